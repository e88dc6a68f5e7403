//! The camera as the kernels see it: a frame of vectors, printed as WGSL constants.

use glam::Vec3;

use crate::scene::Camera;
use crate::wgsl::template::template;
use crate::wgsl::{constant_f32, constant_u32, constant_vec3};

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

    /// Camera rays, from points of a lens if `lens` is set.
    pub(crate) fn wgsl(&self, width: u32, height: u32, lens: bool) -> String {
        let mut out = constant_u32("WIDTH", width) + &constant_u32("HEIGHT", height);
        out += &constant_vec3("CAMERA_POSITION", self.position);
        out += &constant_vec3("CAMERA_FORWARD", self.forward);
        out += &constant_vec3("CAMERA_RIGHT", self.right);
        out += &constant_vec3("CAMERA_UP", self.up);
        if lens {
            let pinhole = self.lens_radius <= 0.0;
            let focus = if pinhole { 1.0 } else { self.focus_distance };
            out += &constant_f32("LENS_RADIUS", self.lens_radius);
            out += &constant_f32("FOCUS_DISTANCE", focus);
        }
        out + &template!("camera.wgsl").wgsl(&[("lens", lens)])
    }
}
