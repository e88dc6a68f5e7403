//! Parallelograms that emit and reflect nothing.

use super::{Context, Kind, Piece, Sampled, Source, luminance};
use crate::scene::{Light, QuadLight};
use crate::wgsl::template::template;
use crate::world::needs::Need;

pub(super) fn kind(context: &Context, _first: u32) -> Option<Kind> {
    let lights = context.scene.lights.iter().enumerate();
    let lights: Vec<Sampled> = lights
        .filter_map(|(index, light)| match light {
            Light::Quad(quad) => sampled(context, index as u32, quad),
            _ => None,
        })
        .collect();
    let count = lights.len();
    let mut rows = vec![(
        Need::QuadLights,
        format!("`[[lights]]` has {count} of them"),
    )];
    if lights.iter().any(|light| light.flag != 0) {
        let what = "`two_sided` is set for a quad of `[[lights]]`".to_owned();
        rows.push((Need::TwoSidedLights, what));
    }
    (!lights.is_empty()).then(|| Kind {
        rows,
        lights,
        ..empty()
    })
}

/// The kind without a light.
pub(super) fn empty() -> Kind {
    Kind {
        serves: &[Need::QuadLights, Need::TwoSidedLights],
        idle: false,
        rows: Vec::new(),
        lights: Vec::new(),
        wgsl: vec![Piece::File(template!("quad.wgsl"))],
        buffers: Vec::new(),
        sample: "sample_quad_light",
        hit: Some("quad_light_hit"),
        escape: None,
        chooses: false,
    }
}

fn sampled(context: &Context, index: u32, quad: &QuadLight) -> Option<Sampled> {
    let of_quad = |light: &Option<u32>| *light == Some(index);
    let lights = &context.mesh.lights;
    let first = lights.iter().position(of_quad)?;
    let area = quad.u.as_dvec3().cross(quad.v.as_dvec3()).length();
    let sides = if quad.two_sided { 2.0 } else { 1.0 };
    let power = std::f64::consts::PI * sides * area * luminance(quad.radiance);
    (power > 0.0).then(|| Sampled {
        by_chance: !quad.sample,
        power,
        radiance: quad.radiance,
        primitive: context.primitives[first],
        source: Source::Light(index),
        flag: u32::from(quad.two_sided),
        is_discrete: false,
        triangles: vec![first as u32, first as u32 + 1],
    })
}
