//! The two sheens: against the formula and the shadowing integral of one paper, and against the
//! table of the other.

use std::f64::consts::PI;

use super::known::{Known, assert_near};
use impasto_verify::statistics::{Numbers, direction};

/// The distribution of Estevez and Kulla 2017, equation 2.
fn charlie(sin: f64, roughness: f64) -> f64 {
    (2.0 + 1.0 / roughness) * sin.powf(1.0 / roughness) / (2.0 * PI)
}

/// cos (1 + lambda) of Smith's shadowing by its definition: the area of all facets, projected toward
/// the cosine `c`.
fn projected_area(c: f64, roughness: f64) -> f64 {
    let (heights, turns) = (400, 200);
    let s = (1.0 - c * c).sqrt();
    let step = 0.5 * PI / f64::from(heights);
    let at = |k: i32| {
        let a = (f64::from(k) + 0.5) * step;
        let mean = (0..turns)
            .map(|t| {
                let phi = (f64::from(t) + 0.5) * PI / f64::from(turns);
                (s * a.sin() * phi.cos() + c * a.cos()).max(0.0)
            })
            .sum::<f64>()
            / f64::from(turns);
        2.0 * PI * mean * charlie(a.sin(), roughness) * a.sin() * step
    };
    (0..heights).map(at).sum()
}

/// The published fit to lambda. Source: the same, equation 3 and table 1.
fn published_lambda(c: f64, roughness: f64) -> f64 {
    let rough = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
    let fine = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
    let t = (1.0 - roughness).powi(2);
    let p: [f64; 5] = std::array::from_fn(|k| t * fine[k] + (1.0 - t) * rough[k]);
    let l = |x: f64| p[0] / (1.0 + p[1] * x.powf(p[2])) + p[3] * x + p[4];
    if c < 0.5 {
        l(c).exp()
    } else {
        (2.0 * l(0.5) - l(1.0 - c)).exp()
    }
}

/// f cos, given the projected areas toward both directions.
fn sheen(wo: [f64; 3], wi: [f64; 3], roughness: f64, area: [f64; 2]) -> f64 {
    let sum: [f64; 3] = std::array::from_fn(|c| wo[c] + wi[c]);
    let cos2 = sum[2] * sum[2] / sum.iter().map(|x| x * x).sum::<f64>();
    let lambda = [area[0] / wo[2] - 1.0, area[1] / wi[2] - 1.0];
    let g = 1.0 / (1.0 + lambda[0] + lambda[1]);
    charlie((1.0 - cos2).sqrt(), roughness) * g / (4.0 * wo[2])
}

#[test]
fn microfacet_sheen_has_its_distribution_and_shadowing() {
    let mut n = Numbers::new(31);
    for roughness in [0.05, 0.2, 0.5, 1.0] {
        let bsdf = Known::new("sheen_conty_kulla", &[&[0.5; 3], &[roughness]]);
        for _ in 0..12 {
            let [wo, wi] = [0, 0].map(|_| direction(n.between(0.02, 0.9), n.between(0.0, 6.0)));
            let area = [wo[2], wi[2]].map(|c| projected_area(c, roughness));
            let exact = 0.5 * sheen(wo, wi, roughness, area);
            let found = bsdf.eval(wo, wi);
            let error = (found - exact).abs();
            assert!(error < 1e-2 * exact + 1e-6, "{found}, not {exact}");
            // The published lambda is a fit to the same integral, good to some percent.
            let area = [wo[2], wi[2]].map(|c| c * (1.0 + published_lambda(c, roughness)));
            let published = 0.5 * sheen(wo, wi, roughness, area);
            assert_near(found, published, 0.2, "as published");
        }
    }
}

/// Rows of the table of Zeltner, Burley and Chiang 2022: roughness and cosine in 31sts, then the
/// transformation's inverse (a, 0, b), (0, a, 0), (0, 0, 1) and the albedo.
const ZELTNER: [([f64; 2], [f64; 3]); 9] = [
    ([5.0, 4.0], [0.08654, -0.00582, 0.13300]),
    ([11.0, 0.0], [0.12869, -0.17952, 0.69766]),
    ([11.0, 5.0], [0.25652, -0.05663, 0.36707]),
    ([11.0, 15.0], [0.33933, -0.02784, 0.05291]),
    ([24.0, 10.0], [0.68535, -0.09011, 0.47731]),
    ([26.0, 20.0], [0.78214, -0.05159, 0.33447]),
    ([31.0, 0.0], [0.72363, 0.00000, 0.74973]),
    ([31.0, 16.0], [0.86320, -0.00005, 0.49191]),
    ([31.0, 31.0], [0.87958, 0.00003, 0.34187]),
];

#[test]
fn fibre_sheen_follows_the_published_table() {
    for ([alpha, cosine], [a, b, albedo]) in ZELTNER {
        let bsdf = Known::new("sheen_zeltner", &[&[1.0; 3], &[alpha / 31.0]]);
        let z = f64::max(cosine / 31.0, 1e-6);
        let turn = 0.9;
        let wo = direction(z, turn);
        let found = bsdf.albedo(wo);
        assert!((found - albedo).abs() < 6e-3, "{found}, not {albedo}");
        // How far apart the distributions are; the fit is coarser for thin lobes.
        let (mut apart, most) = (0.0, if alpha < 12.0 { 0.13 } else { 0.065 });
        let mut n = Numbers::new(32);
        let count = 2000;
        for _ in 0..count {
            let wi = direction(n.unit(), n.between(0.0, 2.0 * PI));
            // In the frame of the viewer's azimuth.
            let x = wi[0] * f64::cos(turn) + wi[1] * f64::sin(turn);
            let y = wi[1] * f64::cos(turn) - wi[0] * f64::sin(turn);
            let m = [a * x + b * wi[2], a * y, wi[2]];
            let length = m.iter().map(|x| x * x).sum::<f64>().sqrt();
            let exact = wi[2] / length / PI * a * a / length.powi(3);
            apart += (bsdf.pdf(wo, wi) - exact).abs() * PI / f64::from(count);
            assert_near(bsdf.eval(wo, wi), found * bsdf.pdf(wo, wi), 1e-9, "value");
        }
        assert!(apart < most, "{apart} apart at {alpha}, {cosine}");
    }
}
