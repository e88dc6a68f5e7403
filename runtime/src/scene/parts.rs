//! The shader parts of a scene, and which of them a kernel has to include together.
//!
//! | part | provides | needs |
//! |---|---|---|
//! | `geometry` | `triangle_vertices`, `primitive_material` | |
//! | `bvh` | `Hit`, `NO_PRIMITIVE`, `trace_closest`, `trace_any` | `geometry` |
//! | `surface` | `hit_position`, `hit_normal`, ..., `offset_origin` | `geometry` |
//! | `lights` | `sample_light`, `light_hit`, `light_escape`, `power_heuristic` | `surface` |
//! | `texture` | `texture_fetch` | |

use crate::shader_part::ShaderPart;

/// Everything a kernel may include to read the scene.
#[derive(Clone, Debug)]
pub struct SceneParts {
    /// Corners and material of each triangle.
    pub geometry: ShaderPart,
    /// Ray casts.
    pub bvh: ShaderPart,
    /// Positions, normals and coordinates of hits.
    pub surface: ShaderPart,
    /// Light samples and the emission that paths run into.
    pub lights: ShaderPart,
    /// Texture lookups; absent if no material reads a texture.
    pub texture: Option<ShaderPart>,
    /// Can any light be sampled? If not, no shadow ray is worth casting
    /// (`HAS_SAMPLED_LIGHTS` in WGSL).
    pub has_sampled_lights: bool,
}
