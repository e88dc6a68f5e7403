//! The random walks between layers against what is known in closed form.

use crate::common::asked::near;
use impasto_compiler::oracle::{Estimate, Stack};
use impasto_compiler::{MaterialRequest, MemoryLoader, Program, compile};

const WALKS: u32 = 20_000;

/// The materials `top` and `bottom` of a text, in this order.
fn stack(text: &str) -> Program {
    let mut files = MemoryLoader::default();
    files.add("stack.impasto", text);
    let request = |name: &str| MaterialRequest {
        material: Some(name.into()),
        ..MaterialRequest::new(name, "stack.impasto")
    };
    let requests = [request("top"), request("bottom")];
    compile(&requests, &mut files).program.expect("compiles")
}

fn walk(program: &Program, cos_o: f64) -> Estimate {
    Stack::new(program, 0, 1)
        .albedo(cos_o, WALKS, 7)
        .expect("ends")
}

/// Within four standard errors, and these are small.
fn agrees(e: &Estimate, expected: [f64; 3], what: &str) {
    for (c, expected) in expected.into_iter().enumerate() {
        assert!(e.error[c] < 0.005, "{what}: {e:?}");
        near(e.mean[c], expected, 4.0 * e.error[c] + 1e-9, what);
    }
}

/// Reflectance of a smooth boundary, from Fresnel's equations as they are printed.
fn fresnel(cos_i: f64, n: f64) -> f64 {
    let sin2_t = (1.0 - cos_i * cos_i) / (n * n);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (cos_t - n * cos_i) / (cos_t + n * cos_i);
    (s * s + p * p) / 2.0
}

/// Share of diffuse light from inside that a smooth boundary of index `n` sends back.
fn internal_reflectance(n: f64) -> f64 {
    const STEPS: usize = 200_000;
    let cosines = (0..STEPS).map(|i| (i as f64 + 0.5) / STEPS as f64);
    cosines.map(|c| 2.0 * c * fresnel(c, 1.0 / n)).sum::<f64>() / STEPS as f64
}

#[test]
fn varnish_over_a_matte_ground_is_a_geometric_series() {
    // Light gets in, is scattered, and comes back to the ground each time it does not get out.
    let program = stack(
        "use std::bsdf::{diffuse, smooth_dielectric};
        material top { surface = smooth_dielectric(1.5); }
        material bottom { surface = diffuse(color(0.8, 0.3, 0.1)); }",
    );
    let inside = internal_reflectance(1.5);
    for cos_o in [1.0, 0.5, 0.1] {
        let r = fresnel(cos_o, 1.5);
        let expected =
            [0.8, 0.3, 0.1].map(|rho| r + (1.0 - r) * rho * (1.0 - inside) / (1.0 - rho * inside));
        agrees(&walk(&program, cos_o), expected, "varnish");
    }
    let other = Stack::new(&program, 0, 1).albedo(0.1, WALKS, 8);
    let other = other.expect("ends");
    assert_ne!(walk(&program, 0.1), other, "another seed walks other ways");
}

#[test]
fn nothing_is_lost_between_what_absorbs_nothing() {
    let program = stack(
        "use std::bsdf::{diffuse, smooth_dielectric};
        material top { surface = smooth_dielectric(1.9); }
        material bottom { surface = diffuse(1.0); }",
    );
    let e = walk(&program, 0.6);
    (0..3).for_each(|c| near(e.mean[c], 1.0, 4.0 * e.error[c] + 1e-6, "white under glass"));
}

#[test]
fn two_mirrors_are_plates_in_a_row() {
    // At one angle all passes see the same reflectances: R + T^2 r / (1 - R r).
    let program = stack(
        "use std::bsdf::{smooth_dielectric, specular};
        material top { surface = smooth_dielectric(1.5); }
        material bottom { surface = specular(0.7); }",
    );
    for cos_o in [1.0, 0.3] {
        let r = fresnel(cos_o, 1.5);
        let expected = r + (1.0 - r) * (1.0 - r) * 0.7 / (1.0 - r * 0.7);
        agrees(&walk(&program, cos_o), [expected; 3], "plates");
    }
}

#[test]
fn a_layer_alone_has_its_albedo() {
    let program = stack(
        "use std::bsdf::{diffuse, mirror};
        material top { surface = layer(mirror(1.5), diffuse(0.4)); }
        material bottom { surface = diffuse(0.0 + 0.3); }",
    );
    let e = Stack::single(&program, 0)
        .albedo(0.5, WALKS, 3)
        .expect("ends");
    let r = fresnel(0.5, 1.5);
    agrees(&e, [r + (1.0 - r) * 0.4; 3], "albedo scaling");
}
