//! The functions of `std::core` that BSDFs and compiled materials stand on, against formulas
//! written down another way.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::ir::{FunctionId, Module, Type};
use impasto_compiler::{MemoryLoader, check, diag};

use super::cells::{self, Measures};
use super::lanes;
use super::sampling::{Distribution, examine};
use super::statistics::{Numbers, direction};

/// The IR of a text and what it reaches.
pub struct Text {
    pub module: Module,
}

impl Text {
    pub fn new(text: &str) -> Self {
        let mut files = MemoryLoader::default();
        files.add("t.impasto", text);
        let checked = check("t.impasto", &mut files);
        let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
        assert!(!diag::has_errors(&checked.diagnostics), "{problems}");
        Self { module: checked.ir }
    }

    pub fn id(&self, name: &str) -> FunctionId {
        let index = self.module.functions.iter().position(|f| f.name == name);
        FunctionId(index.unwrap_or_else(|| panic!("no function `{name}`")) as u32)
    }

    /// Calls a function with floats and vectors; the components of a struct come flattened.
    pub fn call<F: Real>(&self, name: &str, args: &[&[f64]]) -> Vec<f64> {
        let id = self.id(name);
        let params = self.module.functions[id.index()].params.iter();
        let typed = params.zip(args).map(|(p, v)| match p.ty {
            Type::Int => Value::Int(v[0] as i32),
            _ => Value::vector(v),
        });
        let mut run = Interpreter::<F>::new(&self.module, u64::MAX);
        flatten(&run.call(id, typed.collect()).expect("enough fuel"))
    }
}

fn flatten<F: Real>(value: &Value<F>) -> Vec<f64> {
    match value {
        Value::Struct(fields) => fields.iter().flat_map(flatten).collect(),
        Value::Int(i) => vec![f64::from(*i)],
        Value::Bool(b) => vec![f64::from(u8::from(*b))],
        value => value.to_f64(),
    }
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn length(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn reflect(wo: &[f64], n: &[f64]) -> Vec<f64> {
    let twice = 2.0 * dot(wo, n);
    wo.iter().zip(n).map(|(w, n)| twice * n - w).collect()
}

// ---- Fresnel -----------------------------------------------------------------------------

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

// ---- Frames and normals ------------------------------------------------------------------

const FRAMES: &str = "
    fn f(n: normal, t: vector) -> Frame = frame(n, t);
    fn round_trip(n: normal, t: vector, v: vector) -> vector {
        let f = frame(n, t);
        to_world(f, to_local(f, v))
    }
    fn v(n: normal, ng: normal, wo: vector) -> normal = valid_normal(n, ng, wo);
    fn ok(a: vector, b: vector, wo: vector, wi: vector, ng: normal) -> bool = transport_valid(a, b, wo, wi, ng);
";

/// Normals with trouble of their own, and others.
fn normals() -> Vec<[f64; 3]> {
    let mut n = Numbers::new(2);
    let mut normals = vec![
        [0.0, 0.0, -1.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
    ];
    normals.extend([1e-4, 1e-8, -1e-8].map(|e| [e, 0.0, -(1.0 - e * e).sqrt()]));
    normals.extend((0..500).map(|_| n.direction()));
    normals
}

#[test]
fn frames_are_orthonormal_around_any_normal_and_tangent() {
    let text = Text::new(FRAMES);
    let mut n = Numbers::new(3);
    for normal in normals() {
        let near = |e: f64| [normal[0] + e, normal[1] - e, normal[2]];
        let opposite = normal.map(|x| -x);
        let tangents = [
            [0.0; 3],
            normal,
            opposite,
            near(1e-3),
            near(1e-2),
            near(1e-7),
            n.direction(),
            n.direction().map(|x| 1e-4 * x),
        ];
        for t in tangents {
            let f = text.call::<f32>("f", &[&normal, &t]);
            let (x, y, z) = (&f[0..3], &f[3..6], &f[6..9]);
            for (a, b, expected) in [
                (x, x, 1.0),
                (y, y, 1.0),
                (z, z, 1.0),
                (x, y, 0.0),
                (y, z, 0.0),
                (z, x, 0.0),
            ] {
                assert!(
                    (dot(a, b) - expected).abs() < 1e-6,
                    "{normal:?}, {t:?}: {f:?}"
                );
            }
            let cross = [
                x[1] * y[2] - x[2] * y[1],
                x[2] * y[0] - x[0] * y[2],
                x[0] * y[1] - x[1] * y[0],
            ];
            assert!(dot(&cross, z) > 0.99, "{normal:?}, {t:?}: left-handed");
            assert!(
                dot(z, &normal) > 1.0 - 1e-6,
                "{normal:?}, {t:?}: z is not the normal"
            );
            // A tangent of use lies in the plane of x and z, on the side of x.
            let across = (1.0 - (dot(&t, &normal) / length(&t)).powi(2))
                .max(0.0)
                .sqrt();
            if across > 0.01 {
                assert!(
                    dot(y, &t).abs() < 1e-5 * length(&t) / across && dot(x, &t) > 0.0,
                    "{normal:?}, {t:?}: {f:?}"
                );
            }
            let v = n.direction();
            let back = text.call::<f64>("round_trip", &[&normal, &t, &v]);
            assert!((0..3).all(|c| (back[c] - v[c]).abs() < 1e-9));
        }
    }
}

#[test]
fn valid_normals_face_the_viewer_and_mirror_above_the_surface() {
    let text = Text::new(FRAMES);
    let mut n = Numbers::new(4);
    let mut kept = 0;
    for round in 0..20_000 {
        let geometric = if round % 7 == 0 {
            [0.0, 0.0, -1.0]
        } else {
            n.direction()
        };
        let mut wo = n.direction();
        if round % 5 == 0 {
            // Along the surface, to within a millionth.
            let d = dot(&wo, &geometric) - 1e-6;
            (0..3).for_each(|c| wo[c] -= d * geometric[c]);
            let l = length(&wo);
            wo = wo.map(|x| x / l);
        }
        let shading = match round % 11 {
            0 => [0.0; 3],
            1 => geometric.map(|x| -x),
            2 => wo.map(|x| -x),
            3 => geometric.map(|x| 5.0 * x),
            4 => [
                wo[1] * geometric[2] - wo[2] * geometric[1],
                wo[2] * geometric[0] - wo[0] * geometric[2],
                wo[0] * geometric[1] - wo[1] * geometric[0],
            ],
            _ => n.direction(),
        };
        let side = dot(&wo, &geometric).signum();
        let place = format!("n {shading:?}, ng {geometric:?}, wo {wo:?}");
        let found = text.call::<f32>("v", &[&shading, &geometric, &wo]);
        assert!(
            (length(&found) - 1.0).abs() < 1e-5,
            "{place}: {found:?} is not unit"
        );
        assert!(
            dot(&found, &wo) * side > 2e-4,
            "{place}: seen at {}",
            dot(&found, &wo) * side
        );
        let mirrored = reflect(&wo, &found);
        assert!(
            dot(&mirrored, &geometric) * side > 0.0,
            "{place}: mirrors below the surface"
        );

        // What was fine stays as it is.
        let l = length(&shading);
        let unit = shading.map(|x| if l > 0.0 { x / l } else { 0.0 });
        let mirrored = reflect(&wo, &unit);
        if dot(&unit, &wo) * side > 0.02 && dot(&mirrored, &geometric) * side > 0.02 {
            kept += 1;
            assert!(
                (0..3).all(|c| (found[c] - unit[c]).abs() < 1e-5),
                "{place}: changed to {found:?}"
            );
        }
        if l == 0.0 && dot(&wo, &geometric).abs() > 0.01 {
            assert!(
                (0..3).all(|c| (found[c] - geometric[c]).abs() < 1e-5),
                "{place}: not the geometric normal"
            );
        }
    }
    assert!(kept > 2000, "only {kept} normals were fine");
}

#[test]
fn a_valid_normal_moves_no_farther_than_it_must() {
    let text = Text::new(FRAMES);
    let (up, wo) = ([0.0, 0.0, 1.0], direction(0.3, 0.0));
    // Tilted away until the mirror direction sinks below the horizon: it stays just above.
    let mut last = f64::INFINITY;
    for i in 0..60 {
        let tilt = f64::from(i) * 0.02;
        let n = [-tilt.sin(), 0.0, tilt.cos()];
        let found = text.call::<f64>("v", &[&n, &up, &wo]);
        let height = reflect(&wo, &found)[2];
        assert!(
            height > 0.0 && height <= last + 1e-12,
            "a step at a tilt of {tilt}: {height} after {last}"
        );
        last = height;
    }
    assert!(
        last < 0.02,
        "the mirror direction stays {last} above the surface"
    );
}

#[test]
fn transport_is_valid_when_frame_and_geometry_agree() {
    let text = Text::new(FRAMES);
    let up = [0.0, 0.0, 1.0];
    let (above, below) = ([0.6, 0.0, 0.8], [0.6, 0.0, -0.8]);
    let ok = |local: [f64; 3], wi: [f64; 3]| {
        text.call::<f32>("ok", &[&above, &local, &above, &wi, &up])[0] == 1.0
    };
    assert!(ok(above, above), "reflected by both");
    assert!(ok(below, below), "passed by both");
    assert!(!ok(above, below), "reflected into the object");
    assert!(!ok(below, above), "passed to the outside");
    assert!(!ok([1.0, 0.0, 0.0], above), "on the horizon");
    assert!(!ok(above, [0.0; 3]), "failed");
}

// ---- Sampling ----------------------------------------------------------------------------

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
    let densities: [(&str, &dyn Fn(&[f64; 3]) -> f64); 5] = [
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
            let w = lanes::call(&text.module, id, vec![vec![column(0), column(1)]]);
            (0..u.len())
                .map(|l| std::array::from_fn(|c| lanes::float_at(&w, c, l)))
                .collect()
        };
        let measure = |w: &[[f64; 3]]| -> Vec<Measures> {
            w.iter().map(|w| [density(w), 0.0, 0.0, 0.0]).collect()
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

// ---- Microfacets -------------------------------------------------------------------------

const GGX: &str = "
    fn d(m: vector, alpha: vec2) -> float = ggx_d(m, alpha);
    fn alpha(roughness: float, anisotropy: float) -> vec2 = ggx_alpha(roughness, anisotropy);
    fn loss(z: float, a: float) -> float = ggx_loss(z, a);
    fn smooth(alpha: vec2) -> bool = is_smooth(alpha);
";

#[test]
fn facets_cover_the_surface_once() {
    let text = Text::new(GGX);
    let id = text.id("d");
    for alpha in [[1.0, 1.0], [0.3, 0.3], [0.05, 0.4], [0.01, 0.01]] {
        let measure = |m: &[[f64; 3]]| -> Vec<Measures> {
            let columns = (0..3)
                .map(|c| lanes::floats(m.iter().map(|m| m[c]).collect()))
                .collect();
            let d = lanes::call(&text.module, id, vec![columns, lanes::uniform(&alpha)]);
            let value = |(l, m): (usize, &[f64; 3])| {
                [lanes::float_at(&d, 0, l) * m[2].max(0.0), 0.0, 0.0, 0.0]
            };
            m.iter().enumerate().map(value).collect()
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
        let cells = cells::partition(&facets, 100);
        let sum: f64 = cells::integrate(&cells, &measure)
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
fn the_loss_of_single_scattering_matches_its_closed_form() {
    let text = Text::new(GGX);
    // Seen head-on at alpha 1: E = 1 - ln 2; the fit stays below the loss by at most 0.005.
    let loss = text.call::<f64>("loss", &[&[1.0], &[1.0]])[0];
    assert!((0.0..0.006).contains(&(2.0f64.ln() - loss)), "{loss}");
    for i in 0..=100 {
        for j in 0..=100 {
            let loss = text.call::<f32>(
                "loss",
                &[&[f64::from(i) * 0.01], &[1e-4f64.max(f64::from(j) * 0.01)]],
            )[0];
            assert!((0.0..0.75).contains(&loss), "{i}, {j}: {loss}");
        }
    }
}

// ---- Constants ---------------------------------------------------------------------------

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
