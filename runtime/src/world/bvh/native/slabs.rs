//! The part of a ray that nodes are tested with: `safe_inverse`, `traversal_octant` and `set_slabs` of the WGSL,
//! and what a node's planes are to it.

use super::tree::{Node, Placement};
use crate::world::bvh::text::SLACK;

/// A ray in the space of a tree. The fourth components are 0, so that vectors of four have no surprises there.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub(super) struct Slabs {
    pub origin: [f32; 4],
    pub inverse: [f32; 4],
    pub padding: [f32; 4],
    /// Along which axes the ray meets the upper planes first.
    pub flips: [bool; 3],
    /// The bits that make slots an order of visiting.
    pub octant: u32,
}

/// Where planes of a node are on the ray: a byte times `step`, plus `near` or `far`.
pub(super) struct Head {
    pub step: [f32; 3],
    pub near: [f32; 3],
    pub far: [f32; 3],
}

impl Slabs {
    /// Of a ray in the world, whose inverse direction is known.
    #[inline(always)]
    pub(super) fn new(origin: [f32; 3], direction: [f32; 3], inverse: [f32; 3]) -> Self {
        Self::with(origin, direction, inverse, [0.0; 3])
    }

    #[inline(always)]
    fn with(origin: [f32; 3], direction: [f32; 3], inverse: [f32; 3], padding: [f32; 3]) -> Self {
        let bit = |axis: usize, bit: u32| if direction[axis] < 0.0 { 0 } else { bit };
        let four = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
        Self {
            origin: four(origin),
            inverse: four(inverse),
            padding: four(padding),
            flips: inverse.map(|i| i < 0.0),
            octant: bit(0, 4) | bit(1, 2) | bit(2, 1),
        }
    }

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
        let padding = std::array::from_fn(|i| SLACK * reach * sums[i] * inverse[i].abs());
        Self::with(origin, direction, inverse, padding)
    }

    #[inline(always)]
    pub(super) fn enter(&self, node: &Node) -> Head {
        let scale = node.exponents.map(|e| f32::from_bits(u32::from(e) << 23));
        let step: [f32; 3] = std::array::from_fn(|i| scale[i] * self.inverse[i]);
        let start: [f32; 3] =
            std::array::from_fn(|i| (node.origin[i] - self.origin[i]) * self.inverse[i]);
        let slack: [f32; 3] = std::array::from_fn(|i| {
            SLACK * (start[i].abs() + 255.0 * step[i].abs()) + self.padding[i]
        });
        Head {
            step,
            near: std::array::from_fn(|i| start[i] - slack[i]),
            far: std::array::from_fn(|i| start[i] + slack[i]),
        }
    }
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
