//! Pins the microfacet BSDFs and what they are made of to their sources: thin films to the spectral
//! integral of Airy's formula, the dip at 82 degrees, white furnaces, and values at single pairs
//! of directions computed here another way.

use std::f64::consts::{PI, TAU};

use super::library::{Bsdf, Case, bsdf_with};
use super::sampling::{albedo, distribution, view};
use super::text::Text;
use impasto_verify::statistics::Numbers;

type Complex = (f64, f64);

fn mul(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn div(a: Complex, b: Complex) -> Complex {
    let l = b.0 * b.0 + b.1 * b.1;
    let (re, im) = mul(a, (b.0, -b.1));
    (re / l, im / l)
}

fn add(a: Complex, b: Complex) -> Complex {
    (a.0 + b.0, a.1 + b.1)
}

fn sub(a: Complex, b: Complex) -> Complex {
    (a.0 - b.0, a.1 - b.1)
}

/// The root with a positive imaginary part.
fn root(a: Complex) -> Complex {
    let (l, angle) = (a.0.hypot(a.1).sqrt(), 0.5 * a.1.atan2(a.0));
    (l * angle.cos(), l * angle.sin())
}

/// Reflectance of a base n + ik under a film of index `film` and of the phase `turn` (2 pi times
/// the optical path there and back over the wavelength): Airy's closed form, by Snell's angles.
fn airy(cos_o: f64, film: f64, (n, k): Complex, turn: f64) -> f64 {
    let sin2 = 1.0 - cos_o * cos_o;
    let cos_film = (1.0 - sin2 / (film * film)).sqrt();
    let eta = (n, k);
    let cos_base = root(sub((1.0, 0.0), div((sin2, 0.0), mul(eta, eta))));
    let interface = |n1: Complex, c1: Complex, n2: Complex, c2: Complex| {
        let s = div(sub(mul(n1, c1), mul(n2, c2)), add(mul(n1, c1), mul(n2, c2)));
        let p = div(sub(mul(n2, c1), mul(n1, c2)), add(mul(n2, c1), mul(n1, c2)));
        [s, p]
    };
    let (o, f) = ((cos_o, 0.0), (cos_film, 0.0));
    let top = interface((1.0, 0.0), o, (film, 0.0), f);
    let base = interface((film, 0.0), f, eta, cos_base);
    let wave = (turn.cos(), turn.sin());
    let power = |i: usize| {
        let later = mul(base[i], wave);
        let r = div(add(top[i], later), add((1.0, 0.0), mul(top[i], later)));
        r.0 * r.0 + r.1 * r.1
    };
    0.5 * (power(0) + power(1))
}

/// The optical path there and back in a film.
fn path(cos_o: f64, film: f64, thickness: f64) -> f64 {
    2.0 * thickness * (film * film - 1.0 + cos_o * cos_o).sqrt()
}

/// The color of a film: Airy's formula integrated over wave numbers with the sensitivities of
/// Belcour and Barla 2017 (Gaussians: weight, centre and variance in 1/m), equal energy white.
fn film_color(cos_o: f64, film: f64, base: Complex, thickness: f64) -> [f64; 3] {
    let gaussians = [
        [
            (5.4856e-13, 1.6810e6, 4.3278e9),
            (9.7470e-14, 2.2399e6, 4.5282e9),
        ],
        [(4.4201e-13, 1.7953e6, 9.3046e9), (0.0, 1.0, 1.0)],
        [(5.2481e-13, 2.2084e6, 6.6121e9), (0.0, 1.0, 1.0)],
    ];
    let (mut sums, mut whites) = ([0.0; 3], [0.0; 3]);
    for i in 0..6000 {
        let k = 0.9e6 + f64::from(i) * 400.0;
        let r = airy(cos_o, film, base, TAU * k * path(cos_o, film, thickness));
        for (c, pair) in gaussians.iter().enumerate() {
            for (weight, centre, variance) in pair {
                let w = weight * (-(k - centre).powi(2) / (4.0 * variance)).exp();
                sums[c] += w * r;
                whites[c] += w;
            }
        }
    }
    let xyz: [f64; 3] = std::array::from_fn(|c| sums[c] / whites[c]);
    // The inverse of the primaries of ITU-R BT.709 with its white, rows brought to the sum 1.
    let rows = [
        [3.240_454, -1.537_139, -0.498_531],
        [-0.969_266, 1.876_011, 0.041_556],
        [0.055_643, -0.204_026, 1.057_225],
    ];
    rows.map(|row: [f64; 3]| {
        let sum: f64 = row.iter().zip(xyz).map(|(m, x)| m * x).sum();
        (sum / row.iter().sum::<f64>()).clamp(0.0, 1.0)
    })
}

const FILM: &str = "
    fn film(c: float, d: float, n: float, ior: color, k: color) -> color =
        film_reflectance(c, conductor_q2(c, ior, k), d, n, ior, k);
    fn wave(path: float) -> Waves = spectral_wave(path);
    fn root(re: color, im: color) -> Waves = waves_root(Waves(re, im));
    fn one(top: float, re: color, im: color, turn: float) -> color {
        let w1 = Waves(color(cos(turn)), color(sin(turn)));
        let w2 = waves_product(w1, w1);
        airy_sum(top, Waves(re, im), w1, w2, waves_product(w2, w1))
    }
    fn coated(c: float, ior: float, d: length, n: float) -> color =
        coated_dielectric(c, ior, d, n);
    fn metal(c: float, ior: color, k: color, d: length) -> color =
        coated_conductor(c, ior, k, d, 1.7);
    fn bare(c: float, ior: color, k: color) -> color = fresnel_conductor(c, ior, k);
    fn glass(c: float, ior: float) -> float = fresnel_dielectric(c, ior);
    fn schlick(c: float, f0: color, f82: color, f90: color, e: float) -> color =
        schlick82(c, f0, f82, f90, e);
";

#[test]
fn thin_films_have_the_colors_of_the_spectral_integral() {
    let text = Text::new(FILM);
    for (film, base) in [
        (1.33, (1.5, 0.0)),
        (1.8, (1.3, 0.0)),
        (1.4, (0.21, 3.67)),
        (2.0, (2.9, 3.0)),
    ] {
        for thickness in [1e-7, 2.5e-7, 4e-7, 8e-7] {
            for cos_o in [1.0, 0.6, 0.2] {
                let exact = film_color(cos_o, film, base, thickness);
                // Three orders of interference are near all of glass, not of metal at grazing angles.
                let within = if base.1 > 0.0 { 0.025 } else { 0.01 };
                let (n, k) = ([base.0; 3], [base.1; 3]);
                let args: [&[f64]; 5] = [&[cos_o], &[thickness], &[film], &n, &k];
                let found = text.call::<f64>("film", &args);
                let close = |a: &f64, b: &f64| (a - b).abs() < within;
                assert!(
                    found.iter().zip(&exact).all(|(a, b)| close(a, b)),
                    "{film} on {base:?}, {thickness} m at {cos_o}: {found:?}, exactly {exact:?}"
                );
                let single = text.call::<f32>("film", &args);
                assert!(
                    found.iter().zip(single).all(|(a, b)| (a - b).abs() < 1e-4),
                    "{film} on {base:?}, {thickness} m at {cos_o} in single precision"
                );
            }
        }
    }
}

#[test]
fn a_quarter_wave_film_reflects_what_airy_says() {
    let text = Text::new(FILM);
    // Head-on at a quarter of a wave the phase is pi, and the reflectance has a closed form.
    for (film, base) in [(1.38f64, 1.52f64), (2.3, 1.52), (1.2247, 1.5)] {
        let closed = ((base - film * film) / (base + film * film)).powi(2);
        assert!((airy(1.0, film, (base, 0.0), PI) - closed).abs() < 1e-12);
        let (top, bottom) = ((1.0 - film) / (1.0 + film), (film - base) / (film + base));
        let found = text.call::<f64>("one", &[&[top], &[bottom; 3], &[0.0; 3], &[PI]])[0];
        assert!((found - closed).abs() < 1e-4, "{film}: {found}, {closed}");
    }
    // The root of the base's index gives no reflection at all.
    assert!(airy(1.0, 1.5f64.sqrt(), (1.5, 0.0), PI) < 1e-12);
}

#[test]
fn a_film_of_no_thickness_is_none() {
    let text = Text::new(FILM);
    for c in [1.0, 0.7, 0.3, 0.05, -0.9, -0.5, -0.05] {
        let plain = text.call::<f64>("glass", &[&[c], &[1.5]])[0];
        let none = text.call::<f64>("coated", &[&[c], &[1.5], &[0.0], &[1.4]]);
        assert_eq!(none, [plain; 3], "glass at {c}");
        let thinnest = text.call::<f64>("coated", &[&[c], &[1.5], &[1e-13], &[1.4]]);
        assert!(
            thinnest.iter().all(|r| (r - plain).abs() < 2e-3),
            "glass at {c}: {thinnest:?}, {plain}"
        );
        let (n, k) = ([0.21, 1.02, 1.17], [3.67, 2.58, 2.4]);
        let plain = text.call::<f64>("bare", &[&[c], &n, &k]);
        assert_eq!(text.call::<f64>("metal", &[&[c], &n, &k, &[0.0]]), plain);
        let thinnest = text.call::<f64>("metal", &[&[c], &n, &k, &[1e-13]]);
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 0.02;
        assert!(
            thinnest.iter().zip(&plain).all(close),
            "copper at {c}: {thinnest:?}, {plain:?}"
        );
    }
}

#[test]
fn films_are_finite_and_between_0_and_1() {
    let text = Text::new(FILM);
    for thickness in [1e-12, 1e-8, 5e-7, 1e-3, 1e6] {
        for (n, k) in [(1.5, 0.0), (1.0, 0.0), (0.0, 0.0), (0.1, 8.0), (200.0, 0.0)] {
            for cos_o in [0.0, 1e-7, 1e-3, 0.5, 1.0, -1.0] {
                for film in [0.5, 1.0, 1.5, 20.0] {
                    let args: [&[f64]; 5] = [&[cos_o], &[thickness], &[film], &[n; 3], &[k; 3]];
                    for found in [
                        text.call::<f32>("film", &args),
                        text.call::<f64>("film", &args),
                    ] {
                        assert!(
                            found.iter().all(|r| (0.0..=1.0).contains(r)),
                            "{args:?}: {found:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn color82_is_the_reflectance_at_82_degrees() {
    let text = Text::new(FILM);
    let (f0, f90, f82) = ([0.9, 0.5, 0.04], [1.0, 0.9, 1.0], [0.6, 0.3, 1.0]);
    let at = |c: f64, f82: &[f64; 3]| text.call::<f64>("schlick", &[&[c], &f0, f82, &f90, &[5.0]]);
    let (with, without) = (at(1.0 / 7.0, &f82), at(1.0 / 7.0, &[1.0; 3]));
    assert!(((1.0f64 / 7.0).acos().to_degrees() - 82.0).abs() < 0.3);
    for c in 0..3 {
        let schlick = f0[c] + (f90[c] - f0[c]) * (6.0f64 / 7.0).powi(5);
        assert!((without[c] - schlick).abs() < 1e-9);
        assert!((with[c] - f82[c] * schlick).abs() < 1e-9, "{with:?}");
    }
    // Nothing changes at the ends.
    assert!(
        at(1.0, &f82)
            .iter()
            .zip(f0)
            .all(|(a, b)| (a - b).abs() < 1e-12)
    );
    assert!(
        at(0.0, &f82)
            .iter()
            .zip(f90)
            .all(|(a, b)| (a - b).abs() < 1e-12)
    );
}

/// A BSDF of the library with one set of arguments.
struct Given {
    bsdf: Bsdf,
}

impl Given {
    fn new(name: &str, call: &str) -> Self {
        let bsdf = bsdf_with(name, call);
        Self { bsdf }
    }

    fn case(&self) -> &Case {
        &self.bsdf.cases[0]
    }

    /// Density and value from `wo` to `wi`.
    fn measure(&self, wo: [f64; 3], wi: [f64; 3]) -> [f64; 4] {
        (distribution(&self.bsdf, self.case(), wo).measure)(&[wi]).expect("a density")[0]
    }

    /// What is reflected and passes in all, from samples.
    fn furnace(&self, wo: [f64; 3], samples: usize) -> f64 {
        let d = distribution(&self.bsdf, self.case(), wo);
        let mut n = Numbers::new(3);
        let u: Vec<[f64; 4]> = (0..samples).map(|_| n.four()).collect();
        let wi: Vec<[f64; 3]> = (d.sample)(&u).expect("directions");
        let wi: Vec<[f64; 3]> = wi.into_iter().filter(|w| *w != [0.0; 3]).collect();
        let weights = (d.measure)(&wi)
            .expect("densities")
            .into_iter()
            .map(|m| m[1] / m[0]);
        weights.sum::<f64>() / samples as f64
    }
}

const DEGREES: [f64; 5] = [0.0, 40.0, 75.0, 88.0, 150.0];

#[test]
fn glass_keeps_all_light_at_any_roughness() {
    for ior in ["1.1", "1.5", "2.5"] {
        for roughness in ["0.05", "1"] {
            for anisotropy in ["0", "0.9"] {
                let call = format!("ior: {ior}, roughness: {roughness}, anisotropy: {anisotropy}");
                let glass = Given::new("dielectric", &call);
                let film = Given::new(
                    "dielectric",
                    &format!("{call}, thinfilm_thickness: 0.4 um, thinfilm_ior: 1.8"),
                );
                let [reflected, passed] = ["dielectric_reflection", "dielectric_transmission"]
                    .map(|name| Given::new(name, &call));
                for wo in DEGREES.map(view) {
                    let all = glass.furnace(wo, 400);
                    assert!((all - 1.0).abs() < 1e-6, "{call}: {all} from {wo:?}");
                    let all = film.furnace(wo, 2000);
                    assert!((all - 1.0).abs() < 0.08, "{call}: {all} with a film");
                    // Its two halves make a whole, at every pair of directions.
                    let wi = view(200.0 - 100.0 * wo[2]);
                    for wi in [wi, wi.map(|x| -x)] {
                        let whole = glass.measure(wo, wi)[1];
                        let halves = reflected.measure(wo, wi)[1] + passed.measure(wo, wi)[1];
                        assert!((whole - halves).abs() < 1e-9 * whole.max(1.0), "{call}");
                    }
                }
            }
        }
    }
}

#[test]
fn white_metals_keep_all_light() {
    // Without absorption and at an index of next to nothing a metal is white.
    let white = "ior: color(1e-6), extinction: color(5)";
    for (name, args, anisotropy, least) in [
        ("conductor", white, "0", 0.998),
        ("conductor", white, "0.9", 0.99),
        ("generalized_schlick", "color0: 1", "0", 0.998),
        ("generalized_schlick", "color0: 1", "-0.7", 0.99),
    ] {
        for roughness in ["0.05", "0.2", "0.3", "0.6", "0.8", "1"] {
            let metal = Given::new(
                name,
                &format!("{args}, roughness: {roughness}, anisotropy: {anisotropy}"),
            );
            for degrees in [0.0, 40.0, 60.0, 88.0, 89.9] {
                let kept = metal.furnace(view(degrees), 1 << 16);
                assert!(
                    (least - 0.004..1.004).contains(&kept),
                    "{name}, roughness {roughness}, anisotropy {anisotropy}: {kept} at {degrees}"
                );
            }
        }
    }
}

#[test]
fn metals_absorb_more_the_more_facets_light_meets() {
    // A mean reflectance of 0.8: rough, it gets darker than a smooth surface, but not by all
    // that single facets lose.
    let metal = |roughness: &str| {
        let m = Given::new(
            "generalized_schlick",
            &format!("color0: 0.8, color90: 0.8, roughness: {roughness}"),
        );
        m.furnace(view(20.0), 1 << 15)
    };
    let (smooth, rough) = (metal("0"), metal("1"));
    assert!((smooth - 0.8).abs() < 1e-3, "{smooth}");
    // Kulla and Conty's F^2 (1 - L) / (1 - F L) of the light lost, at a mean loss of 0.59.
    assert!((0.57..0.62).contains(&rough), "{rough}");
}

/// GGX of the roughness `a` and Smith's functions, by tangents.
fn ggx(cos_m: f64, a: f64) -> f64 {
    let tan2 = 1.0 / (cos_m * cos_m) - 1.0;
    a * a / (PI * cos_m.powi(4) * (a * a + tan2).powi(2))
}

fn lambda(cos: f64, a: f64) -> f64 {
    0.5 * ((1.0 + a * a * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0)
}

#[test]
fn single_pairs_of_directions_have_the_values_of_the_formulas() {
    let a = 0.36;
    let (wo, wi) = (
        impasto_verify::statistics::direction(0.8, 0.3),
        impasto_verify::statistics::direction(0.55, 2.9),
    );
    let sum: [f64; 3] = std::array::from_fn(|i| wo[i] + wi[i]);
    let l = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    let cos_m = sum[2] / l;
    let o = sum.iter().zip(wo).map(|(s, w)| s * w / l).sum::<f64>();
    // One facet of metal that reflects nothing but at grazing angles leaves single reflection.
    let schlick = Given::new(
        "generalized_schlick",
        "color0: 0.001, color90: 0.001, roughness: 0.6",
    );
    let g2 = 1.0 / (1.0 + lambda(0.8, a) + lambda(0.55, a));
    let single = 0.001 * ggx(cos_m, a) * g2 / (4.0 * 0.8);
    let found = schlick.measure(wo, wi)[1];
    assert!((found / single - 1.0).abs() < 2e-3, "{found}, {single}");
    // Glass: Fresnel by both amplitudes, both facets, masking only toward the viewer.
    let fresnel = |c: f64| {
        let t = (1.0 - (1.0 - c * c) / 2.25).sqrt();
        let (s, p) = ((c - 1.5 * t) / (c + 1.5 * t), (1.5 * c - t) / (1.5 * c + t));
        0.5 * (s * s + p * p)
    };
    let below: [f64; 3] = [sum[0], sum[1], wo[2] - wi[2]];
    let l2 = below.iter().map(|x| x * x).sum::<f64>().sqrt();
    let g1 = 1.0 / (1.0 + lambda(0.8, a));
    let facets = fresnel(o) * ggx(cos_m, a) + fresnel(0.5 * l2) * ggx(below[2] / l2, a);
    let expected = facets * g1 / (4.0 * 0.8);
    let glass = Given::new("dielectric_reflection", "roughness: 0.6");
    let found = glass.measure(wo, wi)[1];
    assert!((found / expected - 1.0).abs() < 1e-6, "{found}, {expected}");
    // A clear coat of the roughness 0.5: alpha 0.0505.
    let coat = Given::new("clear_coat", "roughness: 0.5");
    let a: f64 = 0.0505;
    let d = (a * a - 1.0) / (PI * (a * a).ln() * (1.0 + (a * a - 1.0) * cos_m * cos_m));
    let masked = 1.0 / (1.0 + lambda(0.8, 0.25)) / (1.0 + lambda(0.55, 0.25));
    let expected = fresnel(o) * d * masked / (4.0 * 0.8);
    let found = coat.measure(wo, wi)[1];
    assert!((found / expected - 1.0).abs() < 1e-6, "{found}, {expected}");
}

#[test]
fn what_passes_has_the_jacobian_of_refraction() {
    // The Jacobian by differences: how the refracted direction turns with the facet.
    let (wo, n, a) = (
        impasto_verify::statistics::direction(0.8, 0.3),
        1.5f64,
        0.36,
    );
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let tilted = |x: f64, y: f64| {
        let l = (x * x + y * y + 1.0).sqrt();
        [x / l, y / l, 1.0 / l]
    };
    let refracted = |m: [f64; 3]| -> [f64; 3] {
        let c = dot(wo, m);
        let t = (1.0 - (1.0 - c * c) / (n * n)).sqrt();
        std::array::from_fn(|k| (m[k] * (c - n * t) - wo[k]) / n)
    };
    for (x, y) in [(0.1, 0.2), (-0.2, 0.05), (0.4, 0.1)] {
        let m = tilted(x, y);
        // Solid angle that a small parallelogram of slopes takes.
        let area = |w: &dyn Fn(f64, f64) -> [f64; 3]| {
            let d: [[f64; 3]; 2] = [(1e-5, 0.0), (0.0, 1e-5)].map(|(dx, dy)| {
                let (after, before) = (w(x + dx, y + dy), w(x - dx, y - dy));
                std::array::from_fn(|k| after[k] - before[k])
            });
            (dot(d[0], d[0]) * dot(d[1], d[1]) - dot(d[0], d[1]).powi(2)).sqrt()
        };
        let jacobian = area(&tilted) / area(&|x, y| refracted(tilted(x, y)));
        let (c, wi) = (dot(wo, m), refracted(m));
        let t = (1.0 - (1.0 - c * c) / (n * n)).sqrt();
        let (s, p) = ((c - n * t) / (c + n * t), (n * c - t) / (n * c + t));
        let passed = 1.0 - 0.5 * (s * s + p * p);
        let seen = ggx(m[2], a) * c / (0.8 * (1.0 + lambda(0.8, a)));
        let expected = seen * jacobian;
        for (name, share) in [("dielectric", passed), ("dielectric_transmission", 1.0)] {
            let [pdf, value, ..] = Given::new(name, "roughness: 0.6").measure(wo, wi);
            for (found, expected) in [(pdf, share * expected), (value, passed * expected)] {
                assert!(
                    (found / expected - 1.0).abs() < 1e-6,
                    "{name} at {m:?}: {found}, {expected}"
                );
            }
        }
    }
}

#[test]
fn roughness_going_to_0_reaches_the_smooth_ones() {
    for (rough, args, smooth) in [
        ("conductor", "", "smooth_conductor"),
        (
            "dielectric",
            "tint: color(0.3, 0.6, 1)",
            "smooth_dielectric",
        ),
        ("thin_dielectric", "", "thin_walled_dielectric"),
    ] {
        let limit = Given::new(smooth, args);
        for roughness in ["0", "0.01", "0.05"] {
            let near = Given::new(rough, &format!("roughness: {roughness}, {args}"));
            for wo in [0.0, 40.0, 70.0, 150.0].map(view) {
                let there = albedo(&limit.bsdf, limit.case(), wo);
                let here = albedo(&near.bsdf, near.case(), wo);
                let close = |(a, b): (&f64, f64)| (a - b).abs() < 0.02;
                assert!(
                    here.iter().zip(there).all(close),
                    "{rough} at {roughness}: {here:?}, smooth {there:?}"
                );
            }
        }
    }
}
