//! What surrounds the scene: the same radiance everywhere, or a lat-long picture whose texels
//! are sampled by the light they send.

use std::f64::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::alias::PackedAlias;
use super::{Context, Kind, LightKind, Piece, Sampled, luminance};
use crate::scene::{Environment, EnvironmentMap, EnvironmentSource};
use crate::wgsl;
use crate::wgsl::BufferData;
use crate::wgsl::template::template;
use crate::world::needs::{Need, Needs};

/// The kind.
pub(super) const KIND: LightKind = LightKind {
    name: "environment",
    needs: &[],
    read: None,
    sample: "sample_environment",
    hit: None,
    escape: Some("environment_escape"),
    share: None,
    present,
    absent,
};

fn present(context: &Context, first: u32) -> Option<Kind> {
    let environment = context.scene.environment.as_ref()?;
    match &environment.source {
        EnvironmentSource::Uniform(radiance) => uniform(context, environment, *radiance, first),
        EnvironmentSource::Map(map) => mapped(context, environment, map, first),
    }
}

/// The kind with its one light, if sampled, of `irradiance` W/m^2 summed over all directions.
fn environment_kind(
    context: &Context,
    (need, what): (Need, &str),
    irradiance: Option<f64>,
    wgsl: Vec<Piece>,
) -> Kind {
    let sampled = irradiance.map(|irradiance| Sampled {
        power: irradiance * context.cross_section(),
        ..Sampled::default()
    });
    Kind {
        rows: vec![(need, what.to_owned())],
        lights: sampled.into_iter().collect(),
        wgsl,
        ..Kind::of(&KIND)
    }
}

const UNIFORM: (Need, &str) = (
    Need::UniformEnvironment,
    "`[environment]` has the same color everywhere",
);
const MAP: (Need, &str) = (Need::EnvironmentMap, "`[environment]` names a picture");

/// A black environment that is not in the table of lights: a picture of one texel, or one of one color.
fn absent(needs: Needs) -> Kind {
    if !needs.has(Need::EnvironmentMap) {
        return Kind {
            wgsl: uniform_text(Vec3::ZERO, 0),
            ..Kind::of(&KIND)
        };
    }
    let map = EnvironmentMap {
        width: 1,
        height: 1,
        texels: vec![Vec3::ZERO],
    };
    let table = Importance::new(&map);
    Kind {
        wgsl: sampled_map_text(&map, 0.0, 0),
        buffers: map_buffers(&map, &table),
        ..Kind::of(&KIND)
    }
}

fn uniform(
    context: &Context,
    environment: &Environment,
    radiance: Vec3,
    first: u32,
) -> Option<Kind> {
    if luminance(radiance) <= 0.0 {
        return None;
    }
    if !environment.sample {
        let text = vec![
            Piece::Written(wgsl::constant_vec3("ENVIRONMENT_RADIANCE", radiance)),
            Piece::File(template!("environment_uniform.wgsl")),
        ];
        return Some(environment_kind(context, UNIFORM, None, text));
    }
    let text = uniform_text(radiance, first);
    let irradiance = 4.0 * PI * luminance(radiance);
    Some(environment_kind(context, UNIFORM, Some(irradiance), text))
}

fn uniform_text(radiance: Vec3, light: u32) -> Vec<Piece> {
    let constants = wgsl::constant_vec3("ENVIRONMENT_RADIANCE", radiance)
        + &wgsl::constant_u32("ENVIRONMENT_LIGHT", light);
    vec![
        Piece::Written(constants),
        Piece::File(template!("environment_uniform_sampled.wgsl")),
    ]
}

fn mapped(
    context: &Context,
    environment: &Environment,
    map: &EnvironmentMap,
    first: u32,
) -> Option<Kind> {
    let table = Importance::new(map);
    if table.irradiance <= 0.0 {
        return None;
    }
    if !environment.sample {
        let mut text = map_text(map, environment.rotate);
        text.push(Piece::File(template!("environment_map_unsampled.wgsl")));
        let mut kind = environment_kind(context, MAP, None, text);
        kind.buffers = vec![texel_buffer(map, &[])];
        return Some(kind);
    }
    let text = sampled_map_text(map, environment.rotate, first);
    Some(Kind {
        buffers: map_buffers(map, &table),
        chooses: true,
        ..environment_kind(context, MAP, Some(table.irradiance), text)
    })
}

/// What samples of a map and rays that escape have in common; it is turned by `rotate` degrees.
fn map_text(map: &EnvironmentMap, rotate: f32) -> Vec<Piece> {
    let (sine, cosine) = f64::from(rotate).to_radians().sin_cos();
    let constants = wgsl::constant_u32("ENVIRONMENT_WIDTH", map.width)
        + &wgsl::constant_u32("ENVIRONMENT_HEIGHT", map.height)
        + &wgsl::constant_f32("ENVIRONMENT_SINE", sine as f32)
        + &wgsl::constant_f32("ENVIRONMENT_COSINE", cosine as f32);
    vec![
        Piece::Written(constants),
        Piece::File(template!("environment_map.wgsl")),
    ]
}

/// The same with samples of the map, which is the light of an index.
fn sampled_map_text(map: &EnvironmentMap, rotate: f32, light: u32) -> Vec<Piece> {
    let mut text = map_text(map, rotate);
    let constant = wgsl::constant_u32("ENVIRONMENT_LIGHT", light);
    text.push(Piece::Written(constant));
    text.push(Piece::File(template!("environment_map_sampled.wgsl")));
    text
}

fn map_buffers(map: &EnvironmentMap, table: &Importance) -> Vec<BufferData> {
    let alias = BufferData::new("environment_alias", "array<u32>", &table.alias);
    vec![texel_buffer(map, &table.densities), alias]
}

fn texel_buffer(map: &EnvironmentMap, densities: &[f32]) -> BufferData {
    let densities = densities.iter().copied().chain(std::iter::repeat(0.0));
    let texels: Vec<[f32; 4]> = map
        .texels
        .iter()
        .zip(densities)
        .map(|(rgb, density)| rgb.extend(density).to_array())
        .collect();
    BufferData::new("environment_texels", "array<vec4<f32>>", &texels)
}

/// Tables for sampling a map in proportion to the light of each texel.
struct Importance {
    /// One word a texel, then one a row; see `environment_map_sampled.wgsl`.
    alias: Vec<u32>,
    /// Density of each texel by solid angle.
    densities: Vec<f32>,
    /// Luminance integrated over all directions.
    irradiance: f64,
}

impl Importance {
    fn new(map: &EnvironmentMap) -> Importance {
        let means = mean_luminances(map);
        let width = map.width as usize;
        let solid_angles: Vec<f64> = (0..map.height).map(|row| solid_angle(map, row)).collect();
        let rows: Vec<PackedAlias> = means.par_chunks(width).map(PackedAlias::new).collect();
        let row_weights: Vec<f64> = means
            .chunks(width)
            .zip(&solid_angles)
            .map(|(row, solid_angle)| row.iter().sum::<f64>() * solid_angle)
            .collect();
        let choice = PackedAlias::new(&row_weights);
        let mut densities = Vec::with_capacity(means.len());
        for (row, columns) in rows.iter().enumerate() {
            let factor = choice.probabilities[row] / solid_angles[row];
            densities.extend(columns.probabilities.iter().map(|p| (p * factor) as f32));
        }
        let mut alias: Vec<u32> = rows.iter().flat_map(|r| &r.words).copied().collect();
        alias.extend(&choice.words);
        Importance {
            alias,
            densities,
            irradiance: row_weights.iter().sum(),
        }
    }
}

/// Solid angle of a texel of `row`.
fn solid_angle(map: &EnvironmentMap, row: u32) -> f64 {
    let edge = |row: u32| (PI * f64::from(row) / f64::from(map.height)).cos();
    2.0 * PI / f64::from(map.width) * (edge(row) - edge(row + 1))
}

/// The mean over each texel of what a bilinear lookup gives there: in each direction an eighth of
/// either neighbour and three quarters of the texel itself. It is zero only where the lookup is.
fn mean_luminances(map: &EnvironmentMap) -> Vec<f64> {
    let (width, height) = (map.width as usize, map.height as usize);
    let blend = |before: f64, here: f64, after: f64| (before + 6.0 * here + after) / 8.0;
    let along_rows: Vec<f64> = map
        .texels
        .par_chunks(width)
        .flat_map_iter(|row| {
            let at = move |x: usize| luminance(row[x % width]);
            (0..width).map(move |x| blend(at(x + width - 1), at(x), at(x + 1)))
        })
        .collect();
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let row = |y: usize| &along_rows[y * width..(y + 1) * width];
            let (above, here) = (row(y.saturating_sub(1)), row(y));
            let below = row((y + 1).min(height - 1));
            (0..width).map(move |x| blend(above[x], here[x], below[x]))
        })
        .collect()
}
