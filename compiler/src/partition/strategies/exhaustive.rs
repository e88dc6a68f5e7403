//! `exhaustive`: every kernel is measured, and the best plan by those times is taken. That wants a GPU, so
//! the rule is in the library's module `impasto::measure`, and only `impasto plan` asks for it.

use super::{Rule, StrategyRow};
use crate::partition::Strategy;

pub(super) const ROW: StrategyRow = StrategyRow::new(
    "exhaustive",
    "what is fastest when every kernel is measured; `impasto plan` only",
    Rule::Measured,
);

impl Strategy {
    /// What is best when every kernel is measured.
    pub const EXHAUSTIVE: Strategy = Strategy::new(&ROW);
}
