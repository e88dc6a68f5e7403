//! What tests of numerical stability measured, kept for `cargo experiments stress`, and how hard they
//! are to try.
//!
//! `IMPASTO_EFFORT=full` has the same tests look at more directions, samples and restarts;
//! `IMPASTO_EFFORT=share`, as `cargo xtask test` has it without `--all`, has the longest of them take a
//! share of their cases, each as thoroughly as ever. There is no second list of cases.
//! `IMPASTO_STRESS_ROWS` names a folder: each `Row` noted becomes a line of a file there, written at
//! once, so that a test which fails later does not lose it. A test notes what it measured before it
//! asserts. Tests of other crates include this file by `#[path]`.

#![allow(dead_code)]

use std::io::Write;
use std::path::PathBuf;

/// The folder that rows are kept in.
pub const ROWS: &str = "IMPASTO_STRESS_ROWS";

/// What `IMPASTO_EFFORT` asks for.
pub const EFFORT: &str = "IMPASTO_EFFORT";

/// What holds a measured number.
#[derive(Clone, Copy, Debug)]
pub enum Bound {
    /// It may be this at most: errors, energy, weights.
    AtMost(f64),
    /// It must be this at least: probabilities, what a furnace keeps.
    AtLeast(f64),
}

/// One measured number.
pub struct Row<'a> {
    /// The row of the table of extremes that it belongs to, `1` to `32`, or for tests of sampling
    /// one of `chi-squared`, `density`, `energy`, `weight`, `furnace`, `reciprocity`, `precision`.
    pub table: &'a str,
    /// The BSDF, material, light or scene.
    pub subject: &'a str,
    /// What was measured, in a few words.
    pub what: &'a str,
    /// The worst that was found; not a number where the answer was none.
    pub worst: f64,
    /// What it must keep to.
    pub bound: Bound,
    /// Where the worst was found: parameters and directions.
    pub place: &'a str,
}

impl Row<'_> {
    /// Does it keep to its bound? Not, if it is no number.
    pub fn holds(&self) -> bool {
        match self.bound {
            Bound::AtMost(most) => self.worst <= most,
            Bound::AtLeast(least) => self.worst >= least,
        }
    }

    /// Keeps the row, and says whether it holds.
    pub fn note(&self) -> bool {
        if let Some(folder) = std::env::var_os(ROWS) {
            keep(PathBuf::from(folder), &self.line());
        }
        self.holds()
    }

    /// The fields between tabs; numbers in the shortest form that reads back the same.
    fn line(&self) -> String {
        let (kind, bound) = match self.bound {
            Bound::AtMost(most) => ("<=", most),
            Bound::AtLeast(least) => (">=", least),
        };
        let verdict = if self.holds() { "good" } else { "bad" };
        let text = |s: &str| s.split_whitespace().collect::<Vec<_>>().join(" ");
        format!(
            "{}\t{}\t{}\t{:e}\t{kind}\t{bound:e}\t{verdict}\t{}\n",
            text(self.table),
            text(self.subject),
            text(self.what),
            self.worst,
            text(self.place),
        )
    }
}

/// Appends a line to this process's file; one write, so that threads do not mix theirs.
fn keep(folder: PathBuf, line: &str) {
    let file = folder.join(format!("{}.tsv", std::process::id()));
    let opened = std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(&file);
    let written = opened.and_then(|mut f| f.write_all(line.as_bytes()));
    written.unwrap_or_else(|e| panic!("{}: {e}", file.display()));
}

/// Is everything to be tried that time allows?
pub fn full() -> bool {
    std::env::var(EFFORT).is_ok_and(|e| e == "full")
}

/// Is a share of the cases of the longest tests enough?
pub fn share() -> bool {
    std::env::var(EFFORT).is_ok_and(|e| e == "share")
}

/// `fast` as the suite has it, or `full` where all is to be tried.
pub fn effort(fast: usize, at_full: usize) -> usize {
    if full() { at_full } else { fast }
}
