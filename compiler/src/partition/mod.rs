//! The Plan: which kernels a renderer runs and which materials each evaluates.
//!
//! Wavefront, megakernel and every partition between are values of the one [`Plan`] type over
//! the same generated material code.

use serde::{Deserialize, Serialize};

pub mod model;
pub mod profile;
pub mod workload;

pub use model::{Calibrated, Prediction, TimeModel};
pub use profile::DeviceProfile;
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

/// How a material kernel treats its members.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// One material, one queue.
    Own,
    /// A switch over one queue.
    Mixed,
    /// A queue a material and one dispatch over all of them, in which every workgroup evaluates one
    /// material.
    Binned,
    /// Evaluated where the hit is found, without a queue.
    Inline,
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
}

/// Which kernels a renderer runs. Every material of the program is in exactly one of them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// The strategy that made it, as given on the command line.
    pub strategy: String,
    /// Wavefront or mega.
    pub organisation: Organisation,
    /// The material kernels.
    pub kernels: Vec<PlanKernel>,
}

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
        let one = |form| vec![PlanKernel::new(form, all(), names)];
        let (organisation, kernels) = match self {
            Strategy::Own => {
                let own = |i| PlanKernel::new(Form::Own, vec![i], names);
                (
                    Organisation::Wavefront,
                    all().into_iter().map(own).collect(),
                )
            }
            Strategy::Mixed => (Organisation::Wavefront, one(Form::Mixed)),
            Strategy::Binned => (Organisation::Wavefront, one(Form::Binned)),
            Strategy::Inline => (Organisation::Wavefront, one(Form::Inline)),
            Strategy::Mega => (Organisation::Mega, one(Form::Inline)),
        };
        Plan {
            strategy: self.name().into(),
            organisation,
            kernels,
        }
    }
}

impl PlanKernel {
    /// A kernel over `materials`, ascending, called after the only one or after its form.
    pub fn new(form: Form, materials: Vec<usize>, names: &[String]) -> Self {
        let only = match materials[..] {
            [only] => names.get(only).map(String::as_str),
            _ => None,
        };
        let name = match form {
            Form::Own => only.unwrap_or("own"),
            Form::Mixed => "mixed",
            Form::Binned => "binned",
            Form::Inline => "inline",
        };
        Self {
            name: format!("material_{name}"),
            form,
            materials,
        }
    }
}
