//! From naga's IR of a kernel to code that the interpreter runs: where everything lies, which
//! functions are needed, and statements. Expressions are in `expressions`.

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    AddressSpace, Arena, AtomicFunction, Expression, Handle, Literal, Module, ScalarKind,
    Statement, SwitchValue, TypeInner,
};

use crate::code::{Block, Case, Code, Function, Ins, Node, Pointer, Slot};
use crate::error::TraceError;
use crate::float::{Float, signed};
use crate::ops::{self, Fn2};
use crate::shape::{Place, Shapes, kind};
use crate::signature::Signature;

/// What the functions of a kernel share.
pub(super) struct Shared<'m> {
    pub shapes: Shapes<'m>,
    /// Names of functions that the host looks at or answers.
    hooks: &'m [&'m str],
    /// By the index of a global variable: where it is.
    pub globals: Vec<Option<Pointer>>,
    pub layouts: Vec<Vec<Place>>,
}

/// Makes code of a validated kernel. Functions in `hooks` are known by their place there to the host,
/// which answers those from `answered` on, so that their bodies are left out.
pub(super) fn lower<F: Float>(
    module: &Module,
    info: &ModuleInfo,
    hooks: &[&str],
    answered: &[usize],
) -> Result<Code, TraceError> {
    let shapes = Shapes(module);
    let mut shared = Shared {
        shapes,
        hooks,
        globals: Vec::new(),
        layouts: Vec::new(),
    };
    let (private, buffers) = place_globals::<F>(&mut shared)?;
    let entry = module.entry_points.first();
    let entry = entry.ok_or_else(|| unsupported("kernel without an entry point", "main"))?;
    let is_answered = |function: &naga::Function| {
        let hook = hook_of(function, hooks);
        hook.is_some_and(|hook| answered.contains(&hook))
    };
    let mut reached = vec![false; module.functions.len()];
    mark_calls(&entry.function.body, &mut reached);
    for (handle, function) in module.functions.iter().rev() {
        if reached[handle.index()] && !is_answered(function) {
            mark_calls(&function.body, &mut reached);
        }
    }
    let mut functions = Vec::new();
    let mut signatures = vec![None; hooks.len()];
    for (handle, function) in module.functions.iter() {
        if let Some(hook) = hook_of(function, hooks).filter(|_| reached[handle.index()]) {
            signatures[hook] = Some(Signature::of(function, shapes));
        }
        let lowered = if reached[handle.index()] {
            let lowering = Lowering::<F>::new(&mut shared, function, &info[handle])?;
            Some(lowering.function(is_answered(function))?)
        } else {
            None
        };
        functions.push(lowered);
    }
    let main = Lowering::<F>::new(&mut shared, &entry.function, info.get_entry_point(0))?;
    let main = main.function(false)?;
    Ok(Code {
        functions,
        main,
        private,
        buffers,
        layouts: shared.layouts,
        signatures,
    })
}

fn hook_of(function: &naga::Function, hooks: &[&str]) -> Option<usize> {
    let name = function.name.as_deref()?;
    hooks.iter().position(|hook| *hook == name)
}

pub(super) fn unsupported(what: &str, function: &str) -> TraceError {
    TraceError::Unsupported {
        what: what.to_owned(),
        function: function.to_owned(),
    }
}

/// Gives every module-scope variable a place: the first values of those of the invocation, and the
/// names of buffers.
fn place_globals<F: Float>(shared: &mut Shared<'_>) -> Result<(Vec<u64>, Vec<String>), TraceError> {
    let module = shared.shapes.0;
    let (mut private, mut buffers) = (Vec::new(), Vec::new());
    for (_, variable) in module.global_variables.iter() {
        let name = variable.name.clone().unwrap_or_default();
        let ty = shared.shapes.inner(variable.ty);
        shared.globals.push(match variable.space {
            // A workgroup of one thread has its memory for itself.
            AddressSpace::Private | AddressSpace::WorkGroup => {
                let at = private.len() as u32;
                let cells = shared.shapes.cells(ty);
                let cells = cells.ok_or_else(|| unsupported("variable of this type", &name))?;
                match variable.init {
                    Some(init) => {
                        let value = constant::<F>(shared.shapes, &module.global_expressions, init);
                        let value = value.ok_or_else(|| unsupported("first value", &name))?;
                        private.extend(value);
                    }
                    None => private.resize(private.len() + cells as usize, 0),
                }
                Some(Pointer::Private(at))
            }
            AddressSpace::Uniform | AddressSpace::Storage { .. } => {
                buffers.push(name);
                Some(Pointer::Buffer {
                    buffer: buffers.len() as u32 - 1,
                    offset: 0,
                    index: None,
                })
            }
            _ => None,
        });
    }
    Ok((private, buffers))
}

/// The cells of a constant expression; `None` if it is none.
pub(super) fn constant<F: Float>(
    shapes: Shapes<'_>,
    arena: &Arena<Expression>,
    expression: Handle<Expression>,
) -> Option<Vec<u64>> {
    let module = shapes.0;
    match &arena[expression] {
        Expression::Literal(literal) => Some(vec![self::literal::<F>(*literal)?]),
        Expression::Constant(handle) => {
            let init = module.constants[*handle].init;
            constant::<F>(shapes, &module.global_expressions, init)
        }
        Expression::ZeroValue(ty) => Some(vec![0; shapes.cells(shapes.inner(*ty))? as usize]),
        Expression::Compose { components, .. } => {
            let parts = components.iter().map(|c| constant::<F>(shapes, arena, *c));
            Some(parts.collect::<Option<Vec<_>>>()?.concat())
        }
        Expression::Splat { size, value } => {
            let value = constant::<F>(shapes, arena, *value)?;
            Some(vec![*value.first()?; *size as usize])
        }
        _ => None,
    }
}

fn literal<F: Float>(literal: Literal) -> Option<u64> {
    match literal {
        Literal::F32(x) => Some(F::of_single(x).cell()),
        Literal::U32(x) => Some(x.into()),
        Literal::I32(x) => Some(signed(x)),
        Literal::Bool(x) => Some(x.into()),
        _ => None,
    }
}

/// Marks the functions that a block calls.
fn mark_calls(block: &naga::Block, reached: &mut [bool]) {
    for statement in block {
        match statement {
            Statement::Call { function, .. } => reached[function.index()] = true,
            Statement::Block(inner) => mark_calls(inner, reached),
            Statement::If { accept, reject, .. } => {
                mark_calls(accept, reached);
                mark_calls(reject, reached);
            }
            Statement::Switch { cases, .. } => {
                cases
                    .iter()
                    .for_each(|case| mark_calls(&case.body, reached));
            }
            Statement::Loop {
                body, continuing, ..
            } => {
                mark_calls(body, reached);
                mark_calls(continuing, reached);
            }
            _ => {}
        }
    }
}

/// The lowering of one function.
pub(super) struct Lowering<'s, 'm, F> {
    pub shared: &'s mut Shared<'m>,
    pub shapes: Shapes<'m>,
    pub source: &'m naga::Function,
    pub info: &'m FunctionInfo,
    pub name: String,
    /// The frame as it is when a call begins.
    pub image: Vec<u64>,
    /// Where the values of expressions are.
    pub slots: Vec<Option<Slot>>,
    /// Where those point to that are pointers.
    pub pointers: Vec<Option<Pointer>>,
    arguments: Vec<Slot>,
    locals: Vec<Slot>,
    floats: std::marker::PhantomData<F>,
}

impl<'s, 'm, F: Float> Lowering<'s, 'm, F> {
    fn new(
        shared: &'s mut Shared<'m>,
        source: &'m naga::Function,
        info: &'m FunctionInfo,
    ) -> Result<Self, TraceError> {
        let expressions = source.expressions.len();
        let mut this = Self {
            shapes: shared.shapes,
            shared,
            source,
            info,
            name: source.name.clone().unwrap_or_else(|| "main".into()),
            image: Vec::new(),
            slots: vec![None; expressions],
            pointers: vec![None; expressions],
            arguments: Vec::new(),
            locals: Vec::new(),
            floats: std::marker::PhantomData,
        };
        for argument in &source.arguments {
            let cells = this.cells(this.shapes.inner(argument.ty))?;
            let slot = this.room(cells);
            this.arguments.push(slot);
        }
        Ok(this)
    }

    fn function(mut self, answered: bool) -> Result<Function, TraceError> {
        let arguments = self.image.len() as u32;
        let result = self.source.result.as_ref();
        let result = result.map(|result| self.cells(self.shapes.inner(result.ty)));
        let result = result.transpose()?.unwrap_or(0);
        let body = if answered {
            Vec::new()
        } else {
            self.place_locals()?;
            self.block(&self.source.body)?
        };
        // There must be room for a result even if the function does not end by a return.
        let least = self.image.len().max(result as usize);
        self.image.resize(least, 0);
        Ok(Function {
            hook: hook_of(self.source, self.shared.hooks),
            name: self.name,
            image: self.image,
            arguments,
            result,
            body,
        })
    }

    fn place_locals(&mut self) -> Result<(), TraceError> {
        for (_, variable) in self.source.local_variables.iter() {
            let cells = self.cells(self.shapes.inner(variable.ty))?;
            let slot = self.room(cells);
            self.locals.push(slot);
            if let Some(init) = variable.init {
                let value = constant::<F>(self.shapes, &self.source.expressions, init);
                let value = value.ok_or_else(|| self.unsupported("first value of a variable"))?;
                self.image[slot as usize..][..value.len()].copy_from_slice(&value);
            }
        }
        Ok(())
    }

    pub(super) fn unsupported(&self, what: &str) -> TraceError {
        unsupported(what, &self.name)
    }

    pub(super) fn cells(&self, ty: &TypeInner) -> Result<u32, TraceError> {
        let cells = self.shapes.cells(ty);
        cells.ok_or_else(|| self.unsupported("value of this type"))
    }

    /// New cells of the frame.
    pub(super) fn room(&mut self, cells: u32) -> Slot {
        let at = self.image.len();
        self.image.resize(at + cells as usize, 0);
        at as Slot
    }

    pub(super) fn ty(&self, expression: Handle<Expression>) -> &'m TypeInner {
        self.info[expression].ty.inner_with(&self.shapes.0.types)
    }

    /// The kind of an expression's numbers.
    pub(super) fn kind(&self, expression: Handle<Expression>) -> Result<ScalarKind, TraceError> {
        let kind = kind(self.ty(expression));
        kind.ok_or_else(|| self.unsupported("number of this type"))
    }

    /// Where the value of an expression is. Constants get their place when they are first used.
    pub(super) fn slot(&mut self, expression: Handle<Expression>) -> Result<Slot, TraceError> {
        if let Some(slot) = self.slots[expression.index()] {
            return Ok(slot);
        }
        let slot = match &self.source.expressions[expression] {
            Expression::FunctionArgument(index) => self.arguments[*index as usize],
            other => {
                let value = constant::<F>(self.shapes, &self.source.expressions, expression);
                let value = value.ok_or_else(|| self.unsupported(&word(other)))?;
                let slot = self.room(value.len() as u32);
                self.image[slot as usize..][..value.len()].copy_from_slice(&value);
                slot
            }
        };
        self.slots[expression.index()] = Some(slot);
        Ok(slot)
    }

    /// Where a pointer points to.
    pub(super) fn pointer(&self, expression: Handle<Expression>) -> Result<Pointer, TraceError> {
        if let Some(pointer) = self.pointers[expression.index()] {
            return Ok(pointer);
        }
        let pointer = match &self.source.expressions[expression] {
            Expression::LocalVariable(variable) => {
                Some(Pointer::Frame(self.locals[variable.index()]))
            }
            Expression::GlobalVariable(variable) => self.shared.globals[variable.index()],
            Expression::FunctionArgument(index) => Some(Pointer::Cell {
                slot: self.arguments[*index as usize],
                offset: 0,
            }),
            _ => None,
        };
        pointer.ok_or_else(|| self.unsupported(&word(&self.source.expressions[expression])))
    }

    /// The layout in buffers of the values of a type, if the pointer is into one.
    pub(super) fn layout(&mut self, pointer: Pointer, ty: &TypeInner) -> Result<u32, TraceError> {
        if !matches!(pointer, Pointer::Buffer { .. }) {
            return Ok(0);
        }
        let places = self.shapes.places(ty);
        let places = places.ok_or_else(|| self.unsupported("value of this type in a buffer"))?;
        self.shared.layouts.push(places);
        Ok(self.shared.layouts.len() as u32 - 1)
    }

    fn block(&mut self, block: &naga::Block) -> Result<Block, TraceError> {
        let mut out = Vec::new();
        for statement in block {
            self.statement(statement, &mut out)?;
        }
        Ok(out)
    }

    fn statement(&mut self, statement: &Statement, out: &mut Block) -> Result<(), TraceError> {
        match statement {
            Statement::Emit(range) => {
                for expression in range.clone() {
                    self.emit(expression, out)?;
                }
            }
            Statement::Block(inner) => out.push(Node::Block(self.block(inner)?)),
            Statement::If {
                condition,
                accept,
                reject,
            } => out.push(Node::If {
                condition: self.slot(*condition)?,
                accept: self.block(accept)?,
                reject: self.block(reject)?,
            }),
            Statement::Switch { selector, cases } => {
                let selector = self.slot(*selector)?;
                let cases = cases.iter().map(|case| {
                    Ok(Case {
                        value: match case.value {
                            SwitchValue::I32(value) => Some(value as u32),
                            SwitchValue::U32(value) => Some(value),
                            SwitchValue::Default => None,
                        },
                        body: self.block(&case.body)?,
                        falls_through: case.fall_through,
                    })
                });
                let cases = cases.collect::<Result<_, TraceError>>()?;
                out.push(Node::Switch { selector, cases });
            }
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => {
                let (body, continuing) = (self.block(body)?, self.block(continuing)?);
                let break_if = break_if.map(|e| self.slot(e)).transpose()?;
                out.push(Node::Loop {
                    body,
                    continuing,
                    break_if,
                });
            }
            Statement::Break => out.push(Node::Break),
            Statement::Continue => out.push(Node::Continue),
            Statement::Return { value } => {
                out.push(Node::Return(value.map(|e| self.slot(e)).transpose()?));
            }
            // One thread has nobody to wait for.
            Statement::ControlBarrier(_) | Statement::MemoryBarrier(_) => {}
            Statement::Store { pointer, value } => self.store(*pointer, *value, out)?,
            Statement::Atomic {
                pointer,
                fun,
                value,
                result,
            } => self.atomic(*pointer, fun, *value, *result, out)?,
            Statement::Call {
                function,
                arguments,
                result,
            } => self.call(function.index(), arguments, *result, out)?,
            other => return Err(self.unsupported(&word(other))),
        }
        Ok(())
    }

    fn store(
        &mut self,
        pointer: Handle<Expression>,
        value: Handle<Expression>,
        out: &mut Block,
    ) -> Result<(), TraceError> {
        let (at, ty) = (self.pointer(pointer)?, self.shapes.behind(self.ty(pointer)));
        let ins = Ins::Store {
            pointer: at,
            layout: self.layout(at, &ty)?,
            count: self.cells(&ty)?,
            from: self.slot(value)?,
        };
        out.push(Node::Ins(ins));
        Ok(())
    }

    fn atomic(
        &mut self,
        pointer: Handle<Expression>,
        function: &AtomicFunction,
        value: Handle<Expression>,
        result: Option<Handle<Expression>>,
        out: &mut Block,
    ) -> Result<(), TraceError> {
        let kind = self.kind(value)?;
        let f: Option<Fn2> = match function {
            AtomicFunction::Add => ops::binary::<F>(naga::BinaryOperator::Add, kind),
            AtomicFunction::Subtract => ops::binary::<F>(naga::BinaryOperator::Subtract, kind),
            AtomicFunction::And => ops::binary::<F>(naga::BinaryOperator::And, kind),
            AtomicFunction::ExclusiveOr => {
                ops::binary::<F>(naga::BinaryOperator::ExclusiveOr, kind)
            }
            AtomicFunction::InclusiveOr => {
                ops::binary::<F>(naga::BinaryOperator::InclusiveOr, kind)
            }
            AtomicFunction::Min => ops::math2::<F>(naga::MathFunction::Min, kind),
            AtomicFunction::Max => ops::math2::<F>(naga::MathFunction::Max, kind),
            AtomicFunction::Exchange { compare: None } => Some(|_, new| new),
            AtomicFunction::Exchange { .. } => None,
        };
        let f = f.ok_or_else(|| self.unsupported(&format!("atomic {}", word(function))))?;
        let pointer = self.pointer(pointer)?;
        if !matches!(pointer, Pointer::Buffer { .. }) {
            return Err(self.unsupported("atomic variable outside of buffers"));
        }
        let value = self.slot(value)?;
        let to = result.map(|result| {
            let to = self.room(1);
            self.slots[result.index()] = Some(to);
            to
        });
        out.push(Node::Ins(Ins::Atomic {
            f,
            pointer,
            value,
            to,
        }));
        Ok(())
    }

    fn call(
        &mut self,
        function: usize,
        arguments: &[Handle<Expression>],
        result: Option<Handle<Expression>>,
        out: &mut Block,
    ) -> Result<(), TraceError> {
        let mut given = Vec::new();
        for argument in arguments {
            let ty = self.ty(*argument);
            let is_pointer = ty.pointer_space().is_some();
            let place = if is_pointer {
                let pointer = self.pointer(*argument)?;
                if matches!(pointer, Pointer::Buffer { .. }) {
                    return Err(self.unsupported("pointer into a buffer as an argument"));
                }
                let to = self.room(1);
                out.push(Node::Ins(Ins::Address { pointer, to }));
                (to, 1)
            } else {
                (self.slot(*argument)?, self.cells(ty)?)
            };
            given.push(place);
        }
        let to = match result {
            Some(result) => {
                let to = self.room(self.cells(self.ty(result))?);
                self.slots[result.index()] = Some(to);
                Some(to)
            }
            None => None,
        };
        out.push(Node::Call {
            function: function as u32,
            arguments: given,
            to,
        });
        Ok(())
    }
}

/// What naga calls something: the first word of how it would be printed.
pub(super) fn word(thing: &impl std::fmt::Debug) -> String {
    let text = format!("{thing:?}");
    text.chars().take_while(|c| c.is_alphanumeric()).collect()
}
