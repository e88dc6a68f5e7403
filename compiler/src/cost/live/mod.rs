//! How many numbers are alive at once: what a thread needs registers for.
//!
//! A number is alive from where it is made to where it is last used; what a loop uses in a later
//! turn or what is used after it is alive all through the loop. Code is taken in the order in
//! which WGSL evaluates it, calls in line. Arguments are alive up to their last use, values of the
//! parameter table from the beginning, where they are read. A vector is as many numbers as it has
//! components, a matrix nine, a bool one, a constant none; a loop counts with its counter and bound.
//! A variable counts from where it may first be stored.
//!
//! The driver orders instructions anew and computes some values again rather than keep them, so
//! registers that it needs are another number, one that grows with this one.

mod positions;
mod set;
mod shape;
mod unset;

use std::rc::Rc;

use self::set::Set;
use self::shape::{Number, Shape};
use self::unset::{Side, Unset};
use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Module, Stmt};

/// Calls within calls that are looked into. Deeper ones count as an operation.
const MAX_CALLS: usize = 64;

/// Most numbers that are alive at once while `f`, a function over `module`, runs.
pub fn live(module: &Module, f: &Function) -> u32 {
    let mut walk = Walk {
        module,
        shapes: vec![None; module.functions.len()],
        alive: Set::default(),
        worst: 0,
        counting: true,
        loops: Vec::new(),
        next: 0,
        calls: 0,
    };
    let shape = Rc::new(Shape::of(f, &module.structs));
    let params = walk.reserve(shape.params);
    let frame = Frame {
        f,
        own: walk.reserve(shape.own),
        locals: walk.reserve(shape.locals),
        table: walk.reserve(shape.table),
        params: (params..params + shape.params).map(Some).collect(),
        shape,
    };
    walk.use_all(&frame, &[f.value]);
    walk.block(&frame, &f.body, Some(&frame.shape.unset));
    walk.worst as u32
}

/// Goes over code from its end to its beginning, with what is alive there.
struct Walk<'a> {
    module: &'a Module,
    shapes: Vec<Option<Rc<Shape>>>,
    alive: Set,
    /// The most so far.
    worst: usize,
    /// Does what is alive count? It does not where only uses are looked for.
    counting: bool,
    /// What is alive behind each open loop, and where its next turn begins.
    loops: Vec<(Set, Set)>,
    /// The next free name of a number.
    next: u32,
    calls: usize,
}

/// A function being walked, once for each call.
struct Frame<'a> {
    f: &'a Function,
    shape: Rc<Shape>,
    /// The first names of its numbers.
    own: u32,
    locals: u32,
    table: u32,
    /// The names of its arguments' numbers; none of constants.
    params: Vec<Option<u32>>,
}

impl Frame<'_> {
    fn name(&self, number: Number) -> Option<u32> {
        match number {
            Number::Constant => None,
            Number::Own(i) => Some(self.own + i),
            Number::Param(i) => self.params[i as usize],
            Number::Local(i) => Some(self.locals + i),
            Number::Table(i) => Some(self.table + i),
        }
    }

    fn names(&self, id: ExprId) -> impl Iterator<Item = Option<u32>> {
        self.shape.numbers(id).iter().map(|&n| self.name(n))
    }
}

impl<'a> Walk<'a> {
    fn reserve(&mut self, numbers: u32) -> u32 {
        self.next += numbers;
        self.next - numbers
    }

    fn note(&mut self) {
        if self.counting {
            self.worst = self.worst.max(self.alive.len());
        }
    }

    // ---- Statements --------------------------------------------------------------------

    /// A block, with what is known of its statements if no loop is around it.
    fn block(&mut self, frame: &Frame<'a>, block: &'a Block, unset: Option<&[Unset]>) {
        for (i, stmt) in block.iter().enumerate().rev() {
            let unset = unset.and_then(|all| all.get(i));
            self.stmt(frame, stmt, unset);
            self.forget(frame, unset.map_or(&[], |u| &u.begins));
        }
    }

    /// Variables that are constants here are not alive.
    fn forget(&mut self, frame: &Frame<'a>, locals: &[LocalId]) {
        locals.iter().for_each(|&l| self.end(frame, l, None));
    }

    fn stmt(&mut self, frame: &Frame<'a>, stmt: &'a Stmt, unset: Option<&Unset>) {
        match stmt {
            Stmt::Eval(id) if frame.shape.inlined[id.index()] => {}
            Stmt::Eval(id) => self.eval(frame, *id),
            Stmt::Store(local, part, value) => {
                self.end(frame, *local, *part);
                self.use_all(frame, &[*value]);
            }
            Stmt::If(cond, then, otherwise) => {
                let sides = unset.and_then(|u| u.sides.as_ref());
                let side = |i: usize| sides.map(|s| &s[i]);
                let after = self.alive.clone();
                self.side(frame, otherwise, side(1));
                let before_otherwise = std::mem::replace(&mut self.alive, after);
                self.side(frame, then, side(0));
                self.alive.add_all(&before_otherwise);
                self.use_all(frame, &[*cond]);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let uses = self.uses(|walk| walk.block(frame, body, None));
                let after = self.alive.clone();
                self.alive.add_all(&uses);
                frame.names(*high).flatten().for_each(|n| self.alive.add(n));
                let counter = self.local(frame, *local, None).start;
                self.alive.add(counter);
                self.turns(after, |walk| walk.block(frame, body, None));
                self.alive.remove(counter);
                self.use_all(frame, &[*low, *high]);
            }
            Stmt::While {
                head, test, body, ..
            } => {
                let uses = self.uses(|walk| {
                    walk.block(frame, body, None);
                    walk.use_all(frame, &[*test]);
                    walk.block(frame, head, None);
                });
                let after = self.alive.clone();
                self.alive.add_all(&uses);
                let counter = self.reserve(1);
                self.alive.add(counter);
                self.turns(after.clone(), |walk| {
                    walk.block(frame, body, None);
                    walk.alive.add_all(&after);
                    walk.use_all(frame, &[*test]);
                    walk.block(frame, head, None);
                });
                self.alive.remove(counter);
                self.next = counter;
            }
            Stmt::Break => self.jump(|(after, _)| after),
            Stmt::Continue => self.jump(|(_, again)| again),
        }
    }

    fn side(&mut self, frame: &Frame<'a>, block: &'a Block, side: Option<&Side>) {
        self.forget(frame, side.map_or(&[], |s| &s.lacks));
        self.block(frame, block, side.map(|s| &s.statements[..]));
    }

    /// What a loop uses of what was there before it.
    fn uses(&mut self, turn: impl FnOnce(&mut Self)) -> Set {
        let alive = std::mem::take(&mut self.alive);
        let counting = std::mem::replace(&mut self.counting, false);
        self.loops.push((Set::default(), Set::default()));
        turn(self);
        self.loops.pop();
        self.counting = counting;
        std::mem::replace(&mut self.alive, alive)
    }

    /// Goes over the turns of a loop at whose beginning all is alive that is now, and `after` behind
    /// it. To look for uses, what is alive at the beginning says enough.
    fn turns(&mut self, after: Set, turn: impl FnOnce(&mut Self)) {
        self.note();
        if !self.counting {
            return;
        }
        let again = self.alive.clone();
        self.loops.push((after, again.clone()));
        turn(self);
        self.loops.pop();
        self.alive = again;
    }

    fn jump(&mut self, to: impl Fn(&(Set, Set)) -> &Set) {
        if let Some(innermost) = self.loops.last() {
            self.alive = to(innermost).clone();
        }
    }

    /// The names of a variable's numbers, or of one component.
    fn local(&self, frame: &Frame<'a>, local: LocalId, part: Option<u8>) -> std::ops::Range<u32> {
        let ty = frame.f.locals[local.index()].ty;
        let count = ty.numbers(&self.module.structs);
        let all = frame.shape.local(local.index(), count);
        let (first, end) = (frame.locals + all.start, frame.locals + all.end);
        match part {
            Some(part) => first + u32::from(part)..first + u32::from(part) + 1,
            None => first..end,
        }
    }

    /// Before a variable is stored, what it held is not alive.
    fn end(&mut self, frame: &Frame<'a>, local: LocalId, part: Option<u8>) {
        let names = self.local(frame, local, part);
        names.for_each(|n| self.alive.remove(n));
    }

    // ---- Expressions -------------------------------------------------------------------

    /// Uses values together, and evaluates those that stand where they are used.
    fn use_all(&mut self, frame: &Frame<'a>, ids: &[ExprId]) {
        for &id in ids {
            frame.names(id).flatten().for_each(|n| self.alive.add(n));
        }
        self.note();
        for &id in ids.iter().rev() {
            if frame.shape.inlined[id.index()] {
                self.eval(frame, id);
            }
        }
    }

    fn eval(&mut self, frame: &Frame<'a>, id: ExprId) {
        match &frame.f.expr(id).kind {
            ExprKind::Op(_, args) => {
                frame.names(id).flatten().for_each(|n| self.alive.remove(n));
                self.use_all(frame, args);
            }
            ExprKind::Call(callee, args) => self.call(frame, id, callee.index(), args),
            ExprKind::Load(local) => {
                let held = self.local(frame, *local, None);
                for (made, read) in frame.names(id).flatten().zip(held) {
                    if made != read && self.alive.contains(made) {
                        self.alive.remove(made);
                        self.alive.add(read);
                    }
                }
            }
            // Numbers of others: alive where they are used.
            kind => {
                let operands = kind.operands().iter().rev();
                for &operand in operands.filter(|o| frame.shape.inlined[o.index()]) {
                    self.eval(frame, operand);
                }
            }
        }
    }

    fn call(&mut self, frame: &Frame<'a>, id: ExprId, callee: usize, args: &[ExprId]) {
        let results: Vec<u32> = frame.names(id).flatten().collect();
        let wanted: Vec<bool> = results.iter().map(|&n| self.alive.contains(n)).collect();
        results.iter().for_each(|&n| self.alive.remove(n));
        if self.calls < MAX_CALLS {
            self.calls += 1;
            self.body(frame, callee, args, &wanted);
            self.calls -= 1;
        } else {
            self.use_all(frame, args);
            return;
        }
        for &arg in args.iter().rev() {
            if frame.shape.inlined[arg.index()] {
                self.eval(frame, arg);
            }
        }
    }

    /// The body of a function in place of a call of which the `wanted` numbers are used.
    fn body(&mut self, caller: &Frame<'a>, callee: usize, args: &[ExprId], wanted: &[bool]) {
        let module = self.module;
        let f = &module.functions[callee];
        let shape = Rc::clone(
            self.shapes[callee].get_or_insert_with(|| Rc::new(Shape::of(f, &module.structs))),
        );
        let mark = self.next;
        let frame = Frame {
            f,
            own: self.reserve(shape.own),
            locals: self.reserve(shape.locals),
            table: self.reserve(shape.table),
            params: args.iter().flat_map(|&arg| caller.names(arg)).collect(),
            shape,
        };
        let results = frame.names(f.value).zip(wanted);
        let used: Vec<u32> = results
            .filter(|(_, w)| **w)
            .filter_map(|(n, _)| n)
            .collect();
        used.into_iter().for_each(|n| self.alive.add(n));
        self.note();
        if frame.shape.inlined[f.value.index()] {
            self.eval(&frame, f.value);
        }
        self.block(&frame, &f.body, Some(&frame.shape.unset));
        // Variables begin as zero, whatever the last call left in them.
        (frame.locals..frame.locals + frame.shape.locals).for_each(|n| self.alive.remove(n));
        self.next = mark;
    }
}
