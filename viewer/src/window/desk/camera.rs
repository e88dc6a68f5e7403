//! The camera as hands move it.

use glam::Vec3;
use impasto_runtime::scene::Camera;

use super::super::navigate;
use super::Desk;

impl Desk {
    /// The camera that is asked for, or else that of the scene.
    pub fn camera(&self) -> Option<Camera> {
        self.camera.or(self.news.project.camera)
    }

    /// Has a hand moved the camera?
    pub fn has_moved(&self) -> bool {
        self.camera.is_some()
    }

    /// The picture from here.
    pub fn look_from(&mut self, camera: Camera) {
        if self.camera() != Some(camera) {
            self.camera = Some(camera);
            self.camera_is_new = true;
        }
    }

    /// The point that the camera turns about.
    pub fn pivot(&self) -> Vec3 {
        let looked_at = self.camera().map(|c| c.look_at);
        self.pivot.or(looked_at).unwrap_or_default()
    }

    fn least_distance(&self) -> f64 {
        let bounds = self.news.project.bounds;
        let size =
            bounds.map(|[low, high]| f64::from((Vec3::from(high) - Vec3::from(low)).length()));
        size.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0) * 1e-4
    }

    /// A hand turns the camera by so many heights of the picture: to the right and down.
    pub fn drag_orbit(&mut self, right: f32, down: f32) {
        if let Some(camera) = self.camera() {
            let (yaw, pitch) = (f64::from(right), -f64::from(down));
            let half = std::f64::consts::PI;
            self.look_from(navigate::orbit(
                &camera,
                self.pivot(),
                half * yaw,
                half * pitch,
            ));
        }
    }

    /// A hand moves the camera sideways.
    pub fn drag_pan(&mut self, right: f32, down: f32) {
        if let Some(camera) = self.camera() {
            self.look_from(navigate::pan(
                &camera,
                self.pivot(),
                right.into(),
                down.into(),
            ));
        }
    }

    /// A hand moves the camera nearer by so many notches of a wheel.
    pub fn dolly(&mut self, notches: f32) {
        if let Some(camera) = self.camera() {
            let factor = 0.9f64.powf(f64::from(notches.clamp(-50.0, 50.0)));
            self.look_from(navigate::dolly(
                &camera,
                self.pivot(),
                factor,
                self.least_distance(),
            ));
        }
    }
}
