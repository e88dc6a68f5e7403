//! The structure of a source: its definitions, what folds, and what encloses what.

use std::ops::Range;

use impasto_compiler::analysis::params;
use impasto_compiler::ast::{
    self, Arg, Block, Body, ClosureKind, Expr, ExprKind, IfExpr, Item, ItemKind, Stmt, StmtKind,
};
use impasto_compiler::lexer::Token;
use impasto_compiler::source::Span;

use super::cursor::{self, Tokens};

/// A definition with what is defined in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// What it is, in a word or with its type.
    pub detail: String,
    /// What it is.
    pub kind: EntryKind,
    /// All of it.
    pub whole: Range<usize>,
    /// Its name.
    pub place: Range<usize>,
    /// What is defined in it.
    pub children: Vec<Entry>,
}

/// Kinds of entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum EntryKind {
    Material,
    Closure,
    Function,
    Struct,
    Constant,
    Parameter,
    Variable,
    Output,
    Method,
    Field,
    Test,
}

/// The definitions and tests of a file.
pub fn outline(ast: &ast::Module) -> Vec<Entry> {
    let tests = ast.tests.iter().map(test);
    let mut all: Vec<Entry> = ast.items.iter().map(entry).chain(tests).collect();
    all.sort_by_key(|entry| entry.whole.start);
    all
}

fn test(test: &ast::Test) -> Entry {
    Entry {
        whole: test.span.range(),
        ..leaf(&test.title, "test", EntryKind::Test, test.span)
    }
}

fn entry(item: &Item) -> Entry {
    let (kind, detail) = match &item.kind {
        ItemKind::Material(_) => (EntryKind::Material, "material".to_owned()),
        ItemKind::Closure(c) => {
            let word = match c.kind {
                ClosureKind::Bsdf => "bsdf",
                ClosureKind::DeltaBsdf => "delta bsdf",
                ClosureKind::Edf => "edf",
            };
            (EntryKind::Closure, word.to_owned())
        }
        ItemKind::Function(f) => (EntryKind::Function, format!("-> {}", f.result.node)),
        ItemKind::Struct(_) => (EntryKind::Struct, "struct".to_owned()),
        ItemKind::Const(c) => (EntryKind::Constant, c.ty.node.clone()),
    };
    let mut children = Vec::new();
    if let ItemKind::Material(_) = item.kind {
        children.extend(params(item).into_iter().map(|p| {
            let whole = p.of_material.map_or(p.name.span, |m| m.span);
            leaf(p.name, &p.ty.node, EntryKind::Parameter, whole)
        }));
    }
    match &item.kind {
        ItemKind::Material(m) => children.extend(m.body.iter().filter_map(statement)),
        ItemKind::Closure(c) => {
            children.extend(c.lets.iter().filter_map(statement));
            let methods = c.methods.iter();
            children.extend(methods.map(|m| leaf(&m.name, "", EntryKind::Method, m.span)));
        }
        ItemKind::Struct(fields) => {
            let fields = fields.iter();
            children.extend(fields.map(|f| {
                leaf(
                    &f.name,
                    &f.ty.node,
                    EntryKind::Field,
                    f.name.span.to(f.ty.span),
                )
            }));
        }
        ItemKind::Function(_) | ItemKind::Const(_) => {}
    }
    Entry {
        name: item.name.node.clone(),
        detail,
        kind,
        whole: item.span.range(),
        place: item.name.span.range(),
        children,
    }
}

fn leaf(name: &ast::Name, detail: &str, kind: EntryKind, whole: Span) -> Entry {
    Entry {
        name: name.node.clone(),
        detail: detail.to_owned(),
        kind,
        whole: whole.to(name.span).range(),
        place: name.span.range(),
        children: Vec::new(),
    }
}

fn statement(stmt: &Stmt) -> Option<Entry> {
    match &stmt.kind {
        StmtKind::Let { name, .. } => Some(leaf(name, "", EntryKind::Variable, stmt.span)),
        StmtKind::Assign { place, .. } => match &place.kind {
            ExprKind::Name(name) if impasto_compiler::sema::words::is_output(name) => Some(Entry {
                name: name.clone(),
                detail: String::new(),
                kind: EntryKind::Output,
                whole: stmt.span.range(),
                place: place.span.range(),
                children: Vec::new(),
            }),
            _ => None,
        },
        _ => None,
    }
}

/// What folds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FoldKind {
    Block,
    Comment,
    Imports,
}

/// The parts of a text that fold, by bytes: what stays visible is the line that they begin in.
pub fn folds(text: &str) -> Vec<(Range<usize>, FoldKind)> {
    let mut folds = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    for (token, range) in cursor::tokens(text) {
        match token {
            Token::LeftBrace | Token::LeftParen | Token::LeftBracket => open.push(range.start),
            Token::RightBrace | Token::RightParen | Token::RightBracket => {
                if let Some(start) = open.pop() {
                    folds.push((start..range.end, FoldKind::Block));
                }
            }
            _ => {}
        }
    }
    folds.extend(runs(text, |line| line.starts_with("//"), FoldKind::Comment));
    folds.extend(runs(
        text,
        |line| line.starts_with("use "),
        FoldKind::Imports,
    ));
    let is_long = |range: &Range<usize>| text[range.clone()].contains('\n');
    folds.retain(|(range, _)| is_long(range));
    folds.sort_by_key(|(range, _)| (range.start, std::cmp::Reverse(range.end)));
    folds
}

/// Runs of lines of some kind.
fn runs(text: &str, is_it: impl Fn(&str) -> bool, kind: FoldKind) -> Vec<(Range<usize>, FoldKind)> {
    let (mut found, mut run, mut at) = (Vec::new(), None::<Range<usize>>, 0);
    for line in text.split_inclusive('\n') {
        let end = at + line.trim_end_matches(['\n', '\r']).len();
        if is_it(line.trim_start()) {
            let start = run.map_or(at, |r| r.start);
            run = Some(start..end);
        } else {
            found.extend(run.take().map(|r| (r, kind)));
        }
        at += line.len();
    }
    found.extend(run.map(|r| (r, kind)));
    found
}

/// What encloses byte `at`, innermost first: the word, expressions, statements, definitions, the text.
pub fn around(ast: &ast::Module, text: &str, at: usize) -> Vec<Range<usize>> {
    let mut walk = Walk {
        at: at as u32,
        found: Vec::new(),
    };
    for import in &ast.uses {
        walk.span(import.span);
    }
    ast.items.iter().for_each(|item| walk.item(item));
    let tokens = cursor::tokens(text);
    let touching = tokens.iter().rfind(|(_, r)| r.start <= at && at <= r.end);
    let mut found = walk.found;
    if let Some((token, range)) = touching {
        found.push(range.clone());
        let inside = range.start + 1..range.end.saturating_sub(1);
        if *token == Token::Str && inside.start <= at && at <= inside.end {
            found.push(inside);
        }
    }
    found.extend(cursor::comment(text, &tokens, at));
    found.extend(brackets(&tokens, at));
    found.push(0..text.len());
    found.sort_by_key(|r| (r.len(), r.start));
    found.dedup();
    // Each must enclose the one before.
    let mut nested: Vec<Range<usize>> = Vec::new();
    for range in found {
        let encloses = |inner: &Range<usize>| range.start <= inner.start && inner.end <= range.end;
        if nested.last().is_none_or(encloses) {
            nested.push(range);
        }
    }
    nested
}

/// The brackets around a byte, and what is in each pair of them.
fn brackets(tokens: &Tokens, at: usize) -> Vec<Range<usize>> {
    let (mut open, mut found) = (Vec::new(), Vec::new());
    for (index, (token, range)) in tokens.iter().enumerate() {
        match token {
            Token::LeftBrace | Token::LeftParen | Token::LeftBracket => open.push(index),
            Token::RightBrace | Token::RightParen | Token::RightBracket => {
                let Some(first) = open.pop() else { continue };
                let whole = tokens[first].1.start..range.end;
                let is_around = whole.start < at && at < whole.end;
                if !is_around || first + 1 == index {
                    continue;
                }
                let inside = tokens[first + 1].1.start..tokens[index - 1].1.end;
                if inside.start <= at && at <= inside.end {
                    found.push(inside);
                }
                found.push(whole);
            }
            _ => {}
        }
    }
    found
}

/// Collects what is around a byte.
struct Walk {
    at: u32,
    found: Vec<Range<usize>>,
}

impl Walk {
    fn span(&mut self, span: Span) {
        if span.start <= self.at && self.at <= span.end {
            self.found.push(span.range());
        }
    }

    fn item(&mut self, item: &Item) {
        self.span(item.span);
        for p in params(item) {
            p.of_material.iter().for_each(|m| self.span(m.span));
            self.span(p.name.span.to(p.ty.span));
            p.default.iter().for_each(|d| self.expr(d));
        }
        match &item.kind {
            ItemKind::Material(m) => self.stmts(&m.body),
            ItemKind::Closure(c) => {
                self.stmts(&c.lets);
                for method in &c.methods {
                    self.span(method.span);
                    self.body(&method.body);
                }
            }
            ItemKind::Function(f) => self.body(&f.body),
            ItemKind::Const(c) => self.expr(&c.value),
            ItemKind::Struct(_) => {}
        }
    }

    fn body(&mut self, body: &Body) {
        match body {
            Body::Expr { value, when } => {
                self.expr(value);
                when.iter().for_each(|w| self.expr(w));
            }
            Body::Block(block) => self.block(block),
        }
    }

    fn block(&mut self, block: &Block) {
        self.span(block.span);
        self.stmts(&block.stmts);
        block.value.iter().for_each(|v| self.expr(v));
    }

    fn stmts(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            self.span(stmt.span);
            match &stmt.kind {
                StmtKind::Let { value, .. } => self.expr(value),
                StmtKind::Assign { place, value, .. } => {
                    self.expr(place);
                    self.expr(value);
                }
                StmtKind::If(branch) => self.branch(branch),
                StmtKind::For {
                    low, high, body, ..
                } => {
                    self.expr(low);
                    self.expr(high);
                    self.block(body);
                }
                StmtKind::While { cond, limit, body } => {
                    self.expr(cond);
                    limit.iter().for_each(|l| self.expr(l));
                    self.block(body);
                }
                StmtKind::Assert(condition) => self.expr(condition),
                StmtKind::Break | StmtKind::Continue => {}
            }
        }
    }

    fn branch(&mut self, branch: &IfExpr) {
        self.expr(&branch.cond);
        self.block(&branch.then);
        branch.otherwise.iter().for_each(|b| self.block(b));
    }

    fn expr(&mut self, expr: &Expr) {
        self.span(expr.span);
        match &expr.kind {
            ExprKind::Call { args, .. } => args.iter().for_each(|Arg { name, value }| {
                name.iter().for_each(|n| self.span(n.span.to(value.span)));
                self.expr(value);
            }),
            ExprKind::Field(base, _) | ExprKind::Unary(_, base) => self.expr(base),
            ExprKind::Array(all) => all.iter().for_each(|e| self.expr(e)),
            ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::If(branch) => self.branch(branch),
            ExprKind::Block(block) => self.block(block),
            _ => {}
        }
    }
}
