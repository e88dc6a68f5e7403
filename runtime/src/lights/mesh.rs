//! Triangles whose material emits the same radiance at every point of its front side.

use glam::Vec3;
use impasto_compiler::abi::Emission;

use super::{Context, Kind, Sampled, area, luminance};

pub(super) fn kind(context: &Context, _first: u32) -> Option<Kind> {
    let mesh = context.mesh;
    let lights: Vec<Sampled> = (0..mesh.len())
        .filter_map(|triangle| {
            let info = context.instances.get(mesh.materials[triangle] as usize)?;
            let Emission::Uniform(radiance) = info.emission else {
                return None;
            };
            let radiance = Vec3::from(radiance);
            let power = std::f64::consts::PI * area(mesh.positions[triangle]) * luminance(radiance);
            // Whether a boundary exists where it is hidden at times, a light sample cannot tell.
            let by_chance = context.media.overlap && info.medium.is_some();
            (power > 0.0).then(|| Sampled {
                power,
                by_chance,
                radiance,
                primitive: context.primitives[triangle],
                triangles: vec![triangle as u32],
                ..Sampled::default()
            })
        })
        .collect();
    (!lights.is_empty()).then(|| Kind {
        lights,
        wgsl: include_str!("../kernels/lights/mesh.wgsl").to_owned(),
        buffers: Vec::new(),
        sample: "sample_mesh_light",
        hit: Some("mesh_light_hit"),
        escape: None,
    })
}
