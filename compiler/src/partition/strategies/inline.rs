//! `inline`: no kernel for materials; the logic kernel evaluates them.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow::new(
    "inline",
    "materials are evaluated where hits are found",
    Rule::Names(groups),
);

impl Strategy {
    /// Wavefront; materials are evaluated where hits are found.
    pub const INLINE: Strategy = Strategy::new(&ROW);
}

fn groups(request: &Request<'_>) -> Groups {
    vec![(Form::Inline, request.materials.to_vec())]
}
