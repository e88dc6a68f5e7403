//! Where an object is placed: an affine map, in double precision until it is applied.

use glam::{DMat3, DVec3, Vec3};

/// How much more a transform may stretch one way than another. Beyond it, single precision can
/// hardly tell an object from a plane.
const MAX_STRETCH: f64 = 1e6;

/// An affine map that can be undone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// What is done to directions.
    pub matrix: DMat3,
    /// Where the origin goes, in metres.
    pub translation: DVec3,
}

impl Default for Transform {
    fn default() -> Self {
        Transform {
            matrix: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        }
    }
}

impl Transform {
    /// Scale along the axes, then turns in degrees about x, y and z, then translation.
    pub fn new(scale: Vec3, rotate: Vec3, translate: Vec3) -> Self {
        let [x, y, z] = rotate
            .to_array()
            .map(|degrees| f64::from(degrees).to_radians());
        let turn =
            DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
        Transform {
            matrix: turn * DMat3::from_diagonal(scale.as_dvec3()),
            translation: translate.as_dvec3(),
        }
    }

    /// The first three rows of a 4 x 4 matrix that maps columns, the translation last in each.
    pub fn from_rows(rows: [f64; 12]) -> Self {
        let at = |row: usize, column: usize| rows[4 * row + column];
        let column = |c: usize| DVec3::new(at(0, c), at(1, c), at(2, c));
        Transform {
            matrix: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        }
    }

    /// The transform with entries that single precision can hold, as kernels read them.
    pub(crate) fn rounded(&self) -> Transform {
        Transform {
            matrix: self.matrix.as_mat3().as_dmat3(),
            translation: self.translation.as_vec3().as_dvec3(),
        }
    }

    /// This transform, and `next` after it.
    pub fn then(&self, next: &Transform) -> Transform {
        Transform {
            matrix: next.matrix * self.matrix,
            translation: next.matrix * self.translation + next.translation,
        }
    }

    /// This transform, and then a move.
    pub(crate) fn moved(&self, by: DVec3) -> Transform {
        Transform {
            translation: self.translation + by,
            ..*self
        }
    }

    /// The same for points whose coordinates count from `origin`.
    pub(crate) fn before(&self, origin: DVec3) -> Transform {
        self.moved(self.matrix * origin)
    }

    /// Can it be undone? Not if it maps everything to a plane, or so close to one that rounding
    /// does the rest.
    pub fn is_invertible(&self) -> bool {
        let largest = |m: &DMat3| {
            m.to_cols_array()
                .iter()
                .fold(0.0, |a: f64, x| a.max(x.abs()))
        };
        let size = largest(&self.matrix);
        let inverse = (self.matrix * size.recip()).inverse();
        // Comparisons with what is no number are false.
        let finite = self.translation.is_finite() && inverse.is_finite();
        finite && size > 0.0 && largest(&inverse) < MAX_STRETCH
    }

    /// Does it turn left hands into right hands?
    pub fn is_mirrored(&self) -> bool {
        self.matrix.determinant() < 0.0
    }

    /// Where a point goes.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.place(p.as_dvec3()).as_vec3()
    }

    /// Where a point goes, without rounding to single precision.
    pub(crate) fn place(&self, p: DVec3) -> DVec3 {
        self.matrix * p + self.translation
    }

    /// The unit normal of a surface that had the normal `n`; zero where that is zero.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        // The cofactors are the inverse transpose times the determinant, in range for any scale.
        let [x, y, z] = [self.matrix.x_axis, self.matrix.y_axis, self.matrix.z_axis];
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let side = self.matrix.determinant().signum();
        let normal = side * (cofactors * n.as_dvec3());
        normal.normalize_or_zero().as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_comes_first_and_translation_last() {
        let turned = Transform::new(
            Vec3::new(2.0, 1.0, 1.0),
            Vec3::new(0.0, 90.0, 0.0),
            Vec3::new(0.0, 0.0, 5.0),
        );
        assert!(turned.point(Vec3::X).distance(Vec3::new(0.0, 0.0, 3.0)) < 1e-6);
        let moved = turned.then(&Transform::new(Vec3::splat(0.5), Vec3::ZERO, Vec3::Y));
        assert!(moved.point(Vec3::X).distance(Vec3::new(0.0, 1.0, 1.5)) < 1e-6);
        let rows = [1.0, 2.0, 3.0, 4.0, 0.0, 1.0, 0.0, 5.0, 0.0, 0.0, 1.0, 6.0];
        let sheared = Transform::from_rows(rows);
        assert_eq!(sheared.point(Vec3::ONE), Vec3::new(10.0, 6.0, 7.0));
    }

    #[test]
    fn turns_are_about_x_then_y_then_z() {
        let turned = |x, y, z| {
            let map = Transform::new(Vec3::ONE, Vec3::new(x, y, z), Vec3::ZERO);
            map.point(Vec3::Y)
        };
        for (found, expected) in [
            (turned(90.0, 90.0, 0.0), Vec3::X),
            (turned(90.0, 0.0, 90.0), Vec3::Z),
            (turned(0.0, 90.0, 90.0), Vec3::NEG_X),
        ] {
            assert!(found.distance(expected) < 1e-6, "{found}, not {expected}");
        }
    }

    #[test]
    fn normals_stay_outside_and_at_right_angles() {
        let scale = Vec3::new(-3.0, 0.2, 1.0);
        let map = Transform::new(scale, Vec3::new(20.0, 40.0, 60.0), Vec3::ONE);
        assert!(map.is_mirrored());
        // Two tangents of a sphere at its normal, and the way out.
        let normal = Vec3::new(0.6, 0.0, 0.8);
        let tangents = [Vec3::Y, Vec3::new(0.8, 0.0, -0.6)];
        let placed = map.normal(normal);
        for tangent in tangents {
            let along = map.point(tangent) - map.point(Vec3::ZERO);
            assert!(placed.dot(along).abs() < 1e-6, "{placed} {along}");
        }
        assert!(placed.dot(map.point(normal) - map.point(Vec3::ZERO)) > 0.0);
        assert!((placed.length() - 1.0).abs() < 1e-6);
        assert_eq!(map.normal(Vec3::ZERO), Vec3::ZERO);
    }

    #[test]
    fn flattening_transforms_are_noticed_at_any_scale() {
        for size in [1e-9, 1.0, 1e9] {
            let of = |scale: Vec3| Transform::new(size * scale, Vec3::ONE, Vec3::ZERO);
            assert!(of(Vec3::ONE).is_invertible());
            assert!(of(Vec3::new(-1.0, 1e-3, 1.0)).is_invertible());
            assert!(!of(Vec3::new(1.0, 0.0, 1.0)).is_invertible());
            assert!(!of(Vec3::new(1.0, 1e-8, 1.0)).is_invertible());
        }
        assert!(!Transform::new(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO).is_invertible());
        assert!(!Transform::from_rows([f64::NAN; 12]).is_invertible());
        let rows = [1.0, 2.0, 3.0, 0.0, 2.0, 4.0, 6.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        assert!(!Transform::from_rows(rows).is_invertible());
    }
}
