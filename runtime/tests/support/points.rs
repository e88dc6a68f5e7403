//! A surface point for materials that are asked without a scene: the fields beyond the first six, which are in
//! code that reads them alone, as WGSL and as values of the interpreter.

use impasto_compiler::Program;
use impasto_compiler::ir::Type;
use impasto_compiler::ir::value::{Real, Value};

/// Fields that every module has.
const FIRST: usize = 6;

/// What a pixel sees of the surface, in metres, and in texture coordinates.
const SEEN: f64 = 1.0 / 512.0;

/// A field's WGSL, where `p` is the position and `wo` the view.
fn text(field: &str) -> &'static str {
    match field {
        "footprint_x" => "vec3<f32>(0.001953125, 0.0, 0.0)",
        "footprint_y" => "vec3<f32>(0.0, 0.001953125, 0.0)",
        "footprint_uv_x" | "footprint_uv1_x" => "vec2<f32>(0.001953125, 0.0)",
        "footprint_uv_y" | "footprint_uv1_y" => "vec2<f32>(0.0, 0.001953125)",
        "view" => "wo",
        "instance_id" => "3",
        "object_position" => "p.xyz",
        "object_scale" => "1.0",
        "object_from_world" | "world_from_object" => {
            "mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)"
        }
        "uv1" => "vec2<f32>(0.25, 0.5)",
        "vertex_color" => "vec3<f32>(0.25, 0.5, 0.75)",
        "footprint_color_x" | "footprint_color_y" => "vec3<f32>(0.0)",
        other => panic!("no value for the field `{other}`"),
    }
}

/// The same as a value.
fn value<F: Real>(field: &str, position: &Value<F>, wo: &Value<F>) -> Value<F> {
    let of = |numbers: &[f64]| Value::vector(numbers);
    match field {
        "footprint_x" => of(&[SEEN, 0.0, 0.0]),
        "footprint_y" => of(&[0.0, SEEN, 0.0]),
        "footprint_uv_x" | "footprint_uv1_x" => of(&[SEEN, 0.0]),
        "footprint_uv_y" | "footprint_uv1_y" => of(&[0.0, SEEN]),
        "view" => wo.clone(),
        "instance_id" => Value::Int(3),
        "object_position" => position.clone(),
        "object_scale" => Value::float(1.0),
        "object_from_world" | "world_from_object" => {
            let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            Value::Mat3(unit.map(|column| column.map(F::of)))
        }
        "uv1" => of(&[0.25, 0.5]),
        "vertex_color" => of(&[0.25, 0.5, 0.75]),
        _ => of(&[0.0; 3]),
    }
}

/// The arguments of `SurfacePoint` after the first six, in the module of the program's first material.
pub(crate) fn arguments(program: &Program) -> String {
    let inputs = program.infos()[0].inputs;
    let fields = inputs.declared().skip(FIRST);
    fields.map(|field| format!(", {}", text(field))).collect()
}

/// The fields of the surface point after the first six, for the interpreter.
pub(crate) fn values<F: Real>(
    program: &Program,
    position: &Value<F>,
    wo: &Value<F>,
) -> Vec<Value<F>> {
    let Some(Type::Struct(point)) = program.compiled()[0].evaluate.params.first().map(|p| p.ty)
    else {
        return Vec::new();
    };
    let fields = program.ir().structs[point.index()].fields.iter();
    let fields = fields.skip(FIRST);
    fields.map(|(name, _)| value(name, position, wo)).collect()
}
