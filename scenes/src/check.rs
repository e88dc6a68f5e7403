//! What the tests ask of geometry: closed, outward, finite, without empty triangles.

use glam::DVec3;

use crate::mesh::{Mesh, Triangle};
use crate::obj::rounded;

/// Does every edge belong to exactly two triangles that run along it in opposite directions?
pub fn is_closed(triangles: &[Triangle]) -> bool {
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| corner.position);
        edges.extend([(a, b), (b, c), (c, a)]);
    }
    edges.sort_unstable();
    let unique = edges.windows(2).all(|pair| pair[0] != pair[1]);
    unique
        && edges
            .iter()
            .all(|&(a, b)| edges.binary_search(&(b, a)).is_ok())
}

/// The volume inside a closed surface; negative if it is inside out.
pub fn signed_volume(positions: &[DVec3], triangles: &[Triangle]) -> f64 {
    let tetrahedron = |triangle: &Triangle| {
        let [a, b, c] = triangle.map(|corner| positions[corner.position as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(tetrahedron).sum()
}

/// Everything that is wrong with a mesh as a reader of its file sees it, at most a few lines.
pub fn defects(mesh: &Mesh) -> Vec<String> {
    let mut found = Vec::new();
    let finite =
        mesh.positions.iter().all(|p| p.is_finite()) && mesh.uvs.iter().all(|t| t.is_finite());
    if !finite {
        found.push("a position or texture coordinate is not finite".to_owned());
    }
    for part in &mesh.parts {
        let bad = part.triangles.iter().filter(|t| is_bad(mesh, t)).count();
        if bad > 0 {
            found.push(format!("{bad} bad triangles of {}", part.material));
        }
    }
    found
}

/// Empty once rounded, or with a normal that is no unit vector or points behind the face.
fn is_bad(mesh: &Mesh, triangle: &Triangle) -> bool {
    let [a, b, c] = triangle.map(|corner| rounded(mesh.positions[corner.position as usize]));
    let face = (b - a).cross(c - a);
    let normal_is_bad = triangle.iter().any(|corner| {
        let normal = mesh.normals[corner.normal as usize];
        !(normal.length() - 1.0).abs().le(&1e-6) || normal.dot(face) <= 0.0
    });
    face.length() < 1e-12 || normal_is_bad
}

/// The connected pieces of a part.
pub fn pieces(mesh: &Mesh, material: &str) -> Vec<Vec<Triangle>> {
    let part = mesh.parts.iter().find(|part| part.material == material);
    let triangles = part.map_or(&[][..], |part| &part.triangles);
    let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn root(parent: &mut [u32], mut node: u32) -> u32 {
        while parent[node as usize] != node {
            parent[node as usize] = parent[parent[node as usize] as usize];
            node = parent[node as usize];
        }
        node
    }
    for [a, b, c] in triangles.iter().map(|t| t.map(|corner| corner.position)) {
        let target = root(&mut parent, a);
        for other in [b, c] {
            let other = root(&mut parent, other);
            parent[other as usize] = target;
        }
    }
    let mut by_root: std::collections::BTreeMap<u32, Vec<Triangle>> = Default::default();
    for triangle in triangles {
        let key = root(&mut parent, triangle[0].position);
        by_root.entry(key).or_default().push(*triangle);
    }
    by_root.into_values().collect()
}
