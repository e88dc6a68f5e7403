//! The IR as text, for `impasto emit --what ir`, for snapshots and for the tests of passes.
//!
//! One evaluated expression a line, `%id: type = what`; free expressions (constants, parameters)
//! stand where they are used. Expressions are numbered in the order in which they are evaluated,
//! whatever their place in the arena is, so that equal code gives equal text.
//!
//! [`super::parse`] reads the text back, and printing what it read gives the same text.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{Block, Const, ExprId, ExprKind, Function, Local, Module, Stmt, Type};

mod material;
mod module;

pub use material::material;
pub use module::{module, reachable};

/// A function as text.
pub fn function(module: &Module, f: &Function) -> String {
    named_function(&Names::of(module), f, &f.name)
}

/// A function as text, under a name.
fn named_function(names: &Names<'_>, f: &Function, name: &str) -> String {
    let printer = Printer::new(names, f);
    let mut out = format!("fn {name}({}) -> ", printer.signature());
    let _ = write!(out, "{}", names.ty(f.result));
    if f.turns > 1 {
        let _ = write!(out, " turns {}", f.turns);
    }
    out.push_str(" {\n");
    let (params, table) = outside(f);
    for (i, ty) in params {
        let _ = writeln!(out, "    uniform ${i}: {}", names.ty(ty));
    }
    for (i, ty) in table {
        let _ = writeln!(out, "    table #{i}: {}", names.ty(ty));
    }
    printer.body(&mut out);
    let _ = writeln!(out, "    return {}\n}}", printer.operand(f.value));
    out
}

/// The parameters of its material, and the values of the table, that a function mentions, with
/// their types.
fn outside(f: &Function) -> (BTreeMap<u32, Type>, BTreeMap<u32, Type>) {
    let (mut params, mut table) = (BTreeMap::new(), BTreeMap::new());
    for e in &f.exprs {
        match e.kind {
            ExprKind::MaterialParam(i) => drop(params.insert(i, e.ty)),
            ExprKind::TableValue(i) => drop(table.insert(i, e.ty)),
            _ => {}
        }
    }
    (params, table)
}

/// A constant as text. Floats have a point or an exponent, ints do not; every digit is there.
pub fn constant(c: &Const) -> String {
    match c {
        Const::Bool(b) => b.to_string(),
        Const::Int(i) => i.to_string(),
        Const::Float(v) => match v.as_slice() {
            [x] => format!("{x:?}"),
            parts => {
                let parts: Vec<String> = parts.iter().map(|x| format!("{x:?}")).collect();
                format!("({})", parts.join(", "))
            }
        },
    }
}

/// What the structs, functions and closures of a module are called in text: their own names,
/// numbered (`fade#2`) where several have one name.
struct Names<'a> {
    module: &'a Module,
    structs: Vec<String>,
    functions: Vec<String>,
    closures: Vec<String>,
}

impl<'a> Names<'a> {
    fn of(module: &'a Module) -> Self {
        Self {
            module,
            structs: unique(module.structs.iter().map(|s| &s.name)),
            functions: unique(module.functions.iter().map(|f| &f.name)),
            closures: unique(module.closures.iter().map(|c| &c.name)),
        }
    }

    fn ty(&self, ty: Type) -> String {
        match ty {
            Type::Struct(id) => or_unknown(self.structs.get(id.index())),
            other => format!("{other:?}").to_lowercase(),
        }
    }

    fn locals(&self, locals: &[Local]) -> String {
        let names = unique(locals.iter().map(|l| &l.name));
        let one = |(name, local): (&String, &Local)| format!("{name}: {}", self.ty(local.ty));
        let all: Vec<String> = names.iter().zip(locals).map(one).collect();
        all.join(", ")
    }
}

/// Names that differ, each the given one if no earlier one is equal to it.
fn unique<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut count: BTreeMap<String, u32> = BTreeMap::new();
    let mut out = Vec::new();
    for name in names {
        let mut candidate = name.clone();
        while count.contains_key(&candidate) {
            let n = count.entry(name.clone()).or_insert(1);
            *n += 1;
            candidate = format!("{name}#{n}");
        }
        count.insert(candidate.clone(), 1);
        out.push(candidate);
    }
    out
}

/// What stands for something that a broken function refers to and that is not there.
fn or_unknown(name: Option<&String>) -> String {
    name.map_or_else(|| "?".to_owned(), String::clone)
}

/// The numbers of expressions in text: those that are evaluated, in that order.
pub fn numbers(f: &Function) -> Vec<Option<u32>> {
    fn walk(block: &Block, next: &mut u32, out: &mut [Option<u32>]) {
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => {
                    if let Some(slot @ None) = out.get_mut(id.index()) {
                        *slot = Some(*next);
                        *next += 1;
                    }
                }
                Stmt::If(_, a, b) => {
                    walk(a, next, out);
                    walk(b, next, out);
                }
                Stmt::For { body, .. } => walk(body, next, out),
                Stmt::While { head, body, .. } => {
                    walk(head, next, out);
                    walk(body, next, out);
                }
                Stmt::Store(..) | Stmt::Break | Stmt::Continue => {}
            }
        }
    }
    let mut out = vec![None; f.exprs.len()];
    walk(&f.body, &mut 0, &mut out);
    out
}

/// An expression where it is used, for messages: `%3`, a constant or a parameter.
pub fn operand(module: &Module, f: &Function, id: ExprId) -> String {
    Printer::new(&Names::of(module), f).operand(id)
}

struct Printer<'a> {
    names: &'a Names<'a>,
    f: &'a Function,
    params: Vec<String>,
    numbers: Vec<Option<u32>>,
}

impl<'a> Printer<'a> {
    fn new(names: &'a Names<'a>, f: &'a Function) -> Self {
        Self {
            names,
            f,
            params: unique(f.params.iter().map(|p| &p.name)),
            numbers: numbers(f),
        }
    }

    fn signature(&self) -> String {
        self.names.locals(&self.f.params)
    }

    fn body(&self, out: &mut String) {
        for (i, local) in self.f.locals.iter().enumerate() {
            let (name, ty) = (self.local(i), self.names.ty(local.ty));
            let _ = writeln!(out, "    var {name}: {ty}");
        }
        self.block(out, &self.f.body, 1);
    }

    fn local(&self, index: usize) -> String {
        match self.f.locals.get(index) {
            Some(local) => format!("@{index}.{}", local.name),
            None => format!("@{index}.?"),
        }
    }

    fn block(&self, out: &mut String, block: &Block, depth: usize) {
        block.iter().for_each(|stmt| self.stmt(out, stmt, depth));
    }

    fn stmt(&self, out: &mut String, stmt: &Stmt, depth: usize) {
        let pad = "    ".repeat(depth);
        let _ = match stmt {
            Stmt::Eval(id) => writeln!(out, "{pad}{}", self.eval(*id)),
            Stmt::Store(local, part, value) => {
                let part = part.map_or(String::new(), |p| format!(".{}", letter(p)));
                let (place, value) = (self.local(local.index()), self.operand(*value));
                writeln!(out, "{pad}{place}{part} = {value}")
            }
            Stmt::If(cond, then, otherwise) => {
                let _ = writeln!(out, "{pad}if {} {{", self.operand(*cond));
                self.block(out, then, depth + 1);
                if !otherwise.is_empty() {
                    let _ = writeln!(out, "{pad}}} else {{");
                    self.block(out, otherwise, depth + 1);
                }
                writeln!(out, "{pad}}}")
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let (low, high) = (self.operand(*low), self.operand(*high));
                let local = self.local(local.index());
                let _ = writeln!(out, "{pad}for {local} in {low} .. {high} {{");
                self.block(out, body, depth + 1);
                writeln!(out, "{pad}}}")
            }
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => {
                let _ = writeln!(out, "{pad}loop limit {limit} {{");
                self.block(out, head, depth + 1);
                let _ = writeln!(out, "{pad}}} while {} {{", self.operand(*test));
                self.block(out, body, depth + 1);
                writeln!(out, "{pad}}}")
            }
            Stmt::Break => writeln!(out, "{pad}break"),
            Stmt::Continue => writeln!(out, "{pad}continue"),
        };
    }

    /// `%3 name: type = what`
    fn eval(&self, id: ExprId) -> String {
        let Some(e) = self.f.exprs.get(id.index()) else {
            return self.operand(id);
        };
        let name = e.name.as_ref().map_or(String::new(), |n| format!(" {n}"));
        let (place, ty) = (self.place(id), self.names.ty(e.ty));
        format!("{place}{name}: {ty} = {}", self.value(id))
    }

    /// The number of an expression; one that is never evaluated shows its place in the arena.
    fn place(&self, id: ExprId) -> String {
        match self.numbers.get(id.index()) {
            Some(Some(number)) => format!("%{number}"),
            _ => format!("%?{}", id.0),
        }
    }

    fn operand(&self, id: ExprId) -> String {
        match self.f.exprs.get(id.index()) {
            Some(e) if e.kind.is_free() => self.value(id),
            _ => self.place(id),
        }
    }

    fn operands(&self, ids: &[ExprId]) -> String {
        let all: Vec<String> = ids.iter().map(|&a| self.operand(a)).collect();
        all.join(", ")
    }

    /// An operand in front of a point; one that is a number gets parentheses.
    fn base(&self, id: ExprId) -> String {
        match self.f.exprs.get(id.index()).map(|e| &e.kind) {
            Some(ExprKind::Const(Const::Float(v))) if v.len() == 1 => {
                format!("({})", self.operand(id))
            }
            _ => self.operand(id),
        }
    }

    fn value(&self, id: ExprId) -> String {
        let e = self.f.expr(id);
        match &e.kind {
            ExprKind::Const(c) => constant(c),
            ExprKind::Param(i) => or_unknown(self.params.get(*i as usize)),
            ExprKind::MaterialParam(i) => format!("${i}"),
            ExprKind::TableValue(i) => format!("#{i}"),
            ExprKind::Load(local) => format!("load {}", self.local(local.index())),
            ExprKind::Op(op, args) => format!("{} {}", op.info().text, self.operands(args)),
            ExprKind::Compose(args) => format!("{}({})", self.names.ty(e.ty), self.operands(args)),
            ExprKind::Swizzle(v, components) => {
                let letters: String = components.iter().map(|&c| letter(c)).collect();
                format!("{}.{letters}", self.base(*v))
            }
            ExprKind::Call(callee, args) => {
                let callee = or_unknown(self.names.functions.get(callee.index()));
                format!("call {callee}({})", self.operands(args))
            }
            ExprKind::Make(s, args) => {
                let ty = self.names.ty(Type::Struct(*s));
                format!("{ty} {{ {} }}", self.operands(args))
            }
            ExprKind::Field(v, i) => format!("{}.{}", self.base(*v), self.field(*v, *i)),
        }
    }

    fn field(&self, value: ExprId, index: u32) -> String {
        let ty = self.f.exprs.get(value.index()).map(|e| e.ty);
        let Some(Type::Struct(id)) = ty else {
            return "?".into();
        };
        let fields = self.names.module.structs.get(id.index()).map(|s| &s.fields);
        or_unknown(fields.and_then(|f| f.get(index as usize)).map(|f| &f.0))
    }
}

fn letter(component: u8) -> char {
    ['x', 'y', 'z', 'w'][usize::from(component) & 3]
}
