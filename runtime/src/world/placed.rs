//! The shader parts of a scene with placed objects, which take the place of those in `surface`:
//! the same functions, for primitives that stand for a triangle of a placement.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::places::{Places, Reads};
use super::split::Split;
use super::surface::{Corners, GEOMETRY, colors_buffer, normals_buffer, uvs_buffer, uvs1_buffer};
use crate::error::SceneError;
use crate::scene::{Mesh, NO_MATERIAL, Placement, Scene, Transform};
use crate::technique::Technique;
use crate::wgsl;
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::bvh::{self, Levels, ObjectTree, Trees};
use crate::world::lights::NO_LIGHT;

/// The largest number that may stand for a primitive, and the one that leaves room for
/// rounding up blocks generously.
const MAX_PRIMITIVES: u64 = u32::MAX as u64 - 1;
const AMPLE_PRIMITIVES: u64 = 1 << 31;

/// Everything that is placed, the world's own triangles included, which are where they are.
pub struct Placed<'s> {
    meshes: Vec<&'s Mesh>,
    placements: Vec<Placement>,
    levels: Levels,
    blocks: Blocks,
    bounds: [Vec3; 2],
    has_world: bool,
}

impl<'s> Placed<'s> {
    /// The trees and tables of `split`, whose scene binds `materials` materials.
    ///
    /// # Errors
    /// There are more triangles than primitives can be told apart.
    pub fn build(
        split: &'s Split,
        materials: usize,
        technique: &Technique,
        trees: &Trees,
    ) -> Result<Placed<'s>, SceneError> {
        let has_world = !split.world.is_empty();
        let world = has_world.then_some(&*split.world).into_iter();
        let meshes: Vec<&Mesh> = world.chain(split.objects.iter().map(|o| &**o)).collect();
        let shift = u32::from(has_world);
        let at_home = Placement {
            object: 0,
            transform: Transform::default(),
            materials: (0..materials as u32).chain([NO_MATERIAL]).collect(),
            place: 0,
        };
        let others = split.placements.iter().cloned().map(|p| Placement {
            object: p.object + shift,
            transform: p.transform.rounded(),
            ..p
        });
        let at_home = has_world.then_some(at_home).into_iter();
        let placements: Vec<Placement> = at_home.chain(others).collect();
        let places: Vec<(usize, Transform)> = placements
            .iter()
            .map(|p| (p.object as usize, p.transform))
            .collect();
        let levels = Levels::build(&meshes, &places, technique, trees);
        let objects = levels.objects();
        let sizes = placements
            .iter()
            .map(|p| objects[p.object as usize].order.len() as u64);
        let blocks = Blocks::new(&sizes.collect::<Vec<_>>()).ok_or_else(too_many)?;
        Ok(Placed {
            levels,
            meshes,
            placements,
            blocks,
            bounds: split.bounds,
            has_world,
        })
    }

    /// The trees.
    pub fn levels(&self) -> &Levels {
        &self.levels
    }

    /// How many references there are to triangles.
    pub fn references(&self) -> u64 {
        let objects = self.levels.objects().iter();
        objects.map(|tree| tree.order.len() as u64).sum()
    }

    /// For each of the first references the triangle of the world that it is to.
    pub fn world_order(&self) -> &[u32] {
        match self.levels.objects().first() {
            Some(world) if self.has_world => &world.order,
            _ => &[],
        }
    }

    /// `triangle_vertices`, `primitive_instance` and so on; `lights` gives the index in the light
    /// table of each triangle of the world, `media` the word of each instance's medium, or
    /// nothing where paths follow none.
    pub fn geometry_part(&self, lights: &[u32], media: &[u32]) -> ShaderPart {
        let table = MaterialTable::new(&self.placements);
        ShaderPart {
            wgsl: wgsl::constant_u32("BLOCK_SHIFT", self.blocks.shift)
                + &GEOMETRY.wgsl(&[("placed", true)])
                + include_str!("geometry_placed.wgsl"),
            buffers: vec![
                self.triangles(lights),
                self.rows(&table),
                table.buffer(media),
                self.block_table(),
            ],
        }
    }

    /// What corners have beside positions, left out unless code reads it.
    pub(super) fn corners(&self, reads: Reads) -> Corners {
        let any = |has: fn(&Mesh) -> bool| self.meshes.iter().any(|mesh| has(mesh));
        let normals = || {
            let of_triangle = self.gather(|mesh, t| mesh.normals.get(t).copied().flatten());
            normals_buffer(of_triangle)
        };
        let uvs = || {
            let of_triangle = self.gather(|mesh, t| mesh.uvs.get(t).copied().unwrap_or_default());
            uvs_buffer(of_triangle)
        };
        let uvs1 = || {
            let of_triangle = self.gather(|mesh, t| mesh.uvs1.get(t).copied().unwrap_or_default());
            uvs1_buffer(of_triangle)
        };
        let colors = || colors_buffer(self.gather(Mesh::colors_of));
        Corners {
            bounds: self.bounds,
            origin: DVec3::ZERO,
            placed: true,
            triangles: self.gather(|_, _| ()).count(),
            normals: any(|m| !m.normals.is_empty()).then(normals),
            uvs: (reads.uvs && any(|m| !m.uvs.is_empty())).then(uvs),
            uvs1: (reads.uvs1 && any(|m| !m.uvs1.is_empty())).then(uvs1),
            colors: (reads.colors && any(|m| !m.colors.is_empty())).then(colors),
            places: None,
        }
    }

    /// The places of what is placed in `scene`.
    pub(super) fn places(&self, scene: &Scene) -> Places {
        let world = self.meshes.first().filter(|_| self.has_world);
        let object = |t: &u32| {
            let of_world = world.and_then(|mesh| mesh.objects.get(*t as usize));
            of_world.copied().unwrap_or(0)
        };
        let at_home = |index: u32| self.has_world && index == 0;
        let place = |index: &u32| {
            let placement = &self.placements[*index as usize];
            (!at_home(*index)).then_some(placement.place)
        };
        let triangles = self.world_order().iter().map(object);
        Places::new(scene, triangles, self.levels.order().iter().map(place))
    }

    /// Which object a primitive is of; the parts of the placements that are no world begin with
    /// `first_objects`.
    pub fn objects_part(&self, first_objects: &[u32]) -> ShaderPart {
        let triangles = self.gather(|mesh, t| mesh.objects.get(t).copied().unwrap_or(0));
        let triangles: Vec<u32> = triangles.collect();
        let others = usize::from(self.has_world);
        let first = |index: u32| match (index as usize).checked_sub(others) {
            Some(index) => first_objects.get(index).copied().unwrap_or(0),
            None => 0,
        };
        let placements: Vec<u32> = self.levels.order().iter().map(|&i| first(i)).collect();
        ShaderPart {
            wgsl: include_str!("objects_placed.wgsl").to_owned(),
            buffers: vec![
                BufferData::new("triangle_objects", "array<u32>", &triangles),
                BufferData::new("placement_objects", "array<u32>", &placements),
            ],
        }
    }

    /// Something of the triangle of every reference, in the order of all.
    fn gather<T>(&self, of: impl Fn(&'s Mesh, usize) -> T) -> impl Iterator<Item = T> {
        let objects = self.meshes.iter().zip(self.levels.objects());
        let each = objects.flat_map(|(mesh, tree)| tree.order.iter().map(|&t| (*mesh, t as usize)));
        each.map(move |(mesh, triangle)| of(mesh, triangle))
    }

    /// Of every reference the one that is its triangle's primitive, in the order of all.
    fn gather_primitives(&self) -> impl Iterator<Item = u32> {
        let objects = self.meshes.iter().zip(self.levels.objects());
        objects.flat_map(|(mesh, tree)| {
            let primitives = bvh::primitives(&tree.order, mesh.len());
            let of_triangle = move |&t: &u32| tree.first_triangle + primitives[t as usize];
            tree.order.iter().map(of_triangle)
        })
    }

    fn triangles(&self, lights: &[u32]) -> BufferData {
        let nothing = self.placements.first().map_or(0, |p| p.materials.len()) as u32;
        let world = self.meshes.first().filter(|_| self.has_world);
        let primitives = self.gather_primitives();
        let triangles = self.gather(|mesh, t| (mesh, t));
        let rows = (0..).zip(triangles).zip(primitives);
        let rows = rows.map(|((reference, (mesh, t)), primitive)| {
            let at_home = world.is_some_and(|world| std::ptr::eq(*world, mesh));
            let light = if at_home { lights[t] } else { NO_LIGHT };
            let light = bvh::light_word(reference, primitive, light);
            let material = match mesh.materials[t] {
                // The last row of the world's.
                NO_MATERIAL => nothing.saturating_sub(1),
                material => material,
            };
            let extra = [material, light, 0];
            [0, 1, 2].map(|k| {
                let [x, y, z] = mesh.positions[t][k].to_array().map(f32::to_bits);
                [x, y, z, extra[k]]
            })
        });
        let rows: Vec<[[u32; 4]; 3]> = rows.collect();
        BufferData::new("triangles", "array<vec4<u32>>", &rows)
    }

    fn rows(&self, table: &MaterialTable) -> BufferData {
        let reaches: Vec<DVec3> = self.meshes.iter().map(|m| farthest(m)).collect();
        let rows = self.levels.order().iter().map(|&index| {
            let placement = &self.placements[index as usize];
            let object = placement.object as usize;
            let tree = &self.levels.objects()[object];
            let first = self.blocks.first[index as usize];
            row(
                placement,
                tree,
                reaches[object],
                first,
                table.first(placement),
            )
        });
        let rows: Vec<[[u32; 4]; 7]> = rows.collect();
        BufferData::new("placements", "array<vec4<u32>>", &rows)
    }

    fn block_table(&self) -> BufferData {
        let mut rows = vec![0u32; self.levels.order().len()];
        for (row, &index) in (0..).zip(self.levels.order()) {
            rows[index as usize] = row;
        }
        let table: Vec<u32> = (self.blocks.counts.iter().zip(&rows))
            .flat_map(|(&count, &row)| std::iter::repeat_n(row, count as usize))
            .collect();
        BufferData::new("placement_blocks", "array<u32>", &table)
    }
}

/// The words of a placement; see `geometry_placed.wgsl`.
fn row(
    placement: &Placement,
    tree: &ObjectTree,
    farthest: DVec3,
    first: u32,
    materials: u32,
) -> [[u32; 4]; 7] {
    let Transform {
        matrix,
        translation,
    } = placement.transform;
    let inverse = matrix.inverse();
    let bits = |v: DVec3, word: u32| {
        let [x, y, z] = v.as_vec3().to_array().map(f32::to_bits);
        [x, y, z, word]
    };
    let ends = matrix.abs() * farthest + translation.abs();
    let extent = (ends.length() as f32).max(f32::MIN_POSITIVE);
    let signed = if placement.transform.is_mirrored() {
        -extent
    } else {
        extent
    };
    let place = translation.as_vec3().to_array().map(f32::to_bits);
    [
        bits(matrix.row(0), place[0]),
        bits(matrix.row(1), place[1]),
        bits(matrix.row(2), place[2]),
        bits(inverse.row(0), first.wrapping_sub(tree.first_triangle)),
        bits(inverse.row(1), tree.root),
        bits(inverse.row(2), materials),
        bits(DMat3::abs(&inverse) * DVec3::ONE, signed.to_bits()),
    ]
}

/// The largest magnitude of each coordinate.
fn farthest(mesh: &Mesh) -> DVec3 {
    let corners = mesh.positions.iter().flatten();
    corners.fold(Vec3::ZERO, |m, p| m.max(p.abs())).as_dvec3()
}

/// The lists of materials that placements have, each once, one after the other.
struct MaterialTable {
    firsts: BTreeMap<Arc<[u32]>, u32>,
    rows: Vec<u32>,
}

impl MaterialTable {
    fn new(placements: &[Placement]) -> MaterialTable {
        let mut table = MaterialTable {
            firsts: BTreeMap::new(),
            rows: Vec::new(),
        };
        for list in placements.iter().map(|p| &p.materials) {
            if !table.firsts.contains_key(list) {
                let first = table.rows.len() as u32;
                table.firsts.insert(Arc::clone(list), first);
                table.rows.extend(list.iter());
            }
        }
        table
    }

    fn first(&self, placement: &Placement) -> u32 {
        self.firsts.get(&placement.materials).copied().unwrap_or(0)
    }

    /// Instance and word of the medium.
    fn buffer(&self, media: &[u32]) -> BufferData {
        let medium = |instance: u32| media.get(instance as usize).copied().unwrap_or(0);
        let rows: Vec<[u32; 2]> = self.rows.iter().map(|&i| [i, medium(i)]).collect();
        BufferData::new("placement_materials", "array<vec2<u32>>", &rows)
    }
}

/// Which numbers stand for the triangles of which placement: whole blocks of them, so that a
/// small table finds the placement.
#[derive(Debug, PartialEq, Eq)]
struct Blocks {
    /// A block has 2^shift numbers.
    shift: u32,
    /// Blocks of each placement.
    counts: Vec<u64>,
    /// The first number of each placement.
    first: Vec<u32>,
}

impl Blocks {
    /// The largest blocks that leave half of all numbers unused, or else those that fit. `None`
    /// if there are not enough numbers.
    fn new(sizes: &[u64]) -> Option<Blocks> {
        let numbers = |shift: u32| {
            let rounded = sizes
                .iter()
                .map(|size| u128::from(size.div_ceil(1 << shift)) << shift);
            rounded.sum::<u128>()
        };
        let largest = |limit: u64| (0..=31).rev().find(|&s| numbers(s) <= u128::from(limit));
        let shift = largest(AMPLE_PRIMITIVES).or_else(|| largest(MAX_PRIMITIVES))?;
        let counts: Vec<u64> = sizes.iter().map(|s| s.div_ceil(1 << shift)).collect();
        let first = counts.iter().scan(0u64, |next, count| {
            let first = *next;
            *next += count << shift;
            Some(first as u32)
        });
        Some(Blocks {
            shift,
            first: first.collect(),
            counts,
        })
    }
}

fn too_many() -> SceneError {
    SceneError::new("the scene's placements have more than 2^32 triangles in all")
        .hint("place fewer or coarser objects")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_room_for_all_and_more_than_there_are_is_an_error() {
        let blocks = Blocks::new(&[1000, 1, 70_000]).expect("they fit");
        assert!(blocks.shift >= 17, "one block each: {blocks:?}");
        assert_eq!(blocks.counts, [1; 3]);
        for (sizes, fits) in [
            (vec![100_000; 10_000], true),
            (vec![100_000; 42_949], true),
            (vec![100_000; 42_950], false),
            (vec![u64::from(u32::MAX) - 1], true),
            (vec![u64::from(u32::MAX)], false),
            (vec![1; 1 << 20], true),
        ] {
            let Some(blocks) = Blocks::new(&sizes) else {
                assert!(!fits, "{} placements", sizes.len());
                continue;
            };
            assert!(fits, "{} placements", sizes.len());
            let ends = sizes.iter().zip(&blocks.first);
            let mut end = 0;
            for (size, &first) in ends {
                assert!(u64::from(first) >= end && first & ((1 << blocks.shift) - 1) == 0);
                end = u64::from(first) + size;
            }
            assert!(end <= MAX_PRIMITIVES);
        }
    }
}
