//! Where the coordinates of a scene count from.
//!
//! Single precision knows a place by 24 bits of its distance from 0, so that a chair 100 km from the
//! origin would be rendered in steps of 8 mm. Files are therefore read in double precision, and
//! what is far from the origin for its size counts its coordinates from a place nearby.

use glam::DVec3;

use super::Transform;
use super::formats::Geometry;

/// A box around something, in double precision; without anything in it at first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    low: DVec3,
    high: DVec3,
}

impl Default for Extent {
    fn default() -> Self {
        Extent {
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
        }
    }
}

impl Extent {
    /// The box around the triangles of a geometry file.
    pub(super) fn of(geometry: &Geometry) -> Extent {
        let mut extent = Extent::default();
        let corners = geometry.triangles.iter().flat_map(|t| t.positions);
        corners.for_each(|corner| extent.add(corner));
        extent
    }

    /// Makes it reach to a point.
    pub(super) fn add(&mut self, point: DVec3) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
    }

    /// Makes it reach around another that `transform` places.
    pub(super) fn add_placed(&mut self, other: &Extent, transform: &Transform) {
        if other.is_empty() {
            return;
        }
        let center = transform.place(other.center());
        let half = transform.matrix.abs() * other.half();
        self.add(center - half);
        self.add(center + half);
    }

    fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    fn center(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    fn half(&self) -> DVec3 {
        0.5 * (self.high - self.low)
    }
}

/// The place that coordinates within `extent` count from: of the multiples of a power of two, at least
/// four and less than eight times as large as half its longest side, that next to its centre.
///
/// So it is 0 for all that lies around the origin, and a scene that is moved by such multiples, or scaled
/// by a power of two, has the same coordinates as before or their multiples, bit for bit.
pub(super) fn of(extent: &Extent) -> DVec3 {
    let half = extent.half().max_element();
    let step = (4.0 * half).log2().ceil().exp2();
    let origin = (extent.center() / step).round() * step;
    if half > 0.0 && origin.is_finite() {
        origin
    } else {
        DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_box(center: [f64; 3], half: f64) -> DVec3 {
        let center = DVec3::from(center);
        let mut extent = Extent::default();
        extent.add(center - half);
        extent.add(center + half);
        of(&extent)
    }

    #[test]
    fn what_lies_around_the_origin_counts_from_it() {
        assert_eq!(of_box([0.0; 3], 1.0), DVec3::ZERO);
        assert_eq!(of_box([278.0, 274.0, 280.0], 280.0), DVec3::ZERO);
        assert_eq!(of(&Extent::default()), DVec3::ZERO);
        let mut point = Extent::default();
        point.add(DVec3::splat(1e5));
        assert_eq!(of(&point), DVec3::ZERO);
    }

    #[test]
    fn what_is_far_away_counts_from_nearby() {
        for (center, half) in [(1e5, 1.0), (-3.3e7, 250.0), (1e-2, 1e-7), (5e11, 3.0)] {
            let origin = of_box([center, 0.5 * half, 0.0], half);
            assert!((origin.x - center).abs() <= 4.0 * half, "{origin}");
            assert_eq!([origin.y, origin.z], [0.0; 2]);
        }
    }

    #[test]
    fn moving_by_steps_and_scaling_by_powers_of_two_changes_no_coordinate() {
        let near = of_box([0.3, -1.0, 0.1], 1.1);
        let moved = of_box([0.3 + 131_072.0, -1.0, 0.1], 1.1);
        assert_eq!(moved - near, DVec3::new(131_072.0, 0.0, 0.0));
        let scaled = of_box([1e5 * 0.125, 3.0 * 0.125, 0.0], 1.1 * 0.125);
        assert_eq!(scaled, 0.125 * of_box([1e5, 3.0, 0.0], 1.1));
    }
}
