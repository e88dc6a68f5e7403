//! Frames, shading normals that are always of use, and what counts as reflection.

use super::text::Text;
use super::vectors::{dot, length, reflect};
use impasto_verify::statistics::{Numbers, direction};

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
    normals.extend([1e-4f64, 1e-8, -1e-8].map(|e| [e, 0.0, -(1.0 - e * e).sqrt()]));
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
