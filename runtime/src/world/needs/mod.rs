//! What must exist for a scene: one table of needs, of which everything else takes its conditions.
//!
//! A row of the table is a feature: when a scene has it, and why. The rows are decided once for a world, its
//! materials and a technique ([`Decision`]), before any text is written. State fields, stages, parts
//! of WGSL, their `#if` flags and random draws name rows (`When`) and decide nothing themselves; so a scene
//! pays for what it uses. Rows can be forced, to measure what a scene saves by not having them
//! ([`crate::audit`]), and to test that they change no picture.

use crate::technique::Features;
use crate::wgsl::template::Flag;

mod decision;
mod inputs;
mod table;

pub(crate) use decision::Decision;
pub(crate) use inputs::{LightTraits, MediaTraits, NeedInputs, OutputTraits, SurfaceTraits};
pub(crate) use table::{Forcing, Need, OF_MATERIALS, OF_WAVEFRONTS, ROWS, Row};

/// The rows that are on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Needs(u64);

/// A condition on rows: what a field, stage or part must have to exist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct When {
    /// Rows that must all be on.
    pub all: &'static [Need],
    /// Rows of which none may be on.
    pub none: &'static [Need],
}

/// Always.
pub(crate) const ALWAYS: When = when(&[]);

impl When {
    /// Whether it holds for every scene.
    pub(crate) fn is_always(&self) -> bool {
        self.all.is_empty() && self.none.is_empty()
    }
}

/// If all of some rows are on.
pub(crate) const fn when(all: &'static [Need]) -> When {
    When { all, none: &[] }
}

impl Needs {
    /// Some rows.
    pub(crate) const fn of_rows(rows: &[Need]) -> Self {
        let mut bits = 0;
        let mut at = 0;
        while at < rows.len() {
            bits |= 1 << rows[at] as u64;
            at += 1;
        }
        Self(bits)
    }

    /// What the table says of `inputs`, and what is `forced` with all that it is built on.
    fn judged(inputs: &NeedInputs<'_>, forced: Needs) -> Self {
        let forced = forced.with_foundations();
        let mut needs = Needs::default();
        for row in &ROWS {
            if forced.has(row.need) || (row.reason)(inputs, needs).is_some() {
                needs = needs.with(row.need);
            }
        }
        needs
    }

    /// The rows that `features` put on in a scene that needs `natural` by itself.
    pub(crate) fn forced(features: Features, natural: Needs) -> Needs {
        match features {
            Features::Scene => Needs::default(),
            Features::All => Needs::everything(natural),
        }
    }

    /// Everything that can be on at once for a scene that needs `natural` by itself.
    pub(crate) fn everything(natural: Needs) -> Self {
        let fits = |row: &&Row| row.is_forceable_with(natural);
        let rows = ROWS.iter().filter(|r| r.is_in_everything());
        rows.filter(fits)
            .fold(natural, |all, row| all.with(row.need))
    }

    /// Whether a row is on.
    pub(crate) fn has(self, need: Need) -> bool {
        self.0 >> need as u64 & 1 == 1
    }

    /// Whether any of some rows is on.
    pub(crate) fn any(self, rows: &[Need]) -> bool {
        self.0 & Self::of_rows(rows).0 != 0
    }

    /// The same with one row more.
    pub(crate) fn with(self, need: Need) -> Self {
        Self(self.0 | 1 << need as u64)
    }

    /// The same without a row.
    pub(crate) fn without(self, need: Need) -> Self {
        Self(self.0 & !(1 << need as u64))
    }

    /// The rows of either.
    pub(crate) fn or(self, other: Needs) -> Self {
        Self(self.0 | other.0)
    }

    /// The rows of both.
    pub(crate) fn and(self, other: Needs) -> Self {
        Self(self.0 & other.0)
    }

    /// The rows of this that another lacks.
    pub(crate) fn minus(self, other: Needs) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether a condition holds.
    pub(crate) fn met(self, when: When) -> bool {
        when.all.iter().all(|n| self.has(*n)) && !self.any(when.none)
    }

    /// The rows as flags of WGSL text.
    pub(crate) fn flags(self) -> impl Iterator<Item = Flag> {
        ROWS.iter().map(move |row| (row.flag, self.has(row.need)))
    }

    /// The same with what its rows are built on.
    fn with_foundations(self) -> Self {
        let rows = ROWS.iter().rev();
        rows.fold(self, |needs, row| {
            if needs.has(row.need) {
                needs.or(Self::of_rows(row.foundations))
            } else {
                needs
            }
        })
    }
}
