//! Lights at a point, which shine equally in all directions.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::error::SceneError;
use crate::scene::{Light, SceneLight, Table};
use crate::wgsl;
use crate::wgsl::BufferData;
use crate::wgsl::template::template;
use crate::world::lights::{Context, Kind, LightKind, Piece, Sampled, Source, luminance};

/// The kind.
pub(super) const KIND: LightKind = LightKind {
    name: "point",
    needs: &[],
    read: Some(read),
    sample: "sample_point_light",
    hit: None,    // it has no surface
    escape: None, // and no path finds it by chance
    share: None,
    present,
    absent: |_| kind(&[Vec3::ZERO], 0),
};

/// A light at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLight {
    /// Where it is, in metres.
    pub position: Vec3,
    /// What it sends in every direction, linear RGB, W/sr.
    pub intensity: Vec3,
}

impl SceneLight for PointLight {
    fn put_at(&mut self, place: Vec3) {
        self.position = place;
    }
}

fn read(table: &mut Table) -> Result<(Light, Option<DVec3>), SceneError> {
    let place = table.require("position")?.place()?;
    let light = PointLight {
        position: Vec3::ZERO,
        intensity: table.require("intensity")?.rgb()?,
    };
    Ok((Light::new(light), Some(place)))
}

fn present(context: &Context, first: u32) -> Option<Kind> {
    let shining = |(index, light)| {
        let light: &PointLight = Light::get(light)?;
        let shines = luminance(light.intensity) > 0.0;
        shines.then_some((Source::Light(index as u32), light))
    };
    let lights = context.scene.lights.iter().enumerate().filter_map(shining);
    let (sources, lights): (Vec<Source>, Vec<&PointLight>) = lights.unzip();
    let positions: Vec<Vec3> = lights.iter().map(|light| light.position).collect();
    let sampled = lights.iter().zip(sources).map(|(light, source)| Sampled {
        source,
        power: 4.0 * PI * luminance(light.intensity),
        radiance: light.intensity,
        is_discrete: true,
        ..Sampled::default()
    });
    (!lights.is_empty()).then(|| Kind {
        lights: sampled.collect(),
        ..kind(&positions, first)
    })
}

/// The kind with text and buffers for lights at these places, the first of which has an index.
fn kind(positions: &[Vec3], first: u32) -> Kind {
    let rows: Vec<[f32; 4]> = positions.iter().map(|p| p.extend(0.0).to_array()).collect();
    Kind {
        wgsl: vec![
            Piece::Written(wgsl::constant_u32("FIRST_POINT_LIGHT", first)),
            Piece::File(template!("point.wgsl")),
        ],
        buffers: vec![BufferData::new("point_lights", "array<vec4<f32>>", &rows)],
        ..Kind::of(&KIND)
    }
}
