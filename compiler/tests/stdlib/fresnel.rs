//! Fresnel's equations and Snell's law, against formulas written down another way.

use super::text::Text;
use super::vectors::{dot, length};
use impasto_verify::statistics::Numbers;

/// Reflectance by the amplitudes of both polarisations, from Snell's law.
fn dielectric(cos_i: f64, n: f64) -> f64 {
    let n = if cos_i < 0.0 { 1.0 / n } else { n };
    let c = cos_i.abs();
    let t2 = 1.0 - (1.0 - c * c) / (n * n);
    if t2 <= 0.0 {
        return 1.0;
    }
    let t = t2.sqrt();
    let (s, p) = ((c - n * t) / (c + n * t), (n * c - t) / (n * c + t));
    0.5 * (s * s + p * p)
}

/// The same for a complex index n + ik, in complex arithmetic.
fn conductor(c: f64, n: f64, k: f64) -> f64 {
    type C = (f64, f64);
    let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let sqrt = |a: C| {
        let m = a.0.hypot(a.1);
        (
            ((m + a.0) / 2.0).max(0.0).sqrt(),
            ((m - a.0) / 2.0).max(0.0).sqrt(),
        )
    };
    let ratio = |a: C, b: C| (a.0 * a.0 + a.1 * a.1) / (b.0 * b.0 + b.1 * b.1);
    let eta2 = mul((n, k), (n, k));
    // q = sqrt(eta^2 - sin^2), the index times the cosine of refraction.
    let q = sqrt((eta2.0 - (1.0 - c * c), eta2.1));
    let s = ratio((c - q.0, -q.1), (c + q.0, q.1));
    let e = (eta2.0 * c, eta2.1 * c);
    let p = ratio((e.0 - q.0, e.1 - q.1), (e.0 + q.0, e.1 + q.1));
    0.5 * (s + p)
}

const FRESNEL: &str = "
    fn d(c: float, n: float) -> float = fresnel_dielectric(c, n);
    fn m(c: float, n: float, k: float) -> float = fresnel_conductor_channel(c, n, k);
    fn t(wo: vector, n: float) -> vector = refract(wo, n);
    fn a(wo: vector, m: vector, n: float) -> vector = refract_about(wo, m, n);
";

#[test]
fn dielectrics_follow_fresnel_from_both_sides() {
    let text = Text::new(FRESNEL);
    for n in [0.5, 0.999, 1.0 + 1e-5, 1.0 + 1e-3, 1.33, 1.5, 2.4, 4.0] {
        let n = f64::from(n as f32);
        for i in 1..=200 {
            let c = f64::from((f64::from(i) / 200.0) as f32);
            for c in [c, -c, c * 1e-3] {
                let c = f64::from(c as f32);
                let exact = dielectric(c, n);
                let double = text.call::<f64>("d", &[&[c], &[n]])[0];
                assert!((double - exact).abs() < 1e-9, "{c}, {n}: {double}, {exact}");
                let single = text.call::<f32>("d", &[&[c], &[n]])[0];
                // Next to the edge of total reflection the slope is infinite.
                let edge =
                    (1.0 - (1.0 - c * c) * (if c < 0.0 { n * n } else { 1.0 / (n * n) })).abs();
                assert!(
                    (single - exact).abs() < 1e-6 + 1e-7 / edge.sqrt(),
                    "{c}, {n}: {single}, {exact}"
                );
            }
        }
    }
}

#[test]
fn dielectrics_hold_at_their_ends() {
    let text = Text::new(FRESNEL);
    let d = |c: f64, n: f64| text.call::<f32>("d", &[&[c], &[n]])[0];
    assert!((d(1.0, 1.5) - 0.04).abs() < 1e-7, "4 % of glass");
    for c in [1.0, 0.3, 1e-4, 0.0, -1e-4, -0.3, -1.0] {
        assert_eq!(d(c, 1.0), 0.0, "equal indices reflect nothing at {c}");
    }
    assert_eq!(d(0.0, 1.5), 1.0, "everything is reflected at the horizon");
    // sin 45 degrees is beyond the critical angle of glass, 41.8 degrees.
    assert_eq!(d(-(0.5f64.sqrt()), 1.5), 1.0, "total reflection");
    assert!(d(-0.76, 1.5) < 0.4, "the critical angle is passed at 0.745");
    // At Brewster's angle only one polarisation is reflected: half of ((n^2 - 1) / (n^2 + 1))^2.
    let brewster = 1.0 / (1.0f64 + 1.5 * 1.5).sqrt();
    assert!((d(brewster, 1.5) - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-6);
}

#[test]
fn conductors_follow_fresnel() {
    let text = Text::new(FRESNEL);
    for (n, k) in [
        (0.21, 3.67),
        (1.17, 2.4),
        (1.5, 0.0),
        (1.0, 0.0),
        (0.05, 0.0),
        (0.0, 2.0),
        (4.0, 9.0),
        (1.0, 1e-4),
    ] {
        for i in 1..=100 {
            let c = f64::from(i) / 100.0;
            let exact = conductor(c, n, k);
            for c in [c, -c] {
                let double = text.call::<f64>("m", &[&[c], &[n], &[k]])[0];
                assert!(
                    (double - exact).abs() < 1e-7,
                    "{c}, {n}, {k}: {double}, {exact}"
                );
                let single = text.call::<f32>("m", &[&[c], &[n], &[k]])[0];
                assert!(
                    (single - exact).abs() < 1e-4,
                    "{c}, {n}, {k}: {single}, {exact}"
                );
                assert!((0.0..=1.0).contains(&single), "{c}, {n}, {k}: {single}");
            }
        }
        let horizon = text.call::<f32>("m", &[&[0.0], &[n], &[k]])[0];
        assert_eq!(horizon, 1.0, "{n}, {k} at the horizon");
    }
}

#[test]
fn refraction_follows_snell() {
    let text = Text::new(FRESNEL);
    let mut n = Numbers::new(1);
    for _ in 0..2000 {
        let (wo, m) = (n.direction(), n.direction());
        let ior = n.between(0.4, 2.5);
        let relative = if wo[2] < 0.0 { 1.0 / ior } else { ior };
        let wi = text.call::<f64>("t", &[&wo, &[ior]]);
        let passes = wo[2] * wo[2] > 1.0 - relative * relative;
        assert_eq!(wi != [0.0; 3], passes, "{wo:?} into {ior}");
        if passes {
            assert!((length(&wi) - 1.0).abs() < 1e-9 && wi[2] * wo[2] < 0.0);
            assert!(
                (0..2).all(|c| (wi[c] * relative + wo[c]).abs() < 1e-9),
                "{wo:?} into {ior}: {wi:?}"
            );
        }
        // About another normal: the same angles to it, in one plane with it.
        let wi = text.call::<f64>("a", &[&wo, &m, &[ior]]);
        let c = dot(&wo, &m);
        let relative = if c < 0.0 { 1.0 / ior } else { ior };
        assert_eq!(wi != [0.0; 3], c * c > 1.0 - relative * relative);
        if wi != [0.0; 3] {
            assert!((length(&wi) - 1.0).abs() < 1e-9 && dot(&wi, &m) * c < 0.0);
            let along = |w: &[f64]| {
                let d = dot(w, &m);
                (0..3).map(|i| w[i] - d * m[i]).collect::<Vec<_>>()
            };
            let (o, i) = (along(&wo), along(&wi));
            assert!((0..3).all(|k| (i[k] * relative + o[k]).abs() < 1e-9));
        }
    }
}
