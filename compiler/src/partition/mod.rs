//! The Plan: which kernels a renderer runs and which materials each evaluates.
//!
//! Wavefront, megakernel and every partition between are values of the one [`Plan`] type over
//! the same generated material code.

use serde::{Deserialize, Serialize};

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
    /// Evaluated inside another kernel, without a queue.
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

/// A way to assign materials to kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// Wavefront; all materials share one kernel.
    Shared,
    /// Wavefront; each material has its own kernel.
    Own,
    /// One kernel for everything.
    Mega,
}

impl Strategy {
    /// Every strategy with its name on the command line; the first is the default.
    pub const ALL: [(Strategy, &'static str); 4] = [
        (Strategy::Own, "wavefront"),
        (Strategy::Own, "own"),
        (Strategy::Shared, "shared"),
        (Strategy::Mega, "mega"),
    ];

    /// The strategy called `name`.
    pub fn from_name(name: &str) -> Option<Strategy> {
        Self::ALL.iter().find(|(_, n)| *n == name).map(|(s, _)| *s)
    }

    /// The plan for materials called `names`, in program order.
    pub fn plan(self, names: &[String]) -> Plan {
        let all: Vec<usize> = (0..names.len()).collect();
        let kernel = |name: String, form, materials| PlanKernel {
            name,
            form,
            materials,
        };
        let (strategy, organisation, kernels) = match self {
            Strategy::Shared => (
                "shared",
                Organisation::Wavefront,
                vec![kernel("material".into(), Form::Mixed, all)],
            ),
            Strategy::Mega => (
                "mega",
                Organisation::Mega,
                vec![kernel("material".into(), Form::Inline, all)],
            ),
            Strategy::Own => {
                let own = |i: usize| kernel(format!("material_{}", names[i]), Form::Own, vec![i]);
                (
                    "own",
                    Organisation::Wavefront,
                    all.into_iter().map(own).collect(),
                )
            }
        };
        Plan {
            strategy: strategy.into(),
            organisation,
            kernels,
        }
    }
}
