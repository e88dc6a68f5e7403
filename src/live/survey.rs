//! What can be said of what is shown beside the picture: what its materials cost, why its plan is as it is, and which
//! material each pixel sees. It takes a while and the processor, so a thread of its own does it once the hand rests.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use impasto_compiler::Program;
use impasto_compiler::partition::{DeviceProfile, Plan, Workload};
use impasto_runtime::gpu::DeviceInfo;
use impasto_runtime::scene::Camera;
use impasto_viewer::engine::{LayerKind, PictureLayer};

use super::shared::{Origin, Shared, Shown};
use crate::plan::{POINTS, SceneMaterials};

/// How often it is looked whether there is something new.
const EVERY: Duration = Duration::from_millis(50);
/// A hand rests that did nothing for so long.
const RESTED: Duration = Duration::from_millis(300);

/// What was found.
#[derive(Clone, Default)]
pub(super) struct Survey {
    /// What it is of.
    pub origin: Option<Origin>,
    /// Operations of the material of each binding; none of what is on no surface.
    pub operations: Vec<Option<f64>>,
    /// The plan that was explained, and the explanation, a line each.
    pub explained: Option<(Plan, Vec<String>)>,
    /// What pixels see by a camera.
    pub seen: Option<(Camera, Arc<Vec<Option<u32>>>)>,
}

/// A plan, what it was made for, and the device.
#[derive(Clone)]
pub(super) struct Planned {
    pub plan: Plan,
    pub workload: Workload,
    pub device: DeviceInfo,
}

/// The names of the layers that an engine makes by itself, and what they are.
pub(super) fn own_layers() -> Vec<(String, String)> {
    [("error", ERROR), ("cost", COST), ("kernel", KERNEL)]
        .map(|(name, about)| (name.to_owned(), about.to_owned()))
        .into()
}

const ERROR: &str = "the estimated standard error of the pixel over its brightness, smoothed; rather too large where it \
                     is not estimated for `--until`";
const COST: &str = "operations of one evaluation of the material that the pixel sees first, on average over its surfaces";
const KERNEL: &str = "the kernel of the material that the pixel sees first";

/// Surveys what is shown until the end.
pub(super) fn work(shared: &Shared) {
    let mut surveyor = Surveyor::default();
    while !shared.quits() {
        std::thread::sleep(EVERY);
        let (wanted, _) = shared.wanted();
        if wanted.dragged || wanted.moved.elapsed() < RESTED {
            continue;
        }
        let Some(shown) = shared.shown() else {
            continue;
        };
        if surveyor.goes_on(shared, &shown, wanted.surveys) {
            shared.set_survey(Arc::new(surveyor.survey.clone()));
        }
    }
}

#[derive(Default)]
struct Surveyor {
    survey: Survey,
    /// The program whose materials are known.
    program: Option<(Arc<Program>, SceneMaterials)>,
}

impl Surveyor {
    /// Does what is to be done next; `false` if all is known.
    fn goes_on(&mut self, shared: &Shared, shown: &Shown, sees: bool) -> bool {
        let is_other = self.survey.origin != Some(shown.origin);
        if is_other {
            self.survey = Survey {
                origin: Some(shown.origin),
                operations: std::mem::take(&mut self.survey.operations),
                ..Survey::default()
            };
        }
        let known = self.program.as_ref();
        let known = known.filter(|(program, _)| Arc::ptr_eq(program, &shown.program));
        let Some((_, materials)) = known else {
            let materials = SceneMaterials::new(&shown.scene, &shown.program, POINTS);
            self.survey.operations = operations(&shown.program, &materials);
            self.program = Some((shown.program.clone(), materials));
            return true;
        };
        if is_other {
            // Materials that cost what they did, in a picture of another size or frame.
            return true;
        }
        if let Some(planned) = &shown.planned
            && self.survey.explained.as_ref().map(|(plan, _)| plan) != Some(&planned.plan)
        {
            let lines = explained(materials, planned);
            self.survey.explained = Some((planned.plan.clone(), lines));
            return true;
        }
        if sees && self.survey.seen.as_ref().map(|(camera, _)| *camera) != Some(shown.camera) {
            let seen = shared.first_hits(shown).materials(&shown.camera);
            self.survey.seen = Some((shown.camera, Arc::new(seen)));
            return true;
        }
        false
    }
}

fn operations(program: &Program, materials: &SceneMaterials) -> Vec<Option<f64>> {
    let of = |material: usize| {
        let cost = materials.costs.get(material)?.as_ref()?;
        Some(cost.operations.mean)
    };
    let instances = program.instances().iter();
    instances.map(|i| of(i.info.material)).collect()
}

/// Why a plan is as it is, by the model; nothing where the model knows nothing of it.
fn explained(materials: &SceneMaterials, planned: &Planned) -> Vec<String> {
    let device = &planned.device;
    let Ok(choice) = DeviceProfile::shipped(&device.name, device.kind) else {
        return Vec::new();
    };
    let said = materials.explained(
        &planned.plan,
        &planned.workload,
        &choice.profile,
        choice.exact,
    );
    let said = said.map_or_else(|error| error.to_string(), |said| said.to_string());
    said.trim_end().lines().map(str::to_owned).collect()
}

impl Survey {
    /// The layers of what pixels see by a camera, if that is known: what it costs, and its kernel by `plan`.
    pub(super) fn layers(
        &self,
        camera: &Camera,
        program: &Program,
        plan: &Plan,
    ) -> Vec<PictureLayer> {
        let Some((_, seen)) = self.seen.as_ref().filter(|(of, _)| of == camera) else {
            return Vec::new();
        };
        let names: Vec<String> = plan.kernels.iter().map(|k| k.name.clone()).collect();
        let mut of_material = BTreeMap::new();
        for (index, kernel) in plan.kernels.iter().enumerate() {
            of_material.extend(kernel.materials.iter().map(|m| (*m, index as f32 + 1.0)));
        }
        let instances = program.instances();
        // 0 is no kernel.
        let kernel = |binding: usize| {
            let material = instances.get(binding).map(|i| i.info.material);
            material.and_then(|m| of_material.get(&m).copied())
        };
        let operations = |binding: usize| {
            let operations = self.operations.get(binding).copied().flatten();
            operations.map(|operations| operations as f32)
        };
        let values = |of: &dyn Fn(usize) -> Option<f32>| {
            let bindings = 0..instances.len();
            let table: Vec<f32> = bindings.map(|b| of(b).unwrap_or(0.0)).collect();
            let value = |seen: &Option<u32>| {
                let value = seen.and_then(|binding| table.get(binding as usize));
                value.copied().unwrap_or(0.0)
            };
            Arc::new(seen.iter().map(value).collect::<Vec<f32>>())
        };
        let names = std::iter::once("none".to_owned()).chain(names).collect();
        let layer = |name: &str, about: &str, kind, values| PictureLayer {
            name: name.to_owned(),
            about: about.to_owned(),
            kind,
            channels: 1,
            values,
        };
        vec![
            layer("cost", COST, LayerKind::Number, values(&operations)),
            layer("kernel", KERNEL, LayerKind::Index(names), values(&kernel)),
        ]
    }
}

/// The layer of estimated errors of pixels.
pub(super) fn error_layer(errors: &Arc<Vec<f32>>) -> PictureLayer {
    PictureLayer {
        name: "error".to_owned(),
        about: ERROR.to_owned(),
        kind: LayerKind::Number,
        channels: 1,
        values: errors.clone(),
    }
}
