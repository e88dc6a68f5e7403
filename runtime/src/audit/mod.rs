//! What a scene needs and why, and what it saves by going without the rest: measured by writing its kernels
//! again with one row more. Needs no GPU.

mod path_kernel;

pub use path_kernel::{PathKernel, PathSample, dropped_value};

use std::collections::{BTreeMap, BTreeSet};

use impasto_compiler::abi::MaterialInfo;
use naga::{Expression, Function, Module};
use serde::Serialize;

use crate::error::RuntimeError;
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::{Kernel, Sizes};
use crate::kernels::stages::STAGES;
use crate::kernels::state;
use crate::kernels::validate::validate;
use crate::render::CompositionInputs;
use crate::technique::Technique;
use crate::world::needs::{Decision, Forcing, Need, NeedInputs, Needs, ROWS, Row};
use crate::world::{MaterialSource, World};

/// Sizes of a pool that kernels are written for; they are constants in the text.
const SIZES: Sizes = Sizes {
    pool: 1 << 20,
    pools: 1,
    workgroup: 128,
    suited: false,
    threads: 1 << 16,
    fetch_limit: 64,
    row_groups: 1 << 14,
};
/// Lanes of the subgroups that kernels are written for.
const SUBGROUP_SIZE: u32 = 32;

/// How large the kernels of a scene and their state are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Extent {
    /// Bytes of a path's state.
    pub path_bytes: i64,
    /// Lines of WGSL that are not blank, of all kernels.
    pub lines: i64,
    /// Kernels.
    pub kernels: i64,
    /// Buffers that kernels bind, each counted in every kernel that does.
    pub bindings: i64,
    /// Operations of all kernels in naga's IR.
    pub operations: i64,
}

/// A row of the table of needs, for one scene.
#[derive(Clone, Debug, Serialize)]
pub struct NeedReport {
    /// What it is called.
    pub name: &'static str,
    /// When a scene has it.
    pub when: &'static str,
    /// Why this one has it; absent if it was left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub because: Option<String>,
    /// The fields of a path's state that it brings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<&'static str>,
    /// The kernels that it brings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<&'static str>,
    /// The random numbers that it draws.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub draws: &'static str,
    /// What having it beside what is needed would take, with all that it is built on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saved: Option<Extent>,
    /// Why that is not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unmeasured: Option<String>,
}

/// What a scene needs, with a kernel a material.
#[derive(Clone, Debug, Serialize)]
pub struct NeedsReport {
    /// What its kernels and state take.
    pub extent: Extent,
    /// What they would take with everything that can be on at once.
    pub everything: Extent,
    /// Every row of the table.
    pub rows: Vec<NeedReport>,
}

/// What `world` needs whose materials are those of `source`.
///
/// # Errors
/// If its kernels are not valid.
pub fn report(
    world: &World,
    source: &dyn MaterialSource,
    technique: Technique,
) -> Result<NeedsReport, RuntimeError> {
    let materials = source.infos();
    let mut scale = Scale {
        world,
        source,
        technique,
        materials: &materials,
        operations: BTreeMap::new(),
    };
    let natural = Decision::of(&scale.inputs(), |_| Needs::default()).needs;
    let extent = scale.weigh(Needs::default())?;
    let everything = scale.weigh(Needs::everything(natural))?;
    let rows = ROWS.iter().map(|row| scale.row(row, natural, extent));
    Ok(NeedsReport {
        extent,
        everything,
        rows: rows.collect::<Result<_, _>>()?,
    })
}

/// A kernel as text.
#[derive(Clone, Debug)]
pub struct KernelText {
    /// Its name.
    pub name: String,
    /// Its WGSL.
    pub wgsl: String,
    /// The buffers that it binds.
    pub bindings: Vec<String>,
}

/// The kernels that a render of `world` by `technique` would run, with a kernel a material of `source`.
///
/// # Errors
/// If it cannot be rendered so.
pub fn kernels(
    world: &World,
    source: &dyn MaterialSource,
    technique: Technique,
) -> Result<Vec<KernelText>, RuntimeError> {
    let decision = world.decide(&source.infos(), &technique);
    let (_, kernels) = compose(world, source, technique, decision)?;
    let text = |kernel: Kernel| KernelText {
        name: kernel.desc.name,
        wgsl: kernel.wgsl,
        bindings: kernel
            .bindings
            .into_iter()
            .map(|b| b.name.to_owned())
            .collect(),
    };
    Ok(kernels.into_iter().map(text).collect())
}

/// The rows of the table by name, each with its condition in words.
pub fn rows() -> impl Iterator<Item = (&'static str, &'static str)> {
    ROWS.iter().map(|row| (row.name, row.when))
}

/// Writes kernels with rows forced, and weighs them.
struct Scale<'a> {
    world: &'a World,
    source: &'a dyn MaterialSource,
    technique: Technique,
    materials: &'a [MaterialInfo],
    /// Operations of kernels seen before, by their text.
    operations: BTreeMap<String, i64>,
}

impl<'a> Scale<'a> {
    /// What decides which rows are on.
    fn inputs(&self) -> NeedInputs<'a> {
        self.world.need_inputs(self.materials, &self.technique)
    }

    fn row(
        &mut self,
        row: &Row,
        natural: Needs,
        extent: Extent,
    ) -> Result<NeedReport, RuntimeError> {
        let because = (row.reason)(&self.inputs(), natural);
        let saved = if because.is_none() && row.is_forceable_with(natural) {
            Some(self.weigh(Needs::of_rows(&[row.need]))?.beyond(extent))
        } else {
            None
        };
        let unmeasured = match row.forcing {
            _ if because.is_some() || saved.is_some() => None,
            Forcing::Never(why) => Some(why.to_owned()),
            Forcing::Unless(other) | Forcing::WholeUnless(other) => {
                let other = ROWS.iter().find(|r| r.need == other);
                Some(format!("the scene has a {}", other.map_or("", |r| r.name)))
            }
            Forcing::Whole => None,
        };
        Ok(NeedReport {
            name: row.name,
            when: row.when,
            because,
            fields: fields(row.need),
            stages: stages(row.need),
            draws: row.draws,
            saved,
            unmeasured,
        })
    }

    /// What kernels and state take with some rows forced.
    fn weigh(&mut self, forced: Needs) -> Result<Extent, RuntimeError> {
        let decision = Decision::of(&self.inputs(), |_| forced);
        let (layout, kernels) = compose(self.world, self.source, self.technique, decision)?;
        let lines = kernels.iter().flat_map(|k| k.wgsl.lines());
        let mut operations = 0;
        for kernel in &kernels {
            operations += self.operations(kernel)?;
        }
        Ok(Extent {
            path_bytes: layout.path_bytes() as i64,
            lines: lines.filter(|line| !line.trim().is_empty()).count() as i64,
            kernels: kernels.len() as i64,
            bindings: kernels.iter().map(|k| k.bindings.len() as i64).sum(),
            operations,
        })
    }

    fn operations(&mut self, kernel: &Kernel) -> Result<i64, RuntimeError> {
        if let Some(known) = self.operations.get(&kernel.wgsl) {
            return Ok(*known);
        }
        let (module, _) = validate(&kernel.desc.name, &kernel.wgsl)?;
        let count = operations(&module);
        self.operations.insert(kernel.wgsl.clone(), count);
        Ok(count)
    }
}

impl Extent {
    fn beyond(self, other: Extent) -> Self {
        Self {
            path_bytes: self.path_bytes - other.path_bytes,
            lines: self.lines - other.lines,
            kernels: self.kernels - other.kernels,
            bindings: self.bindings - other.bindings,
            operations: self.operations - other.operations,
        }
    }
}

/// The kernels of a wavefront with a kernel a material, and its layout, as it was decided.
fn compose(
    world: &World,
    source: &dyn MaterialSource,
    technique: Technique,
    decision: Decision,
) -> Result<(PlanLayout, Vec<Kernel>), RuntimeError> {
    let inputs = CompositionInputs::decided(SUBGROUP_SIZE, world, source, technique, decision)?;
    let plan = world.own_plan(&inputs.materials);
    let layout = inputs.layout(&plan)?;
    let kernels = inputs.composer(&plan, layout, SIZES).kernels();
    Ok((layout, kernels))
}

/// The names of the fields' uses that a row brings.
fn fields(need: Need) -> Vec<&'static str> {
    let uses = state::FIELDS.iter().flat_map(|field| field.uses);
    let brought = uses.filter(|u| u.need.all.contains(&need));
    let names: BTreeSet<&str> = brought.map(|u| u.name).collect();
    names.into_iter().collect()
}

/// The names of the stages that a row brings.
fn stages(need: Need) -> Vec<&'static str> {
    let brought = STAGES.iter().filter(|s| s.need.all.contains(&need));
    brought.map(|s| s.name).collect()
}

/// Expressions of a module that compute, load or call.
fn operations(module: &Module) -> i64 {
    let of_function = |f: &Function| f.expressions.iter().filter(|(_, e)| computes(e)).count();
    let functions = module.functions.iter().map(|(_, f)| of_function(f));
    let entries = module.entry_points.iter().map(|e| of_function(&e.function));
    functions.chain(entries).sum::<usize>() as i64
}

fn computes(expression: &Expression) -> bool {
    use Expression as E;
    matches!(
        expression,
        E::Load { .. }
            | E::Unary { .. }
            | E::Binary { .. }
            | E::Select { .. }
            | E::Relational { .. }
            | E::Math { .. }
            | E::As { .. }
            | E::CallResult(_)
            | E::AtomicResult { .. }
            | E::SubgroupOperationResult { .. }
            | E::SubgroupBallotResult
    )
}
