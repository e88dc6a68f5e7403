//! Arithmetic, choices and channels.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Each, Text};
use crate::mtlx::nodes::{Made, NodeRow, matrices, one, row};
use crate::mtlx::text::{Level, bound};
use crate::mtlx::types::Type::{self, *};
use crate::mtlx::types::{Literal, list, number};
use crate::mtlx::value::{Extra, Value};

pub(super) const ROWS: &[NodeRow] = &[
    row("constant", "value:same=0", Code(passed), "its value"),
    row("dot", "in:same=0 note:string=", Code(passed), "its input"),
    row(
        "add",
        "in1:same=0 in2:any=0",
        Code(add),
        "`in1 + in2`; sums of closures can gain energy, as the compiler warns",
    ),
    row(
        "subtract",
        "in1:same=0 in2:any=0",
        Code(subtract),
        "`in1 - in2`",
    ),
    row(
        "multiply",
        "in1:same=0 in2:any=1",
        Code(multiply),
        "`in1 * in2`",
    ),
    row(
        "divide",
        "in1:same=0 in2:any=1",
        Code(divide),
        "`in1 / in2`; 0 where `in2` is 0",
    ),
    row(
        "modulo",
        "in1:same=0 in2:scalar=1",
        Text("mod({in1}, {in2})"),
        "",
    ),
    row("fract", "in:same=0", Text("fract({in})"), ""),
    row(
        "invert",
        "in:same=0 amount:scalar=1",
        Text("{amount} - {in}"),
        "",
    ),
    row("absval", "in:same=0", Text("abs({in})"), ""),
    row("sign", "in:same=0", Text("sign({in})"), ""),
    row(
        "floor",
        "in:any=0",
        Each(&[(&[Integer], "int(floor({in}))"), (&[], "floor({in})")]),
        "",
    ),
    row(
        "ceil",
        "in:any=0",
        Each(&[(&[Integer], "int(ceil({in}))"), (&[], "ceil({in})")]),
        "",
    ),
    row(
        "round",
        "in:any=0",
        Each(&[(&[Integer], "int(round({in}))"), (&[], "round({in})")]),
        "`round(in)`; halves go to the even number",
    ),
    row(
        "power",
        "in1:same=0 in2:scalar=1",
        Text("pow({in1}, {in2})"),
        "`pow(in1, in2)`; 0 where `in1` is negative",
    ),
    row(
        "safepower",
        "in1:same=0 in2:scalar=1",
        Text("sign({in1}) * pow(abs({in1}), {in2})"),
        "",
    ),
    row("sin", "in:same=0", Text("sin({in})"), ""),
    row("cos", "in:same=0", Text("cos({in})"), ""),
    row("tan", "in:same=0", Text("tan({in})"), ""),
    row("asin", "in:same=0", Text("asin({in})"), ""),
    row("acos", "in:same=0", Text("acos({in})"), ""),
    row(
        "atan2",
        "iny:same=0 inx:same=1 in1:same=0 in2:same=1",
        Code(atan2),
        "`atan2(iny, inx)`",
    ),
    row("sqrt", "in:same=0", Text("sqrt({in})"), ""),
    row("ln", "in:same=1", Text("log({in})"), ""),
    row("exp", "in:same=0", Text("exp({in})"), ""),
    row(
        "clamp",
        "in:same=0 low:scalar=0 high:scalar=1",
        Code(clamp),
        "`clamp(in, low, high)`",
    ),
    row(
        "min",
        "in1:same=0 in2:scalar=0",
        Text("min({in1}, {in2})"),
        "",
    ),
    row(
        "max",
        "in1:same=0 in2:scalar=0",
        Text("max({in1}, {in2})"),
        "",
    ),
    row(
        "mincomponent",
        "->float in:any=0,0,0",
        Text("min_component({in})"),
        "",
    ),
    row(
        "maxcomponent",
        "->float in:any=0,0,0",
        Text("max_component({in})"),
        "",
    ),
    row("normalize", "in:same=0", Text("normalize({in})"), ""),
    row("magnitude", "->float in:any=0,0", Text("length({in})"), ""),
    row(
        "distance",
        "->float in1:any=0,0 in2:any=0,0",
        Text("distance({in1}, {in2})"),
        "",
    ),
    row(
        "dotproduct",
        "->float in1:any=0,0 in2:any=0,0",
        Text("dot({in1}, {in2})"),
        "",
    ),
    row(
        "crossproduct",
        "->vector3 in1:vector3=0 in2:vector3=0",
        Text("cross({in1}, {in2})"),
        "",
    ),
    row(
        "reflect",
        "->vector3 in:vector3=1,0,0 normal:vector3=@Nworld",
        Text("reflect({in}, {normal})"),
        "",
    ),
    row(
        "refract",
        "->vector3 in:vector3=1,0,0 normal:vector3=@Nworld ior:float=1",
        Text("#refracted({in}, {normal}, {ior})"),
        "",
    ),
    row(
        "remap",
        "in:same=0 inlow:scalar=0 inhigh:scalar=1 outlow:scalar=0 outhigh:scalar=1",
        Code(remap),
        "`outlow + (in - inlow) / (inhigh - inlow) * (outhigh - outlow)`",
    ),
    row(
        "range",
        "in:same=0 inlow:scalar=0 inhigh:scalar=1 gamma:scalar=1 outlow:scalar=0 outhigh:scalar=1 \
        doclamp:boolean=false",
        Code(remap),
        "as `remap`, with a power between",
    ),
    row(
        "smoothstep",
        "in:same=0 low:scalar=0 high:scalar=1",
        Code(smoothstep),
        "`smoothstep(low, high, in)`",
    ),
    row(
        "trianglewave",
        "->float in:float=0",
        Text("0.5 - abs(mod(abs({in}), 1.0) - 0.5)"),
        "",
    ),
    row(
        "creatematrix",
        "in1:any=1,0,0 in2:any=0,1,0 in3:any=0,0,1 in4:any=0,0,0",
        Each(&[(&[Matrix33], "mat3({in1}, {in2}, {in3})")]),
        "`mat3(in1, in2, in3)`, of 3 by 3; matrices of 4 by 4 must be known",
    ),
    row(
        "transpose",
        "in:same",
        Each(&[(&[Matrix33], "transpose({in})")]),
        "`transpose(in)`, as before",
    ),
    row(
        "determinant",
        "->float in:any=1,0,0,0,1,0,0,0,1",
        Each(&[(&[Matrix33], "determinant({in})")]),
        "`determinant(in)`, as before",
    ),
    row(
        "invertmatrix",
        "in:same",
        Each(&[(&[Matrix33], "inverse({in})")]),
        "`inverse(in)`, as before",
    ),
    row(
        "transformmatrix",
        "in:same=0 mat:any=1,0,0,0,1,0,0,0,1",
        Code(matrices::transform),
        "`mat * in`; a matrix of 4 by 4 must be known",
    ),
];

fn passed(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let name = if call.row.category == "constant" {
        "value"
    } else {
        "in"
    };
    one(call.arg(name)?)
}

fn add(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let made = {
        let template = sum(call, "+")?;
        call.template(template)?
    };
    with_medium(call, made, &["in1", "in2"])
}

fn subtract(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let template = sum(call, "-")?;
    call.template(template)
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
        factor(call, Color3)?;
        let made = call.template("{in2} * {in1}")?;
        return with_medium(call, made, &["in1"]);
    }
    scaled(call, "*")
}

/// A product or quotient; a vector of equal numbers is one number.
fn scaled(call: &mut Call<'_, '_, '_>, operator: &str) -> Result<Made, ImportError> {
    let by = factor(call, call.ty)?;
    let is_vector = matches!(call.ty, Color3 | Color4 | Vector2 | Vector3 | Vector4);
    match by.single().filter(|_| is_vector && by.ty == call.ty) {
        Some(by) => call.template(&format!("{{in1}} {operator} {}", number(by))),
        None => call.template(&format!("{{in1}} {operator} {{in2}}")),
    }
}

/// The second factor: a number, or a value of this type.
fn factor(call: &mut Call<'_, '_, '_>, ty: Type) -> Result<Value, ImportError> {
    let by = call.arg("in2")?;
    if by.ty == ty || matches!(by.ty, Float | Integer) {
        return Ok(by);
    }
    let (own, wrong) = (call.described(), by.ty.name());
    let error = call.error(format!("the input `in2` of {own} has the type `{wrong}`"));
    Err(error
        .expected(format!("`{}` or `float`", ty.name()))
        .hint("put a `convert` between them"))
}

fn divide(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    match call.ty {
        Matrix33 => call.template("{in1} * inverse({in2})"),
        _ => scaled(call, "/"),
    }
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
    call.template(if old {
        "atan2({in1}, {in2})"
    } else {
        "atan2({iny}, {inx})"
    })
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
        return call.template("saturate({in})");
    }
    let (low, high) = (wide(call, "low")?, wide(call, "high")?);
    let template = format!("clamp({{in}}, {low}, {high})");
    call.template(&template)
}

fn smoothstep(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (low, high) = (wide(call, "low")?, wide(call, "high")?);
    let template = format!("smoothstep({low}, {high}, {{in}})");
    call.template(&template)
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
        text = format!(
            "sign({share}) * pow(abs({share}), {})",
            reciprocal(call, &gamma)
        );
    }
    let (low, high) = (call.arg("outlow")?, call.arg("outhigh")?);
    let inner = bound(&text, Level::Product);
    text = match (is(&low, 0.0), is(&high, 1.0)) {
        (true, true) => text,
        (true, false) => format!("{inner} * {}", bound(&high.plain(), Level::Prefix)),
        (false, _) => {
            let span = match (low.single(), high.single()) {
                (Some(low), Some(high)) => list(&[high - low]),
                _ => format!(
                    "({} - {})",
                    high.plain(),
                    bound(&low.plain(), Level::Product)
                ),
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
