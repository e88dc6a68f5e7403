//! `mega`: one kernel that runs whole paths, with every material inline.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups, Organisation, Plan, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow {
    organisation: Organisation::Mega,
    ..StrategyRow::new("mega", "one kernel for whole paths", Rule::Names(groups))
};

impl Strategy {
    /// One kernel for everything.
    pub const MEGA: Strategy = Strategy::new(&ROW);
}

impl Plan {
    /// The plan of [`Strategy::MEGA`], which lacks nothing: materials are called `names`, and no surface
    /// binds those of `unused`.
    pub fn mega(names: &[String], unused: &[usize]) -> Plan {
        Strategy::MEGA.plan_by_names(groups, names, unused)
    }
}

fn groups(request: &Request<'_>) -> Groups {
    vec![(Form::Inline, request.materials.to_vec())]
}
