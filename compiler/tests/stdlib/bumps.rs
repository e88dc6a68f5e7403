//! Gradients of functions of a point, and normals bent by heights and by maps.

use super::text::Text;
use super::vectors::{dot, length};
use impasto_verify::statistics::Numbers;

const FIELDS: &str = "
    use std::pattern::{bump, normal_map};
    use std::noise::perlin;

    fn twisted(p: point, k: float) -> float =
        k * (3.0 * p.x * p.x - p.y * p.y + 0.5 * p.z * p.z)
        + 2.0 * p.x * p.y - 4.0 * p.y * p.z + p.z * p.x + 7.0 * p.x - p.y + 11.0;
    fn wave(p: point) -> float = sin(3.0 * p.x) * cos(2.0 * p.y) + exp(p.z);
    fn ramp(p: point, slope: float) -> length = slope * p.x * 1 m;
    fn along(d: vector, far: float) -> float = far * d.z;

    fn of_twisted(p: point, k: float) -> vector = gradient(twisted(p, k), step: 10 cm);
    fn of_wave(p: point, e: float) -> vector = gradient(wave(p), step: e * 1 m);
    fn of_ramp(p: point, slope: float) -> vector = gradient(ramp(slope: slope, p: p), 1 mm);
    fn of_vector(d: vector, far: float) -> vector = gradient(along(d, far), step: 1 mm);
    fn of_noise(p: point, e: float) -> vector = gradient(perlin(p), step: e * 1 m);
    fn again(p: point) -> vector {
        var last = vector(0.0);
        for i in 0 .. 3 {
            last = gradient(twisted(p, float(i)), step: 10 cm);
        }
        last
    }

    fn bumped(n: normal, slope: float) -> normal = bump(n, gradient(ramp(point(0.0), slope), 1 mm));
    fn bent(n: normal, g: vector) -> normal = bump(n, g);
    fn mapped(v: color, n: normal, t: vector, scale: float) -> normal = normal_map(v, n, t, scale);
";

const UP: [f64; 3] = [0.0, 0.0, 1.0];

fn near(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    let close = a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(close && a.len() == b.len(), "{what}: {a:?} is not {b:?}");
}

/// The gradient of `twisted`, by hand.
fn gradient_of_twisted(p: [f64; 3], k: f64) -> [f64; 3] {
    let [x, y, z] = p;
    [
        6.0 * k * x + 2.0 * y + z + 7.0,
        -2.0 * k * y + 2.0 * x - 4.0 * z - 1.0,
        k * z - 4.0 * y + x,
    ]
}

#[test]
fn gradients_of_the_second_degree_are_exact() {
    let text = Text::new(FIELDS);
    let mut n = Numbers::new(1);
    for _ in 0..50 {
        let p = n.direction().map(|x| 3.0 * x);
        let k = 4.0 * n.direction()[0];
        let found = text.call::<f64>("of_twisted", &[&p, &[k]]);
        near(&found, &gradient_of_twisted(p, k), 1e-10, "second degree");
    }
    let p = [0.3, -1.0, 0.2];
    let last = text.call::<f64>("again", &[&p]);
    near(&last, &gradient_of_twisted(p, 2.0), 1e-10, "in a loop");
}

#[test]
fn gradients_err_with_the_square_of_the_step() {
    let text = Text::new(FIELDS);
    let p: [f64; 3] = [0.4, 0.7, -0.3];
    let exact = [
        3.0 * (1.2f64).cos() * (1.4f64).cos(),
        -2.0 * (1.2f64).sin() * (1.4f64).sin(),
        (-0.3f64).exp(),
    ];
    let error = |step: f64| {
        let found = text.call::<f64>("of_wave", &[&p, &[step]]);
        length(&[0, 1, 2].map(|c| found[c] - exact[c]))
    };
    let (wide, narrow) = (error(0.02), error(0.01));
    assert!(narrow < 1e-3 && narrow > 0.0, "{narrow}");
    assert!((wide / narrow - 4.0).abs() < 0.05, "{wide} to {narrow}");
}

#[test]
fn gradients_of_lengths_have_no_unit_and_arguments_keep_their_names() {
    let text = Text::new(FIELDS);
    let found = text.call::<f64>("of_ramp", &[&[5.0, 1.0, 2.0], &[0.25]]);
    near(&found, &[0.25, 0.0, 0.0], 1e-9, "slope of the ramp");
    let found = text.call::<f64>("of_vector", &[&[5.0, 1.0, 2.0], &[8.0]]);
    near(&found, &[0.0, 0.0, 8.0], 1e-9, "function of a vector");
}

#[test]
fn gradients_of_noise_agree_in_both_precisions() {
    let text = Text::new(FIELDS);
    let mut n = Numbers::new(4);
    for _ in 0..50 {
        let p = n.direction().map(|x| 5.0 * x);
        let args: [&[f64]; 2] = [&p, &[0.01]];
        let (wide, narrow) = (
            text.call::<f64>("of_noise", &args),
            text.call::<f32>("of_noise", &args),
        );
        near(&narrow, &wide, 2e-3, "perlin in single precision");
    }
}

#[test]
fn a_slope_tilts_by_its_arc_tangent() {
    let text = Text::new(FIELDS);
    for slope in [0.0, 0.1, 1.0, -2.0, 40.0f64] {
        let found = text.call::<f64>("bumped", &[&UP, &[slope]]);
        let tilt = slope.atan();
        // Higher towards +x: the normal leans back, towards -x.
        near(&found, &[-tilt.sin(), 0.0, tilt.cos()], 1e-9, "tilt");
    }
}

#[test]
fn bumps_have_no_part_along_the_normal() {
    let text = Text::new(FIELDS);
    let mut n = Numbers::new(5);
    for _ in 0..200 {
        let (normal, g) = (n.direction(), n.direction().map(|x| 3.0 * x));
        let found = text.call::<f64>("bent", &[&normal, &g]);
        let shifted = [0, 1, 2].map(|c| g[c] + 2.5 * normal[c]);
        let same = text.call::<f64>("bent", &[&normal, &shifted]);
        near(&found, &same, 1e-9, "a gradient along the normal");
        near(&[length(&found)], &[1.0], 1e-9, "length");
        let across2 = dot(&g, &g) - dot(&g, &normal).powi(2);
        let cosine = 1.0 / (1.0 + across2).sqrt();
        near(&[dot(&found, &normal)], &[cosine], 1e-9, "tilt");
    }
    for g in [[0.0; 3], [3e38; 3], [-3e38, 0.0, 1.0], [1e-30, 0.0, 0.0]] {
        let found = text.call::<f32>("bent", &[&UP, &g]);
        near(&[length(&found)], &[1.0], 1e-5, "length of an extreme one");
        assert!(found[2] > 0.0, "{g:?} turns the normal over: {found:?}");
    }
}

#[test]
fn a_normal_map_at_rest_is_the_normal() {
    let text = Text::new(FIELDS);
    let mut n = Numbers::new(6);
    for _ in 0..100 {
        let (normal, t) = (n.direction(), n.direction());
        let rest = text.call::<f32>("mapped", &[&[0.5, 0.5, 1.0], &normal, &t, &[1.0]]);
        near(&rest, &normal, 3e-7, "at rest");
    }
}

#[test]
fn a_normal_map_leans_along_tangent_and_bitangent() {
    let text = Text::new(FIELDS);
    let (t, s) = ([2.0, 0.0, 0.3], 0.6f64.sqrt());
    let map = |v: [f64; 3], scale: f64| text.call::<f64>("mapped", &[&v, &UP, &t, &[scale]]);
    near(&map([0.8, 0.5, 0.9], 1.0), &[0.6, 0.0, 0.8], 1e-9, "red");
    near(&map([0.5, 0.8, 0.9], 1.0), &[0.0, 0.6, 0.8], 1e-9, "green");
    near(
        &map([0.8, 0.5, 0.9], -1.0),
        &[-0.6, 0.0, 0.8],
        1e-9,
        "turned",
    );
    let scaled = map([0.5 + 0.1 * s, 0.5, 0.6], 2.0);
    near(
        &[scaled[0] / scaled[2]],
        &[2.0 * s],
        1e-9,
        "slope by the scale",
    );
}

#[test]
fn a_normal_map_without_a_direction_is_the_normal() {
    let text = Text::new(FIELDS);
    let value = [0.8, 0.3, 0.9];
    for t in [
        [0.0; 3],
        UP,
        [0.0, 0.0, -1.0],
        [1e-5, 0.0, -1.0],
        [0.0, 0.0, 1e-20],
    ] {
        let found = text.call::<f32>("mapped", &[&value, &UP, &t, &[1.0]]);
        near(&found, &UP, 0.0, "a tangent along the normal");
    }
    for v in [[0.5, 0.5, 0.0], [1.0, 0.5, 0.5], [0.5; 3], [0.0; 3]] {
        let found = text.call::<f32>("mapped", &[&v, &UP, &[1.0, 0.0, 0.0], &[1.0]]);
        near(&found, &UP, 0.0, "a map that points into the surface");
    }
    let huge = text.call::<f32>(
        "mapped",
        &[&[1.0, 0.9, 0.7], &UP, &[1.0, 0.0, 0.0], &[3e38]],
    );
    near(&[length(&huge)], &[1.0], 1e-5, "an extreme scale");
}
