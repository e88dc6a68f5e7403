//! From naga's IR of a kernel to code: where everything lies, which functions are needed, and statements.
//! Expressions are in `expressions`.

use naga::valid::{FunctionInfo, ModuleInfo};
use std::collections::HashMap;

use naga::{
    AddressSpace, Arena, AtomicFunction, BinaryOperator, Expression, Handle, Literal, MathFunction,
    Module, ScalarKind, Statement, SwitchValue, TypeInner,
};

mod expressions;

use crate::code::{
    Atomic, Block, Case, Code, Function, Input, Ins, Node, Op, Pointer, Scalar, Slot,
};
use crate::error::KernelError;
use crate::shape::{Place, Shapes, kind};

/// What the functions of a kernel share.
struct Shared<'m> {
    pub shapes: Shapes<'m>,
    /// Names of functions that the host looks at or answers.
    hooks: &'m [&'m str],
    /// By the index of a global variable: where it is.
    pub globals: Vec<Option<Pointer>>,
    pub layouts: Vec<Vec<Place>>,
    /// Every operation so far, and where it is among those of the code.
    ops: HashMap<Op, u32>,
    has_barriers: bool,
}

/// Makes code of a validated kernel. Functions in `hooks` are known by their place there to the host,
/// which answers those from `answered` on, so that their bodies are left out.
pub fn lower(
    module: &Module,
    info: &ModuleInfo,
    hooks: &[&str],
    answered: &[usize],
) -> Result<Code, KernelError> {
    let shapes = Shapes(module);
    let mut shared = Shared {
        shapes,
        hooks,
        globals: Vec::new(),
        layouts: Vec::new(),
        ops: HashMap::new(),
        has_barriers: false,
    };
    let (private, buffers) = place_globals(&mut shared)?;
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
    for (handle, function) in module.functions.iter() {
        let lowered = if reached[handle.index()] {
            let lowering = Lowering::new(&mut shared, function, &info[handle])?;
            Some(lowering.function(is_answered(function))?)
        } else {
            None
        };
        functions.push(lowered);
    }
    let main = Lowering::new(&mut shared, &entry.function, info.get_entry_point(0))?;
    let main = main.function(false)?;
    let mut ops: Vec<(Op, u32)> = shared.ops.into_iter().collect();
    ops.sort_by_key(|(_, index)| *index);
    Ok(Code {
        functions,
        main,
        inputs: inputs(shapes, &entry.function),
        workgroup: entry.workgroup_size.iter().product(),
        has_barriers: shared.has_barriers,
        private,
        buffers,
        layouts: shared.layouts,
        ops: ops.into_iter().map(|(op, _)| op).collect(),
    })
}

/// What each cell of the entry point's arguments is.
fn inputs(shapes: Shapes<'_>, function: &naga::Function) -> Vec<Input> {
    let of = |argument: &naga::FunctionArgument| {
        let built_in = match argument.binding {
            Some(naga::Binding::BuiltIn(built_in)) => Some(built_in),
            _ => None,
        };
        let cells = shapes.cells(shapes.inner(argument.ty)).unwrap_or(0);
        (0..cells).map(move |component| Input {
            built_in,
            component,
        })
    };
    function.arguments.iter().flat_map(of).collect()
}

fn hook_of(function: &naga::Function, hooks: &[&str]) -> Option<usize> {
    let name = function.name.as_deref()?;
    hooks.iter().position(|hook| *hook == name)
}

fn unsupported(what: &str, function: &str) -> KernelError {
    KernelError::unsupported(what, function)
}

/// Gives every module-scope variable a place: the first values of those of the invocation, and the
/// names of buffers.
fn place_globals(shared: &mut Shared<'_>) -> Result<(Vec<Scalar>, Vec<String>), KernelError> {
    let module = shared.shapes.0;
    let (mut private, mut buffers) = (Vec::new(), Vec::new());
    for (_, variable) in module.global_variables.iter() {
        let name = variable.name.clone().unwrap_or_default();
        let ty = shared.shapes.inner(variable.ty);
        shared.globals.push(match variable.space {
            // A workgroup of one thread has its memory for itself.
            AddressSpace::Private | AddressSpace::WorkGroup => {
                let at = private.len() as u32;
                match variable.init {
                    Some(init) => {
                        let value = constant(shared.shapes, &module.global_expressions, init);
                        let value = value.ok_or_else(|| unsupported("first value", &name))?;
                        private.extend(value);
                    }
                    None => {
                        let zero = shared.shapes.zero(ty);
                        let zero = zero.ok_or_else(|| unsupported("variable of this type", &name));
                        private.extend(zero?);
                    }
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
fn constant(
    shapes: Shapes<'_>,
    arena: &Arena<Expression>,
    expression: Handle<Expression>,
) -> Option<Vec<Scalar>> {
    let module = shapes.0;
    match &arena[expression] {
        Expression::Literal(literal) => Some(vec![self::literal(*literal)?]),
        Expression::Constant(handle) => {
            let init = module.constants[*handle].init;
            constant(shapes, &module.global_expressions, init)
        }
        Expression::ZeroValue(ty) => shapes.zero(shapes.inner(*ty)),
        Expression::Compose { components, .. } => {
            let parts = components.iter().map(|c| constant(shapes, arena, *c));
            Some(parts.collect::<Option<Vec<_>>>()?.concat())
        }
        Expression::Splat { size, value } => {
            let value = constant(shapes, arena, *value)?;
            Some(vec![*value.first()?; *size as usize])
        }
        _ => None,
    }
}

fn literal(literal: Literal) -> Option<Scalar> {
    match literal {
        Literal::F32(x) => Some(Scalar::Float(x)),
        Literal::U32(x) => Some(Scalar::Word(x)),
        Literal::I32(x) => Some(Scalar::Word(x as u32)),
        Literal::Bool(x) => Some(Scalar::Bool(x)),
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
struct Lowering<'s, 'm> {
    pub shared: &'s mut Shared<'m>,
    pub shapes: Shapes<'m>,
    pub source: &'m naga::Function,
    pub info: &'m FunctionInfo,
    pub name: String,
    /// The frame as it is when a call begins.
    pub image: Vec<Scalar>,
    /// Where the values of expressions are.
    pub slots: Vec<Option<Slot>>,
    /// Where those point to that are pointers.
    pub pointers: Vec<Option<Pointer>>,
    arguments: Vec<Slot>,
    locals: Vec<Slot>,
    /// Where variables are, and how many cells each has.
    variables: Vec<(Slot, u32)>,
}

impl<'s, 'm> Lowering<'s, 'm> {
    fn new(
        shared: &'s mut Shared<'m>,
        source: &'m naga::Function,
        info: &'m FunctionInfo,
    ) -> Result<Self, KernelError> {
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
            variables: Vec::new(),
        };
        for argument in &source.arguments {
            let slot = this.room(this.shapes.inner(argument.ty))?;
            this.arguments.push(slot);
        }
        Ok(this)
    }

    fn function(mut self, answered: bool) -> Result<Function, KernelError> {
        let arguments = self.image.len() as u32;
        let result = self.source.result.as_ref();
        let result = result.map(|result| self.zero(self.shapes.inner(result.ty)));
        let result = result.transpose()?.unwrap_or_default();
        let body = if answered {
            Vec::new()
        } else {
            self.place_locals()?;
            self.block(&self.source.body)?
        };
        Ok(Function {
            hook: hook_of(self.source, self.shared.hooks),
            answered,
            name: self.name,
            image: self.image,
            arguments,
            result,
            variables: self.variables,
            body,
        })
    }

    fn place_locals(&mut self) -> Result<(), KernelError> {
        for (_, variable) in self.source.local_variables.iter() {
            let slot = self.room(self.shapes.inner(variable.ty))?;
            let cells = self.image.len() as Slot - slot;
            self.locals.push(slot);
            self.variables.push((slot, cells));
            if let Some(init) = variable.init {
                let value = constant(self.shapes, &self.source.expressions, init);
                let value = value.ok_or_else(|| self.unsupported("first value of a variable"))?;
                self.image[slot as usize..][..value.len()].copy_from_slice(&value);
            }
        }
        Ok(())
    }

    fn unsupported(&self, what: &str) -> KernelError {
        unsupported(what, &self.name)
    }

    fn cells(&self, ty: &TypeInner) -> Result<u32, KernelError> {
        let cells = self.shapes.cells(ty);
        cells.ok_or_else(|| self.unsupported("value of this type"))
    }

    fn zero(&self, ty: &TypeInner) -> Result<Vec<Scalar>, KernelError> {
        let zero = self.shapes.zero(ty);
        zero.ok_or_else(|| self.unsupported("value of this type"))
    }

    /// New cells of the frame, for a value of a type.
    fn room(&mut self, ty: &TypeInner) -> Result<Slot, KernelError> {
        let value = self.zero(ty)?;
        Ok(self.append(&value))
    }

    /// A new cell of the frame for a word.
    fn word(&mut self) -> Slot {
        self.append(&[Scalar::Word(0)])
    }

    /// The place of a value that the frame begins with.
    fn append(&mut self, value: &[Scalar]) -> Slot {
        let at = self.image.len();
        self.image.extend_from_slice(value);
        at as Slot
    }

    /// The place of an operation in the code.
    fn op(&mut self, op: Op) -> u32 {
        let next = self.shared.ops.len() as u32;
        *self.shared.ops.entry(op).or_insert(next)
    }

    fn ty(&self, expression: Handle<Expression>) -> &'m TypeInner {
        self.info[expression].ty.inner_with(&self.shapes.0.types)
    }

    /// The kind of an expression's numbers.
    fn kind(&self, expression: Handle<Expression>) -> Result<ScalarKind, KernelError> {
        let kind = kind(self.ty(expression));
        kind.ok_or_else(|| self.unsupported("number of this type"))
    }

    /// Where the value of an expression is. Constants get their place when they are first used.
    fn slot(&mut self, expression: Handle<Expression>) -> Result<Slot, KernelError> {
        if let Some(slot) = self.slots[expression.index()] {
            return Ok(slot);
        }
        let slot = match &self.source.expressions[expression] {
            Expression::FunctionArgument(index) => self.arguments[*index as usize],
            other => {
                let value = constant(self.shapes, &self.source.expressions, expression);
                let value = value.ok_or_else(|| self.unsupported(&word(other)))?;
                self.append(&value)
            }
        };
        self.slots[expression.index()] = Some(slot);
        Ok(slot)
    }

    /// Where a pointer points to.
    fn pointer(&self, expression: Handle<Expression>) -> Result<Pointer, KernelError> {
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
    fn layout(&mut self, pointer: Pointer, ty: &TypeInner) -> Result<u32, KernelError> {
        if !matches!(pointer, Pointer::Buffer { .. }) {
            return Ok(0);
        }
        let places = self.shapes.places(ty);
        let places = places.ok_or_else(|| self.unsupported("value of this type in a buffer"))?;
        self.shared.layouts.push(places);
        Ok(self.shared.layouts.len() as u32 - 1)
    }

    fn block(&mut self, block: &naga::Block) -> Result<Block, KernelError> {
        let mut out = Vec::new();
        for statement in block {
            self.statement(statement, &mut out)?;
        }
        Ok(out)
    }

    fn statement(&mut self, statement: &Statement, out: &mut Block) -> Result<(), KernelError> {
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
                let cases = cases.collect::<Result<_, KernelError>>()?;
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
            // One thread has nobody to wait for, and others are told.
            Statement::ControlBarrier(_) | Statement::MemoryBarrier(_) => {
                self.shared.has_barriers = true;
            }
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
    ) -> Result<(), KernelError> {
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
    ) -> Result<(), KernelError> {
        let kind = self.kind(value)?;
        let binary = |op| Some(Op::Binary(op, kind));
        let op = match function {
            AtomicFunction::Add => binary(BinaryOperator::Add),
            AtomicFunction::Subtract => binary(BinaryOperator::Subtract),
            AtomicFunction::And => binary(BinaryOperator::And),
            AtomicFunction::ExclusiveOr => binary(BinaryOperator::ExclusiveOr),
            AtomicFunction::InclusiveOr => binary(BinaryOperator::InclusiveOr),
            AtomicFunction::Min => Some(Op::Math(MathFunction::Min, kind)),
            AtomicFunction::Max => Some(Op::Math(MathFunction::Max, kind)),
            AtomicFunction::Exchange { compare: None } => None,
            AtomicFunction::Exchange {
                compare: Some(free),
            } => {
                return self.claim(pointer, *free, value, result, out);
            }
        };
        if kind == ScalarKind::Float {
            return Err(self.unsupported("atomic float"));
        }
        let pointer = self.pointer(pointer)?;
        if !matches!(pointer, Pointer::Buffer { .. }) {
            return Err(self.unsupported("atomic variable outside of buffers"));
        }
        let value = self.slot(value)?;
        let to = result.map(|result| {
            let to = self.word();
            self.slots[result.index()] = Some(to);
            to
        });
        let function = op.map_or(Atomic::Exchange, |op| Atomic::Op(self.op(op)));
        out.push(Node::Ins(Ins::Atomic {
            function,
            pointer,
            value,
            to,
        }));
        Ok(())
    }

    /// An exchange with a comparison, which is known with 0 alone: it gives the word before, and whether
    /// that was 0.
    fn claim(
        &mut self,
        pointer: Handle<Expression>,
        free: Handle<Expression>,
        value: Handle<Expression>,
        result: Option<Handle<Expression>>,
        out: &mut Block,
    ) -> Result<(), KernelError> {
        let known = constant(self.shapes, &self.source.expressions, free);
        if known != Some(vec![Scalar::Word(0)]) {
            return Err(self.unsupported("atomic exchange with a comparison but with 0"));
        }
        let pointer = self.pointer(pointer)?;
        if !matches!(pointer, Pointer::Buffer { .. }) {
            return Err(self.unsupported("atomic variable outside of buffers"));
        }
        let kind = self.kind(value)?;
        let (value, free) = (self.slot(value)?, self.slot(free)?);
        let to = match result {
            Some(result) => self.room(self.ty(result))?,
            None => self.word(),
        };
        out.push(Node::Ins(Ins::Atomic {
            function: Atomic::Claim,
            pointer,
            value,
            to: Some(to),
        }));
        if let Some(result) = result {
            self.slots[result.index()] = Some(to);
            out.push(Node::Ins(Ins::Map2 {
                op: self.op(Op::Binary(BinaryOperator::Equal, kind)),
                from: [to, free],
                step: [0, 0],
                to: to + 1,
                count: 1,
            }));
        }
        Ok(())
    }

    fn call(
        &mut self,
        function: usize,
        arguments: &[Handle<Expression>],
        result: Option<Handle<Expression>>,
        out: &mut Block,
    ) -> Result<(), KernelError> {
        let mut given = Vec::new();
        for argument in arguments {
            let ty = self.ty(*argument);
            let is_pointer = ty.pointer_space().is_some();
            let place = if is_pointer {
                let pointer = self.pointer(*argument)?;
                if matches!(pointer, Pointer::Buffer { .. }) {
                    return Err(self.unsupported("pointer into a buffer as an argument"));
                }
                let to = self.word();
                out.push(Node::Ins(Ins::Address { pointer, to }));
                (to, 1)
            } else {
                (self.slot(*argument)?, self.cells(ty)?)
            };
            given.push(place);
        }
        let to = match result {
            Some(result) => {
                let to = self.room(self.ty(result))?;
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
fn word(thing: &impl std::fmt::Debug) -> String {
    let text = format!("{thing:?}");
    text.chars().take_while(|c| c.is_alphanumeric()).collect()
}
