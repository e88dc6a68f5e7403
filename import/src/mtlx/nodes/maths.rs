//! Arithmetic, choices and channels.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Each, Text};
use crate::mtlx::nodes::{Made, NodeRow, matrices, one, row};
use crate::mtlx::text::{Level, bound, is_simple};
use crate::mtlx::types::Type::{self, *};
use crate::mtlx::types::{Literal, list};
use crate::mtlx::value::{Extra, Value};

const FLOATS: &[Type] = &[Float, Integer, Vector2, Vector3, Vector4, Color3, Color4];

pub(super) const ROWS: &[NodeRow] = &[
    row("constant", "value:same=0", Code(passed), "its value"),
    row("dot", "in:same=0 note:string=", Code(passed), "its input"),
    row("add", "in1:same=0 in2:any=0", Code(add), "`in1 + in2`; sums of closures can gain energy, as the compiler warns"),
    row("subtract", "in1:same=0 in2:any=0", Code(subtract), "`in1 - in2`"),
    row("multiply", "in1:same=0 in2:any=1", Code(multiply), "`in1 * in2`"),
    row("divide", "in1:same=0 in2:any=1", Each(&[
        (FLOATS, "{in1} / {in2}"),
        (&[Matrix33], "{in1} * inverse({in2})"),
    ]), "`in1 / in2`; 0 where `in2` is 0"),
    row("modulo", "in1:same=0 in2:scalar=1", Text("mod({in1}, {in2})"), ""),
    row("fract", "in:same=0", Text("fract({in})"), ""),
    row("invert", "in:same=0 amount:scalar=1", Text("{amount} - {in}"), ""),
    row("absval", "in:same=0", Text("abs({in})"), ""),
    row("sign", "in:same=0", Text("sign({in})"), ""),
    row("floor", "in:any=0", Each(&[(&[Integer], "int(floor({in}))"), (&[], "floor({in})")]), ""),
    row("ceil", "in:any=0", Each(&[(&[Integer], "int(ceil({in}))"), (&[], "ceil({in})")]), ""),
    row("round", "in:any=0", Each(&[(&[Integer], "int(round({in}))"), (&[], "round({in})")]),
        "`round(in)`; halves go to the even number"),
    row("power", "in1:same=0 in2:scalar=1", Text("pow({in1}, {in2})"), "`pow(in1, in2)`; 0 where `in1` is negative"),
    row("safepower", "in1:same=0 in2:scalar=1", Text("sign({in1}) * pow(abs({in1}), {in2})"), ""),
    row("sin", "in:same=0", Text("sin({in})"), ""),
    row("cos", "in:same=0", Text("cos({in})"), ""),
    row("tan", "in:same=0", Text("tan({in})"), ""),
    row("asin", "in:same=0", Text("asin({in})"), ""),
    row("acos", "in:same=0", Text("acos({in})"), ""),
    row("atan2", "iny:same=0 inx:same=1 in1:same=0 in2:same=1", Code(atan2), "`atan2(iny, inx)`"),
    row("sqrt", "in:same=0", Text("sqrt({in})"), ""),
    row("ln", "in:same=1", Text("log({in})"), ""),
    row("exp", "in:same=0", Text("exp({in})"), ""),
    row("clamp", "in:same=0 low:scalar=0 high:scalar=1", Code(clamp), "`clamp(in, low, high)`"),
    row("min", "in1:same=0 in2:scalar=0", Text("min({in1}, {in2})"), ""),
    row("max", "in1:same=0 in2:scalar=0", Text("max({in1}, {in2})"), ""),
    row("mincomponent", "in:any=0", Text("min_component({in})"), ""),
    row("maxcomponent", "in:any=0", Text("max_component({in})"), ""),
    row("normalize", "in:same=0", Text("normalize({in})"), ""),
    row("magnitude", "in:any=0", Text("length({in})"), ""),
    row("distance", "in1:any=0 in2:any=0", Text("distance({in1}, {in2})"), ""),
    row("dotproduct", "in1:any=0 in2:any=0", Text("dot({in1}, {in2})"), ""),
    row("crossproduct", "in1:vector3=0 in2:vector3=0", Text("cross({in1}, {in2})"), ""),
    row("reflect", "in:vector3=1,0,0 normal:vector3=@Nworld", Text("reflect({in}, {normal})"), ""),
    row("refract", "in:vector3=1,0,0 normal:vector3=@Nworld ior:float=1", Text("#refracted({in}, {normal}, {ior})"), ""),
    row("remap", "in:same=0 inlow:scalar=0 inhigh:scalar=1 outlow:scalar=0 outhigh:scalar=1", Code(remap),
        "`outlow + (in - inlow) / (inhigh - inlow) * (outhigh - outlow)`"),
    row("range", "in:same=0 inlow:scalar=0 inhigh:scalar=1 gamma:scalar=1 outlow:scalar=0 outhigh:scalar=1 \
        doclamp:boolean=false", Code(remap), "as `remap`, with a power between"),
    row("smoothstep", "in:same=0 low:scalar=0 high:scalar=1", Code(smoothstep), "`smoothstep(low, high, in)`"),
    row("trianglewave", "in:float=0", Text("0.5 - abs(mod(abs({in}), 1.0) - 0.5)"), ""),
    row("creatematrix", "in1:any=1,0,0 in2:any=0,1,0 in3:any=0,0,1 in4:any=0,0,0", Each(&[(&[Matrix33],
        "mat3({in1}, {in2}, {in3})")]), "`mat3(in1, in2, in3)`, of 3 by 3; matrices of 4 by 4 must be known"),
    row("transpose", "in:same", Each(&[(&[Matrix33], "transpose({in})")]), "`transpose(in)`, as before"),
    row("determinant", "in:any", Each(&[(&[Matrix33], "determinant({in})")]), "`determinant(in)`, as before"),
    row("invertmatrix", "in:same", Each(&[(&[Matrix33], "inverse({in})")]), "`inverse(in)`, as before"),
    row("transformmatrix", "in:same=0 mat:any", Code(matrices::transform), "`mat * in`; a matrix of 4 by 4 must be known"),
];

pub(super) const CHOICES: &[NodeRow] = &[
    row("ifgreater", "value1:any=1 value2:any=0 in1:same=0 in2:same=0", Code(greater),
        "`if value1 > value2 { in1 } else { in2 }`"),
    row("ifgreatereq", "value1:any=1 value2:any=0 in1:same=0 in2:same=0", Code(greater_or_equal),
        "`if value1 >= value2 { in1 } else { in2 }`"),
    row("ifequal", "value1:any=0 value2:any=0 in1:same=0 in2:same=0", Code(equal),
        "`if value1 == value2 { in1 } else { in2 }`"),
    row("compare", "intest:float=0 cutoff:float=0 in1:same=0 in2:same=0",
        Text("if {intest} > {cutoff} { {in2} } else { {in1} }"), "of version 1.36: `if intest > cutoff { in2 } else { in1 }`"),
    row("switch", "in1:same=0 in2:same=0 in3:same=0 in4:same=0 in5:same=0 in6:same=0 in7:same=0 in8:same=0 in9:same=0 \
        in10:same=0 which:any=0", Code(switch), "a chain of `if`; only the input itself where `which` is known"),
    row("and", "in1:boolean=false in2:boolean=false", Text("{in1} && {in2}"), ""),
    row("or", "in1:boolean=false in2:boolean=false", Text("{in1} || {in2}"), ""),
    row("xor", "in1:boolean=false in2:boolean=false", Text("{in1} != {in2}"), ""),
    row("not", "in:boolean=false", Text("!{in}"), ""),
];

pub(super) const CHANNELS: &[NodeRow] = &[
    row("convert", "in:any=0", Code(convert), "a call of the type; a color without alpha becomes opaque"),
    row("combine2", "in1:any=0 in2:any=0", Each(&[
        (&[Color4], "vec4(vec3({in1}), {in2})"),
        (&[], "$T({in1}, {in2})"),
    ]), "a call of the type"),
    row("combine3", "in1:float=0 in2:float=0 in3:float=0", Text("$T({in1}, {in2}, {in3})"), "a call of the type"),
    row("combine4", "in1:float=0 in2:float=0 in3:float=0 in4:float=0", Text("$T({in1}, {in2}, {in3}, {in4})"),
        "a call of the type"),
    row("extract", "in:any=0 index:integer=0", Code(extract), "a component; `index` must be known"),
    row("separate2", "in:any=0", Code(separate), "components"),
    row("separate3", "in:any=0", Code(separate), "components"),
    row("separate4", "in:any=0", Code(separate), "components"),
    row("swizzle", "in:any=0 channels:string=", Code(swizzle), "of version 1.38: components, 0 and 1"),
];

fn passed(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let name = if call.row.category == "constant" { "value" } else { "in" };
    one(call.arg(name)?)
}

fn add(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let made = {
        let template = sum(call, "+")?;
        call.from_template(template)?
    };
    with_medium(call, made, &["in1", "in2"])
}

fn subtract(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let template = sum(call, "-")?;
    call.from_template(template)
}

/// A number that is added to a matrix is added to all of its numbers.
fn sum(call: &mut Call<'_, '_, '_>, operator: &str) -> Result<&'static str, ImportError> {
    let fills = call.ty == Matrix33 && call.arg("in2")?.ty == Float;
    Ok(match (operator, fills) {
        ("+", false) => "{in1} + {in2}",
        ("+", true) => "{in1} + mat3(vec3({in2}), vec3({in2}), vec3({in2}))",
        (_, false) => "{in1} - {in2}",
        (_, true) => "{in1} - mat3(vec3({in2}), vec3({in2}), vec3({in2}))",
    })
}

fn multiply(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    if matches!(call.ty, Bsdf | Edf) {
        let made = call.from_template("{in2} * {in1}")?;
        return with_medium(call, made, &["in1"]);
    }
    call.from_template("{in1} * {in2}")
}

/// A closure with the medium of its parts.
pub(super) fn with_medium(
    call: &mut Call<'_, '_, '_>,
    mut made: Made,
    parts: &[&str],
) -> Result<Made, ImportError> {
    if call.ty != Bsdf {
        return Ok(made);
    }
    for part in parts {
        let value = call.arg(part)?;
        if let (Some(medium), Some((_, made))) = (value.medium(), made.first_mut()) {
            made.extra = Extra::Medium(medium.clone());
        }
    }
    Ok(made)
}

fn atan2(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    // Version 1.36 calls the inputs `in1` and `in2`.
    let old = call.given("in1")?.is_some() || call.given("in2")?.is_some();
    call.from_template(if old { "atan2({in1}, {in2})" } else { "atan2({iny}, {inx})" })
}

/// An input as a value of the node's type: functions take their type from the first argument.
fn wide(call: &mut Call<'_, '_, '_>, name: &str) -> Result<String, ImportError> {
    let value = call.arg(name)?;
    Ok(match value.ty {
        Float | Integer if !matches!(call.ty, Float | Integer) => {
            format!("{}({})", call.ty.impasto(), value.text)
        }
        _ => value.plain(),
    })
}

fn clamp(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (low, high) = (call.arg("low")?, call.arg("high")?);
    if low.single() == Some(0.0) && high.single() == Some(1.0) {
        return call.from_template("saturate({in})");
    }
    let (low, high) = (wide(call, "low")?, wide(call, "high")?);
    let template = format!("clamp({{in}}, {low}, {high})");
    call.from_template(&template)
}

fn smoothstep(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (low, high) = (wide(call, "low")?, wide(call, "high")?);
    let template = format!("smoothstep({low}, {high}, {{in}})");
    call.from_template(&template)
}

/// From the input's range to 0 .. 1, perhaps along a power, and to the range of the output.
fn remap(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let is = |value: &Value, number: f64| value.single() == Some(number);
    let (low, high) = (call.arg("inlow")?, call.arg("inhigh")?);
    let mut text = match (is(&low, 0.0), is(&high, 1.0)) {
        (true, true) => call.filled("{in}")?,
        (true, false) => call.filled("{in} / {inhigh}")?,
        _ => call.filled("({in} - {inlow}) / ({inhigh} - {inlow})")?,
    };
    if call.row.category == "range" && !is(&call.arg("gamma")?, 1.0) {
        let share = call.named("share", Value::new(call.ty, text)).text;
        let gamma = wide(call, "gamma")?;
        text = format!("sign({share}) * pow(abs({share}), {})", reciprocal(call, &gamma));
    }
    let (low, high) = (call.arg("outlow")?, call.arg("outhigh")?);
    let inner = bound(&text, Level::Product);
    text = match (is(&low, 0.0), is(&high, 1.0)) {
        (true, true) => text,
        (true, false) => format!("{inner} * {}", bound(&high.plain(), Level::Prefix)),
        (false, _) => {
            let span = match (low.single(), high.single()) {
                (Some(low), Some(high)) => list(&[high - low]),
                _ => format!("({} - {})", high.plain(), bound(&low.plain(), Level::Product)),
            };
            format!("{} + {inner} * {span}", low.plain())
        }
    };
    let clamps = call.row.category == "range"
        && call.arg("doclamp")?.literal == Some(Literal::Boolean(true));
    if clamps {
        let (low, high) = (wide(call, "outlow")?, wide(call, "outhigh")?);
        text = format!("clamp({text}, {low}, {high})");
    }
    one(Value::new(call.ty, text))
}

/// 1 over a number of the node's type.
fn reciprocal(call: &Call<'_, '_, '_>, gamma: &str) -> String {
    match call.ty {
        Float => format!("1.0 / {}", bound(gamma, Level::Prefix)),
        ty => format!("{}(1.0) / {}", ty.impasto(), bound(gamma, Level::Prefix)),
    }
}

/// Does the node give what it compares?
fn is_test(call: &mut Call<'_, '_, '_>) -> Result<bool, ImportError> {
    Ok(call.ty == Boolean && call.given("in1")?.is_none() && call.given("in2")?.is_none())
}

fn chosen(call: &mut Call<'_, '_, '_>, operator: &str) -> Result<Made, ImportError> {
    if is_test(call)? {
        return call.from_template(&format!("{{value1}} {operator} {{value2}}"));
    }
    let template = format!("if {{value1}} {operator} {{value2}} {{ {{in1}} }} else {{ {{in2}} }}");
    call.from_template(&template)
}

fn greater(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    chosen(call, ">")
}

fn greater_or_equal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    chosen(call, ">=")
}

fn equal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let value = call.arg("value1")?;
    let other = call.arg("value2")?;
    // A default is a number: beside a truth value it is false.
    if value.ty == Boolean && other.literal == Some(Literal::Boolean(true)) {
        if is_test(call)? {
            return one(value);
        }
        return call.from_template("if {value1} { {in1} } else { {in2} }");
    }
    chosen(call, "==")
}

fn switch(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let which = call.arg("which")?;
    const INPUTS: [&str; 10] = ["in1", "in2", "in3", "in4", "in5", "in6", "in7", "in8", "in9", "in10"];
    if let Some(which) = which.single() {
        let index = which.max(0.0).floor() as usize;
        return match INPUTS.get(index) {
            Some(name) => one(call.arg(name)?),
            None => one(Value::of(call.ty, Literal::Numbers(vec![0.0; call.ty.count()]))),
        };
    }
    let mut last = 1;
    for (index, name) in INPUTS.iter().enumerate() {
        if call.given(name)?.is_some() {
            last = index + 1;
        }
    }
    let which = call.named("which", which);
    let which_text = match which.ty {
        Integer => which.text,
        _ => format!("floor({})", which.text),
    };
    let number = |index: usize| match which.ty {
        Integer => index.to_string(),
        _ => format!("{index}.0"),
    };
    let mut text = String::new();
    for (index, name) in INPUTS.iter().take(last).enumerate() {
        let value = call.arg(name)?.plain();
        text.push_str(&format!("if {which_text} == {} {{ {value} }} else ", number(index)));
    }
    let zero = match call.ty {
        Matrix33 => "mat3(0.0)".to_owned(),
        ty => Value::of(ty, Literal::Numbers(vec![0.0; ty.count()])).text,
    };
    text.push_str(&format!("{{ {zero} }}"));
    one(Value::new(call.ty, text))
}

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
        (Boolean, Color3 | Vector2 | Vector3 | Color4 | Vector4) => "$T(if {in} { 1.0 } else { 0.0 })",
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
        None => call.from_template(template),
    }
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
    let name = index.single().and_then(|index| component(value.ty, index.max(0.0) as usize));
    let Some(name) = name else {
        let message = format!("the index of {} is not that of a component", call.described());
        let most = value.ty.count().clamp(1, 4) - 1;
        return Err(call.error(message).expected(format!("a value from 0 to {most}")));
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
        Some((*name, Value::new(Float, format!("{}.{component}", value.plain()))))
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
                return Err(call.error(message).expected("channels of its input, 0 or 1"));
            }
        }
    }
    if parts.len() != call.ty.count() {
        let message = format!("{} has {} channels", call.described(), parts.len());
        return Err(call.error(message).expected(format!("{}", call.ty.count())));
    }
    let text = match parts.as_slice() {
        [only] => only.clone(),
        parts => format!("{}({})", call.ty.impasto(), parts.join(", ")),
    };
    one(Value::new(call.ty, text))
}
