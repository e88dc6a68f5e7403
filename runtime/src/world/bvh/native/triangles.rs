//! The triangle test of `triangle.wgsl`, of a packet at once.

use super::lanes::{Lanes, WIDTH};
use super::tree::{Packet, Placement};
use super::{Hit, Rays};

type Vector<L> = [L; 3];

/// The frame of a ray, in every lane the same.
#[derive(Clone, Copy)]
pub(super) struct Frame<L> {
    origin: Vector<L>,
    x: Vector<L>,
    y: Vector<L>,
    z: Vector<L>,
}

impl<L: Lanes> Frame<L> {
    /// Of the ray of a lane.
    #[inline(always)]
    pub(super) fn of<const N: usize>(rays: &Rays<N>, across: &Across<N>, lane: usize) -> Self {
        Self {
            origin: splat(rays.origin(lane)),
            x: splat(across.x.map(|values| values[lane])),
            y: splat(across.y.map(|values| values[lane])),
            z: splat(rays.direction(lane)),
        }
    }

    /// Where points, given from the ray's origin, lie across the ray.
    #[inline(always)]
    fn project(&self, point: Vector<L>) -> [L; 2] {
        [dot(self.x, point), dot(self.y, point)]
    }
}

/// The first two axes of the frames of rays.
pub(super) struct Across<const N: usize> {
    x: [[f32; N]; 3],
    y: [[f32; N]; 3],
}

impl<const N: usize> Across<N> {
    /// `frame_from_z` of the WGSL, whose order of operations this has.
    #[inline(always)]
    pub(super) fn new(directions: &[[f32; N]; 3]) -> Self {
        let mut this = Self {
            x: [[0.0; N]; 3],
            y: [[0.0; N]; 3],
        };
        let [x, y, z] = directions;
        for (lane, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
            let side = if *z >= 0.0 { 1.0 } else { -1.0 };
            let a = -1.0 / (side + z);
            let b = x * y * a;
            this.x[0][lane] = 1.0 + side * x * x * a;
            this.x[1][lane] = side * b;
            this.x[2][lane] = -side * x;
            this.y[0][lane] = b;
            this.y[1][lane] = side + y * y * a;
            this.y[2][lane] = -y;
        }
        this
    }
}

/// A placement's matrix, in every lane the same.
pub(super) struct Place<L> {
    rows: [[L; 4]; 3],
    is_mirrored: bool,
}

impl<L: Lanes> Place<L> {
    #[inline(always)]
    pub(super) fn new(placement: &Placement) -> Self {
        let [x, y, z, ..] = placement.rows;
        Self {
            rows: [row(x), row(y), row(z)],
            is_mirrored: placement.is_mirrored(),
        }
    }

    #[inline(always)]
    fn triangles(&self, [a, b, c]: [Vector<L>; 3]) -> [Vector<L>; 3] {
        let (b, c) = if self.is_mirrored { (c, b) } else { (b, c) };
        [self.point(a), self.point(b), self.point(c)]
    }

    #[inline(always)]
    fn point(&self, p: Vector<L>) -> Vector<L> {
        let [x, y, z] = self.rows;
        [plane(x, p), plane(y, p), plane(z, p)]
    }
}

/// Tests the triangles of a packet that have a bit in `lanes`, the last first, and keeps the nearest hit.
/// Primitives are `shift` more than those of the packet. Is there a hit that is nearer than before?
#[inline(always)]
pub(super) fn intersect<L: Lanes>(
    packet: &Packet,
    place: Option<&Place<L>>,
    shift: u32,
    lanes: u32,
    frame: &Frame<L>,
    skip: u32,
    hit: &mut Hit,
) -> bool {
    let [a, b, c] = &packet.corners;
    let corners = [load(a), load(b), load(c)];
    let corners = match place {
        Some(place) => place.triangles(corners),
        None => corners,
    };
    let [a, b, c] = corners;
    let from_a = subtract(a, frame.origin);
    let from_b = subtract(b, frame.origin);
    let from_c = subtract(c, frame.origin);
    let a = frame.project(from_a);
    let b = frame.project(from_b);
    let c = frame.project(from_c);
    let weights = [edge_side(b, c), edge_side(c, a), edge_side(a, b)];
    let zero = L::splat(0.0);
    let [x, y, z] = weights;
    let left = L::and(L::and(x.at_least(zero), y.at_least(zero)), z.at_least(zero));
    let right = L::and(L::and(x.at_most(zero), y.at_most(zero)), z.at_most(zero));
    let sum = x.add(y).add(z);
    let inside = L::and(L::or(left, right), sum.abs().above(L::splat(1e-37)));
    let lanes = L::bits(inside) & lanes;
    if lanes == 0 {
        return false;
    }
    let barycentric = [x.div(sum), y.div(sum), z.div(sum)];
    let depths = [
        dot(frame.z, from_a),
        dot(frame.z, from_b),
        dot(frame.z, from_c),
    ];
    let t = dot(barycentric, depths);
    let nearer = L::and(t.above(zero), t.below(L::splat(hit.t)));
    let mut lanes = L::bits(nearer) & lanes;
    if lanes == 0 {
        return false;
    }
    let (t, u, v) = (t.values(), barycentric[1].values(), barycentric[2].values());
    let mut is_hit = false;
    while lanes != 0 {
        let lane = (31 - lanes.leading_zeros()) as usize % WIDTH;
        lanes &= !(1 << lane);
        let primitive = packet.primitives[lane].wrapping_add(shift);
        if t[lane] < hit.t && primitive != skip {
            *hit = Hit {
                t: t[lane],
                u: u[lane],
                v: v[lane],
                primitive,
            };
            is_hit = true;
        }
    }
    is_hit
}

/// See `edge_side` of the WGSL, whose order of operations this has.
#[inline(always)]
fn edge_side<L: Lanes>(p: [L; 2], q: [L; 2]) -> L {
    let middle = [p[0].add(q[0]), p[1].add(q[1])];
    let edge = [q[0].sub(p[0]), q[1].sub(p[1])];
    middle[0].mul(edge[1]).sub(middle[1].mul(edge[0]))
}

/// A row of a matrix, splat.
#[inline(always)]
fn row<L: Lanes>([x, y, z, w]: [f32; 4]) -> [L; 4] {
    [L::splat(x), L::splat(y), L::splat(z), L::splat(w)]
}

/// A row of a matrix times points.
#[inline(always)]
fn plane<L: Lanes>([x, y, z, w]: [L; 4], p: Vector<L>) -> L {
    dot([x, y, z], p).add(w)
}

#[inline(always)]
fn splat<L: Lanes>([x, y, z]: [f32; 3]) -> Vector<L> {
    [L::splat(x), L::splat(y), L::splat(z)]
}

#[inline(always)]
fn load<L: Lanes>([x, y, z]: &[[f32; WIDTH]; 3]) -> Vector<L> {
    [L::load(x), L::load(y), L::load(z)]
}

#[inline(always)]
fn subtract<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
fn dot<L: Lanes>(a: Vector<L>, b: Vector<L>) -> L {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}
