//! Layering, lobe choice and densities of whole materials, run by the f64 interpreter.
//!
//! Each test compares what a compiled material samples with what it says it samples, or with
//! a closed form. A lobe that is lost, chosen with another probability than its density says, or
//! weighted wrongly fails here.

use crate::common::asked::{Asked, direction, near, point4};

const USES: &str = "use std::bsdf::{diffuse, specular, mirror, blinn_phong};";

#[test]
fn diffuse_gives_its_reflectance() {
    let m = Asked::new(USES, "diffuse(color(0.2, 0.5, 0.9))");
    let albedo = m.sampled_albedo(direction(40.0, 1.0), 64);
    for (a, b) in albedo.iter().zip([0.2, 0.5, 0.9]) {
        near(
            *a,
            b,
            1e-9,
            "every sample of diffuse has its reflectance as throughput",
        );
    }
}

#[test]
fn layer_passes_on_what_the_top_leaves() {
    // A discrete top of albedo 0.3 over a white-ish base: 0.3 + 0.7 * 0.5.
    let m = Asked::new(USES, "layer(specular(0.3), diffuse(0.5))");
    let albedo = m.sampled_albedo(direction(30.0, 0.4), 20_000);
    albedo
        .iter()
        .for_each(|a| near(*a, 0.3 + 0.7 * 0.5, 2e-3, "albedo of the layer"));
}

#[test]
fn three_layers_in_order() {
    let m = Asked::new(
        USES,
        "layer(specular(0.2), 0.5 * diffuse(0.4), diffuse(0.9))",
    );
    let below = 0.5 * 0.4 + (1.0 - 0.5 * 0.4) * 0.9;
    let albedo = m.sampled_albedo(direction(50.0, 2.0), 20_000);
    albedo
        .iter()
        .for_each(|a| near(*a, 0.2 + 0.8 * below, 3e-3, "albedo of three layers"));
}

/// A bsdf that reflects a tenth and passes 0.5, whatever that leaves.
const VEIL: &str = "
    delta bsdf veil(share: float) {
        eval(wo, wi) = color(share) when same_side(wo, wi);
        sample(wo, u) = reflect_z(wo);
        pdf(wo, wi) = 1.0 when same_side(wo, wi);
        albedo(wo) = color(share);
        passes(wo) = color(0.5, 0.25, 0.0);
    }";

#[test]
fn layers_pass_what_they_say() {
    let under = |tree: &str, expected: [f64; 3]| {
        let m = Asked::new(&format!("{USES}{VEIL}"), tree);
        let albedo = m.sampled_albedo(direction(30.0, 0.4), 20_000);
        for (a, b) in albedo.iter().zip(expected) {
            near(*a, b, 3e-3, tree);
        }
    };
    let of = |passed: [f64; 3], reflected: f64| passed.map(|p| reflected + p * 0.8);
    under("layer(veil(0.1), diffuse(0.8))", of([0.5, 0.25, 0.0], 0.1));
    // Without a reflection of its own, it shows in what lies under it.
    under("layer(veil(0.0), diffuse(0.8))", of([0.5, 0.25, 0.0], 0.0));
    // A weight is the share that is covered.
    let covered = [0.5, 0.25, 0.0].map(|p| 1.0 - 0.4 * (1.0 - p));
    under("layer(0.4 * veil(0.1), diffuse(0.8))", of(covered, 0.04));
    let twice = [0.25, 0.0625, 0.0];
    under("layer(veil(0.0), veil(0.0), diffuse(0.8))", of(twice, 0.0));
    let stacked = "layer(layer(veil(0.0), veil(0.0)), diffuse(0.8))";
    under(stacked, of(twice, 0.0));
    // Beside one that passes all that it leaves, 0.9.
    let mixed = [0.5, 0.25, 0.0].map(|p| 0.75 * p + 0.25 * 0.9);
    let tree = "layer(mix(veil(0.1), specular(0.1), 0.25), diffuse(0.8))";
    under(tree, of(mixed, 0.1));
}

/// A light that is behind the surface does not shine through where the normal is bent towards it.
#[test]
fn bent_normals_let_no_light_through_the_surface() {
    let bent = Asked::new(
        USES,
        "diffuse(0.8, normal: normalize(vector(0.6, 0.0, 0.8)))",
    );
    let wo = direction(20.0, 0.0);
    for (degrees, shines) in [(60.0, true), (85.0, true), (95.0, false), (120.0, false)] {
        let answer = bent.ask(wo, direction(degrees, 0.0), point4(0));
        let lit = answer.light_throughput.iter().all(|x| *x > 0.0);
        assert_eq!(lit, shines, "light from {degrees} degrees");
        assert_eq!(
            answer.light_pdf > 0.0,
            shines,
            "light from {degrees} degrees"
        );
    }
}

#[test]
fn a_weight_below_zero_is_none() {
    let (wo, wl) = (direction(30.0, 0.4), direction(50.0, 2.0));
    // Weights that vary: constants are warned of.
    let black = Asked::new(USES, "(uv.x - 1.0) * diffuse(0.8)");
    let white = Asked::new(
        USES,
        "layer((uv.x - 1.0) * blinn_phong(20.0), diffuse(0.8))",
    );
    let plain = Asked::new(USES, "diffuse(0.8)");
    for i in 0..16 {
        let dark = black.ask(wo, wl, point4(i));
        assert_eq!(
            (dark.throughput, dark.light_throughput),
            ([0.0; 3], [0.0; 3])
        );
        let [light, expected] = [&white, &plain].map(|m| m.ask(wo, wl, point4(i)));
        for c in 0..3 {
            let (a, b) = (light.light_throughput[c], expected.light_throughput[c]);
            near(a, b, 1e-12, "what lies under no layer");
        }
    }
}

#[test]
fn mix_is_linear_and_ends_are_exact() {
    for (t, expected) in [(0.0, 0.2), (0.25, 0.2 * 0.75 + 0.8 * 0.25), (1.0, 0.8)] {
        let m = Asked::new(USES, &format!("mix(diffuse(0.2), specular(0.8), {t:?})"));
        let albedo = m.sampled_albedo(direction(20.0, 0.0), 20_000);
        albedo
            .iter()
            .for_each(|a| near(*a, expected, 2e-3, &format!("mix at {t}")));
    }
}

#[test]
fn weights_color_and_sum() {
    let m = Asked::new(
        USES,
        "color(0.5, 1.0, 0.0) * diffuse(0.6) + 0.25 * specular(1.0)",
    );
    let albedo = m.sampled_albedo(direction(10.0, 0.0), 20_000);
    for (a, b) in albedo.iter().zip([0.3 + 0.25, 0.6 + 0.25, 0.25]) {
        near(*a, b, 3e-3, "sum of weighted closures");
    }
}

#[test]
fn choice_takes_one_side() {
    let m = Asked::new(
        USES,
        "if uv.x > 0.5 { diffuse(0.9) } else { specular(0.3) }",
    );
    let answer = m.ask(direction(10.0, 0.0), direction(20.0, 0.0), [0.7; 4]);
    assert_eq!(
        answer.pdf, 0.0,
        "uv.x is 0.4, so the discrete side is taken"
    );
    assert_eq!(answer.light_throughput, [0.0; 3]);
    answer
        .throughput
        .iter()
        .for_each(|t| near(*t, 0.3, 1e-9, "throughput"));
}

/// The answer for a light must be that for a sample in the same direction.
#[test]
fn the_light_sees_what_is_sampled() {
    let m = Asked::new(
        USES,
        "layer(0.4 * blinn_phong(exponent: 30, normal: normalize(normal + vec3(0.2, 0, 0))), specular(0.1), diffuse(0.7))",
    );
    let mut continuous = 0;
    for i in 0..2000 {
        let wo = direction((i % 80) as f64, i as f64);
        let sampled = m.ask(wo, [0.0; 3], point4(i));
        if sampled.pdf > 0.0 {
            continuous += 1;
            let light = m.ask(wo, sampled.wi, point4(i));
            near(light.light_pdf, sampled.pdf, 1e-9 * sampled.pdf, "density");
            for c in 0..3 {
                near(
                    light.light_throughput[c],
                    sampled.throughput[c] * sampled.pdf,
                    1e-9 * sampled.pdf,
                    "value",
                );
            }
        }
    }
    assert!(
        continuous > 1000,
        "only {continuous} samples of lobes with a density"
    );
}

/// Chi-squared over a grid of directions: samples fall where the density says, and the share of
/// discrete and failed samples is what the density leaves.
#[test]
fn samples_follow_the_density_of_all_lobes() {
    let m = Asked::new(
        USES,
        "layer(0.5 * blinn_phong(exponent: 8), specular(0.2), mix(diffuse(0.7), blinn_phong(exponent: 3, normal: normalize(normal + vec3(0, 0.4, 0))), 0.5))",
    );
    for wo in [
        direction(0.0, 0.0),
        direction(45.0, 0.7),
        direction(75.0, -2.0),
        [0.6, 0.0, -0.8],
    ] {
        chi_squared(&m, wo);
    }
}

fn chi_squared(m: &Asked, wo: [f64; 3]) {
    const COS: usize = 12;
    const PHI: usize = 16;
    const N: usize = 30_000;
    let mut counts = vec![0.0; COS * PHI];
    for i in 0..N {
        let answer = m.ask(wo, [0.0; 3], point4(i));
        if answer.pdf > 0.0 && answer.throughput != [0.0; 3] {
            counts[bin(answer.wi, COS, PHI)] += 1.0;
        }
    }
    let mut statistic = 0.0;
    let mut cells = 0.0;
    let mut total = 0.0;
    for c in 0..COS {
        for p in 0..PHI {
            let expected = N as f64 * integral(m, wo, c, p, COS, PHI);
            total += expected;
            if expected > 10.0 {
                let observed: f64 = counts[c * PHI + p];
                statistic += (observed - expected).powi(2) / expected;
                cells += 1.0;
            }
        }
    }
    let found: f64 = counts.iter().sum();
    near(
        found / N as f64,
        total / N as f64,
        0.01,
        "share of samples with a density",
    );
    // Four standard deviations of the chi-squared distribution; the sequence is better spread
    // than random numbers, so a right sampler stays far below.
    assert!(
        statistic < cells + 4.0 * (2.0_f64 * cells).sqrt(),
        "chi-squared {statistic} over {cells} cells for wo {wo:?}"
    );
}

fn bin(w: [f64; 3], cos: usize, phi: usize) -> usize {
    let c = (((w[2] + 1.0) / 2.0 * cos as f64) as usize).min(cos - 1);
    let turn = w[1].atan2(w[0]) / std::f64::consts::TAU + 0.5;
    c * phi + ((turn * phi as f64) as usize).min(phi - 1)
}

/// The density over one cell, by the midpoint rule.
fn integral(m: &Asked, wo: [f64; 3], c: usize, p: usize, cos: usize, phi: usize) -> f64 {
    const SUB: usize = 4;
    let area = 2.0 / cos as f64 * std::f64::consts::TAU / phi as f64;
    let mut sum = 0.0;
    for i in 0..SUB * SUB {
        let z = -1.0 + 2.0 * (c as f64 + ((i / SUB) as f64 + 0.5) / SUB as f64) / cos as f64;
        let turn = (p as f64 + ((i % SUB) as f64 + 0.5) / SUB as f64) / phi as f64 - 0.5;
        let s = (1.0 - z * z).sqrt();
        let angle = turn * std::f64::consts::TAU;
        sum += m
            .ask(wo, [s * angle.cos(), s * angle.sin(), z], [0.5; 4])
            .light_pdf;
    }
    sum / (SUB * SUB) as f64 * area
}

#[test]
fn discrete_materials_answer_lights_with_nothing() {
    let m = Asked::new(USES, "mirror(fresnel: 1.5)");
    let info = &m.program.infos()[0];
    assert!(info.delta_only && !info.transmissive);
    let answer = m.ask(
        direction(30.0, 0.0),
        direction(30.0, std::f64::consts::PI),
        [0.5; 4],
    );
    assert_eq!(
        (answer.light_pdf, answer.light_throughput, answer.pdf),
        (0.0, [0.0; 3], 0.0)
    );
    assert!(
        answer.throughput[0] > 0.03 && answer.transmitted == 0.0,
        "{answer:?}"
    );
}

#[test]
fn glass_changes_sides_and_says_so() {
    let m = Asked::material(
        "use std::bsdf::smooth_dielectric;
        material m { surface = smooth_dielectric(1.5); interior = medium(ior: 1.5); }",
    );
    assert!(m.program.infos()[0].transmissive);
    let sides: Vec<f64> = (0..5000)
        .map(|i| m.ask(direction(20.0, 0.3), [0.0; 3], point4(i)))
        .map(|a| {
            assert_eq!(a.transmitted, f64::from(u8::from(a.wi[2] < 0.0)), "{a:?}");
            a.transmitted
        })
        .collect();
    let through = sides.iter().sum::<f64>() / 5000.0;
    near(
        through,
        0.9594,
        0.003,
        "share of light that enters glass at 20 degrees",
    );
}

#[test]
fn a_weight_of_zero_leaves_no_trace() {
    let with = Asked::new(USES, "layer(0.0 * blinn_phong(exponent: 50), diffuse(0.5))");
    let without = Asked::new(USES, "diffuse(0.5)");
    assert_eq!(with.program.infos()[0].lobes, 1);
    assert!(!with.program.wgsl(&[0]).contains("blinn_phong"));
    let (a, b) = (
        with.ask(direction(30.0, 0.0), direction(10.0, 0.0), [0.3; 4]),
        without.ask(direction(30.0, 0.0), direction(10.0, 0.0), [0.3; 4]),
    );
    assert_eq!(
        (a.pdf, a.throughput, a.light_pdf),
        (b.pdf, b.throughput, b.light_pdf)
    );
}
