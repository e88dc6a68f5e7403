//! `own`: a kernel for each material.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups, Plan, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow {
    older_names: &["wavefront"],
    ..StrategyRow::new("own", "a kernel for each material", Rule::Names(groups))
};

impl Strategy {
    /// Wavefront; each material has its own kernel.
    pub const OWN: Strategy = Strategy::new(&ROW);
}

impl Plan {
    /// The plan of [`Strategy::OWN`], which lacks nothing: materials are called `names`, and no surface
    /// binds those of `unused`.
    pub fn own(names: &[String], unused: &[usize]) -> Plan {
        Strategy::OWN.plan_by_names(groups, names, unused)
    }
}

fn groups(request: &Request<'_>) -> Groups {
    let materials = request.materials.iter();
    materials.map(|m| (Form::Own, vec![*m])).collect()
}
