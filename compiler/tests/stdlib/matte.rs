//! Matte BSDFs against the formulas of their papers, written down another way.

use std::f64::consts::PI;

use super::known::{Known, assert_near};
use impasto_verify::statistics::{Numbers, direction};

/// A pair of directions by their angles: from the normal, and between their azimuths.
struct Pair {
    o: f64,
    i: f64,
    azimuth: f64,
}

impl Pair {
    fn random(n: &mut Numbers) -> Self {
        Self {
            o: n.between(0.0, 1.5),
            i: n.between(0.0, 1.5),
            azimuth: n.between(-PI, PI),
        }
    }

    /// Both directions, the first turned by `turn` around the normal; below it, if `inside`.
    fn directions(&self, turn: f64, inside: bool) -> [[f64; 3]; 2] {
        let side = if inside { -1.0 } else { 1.0 };
        [(self.o, turn), (self.i, turn + self.azimuth)].map(|(a, phi)| {
            let [x, y, z] = direction(a.cos(), phi);
            [x, y, side * z]
        })
    }

    fn cos_between(&self) -> f64 {
        self.o.sin() * self.i.sin() * self.azimuth.cos() + self.o.cos() * self.i.cos()
    }
}

/// Fujii's lobe of white times the cosine. Source: Portsmouth et al. 2025, equations 8 and 12.
fn fujii(p: &Pair, roughness: f64) -> f64 {
    let s = p.cos_between() - p.o.cos() * p.i.cos();
    let t = if s > 0.0 {
        p.o.cos().max(p.i.cos())
    } else {
        1.0
    };
    let a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * roughness);
    a / PI * (1.0 + roughness * s / t) * p.i.cos()
}

/// Its albedo at an angle, and the mean of that. Source: the same, equations 15 and 17.
fn fujii_albedo(angle: f64, roughness: f64) -> f64 {
    let a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * roughness);
    let s = angle.sin();
    let g =
        s * (angle - s * angle.cos()) + 2.0 / 3.0 * angle.tan() * (1.0 - s.powi(3)) - 2.0 / 3.0 * s;
    a + roughness * a / PI * g
}

fn fujii_mean(roughness: f64) -> f64 {
    let a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * roughness);
    a * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * PI)) * roughness)
}

#[test]
fn rough_diffuse_is_the_published_formula() {
    let mut n = Numbers::new(21);
    for (rho, r) in [(0.6, 0.7), (1.0, 1.0), (0.05, 0.2), (0.9, 0.0)] {
        let color = [rho; 3];
        let full = Known::new("oren_nayar_diffuse", &[&color, &[r], &[1.0]]);
        let plain = Known::new("oren_nayar_diffuse", &[&color, &[r], &[0.0]]);
        let mean = fujii_mean(r);
        let multiple = rho * rho * mean / (1.0 - rho * (1.0 - mean));
        for k in 0..50 {
            let p = Pair::random(&mut n);
            let [wo, wi] = p.directions(n.between(0.0, 6.0), k % 2 == 0);
            let single = rho * fujii(&p, r);
            let lost = [p.o, p.i].map(|a| 1.0 - fujii_albedo(a, r));
            let rest = if r > 0.0 {
                multiple / PI * lost[0] * lost[1] / (1.0 - mean) * p.i.cos()
            } else {
                0.0
            };
            assert_near(plain.eval(wo, wi), single, 1e-6, "single");
            assert_near(full.eval(wo, wi), single + rest, 1e-6, "compensated");
            let albedo = rho * fujii_albedo(p.o, r);
            assert_near(plain.albedo(wo), albedo, 1e-6, "plain albedo");
            assert_near(full.albedo(wo), albedo + multiple * lost[0], 1e-6, "albedo");
        }
    }
}

#[test]
fn white_rough_diffuse_keeps_all_light() {
    for r in [0.0, 0.3, 1.0] {
        let white = Known::new("oren_nayar_diffuse", &[&[1.0; 3], &[r], &[1.0]]);
        for z in [1e-4, 0.1, 0.5, 1.0] {
            assert_near(white.albedo(direction(z, 1.0)), 1.0, 1e-12, "albedo");
        }
    }
}

#[test]
fn without_roughness_rough_diffuse_is_lambertian() {
    let smooth = Known::new("oren_nayar_diffuse", &[&[0.5; 3], &[0.0], &[1.0]]);
    let mut n = Numbers::new(22);
    for _ in 0..50 {
        let [wo, wi] = Pair::random(&mut n).directions(0.3, false);
        assert_near(smooth.eval(wo, wi), 0.5 * wi[2] / PI, 1e-12, "value");
        assert_near(smooth.pdf(wo, wi), wi[2] / PI, 1e-12, "density");
    }
}

/// What sampling by clipped transformed cosines is for: weights near one at grazing views, where
/// the cosine's reach 2.
#[test]
fn rough_diffuse_is_sampled_by_its_shape() {
    let bsdf = Known::new("oren_nayar_diffuse", &[&[1.0; 3], &[1.0], &[1.0]]);
    let mut n = Numbers::new(23);
    for (z, most) in [(0.05, 0.2), (0.3, 0.1), (0.9, 0.02)] {
        let wo = direction(z, 2.0);
        let (mut squares, count) = (0.0, 4000);
        for _ in 0..count {
            let [u @ .., _] = n.four();
            let wi = bsdf.sample(wo, u);
            let wi = [wi[0], wi[1], wi[2]];
            squares += (bsdf.eval(wo, wi) / bsdf.pdf(wo, wi)).powi(2);
        }
        let variance = squares / f64::from(count) - 1.0;
        assert!(variance < most, "variance {variance} at cosine {z}");
    }
}

/// Burley's lobe of white, times the cosine, by the angle between half vector and directions.
fn burley(p: &Pair, roughness: f64) -> f64 {
    let half = 0.5 * p.cos_between().clamp(-1.0, 1.0).acos();
    let at_grazing = 0.5 + 2.0 * roughness * half.cos().powi(2);
    let factor = |a: f64| 1.0 + (at_grazing - 1.0) * (1.0 - a.cos()).powi(5);
    factor(p.o) * factor(p.i) / PI * p.i.cos()
}

/// The integral of `burley` over incoming directions, by the midpoint rule.
fn burley_albedo(o: f64, roughness: f64) -> f64 {
    let (heights, turns) = (400, 60);
    let step = 0.5 * PI / f64::from(heights);
    let at = |k: i32| {
        let i = (f64::from(k) + 0.5) * step;
        let mean = (0..turns)
            .map(|t| {
                let azimuth = (f64::from(t) + 0.5) * PI / f64::from(turns);
                burley(&Pair { o, i, azimuth }, roughness)
            })
            .sum::<f64>()
            / f64::from(turns);
        2.0 * PI * mean * i.sin() * step
    };
    (0..heights).map(at).sum()
}

#[test]
fn burley_is_the_published_formula_as_far_as_it_keeps_energy() {
    let mut n = Numbers::new(24);
    for r in [0.0, 0.25, 0.4, 0.7, 1.0] {
        let bsdf = Known::new("burley_diffuse", &[&[0.5; 3], &[r]]);
        for k in 0..20 {
            let p = Pair::random(&mut n);
            let [wo, wi] = p.directions(n.between(0.0, 6.0), k % 2 == 0);
            let gain = [p.o, p.i].map(|a| burley_albedo(a, r));
            let most = gain[0].max(gain[1]).max(1.0);
            assert!(r > 0.4 || most < 1.0 + 1e-4, "{most} at roughness {r}");
            let exact = 0.5 * burley(&p, r) / most;
            assert_near(bsdf.eval(wo, wi), exact, 2e-4, "value");
        }
    }
}

#[test]
fn translucent_light_leaves_on_the_other_side() {
    let bsdf = Known::new("translucent", &[&[0.25; 3]]);
    for z in [0.3, -0.3] {
        let wo = direction(z, 0.0);
        for i in [-0.8, -0.1, 0.1, 0.8] {
            let exact = if z * i < 0.0 { i.abs() / PI } else { 0.0 };
            assert_near(
                bsdf.eval(wo, direction(i, 2.0)),
                0.25 * exact,
                1e-12,
                "value",
            );
            assert_near(bsdf.pdf(wo, direction(i, 2.0)), exact, 1e-12, "density");
        }
        assert!(bsdf.sample(wo, [0.1, 0.7, 0.0])[2] * z < 0.0);
    }
}

#[test]
fn what_is_transparent_does_not_bend_light() {
    let bsdf = Known::new("transparent", &[&[1.0; 3]]);
    let wo = direction(0.4, 1.0);
    let wi = wo.map(|x| -x);
    assert_eq!(bsdf.sample(wo, [0.5; 3]), wi);
    assert_eq!([bsdf.eval(wo, wi), bsdf.pdf(wo, wi)], [1.0, 1.0]);
    assert_eq!(bsdf.eval(wo, [wi[0], wi[1], -wi[2]]), 0.0);
}

#[test]
fn retroreflection_is_ggx_with_the_view_mirrored() {
    // So dark that what several facets send, of second order in the color, does not count.
    let (dark, roughness) = (1e-6, 0.5);
    let bsdf = Known::new("retroreflective", &[&[dark; 3], &[roughness]]);
    let alpha2 = f64::powi(roughness, 4);
    let mut n = Numbers::new(25);
    for _ in 0..50 {
        let p = Pair::random(&mut n);
        let [wo, wi] = p.directions(0.0, false);
        // The facet half way between the light and the mirrored view.
        let sum = [wi[0] - wo[0], wi[1] - wo[1], wi[2] + wo[2]];
        let cos2 = sum[2] * sum[2] / sum.iter().map(|x| x * x).sum::<f64>();
        let tan2 = 1.0 / cos2 - 1.0;
        let d = alpha2 / (PI * cos2 * cos2 * (alpha2 + tan2).powi(2));
        let lambda = |a: f64| 0.5 * ((1.0 + alpha2 * a.tan().powi(2)).sqrt() - 1.0);
        let g = 1.0 / (1.0 + lambda(p.o) + lambda(p.i));
        assert_near(
            bsdf.eval(wo, wi),
            dark * d * g / (4.0 * p.o.cos()),
            1e-4,
            "value",
        );
    }
}
