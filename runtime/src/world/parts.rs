//! What kernels may read of a scene, and the shader parts that are written of it once its needs are decided;
//! which of them a kernel has to include together:
//!
//! | part | provides | needs |
//! |---|---|---|
//! | `geometry` | `triangle_vertices`, `primitive_instance` | |
//! | `bvh` | `Hit`, `NO_PRIMITIVE`, `trace_closest`, `trace_any`, the steps of casts | `geometry` |
//! | `surface` | `hit_position`, `hit_normal`, ..., `offset_origin` | `geometry` |
//! | `lights` | `sample_light`, `light_hit`, `light_escape` | `surface`, `lights::mis` |
//! | `media` | `active_medium`, `media_beyond`, `transmittance`, ... | `geometry` |
//! | `texture` | `texture_fetch` | |

use glam::Vec3;
use impasto_compiler::abi::{InputSet, InstanceInfo, MaterialInfo, TextureRef};

use super::surface::{Corners, Surface, geometry_part};
use super::{GeometryCounts, Placed, Split};
use crate::error::SceneError;
use crate::film::layers::Layers;
use crate::film::outputs::Ask;
use crate::scene::Scene;
use crate::technique::{Stack, Technique};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::bvh::{self, Trees};
use crate::world::lights::{Kinds, Lights};
use crate::world::media::{self, Media};
use crate::world::needs::{Need, Needs};
use crate::world::outputs::{Recorded, objects_part};
use crate::world::places::{Places, Reads};
use crate::world::texture;

/// Everything that kernels may read of a scene. What depends on needs is no text yet.
#[derive(Clone, Debug)]
pub struct SceneParts {
    /// Corners, instance and medium of each triangle.
    pub geometry: ShaderPart,
    /// Ray casts.
    pub bvh: ShaderPart,
    /// The corners of a box around everything, in metres.
    pub bounds: [Vec3; 2],
    /// Positions, normals and coordinates of hits.
    pub surface: Surface,
    /// Light samples and the emission that paths run into.
    pub lights: Lights,
    /// What fills objects.
    pub media: Media,
    /// Texture lookups; absent if no material reads a texture.
    pub texture: Option<ShaderPart>,
    /// How many triangles there are, for the report.
    pub counts: GeometryCounts,
    /// Indices of the materials that no triangle binds, ascending.
    pub unbound: Vec<usize>,
}

/// The parts as kernels include them: written once it is known what is needed.
#[derive(Clone, Debug)]
pub struct KernelParts {
    /// Corners, instance and medium of each triangle.
    pub geometry: ShaderPart,
    /// Ray casts.
    pub bvh: ShaderPart,
    /// Positions, normals and coordinates of hits, and `in_world` if coordinates are counted from elsewhere.
    pub surface: ShaderPart,
    /// Light samples and the emission that paths run into. `light_hit` is the emission of
    /// materials with `Emission::Uniform` (and of quad lights); that of `Emission::Varying` is
    /// left to `material_emission`.
    pub lights: ShaderPart,
    /// The media that a path is in; absent if paths follow none.
    pub media: Option<ShaderPart>,
    /// Texture lookups; absent if no material reads a texture.
    pub texture: Option<ShaderPart>,
    /// What outputs of the film look up; absent if they look up nothing.
    pub outputs: Option<ShaderPart>,
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
        let inputs = (materials, instances, textures);
        let (parts, _) = Self::recording(
            scene,
            inputs,
            technique,
            Layers::default(),
            &Trees::default(),
        )?;
        Ok(parts)
    }

    /// The same for a film with some outputs, and what these look up; `trees` may be there already.
    pub(crate) fn recording(
        scene: &Scene,
        (materials, instances, textures): (&[MaterialInfo], &[InstanceInfo], &[TextureRef]),
        technique: &Technique,
        layers: Layers,
        trees: &Trees,
    ) -> Result<(SceneParts, Recorded), SceneError> {
        let texture = texture::part(textures, &scene.base).map_err(|e| texture::named(e, scene))?;
        let media = Media::build(materials, instances, &scene.camera_media)?;
        let inputs = materials.iter().map(|m| m.inputs);
        let mut reads = Reads::of(inputs.fold(InputSet::default(), InputSet::or));
        reads.uvs |= layers.ask(Ask::Uvs);
        let tells_objects = layers.ask(Ask::Objects);
        let split = Split::new(scene, instances, technique.copies)?;
        let lights = |order: &[u32]| {
            let mesh = &*split.world;
            // A light is chosen by its triangle, however many references there are to it.
            let primitives = bvh::primitives(order, mesh.len());
            Kinds::build(scene, mesh, split.bounds, &primitives, instances, &media)
        };
        let (geometry, bvh, corners, lights, objects, references) = if split.placements.is_empty() {
            let mesh = &*split.world;
            let bvh = trees.over(mesh, technique);
            let lights = lights(bvh.order());
            let of_triangle = lights.of_triangle(mesh.len());
            (
                geometry_part(mesh, bvh.order(), &of_triangle, &media.of_instance),
                bvh.part(technique),
                Corners {
                    places: reads
                        .places
                        .then(|| Places::of_mesh(scene, mesh, bvh.order())),
                    ..Corners::of_mesh(mesh, bvh.order(), reads)
                },
                lights,
                tells_objects.then(|| objects_part(mesh, bvh.order())),
                bvh.order().len() as u64,
            )
        } else {
            check_stack(technique.stack)?;
            let placed = Placed::build(&split, instances.len(), technique, trees)?;
            let lights = lights(placed.world_order());
            let of_triangle = lights.of_triangle(split.world.len());
            (
                placed.geometry_part(&of_triangle, &media.of_instance),
                placed.levels().part(technique),
                Corners {
                    places: reads.places.then(|| placed.places(scene)),
                    ..placed.corners(reads)
                },
                lights,
                tells_objects.then(|| placed.objects_part(&split.first_objects)),
                placed.references(),
            )
        };
        let recorded = Recorded {
            groups: lights.groups(scene, &layers),
            objects,
            layers,
        };
        let parts = SceneParts {
            geometry,
            bvh,
            surface: Surface::OfScene(Box::new(Corners {
                bounds: split.bounds,
                origin: scene.origin,
                ..corners
            })),
            bounds: split.bounds,
            lights: Lights::OfScene(lights),
            counts: GeometryCounts {
                references,
                ..split.counts()
            },
            unbound: scene.unbound(materials.len(), instances),
            media,
            texture,
        };
        Ok((parts, recorded))
    }

    /// The texts that `needs` ask for. What they ask for without its being there comes with black lights,
    /// corners without normals, empty space.
    pub(crate) fn written(&self, needs: Needs) -> KernelParts {
        let media = || {
            self.media
                .part
                .clone()
                .unwrap_or_else(media::of_empty_space)
        };
        KernelParts {
            geometry: self.geometry.clone(),
            bvh: self.bvh.clone(),
            surface: self.surface.written(needs),
            lights: self.lights.written(needs),
            media: needs.has(Need::Media).then(media),
            texture: self.texture.clone(),
            outputs: None,
        }
    }

    /// The same without the contents of buffers, for composing kernels that read what is uploaded already.
    pub(crate) fn without_contents(&self) -> Self {
        let mut parts = self.clone();
        let of_parts = [&mut parts.geometry, &mut parts.bvh].into_iter();
        let of_parts = of_parts
            .chain(&mut parts.media.part)
            .chain(&mut parts.texture);
        let of_parts = of_parts.flat_map(|part| &mut part.buffers);
        let others = parts.surface.buffers_mut().into_iter();
        let others = others.chain(parts.lights.buffers_mut());
        of_parts.chain(others).for_each(BufferData::drop_contents);
        parts
    }
}

impl KernelParts {
    /// Every part that there is, in the order of their buffers.
    pub(crate) fn all(&self) -> impl Iterator<Item = &ShaderPart> {
        let always = [&self.geometry, &self.bvh, &self.surface, &self.lights];
        let others = self.media.iter().chain(&self.texture);
        always.into_iter().chain(others).chain(&self.outputs)
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
