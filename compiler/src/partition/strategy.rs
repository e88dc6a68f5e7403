//! Strategies: ways to come to a plan, by their names on the command line.

use super::{Form, Organisation, Plan};

/// A way to assign materials to kernels that needs to know nothing of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// Wavefront; each material has its own kernel.
    Own,
    /// Wavefront; all materials share one queue and kernel.
    Mixed,
    /// Wavefront; each material has its own queue, and one kernel works on all of them.
    Binned,
    /// Wavefront; materials are evaluated where hits are found.
    Inline,
    /// One kernel for everything.
    Mega,
}

impl Strategy {
    /// Every strategy with its name on the command line.
    pub const ALL: [(Strategy, &'static str); 7] = [
        (Strategy::Own, "own"),
        (Strategy::Own, "wavefront"),
        (Strategy::Mixed, "mixed"),
        (Strategy::Mixed, "shared"),
        (Strategy::Binned, "binned"),
        (Strategy::Inline, "inline"),
        (Strategy::Mega, "mega"),
    ];

    /// The strategy called `name`.
    pub fn from_name(name: &str) -> Option<Strategy> {
        Self::ALL.iter().find(|(_, n)| *n == name).map(|(s, _)| *s)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        // The table holds every strategy.
        let found = Self::ALL.iter().find(|(s, _)| *s == self);
        found.map_or("", |(_, name)| name)
    }

    /// The plan for materials called `names`, in program order.
    pub fn plan(self, names: &[String]) -> Plan {
        let all = || (0..names.len()).collect::<Vec<usize>>();
        let one = |form| vec![(form, all())];
        let groups = match self {
            Strategy::Own => all().into_iter().map(|m| (Form::Own, vec![m])).collect(),
            Strategy::Mixed => one(Form::Mixed),
            Strategy::Binned => one(Form::Binned),
            Strategy::Inline | Strategy::Mega => one(Form::Inline),
        };
        let groups = groups
            .into_iter()
            .filter(|(_, members)| !members.is_empty());
        let plan = Plan::wavefront(self.name(), groups, Vec::new(), names);
        match self {
            Strategy::Mega => Plan {
                organisation: Organisation::Mega,
                ..plan
            },
            _ => plan,
        }
    }
}
