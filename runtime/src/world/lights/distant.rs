//! Lights so far away that they shine from one direction, or from a disc of directions.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::table::Share;
use super::{Context, Kind, LightKind, Piece, Sampled, Source, luminance};
use crate::error::SceneError;
use crate::scene::{Light, SceneLight, Table, Value, optional};
use crate::wgsl::template::template;
use crate::wgsl::{self, BufferData};
use crate::world::needs::{Need, Needs};

/// The kind.
pub(super) const KIND: LightKind = LightKind {
    name: "distant",
    needs: &[],
    read: Some(read),
    sample: "sample_distant_light",
    hit: None,
    escape: Some("distant_light_escape"),
    share: Some(Share {
        function: "distant_light_share",
        wgsl: template!("distant_groups.wgsl"),
        first: "FIRST_DISTANT_LIGHT",
        count: "DISTANT_LIGHTS",
    }),
    present,
    absent,
};

/// A light at infinity, of uniform radiance over a disc of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct DistantLight {
    /// Unit direction towards the light.
    pub to_light: Vec3,
    /// Irradiance on a surface that faces it, linear RGB, W/m^2.
    pub irradiance: Vec3,
    /// Angular diameter in degrees, below 180; 0 is a single direction.
    pub angle: f32,
    /// Do light samples pick directions in it, or is it only found by chance? A single direction
    /// is always sampled.
    pub sample: bool,
}

impl SceneLight for DistantLight {}

fn read(table: &mut Table) -> Result<(Light, Option<DVec3>), SceneError> {
    let hint = "the direction from the scene towards the light";
    let direction = table.require("to_light").map_err(|e| e.or_hint(hint))?;
    let to_light = direction.vector()?.as_dvec3().normalize_or_zero().as_vec3();
    if to_light == Vec3::ZERO {
        return Err(direction.mismatch("a direction that is not zero"));
    }
    let angle =
        |v: &Value| v.float_where("degrees from 0 to below 180", |v| (0.0..180.0).contains(&v));
    let light = DistantLight {
        to_light,
        irradiance: table.require("irradiance")?.rgb()?,
        angle: optional(table, "angle", angle, 0.0)?,
        sample: optional(table, "sample", Value::boolean, true)?,
    };
    if light.angle == 0.0 && !light.sample {
        return Err(table
            .error("a distant light of a single direction is not sampled, so nothing would find it")
            .hint("give it an `angle`, or leave `sample = false` out"));
    }
    Ok((Light::new(light), None))
}

fn present(context: &Context, first: u32) -> Option<Kind> {
    let shining = |(index, light)| {
        let light: &DistantLight = Light::get(light)?;
        let shines = luminance(light.irradiance) > 0.0;
        shines.then_some((Source::Light(index as u32), light))
    };
    let lights = context.scene.lights.iter().enumerate().filter_map(shining);
    let (sources, lights): (Vec<Source>, Vec<&DistantLight>) = lights.unzip();
    let sampled = lights.iter().zip(sources).map(|(light, source)| Sampled {
        source,
        power: luminance(light.irradiance) * context.cross_section(),
        by_chance: !light.sample,
        is_discrete: light.angle <= 0.0,
        ..Sampled::default()
    });
    let row = |need, what: &str, holds: fn(&DistantLight) -> bool| {
        let found = lights.iter().any(|light| holds(light));
        found.then(|| (need, format!("`[[lights]]` has a distant one {what}")))
    };
    let rows = [
        row(Need::DirectionalLights, "without an angle", |l| {
            l.angle <= 0.0
        }),
        row(Need::DiscLights, "with an angle", |l| l.angle > 0.0),
    ];
    let is_disc = lights.iter().any(|l| l.angle > 0.0);
    (!lights.is_empty()).then(|| Kind {
        rows: rows.into_iter().flatten().collect(),
        lights: sampled.collect(),
        ..kind(is_disc, &lights, first)
    })
}

/// The code has a light that is black, and not in the table.
fn absent(needs: Needs) -> Kind {
    let black = DistantLight {
        to_light: Vec3::Y,
        irradiance: Vec3::ZERO,
        angle: 1.0,
        sample: true,
    };
    kind(needs.has(Need::DiscLights), &[&black], 0)
}

/// The kind with code for `lights`. What is no disc, but a single direction, is never met by chance.
fn kind(is_disc: bool, lights: &[&DistantLight], first: u32) -> Kind {
    let constants = wgsl::constants_u32(&[
        ("FIRST_DISTANT_LIGHT", first),
        ("DISTANT_LIGHTS", lights.len() as u32),
    ]);
    let (lookup, buffers) = if lights.len() > MOST_IN_TEXT {
        (FROM_TABLE.to_owned(), vec![table(lights)])
    } else {
        (from_text(lights), Vec::new())
    };
    Kind {
        wgsl: vec![
            Piece::Written(constants),
            Piece::File(template!("distant.wgsl")),
            Piece::Written(lookup),
        ],
        buffers,
        escape: KIND.escape.filter(|_| is_disc),
        ..Kind::of(&KIND)
    }
}

/// So many lights are constants of the code, which is fastest. Drivers take long for more.
const MOST_IN_TEXT: usize = 16;

/// `distant_light` by a switch over constants.
fn from_text(lights: &[&DistantLight]) -> String {
    let mut text =
        "\nfn distant_light(index: u32) -> DistantLight {\n    switch index {\n".to_owned();
    for (index, light) in lights.iter().enumerate() {
        let case = if index + 1 == lights.len() {
            "default".to_owned()
        } else {
            format!("case {index}u")
        };
        text += &format!("        {case}: {{ return {}; }}\n", literal(light));
    }
    text + "    }\n}\n"
}

/// The same by a buffer of two rows a light.
const FROM_TABLE: &str = "
fn distant_light(index: u32) -> DistantLight {
    let axis = distant_lights[2u * index];
    let value = distant_lights[2u * index + 1u];
    return DistantLight(axis.xyz, value.xyz, axis.w, value.w);
}
";

fn table(lights: &[&DistantLight]) -> BufferData {
    let rows = lights.iter().flat_map(|light| {
        let (value, sine2, pdf) = fields(light);
        [light.to_light.extend(sine2), value.extend(pdf)].map(|row| row.to_array())
    });
    let rows: Vec<[f32; 4]> = rows.collect();
    BufferData::new("distant_lights", "array<vec4<f32>>", &rows)
}

fn literal(light: &DistantLight) -> String {
    let (value, sine2, pdf) = fields(light);
    let (axis, value) = (wgsl::vec3(light.to_light), wgsl::vec3(value));
    let [sine2, pdf] = [sine2, pdf].map(wgsl::float);
    format!("DistantLight({axis}, {value}, {sine2}, {pdf})")
}

/// `value`, `sine2` and `pdf` of the WGSL struct.
fn fields(light: &DistantLight) -> (Vec3, f32, f32) {
    let radius = 0.5 * f64::from(light.angle).to_radians();
    let sine2 = (0.5 * radius).sin().powi(2);
    let (value, pdf) = if sine2 > 0.0 {
        // A disc of radiance L gives L pi sin^2(radius) to a surface that faces it.
        let facing = PI * radius.sin().powi(2);
        (
            (light.irradiance.as_dvec3() / facing).as_vec3(),
            1.0 / (4.0 * PI * sine2),
        )
    } else {
        (light.irradiance, 0.0)
    };
    (value, sine2 as f32, pdf as f32)
}
