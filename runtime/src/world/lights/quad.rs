//! Parallelograms that emit and reflect nothing.

use glam::{DVec3, Vec3};

use super::{Context, Kind, LightKind, Piece, Sampled, Source, luminance};
use crate::error::SceneError;
use crate::scene::{Light, SceneLight, Table, Value, has_area, optional};
use crate::wgsl::template::template;
use crate::world::needs::Need;

/// The kind.
pub(super) const KIND: LightKind = LightKind {
    name: "quad",
    needs: &[],
    read: Some(read),
    sample: "sample_quad_light",
    hit: Some("quad_light_hit"),
    escape: None,
    share: None,
    present,
    absent: |_| without_lights(),
};

/// A parallelogram that emits the same radiance in all directions of its front side.
///
/// Its two triangles are in the mesh of the scene with [`crate::scene::NO_MATERIAL`]; paths end on it.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadLight {
    /// One corner, in metres.
    pub corner: Vec3,
    /// Edge from the corner.
    pub u: Vec3,
    /// The other edge from the corner; the front side is where `u x v` points.
    pub v: Vec3,
    /// Emitted radiance, linear RGB, W/(m^2 sr).
    pub radiance: Vec3,
    /// Does the back emit as well?
    pub two_sided: bool,
    /// Do light samples pick points on it, or is it only found by chance?
    pub sample: bool,
}

impl SceneLight for QuadLight {
    fn put_at(&mut self, place: Vec3) {
        self.corner = place;
    }

    fn corners(&self, corner: DVec3) -> Vec<DVec3> {
        let [u, v] = [self.u, self.v].map(|edge| edge.as_dvec3());
        vec![corner, corner + u, corner + v, corner + u + v]
    }

    /// Corner, end of u, opposite corner, and corner, opposite corner, end of v.
    fn triangles(&self) -> Vec<[Vec3; 3]> {
        let QuadLight { corner, u, v, .. } = *self;
        let opposite = corner + u + v;
        vec![
            [corner, corner + u, opposite],
            [corner, opposite, corner + v],
        ]
    }
}

fn read(table: &mut Table) -> Result<(Light, Option<DVec3>), SceneError> {
    let corner = table.require("corner")?.place()?;
    let quad = QuadLight {
        corner: Vec3::ZERO,
        u: table.require("u")?.place()?.as_vec3(),
        v: table.require("v")?.place()?.as_vec3(),
        radiance: table.require("radiance")?.rgb()?,
        two_sided: optional(table, "two_sided", Value::boolean, false)?,
        sample: optional(table, "sample", Value::boolean, true)?,
    };
    if !has_area(&quad.triangles()[0]) {
        return Err(table
            .error("the quad light has no area")
            .hint("its edges `u` and `v` must not be zero or parallel"));
    }
    Ok((Light::new(quad), Some(corner)))
}

fn present(context: &Context, _first: u32) -> Option<Kind> {
    let first_triangles = first_triangles(context);
    let lights = context.scene.lights.iter().enumerate();
    let lights: Vec<Sampled> = lights
        .filter_map(|(index, light)| {
            // A quad where an equal one is has none.
            let first = first_triangles[index]?;
            sampled(context, index as u32, first, light.get()?)
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
        ..without_lights()
    })
}

fn without_lights() -> Kind {
    Kind {
        wgsl: vec![Piece::File(template!("quad.wgsl"))],
        ..Kind::of(&KIND)
    }
}

/// The first triangle of each light.
fn first_triangles(context: &Context) -> Vec<Option<usize>> {
    let mut first = vec![None; context.scene.lights.len()];
    for (triangle, light) in context.mesh.lights.iter().enumerate() {
        if let Some(light) = light {
            first[*light as usize].get_or_insert(triangle);
        }
    }
    first
}

fn sampled(context: &Context, index: u32, first: usize, quad: &QuadLight) -> Option<Sampled> {
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
