//! The shader parts of a scene, and which of them a kernel has to include together.
//!
//! | part | provides | needs |
//! |---|---|---|
//! | `geometry` | `triangle_vertices`, `primitive_instance` | |
//! | `bvh` | `Hit`, `NO_PRIMITIVE`, `trace_closest`, `trace_any`, the steps of casts | `geometry` |
//! | `surface` | `hit_position`, `hit_normal`, ..., `offset_origin` | `geometry` |
//! | `lights` | `sample_light`, `light_hit`, `light_escape`, `power_heuristic` | `surface` |
//! | `media` | `active_medium`, `media_beyond`, `transmittance`, ... | `geometry` |
//! | `texture` | `texture_fetch` | |

use glam::Vec3;
use impasto_compiler::abi::{InstanceInfo, MaterialInfo, TextureRef};

use super::surface::{geometry_part, surface_part};
use super::{Scene, SceneError};
use crate::bvh::Bvh;
use crate::lights::Lights;
use crate::media::Media;
use crate::shader_part::ShaderPart;
use crate::technique::Technique;
use crate::texture;

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
        let bvh = Bvh::build(&scene.mesh, technique.traversal);
        let media = Media::build(materials, instances, &scene.camera_media)?;
        let lights = Lights::build(scene, bvh.order(), instances, &media);
        let reads_uv = materials.iter().any(|m| m.inputs.uv || m.inputs.tangent);
        Ok(SceneParts {
            geometry: geometry_part(
                &scene.mesh,
                bvh.order(),
                &lights.of_triangle,
                &media.of_instance,
            ),
            bvh: bvh.part(technique),
            bounds: scene.mesh.bounds(),
            surface: surface_part(&scene.mesh, bvh.order(), reads_uv),
            lights: lights.part,
            media,
            texture,
            has_sampled_lights: lights.has_sampled,
        })
    }
}
