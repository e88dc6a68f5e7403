//! Pictures: where they are looked up, and what their texels mean.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::color_spaces::{self, Curve, LINEAR};
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::text::{Level, bound};
use crate::mtlx::types::Type::{self, *};
use crate::mtlx::types::number;
use crate::mtlx::value::Value;

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "image",
        "file:filename layer:string= default:same=0 texcoord:vector2=@UV0 uaddressmode:string=periodic \
        vaddressmode:string=periodic filtertype:string=linear framerange:string= frameoffset:integer=0 \
        frameendaction:string=constant",
        Code(image),
        "`image` of colors in sRGB, `image_data` of other numbers; beyond the edge of `constant` all is 0",
    ),
    row(
        "tiledimage",
        "file:filename default:same=0 texcoord:vector2=@UV0 uvtiling:vector2=1 uvoffset:vector2=0 \
        realworldimagesize:vector2=1 realworldtilesize:vector2=1 filtertype:string=linear framerange:string= \
        frameoffset:integer=0 frameendaction:string=constant",
        Code(tiled),
        "as `image`, at `uv * uvtiling - uvoffset`",
    ),
    row(
        "triplanarprojection",
        "filex:filename filey:filename filez:filename layerx:string= layery:string= \
        layerz:string= default:same=0 position:vector3=@Pobject normal:vector3=@Nobject upaxis:integer=2 \
        blend:float=1 filtertype:string=linear framerange:string= frameoffset:integer=0 \
        frameendaction:string=constant",
        Code(triplanar),
        "three lookups, weighted as there",
    ),
    row(
        "hextiledimage",
        "file:filename default:same=0 texcoord:vector2=@UV0 tiling:vector2=1 rotation:float=1 \
        rotationrange:vector2=0,360 scale:float=1 scalerange:vector2=0.5,2 offset:float=1 offsetrange:vector2=0,1 \
        falloff:float=0.5 falloffcontrast:float=0.5 lumacoeffs:color3=0.2722287,0.6740818,0.0536895",
        Code(hex_tiled),
        "`hex_tiling`, of colors in sRGB; its hexagons lie elsewhere, are turned but not scaled",
    ),
    row(
        "hextilednormalmap",
        "->vector3 file:filename default:vector3=0.5,0.5,1 texcoord:vector2=@UV0 tiling:vector2=1 \
        rotation:float=1 rotationrange:vector2=0,360 scale:float=1 scalerange:vector2=0.5,2 offset:float=1 \
        offsetrange:vector2=0,1 falloff:float=0.5 strength:float=1 flip_g:boolean=false normal:vector3=@Nworld \
        tangent:vector3=@Tworld bitangent:vector3=@Bworld",
        Code(hex_tiled_normal),
        "`hex_tiling_normal`, as before",
    ),
    row(
        "latlongimage",
        "->color3 file:filename default:color3=0 viewdir:vector3=0,0,1 rotation:float=0",
        Code(latlong),
        "`latlong(file, viewdir, rotate: rotation)`",
    ),
    row(
        "gltf_image",
        GLTF,
        Code(gltf_image),
        "as `image`, placed and multiplied by `factor`",
    ),
    row(
        "gltf_colorimage",
        "file:filename default:color4=0 texcoord:vector2=@UV0 pivot:vector2=0,1 scale:vector2=1 \
        rotate:float=0 offset:vector2=0 operationorder:integer=1 uaddressmode:string=periodic \
        vaddressmode:string=periodic filtertype:string=linear color:color4=1 geomcolor:color4=1",
        Code(gltf_color),
        "`outcolor` and `outa`: as `image` with alpha, times both colors",
    ),
    row(
        "gltf_normalmap",
        GLTF,
        Code(gltf_normal),
        "as `image` and `normalmap`",
    ),
    row(
        "gltf_iridescence_thickness",
        "->float file:filename default:vector3=0 texcoord:vector2=@UV0 pivot:vector2=0 \
        scale:vector2=1 rotate:float=0 offset:vector2=0 uaddressmode:string=periodic vaddressmode:string=periodic \
        filtertype:string=linear thicknessMin:float=100 thicknessMax:float=400",
        Code(gltf_thickness),
        "between both by the green of the picture",
    ),
    row(
        "UsdUVTexture",
        "file:filename st:vector2=@UV0 wrapS:string=periodic wrapT:string=periodic \
        fallback:color4=0,0,0,1 scale:color4=1 bias:color4=0",
        Code(usd_texture),
        "as `image`; its channels are outputs",
    ),
    row(
        "UsdTransform2d",
        "->vector2 in:vector2=0 rotation:float=0 scale:vector2=1 translation:vector2=0",
        Text("@pattern::rotation({rotation} * 1 deg) * ({in} * {scale}) + {translation}"),
        "",
    ),
];

const GLTF: &str = "file:filename factor:same=1 default:same=0 texcoord:vector2=@UV0 pivot:vector2=0,1 scale:vector2=1 \
    rotate:float=0 offset:vector2=0 operationorder:integer=0 uaddressmode:string=periodic vaddressmode:string=periodic \
    filtertype:string=linear";

/// A picture with all that its lookups share.
struct Picture<'s> {
    file: String,
    space: Option<&'s str>,
    /// Further arguments, each with a comma before it.
    arguments: String,
}

/// The picture that the input `file` names; nothing where the document names none.
fn picture<'s>(
    call: &mut Call<'_, '_, 's>,
    file: &str,
    wraps: [&str; 2],
) -> Result<Option<Picture<'s>>, ImportError> {
    let Some(value) = call.given(file)? else {
        return Ok(None);
    };
    let document = call.builder.graphs.document;
    let space = match document.input(call.key.node, file) {
        Some(element) => call.builder.color_space(call.key.scope, element)?,
        None => None,
    };
    let mut arguments = String::new();
    let [u, v] = [wrap(call, wraps[0])?, wrap(call, wraps[1])?];
    match (u == v, u, v) {
        (true, "REPEAT", _) => {}
        (true, wrap, _) => arguments.push_str(&format!(", wrap: {wrap}")),
        (false, u, v) => arguments.push_str(&format!(", wrap_u: {u}, wrap_v: {v}")),
    }
    if call.row.input_row("filtertype").is_some() {
        match call.text("filtertype")?.as_str() {
            "closest" => arguments.push_str(", filter: NEAREST"),
            "cubic" => arguments.push_str(", filter: BICUBIC"),
            _ => {}
        }
    }
    if call.row.input_row("framerange").is_some() && call.given("framerange")?.is_some() {
        call.warn("sequences of pictures are not read: each frame has the same");
    }
    Ok(Some(Picture {
        file: value.text,
        space,
        arguments,
    }))
}

fn wrap(call: &mut Call<'_, '_, '_>, input: &str) -> Result<&'static str, ImportError> {
    if call.row.input_row(input).is_none() {
        return Ok("REPEAT");
    }
    Ok(match call.text(input)?.as_str() {
        "clamp" => "CLAMP",
        "mirror" => "MIRROR",
        "constant" | "black" => {
            let default = call.row.input_row("default").is_some();
            if default && call.given("default")?.is_some_and(|value| !value.is_zero()) {
                call.warn("beyond the edge the picture is 0, whatever `default` says");
            }
            "BORDER"
        }
        _ => "REPEAT",
    })
}

/// The value of a picture at texture coordinates, as a value of a type.
fn looked_up(call: &mut Call<'_, '_, '_>, picture: &Picture<'_>, uv: &str, ty: Type) -> String {
    let Picture {
        file,
        space,
        arguments,
    } = picture;
    let data = format!("image_data({file}, {uv}{arguments})");
    let space = match color_spaces::find(space.unwrap_or_default()) {
        _ if !matches!(ty, Color3 | Color4) => LINEAR,
        Some(space) => space,
        None => {
            let name = space.unwrap_or_default().to_owned();
            call.warn(format!(
                "the color space `{name}` is not known; texels are taken as linear Rec. 709"
            ));
            LINEAR
        }
    };
    let color = match space.curve {
        Curve::Linear => format!("color({data}.xyz)"),
        Curve::Srgb => format!("image({file}, {uv}{arguments})"),
        Curve::Gamma(gamma) => format!("pow(color({data}.xyz), color({}))", number(gamma)),
    };
    // Paths of pictures may have any sign: only what stands around them is a template.
    let (before, after) = match space.to_rec709("COLOR").split_once("COLOR") {
        Some((before, after)) => (call.builder.source.names_in(before), after.to_owned()),
        None => Default::default(),
    };
    let color = format!("{before}{color}{after}");
    match ty {
        Color3 => color,
        Color4 if space == LINEAR => data,
        Color4 => format!("vec4(vec3({color}), image_alpha({file}, {uv}{arguments}))"),
        Float => format!("{data}.x"),
        Vector2 => format!("{data}.xy"),
        Vector3 => format!("{data}.xyz"),
        _ => data,
    }
}

/// What a node without a picture gives.
fn without(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    call.warn(format!(
        "{} names no picture: its default is taken",
        call.described()
    ));
    one(call.arg("default")?)
}

fn image(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(picture) = picture(call, "file", ["uaddressmode", "vaddressmode"])? else {
        return without(call);
    };
    let uv = call.arg("texcoord")?.text;
    let text = looked_up(call, &picture, &uv, call.ty);
    one(Value::new(call.ty, text))
}

fn tiled(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(picture) = picture(call, "file", ["", ""])? else {
        return without(call);
    };
    let mut uv = "{texcoord}".to_owned();
    let mut steps = Vec::new();
    let differs = |value: &Value, number: f64| value.single() != Some(number);
    if differs(&call.arg("uvtiling")?, 1.0) {
        steps.push(" * {uvtiling}");
    }
    if differs(&call.arg("uvoffset")?, 0.0) {
        steps.push(" - {uvoffset}");
    }
    let (size, tile) = (
        call.arg("realworldimagesize")?,
        call.arg("realworldtilesize")?,
    );
    if size.text != tile.text {
        if steps.contains(&" - {uvoffset}") {
            uv.insert(0, '(');
            steps.push(")");
        }
        steps.extend([" / {realworldimagesize}", " * {realworldtilesize}"]);
    }
    uv.push_str(&steps.concat());
    // One number is the scale of both coordinates.
    for name in ["uvtiling", "realworldimagesize", "realworldtilesize"] {
        if let Some(single) = call.arg(name)?.single() {
            uv = uv.replace(&format!("{{{name}}}"), &number(single));
        }
    }
    let uv = call.filled(&uv)?;
    let text = looked_up(call, &picture, &uv, call.ty);
    one(Value::new(call.ty, text))
}

fn triplanar(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let upaxis = call.arg("upaxis")?.single().unwrap_or(2.0) as i32;
    let position = call.arg("position")?;
    let position = if position.is_geometric {
        Value::new(Vector3, position.plain())
    } else {
        position
    };
    let p = call.named("position", position).text;
    let weights = call.filled("#side_weights({~normal}, {blend})")?;
    let w = call.named("weights", Value::new(Vector3, weights)).text;
    let sides = [
        (
            "filex",
            "x",
            if upaxis == 2 { ["y", "z"] } else { ["z", "y"] },
        ),
        (
            "filey",
            "y",
            if upaxis == 0 { ["z", "x"] } else { ["x", "z"] },
        ),
        (
            "filez",
            "z",
            if upaxis == 0 { ["-y", "x"] } else { ["x", "y"] },
        ),
    ];
    let mut terms = Vec::new();
    for (file, weight, [u, v]) in sides {
        let Some(picture) = picture(call, file, ["", ""])? else {
            continue;
        };
        let part = |c: &str| match c.strip_prefix('-') {
            Some(c) => format!("-{p}.{c}"),
            None => format!("{p}.{c}"),
        };
        let uv = match u.strip_prefix('-') {
            Some(_) => format!("vec2({}, {})", part(u), part(v)),
            None => format!("{p}.{u}{v}"),
        };
        let text = looked_up(call, &picture, &uv, call.ty);
        terms.push(format!("{w}.{weight} * {text}"));
    }
    if terms.is_empty() {
        without(call)
    } else {
        one(Value::new(call.ty, terms.join(" + ")))
    }
}

fn hex_tiled(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(picture) = picture(call, "file", ["", ""])? else {
        return without(call);
    };
    let space = color_spaces::find(picture.space.unwrap_or_default());
    if space.map(|space| space.curve) != Some(Curve::Srgb) {
        call.warn("`hex_tiling` reads pictures of integers as sRGB");
    }
    call.warn("`hex_tiling` has other hexagons, which are turned but not scaled");
    let file = &picture.file;
    let text = call.filled(&format!(
        "@pattern::hex_tiling({file}, {{texcoord}} * {{tiling}}, rotate: 180 deg * {{rotation}}, contrast: {{falloffcontrast}})"
    ))?;
    one(match call.ty {
        Color4 => Value::new(Color4, format!("vec4(vec3({text}), 1.0)")),
        ty => Value::new(ty, text),
    })
}

fn hex_tiled_normal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(picture) = picture(call, "file", ["", ""])? else {
        return one(call.builder.geometry("Nworld", call.key.node)?);
    };
    call.warn("`hex_tiling_normal` has other hexagons, which are turned but not scaled");
    let file = &picture.file;
    let text = call.filled(&format!(
        "@pattern::hex_tiling_normal({file}, {{texcoord}} * {{tiling}}, {{~normal}}, {{~tangent}}, scale: {{strength}}, rotate: 180 deg * {{rotation}})"
    ))?;
    one(Value::geometric(text))
}

fn latlong(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(picture) = picture(call, "file", ["", ""])? else {
        return without(call);
    };
    let file = &picture.file;
    call.template(&format!(
        "@pattern::latlong({file}, {{~viewdir}}, rotate: {{rotation}} * 1 deg)"
    ))
}

/// Texture coordinates as glTF's nodes place them.
fn placed(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    let moved = call.differs("scale")? || call.differs("rotate")? || call.differs("offset")?;
    if !moved {
        return call.filled("{texcoord}");
    }
    let is_trs = match call.row.input_row("operationorder") {
        Some(_) => call.arg("operationorder")?.single() == Some(1.0),
        None => false,
    };
    let place = if is_trs {
        "#moved_then_scaled"
    } else {
        "@pattern::place2d"
    };
    call.filled(&format!(
        "{place}({{texcoord}}, {{pivot}}, vec2(1.0) / {{scale}}, -{{rotate}} * 1 deg, {{offset}} * vec2(-1.0, 1.0))"
    ))
}

fn gltf_picture(call: &mut Call<'_, '_, '_>, ty: Type) -> Result<Option<String>, ImportError> {
    let Some(picture) = picture(call, "file", ["uaddressmode", "vaddressmode"])? else {
        return Ok(None);
    };
    let uv = placed(call)?;
    Ok(Some(looked_up(call, &picture, &uv, ty)))
}

fn gltf_image(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(text) = gltf_picture(call, call.ty)? else {
        return without(call);
    };
    let text = if call.differs("factor")? {
        format!(
            "{text} * {}",
            bound(&call.arg("factor")?.text, Level::Prefix)
        )
    } else {
        text
    };
    one(Value::new(call.ty, text))
}

fn gltf_color(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let text = match gltf_picture(call, Color4)? {
        Some(text) => text,
        None => without(call)?
            .pop()
            .map(|(_, value)| value.text)
            .unwrap_or_default(),
    };
    let mut text = text;
    for factor in ["color", "geomcolor"] {
        if call.differs(factor)? {
            text = format!("{text} * {}", bound(&call.arg(factor)?.text, Level::Prefix));
        }
    }
    let name = call.name();
    let name = call.builder.bind(&name, &text);
    Ok(vec![
        ("outcolor", Value::new(Color3, format!("color({name}.xyz)"))),
        ("outa", Value::new(Float, format!("{name}.w"))),
    ])
}

fn gltf_normal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(text) = gltf_picture(call, Vector3)? else {
        return one(call.builder.geometry("Nworld", call.key.node)?);
    };
    let map = call.builder.source.names_in("@pattern::normal_map");
    one(Value::geometric(format!(
        "{map}(color({text}), normal, tangent)"
    )))
}

fn gltf_thickness(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(text) = gltf_picture(call, Vector3)? else {
        return one(call.arg("thicknessMin")?);
    };
    let template =
        format!("mix({{thicknessMin}}, {{thicknessMax}}, {text}.y)").replace(".xyz.y", ".y");
    call.template(&template)
}

fn usd_texture(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let text = match picture(call, "file", ["wrapS", "wrapT"])? {
        Some(picture) => {
            let uv = call.arg("st")?.text;
            looked_up(call, &picture, &uv, Color4)
        }
        None => call.arg("fallback")?.text,
    };
    let mut text = text;
    if call.differs("scale")? {
        text = format!(
            "{text} * {}",
            bound(&call.arg("scale")?.text, Level::Prefix)
        );
    }
    if call.differs("bias")? {
        text = format!(
            "{text} + {}",
            bound(&call.arg("bias")?.text, Level::Product)
        );
    }
    let name = call.name();
    let name = call.builder.bind(&name, &text);
    let part = |c: &str| Value::new(Float, format!("{name}.{c}"));
    let mut made = vec![
        ("rgb", Value::new(Color3, format!("color({name}.xyz)"))),
        ("rgba", Value::new(Color4, name.clone())),
        ("r", part("x")),
        ("g", part("y")),
        ("b", part("z")),
        ("a", part("w")),
    ];
    // A node of one type gives that.
    if let Some(at) = made.iter().position(|(_, value)| value.ty == call.ty) {
        made.swap(0, at);
    }
    Ok(made)
}
