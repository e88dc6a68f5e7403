//! What the materials of a scene, or of a file, cost where they are used: operations of one
//! evaluation at points of the scene's own surfaces.

use glam::{DVec2, DVec3};
use impasto_compiler::cost::{self, Cost, Inputs, Operations};
use impasto_compiler::inspect::At;
use impasto_compiler::ir::interp::OutOfFuel;
use impasto_compiler::{Program, abi::MaterialInfo};
use impasto_runtime::scene::{Mesh, NO_MATERIAL};
use serde::Serialize;

use crate::Scene;

/// What a material of a program costs.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialCost {
    /// Its name in the program.
    pub name: String,
    /// How many instances share its code.
    pub instances: usize,
    /// Its lobes after layering.
    pub lobes: usize,
    /// What evaluating it costs; none if it is on no surface of the scene.
    pub cost: Option<Cost>,
}

impl MaterialCost {
    /// Operations of one evaluation.
    pub fn operations(&self) -> Option<&Operations> {
        self.cost.as_ref().map(|c| &c.operations)
    }
}

/// The materials of `program`, which a scene's bindings compiled to, each evaluated at `samples`
/// points: spread by area over the surfaces that bind it, seen from random directions.
///
/// # Errors
/// If the evaluations of a material take too long together.
pub fn of_scene(
    scene: &Scene,
    program: &Program,
    samples: usize,
) -> Result<Vec<MaterialCost>, OutOfFuel> {
    let mesh = &*scene.sampled(SAMPLED_COPIES);
    let surfaces = surfaces(mesh, program);
    measure(program, |material, info| {
        let mut inputs = Inputs::new(material as u64);
        surfaces[material].points(mesh, samples, info.crosses, &mut inputs)
    })
}

/// The materials of `program`, each evaluated at `samples` points anywhere within a few metres.
///
/// # Errors
/// If the evaluations of a material take too long together.
pub fn anywhere(program: &Program, samples: usize) -> Result<Vec<MaterialCost>, OutOfFuel> {
    measure(program, |material, _| {
        let of = |i: &usize| program.instances()[*i].info.material == material;
        let instances: Vec<usize> = (0..program.instances().len()).filter(of).collect();
        let mut inputs = Inputs::new(material as u64);
        let point = |i: usize| (instances[i * instances.len() / samples], inputs.anywhere());
        (0..samples).map(point).collect()
    })
}

fn measure(
    program: &Program,
    mut points: impl FnMut(usize, &MaterialInfo) -> Vec<(usize, At)>,
) -> Result<Vec<MaterialCost>, OutOfFuel> {
    let cost = |(material, info): (usize, &MaterialInfo)| {
        let instances = program.instances().iter();
        Ok(MaterialCost {
            name: info.name.clone(),
            instances: instances.filter(|i| i.info.material == material).count(),
            lobes: info.lobes,
            cost: cost::vector(program, material, &points(material, info))?,
        })
    };
    program.materials().enumerate().map(cost).collect()
}

/// About how many triangles of placed objects points are taken from.
const SAMPLED_COPIES: usize = 4_000_000;

/// The triangles of one material, by instance, each with the area up to its end.
#[derive(Default)]
struct Surfaces {
    triangles: Vec<u32>,
    area: Vec<f64>,
}

/// The surfaces of each material.
fn surfaces(mesh: &Mesh, program: &Program) -> Vec<Surfaces> {
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
    /// Points with their instances, in equal steps of area, each step with a point in it.
    fn points(
        &self,
        mesh: &Mesh,
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
            let at = on_triangle(mesh, triangle, [inputs.unit(), inputs.unit()]);
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
        ..At::default()
    }
}

/// The unit direction in which the first texture coordinate grows; zero where there is none.
fn tangent([a, b, c]: [DVec3; 3], [ta, tb, tc]: [DVec2; 3]) -> DVec3 {
    let (d1, d2) = (tb - ta, tc - ta);
    let along = (b - a) * d2.y - (c - a) * d1.y;
    (along * d1.perp_dot(d2).signum()).normalize_or_zero()
}
