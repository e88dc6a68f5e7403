//! The Plan: which kernels a renderer runs and which materials each evaluates.
//!
//! Wavefront, megakernel and every partition between are values of the one [`Plan`] type over
//! the same generated material code.

use serde::{Deserialize, Serialize};

mod candidates;
#[cfg(test)]
mod cases;
mod check;
mod error;
pub mod explain;
pub mod file;
mod form;
mod inputs;
pub mod model;
pub mod profile;
pub mod search;
pub mod strategies;
mod strategy;
pub mod text;
pub mod workload;

pub use candidates::{Candidate, Expected, candidates, in_wide_workgroups};
pub use error::PlanError;
pub use form::Form;
pub use inputs::PlanInputs;
pub use model::{Calibrated, Prediction, TimeModel};
pub use profile::{DeviceProfile, ProfileError};
pub use search::{Automatic, Exact, Groups, Heuristic, Problem, Search};
pub use strategies::{PAPER_OPERATIONS, Requires, STRATEGIES, StrategyRow};
pub use strategy::Strategy;
pub use workload::{Hits, Workload};

/// How the stages of the path tracer are organised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Organisation {
    /// Each stage is a kernel; queues in memory connect them.
    Wavefront,
    /// One kernel runs whole paths; state stays in registers.
    Mega,
}

/// One material kernel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanKernel {
    /// Its name in reports and GPU captures, such as `material_car_paint`.
    pub name: String,
    /// How it treats its members.
    pub form: Form,
    /// Indices of the materials it evaluates, ascending.
    pub materials: Vec<usize>,
    /// Threads of a workgroup, where it is not to have as many as other kernels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub workgroup: Option<u32>,
}

/// Which kernels a renderer runs. Every material of the program is in exactly one of them, or else
/// unused ([`Plan::check`]).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// The strategy that made it, as given on the command line.
    pub strategy: String,
    /// Wavefront or mega.
    pub organisation: Organisation,
    /// The material kernels.
    pub kernels: Vec<PlanKernel>,
    /// Indices of the materials without a kernel, ascending: no surface of the scene binds them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unused: Vec<usize>,
}

impl Plan {
    /// A wavefront of the kernels `groups`, in this order, for materials called `names`; `unused`
    /// have none. Equal names of kernels are told apart by a number.
    pub fn wavefront(
        strategy: impl Into<String>,
        groups: impl IntoIterator<Item = (Form, Vec<usize>)>,
        unused: Vec<usize>,
        names: &[String],
    ) -> Plan {
        let groups = groups.into_iter();
        let kernels = groups.map(|(form, materials)| PlanKernel::new(form, materials, names));
        Self::of_kernels(strategy, kernels.collect(), unused)
    }

    /// A wavefront of some kernels, in this order; the materials `unused` have none. Equal names of kernels are told apart
    /// by a number.
    pub(crate) fn of_kernels(
        strategy: impl Into<String>,
        mut kernels: Vec<PlanKernel>,
        mut unused: Vec<usize>,
    ) -> Plan {
        number_equal_names(&mut kernels);
        unused.sort_unstable();
        Plan {
            strategy: strategy.into(),
            organisation: Organisation::Wavefront,
            kernels,
            unused,
        }
    }

    /// The form and the materials of each kernel, in its order.
    pub fn groups(&self) -> Groups {
        let kernels = self.kernels.iter();
        kernels.map(|k| (k.form, k.materials.clone())).collect()
    }

    /// Whether another has the same kernels, whatever they are called and in whichever order they come.
    pub fn does_as(&self, other: &Self) -> bool {
        let kernels = |plan: &Self| {
            let kernels = plan.kernels.iter();
            let mut kernels: Vec<_> = kernels.map(PlanKernel::what_it_does).collect();
            kernels.sort();
            kernels
        };
        self.organisation == other.organisation
            && self.unused == other.unused
            && kernels(self) == kernels(other)
    }

    /// The same plan without kernels for the materials `unused`, which no surface binds.
    pub fn leaving_out(mut self, unused: &[usize]) -> Plan {
        for kernel in &mut self.kernels {
            kernel.materials.retain(|m| !unused.contains(m));
        }
        self.kernels.retain(|k| !k.materials.is_empty());
        self.unused.extend(unused);
        self.unused.sort_unstable();
        self.unused.dedup();
        self
    }
}

/// Gives the second of equal names the number 2, the third 3.
fn number_equal_names(kernels: &mut [PlanKernel]) {
    let mut taken = std::collections::BTreeSet::new();
    for kernel in kernels {
        let base = kernel.name.clone();
        let mut number = 2;
        while !taken.insert(kernel.name.clone()) {
            kernel.name = format!("{base}_{number}");
            number += 1;
        }
    }
}

impl PlanKernel {
    /// A kernel over `materials`, called after the only one or after its form.
    pub fn new(form: Form, mut materials: Vec<usize>, names: &[String]) -> Self {
        materials.sort_unstable();
        let only = match materials[..] {
            [only] => names.get(only).map(String::as_str),
            _ => None,
        };
        let name = match only {
            Some(only) if !form.takes_several() => only,
            _ => form.name(),
        };
        Self {
            name: format!("material_{name}"),
            form,
            materials,
            workgroup: None,
        }
    }

    /// All that it does, whatever it is called.
    pub fn what_it_does(&self) -> (Form, Vec<usize>, Option<u32>) {
        (self.form, self.materials.clone(), self.workgroup)
    }
}
