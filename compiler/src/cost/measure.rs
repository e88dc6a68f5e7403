//! Runs a material on inputs and counts: operations, what subgroups issue, and where it all comes
//! from.

use super::size::Size;
use super::subgroups::{BATCH, Subgroups};
use super::walk::{WalkTally, Walks};
use super::{BUDGET, Classes, Cost, Operations, Spent, live};
use crate::codegen;
use crate::inspect::{self, At};
use crate::ir::interp::{Interpreter, OutOfFuel};
use crate::ir::ops::Counts;
use crate::ir::value::Value;
use crate::ir::{ExprKind, Function, Module, Type};
use crate::program::{CompiledMaterial, Program};

/// Bytes of a row of the parameter table.
const ROW: f64 = 16.0;

/// Bytes that a texture lookup reads: what is known of the texture, and four texels of four half
/// floats (`texture.wgsl`).
const LOOKUP: f64 = 8.0 + 4.0 * 8.0;

/// Counts that a batch may hold: of very large code, fewer evaluations are put together at a time.
const MOST_COUNTS: usize = 1 << 25;

/// A material that was evaluated at some inputs.
pub struct Measured<'p> {
    pub(super) program: &'p Program,
    material: &'p CompiledMaterial,
    pub(super) run: Interpreter<'p, f32>,
    pub(super) subgroups: Subgroups,
    evaluations: u64,
    least: u64,
    most: u64,
    spent: Option<Spent>,
    walks: Option<WalkTally>,
}

impl<'p> Measured<'p> {
    /// Evaluates material `material` of `program` at `inputs`: instances of it, and where. `None`
    /// without inputs.
    ///
    /// One evaluation is what a path asks at a surface: scattering, and emission where it varies.
    /// Textures are not read; each gives one half.
    pub fn new(program: &'p Program, material: usize, inputs: &[(usize, At)]) -> Option<Self> {
        Self::within(program, material, inputs, BUDGET)
    }

    /// The same with `budget` expressions for each evaluation, over all of them together.
    pub fn within(
        program: &'p Program,
        material: usize,
        inputs: &[(usize, At)],
        budget: u64,
    ) -> Option<Self> {
        let budget = budget.saturating_mul(inputs.len() as u64);
        let mut this = Self {
            program,
            material: &program.compiled()[material],
            run: Interpreter::new(program.ir(), budget).with_calls_apart(),
            subgroups: Subgroups::default(),
            evaluations: 0,
            least: u64::MAX,
            most: 0,
            spent: None,
            walks: WalkTally::new(program.ir()),
        };
        // Every batch takes its inputs from all over the list.
        let batches = inputs.len().div_ceil(BATCH);
        for batch in 0..batches {
            this.batch(inputs.iter().skip(batch).step_by(batches));
            if let Some(spent) = &mut this.spent {
                (spent.budget, spent.wanted) = (budget, inputs.len() as u64);
                break;
            }
        }
        (this.evaluations > 0).then_some(this)
    }

    /// What is said of a budget that was spent before all inputs were evaluated.
    pub fn spent(&self) -> Option<&Spent> {
        self.spent.as_ref()
    }

    fn batch<'i>(&mut self, inputs: impl Iterator<Item = &'i (usize, At)>) {
        let mut batch = Vec::new();
        let (mut set, mut counted) = (None, 0);
        for (instance, at) in inputs {
            if set != Some(*instance) {
                self.run
                    .set_table(&self.program.instances()[*instance].values);
                set = Some(*instance);
            }
            if self.evaluate(at).is_err() {
                self.spent = Some(Spent {
                    evaluations: self.evaluations,
                    place: self.busiest_loop(),
                    ..Spent::default()
                });
                // What is known of it is a lower bound, and better than nothing.
                if self.evaluations == 0 {
                    batch.push(self.count());
                }
                break;
            }
            batch.push(self.count());
            counted += batch.last().map_or(0, Vec::len);
            if counted > MOST_COUNTS {
                self.subgroups.add(&batch);
                (batch, counted) = (Vec::new(), 0);
            }
        }
        self.subgroups.add(&batch);
    }

    /// `file:line` of the loop that took most turns in the present evaluation.
    fn busiest_loop(&self) -> Option<String> {
        let span = self.run.busiest_loop()?;
        Some(self.program.sources().file_line(span))
    }

    fn evaluate(&mut self, at: &At) -> Result<(), OutOfFuel> {
        let module = self.program.ir();
        let [wo, wi, u] = [&at.wo[..], &at.wi[..], &at.u[..]].map(Value::vector);
        let evaluate = &self.material.evaluate;
        let point = here(evaluate, module, at);
        let sample = self.run.run(evaluate, vec![point, wo.clone(), wi, u])?;
        if let Some(walks) = &mut self.walks {
            walks.add(&sample);
        }
        if let Some(f) = varying(self.material) {
            self.run.run(f, vec![here(f, module, at), wo])?;
        }
        Ok(())
    }

    /// How often the last evaluation executed each run.
    fn count(&mut self) -> Vec<u32> {
        let operations: Vec<u64> = self.run.runs().map(|c| c.operations()).collect();
        // No evaluation that ends in time executes a run more often than this.
        let times = self.run.take_times();
        let times: Vec<u32> = times
            .map(|n| u32::try_from(n).unwrap_or(u32::MAX))
            .collect();
        let all = times.iter().zip(operations);
        let all = all.map(|(&n, operations)| u64::from(n) * operations).sum();
        self.evaluations += 1;
        self.least = self.least.min(all);
        self.most = self.most.max(all);
        times
    }

    /// What the walks of its light below the surface cost, if any go there.
    pub fn walks(&self) -> Option<Walks> {
        self.walks.as_ref()?.mean(self.evaluations)
    }

    /// What the material costs.
    pub fn cost(&self) -> Cost {
        let issued = std::array::from_fn(|i| self.issued(i));
        let classes = self.issued(0);
        let functions = || std::iter::once(&self.material.evaluate).chain(varying(self.material));
        let module = self.program.ir();
        let mut size = Size::default();
        functions().for_each(|f| size.add(Size::of(module, f)));
        let worst = functions().map(|f| live::live(module, f)).max();
        Cost {
            operations: Operations {
                evaluations: self.evaluations,
                mean: classes.sum(),
                min: self.least,
                max: self.most,
                classes,
            },
            issued,
            live: worst.unwrap_or(0),
            code: u32::try_from(size.code).unwrap_or(u32::MAX),
            loops: u32::try_from(size.loops).unwrap_or(u32::MAX),
            bytes: ROW * rows(self.material) + LOOKUP * classes.texture,
        }
    }

    /// What subgroups of `LANES[i]` lanes issue.
    fn issued(&self, i: usize) -> Classes {
        let (times, evaluations) = self.subgroups.sums(i);
        let mut counts = Counts::default();
        for (run, &times) in self.run.runs().zip(times) {
            counts.add(&run, times);
        }
        Classes::mean(&counts, evaluations)
    }
}

/// The function of a material's emission, where it is part of an evaluation.
fn varying(material: &CompiledMaterial) -> Option<&Function> {
    let varies = material.info.varying_emission;
    material.emission.as_ref().filter(|_| varies)
}

fn here(f: &Function, module: &Module, at: &At) -> Value<f32> {
    match f.params.first().map(|p| p.ty) {
        Some(Type::Struct(id)) => inspect::point(at, &module.structs[id.index()]),
        _ => Value::float(0.0),
    }
}

/// How many rows of the parameter table an evaluation reads.
fn rows(material: &CompiledMaterial) -> f64 {
    let functions = std::iter::once(&material.evaluate).chain(varying(material));
    let read = functions.flat_map(|f| {
        let used = codegen::table_values(f).into_iter();
        used.filter_map(|id| match f.expr(id).kind {
            ExprKind::TableValue(i) => Some(material.layout.places.get(i as usize)?.row),
            _ => None,
        })
    });
    read.collect::<std::collections::BTreeSet<u32>>().len() as f64
}
