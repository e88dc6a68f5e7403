//! What each material of a program costs, with the lines of its source.

use serde::Serialize;

use super::{BUDGET, Cost, Inputs, LineCost, Measured, Operations, Spent, Walks};
use crate::abi::MaterialInfo;
use crate::inspect::At;
use crate::program::Program;

/// What a material of a program costs.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialCost {
    /// Its name in the program.
    pub name: String,
    /// How many instances share its code.
    pub instances: usize,
    /// Its lobes after layering.
    pub lobes: usize,
    /// What evaluating it costs; none if it is on no surface of the scene.
    pub cost: Option<Cost>,
    /// What its light costs below the surface, if any goes there.
    pub walks: Option<Walks>,
    /// What the lines of its source cost, those first that cost most with what they call.
    pub lines: Vec<LineCost>,
    /// What cut its evaluations short, if anything did: then the cost is that of fewer.
    pub spent: Option<Spent>,
}

/// How a material is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// At how many points.
    pub samples: usize,
    /// How many expressions each may take, over all of them together.
    pub budget: u64,
}

impl From<usize> for Effort {
    fn from(samples: usize) -> Self {
        Self {
            samples,
            budget: BUDGET,
        }
    }
}

impl MaterialCost {
    /// Operations of one evaluation.
    pub fn operations(&self) -> Option<&Operations> {
        self.cost.as_ref().map(|c| &c.operations)
    }
}

/// The materials of `program`, each evaluated at a number of points anywhere within a few metres.
pub fn anywhere(program: &Program, effort: impl Into<Effort>) -> Vec<MaterialCost> {
    let effort = effort.into();
    let samples = effort.samples;
    measure(program, effort, |material, info| {
        let of = |i: &usize| program.instances()[*i].info.material == material;
        let instances: Vec<usize> = (0..program.instances().len()).filter(of).collect();
        let mut inputs = Inputs::named(&info.name);
        let point = |i: usize| (instances[i * instances.len() / samples], inputs.anywhere());
        (0..samples).map(point).collect()
    })
}

/// The materials of `program`, each evaluated at the points that `points` gives for it: instances of the program, and
/// where they are.
pub fn measure(
    program: &Program,
    effort: Effort,
    mut points: impl FnMut(usize, &MaterialInfo) -> Vec<(usize, At)>,
) -> Vec<MaterialCost> {
    let cost = |(material, info): (usize, &MaterialInfo)| {
        let instances = program.instances().iter();
        let points = points(material, info);
        let measured = Measured::within(program, material, &points, effort.budget);
        MaterialCost {
            name: info.name.clone(),
            instances: instances.filter(|i| i.info.material == material).count(),
            lobes: info.lobes,
            cost: measured.as_ref().map(Measured::cost),
            walks: measured.as_ref().and_then(Measured::walks),
            lines: measured.as_ref().map_or(Vec::new(), Measured::lines),
            spent: measured.and_then(|m| m.spent().cloned()),
        }
    };
    program.materials().enumerate().map(cost).collect()
}
