//! OpenPBR against what its specification says, by formulas that are written again here, and against
//! the same layers written by hand.

use std::f64::consts::{PI, TAU};

use impasto_compiler::cost::{self, Inputs};
use impasto_compiler::inspect::At;
use impasto_compiler::{
    MaterialRequest, MemoryLoader, Parameters, Program, codegen, compile, diag,
};

use super::known::assert_near;
use super::lanes;
use super::materials::{LIGHT_PDF, LIGHT_THROUGHPUT, answers, point, reflected};
use super::sampling::view;
use super::surfaces::set;
use super::text::Text;
use impasto_verify::drawn::Setting;
use impasto_verify::statistics::{Numbers, direction};

/// Two lobes as a person would write them who needs no more.
const BY_HAND: &str = include_str!("two_lobes.impasto");

fn params(list: &[(&str, &str)]) -> Vec<Setting> {
    let owned = |(n, v): &(&str, &str)| ((*n).to_owned(), (*v).to_owned());
    list.iter().map(owned).collect()
}

fn open_pbr(list: &[(&str, &str)]) -> Program {
    set("open_pbr", &params(list))
}

/// The only material of a text.
pub fn written(text: &str) -> Program {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let request = MaterialRequest {
        parameters: Parameters::Baked,
        ..MaterialRequest::new("m", "m.impasto")
    };
    let compiled = compile(&[request], &mut files);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled.program.unwrap_or_else(|| panic!("{problems}"))
}

/// A material of one closure.
fn closure(uses: &str, surface: &str) -> Program {
    written(&format!(
        "use std::bsdf::{{{uses}}};\nmaterial m {{ surface = {surface}; }}"
    ))
}

pub fn here() -> Vec<f64> {
    point([0.1, 0.2, 0.3], [0.4, 0.6])
}

/// Value toward a light and density there.
fn toward(p: &Program, wo: [f64; 3], wl: [f64; 3]) -> [f64; 4] {
    let found = answers::<f64>(p, &here(), wo, &[wl], &[[0.4, 0.3, 0.6, 0.2]]);
    [
        lanes::float_at(&found, LIGHT_PDF, 0),
        lanes::float_at(&found, LIGHT_THROUGHPUT, 0),
        lanes::float_at(&found, LIGHT_THROUGHPUT + 1, 0),
        lanes::float_at(&found, LIGHT_THROUGHPUT + 2, 0),
    ]
}

/// Both materials answer the same, sampled and toward lights, to within `relative`.
pub fn same(a: &Program, b: &Program, relative: f64) {
    let mut n = Numbers::new(3);
    for i in 0..200 {
        let wo = direction(n.between(0.05, 1.0), n.between(0.0, TAU));
        let (wl, u) = (n.direction(), n.four());
        let x = answers::<f64>(a, &here(), wo, &[wl], &[u]);
        let y = answers::<f64>(b, &here(), wo, &[wl], &[u]);
        for c in 0..LIGHT_THROUGHPUT + 3 {
            let (x, y) = (lanes::float_at(&x, c, 0), lanes::float_at(&y, c, 0));
            let scale = x.abs().max(y.abs()).max(1e-3);
            assert!(
                (x - y).abs() <= relative * scale,
                "answer {c} of sample {i}: {x} and {y}"
            );
        }
    }
}

/// Mean operations of one evaluation.
fn operations(p: &Program) -> f64 {
    let mut inputs = Inputs::new(0);
    let points: Vec<(usize, At)> = (0..256).map(|_| (0, inputs.anywhere())).collect();
    let found = cost::vector(p, 0, &points);
    found.expect("there are inputs").operations.mean
}

#[test]
fn base_and_specular_are_the_layer_written_by_hand() {
    let model = open_pbr(&[]);
    let by_hand = written(BY_HAND);
    assert_eq!(model.compiled()[0].info.lobes, 2);
    same(&model, &by_hand, 1e-6);
    let ratio = operations(&model) / operations(&by_hand);
    assert!((0.95..=1.05).contains(&ratio), "{ratio} times the cost");
}

#[test]
fn what_an_instance_switches_off_is_gone() {
    let lobes = |list: &[(&str, &str)]| open_pbr(list).compiled()[0].info.lobes;
    assert_eq!(lobes(&[("base_metalness", "1")]), 1);
    assert_eq!(lobes(&[("transmission_weight", "1")]), 1);
    assert_eq!(lobes(&[("coat_weight", "1")]), 3);
    assert_eq!(lobes(&[("specular_weight", "0"), ("fuzz_weight", "1")]), 3);
    let split = [
        ("transmission_weight", "1"),
        ("transmission_dispersion_scale", "0.5"),
    ];
    assert_eq!(lobes(&split), 3);
}

#[test]
fn slabs_are_mixed_by_their_weights() {
    let model = open_pbr(&[
        ("base_weight", "0.9"),
        ("base_metalness", "0.3"),
        ("transmission_weight", "0.6"),
        ("subsurface_weight", "0.4"),
        ("subsurface_radius", "0 m"),
        ("subsurface_color", "color(0.9, 0.5, 0.3)"),
        ("subsurface_scatter_anisotropy", "0.2"),
        ("specular_color", "color(0.9, 0.8, 0.7)"),
        ("transmission_color", "color(0.4, 0.6, 0.8)"),
        ("geometry_opacity", "0.75"),
    ]);
    let by_hand = written(
        "use std::bsdf::{coating, dielectric, diffuse, generalized_schlick, subsurface};
        material m {
            let tint = color(0.9, 0.8, 0.7);
            let below = subsurface(color: color(0.9, 0.5, 0.3), anisotropy: 0.2);
            let gloss = coating(ior: 1.5, roughness: 0.3, tint: tint);
            let opaque = layer(gloss, mix(0.9 * diffuse(0.8), below, 0.4));
            let glass = dielectric(
                ior: 1.5,
                roughness: 0.3,
                tint: color(0.4, 0.6, 0.8),
                reflection_tint: tint,
            );
            let metal = generalized_schlick(color0: color(0.72), color82: tint, roughness: 0.3);
            surface = mix(mix(opaque, glass, 0.6), metal, 0.3);
            interior = medium(ior: 1.5);
            opacity = 0.75;
        }",
    );
    same(&model, &by_hand, 1e-5);
}

#[test]
fn light_from_below_goes_through_the_coat_once() {
    let model = open_pbr(&[
        ("emission_luminance", "10"),
        ("emission_color", "color(1, 0.5, 0.25)"),
        ("coat_weight", "0.6"),
        ("coat_color", "color(0.9, 0.5, 0.1)"),
    ]);
    let emission = model.compiled()[0].emission.as_ref().expect("it emits");
    for degrees in [0.0, 50.0] {
        let wo = view(degrees);
        let args = vec![lanes::uniform(&here()), lanes::uniform(&wo)];
        let found = lanes::run::<f64>(model.ir(), emission, args);
        let below = (1.0 - (1.0 - wo[2] * wo[2]) / (1.6 * 1.6)).sqrt();
        for (c, (hue, left)) in [(1.0, 0.9f64), (0.5, 0.5), (0.25, 0.1)]
            .into_iter()
            .enumerate()
        {
            let through = (1.0 - fresnel(wo[2], 1.6)) * left.powf(0.5 / below);
            let exact = 10.0 * hue * (0.4 + 0.6 * through);
            assert_near(lanes::float_at(&found, c, 0), exact, 3e-3, "the emission");
        }
    }
}

#[test]
fn films_that_are_not_there_leave_no_code() {
    let text = |list: &[(&str, &str)]| codegen::module(&open_pbr(list), &[0]);
    assert!(!text(&[("coat_weight", "1")]).contains("spectral_wave"));
    assert!(text(&[("thin_film_weight", "0.5")]).contains("spectral_wave"));
}

#[test]
fn car_paint_is_short() {
    let values = [
        ("base_color", "color(0.1, 0.6, 0.9)"),
        ("specular_ior", "1.6"),
        ("coat_weight", "1"),
        ("coat_roughness", "0.02"),
    ];
    let lines = codegen::module(&open_pbr(&values), &[0]).lines().count();
    assert!(lines < 600, "{lines} lines of WGSL");
}

#[test]
fn metals_are_tinted_at_82_degrees() {
    let model = open_pbr(&[
        ("base_metalness", "1"),
        ("base_weight", "0.9"),
        ("base_color", "color(0.9, 0.6, 0.3)"),
        ("specular_color", "color(0.5, 0.8, 1.0)"),
        ("specular_roughness", "0.4"),
    ]);
    let by_hand = closure(
        "generalized_schlick",
        "generalized_schlick(color0: color(0.81, 0.54, 0.27), color82: color(0.5, 0.8, 1.0),
            roughness: 0.4)",
    );
    same(&model, &by_hand, 1e-6);
}

#[test]
fn anisotropy_keeps_the_mean_of_the_squared_roughness() {
    for (r, a) in [(0.5f64, 0.3f64), (0.4, 0.9), (0.6, 0.99)] {
        let along = r * r * (2.0 / (1.0 + (1.0 - a) * (1.0 - a))).sqrt();
        let across = (1.0 - a) * along;
        assert_near(
            along * along + across * across,
            2.0 * r.powi(4),
            1e-12,
            "the mean",
        );
        let model = open_pbr(&[
            ("base_metalness", "1"),
            ("specular_roughness", &r.to_string()),
            ("specular_roughness_anisotropy", &a.to_string()),
        ]);
        // What the library's own parameters must be to give these two.
        let by_hand = closure(
            "generalized_schlick",
            &format!(
                "generalized_schlick(color0: 0.8, roughness: {}, anisotropy: {})",
                (along * across).sqrt().sqrt(),
                (1.0 - across / along) / 0.9
            ),
        );
        same(&model, &by_hand, 1e-5);
    }
}

#[test]
fn weights_of_the_highlight_scale_it_head_on() {
    // 0.04 at an index of 1.5, times 0.25, is an index of (1 + 0.1) / (1 - 0.1).
    let less = open_pbr(&[("specular_weight", "0.25")]);
    let by_hand = closure(
        "coating, diffuse",
        "layer(coating(ior: 1.1 / 0.9, roughness: 0.3), diffuse(0.8))",
    );
    same(&less, &by_hand, 1e-5);
}

#[test]
fn rough_coats_roughen_what_is_below() {
    let model = open_pbr(&[
        ("base_metalness", "1"),
        ("specular_roughness", "0.3"),
        ("coat_weight", "1"),
        ("coat_roughness", "0.4"),
        ("coat_darkening", "0"),
    ]);
    let rough = (0.3f64.powi(4) + 2.0 * 0.4f64.powi(4)).powf(0.25);
    let by_hand = closure(
        "coating, generalized_schlick",
        &format!(
            "layer(coating(ior: 1.6, roughness: 0.4),
                generalized_schlick(color0: 0.8, roughness: {rough}))"
        ),
    );
    same(&model, &by_hand, 1e-5);
}

/// Fresnel's equations for a dielectric, as textbooks have them.
fn fresnel(cos_i: f64, n: f64) -> f64 {
    let sin_t = (1.0 - cos_i * cos_i).sqrt() / n;
    if sin_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin_t * sin_t).sqrt();
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (cos_t - n * cos_i) / (cos_t + n * cos_i);
    0.5 * (s * s + p * p)
}

/// Twice the integral of Fresnel's reflectance times the cosine.
fn average_fresnel(n: f64) -> f64 {
    const STEPS: usize = 4000;
    let at = |i: usize| (i as f64 + 0.5) / STEPS as f64;
    let sum: f64 = (0..STEPS).map(|i| 2.0 * at(i) * fresnel(at(i), n)).sum();
    sum / STEPS as f64
}

/// The specification's darkening of a base of albedo `e` by what comes back, the share `k`.
fn darkened(e: f64, k: f64) -> f64 {
    (1.0 - k) / (1.0 - e * k)
}

#[test]
fn coats_darken_diffuse_ground_as_the_specification_says() {
    for ior in [1.3, 1.6, 2.2] {
        let k = 1.0 - (1.0 - average_fresnel(ior)) / (ior * ior);
        for darkening in [0.0, 0.4, 1.0] {
            let model = open_pbr(&[
                ("base_color", "color(0.8, 0.3, 0.05)"),
                ("specular_weight", "0"),
                ("coat_weight", "1"),
                ("coat_ior", &ior.to_string()),
                ("coat_darkening", &darkening.to_string()),
            ]);
            // Far from the mirror direction, the coat itself reflects next to nothing.
            let (wo, wl) = (view(35.0), direction(0.5, 1.9));
            let found = toward(&model, wo, wl);
            for (c, albedo) in [0.8, 0.3, 0.05].into_iter().enumerate() {
                let kept = 1.0 + (darkened(albedo, k) - 1.0) * darkening;
                let exact = albedo / PI * 0.5 * (1.0 - fresnel(wo[2], ior)) * kept;
                let what = format!("index {ior}, darkening {darkening}, channel {c}");
                assert_near(found[c + 1], exact, 6e-3, &what);
            }
        }
    }
}

#[test]
fn coats_darken_mirrors_by_their_own_reflectance() {
    let model = open_pbr(&[
        ("base_metalness", "1"),
        ("base_color", "color(0.8, 0.5, 0.2)"),
        ("specular_roughness", "0"),
        ("coat_weight", "1"),
    ]);
    let found = reflected(&model, &here(), view(0.0), 4096);
    let f = fresnel(1.0, 1.6);
    for (c, albedo) in [0.8, 0.5, 0.2].into_iter().enumerate() {
        let exact = f + (1.0 - f) * albedo * darkened(albedo, f);
        assert_near(found[c], exact, 1e-2, &format!("channel {c}"));
    }
}

#[test]
fn coats_absorb_more_at_a_slant() {
    let model = open_pbr(&[
        ("base_color", "color(0.8)"),
        ("specular_weight", "0"),
        ("coat_weight", "1"),
        ("coat_darkening", "0"),
        ("coat_color", "color(0.9, 0.5, 0.1)"),
    ]);
    for degrees in [0.0f64, 40.0, 75.0] {
        let (wo, wl) = (view(degrees), direction(0.4, 3.6));
        let found = toward(&model, wo, wl);
        let below = (1.0 - (1.0 - wo[2] * wo[2]) / (1.6 * 1.6)).sqrt();
        for (c, left) in [0.9f64, 0.5, 0.1].into_iter().enumerate() {
            let plain = 0.8 / PI * 0.4 * (1.0 - fresnel(wo[2], 1.6));
            let what = format!("{degrees} degrees, channel {c}");
            assert_near(found[c + 1], plain * left.powf(1.0 / below), 3e-3, &what);
        }
    }
}

#[test]
fn fuzz_does_not_tint_what_is_below() {
    let fuzzy = |color: &str, base: &str| {
        open_pbr(&[
            ("specular_weight", "0"),
            ("fuzz_weight", "0.7"),
            ("fuzz_color", color),
            ("base_color", base),
        ])
    };
    let (wo, wl) = (view(65.0), direction(0.6, 2.0));
    let stopped = reflected(&fuzzy("color(1)", "color(0)"), &here(), wo, 1 << 14)[0];
    let black = toward(&fuzzy("color(0)", "color(0.8, 0.4, 0.2)"), wo, wl);
    for (c, albedo) in [0.8, 0.4, 0.2].into_iter().enumerate() {
        let exact = (1.0 - stopped) * albedo / PI * 0.6;
        assert_near(black[c + 1], exact, 1e-2, &format!("channel {c}"));
    }
    let red = toward(&fuzzy("color(1, 0, 0)", "color(0.8, 0.4, 0.2)"), wo, wl);
    assert_near(red[2], black[2], 1e-9, "green under red fuzz");
}

#[test]
fn clear_glass_is_a_dielectric() {
    let model = open_pbr(&[("transmission_weight", "1"), ("specular_roughness", "0")]);
    let by_hand = closure("dielectric", "dielectric(ior: 1.5, roughness: 0.0)");
    same(&model, &by_hand, 1e-5);
    let medium = |list: &[(&str, &str)]| open_pbr(list).instances()[0].info.medium;
    assert!(medium(&[]).is_none());
    let walls = [
        ("transmission_weight", "1"),
        ("geometry_thin_walled", "true"),
    ];
    assert!(medium(&walls).is_none());
    let inked = medium(&[
        ("transmission_weight", "1"),
        ("transmission_color", "color(0.5, 0.25, 1.0)"),
        ("transmission_depth", "2 cm"),
        ("transmission_scatter", "color(0.1)"),
    ]);
    let inked = inked.expect("an interior");
    assert!(inked.scattering.iter().all(|s| (s - 5.0).abs() < 1e-4));
    // ln 2 / 2 cm less a tenth over 2 cm; blue would shine and is lifted to 0, the rest with it.
    let lost = [2.0f64.ln(), 4.0f64.ln(), 0.0].map(|x| x / 0.02);
    for (found, exact) in inked.absorption.iter().zip(lost) {
        assert!((f64::from(*found) - exact).abs() < 1e-2, "{inked:?}");
    }
}

#[test]
fn colors_are_split_by_cauchys_formula() {
    let text = Text::new(
        "use std::surface::dispersed_ior;
        fn split(n: float, s: float, v: float) -> color = dispersed_ior(n, s, v);",
    );
    for (n, scale, abbe) in [(1.5, 1.0, 20.0), (1.7, 0.5, 60.0)] {
        let found = text.call::<f64>("split", &[&[n], &[scale], &[abbe]]);
        // Micrometres; B from the Abbe number, A from the index at 587.6 nm.
        let inverse = |l: f64| 1.0 / (l * l);
        let b = (n - 1.0) * scale / (abbe * (inverse(0.4861) - inverse(0.6563)));
        let a = n - b * inverse(0.5876);
        for (found, wavelength) in found.iter().zip([0.6114, 0.5491, 0.4643]) {
            assert_near(*found, a + b * inverse(wavelength), 1e-4, "the index");
        }
    }
}

#[test]
fn thin_walls_let_diffuse_light_through() {
    for (g, through) in [("-1", 0.0), ("0", 0.5), ("0.5", 0.75), ("1", 1.0)] {
        let model = open_pbr(&[
            ("subsurface_weight", "1"),
            ("subsurface_color", "color(0.6)"),
            ("specular_weight", "0"),
            ("geometry_thin_walled", "true"),
            ("subsurface_scatter_anisotropy", g),
        ]);
        let wo = view(40.0);
        let (above, below) = (direction(0.5, 2.0), direction(-0.5, 2.0));
        let each = 0.6 / PI * 0.5;
        assert_near(
            toward(&model, wo, below)[1] + 1.0,
            1.0 + each * through,
            1e-6,
            "below",
        );
        let back = each * (1.0 - through);
        assert_near(
            toward(&model, wo, above)[1] + 1.0,
            1.0 + back,
            1e-6,
            "above",
        );
    }
}
