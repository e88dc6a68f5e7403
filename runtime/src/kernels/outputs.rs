//! The text that records outputs of the film: one function for each point of a path at which there is something
//! to record, made of the rows of the table of outputs.
//!
//! | function | its values may mention |
//! |---|---|
//! | `record_first_hit` | `hit`, `way` (of the ray), `instance`, `corners`, `position` (in the scene's coordinates), `place` (in the world), `geometric`, `normal` |
//! | `record_material` | `instance`, `point`, `wo` |
//! | `record_sample` | `radiance` |
//! | `record_light` | `light` |

use crate::film::layers::{Layer, Layers};
use crate::film::outputs::{At, ID_SLOTS, Kind, LIMIT, Output};
use crate::wgsl;
use crate::world::needs::{Need, Needs};

/// The functions, for a kernel that has what `needs` says.
pub(crate) fn text(layers: &Layers, needs: Needs) -> String {
    let mut out = wgsl::constant_u32("ID_SLOTS", ID_SLOTS as u32) + include_str!("outputs.wgsl");
    if needs.has(Need::FirstHitOutputs) {
        out += &first_hit(layers, needs);
    }
    if needs.has(Need::MaterialOutputs) {
        out += &format!(
            "fn record_material(pixel: u32, instance: u32, point: SurfacePoint, wo: vec3<f32>) {{\n{}}}\n",
            statements(layers, At::Material)
        );
    }
    if needs.has(Need::SampleOutputs) {
        out += &format!(
            "fn record_sample(pixel: u32, radiance: vec3<f32>) {{\n{}}}\n",
            statements(layers, At::Sample)
        );
    }
    if needs.has(Need::LightGroups) {
        out += &light(layers);
    }
    out
}

fn first_hit(layers: &Layers, needs: Needs) -> String {
    let pick = |need, value, other| if needs.has(need) { value } else { other };
    let place = pick(Need::Moved, "in_world(position)", "position");
    let normal = pick(
        Need::Normals,
        "hit_normal(hit.primitive, corners)",
        "geometric",
    );
    let bare = layers.placed().filter(|(_, l)| !l.output.bare.is_empty());
    let bare: String = bare
        .map(|(plane, layer)| statement(plane, layer.output, layer.output.bare))
        .collect();
    let bare = if bare.is_empty() {
        bare
    } else {
        format!("    if instance == NOTHING {{\n{bare}    }}\n")
    };
    format!(
        "fn record_first_hit(pixel: u32, hit: PathHit, way: vec3<f32>, instance: u32) {{\n    \
         let corners = vec2<f32>(hit.u, hit.v);\n    \
         let position = hit_position(hit.primitive, corners);\n    \
         let place = {place};\n    \
         let geometric = hit_geometric_normal(hit.primitive);\n    \
         let normal = {normal};\n{}{bare}}}\n",
        statements(layers, At::FirstHit)
    )
}

/// Light that is gathered, and the group that it comes from.
fn light(layers: &Layers) -> String {
    let groups: Vec<(usize, &Layer)> = layers
        .placed()
        .filter(|(_, l)| l.output.at == At::Light)
        .collect();
    let Some((first, layer)) = groups.first() else {
        return String::new();
    };
    let planes = layer.output.planes();
    let plane = format!("{first}u + {planes}u * group");
    let recorded = add(&plane, layer.output, layer.output.value);
    format!(
        "fn record_light(pixel: u32, group: u32, light: vec3<f32>) {{\n    \
         if group < {}u {{\n    {recorded}    }}\n}}\n",
        groups.len()
    )
}

fn statements(layers: &Layers, at: At) -> String {
    let recorded = layers.placed().filter(|(_, l)| l.output.at == at);
    let each = recorded.map(|(plane, layer)| statement(plane, layer.output, layer.output.value));
    each.collect()
}

fn statement(plane: usize, output: &Output, value: &str) -> String {
    add(&format!("{plane}u"), output, value)
}

/// Adds a value to an output whose first plane is `plane`.
fn add(plane: &str, output: &Output, value: &str) -> String {
    let count = output.channels.len();
    let sum = |low: f32, high: f32| {
        let value = match count {
            1 => format!("vec3<f32>({value}, 0.0, 0.0)"),
            2 => format!("vec3<f32>({value}, 0.0)"),
            _ => value.to_owned(),
        };
        let (low, high) = (wgsl::float(low), wgsl::float(high));
        format!("    film_add_values({plane}, pixel, {value}, {count}u, {low}, {high});\n")
    };
    match output.kind {
        Kind::Mean(_, low, high) => sum(low, high),
        Kind::Variance => sum(0.0, LIMIT),
        Kind::Share => format!("    atomicAdd(&film[({plane}) * PIXELS + pixel], 1u);\n"),
        Kind::Nearest => format!("    film_add_nearest({plane}, pixel, {value});\n"),
        Kind::Ids => format!("    film_add_id({plane}, pixel, {value});\n"),
        Kind::Samples => String::new(),
    }
}
