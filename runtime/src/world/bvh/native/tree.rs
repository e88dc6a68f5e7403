//! A tree as the processor walks it: the nodes that kernels bind, but the boxes of their children in full, and
//! triangles in packets of eight, coordinate by coordinate, so that one load brings a coordinate of all of them.
//!
//! All that a walk will follow is followed once here, so that it needs no limits of its own.

use bytemuck::{Pod, Zeroable};

use super::NO_PRIMITIVE;
use super::lanes::WIDTH;
use crate::wgsl::ShaderPart;
use crate::world::bvh::references::primitive_of;
use crate::world::bvh::text::{self, SLACK};

/// Words of a placement; see `geometry_placed.wgsl`.
const PLACEMENT_WORDS: usize = 7;

/// A node of `wide.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(16))]
struct Compressed {
    origin: [f32; 3],
    exponents: [u8; 3],
    /// Which children are inner ones.
    inner: u8,
    first_child: u32,
    first_leaf: u32,
    meta: [u8; WIDTH],
    /// The lower and the upper planes of each axis.
    planes: [[[u8; WIDTH]; 2]; 3],
}

/// A node. Bit b of its leaves stands for lane b % 8 of packet b / 8 of its own, or for placement b.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub first_child: u32,
    /// The first of its packets, or of its placements.
    pub first_leaf: u32,
    /// Which children are inner ones.
    pub inner: u8,
    /// The bits of the leaves of each child; none of inner ones.
    pub leaves: [u32; WIDTH],
    pub boxes: Boxes,
}

/// The lower and the upper planes of each axis of a node's children; where there is no child, they are the wrong
/// way round.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub(super) struct Boxes(pub [[[f32; WIDTH]; 2]; 3]);

/// Eight triangles, those that are missing all at the origin.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Packet {
    /// `corners[c][axis]` of all.
    pub corners: [[[f32; WIDTH]; 3]; 3],
    /// The primitive that each is, or that it is a further reference to.
    pub primitives: [u32; WIDTH],
}

/// A placement's words, as floats.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(16))]
pub(super) struct Placement {
    pub rows: [[f32; 4]; PLACEMENT_WORDS],
}

/// Everything that casts read.
pub(super) struct Trees {
    pub nodes: Vec<Node>,
    /// The least and the greatest coordinates by axis.
    pub bounds: [[f32; 2]; 3],
    pub packets: Vec<Packet>,
    /// None if there is one level.
    pub placements: Option<Vec<Placement>>,
    /// Nodes on the longest path, through both levels.
    pub depth: usize,
}

impl Trees {
    /// Of the parts that kernels include; none if these do not have a wide tree, or one that cannot be walked.
    pub(super) fn new(geometry: &ShaderPart, bvh: &ShaderPart) -> Option<Self> {
        if !text::is_wide(bvh) {
            return None;
        }
        let corners: Vec<[[u32; 4]; 3]> = values(geometry, "triangles")?;
        let compressed: Vec<Compressed> = values(bvh, "bvh_nodes")?;
        let mut reader = Reader {
            nodes: vec![Node::default(); compressed.len()],
            seen: vec![false; compressed.len()],
            compressed,
            corners: &corners,
            packets: Vec::new(),
        };
        let Some(placements) = values::<Placement>(geometry, "placements") else {
            let depth = reader.read(0, Leaves::Triangles)?;
            return Some(reader.trees(None, depth));
        };
        let upper = reader.read(0, Leaves::Placements(placements.len()))?;
        let mut roots: Vec<u32> = placements.iter().map(Placement::root).collect();
        roots.sort_unstable();
        roots.dedup();
        let depths = roots
            .iter()
            .map(|&root| reader.read(root, Leaves::Triangles));
        let below = depths.collect::<Option<Vec<_>>>()?.into_iter().max();
        Some(reader.trees(Some(placements), upper + below.unwrap_or(0)))
    }
}

impl Placement {
    pub(super) fn root(&self) -> u32 {
        self.rows[4][3].to_bits()
    }

    /// What primitives exceed their triangles by, modulo 2^32.
    pub(super) fn shift(&self) -> u32 {
        self.rows[3][3].to_bits()
    }

    pub(super) fn is_mirrored(&self) -> bool {
        self.rows[6][3] < 0.0
    }
}

/// The values of a buffer.
fn values<T: Pod>(part: &ShaderPart, name: &str) -> Option<Vec<T>> {
    let buffer = part.buffers.iter().find(|b| b.name == name)?;
    let whole = buffer.bytes.len() / size_of::<T>() * size_of::<T>();
    (whole > 0).then(|| bytemuck::pod_collect_to_vec(&buffer.bytes[..whole]))
}

/// What the leaves of a tree are.
#[derive(Clone, Copy)]
enum Leaves {
    Triangles,
    /// So many of them.
    Placements(usize),
}

/// Follows trees from their roots.
struct Reader<'c> {
    compressed: Vec<Compressed>,
    corners: &'c [[[u32; 4]; 3]],
    seen: Vec<bool>,
    nodes: Vec<Node>,
    packets: Vec<Packet>,
}

impl Reader<'_> {
    /// Nodes on the longest path from `root`; none if a node is out of range or has two parents.
    fn read(&mut self, root: u32, leaves: Leaves) -> Option<usize> {
        let mut deepest = 0;
        let mut waiting = vec![(root, 1)];
        while let Some((index, depth)) = waiting.pop() {
            let seen = self.seen.get_mut(index as usize)?;
            if std::mem::replace(seen, true) {
                return None;
            }
            deepest = deepest.max(depth);
            let compressed = self.compressed[index as usize];
            let node = self.node(&compressed, leaves)?;
            for child in (0..u32::from(node.inner).count_ones()).rev() {
                waiting.push((node.first_child.checked_add(child)?, depth + 1));
            }
            self.nodes[index as usize] = node;
        }
        Some(deepest)
    }

    fn node(&mut self, compressed: &Compressed, leaves: Leaves) -> Option<Node> {
        let leaves_of = compressed.leaves()?;
        let bits = leaves_of.iter().fold(0, |all, bits| all | bits);
        let count = 32 - bits.leading_zeros();
        Some(Node {
            first_child: compressed.first_child,
            first_leaf: self.first_leaf(compressed.first_leaf, count, leaves)?,
            inner: compressed.inner,
            leaves: leaves_of,
            boxes: compressed.boxes(),
        })
    }

    /// Where `count` leaves are now that were at `first`.
    fn first_leaf(&mut self, first: u32, count: u32, leaves: Leaves) -> Option<u32> {
        let end = first.checked_add(count)? as usize;
        match leaves {
            Leaves::Placements(all) => (end <= all).then_some(first),
            Leaves::Triangles if count == 0 => Some(0),
            Leaves::Triangles => {
                let triangles = self.corners.get(first as usize..end)?;
                let packet = self.packets.len() as u32;
                let starts = (first..).step_by(WIDTH);
                let packets = starts.zip(triangles.chunks(WIDTH));
                self.packets
                    .extend(packets.map(|(first, t)| packet_of(first, t)));
                Some(packet)
            }
        }
    }

    fn trees(self, placements: Option<Vec<Placement>>, depth: usize) -> Trees {
        Trees {
            bounds: self.compressed[0].bounds(),
            nodes: self.nodes,
            packets: self.packets,
            placements,
            depth,
        }
    }
}

impl Compressed {
    /// The bits of the leaves of each child; none if they are not as a builder makes them.
    fn leaves(&self) -> Option<[u32; WIDTH]> {
        let mut found = [0; WIDTH];
        for (child, meta) in self.meta.iter().enumerate() {
            let (count, shift) = (u32::from(meta >> 5), u32::from(meta & 31));
            let is_inner = self.inner >> child & 1 == 1;
            // A child that is marked as an inner one has the bit of its slot.
            let is_marked = count == 1 && shift == 24 + child as u32;
            if is_inner != is_marked || !is_inner && count != 0 && shift > 21 {
                return None;
            }
            found[child] = if is_inner { 0 } else { count << shift };
        }
        Some(found)
    }

    /// Builders round exponents, through logarithms, and so planes by some units in the last place of all of the
    /// node: boxes exceed them by as much as those of the WGSL do.
    fn boxes(&self) -> Boxes {
        let mut planes = [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3];
        for (axis, [lower, upper]) in planes.iter_mut().enumerate() {
            let origin = f64::from(self.origin[axis]);
            let step = f64::from(f32::from_bits(u32::from(self.exponents[axis]) << 23));
            let slack = 255.0 * step * f64::from(SLACK);
            let plane = |byte: u8| origin + f64::from(byte) * step;
            for child in (0..WIDTH).filter(|&child| self.meta[child] != 0) {
                let [low, high] = self.planes[axis].map(|planes| planes[child]);
                lower[child] = below(plane(low) - slack);
                upper[child] = -below(-(plane(high) + slack));
            }
        }
        Boxes(planes)
    }

    /// The least and the greatest coordinates by axis.
    fn bounds(&self) -> [[f32; 2]; 3] {
        let Boxes(planes) = self.boxes();
        planes.map(|[lower, upper]| {
            let least = lower.into_iter().fold(f32::INFINITY, f32::min);
            let greatest = upper.into_iter().fold(f32::NEG_INFINITY, f32::max);
            [least, greatest]
        })
    }
}

/// A number of single precision that is not above.
fn below(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x {
        near.next_down()
    } else {
        near
    }
}

fn packet_of(first: u32, triangles: &[[[u32; 4]; 3]]) -> Packet {
    let mut corners = [[[0.0; WIDTH]; 3]; 3];
    let mut primitives = [NO_PRIMITIVE; WIDTH];
    for (lane, (reference, triangle)) in (first..).zip(triangles).enumerate() {
        primitives[lane] = primitive_of(reference, triangle);
        for (to, from) in corners.iter_mut().zip(triangle) {
            for (to, from) in to.iter_mut().zip(from) {
                to[lane] = f32::from_bits(*from);
            }
        }
    }
    Packet {
        corners,
        primitives,
    }
}
