//! Colors: spaces, corrections, temperatures.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Each, Text};
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::types::Type::*;
use crate::mtlx::value::Value;

const LUMA: &str = "0.2722287,0.6740818,0.0536895";

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "luminance",
        "in:same=0 lumacoeffs:color3=0.2722287,0.6740818,0.0536895",
        Code(luminance),
        "`luminance(in)` of Rec. 709, a `dot` with other coefficients",
    ),
    row(
        "rgbtohsv",
        "in:same=0",
        Each(&[
            (&[Color3], "color(@color::to_hsv({in}))"),
            (&[Color4], "vec4(@color::to_hsv(color({in}.xyz)), {in}.w)"),
        ]),
        "",
    ),
    row(
        "hsvtorgb",
        "in:same=0",
        Each(&[
            (&[Color3], "@color::from_hsv(vec3({in}))"),
            (&[Color4], "vec4(vec3(@color::from_hsv({in}.xyz)), {in}.w)"),
        ]),
        "",
    ),
    row(
        "contrast",
        "in:same=0 amount:scalar=1 pivot:scalar=0.5",
        Text("({in} - {pivot}) * {amount} + {pivot}"),
        "",
    ),
    row(
        "hsvadjust",
        "in:same=0 amount:vector3=0,1,1",
        Each(&[
            (&[Color3], "#hsv_adjusted({in}, {amount})"),
            (
                &[Color4],
                "vec4(vec3(#hsv_adjusted(color({in}.xyz), {amount})), {in}.w)",
            ),
        ]),
        "",
    ),
    row(
        "saturate",
        "in:same=0 amount:float=1 lumacoeffs:color3=0.2722287,0.6740818,0.0536895",
        Each(&[
            (
                &[Color3],
                "mix(color(dot(vec3({in}), vec3({lumacoeffs}))), {in}, {amount})",
            ),
            (
                &[Color4],
                "vec4(mix(vec3(dot({in}.xyz, vec3({lumacoeffs}))), {in}.xyz, {amount}), {in}.w)",
            ),
        ]),
        "between the luminance and the color",
    ),
    row(
        "colorcorrect",
        "in:same=1 hue:float=0 saturation:float=1 gamma:float=1 lift:float=0 gain:float=1 \
        contrast:float=1 contrastpivot:float=0.5 exposure:float=0",
        Code(corrected),
        "hue, saturation, gamma, lift, gain, contrast and exposure in that order, those that are given",
    ),
    row(
        "blackbody",
        "->color3 temperature:float=5000",
        Text("@color::blackbody({temperature})"),
        "",
    ),
];

fn luminance(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let weights = call.arg("lumacoeffs")?;
    let rec709 = matches!(
        weights.text.as_str(),
        "color(0.2126, 0.7152, 0.0722)" | "color(0.212639, 0.715169, 0.072192)"
    );
    call.template(match (call.ty, rec709) {
        (Color4, true) => "vec4(vec3(luminance(color({in}.xyz))), {in}.w)",
        (Color4, false) => "vec4(vec3(dot({in}.xyz, vec3({lumacoeffs}))), {in}.w)",
        (_, true) => "color(luminance({in}))",
        (_, false) => "color(dot(vec3({in}), vec3({lumacoeffs})))",
    })
}

fn corrected(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let input = call.arg("in")?;
    let (mut text, alpha) = match call.ty {
        Color4 => {
            let input = call.named("in", input);
            (
                format!("color({}.xyz)", input.text),
                Some(format!("{}.w", input.text)),
            )
        }
        _ => (input.text, None),
    };
    let steps: &[(&str, &str, &str)] = &[
        ("hue", "hue", "#hsv_adjusted({c}, vec3({hue}, 1.0, 1.0))"),
        (
            "saturation",
            "gray",
            "mix(color(dot(vec3({c}), vec3(LUMA))), {c}, {saturation})",
        ),
        (
            "gamma",
            "gamma",
            "sign({c}) * pow(abs({c}), color(1.0 / {gamma}))",
        ),
        ("lift", "lift", "{c} * (1.0 - {lift}) + {lift}"),
        ("gain", "gain", "{c} * {gain}"),
        (
            "contrast",
            "contrast",
            "({c} - {contrastpivot}) * {contrast} + {contrastpivot}",
        ),
        ("exposure", "exposure", "{c} * exp2({exposure})"),
    ];
    for (input, name, template) in steps {
        if !call.differs(input)? {
            continue;
        }
        let c = call.named(name, Value::new(Color3, text)).text;
        let template = template.replace("LUMA", LUMA).replace("{c}", &c);
        text = call.filled(&template)?;
    }
    if let Some(alpha) = alpha {
        text = format!("vec4(vec3({text}), {alpha})");
    }
    one(Value::new(call.ty, text))
}
