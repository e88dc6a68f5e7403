//! The walk through one tree or two, in the order of `wide.wgsl` and `placed.wgsl`.

use super::lanes::{Lanes, WIDTH};
use super::slabs::{Slabs, safe_inverses};
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
    let directions = [0, 1, 2].map(|axis| L::load(&rays.directions[axis]));
    let lanes = lanes & are_rays::<L>(rays, directions);
    let inverses = directions.map(|d| safe_inverses(d).values());
    let across = Across::new(directions);
    let slabs = |lane: usize| {
        let inverse = inverses.map(|values| values[lane]);
        Slabs::new(rays.origin(lane), rays.direction(lane), inverse)
    };
    let frame = |lane: usize| Frame::<L>::of(rays, &across, lane);
    match &trees.placements {
        None => {
            let leaves = |lane: usize| Triangles::<L, ANY> {
                packets: &trees.packets,
                frame: frame(lane),
                place: None,
                shift: 0,
                skip: rays.skip[lane],
            };
            walk_all::<L, _>(trees, lanes, &mut hits, |lane| (slabs(lane), leaves(lane)));
        }
        Some(placements) => {
            let leaves = |lane: usize| Placements::<L, ANY> {
                trees,
                placements,
                frame: frame(lane),
                origin: rays.origin(lane),
                direction: rays.direction(lane),
                skip: rays.skip[lane],
            };
            walk_all::<L, _>(trees, lanes, &mut hits, |lane| (slabs(lane), leaves(lane)));
        }
    }
    hits
}

/// Bits of those that are rays: what is none would walk all of the tree to hit nothing.
#[inline(always)]
fn are_rays<L: Lanes>(rays: &Rays, directions: [L; 3]) -> u32 {
    let is_finite = |x: L| x.abs().at_most(L::splat(f32::MAX));
    let mut found = L::load(&rays.t_max).above(L::splat(0.0));
    for axis in 0..3 {
        let origin = L::load(&rays.origins[axis]);
        found = L::and(
            found,
            L::and(is_finite(origin), is_finite(directions[axis])),
        );
    }
    L::bits(found)
}

/// Walks the tree for all rays that have a bit, two at a time: a processor tests a node for one while it waits for
/// what the test for the other gives.
#[inline(always)]
fn walk_all<L: Lanes, M: Leaves>(
    trees: &Trees,
    mut lanes: u32,
    hits: &mut Hits,
    begin: impl Fn(usize) -> (Slabs, M),
) {
    let mut shallow = [[(0, 0); SHALLOW]; 2];
    let mut deep = [Vec::new(), Vec::new()];
    let mut stacks = if trees.depth <= SHALLOW {
        shallow.each_mut().map(|stack| &mut stack[..])
    } else {
        deep.each_mut().map(|stack| {
            stack.resize(trees.depth, (0, 0));
            &mut stack[..]
        })
    };
    let mut next = || {
        let lane = lanes.trailing_zeros() as usize % WIDTH;
        let is_left = lanes != 0;
        lanes &= lanes.wrapping_sub(1);
        is_left.then(|| (lane, Walker::new(begin(lane))))
    };
    let Some(mut one) = next() else {
        return;
    };
    while let Some(mut other) = next() {
        // Until one of them ends, whose place the next ray takes.
        loop {
            let [stack, its_stack] = &mut stacks;
            let node = one.1.enter(&trees.nodes, stack);
            let its_node = other.1.enter(&trees.nodes, its_stack);
            let children = L::children(node, &one.1.slabs, hits[one.0].t);
            let its_children = L::children(its_node, &other.1.slabs, hits[other.0].t);
            let ended = one.1.meet(node, children, stack, &mut hits[one.0]);
            let has_ended = other
                .1
                .meet(its_node, its_children, its_stack, &mut hits[other.0]);
            match (ended, has_ended) {
                (false, false) => {}
                (false, true) => break,
                (true, false) => {
                    one = other;
                    stacks.swap(0, 1);
                    break;
                }
                (true, true) => match next() {
                    Some(following) => {
                        one = following;
                        break;
                    }
                    None => return,
                },
            }
        }
    }
    let (lane, walker) = one;
    walker.walk::<L>(&trees.nodes, stacks[0], &mut hits[lane]);
}

/// A ray on its way through a tree.
struct Walker<M> {
    slabs: Slabs,
    leaves: M,
    group: Group,
    stacked: usize,
}

impl<M: Leaves> Walker<M> {
    #[inline(always)]
    fn new((slabs, leaves): (Slabs, M)) -> Self {
        Self::at(0, slabs, leaves)
    }

    /// One that begins at a root.
    #[inline(always)]
    fn at(root: u32, slabs: Slabs, leaves: M) -> Self {
        Self {
            slabs,
            leaves,
            group: (root, 0x8000_0000),
            stacked: 0,
        }
    }

    /// Takes the most urgent node, and stacks what is left of its group.
    #[inline(always)]
    fn enter<'n>(&mut self, nodes: &'n [Node], stack: &mut [Group]) -> &'n Node {
        let bit = 31 - self.group.1.leading_zeros();
        let slot = (bit - 24) ^ self.slabs.octant;
        let node = self.group.0 + (self.group.1 & !(u32::MAX << slot)).count_ones();
        let rest = self.group.1 & !(1 << bit);
        if rest > 0x00ff_ffff {
            stack[self.stacked] = (self.group.0, rest);
            self.stacked += 1;
        }
        &nodes[node as usize]
    }

    /// Meets the children of a node that the ray hits. Is the walk at its end?
    #[inline(always)]
    fn meet(&mut self, node: &Node, children: u32, stack: &mut [Group], hit: &mut Hit) -> bool {
        self.group = (
            node.first_child,
            children & 0xff00_0000 | u32::from(node.inner),
        );
        let bits = children & 0x00ff_ffff;
        let rest = &mut stack[self.stacked..];
        if bits != 0 && self.leaves.meet(node.first_leaf, bits, rest, hit) {
            return true;
        }
        if self.group.1 <= 0x00ff_ffff {
            if self.stacked == 0 {
                return true;
            }
            self.stacked -= 1;
            self.group = stack[self.stacked];
        }
        false
    }

    /// Walks to the end.
    #[inline(always)]
    fn walk<L: Lanes>(mut self, nodes: &[Node], stack: &mut [Group], hit: &mut Hit) {
        loop {
            let node = self.enter(nodes, stack);
            let children = L::children(node, &self.slabs, hit.t);
            if self.meet(node, children, stack, hit) {
                return;
            }
        }
    }
}

/// What a tree has in its leaves.
trait Leaves {
    /// Meets those of a node, from `first` on, that have a bit, the last first. Is the walk at its end?
    fn meet(&mut self, first: u32, bits: u32, stack: &mut [Group], hit: &mut Hit) -> bool;
}

/// Triangles in the world, or of a placement.
struct Triangles<'t, L, const ANY: bool> {
    packets: &'t [Packet],
    frame: Frame<L>,
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
                &self.frame,
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
    frame: Frame<L>,
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
            let leaves = Triangles::<L, ANY> {
                packets: &self.trees.packets,
                frame: self.frame,
                place: Some(Place::new(placement)),
                shift: placement.shift(),
                skip: self.skip,
            };
            let walker = Walker::at(placement.root(), slabs, leaves);
            walker.walk::<L>(&self.trees.nodes, stack, hit);
            if ANY && hit.primitive != NO_PRIMITIVE {
                return true;
            }
        }
        false
    }
}
