//! What stands beside the lines of a source: what they cost, and above each material what all of it costs and which
//! kernel it has.
//!
//! Costs come a moment after typing rests. Until then the lines that did not change keep theirs, wherever they move.

use std::collections::BTreeMap;

use impasto_compiler::cost::{MaterialCost, difference};

use crate::host::PlannedMaterial;
use crate::text::Change;

/// What is known of the cost of an open file.
#[derive(Clone, Debug, Default)]
pub struct Margin {
    /// Operations by line, from 0.
    lines: BTreeMap<usize, LineHint>,
    /// What materials cost, by name.
    materials: Vec<MaterialHint>,
}

/// What a line costs.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LineHint {
    /// Operations of one evaluation, of the line and what it calls.
    operations: f64,
    /// Their share of the material's.
    share: f64,
}

/// What a material costs.
#[derive(Clone, Debug, PartialEq)]
struct MaterialHint {
    name: String,
    operations: f64,
    live: u32,
    lobes: usize,
    /// Operations that came to it since the file was committed.
    change: Option<f64>,
}

/// A line's share of its material from which on its hint is shown.
const SHOWN: f64 = 0.01;

impl Margin {
    /// What was measured of the materials of the file at `path`, and of the same file as it was committed.
    pub fn new(path: &str, costs: &[MaterialCost], committed: Option<&[MaterialCost]>) -> Self {
        let mut margin = Self::default();
        let changes = committed.map(|old| difference(old, costs));
        for material in costs {
            let Some(cost) = &material.cost else { continue };
            let change = changes.as_ref().and_then(|d| {
                let change = d.materials.iter().find(|m| m.name == material.name)?;
                let operations = |c: &Option<impasto_compiler::cost::Cost>| {
                    c.as_ref().map(|c| c.operations.mean)
                };
                Some(operations(&change.new)? - operations(&change.old)?)
            });
            margin.materials.push(MaterialHint {
                name: material.name.clone(),
                operations: cost.operations.mean,
                live: cost.live,
                lobes: material.lobes,
                change,
            });
            for line in material.lines.iter().filter(|l| l.file == path) {
                let hint = LineHint {
                    operations: line.with_calls,
                    share: line.share,
                };
                // A helper that several materials call costs what the most expensive of them spends in it.
                let known = margin.lines.entry(line.line - 1).or_insert(hint);
                if hint.operations > known.operations {
                    *known = hint;
                }
            }
        }
        margin
    }

    /// Moves hints with their lines; those of lines that changed go.
    pub fn shift(&mut self, change: Change) {
        let last = change.first + change.old;
        let lines = std::mem::take(&mut self.lines).into_iter();
        let moved = lines.filter_map(|(line, hint)| {
            if line < change.first {
                Some((line, hint))
            } else if line > last {
                Some((line + change.new - change.old, hint))
            } else {
                None
            }
        });
        self.lines = moved.collect();
    }

    /// Texts behind lines, from 0, with a longer one each; those of lines that cost next to nothing are left out.
    pub fn hints(&self) -> impl Iterator<Item = (usize, String, String)> {
        let shown = self.lines.iter().filter(|(_, hint)| hint.share >= SHOWN);
        shown.map(|(line, hint)| {
            let operations = count(hint.operations);
            let short = format!("{operations} ops");
            let percent = 100.0 * hint.share;
            let long = format!(
                "{operations} operations of one evaluation, with what the line calls: {percent:.0} % of the material"
            );
            (*line, short, long)
        })
    }

    /// The text above a material.
    pub fn lens(&self, material: &str) -> Option<String> {
        let hint = self.materials.iter().find(|m| m.name == material)?;
        let lobes = match hint.lobes {
            1 => "1 lobe".to_owned(),
            lobes => format!("{lobes} lobes"),
        };
        let change = match hint.change {
            Some(change) if change.abs() >= 0.5 => {
                let sign = if change > 0.0 { "+" } else { "-" };
                format!(" ({sign}{} since the commit)", count(change.abs()))
            }
            _ => String::new(),
        };
        let operations = count(hint.operations);
        Some(format!(
            "{operations} operations{change}, {} live numbers, {lobes}",
            hint.live
        ))
    }
}

/// What stands above a material of its kernel.
pub fn kernel(planned: &PlannedMaterial, scene: &str) -> String {
    format!("{} in {scene}", planned.kernel)
}

/// A count with separators, as `12,345`.
fn count(x: f64) -> String {
    let digits = format!("{x:.0}");
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 && c.is_ascii_digit() {
            out.push(',');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hints_move_with_their_lines() {
        let hint = |operations| LineHint {
            operations,
            share: 0.5,
        };
        let mut margin = Margin {
            lines: [(1, hint(10.0)), (4, hint(1234.0)), (7, hint(3.0))].into(),
            materials: Vec::new(),
        };
        // Line 4 is edited and becomes three.
        margin.shift(Change {
            first: 4,
            old: 0,
            new: 2,
        });
        let lines: Vec<usize> = margin.hints().map(|(line, ..)| line).collect();
        assert_eq!(lines, [1, 9]);
        // Lines 0 to 2 become one.
        margin.shift(Change {
            first: 0,
            old: 2,
            new: 0,
        });
        let lines: Vec<usize> = margin.hints().map(|(line, ..)| line).collect();
        assert_eq!(lines, [7]);
    }

    #[test]
    fn counts_have_separators() {
        assert_eq!(count(7.4), "7");
        assert_eq!(count(1234.6), "1,235");
        assert_eq!(count(1_234_567.0), "1,234,567");
    }
}
