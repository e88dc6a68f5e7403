//! Calls: of functions in line, of those that are compiled on their own, and of the host.

use super::{Target, Translator, Value};
use crate::code::{Function, Scalar, Slot};
use crate::error::KernelError;
use crate::wide::inst::{Inst, Two};
use crate::wide::memory::CELL;

impl<'a> Translator<'a> {
    pub(super) fn call(
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
            self.call_compiled(callee, function, &values)?
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
        let first = self.variables.count();
        let mut result = Vec::new();
        for cell in &function.result {
            let value = self.constant(*cell);
            result.push(self.variables.begin(value, self.mask));
        }
        self.begin(function, result.clone());
        let frame = self.frame();
        frame.values[..values.len()].clone_from_slice(&values);
        frame.pointers[..pointers.len()].clone_from_slice(&pointers);
        let mask = self.mask;
        self.block(&function.body)?;
        self.mask = mask;
        self.frames.pop();
        let results = result
            .into_iter()
            .map(|variable| self.get(variable))
            .collect();
        self.variables.end(first);
        Ok(results)
    }

    fn call_compiled(
        &mut self,
        callee: usize,
        function: &Function,
        values: &[Option<Value>],
    ) -> Result<Vec<Value>, KernelError> {
        let interface = self.shared.interfaces[callee].clone();
        let interface = interface.ok_or_else(|| self.unsupported("function on its own"))?;
        for (at, value) in values.iter().enumerate() {
            let value = value.ok_or_else(|| self.unsupported("pointer given to a function"))?;
            self.store(interface.arguments + CELL * at as i32, value);
        }
        self.store(interface.mask, self.mask);
        self.flush();
        self.insts.push(Inst::Call(interface.label));
        for variable in self.private.clone() {
            self.variables.renew(variable);
        }
        let results = 0..function.result.len() as i32;
        Ok(results
            .map(|at| self.load(interface.result + CELL * at))
            .collect())
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
        let mut arguments = vec![self.mask];
        for value in values {
            let value = value.ok_or_else(|| self.unsupported("pointer given to the host"))?;
            arguments.push(value);
        }
        let data = self.memory.data(hook);
        let results = self.host(answer as usize, data, arguments, function.result.len())?;
        let mut found = Vec::new();
        for (value, cell) in results.into_iter().zip(&function.result) {
            found.push(match cell {
                Scalar::Bool(_) => {
                    let zero = self.bits(0);
                    let none = self.two(Two::Equal, value, zero);
                    let all = self.bits(u32::MAX);
                    self.two(Two::Xor, none, all)
                }
                _ => value,
            });
        }
        Ok(found)
    }

    /// Calls a function of the host with cells.
    pub(super) fn host(
        &mut self,
        function: usize,
        data: i32,
        arguments: Vec<Value>,
        results: usize,
    ) -> Result<Vec<Value>, KernelError> {
        if arguments.len() + results > self.memory.exchange_cells() {
            return Err(self.unsupported("call of the host with so many numbers"));
        }
        let results: Vec<Value> = (0..results).map(|_| self.new_value()).collect();
        self.insts.push(Inst::Host {
            function,
            data,
            arguments,
            results: results.clone(),
        });
        Ok(results)
    }
}
