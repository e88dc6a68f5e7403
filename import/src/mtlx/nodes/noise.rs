//! Noise. The library's has the same character and range, but other lattices: what is seen lies elsewhere.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::text::{Level, bound, weighted};
use crate::mtlx::types::Type::*;
use crate::mtlx::types::number;
use crate::mtlx::value::Value;

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "noise2d",
        "amplitude:any=1 pivot:float=0 texcoord:vector2=@UV0",
        Code(perlin),
        "`amplitude * perlin_2d(texcoord) + pivot`, with a seed for each component",
    ),
    row(
        "noise3d",
        "amplitude:any=1 pivot:float=0 position:vector3=@Pobject",
        Code(perlin),
        "`amplitude * perlin(position) + pivot`, with a seed for each component",
    ),
    row(
        "fractal2d",
        "amplitude:any=1 octaves:integer=3 lacunarity:float=2 diminish:float=0.5 texcoord:vector2=@UV0",
        Code(fractal),
        "octaves of `perlin` in a plane, added up",
    ),
    row(
        "fractal3d",
        "amplitude:any=1 octaves:integer=3 lacunarity:float=2 diminish:float=0.5 \
        position:vector3=@Pobject",
        Code(fractal),
        "octaves of `perlin`, added up",
    ),
    row(
        "cellnoise2d",
        "->float texcoord:vector2=@UV0 period:vector2=0",
        Text("@noise::cell_2d({texcoord})"),
        "",
    ),
    row(
        "cellnoise3d",
        "->float position:vector3=@Pobject",
        Text("@noise::cell({~position})"),
        "",
    ),
    row(
        "worleynoise2d",
        "texcoord:vector2=@UV0 jitter:float=1 style:integer=0",
        Code(worley),
        "`worley_2d(texcoord, jitter).f1`, of several components `f2` too; `id` in style 1",
    ),
    row(
        "worleynoise3d",
        "position:vector3=@Pobject jitter:float=1 style:integer=0",
        Code(worley),
        "`worley(position, jitter).f1`, of several components `f2` too; `id` in style 1",
    ),
    row(
        "unifiednoise2d",
        "->float texcoord:vector2=@UV0 freq:vector2=1 offset:vector2=0 jitter:float=1 outmin:float=0 \
        outmax:float=1 clampoutput:boolean=true octaves:integer=3 lacunarity:float=2 diminish:float=0.5 \
        type:integer=0 style:integer=0",
        Code(unified),
        "one of the above, from `outmin` to `outmax`",
    ),
    row(
        "unifiednoise3d",
        "->float position:vector3=@Pobject freq:vector3=1 offset:vector3=0 jitter:float=1 outmin:float=0 \
        outmax:float=1 clampoutput:boolean=true octaves:integer=3 lacunarity:float=2 diminish:float=0.5 \
        type:integer=0 style:integer=0",
        Code(unified),
        "one of the above, from `outmin` to `outmax`",
    ),
    row(
        "randomfloat",
        "->float in:any=0 min:float=0 max:float=1 seed:integer=0",
        Text("@noise::random({in}, {min}, {max}, {seed})"),
        "",
    ),
    row(
        "randomcolor",
        "->color3 in:any=0 huelow:float=0 huehigh:float=1 saturationlow:float=0.825 saturationhigh:float=1 \
        brightnesslow:float=1 brightnesshigh:float=1 seed:integer=0",
        Text(
            "@color::from_hsv(vec3(@noise::random({in}, {huelow}, {huehigh}, {seed} + 413), \
        @noise::random({in}, {saturationlow}, {saturationhigh}, {seed} + 1522), \
        @noise::random({in}, {brightnesslow}, {brightnesshigh}, {seed} + 1813)))",
        ),
        "a color of three `random` numbers: hue, saturation, value",
    ),
    row(
        "flake2d",
        FLAKES_2D,
        Code(flakes),
        "`flakes` at `point(texcoord.x, texcoord.y, 0)`",
    ),
    row(
        "flake3d",
        FLAKES_3D,
        Code(flakes),
        "`flakes` at `position`; `id` and `rand` belong to the cell of the place",
    ),
];

const FLAKES_2D: &str = "size:float=0.01 roughness:float=0.1 coverage:float=0.5 texcoord:vector2=@UV0 \
    normal:vector3=@Nworld tangent:vector3=@Tworld bitangent:vector3=@Bworld";
const FLAKES_3D: &str = "size:float=0.01 roughness:float=0.1 coverage:float=0.5 position:vector3=@Pobject \
    normal:vector3=@Nworld tangent:vector3=@Tworld bitangent:vector3=@Bworld";

/// A number for each component of the node's type: `one` gives that of a seed.
fn components(call: &Call<'_, '_, '_>, one: impl Fn(usize) -> String) -> String {
    match call.ty.count() {
        0 | 1 => one(0),
        count => {
            let parts: Vec<String> = (0..count).map(one).collect();
            format!("{}({})", call.ty.impasto(), parts.join(", "))
        }
    }
}

/// An amplitude and a pivot around a text.
fn scaled(call: &mut Call<'_, '_, '_>, text: String) -> Result<Made, ImportError> {
    let amplitude = call.arg("amplitude")?;
    let weight = match (amplitude.single(), amplitude.ty) {
        (Some(number_of_all), _) => number(number_of_all),
        (None, Vector3) if call.ty == Color3 => match &amplitude.literal {
            Some(literal) => literal.written(Color3),
            None => format!("color({})", amplitude.text),
        },
        _ => amplitude.plain(),
    };
    let mut text = weighted(&weight, &text);
    if call.row.input_row("pivot").is_some() {
        let pivot = call.arg("pivot")?;
        if pivot.single() != Some(0.0) {
            text = format!("{text} + {}", bound(&pivot.text, Level::Product));
        }
    }
    one(Value::new(call.ty, text))
}

/// The place at which noise is evaluated, with a name where it stands more than once.
fn place(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    let name = if call.row.input_row("position").is_some() {
        "position"
    } else {
        "texcoord"
    };
    let place = call.arg(name)?;
    Ok(if call.ty.count() > 1 {
        call.named(name, place).text
    } else {
        place.text
    })
}

fn perlin(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let place = place(call)?;
    let function = if call.row.category == "noise2d" {
        "@noise::perlin_2d"
    } else {
        "@noise::perlin"
    };
    let function = call.builder.source.names_in(function);
    let text = components(call, |seed| match seed {
        0 => format!("{function}({place})"),
        seed => format!("{function}({place}, seed: {seed})"),
    });
    scaled(call, text)
}

fn fractal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let mut p = place(call)?;
    if call.row.category == "fractal2d" {
        p = format!("vec3({p}, 0.0)");
    }
    let sum = call.filled("#fractal_sum(PLACE, {octaves}, {lacunarity}, {diminish}")?;
    let sum = sum.replace("PLACE", &p);
    let text = components(call, |seed| match seed {
        0 => format!("{sum})"),
        seed => format!("{sum}, seed: {seed})"),
    });
    scaled(call, text)
}

fn worley(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let name = match call.row.category {
        "worleynoise2d" => "@noise::worley_2d({texcoord}",
        _ => "@noise::worley({~position}",
    };
    let jitter = if call.differs("jitter")? {
        ", jitter: {jitter})"
    } else {
        ")"
    };
    let cells = call.filled(&format!("{name}{jitter}"))?;
    let is_solid = call.arg("style")?.single() == Some(1.0);
    let fields: &[&str] = match (is_solid, call.ty) {
        (true, Float) => &["id"],
        (false, Float) => &["f1"],
        (true, _) => {
            // A number a cell and component.
            let id = call
                .named("cells", Value::new(Float, format!("{cells}.id")))
                .text;
            let random = call.builder.source.names_in("@noise::random");
            let text = components(call, |seed| format!("{random}({id}, seed: {seed})"));
            return one(Value::new(call.ty, text));
        }
        (false, Vector2) => &["f1", "f2"],
        (false, _) => {
            call.warn("there is no third distance: the second is taken for it");
            &["f1", "f2", "f2"]
        }
    };
    if let [field] = fields {
        return one(Value::new(call.ty, format!("{cells}.{field}")));
    }
    let cells = call.named("cells", Value::new(Float, cells)).text;
    let parts: Vec<String> = fields
        .iter()
        .map(|field| format!("{cells}.{field}"))
        .collect();
    one(Value::new(
        call.ty,
        format!("{}({})", call.ty.impasto(), parts.join(", ")),
    ))
}

fn unified(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let is_flat = call.row.category == "unifiednoise2d";
    let mut place = if is_flat { "{texcoord}" } else { "{position}" }.to_owned();
    if call.differs("freq")? {
        place.push_str(" * {freq}");
    }
    if call.differs("offset")? {
        place.push_str(" + {offset}");
    }
    if is_flat {
        place = format!("vec3({place}, 0.0)");
    }
    let noise = format!(
        "#unified_noise({place}, {{type}}, {{jitter}}, {{style}}, {{octaves}}, {{lacunarity}}, {{diminish}})"
    );
    let (low, high) = (call.arg("outmin")?, call.arg("outmax")?);
    let mut template = match (low.single(), high.single()) {
        (Some(low), Some(high)) if low == 0.0 && high == 1.0 => noise,
        _ => format!("mix({{outmin}}, {{outmax}}, {noise})"),
    };
    if call.arg("clampoutput")?.text == "true" {
        template = if template.starts_with("mix") {
            format!("clamp({template}, {{outmin}}, {{outmax}})")
        } else {
            format!("saturate({template})")
        };
    }
    call.template(&template)
}

fn flakes(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let place = match call.row.category {
        "flake2d" => "point({texcoord}.x, {texcoord}.y, 0.0)",
        _ => "point({position})",
    };
    let text = call.filled(&format!(
        "@noise::flakes({place}, {{~normal}}, size: {{size}} * 1 m, coverage: {{coverage}}, spread: {{roughness}})"
    ))?;
    let flake = call.named("flake", Value::new(Float, text)).text;
    let random = call.filled(&format!("@noise::cell({place} / {{size}})"))?;
    Ok(vec![
        ("flakenormal", Value::geometric(format!("{flake}.normal"))),
        ("presence", Value::new(Float, format!("{flake}.weight"))),
        ("rand", Value::new(Float, random.clone())),
        (
            "id",
            Value::new(Integer, format!("int(65536.0 * {random})")),
        ),
    ])
}
