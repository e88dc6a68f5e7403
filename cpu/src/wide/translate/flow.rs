//! Control flow: statements under masks, and lanes that leave early.

use std::collections::HashMap;

use super::{Around, Shared, Translator, Value, Variable};
use crate::code::{Block, Case, Ins, Node, Slot};
use crate::error::KernelError;
use crate::plan::{self, walk};
use crate::wide::inst::{Inst, Two};

/// Instructions that are not worth a jump.
const FEW: usize = 10;

/// How lanes may leave a statement before its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Escapes {
    pub(super) returns: bool,
    breaks: bool,
    continues: bool,
}

impl Escapes {
    fn any(self) -> bool {
        self.returns || self.breaks || self.continues
    }

    fn with(self, other: Self) -> Self {
        Self {
            returns: self.returns || other.returns,
            breaks: self.breaks || other.breaks,
            continues: self.continues || other.continues,
        }
    }
}

fn escapes(node: &Node) -> Escapes {
    match node {
        Node::Break => Escapes {
            breaks: true,
            ..Escapes::default()
        },
        Node::Continue => Escapes {
            continues: true,
            ..Escapes::default()
        },
        Node::Return(_) => Escapes {
            returns: true,
            ..Escapes::default()
        },
        Node::If { accept, reject, .. } => escapes_of(accept).with(escapes_of(reject)),
        Node::Block(inner) => escapes_of(inner),
        Node::Switch { cases, .. } => {
            let all = cases.iter().map(|case| escapes_of(&case.body));
            let inner = all.fold(Escapes::default(), Escapes::with);
            Escapes {
                breaks: false,
                ..inner
            }
        }
        Node::Loop {
            body, continuing, ..
        } => {
            let inner = escapes_of(body).with(escapes_of(continuing));
            Escapes {
                returns: inner.returns,
                ..Escapes::default()
            }
        }
        Node::Ins(_) | Node::Call { .. } => Escapes::default(),
    }
}

pub(super) fn escapes_of(block: &[Node]) -> Escapes {
    block
        .iter()
        .map(escapes)
        .fold(Escapes::default(), Escapes::with)
}

/// About how many instructions a block takes; `None` if it has loops or calls.
fn weight(block: &Block, shared: &Shared<'_>) -> Option<usize> {
    let (mut sum, mut small) = (0, true);
    walk(block, &mut |node| match node {
        Node::Ins(ins) => sum += plan::weight(ins),
        Node::Loop { .. } | Node::Switch { .. } | Node::Return(_) => small = false,
        Node::Call { function, .. } => {
            small &= shared.plan.inline[*function as usize];
            sum += shared.plan.sizes[*function as usize];
        }
        _ => sum += 1,
    });
    walk(block, &mut |node| {
        if let Node::Ins(Ins::Atomic { .. }) = node {
            small = false;
        }
    });
    small.then_some(sum)
}

impl<'a> Translator<'a> {
    pub(super) fn block(&mut self, block: &'a [Node]) -> Result<(), KernelError> {
        for (at, node) in block.iter().enumerate() {
            match node {
                Node::Ins(ins) => self.instruction(ins)?,
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
                    let left = self.frame().around.last().and_then(|around| around.broken);
                    return self.leave(left);
                }
                Node::Continue => {
                    let around = &self.frame().around;
                    let turn = around.iter().rev().find_map(|around| around.continued);
                    return self.leave(turn);
                }
                Node::Return(slot) => return self.give_back(*slot),
                Node::Call {
                    function,
                    arguments,
                    to,
                } => self.call(*function as usize, arguments, *to)?,
            }
            let escapes = escapes(node);
            if escapes.any() {
                let rest = &block[at + 1..];
                if rest.is_empty() {
                    return Ok(());
                }
                let left = self.still(self.mask, escapes);
                let all = std::mem::replace(&mut self.mask, left);
                self.part(left, true, |this| this.block(rest))?;
                self.mask = all;
                return Ok(());
            }
        }
        Ok(())
    }

    /// The lanes of a mask that have not left.
    fn still(&mut self, mask: Value, escapes: Escapes) -> Value {
        let frame = self.frame();
        let mut left = Vec::new();
        if escapes.returns {
            left.extend(frame.returned);
        }
        if escapes.breaks {
            left.extend(frame.around.last().and_then(|around| around.broken));
        }
        if escapes.continues {
            left.extend(
                frame
                    .around
                    .iter()
                    .rev()
                    .find_map(|around| around.continued),
            );
        }
        let mut mask = mask;
        for variable in left {
            let gone = self.get(variable);
            mask = self.two(Two::AndNot, gone, mask);
        }
        mask
    }

    /// Makes the present lanes part of those that have left.
    fn leave(&mut self, left: Option<Variable>) -> Result<(), KernelError> {
        let left = left.ok_or_else(|| self.unsupported("jump out of nothing"))?;
        let before = self.get(left);
        let after = self.two(Two::Or, before, self.mask);
        self.assign_all(left, after);
        Ok(())
    }

    fn give_back(&mut self, slot: Option<Slot>) -> Result<(), KernelError> {
        let result = self.frame().result.clone();
        if let Some(slot) = slot {
            for (slot, variable) in (slot..).zip(result) {
                let value = self.value(slot);
                self.assign(variable, value);
            }
        }
        match self.frame().returned {
            Some(returned) => self.leave(Some(returned)),
            None => Ok(()),
        }
    }

    /// Translates what counts for the lanes of `mask` alone, and is jumped over if there are none.
    fn part(
        &mut self,
        mask: Value,
        jump: bool,
        statements: impl FnOnce(&mut Self) -> Result<(), KernelError>,
    ) -> Result<(), KernelError> {
        let all = std::mem::replace(&mut self.mask, mask);
        if jump && self.bits_of(mask).is_none() {
            self.flush();
            let label = (self.labels)();
            self.insts.push(Inst::SkipIfNone { mask, to: label });
            self.known.push(HashMap::new());
            self.variables.enter();
            statements(self)?;
            self.flush();
            self.variables.leave();
            self.known.pop();
            self.insts.push(Inst::Join(label));
        } else {
            statements(self)?;
        }
        self.mask = all;
        Ok(())
    }

    fn branch(
        &mut self,
        condition: Slot,
        accept: &'a Block,
        reject: &'a Block,
    ) -> Result<(), KernelError> {
        let condition = self.value(condition);
        match self.bits_of(condition) {
            Some(0) => return self.block(reject),
            Some(_) => return self.block(accept),
            None => {}
        }
        let all = self.mask;
        let yes = self.two(Two::And, condition, all);
        let no = self.two(Two::AndNot, condition, all);
        for (mask, block) in [(yes, accept), (no, reject)] {
            if !block.is_empty() {
                let jump = weight(block, self.shared).is_none_or(|weight| weight > FEW);
                self.part(mask, jump, |this| this.block(block))?;
            }
        }
        Ok(())
    }

    fn switch(&mut self, selector: Slot, cases: &'a [Case]) -> Result<(), KernelError> {
        let selector = self.value(selector);
        let all = self.mask;
        let broken = self.fresh_mask();
        self.frame().around.push(Around {
            broken: Some(broken),
            continued: None,
        });
        // The lanes of each case, of those that it is reached from by falling through as well.
        let mut rest = all;
        let mut masks = Vec::new();
        for case in cases {
            let mask = case.value.map(|value| {
                let value = self.bits(value);
                let fits = self.two(Two::Equal, selector, value);
                let mask = self.two(Two::And, fits, all);
                rest = self.two(Two::AndNot, fits, rest);
                mask
            });
            masks.push(mask);
        }
        let mut carried: Option<Value> = None;
        for (case, mask) in cases.iter().zip(masks) {
            let mut mask = mask.unwrap_or(rest);
            if let Some(before) = carried.take() {
                mask = self.two(Two::Or, mask, before);
            }
            if case.falls_through && case.body.is_empty() {
                carried = Some(mask);
                continue;
            }
            if case.falls_through {
                return Err(self.unsupported("case that falls through"));
            }
            self.part(mask, true, |this| this.block(&case.body))?;
        }
        self.frame().around.pop();
        Ok(())
    }

    /// A variable of lanes that begins with none.
    fn fresh_mask(&mut self) -> Variable {
        let none = self.bits(0);
        self.variables.begin(none, self.mask)
    }

    /// A loop, which ends as well when the host says that nothing is waited for any more.
    fn turns(
        &mut self,
        body: &'a Block,
        continuing: &'a Block,
        break_if: Option<Slot>,
    ) -> Result<(), KernelError> {
        let all = self.mask;
        let inner = escapes_of(body);
        let broken = self.fresh_mask();
        let continued = inner.continues.then(|| self.fresh_mask());
        self.flush();
        let (turn, end) = ((self.labels)(), (self.labels)());
        self.insts.push(Inst::Head { turn, end });
        self.known.push(HashMap::new());
        self.variables.forget();
        self.frame().around.push(Around {
            broken: Some(broken),
            continued,
        });
        let returns = Escapes {
            returns: inner.returns,
            breaks: true,
            continues: false,
        };
        let mask = self.still(all, returns);
        self.insts.push(Inst::LeaveIfNone { mask, end });
        if let Some(continued) = continued {
            let none = self.bits(0);
            self.assign_all(continued, none);
        }
        self.mask = mask;
        self.block(body)?;
        self.mask = self.still(mask, returns);
        self.block(continuing)?;
        if let Some(slot) = break_if {
            let ends = self.value(slot);
            let ends = self.two(Two::And, ends, self.mask);
            let before = self.get(broken);
            let after = self.two(Two::Or, before, ends);
            self.assign_all(broken, after);
        }
        self.flush();
        self.frame().around.pop();
        self.known.pop();
        self.insts.push(Inst::Back { turn, end });
        self.variables.forget();
        self.mask = all;
        Ok(())
    }
}
