//! The interpreter: runs IR on the CPU in f32 or f64.
//!
//! In f64 it is the oracle of the numerics tests; in f32 it rounds where the GPU rounds. It also
//! evaluates what must be known before rendering (parameter values, uniform emission). Work is
//! bounded by a number of evaluated expressions, so no input can make it hang.

use super::value::{Floats, Real, Value};
use super::{Block, Const, ExprId, ExprKind, Function, FunctionId, Module, Stmt};
use crate::ops::{self, Op};

/// Looks up a texture: index, u, v, color or data; gives RGBA.
pub type TextureLookup<'a> = dyn Fn(usize, f64, f64, Op) -> [f64; 4] + 'a;

/// Runs functions of one module.
pub struct Interpreter<'a, F> {
    module: &'a Module,
    /// Values of the material's parameters.
    uniforms: Vec<Value<F>>,
    texture: Option<&'a TextureLookup<'a>>,
    /// Expressions that may still be evaluated.
    fuel: u64,
    /// Expressions evaluated so far.
    executed: u64,
}

/// The work limit was reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfFuel;

/// How a block ended.
enum Flow {
    Next,
    Break,
    Continue,
}

struct Frame<F> {
    params: Vec<Value<F>>,
    locals: Vec<Value<F>>,
    values: Vec<Option<Value<F>>>,
}

impl<'a, F: Real> Interpreter<'a, F> {
    /// An interpreter that evaluates at most `fuel` expressions.
    pub fn new(module: &'a Module, fuel: u64) -> Self {
        Self {
            module,
            uniforms: Vec::new(),
            texture: None,
            fuel,
            executed: 0,
        }
    }

    /// Sets the material's parameters.
    pub fn with_uniforms(mut self, uniforms: &[Const]) -> Self {
        self.uniforms = uniforms.iter().map(Value::constant).collect();
        self
    }

    /// Sets what texture lookups give; without it they give 0.5.
    pub fn with_texture(mut self, texture: &'a TextureLookup<'a>) -> Self {
        self.texture = Some(texture);
        self
    }

    /// Expressions evaluated so far.
    pub fn executed(&self) -> u64 {
        self.executed
    }

    /// Calls function `id`.
    pub fn call(&mut self, id: FunctionId, args: Vec<Value<F>>) -> Result<Value<F>, OutOfFuel> {
        self.run(&self.module.functions[id.index()], args)
    }

    /// Calls a function that need not be in the module.
    pub fn run(&mut self, f: &Function, args: Vec<Value<F>>) -> Result<Value<F>, OutOfFuel> {
        let locals = f
            .locals
            .iter()
            .map(|l| Value::zero(l.ty, &self.module.structs))
            .collect();
        let mut frame = Frame {
            params: args,
            locals,
            values: vec![None; f.exprs.len()],
        };
        self.block(f, &mut frame, &f.body)?;
        Ok(self.get(f, &frame, f.value))
    }

    fn block(
        &mut self,
        f: &Function,
        frame: &mut Frame<F>,
        block: &Block,
    ) -> Result<Flow, OutOfFuel> {
        for stmt in block {
            match self.stmt(f, frame, stmt)? {
                Flow::Next => {}
                other => return Ok(other),
            }
        }
        Ok(Flow::Next)
    }

    fn stmt(&mut self, f: &Function, frame: &mut Frame<F>, stmt: &Stmt) -> Result<Flow, OutOfFuel> {
        match stmt {
            Stmt::Eval(id) => {
                let value = self.eval(f, frame, *id)?;
                frame.values[id.index()] = Some(value);
            }
            Stmt::Store(local, part, value) => {
                let value = self.get(f, frame, *value);
                store(&mut frame.locals[local.index()], *part, value);
            }
            Stmt::If(cond, then, otherwise) => {
                let taken = if self.get(f, frame, *cond).as_bool() {
                    then
                } else {
                    otherwise
                };
                return self.block(f, frame, taken);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let (low, high) = (
                    self.get(f, frame, *low).as_int(),
                    self.get(f, frame, *high).as_int(),
                );
                for i in low..high {
                    self.burn()?;
                    frame.locals[local.index()] = Value::Int(i);
                    if let Flow::Break = self.block(f, frame, body)? {
                        break;
                    }
                }
            }
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => {
                for _ in 0..*limit {
                    self.burn()?;
                    self.block(f, frame, head)?;
                    if !self.get(f, frame, *test).as_bool() {
                        break;
                    }
                    if let Flow::Break = self.block(f, frame, body)? {
                        break;
                    }
                }
            }
            Stmt::Break => return Ok(Flow::Break),
            Stmt::Continue => return Ok(Flow::Continue),
        }
        Ok(Flow::Next)
    }

    fn burn(&mut self) -> Result<(), OutOfFuel> {
        self.executed += 1;
        if self.executed > self.fuel {
            Err(OutOfFuel)
        } else {
            Ok(())
        }
    }

    /// The value of an expression that is free or was evaluated.
    fn get(&self, f: &Function, frame: &Frame<F>, id: ExprId) -> Value<F> {
        match &f.expr(id).kind {
            ExprKind::Const(c) => Value::constant(c),
            ExprKind::Param(i) => frame.params[*i as usize].clone(),
            ExprKind::Uniform(i) => self.uniforms[*i as usize].clone(),
            _ => match &frame.values[id.index()] {
                Some(value) => value.clone(),
                None => Value::zero(f.ty(id), &self.module.structs),
            },
        }
    }

    fn eval(
        &mut self,
        f: &Function,
        frame: &mut Frame<F>,
        id: ExprId,
    ) -> Result<Value<F>, OutOfFuel> {
        self.burn()?;
        let e = f.expr(id);
        let args: Vec<Value<F>> = e
            .kind
            .operands()
            .iter()
            .map(|&a| self.get(f, frame, a))
            .collect();
        Ok(match &e.kind {
            ExprKind::Op(op @ (Op::Image | Op::ImageData), _) => self.texture(*op, &args),
            ExprKind::Op(op, _) => ops::evaluate(*op, &args),
            ExprKind::Load(local) => frame.locals[local.index()].clone(),
            ExprKind::Compose(_) => compose(e.ty, &args),
            ExprKind::Swizzle(_, components) => {
                let v = args[0].components();
                let picked: Vec<F> = components.iter().map(|&c| v[usize::from(c)]).collect();
                Value::Floats(Floats::new(&picked))
            }
            ExprKind::Call(callee, _) => self.call(*callee, args)?,
            ExprKind::Make(..) => Value::Struct(args),
            ExprKind::Field(_, i) => args[0]
                .field(*i as usize)
                .cloned()
                .unwrap_or(Value::float(0.0)),
            ExprKind::Const(_) | ExprKind::Param(_) | ExprKind::Uniform(_) => {
                self.get(f, frame, id)
            }
        })
    }

    fn texture(&self, op: Op, args: &[Value<F>]) -> Value<F> {
        let Some(texture) = self.texture else {
            return ops::evaluate(op, args);
        };
        let uv = args[1].to_f64();
        let rgba = texture(args[0].as_int().max(0) as usize, uv[0], uv[1], op);
        Value::vector(if op == Op::Image { &rgba[..3] } else { &rgba })
    }
}

fn store<F: Real>(place: &mut Value<F>, part: Option<u8>, value: Value<F>) {
    match (part, place) {
        (Some(part), Value::Floats(v)) => v.as_mut_slice()[usize::from(part)] = value.as_float(),
        (_, place) => *place = value,
    }
}

fn compose<F: Real>(ty: super::Type, parts: &[Value<F>]) -> Value<F> {
    let components: Vec<F> = parts
        .iter()
        .flat_map(|p| p.components().iter().copied())
        .collect();
    if ty == super::Type::Mat3 {
        let column = |c: usize| {
            [
                components[3 * c],
                components[3 * c + 1],
                components[3 * c + 2],
            ]
        };
        return Value::Mat3([column(0), column(1), column(2)]);
    }
    match components.as_slice() {
        [x] => Value::Floats(Floats::new(&vec![*x; ty.width().unwrap_or(1)])),
        all => Value::Floats(Floats::new(all)),
    }
}
