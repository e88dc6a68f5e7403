//! Numbers that checks measure: of each kind the worst, with what it must keep to and where it was found.

use std::borrow::Cow;

use super::Verdict;

/// What a number must keep to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// It may be this at most: errors, energy, weights.
    AtMost(f64),
    /// It must be this at least: probabilities, what a furnace keeps.
    AtLeast(f64),
}

impl Bound {
    /// Does a number keep to it? None that is no number does.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Bound::AtMost(most) => x <= most,
            Bound::AtLeast(least) => x >= least,
        }
    }

    /// Is a number further from keeping to it than another?
    fn worse(self, x: f64, than: f64) -> bool {
        match self {
            _ if x.is_nan() => true,
            Bound::AtMost(_) => x > than,
            Bound::AtLeast(_) => x < than,
        }
    }
}

/// The worst number of a kind that was measured of a subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// What it is about: `energy`, `furnace`, `chi-squared`, `density`, `weight`, `precision`, `reciprocity`, `finite`.
    pub topic: &'static str,
    /// What was measured, in a few words.
    pub what: Cow<'static, str>,
    /// The worst that was found.
    pub worst: f64,
    /// What it must keep to.
    pub bound: Bound,
    /// Where the worst was found: parameters and directions.
    pub place: String,
}

impl Verdict {
    /// Notes a number unless a worse one of its kind and bound is known, and says whether it keeps to its bound.
    pub(super) fn measure(
        &mut self,
        (topic, what): (&'static str, impl Into<Cow<'static, str>>),
        x: f64,
        bound: Bound,
        place: impl FnOnce() -> String,
    ) -> bool {
        let what = what.into();
        let mut known = self.measured.iter_mut();
        let known = known.find(|m| m.topic == topic && m.what == what && m.bound == bound);
        let one = || Measurement {
            topic,
            what: what.clone(),
            worst: x,
            bound,
            place: place(),
        };
        match known {
            Some(known) if known.bound.worse(x, known.worst) => *known = one(),
            Some(_) => {}
            None => self.measured.push(one()),
        }
        bound.holds(x)
    }
}
