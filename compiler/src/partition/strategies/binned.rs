//! `binned`: one dispatch for all materials, each with a queue.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow::new(
    "binned",
    "one dispatch for all materials, of which each workgroup evaluates one",
    Rule::Names(groups),
);

impl Strategy {
    /// Wavefront; each material has its own queue, and one kernel works on all of them.
    pub const BINNED: Strategy = Strategy::new(&ROW);
}

fn groups(request: &Request<'_>) -> Groups {
    vec![(Form::Binned, request.materials.to_vec())]
}
