//! Evaluates a value of a body under construction once more, with other inputs.
//!
//! What was evaluated so far lies in the open blocks of the builder. Of that the value depends on some
//! expressions, variables and statements; of these are copied those that the inputs change.

use std::collections::{BTreeMap, BTreeSet};

use crate::abi::{Input, Tangents};
use crate::ir::build::Builder;
use crate::ir::walk::Renumber;
use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Module, Stmt, Type};
use crate::source::Span;

/// An input with another value.
pub(super) struct Moved {
    pub input: Input,
    pub value: ExprId,
}

/// What has to be evaluated again.
pub(super) struct Again {
    value: ExprId,
    /// The statements, those within others included, that are copied.
    stmts: Block,
    /// Expressions that are copied where they are evaluated.
    exprs: BTreeSet<ExprId>,
    /// The expressions that are inputs.
    inputs: BTreeMap<ExprId, Input>,
    /// The variables that the copies have for themselves.
    locals: BTreeSet<LocalId>,
}

impl Again {
    /// Of a value that was evaluated in the open blocks.
    pub fn of(b: &Builder, module: &Module, value: ExprId) -> Self {
        let facts = Facts::of(b);
        let needed = needed(b.function(), &facts, value);
        let moved = changed(b.function(), module, &facts, &needed);
        let locals = copied_locals(b, &needed, moved.locals);
        let mut again = Self {
            value,
            stmts: Vec::new(),
            exprs: BTreeSet::new(),
            inputs: BTreeMap::new(),
            locals,
        };
        for stmt in b.so_far() {
            match stmt {
                Stmt::Eval(id) if moved.exprs.contains(id) => again.stmts.push(stmt.clone()),
                Stmt::Store(local, ..) if again.locals.contains(local) => {
                    again.stmts.push(stmt.clone());
                }
                stmt if stores_any(stmt, &again.locals) => {
                    let kept = again.kept(stmt, &needed);
                    again.stmts.push(kept);
                }
                _ => {}
            }
        }
        let mut evaluated = Vec::new();
        collect(&again.stmts, &mut evaluated);
        for id in evaluated {
            match input(module, b.function(), id) {
                Some(input) => {
                    again.inputs.insert(id, input);
                }
                None => {
                    again.exprs.insert(id);
                }
            }
        }
        again
    }

    /// The inputs that change it, each once.
    pub fn inputs(&self) -> Vec<Input> {
        let each: BTreeSet<Input> = self.inputs.values().copied().collect();
        each.into_iter().collect()
    }

    /// How many expressions are copied.
    pub fn size(&self) -> usize {
        self.exprs.len()
    }

    /// A statement that is copied whole, with what of it is needed.
    fn kept(&self, stmt: &Stmt, needed: &BTreeSet<ExprId>) -> Stmt {
        let block = |block: Block| {
            let each = block.into_iter().filter(|inner| match inner {
                Stmt::Eval(id) => needed.contains(id),
                Stmt::Store(local, ..) => self.locals.contains(local),
                Stmt::Break | Stmt::Continue => true,
                inner => stores_any(inner, &self.locals) || jumps(inner),
            });
            each.map(|inner| self.kept(&inner, needed)).collect()
        };
        stmt.clone().map_blocks(block)
    }

    /// Evaluates it in the open block, with some inputs moved; gives the value.
    pub fn evaluate(
        &self,
        b: &mut Builder,
        module: &Module,
        moved: &[Moved],
        span: Span,
    ) -> ExprId {
        let mut copy = Copy::default();
        for (id, input) in &self.inputs {
            if let Some(moved) = moved.iter().find(|m| m.input == *input) {
                copy.exprs.insert(*id, moved.value);
            }
        }
        let mut locals = self.locals.clone();
        counters(&self.stmts, &mut |counter| {
            locals.insert(counter);
        });
        for local in locals {
            let (name, ty) = {
                let of = &b.function().locals[local.index()];
                (of.name.clone(), of.ty)
            };
            copy.locals.insert(local, b.local(&name, ty));
        }
        // Variables begin as zero, in every turn.
        for local in &self.locals {
            let own = copy.local(*local);
            let zero = b.zero(module, b.function().locals[own.index()].ty, span);
            b.store(own, zero);
        }
        // Whatever is copied has its number before statements refer to it.
        let via = b.via();
        let mut order = Vec::new();
        collect(&self.stmts, &mut order);
        for id in order.into_iter().filter(|id| self.exprs.contains(id)) {
            let mut expr = b.function().expr(id).clone();
            expr.name = None;
            if let ExprKind::Load(local) = &mut expr.kind {
                *local = copy.local(*local);
            }
            for operand in expr.kind.operands_mut() {
                *operand = copy.expr(*operand);
            }
            let own = b.adopt(expr);
            copy.exprs.insert(id, own);
        }
        for stmt in without_inputs(&self.stmts, &self.inputs) {
            b.stmt(copy.stmt(&stmt));
        }
        b.set_via(via);
        copy.expr(self.value)
    }
}

/// Statements without the evaluation of inputs, for which there are other values.
fn without_inputs(stmts: &Block, inputs: &BTreeMap<ExprId, Input>) -> Block {
    let kept = stmts.iter().filter(|stmt| match stmt {
        Stmt::Eval(id) => !inputs.contains_key(id),
        _ => true,
    });
    kept.map(|stmt| {
        stmt.clone()
            .map_blocks(|inner| without_inputs(&inner, inputs))
    })
    .collect()
}

/// The numbers of what was copied.
#[derive(Default)]
struct Copy {
    exprs: BTreeMap<ExprId, ExprId>,
    locals: BTreeMap<LocalId, LocalId>,
}

impl Renumber for Copy {
    fn expr(&self, id: ExprId) -> ExprId {
        self.exprs.get(&id).copied().unwrap_or(id)
    }

    fn local(&self, id: LocalId) -> LocalId {
        self.locals.get(&id).copied().unwrap_or(id)
    }
}

/// The input that varies over the surface that an expression is, if it is one.
fn input(module: &Module, f: &Function, id: ExprId) -> Option<Input> {
    let ExprKind::Field(base, field) = f.expr(id).kind else {
        return None;
    };
    let (ExprKind::Param(0), Type::Struct(of)) = (&f.expr(base).kind, f.ty(base)) else {
        return None;
    };
    let fields = &module.structs[of.index()].fields;
    let input = Input::of_field(&fields.get(field as usize)?.0)?;
    (input.tangents() != Tangents::None).then_some(input)
}

/// What a body did so far.
struct Facts {
    /// What was evaluated, in order.
    evaluated: Vec<ExprId>,
    /// Every assignment: variable, value, and what decided whether it happened.
    stores: Vec<(LocalId, ExprId, Vec<ExprId>)>,
}

impl Facts {
    fn of(b: &Builder) -> Self {
        let mut facts = Facts {
            evaluated: Vec::new(),
            stores: Vec::new(),
        };
        let mut control = Vec::new();
        for stmt in b.so_far() {
            facts.stmt(stmt, &mut control);
        }
        facts
    }

    fn stmt(&mut self, stmt: &Stmt, control: &mut Vec<ExprId>) {
        let outer = control.len();
        match stmt {
            Stmt::Eval(id) => self.evaluated.push(*id),
            Stmt::Store(local, _, value) => self.stores.push((*local, *value, control.clone())),
            Stmt::If(test, ..) => control.push(*test),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                control.extend([*low, *high]);
                jump_tests(body, control);
                self.stores.push((*local, *low, control.clone()));
            }
            Stmt::While { test, body, .. } => {
                control.push(*test);
                jump_tests(body, control);
            }
            Stmt::Break | Stmt::Continue => {}
        }
        for block in stmt.blocks() {
            block.iter().for_each(|inner| self.stmt(inner, control));
        }
        control.truncate(outer);
    }
}

/// The tests that decide whether a loop's body is left or its turn ends.
fn jump_tests(body: &Block, out: &mut Vec<ExprId>) {
    for stmt in body {
        if let Stmt::If(test, a, b) = stmt {
            if jumps(stmt) {
                out.push(*test);
            }
            jump_tests(a, out);
            jump_tests(b, out);
        }
    }
}

/// Does a statement leave the loop that it stands in, at any depth?
fn jumps(stmt: &Stmt) -> bool {
    match stmt {
        Stmt::Break | Stmt::Continue => true,
        Stmt::If(_, a, b) => a.iter().chain(b).any(jumps),
        _ => false,
    }
}

/// The variables that copies have for themselves: those that change, and those that are read within what
/// is copied whole, since they must hold what they held at that time. Counters belong to their loops.
fn copied_locals(
    b: &Builder,
    needed: &BTreeSet<ExprId>,
    changed: BTreeSet<LocalId>,
) -> BTreeSet<LocalId> {
    let mut locals = changed;
    for stmt in b.so_far() {
        counters(std::slice::from_ref(stmt), &mut |counter| {
            locals.remove(&counter);
        });
    }
    loop {
        let mut read = BTreeSet::new();
        for stmt in b.so_far().filter(|stmt| stores_any(stmt, &locals)) {
            loads_within(b.function(), stmt, needed, &mut read);
        }
        let before = locals.len();
        locals.extend(read);
        if locals.len() == before {
            return locals;
        }
    }
}

/// What the value depends on.
fn needed(f: &Function, facts: &Facts, value: ExprId) -> BTreeSet<ExprId> {
    let mut found = BTreeSet::new();
    let mut locals = BTreeSet::new();
    let mut pending = vec![value];
    while let Some(id) = pending.pop() {
        if !found.insert(id) {
            continue;
        }
        pending.extend(f.expr(id).kind.operands());
        if let ExprKind::Load(local) = f.expr(id).kind
            && locals.insert(local)
        {
            for (_, value, control) in facts.stores.iter().filter(|(l, ..)| *l == local) {
                pending.push(*value);
                pending.extend(control);
            }
        }
    }
    found
}

/// Expressions and variables that the inputs change.
#[derive(Default)]
struct Changed {
    exprs: BTreeSet<ExprId>,
    locals: BTreeSet<LocalId>,
}

/// What of the needed the inputs change.
fn changed(f: &Function, module: &Module, facts: &Facts, needed: &BTreeSet<ExprId>) -> Changed {
    let mut found = Changed::default();
    // A loop carries what it assigns to its start, so that more than one round may be needed.
    loop {
        for id in facts.evaluated.iter().filter(|id| needed.contains(id)) {
            let kind = &f.expr(*id).kind;
            let loads = matches!(kind, ExprKind::Load(l) if found.locals.contains(l));
            let takes = || kind.operands().iter().any(|o| found.exprs.contains(o));
            if loads || takes() || input(module, f, *id).is_some() {
                found.exprs.insert(*id);
            }
        }
        let before = found.locals.len();
        for (local, value, control) in &facts.stores {
            let mut causes = control.iter().chain([value]);
            if causes.any(|id| found.exprs.contains(id)) {
                found.locals.insert(*local);
            }
        }
        if found.locals.len() == before {
            found.locals.retain(|local| is_needed(f, needed, *local));
            return found;
        }
    }
}

fn is_needed(f: &Function, needed: &BTreeSet<ExprId>, local: LocalId) -> bool {
    let mut all = needed.iter();
    all.any(|id| matches!(f.expr(*id).kind, ExprKind::Load(l) if l == local))
}

/// Does a statement with blocks assign one of these variables in them?
fn stores_any(stmt: &Stmt, locals: &BTreeSet<LocalId>) -> bool {
    let mut inner = stmt.blocks().flatten();
    inner.any(|stmt| match stmt {
        Stmt::Store(local, ..) => locals.contains(local),
        stmt => stores_any(stmt, locals),
    })
}

/// Adds the variables that needed expressions within a statement read, but for its counters.
fn loads_within(f: &Function, stmt: &Stmt, needed: &BTreeSet<ExprId>, out: &mut BTreeSet<LocalId>) {
    let whole = std::slice::from_ref(stmt);
    let mut evaluated = Vec::new();
    collect(whole, &mut evaluated);
    let mut own = BTreeSet::new();
    counters(whole, &mut |counter| {
        own.insert(counter);
    });
    for id in evaluated.into_iter().filter(|id| needed.contains(id)) {
        match f.expr(id).kind {
            ExprKind::Load(local) if !own.contains(&local) => {
                out.insert(local);
            }
            _ => {}
        }
    }
}

/// Tells the counters of loops.
fn counters(stmts: &[Stmt], found: &mut dyn FnMut(LocalId)) {
    for stmt in stmts {
        if let Stmt::For { local, .. } = stmt {
            found(*local);
        }
        stmt.blocks().for_each(|inner| counters(inner, found));
    }
}

/// Adds what is evaluated, in order.
fn collect(stmts: &[Stmt], out: &mut Vec<ExprId>) {
    for stmt in stmts {
        if let Stmt::Eval(id) = stmt {
            out.push(*id);
        }
        stmt.blocks().for_each(|inner| collect(inner, out));
    }
}
