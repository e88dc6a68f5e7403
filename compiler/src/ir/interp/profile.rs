//! What was executed how often, for whoever wants to know more than sums: by stretch of code that is
//! executed as a whole, with every call standing for itself, as if it were in line.

use std::collections::BTreeMap;

use super::Interpreter;
use super::code::Numbers;
use crate::ir::ops::Counts;
use crate::ir::value::{Real, Value};
use crate::ir::{Const, ExprId, Function};
use crate::source::Span;

/// A part of a run of operations.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// The run, an index of what [`Interpreter::take_times`] gives.
    pub run: usize,
    /// What is evaluated; of a turn of a loop, its bound or test.
    pub expr: ExprId,
    /// What it counts as.
    pub counts: Counts,
    /// The code that it is part of, for [`Interpreter::origin`].
    pub code: usize,
}

/// Where code comes from.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// The function whose code it is.
    pub function: &'a Function,
    /// The code that calls it, and where.
    pub caller: Option<(usize, ExprId)>,
}

impl<'a, F: Real> Interpreter<'a, F> {
    /// Keeps calls apart: the same function called from two places is counted in each.
    pub fn with_calls_apart(self) -> Self {
        Self {
            apart: true,
            ..self.with_parts()
        }
    }

    /// Keeps what code is made of, for [`Interpreter::busiest_loop`].
    pub fn with_parts(mut self) -> Self {
        self.has_parts = true;
        self
    }

    /// The loop that took most turns since [`Interpreter::take_times`] was last called, where its bound
    /// or test stands in the source. Only code that keeps its parts knows.
    pub fn busiest_loop(&self) -> Option<Span> {
        let mut turns: BTreeMap<Span, u64> = BTreeMap::new();
        for (code, source) in self.codes.iter().zip(&self.sources) {
            let Some(f) = source else { continue };
            let looped = code.parts.iter().filter(|part| part.counts.turns > 0);
            for part in looped {
                let taken = code.runs[part.run as usize].times;
                *turns.entry(f.expr(part.expr).span).or_default() += taken;
            }
        }
        // Of several the first.
        let most = *turns.values().max()?;
        let found = turns.into_iter().find(|(_, taken)| *taken == most);
        found.filter(|_| most > 0).map(|(span, _)| span)
    }

    /// Goes on with other values of the parameter table. Numbers of runs stay.
    pub fn set_table(&mut self, values: &[Const]) {
        self.outside.table = values.iter().map(Value::constant).collect();
        let structs = &self.module.structs;
        for code in &mut self.codes {
            for &(value, place, ty) in &code.table {
                let mut numbers = Numbers::new();
                numbers.push(self.outside.table.get(value as usize), ty, structs);
                code.image.put(place, &numbers);
            }
        }
    }

    /// Operations of each run. Runs are numbered as their code is first entered.
    pub fn runs(&self) -> impl Iterator<Item = Counts> {
        self.codes.iter().flat_map(|c| &c.runs).map(|r| r.counts)
    }

    /// How often each run was executed since this was last asked.
    pub fn take_times(&mut self) -> impl Iterator<Item = u64> {
        let runs = self.codes.iter_mut().flat_map(|c| &mut c.runs);
        runs.map(|r| std::mem::take(&mut r.times))
    }

    /// What runs are made of, in the order of runs. Only code that keeps its parts knows.
    pub fn parts(&self) -> impl Iterator<Item = Part> {
        let first = self.codes.iter().scan(0, |next, code| {
            let first = *next;
            *next += code.runs.len();
            Some(first)
        });
        let codes = self.codes.iter().zip(first).enumerate();
        codes.flat_map(|(code, (c, first))| {
            c.parts.iter().map(move |part| Part {
                run: first + part.run as usize,
                expr: part.expr,
                counts: part.counts,
                code,
            })
        })
    }

    /// Where code comes from.
    pub fn origin(&self, code: usize) -> Option<Origin<'a>> {
        Some(Origin {
            function: (*self.sources.get(code)?)?,
            caller: self.codes[code].caller,
        })
    }
}
