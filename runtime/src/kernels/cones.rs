//! Ray cones: how much of the scene a ray stands for, for materials that ask for `filter_width`.
//!
//! A cone is a width and a spread, carried by the path (`cone` in the state) only where some material
//! asks. It begins as a pixel (`kernels/new_path.wgsl`), widens where light is scattered into more than one direction
//! (`kernels/material.wgsl`), and meets surfaces as an ellipse (`world/footprint.wgsl`).
//! docs/filtering.md has the formulas.

use crate::wgsl::constant_f32;
use crate::world::camera::CameraFrame;

/// A scattered ray stands for the solid angle that it would have to itself among so many rays of its
/// density: about as many as a pixel gets in a quick picture.
const RAYS: f32 = 16.0;
/// The widest cone: more than a radian is no direction any more.
const WIDEST: f32 = 1.0;
/// The longest footprint, in widths of its cone.
const LONGEST: f32 = 16.0;

/// The constants of the stages that widen cones.
pub(crate) fn constants() -> String {
    constant_f32("CONE_RAYS", RAYS)
        + &constant_f32("WIDEST_CONE", WIDEST)
        + &constant_f32("LONGEST_FOOTPRINT", LONGEST)
}

/// The square root of the solid angle of the pixel in the middle of a picture, in radians.
pub(crate) fn pixel_angle(camera: &CameraFrame, width: u32, height: u32) -> f32 {
    let across = 2.0 * camera.right.length() / width as f32;
    let down = 2.0 * camera.up.length() / height as f32;
    across.sqrt() * down.sqrt()
}
