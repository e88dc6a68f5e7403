//! How a hand moves a camera: orbit, pan, dolly, frame, focus. All of it is arithmetic on [`Camera`], without a window.
//!
//! The camera turns about its `up` as a turntable does, so that the horizon stays level. It stops short of the poles:
//! a view along `up` has no sides. Positions are computed in double precision, since they are differences of large
//! numbers where scenes are large.

use glam::{DQuat, DVec3, Vec3};
use impasto_runtime::scene::Camera;

/// How near to the poles a hand turns the view, in radians.
const POLE: f64 = 0.02;

/// Turns the camera about a point, and its view with it: by `yaw` to the right about `up`, and by `pitch` upwards, in
/// radians.
pub fn orbit(camera: &Camera, pivot: Vec3, yaw: f64, pitch: f64) -> Camera {
    let up = camera.up.as_dvec3().normalize_or_zero();
    let (position, target) = (camera.position.as_dvec3(), camera.look_at.as_dvec3());
    let forward = (target - position).normalize_or_zero();
    if up == DVec3::ZERO || forward == DVec3::ZERO || !(yaw.is_finite() && pitch.is_finite()) {
        return *camera;
    }
    // From the upper pole. A camera that was written nearer to a pole than a hand may go moves away from it only.
    let angle = forward.dot(up).clamp(-1.0, 1.0).acos();
    let (least, most) = (POLE.min(angle), (std::f64::consts::PI - POLE).max(angle));
    let pitch = angle - (angle - pitch).clamp(least, most);
    let right = forward.cross(up).normalize_or_zero();
    if right == DVec3::ZERO {
        return *camera;
    }
    let turn = DQuat::from_axis_angle(up, -yaw) * DQuat::from_axis_angle(right, pitch);
    let pivot = pivot.as_dvec3();
    Camera {
        position: (pivot + turn * (position - pivot)).as_vec3(),
        look_at: (pivot + turn * (target - pivot)).as_vec3(),
        ..*camera
    }
}

/// Moves the camera sideways, so that what is as far as `pivot` follows a hand that moves by so many heights of the
/// picture: to the right and down.
pub fn pan(camera: &Camera, pivot: Vec3, right: f64, down: f64) -> Camera {
    let [side, up, forward] = camera.basis().map(|v| v.as_dvec3());
    let away = pivot.as_dvec3() - camera.position.as_dvec3();
    let depth = away.dot(forward);
    let depth = if depth > 0.0 { depth } else { away.length() };
    let height = 2.0 * depth * (0.5 * f64::from(camera.fov).to_radians()).tan();
    let step = height * (up * down - side * right);
    if !step.is_finite() {
        return *camera;
    }
    Camera {
        position: (camera.position.as_dvec3() + step).as_vec3(),
        look_at: (camera.look_at.as_dvec3() + step).as_vec3(),
        ..*camera
    }
}

/// Moves the camera along the view until `pivot` is `factor` times as far, and not nearer than `least` metres.
pub fn dolly(camera: &Camera, pivot: Vec3, factor: f64, least: f64) -> Camera {
    let forward = camera.basis()[2].as_dvec3();
    let position = camera.position.as_dvec3();
    let away = pivot.as_dvec3() - position;
    let depth = away.dot(forward);
    let depth = if depth > 0.0 { depth } else { away.length() };
    let step = depth - (depth * factor).max(least.min(depth));
    if !step.is_finite() || depth == 0.0 {
        return *camera;
    }
    let moved = position + forward * step;
    // What is in the middle stays there, in front of the camera.
    let target = camera.look_at.as_dvec3();
    let ahead = (target - moved).dot(forward).max(least.max(1e-6));
    Camera {
        position: moved.as_vec3(),
        look_at: (moved + forward * ahead).as_vec3(),
        ..*camera
    }
}

/// The camera that sees all of a box from where it looks now, in a picture of `aspect`, width over height.
pub fn frame(camera: &Camera, bounds: [[f32; 3]; 2], aspect: f64) -> Camera {
    let [low, high] = bounds.map(|corner| Vec3::from(corner).as_dvec3());
    let centre = 0.5 * (low + high);
    let radius = (0.5 * (high - low).length()).max(1e-4);
    let forward = camera.basis()[2].as_dvec3();
    let half = (0.5 * f64::from(camera.fov).to_radians()).tan();
    let narrow = (half * aspect.min(1.0)).atan();
    let distance = 1.05 * radius / narrow.sin();
    if !(centre.is_finite() && distance.is_finite()) || forward == DVec3::ZERO {
        return *camera;
    }
    Camera {
        position: (centre - forward * distance).as_vec3(),
        look_at: centre.as_vec3(),
        focus: distance as f32,
        ..*camera
    }
}

/// The camera with a point in the middle of the picture, at the distance at which it is.
pub fn aim(camera: &Camera, at: Vec3) -> Camera {
    let forward = camera.basis()[2].as_dvec3();
    let distance = (at - camera.position).as_dvec3().length();
    Camera {
        position: (at.as_dvec3() - forward * distance).as_vec3(),
        look_at: at,
        ..*camera
    }
}

/// The camera with what is this far along the view in focus.
pub fn focus(camera: &Camera, depth: f32) -> Camera {
    if depth.is_finite() && depth > 0.0 {
        Camera {
            focus: depth,
            ..*camera
        }
    } else {
        *camera
    }
}

/// The camera with so many degrees of vertical view.
pub fn lens(camera: &Camera, fov: f32) -> Camera {
    Camera {
        fov: fov.clamp(0.5, 175.0),
        ..*camera
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(0.0, 1.0, 5.0),
            look_at: Vec3::new(0.0, 1.0, 0.0),
            up: Vec3::Y,
            fov: 40.0,
            aperture: 0.0,
            focus: 5.0,
        }
    }

    fn distance(camera: &Camera, pivot: Vec3) -> f32 {
        (camera.position - pivot).length()
    }

    fn is_level(camera: &Camera) -> bool {
        let [right, up, forward] = camera.basis();
        right.dot(camera.up).abs() < 1e-5 && up.dot(camera.up) > 0.0 && forward.is_finite()
    }

    #[test]
    fn a_turn_to_the_right_goes_counterclockwise_from_above() {
        let turned = orbit(&camera(), Vec3::Y, std::f64::consts::FRAC_PI_2, 0.0);
        assert!(
            (turned.position - Vec3::new(-5.0, 1.0, 0.0)).length() < 1e-5,
            "{turned:?}"
        );
        assert!((turned.look_at - Vec3::Y).length() < 1e-6);
        let raised = orbit(&camera(), Vec3::Y, 0.0, -0.5);
        assert!(raised.position.y > 3.0, "{raised:?}");
    }

    #[test]
    fn no_hand_gets_over_a_pole() {
        for pitch in [-0.9, 0.9, 1e6, -1e6] {
            let mut moved = camera();
            for step in 0..40 {
                moved = orbit(&moved, Vec3::Y, 0.3, pitch);
                assert!(is_level(&moved), "{pitch} {step}: {moved:?}");
                assert!((distance(&moved, Vec3::Y) - 5.0).abs() < 1e-3);
            }
            // And comes back from there.
            let back = orbit(&moved, Vec3::Y, 0.0, -pitch.signum());
            let height = |camera: &Camera| (camera.position.y - 1.0).abs();
            assert!(height(&back) < height(&moved) - 0.5, "{back:?}");
        }
    }

    #[test]
    fn turning_about_another_point_keeps_it_where_it_is_in_the_picture() {
        let pivot = Vec3::new(0.5, 1.2, 0.3);
        let at = |camera: &Camera| {
            let [right, up, forward] = camera.basis();
            let away = pivot - camera.position;
            let depth = away.dot(forward);
            Vec3::new(away.dot(right) / depth, away.dot(up) / depth, depth)
        };
        let mut moved = camera();
        for _ in 0..10 {
            moved = orbit(&moved, pivot, 0.2, -0.05);
        }
        assert!((at(&moved) - at(&camera())).length() < 1e-4);
        assert!(is_level(&moved));
    }

    #[test]
    fn other_ups_and_poles_as_written() {
        let above = Camera {
            position: Vec3::new(0.0, 9.0, 0.001),
            look_at: Vec3::ZERO,
            ..camera()
        };
        let turned = orbit(&above, Vec3::ZERO, 0.4, 0.0);
        assert!(is_level(&turned) && turned.position.y > 8.9, "{turned:?}");
        let lowered = orbit(&above, Vec3::ZERO, 0.0, 0.5);
        assert!(lowered.position.y < 8.5, "{lowered:?}");
        let z = Camera {
            up: Vec3::Z * 3.0,
            ..camera()
        };
        let turned = orbit(&z, Vec3::Y, 0.7, 0.1);
        assert!(turned.position.is_finite());
        let degenerate = Camera {
            up: Vec3::NEG_Z,
            ..camera()
        };
        assert_eq!(orbit(&degenerate, Vec3::Y, 0.7, 0.1), degenerate);
        assert_eq!(orbit(&camera(), Vec3::Y, f64::NAN, 0.1), camera());
    }

    #[test]
    fn what_is_panned_follows_the_hand() {
        let moved = pan(&camera(), camera().look_at, 0.5, 0.25);
        let height = 2.0 * 5.0 * 20f32.to_radians().tan();
        let expected = Vec3::new(-0.5 * height, 0.25 * height, 0.0);
        assert!((moved.position - camera().position - expected).length() < 1e-5);
        assert_eq!(
            moved.position - camera().position,
            moved.look_at - camera().look_at
        );
    }

    #[test]
    fn dollying_in_and_out_ends_where_it_began() {
        let near = dolly(&camera(), Vec3::Y, 0.5, 0.01);
        assert!((distance(&near, Vec3::Y) - 2.5).abs() < 1e-5);
        let back = dolly(&near, Vec3::Y, 2.0, 0.01);
        assert!((back.position - camera().position).length() < 1e-5);
        let mut moved = camera();
        for _ in 0..200 {
            moved = dolly(&moved, Vec3::Y, 0.8, 0.01);
        }
        assert!((distance(&moved, Vec3::Y) - 0.01).abs() < 1e-4);
        assert!(moved.basis()[2].z < -0.99, "it looks where it looked");
    }

    #[test]
    fn what_is_framed_is_inside_the_picture() {
        let bounds = [[-3.0, 0.0, -1.0], [4.0, 2.0, 1.0]];
        for aspect in [0.3, 1.0, 2.5] {
            let framed = frame(&camera(), bounds, aspect);
            for corner in 0..8 {
                let pick = |axis: usize| bounds[corner >> axis & 1][axis];
                let corner = Vec3::new(pick(0), pick(1), pick(2));
                let at = crate::window::project::point(&framed, aspect as f32, corner);
                let at = at.expect("in front");
                assert!(
                    (0.0..=1.0).contains(&at[0]) && (0.0..=1.0).contains(&at[1]),
                    "{aspect} {at:?}"
                );
            }
        }
        let point = frame(&camera(), [[1.0; 3]; 2], 1.0);
        assert!(point.position.is_finite() && point.basis()[2].is_finite());
        let endless = [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]];
        assert_eq!(frame(&camera(), endless, 1.0), camera());
    }

    #[test]
    fn focus_is_a_distance() {
        assert_eq!(focus(&camera(), 2.0).focus, 2.0);
        assert_eq!(focus(&camera(), f32::NAN), camera());
        assert_eq!(focus(&camera(), 0.0), camera());
        assert_eq!(lens(&camera(), 500.0).fov, 175.0);
        let aimed = aim(&camera(), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(aimed.look_at, Vec3::new(1.0, 1.0, 0.0));
        assert!((aimed.basis()[2] - camera().basis()[2]).length() < 1e-6);
    }
}
