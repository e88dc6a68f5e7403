//! `auto`: the partition that the search finds to be fastest by the time model.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Automatic, Calibrated, Groups, Problem, Search, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow::new(
    "auto",
    "what the time model predicts to be fastest",
    Rule::Model(groups),
);

impl Strategy {
    /// What the time model likes best.
    pub const AUTO: Strategy = Strategy::new(&ROW);
}

fn groups(request: &Request<'_>, model: &Calibrated<'_>) -> Groups {
    let problem = Problem::new(request.materials.iter().copied());
    Automatic.search(&problem, &model.prepared())
}
