//! The shader parts that read triangles: `geometry` (what every other part needs) and `surface`
//! (what materials see of a hit).

use glam::{Vec2, Vec3};

use crate::scene::Mesh;
use crate::wgsl;
use crate::wgsl::text::preprocess;
use crate::wgsl::{BufferData, ShaderPart};

/// How far rays start off the surface they leave, relative to the largest coordinate of the
/// point: 16 to 32 units in its last place. Four is too little for rays that graze a flat mesh.
const OFFSET: f32 = 1.0 / (1 << 19) as f32;

/// The same for points near the origin on large triangles, relative to the scene's largest
/// coordinate.
const OFFSET_FLOOR: f32 = 1.0 / (1 << 23) as f32;

/// `triangle_vertices`, `primitive_instance` and `primitive_light`, for the triangles of `mesh`
/// in `order`; `lights` gives each triangle's index in the light table, `media` the word of
/// each instance's medium, or nothing where paths follow none.
pub fn geometry_part(mesh: &Mesh, order: &[u32], lights: &[u32], media: &[u32]) -> ShaderPart {
    let rows: Vec<[[u32; 4]; 3]> = order
        .iter()
        .map(|&index| {
            let index = index as usize;
            let instance = mesh.materials[index];
            let medium = media.get(instance as usize).copied().unwrap_or(0);
            let extra = [instance, lights[index], medium];
            [0, 1, 2].map(|k| {
                let [x, y, z] = mesh.positions[index][k].to_array().map(f32::to_bits);
                [x, y, z, extra[k]]
            })
        })
        .collect();
    let triangles = BufferData::new("triangles", "array<vec4<u32>>", &rows);
    ShaderPart {
        wgsl: preprocess(include_str!("geometry.wgsl"), &[]),
        buffers: vec![triangles],
    }
}

/// `hit_position` and the other functions of a hit, for the triangles of `mesh` in `order`.
/// Texture coordinates are left out unless `reads_uv`. Needs the geometry part.
pub fn surface_part(mesh: &Mesh, order: &[u32], reads_uv: bool) -> ShaderPart {
    let mut part = ShaderPart {
        wgsl: offset_constants(mesh.bounds()) + include_str!("surface.wgsl"),
        buffers: Vec::new(),
    };
    if mesh.normals.is_empty() {
        part.wgsl += include_str!("surface_flat.wgsl");
    } else {
        part.wgsl += &preprocess(include_str!("surface_smooth.wgsl"), &[]);
        part.buffers.push(normals_buffer(mesh, order));
    }
    if mesh.uvs.is_empty() || !reads_uv {
        part.wgsl += include_str!("surface_no_uv.wgsl");
    } else {
        part.wgsl += &preprocess(include_str!("surface_uv.wgsl"), &[]);
        part.buffers.push(uvs_buffer(mesh, order));
    }
    part
}

/// What `offset_origin` moves rays by, in a scene between two corners.
pub(super) fn offset_constants([low, high]: [Vec3; 2]) -> String {
    let largest = low.abs().max(high.abs()).max_element();
    // The floor is positive even for a scene that is all zeros, so that it is an offset.
    let floor = (largest * OFFSET_FLOOR).max(f32::MIN_POSITIVE);
    wgsl::constant_f32("ORIGIN_OFFSET", OFFSET) + &wgsl::constant_f32("ORIGIN_OFFSET_FLOOR", floor)
}

fn normals_buffer(mesh: &Mesh, order: &[u32]) -> BufferData {
    let rows = order
        .iter()
        .map(|&i| pack_normals(mesh.normals[i as usize]));
    let rows: Vec<[u32; 4]> = rows.collect();
    BufferData::new("vertex_normals", "array<vec4<u32>>", &rows)
}

fn uvs_buffer(mesh: &Mesh, order: &[u32]) -> BufferData {
    let rows: Vec<[Vec2; 3]> = order.iter().map(|&i| mesh.uvs[i as usize]).collect();
    BufferData::new("vertex_uvs", "array<vec2<f32>>", &rows)
}

/// Three vertex normals, and whether there are any.
pub(super) fn pack_normals(normals: Option<[Vec3; 3]>) -> [u32; 4] {
    match normals {
        Some([a, b, c]) => [pack_normal(a), pack_normal(b), pack_normal(c), 1],
        None => [0; 4],
    }
}

/// Octahedral coordinates in two signed 16-bit fractions; see `unpack_normal` in WGSL.
fn pack_normal(normal: Vec3) -> u32 {
    let n = normal / normal.abs().element_sum();
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if n.z >= 0.0 {
        (n.x, n.y)
    } else {
        ((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y))
    };
    let snorm = |x: f32| (x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16 as u32;
    snorm(x) | snorm(y) << 16
}
