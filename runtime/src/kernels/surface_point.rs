//! What materials are told of a hit: the table of the fields of `SurfacePoint`, each with the WGSL that computes
//! it, the rows of needs that it takes, and what stands for it without them.

use impasto_compiler::abi::InputSet;

use crate::world::needs::{Need, Needs, When, when};

/// A field. The first row of its name whose condition holds counts.
struct Row {
    field: &'static str,
    when: When,
    value: &'static str,
    otherwise: &'static str,
}

macro_rules! rows {
    ($($field:literal [$($need:ident),*] $value:expr, $otherwise:expr;)+) => {
        const ROWS: &[Row] = &[$(Row {
            field: $field,
            when: when(&[$(Need::$need),*]),
            value: $value,
            otherwise: $otherwise,
        }),+];
    };
}

const NO_VECTOR: &str = "vec3<f32>(0.0)";
const NO_PAIR: &str = "vec2<f32>(0.0)";
const IDENTITY: &str = "mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)";
const GEOMETRIC: &str = "hit_geometric_normal(hit.primitive)";

rows! {
    "position" [Position, Moved] "in_world(hit_position(hit.primitive, barycentrics))", NO_VECTOR;
    "position" [Position] "hit_position(hit.primitive, barycentrics)", NO_VECTOR;
    "normal" [Normals] "hit_normal(hit.primitive, barycentrics)", GEOMETRIC;
    "geometric_normal" [] GEOMETRIC, GEOMETRIC;
    "tangent" [Tangents] "hit_tangent(hit.primitive)", NO_VECTOR;
    "uv" [Uvs] "hit_uv(hit.primitive, barycentrics)", NO_PAIR;
    "exterior_ior" [] "exterior_ior", "1.0";
    "footprint_x" [RayCones] "seen.x", NO_VECTOR;
    "footprint_y" [RayCones] "seen.y", NO_VECTOR;
    "footprint_uv_x" [RayCones, UvWidths] "hit_uv_change(hit.primitive, seen.x)", NO_PAIR;
    "footprint_uv_y" [RayCones, UvWidths] "hit_uv_change(hit.primitive, seen.y)", NO_PAIR;
    "view" [View] "wo", NO_VECTOR;
    "instance_id" [Places] "i32(hit_place(hit.primitive))", "0";
    "object_position" [Spaces] "hit_object_position(hit.primitive, barycentrics)", NO_VECTOR;
    "object_scale" [Spaces] "hit_object_scale(hit.primitive)", "1.0";
    "object_from_world" [Spaces] "hit_object_from_world(hit.primitive)", IDENTITY;
    "world_from_object" [Spaces] "hit_world_from_object(hit.primitive)", IDENTITY;
    "uv1" [Uvs1] "hit_uv1(hit.primitive, barycentrics)", NO_PAIR;
    "footprint_uv1_x" [RayCones, Uv1Widths] "hit_uv1_change(hit.primitive, seen.x)", NO_PAIR;
    "footprint_uv1_y" [RayCones, Uv1Widths] "hit_uv1_change(hit.primitive, seen.y)", NO_PAIR;
    "vertex_color" [Colors] "hit_color(hit.primitive, barycentrics)", "vec3<f32>(1.0)";
    "footprint_color_x" [RayCones, ColorWidths] "hit_color_change(hit.primitive, seen.x)", NO_VECTOR;
    "footprint_color_y" [RayCones, ColorWidths] "hit_color_change(hit.primitive, seen.y)", NO_VECTOR;
}

/// The function that fills the surface point of materials which read `inputs`.
pub(super) fn text(needs: Needs, inputs: InputSet) -> String {
    let cones = needs.has(Need::RayCones);
    let mut parameters = "hit: PathHit, exterior_ior: f32".to_owned();
    if cones || needs.has(Need::View) {
        parameters += ", wo: vec3<f32>";
    }
    if cones {
        parameters += ", width: f32";
    }
    let values: Vec<&str> = inputs.declared().map(|field| value(field, needs)).collect();
    let values = values.join(", ");
    let is_seen = values.contains("seen.");
    let (functions, statement) = if is_seen {
        let seen = "let seen = footprint(hit_geometric_normal(hit.primitive), wo, width);\n    ";
        (include_str!("../world/footprint.wgsl"), seen)
    } else {
        ("", "")
    };
    format!(
        "{functions}fn surface_point({parameters}) -> SurfacePoint {{\n    \
         let barycentrics = vec2<f32>(hit.u, hit.v);\n    {statement}\
         return SurfacePoint({values});\n}}\n"
    )
}

fn value(field: &str, needs: Needs) -> &'static str {
    let mut rows = ROWS.iter().filter(|row| row.field == field);
    let otherwise = rows.clone().map(|row| row.otherwise).next();
    let found = rows.find(|row| needs.met(row.when)).map(|row| row.value);
    found.or(otherwise).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use impasto_compiler::abi::Input;

    use super::*;

    #[test]
    fn every_field_has_a_value() {
        let all: Vec<Input> = Input::all().collect();
        for field in InputSet::of(&all).declared() {
            assert!(!value(field, Needs::default()).is_empty(), "{field}");
        }
        let fields: Vec<&str> = InputSet::of(&all).declared().collect();
        for row in ROWS {
            assert!(fields.contains(&row.field), "{}", row.field);
        }
    }
}
