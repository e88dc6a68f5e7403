//! A time model and a search of one's own, in place of those of `--strategy auto`. No GPU is needed.
//!
//! ```sh
//! cargo run --example custom_model
//! cargo run --example custom_model -- SCENE.toml WORKLOAD.json
//! ```
//!
//! The model is the simplest that anyone would write: a kernel takes a fixed time to start and drain, and
//! then its operations, one after the other; nothing diverges. The search throws dice. What either makes
//! of a scene is set beside what `auto` makes of it, all judged by the calibrated model.

use std::error::Error;
use std::path::Path;

use impasto::compiler::partition::{
    Automatic, Calibrated, DeviceProfile, Form, Groups, Problem, Search, TimeModel, Workload,
};
use impasto::compiler::partition::{search, text};
use impasto::plan::SceneMaterials;

const SCENE: &str = "examples/swatches/scene.toml";
const WORKLOAD: &str = "tests/plans/swatches.workload.json";

/// A kernel takes a start and its operations.
struct Simple<'a> {
    materials: &'a SceneMaterials,
    workload: &'a Workload,
    /// Seconds that a kernel takes to start and to drain.
    start: f64,
    /// Seconds of one operation of one lane, all of the machine being busy.
    operation: f64,
}

impl TimeModel for Simple<'_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        let operations = |m: &usize| {
            let cost = self.materials.costs[*m].as_ref();
            let mean = cost.map_or(0.0, |cost| cost.operations.mean);
            mean * self.workload.materials[*m].share
        };
        let slots = f64::from(self.workload.pool);
        let busy = self.operation * slots * members.iter().map(operations).sum::<f64>();
        match form {
            // Whoever has no kernel waits for none, but holds up the others of its subgroup.
            Form::Inline => busy * (members.len() as f64).sqrt(),
            _ => self.start + busy,
        }
    }
}

/// Throws dice for every material, often, and keeps the best.
struct Dice {
    throws: u32,
}

impl Search for Dice {
    fn search(&self, problem: &Problem, model: &dyn TimeModel) -> Groups {
        let mut random = 1u64;
        let mut best: Option<(f64, Groups)> = None;
        for _ in 0..self.throws {
            let groups = thrown(problem, &mut random);
            let seconds = search::total(model, &groups);
            if best.as_ref().is_none_or(|(least, _)| seconds < *least) {
                best = Some((seconds, groups));
            }
        }
        best.map_or(Groups::new(), |(_, groups)| groups)
    }
}

/// Materials thrown into at most four kernels, of which the first is inline.
fn thrown(problem: &Problem, random: &mut u64) -> Groups {
    let mut kernels: [Vec<usize>; 4] = Default::default();
    for material in &problem.materials {
        kernels[throw(random, 4)].push(*material);
    }
    let form = |(k, members): (usize, &Vec<usize>)| match (k, members.len()) {
        (0, _) => Form::Inline,
        (_, 1) => Form::Own,
        _ => [Form::Mixed, Form::Binned][throw(random, 2)],
    };
    let forms: Vec<Form> = kernels.iter().enumerate().map(form).collect();
    let groups = forms.into_iter().zip(kernels);
    groups.filter(|(_, members)| !members.is_empty()).collect()
}

/// A number below `sides`, by a linear congruential generator.
fn throw(random: &mut u64, sides: usize) -> usize {
    *random = random
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*random >> 33) as usize % sides
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let scene = args.next().unwrap_or_else(|| SCENE.into());
    let workload = args.next().unwrap_or_else(|| WORKLOAD.into());
    let scene = impasto::load(Path::new(&scene))?;
    let program = impasto::compile(&scene)?;
    let materials = SceneMaterials::new(&scene, &program, 256);
    let workload = Workload::parse(&std::fs::read_to_string(workload)?, &materials.names)?;
    let profile = DeviceProfile::named("h200").ok_or("there is no profile of that name")?;

    let inputs = materials.inputs(&workload, &profile);
    let calibrated = Calibrated {
        costs: &materials.costs,
        workload: &workload,
        profile: &profile,
    };
    let simple = Simple {
        materials: &materials,
        workload: &workload,
        start: 20e-6,
        operation: 1.0 / 33e12,
    };
    let dice = Dice { throws: 20_000 };
    let plans: [(&str, &dyn TimeModel, &dyn Search); 4] = [
        (
            "calibrated model, automatic search",
            &calibrated,
            &Automatic,
        ),
        ("calibrated model, dice", &calibrated, &dice),
        ("simple model, automatic search", &simple, &Automatic),
        ("simple model, dice", &simple, &dice),
    ];
    for (what, model, search) in plans {
        let groups = search.search(&inputs.problem(), model);
        let plan = inputs.plan("custom", groups.clone());
        plan.check_named(&materials.names)?;
        let us = |model: &dyn TimeModel| 1e6 * search::total(model, &groups);
        println!("{what}");
        println!("  {}", text::print(&plan, &materials.names));
        println!(
            "  {:.1} us by the model used, {:.1} us by the calibrated one",
            us(model),
            us(&calibrated)
        );
    }
    Ok(())
}
