//! The shader parts of a scene, and which of them a kernel has to include together.
//!
//! | part | provides | needs |
//! |---|---|---|
//! | `geometry` | `triangle_vertices`, `primitive_instance` | |
//! | `bvh` | `Hit`, `NO_PRIMITIVE`, `trace_closest`, `trace_any`, the steps of casts | `geometry` |
//! | `surface` | `hit_position`, `hit_normal`, ..., `offset_origin` | `geometry` |
//! | `lights` | `sample_light`, `light_hit`, `light_escape` | `surface`, `lights::mis` |
//! | `media` | `active_medium`, `media_beyond`, `transmittance`, ... | `geometry` |
//! | `texture` | `texture_fetch` | |

use glam::{DVec3, Vec3};
use impasto_compiler::abi::{InstanceInfo, MaterialInfo, TextureRef};

use super::surface::{geometry_part, offset_constants, surface_part};
use super::{GeometryCounts, Placed, Split};
use crate::error::SceneError;
use crate::scene::Scene;
use crate::technique::{Stack, Technique};
use crate::wgsl;
use crate::wgsl::text::{Flag, preprocess};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::bvh::Bvh;
use crate::world::lights::{Kinds, Lights};
use crate::world::media::{self, Media};
use crate::world::needs::facts::SceneFacts;
use crate::world::needs::{Need, Needs};
use crate::world::texture;

/// Everything a kernel may include to read the scene.
#[derive(Clone, Debug)]
pub struct SceneParts {
    /// Corners, instance and medium of each triangle.
    pub geometry: ShaderPart,
    /// Ray casts.
    pub bvh: ShaderPart,
    /// The corners of a box around everything, in metres.
    pub bounds: [Vec3; 2],
    /// Positions, normals and coordinates of hits.
    pub surface: ShaderPart,
    /// Do materials read positions that [`Scene::origin`] has to be added to? Then `surface` has
    /// `in_world`.
    pub moved: bool,
    /// Light samples and the emission that paths run into. `light_hit` is the emission of
    /// materials with `Emission::Uniform` (and of quad lights); that of `Emission::Varying` is
    /// left to `material_emission`.
    pub lights: ShaderPart,
    /// What fills objects.
    pub media: Media,
    /// Texture lookups; absent if no material reads a texture.
    pub texture: Option<ShaderPart>,
    /// Can any light be sampled? If not, no shadow ray is worth casting
    /// (`HAS_SAMPLED_LIGHTS` in WGSL).
    pub has_sampled_lights: bool,
    /// How many triangles there are, for the report.
    pub counts: GeometryCounts,
    /// Indices of the materials that no triangle binds, ascending.
    pub unbound: Vec<usize>,
    /// What the table of needs judges by.
    pub facts: SceneFacts,
    /// What the parts are made of that depend on needs; absent if they were written by hand.
    pub sources: Option<Sources>,
}

/// What the texts are made of that depend on needs.
#[derive(Clone, Debug)]
pub struct Sources {
    lights: Kinds,
    /// The constants of `offset_origin`.
    offsets: String,
    /// `in_world`, of a scene that counts coordinates from elsewhere.
    in_world: String,
}

impl SceneParts {
    /// The parts of `scene`, whose bindings compiled to `instances` of `materials`, which read
    /// `textures`; rays are cast as `technique` says.
    pub fn build(
        scene: &Scene,
        materials: &[MaterialInfo],
        instances: &[InstanceInfo],
        textures: &[TextureRef],
        technique: &Technique,
    ) -> Result<SceneParts, SceneError> {
        let texture = texture::part(textures, &scene.base)?;
        let media = Media::build(materials, instances, &scene.camera_media)?;
        let reads_uv = |m: &MaterialInfo| {
            let inputs = &m.inputs;
            inputs.uv || inputs.tangent || inputs.footprint_uv
        };
        let reads_uv = materials.iter().any(reads_uv);
        let reads_position = materials.iter().any(|m| m.inputs.position);
        let moved = reads_position && scene.origin != DVec3::ZERO;
        let split = Split::new(scene, instances, technique.copies)?;
        let lights = |order: &[u32]| {
            Lights::build(scene, &split.world, split.bounds, order, instances, &media)
        };
        let (geometry, bvh, mut surface, lights) = if split.placements.is_empty() {
            let mesh = &*split.world;
            let bvh = Bvh::build(mesh, technique.traversal);
            let lights = lights(bvh.order());
            let of_triangle = &lights.of_triangle;
            (
                geometry_part(mesh, bvh.order(), of_triangle, &media.of_instance),
                bvh.part(technique),
                surface_part(mesh, bvh.order(), reads_uv),
                lights,
            )
        } else {
            check_stack(technique.stack)?;
            let placed = Placed::build(&split, instances.len(), technique.traversal)?;
            let lights = lights(placed.world_order());
            (
                placed.geometry_part(&lights.of_triangle, &media.of_instance),
                placed.levels().part(technique),
                placed.surface_part(reads_uv),
                lights,
            )
        };
        let in_world = match scene.origin == DVec3::ZERO {
            true => String::new(),
            false => in_world(scene.origin),
        };
        surface.wgsl += &in_world;
        let mut facts = lights.kinds.facts();
        facts.normals = has(&surface, NORMALS.0);
        facts.uvs = has(&surface, UVS.0);
        facts.placed = !split.placements.is_empty();
        Ok(SceneParts {
            facts,
            sources: Some(Sources {
                lights: lights.kinds,
                offsets: offset_constants(split.bounds),
                in_world,
            }),
            geometry,
            bvh,
            surface,
            moved,
            bounds: split.bounds,
            lights: lights.part,
            has_sampled_lights: lights.has_sampled,
            counts: split.counts(),
            unbound: scene.unbound(materials.len(), instances),
            media,
            texture,
        })
    }
}

/// The place in the world of a place in the scene's own coordinates.
fn in_world(origin: DVec3) -> String {
    wgsl::constant_vec3("WORLD_ORIGIN", origin.as_vec3())
        + "\nfn in_world(position: vec3<f32>) -> vec3<f32> {\n    return position + WORLD_ORIGIN;\n}\n"
}

/// A buffer of what corners have: the name, its type, and bytes a triangle.
type CornerBuffer = (&'static str, &'static str, usize);

const NORMALS: CornerBuffer = ("vertex_normals", "array<vec4<u32>>", 16);
const UVS: CornerBuffer = ("vertex_uvs", "array<vec2<f32>>", 24);

fn has(part: &ShaderPart, buffer: &str) -> bool {
    part.buffers.iter().any(|b| b.name == buffer)
}

impl SceneParts {
    /// Makes the texts anew for what is needed: what is not needed goes, and what is needed without being
    /// there comes with black lights, corners without normals, empty space.
    pub(crate) fn specialise(&mut self, needs: Needs) {
        let Some(sources) = &self.sources else {
            return;
        };
        self.lights = sources.lights.part(needs);
        let corners = self.geometry.buffers.iter().find(|b| b.name == "triangles");
        let triangles = corners.map_or(0, |b| b.bytes.len() / CORNERS_BYTES);
        let mut flags: Vec<Flag> = needs.flags().collect();
        flags.push(("placed", self.facts.placed));
        let mut wgsl = sources.offsets.clone() + include_str!("surface.wgsl");
        if needs.has(Need::Moved) {
            wgsl += &sources.in_world;
        }
        let mut buffers = std::mem::take(&mut self.surface.buffers);
        let mut corners_text = |need: bool, (name, ty, bytes): CornerBuffer, text: &str| {
            if !need {
                buffers.retain(|b| b.name != name);
                return String::new();
            }
            if buffers.iter().all(|b| b.name != name) {
                buffers.push(BufferData::new(name, ty, &vec![0u8; bytes * triangles]));
            }
            preprocess(text, &flags)
        };
        let of_corners = [
            (
                needs.has(Need::Normals),
                NORMALS,
                include_str!("surface_smooth.wgsl"),
            ),
            (
                needs.any(&[Need::Uvs, Need::Tangents, Need::UvWidths]),
                UVS,
                include_str!("surface_uv.wgsl"),
            ),
        ];
        for (need, buffer, text) in of_corners {
            wgsl += &corners_text(need, buffer, text);
        }
        self.surface = ShaderPart { wgsl, buffers };
        if needs.has(Need::Media) && self.media.part.is_none() {
            self.media.part = Some(media::of_empty_space());
        }
    }
}

/// Bytes of a triangle's corners.
const CORNERS_BYTES: usize = 48;

impl Sources {
    /// The same without the contents of buffers.
    pub(crate) fn text(&self) -> Self {
        Self {
            lights: self.lights.text(),
            offsets: self.offsets.clone(),
            in_world: self.in_world.clone(),
        }
    }
}

/// A trail says where a ray is in one tree, not in two.
fn check_stack(stack: Stack) -> Result<(), SceneError> {
    if stack != Stack::Trail {
        return Ok(());
    }
    let message = "objects that are placed cannot be rendered without a stack (`--stack trail`)";
    Err(SceneError::new(message).hint("choose another stack, or copy objects with `--copies flat`"))
}
