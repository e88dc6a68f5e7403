//! The extremes that break shading elsewhere, each by its number in the table of docs/stability.md,
//! on what the library's functions and BSDFs are made of. Each notes what it measured. What holds
//! the rows that are the language's:
//!
//! | row | held here | and in |
//! |---|---|---|
//! | 1 sharp GGX | `ggx_keeps_its_precision...` | `search` |
//! | 2 one alpha 0 | `roughness_of_0...` | `precision` |
//! | 3 smooth to delta | `smooth_and_nearly_smooth...` | `microfacet` |
//! | 4, 10 half vectors, cosines at the horizon | `half_vectors_and_cosines...` | `precision` |
//! | 5, 6 indices of 1 and next to it | `equal_and_nearly_equal...` | `fresnel`, `search` |
//! | 7 impossible indices | | `tests/diagnostics/parameter_value`, `precision` |
//! | 8 total reflection | `total_reflection...` | `fresnel` |
//! | 9 metals at their ends | `metals_reflect...` | `fresnel` |
//! | 11 ends of random numbers | | `precision` |
//! | 13 functions outside of their domain | `functions_are_defined...` | `compiler/tests/interpreter` |
//! | 14, 15 frames, tangents | `frames_and_normals...` | `normals`, `bumps` |
//! | 16 normals that face away | `shading_normals...` | `normals` |
//! | 17 bumped normals sampled as evaluated | | `materials` |
//! | 21 noise far away | `noise_far...` | `noise` |
//! | 26 white surfaces | `white_surfaces...` | `energy` |
//! | 27 weights of 0 and 1 | `weights_of_exactly...` | `compiler/tests/layering.rs` |
//! | 30 deep nests | `deep_nests...` | `tests/diagnostics/lobes` |
//!
//! Over every BSDF: `sampling` (chi-squared, density, energy), `symmetry` (reciprocity), `energy`
//! (energy, albedo and white furnaces, searched), `search` and `precision` (single against double);
//! over every material: `materials`.

use impasto_compiler::{MaterialRequest, MemoryLoader, compile, diag};

use super::lanes::{self, Lanes};
use super::library::{Bsdf, Case, bsdf_with};
use super::sampling::{albedo, distribution, view};
use super::text::Text;
use super::vectors::{dot, length, reflect};
use crate::common::record::{Bound, Row};
use impasto_verify::statistics::{Numbers, direction};

const FUNCTIONS: &str = "
    use std::noise::{perlin, cell, fractal};
    fn ggx(m: vector, alpha: vec2) -> float = ggx_d(m, alpha);
    fn view(wo: vector, wi: vector, alpha: vec2) -> float = ggx_visibility(wo, wi, alpha);
    fn glass(c: float, ior: float) -> float = fresnel_dielectric(c, ior);
    fn metal(c: float, ior: float, k: float) -> float = fresnel_conductor_channel(c, ior, k);
    fn bent(wo: vector, ior: float) -> vector = refract(wo, ior);
    fn around(n: normal) -> Frame = frame_around(n);
    fn along(n: normal, t: vector) -> Frame = frame(n, t);
    fn useful(n: normal, ng: normal, wo: vector) -> normal = valid_normal(n, ng, wo);
    fn odd(x: float, y: float) -> vec4 = vec4(pow(x, y), x / y, atan2(x, y), sqrt(x));
    fn unit(v: vector) -> vector = normalize(v);
    fn rough(p: point) -> float = perlin(p);
    fn steps(p: point) -> float = cell(p);
    fn deep(p: point) -> float = fractal(p, octaves: 20);
";

/// The worst of what was measured, and where.
struct Worst(f64, String);

impl Worst {
    fn none() -> Self {
        Self(0.0, String::new())
    }

    fn add(&mut self, x: f64, place: impl FnOnce() -> String) {
        if x > self.0 || x.is_nan() {
            *self = Self(if x.is_finite() { x } else { f64::INFINITY }, place());
        }
    }

    /// Notes the row and fails beyond `most`.
    fn at_most(&self, most: f64, table: &str, subject: &str, what: &str) {
        let bound = Bound::AtMost(most);
        let good = Row {
            table,
            subject,
            what,
            worst: self.0,
            bound,
            place: &self.1,
        }
        .note();
        assert!(
            good,
            "row {table}, {subject}: {what} {:e}, more than {most:e}: {}",
            self.0, self.1
        );
    }
}

fn relative(exact: f64, found: f64) -> f64 {
    (exact - found).abs() / exact.abs().max(1e-30)
}

/// Both precisions of a function of floats and vectors.
fn both(text: &Text, name: &str, args: &[&[f64]]) -> (Vec<f64>, Vec<f64>) {
    (text.call::<f64>(name, args), text.call::<f32>(name, args))
}

fn single<const N: usize>(v: [f64; N]) -> [f64; N] {
    v.map(|x| f64::from(x as f32))
}

#[test]
fn ggx_keeps_its_precision_down_to_the_least_alpha() {
    let text = Text::new(FUNCTIONS);
    let mut worst = Worst::none();
    for alpha in [1e-2, 3e-3, 1e-3, 3e-4, 1e-4] {
        for stretch in [1.0, 0.2] {
            let a = single([alpha, (alpha * stretch).max(1e-4)]);
            for tan in [0.0, 0.3, 1.0, 2.0, 10.0] {
                let m = single(direction(
                    1.0 / (1.0 + (tan * alpha) * (tan * alpha)).sqrt(),
                    0.4,
                ));
                // The facet's tangent from x and y: its cosine has no digits left for it.
                let s: f64 = (m[0] / a[0]).powi(2) + (m[1] / a[1]).powi(2) + m[2] * m[2];
                let exact = 1.0 / (std::f64::consts::PI * a[0] * a[1] * s * s);
                let (double, found) = both(&text, "ggx", &[&m, &a]);
                worst.add(relative(exact, found[0]), || {
                    format!("alpha {a:?}, facet {m:?}")
                });
                worst.add(relative(exact, double[0]) * 1e6, || {
                    format!("double, alpha {a:?}")
                });
            }
        }
    }
    worst.at_most(1e-5, "1", "ggx_d", "relative error of the distribution");
}

/// Is every answer finite and not negative, in both precisions?
fn sound(bsdf: &Bsdf, case: &Case, wo: [f64; 3], worst: &mut Worst) {
    let u: Vec<[f64; 4]> = [0.0, 0.5, 1.0 - 1.0 / 16_777_216.0]
        .iter()
        .flat_map(|&a| [[a, 0.3, a, 0.0], [0.7, a, 0.2, 0.0]])
        .collect();
    let d = distribution(bsdf, case, wo);
    let wi: Vec<[f64; 3]> = (d.sample)(&u).expect("directions");
    for (w, m) in wi.iter().zip((d.measure)(&wi).expect("densities")) {
        let fine = w.iter().chain(&m).all(|x| x.is_finite()) && m.iter().all(|x| *x >= 0.0);
        worst.add(f64::from(u8::from(!fine)), || {
            format!("{} to {w:?}: {m:?}", d.label)
        });
    }
}

#[test]
fn roughness_of_0_one_way_or_both_is_finite() {
    let mut worst = Worst::none();
    for name in [
        "conductor",
        "dielectric",
        "generalized_schlick",
        "thin_dielectric",
    ] {
        for call in [
            "roughness: 0, anisotropy: 1",
            "roughness: 1e-3, anisotropy: -1",
            "roughness: 0",
        ] {
            let bsdf = bsdf_with(name, call);
            for degrees in [0.0, 45.0, 89.9, 135.0] {
                sound(&bsdf, &bsdf.cases[0], view(degrees), &mut worst);
            }
        }
    }
    worst.at_most(0.0, "2", "anisotropic BSDFs", "answers that are not finite");
}

#[test]
fn smooth_and_nearly_smooth_have_one_albedo() {
    let mut worst = Worst::none();
    for name in [
        "conductor",
        "dielectric",
        "generalized_schlick",
        "metal",
        "thin_dielectric",
    ] {
        let at = |roughness: f64| bsdf_with(name, &format!("roughness: {roughness}"));
        // Alpha just below, at and above the least one.
        let near = [0.0099, 0.01, 0.0101].map(at);
        for degrees in [0.0, 30.0, 60.0, 80.0, 150.0] {
            let seen = near
                .each_ref()
                .map(|b| albedo(b, &b.cases[0], view(degrees))[0]);
            for pair in seen.windows(2) {
                worst.add((pair[0] - pair[1]).abs(), || {
                    format!("{name} from {degrees}: {seen:?}")
                });
            }
        }
    }
    worst.at_most(
        1e-4,
        "3",
        "rough BSDFs",
        "step of the albedo where they become smooth",
    );
}

#[test]
fn half_vectors_and_cosines_at_the_horizon_give_0() {
    let text = Text::new(FUNCTIONS);
    let mut worst = Worst::none();
    for z in [0.0, 1e-20, 1e-7] {
        for alpha in [[1e-4, 1e-4], [1.0, 1e-4], [1.0, 1.0]] {
            let (a, b) = both(&text, "ggx", &[&direction(z, 0.3), &alpha]);
            let (c, d) = both(
                &text,
                "view",
                &[&direction(z, 0.3), &direction(z, 2.0), &alpha],
            );
            for v in [a, b, c, d] {
                let fine = v.iter().all(|x| x.is_finite() && *x >= 0.0);
                worst.add(f64::from(u8::from(!fine)), || {
                    format!("{v:?} at {z:e}, {alpha:?}")
                });
            }
        }
    }
    worst.at_most(
        0.0,
        "4",
        "GGX",
        "answers at the horizon that are not finite",
    );

    let mut worst = Worst::none();
    for bsdf in super::library::bsdfs().iter().filter(|b| !b.delta) {
        for case in &bsdf.cases {
            let flat = [1.0, 0.0, 0.0];
            for (wo, wi) in [
                (flat, view(30.0)),
                (view(30.0), flat),
                (flat, [-1.0, 0.0, 0.0]),
            ] {
                let m = (distribution(bsdf, case, wo).measure)(&[wi]).expect("a density")[0];
                worst.add(m.iter().fold(0.0, |a, &b| a.max(b)), || {
                    format!("{}: {m:?}", case.label)
                });
            }
            for z in [1e-7, -1e-7] {
                sound(bsdf, case, direction(z, 0.3), &mut worst);
            }
        }
    }
    worst.at_most(
        0.0,
        "10",
        "every BSDF",
        "value or density along the surface",
    );
}

#[test]
fn equal_and_nearly_equal_indices_pass_light_on() {
    let text = Text::new(FUNCTIONS);
    let mut worst = Worst::none();
    for degrees in [0.0, 60.0, 89.0, 120.0] {
        let wo = single(view(degrees));
        let (_, through) = both(&text, "bent", &[&wo, &[1.0]]);
        let off = wo.iter().zip(&through).map(|(a, b)| (a + b).abs());
        worst.add(off.fold(0.0, f64::max), || {
            format!("from {degrees} degrees")
        });
        worst.add(both(&text, "glass", &[&[wo[2]], &[1.0]]).1[0], || {
            format!("from {degrees}")
        });
    }
    worst.at_most(
        2e-7,
        "5",
        "fresnel_dielectric, refract",
        "what ior 1 reflects or bends",
    );

    let mut worst = Worst::none();
    for ior in [1.0 + 1e-5, 1.0 - 1e-5, 1.0 + 1e-4, 1.0 + 1e-3] {
        let ior = f64::from(ior as f32);
        for i in 1..=200 {
            let c = f64::from((f64::from(i) / 200.0) as f32);
            // Snell's law and both amplitudes in double precision.
            let t2 = 1.0 - (1.0 - c * c) / (ior * ior);
            let t = t2.max(0.0).sqrt();
            let (s, p) = ((c - ior * t) / (c + ior * t), (ior * c - t) / (ior * c + t));
            let exact = if t2 <= 0.0 {
                1.0
            } else {
                0.5 * (s * s + p * p)
            };
            // The slope at the edge of total reflection has no bound.
            if t2.abs() > 1e-3 {
                let found = text.call::<f32>("glass", &[&[c], &[ior]])[0];
                worst.add((exact - found).abs(), || format!("ior {ior}, cosine {c}"));
            }
        }
    }
    worst.at_most(1e-6, "6", "fresnel_dielectric", "error next to ior 1");
}

#[test]
fn total_reflection_reflects_all_from_its_edge_on() {
    let text = Text::new(FUNCTIONS);
    let mut worst = Worst::none();
    for ior in [1.1f64, 1.33, 1.5, 2.4] {
        let edge = (1.0 - 1.0 / (ior * ior)).sqrt();
        for below in [1e-6, 1e-4, 0.5 * edge, edge - 1e-4] {
            let c = -(edge - below).max(1e-6);
            let (a, b) = both(&text, "glass", &[&[c], &[ior]]);
            worst.add((1.0 - a[0]).abs().max((1.0 - b[0]).abs()), || {
                format!("ior {ior} at {c}")
            });
        }
        // Within rounding of the edge there is either answer, but never another.
        for ulps in -8..=8 {
            let c = -f64::from(edge as f32) - f64::from(ulps) * 6e-8;
            let r = text.call::<f32>("glass", &[&[c], &[ior]])[0];
            let fine = (0.98..=1.0).contains(&r);
            worst.add(f64::from(u8::from(!fine)), || {
                format!("ior {ior} at {c}: {r}")
            });
        }
    }
    worst.at_most(
        1e-6,
        "8",
        "fresnel_dielectric",
        "what total reflection lacks of 1",
    );
}

#[test]
fn metals_reflect_between_0_and_1_at_their_ends() {
    let text = Text::new(FUNCTIONS);
    let mut worst = Worst::none();
    for ior in [0.0, 1e-6, 0.05, 1.0, 1.0 + 1e-7, 10.0, 1e6] {
        for k in [0.0, 1e-6, 1.0, 10.0, 1e6] {
            for c in [0.0, 1e-7, 1e-3, 0.5, 1.0, -1.0, 1.0 + 1e-7] {
                let (a, b) = both(&text, "metal", &[&[c], &[ior], &[k]]);
                let outside = |r: f64| {
                    if r.is_finite() {
                        (r - 1.0).max(-r)
                    } else {
                        r.abs()
                    }
                };
                worst.add(outside(a[0]).max(outside(b[0])), || {
                    format!("{ior} + {k}i at {c}")
                });
            }
        }
    }
    worst.at_most(0.0, "9", "fresnel_conductor", "how far outside of [0, 1]");
}

#[test]
fn functions_are_defined_outside_of_their_domains() {
    let text = Text::new(FUNCTIONS);
    let mut worst = Worst::none();
    for x in [0.0, -0.0, -2.5, 1.0, 1e-40, 3e38, -3e38] {
        for y in [0.0, -0.0, 0.5, -3.0, 1e-40, 3e38] {
            let (a, b) = both(&text, "odd", &[&[x], &[y]]);
            let expected = if y == 0.0 { Some(1.0) } else { None };
            let fine = b[0].is_finite() && b[3].is_finite() && !b[2].is_nan() && !b[1].is_nan();
            let defined =
                expected.is_none_or(|p| a[0] == p && b[0] == p) && a.iter().all(|v| !v.is_nan());
            worst.add(f64::from(u8::from(!fine || !defined)), || {
                format!("{x}, {y}: {a:?}, {b:?}")
            });
        }
    }
    let zero = both(&text, "unit", &[&[0.0; 3]]);
    worst.add(length(&zero.0) + length(&zero.1), || {
        "normalize(0)".to_owned()
    });
    worst.at_most(
        0.0,
        "13",
        "pow, /, atan2, sqrt, normalize",
        "undefined answers",
    );
}

#[test]
fn frames_and_normals_hold_where_there_is_none() {
    let text = Text::new(FUNCTIONS);
    let mut n = Numbers::new(14);
    let down = [
        [0.0, 0.0, -1.0],
        [1e-7, 0.0, -1.0],
        [0.0, -1e-4, -1.0],
        [0.0, 0.0, 1.0],
    ];
    let mut normals: Vec<[f64; 3]> = down.to_vec();
    normals.extend((0..300).map(|_| single(n.direction())));
    let error = |f: &[f64]| {
        let rows = [&f[0..3], &f[3..6], &f[6..9]];
        let unit = rows.iter().map(|r| (dot(r, r) - 1.0).abs());
        let right = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| dot(rows[i], rows[j]).abs());
        unit.chain(right).fold(0.0, f64::max)
    };
    let (mut given, mut made) = (Worst::none(), Worst::none());
    for normal in normals {
        let f = text.call::<f32>("around", &[&normal]);
        made.add(error(&f), || format!("around {normal:?}"));
        for t in [
            [0.0; 3],
            normal,
            normal.map(|x| -x),
            n.direction().map(|x| 1e-6 * x),
        ] {
            let f = text.call::<f32>("along", &[&normal, &t]);
            given.add(error(&f), || format!("around {normal:?}, tangent {t:?}"));
        }
    }
    given.at_most(1e-6, "14", "frame", "what lacks to an orthonormal frame");
    made.at_most(
        1e-6,
        "15",
        "frame_around",
        "what lacks to an orthonormal frame",
    );
}

#[test]
fn shading_normals_that_look_away_are_of_use_all_the_same() {
    let text = Text::new(FUNCTIONS);
    let mut n = Numbers::new(16);
    let up = [0.0, 0.0, 1.0];
    let mut worst = Worst::none();
    for i in 0..2000 {
        let shading = if i == 0 { [0.0; 3] } else { n.direction() };
        let wo = single(direction(
            n.between(1e-3, 1.0),
            n.between(0.0, std::f64::consts::TAU),
        ));
        let used = text.call::<f32>("useful", &[&shading, &up, &wo]);
        // Seen from the front, and what it mirrors leaves the surface: else it would be black.
        let seen = dot(&used, &wo) > 0.0 && reflect(&wo, &used)[2] > 0.0;
        let unit = (length(&used) - 1.0).abs() < 1e-5;
        worst.add(f64::from(u8::from(!seen || !unit)), || {
            format!("{shading:?} from {wo:?}: {used:?}")
        });
    }
    worst.at_most(0.0, "16", "valid_normal", "normals that would be black");
}

#[test]
fn noise_far_from_the_origin_is_still_noise() {
    let text = Text::new(FUNCTIONS);
    for (name, far) in [
        ("rough", 1e5),
        ("steps", 1e5),
        ("steps", 1e9),
        ("deep", 1e5),
        ("rough", 1e9),
        ("deep", 1e9),
    ] {
        let mut n = Numbers::new(21);
        let (mut sum, mut squares, mut outside) = (0.0, 0.0, 0);
        let count = 400;
        for _ in 0..count {
            let p = [0.0; 3].map(|_: f64| far * n.between(0.5, 1.0));
            let x = text.call::<f32>(name, &[&p])[0];
            outside += usize::from(x.abs() > 4.0 || x.is_nan());
            (sum, squares) = (sum + x, squares + x * x);
        }
        let mean = sum / f64::from(count);
        let variance = squares / f64::from(count) - mean * mean;
        let place = format!("{name} at {far:e}: mean {mean:.3}, {outside} out of range");
        let of = format!("{name} at {far:e}");
        // Beyond 2^24 single precision has no fraction left, and gradient noise is 0 at corners.
        let least = if far > 1e7 && name != "steps" {
            0.0
        } else {
            1e-3
        };
        let worst = if outside == 0 { variance } else { f64::NAN };
        let row = Row {
            table: "21",
            subject: &of,
            what: "variance",
            worst,
            bound: Bound::AtLeast(least),
            place: &place,
        };
        assert!(row.note(), "{place}, variance {variance}");
    }
}

#[test]
fn white_surfaces_of_roughness_1_keep_their_light() {
    let kept = |name: &str, call: &str, degrees: f64| {
        let bsdf = bsdf_with(name, call);
        let d = distribution(&bsdf, &bsdf.cases[0], view(degrees));
        let mut n = Numbers::new(26);
        let u: Vec<[f64; 4]> = (0..1 << 14).map(|_| n.four()).collect();
        let wi: Vec<[f64; 3]> = (d.sample)(&u)
            .expect("directions")
            .into_iter()
            .filter(|w| *w != [0.0; 3])
            .collect();
        (d.measure)(&wi)
            .expect("densities")
            .iter()
            .map(|m| m[1] / m[0])
            .sum::<f64>()
            / f64::from(1 << 14)
    };
    for (name, call) in [
        ("metal", "reflectance: 1.0, edge: 1.0, roughness: 1"),
        (
            "conductor",
            "ior: color(1e-6), extinction: color(5), roughness: 1",
        ),
        ("generalized_schlick", "color0: 1, roughness: 1"),
        ("retroreflective", "color: 1.0, roughness: 1"),
        ("dielectric", "roughness: 1"),
        ("thin_dielectric", "roughness: 1"),
        ("oren_nayar_diffuse", "color: 1.0, roughness: 1"),
    ] {
        let views = [0.0, 30.0, 60.0, 80.0, 89.0];
        let all = views.map(|degrees| kept(name, call, degrees));
        let least = all.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        let place = format!("{call}: {all:?} from {views:?}");
        let row = Row {
            table: "26",
            subject: name,
            what: "least that is kept of 1",
            worst: least,
            bound: Bound::AtLeast(0.99),
            place: &place,
        };
        assert!(row.note(), "{name}: {place}");
    }
    // Single facets alone keep 1 - ln 2 seen from straight above, in closed form.
    let single = "color0: 0.001, color90: 0.001, roughness: 1";
    let found = kept("generalized_schlick", single, 0.0) / 0.001;
    let mut worst = Worst::none();
    worst.add((found - (1.0 - 2.0f64.ln())).abs(), || {
        format!("{single}: {found}")
    });
    worst.at_most(
        0.01,
        "26",
        "single facets",
        "difference from 1 - ln 2 seen from above",
    );
}

/// What a surface written in Impasto reflects in each channel, and how many lobes it has.
fn seen(uses: &str, surface: &str, wo: [f64; 3]) -> Result<([f64; 4], usize), String> {
    let mut files = MemoryLoader::default();
    let text = format!("use std::bsdf::{{{uses}}};\nmaterial m {{ surface = {surface}; }}");
    files.add("m.impasto", text);
    let compiled = compile(&[MaterialRequest::new("m", "m.impasto")], &mut files);
    let Some(program) = compiled.program else {
        return Err(diag::render::text(
            &compiled.sources,
            &compiled.diagnostics,
            false,
        ));
    };
    let at = [
        0.1, 0.2, 0.3, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.4, 0.6, 1.0,
    ];
    let wl = single(direction(0.6, 2.1));
    let numbers = [wo.as_slice(), &wl, &[0.3, 0.6, 0.2, 0.8]];
    let mut args = vec![lanes::uniform(&at)];
    args.extend(numbers.map(lanes::uniform));
    let out: Lanes = lanes::run(program.ir(), &program.compiled()[0].evaluate, args);
    // `light_pdf` and `light_throughput` of `MaterialSample`, flattened.
    let light = std::array::from_fn(|c| lanes::float_at(&out, 7 + c, 0));
    Ok((light, program.infos()[0].lobes))
}

#[test]
fn weights_of_exactly_0_and_1_leave_a_lobe_out() {
    let uses = "diffuse, metal, mirror";
    let mut worst = Worst::none();
    for (with, without) in [
        ("mix(diffuse(0.5), metal(), 0.0)", "diffuse(0.5)"),
        ("mix(diffuse(0.5), metal(), 1.0)", "metal()"),
        ("layer(0.0 * metal(), diffuse(0.5))", "diffuse(0.5)"),
        ("layer(0.0 * mirror(), diffuse(0.5))", "diffuse(0.5)"),
        ("1.0 * metal()", "metal()"),
    ] {
        for degrees in [0.0, 60.0, 89.0] {
            let wo = single(view(degrees));
            let (a, _) = seen(uses, with, wo).expect("compiles");
            let (b, _) = seen(uses, without, wo).expect("compiles");
            let apart = (0..4).map(|c| (a[c] - b[c]).abs() / b[c].abs().max(1e-3));
            worst.add(apart.fold(0.0, f64::max), || {
                format!("{with} from {degrees}")
            });
        }
    }
    worst.at_most(
        1e-12,
        "27",
        "mix, layer, weights",
        "difference to the same without the lobe",
    );
}

#[test]
fn deep_nests_of_layers_are_answered_or_refused() {
    let mut worst = Worst::none();
    for depth in [1usize, 2, 4, 8, 16, 32, 64, 65, 200] {
        let open: String = (0..depth - 1).map(|_| "layer(0.1 * metal(), ").collect();
        let surface = format!("{open}diffuse(0.5){}", ")".repeat(depth - 1));
        let answer = seen("diffuse, metal", &surface, single(view(30.0)));
        let good = match &answer {
            Ok((light, lobes)) => {
                *lobes == depth && light.iter().all(|x| x.is_finite() && *x > 0.0)
            }
            // A limit is an error that says so.
            Err(text) => depth > 16 && text.contains("error[E"),
        };
        worst.add(f64::from(u8::from(!good)), || {
            format!("{depth} layers: {answer:?}")
        });
    }
    worst.at_most(
        0.0,
        "30",
        "layer",
        "nests that are neither answered nor refused",
    );
}
