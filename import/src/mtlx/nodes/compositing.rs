//! Layers of pictures: blends, and what alpha says.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::maths::with_medium;
use crate::mtlx::nodes::{Made, one};
use crate::mtlx::nodes::{NodeRow, row};
use crate::mtlx::types::Type::*;
use crate::mtlx::value::Value;

const BLEND: &str = "fg:same=0 bg:same=0 mix:float=1";

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "mix",
        "fg:same=0 bg:same=0 mix:scalar=0",
        Code(mix),
        "`mix(bg, fg, mix)`, of closures and surfaces too",
    ),
    row("plus", BLEND, Code(blend), "`bg + fg`, by `mix`"),
    row("minus", BLEND, Code(blend), "`bg - fg`, by `mix`"),
    row("difference", BLEND, Code(blend), "`abs(bg - fg)`, by `mix`"),
    row(
        "screen",
        BLEND,
        Code(blend),
        "`1 - (1 - fg) (1 - bg)`, by `mix`",
    ),
    row(
        "overlay",
        BLEND,
        Code(blend),
        "twice the product or the screen, by `bg`",
    ),
    row(
        "burn",
        BLEND,
        Text("step($T(1e-6), abs({fg})) * mix({bg}, 1.0 - (1.0 - {bg}) / {fg}, {mix})"),
        "`1 - (1 - bg) / fg`, by `mix`; 0 where `fg` is 0",
    ),
    row(
        "dodge",
        BLEND,
        Text("step($T(1e-6), abs(1.0 - {fg})) * mix({bg}, {bg} / (1.0 - {fg}), {mix})"),
        "`bg / (1 - fg)`, by `mix`; 0 where `fg` is 1",
    ),
    row(
        "disjointover",
        BLEND,
        Text("mix({bg}, #disjoint_over({fg}, {bg}), {mix})"),
        "",
    ),
    row("in", BLEND, Text("mix({bg}, {fg} * {bg}.w, {mix})"), ""),
    row("mask", BLEND, Text("mix({bg}, {bg} * {fg}.w, {mix})"), ""),
    row(
        "matte",
        BLEND,
        Text(
            "mix({bg}, vec4(mix({bg}.xyz, {fg}.xyz, {fg}.w), {fg}.w + {bg}.w * (1.0 - {fg}.w)), {mix})",
        ),
        "",
    ),
    row(
        "out",
        BLEND,
        Text("mix({bg}, {fg} * (1.0 - {bg}.w), {mix})"),
        "",
    ),
    row(
        "over",
        BLEND,
        Text("mix({bg}, {fg} + {bg} * (1.0 - {fg}.w), {mix})"),
        "",
    ),
    row(
        "inside",
        "in:same=0 mask:float=1",
        Text("{in} * {mask}"),
        "",
    ),
    row(
        "outside",
        "in:same=0 mask:float=0",
        Text("{in} * (1.0 - {mask})"),
        "",
    ),
    row(
        "premult",
        "->color4 in:color4=0,0,0,1",
        Text("vec4({in}.xyz * {in}.w, {in}.w)"),
        "",
    ),
    row(
        "unpremult",
        "->color4 in:color4=0,0,0,1",
        Text("vec4({in}.xyz / {in}.w, {in}.w)"),
        "`in / in.w`; 0 where alpha is 0",
    ),
];

fn mix(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    match call.ty {
        SurfaceShader => super::surfaces::mixed(call),
        Bsdf => {
            let made = call.template("mix({bg}, {fg}, {mix})")?;
            with_medium(call, made, &["bg", "fg"])
        }
        _ => call.template("mix({bg}, {fg}, {mix})"),
    }
}

fn blend(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let blended = match call.row.category {
        "plus" => "{bg} + {fg}",
        "minus" => "{bg} - {fg}",
        "difference" => "abs({bg} - {fg})",
        "screen" => "1.0 - (1.0 - {fg}) * (1.0 - {bg})",
        _ => "mix(2.0 * {fg} * {bg}, 1.0 - 2.0 * (1.0 - {fg}) * (1.0 - {bg}), step($T(0.5), {bg}))",
    };
    // In full by default.
    if call.arg("mix")?.single() == Some(1.0) {
        return one(Value::new(call.ty, call.filled(blended)?));
    }
    call.template(&format!("mix({{bg}}, {blended}, {{mix}})"))
}
