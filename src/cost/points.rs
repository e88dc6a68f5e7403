//! Points of the surfaces of a scene, by material.

use glam::{DVec2, DVec3};
use impasto_compiler::Program;
use impasto_compiler::cost::Inputs;
use impasto_compiler::inspect::At;
use impasto_runtime::scene::{Mesh, NO_MATERIAL};

/// What a ray sees of a triangle, in its size: patterns that filter do so.
const SEEN: f64 = 1e-2;

/// The triangles of one material, by instance, each with the area up to its end.
#[derive(Default)]
pub(super) struct Surfaces {
    triangles: Vec<u32>,
    area: Vec<f64>,
}

/// The surfaces of each material.
pub(super) fn surfaces(mesh: &Mesh, program: &Program) -> Vec<Surfaces> {
    let mut order: Vec<u32> = (0..mesh.len() as u32).collect();
    order.retain(|&t| mesh.materials[t as usize] != NO_MATERIAL);
    // Instances one after another: evaluating them by turns would be slow.
    order.sort_by_key(|&t| mesh.materials[t as usize]);
    let mut surfaces: Vec<Surfaces> = program.materials().map(|_| Surfaces::default()).collect();
    for triangle in order {
        let instance = mesh.materials[triangle as usize] as usize;
        let of = &mut surfaces[program.instances()[instance].info.material];
        let [a, b, c] = mesh.positions[triangle as usize].map(|p| p.as_dvec3());
        let before = of.area.last().copied().unwrap_or(0.0);
        of.triangles.push(triangle);
        of.area.push(before + 0.5 * (b - a).cross(c - a).length());
    }
    surfaces
}

impl Surfaces {
    /// Points with their instances, in equal steps of area, each step with a point in it. The mesh's
    /// coordinates count from a place in the world.
    pub fn points(
        &self,
        (mesh, origin): (&Mesh, DVec3),
        samples: usize,
        passes: bool,
        inputs: &mut Inputs,
    ) -> Vec<(usize, At)> {
        let Some(&total) = self.area.last() else {
            return Vec::new();
        };
        let point = |i: usize| {
            let area = total * (i as f64 + inputs.unit()) / samples as f64;
            let found = self.area.partition_point(|&end| end <= area);
            let triangle = self.triangles[found.min(self.triangles.len() - 1)] as usize;
            let mut at = on_triangle(mesh, triangle, [inputs.unit(), inputs.unit()]);
            at.position = (DVec3::from(at.position) + origin).to_array();
            (mesh.materials[triangle] as usize, inputs.lit(at, passes))
        };
        (0..samples).map(point).collect()
    }
}

/// The point of a triangle that two numbers pick, uniformly by area.
fn on_triangle(mesh: &Mesh, triangle: usize, [s, t]: [f64; 2]) -> At {
    let root = s.sqrt();
    let weights = [1.0 - root, root * (1.0 - t), root * t];
    let mixed = |v: [DVec3; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
    let corners = mesh.positions[triangle].map(|p| p.as_dvec3());
    let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let size = flat.length().sqrt();
    let flat = flat.normalize_or_zero();
    let smooth = mesh.normals.get(triangle).copied().flatten();
    let smooth = smooth.map(|n| mixed(n.map(|n| n.as_dvec3())).normalize_or(flat));
    let uvs = mesh.uvs.get(triangle).copied().unwrap_or_default();
    let uvs = uvs.map(|uv| uv.as_dvec2());
    let uv = uvs[0] * weights[0] + uvs[1] * weights[1] + uvs[2] * weights[2];
    At {
        position: mixed(corners).to_array(),
        normal: smooth.unwrap_or(flat).to_array(),
        geometric_normal: flat.to_array(),
        tangent: tangent(corners, uvs).to_array(),
        uv: uv.to_array(),
        footprint: SEEN * size,
        ..At::default()
    }
}

/// The unit direction in which the first texture coordinate grows; zero where there is none.
fn tangent([a, b, c]: [DVec3; 3], [ta, tb, tc]: [DVec2; 3]) -> DVec3 {
    let (d1, d2) = (tb - ta, tc - ta);
    let along = (b - a) * d2.y - (c - a) * d1.y;
    (along * d1.perp_dot(d2).signum()).normalize_or_zero()
}
