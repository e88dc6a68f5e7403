//! Turns a function into flat code for the interpreter.
//!
//! Every value gets its place once. A field of a struct and neighbouring components of a vector
//! are places within their value's, and take no instruction. Places are handed out like a stack:
//! what a block computed is not visible after it, so its places are used again. A call's frame
//! begins where the stack ends: whatever lies beyond is computed anew before it is read.

use super::code::{Call, Code, Ins, Numbers, Part, Place, Run};
use crate::ir::ops::{self, Counts, Op};
use crate::ir::value::{Real, Value};
use crate::ir::{Block, ExprId, ExprKind, Function, FunctionId, LocalId, Module, Stmt, Type};

/// What functions read from outside.
#[derive(Debug)]
pub(super) struct Outside<F> {
    /// Values of the material's parameters.
    pub params: Vec<Value<F>>,
    /// Values of the parameter table.
    pub table: Vec<Value<F>>,
}

impl<F> Default for Outside<F> {
    fn default() -> Self {
        Self {
            params: Vec::new(),
            table: Vec::new(),
        }
    }
}

/// The code of `f`, a function over `module`, and where it leaves the values of the expressions
/// `kept`, which stand in no block within another. `in_parts`: the code knows what its runs of
/// operations are made of.
pub(super) fn lower<F: Real>(
    module: &Module,
    f: &Function,
    outside: &Outside<F>,
    kept: &[ExprId],
    in_parts: bool,
) -> (Code<F>, Vec<Place>) {
    let mut l = Lowering {
        module,
        f,
        instructions: Vec::with_capacity(2 * f.exprs.len() + 8),
        runs: Vec::new(),
        parts: in_parts.then(Vec::new),
        calls: Vec::new(),
        table: Vec::new(),
        in_run: false,
        places: vec![Place::default(); f.exprs.len()],
        locals: Vec::with_capacity(f.locals.len()),
        top: Place::default(),
        size: Place::default(),
        loops: Vec::new(),
    };
    let params: Vec<Place> = f.params.iter().map(|p| l.reserve(p.ty)).collect();
    let image_at = l.top;
    let image = l.image(&params, outside, kept);
    l.block(&f.body);
    l.emit(Ins::Return);
    let result = (l.place(f.value), l.size_of(f.ty(f.value)));
    let places = kept.iter().map(|&id| l.place(id)).collect();
    let code = Code {
        image_at,
        image,
        table: l.table,
        size: l.size,
        result,
        runs: l.runs,
        parts: l.parts.unwrap_or_default(),
        calls: l.calls,
        caller: None,
        instructions: l.instructions,
    };
    (code, places)
}

/// Jumps of a loop whose targets are not known yet.
#[derive(Default)]
struct Loop {
    breaks: Vec<usize>,
    continues: Vec<usize>,
}

struct Lowering<'a, F> {
    module: &'a Module,
    f: &'a Function,
    instructions: Vec<Ins<F>>,
    runs: Vec<Run>,
    /// What runs are made of, if that is asked for.
    parts: Option<Vec<Part>>,
    calls: Vec<Call>,
    table: Vec<(u32, Place, Type)>,
    /// Does the last run go on?
    in_run: bool,
    places: Vec<Place>,
    locals: Vec<Place>,
    /// Where free places begin.
    top: Place,
    /// The furthest that `top` went.
    size: Place,
    loops: Vec<Loop>,
}

impl<F: Real> Lowering<'_, F> {
    /// Places variables, constants and what comes from outside behind the parameters.
    fn image(&mut self, params: &[Place], outside: &Outside<F>, kept: &[ExprId]) -> Numbers<F> {
        let mut image = Numbers::new();
        let base = self.top;
        for local in &self.f.locals {
            self.locals.push(base.plus(image.len()));
            image.push(None, local.ty, &self.module.structs);
        }
        let mut used = vec![false; self.f.exprs.len()];
        used[self.f.value.index()] = true;
        kept.iter().for_each(|id| used[id.index()] = true);
        mark(self.f, &self.f.body, &mut used);
        for (i, e) in self.f.exprs.iter().enumerate() {
            if !used[i] {
                continue;
            }
            match &e.kind {
                ExprKind::Const(c) => {
                    self.places[i] = base.plus(image.len());
                    image.push_const(c);
                }
                ExprKind::MaterialParam(p) => {
                    self.places[i] = base.plus(image.len());
                    image.push(outside.params.get(*p as usize), e.ty, &self.module.structs);
                }
                ExprKind::TableValue(v) => {
                    self.places[i] = base.plus(image.len());
                    self.table.push((*v, image.len(), e.ty));
                    image.push(outside.table.get(*v as usize), e.ty, &self.module.structs);
                }
                ExprKind::Param(p) => self.places[i] = params[*p as usize],
                _ => {}
            }
        }
        self.take(image.len());
        image
    }

    // ---- Places and instructions -------------------------------------------------------

    fn size_of(&self, ty: Type) -> Place {
        Place::size(ty, &self.module.structs)
    }

    fn take(&mut self, size: Place) -> Place {
        let place = self.top;
        self.top = place.plus(size);
        self.size = self.size.max(self.top);
        place
    }

    fn reserve(&mut self, ty: Type) -> Place {
        self.take(self.size_of(ty))
    }

    fn place(&self, id: ExprId) -> Place {
        self.places[id.index()]
    }

    /// Where a float, int or bool lies in its array.
    fn index(&self, id: ExprId) -> u32 {
        match self.f.ty(id) {
            Type::Bool | Type::Int => self.place(id).ints,
            _ => self.place(id).floats,
        }
    }

    fn emit(&mut self, ins: Ins<F>) -> usize {
        self.instructions.push(ins);
        self.instructions.len() - 1
    }

    fn here(&self) -> u32 {
        self.instructions.len() as u32
    }

    fn copy(&mut self, from: Place, to: Place, size: Place) {
        let (f, i) = ((from.floats, to.floats), (from.ints, to.ints));
        match size.floats {
            0 => {}
            1 => {
                self.emit(Ins::Float { from: f.0, to: f.1 });
            }
            count => {
                self.emit(Ins::Floats {
                    from: f.0,
                    to: f.1,
                    count,
                });
            }
        }
        if size.ints > 0 {
            self.emit(Ins::Ints {
                from: i.0,
                to: i.1,
                count: size.ints,
            });
        }
    }

    /// The run that the next operation belongs to.
    fn run(&mut self) -> &mut Run {
        if !self.in_run {
            self.in_run = true;
            let index = self.runs.len() as u32;
            self.emit(Ins::Run(index));
            self.runs.push(Run::default());
        }
        let last = self.runs.len() - 1;
        &mut self.runs[last]
    }

    /// Counts an evaluation of `expr` as `counts`.
    fn count(&mut self, expr: ExprId, counts: Counts) {
        let run = self.run();
        run.executed += 1;
        run.counts.add(&counts, 1);
        let run = self.runs.len() as u32 - 1;
        if let Some(parts) = &mut self.parts {
            parts.push(Part { run, expr, counts });
        }
    }

    // ---- Statements --------------------------------------------------------------------

    fn block(&mut self, block: &Block) {
        block.iter().for_each(|stmt| self.stmt(stmt));
    }

    /// A block whose values are not visible after it.
    fn scoped(&mut self, block: &Block) {
        let top = self.top;
        self.in_run = false;
        self.block(block);
        self.in_run = false;
        self.top = top;
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::Eval(id) => self.eval(*id),
            Stmt::Store(local, part, value) => self.store(*local, *part, *value),
            Stmt::If(cond, then, otherwise) => self.branch(*cond, then, otherwise),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => self.count_up(*local, *low, *high, body),
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => self.repeat(head, *test, *limit, body),
            Stmt::Break => self.leave(|l| &mut l.breaks),
            Stmt::Continue => self.leave(|l| &mut l.continues),
        }
    }

    fn store(&mut self, local: LocalId, part: Option<u8>, value: ExprId) {
        let (from, mut to) = (self.place(value), self.locals[local.index()]);
        to.floats += part.map_or(0, u32::from);
        self.copy(from, to, self.size_of(self.f.ty(value)));
    }

    fn branch(&mut self, cond: ExprId, then: &Block, otherwise: &Block) {
        let test = self.emit(Ins::Unless(self.index(cond), 0));
        self.scoped(then);
        if otherwise.is_empty() {
            return self.aim(test);
        }
        let past = self.emit(Ins::Jump(0));
        self.aim(test);
        self.scoped(otherwise);
        self.aim(past);
    }

    fn count_up(&mut self, local: LocalId, low: ExprId, high: ExprId, body: &Block) {
        let before = self.top;
        let counter = self.reserve(Type::Int).ints;
        let (low, end) = (self.index(low), self.index(high));
        self.emit(Ins::Ints {
            from: low,
            to: counter,
            count: 1,
        });
        let top = self.here();
        let test = self.emit(Ins::Below {
            counter,
            end,
            exit: 0,
        });
        self.turn(high);
        let to = self.locals[local.index()].ints;
        self.emit(Ins::Ints {
            from: counter,
            to,
            count: 1,
        });
        self.repeated(body, counter, top);
        self.aim(test);
        self.top = before;
    }

    fn repeat(&mut self, head: &Block, test: ExprId, limit: u32, body: &Block) {
        let before = self.top;
        let (counter, end) = (self.reserve(Type::Int).ints, self.reserve(Type::Int).ints);
        // A limit beyond what an int holds is out of reach of any fuel.
        let limit = i32::try_from(limit).unwrap_or(i32::MAX);
        self.emit(Ins::Set {
            to: counter,
            value: 0,
        });
        self.emit(Ins::Set {
            to: end,
            value: limit,
        });
        let top = self.here();
        let below = self.emit(Ins::Below {
            counter,
            end,
            exit: 0,
        });
        self.turn(test);
        self.block(head);
        let done = self.emit(Ins::Unless(self.index(test), 0));
        self.in_run = false;
        self.repeated(body, counter, top);
        self.aim(below);
        self.aim(done);
        self.top = before;
    }

    /// Counts a turn of a loop with the operations that follow.
    fn turn(&mut self, test: ExprId) {
        self.in_run = false;
        let turn = Counts {
            turns: 1,
            ..Counts::default()
        };
        self.count(test, turn);
    }

    /// The body of a loop up to its end, and its jumps.
    fn repeated(&mut self, body: &Block, counter: u32, top: u32) {
        self.loops.push(Loop::default());
        self.block(body);
        let Loop { breaks, continues } = self.loops.pop().unwrap_or_default();
        continues.into_iter().for_each(|jump| self.aim(jump));
        self.emit(Ins::Next { counter, top });
        breaks.into_iter().for_each(|jump| self.aim(jump));
        self.in_run = false;
    }

    fn leave(&mut self, list: impl Fn(&mut Loop) -> &mut Vec<usize>) {
        let jump = self.emit(Ins::Jump(0));
        match self.loops.last_mut() {
            Some(innermost) => list(innermost).push(jump),
            // Outside loops, which verified code never is, the function ends.
            None => self.instructions[jump] = Ins::Return,
        }
        self.in_run = false;
    }

    /// Makes the jump at `index` go to what is emitted next.
    fn aim(&mut self, index: usize) {
        let here = self.here();
        match &mut self.instructions[index] {
            Ins::Jump(to) | Ins::Unless(_, to) | Ins::Below { exit: to, .. } => *to = here,
            _ => {}
        }
        self.in_run = false;
    }

    // ---- Expressions -------------------------------------------------------------------

    fn eval(&mut self, id: ExprId) {
        let (f, ty) = (self.f, self.f.ty(id));
        self.count(id, f.counts(&self.module.structs, id));
        self.places[id.index()] = match &f.expr(id).kind {
            ExprKind::Op(op, args) => self.op(*op, args, ty),
            ExprKind::Load(local) => {
                let (from, size) = (self.locals[local.index()], self.size_of(ty));
                let to = self.take(size);
                self.copy(from, to, size);
                to
            }
            ExprKind::Compose(parts) => self.compose(ty, parts),
            ExprKind::Swizzle(value, components) => self.swizzle(*value, components),
            ExprKind::Call(callee, args) => self.call(id, *callee, args),
            ExprKind::Make(_, fields) => {
                let to = self.reserve(ty);
                self.place_all(fields, to);
                to
            }
            ExprKind::Field(value, i) => self.field(*value, *i as usize),
            ExprKind::Const(_)
            | ExprKind::Param(_)
            | ExprKind::MaterialParam(_)
            | ExprKind::TableValue(_) => self.place(id),
        };
    }

    fn op(&mut self, op: Op, args: &[ExprId], ty: Type) -> Place {
        if op == Op::Select && ty.width().is_none() {
            return self.select(args, ty);
        }
        let types: Vec<Type> = args.iter().map(|&a| self.f.ty(a)).collect();
        let components = op.components(&types);
        let to = self.reserve(ty);
        let result = match ty {
            Type::Bool | Type::Int => to.ints,
            _ => to.floats,
        };
        let from = |k: usize| args.get(k).map_or(0, |&a| self.index(a));
        let at = op.operands(&types, result, [from(0), from(1), from(2)]);
        let kernel = ops::kernel(op, components);
        self.emit(match op.texture_space() {
            Some(_) => Ins::Texture {
                op,
                wide: types.get(1) == Some(&Type::Vec4),
                kernel,
                at,
            },
            None => Ins::Op(kernel, at),
        });
        to
    }

    /// A choice between ints, bools, matrices or structs: number by number.
    fn select(&mut self, args: &[ExprId], ty: Type) -> Place {
        let size = self.size_of(ty);
        let to = self.take(size);
        let (cond, a, b) = (
            self.index(args[0]),
            self.place(args[1]),
            self.place(args[2]),
        );
        let types = [Type::Bool, ty, ty];
        for first in (0..size.floats).step_by(4) {
            let from = [cond, a.floats + first, b.floats + first];
            let at = Op::Select.operands(&types, to.floats + first, from);
            let components = (size.floats - first).min(4) as usize;
            self.emit(Ins::Op(ops::kernel(Op::Select, components), at));
        }
        for i in 0..size.ints {
            let at = Op::Select.operands(&types, to.ints + i, [cond, a.ints + i, b.ints + i]);
            self.emit(Ins::Op(ops::kernel(Op::Select, 0), at));
        }
        to
    }

    fn compose(&mut self, ty: Type, parts: &[ExprId]) -> Place {
        let to = self.reserve(ty);
        match (parts, self.size_of(ty).floats) {
            ([one], count) if self.f.ty(*one) == Type::Float => {
                let (from, to) = (self.index(*one), to.floats);
                self.emit(Ins::Fill { from, to, count });
            }
            _ => self.place_all(parts, to),
        }
        to
    }

    /// Copies values side by side, the first to `to`.
    fn place_all(&mut self, values: &[ExprId], mut to: Place) {
        for &value in values {
            let size = self.size_of(self.f.ty(value));
            self.copy(self.place(value), to, size);
            to = to.plus(size);
        }
    }

    fn swizzle(&mut self, value: ExprId, components: &[u8]) -> Place {
        let mut base = self.place(value);
        let at = |c: u8| base.floats + u32::from(c);
        if components.windows(2).all(|pair| pair[1] == pair[0] + 1) {
            base.floats = components.first().map_or(base.floats, |&c| at(c));
            return base;
        }
        let to = self.reserve(Type::of_width(components.len()));
        for (i, &c) in components.iter().enumerate() {
            let to = to.floats + i as u32;
            self.emit(Ins::Float { from: at(c), to });
        }
        to
    }

    fn field(&self, value: ExprId, index: usize) -> Place {
        let base = self.place(value);
        let Type::Struct(id) = self.f.ty(value) else {
            return base;
        };
        let before = &self.module.structs[id.index()].fields[..index];
        let sizes = before.iter().map(|(_, ty)| self.size_of(*ty));
        sizes.fold(base, Place::plus)
    }

    fn call(&mut self, id: ExprId, function: FunctionId, args: &[ExprId]) -> Place {
        let to = self.reserve(self.f.ty(id));
        let frame = self.top;
        self.place_all(args, frame);
        let arguments = args.iter().map(|&a| self.size_of(self.f.ty(a)));
        let end = arguments.fold(frame, Place::plus);
        self.size = self.size.max(end);
        let call = self.calls.len() as u32;
        self.calls.push(Call {
            function,
            expr: id,
            code: None,
        });
        self.emit(Ins::Call { call, frame, to });
        to
    }
}

/// Marks the operands of what a block evaluates.
fn mark(f: &Function, block: &Block, used: &mut [bool]) {
    for stmt in block {
        match stmt {
            Stmt::Eval(id) => {
                for operand in f.expr(*id).kind.operands() {
                    used[operand.index()] = true;
                }
            }
            Stmt::Store(_, _, value) => used[value.index()] = true,
            Stmt::If(cond, then, otherwise) => {
                used[cond.index()] = true;
                mark(f, then, used);
                mark(f, otherwise, used);
            }
            Stmt::For {
                low, high, body, ..
            } => {
                used[low.index()] = true;
                used[high.index()] = true;
                mark(f, body, used);
            }
            Stmt::While {
                head, test, body, ..
            } => {
                used[test.index()] = true;
                mark(f, head, used);
                mark(f, body, used);
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }
}
