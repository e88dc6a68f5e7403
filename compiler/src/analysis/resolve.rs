//! What each name of a file stands for, from its syntax tree alone.
//!
//! Scopes follow those of the checker (`sema/body.rs`, `sema/call.rs`): a name of a value is looked for among
//! locals, inputs and definitions in this order, a callee among definitions first.

use std::collections::HashMap;
use std::ops::Range;

use super::{Analysis, ParamRef};
use crate::ast::{
    self, Arg, Block, Body, Expr, ExprKind, IfExpr, Item, ItemKind, Name, Stmt, StmtKind, TypeName,
};
use crate::sema::{ItemRef, ModuleId, words};
use crate::source::Span;

/// A name in a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Occurrence {
    /// Where it stands.
    pub span: Span,
    /// What it stands for.
    pub symbol: Symbol,
    /// What happens to that.
    pub role: Role,
}

/// What happens to what a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It is defined.
    Define,
    /// It is imported.
    Import,
    /// It is read or called.
    Read,
    /// It is assigned.
    Write,
    /// It is named to give it a value, as a parameter in a call.
    Give,
}

/// What a name stands for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    /// A definition.
    Item(ItemRef),
    /// A parameter of a definition, by its place.
    Param(ItemRef, usize),
    /// A field of a struct, by its place.
    Field(ItemRef, usize),
    /// What a body defines, by its place in [`Analysis::locals`].
    Local(usize),
    /// A file that is imported from.
    File(ModuleId),
    /// A function, input or output of the language.
    BuiltIn(String),
    /// A type of the language, where a type stands.
    Type(String),
}

/// What a body defines.
#[derive(Clone, Debug, PartialEq)]
pub struct Local {
    /// Its name.
    pub name: String,
    /// Where the name is defined.
    pub span: Span,
    /// How.
    pub kind: LocalKind,
    /// The bytes in which it is in scope.
    pub scope: Range<u32>,
}

/// How a body defines a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalKind {
    /// `let`
    Let,
    /// `var`
    Var,
    /// `for name in ..`
    Loop,
    /// An argument of a closure's method.
    Argument,
}

/// The parameters of a definition.
pub fn params(item: &Item) -> Vec<ParamRef<'_>> {
    fn of_function(params: &[ast::Param]) -> Vec<ParamRef<'_>> {
        let params = params.iter().map(|p| ParamRef {
            name: &p.name,
            ty: &p.ty,
            default: p.default.as_ref(),
            of_material: None,
        });
        params.collect()
    }
    match &item.kind {
        ItemKind::Material(m) => {
            let params = m.params.iter().map(|p| ParamRef {
                name: &p.name,
                ty: &p.ty,
                default: Some(&p.default),
                of_material: Some(p),
            });
            params.collect()
        }
        ItemKind::Closure(c) => of_function(&c.params),
        ItemKind::Function(f) => of_function(&f.params),
        ItemKind::Struct(_) | ItemKind::Const(_) => Vec::new(),
    }
}

/// One of the parameters of a definition.
pub fn param(item: &Item, index: usize) -> Option<&Name> {
    match &item.kind {
        ItemKind::Material(m) => Some(&m.params.get(index)?.name),
        ItemKind::Closure(c) => Some(&c.params.get(index)?.name),
        ItemKind::Function(f) => Some(&f.params.get(index)?.name),
        ItemKind::Struct(_) | ItemKind::Const(_) => None,
    }
}

/// Fields that expressions read, by the places of their names: the checker knows their structs.
type Fields = HashMap<Span, (ItemRef, usize)>;

/// Every name of a file, and what its bodies define.
pub fn resolve(
    analysis: &Analysis,
    module: ModuleId,
    fields: &Fields,
) -> (Vec<Occurrence>, Vec<Local>) {
    let mut resolver = Resolver {
        analysis,
        module,
        fields,
        scopes: Vec::new(),
        in_material: false,
        occurrences: Vec::new(),
        locals: Vec::new(),
    };
    let ast = &analysis.modules[module.0].ast;
    ast.uses.iter().for_each(|import| resolver.import(import));
    for (index, item) in ast.items.iter().enumerate() {
        resolver.item(item, ItemRef { module, index });
    }
    resolver.in_material = false;
    for test in &ast.tests {
        resolver.scoped(test.span.end, |r| r.statements(&test.body.stmts));
    }
    let Resolver {
        mut occurrences,
        locals,
        ..
    } = resolver;
    occurrences.sort_by_key(|o| (o.span.start, o.span.end));
    (occurrences, locals)
}

struct Resolver<'a> {
    analysis: &'a Analysis,
    module: ModuleId,
    fields: &'a Fields,
    /// Names in scope, innermost last, and where the innermost scope ends.
    scopes: Vec<Scope>,
    in_material: bool,
    occurrences: Vec<Occurrence>,
    locals: Vec<Local>,
}

/// Names, what they stand for, and whether that is a variable; of two of one name the last.
type Names = HashMap<String, (Symbol, bool)>;

struct Scope {
    names: Names,
    end: u32,
}

impl Resolver<'_> {
    fn note(&mut self, span: Span, symbol: Symbol, role: Role) {
        self.occurrences.push(Occurrence { span, symbol, role });
    }

    fn import(&mut self, import: &ast::Use) {
        let mut from = None;
        for wanted in &import.names {
            let local = wanted.alias.as_ref().unwrap_or(&wanted.name);
            let names = &self.analysis.modules[self.module.0].names;
            let Some(item) = names.get(&local.node).copied() else {
                continue;
            };
            from = Some(item.module);
            self.note(wanted.name.span, Symbol::Item(item), Role::Import);
            if let Some(alias) = &wanted.alias {
                self.note(alias.span, Symbol::Item(item), Role::Import);
            }
        }
        let is_std = import.path.first().is_some_and(|n| n.node == "std");
        if let (Some(module), Some(last), false) = (from, import.path.last(), is_std) {
            self.note(last.span, Symbol::File(module), Role::Import);
        }
    }

    fn item(&mut self, item: &Item, itself: ItemRef) {
        self.note(item.name.span, Symbol::Item(itself), Role::Define);
        self.in_material = matches!(item.kind, ItemKind::Material(_));
        for (index, param) in params(item).into_iter().enumerate() {
            let symbol = Symbol::Param(itself, index);
            self.note(param.name.span, symbol, Role::Define);
            self.type_name(param.ty);
            if let Some(default) = param.default {
                self.expr(default);
            }
            if let Some(p) = param.of_material {
                let ends = p.range.iter().flat_map(|(low, high)| [low, high]);
                ends.for_each(|end| self.expr(end));
                // A unit is a name to the parser, and none that is in scope.
                let entries = p.metadata.iter().filter(|e| e.key.node != "unit");
                for entry in entries {
                    self.expr(&entry.value);
                    entry.high.iter().for_each(|high| self.expr(high));
                }
            }
        }
        let end = item.span.end;
        let of_item = |(index, param): (usize, ParamRef<'_>)| {
            let symbol = Symbol::Param(itself, index);
            (param.name.node.clone(), (symbol, false))
        };
        let names = params(item).into_iter().enumerate().map(of_item).collect();
        self.scopes.push(Scope { names, end });
        match &item.kind {
            ItemKind::Material(m) => self.scoped(end, |r| r.statements(&m.body)),
            ItemKind::Function(f) => {
                self.type_name(&f.result);
                self.body(&f.body, end);
            }
            ItemKind::Closure(c) => {
                let mut shared = Names::new();
                for method in &c.methods {
                    self.scoped(method.span.end, |r| r.method(&c.lets, method, &mut shared));
                }
                if c.methods.is_empty() {
                    self.scoped(end, |r| r.statements(&c.lets));
                }
            }
            ItemKind::Struct(fields) => {
                for (index, field) in fields.iter().enumerate() {
                    self.note(field.name.span, Symbol::Field(itself, index), Role::Define);
                    self.type_name(&field.ty);
                }
            }
            ItemKind::Const(c) => {
                self.type_name(&c.ty);
                self.expr(&c.value);
            }
        }
        self.scopes.pop();
    }

    /// A method with the `let`s before it, which belong to each of the methods. Their names are noted with the first, and
    /// kept in `shared` for the others.
    fn method(&mut self, lets: &[Stmt], method: &ast::Method, shared: &mut Names) {
        if shared.is_empty() {
            self.statements(lets);
            let names = self.scopes.last().map(|scope| scope.names.clone());
            *shared = names.unwrap_or_default();
        } else if let Some(scope) = self.scopes.last_mut() {
            for (symbol, _) in shared.values() {
                if let Symbol::Local(index) = symbol {
                    let local = &mut self.locals[*index];
                    local.scope.end = local.scope.end.max(scope.end);
                }
            }
            scope.names.extend(shared.clone());
        }
        let symbol = Symbol::BuiltIn(method.name.node.clone());
        self.note(method.name.span, symbol, Role::Define);
        for name in &method.args {
            self.define(name, LocalKind::Argument, method.span.start);
        }
        self.body(&method.body, method.span.end);
    }

    fn scoped(&mut self, end: u32, f: impl FnOnce(&mut Self)) {
        let names = Names::new();
        self.scopes.push(Scope { names, end });
        f(self);
        self.scopes.pop();
    }

    fn define(&mut self, name: &Name, kind: LocalKind, from: u32) {
        let symbol = Symbol::Local(self.locals.len());
        self.note(name.span, symbol.clone(), Role::Define);
        if let Some(scope) = self.scopes.last_mut() {
            self.locals.push(Local {
                name: name.node.clone(),
                span: name.span,
                kind,
                scope: from..scope.end.max(from),
            });
            let mutable = kind == LocalKind::Var;
            scope.names.insert(name.node.clone(), (symbol, mutable));
        }
    }

    fn body(&mut self, body: &Body, end: u32) {
        match body {
            Body::Expr { value, when } => self.scoped(end, |r| {
                r.expr(value);
                when.iter().for_each(|cond| r.expr(cond));
            }),
            Body::Block(block) => self.block(block),
        }
    }

    fn block(&mut self, block: &Block) {
        self.scoped(block.span.end, |r| {
            r.statements(&block.stmts);
            if let Some(value) = &block.value {
                r.expr(value);
            }
        });
    }

    fn statements(&mut self, stmts: &[Stmt]) {
        stmts.iter().for_each(|stmt| self.statement(stmt));
    }

    fn statement(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::Let {
                mutable,
                name,
                ty,
                value,
            } => {
                ty.iter().for_each(|ty| self.type_name(ty));
                self.expr(value);
                let kind = if *mutable {
                    LocalKind::Var
                } else {
                    LocalKind::Let
                };
                self.define(name, kind, stmt.span.end);
            }
            StmtKind::Assign { place, value, .. } => {
                self.place(place);
                self.expr(value);
            }
            StmtKind::If(branch) => self.branch(branch),
            StmtKind::For {
                name,
                low,
                high,
                body,
            } => {
                self.expr(low);
                self.expr(high);
                self.scoped(body.span.end, |r| {
                    r.define(name, LocalKind::Loop, body.span.start);
                    r.block(body);
                });
            }
            StmtKind::While { cond, limit, body } => {
                self.expr(cond);
                limit.iter().for_each(|limit| self.expr(limit));
                self.block(body);
            }
            StmtKind::Assert(condition) => self.expr(condition),
            StmtKind::Break | StmtKind::Continue => {}
        }
    }

    /// What is assigned: an output, unless a variable has the name.
    fn place(&mut self, place: &Expr) {
        match &place.kind {
            ExprKind::Name(name) => {
                let local = self.local(name);
                let is_output = self.in_material && words::is_output(name);
                let symbol = match local {
                    Some((symbol, is_variable)) if is_variable || !is_output => symbol,
                    _ if is_output => Symbol::BuiltIn(name.clone()),
                    _ => return,
                };
                self.note(place.span, symbol, Role::Write);
            }
            ExprKind::Field(base, part) => {
                self.place(base);
                self.field(part);
            }
            ExprKind::Index(base, index) => {
                self.place(base);
                self.expr(index);
            }
            _ => self.expr(place),
        }
    }

    /// The local of a name, and whether it is a variable.
    fn local(&self, name: &str) -> Option<(Symbol, bool)> {
        let mut scopes = self.scopes.iter().rev();
        scopes.find_map(|scope| scope.names.get(name)).cloned()
    }

    fn type_name(&mut self, ty: &TypeName) {
        let (name, span) = match &ty.array {
            Some(array) => {
                array.count.iter().for_each(|count| self.expr(count));
                (array.element.node.as_str(), array.element.span)
            }
            None => (ty.node.as_str(), ty.span),
        };
        if words::is_type(name) {
            self.note(span, Symbol::Type(name.to_owned()), Role::Read);
        } else if let Some(item) = self.analysis.lookup(self.module, name) {
            self.note(span, Symbol::Item(item), Role::Read);
        }
    }

    fn branch(&mut self, branch: &IfExpr) {
        self.expr(&branch.cond);
        self.block(&branch.then);
        branch.otherwise.iter().for_each(|block| self.block(block));
    }

    fn field(&mut self, part: &Name) {
        if let Some((item, index)) = self.fields.get(&part.span) {
            self.note(part.span, Symbol::Field(*item, *index), Role::Read);
        } else if words::is_output(&part.node) {
            let symbol = Symbol::BuiltIn(part.node.clone());
            self.note(part.span, symbol, Role::Read);
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                if let Some(symbol) = self.value(name) {
                    self.note(expr.span, symbol, Role::Read);
                }
            }
            ExprKind::Call { callee, args } => self.call(callee, args),
            ExprKind::Field(base, part) => {
                self.expr(base);
                self.field(part);
            }
            ExprKind::Array(elements) => elements.iter().for_each(|e| self.expr(e)),
            ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::Unary(_, operand) => self.expr(operand),
            ExprKind::If(branch) => self.branch(branch),
            ExprKind::Block(block) => self.block(block),
            ExprKind::Bool(_)
            | ExprKind::Int(_)
            | ExprKind::Uint(_)
            | ExprKind::Float(_)
            | ExprKind::Quantity(..)
            | ExprKind::Str(_)
            | ExprKind::Error => {}
        }
    }

    /// What a name stands for where a value is.
    fn value(&self, name: &str) -> Option<Symbol> {
        if let Some((symbol, _)) = self.local(name) {
            return Some(symbol);
        }
        let built_in = || Some(Symbol::BuiltIn(name.to_owned()));
        if self.in_material && words::is_input(name) {
            return built_in();
        }
        let item = self.analysis.lookup(self.module, name);
        let is_const = |item| matches!(self.analysis.item(item).kind, ItemKind::Const(_));
        if words::is_moment(name) && !item.is_some_and(is_const) {
            return if self.in_material { built_in() } else { None };
        }
        match item {
            Some(item) => Some(Symbol::Item(item)),
            None if name == words::NO_MEDIUM => built_in(),
            None => None,
        }
    }

    fn call(&mut self, callee: &Name, args: &[Arg]) {
        let item = self.analysis.lookup(self.module, &callee.node);
        let symbol = match item {
            Some(item) => Some(Symbol::Item(item)),
            None => self.local(&callee.node).map(|(symbol, _)| symbol),
        };
        let symbol = symbol.or_else(|| {
            let name = &callee.node;
            let known = words::is_type(name) || words::built_in_functions().any(|f| f == name);
            known.then(|| Symbol::BuiltIn(name.clone()))
        });
        if let Some(symbol) = symbol {
            self.note(callee.span, symbol, Role::Read);
        }
        for arg in args {
            if let (Some(name), Some(item)) = (&arg.name, item) {
                self.argument(item, name);
            }
            self.expr(&arg.value);
        }
    }

    /// The name of an argument: a parameter of what is called, or a field of a struct that is made.
    fn argument(&mut self, item: ItemRef, name: &Name) {
        let found = self.analysis.item(item);
        let symbol = match &found.kind {
            ItemKind::Struct(fields) => {
                let index = fields.iter().position(|f| f.name.node == name.node);
                index.map(|index| Symbol::Field(item, index))
            }
            _ => {
                let named = |p: &ParamRef<'_>| p.name.node == name.node;
                let index = params(found).iter().position(named);
                index.map(|index| Symbol::Param(item, index))
            }
        };
        // Every bsdf has its axes.
        let is_axis = matches!(found.kind, ItemKind::Closure(_)) && words::is_input(&name.node);
        let symbol = symbol.or_else(|| is_axis.then(|| Symbol::BuiltIn(name.node.clone())));
        if let Some(symbol) = symbol {
            self.note(name.span, symbol, Role::Give);
        }
    }
}
