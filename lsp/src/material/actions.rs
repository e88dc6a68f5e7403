//! Quick fixes: what diagnostics offer as changes, and a few that follow from their place.

use std::ops::Range;

use impasto_compiler::analysis::{Analysis, params};
use impasto_compiler::ast::{self, ItemKind, Stmt, StmtKind};
use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::lexer::Token;
use impasto_compiler::source::{FileId, Span};

use super::cursor::{self, Tokens};
use super::imports;
use crate::documents;

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
        let of_it = fixes(ast, text, file, diagnostic).into_iter();
        actions.extend(of_it.map(|(title, edits)| Action {
            title,
            edits,
            repairs: Some(index),
        }));
    }
    actions.extend(arguments(analysis, file, text, range.start));
    actions.extend(output(analysis, file, text, range.start));
    for action in &mut actions {
        action.title = shortened(&action.title);
    }
    actions
}

/// A title in one line of a menu: what is written may be an expression over several.
fn shortened(title: &str) -> String {
    const MOST: usize = 80;
    let line = title.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line,
    }
}

type Change = (String, Vec<(Range<usize>, String)>);

fn fixes(ast: &ast::Module, text: &str, file: FileId, diagnostic: &Diagnostic) -> Vec<Change> {
    let mut found = Vec::new();
    for fix in diagnostic.fixes.iter().filter(|f| f.span.file == file) {
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
            edits.push((range.clone(), on_its_line(text, &range, &fix.text)));
        }
        if !edits.is_empty() {
            found.push((fix.title.clone(), edits));
        }
    }
    if diagnostic.code == Code::Unused
        && let Some(span) = diagnostic.span
        && span.file == file
    {
        found.splice(0..0, unused(ast, text, span.start as usize));
    }
    found
}

/// The brace that closes a block stands on a line of its own.
fn on_its_line(text: &str, range: &Range<usize>, new: &str) -> String {
    let before = text.get(..range.start).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    let is_last = text
        .get(range.end..)
        .is_some_and(|rest| rest.trim().is_empty());
    let is_apart = new == "}" && is_last && !line.trim().is_empty() && before.contains('\n');
    if is_apart {
        format!("\n{new}")
    } else {
        new.to_owned()
    }
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
    while let Some(before) = text.get(..start)
        && let Some(line) = before.trim_end_matches([' ', '\t']).strip_suffix('\n')
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
    let (Some(before), Some(after)) = (text.get(..range.start), text.get(range.end..)) else {
        return range;
    };
    let start = before.rfind('\n').map_or(0, |n| n + 1);
    let end = after.find('\n').map_or(after.len(), |n| n + 1);
    let alone = before[start..].trim().is_empty() && after[..end].trim().is_empty();
    if alone { start..range.end + end } else { range }
}

/// Offers to write the arguments that a call lacks.
fn arguments(analysis: &Analysis, file: FileId, text: &str, at: usize) -> Option<Action> {
    let is_lacking = |d: &Diagnostic| {
        let touches = |s: Span| s.file == file && s.start as usize <= at && at <= s.end as usize;
        d.code == Code::MissingArgument && d.span.is_some_and(touches)
    };
    let index = analysis.diagnostics.iter().position(is_lacking)?;
    let callee = analysis.diagnostics[index].span?;
    let tokens = cursor::tokens(text);
    let open = tokens.partition_point(|(_, r)| r.start < callee.end as usize);
    let close = closing(&tokens, open)?;
    let given = cursor::cursor(text, tokens[close].1.start);
    let call = given.calls.first()?;
    let item = analysis.lookup(analysis.module?, &call.callee)?;
    // Behind the last argument, before a comma that ends the list.
    let inside = &tokens[open + 1..close];
    let last = inside.iter().rfind(|(token, _)| *token != Token::Comma);
    let ends_list = inside
        .last()
        .is_some_and(|(token, _)| *token == Token::Comma);
    let count = call.by_place() + usize::from(last.is_some() && !ends_list);
    let by_name = call.given.iter();
    let by_place = count - usize::from(call.named.is_some());
    let all = params(analysis.item(item));
    let missing = all.iter().skip(by_place);
    let missing = missing
        .filter(|p| p.default.is_none() && !by_name.clone().any(|given| *given == p.name.node));
    let new: Vec<String> = missing
        .map(|p| format!("{}: {}", p.name.node, placeholder(&p.ty.node)))
        .collect();
    if new.is_empty() {
        return None;
    }
    let new = new.join(", ");
    let (end, comma) = match last {
        Some((_, range)) => (range.end, ", "),
        None => (tokens[open].1.end, ""),
    };
    Some(Action {
        title: format!("add {new}"),
        edits: vec![(end..end, format!("{comma}{new}"))],
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

/// The bracket that closes the one at a place among the tokens.
fn closing(tokens: &Tokens, open: usize) -> Option<usize> {
    let mut depth = 0usize;
    for (index, (token, _)) in tokens.iter().enumerate().skip(open) {
        match token {
            Token::LeftParen | Token::LeftBracket | Token::LeftBrace => depth += 1,
            Token::RightParen | Token::RightBracket | Token::RightBrace => {
                depth = depth.checked_sub(1)?;
            }
            _ => {}
        }
        if depth == 0 {
            return Some(index).filter(|_| index > open);
        }
    }
    None
}

/// Offers to give a material the surface that it lacks.
fn output(analysis: &Analysis, file: FileId, text: &str, at: usize) -> Option<Action> {
    // Where the syntax is wrong, it may be there.
    if documents::has_syntax_errors(analysis) {
        return None;
    }
    let (_, item) = analysis.item_at(at as u32)?;
    let lacks = |s: Span| s.file == file && item.span.range().contains(&(s.start as usize));
    let is_lacking = |d: &Diagnostic| d.code == Code::MissingOutput && d.span.is_some_and(lacks);
    let index = analysis.diagnostics.iter().position(is_lacking)?;
    let inside = text.get(item.span.range())?.strip_suffix('}')?;
    let end = item.span.start as usize + inside.len();
    let is_empty = inside.trim_end().ends_with('{');
    let line = match (is_empty, inside.ends_with('\n')) {
        (_, true) => "    surface = diffuse(0.5);\n",
        (true, false) => "\n    surface = diffuse(0.5);\n",
        (false, false) => " surface = diffuse(0.5); ",
    };
    let import = imports::added(analysis.ast()?, text, "std::bsdf::diffuse");
    let mut edits: Vec<(Range<usize>, String)> = import.into_iter().collect();
    edits.push((end..end, line.to_owned()));
    Some(Action {
        title: "assign a matte surface".into(),
        edits,
        repairs: Some(index),
    })
}
