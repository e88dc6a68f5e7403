//! Quick fixes: what diagnostics offer as changes, and a few that follow from their place.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, params};
use impasto_compiler::ast::{self, ItemKind, Stmt, StmtKind};
use impasto_compiler::diag::{Code, Diagnostic};

use super::cursor::cursor;
use super::imports;

/// A change that an author can ask for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Action {
    /// What it does.
    pub title: String,
    /// The ranges that are replaced, and by what.
    pub edits: Vec<(Range<usize>, String)>,
    /// The place in [`Analysis::diagnostics`] of what it repairs; nothing of what is only convenient.
    pub repairs: Option<usize>,
}

/// What can be done about the bytes `range`.
pub fn actions(analysis: &Analysis, range: Range<usize>) -> Vec<Action> {
    let (Some(file), Some(ast)) = (analysis.file(), analysis.ast()) else {
        return Vec::new();
    };
    let text = &analysis.sources.file(file).text;
    let mut actions = Vec::new();
    for (index, diagnostic) in analysis.diagnostics.iter().enumerate() {
        let touches = diagnostic.span.is_some_and(|span| {
            let (start, end) = (span.start as usize, span.end as usize);
            span.file == file && start <= range.end && range.start <= end
        });
        if !touches {
            continue;
        }
        let of_it = fixes(ast, text, diagnostic).into_iter();
        actions.extend(of_it.map(|(title, edits)| Action {
            title,
            edits,
            repairs: Some(index),
        }));
    }
    actions.extend(arguments(analysis, text, range.start));
    actions.extend(output(analysis, text, range.start));
    actions
}

type Change = (String, Vec<(Range<usize>, String)>);

fn fixes(ast: &ast::Module, text: &str, diagnostic: &Diagnostic) -> Vec<Change> {
    let mut found = Vec::new();
    for fix in &diagnostic.fixes {
        let range = fix.span.range();
        let is_meant = match (&fix.was, text.get(range.clone())) {
            (_, None) => false,
            (Some(was), Some(there)) => was == there,
            (None, Some(_)) => true,
        };
        if !is_meant {
            continue;
        }
        let imports = fix
            .imports
            .iter()
            .filter_map(|path| imports::added(ast, text, path));
        let mut edits: Vec<(Range<usize>, String)> = imports.collect();
        if !(range.is_empty() && fix.text.is_empty()) {
            edits.push((range, fix.text.clone()));
        }
        if !edits.is_empty() {
            found.push((fix.title.clone(), edits));
        }
    }
    if diagnostic.code == Code::Unused
        && let Some(span) = diagnostic.span
    {
        found.splice(0..0, unused(ast, text, span.start as usize));
    }
    found
}

/// Takes an unused name out: an import, a statement, a definition.
fn unused(ast: &ast::Module, text: &str, at: usize) -> Option<Change> {
    if let Some(range) = imports::removed(ast, text, at) {
        return Some(("remove the import".into(), vec![(range, String::new())]));
    }
    if let Some(item) = ast.items.iter().find(|i| i.name.span.start as usize == at) {
        let range = lines(text, with_docs(text, item.span.range()));
        let title = format!("remove `{}`", item.name.node);
        return Some((title, vec![(range, String::new())]));
    }
    let is_it = |stmt: &Stmt| matches!(&stmt.kind, StmtKind::Let { name, .. } if name.span.start as usize == at);
    let stmt = statements(ast).into_iter().find(|s| is_it(s))?;
    let StmtKind::Let { name, .. } = &stmt.kind else {
        return None;
    };
    let title = format!("remove `{}`", name.node);
    Some((title, vec![(lines(text, stmt.span.range()), String::new())]))
}

/// All statements of a file, those in blocks of statements included.
fn statements(ast: &ast::Module) -> Vec<&Stmt> {
    fn within<'a>(stmts: &'a [Stmt], all: &mut Vec<&'a Stmt>) {
        for stmt in stmts {
            all.push(stmt);
            match &stmt.kind {
                StmtKind::If(branch) => {
                    within(&branch.then.stmts, all);
                    let otherwise = branch.otherwise.iter();
                    otherwise.for_each(|block| within(&block.stmts, all));
                }
                StmtKind::For { body, .. } | StmtKind::While { body, .. } => {
                    within(&body.stmts, all);
                }
                _ => {}
            }
        }
    }
    let mut all = Vec::new();
    for item in &ast.items {
        match &item.kind {
            ItemKind::Material(m) => within(&m.body, &mut all),
            ItemKind::Closure(c) => {
                within(&c.lets, &mut all);
                for method in &c.methods {
                    if let ast::Body::Block(block) = &method.body {
                        within(&block.stmts, &mut all);
                    }
                }
            }
            ItemKind::Function(f) => {
                if let ast::Body::Block(block) = &f.body {
                    within(&block.stmts, &mut all);
                }
            }
            ItemKind::Struct(_) | ItemKind::Const(_) => {}
        }
    }
    all
}

/// A range with the documentation lines before it.
fn with_docs(text: &str, range: Range<usize>) -> Range<usize> {
    let mut start = range.start;
    while let Some(line) = text[..start]
        .trim_end_matches([' ', '\t'])
        .strip_suffix('\n')
    {
        let from = line.rfind('\n').map_or(0, |n| n + 1);
        if !line[from..].trim_start().starts_with("///") {
            break;
        }
        start = from;
    }
    start..range.end
}

/// A range as whole lines, if nothing else is on them.
fn lines(text: &str, range: Range<usize>) -> Range<usize> {
    let before = text[..range.start].rfind('\n').map_or(0, |n| n + 1);
    let after = text[range.end..]
        .find('\n')
        .map_or(text.len(), |n| range.end + n + 1);
    let alone =
        text[before..range.start].trim().is_empty() && text[range.end..after].trim().is_empty();
    if alone { before..after } else { range }
}

/// Offers to write the arguments that a call lacks.
fn arguments(analysis: &Analysis, text: &str, at: usize) -> Option<Action> {
    let (index, _) = analysis.diagnostics.iter().enumerate().find(|(_, d)| {
        let here = d
            .span
            .is_some_and(|s| s.start as usize <= at && at <= s.end as usize);
        d.code == Code::MissingArgument && here
    })?;
    let span = analysis.diagnostics[index].span?;
    let open = text[span.end as usize..].find('(')? + span.end as usize + 1;
    let cursor = cursor(text, open);
    let call = cursor.calls.first()?;
    let item = analysis.lookup(analysis.module?, &call.callee)?;
    let close = closing(text, open)?;
    let inside = &text[open..close];
    let given = self::cursor(text, close);
    let call = given.calls.first()?;
    let count = if inside.trim().is_empty() {
        0
    } else {
        call.position + 1
    };
    let all = params(analysis.item(item));
    let missing = all.iter().enumerate().filter(|(i, p)| {
        let by_place = *i + call.given.len() < count;
        p.default.is_none() && !by_place && !call.given.contains(&p.name.node)
    });
    let new: Vec<String> = missing
        .map(|(_, p)| format!("{}: {}", p.name.node, placeholder(&p.ty.node)))
        .collect();
    if new.is_empty() {
        return None;
    }
    let comma = if count == 0 || inside.trim_end().ends_with(',') {
        ""
    } else {
        ", "
    };
    let end = open + inside.trim_end().len();
    Some(Action {
        title: format!("add {}", new.join(", ")),
        edits: vec![(end..end, format!("{comma}{}", new.join(", ")))],
        repairs: Some(index),
    })
}

/// A value of a type, to begin with.
fn placeholder(ty: &str) -> &'static str {
    match ty {
        "bool" => "false",
        "int" => "0",
        "uint" => "0u",
        "length" => "1 cm",
        "angle" => "0 deg",
        "color" => "color(0.5, 0.5, 0.5)",
        "vec2" => "vec2(0.0, 0.0)",
        "vec3" | "point" | "vector" | "normal" => "vec3(0.0, 0.0, 1.0)",
        _ => "0.5",
    }
}

/// The bracket that closes what is open before a byte.
fn closing(text: &str, from: usize) -> Option<usize> {
    let mut depth = 0;
    for (at, c) in text[from..].char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' if depth == 0 => return Some(from + at),
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
    }
    None
}

/// Offers to give a material the surface that it lacks.
fn output(analysis: &Analysis, text: &str, at: usize) -> Option<Action> {
    let (_, item) = analysis.item_at(at as u32)?;
    let lacking = |d: &Diagnostic| {
        d.code == Code::MissingOutput
            && d.span
                .is_some_and(|s| item.span.range().contains(&(s.start as usize)))
    };
    let index = analysis.diagnostics.iter().position(lacking)?;
    let end = item.span.end as usize - 1;
    let is_empty = text[..end].trim_end().ends_with('{');
    let ends_line = text[..end].ends_with('\n');
    let line = match (is_empty, ends_line) {
        (_, true) => "    surface = diffuse(0.5);\n",
        (true, false) => "\n    surface = diffuse(0.5);\n",
        (false, false) => " surface = diffuse(0.5); ",
    };
    let mut edits: Vec<(Range<usize>, String)> =
        imports::added(analysis.ast()?, text, "std::bsdf::diffuse")
            .into_iter()
            .collect();
    edits.push((end..end, line.to_owned()));
    Some(Action {
        title: "assign a matte surface".into(),
        edits,
        repairs: Some(index),
    })
}
