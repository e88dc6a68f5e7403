//! The interpreter: runs IR on the CPU in f32 or f64.
//!
//! In f64 it is the oracle of the numerics tests; in f32 it rounds where the GPU rounds. It also
//! evaluates what must be known before rendering (parameter values, uniform emission). A function
//! is turned into flat code when it is first called. Work is bounded by a number of evaluated
//! expressions, so no input can make it hang, and calls need no native stack.

mod code;
mod lower;
mod profile;

use self::code::{Code, Ins, Numbers, Place};
use self::lower::Outside;
pub use self::profile::{Origin, Part};
use super::value::{Real, Value};
use super::{Const, ExprId, Function, FunctionId, Module};
use crate::ir::ops::{Counts, Op, Operands};

/// What is asked of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRequest {
    /// Its index in the module.
    pub texture: usize,
    /// Which lookup asks; it tells whether a color is meant or data.
    pub op: Op,
    /// Where.
    pub uv: [f64; 2],
    /// How wide an average is wanted; zero for none.
    pub width: [f64; 2],
    /// The bits of [`crate::abi::texture_mode`].
    pub mode: i32,
}

/// Looks up a texture; gives RGBA.
pub type TextureLookup<'a> = dyn Fn(&TextureRequest) -> [f64; 4] + 'a;

/// Runs functions of one module. Keep it for many calls: the code it makes of a function stays.
pub struct Interpreter<'a, F> {
    module: &'a Module,
    /// What functions read from outside.
    outside: Outside<F>,
    texture: Option<&'a TextureLookup<'a>>,
    /// Expressions that may still be evaluated.
    fuel: u64,
    /// Expressions evaluated so far.
    executed: u64,
    codes: Vec<Code<F>>,
    /// The functions that these are the code of, where they outlive the interpreter.
    sources: Vec<Option<&'a Function>>,
    /// Index in `codes` of the module's functions, once they were called.
    known: Vec<Option<usize>>,
    /// Functions that `run` was given. They live as long as the module does, so that an address
    /// stands for one function.
    others: Vec<(&'a Function, usize)>,
    /// The frames of all calls.
    stack: Numbers<F>,
    /// Does each call have code of its own?
    apart: bool,
    /// Does code know what it is made of?
    has_parts: bool,
}

/// The work limit was reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfFuel;

impl std::fmt::Display for OutOfFuel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the evaluation takes too long")
    }
}

impl std::error::Error for OutOfFuel {}

/// A call that waits for the one it made.
struct Waiting {
    code: usize,
    next: usize,
    base: Place,
    /// Where the result goes.
    to: Place,
}

/// Why a function's code stopped.
enum Stop {
    Call {
        call: u32,
        frame: Place,
        to: Place,
        next: usize,
    },
    Return,
}

impl<'a, F: Real> Interpreter<'a, F> {
    /// An interpreter that evaluates at most `fuel` expressions.
    pub fn new(module: &'a Module, fuel: u64) -> Self {
        Self {
            module,
            outside: Outside::default(),
            texture: None,
            fuel,
            executed: 0,
            codes: Vec::new(),
            sources: Vec::new(),
            known: vec![None; module.functions.len()],
            others: Vec::new(),
            stack: Numbers::new(),
            apart: false,
            has_parts: false,
        }
    }

    /// Sets the material's parameters, which functions read before hoisting; zero without them.
    pub fn with_params(mut self, params: &[Const]) -> Self {
        self.outside.params = params.iter().map(Value::constant).collect();
        self.forget_code()
    }

    /// Sets the values of the parameter table, which functions read after hoisting; zero without
    /// them.
    pub fn with_table(mut self, values: &[Const]) -> Self {
        self.outside.table = values.iter().map(Value::constant).collect();
        self.forget_code()
    }

    fn forget_code(mut self) -> Self {
        // Their values are part of the code.
        self.codes.clear();
        self.sources.clear();
        self.others.clear();
        self.known.fill(None);
        self
    }

    /// Sets what texture lookups give; without it they give 0.5.
    pub fn with_texture(mut self, texture: &'a TextureLookup<'a>) -> Self {
        self.texture = Some(texture);
        self
    }

    /// Lets it evaluate `fuel` more expressions, whatever it has evaluated so far.
    pub fn refill(&mut self, fuel: u64) {
        self.fuel = self.executed.saturating_add(fuel);
    }

    /// Expressions evaluated so far, turns of loops included.
    pub fn executed(&self) -> u64 {
        self.executed
    }

    /// What was executed so far, by class.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for run in self.codes.iter().flat_map(|c| &c.runs) {
            counts.add(&run.counts, run.times);
        }
        counts
    }

    /// Calls function `id`.
    pub fn call(&mut self, id: FunctionId, args: Vec<Value<F>>) -> Result<Value<F>, OutOfFuel> {
        let code = self.known_code(id);
        self.start(code, &self.module.functions[id.index()], &args)
    }

    /// Calls a function that need not be in the module.
    pub fn run(&mut self, f: &'a Function, args: Vec<Value<F>>) -> Result<Value<F>, OutOfFuel> {
        let known = self.others.iter().find(|(g, _)| std::ptr::eq(*g, f));
        let code = match known {
            Some((_, code)) => *code,
            None => {
                let code = self.lower(f);
                self.others.push((f, code));
                code
            }
        };
        self.start(code, f, &args)
    }

    /// Runs a function without parameters once, for the values of some of its expressions, which
    /// stand in no block within another.
    pub fn values(&mut self, f: &Function, of: &[ExprId]) -> Result<Vec<Value<F>>, OutOfFuel> {
        let (code, places) = lower::lower(self.module, f, &self.outside, of, self.has_parts);
        self.codes.push(code);
        self.sources.push(None);
        self.execute(self.codes.len() - 1)?;
        let value = |(&id, mut at): (&ExprId, Place)| {
            let structs = &self.module.structs;
            self.stack.read(f.ty(id), structs, &mut at)
        };
        Ok(of.iter().zip(places).map(value).collect())
    }

    fn known_code(&mut self, id: FunctionId) -> usize {
        if let Some(code) = self.known[id.index()] {
            return code;
        }
        let code = self.lower(&self.module.functions[id.index()]);
        self.known[id.index()] = Some(code);
        code
    }

    /// The code that a call goes to.
    fn callee(&mut self, caller: usize, call: usize) -> usize {
        let made = self.codes[caller].calls[call];
        if let Some(known) = made.code {
            return known;
        }
        let code = if self.apart {
            let code = self.lower(&self.module.functions[made.function.index()]);
            self.codes[code].caller = Some((caller, made.expr));
            code
        } else {
            self.known_code(made.function)
        };
        self.codes[caller].calls[call].code = Some(code);
        code
    }

    fn lower(&mut self, f: &'a Function) -> usize {
        let (code, _) = lower::lower(self.module, f, &self.outside, &[], self.has_parts);
        self.codes.push(code);
        self.sources.push(Some(f));
        self.codes.len() - 1
    }

    fn start(
        &mut self,
        code: usize,
        f: &Function,
        args: &[Value<F>],
    ) -> Result<Value<F>, OutOfFuel> {
        let structs = &self.module.structs;
        let mut given = Numbers::new();
        for (i, param) in f.params.iter().enumerate() {
            given.push(args.get(i), param.ty, structs);
        }
        self.stack.reserve(given.len());
        self.stack.put(Place::default(), &given);
        self.execute(code)?;
        let mut at = self.codes[code].result.0;
        Ok(self.stack.read(f.result, structs, &mut at))
    }

    /// Runs code whose arguments begin the stack, and what it calls.
    fn execute(&mut self, mut code: usize) -> Result<(), OutOfFuel> {
        let mut waiting: Vec<Waiting> = Vec::new();
        let (mut base, mut next) = (Place::default(), 0);
        self.enter(code, base);
        loop {
            match self.step(code, base, next)? {
                Stop::Call {
                    call,
                    frame,
                    to,
                    next,
                } => {
                    waiting.push(Waiting {
                        code,
                        next,
                        base,
                        to: base.plus(to),
                    });
                    code = self.callee(code, call as usize);
                    base = base.plus(frame);
                    self.enter(code, base);
                }
                Stop::Return => {
                    let Some(caller) = waiting.pop() else {
                        return Ok(());
                    };
                    let (result, size) = self.codes[code].result;
                    self.stack.copy(base.plus(result), caller.to, size);
                    Waiting {
                        code,
                        next,
                        base,
                        ..
                    } = caller;
                    continue;
                }
            }
            next = 0;
        }
    }

    /// Prepares the frame at `base`.
    fn enter(&mut self, code: usize, base: Place) {
        let code = &self.codes[code];
        self.stack.reserve(base.plus(code.size));
        self.stack.put(base.plus(code.image_at), &code.image);
    }

    /// Runs code from instruction `next` on, up to a call or its end.
    fn step(&mut self, code: usize, base: Place, mut next: usize) -> Result<Stop, OutOfFuel> {
        let Code {
            instructions, runs, ..
        } = &mut self.codes[code];
        let floats = &mut self.stack.floats[base.floats as usize..];
        let ints = &mut self.stack.ints[base.ints as usize..];
        while let Some(ins) = instructions.get(next) {
            next += 1;
            match ins {
                Ins::Op(kernel, at) => kernel(floats, ints, at),
                Ins::Float { from, to } => floats[*to as usize] = floats[*from as usize],
                Ins::Floats { from, to, count } => {
                    floats.copy_within(range(*from, *count), *to as usize);
                }
                Ins::Ints { from, to, count } => {
                    ints.copy_within(range(*from, *count), *to as usize);
                }
                Ins::Fill { from, to, count } => {
                    let x = floats[*from as usize];
                    floats[range(*to, *count)].fill(x);
                }
                Ins::Set { to, value } => ints[*to as usize] = *value,
                Ins::Run(index) => {
                    let run = &mut runs[*index as usize];
                    run.times += 1;
                    self.executed += u64::from(run.executed);
                    if self.executed > self.fuel {
                        return Err(OutOfFuel);
                    }
                }
                Ins::Jump(to) => next = *to as usize,
                Ins::Unless(cond, to) => {
                    if ints[*cond as usize] == 0 {
                        next = *to as usize;
                    }
                }
                Ins::Below { counter, end, exit } => {
                    if ints[*counter as usize] >= ints[*end as usize] {
                        next = *exit as usize;
                    }
                }
                Ins::Next { counter, top } => {
                    ints[*counter as usize] += 1;
                    next = *top as usize;
                }
                Ins::Texture {
                    op,
                    wide,
                    kernel,
                    at,
                } => match self.texture {
                    Some(texture) => fetch(texture, *op, *wide, floats, ints, at),
                    None => kernel(floats, ints, at),
                },
                Ins::Call { call, frame, to } => {
                    return Ok(Stop::Call {
                        call: *call,
                        frame: *frame,
                        to: *to,
                        next,
                    });
                }
                Ins::Return => return Ok(Stop::Return),
            }
        }
        Ok(Stop::Return)
    }
}

fn range(start: u32, count: u32) -> std::ops::Range<usize> {
    start as usize..(start + count) as usize
}

/// Looks up a texture: its index is an int, its coordinates two floats, which those of the width
/// follow if it is `wide`; what its mode is, if it has one, another int.
fn fetch<F: Real>(
    texture: &TextureLookup<'_>,
    op: Op,
    wide: bool,
    floats: &mut [F],
    ints: &[i32],
    at: &Operands,
) {
    let [index, uv, mode] = at.from.map(|i| i as usize);
    let pair = |first: usize| [floats[first].f64(), floats[first + 1].f64()];
    let rgba = texture(&TextureRequest {
        texture: ints[index].max(0) as usize,
        op,
        uv: pair(uv),
        width: if wide { pair(uv + 2) } else { [0.0; 2] },
        mode: if op.arity() == 3 { ints[mode] } else { 0 },
    });
    for (c, x) in rgba[op.texel_part()].iter().enumerate() {
        floats[at.to as usize + c] = F::of(*x);
    }
}
