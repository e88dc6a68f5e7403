//! Spheres that emit and reflect nothing: lamps, and with a cone, spots.
//!
//! A sphere is triangles in the mesh of the scene, as all that rays meet is. Each triangle has one that is its mirror
//! image through the centre. Of such a pair at most one faces a point, so that light samples choose a pair and take that
//! one: none is lost on the far side.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{Context, Kind, LightKind, Piece, Sampled, Source, luminance};
use crate::error::SceneError;
use crate::scene::{Light, SceneLight, Table, Value, optional};
use crate::wgsl::template::template;
use crate::wgsl::{self, BufferData};
use crate::world::needs::Need;

/// The kind.
pub(super) const KIND: LightKind = LightKind {
    name: "sphere",
    needs: &[],
    read: Some(read),
    sample: "sample_sphere_light",
    hit: Some("sphere_light_hit"),
    escape: None,
    share: None,
    present,
    absent: |_| kind(0, &[[0; WORDS]]),
};

/// Triangles of a sphere, without their mirror images: half of an icosahedron, each face split in four twice.
const PAIRS: usize = 10 * 16;

/// Words of a light in the buffer: the primitives of its triangles, then axis, cosine and slope of its cone.
const WORDS: usize = 2 * PAIRS + 5;

/// A sphere that emits the same radiance everywhere.
///
/// Its triangles are in the mesh of the scene with [`crate::scene::NO_MATERIAL`]; paths end on it. They have the surface
/// of the sphere together, so that its power is that of the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereLight {
    /// Its centre, in metres.
    pub center: Vec3,
    /// Its radius, in metres.
    pub radius: f32,
    /// Emitted radiance, linear RGB, W/(m^2 sr); of a cone along its axis.
    pub radiance: Vec3,
    /// Where it shines; none if everywhere.
    pub cone: Option<Cone>,
    /// Do light samples pick points on it, or is it only found by chance?
    pub sample: bool,
}

/// Directions that a light shines into, with a soft edge: glTF's KHR_lights_punctual, "Inner and Outer Cone Angles".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit direction of its axis, away from the light.
    pub axis: Vec3,
    /// Angle from the axis, in degrees, from which on there is no light.
    pub outer: f32,
    /// Angle from the axis, in degrees, up to which there is all light; not above `outer`.
    pub inner: f32,
}

impl Cone {
    /// Cosine of the outer angle, and one over how far the cosine goes from there to the inner one.
    fn fall(&self) -> [f64; 2] {
        let [outer, inner] = [self.outer, self.inner].map(|a| f64::from(a).to_radians().cos());
        [outer, 1.0 / (inner - outer).max(1e-6)]
    }

    /// The integral of its share of light over all directions, in sr.
    fn solid_angle(&self) -> f64 {
        let [outer, slope] = self.fall();
        let edge = 1.0 / slope;
        2.0 * PI * ((1.0 - outer - edge).max(0.0) + edge / 3.0)
    }
}

impl SceneLight for SphereLight {
    fn put_at(&mut self, place: Vec3) {
        self.center = place;
    }

    fn corners(&self, center: DVec3) -> Vec<DVec3> {
        let triangles = pairs(f64::from(self.radius));
        let corners = triangles.into_iter().flatten();
        corners.flat_map(|p| [center + p, center - p]).collect()
    }

    /// One of each pair, and then their mirror images in the same order.
    fn triangles(&self) -> Vec<[Vec3; 3]> {
        let pairs = pairs(f64::from(self.radius));
        let at = |p: DVec3| self.center + p.as_vec3();
        let ones = pairs.iter().map(|corners| corners.map(at));
        let others = pairs.iter().map(|[a, b, c]| [-*a, -*c, -*b].map(at));
        ones.chain(others).collect()
    }
}

/// One triangle of each pair on a sphere around 0, seen from outside counter-clockwise.
fn pairs(radius: f64) -> Vec<[DVec3; 3]> {
    let mut triangles = half_icosahedron();
    for _ in 0..2 {
        let split = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
    let half: f64 = triangles.iter().map(area).sum();
    let scale = radius * (2.0 * PI / half).sqrt();
    let scaled = triangles
        .into_iter()
        .map(|corners| corners.map(|p| scale * p));
    scaled.collect()
}

/// The five faces around a vertex of an icosahedron, and the five that share edges with them.
fn half_icosahedron() -> Vec<[DVec3; 3]> {
    let (height, width) = (1.0 / 5f64.sqrt(), 2.0 / 5f64.sqrt());
    let ring = |turn: f64, y: f64| {
        let angle = 0.4 * PI * turn;
        DVec3::new(width * angle.sin(), y, width * angle.cos())
    };
    let faces = (0..5).flat_map(|i| {
        let turn = f64::from(i);
        let [a, b] = [ring(turn, height), ring(turn + 1.0, height)];
        [[DVec3::Y, a, b], [b, a, ring(turn + 0.5, -height)]]
    });
    faces.collect()
}

fn read(table: &mut Table) -> Result<(Light, Option<DVec3>), SceneError> {
    let center = table.require("center")?.place()?;
    let above = |v: &Value| v.float_where("a radius above 0", |r| r > 0.0);
    let light = SphereLight {
        center: Vec3::ZERO,
        radius: above(&table.require("radius")?)?,
        radiance: table.require("radiance")?.rgb()?,
        cone: cone(table)?,
        sample: optional(table, "sample", Value::boolean, true)?,
    };
    Ok((Light::new(light), Some(center)))
}

fn cone(table: &mut Table) -> Result<Option<Cone>, SceneError> {
    let angle = |v: &Value| v.float_where("degrees above 0, up to 180", |a| a > 0.0 && a <= 180.0);
    let Some(outer) = optional(table, "cone", |v: &Value| angle(v).map(Some), None)? else {
        return Ok(None);
    };
    let hint = "a sphere with a `cone` needs the direction that it shines in";
    let direction = table.require("axis").map_err(|e| e.or_hint(hint))?;
    let axis = direction.vector()?.as_dvec3().normalize_or_zero().as_vec3();
    if axis == Vec3::ZERO {
        return Err(direction.mismatch("a direction that is not zero"));
    }
    let within =
        |v: &Value| v.float_where("degrees from 0 to `cone`", |a| (0.0..=outer).contains(&a));
    let inner = optional(table, "inner", within, 0.0)?;
    Ok(Some(Cone { axis, outer, inner }))
}

fn present(context: &Context, first: u32) -> Option<Kind> {
    let mut triangles = vec![Vec::new(); context.scene.lights.len()];
    for (triangle, light) in context.mesh.lights.iter().enumerate() {
        if let Some(light) = light {
            triangles[*light as usize].push(triangle as u32);
        }
    }
    let mut lights = Vec::new();
    let mut rows = Vec::new();
    let mut cones = 0;
    for (index, (light, triangles)) in context.scene.lights.iter().zip(triangles).enumerate() {
        let Some(sphere) = Light::get::<SphereLight>(light) else {
            continue;
        };
        let power = power(sphere);
        // A sphere where an equal one is has no triangles.
        if power > 0.0 && triangles.len() == 2 * PAIRS {
            rows.push(row(
                sphere,
                triangles.iter().map(|t| context.primitives[*t as usize]),
            ));
            cones += u32::from(sphere.cone.is_some());
            lights.push(Sampled {
                by_chance: !sphere.sample,
                power,
                radiance: sphere.radiance,
                source: Source::Light(index as u32),
                triangles,
                ..Sampled::default()
            });
        }
    }
    let count = lights.len();
    let of_rows = [
        (Need::SphereLights, count as u32, "of them"),
        (Need::SpotLights, cones, "with a `cone`"),
    ];
    let of_rows = of_rows.into_iter().filter(|(_, count, _)| *count > 0);
    (count > 0).then(|| Kind {
        rows: of_rows
            .map(|(need, count, what)| (need, format!("`[[lights]]` has {count} {what}")))
            .collect(),
        lights,
        chooses: true,
        ..kind(first, &rows)
    })
}

/// Watts that the sphere emits: of a convex body a direction sees a quarter of the surface on average.
fn power(light: &SphereLight) -> f64 {
    let seen = PI * f64::from(light.radius).powi(2);
    let directions = light.cone.map_or(4.0 * PI, |cone| cone.solid_angle());
    seen * directions * luminance(light.radiance)
}

/// The words of a light with these primitives; of one without a cone the latter holds every direction.
fn row(light: &SphereLight, primitives: impl Iterator<Item = u32>) -> [u32; WORDS] {
    let mut row = [0; WORDS];
    row.iter_mut()
        .zip(primitives)
        .for_each(|(word, p)| *word = p);
    let all = ([0.0; 3], [-2.0, 1.0]);
    let (axis, fall) = light
        .cone
        .map_or(all, |cone| (cone.axis.to_array(), cone.fall()));
    let numbers = axis.into_iter().chain(fall.map(|x| x as f32));
    let words = row[2 * PAIRS..].iter_mut();
    words.zip(numbers).for_each(|(word, x)| *word = x.to_bits());
    row
}

/// The kind with code for lights of these rows, the first of which has an index.
fn kind(first: u32, rows: &[[u32; WORDS]]) -> Kind {
    let constants = wgsl::constants_u32(&[
        ("FIRST_SPHERE_LIGHT", first),
        ("SPHERE_PAIRS", PAIRS as u32),
        ("SPHERE_WORDS", WORDS as u32),
    ]);
    Kind {
        wgsl: vec![
            Piece::Written(constants),
            Piece::File(template!("sphere.wgsl")),
        ],
        buffers: vec![BufferData::new("sphere_lights", "array<u32>", rows)],
        ..Kind::of(&KIND)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_a_closed_sphere_of_the_right_area_in_pairs() {
        let sphere = SphereLight {
            center: Vec3::ZERO,
            radius: 2.0,
            radiance: Vec3::ONE,
            cone: None,
            sample: true,
        };
        let triangles = sphere.triangles();
        assert_eq!(triangles.len(), 2 * PAIRS);
        let (mut area, mut volume) = (0.0, 0.0);
        for (i, corners) in triangles.iter().enumerate() {
            let [a, b, c] = corners.map(Vec3::as_dvec3);
            let normal = (b - a).cross(c - a);
            assert!(normal.dot(a + b + c) > 0.0, "{i} faces inwards");
            area += 0.5 * normal.length();
            volume += a.dot(b.cross(c)) / 6.0;
            let [x, y, z] = triangles[(i + PAIRS) % (2 * PAIRS)];
            assert_eq!(*corners, [-x, -z, -y], "{i} has no mirror image");
        }
        assert!((area / (16.0 * PI) - 1.0).abs() < 1e-6, "{area}");
        // Of all bodies of that area a sphere has the largest volume; holes or doubles would show.
        let share = volume / (4.0 / 3.0 * PI * 8.0);
        assert!((0.98..1.0).contains(&share), "{share}");
    }

    #[test]
    fn a_cone_is_as_large_as_its_share_of_light() {
        for (outer, inner) in [(90.0, 90.0), (45.0, 0.0), (180.0, 20.0), (60.0, 59.0)] {
            let cone = Cone {
                axis: Vec3::Y,
                outer,
                inner,
            };
            let [low, slope] = cone.fall();
            let steps = 1_000_000;
            let share = |i: u32| {
                let cosine = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
                ((cosine - low) * slope).clamp(0.0, 1.0).powi(2)
            };
            let sum: f64 = (0..steps).map(share).sum();
            let expected = 4.0 * PI * sum / f64::from(steps);
            let found = cone.solid_angle();
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{found}, not {expected}"
            );
        }
    }
}
