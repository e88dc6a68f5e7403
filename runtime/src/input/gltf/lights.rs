//! The lights of a glTF file (KHR_lights_punctual), as entries of a scene file.

use std::fmt::Write;

use glam::{DMat4, DVec3};
use gltf::khr_lights_punctual::Kind;

use super::Model;
use super::scene::keys;
use crate::input::shown::array;

/// Lumens of a watt: of lights, glTF tells what eyes see, and a renderer counts energy. It is what Blender takes.
const LUMENS_A_WATT: f64 = 683.0;

/// Angular diameter of a distant light, in degrees: of the sun.
const SUN: f64 = 0.53;

/// Radius of the sphere that stands for a light at a point, in metres, or by the size of the scene if that is small.
const LAMP: f64 = 0.025;
const LAMP_SHARE: f64 = 0.005;

/// A light where a node has it.
pub(super) struct Light {
    node: usize,
    transform: DMat4,
    kind: Kind,
    /// Candela, or lux of one at infinity, by linear RGB.
    intensity: DVec3,
}

impl Light {
    pub(super) fn new(
        node: usize,
        transform: &DMat4,
        light: &gltf::khr_lights_punctual::Light<'_>,
    ) -> Self {
        let color = light.color().map(f64::from);
        Self {
            node,
            transform: *transform,
            kind: light.kind(),
            intensity: f64::from(light.intensity()) * DVec3::from(color),
        }
    }

    /// Is it elsewhere at other times?
    pub(super) fn moves(&self, model: &Model) -> bool {
        model.motion.moves(self.node)
    }

    /// Writes its entry, in a scene that reaches so far from its centre.
    pub(super) fn write(&self, model: &Model, radius: f64, text: &mut String) {
        let power = (self.intensity / LUMENS_A_WATT).max(DVec3::ZERO);
        let mut line = |line: String| {
            text.push_str(&line);
            text.push('\n');
        };
        line("[[lights]]".into());
        let moving: &[_] = match self.kind {
            Kind::Directional => {
                line("kind = \"distant\"".into());
                line(format!("to_light = {}", array(back(&self.transform))));
                line(format!("irradiance = {}\nangle = {SUN}", array(power)));
                &[("to_light", back as fn(&DMat4) -> DVec3)]
            }
            Kind::Point | Kind::Spot { .. } => {
                let radius = LAMP.min(LAMP_SHARE * radius);
                // A sphere of radiance L sends pi r^2 L into every direction.
                let radiance = power / (std::f64::consts::PI * radius * radius);
                line("kind = \"sphere\"".into());
                line(format!("center = {}", array(place(&self.transform))));
                line(format!(
                    "radius = {radius:?}\nradiance = {}",
                    array(radiance)
                ));
                if let Kind::Spot {
                    inner_cone_angle,
                    outer_cone_angle,
                } = self.kind
                {
                    let degrees = |angle: f32| f64::from(angle).to_degrees();
                    let outer = degrees(outer_cone_angle).clamp(0.01, 180.0);
                    let inner = degrees(inner_cone_angle).clamp(0.0, outer);
                    line(format!("axis = {}", array(-back(&self.transform))));
                    line(format!("cone = {outer:?}\ninner = {inner:?}"));
                    &[("center", place), ("axis", |m| -back(m))]
                } else {
                    &[("center", place)]
                }
            }
        };
        let keys = keys(model, self.node, moving);
        let _ = writeln!(text, "{}", keys.unwrap_or_default());
    }
}

fn place(transform: &DMat4) -> DVec3 {
    transform.w_axis.truncate()
}

/// Away from where the light shines.
fn back(transform: &DMat4) -> DVec3 {
    transform.z_axis.truncate().normalize_or(DVec3::Z)
}
