//! Looks at the calls that a kernel makes, and writes down what the path does.
//!
//! The kernel knows nothing of this: functions are recognised by their names, and what they take and
//! give by the names of arguments and members. `tests/trace.rs` notices when a name is no more.

use impasto_cpu::KernelError;
use impasto_cpu::interpret::{Float, Host};

use crate::materials::Materials;
use crate::path::{Emission, End, Hit, Light, Path, Roulette, Scattering, Triple, Vertex};
use crate::signature::Signature;
use impasto_runtime::audit::dropped_value;
use impasto_runtime::world::lights::sample_functions;

/// The functions whose calls are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hook {
    CameraRay,
    Logic,
    Material,
    LightHit,
    LightEscape,
    PowerHeuristic,
    LightShare,
    LightContribution,
    SampleLight,
    Survival,
    Transmittance,
    TraceClosest,
    TraceAny,
    StoreDirection,
    StoreThroughput,
    StoreRadiance,
    StoreMedia,
    StoreContribution,
    PrimitiveInstance,
    GeometricNormal,
    CountDropped,
    FilmAdd,
    MaterialEmission,
    EvaluateMaterial,
    /// Where a walk below a surface ends, in the place of the material there.
    LeaveSurface,
    /// The sample of a light of this kind.
    SampleKind(&'static str),
}

/// Each by its name, but for those of kinds of light.
const HOOKS: [(Hook, &str); 25] = [
    (Hook::CameraRay, "camera_ray"),
    (Hook::Logic, "logic"),
    (Hook::Material, "material"),
    (Hook::LightHit, "light_hit"),
    (Hook::LightEscape, "light_escape"),
    (Hook::PowerHeuristic, "power_heuristic"),
    (Hook::LightShare, "light_share"),
    (Hook::LightContribution, "light_contribution"),
    (Hook::SampleLight, "sample_light"),
    (Hook::Survival, "survival_probability"),
    (Hook::Transmittance, "transmittance"),
    (Hook::TraceClosest, "trace_closest"),
    (Hook::TraceAny, "trace_any"),
    (Hook::StoreDirection, "store_ray_direction"),
    (Hook::StoreThroughput, "store_throughput"),
    (Hook::StoreRadiance, "store_radiance"),
    (Hook::StoreMedia, "store_media"),
    (Hook::StoreContribution, "store_contribution"),
    (Hook::PrimitiveInstance, "primitive_instance"),
    (Hook::GeometricNormal, "hit_geometric_normal"),
    (Hook::CountDropped, "count_dropped"),
    (Hook::FilmAdd, "film_add"),
    (Hook::LeaveSurface, "leave_surface_diffusely"),
    // Materials answer these.
    (Hook::MaterialEmission, "material_emission"),
    (Hook::EvaluateMaterial, "evaluate_material"),
];

/// All hooks, each by its name.
fn hooks() -> impl Iterator<Item = (Hook, &'static str)> {
    let kinds = sample_functions().map(|(kind, function)| (Hook::SampleKind(kind), function));
    HOOKS.into_iter().chain(kinds)
}

/// The names, in the order of hooks.
pub(super) fn names() -> Vec<&'static str> {
    hooks().map(|(_, name)| name).collect()
}

/// The hooks that materials answer.
pub(super) fn answered() -> Vec<usize> {
    let is_answered = |hook| matches!(hook, Hook::MaterialEmission | Hook::EvaluateMaterial);
    let hooks = hooks().enumerate();
    let answered = hooks.filter(|(_, (hook, _))| is_answered(*hook));
    answered.map(|(index, _)| index).collect()
}

/// Names of a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    /// Of instances, each with its material's.
    pub instances: Vec<(String, String)>,
}

/// The writer of one path.
pub(super) struct Recorder<'r, 'p, F> {
    hooks: Vec<Hook>,
    signatures: &'r [Option<Signature>],
    names: &'r Names,
    materials: &'r mut Materials<'p, F>,
    max_depth: u32,
    /// The calls that are under way.
    calls: Vec<Hook>,
    path: Path,
    ray: [Triple; 2],
    throughput: Triple,
    media: Vec<u32>,
    /// What the last ray cast found: distance and primitive.
    found: Option<(f64, u32)>,
    /// Whether a ray was cast since the last vertex: none is for a path that carries nothing.
    cast: bool,
    /// Whether what it found is the present vertex.
    met: bool,
    finished: bool,
}

const NOTHING: u32 = u32::MAX;

impl<'r, 'p, F: Float> Recorder<'r, 'p, F> {
    pub(super) fn new(
        signatures: &'r [Option<Signature>],
        names: &'r Names,
        materials: &'r mut Materials<'p, F>,
        max_depth: u32,
    ) -> Self {
        Self {
            hooks: hooks().map(|(hook, _)| hook).collect(),
            signatures,
            names,
            materials,
            max_depth,
            calls: Vec::new(),
            path: Path {
                pixel: [0; 2],
                sample: 0,
                seed: 0,
                precision: if F::SINGLE { 32 } else { 64 },
                camera: Default::default(),
                vertices: Vec::new(),
                end: End::Absorbed,
                radiance: Triple::default(),
                left_out: false,
                steps: 0,
                seconds: 0.0,
                added: [0.0; 3],
            },
            ray: Default::default(),
            throughput: [1.0; 3],
            media: Vec::new(),
            found: None,
            cast: false,
            met: false,
            finished: false,
        }
    }

    /// The path, if it came to an end.
    pub(super) fn finish(self) -> Option<Path> {
        self.finished.then_some(self.path)
    }

    fn is_within(&self, hook: Hook) -> bool {
        self.calls.contains(&hook)
    }

    fn last(&mut self) -> Option<&mut Vertex> {
        self.path.vertices.last_mut()
    }

    /// The vertex before the present one, whose light sample waits.
    fn before(&mut self) -> Option<&mut Vertex> {
        self.path.vertices.iter_mut().rev().nth(1)
    }

    fn begin_vertex(&mut self) {
        // Paths lost among hidden boundaries carry nothing on, though their ray was cast.
        let carries = self.throughput.iter().any(|x| *x > 0.0);
        self.met = std::mem::take(&mut self.cast) && carries;
        let [origin, direction] = self.ray;
        let hit = self.found.filter(|(_, primitive)| *primitive != NOTHING);
        let hit = hit.map(|(distance, primitive)| Hit {
            distance,
            position: [0, 1, 2].map(|i| origin[i] + distance * direction[i]),
            primitive,
            ..Hit::default()
        });
        let radiance = self.last().map_or([0.0; 3], |v| v.radiance);
        self.path.vertices.push(Vertex {
            number: self.path.vertices.len() as u32 + 1,
            hit,
            wo: direction.map(|x| -x),
            media: self.media.clone(),
            arriving: self.throughput,
            radiance,
            ..Vertex::default()
        });
    }

    /// Light that is met adds up: of surfaces and, at the same place, of their materials.
    fn add_emission(&mut self, radiance: Triple) {
        let Some(vertex) = self.last() else {
            return;
        };
        let arriving = vertex.arriving;
        if radiance == [0.0; 3] {
            return;
        }
        let emission = vertex.emission.get_or_insert_with(|| Emission {
            weight: 1.0,
            ..Emission::default()
        });
        for i in 0..3 {
            emission.radiance[i] += radiance[i];
            emission.added[i] += arriving[i] * radiance[i];
            vertex.radiance[i] += arriving[i] * radiance[i];
        }
    }

    fn weigh(&mut self, weight: f64) {
        let meets = self.is_within(Hook::LightHit) || self.is_within(Hook::LightEscape);
        if meets && let Some(vertex) = self.last() {
            vertex.emission.get_or_insert_with(Emission::default).weight = weight;
        }
    }

    fn end(&mut self, radiance: Triple) {
        let max_depth = self.max_depth;
        let met = self.met;
        if !met {
            // Nothing was carried here, so that no ray was cast.
            self.path.vertices.pop();
        }
        self.path.end = match self.last() {
            None => End::Absorbed,
            Some(vertex) if !met => match (vertex.dropped, &vertex.scattering) {
                (Some(_), _) => End::Dropped,
                (_, None) if vertex.number >= max_depth => End::MaxDepth,
                _ => End::Absorbed,
            },
            Some(vertex) if vertex.hit.is_none() => End::Escaped,
            Some(vertex) if vertex.roulette.is_some() => End::Roulette,
            Some(Vertex { hit: Some(hit), .. }) if hit.instance.is_none() => End::Light,
            Some(_) => End::MaxDepth,
        };
        self.path.radiance = radiance;
        if self.path.left_out
            && let Some(vertex) = self.last()
        {
            vertex.dropped = Some("radiance");
        }
        self.finished = true;
    }

    fn entered(&mut self, hook: Hook) {
        match hook {
            Hook::Logic => self.begin_vertex(),
            Hook::Material => {
                if let Some(roulette) = self.last().and_then(|v| v.roulette.as_mut()) {
                    roulette.survived = true;
                }
            }
            _ => {}
        }
    }

    fn left(&mut self, hook: Hook, of: &Signature, arguments: &[u64], result: &[u64]) {
        let given = |name: &str| of.arguments.triple::<F>(name, arguments);
        let got = |name: &str| of.result.triple::<F>(name, result);
        match hook {
            Hook::CameraRay => {
                self.ray = [got("origin"), got("direction")];
                self.path.camera = self.ray;
            }
            Hook::StoreDirection => self.ray[1] = given("value.direction"),
            Hook::TraceClosest => {
                self.cast = true;
                // Boundaries that are crossed begin the ray anew.
                self.ray[0] = given("origin");
                let primitive = of.result.word("primitive", result);
                self.found = Some((of.result.number::<F>("t", result), primitive));
            }
            Hook::StoreThroughput => {
                self.throughput = given("value.throughput");
                let throughput = self.throughput;
                if self.is_within(Hook::Material)
                    && let Some(vertex) = self.last()
                {
                    vertex.throughput = throughput;
                }
            }
            Hook::StoreRadiance => {
                let radiance = given("value.radiance");
                if let Some(vertex) = self.last() {
                    vertex.radiance = radiance;
                }
            }
            Hook::StoreMedia => self.media = of.arguments.words("value.stack", arguments),
            Hook::Transmittance
                if !self.is_within(Hook::Material) && self.is_within(Hook::Logic) =>
            {
                let kept = got("");
                if let Some(vertex) = self.last() {
                    vertex.arriving = [0, 1, 2].map(|i| vertex.arriving[i] * kept[i]);
                }
            }
            Hook::LightHit | Hook::LightEscape | Hook::MaterialEmission => {
                self.add_emission(got(""));
            }
            Hook::PowerHeuristic => self.weigh(of.result.number::<F>("", result)),
            Hook::PrimitiveInstance => {
                let instance = of.result.word("", result) as usize;
                let names = self.names;
                if self.is_within(Hook::Logic)
                    && let Some(hit) = self.last().and_then(|v| v.hit.as_mut())
                {
                    (hit.instance, hit.material) = names.instances.get(instance).cloned().unzip();
                }
            }
            Hook::GeometricNormal if self.calls == [Hook::Material] => {
                let normal = got("");
                if let Some(vertex) = self.last() {
                    let cosine: f64 = (0..3).map(|i| normal[i] * vertex.wo[i]).sum();
                    if let Some(hit) = &mut vertex.hit {
                        hit.front = Some(cosine >= 0.0);
                    }
                }
            }
            Hook::Survival => {
                let probability = of.result.number::<F>("", result);
                if let Some(vertex) = self.last() {
                    vertex.roulette = Some(Roulette {
                        probability,
                        survived: false,
                    });
                }
            }
            Hook::EvaluateMaterial | Hook::LeaveSurface => {
                let u = of.arguments.numbers::<F>("u", arguments);
                let scattering = Scattering {
                    u: u.try_into().unwrap_or_default(),
                    wi: got("wi"),
                    pdf: of.result.number::<F>("pdf", result),
                    weight: got("throughput"),
                    transmitted: of.result.number::<F>("transmitted", result) > 0.5,
                };
                let bsdf_pdf = of.result.number::<F>("light_pdf", result);
                let throughput = got("light_throughput");
                if let Some(vertex) = self.last() {
                    vertex.scattering = Some(scattering);
                    if let Some(light) = &mut vertex.light {
                        (light.bsdf_pdf, light.throughput) = (bsdf_pdf, throughput);
                    }
                }
            }
            Hook::CountDropped if self.is_within(Hook::FilmAdd) => self.path.left_out = true,
            Hook::CountDropped => {
                let value = dropped_value(of.arguments.word("value", arguments));
                if let Some(vertex) = self.last() {
                    vertex.dropped = Some(value);
                }
            }
            Hook::FilmAdd => self.end(given("radiance")),
            _ => self.left_light(hook, of, arguments, result),
        }
    }

    /// What concerns light samples.
    fn left_light(&mut self, hook: Hook, of: &Signature, arguments: &[u64], result: &[u64]) {
        let got = |name: &str| of.result.triple::<F>(name, result);
        let blocked = of.result.word("", result) != 0;
        let weight = of.result.number::<F>("", result);
        let Some(vertex) = self.last() else {
            return;
        };
        match hook {
            Hook::SampleKind(kind) => vertex.light.get_or_insert_with(Light::default).kind = kind,
            Hook::SampleLight => {
                let light = vertex.light.get_or_insert_with(Light::default);
                (light.wi, light.radiance) = (got("wi"), got("radiance"));
                light.distance = of.result.number::<F>("distance", result);
                light.pdf = of.result.number::<F>("pdf", result);
                light.weight = 1.0;
            }
            Hook::LightShare => {
                if let Some(light) = &mut vertex.light {
                    light.weight = weight;
                }
            }
            // Unless something lies between, which the shadow ray says later.
            Hook::StoreContribution => {
                let added = of.arguments.triple::<F>("value.radiance", arguments);
                if let Some(light) = &mut vertex.light {
                    light.added = added;
                }
            }
            Hook::TraceAny => {
                if let Some(light) = &mut vertex.light {
                    light.blocked = Some(blocked);
                }
            }
            Hook::LightContribution => {
                let added = got("");
                for (sum, x) in vertex.radiance.iter_mut().zip(added) {
                    *sum += x;
                }
                if let Some(light) = self.before().and_then(|v| v.light.as_mut()) {
                    light.added = added;
                }
            }
            _ => {}
        }
    }
}

impl<F: Float> Host for Recorder<'_, '_, F> {
    fn enter(
        &mut self,
        hook: usize,
        arguments: &[u64],
        result: &mut Vec<u64>,
    ) -> Result<(), KernelError> {
        let signatures = self.signatures;
        let (Some(&hook), Some(Some(signature))) = (self.hooks.get(hook), signatures.get(hook))
        else {
            return Ok(());
        };
        self.calls.push(hook);
        self.entered(hook);
        match hook {
            Hook::EvaluateMaterial => self.materials.evaluate(signature, arguments, result),
            Hook::MaterialEmission => self.materials.emission(signature, arguments, result),
            _ => Ok(()),
        }
    }

    fn leave(&mut self, hook: usize, arguments: &[u64], result: &[u64]) {
        let signatures = self.signatures;
        if let (Some(&hook), Some(Some(signature))) = (self.hooks.get(hook), signatures.get(hook)) {
            self.calls.pop();
            self.left(hook, signature, arguments, result);
        }
    }
}
