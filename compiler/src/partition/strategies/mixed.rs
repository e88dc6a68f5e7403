//! `mixed`: one kernel for all materials.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow {
    older_names: &["shared"],
    ..StrategyRow::new(
        "mixed",
        "one kernel for all materials, which switches",
        Rule::Names(groups),
    )
};

impl Strategy {
    /// Wavefront; all materials share one queue and kernel.
    pub const MIXED: Strategy = Strategy::new(&ROW);
}

fn groups(request: &Request<'_>) -> Groups {
    vec![(Form::Mixed, request.materials.to_vec())]
}
