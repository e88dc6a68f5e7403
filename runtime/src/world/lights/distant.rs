//! Lights so far away that they shine from one direction, or from a disc of directions.

use std::f64::consts::PI;

use glam::Vec3;

use super::{Context, Kind, Piece, Sampled, Source, luminance};
use crate::scene::{DistantLight, Light};
use crate::wgsl;
use crate::wgsl::template::template;
use crate::world::needs::Need;

pub(super) fn kind<'a>(context: &Context<'a>, first: u32) -> Option<Kind> {
    let shining = |(index, light): (usize, &'a Light)| match light {
        Light::Distant(distant) if luminance(distant.irradiance) > 0.0 => {
            Some((Source::Light(index as u32), distant))
        }
        _ => None,
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
        wgsl: text(&lights, first),
        ..empty(is_disc)
    })
}

/// The kind without a light; its code has one that is black, and not in the table. What is no disc, but a single
/// direction, is never met by chance.
pub(super) fn empty(is_disc: bool) -> Kind {
    let black = DistantLight {
        to_light: Vec3::Y,
        irradiance: Vec3::ZERO,
        angle: 1.0,
        sample: true,
    };
    Kind {
        serves: &[Need::DirectionalLights, Need::DiscLights],
        idle: false,
        rows: Vec::new(),
        lights: Vec::new(),
        wgsl: text(&[&black], 0),
        buffers: Vec::new(),
        sample: "sample_distant_light",
        hit: None,
        escape: is_disc.then_some("distant_light_escape"),
        chooses: false,
    }
}

fn text(lights: &[&DistantLight], first: u32) -> Vec<Piece> {
    let constants = wgsl::constants_u32(&[
        ("FIRST_DISTANT_LIGHT", first),
        ("DISTANT_LIGHTS", lights.len() as u32),
    ]);
    let mut text =
        "\nfn distant_light(index: u32) -> DistantLight {\n    switch index {\n".to_owned();
    for (index, light) in lights.iter().enumerate() {
        let case = match index + 1 == lights.len() {
            true => "default".to_owned(),
            false => format!("case {index}u"),
        };
        text += &format!("        {case}: {{ return {}; }}\n", literal(light));
    }
    text += "    }\n}\n";
    vec![
        Piece::Written(constants),
        Piece::File(template!("distant.wgsl")),
        Piece::Written(text),
    ]
}

fn literal(light: &DistantLight) -> String {
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
    let (axis, value) = (wgsl::vec3(light.to_light), wgsl::vec3(value));
    let [sine2, pdf] = [sine2, pdf].map(|x| wgsl::float(x as f32));
    format!("DistantLight({axis}, {value}, {sine2}, {pdf})")
}
