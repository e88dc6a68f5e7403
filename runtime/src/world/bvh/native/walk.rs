//! The walk through one tree or two, each ray in the order of `wide.wgsl` and `placed.wgsl`.
//!
//! Rays take turns: each tests the boxes of a node, then those that have to meet triangles do, then each goes on to
//! its next node, which is asked for before it is needed. A processor that waits for a ray's memory, or has guessed
//! wrong where it goes, works on the others; and the turns have few branches that it could guess wrong.

use std::cell::Cell;

use super::lanes::{Lanes, WIDTH};
use super::slabs::Slabs;
use super::tree::{Placement, Trees};
use super::triangles::{Across, Frame, Place, intersect};
use super::{Hit, NO_PRIMITIVE, Rays};

/// The index of the first inner child of a node; in bits 24..31 those that are still to be visited, most urgent
/// first, and in 0..7 which children are inner ones.
type Group = (u32, u32);

thread_local! {
    /// What a thread keeps for its next cast: what stacks hold at first does not matter, so they are not cleared.
    static STACK: Cell<Vec<Group>> = const { Cell::new(Vec::new()) };
}

/// Of each ray that has a bit in `lanes` the nearest hit, or `ANY`, whichever comes first.
#[inline(always)]
pub(super) fn cast<L: Lanes, const ANY: bool, const N: usize>(
    trees: &Trees,
    rays: &Rays<N>,
    lanes: u32,
) -> [Hit; N] {
    let missed = Hit {
        t: 0.0,
        u: 0.0,
        v: 0.0,
        primitive: NO_PRIMITIVE,
    };
    let mut hits = [missed; N];
    for (hit, t_max) in hits.iter_mut().zip(rays.t_max) {
        hit.t = t_max;
    }
    let lanes = lanes & are_rays(rays);
    let mut stack = STACK.take();
    if stack.len() < N * trees.depth {
        stack.resize(N * trees.depth, (0, 0));
    }
    let slabs = Slabs::new(&trees.bounds, rays);
    let walks = Walks {
        trees,
        placements: trees.placements.as_deref().unwrap_or_default(),
        rays,
        across: Across::new(&rays.directions),
        outside: trees.placements.is_some().then_some(slabs),
        slabs,
        points: [Point::default(); N],
        hits,
        stack: &mut stack,
    };
    let hits = if trees.placements.is_none() {
        walks.finish::<L, ANY, false>(lanes)
    } else {
        walks.finish::<L, ANY, true>(lanes)
    };
    STACK.set(stack);
    hits
}

/// Bits of those that are rays: what is none would walk all of the tree to hit nothing.
#[inline(always)]
fn are_rays<const N: usize>(rays: &Rays<N>) -> u32 {
    let mut are = [0; N];
    for (are, t_max) in are.iter_mut().zip(&rays.t_max) {
        *are = u32::from(*t_max > 0.0);
    }
    for values in rays.origins.iter().chain(&rays.directions) {
        for (are, value) in are.iter_mut().zip(values) {
            *are &= u32::from(value.abs() <= f32::MAX);
        }
    }
    (0..).zip(are).fold(0, |bits, (lane, is)| bits | is << lane)
}

/// Rays on their way.
struct Walks<'w, const N: usize> {
    trees: &'w Trees,
    placements: &'w [Placement],
    rays: &'w Rays<N>,
    across: Across<N>,
    /// The rays in the world, if they go elsewhere.
    outside: Option<Slabs<N>>,
    /// The rays in the space of the tree that each is in.
    slabs: Slabs<N>,
    points: [Point; N],
    hits: [Hit; N],
    /// For each ray as many entries as the trees are deep.
    stack: &'w mut [Group],
}

/// Where a ray is.
#[derive(Clone, Copy, Default)]
struct Point {
    /// The node that it visits next.
    node: u32,
    /// Which of the node's leaves it meets, and where they begin.
    leaves: u32,
    first_leaf: u32,
    /// How many groups are on its stack, and with how many its tree is left.
    stacked: u32,
    floor: u32,
    /// The placement that it is in, if it is in one, and those that it will enter next.
    placement: u32,
    is_inside: bool,
    first_placement: u32,
    next_placements: u32,
}

impl<const N: usize> Walks<'_, N> {
    /// Goes on until all are at their ends. There are two levels if they are `PLACED`.
    #[inline(always)]
    fn finish<L: Lanes, const ANY: bool, const PLACED: bool>(mut self, lanes: u32) -> [Hit; N] {
        let mut walking = lanes;
        while walking != 0 {
            let mut meeting = 0;
            for lane in Ones(walking) {
                meeting |= u32::from(self.visit::<L, PLACED>(lane % N)) << lane;
            }
            for lane in Ones(meeting) {
                let is_hit = self.meet::<L, ANY, PLACED>(lane % N);
                if ANY && is_hit {
                    walking &= !(1 << lane);
                }
            }
            for lane in Ones(walking) {
                if !self.go_on::<L, PLACED>(lane % N) {
                    walking &= !(1 << lane);
                }
            }
        }
        self.hits
    }

    /// Tests the boxes of the next node of a ray. Does it meet triangles there?
    #[inline(always)]
    fn visit<L: Lanes, const PLACED: bool>(&mut self, lane: usize) -> bool {
        let point = &mut self.points[lane];
        let node = &self.trees.nodes[point.node as usize];
        let met = self.slabs.meet::<L>(lane, &node.boxes, self.hits[lane].t);
        let children = L::bits(met) as usize % 256;
        let order = &ORDERS[self.slabs.octants[lane] as usize % 8];
        let visited = order[children & usize::from(node.inner)];
        let group = u32::from(visited) << 24 | u32::from(node.inner);
        self.stack[lane * self.trees.depth + point.stacked as usize] = (node.first_child, group);
        point.stacked += u32::from(visited != 0);
        let leaves = L::united(met, &node.leaves);
        if PLACED && !point.is_inside {
            (point.first_placement, point.next_placements) = (node.first_leaf, leaves);
            point.floor = point.stacked;
            return false;
        }
        (point.first_leaf, point.leaves) = (node.first_leaf, leaves);
        let first = (node.first_leaf + highest(leaves | 1) / WIDTH as u32) as usize;
        if let Some(packet) = self.trees.packets.get(first) {
            L::prefetch(packet);
        }
        leaves != 0
    }

    /// Tests triangles, the last first, and of `ANY` no more than it takes. Is there a hit that is nearer than before?
    #[inline(always)]
    fn meet<L: Lanes, const ANY: bool, const PLACED: bool>(&mut self, lane: usize) -> bool {
        let point = &self.points[lane];
        let frame = Frame::<L>::of(self.rays, &self.across, lane);
        let placement = PLACED.then(|| &self.placements[point.placement as usize]);
        let place = placement.map(Place::new);
        let shift = placement.map_or(0, Placement::shift);
        let (skip, hit) = (self.rays.skip[lane], &mut self.hits[lane]);
        let mut rest = point.leaves;
        let mut is_hit = false;
        while rest != 0 {
            let packet = highest(rest) / WIDTH as u32;
            let at = packet * WIDTH as u32;
            let bits = rest >> at;
            rest &= !(u32::MAX << at);
            let packet = &self.trees.packets[(point.first_leaf + packet) as usize];
            is_hit |= intersect(packet, place.as_ref(), shift, bits, &frame, skip, hit);
            if ANY && is_hit {
                return true;
            }
        }
        is_hit
    }

    /// Finds the next node of a ray, if there is one.
    #[inline(always)]
    fn go_on<L: Lanes, const PLACED: bool>(&mut self, lane: usize) -> bool {
        let point = &mut self.points[lane];
        if PLACED && point.stacked == point.floor && point.next_placements != 0 {
            let bit = highest(point.next_placements);
            point.next_placements &= !(1 << bit);
            point.placement = point.first_placement + bit;
            point.is_inside = true;
            let placement = &self.placements[point.placement as usize];
            let (origin, direction) = (self.rays.origin(lane), self.rays.direction(lane));
            let slabs = Slabs::within(placement, origin, direction);
            self.slabs.set(lane, &slabs, 0);
            point.node = placement.root();
            L::prefetch(&self.trees.nodes[point.node as usize]);
            return true;
        }
        if point.stacked == 0 {
            return false;
        }
        if PLACED && point.is_inside && point.stacked == point.floor {
            point.is_inside = false;
            point.floor = 0;
            if let Some(outside) = &self.outside {
                self.slabs.set(lane, outside, lane);
            }
        }
        let top = &mut self.stack[lane * self.trees.depth + point.stacked as usize - 1];
        let (first_child, group) = *top;
        let bit = highest(group);
        let slot = (bit - 24) ^ self.slabs.octants[lane];
        point.node = first_child + (group & !(u32::MAX << slot)).count_ones();
        L::prefetch(&self.trees.nodes[point.node as usize]);
        top.1 = group & !(1 << bit);
        point.stacked -= u32::from(top.1 <= 0x00ff_ffff);
        true
    }
}

/// The numbers of the bits that are set.
struct Ones(u32);

impl Iterator for Ones {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let bits = self.0;
        self.0 &= bits.wrapping_sub(1);
        (bits != 0).then(|| bits.trailing_zeros() as usize)
    }
}

/// The number of the highest bit that is set.
#[inline(always)]
fn highest(bits: u32) -> u32 {
    31 - bits.leading_zeros()
}

/// By octant and bits of slots: the same bits in the order of visiting, the most urgent highest.
static ORDERS: [[u8; 256]; 8] = orders();

const fn orders() -> [[u8; 256]; 8] {
    let mut orders = [[0; 256]; 8];
    let mut at = 0;
    while at < 8 * 256 * 8 {
        let (octant, slots, slot) = (at / 2048, at / 8 % 256, at % 8);
        orders[octant][slots] |= ((slots >> slot & 1) << (slot ^ octant)) as u8;
        at += 1;
    }
    orders
}
