//! Patterns over texture coordinates: ramps, borders, shapes, tiles; and what moves them.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::{Made, NodeRow, row};
use crate::mtlx::text::{Level, bound};
use crate::mtlx::types::number;
use crate::mtlx::value::Value;

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "ramplr",
        "valuel:same=0 valuer:same=0 texcoord:vector2=@UV0",
        Text("mix({valuel}, {valuer}, saturate({texcoord}.x))"),
        "",
    ),
    row(
        "ramptb",
        "valuet:same=0 valueb:same=0 texcoord:vector2=@UV0",
        Text("mix({valueb}, {valuet}, saturate({texcoord}.y))"),
        "",
    ),
    row(
        "ramp4",
        "valuetl:same=0 valuetr:same=0 valuebl:same=0 valuebr:same=0 texcoord:vector2=@UV0",
        Text(
            "mix(mix({valuebl}, {valuebr}, saturate({texcoord}.x)), mix({valuetl}, {valuetr}, \
        saturate({texcoord}.x)), saturate({texcoord}.y))",
        ),
        "`mix` of both rows and columns",
    ),
    row(
        "splitlr",
        "valuel:same=0 valuer:same=0 center:float=0.5 texcoord:vector2=@UV0",
        Text("mix({valuel}, {valuer}, @pattern::edge({texcoord}.x, {center}))"),
        "",
    ),
    row(
        "splittb",
        "valuet:same=0 valueb:same=0 center:float=0.5 texcoord:vector2=@UV0",
        Text("mix({valueb}, {valuet}, @pattern::edge({texcoord}.y, {center}))"),
        "",
    ),
    row(
        "ramp",
        "->color4 texcoord:vector2=@UV0 type:integer=0 interpolation:integer=1 num_intervals:integer=2 \
        interval1:float=0 color1:color4=0,0,0,1 interval2:float=1 color2:color4=1 interval3:float=1 color3:color4=1 \
        interval4:float=1 color4:color4=1 interval5:float=1 color5:color4=1 interval6:float=1 color6:color4=1 \
        interval7:float=1 color7:color4=1 interval8:float=1 color8:color4=1 interval9:float=1 color9:color4=1 \
        interval10:float=1 color10:color4=1",
        Code(ramp),
        "`num_intervals` stops, which must be known, as must `type`",
    ),
    row(
        "checkerboard",
        "->color3 color1:color3=1 color2:color3=0 uvtiling:vector2=8 uvoffset:vector2=0 \
        texcoord:vector2=@UV0",
        Text("mix({color2}, {color1}, @pattern::checker({texcoord} * {uvtiling} - {uvoffset}))"),
        "",
    ),
    row(
        "circle",
        "->float texcoord:vector2=@UV0 center:vector2=0 radius:float=0.5",
        Text("@pattern::circle({texcoord}, {center}, {radius})"),
        "",
    ),
    row(
        "cloverleaf",
        "->float texcoord:vector2=@UV0 center:vector2=0 radius:float=0.5",
        Text("@pattern::cloverleaf({texcoord}, {center}, {radius})"),
        "",
    ),
    row(
        "hexagon",
        "->float texcoord:vector2=@UV0 center:vector2=0 radius:float=0.5",
        Text("@pattern::hexagon({texcoord}, {center}, {radius})"),
        "",
    ),
    row(
        "line",
        "->float texcoord:vector2=@UV0 center:vector2=0 radius:float=0.1 point1:vector2=0.25 point2:vector2=0.75",
        Text("@pattern::line({texcoord} - {center}, {point1}, {point2}, {radius})"),
        "",
    ),
    row(
        "grid",
        "->color3 texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 thickness:float=0.05 \
        staggered:boolean=false",
        Text(
            "color(@pattern::grid({texcoord} * {uvtiling} - {uvoffset}, {thickness}, {staggered}))",
        ),
        "",
    ),
    row(
        "crosshatch",
        "->color3 texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 thickness:float=0.05 \
        staggered:boolean=false",
        Text(
            "color(@pattern::crosshatch({texcoord} * {uvtiling} - {uvoffset}, {thickness}, {staggered}))",
        ),
        "",
    ),
    row(
        "tiledcircles",
        SHAPES,
        Text(
            "color(@pattern::tiled_circles({texcoord} * {uvtiling} - {uvoffset}, {size}, {staggered}))",
        ),
        "`tiled_circles`; staggered rows are whole squares apart",
    ),
    row(
        "tiledcloverleafs",
        SHAPES,
        Text(
            "color(@pattern::tiled_cloverleafs({texcoord} * {uvtiling} - {uvoffset}, {size}, {staggered}))",
        ),
        "`tiled_cloverleafs`; staggered rows are whole squares apart",
    ),
    row(
        "tiledhexagons",
        SHAPES,
        Text(
            "color(@pattern::tiled_hexagons({texcoord} * {uvtiling} - {uvoffset}, {size}, {staggered}))",
        ),
        "`tiled_hexagons`; staggered rows are whole squares apart",
    ),
    row(
        "place2d",
        "->vector2 texcoord:vector2=0 pivot:vector2=0 scale:vector2=1 rotate:float=0 offset:vector2=0 \
        operationorder:integer=0",
        Code(place2d),
        "`place2d` with the arguments that are given",
    ),
    row(
        "rotate2d",
        "->vector2 in:vector2=0 amount:float=0",
        Code(rotate2d),
        "`rotation(-amount) * in`",
    ),
    row(
        "rotate3d",
        "->vector3 in:vector3=0 amount:float=0 axis:vector3=0,1,0",
        Code(rotate3d),
        "Rodrigues' formula, the same way round",
    ),
];

const SHAPES: &str = "->color3 texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 size:float=0.5 staggered:boolean=false";

/// Degrees as an angle; `sign` turns it round.
fn angle(value: &Value, sign: f64) -> String {
    match value.single() {
        Some(degrees) => {
            let text = number(sign * degrees);
            format!("{} deg", text.trim_end_matches(".0"))
        }
        None if sign < 0.0 => format!("-{} * 1 deg", bound(&value.text, Level::Atom)),
        None => format!("{} * 1 deg", bound(&value.text, Level::Product)),
    }
}

fn rotate2d(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let angle = angle(&call.arg("amount")?, -1.0);
    call.template(&format!("@pattern::rotation({angle}) * {{in}}"))
}

fn rotate3d(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let angle = angle(&call.arg("amount")?, 1.0);
    call.template(&format!("#rotated_about({{in}}, {angle}, {{axis}})"))
}

fn place2d(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let angle = angle(&call.arg("rotate")?, 1.0);
    if call.arg("operationorder")?.single() == Some(1.0) {
        return call.template(&format!(
            "#moved_then_scaled({{texcoord}}, {{pivot}}, {{scale}}, {angle}, {{offset}})"
        ));
    }
    let mut template = "@pattern::place2d({texcoord}".to_owned();
    for (name, text) in [
        ("pivot", ", pivot: {pivot}"),
        ("scale", ", scale: {scale}"),
        ("rotate", ", rotate: ANGLE"),
        ("offset", ", offset: {offset}"),
    ] {
        if call.differs(name)? {
            template.push_str(&text.replace("ANGLE", &angle));
        }
    }
    template.push(')');
    call.template(&template)
}

fn ramp(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let known = |call: &mut Call<'_, '_, '_>, name: &str| -> Result<i64, ImportError> {
        let value = call.arg(name)?.single();
        value.map(|value| value as i64).ok_or_else(|| {
            let message = format!("the input `{name}` of {} is not known", call.described());
            call.error(message)
                .expected("a number that the document says")
        })
    };
    let uv = call.arg("texcoord")?;
    let uv = call.named("texcoord", uv).text;
    let x = match known(call, "type")? {
        1 => format!("atan2({uv}.x - 0.5, {uv}.y - 0.5) / TWO_PI + 0.5"),
        2 => format!("1.414 * length({uv} - 0.5)"),
        3 => format!("2.0 * max_component(abs({uv} - 0.5))"),
        _ => format!("{uv}.x"),
    };
    let count = known(call, "num_intervals")?.clamp(2, 10);
    let numbers = |name: &str| {
        let numbers: Vec<String> = (1..=count).map(|i| format!("{{{name}{i}}}")).collect();
        numbers.join(", ")
    };
    let template = format!(
        "#ramp_stops({x}, [{}], [{}], {{interpolation}})",
        numbers("interval"),
        numbers("color")
    );
    call.template(&template)
}
