//! The part of a ray that boxes are tested with: `safe_inverse` and `traversal_octant` of the WGSL, and slabs.
//!
//! A walk must meet every box with a triangle in it that the ray hits as triangles are tested, which rounds where
//! corners lie across the ray by some units in the last place of how far away they are. So a ray is as thick as
//! that to boxes. The distances of planes then have relative errors alone, since nothing is subtracted but what is
//! exact: some units in the last place, by which slabs are widened. After Ize, "Robust BVH Ray Traversal" (2013).

use super::Rays;
use super::lanes::{Lanes, WIDTH};
use super::tree::{Boxes, Placement};
use crate::world::bvh::text::SLACK;

/// Rays in the space of a tree.
#[derive(Clone, Copy)]
pub(super) struct Slabs<const N: usize> {
    /// By axis: from where planes are entered, behind the origin if they are ahead; and from where they are left.
    origins: [[[f32; N]; 2]; 3],
    inverses: [[[f32; N]; 2]; 3],
    /// By axis: whether the ray meets the upper planes first, 0 or 1.
    flips: [[u32; N]; 3],
    /// The bits that make slots an order of visiting.
    pub octants: [u32; N],
}

impl<const N: usize> Slabs<N> {
    /// Of rays in the world, through a tree within `bounds`.
    #[inline(always)]
    pub(super) fn new(bounds: &[[f32; 2]; 3], rays: &Rays<N>) -> Self {
        let mut thickness = [0.0_f32; N];
        for (origins, [least, greatest]) in rays.origins.iter().zip(bounds) {
            for (thickness, origin) in thickness.iter_mut().zip(origins) {
                let reach = (origin - least).max(greatest - origin);
                *thickness = thickness.max(SLACK * reach);
            }
        }
        let mut inverses = [[0.0; N]; 3];
        for (inverses, directions) in inverses.iter_mut().zip(&rays.directions) {
            for (inverse, direction) in inverses.iter_mut().zip(directions) {
                *inverse = safe_inverse(*direction);
            }
        }
        Self::with(&rays.origins, &rays.directions, &inverses, &[thickness; 3])
    }

    #[inline(always)]
    fn with(
        origins: &[[f32; N]; 3],
        directions: &[[f32; N]; 3],
        inverses: &[[f32; N]; 3],
        thickness: &[[f32; N]; 3],
    ) -> Self {
        let mut this = Self {
            origins: [[[0.0; N]; 2]; 3],
            inverses: [[[0.0; N]; 2]; 3],
            flips: [[0; N]; 3],
            octants: [0; N],
        };
        for axis in 0..3 {
            for lane in 0..N {
                let (origin, inverse) = (origins[axis][lane], inverses[axis][lane]);
                let behind = thickness[axis][lane].copysign(inverse);
                this.origins[axis][0][lane] = origin + behind;
                this.origins[axis][1][lane] = origin - behind;
                this.inverses[axis][0][lane] = inverse * (1.0 - SLACK);
                this.inverses[axis][1][lane] = inverse * (1.0 + SLACK);
                this.flips[axis][lane] = u32::from(inverse < 0.0);
                let is_forward = u32::from(directions[axis][lane] >= 0.0);
                this.octants[lane] |= is_forward << (2 - axis);
            }
        }
        this
    }

    /// Takes a ray from others.
    #[inline(always)]
    pub(super) fn set<const M: usize>(&mut self, lane: usize, others: &Slabs<M>, other: usize) {
        for axis in 0..3 {
            for end in 0..2 {
                self.origins[axis][end][lane] = others.origins[axis][end][other];
                self.inverses[axis][end][lane] = others.inverses[axis][end][other];
            }
            self.flips[axis][lane] = others.flips[axis][other];
        }
        self.octants[lane] = others.octants[other];
    }

    /// Which of the boxes the ray of a lane meets nearer than `t_max`.
    #[inline(always)]
    pub(super) fn meet<L: Lanes>(&self, lane: usize, boxes: &Boxes, t_max: f32) -> L::Mask {
        let mut near = L::splat(0.0);
        let mut far = L::splat(t_max);
        for axis in 0..3 {
            let (planes, flip) = (&boxes.0[axis], self.flips[axis][lane] as usize);
            let [enter, leave] = &self.origins[axis];
            let [slower, faster] = &self.inverses[axis];
            let enter = plane::<L>(&planes[flip % 2], enter[lane], slower[lane]);
            let leave = plane::<L>(&planes[(flip + 1) % 2], leave[lane], faster[lane]);
            near = near.max(enter);
            far = far.min(leave);
        }
        near.at_most(far)
    }
}

impl Slabs<1> {
    /// Of a ray brought to where an object is: `enter_placement`.
    #[inline(always)]
    pub(super) fn within(placement: &Placement, origin: [f32; 3], direction: [f32; 3]) -> Self {
        let offset: [f32; 3] = std::array::from_fn(|i| origin[i] - placement.rows[i][3]);
        let [x, y, z] = [3, 4, 5].map(|row| three(placement.rows[row]));
        let sums = placement.rows[6];
        let reach = dot(offset, offset).sqrt() + sums[3].abs();
        let [origin, direction] = [offset, direction].map(|v| [dot(x, v), dot(y, v), dot(z, v)]);
        let [a, b, c] = direction.map(f32::abs);
        let size = a.max(b.max(c));
        let inverse = direction.map(|d| safe_inverse(d / size) / size);
        let thickness: [f32; 3] = std::array::from_fn(|i| SLACK * reach * sums[i]);
        let [origin, direction, inverse, thickness] =
            [origin, direction, inverse, thickness].map(|v| v.map(|x| [x]));
        Self::with(&origin, &direction, &inverse, &thickness)
    }
}

/// Where planes are on the ray.
#[inline(always)]
fn plane<L: Lanes>(planes: &[f32; WIDTH], origin: f32, inverse: f32) -> L {
    L::load(planes).sub(L::splat(origin)).mul(L::splat(inverse))
}

#[inline(always)]
pub(super) fn three([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A component of `safe_inverse`.
#[inline(always)]
pub(super) fn safe_inverse(d: f32) -> f32 {
    let tiny = if d < 0.0 { -1e-18 } else { 1e-18 };
    1.0 / if d.abs() > 1e-18 { d } else { tiny }
}
