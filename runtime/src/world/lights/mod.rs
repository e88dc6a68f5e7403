//! Every kind of light as one shader part: a table to choose a light from, and what each kind
//! contributes to a light sample, a hit and an escaping ray.
//!
//! A kind is a file here, its WGSL beside it and a row of the table in `table.rs`. Kinds that a scene
//! lacks leave no trace in its WGSL.

use glam::Vec3;
use impasto_compiler::abi::{Emission, InstanceInfo};

use crate::error::SceneError;
use crate::scene::{Mesh, Scene};
use crate::wgsl;
use crate::wgsl::template::{Flag, Template, template};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::media::Media;
use crate::world::needs::{LightTraits, Need, Needs};

mod alias;
mod boxes;
pub mod distant;
mod environment;
pub(crate) mod groups;
mod mesh;
pub mod quad;
pub mod sphere;
pub(crate) mod table;
#[cfg(test)]
mod tests;

pub use table::{LIGHT_KINDS, LightKind, readers, sample_functions};

use alias::WordAlias;
use boxes::Boxes;

/// Index in the light table of triangles that are no sampled light: beyond any table.
pub const NO_LIGHT: u32 = u32::MAX;

/// What lights a scene, of which text is written once it is known what of it is needed.
#[derive(Clone, Debug)]
pub enum Lights {
    /// The lights of a scene.
    OfScene(Kinds),
    /// A text by hand, which is taken as it is.
    ByHand {
        /// `sample_light`, `light_hit` and `light_escape`.
        part: ShaderPart,
        /// Can any light be sampled?
        sampled: bool,
        /// Can scattered rays find a light that is sampled as well?
        weighted: bool,
    },
}

impl Lights {
    /// The part with the functions that `needs` asks for; needs the surface part and [`mis`].
    pub(super) fn written(&self, needs: Needs) -> ShaderPart {
        match self {
            Lights::OfScene(kinds) => kinds.written(LIGHT_KINDS, needs),
            Lights::ByHand { part, .. } => part.clone(),
        }
    }

    /// What the table of needs has to know; of what is written by hand the worst is assumed.
    pub(super) fn traits(&self) -> LightTraits {
        match self {
            Lights::OfScene(kinds) => kinds.traits(),
            Lights::ByHand {
                sampled, weighted, ..
            } => LightTraits {
                rows: Vec::new(),
                sampled: *sampled,
                weighted: *weighted,
                far: true,
                choice: true,
                hit: true,
                escape: true,
                small: false,
            },
        }
    }

    /// The buffers that it may read.
    pub(super) fn buffers_mut(&mut self) -> Vec<&mut BufferData> {
        match self {
            Lights::OfScene(kinds) => {
                let kinds = kinds.kinds.iter_mut();
                kinds.flat_map(|kind| &mut kind.buffers).collect()
            }
            Lights::ByHand { part, .. } => part.buffers.iter_mut().collect(),
        }
    }
}

/// Weights of light samples against scattered rays: `power_heuristic`.
pub fn mis() -> ShaderPart {
    ShaderPart {
        wgsl: include_str!("mis.wgsl").to_owned(),
        buffers: Vec::new(),
    }
}

/// Is there anything in the scene that could give light? An all-black picture is hardly meant.
pub fn check(scene: &Scene, instances: &[InstanceInfo]) -> Result<(), SceneError> {
    let emissive = instances.iter().any(|i| i.emission != Emission::None);
    if emissive || !scene.lights.is_empty() || scene.environment.is_some() {
        return Ok(());
    }
    let error = SceneError::new(format!("the scene `{}` has no light", scene.name));
    Err(error.hint(
        "add [environment], a [[lights]] entry, or a material that assigns `emission` \
         to some of the geometry",
    ))
}

/// What the kinds read.
struct Context<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    instances: &'a [InstanceInfo],
    media: &'a Media,
    /// Triangle of the mesh to primitive.
    primitives: &'a [u32],
    /// The corners of a box around everything.
    bounds: [Vec3; 2],
}

impl<'a> Context<'a> {
    fn new(
        scene: &'a Scene,
        mesh: &'a Mesh,
        bounds: [Vec3; 2],
        primitives: &'a [u32],
        instances: &'a [InstanceInfo],
        media: &'a Media,
    ) -> Self {
        Context {
            scene,
            mesh,
            instances,
            media,
            primitives,
            bounds,
        }
    }

    /// Watts that a light at infinity sends through the scene, per W/m^2 facing it.
    fn cross_section(&self) -> f64 {
        let radius = bounding_radius(self.bounds);
        std::f64::consts::PI * radius * radius
    }
}

/// One kind of light as a scene has it.
#[derive(Clone, Debug)]
struct Kind {
    /// Is its code there in vain?
    idle: bool,
    /// The rows that its lights are, and which of them they are.
    rows: Vec<(Need, String)>,
    /// Those of the light table.
    lights: Vec<Sampled>,
    /// The kind's functions and constants.
    wgsl: Vec<Piece>,
    buffers: Vec<BufferData>,
    /// The functions, as [`LightKind`] names them.
    sample: &'static str,
    hit: Option<&'static str>,
    escape: Option<&'static str>,
    share: Option<table::Share>,
    /// Is there more to choose in one of its lights?
    chooses: bool,
}

impl Kind {
    /// A kind without lights and text.
    fn of(kind: &LightKind) -> Kind {
        Kind {
            idle: false,
            rows: Vec::new(),
            lights: Vec::new(),
            wgsl: Vec::new(),
            buffers: Vec::new(),
            sample: kind.sample,
            hit: kind.hit,
            escape: kind.escape,
            share: kind.share,
            chooses: false,
        }
    }
}

/// A piece of a kind's text.
#[derive(Clone, Debug)]
enum Piece {
    /// What the host writes.
    Written(String),
    /// A file.
    File(Template),
}

impl Piece {
    fn wgsl(&self, flags: &[Flag]) -> String {
        match self {
            Piece::Written(text) => text.clone(),
            Piece::File(template) => template.wgsl(flags),
        }
    }
}

/// What a light is in the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Source {
    /// The environment.
    #[default]
    Environment,
    /// One of [`Scene::lights`].
    Light(u32),
    /// A triangle of one of [`Scene::materials`].
    Material(u32),
}

/// A row of the light table.
#[derive(Clone, Debug, Default)]
struct Sampled {
    /// Emitted power in W (by luminance), more than 0.
    power: f64,
    /// Radiance of lights with a surface.
    radiance: Vec3,
    /// The primitive that light samples read, of lights with a surface.
    primitive: u32,
    /// Is it found by scattering alone?
    by_chance: bool,
    /// Is it seen in a single direction, where scattering cannot find it?
    is_discrete: bool,
    /// What it is, for groups of lights.
    source: Source,
    /// The kind's own use.
    flag: u32,
    /// Triangles of the mesh that belong to it.
    triangles: Vec<u32>,
}

/// The kinds of lights that a scene has, from which its shader part is made.
#[derive(Clone, Debug, Default)]
pub struct Kinds {
    kinds: Vec<Kind>,
    boxes: Boxes,
}

impl Kinds {
    /// The lights of `scene`, whose triangles in the world are those of `mesh`, each with its
    /// primitive, and which reaches from corner to corner of `bounds`. Its bindings compiled to
    /// `instances` with `media`.
    pub(super) fn build(
        scene: &Scene,
        mesh: &Mesh,
        bounds: [Vec3; 2],
        primitives: &[u32],
        instances: &[InstanceInfo],
        media: &Media,
    ) -> Kinds {
        let context = Context::new(scene, mesh, bounds, primitives, instances, media);
        Kinds::of(LIGHT_KINDS, &context)
    }

    /// Those of the kinds in `table` that there are lights of.
    fn of(table: &[LightKind], context: &Context) -> Kinds {
        let mut kinds = Kinds::default();
        for kind in table {
            kinds.kinds.extend((kind.present)(context, kinds.count()));
        }
        let lights = kinds.kinds.iter().flat_map(|kind| &kind.lights);
        let triangles = lights.flat_map(|light| &light.triangles);
        let corners = triangles.map(|triangle| context.mesh.positions[*triangle as usize]);
        kinds.boxes = Boxes::around(corners, context.bounds);
        kinds
    }

    /// For each triangle of the world, of which there are `triangles`, its index in the light table, or
    /// [`NO_LIGHT`].
    pub(super) fn of_triangle(&self, triangles: usize) -> Vec<u32> {
        let mut of_triangle = vec![NO_LIGHT; triangles];
        for (index, light) in self.kinds.iter().flat_map(|k| &k.lights).enumerate() {
            for &triangle in &light.triangles {
                of_triangle[triangle as usize] = index as u32;
            }
        }
        of_triangle
    }

    /// How many lights there are.
    fn count(&self) -> u32 {
        self.kinds.iter().map(|k| k.lights.len() as u32).sum()
    }

    fn sampled(&self) -> impl Iterator<Item = (&Kind, &Sampled)> {
        let all = self
            .kinds
            .iter()
            .flat_map(|k| k.lights.iter().map(move |l| (k, l)));
        all.filter(|(_, light)| !light.by_chance)
    }

    fn traits(&self) -> LightTraits {
        let chooses = self.sampled().any(|(kind, _)| kind.chooses);
        LightTraits {
            rows: self.kinds.iter().flat_map(|k| k.rows.clone()).collect(),
            sampled: self.sampled().next().is_some(),
            weighted: self.sampled().any(|(_, light)| !light.is_discrete),
            far: self.sampled().any(|(kind, _)| kind.hit.is_none()),
            choice: self.count() > 1 || chooses,
            hit: self.kinds.iter().any(|k| k.hit.is_some()),
            escape: self.kinds.iter().any(|k| k.escape.is_some()),
            small: self.boxes.are_small,
        }
    }

    /// The part with the functions that `needs` asks for. Kinds in `table` that it asks for in vain have their
    /// code and no light.
    fn written(&self, table: &[LightKind], needs: Needs) -> ShaderPart {
        let has = |kind: &LightKind| self.kinds.iter().any(|k| k.sample == kind.sample);
        let idle = table.iter().filter(|k| needs.any(k.needs) && !has(k));
        let idle = idle.map(|kind| Kind {
            idle: true,
            ..(kind.absent)(needs)
        });
        let kinds: Vec<Kind> = self.kinds.iter().cloned().chain(idle).collect();
        part(&kinds, self.count(), &self.boxes, needs)
    }
}

/// The part of some kinds, which have `count` lights.
fn part(kinds: &[Kind], count: u32, boxes: &Boxes, needs: Needs) -> ShaderPart {
    let flags: Vec<Flag> = needs.flags().collect();
    let mut part = ShaderPart {
        wgsl: template!("common.wgsl").wgsl(&flags),
        buffers: Vec::new(),
    };
    let sampled = kinds.iter().flat_map(|k| &k.lights).any(|l| !l.by_chance);
    part.wgsl += &format!("const HAS_SAMPLED_LIGHTS: bool = {sampled};\n");
    if count > 0 || kinds.iter().any(|k| k.idle) {
        part.wgsl += &wgsl::constant_u32("LIGHT_COUNT", count.max(1));
        part.wgsl += &template!("select.wgsl").wgsl(&flags);
        let mut rows = light_table(kinds);
        if needs.has(Need::LastRays) {
            part.wgsl += &wgsl::constant_u32("LIGHT_BOXES", boxes.len() as u32);
            part.wgsl += include_str!("boxes.wgsl");
            rows.extend(boxes.rows());
        }
        let table = BufferData::new("light_table", "array<vec4<u32>>", &rows);
        part.buffers.push(table);
    }
    if kinds.iter().any(|k| k.hit.is_some()) {
        part.wgsl += &template!("area.wgsl").wgsl(&flags);
    }
    for kind in kinds {
        part.wgsl
            .extend(kind.wgsl.iter().map(|piece| piece.wgsl(&flags)));
        part.buffers.extend(kind.buffers.iter().cloned());
    }
    part.wgsl += &sample_function(kinds);
    part.wgsl += &hit_function(kinds);
    part.wgsl += &escape_function(kinds);
    part
}

/// Two rows of words a light; see `select.wgsl`.
fn light_table(kinds: &[Kind]) -> Vec<[[u32; 4]; 2]> {
    let weights = selection_weights(kinds);
    let alias = WordAlias::new(&weights);
    let mut rows: Vec<[[u32; 4]; 2]> = kinds
        .iter()
        .flat_map(|k| &k.lights)
        .enumerate()
        .map(|(i, light)| {
            let threshold = alias.thresholds[i];
            let probability = (alias.probabilities[i] as f32).to_bits();
            let [r, g, b] = light.radiance.to_array().map(f32::to_bits);
            [
                [threshold, alias.aliases[i], probability, light.primitive],
                [r, g, b, light.flag],
            ]
        })
        .collect();
    if rows.is_empty() {
        rows.push([[0; 4]; 2]);
    }
    rows
}

/// Half of the choice goes by power over all lights. The other half goes in equal parts to the
/// kinds, so that a bright sky over a large ground plane leaves samples for a lamp, and then by
/// power within the kind. Lights that are found by chance have none, which gives hits full weight.
fn selection_weights(kinds: &[Kind]) -> Vec<f64> {
    let of_light = |l: &Sampled| if l.by_chance { 0.0 } else { l.power };
    let power = |k: &Kind| k.lights.iter().map(of_light).sum::<f64>();
    let total: f64 = kinds.iter().map(power).sum();
    let present = kinds.iter().filter(|k| power(k) > 0.0).count() as f64;
    let weights = kinds.iter().flat_map(|kind| {
        let share = power(kind) * present;
        kind.lights.iter().map(move |light| match of_light(light) {
            power if power > 0.0 => power / total + power / share,
            _ => 0.0,
        })
    });
    weights.collect()
}

fn sample_function(kinds: &[Kind]) -> String {
    let mut text =
        String::from("fn sample_light(position: vec3<f32>, bits: vec4<u32>) -> LightSample {\n");
    let sampled: Vec<&Kind> = kinds.iter().filter(|k| !k.lights.is_empty()).collect();
    let idle: Vec<&Kind> = kinds.iter().filter(|k| k.idle).collect();
    if !(sampled.is_empty() && idle.is_empty()) {
        text += "    let pick = pick_light(bits);\n";
    }
    for name in idle.iter().map(|k| k.sample) {
        text += &format!("    if pick.light < {NONE} {{ return {name}(pick, position); }}\n");
    }
    let Some((last, others)) = sampled.split_last() else {
        return text + "    return no_light_sample();\n}\n";
    };
    let mut end = 0;
    for kind in others {
        end += kind.lights.len();
        let name = kind.sample;
        text += &format!("    if pick.light < {end}u {{ return {name}(pick, position); }}\n");
    }
    text + &format!("    return {}(pick, position);\n}}\n", last.sample)
}

/// A number of lights that is zero, and that compilers do not know to be.
const NONE: &str = "run.none";

fn hit_function(kinds: &[Kind]) -> String {
    let mut text = String::from(
        "fn light_hit(primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {\n",
    );
    if kinds.iter().any(|k| k.hit.is_some()) {
        text += "    let light = primitive_light(primitive);\n";
    }
    let mut end = 0;
    for kind in kinds {
        end += kind.lights.len();
        if let Some(name) = kind.hit {
            let call = format!("{name}(light, primitive, t, direction, bsdf_pdf)");
            let bound = if kind.idle {
                NONE.to_owned()
            } else {
                format!("{end}u")
            };
            text += &format!("    if light < {bound} {{ return {call}; }}\n");
        }
    }
    text + "    return vec3<f32>(0.0);\n}\n"
}

fn escape_function(kinds: &[Kind]) -> String {
    let calls = kinds.iter().filter_map(|k| k.escape);
    let terms: String = calls
        .map(|n| format!(" + {n}(direction, bsdf_pdf)"))
        .collect();
    format!(
        "fn light_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {{\n    \
         return vec3<f32>(0.0){terms};\n}}\n"
    )
}

/// Luminance of linear RGB with Rec. 709 primaries.
fn luminance(rgb: Vec3) -> f64 {
    rgb.as_dvec3().dot(glam::dvec3(0.2126, 0.7152, 0.0722))
}

fn area([a, b, c]: [Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

fn bounding_radius([low, high]: [Vec3; 2]) -> f64 {
    (0.5 * (high.as_dvec3() - low.as_dvec3()).length()).max(f64::MIN_POSITIVE)
}
