//! What a plan is made from.

use super::search::Problem;
use super::{DeviceProfile, Groups, Plan, Workload};
use crate::cost::Cost;

/// What is known of a scene's materials when a plan is made.
#[derive(Clone, Copy, Debug)]
pub struct PlanInputs<'a> {
    /// The names of the program's materials, in its order.
    pub names: &'a [String],
    /// Those that no surface binds.
    pub unused: &'a [usize],
    /// What each costs, if that is known.
    pub costs: Option<&'a [Option<Cost>]>,
    /// How paths hit them, if that is known.
    pub workload: Option<&'a Workload>,
    /// What the GPU takes, if that is known.
    pub profile: Option<&'a DeviceProfile>,
}

impl<'a> PlanInputs<'a> {
    /// Materials called `names`, all on some surface, of which nothing else is known.
    pub fn of_names(names: &'a [String]) -> Self {
        Self {
            names,
            unused: &[],
            costs: None,
            workload: None,
            profile: None,
        }
    }

    /// The materials that are on some surface, to be placed in kernels of any form.
    pub fn problem(&self) -> Problem {
        Problem::new((0..self.names.len()).filter(|m| !self.unused.contains(m)))
    }

    /// The wavefront of `groups`, which a strategy called `strategy` has made.
    pub fn plan(&self, strategy: &str, groups: Groups) -> Plan {
        Plan::wavefront(strategy, groups, self.unused.to_vec(), self.names)
    }
}
