//! Where points of the scene lie in a picture: paths are drawn over it.

use glam::{DVec3, Vec3};
use impasto_runtime::scene::Camera;

/// The nearest that is drawn, as a share of the distance from the camera to what it looks at.
const NEAR: f64 = 1e-4;

/// A point in the camera's own axes: right, up, and along the view.
fn seen(camera: &Camera, point: Vec3) -> DVec3 {
    let away = point.as_dvec3() - camera.position.as_dvec3();
    let [right, up, forward] = camera.basis().map(|v| v.as_dvec3());
    DVec3::new(away.dot(right), away.dot(up), away.dot(forward))
}

fn near(camera: &Camera) -> f64 {
    let distance = camera.look_at.as_dvec3() - camera.position.as_dvec3();
    (NEAR * distance.length()).max(1e-9)
}

/// From the camera's axes to the picture: (0, 0) is its top left corner, (1, 1) the bottom right one.
fn onto(camera: &Camera, aspect: f32, seen: DVec3) -> [f32; 2] {
    let height = (0.5 * f64::from(camera.fov).to_radians()).tan();
    let x = seen.x / (seen.z * height * f64::from(aspect));
    let y = seen.y / (seen.z * height);
    [(0.5 + 0.5 * x) as f32, (0.5 - 0.5 * y) as f32]
}

/// Where a point lies in a picture of `aspect`, width over height; nowhere if it is behind the camera.
pub fn point(camera: &Camera, aspect: f32, point: Vec3) -> Option<[f32; 2]> {
    let seen = seen(camera, point);
    (seen.z >= near(camera)).then(|| onto(camera, aspect, seen))
}

/// Where a line lies: its part in front of the camera, if it has one.
pub fn line(camera: &Camera, aspect: f32, ends: [Vec3; 2]) -> Option<[[f32; 2]; 2]> {
    let near = near(camera);
    let [mut a, mut b] = ends.map(|end| seen(camera, end));
    if !(a.is_finite() && b.is_finite()) || a.z < near && b.z < near {
        return None;
    }
    let cut = |behind: DVec3, front: DVec3| {
        let share = (near - behind.z) / (front.z - behind.z);
        behind + (front - behind) * share
    };
    if a.z < near {
        a = cut(a, b);
    } else if b.z < near {
        b = cut(b, a);
    }
    Some([onto(camera, aspect, a), onto(camera, aspect, b)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(0.0, 0.0, 5.0),
            look_at: Vec3::ZERO,
            up: Vec3::Y,
            fov: 90.0,
            aperture: 0.0,
            focus: 5.0,
        }
    }

    #[test]
    fn the_middle_the_corners_and_behind() {
        assert_eq!(point(&camera(), 2.0, Vec3::ZERO), Some([0.5, 0.5]));
        let corner = point(&camera(), 2.0, Vec3::new(10.0, 5.0, 0.0)).expect("in front");
        assert!(
            (corner[0] - 1.0).abs() < 1e-5 && corner[1].abs() < 1e-5,
            "{corner:?}"
        );
        assert_eq!(point(&camera(), 2.0, Vec3::new(0.0, 0.0, 6.0)), None);
        assert_eq!(point(&camera(), 2.0, camera().position), None);
    }

    #[test]
    fn lines_are_cut_where_they_pass_the_camera() {
        let behind = Vec3::new(1.0, 0.0, 9.0);
        let front = Vec3::new(1.0, 0.0, 0.0);
        let [a, b] = line(&camera(), 1.0, [behind, front]).expect("its front part");
        assert!(a[0] > 100.0 && a[0].is_finite(), "{a:?}");
        assert!((b[0] - 0.6).abs() < 1e-6, "{b:?}");
        let [c, d] = line(&camera(), 1.0, [front, behind]).expect("its front part");
        assert_eq!((a, b), (d, c));
        assert_eq!(line(&camera(), 1.0, [behind, behind + Vec3::X]), None);
        // From the lens itself, as paths begin.
        let [a, b] = line(&camera(), 1.0, [camera().position, front]).expect("all of it");
        assert!((a[0] - b[0]).abs() < 1e-5 && (a[1] - b[1]).abs() < 1e-5);
        assert_eq!(line(&camera(), 1.0, [front, Vec3::NAN]), None);
    }
}
