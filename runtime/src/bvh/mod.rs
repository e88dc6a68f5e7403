//! The acceleration structure of ray casts: an eight-wide compressed BVH.
//!
//! obvhs builds it; `kernels/bvh.wgsl` traverses it. Triangles are stored in the order of the
//! leaves, so that a leaf is a contiguous range and a *primitive* is an index in that order.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;

use crate::scene::Mesh;
use crate::shader_part::{BufferData, ShaderPart};
use crate::wgsl;

/// The builder's settings. Which of several triangles at one distance a ray hits depends on
/// them, and so do pictures: never change them by what a scene looks like.
const PRESET: BvhBuildParams = BvhBuildParams::medium_build();

/// How much slabs are widened, relative to the terms of a plane's distance: 16 units in the last
/// place. The builder rounds exponents by up to 11 of them (through `log2`), the kernel by 2.
const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// A BVH over the triangles of a mesh.
#[derive(Clone, Debug)]
pub struct Bvh {
    tree: CwBvh,
    depth: usize,
}

impl Bvh {
    /// Builds the tree. Equal meshes give equal trees.
    pub fn build(mesh: &Mesh) -> Bvh {
        let boxes: Vec<Aabb> = mesh.positions.iter().map(bounds).collect();
        let indices = (0..boxes.len() as u32).collect();
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PRESET.ploc_search_distance,
            &boxes,
            indices,
            PRESET.sort_precision,
            PRESET.search_depth_threshold,
        );
        let batch_ratio = PRESET.reinsertion_batch_ratio;
        ReinsertionOptimizer::default().run(&mut binary, batch_ratio, None);
        let leaf_size = PRESET.max_prims_per_leaf.clamp(1, 3);
        let tree = bvh2_to_cwbvh(&binary, leaf_size, true, false);
        let depth = depth(&tree);
        Bvh { tree, depth }
    }

    /// For each primitive, the index of its triangle in the mesh.
    pub fn order(&self) -> &[u32] {
        &self.tree.primitive_indices
    }

    /// Number of nodes on the longest path from the root, which bounds the traversal stack:
    /// each node on the way leaves at most one entry, the rest of its children.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// `trace_closest` and `trace_any`; needs the geometry part.
    pub fn part(&self) -> ShaderPart {
        let constants = [
            wgsl::constant_u32("BVH_STACK_SIZE", self.depth as u32),
            wgsl::constant_f32("BVH_SLACK", SLACK),
        ];
        ShaderPart {
            wgsl: constants.concat() + include_str!("../kernels/bvh.wgsl"),
            buffers: vec![BufferData::new(
                "bvh_nodes",
                "array<vec4<u32>>",
                &self.tree.nodes,
            )],
        }
    }
}

fn bounds(corners: &[glam::Vec3; 3]) -> Aabb {
    let [a, b, c] = corners.map(Vec3A::from);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

/// Nodes on the longest path; children always come after their parent.
fn depth(tree: &CwBvh) -> usize {
    let mut depths = vec![1; tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        for child in 0..node.imask.count_ones() {
            depths[(node.child_base_idx + child) as usize] = depths[index] + 1;
        }
    }
    depths.into_iter().max().unwrap_or(1)
}
