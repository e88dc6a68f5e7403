//! From code to the compiler's intermediate representation: statements and calls.
//!
//! Each cell of a frame is a value, or a variable of which the compiler makes values; only what is indexed
//! by numbers that are known when running lies in memory.

mod memory;
mod primitives;

use cranelift_codegen::ir::{
    self, AbiParam, Block as Label, ExtFuncData, ExternalName, InstBuilder, MemFlagsData,
    Signature, StackSlot, Type, UserExternalName, Value, types,
};
use cranelift_codegen::isa::CallConv;
use cranelift_frontend::{FunctionBuilder, Switch, Variable};

use super::constants::Constants;
use super::host::Answer;
use super::layout::{Layout, STOP};

use crate::code::{Block, Case, Code, Function, Ins, Node, Scalar, Slot};
use crate::error::KernelError;
use crate::plan::{self, Plan};

/// What all functions of a kernel are compiled with.
pub(super) struct Shared<'a> {
    pub code: &'a Code,
    pub plan: &'a Plan,
    pub layout: Layout,
    pub constants: &'a Constants,
    /// By hook: who answers.
    pub answers: &'a [Option<Answer>],
    /// How functions of the host are called.
    pub host: CallConv,
}

/// A function that is being translated.
pub(super) struct Emitter<'a, 'b> {
    shared: &'a Shared<'a>,
    builder: FunctionBuilder<'b>,
    /// The address of the context.
    context: Value,
    /// The function and those that are part of it, innermost last.
    frames: Vec<Frame<'a>>,
}

/// A function whose statements are being translated.
struct Frame<'a> {
    function: &'a Function,
    /// By slot: what was computed.
    values: Vec<Option<Value>>,
    /// By slot: what pointers point to.
    pointers: Vec<Option<Target>>,
    variables: Vec<Place>,
    /// What a return leads to.
    leave: Leave,
    /// The loops and switches around.
    around: Vec<Around>,
}

/// Where a variable is.
enum Place {
    Registers(Vec<Variable>),
    Memory(StackSlot),
}

/// What a pointer to cells points to.
#[derive(Clone, Copy)]
enum Target {
    /// A cell of a variable of one of the frames.
    Cell { frame: usize, slot: Slot },
    /// So many cells behind an address.
    Memory { address: Value, cell: u32 },
}

#[derive(Clone)]
enum Leave {
    /// Another function's statements go on, with the result.
    To(Label, Vec<Variable>),
    /// The caller does. There may be an address for the result.
    Return(Option<Value>),
}

/// Where `break` and `continue` lead.
#[derive(Clone, Copy)]
struct Around {
    end: Label,
    turn: Option<Label>,
}

/// Memory that does not change while the code runs.
const CONSTANT: MemFlagsData = MemFlagsData::trusted().with_readonly().with_can_move();

/// Whether statements that follow are reached.
type Reached = bool;

/// The type of a cell.
fn ty(cell: Scalar) -> Type {
    match cell {
        Scalar::Float(_) => types::F32,
        Scalar::Word(_) => types::I32,
        Scalar::Bool(_) => types::I8,
    }
}

/// What a function is called with: the context, its arguments, and where a result of several cells goes.
pub(super) fn signature(function: &Function, pointers: &[bool], convention: CallConv) -> Signature {
    let mut signature = Signature::new(convention);
    signature.params.push(AbiParam::new(types::I64));
    for (slot, cell) in function.image[..function.arguments as usize]
        .iter()
        .enumerate()
    {
        let ty = if pointers[slot] {
            types::I64
        } else {
            ty(*cell)
        };
        signature.params.push(AbiParam::new(ty));
    }
    match function.result[..] {
        [] => {}
        [one] => signature.returns.push(AbiParam::new(ty(one))),
        _ => signature.params.push(AbiParam::new(types::I64)),
    }
    signature
}

impl<'a, 'b> Emitter<'a, 'b> {
    /// Translates a function that is compiled on its own.
    pub(super) fn translate(
        shared: &'a Shared<'a>,
        function: &'a Function,
        mut builder: FunctionBuilder<'b>,
    ) -> Result<FunctionBuilder<'b>, KernelError> {
        let entry = builder.create_block();
        builder.append_block_params_for_function_params(entry);
        builder.switch_to_block(entry);
        builder.seal_block(entry);
        let parameters = builder.block_params(entry).to_vec();
        let arguments = function.arguments as usize;
        let mut this = Self {
            shared,
            builder,
            context: parameters[0],
            frames: Vec::new(),
        };
        let leave = Leave::Return(parameters.get(1 + arguments).copied());
        this.begin(function, leave);
        this.frame().values[..arguments].clone_from_slice(
            &parameters[1..=arguments]
                .iter()
                .copied()
                .map(Some)
                .collect::<Vec<_>>(),
        );
        if this.block(&function.body)? {
            this.leave(None);
        }
        Ok(this.builder)
    }

    fn frame(&mut self) -> &mut Frame<'a> {
        let last = self.frames.len() - 1;
        &mut self.frames[last]
    }

    fn function(&self) -> &'a Function {
        self.frames[self.frames.len() - 1].function
    }

    fn unsupported(&self, what: &str) -> KernelError {
        KernelError::unsupported(what, &self.function().name)
    }

    /// Begins the statements of a function, with its variables as they are then.
    fn begin(&mut self, function: &'a Function, leave: Leave) {
        let in_memory = plan::in_memory(function, self.shared.plan);
        let mut variables = Vec::new();
        for ((first, cells), in_memory) in function.variables.iter().zip(in_memory) {
            let image = &function.image[*first as usize..(first + cells) as usize];
            variables.push(if in_memory {
                self.memory_of(image)
            } else {
                self.registers_of(image)
            });
        }
        self.frames.push(Frame {
            function,
            values: vec![None; function.image.len()],
            pointers: vec![None; function.image.len()],
            variables,
            leave,
            around: Vec::new(),
        });
    }

    fn registers_of(&mut self, image: &[Scalar]) -> Place {
        let register = |cell: &Scalar| {
            let variable = self.builder.declare_var(ty(*cell));
            let value = self.constant(*cell);
            self.builder.def_var(variable, value);
            variable
        };
        Place::Registers(image.iter().map(register).collect())
    }

    fn constant(&mut self, cell: Scalar) -> Value {
        match cell {
            Scalar::Float(x) => self.builder.ins().f32const(x),
            Scalar::Word(x) => self.builder.ins().iconst(types::I32, i64::from(x)),
            Scalar::Bool(x) => self.builder.ins().iconst(types::I8, i64::from(x)),
        }
    }

    /// What a cell holds: what was computed, or else what the frame begins with.
    fn value(&mut self, slot: Slot) -> Value {
        let frame = self.frame();
        match frame.values[slot as usize] {
            Some(value) => value,
            None => {
                let cell = frame.function.image[slot as usize];
                self.constant(cell)
            }
        }
    }

    fn set(&mut self, slot: Slot, value: Value) {
        self.frame().values[slot as usize] = Some(value);
    }

    fn block(&mut self, block: &'a Block) -> Result<Reached, KernelError> {
        for node in block {
            let reached = match node {
                Node::Ins(ins) => {
                    self.instruction(ins)?;
                    true
                }
                Node::If {
                    condition,
                    accept,
                    reject,
                } => self.branch(*condition, accept, reject)?,
                Node::Switch { selector, cases } => self.switch(*selector, cases)?,
                Node::Loop {
                    body,
                    continuing,
                    break_if,
                } => self.turns(body, continuing, *break_if)?,
                Node::Block(inner) => self.block(inner)?,
                Node::Break => {
                    let end = self.frame().around.last().map(|around| around.end);
                    self.jump_to(end)?
                }
                Node::Continue => {
                    let around = &self.frame().around;
                    let turn = around.iter().rev().find_map(|around| around.turn);
                    self.jump_to(turn)?
                }
                Node::Return(slot) => {
                    self.leave(*slot);
                    false
                }
                Node::Call {
                    function,
                    arguments,
                    to,
                } => {
                    self.call(*function as usize, arguments, *to)?;
                    true
                }
            };
            if !reached {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn jump_to(&mut self, label: Option<Label>) -> Result<Reached, KernelError> {
        let label = label.ok_or_else(|| self.unsupported("jump out of nothing"))?;
        self.builder.ins().jump(label, &[]);
        Ok(false)
    }

    fn go_on_at(&mut self, label: Label) {
        self.builder.seal_block(label);
        self.builder.switch_to_block(label);
    }

    fn branch(
        &mut self,
        condition: Slot,
        accept: &'a Block,
        reject: &'a Block,
    ) -> Result<Reached, KernelError> {
        let condition = self.value(condition);
        let (first, end) = (self.builder.create_block(), self.builder.create_block());
        let second = if reject.is_empty() {
            end
        } else {
            self.builder.create_block()
        };
        self.builder.ins().brif(condition, first, &[], second, &[]);
        let mut reached = reject.is_empty();
        for (label, block) in [(first, accept), (second, reject)] {
            if label == end {
                continue;
            }
            self.builder.seal_block(label);
            self.builder.switch_to_block(label);
            if self.block(block)? {
                self.builder.ins().jump(end, &[]);
                reached = true;
            }
        }
        if reached {
            self.go_on_at(end);
        }
        Ok(reached)
    }

    fn switch(&mut self, selector: Slot, cases: &'a [Case]) -> Result<Reached, KernelError> {
        let selector = self.value(selector);
        let end = self.builder.create_block();
        let labels: Vec<Label> = cases.iter().map(|_| self.builder.create_block()).collect();
        let mut switch = Switch::new();
        let mut default = end;
        for (case, label) in cases.iter().zip(&labels) {
            match case.value {
                Some(value) => switch.set_entry(value.into(), *label),
                None => default = *label,
            }
        }
        switch.emit(&mut self.builder, selector, default);
        self.frame().around.push(Around { end, turn: None });
        for (at, case) in cases.iter().enumerate() {
            self.go_on_at(labels[at]);
            if self.block(&case.body)? {
                let next = labels.get(at + 1).filter(|_| case.falls_through);
                self.builder.ins().jump(*next.unwrap_or(&end), &[]);
            }
        }
        self.frame().around.pop();
        self.go_on_at(end);
        Ok(true)
    }

    /// A loop, which ends as well when the host says that nothing is waited for any more.
    fn turns(
        &mut self,
        body: &'a Block,
        continuing: &'a Block,
        break_if: Option<Slot>,
    ) -> Result<Reached, KernelError> {
        let [head, first, turn, end] = [(); 4].map(|()| self.builder.create_block());
        self.builder.ins().jump(head, &[]);
        self.builder.switch_to_block(head);
        let flag = self
            .builder
            .ins()
            .load(types::I64, CONSTANT, self.context, STOP);
        let stop = self
            .builder
            .ins()
            .load(types::I8, MemFlagsData::trusted(), flag, 0);
        self.builder.ins().brif(stop, end, &[], first, &[]);
        self.go_on_at(first);
        self.frame().around.push(Around {
            end,
            turn: Some(turn),
        });
        if self.block(body)? {
            self.builder.ins().jump(turn, &[]);
        }
        self.go_on_at(turn);
        if self.block(continuing)? {
            match break_if {
                Some(slot) => {
                    let ends = self.value(slot);
                    self.builder.ins().brif(ends, end, &[], head, &[]);
                }
                None => {
                    self.builder.ins().jump(head, &[]);
                }
            }
        }
        self.frame().around.pop();
        self.builder.seal_block(head);
        self.go_on_at(end);
        Ok(true)
    }

    /// Ends the function with the result in some cells; with zeros if there is none, which no valid kernel
    /// comes to.
    fn leave(&mut self, slot: Option<Slot>) {
        let result = &self.function().result;
        let values: Vec<Value> = match slot {
            Some(slot) => (slot..).take(result.len()).map(|s| self.value(s)).collect(),
            None => result.iter().map(|cell| self.constant(*cell)).collect(),
        };
        match self.frame().leave.clone() {
            Leave::To(end, variables) => {
                for (variable, value) in variables.into_iter().zip(values) {
                    self.builder.def_var(variable, value);
                }
                self.builder.ins().jump(end, &[]);
            }
            Leave::Return(None) => {
                self.builder.ins().return_(&values);
            }
            Leave::Return(Some(address)) => {
                for (at, value) in values.into_iter().enumerate() {
                    self.put(address, 4 * at as i32, value);
                }
                self.builder.ins().return_(&[]);
            }
        }
    }

    fn call(
        &mut self,
        callee: usize,
        arguments: &[(Slot, u32)],
        to: Option<Slot>,
    ) -> Result<(), KernelError> {
        let function = self.shared.code.functions[callee].as_ref();
        let function = function.ok_or_else(|| self.unsupported("function that it calls"))?;
        let mut values = Vec::new();
        let mut pointers = Vec::new();
        for (slot, count) in arguments {
            let pointer = self.frame().pointers[*slot as usize];
            for slot in *slot..slot + count {
                values.push(match pointer {
                    Some(_) => None,
                    None => Some(self.value(slot)),
                });
                pointers.push(pointer);
            }
        }
        let results = if function.answered {
            self.ask(function, &values)?
        } else if self.shared.plan.inline[callee] {
            self.expand(function, values, pointers)?
        } else {
            self.call_compiled(callee, function, &values, &pointers)
        };
        if let Some(to) = to {
            for (slot, value) in (to..).zip(results) {
                self.set(slot, value);
            }
        }
        Ok(())
    }

    /// Translates a function where it is called.
    fn expand(
        &mut self,
        function: &'a Function,
        values: Vec<Option<Value>>,
        pointers: Vec<Option<Target>>,
    ) -> Result<Vec<Value>, KernelError> {
        let end = self.builder.create_block();
        let declare = |cell: &Scalar| self.builder.declare_var(ty(*cell));
        let results: Vec<Variable> = function.result.iter().map(declare).collect();
        self.begin(function, Leave::To(end, results.clone()));
        let frame = self.frame();
        frame.values[..values.len()].clone_from_slice(&values);
        frame.pointers[..pointers.len()].clone_from_slice(&pointers);
        if self.block(&function.body)? {
            self.leave(None);
        }
        self.frames.pop();
        self.go_on_at(end);
        Ok(results
            .into_iter()
            .map(|v| self.builder.use_var(v))
            .collect())
    }

    fn call_compiled(
        &mut self,
        callee: usize,
        function: &Function,
        values: &[Option<Value>],
        pointers: &[Option<Target>],
    ) -> Vec<Value> {
        let is_pointer: Vec<bool> = pointers.iter().map(Option::is_some).collect();
        let signature = signature(function, &is_pointer, CallConv::Fast);
        let signature = self.builder.import_signature(signature);
        let name = UserExternalName::new(0, callee as u32);
        let name = self.builder.func.declare_imported_user_function(name);
        let reference = self.builder.import_function(ExtFuncData {
            name: ExternalName::user(name),
            signature,
            colocated: true,
            patchable: false,
        });
        let mut given = vec![self.context];
        for (value, pointer) in values.iter().zip(pointers) {
            given.push(match (value, pointer) {
                (Some(value), _) => *value,
                (None, Some(target)) => self.address_of(*target),
                (None, None) => self.context,
            });
        }
        let several = function.result.len() > 1;
        let room = several.then(|| {
            let slot = self.stack(function.result.len());
            self.builder.ins().stack_addr(types::I64, slot, 0)
        });
        given.extend(room);
        let call = self.builder.ins().call(reference, &given);
        match room {
            None => self.builder.inst_results(call).to_vec(),
            Some(address) => {
                let cells = function.result.iter().enumerate();
                cells
                    .map(|(at, cell)| self.get(address, 4 * at as i32, *cell))
                    .collect()
            }
        }
    }

    /// Calls the host, which answers in place of a function.
    fn ask(
        &mut self,
        function: &Function,
        values: &[Option<Value>],
    ) -> Result<Vec<Value>, KernelError> {
        let known = |hook| Some((hook as u32, (*self.shared.answers.get(hook)?)?));
        let answer = function.hook.and_then(known);
        let (hook, answer) = answer.ok_or_else(|| self.unsupported("answer to a call"))?;
        let room = self.shared.layout.exchange_words();
        if values.len() + function.result.len() > room {
            return Err(self.unsupported("answer of so many numbers"));
        }
        let exchange = self.shared.layout.exchange();
        for (at, value) in values.iter().enumerate() {
            let value = value.ok_or_else(|| self.unsupported("pointer given to the host"))?;
            self.put(self.context, exchange + 4 * at as i32, value);
        }
        let mut signature = Signature::new(self.shared.host);
        signature.params = vec![AbiParam::new(types::I64); 3];
        let signature = self.builder.import_signature(signature);
        let at = self.shared.layout.data(hook);
        let data = self
            .builder
            .ins()
            .load(types::I64, CONSTANT, self.context, at);
        let answer = self
            .builder
            .ins()
            .iconst(types::I64, answer as usize as i64);
        let first = i64::from(exchange);
        let arguments = self.builder.ins().iadd_imm_s(self.context, first);
        let behind = exchange + 4 * values.len() as i32;
        let result = self
            .builder
            .ins()
            .iadd_imm_s(self.context, i64::from(behind));
        let given = [data, arguments, result];
        self.builder.ins().call_indirect(signature, answer, &given);
        let cells = function.result.iter().enumerate();
        Ok(cells
            .map(|(at, cell)| self.get(self.context, behind + 4 * at as i32, *cell))
            .collect())
    }

    /// Calls a function of the host on numbers.
    fn call_host(&mut self, function: usize, arguments: &[Value], result: Type) -> Value {
        let mut signature = Signature::new(self.shared.host);
        for argument in arguments {
            let ty = self.builder.func.dfg.value_type(*argument);
            signature.params.push(AbiParam::new(ty));
        }
        signature.returns.push(AbiParam::new(result));
        let signature = self.builder.import_signature(signature);
        let address = self.builder.ins().iconst(types::I64, function as i64);
        let call = self
            .builder
            .ins()
            .call_indirect(signature, address, arguments);
        self.builder.inst_results(call)[0]
    }

    fn component(&mut self, op: u32, x: &[Value]) -> Result<Value, KernelError> {
        let op = self.shared.code.ops[op as usize];
        let value = crate::arithmetic::component(self, op, x);
        value.ok_or_else(|| self.unsupported(&format!("{op:?}")))
    }

    fn instruction(&mut self, ins: &'a Ins) -> Result<(), KernelError> {
        match ins {
            Ins::Copy { from, to, count } => {
                for i in 0..*count {
                    let pointer = self.frame().pointers[(from + i) as usize];
                    match pointer {
                        Some(_) => self.frame().pointers[(to + i) as usize] = pointer,
                        None => {
                            let value = self.value(from + i);
                            self.set(to + i, value);
                        }
                    }
                }
            }
            Ins::Map1 {
                op,
                from,
                to,
                count,
            } => {
                for i in 0..*count {
                    let value = self.value(from + i);
                    let value = self.component(*op, &[value])?;
                    self.set(to + i, value);
                }
            }
            Ins::Map2 {
                op,
                from: [a, b],
                step: [p, q],
                to,
                count,
            } => {
                for i in 0..*count {
                    let operands = [self.value(a + p * i), self.value(b + q * i)];
                    let value = self.component(*op, &operands)?;
                    self.set(to + i, value);
                }
            }
            Ins::Map3 {
                op,
                from: [a, b, c],
                step: [p, q, r],
                to,
                count,
            } => {
                for i in 0..*count {
                    let operands = [
                        self.value(a + p * i),
                        self.value(b + q * i),
                        self.value(c + r * i),
                    ];
                    let value = self.component(*op, &operands)?;
                    self.set(to + i, value);
                }
            }
            Ins::Vectors {
                op,
                from,
                width,
                to,
                count,
            } => {
                let of = |this: &mut Self, at: usize, width: u32| {
                    (from[at]..from[at] + width)
                        .map(|slot| this.value(slot))
                        .collect()
                };
                let op = self.shared.code.ops[*op as usize];
                let values = crate::arithmetic::vectors(self, op, *width, of);
                let values = values.ok_or_else(|| self.unsupported(&format!("{op:?}")))?;
                if values.len() < *count as usize {
                    return Err(self.unsupported("result of so many components"));
                }
                for (slot, value) in (*to..).zip(values) {
                    self.set(slot, value);
                }
            }
            other => self.memory(other)?,
        }
        Ok(())
    }
}

/// A function's name within the module: its index, and behind all others the entry point.
pub(super) fn name(index: usize) -> ir::UserFuncName {
    ir::UserFuncName::user(0, index as u32)
}
