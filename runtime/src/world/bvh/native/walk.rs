//! The walk through one tree or two, in the order of `wide.wgsl` and `placed.wgsl`.

use super::lanes::{Lanes, WIDTH};
use super::slabs::{Slabs, safe_inverse};
use super::tree::{Node, Packet, Placement, Trees};
use super::triangles::{Across, Frame, Place, intersect};
use super::{Hit, Hits, NO_PRIMITIVE, Rays};

/// Entries of a stack for trees that are not unusually deep.
const SHALLOW: usize = 64;

/// The index of the first inner child of a node; in bits 24..31 those that are still to be visited, most urgent
/// first, and in 0..7 which children are inner ones.
type Group = (u32, u32);

/// Of each ray that has a bit in `lanes` the nearest hit, or `ANY`, whichever comes first.
#[inline(always)]
pub(super) fn cast<L: Lanes, const ANY: bool>(trees: &Trees, rays: &Rays, lanes: u32) -> Hits {
    let mut hits = rays.t_max.map(|t| Hit {
        t,
        u: 0.0,
        v: 0.0,
        primitive: NO_PRIMITIVE,
    });
    let [x, y, z] = &rays.directions;
    let directions = [L::load(x), L::load(y), L::load(z)];
    let mut lanes = lanes & are_rays::<L>(rays, directions);
    let inverses = rays.directions.map(|values| values.map(safe_inverse));
    let across = Across::new(directions);
    let mut shallow = [(0, 0); SHALLOW];
    let mut deep = Vec::new();
    let stack = if trees.depth <= SHALLOW {
        &mut shallow[..]
    } else {
        deep.resize(trees.depth, (0, 0));
        &mut deep[..]
    };
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize % WIDTH;
        lanes &= lanes - 1;
        let (origin, direction) = (rays.origin(lane), rays.direction(lane));
        let inverse = inverses.map(|values| values[lane]);
        let slabs = Slabs::new(origin, direction, inverse);
        let frame = Frame::<L>::of(rays, &across, lane);
        let (skip, hit) = (rays.skip[lane], &mut hits[lane]);
        match &trees.placements {
            None => {
                let mut leaves = Triangles::<L, ANY> {
                    packets: &trees.packets,
                    frame: &frame,
                    place: None,
                    shift: 0,
                    skip,
                };
                walk::<L, _>(&trees.nodes, 0, &slabs, stack, hit, &mut leaves);
            }
            Some(placements) => {
                let mut leaves = Placements::<L, ANY> {
                    trees,
                    placements,
                    frame: &frame,
                    origin,
                    direction,
                    skip,
                };
                walk::<L, _>(&trees.nodes, 0, &slabs, stack, hit, &mut leaves);
            }
        }
    }
    hits
}

/// Bits of those that are rays: what is none would walk all of the tree to hit nothing.
#[inline(always)]
fn are_rays<L: Lanes>(rays: &Rays, directions: [L; 3]) -> u32 {
    let is_finite = |x: L| x.abs().at_most(L::splat(f32::MAX));
    let mut found = L::load(&rays.t_max).above(L::splat(0.0));
    for (origins, direction) in rays.origins.iter().zip(directions) {
        let origin = L::load(origins);
        found = L::and(found, L::and(is_finite(origin), is_finite(direction)));
    }
    L::bits(found)
}

/// What a tree has in its leaves.
trait Leaves {
    /// Meets those of a node, from `first` on, that have a bit, the last first. Is the walk at its end?
    fn meet(&mut self, first: u32, bits: u32, stack: &mut [Group], hit: &mut Hit) -> bool;
}

/// Walks the tree below `root`. Did its leaves end it?
#[inline(always)]
fn walk<L: Lanes, M: Leaves>(
    nodes: &[Node],
    root: u32,
    slabs: &Slabs,
    stack: &mut [Group],
    hit: &mut Hit,
    leaves: &mut M,
) -> bool {
    let mut stacked = 0;
    let mut group: Group = (root, 0x8000_0000);
    loop {
        let bit = 31 - group.1.leading_zeros();
        let slot = (bit - 24) ^ slabs.octant;
        let node = group.0 + (group.1 & !(u32::MAX << slot)).count_ones();
        let rest = group.1 & !(1 << bit);
        if rest > 0x00ff_ffff {
            stack[stacked] = (group.0, rest);
            stacked += 1;
        }
        let node = &nodes[node as usize];
        let hits = L::children(node, slabs, hit.t);
        group = (node.first_child, hits & 0xff00_0000 | u32::from(node.inner));
        let bits = hits & 0x00ff_ffff;
        if bits != 0 && leaves.meet(node.first_leaf, bits, &mut stack[stacked..], hit) {
            return true;
        }
        if group.1 <= 0x00ff_ffff {
            if stacked == 0 {
                return false;
            }
            stacked -= 1;
            group = stack[stacked];
        }
    }
}

/// Triangles in the world, or of a placement.
struct Triangles<'t, L, const ANY: bool> {
    packets: &'t [Packet],
    frame: &'t Frame<L>,
    place: Option<Place<L>>,
    shift: u32,
    skip: u32,
}

impl<L: Lanes, const ANY: bool> Leaves for Triangles<'_, L, ANY> {
    #[inline(always)]
    fn meet(&mut self, first: u32, bits: u32, _: &mut [Group], hit: &mut Hit) -> bool {
        let mut rest = bits;
        while rest != 0 {
            let packet = (31 - rest.leading_zeros()) / WIDTH as u32;
            let at = packet * WIDTH as u32;
            let lanes = rest >> at;
            rest &= !(u32::MAX << at);
            let found = intersect(
                &self.packets[(first + packet) as usize],
                self.place.as_ref(),
                self.shift,
                lanes,
                self.frame,
                self.skip,
                hit,
            );
            if ANY && found {
                return true;
            }
        }
        false
    }
}

/// Placements, each with a tree of its own.
struct Placements<'t, L, const ANY: bool> {
    trees: &'t Trees,
    placements: &'t [Placement],
    frame: &'t Frame<L>,
    origin: [f32; 3],
    direction: [f32; 3],
    skip: u32,
}

impl<L: Lanes, const ANY: bool> Leaves for Placements<'_, L, ANY> {
    #[inline(always)]
    fn meet(&mut self, first: u32, bits: u32, stack: &mut [Group], hit: &mut Hit) -> bool {
        let mut rest = bits;
        while rest != 0 {
            let bit = 31 - rest.leading_zeros();
            rest &= !(1 << bit);
            let placement = &self.placements[(first + bit) as usize];
            let slabs = Slabs::within(placement, self.origin, self.direction);
            let mut leaves = Triangles::<L, ANY> {
                packets: &self.trees.packets,
                frame: self.frame,
                place: Some(Place::new(placement)),
                shift: placement.shift(),
                skip: self.skip,
            };
            let nodes = &self.trees.nodes;
            if walk::<L, _>(nodes, placement.root(), &slabs, stack, hit, &mut leaves) {
                return true;
            }
        }
        false
    }
}
