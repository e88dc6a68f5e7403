//! Where the surface is, how it lies, and when it is seen.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::text;
use crate::mtlx::types::Type::*;
use crate::mtlx::types::number;
use crate::mtlx::value::Value;

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "position",
        "->vector3 space:string=object",
        Code(place),
        "`object_position`, or `position` in world space",
    ),
    row(
        "normal",
        "->vector3 space:string=object",
        Code(place),
        "`object_normal`, or `normal` in world space",
    ),
    row(
        "tangent",
        "->vector3 space:string=object index:integer=0",
        Code(place),
        "`tangent`; that of the first texture coordinates",
    ),
    row(
        "bitangent",
        "->vector3 space:string=object index:integer=0",
        Code(place),
        "`cross(normal, tangent)`",
    ),
    row(
        "texcoord",
        "index:integer=0",
        Code(texcoord),
        "`uv`, or `uv1` for index 1",
    ),
    row(
        "geomcolor",
        "index:integer=0",
        Code(geomcolor),
        "`vertex_color`; opaque",
    ),
    row(
        "geompropvalue",
        "geomprop:string= default:any",
        Code(property),
        "`uv` of st, uv and UV0, `uv1` of UV1, `vertex_color` of displayColor; other properties have no counterpart",
    ),
    row(
        "UsdPrimvarReader",
        "varname:string= fallback:any",
        Code(property),
        "as `geompropvalue`",
    ),
    row(
        "viewdirection",
        "->vector3 space:string=world",
        Code(place),
        "`-view`",
    ),
    row(
        "facingratio",
        "->float viewdirection:vector3=@Vworld normal:vector3=@Nworld faceforward:boolean=true \
        invert:boolean=false",
        Code(facing),
        "`facing` by default",
    ),
    row("frame", "->float", Text("frame"), ""),
    row("time", "->float fps:float=24", Text("time"), ""),
    row(
        "transformpoint",
        "->vector3 in:vector3=0 fromspace:string= tospace:string=",
        Code(transform),
        "`world_from_object(in)` or `object_from_world(in)`",
    ),
    row(
        "transformvector",
        "->vector3 in:vector3=0 fromspace:string= tospace:string=",
        Code(transform),
        "the same of a vector",
    ),
    row(
        "transformnormal",
        "->vector3 in:vector3=0,0,1 fromspace:string= tospace:string=",
        Code(transform),
        "the same of a normal",
    ),
    row(
        "normalmap",
        "->vector3 in:vector3=0.5,0.5,1 scale:any=1 normal:vector3=@Nworld tangent:vector3=@Tworld \
        bitangent:vector3=@Bworld space:string=tangent",
        Code(normal_map),
        "`normal_map(color(in), normal, tangent, scale)`; the bitangent is at right angles to both",
    ),
    row(
        "heighttonormal",
        "->vector3 in:float=0 scale:float=1 texcoord:vector2=@UV0",
        Code(height_to_normal),
        "by the gradient of the height along the surface",
    ),
    row(
        "bump",
        "->vector3 height:float=0 scale:float=1 normal:vector3=@Nworld tangent:vector3=@Tworld \
        bitangent:vector3=@Bworld",
        Code(bump),
        "as `heighttonormal` and `normalmap`",
    ),
];

fn space(call: &mut Call<'_, '_, '_>, name: &str) -> Result<bool, ImportError> {
    let space = call.text(name)?;
    match space.as_str() {
        "world" => Ok(true),
        "object" | "model" => Ok(false),
        _ => {
            let message = format!("{} has the space `{space}`", call.described());
            Err(call.error(message).expected("`world`, `object` or `model`"))
        }
    }
}

fn place(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let is_world = space(call, "space")?;
    let category = call.row.category;
    if matches!(category, "tangent" | "bitangent") && call.arg("index")?.single() != Some(0.0) {
        call.warn("there is one tangent, that of the first texture coordinates");
    }
    let property = match (category, is_world) {
        ("position", true) => "Pworld",
        ("position", false) => "Pobject",
        ("normal", true) => "Nworld",
        ("normal", false) => "Nobject",
        ("tangent", true) => "Tworld",
        ("tangent", false) => "Tobject",
        ("bitangent", true) => "Bworld",
        ("bitangent", false) => "Bobject",
        (_, true) => "Vworld",
        (_, false) => return one(Value::geometric("object_from_world(vector(-view))")),
    };
    one(call.builder.geometry(property, call.key.node)?)
}

fn texcoord(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let uv = match call.arg("index")?.single() {
        Some(0.0) => "uv",
        Some(1.0) => "uv1",
        _ => {
            let message = format!("{} has an index other than 0 and 1", call.described());
            return Err(call
                .error(message)
                .expected("one of two sets of texture coordinates"));
        }
    };
    one(match call.ty {
        Vector3 => Value::new(Vector3, format!("vec3({uv}, 0.0)")),
        _ => Value::new(Vector2, uv),
    })
}

fn geomcolor(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    if call.arg("index")?.single() != Some(0.0) {
        call.warn("there is one color of corners");
    }
    one(vertex_color(call))
}

fn vertex_color(call: &Call<'_, '_, '_>) -> Value {
    Value::new(
        call.ty,
        match call.ty {
            Float => "vertex_color.r",
            Color4 => "vec4(vec3(vertex_color), 1.0)",
            _ => "vertex_color",
        },
    )
}

fn property(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (name, default) = match call.row.category {
        "geompropvalue" => ("geomprop", "default"),
        _ => ("varname", "fallback"),
    };
    let property = call.text(name)?;
    if matches!(property.as_str(), "displayColor" | "Cd") {
        return one(vertex_color(call));
    }
    match call.builder.geometry(&property, call.key.node) {
        Ok(value) if value.ty == call.ty => one(value),
        Ok(value) => {
            let message = format!(
                "{} asks for `{property}` as a `{}`",
                call.described(),
                call.ty.name()
            );
            Err(call
                .error(message)
                .expected(format!("`{}`", value.ty.name())))
        }
        Err(error) => match call.given(default)? {
            // What the geometry lacks has this value by its own words.
            Some(value) => {
                call.warn(format!(
                    "the geometry has no property `{property}`: its default is taken"
                ));
                one(value)
            }
            None => Err(error),
        },
    }
}

fn facing(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let is = |value: Value| value.text == "true";
    let plain = call.given("viewdirection")?.is_none() && call.given("normal")?.is_none();
    let forward = is(call.arg("faceforward")?);
    let text = match (plain, forward) {
        (true, true) => "facing".to_owned(),
        (_, true) => call.filled("abs(dot({viewdirection}, {normal}))")?,
        (_, false) => call.filled("-dot({viewdirection}, {normal})")?,
    };
    let text = if is(call.arg("invert")?) {
        format!("1.0 - {}", text::bound(&text, text::Level::Product))
    } else {
        text
    };
    one(Value::new(Float, text))
}

fn transform(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (from, to) = (space(call, "fromspace")?, space(call, "tospace")?);
    if from == to {
        return one(call.arg("in")?);
    }
    let kind = call.row.category.trim_start_matches("transform");
    let way = if to {
        "world_from_object"
    } else {
        "object_from_world"
    };
    let input = call.arg("in")?;
    let inner = if input.is_geometric && kind != "vector" {
        input.text
    } else {
        format!("{kind}({})", input.plain())
    };
    one(Value::geometric(format!("{way}({inner})")))
}

/// The arguments `normal` and `tangent` of a normal map.
fn frame(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    let around = |call: &mut Call<'_, '_, '_>, name: &str| -> Result<String, ImportError> {
        Ok(match call.given(name)? {
            Some(value) if !value.is_zero() => value.text,
            _ => name.to_owned(),
        })
    };
    Ok(format!(
        "{}, {}",
        around(call, "normal")?,
        around(call, "tangent")?
    ))
}

fn normal_map(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    if call.text("space")? == "object" {
        let text = call.filled("2.0 * {in} - 1.0")?;
        return one(Value::new(Vector3, text));
    }
    let frame = frame(call)?;
    let scale = call.arg("scale")?;
    let text = match (scale.ty, scale.single()) {
        (_, Some(1.0)) => call.filled(&format!("@pattern::normal_map(color({{in}}), {frame})"))?,
        (Vector2, None) => call.filled(&format!(
            "@pattern::normal_map(#scaled_normal_map({{in}}, {{scale}}), {frame})"
        ))?,
        (_, Some(scale)) => {
            let scale = number(scale);
            call.filled(&format!(
                "@pattern::normal_map(color({{in}}), {frame}, scale: {scale})"
            ))?
        }
        _ => call.filled(&format!(
            "@pattern::normal_map(color({{in}}), {frame}, scale: {{scale}})"
        ))?,
    };
    one(Value::geometric(text))
}

/// The texel of a normal map for a height.
fn height_texel(
    call: &mut Call<'_, '_, '_>,
    height: &str,
    uv: &str,
) -> Result<String, ImportError> {
    let height = call.arg(height)?;
    let scale = call.arg("scale")?;
    // What a filter over neighbouring texels would give, which other renderers have.
    let height = call.named("height", height).text;
    let scale = match (call.row.category, scale.single()) {
        ("bump", _) => "0.0625".to_owned(),
        (_, Some(scale)) => number(scale / 16.0),
        _ => format!("0.0625 * {}", text::bound(&scale.text, text::Level::Prefix)),
    };
    let uv = text::bound(uv, text::Level::Atom);
    let helper = call.builder.source.names_in("#height_normal");
    Ok(format!(
        "{helper}(gradient({scale} * {height}), gradient({uv}.x), gradient({uv}.y))"
    ))
}

fn height_to_normal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let uv = call.arg("texcoord")?;
    let uv = call.named("texcoord", uv).text;
    let text = height_texel(call, "in", &uv)?;
    one(Value::new(Vector3, text))
}

fn bump(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let texel = height_texel(call, "height", "uv")?;
    let frame = frame(call)?;
    let text = call.filled(&format!(
        "@pattern::normal_map(color(TEXEL), {frame}, scale: {{scale}})"
    ))?;
    one(Value::geometric(text.replace("TEXEL", &texel)))
}
