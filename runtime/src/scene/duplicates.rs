//! What a scene has twice in one place: triangles and placements that agree in all that a picture shows.
//!
//! Of two surfaces in one place a ray meets one, and which is chance. If they are equal, it makes no
//! difference to what is seen, but rays are tested against all of them, and what they emit or let through would
//! count several times in some estimates and once in others. Therefore the first one stays, alone.

use std::collections::BTreeMap;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher, Hash};

use rayon::prelude::*;

use super::mesh::Attributes;
use super::{Labels, Light, Mesh, Placement};

/// Leaves out the triangles of a mesh that are equal to an earlier one: corners, normals, texture
/// coordinates, material, and for those of a light all that is said of it. Returns how many that are.
pub(super) fn remove_triangles(mesh: &mut Mesh, lights: &[Light], labels: &Labels) -> Removed {
    let lights = classes(lights, labels);
    let repeated = repeated(mesh.len(), |triangle| words(mesh, triangle, &lights));
    let mut removed = Removed::default();
    if repeated.is_empty() {
        return removed;
    }
    let mut keep = vec![true; mesh.len()];
    let mut last_light = None;
    for triangle in repeated {
        keep[triangle] = false;
        match mesh.lights.get(triangle).copied().flatten() {
            // The triangles of a light follow each other.
            Some(light) if last_light == Some(light) => {}
            Some(light) => {
                last_light = Some(light);
                removed.lights += 1;
            }
            None => removed.triangles += 1,
        }
    }
    *mesh = mesh.filtered(|triangle| keep[triangle]);
    removed
}

/// How much was left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Removed {
    /// Triangles that belong to no light.
    pub(super) triangles: usize,
    /// Lights with a surface.
    pub(super) lights: usize,
}

/// Leaves out placements of one object by one transform with the same materials; returns how many.
pub(super) fn remove_placements(placements: &mut Vec<Placement>, copies: &mut Vec<u32>) -> usize {
    let words = |index: usize| {
        let placement: &Placement = &placements[index];
        let matrix = placement.transform.matrix.to_cols_array();
        let place = placement.transform.translation.to_array();
        let bits = |numbers: &[f64]| numbers.iter().map(|n| (n + 0.0).to_bits()).collect();
        let transform: [Vec<u64>; 2] = [bits(&matrix), bits(&place)];
        (placement.object, transform, placement.materials.clone())
    };
    let repeated = repeated(placements.len(), words);
    let mut keep = vec![true; placements.len()];
    repeated.iter().for_each(|&index| keep[index] = false);
    let mut kept = keep.iter();
    placements.retain(|_| kept.next() != Some(&false));
    let mut kept = keep.iter();
    copies.retain(|_| kept.next() != Some(&false));
    repeated.len()
}

/// The indices, ascending, of what has the key of something before it.
fn repeated<K: Hash + Eq>(count: usize, key: impl Fn(usize) -> K + Sync) -> Vec<usize> {
    // Hashes that are the same in every run.
    let hasher = BuildHasherDefault::<DefaultHasher>::default();
    let hashed = |index: usize| (hasher.hash_one(key(index)), index as u32);
    let mut hashed: Vec<(u64, u32)> = (0..count).into_par_iter().map(hashed).collect();
    hashed.par_sort_unstable();
    let mut repeated = Vec::new();
    for equal in hashed.chunk_by(|a, b| a.0 == b.0).filter(|c| c.len() > 1) {
        let mut different: Vec<K> = Vec::new();
        for &(_, index) in equal {
            let key = key(index as usize);
            if different.contains(&key) {
                repeated.push(index as usize);
            } else {
                different.push(key);
            }
        }
    }
    repeated.sort_unstable();
    repeated
}

/// For each light a number that those have in common of which the same is said.
fn classes(lights: &[Light], labels: &Labels) -> Vec<u32> {
    let mut known = BTreeMap::new();
    let mut class = |(index, light): (usize, &Light)| {
        let group = labels.lights.get(index).cloned().flatten();
        let next = known.len() as u32;
        *known.entry((format!("{light:?}"), group)).or_insert(next)
    };
    lights.iter().enumerate().map(&mut class).collect()
}

/// All that a picture shows of a triangle. Which corner is the first does not matter.
fn words(mesh: &Mesh, triangle: usize, lights: &[u32]) -> [u32; 42] {
    // Zero has two signs.
    let bits = |value: f32| (value + 0.0).to_bits();
    let corners = mesh.positions[triangle].map(|p| p.to_array().map(bits));
    let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
    let Attributes {
        normals,
        uvs,
        uvs1,
        colors,
    } = mesh.attributes(triangle);
    let mut words = [0; 42];
    for (place, corner) in (0..3).map(|i| (first + i) % 3).enumerate() {
        let normal = normals.map_or([0; 3], |n| n[corner].to_array().map(bits));
        let [x, y, z] = corners[corner];
        let [u, v] = uvs[corner].to_array().map(bits);
        let [u1, v1] = uvs1[corner].to_array().map(bits);
        let [r, g, b] = colors[corner].to_array().map(bits);
        words[13 * place..13 * place + 13].copy_from_slice(&[
            x, y, z, normal[0], normal[1], normal[2], u, v, u1, v1, r, g, b,
        ]);
    }
    let light = mesh.lights.get(triangle).copied().flatten();
    words[39] = mesh.materials[triangle];
    words[40] = light.map_or(0, |light| 1 + lights[light as usize]);
    words[41] = u32::from(normals.is_some());
    words
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Vec2, Vec3};

    use super::*;
    use crate::scene::Transform;

    const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    /// Triangles of these corners and materials.
    fn mesh(triangles: &[([Vec3; 3], u32)]) -> Mesh {
        Mesh {
            positions: triangles.iter().map(|t| t.0).collect(),
            materials: triangles.iter().map(|t| t.1).collect(),
            lights: vec![None; triangles.len()],
            objects: (0..triangles.len() as u32).collect(),
            ..Mesh::default()
        }
    }

    fn left(mut mesh: Mesh) -> Vec<u32> {
        let before = mesh.len();
        let removed = remove_triangles(&mut mesh, &[], &Labels::default());
        assert_eq!(removed.triangles, before - mesh.len());
        mesh.objects
    }

    #[test]
    fn the_first_of_equal_triangles_stays() {
        let [a, b, c] = CORNERS;
        let zero = Vec3::splat(-0.0);
        let moved = [a, b, c + Vec3::splat(f32::MIN_POSITIVE)];
        let triangles = [
            ([a, b, c], 0),
            ([b, c, a], 0),
            ([a, b, c], 1),
            // The other side is the outside.
            ([a, c, b], 0),
            ([zero, b, c], 1),
            (moved, 0),
            ([c, a, b], 0),
        ];
        assert_eq!(left(mesh(&triangles)), [0, 2, 3, 5]);
    }

    #[test]
    fn what_differs_in_normals_or_texture_coordinates_stays() {
        let mut mesh = mesh(&[(CORNERS, 0); 6]);
        let uvs = |u: f32| CORNERS.map(|c| Vec2::new(c.x + u, c.y));
        mesh.uvs = [0.0, 1.0, 0.0, 1.0, 0.0, 0.0].map(uvs).to_vec();
        mesh.normals = vec![None; 6];
        mesh.normals[4] = Some([Vec3::Z; 3]);
        mesh.normals[5] = Some([Vec3::Z; 3]);
        assert_eq!(left(mesh), [0, 1, 4]);
    }

    #[test]
    fn the_first_of_equal_placements_stays() {
        let place = |object: u32, x: f32, material: u32| Placement {
            object,
            transform: Transform::new(Vec3::ONE, Vec3::ZERO, Vec3::new(x, 0.0, 0.0)),
            materials: Arc::from([material]),
            place: 0,
        };
        let mut placements = vec![
            place(0, 1.0, 0),
            place(1, 1.0, 0),
            place(0, 1.0, 0),
            place(0, 2.0, 0),
            place(0, 1.0, 1),
            place(1, 1.0, 0),
        ];
        let kept: Vec<Placement> = [0, 1, 3, 4].map(|i: usize| placements[i].clone()).to_vec();
        let mut copies = vec![0, 0, 1, 2, 3, 1];
        assert_eq!(remove_placements(&mut placements, &mut copies), 2);
        assert_eq!(placements, kept);
        assert_eq!(copies, [0, 0, 2, 3]);
    }
}
