//! Components of values, and values of other types.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::{Made, NodeRow, matrices, one, row};
use crate::mtlx::text::{Level, bound, is_simple};
use crate::mtlx::types::Literal;
use crate::mtlx::types::Type::{self, *};
use crate::mtlx::value::Value;

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "convert",
        "in:any=0",
        Code(convert),
        "a call of the type; a color without alpha becomes opaque",
    ),
    row(
        "combine2",
        "in1:any=0 in2:any=0",
        Code(combine2),
        "a call of the type",
    ),
    row(
        "combine3",
        "in1:float=0 in2:float=0 in3:float=0",
        Text("$T({in1}, {in2}, {in3})"),
        "a call of the type",
    ),
    row(
        "combine4",
        "in1:float=0 in2:float=0 in3:float=0 in4:float=0",
        Text("$T({in1}, {in2}, {in3}, {in4})"),
        "a call of the type",
    ),
    row(
        "extract",
        "in:any=0 index:integer=0",
        Code(extract),
        "a component; `index` must be known",
    ),
    row("separate2", "in:any=0", Code(separate), "components"),
    row("separate3", "in:any=0", Code(separate), "components"),
    row("separate4", "in:any=0", Code(separate), "components"),
    row(
        "swizzle",
        "in:any=0 channels:string=",
        Code(swizzle),
        "of version 1.38: components, 0 and 1",
    ),
];

fn convert(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let value = call.arg("in")?;
    let template = match (value.ty, call.ty) {
        (from, to) if from == to => "{in}",
        (Integer, Float) => "float({in})",
        (Boolean, Float) => "if {in} { 1.0 } else { 0.0 }",
        (Boolean, Integer) => "if {in} { 1 } else { 0 }",
        (Integer, Boolean) => "{in} != 0",
        (Float, Boolean) => "{in} != 0.0",
        (Float, Integer) => "int({in})",
        (Boolean, Color3 | Vector2 | Vector3 | Color4 | Vector4) => {
            "$T(if {in} { 1.0 } else { 0.0 })"
        }
        (Float, Color3 | Color4 | Vector2 | Vector3 | Vector4) => "$T({in})",
        (Integer, Color3 | Color4 | Vector2 | Vector3 | Vector4) => "$T(float({in}))",
        (Color3, Vector3) | (Vector3, Color3) => "$T({in})",
        (Color3, Vector2) => "vec3({in}).xy",
        (Color3, Color4 | Vector4) => "vec4(vec3({in}), 1.0)",
        (Vector3, Color4 | Vector4) => "vec4({in}, 1.0)",
        (Vector3 | Color4 | Vector4, Vector2) => "{in}.xy",
        (Color4 | Vector4, Color3) => "color({in}.xyz)",
        (Color4 | Vector4, Vector3) => "{in}.xyz",
        (Color4, Vector4) | (Vector4, Color4) => "{in}",
        (Vector2, Color3 | Vector3) => "$T({in}.x, {in}.y, 0.0)",
        (Vector2, Color4 | Vector4) => "vec4({in}, 0.0, 1.0)",
        (from, SurfaceShader) => return super::surfaces::shown(call, from),
        (from, to) => {
            let message = format!(
                "{} makes a `{}` of a `{}`, which it cannot",
                call.described(),
                to.name(),
                from.name()
            );
            return Err(call.error(message));
        }
    };
    let literal = match (call.ty, value.single()) {
        (Color3 | Vector2 | Vector3, Some(number)) if value.ty == Float => {
            Some(Literal::Numbers(vec![number; call.ty.count()]))
        }
        _ => None,
    };
    match literal {
        Some(literal) => one(Value::of(call.ty, literal)),
        None => call.template(template),
    }
}

fn combine2(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let given = call.given("in1")?.map(|value| value.ty);
    call.template(match (call.ty, given) {
        (Color4, None) => "vec4(vec3(0.0), {in2})",
        (Color4, Some(_)) => "vec4(vec3({in1}), {in2})",
        _ => "$T({in1}, {in2})",
    })
}

/// The name of a component.
fn component(ty: Type, index: usize) -> Option<&'static str> {
    let names: &[&str] = match ty {
        Color3 => &["r", "g", "b"],
        _ => &["x", "y", "z", "w"],
    };
    names.get(index).copied().filter(|_| index < ty.count())
}

fn extract(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let value = call.arg("in")?;
    let index = call.arg("index")?;
    if matches!(value.ty, Matrix33 | Matrix44) {
        return matrices::column(call, &value, index.single());
    }
    let name = index
        .single()
        .and_then(|index| component(value.ty, index.max(0.0) as usize));
    let Some(name) = name else {
        let message = format!(
            "the index of {} is not that of a component",
            call.described()
        );
        let most = value.ty.count().clamp(1, 4) - 1;
        return Err(call
            .error(message)
            .expected(format!("a value from 0 to {most}")));
    };
    let text = bound(&value.plain(), Level::Atom);
    one(Value::new(Float, format!("{text}.{name}")))
}

fn separate(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let mut value = call.arg("in")?;
    let text = value.plain();
    if !is_simple(&text) {
        let name = call.name();
        value.text = call.builder.bind(&name, &text);
        value.is_geometric = false;
    }
    let names: &[&'static str] = match value.ty {
        Color3 | Color4 => &["outr", "outg", "outb", "outa"],
        _ => &["outx", "outy", "outz", "outw"],
    };
    let outputs = names.iter().enumerate().filter_map(|(index, name)| {
        let component = component(value.ty, index)?;
        Some((
            *name,
            Value::new(Float, format!("{}.{component}", value.plain())),
        ))
    });
    Ok(outputs.collect())
}

fn swizzle(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let value = call.arg("in")?;
    let value = call.named("in", value);
    let channels = call.text("channels")?;
    let text = bound(&value.plain(), Level::Atom);
    let mut parts = Vec::new();
    for channel in channels.chars() {
        let index = match channel {
            '0' | '1' => {
                parts.push(format!("{channel}.0"));
                continue;
            }
            'r' | 'x' => 0,
            'g' | 'y' => 1,
            'b' | 'z' => 2,
            'a' | 'w' => 3,
            _ => usize::MAX,
        };
        match component(value.ty, index) {
            _ if value.ty == Float && index == 0 => parts.push(text.clone()),
            Some(name) => parts.push(format!("{text}.{name}")),
            None => {
                let message = format!("{} has the channel `{channel}`", call.described());
                return Err(call
                    .error(message)
                    .expected("channels of its input, 0 or 1"));
            }
        }
    }
    if parts.is_empty() || parts.len() != call.ty.count() {
        let message = format!("{} has {} channels", call.described(), parts.len());
        return Err(call.error(message).expected(format!("{}", call.ty.count())));
    }
    let text = match parts.as_slice() {
        [only] => only.clone(),
        parts => format!("{}({})", call.ty.impasto(), parts.join(", ")),
    };
    one(Value::new(call.ty, text))
}
