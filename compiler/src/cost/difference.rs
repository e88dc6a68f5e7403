//! What an edit did to the cost of materials.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Cost, LineCost, MaterialCost, Walks};

/// How the materials of two sources differ in what they cost; materials of one name belong together.
#[derive(Clone, Debug, Serialize)]
pub struct Difference {
    /// The materials that both have, in the order of the new source.
    pub materials: Vec<Change>,
    /// The materials that only the old source has.
    pub only_old: Vec<String>,
    /// The materials that only the new source has.
    pub only_new: Vec<String>,
}

/// What became of the cost of a material.
#[derive(Clone, Debug, Serialize)]
pub struct Change {
    /// Its name.
    pub name: String,
    /// Does it cost what it did, in every number?
    pub same: bool,
    /// What it cost; none if it was on no surface.
    pub old: Option<Cost>,
    /// What it costs now.
    pub new: Option<Cost>,
    /// What its light cost below the surface, if any went there.
    pub old_walks: Option<Walks>,
    /// What it costs there now.
    pub new_walks: Option<Walks>,
    /// The author's lines whose cost changed, those first that changed most.
    pub lines: Vec<LineChange>,
}

/// A line of the author's files whose cost changed. Lines with the same text belong together, the
/// first with the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineChange {
    /// Its text.
    pub text: String,
    /// Where it was, from 1; none if it was not there, or cost nothing.
    pub old_line: Option<usize>,
    /// Where it is now.
    pub new_line: Option<usize>,
    /// Operations of the line and what it called; 0 if it was not there.
    pub old: f64,
    /// Operations of the line and what it calls now.
    pub new: f64,
}

impl LineChange {
    /// Operations that came to it.
    pub fn change(&self) -> f64 {
        self.new - self.old
    }
}

/// What changed from `old` to `new`.
pub fn difference(old: &[MaterialCost], new: &[MaterialCost]) -> Difference {
    let find = |all: &'_ [MaterialCost], name: &str| all.iter().position(|m| m.name == name);
    let both = new.iter().filter_map(|new| {
        let old = &old[find(old, &new.name)?];
        Some(change(old, new))
    });
    let only = |these: &[MaterialCost], those: &[MaterialCost]| {
        let alone = these.iter().filter(|m| find(those, &m.name).is_none());
        alone.map(|m| m.name.clone()).collect()
    };
    Difference {
        materials: both.collect(),
        only_old: only(old, new),
        only_new: only(new, old),
    }
}

fn change(old: &MaterialCost, new: &MaterialCost) -> Change {
    let lines = line_changes(&old.lines, &new.lines);
    Change {
        name: new.name.clone(),
        same: old.cost == new.cost && old.walks == new.walks,
        old: old.cost.clone(),
        new: new.cost.clone(),
        old_walks: old.walks,
        new_walks: new.walks,
        lines,
    }
}

/// A line by what it is recognised: its text, and how many lines with this text come before it.
type Key<'a> = (&'a str, usize);

fn line_changes(old: &[LineCost], new: &[LineCost]) -> Vec<LineChange> {
    let (old, new) = (authored(old), authored(new));
    let mut changes: Vec<LineChange> = Vec::new();
    for (key, line) in &new {
        changes.push(line_change(old.get(key).copied(), Some(line)));
    }
    for (_, line) in old.iter().filter(|(key, _)| !new.contains_key(*key)) {
        changes.push(line_change(Some(line), None));
    }
    changes.retain(|c| c.old != c.new);
    changes.sort_by(|a, b| {
        let most = b.change().abs().total_cmp(&a.change().abs());
        let place = |c: &LineChange| c.new_line.or(c.old_line);
        most.then(place(a).cmp(&place(b)))
    });
    changes
}

/// The lines of the author's files.
fn authored(lines: &[LineCost]) -> BTreeMap<Key<'_>, &LineCost> {
    let mut own: Vec<&LineCost> = lines.iter().filter(|l| !l.library).collect();
    own.sort_by(|a, b| (&a.file, a.line).cmp(&(&b.file, b.line)));
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let keyed = own.into_iter().map(|line| {
        let count = seen.entry(&line.text).or_default();
        *count += 1;
        ((line.text.as_str(), *count), line)
    });
    keyed.collect()
}

fn line_change(old: Option<&LineCost>, new: Option<&LineCost>) -> LineChange {
    let text = new.or(old).map_or(String::new(), |l| l.text.clone());
    LineChange {
        text,
        old_line: old.map(|l| l.line),
        new_line: new.map(|l| l.line),
        old: old.map_or(0.0, |l| l.with_calls),
        new: new.map_or(0.0, |l| l.with_calls),
    }
}
