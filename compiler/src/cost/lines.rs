//! Which lines of the source the operations of a material come from.
//!
//! An operation belongs to the line that it was written in, and to every line that calls the function
//! it was written in. What several lines compute alike is computed once, and belongs to one of them;
//! the operation whose result a `let` names belongs to the `let`, and what the compiler's own rules add
//! to the line of what they replace.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Classes, LANES, Measured};
use crate::ir::interp::{Origin, Part};
use crate::ir::ops::Counts;
use crate::ir::{Function, SiteId};
use crate::source::{FileId, Span};

/// What a line of the source costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineCost {
    /// Its file: the path as it was given, or that of a file of the standard library,
    /// `std/noise/perlin.impasto`.
    pub file: String,
    /// Does the file belong to the standard library?
    pub library: bool,
    /// The line, from 1.
    pub line: usize,
    /// Its text, without the blanks around it.
    pub text: String,
    /// Operations that one evaluation executes of what the line itself says. Over all lines they
    /// add up to the material's.
    pub operations: f64,
    /// The same by class.
    pub classes: Classes,
    /// The same that a full subgroup issues.
    pub issued: f64,
    /// Operations of the line and of the functions that it calls.
    pub with_calls: f64,
    /// `with_calls` over the operations of the material, from 0 to 1.
    pub share: f64,
}

/// A line of a file, from 0.
type Line = (FileId, usize);

/// What was counted of a line.
#[derive(Clone, Copy, Default)]
struct Sums {
    own: Counts,
    issued: u64,
    with_calls: u64,
}

impl Measured<'_> {
    /// What each line of the source costs, of all files that take part, those first that cost most with
    /// what they call.
    pub fn lines(&self) -> Vec<LineCost> {
        let mut lines = Lines {
            measured: self,
            callers: BTreeMap::new(),
            sums: BTreeMap::new(),
        };
        let (times, evaluations) = self.subgroups.sums(0);
        let (issued, _) = self.subgroups.sums(LANES.len() - 1);
        for part in self.run.parts() {
            lines.add(&part, times[part.run], issued[part.run]);
        }
        let sums = lines.sums;
        let all: u64 = sums.values().map(|s| s.own.operations()).sum();
        let mut found: Vec<LineCost> = sums
            .iter()
            .map(|(line, sums)| self.line(*line, sums, evaluations, all))
            .collect();
        // Equals stay in the order of the source.
        found.sort_by(|a, b| b.with_calls.total_cmp(&a.with_calls));
        found
    }

    fn line(&self, (file, line): Line, sums: &Sums, evaluations: u64, all: u64) -> LineCost {
        // Files of the library have the first ids.
        let library = file.is_library();
        let file = self.program.sources().file(file);
        let mean = |n: u64| n as f64 / evaluations as f64;
        let classes = Classes::mean(&sums.own, evaluations);
        LineCost {
            file: file.name.clone(),
            library,
            line: line + 1,
            text: file.text[file.line_range(line)].trim().to_owned(),
            operations: classes.sum(),
            classes,
            issued: mean(sums.issued),
            with_calls: mean(sums.with_calls),
            share: sums.with_calls as f64 / all as f64,
        }
    }
}

/// Hands what was executed to lines.
struct Lines<'m> {
    measured: &'m Measured<'m>,
    /// The lines that call what stands in code in place of a call, each once.
    callers: BTreeMap<(usize, Option<SiteId>), Vec<Line>>,
    sums: BTreeMap<Line, Sums>,
}

impl<'m> Lines<'m> {
    /// Adds a part that was executed, and issued, so many times.
    fn add(&mut self, part: &Part, times: u64, issued: u64) {
        let operations = part.counts.operations();
        let Some(origin) = self.measured.run.origin(part.code) else {
            return;
        };
        if operations * issued == 0 {
            return;
        }
        let expr = origin.function.expr(part.expr);
        let own = self.line(expr.span);
        let sums = self.sums.entry(own).or_default();
        sums.own.add(&part.counts, times);
        sums.issued += operations * issued;
        sums.with_calls += operations * times;
        let key = (part.code, expr.via);
        if !self.callers.contains_key(&key) {
            let callers = self.callers(origin, expr.via);
            self.callers.insert(key, callers);
        }
        for &caller in self.callers[&key].iter().filter(|&&line| line != own) {
            self.sums.entry(caller).or_default().with_calls += operations * times;
        }
    }

    /// The lines whose calls, within each other, led to what stands in code in place of `via`.
    fn callers(&self, mut origin: Origin<'m>, mut via: Option<SiteId>) -> Vec<Line> {
        let mut lines = Vec::new();
        loop {
            self.sites(origin.function, via, &mut lines);
            let Some((code, call)) = origin.caller else {
                break;
            };
            let Some(caller) = self.measured.run.origin(code) else {
                break;
            };
            let call = caller.function.expr(call);
            lines.push(self.line(call.span));
            (origin, via) = (caller, call.via);
        }
        lines.sort_unstable();
        lines.dedup();
        lines
    }

    fn sites(&self, f: &Function, via: Option<SiteId>, lines: &mut Vec<Line>) {
        lines.extend(f.calls_to(via).map(|site| self.line(site.span)));
    }

    fn line(&self, span: Span) -> Line {
        let sources = self.measured.program.sources();
        let span = sources.known(span);
        let file = sources.file(span.file);
        (span.file, file.line_index(span.start as usize))
    }
}
