//! The report of a render: what ran, on what, how long, and what was dropped. Scripts read it
//! as JSON; the names of fields are a promise. Reports of older versions are read as well: what they
//! lack has its default.

use std::collections::BTreeMap;

use impasto_compiler::abi::{InstanceInfo, MaterialInfo};
use impasto_compiler::partition::{Form, Organisation, Plan, Workload, text};
use serde::{Deserialize, Serialize};

use crate::film::file::{Maker, Range};
use crate::film::{Film, Sums};
use crate::gpu::{DeviceIds, DeviceInfo};
use crate::kernels::dropped::Dropped;
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::{DispatchSource, Kernel, KernelDesc};
use crate::kernels::queues::Scalar;
use crate::options::RenderOptions;
use crate::render::status::Status;
use crate::render::trials::Tried;
use crate::render::until::{Check, Ending};
use crate::technique::Technique;
use crate::world::GeometryCounts;

/// What a render did. Times are in seconds, sizes in bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// The GPU.
    pub adapter: AdapterReport,
    /// What tells it from others of its kind on its machine, as `--gpu` takes it: its PCI address, or else its
    /// index; absent for the processor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapter_id: Option<String>,
    /// The plan's strategy.
    pub strategy: String,
    /// The plan: groups of materials with their forms, as `impasto render --partition` takes it;
    /// `mega` for a megakernel.
    pub plan: String,
    /// The strategy of the plan that was asked for, if the device has another whatever is asked for;
    /// absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replaced_strategy: Option<String>,
    /// How the plan was renewed while rendering; absent if it was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replanned: Option<ReplanReport>,
    /// How the work was done.
    pub technique: Technique,
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Samples asked for in each pixel.
    pub samples_per_pixel: u32,
    /// Index of each pixel's first sample.
    pub first_sample: u32,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Triangles that are stored.
    pub triangles: u64,
    /// References of acceleration structures to them: more than triangles where large ones are in several leaves.
    pub references: u64,
    /// Triangles that rays can hit: those of an object count once for each of its placements.
    pub placed_triangles: u64,
    /// Objects that are stored once and placed any number of times.
    pub objects: u64,
    /// Placements of objects.
    pub placements: u64,
    /// Materials: each is a shader, compiled once.
    pub material_count: usize,
    /// Instances of materials: what the scene binds to geometry, each with its own parameters.
    pub instance_count: usize,
    /// The materials, in the order of the program.
    pub materials: Vec<MaterialReport>,
    /// Samples in each pixel that were taken over from a checkpoint.
    pub resumed_samples: u32,
    /// Paths finished, those taken over included. Fewer than pixels times samples if the render
    /// was stopped.
    pub paths: u64,
    /// Time the GPU was busy, without building pipelines.
    pub gpu_seconds: f64,
    /// Where GPU times come from.
    pub timing: TimeSource,
    /// Time from the first submission to the finished film.
    pub wall_seconds: f64,
    /// Time to compose and build the pipelines; callers add what they spent on materials.
    pub compile_seconds: f64,
    /// Paths finished in a second of `gpu_seconds`.
    pub paths_per_second: f64,
    /// The same while the mixture of paths was steady, from a quarter to nine tenths of them; absent
    /// if the render was too short to tell, or the GPU has no timestamps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steady_paths_per_second: Option<f64>,
    /// Memory for the state of one path; 0 in a megakernel.
    pub path_state_bytes: u64,
    /// Paths in flight.
    pub pool_size: u32,
    /// Paths that would be in flight if the GPU had had memory for them; absent if it had.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wanted_pool_size: Option<u32>,
    /// Times every kernel was dispatched.
    pub iterations: u64,
    /// The kernels in the order of an iteration; of a renewed plan what they did since then.
    pub kernels: Vec<KernelReport>,
    /// What each of several devices did; absent if there was one. Times, rates and numbers of the report are then sums
    /// over them, and its plan, pool and kernels are those of `adapter`, the first one that was not lost.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub devices: Vec<DeviceReport>,
    /// What paths hit, on average over the iterations; absent if that was not counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub workload: Option<Workload>,
    /// Samples dropped because a value was no finite number, or below zero: those that
    /// kernels dropped at a material, and those found when a path ended.
    pub nonfinite_samples: u64,
    /// Those of them that this run found to be below zero, and finite.
    pub negative_samples: u64,
    /// The ones that this run found, by kernel and material, each with an example.
    pub dropped: Vec<Dropped>,
    /// Estimates of the error while rendering, if it was rendered until a goal; absent otherwise.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub convergence: Vec<Check>,
    /// Why such a render ended: `relmse`, `rmse`, `time`, `samples` or `interrupt`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended_by: Option<Ending>,
    /// What the film records beside the picture, as `--aov` calls it; absent if nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<String>,
    /// Samples cut to what the film holds, and values of outputs that were no finite number.
    pub clamped_samples: u64,
    /// Samples whose id found no room in their pixel, of outputs that are Cryptomattes.
    pub lost_ids: u64,
    /// Requests lost because a queue was full; anything but 0 is a defect.
    pub queue_overflow: u64,
    /// Media that paths entered while in as many as they can follow, and then ignored.
    pub media_overflow: u64,
    /// Paths given up because they crossed too many hidden boundaries in a row, or were turned too often in a
    /// medium or below a surface.
    pub lost_paths: u64,
}

impl Report {
    /// Paths a second that count: of the steady state if it was reached, else of the whole render.
    pub fn rate(&self) -> f64 {
        self.steady_paths_per_second
            .unwrap_or(self.paths_per_second)
    }
}

/// Where the GPU times of a report come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeSource {
    /// The GPU's timestamps.
    #[default]
    Timestamps,
    /// The time waited, on GPUs without timestamps: kernels have no times.
    Wall,
}

/// A material of a report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaterialReport {
    /// Its name.
    pub name: String,
    /// Its lobes, after layering.
    pub lobes: usize,
    /// The names of its instances.
    pub instances: Vec<String>,
}

impl MaterialReport {
    pub(crate) fn of(materials: &[MaterialInfo], instances: &[InstanceInfo]) -> Vec<Self> {
        let report = |material: &MaterialInfo| Self {
            name: material.name.clone(),
            lobes: material.lobes,
            instances: Vec::new(),
        };
        let mut reports: Vec<Self> = materials.iter().map(report).collect();
        for instance in instances {
            if let Some(report) = reports.get_mut(instance.material) {
                report.instances.push(instance.name.clone());
            }
        }
        reports
    }
}

/// The GPU of a report.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AdapterReport {
    /// Its name.
    pub name: String,
    /// The interface it was reached through.
    pub backend: String,
    /// The driver's name and version.
    pub driver: String,
}

impl From<DeviceInfo> for AdapterReport {
    fn from(info: DeviceInfo) -> Self {
        Self {
            name: info.name,
            backend: info.backend,
            driver: info.driver,
        }
    }
}

/// What one of several devices did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DeviceReport {
    /// The device.
    pub adapter: AdapterReport,
    /// What tells it from others of its kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapter_id: Option<String>,
    /// Samples of each pixel that it took.
    pub samples: u64,
    /// Time that it was busy.
    pub gpu_seconds: f64,
    /// Paths finished in a second of that.
    pub paths_per_second: f64,
    /// Its plan.
    pub plan: String,
    /// How that was renewed while rendering; absent if it was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replanned: Option<ReplanReport>,
    /// Paths in flight.
    pub pool_size: u32,
    /// Paths that would be in flight if the GPU had had memory for them; absent if it had.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wanted_pool_size: Option<u32>,
    /// Times every kernel was dispatched.
    pub iterations: u64,
    /// Its kernels.
    pub kernels: Vec<KernelReport>,
    /// Why it was lost while rendering; absent if it was not. Its samples are those that it had given until then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost: Option<String>,
}

/// What one kernel did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct KernelReport {
    /// Its name.
    pub name: String,
    /// The stage that it runs: `logic`, `new_path`, `material`, `shadow`, `extension`, or `bin_shadow` and
    /// `bin_extension` of rays that are ordered; of a kernel that casts all rays `rays`; of kernels between stages
    /// `prepare`, `scan` or `scatter`; and of a megakernel, which runs all, `mega`.
    pub stage: String,
    /// How it treats its materials (`own`, `mixed`, `binned`, `inline`); absent if it evaluates none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub form: Option<impasto_compiler::partition::Form>,
    /// The names of the materials it evaluates.
    pub materials: Vec<String>,
    /// Items it worked on: of its queues, or slots, or for a megakernel paths.
    pub items: u64,
    /// Those of each stage, if it casts the rays of several; empty otherwise.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub items_by_stage: BTreeMap<String, u64>,
    /// GPU time; 0 without timestamps.
    pub gpu_seconds: f64,
    /// In a profiling build the share of a subgroup's lanes that are at work, on average over the
    /// statements it executes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub utilisation: Option<f64>,
    /// Samples that its materials gave a value that is no finite number, or below zero.
    pub nonfinite_samples: u64,
}

impl KernelReport {
    /// The items of a stage; `None` if it does not run that.
    pub fn items_of(&self, stage: &str) -> Option<u64> {
        let alone = (self.stage == stage).then_some(self.items);
        alone.or_else(|| self.items_by_stage.get(stage).copied())
    }
}

impl Report {
    /// The items of a stage in all kernels; `None` if none runs it. A megakernel does not tell stages apart.
    pub fn items_of(&self, stage: &str) -> Option<u64> {
        let items = self.kernels.iter().filter_map(|k| k.items_of(stage));
        items.reduce(|a, b| a + b)
    }
}

/// How a plan was renewed while rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReplanReport {
    /// Iterations that the first plan ran.
    pub at_iteration: u64,
    /// Time from the first submission until then.
    pub at_seconds: f64,
    /// Time that planning took, while the GPU went on.
    pub planning_seconds: f64,
    /// Time that compiling the new kernels took, while the GPU went on.
    pub compile_seconds: f64,
    /// The first plan.
    pub from: String,
    /// The new plan; absent if none was made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// Why the first plan went on, if it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<String>,
    /// GPU time of the first plan.
    pub gpu_seconds: f64,
    /// GPU time that counting hits took: by how much the logic kernel got faster without. Absent if
    /// the new plan's logic kernel evaluates materials, or there are no timestamps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counting_seconds: Option<f64>,
    /// What kernels did before the last plan took over; empty where those of the first plan went on.
    pub kernels: Vec<KernelReport>,
    /// Plans that were tried beside the new one, in this order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trials: Vec<TrialReport>,
}

/// A plan that was tried for some iterations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialReport {
    /// The plan.
    pub plan: String,
    /// GPU time of an iteration that was expected of it, in times of one by the plan that ran before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected: Option<f64>,
    /// Time that compiling its kernels took, while the GPU went on.
    pub compile_seconds: f64,
    /// GPU time of an iteration by it; absent if it could not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// The same by the plan that ran before, which was the fastest until then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds_before: Option<f64>,
    /// Whether it was faster, and went on.
    pub kept: bool,
    /// Why it could not run, if it could not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

impl TrialReport {
    /// Of a trial of a plan for some materials.
    pub(super) fn of(tried: Tried, materials: &[MaterialReport]) -> Self {
        let made = tried.made;
        let plan = made.plan.map(|plan| partition(&plan, materials));
        let (seconds, failed) = match tried.outcome {
            Ok(seconds) => (Some(seconds), None),
            Err(why) => (None, Some(why)),
        };
        Self {
            plan: plan.unwrap_or_default(),
            expected: made.expected.map(|it| it.ratio),
            compile_seconds: made.compile_seconds,
            seconds: seconds.map(|[its, _]| its),
            seconds_before: seconds.map(|[_, before]| before),
            kept: tried.is_kept,
            failed,
        }
    }
}

/// Adds what kernels did, of those that are there already to what these did.
pub(super) fn add_kernels(all: &mut Vec<KernelReport>, more: Vec<KernelReport>) {
    for kernel in more {
        let is_same = |known: &&mut KernelReport| {
            known.name == kernel.name
                && known.form == kernel.form
                && known.materials == kernel.materials
        };
        match all.iter_mut().find(is_same) {
            Some(known) => {
                known.items += kernel.items;
                known.gpu_seconds += kernel.gpu_seconds;
                known.nonfinite_samples += kernel.nonfinite_samples;
                // Of a mean over several times nothing is known but of each.
                known.utilisation = None;
            }
            None => all.push(kernel),
        }
    }
}

/// What a render took over from an earlier run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Resumed {
    /// Samples of each pixel.
    pub samples: u32,
    /// Which ones.
    pub ranges: Vec<Range>,
    /// Of which no number were so many.
    pub nonfinite: u64,
    /// And cut were so many.
    pub clamped: u64,
    /// The devices that took them.
    pub makers: Vec<Maker>,
}

/// What a report is made of.
pub(crate) struct Inputs<'a> {
    pub resumed: &'a Resumed,
    /// Samples of each pixel that this run took.
    pub taken: u32,
    pub device: DeviceInfo,
    pub options: &'a RenderOptions,
    pub layout: &'a PlanLayout,
    pub kernels: &'a [Kernel],
    pub timed: bool,
    pub strategy: &'a str,
    pub replaced_strategy: Option<&'a str>,
    pub plan: &'a Plan,
    pub replanned: Option<ReplanReport>,
    pub geometry: GeometryCounts,
    pub pool: u32,
    pub wanted_pool: Option<u32>,
    pub materials: &'a [MaterialReport],
    pub workload: Option<Workload>,
    pub compile_seconds: f64,
    pub wall_seconds: f64,
}

impl Inputs<'_> {
    pub(crate) fn report(self, status: &Status, film: &Film, sums: &Sums) -> Report {
        let pixels = self.options.pixel_count(film.width, film.height);
        let all_paths = film.total_samples();
        let paths = pixels * u64::from(self.taken);
        let gpu_seconds = if self.timed {
            status.gpu_seconds
        } else {
            self.wall_seconds
        };
        let ran = Ran {
            layout: self.layout,
            kernels: self.kernels,
            materials: self.materials,
            pool: self.pool,
        };
        let kernels = ran.report(status, paths);
        let scalar = |s| u64::from(self.layout.counters.scalar(&status.counters, s));
        let before = status.before.dropped.iter().cloned();
        let dropped = before.chain(ran.dropped(status, film.width, self.options.seed));
        let dropped = Dropped::merged(dropped);
        Report {
            strategy: self.strategy.to_string(),
            replaced_strategy: self.replaced_strategy.map(str::to_string),
            plan: partition(self.plan, self.materials),
            replanned: self.replanned,
            technique: self.options.technique,
            width: film.width,
            height: film.height,
            samples_per_pixel: self.options.samples,
            first_sample: self.options.first_sample,
            seed: self.options.seed,
            triangles: self.geometry.triangles,
            references: self.geometry.references,
            placed_triangles: self.geometry.placed_triangles,
            objects: self.geometry.objects,
            placements: self.geometry.placements,
            material_count: self.materials.len(),
            instance_count: self.materials.iter().map(|m| m.instances.len()).sum(),
            materials: self.materials.to_vec(),
            resumed_samples: self.resumed.samples,
            paths: all_paths,
            gpu_seconds,
            timing: if self.timed {
                TimeSource::Timestamps
            } else {
                TimeSource::Wall
            },
            wall_seconds: self.wall_seconds,
            compile_seconds: self.compile_seconds,
            paths_per_second: paths as f64 / gpu_seconds.max(f64::MIN_POSITIVE),
            steady_paths_per_second: status.steady_rate(paths),
            path_state_bytes: self.layout.memory(),
            pool_size: self.pool,
            wanted_pool_size: self.wanted_pool,
            iterations: status.iterations,
            kernels,
            devices: Vec::new(),
            workload: self.workload,
            nonfinite_samples: self.resumed.nonfinite
                + dropped.iter().map(Dropped::samples).sum::<u64>(),
            negative_samples: dropped.iter().map(|d| d.negative).sum(),
            dropped,
            convergence: Vec::new(),
            ended_by: None,
            outputs: sums.layers().names(),
            lost_ids: sums.lost_ids(),
            clamped_samples: self.resumed.clamped + scalar(Scalar::FilmClamped),
            queue_overflow: scalar(Scalar::Overflow),
            media_overflow: scalar(Scalar::MediaOverflow),
            lost_paths: scalar(Scalar::LostPaths),
            adapter_id: self.device.ids.as_ref().map(DeviceIds::id),
            adapter: self.device.into(),
        }
    }
}

/// A plan as a string, for materials of some reports.
pub(crate) fn partition(plan: &Plan, materials: &[MaterialReport]) -> String {
    let names: Vec<String> = materials.iter().map(|m| m.name.clone()).collect();
    match plan.organisation {
        Organisation::Wavefront => text::print(plan, &names),
        Organisation::Mega => "mega".to_string(),
    }
}

/// The kernels of a plan that ran.
pub(crate) struct Ran<'a> {
    pub layout: &'a PlanLayout,
    pub kernels: &'a [Kernel],
    pub materials: &'a [MaterialReport],
    pub pool: u32,
}

impl Ran<'_> {
    /// What each did since the plan began; a megakernel finished `paths`.
    pub(crate) fn report(&self, status: &Status, paths: u64) -> Vec<KernelReport> {
        let kernels = self.kernels.iter().zip(&status.step_seconds).enumerate();
        let report = kernels.map(|(index, (kernel, seconds))| KernelReport {
            utilisation: self.layout.counters.utilisation(&status.counters, index),
            ..self.kernel(kernel, *seconds, status, paths)
        });
        report.collect()
    }

    fn kernel(&self, kernel: &Kernel, seconds: f64, status: &Status, paths: u64) -> KernelReport {
        let iterations = status.iterations - status.before.iterations;
        let (desc, counters) = (&kernel.desc, self.layout.counters);
        let name = |index: &usize| self.materials.get(*index).map(|m| m.name.clone());
        KernelReport {
            name: desc.name.clone(),
            stage: desc.role.to_owned(),
            form: desc.form,
            materials: desc.members.iter().filter_map(name).collect(),
            items: match desc.source {
                DispatchSource::Queue(queue) => counters.items_of(&status.counters, queue),
                DispatchSource::Queues { first, count }
                | DispatchSource::FetchedQueues { first, count } => (first..first + count)
                    .map(|queue| counters.items_of(&status.counters, queue))
                    .sum(),
                DispatchSource::Pool if self.layout.wavefront => iterations * u64::from(self.pool),
                DispatchSource::Pool | DispatchSource::Fetched => paths,
                DispatchSource::Once | DispatchSource::Groups(_) => iterations,
            },
            items_by_stage: self.items_by_stage(desc, status),
            gpu_seconds: seconds,
            utilisation: None,
            nonfinite_samples: rows(desc)
                .filter_map(|row| counters.dropped_row(&status.counters, row))
                .map(|row| row.samples())
                .sum(),
        }
    }

    /// The items of each stage of a kernel that fetches those of several.
    fn items_by_stage(&self, desc: &KernelDesc, status: &Status) -> BTreeMap<String, u64> {
        let DispatchSource::FetchedQueues { count: 2.., .. } = desc.source else {
            return BTreeMap::new();
        };
        let (queues, counters) = (self.layout.queues, self.layout.counters);
        let items = desc.stages.iter().flat_map(|stage| {
            let of = queues.of(stage.name);
            of.map(|queue| {
                (
                    stage.name.to_owned(),
                    counters.items_of(&status.counters, queue),
                )
            })
        });
        items.collect()
    }

    /// What each dropped for every material, and the one that fills the film for none. The picture is
    /// `width` pixels wide.
    pub(crate) fn dropped(&self, status: &Status, width: u32, seed: u32) -> Vec<Dropped> {
        let counters = self.layout.counters;
        let mut out = Vec::new();
        for Kernel { desc, .. } in self.kernels {
            // Samples that the film drops are counted for it once, whatever kernel added them.
            let film = desc.decides_on_all().then_some(counters.film_row());
            for row in rows(desc).chain(film) {
                let material = self.materials.get(row).map(|m| m.name.as_str());
                if let Some(found) = counters.dropped_row(&status.counters, row) {
                    out.push(Dropped::new(&desc.name, material, &found, width, seed));
                }
            }
        }
        out
    }
}

/// The rows of the samples that a kernel drops at materials. It alone evaluates those; of two that evaluate them inline, it
/// is the one that decides how each path goes on.
fn rows(desc: &KernelDesc) -> impl Iterator<Item = usize> {
    let is_first = desc.form != Some(Form::Inline) || desc.decides_on_all();
    desc.members.iter().copied().filter(move |_| is_first)
}
