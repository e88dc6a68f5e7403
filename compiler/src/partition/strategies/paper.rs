//! `paper`: the hand choice of Laine, Karras and Aila 2013, as a threshold.

use super::{Request, Rule, StrategyRow, threshold};
use crate::cost::Cost;
use crate::partition::{Groups, Strategy};

/// Mean operations from which on [`Strategy::PAPER`] gives a material a kernel of its own.
///
/// Laine, Karras and Aila 2013 decide by hand, and leave choosing by a machine open: what is expensive
/// and procedural has its own kernel, and what is simple shares one. One noise evaluation is where the
/// two part in their scenes: every material that they call complex evaluates noise or a loop (868
/// operations and more, as Impasto counts), and none of the others does (430 and less).
pub const PAPER_OPERATIONS: f64 = 600.0;

pub(super) const ROW: StrategyRow = StrategyRow::new(
    "paper",
    "the hand choice of Laine, Karras and Aila 2013: threshold=600",
    Rule::Costs(groups),
);

impl Strategy {
    /// The hand choice of Laine, Karras and Aila 2013: [`PAPER_OPERATIONS`].
    pub const PAPER: Strategy = Strategy::new(&ROW);
}

fn groups(request: &Request<'_>, costs: &[Option<Cost>]) -> Groups {
    let request = Request {
        number: PAPER_OPERATIONS,
        ..*request
    };
    threshold::groups(&request, costs)
}
