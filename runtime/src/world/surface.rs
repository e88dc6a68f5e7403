//! The shader parts that read triangles: `geometry` (what every other part needs) and `surface`
//! (what materials see of a hit).

use glam::{DVec3, Vec2, Vec3};

use crate::scene::Mesh;
use crate::wgsl;
use crate::wgsl::template::{Template, template};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::bvh;
use crate::world::needs::{Need, Needs, SurfaceTraits};
use crate::world::places::{Places, Reads};

/// Triangles, where they are or placed.
pub(super) const GEOMETRY: Template = template!("geometry.wgsl");

/// How far rays start off the surface they leave, relative to the largest coordinate of the
/// point: 16 to 32 units in its last place. Four is too little for rays that graze a flat mesh.
const OFFSET: f32 = 1.0 / (1 << 19) as f32;

/// The same for points near the origin on large triangles, relative to the scene's largest
/// coordinate.
const OFFSET_FLOOR: f32 = 1.0 / (1 << 23) as f32;

/// `triangle_vertices`, `primitive_instance` and `primitive_light`, for the triangles of `mesh`
/// in `order`, which may have some of them several times; `lights` gives each triangle's index in the light table, `media` the word of
/// each instance's medium, or nothing where paths follow none.
pub fn geometry_part(mesh: &Mesh, order: &[u32], lights: &[u32], media: &[u32]) -> ShaderPart {
    let primitives = bvh::primitives(order, mesh.len());
    let rows: Vec<[[u32; 4]; 3]> = (0..)
        .zip(order)
        .map(|(reference, &index)| {
            let index = index as usize;
            let instance = mesh.materials[index];
            let medium = media.get(instance as usize).copied().unwrap_or(0);
            let light = bvh::light_word(reference, primitives[index], lights[index]);
            let extra = [instance, light, medium];
            [0, 1, 2].map(|k| {
                let [x, y, z] = mesh.positions[index][k].to_array().map(f32::to_bits);
                [x, y, z, extra[k]]
            })
        })
        .collect();
    let triangles = BufferData::new("triangles", "array<vec4<u32>>", &rows);
    ShaderPart {
        wgsl: GEOMETRY.wgsl(&[("placed", false)]),
        buffers: vec![triangles],
    }
}

/// What kernels ask of hits, of which each scene needs a part.
#[derive(Clone, Debug)]
pub enum Surface {
    /// A scene's corners, of which text is written once it is known what of them materials read.
    OfScene(Box<Corners>),
    /// A text by hand, which is taken as it is.
    ByHand(ShaderPart),
}

/// What the corners of a scene's triangles have.
#[derive(Clone, Debug)]
pub struct Corners {
    /// The corners of a box around everything.
    pub(super) bounds: [Vec3; 2],
    /// What coordinates are counted from.
    pub(super) origin: DVec3,
    /// Are there objects that are placed?
    pub(super) placed: bool,
    pub(super) triangles: usize,
    /// Absent if no corner has any.
    pub(super) normals: Option<BufferData>,
    /// The same; absent as well if no material reads any.
    pub(super) uvs: Option<BufferData>,
    /// The same.
    pub(super) uvs1: Option<BufferData>,
    /// The same.
    pub(super) colors: Option<BufferData>,
    /// Where objects are placed; absent if no material asks.
    pub(super) places: Option<Places>,
}

/// What corners may have beside positions.
struct Attribute {
    buffer: &'static str,
    wgsl_type: &'static str,
    /// Bytes a triangle.
    bytes: usize,
    functions: Template,
}

const NORMALS: Attribute = Attribute {
    buffer: "vertex_normals",
    wgsl_type: "array<vec4<u32>>",
    bytes: 16,
    functions: template!("surface_smooth.wgsl"),
};

const UVS: Attribute = Attribute {
    buffer: "vertex_uvs",
    wgsl_type: "array<vec2<f32>>",
    bytes: 24,
    functions: template!("surface_uv.wgsl"),
};

const UVS1: Attribute = Attribute {
    buffer: "vertex_uvs1",
    wgsl_type: "array<vec2<f32>>",
    bytes: 24,
    functions: template!("surface_uv1.wgsl"),
};

/// Of triangles without colors the bytes are those of black, which nobody reads.
const COLORS: Attribute = Attribute {
    buffer: "vertex_colors",
    wgsl_type: "array<vec2<u32>>",
    bytes: 24,
    functions: template!("surface_color.wgsl"),
};

/// What finds the corners of the last three, and says how what they have changes.
const CORNERS: Template = template!("surface_corners.wgsl");

impl Attribute {
    /// The buffer of three values for each of some triangles.
    fn buffer<T: bytemuck::NoUninit>(&self, triangles: &[T]) -> BufferData {
        BufferData::new(self.buffer, self.wgsl_type, triangles)
    }

    /// The same where no corner has any.
    fn nothing(&self, triangles: usize) -> BufferData {
        self.buffer(&vec![0u8; self.bytes * triangles])
    }
}

/// Vertex normals, three a triangle.
pub(super) fn normals_buffer(triangles: impl Iterator<Item = Option<[Vec3; 3]>>) -> BufferData {
    let rows: Vec<[u32; 4]> = triangles.map(pack_normals).collect();
    NORMALS.buffer(&rows)
}

/// Texture coordinates, three a triangle.
pub(super) fn uvs_buffer(triangles: impl Iterator<Item = [Vec2; 3]>) -> BufferData {
    let rows: Vec<[Vec2; 3]> = triangles.collect();
    UVS.buffer(&rows)
}

/// The second set of texture coordinates.
pub(super) fn uvs1_buffer(triangles: impl Iterator<Item = [Vec2; 3]>) -> BufferData {
    let rows: Vec<[Vec2; 3]> = triangles.collect();
    UVS1.buffer(&rows)
}

/// Colors, three a triangle.
pub(super) fn colors_buffer(triangles: impl Iterator<Item = [Vec3; 3]>) -> BufferData {
    let half = |x: f32| u32::from(half::f16::from_f32(x).to_bits());
    let pack = |c: Vec3| [half(c.x) | half(c.y) << 16, half(c.z)];
    let rows: Vec<[[u32; 2]; 3]> = triangles.map(|colors| colors.map(pack)).collect();
    COLORS.buffer(&rows)
}

impl Corners {
    /// Of the triangles of `mesh` in `order`; what corners may have is left out unless code reads it.
    pub(super) fn of_mesh(mesh: &Mesh, order: &[u32], reads: Reads) -> Self {
        let in_order = || order.iter().map(|index| *index as usize);
        let normals = || normals_buffer(in_order().map(|i| mesh.normals[i]));
        let uvs = || uvs_buffer(in_order().map(|i| mesh.uvs[i]));
        let uvs1 = || uvs1_buffer(in_order().map(|i| mesh.uvs1[i]));
        let colors = || colors_buffer(in_order().map(|i| mesh.colors[i]));
        Self {
            bounds: mesh.bounds(),
            origin: DVec3::ZERO,
            placed: false,
            triangles: order.len(),
            normals: (!mesh.normals.is_empty()).then(normals),
            uvs: (reads.uvs && !mesh.uvs.is_empty()).then(uvs),
            uvs1: (reads.uvs1 && !mesh.uvs1.is_empty()).then(uvs1),
            colors: (reads.colors && !mesh.colors.is_empty()).then(colors),
            places: None,
        }
    }

    /// The functions of a hit that `needs` asks for. Corners without what they are asked for have zeros.
    fn written(&self, needs: Needs) -> ShaderPart {
        let ShaderPart { mut wgsl, .. } = positions_part(self.bounds);
        if needs.has(Need::Moved) {
            wgsl += &in_world(self.origin);
        }
        let widths = [Need::UvWidths, Need::Uv1Widths, Need::ColorWidths];
        let flags = [
            ("placed", self.placed),
            ("corner_widths", needs.any(&widths)),
            ("uv_widths", needs.has(Need::UvWidths)),
            ("uv1_widths", needs.has(Need::Uv1Widths)),
            ("color_widths", needs.has(Need::ColorWidths)),
        ];
        let any_uvs = [Need::Uvs, Need::Tangents, Need::UvWidths];
        let reads_uvs1 = needs.any(&[Need::Uvs1, Need::Uv1Widths]);
        let reads_colors = needs.any(&[Need::Colors, Need::ColorWidths]);
        if reads_uvs1 || reads_colors || needs.any(&widths) {
            wgsl += &CORNERS.wgsl(&flags);
        }
        let mut read = Vec::new();
        for (is_read, attribute, values) in [
            (needs.has(Need::Normals), NORMALS, &self.normals),
            (needs.any(&any_uvs), UVS, &self.uvs),
            (reads_uvs1, UVS1, &self.uvs1),
            (reads_colors, COLORS, &self.colors),
        ] {
            if is_read {
                wgsl += &attribute.functions.wgsl(&flags);
                read.push((attribute, values));
            }
        }
        // What there is comes first.
        read.sort_by_key(|(_, values)| values.is_none());
        let buffer = |(attribute, values): (Attribute, &Option<BufferData>)| {
            let nothing = || attribute.nothing(self.triangles);
            values.clone().unwrap_or_else(nothing)
        };
        let mut buffers: Vec<BufferData> = read.into_iter().map(buffer).collect();
        if needs.has(Need::Places) {
            let nowhere = Places::nowhere(self.triangles);
            let places = self.places.as_ref().unwrap_or(&nowhere);
            let part = places.written(needs, self.placed);
            wgsl += &part.wgsl;
            buffers.extend(part.buffers);
        }
        ShaderPart { wgsl, buffers }
    }
}

impl Surface {
    /// The part with the functions that `needs` asks for. Needs the geometry part.
    pub(super) fn written(&self, needs: Needs) -> ShaderPart {
        match self {
            Surface::OfScene(corners) => corners.written(needs),
            Surface::ByHand(part) => part.clone(),
        }
    }

    /// What the table of needs has to know; of what is written by hand the worst is assumed.
    pub(super) fn traits(&self) -> SurfaceTraits {
        match self {
            Surface::OfScene(corners) => SurfaceTraits {
                normals: corners.normals.is_some(),
                uvs: corners.uvs.is_some(),
                uvs1: corners.uvs1.is_some(),
                colors: corners.colors.is_some(),
                moved: corners.origin != DVec3::ZERO,
                placed: corners.placed,
            },
            Surface::ByHand(_) => SurfaceTraits {
                normals: true,
                uvs: true,
                uvs1: false,
                colors: false,
                moved: false,
                placed: false,
            },
        }
    }

    /// The buffers that it may read.
    pub(super) fn buffers_mut(&mut self) -> Vec<&mut BufferData> {
        match self {
            Surface::OfScene(corners) => {
                let Corners {
                    normals,
                    uvs,
                    uvs1,
                    colors,
                    places,
                    ..
                } = &mut **corners;
                let attributes = normals.iter_mut().chain(uvs).chain(uvs1).chain(colors);
                let places = places.iter_mut().flat_map(Places::buffers_mut);
                attributes.chain(places).collect()
            }
            Surface::ByHand(part) => part.buffers.iter_mut().collect(),
        }
    }
}

/// `hit_position`, `hit_geometric_normal` and `offset_origin`, which every scene needs, in a scene between two
/// corners. Needs the geometry part.
pub fn positions_part(bounds: [Vec3; 2]) -> ShaderPart {
    ShaderPart {
        wgsl: offset_constants(bounds) + include_str!("surface.wgsl"),
        buffers: Vec::new(),
    }
}

/// The place in the world of a place in the scene's own coordinates.
fn in_world(origin: DVec3) -> String {
    wgsl::constant_vec3("WORLD_ORIGIN", origin.as_vec3())
        + "\nfn in_world(position: vec3<f32>) -> vec3<f32> {\n    return position + WORLD_ORIGIN;\n}\n"
}

/// What `offset_origin` moves rays by, in a scene between two corners.
fn offset_constants([low, high]: [Vec3; 2]) -> String {
    let largest = low.abs().max(high.abs()).max_element();
    // The floor is positive even for a scene that is all zeros, so that it is an offset.
    let floor = (largest * OFFSET_FLOOR).max(f32::MIN_POSITIVE);
    wgsl::constant_f32("ORIGIN_OFFSET", OFFSET) + &wgsl::constant_f32("ORIGIN_OFFSET_FLOOR", floor)
}

/// Three vertex normals, and whether there are any.
fn pack_normals(normals: Option<[Vec3; 3]>) -> [u32; 4] {
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
