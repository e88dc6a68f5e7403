//! What a material assigns beside its surface: opacity, emission under a coat, and an interior; as
//! the compiled functions answer and as the renderer is told.

use crate::common::asked::{Asked, direction, near, point4};
use impasto_compiler::MaterialRequest;
use impasto_compiler::abi::{Emission, Medium};
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;

/// The emission toward `wo` of the only material of a text.
fn emitted(m: &Asked, wo: [f64; 3]) -> Vec<f64> {
    let z = || Value::vector(&[0.0, 0.0, 1.0]);
    let point = Value::Struct(vec![
        Value::vector(&[0.3, -1.2, 0.7]),
        z(),
        z(),
        Value::vector(&[1.0, 0.0, 0.0]),
        Value::vector(&[0.4, 0.6]),
        Value::float(1.0),
    ]);
    let emission = m.program.compiled()[0].emission.as_ref().expect("emits");
    Interpreter::<f64>::new(m.program.ir(), 1 << 20)
        .run(emission, vec![point, Value::vector(&wo)])
        .expect("ends")
        .to_f64()
}

/// Reflectance of a smooth boundary, from Fresnel's equations as they are printed.
fn fresnel(cos_i: f64, n: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (n * n)).sqrt();
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (cos_t - n * cos_i) / (cos_t + n * cos_i);
    (s * s + p * p) / 2.0
}

#[test]
fn opacity_mixes_with_what_is_behind() {
    let m = Asked::material(
        "use std::bsdf::diffuse;
        material m { surface = diffuse(0.6); opacity = 0.3; }",
    );
    let wo = direction(40.0, 0.7);
    let (mut through, mut reflected) = (0.0, 0.0);
    const N: usize = 4000;
    for i in 0..N {
        let answer = m.ask(wo, [0.0; 3], point4(i));
        if answer.pdf == 0.0 {
            (0..3).for_each(|c| near(answer.wi[c], -wo[c], 1e-12, "straight on"));
            through += answer.throughput[0];
        } else {
            assert!(answer.wi[2] > 0.0);
            reflected += answer.throughput[0];
        }
    }
    near(through / N as f64, 0.7, 0.002, "light that passes");
    near(
        reflected / N as f64,
        0.3 * 0.6,
        0.002,
        "light that is reflected",
    );
    let light = m.ask(wo, direction(20.0, 0.0), [0.5; 4]).light_throughput[1];
    let cos = 20f64.to_radians().cos();
    near(
        light,
        0.3 * 0.6 * cos / std::f64::consts::PI,
        1e-12,
        "toward a light",
    );
}

#[test]
fn opaque_and_absent_surfaces_are_exact() {
    let uses = "use std::bsdf::diffuse;";
    let whole = Asked::material(&format!(
        "{uses} material m {{ surface = diffuse(0.6); opacity = 1.0; }}"
    ));
    let plain = Asked::material(&format!("{uses} material m {{ surface = diffuse(0.6); }}"));
    assert_eq!(whole.program.wgsl(&[0]), plain.program.wgsl(&[0]));
    let gone = Asked::material(&format!(
        "{uses} material m {{ surface = diffuse(0.6); opacity = 0.0; }}"
    ));
    let info = &gone.program.infos()[0];
    assert!(info.delta_only && info.lobes == 1, "{info:?}");
    let answer = gone.ask(direction(10.0, 0.0), [0.0; 3], [0.9; 4]);
    assert_eq!(answer.throughput, [1.0; 3]);
}

#[test]
fn opacity_dims_emission_too() {
    let m = Asked::material(
        "use std::edf::uniform;
        material m { emission = uniform(4.0); opacity = 0.25; }",
    );
    assert_eq!(emitted(&m, direction(30.0, 0.0)), [1.0; 3]);
    assert_eq!(
        m.program.instances()[0].info.emission,
        Emission::Uniform([1.0; 3])
    );
    let passed = m.sampled_albedo(direction(30.0, 0.0), 1);
    assert_eq!(passed, [0.75; 3], "light from behind");
}

#[test]
fn a_coat_dims_the_emission_under_it() {
    let m = Asked::material(
        "use std::bsdf::mirror; use std::edf::uniform;
        material m { emission = layer(0.5 * mirror(1.5), mirror(1.5), uniform(3.0)); }",
    );
    for angle in [0.0f64, 45.0, 80.0] {
        let r = fresnel(angle.to_radians().cos(), 1.5);
        let expected = 3.0 * (1.0 - 0.5 * r) * (1.0 - r);
        near(
            emitted(&m, direction(angle, 1.0))[0],
            expected,
            1e-9,
            "emission",
        );
    }
    assert_eq!(emitted(&m, [0.0, 0.6, -0.8]), [0.0; 3], "behind");
    assert_eq!(m.program.instances()[0].info.emission, Emission::Varying);
}

const GLASS: &str = "use std::bsdf::smooth_dielectric;
    material m {
        param tint: color = color(1.0, 2.0, 4.0);
        param n: float = 1.5;
        surface = smooth_dielectric(n / exterior_ior);
        interior = medium(absorption: tint * 3.0, ior: n, priority: 2);
    }";

#[test]
fn an_interior_is_numbers_for_each_instance() {
    let mut files = impasto_compiler::MemoryLoader::default();
    files.add("glass.impasto", GLASS);
    let mut requests = vec![MaterialRequest::new("a", "glass.impasto"); 2];
    requests[1].params = vec![
        ("n".into(), "1.25".into()),
        ("tint".into(), "color(0)".into()),
    ];
    let program = impasto_compiler::compile(&requests, &mut files)
        .program
        .expect("compiles");
    let media: Vec<Option<Medium>> = program.instances().iter().map(|i| i.info.medium).collect();
    let medium = |absorption: [f32; 3], ior: f32| {
        Some(Medium {
            absorption,
            ior,
            priority: 2,
            ..Medium::AIR
        })
    };
    assert_eq!(
        media,
        [medium([3.0, 6.0, 12.0], 1.5), medium([0.0; 3], 1.25)]
    );
    assert!(program.infos()[0].transmissive && program.infos()[0].crosses);
}

#[test]
fn only_an_interior_changes_the_medium() {
    let thin = Asked::new(
        "use std::bsdf::smooth_dielectric;",
        "smooth_dielectric(1.5)",
    );
    let info = &thin.program.infos()[0];
    assert!(info.crosses && !info.transmissive);
    let solid = Asked::material(GLASS);
    for (wo, inside) in [(direction(20.0, 0.3), 1.0), ([0.0, 0.6, -0.8], -1.0)] {
        let mut crossed = 0;
        for i in 0..500 {
            let (a, b) = (
                thin.ask(wo, [0.0; 3], point4(i)),
                solid.ask(wo, [0.0; 3], point4(i)),
            );
            assert_eq!(a.wi, b.wi);
            assert_eq!(a.transmitted, 0.0);
            let across = b.wi[2] * inside < 0.0;
            assert_eq!(b.transmitted, f64::from(u8::from(across)), "{b:?}");
            crossed += u32::from(across);
        }
        assert!(crossed > 300, "{crossed} of 500 go through");
    }
}

#[test]
fn a_gap_leads_into_no_medium() {
    let text = GLASS.replace("surface =", "opacity = 0.5; surface =");
    let m = Asked::material(&text);
    let wo = direction(20.0, 0.3);
    let (mut gaps, mut entered) = (0, 0);
    for i in 0..2000 {
        let answer = m.ask(wo, [0.0; 3], point4(i));
        let straight = (answer.wi[2] + wo[2]).abs() < 1e-12;
        if straight {
            assert_eq!(answer.transmitted, 0.0);
            gaps += 1;
        }
        entered += u32::from(answer.transmitted == 1.0);
    }
    near(f64::from(gaps) / 2000.0, 0.5, 0.02, "gaps");
    near(f64::from(entered) / 2000.0, 0.48, 0.02, "light that enters");
}
