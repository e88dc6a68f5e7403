//! Mappings from uniform numbers to directions, facet distributions, and constants of `std::core`.

use super::how_hard;
use super::lanes;
use super::sampling::{Distribution, examine};
use super::text::Text;
use super::vectors::length;
use impasto_verify::cells::{self, Measures};
use impasto_verify::lanes::Stuck;
use impasto_verify::statistics::{Numbers, direction};

#[test]
fn mappings_have_the_densities_they_state() {
    let text = Text::new(
        "fn cosine(u: vec2) -> vector = cosine_hemisphere(u);
         fn upper_half(u: vec2) -> vector = uniform_hemisphere(u);
         fn sphere(u: vec2) -> vector = uniform_sphere(u);
         fn power1(u: vec2) -> vector = power_hemisphere(u, 1.0);
         fn power900(u: vec2) -> vector = power_hemisphere(u, 900.0);",
    );
    use std::f64::consts::TAU;
    let upper = |w: &[f64; 3], d: f64| if w[2] > 0.0 { d } else { 0.0 };
    type Density<'a> = &'a dyn Fn(&[f64; 3]) -> f64;
    let densities: [(&str, Density<'_>); 5] = [
        ("cosine", &|w| upper(w, 2.0 * w[2] / TAU)),
        ("upper_half", &|w| upper(w, 1.0 / TAU)),
        ("sphere", &|_| 0.5 / TAU),
        ("power1", &|w| upper(w, 2.0 * w[2] / TAU)),
        ("power900", &|w| {
            upper(w, 901.0 * w[2].max(0.0).powi(900) / TAU)
        }),
    ];
    for (name, density) in densities {
        let id = text.id(name);
        let sample = |u: &[[f64; 4]]| {
            let column = |c: usize| lanes::floats(u.iter().map(|u| u[c]).collect());
            let w = lanes::call(text.module, id, vec![vec![column(0), column(1)]]);
            let one = |l| std::array::from_fn(|c| lanes::float_at(&w, c, l));
            Ok((0..u.len()).map(one).collect())
        };
        let measure = |w: &[[f64; 3]]| -> Result<Vec<Measures>, Stuck> {
            Ok(w.iter().map(|w| [density(w), 0.0, 0.0, 0.0]).collect())
        };
        let d = Distribution {
            label: name.into(),
            sample: Box::new(sample),
            measure: Box::new(measure),
        };
        let outcome = examine(&d, 1 << 16, 5);
        assert!(
            outcome.fit > 1e-3 && (outcome.total - 1.0).abs() < 1e-3,
            "{name}: p = {:e}, integral {}",
            outcome.fit,
            outcome.total
        );
        for u in [0.0, 0.5, 1.0 - 1.0 / 16_777_216.0]
            .map(|x| [0.0, 0.5, 1.0 - 1.0 / 16_777_216.0].map(|y| [x, y]))
            .concat()
        {
            let w = text.call::<f32>(name, &[&u]);
            assert!((length(&w) - 1.0).abs() < 1e-5, "{name} of {u:?}: {w:?}");
            assert!(
                name == "sphere" || w[2] > 0.0,
                "{name} of {u:?} is on the horizon"
            );
        }
    }
}

const GGX: &str = "
    fn d(m: vector, alpha: vec2) -> float = ggx_d(m, alpha);
    fn alpha(roughness: float, anisotropy: float) -> vec2 = ggx_alpha(roughness, anisotropy);
    fn smooth(alpha: vec2) -> bool = is_smooth(alpha);
";

#[test]
fn facets_cover_the_surface_once() {
    let text = Text::new(GGX);
    let id = text.id("d");
    for alpha in [[1.0, 1.0], [0.3, 0.3], [0.05, 0.4], [0.01, 0.01]] {
        let measure = |m: &[[f64; 3]]| -> Result<Vec<Measures>, Stuck> {
            let columns = (0..3)
                .map(|c| lanes::floats(m.iter().map(|m| m[c]).collect()))
                .collect();
            let d = lanes::call(text.module, id, vec![columns, lanes::uniform(&alpha)]);
            let value = |(l, m): (usize, &[f64; 3])| {
                [lanes::float_at(&d, 0, l) * m[2].max(0.0), 0.0, 0.0, 0.0]
            };
            Ok(m.iter().enumerate().map(value).collect())
        };
        // Cells follow the distribution's own shape: normals whose slopes are alpha times those of a
        // unit distribution.
        let mut n = Numbers::new(6);
        let facets: Vec<[f64; 3]> = (0..20_000)
            .map(|_| {
                let (t, phi) = (n.unit(), n.between(0.0, std::f64::consts::TAU));
                let slope = (t / (1.0 - t)).sqrt();
                let m = [
                    alpha[0] * slope * phi.cos(),
                    alpha[1] * slope * phi.sin(),
                    1.0,
                ];
                let l = length(&m);
                m.map(|x| x / l)
            })
            .collect();
        let cells = cells::partition(&facets, 100, how_hard());
        let sum: f64 = cells::integrate(&cells, &measure)
            .expect("answers")
            .iter()
            .map(|m| m[0])
            .sum();
        assert!((sum - 1.0).abs() < 2e-3, "{alpha:?}: {sum}");
    }
}

#[test]
fn sharp_facets_keep_their_precision() {
    let text = Text::new(GGX);
    for alpha in [1e-2, 1e-3, 1e-4] {
        for i in 0..200 {
            // Normals up to ten alphas from the top, as single precision has them.
            let s = alpha * f64::from(i) * 0.05;
            let m = direction((1.0 - s * s).sqrt(), 0.4).map(|x| f64::from(x as f32));
            let alpha = f64::from(alpha as f32);
            let [single, double] = [
                text.call::<f32>("d", &[&m, &[alpha, alpha]])[0],
                text.call::<f64>("d", &[&m, &[alpha, alpha]])[0],
            ];
            assert!(
                (single / double - 1.0).abs() < 1e-5,
                "{alpha}, {i}: {single} instead of {double}"
            );
        }
    }
    // Facets on edge.
    let on_edge = text.call::<f32>("d", &[&[1.0, 0.0, 0.0], &[1e-4, 1e-4]])[0];
    assert!((0.0..1e-6).contains(&on_edge), "{on_edge}");
}

#[test]
fn roughness_gives_alpha_within_bounds() {
    let text = Text::new(GGX);
    let alpha = |r: f64, a: f64| text.call::<f32>("alpha", &[&[r], &[a]]);
    assert_eq!(alpha(0.0, 0.0), alpha(0.001, 0.0), "one floor");
    assert!(
        (alpha(0.5, 0.0)[0] - 0.25).abs() < 1e-6,
        "the square of roughness"
    );
    let stretched = alpha(0.3, 1.0);
    assert!(
        (stretched[0] / stretched[1] - 10.0).abs() < 1e-4
            && (stretched[0] * stretched[1] - 0.0081).abs() < 1e-6
    );
    let turned = alpha(0.3, -1.0);
    assert_eq!(
        [turned[1], turned[0]],
        [stretched[0], stretched[1]],
        "axes exchanged"
    );
    let smooth = |a: [f64; 2]| text.call::<f32>("smooth", &[&a])[0] == 1.0;
    let floor = alpha(0.0, 0.0);
    assert!(smooth([floor[0], floor[1]]) && !smooth([floor[0], 1e-3]) && !smooth([2e-4, 2e-4]));
}

#[test]
fn constants_are_what_they_are_called() {
    use std::f64::consts;
    let names = [
        ("PI", consts::PI),
        ("HALF_PI", consts::FRAC_PI_2),
        ("QUARTER_PI", consts::FRAC_PI_4),
        ("TWO_PI", consts::TAU),
        ("INV_PI", consts::FRAC_1_PI),
        ("INV_TWO_PI", 1.0 / consts::TAU),
        ("INV_FOUR_PI", 0.5 / consts::TAU),
    ];
    for (name, value) in names {
        let text = Text::new(&format!("fn c() -> float = {name};"));
        let found = text.call::<f64>("c", &[])[0];
        assert!((found / value - 1.0).abs() < 1e-12, "{name} is {found}");
    }
}
