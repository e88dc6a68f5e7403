//! The camera as the kernels see it: a frame of vectors, which they read of the uniform `camera`
//! (`kernels/camera.rs`), so that one looks from elsewhere without building any. The size of the picture, and
//! whether there is a lens, are part of their text.

use glam::Vec3;

use crate::scene::Camera;
use crate::wgsl::constants_u32;
use crate::wgsl::template::template;

/// A pinhole or thin-lens camera. A ray through the picture at (x, y) in [-1, 1]^2, y up, goes
/// towards `forward + x right + y up`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraFrame {
    /// Centre of the lens, in metres.
    pub position: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// To the right, as long as the tangent of half the horizontal field of view.
    pub right: Vec3,
    /// Upwards, as long as the tangent of half the vertical field of view.
    pub up: Vec3,
    /// Radius of the lens in metres; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance along `forward` of the plane in focus, in metres; unused by a pinhole.
    pub focus_distance: f32,
}

impl CameraFrame {
    /// The frame of a scene's camera for pictures of `aspect`, width over height.
    pub fn new(camera: &Camera, aspect: f32) -> Self {
        let [right, up, forward] = camera.basis();
        let height = (0.5 * camera.fov.to_radians()).tan();
        Self {
            position: camera.position,
            forward,
            right: right * height * aspect,
            up: up * height,
            lens_radius: 0.5 * camera.aperture,
            focus_distance: camera.focus,
        }
    }

    /// The radius of the lens and the distance that it is focused on, as kernels compute with them. A pinhole stays
    /// one whatever it is focused on.
    pub(crate) fn lens(&self) -> [f32; 2] {
        if self.has_lens() {
            [self.lens_radius, self.focus_distance]
        } else {
            [0.0, 1.0]
        }
    }

    /// Whether rays begin at points of a lens, not in one.
    pub(crate) fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }
}

/// Camera rays of a picture, from points of a lens if `lens` is set.
pub(crate) fn wgsl(width: u32, height: u32, lens: bool) -> String {
    constants_u32(&[("WIDTH", width), ("HEIGHT", height)])
        + &template!("camera.wgsl").wgsl(&[("lens", lens)])
}
