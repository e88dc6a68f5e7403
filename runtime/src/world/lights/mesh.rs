//! Triangles whose material emits the same radiance at every point of its front side.

use glam::Vec3;
use impasto_compiler::abi::Emission;

use super::{Context, Kind, LightKind, Piece, Sampled, Source, area, luminance};
use crate::wgsl::template::template;
use crate::world::needs::Need;

/// The kind.
pub(super) const KIND: LightKind = LightKind {
    name: "mesh",
    needs: &[],
    read: None,
    sample: "sample_mesh_light",
    hit: Some("mesh_light_hit"),
    escape: None,
    share: None,
    present,
    absent: |_| without_lights(),
};

fn present(context: &Context, _first: u32) -> Option<Kind> {
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
                source: Source::Material(mesh.materials[triangle]),
                triangles: vec![triangle as u32],
                ..Sampled::default()
            })
        })
        .collect();
    let named = |light: &Sampled| {
        let material = mesh.materials[light.triangles[0] as usize] as usize;
        let name = context.instances.get(material).map_or("", |i| &i.name);
        format!("`{name}` emits the same light everywhere on its front")
    };
    let rows = lights.first().map(|light| (Need::MeshLights, named(light)));
    (!lights.is_empty()).then(|| Kind {
        rows: rows.into_iter().collect(),
        lights,
        ..without_lights()
    })
}

fn without_lights() -> Kind {
    Kind {
        wgsl: vec![Piece::File(template!("mesh.wgsl"))],
        ..Kind::of(&KIND)
    }
}
