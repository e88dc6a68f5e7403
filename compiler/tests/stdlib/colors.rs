//! Colors: round trips between spaces, black bodies against Planck's law, metals against Fresnel.

use super::text::Text;
use impasto_verify::statistics::Numbers;

#[test]
fn spaces_are_left_as_they_were_entered() {
    let text = Text::new(
        "use std::color::{to_srgb, from_srgb, to_hsv, from_hsv, to_hsl, from_hsl, to_xyz, from_xyz};
         use std::color::{to_yuv, from_yuv, to_acescg, from_acescg, premultiply, unpremultiply};
         fn encoded(c: color) -> color = from_srgb(to_srgb(c));
         fn hsv(c: color) -> color = from_hsv(to_hsv(c));
         fn hsl(c: color) -> color = from_hsl(to_hsl(c));
         fn xyz(c: color) -> color = from_xyz(to_xyz(c));
         fn yuv(c: color) -> color = from_yuv(to_yuv(c));
         fn aces(c: color) -> color = from_acescg(to_acescg(c));
         fn alpha(c: color) -> color = unpremultiply(premultiply(c, 0.3), 0.3);",
    );
    let mut n = Numbers::new(1);
    for turn in 0..300 {
        let mut c: [f64; 3] = std::array::from_fn(|_| n.unit());
        // Grays, and colors with equal components, have a rule of their own.
        if turn % 5 == 0 {
            c[1] = c[0];
        }
        if turn % 10 == 0 {
            c[2] = c[0];
        }
        for space in ["encoded", "hsv", "hsl", "xyz", "yuv", "aces", "alpha"] {
            let back = text.call::<f64>(space, &[&c]);
            let off = back.iter().zip(&c).map(|(a, b)| (a - b).abs());
            let off = off.fold(0.0, f64::max);
            assert!(off < 2e-6, "{space} of {c:?}: {back:?}");
        }
    }
}

#[test]
fn colors_are_where_tables_have_them() {
    let text = Text::new(
        "use std::color::{to_srgb, to_hsv, from_hsv, to_hsl, to_xyz, to_acescg, saturation, adjust};
         use std::color::{blend, contrast, gamma, SCREEN, OVERLAY, DODGE, BURN, DIFFERENCE};
         fn encoded(c: color) -> color = to_srgb(c);
         fn hsv(c: color) -> vec3 = to_hsv(c);
         fn hsl(c: color) -> vec3 = to_hsl(c);
         fn xyz(c: color) -> vec3 = to_xyz(c);
         fn aces(c: color) -> color = to_acescg(c);
         fn gray(c: color) -> color = saturation(c, 0.0);
         fn turned(c: color) -> color = adjust(c, hue: 1.0 / 3.0);
         fn same(c: color) -> color = adjust(c);
         fn screen(c: color) -> color = blend(c, color(0.5), mode: SCREEN);
         fn overlay(c: color) -> color = blend(c, color(0.5, 0.2, 0.8), mode: OVERLAY);
         fn dodge(c: color) -> color = blend(c, color(0.5), mode: DODGE);
         fn burn(c: color) -> color = blend(c, color(0.5), mode: BURN);
         fn difference(c: color) -> color = blend(c, color(0.5), mode: DIFFERENCE, amount: 0.5);
         fn harder(c: color) -> color = contrast(c, 2.0);
         fn squared(c: color) -> color = gamma(c, 0.5);",
    );
    let c = [0.2, 0.6, 0.4];
    for (name, at, expected) in [
        ("encoded", [0.5, 0.002, 1.0], [0.735_357, 0.025_84, 1.0]),
        ("hsv", c, [5.0 / 12.0, 2.0 / 3.0, 0.6]),
        ("hsl", c, [5.0 / 12.0, 0.5, 0.4]),
        ("hsv", [1.0, 0.0, 0.5], [11.0 / 12.0, 1.0, 1.0]),
        // The white point of D65.
        ("xyz", [1.0; 3], [0.950_456, 1.0, 1.089_058]),
        ("aces", [1.0; 3], [1.0; 3]),
        ("gray", c, [0.500_52; 3]),
        ("turned", c, [0.4, 0.2, 0.6]),
        ("same", c, c),
        ("screen", c, [0.6, 0.8, 0.7]),
        ("overlay", c, [0.2, 0.36, 0.64]),
        ("dodge", c, [0.4, 1.0, 0.8]),
        ("burn", c, [0.0, 0.2, 0.0]),
        ("difference", c, [0.25, 0.35, 0.25]),
        ("harder", c, [-0.1, 0.7, 0.3]),
        ("squared", c, [0.04, 0.36, 0.16]),
    ] {
        let found = text.call::<f64>(name, &[&at]);
        let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        let off = off.fold(0.0, f64::max);
        assert!(
            off < 2e-5,
            "{name} of {at:?}: {found:?} instead of {expected:?}"
        );
    }
}

/// Planck's law by wavelength in nanometres, up to a factor.
fn planck(nm: f64, kelvin: f64) -> f64 {
    let x = 1.438_776_877e7 / (nm * kelvin);
    (nm / 1000.0).powi(-5) / x.exp_m1()
}

#[test]
fn black_bodies_have_the_color_of_plancks_law() {
    let text = Text::new(
        "use std::color::{blackbody, wavelength_xyz, from_xyz};
         fn glow(t: float) -> color = blackbody(t);
         fn matching(w: length) -> vec3 = wavelength_xyz(w);
         fn rgb(xyz: vec3) -> color = from_xyz(xyz);",
    );
    let curve: Vec<(f64, Vec<f64>)> = (360..830)
        .map(f64::from)
        .map(|nm| (nm, text.call::<f64>("matching", &[&[nm * 1e-9]])))
        .collect();
    for step in 0..=60 {
        let kelvin = 800.0 * 50f64.powf(f64::from(step) / 60.0);
        let mut xyz = [0.0; 3];
        for (nm, matching) in &curve {
            (0..3).for_each(|c| xyz[c] += matching[c] * planck(*nm, kelvin));
        }
        let expected = text.call::<f64>("rgb", &[&xyz.map(|x| x / xyz[1])]);
        let found = text.call::<f64>("glow", &[&[kelvin]]);
        for (found, expected) in found.iter().zip(&expected) {
            let off = (found - expected.max(0.0)).abs();
            assert!(off < 0.005, "{kelvin} K: {found} instead of {expected}");
        }
    }
}

#[test]
fn one_wavelength_is_seen_where_observers_see_it() {
    let text = Text::new(
        "use std::color::{wavelength_color, wavelength_xyz};
         fn seen(w: length) -> color = wavelength_color(w);
         fn matching(w: length) -> vec3 = wavelength_xyz(w);",
    );
    let brightest = |c: usize| {
        let by = |a: &i32, b: &i32| {
            let value = |nm: &i32| text.call::<f64>("seen", &[&[f64::from(*nm) * 1e-9]])[c];
            value(a).total_cmp(&value(b))
        };
        (380..780).max_by(by).expect("some wavelengths")
    };
    let peaks = [0, 1, 2].map(brightest);
    assert!(
        (595..620).contains(&peaks[0])
            && (530..550).contains(&peaks[1])
            && (440..460).contains(&peaks[2]),
        "{peaks:?}"
    );
    // CIE 1931, table: all three at 560 nm, within what the fit states.
    let found = text.call::<f64>("matching", &[&[560e-9]]);
    for (found, table) in found.iter().zip([0.5945, 0.9950, 0.0039]) {
        assert!((found - table).abs() < 0.03, "{found} instead of {table}");
    }
    let white: f64 = (380..780)
        .map(|nm| text.call::<f64>("matching", &[&[f64::from(nm) * 1e-9]])[1])
        .sum();
    assert!((white - 106.857).abs() < 1.0, "the sum of y is {white}");
}

#[test]
fn metals_by_their_colors_reflect_them() {
    let text = Text::new(
        "use std::color::{artistic_ior, ior_reflectivity, ior_edge_color, ArtisticIor};
         fn metal(r: color, g: color) -> ArtisticIor = artistic_ior(r, g);
         fn reflects(n: color, k: color) -> color = ior_reflectivity(n, k);
         fn edge(n: color, k: color) -> color = ior_edge_color(n, k);",
    );
    let mut n = Numbers::new(2);
    for _ in 0..300 {
        let r: [f64; 3] = std::array::from_fn(|_| n.between(0.02, 0.98));
        let g: [f64; 3] = std::array::from_fn(|_| n.unit());
        let metal = text.call::<f64>("metal", &[&r, &g]);
        let (index, extinction) = metal.split_at(3);
        let back = text.call::<f64>("reflects", &[index, extinction]);
        let edge = text.call::<f64>("edge", &[index, extinction]);
        for c in 0..3 {
            assert!((back[c] - r[c]).abs() < 1e-9, "{r:?}: {back:?}");
            assert!((edge[c] - g[c]).abs() < 1e-6, "{g:?}: {edge:?}");
        }
    }
    // Gold by its measured index at 650, 550 and 450 nm, as reflectance head-on.
    let gold = text.call::<f64>("reflects", &[&[0.18, 0.42, 1.37], &[3.42, 2.35, 1.77]]);
    for (found, expected) in gold.iter().zip([0.944, 0.771, 0.376]) {
        assert!((found - expected).abs() < 0.02, "{gold:?}");
    }
}
