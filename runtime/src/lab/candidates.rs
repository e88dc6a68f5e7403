//! From candidates to dispatches: composing the kernels around a kernel under test, and building
//! each text once.

use std::collections::BTreeMap;
use std::sync::Arc;

use impasto_compiler::partition::{Form, Organisation, Plan, PlanKernel};

use super::bench::Run;
use super::{Candidate, Lab, Unmeasured};
use crate::error::RuntimeError;
use crate::gpu::resources::Resources;
use crate::gpu::schedule::{Schedule, Step};
use crate::gpu::{Gpu, KernelStatistics};
use crate::kernels::modules::{Composer, DispatchSource, Kernel, KernelDesc, PREPARE, Sizes};
use crate::render::build_step;

/// Kernels built so far, by their text; or why they could not be.
pub(super) type Cache = BTreeMap<String, Result<Step, Unmeasured>>;

/// A run whose kernels are composed and not yet built.
struct Composed {
    kernels: Vec<Kernel>,
    run: Run,
}

impl Lab<'_> {
    /// The dispatches of each candidate.
    pub(super) fn runs(
        &mut self,
        candidates: &[Candidate],
    ) -> Result<Vec<Result<Run, Unmeasured>>, RuntimeError> {
        let compose = |candidate: &Candidate| self.compose(candidate);
        let composed: Vec<_> = candidates.iter().map(compose).collect();
        let kernels = composed.iter().filter_map(|c| c.as_ref().ok());
        let kernels: Vec<Kernel> = kernels.flat_map(|c| c.kernels.clone()).collect();
        self.build(kernels)?;
        let run = |composed: Result<Composed, Unmeasured>| self.finish(composed?);
        Ok(composed.into_iter().map(run).collect())
    }

    /// What the driver says of own and mixed kernels, if it is to be asked.
    pub(super) fn tell(&self, candidates: &[Candidate]) -> Vec<Option<KernelStatistics>> {
        let Some(statistics) = &self.statistics else {
            return vec![None; candidates.len()];
        };
        let asked = |c: &Candidate| matches!(c.form, Form::Own | Form::Mixed);
        let kernel = |candidate: &Candidate| {
            let composed = Some(candidate)
                .filter(|c| asked(c))
                .map(|c| self.compose(c));
            composed?.ok()?.kernels.pop()
        };
        let kernels: Vec<Option<Kernel>> = candidates.iter().map(kernel).collect();
        crate::parallel::map(&kernels, |kernel| {
            let kernel = kernel.as_ref()?;
            statistics.of(&kernel.desc.name, &kernel.wgsl, &kernel.bindings)
        })
    }

    /// The kernels alone that decide how paths go on, of a kernel a material.
    pub(super) fn bare_logic(&mut self) -> Result<Run, RuntimeError> {
        let plan = self.own_plan();
        let composer = self.composer(&plan, false)?;
        let composed = self.composed(&composer, deciding(composer.descs()), Vec::new());
        self.build(composed.kernels.clone())?;
        let run = self.finish(composed);
        run.map_err(RuntimeError::Validation)
    }

    /// All dispatches of an iteration.
    pub(super) fn whole(&mut self, plan: &Plan) -> Result<Run, RuntimeError> {
        if plan.organisation != Organisation::Wavefront {
            return Err(RuntimeError::Plan {
                strategy: plan.strategy.clone(),
                reason: "a megakernel has no iterations to be timed".into(),
            });
        }
        let composer = self.composer(plan, false)?;
        let composed = self.composed(&composer, composer.descs(), Vec::new());
        self.build(composed.kernels.clone())?;
        self.finish(composed).map_err(RuntimeError::Validation)
    }

    pub(super) fn descs(&self, plan: &Plan) -> Result<Vec<KernelDesc>, RuntimeError> {
        Ok(self.composer(plan, false)?.descs())
    }

    fn compose(&self, candidate: &Candidate) -> Result<Composed, Unmeasured> {
        let plan = self.plan_around(candidate)?;
        let inline = candidate.form == Form::Inline;
        let composer = self.composer(&plan, !inline);
        let composer = composer.map_err(|error| error.to_string())?;
        let mut descs = composer.descs();
        if inline {
            return Ok(self.composed(&composer, deciding(descs), Vec::new()));
        }
        let subject = descs.iter().position(|desc| {
            desc.form == Some(candidate.form) && desc.members == candidate.members
        });
        let Some(subject) = subject else {
            return Err("the plan has no such kernel".into());
        };
        // The kernels that queue its hits, and those until the one that counts them.
        let prepared = descs[..subject]
            .iter()
            .rposition(|desc| desc.role == PREPARE);
        let subject = descs.swap_remove(subject);
        descs.truncate(prepared.map_or(0, |at| at + 1));
        descs.push(subject);
        Ok(self.composed(&composer, descs, composer.queue_table()))
    }

    /// A kernel a material that is on some surface.
    fn own_plan(&self) -> Plan {
        self.inputs.world.own_plan(&self.inputs.materials)
    }

    fn names(&self) -> Vec<String> {
        let materials = self.inputs.materials.iter();
        materials.map(|m| m.name.clone()).collect()
    }

    /// A plan with the candidate first, and an own kernel for every other material.
    fn plan_around(&self, candidate: &Candidate) -> Result<Plan, Unmeasured> {
        let (form, members) = (candidate.form, &candidate.members);
        let ascending = members.windows(2).all(|pair| pair[0] < pair[1]);
        let known = members.iter().all(|m| *m < self.inputs.materials.len());
        if members.is_empty() || !ascending || !known || form == Form::Own && members.len() > 1 {
            return Err(format!(
                "there is no kernel of form {form:?} over {members:?}"
            ));
        }
        let own = self.own_plan();
        if form == Form::Own {
            return Ok(own);
        }
        let others = own.kernels.into_iter();
        let others = others.filter(|kernel| !members.contains(&kernel.materials[0]));
        let subject = PlanKernel::new(form, members.clone(), &self.names());
        Ok(Plan {
            kernels: std::iter::once(subject).chain(others).collect(),
            ..own
        })
    }

    fn composed(
        &self,
        composer: &Composer<'_>,
        descs: Vec<KernelDesc>,
        table: Vec<u32>,
    ) -> Composed {
        let subject = descs.len() - 1;
        let of_logic = descs.iter().enumerate().filter(|(_, desc)| desc.decides());
        let run = Run {
            schedule: Arc::new(Schedule {
                steps: Vec::new(),
                arguments: self.resources.arguments().clone(),
                timing: self.gpu.timing,
            }),
            subject,
            deciding: of_logic.map(|(at, _)| at).collect(),
            table,
            counters: composer.layout.counters,
            queues: match descs[subject].source {
                DispatchSource::Queue(_) if descs[subject].decides() => Vec::new(),
                DispatchSource::Queue(queue) => vec![queue],
                DispatchSource::Queues { first, count } => (first..first + count).collect(),
                _ => Vec::new(),
            },
            pool: self.sizes.pool,
        };
        let kernels = descs.into_iter().enumerate();
        let kernels = kernels.map(|(index, desc)| composer.compose(index, desc));
        Composed {
            kernels: kernels.collect(),
            run,
        }
    }

    /// Builds the kernels that are not built yet, several at a time.
    fn build(&mut self, kernels: Vec<Kernel>) -> Result<(), RuntimeError> {
        let mut wanted: BTreeMap<String, Kernel> = BTreeMap::new();
        for kernel in kernels {
            if !self.cache.contains_key(&kernel.wgsl) {
                wanted.insert(kernel.wgsl.clone(), kernel);
            }
        }
        let wanted: Vec<Kernel> = wanted.into_values().collect();
        let (gpu, resources, sizes) = (self.gpu, &self.resources, self.sizes);
        let build = |kernel: &Kernel| build_one(gpu, resources, sizes, kernel);
        let built = crate::parallel::map(&wanted, build);
        self.gpu.check()?;
        let texts = wanted.into_iter().map(|kernel| kernel.wgsl);
        self.cache.extend(texts.zip(built));
        Ok(())
    }

    fn finish(&self, composed: Composed) -> Result<Run, Unmeasured> {
        let step = |kernel: &Kernel| match self.cache.get(&kernel.wgsl) {
            Some(step) => step.clone(),
            None => Err("it was not built".to_string()),
        };
        let steps: Result<Vec<Step>, Unmeasured> = composed.kernels.iter().map(step).collect();
        Ok(Run {
            schedule: Arc::new(Schedule {
                steps: steps?,
                arguments: composed.run.schedule.arguments.clone(),
                timing: composed.run.schedule.timing,
            }),
            ..composed.run
        })
    }
}

/// The kernels of an iteration up to the last that decides how paths go on.
fn deciding(mut descs: Vec<KernelDesc>) -> Vec<KernelDesc> {
    let last = descs.iter().rposition(KernelDesc::decides);
    descs.truncate(last.map_or(0, |at| at + 1));
    descs
}

impl Composer<'_> {
    /// The queue of each material, or the largest number, as `queue_table` has it.
    fn queue_table(&self) -> Vec<u32> {
        let mut table = vec![u32::MAX; self.materials.len()];
        for (material, queue) in self.queues_of_materials() {
            table[material] = queue as u32;
        }
        table
    }
}

/// What wgpu refuses is not the end of other measurements.
fn build_one(
    gpu: &Gpu,
    resources: &Resources,
    sizes: Sizes,
    kernel: &Kernel,
) -> Result<Step, Unmeasured> {
    let filters = [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::Internal];
    let scopes = filters.map(|filter| gpu.device.push_error_scope(filter));
    let built = build_step(gpu, kernel, resources, sizes);
    // Scopes end in the reverse order of their beginnings.
    for scope in scopes.into_iter().rev() {
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(error.to_string());
        }
    }
    built.map_err(|error| error.to_string())
}
