//! The colour spaces of FLIP: linear RGB, a linear opponent space to filter in, and CIE L*a*b* in
//! which differences are measured.

/// X, Y and Z of linear RGB with the primaries of Rec. 709 and the white of D65 (x = 0.3127,
/// y = 0.3290), by rows.
const XYZ_OF_RGB: [[f64; 3]; 3] = [
    [
        0.412_390_799_265_959_5,
        0.357_584_339_383_877_97,
        0.180_480_788_401_834_27,
    ],
    [
        0.212_639_005_871_510_36,
        0.715_168_678_767_755_9,
        0.072_192_315_360_733_71,
    ],
    [
        0.019_330_818_715_591_85,
        0.119_194_779_794_625_99,
        0.950_532_152_249_660_6,
    ],
];

/// Colour conversions with their constants worked out.
pub(super) struct Space {
    /// Relative to white: X/Xn, Y/Yn and Z/Zn.
    forward: [[f32; 3]; 3],
    backward: [[f32; 3]; 3],
}

impl Space {
    pub(super) fn new() -> Self {
        let relative = XYZ_OF_RGB.map(|row| {
            let white: f64 = row.iter().sum();
            row.map(|v| v / white)
        });
        Self {
            forward: relative.map(|row| row.map(|v| v as f32)),
            backward: inverse(&relative).map(|row| row.map(|v| v as f32)),
        }
    }

    /// The opponent space YCxCz: a linear form of L*a*b*. Source: Flohr et al. 1993, "Scene adaptive
    /// color quantization".
    pub(super) fn opponent(&self, rgb: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = product(&self.forward, rgb);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// Back from the opponent space.
    pub(super) fn rgb_of_opponent(&self, [luma, red_green, yellow_blue]: [f32; 3]) -> [f32; 3] {
        let y = (luma + 16.0) / 116.0;
        product(
            &self.backward,
            [y + red_green / 500.0, y, y - yellow_blue / 200.0],
        )
    }

    /// CIE L*a*b* of 1976, whose a* and b* count less the darker a colour is. Source: Hunt 1952,
    /// "Light and dark adaptation and the perception of color".
    pub(super) fn hunt_lab(&self, rgb: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = product(&self.forward, rgb).map(compressed);
        let lightness = 116.0 * y - 16.0;
        let chroma = 0.01 * lightness;
        [
            lightness,
            chroma * 500.0 * (x - y),
            chroma * 200.0 * (y - z),
        ]
    }
}

/// The cube root of L*a*b*, with its linear part near zero.
fn compressed(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA {
        t.cbrt()
    } else {
        t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
    }
}

/// How different two colours are. Source: Abasi et al. 2020, "Distance metrics for very large color
/// differences" (HyAB).
pub(super) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [l, a, b] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    l.abs() + (a * a + b * b).sqrt()
}

fn product(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// By cofactors.
fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |i: usize, j: usize| {
        let [(a, b), (c, d)] = [i, j].map(|k| ((k + 1) % 3, (k + 2) % 3));
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| minor(j, i) / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f32; 3], b: [f32; 3]) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 2e-3, "{a} instead of {b}");
        }
    }

    #[test]
    fn white_and_black_are_the_ends_of_every_axis() {
        let space = Space::new();
        near(space.opponent([1.0; 3]), [100.0, 0.0, 0.0]);
        near(space.opponent([0.0; 3]), [-16.0, 0.0, 0.0]);
        near(space.hunt_lab([1.0; 3]), [100.0, 0.0, 0.0]);
        near(space.hunt_lab([0.0; 3]), [0.0; 3]);
    }

    /// L*a*b* of sRGB's red under D65 is (53.24, 80.09, 67.20), before Hunt's adjustment.
    #[test]
    fn red_is_where_tables_have_it() {
        let [l, a, b] = Space::new().hunt_lab([1.0, 0.0, 0.0]);
        assert!((l - 53.24).abs() < 0.01, "{l}");
        assert!((a / (0.01 * l) - 80.09).abs() < 0.05, "{a}");
        assert!((b / (0.01 * l) - 67.20).abs() < 0.05, "{b}");
    }

    #[test]
    fn the_opponent_space_leads_back() {
        let space = Space::new();
        for rgb in [[1.0, 0.0, 0.0], [0.1, 0.7, 0.3], [0.0, 0.01, 1.0]] {
            let back = space.rgb_of_opponent(space.opponent(rgb));
            for (a, b) in back.iter().zip(rgb) {
                assert!((a - b).abs() < 1e-4, "{a} instead of {b}");
            }
        }
    }

    #[test]
    fn lightness_adds_to_the_distance_in_the_plane() {
        assert_eq!(distance([10.0, 3.0, 0.0], [4.0, 0.0, 4.0]), 11.0);
    }
}
