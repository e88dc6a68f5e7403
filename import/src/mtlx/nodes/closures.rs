//! Distributions of scattered and emitted light, and what they are made from.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::Code;
use crate::mtlx::nodes::maths::with_medium;
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::text::{Level, bound, is_simple, weighted};
use crate::mtlx::types::Type::*;
use crate::mtlx::types::{Literal, number};
use crate::mtlx::value::{Extra, Medium, Value};

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "oren_nayar_diffuse_bsdf",
        "weight:float=1 color:color3=0.18 roughness:float=0 normal:vector3=@Nworld \
        energy_compensation:boolean=false",
        Code(oren_nayar),
        "`oren_nayar_diffuse`; `diffuse` where it is not rough",
    ),
    row(
        "burley_diffuse_bsdf",
        "weight:float=1 color:color3=0.18 roughness:float=0 normal:vector3=@Nworld",
        Code(burley),
        "`burley_diffuse`, which keeps energy",
    ),
    row(
        "translucent_bsdf",
        "weight:float=1 color:color3=1 normal:vector3=@Nworld",
        Code(translucent),
        "`translucent`",
    ),
    row(
        "dielectric_bsdf",
        "weight:float=1 tint:color3=1 ior:float=1.5 roughness:vector2=0.05 \
        retroreflective:boolean=false thinfilm_thickness:float=0 thinfilm_ior:float=1.5 normal:vector3=@Nworld \
        tangent:vector3=@Tworld distribution:string=ggx scatter_mode:string=R",
        Code(dielectric),
        "`dielectric_reflection` (R), `dielectric_transmission` (T) or `dielectric` (RT)",
    ),
    row(
        "conductor_bsdf",
        "weight:float=1 ior:color3=0.183,0.421,1.373 extinction:color3=3.424,2.346,1.770 \
        roughness:vector2=0.05 retroreflective:boolean=false thinfilm_thickness:float=0 thinfilm_ior:float=1.5 \
        normal:vector3=@Nworld tangent:vector3=@Tworld distribution:string=ggx",
        Code(conductor),
        "`conductor`",
    ),
    row(
        "generalized_schlick_bsdf",
        "weight:float=1 color0:color3=1 color82:color3=1 color90:color3=1 exponent:float=5 \
        roughness:vector2=0.05 retroreflective:boolean=false thinfilm_thickness:float=0 thinfilm_ior:float=1.5 \
        normal:vector3=@Nworld tangent:vector3=@Tworld distribution:string=ggx scatter_mode:string=R",
        Code(schlick),
        "`generalized_schlick`; what it lets through (T, RT) is that of a dielectric as bright as `color0`",
    ),
    row(
        "subsurface_bsdf",
        "weight:float=1 color:color3=0.18 radius:color3=1 anisotropy:float=0 \
        normal:vector3=@Nworld",
        Code(subsurface),
        "`subsurface`, its radius in metres",
    ),
    row(
        "sheen_bsdf",
        "weight:float=1 color:color3=1 roughness:float=0.3 normal:vector3=@Nworld \
        mode:string=conty_kulla",
        Code(sheen),
        "`sheen_conty_kulla` or `sheen_zeltner`",
    ),
    row("uniform_edf", "color:color3=1", Code(uniform), "`uniform`"),
    row(
        "conical_edf",
        "color:color3=1 normal:vector3=@Nworld inner_angle:float=60 outer_angle:float=0",
        Code(conical),
        "`conical`",
    ),
    row(
        "generalized_schlick_edf",
        "color0:color3=1 color90:color3=1 exponent:float=5 base:EDF",
        Code(schlick_edf),
        "`generalized_schlick` of emission, over a `uniform_edf`",
    ),
    row(
        "absorption_vdf",
        "absorption:vector3=0",
        Code(volume),
        "`medium(absorption)`, 1/m",
    ),
    row(
        "anisotropic_vdf",
        "absorption:vector3=0 scattering:vector3=0 anisotropy:float=0",
        Code(volume),
        "`medium(absorption, scattering, anisotropy)`, 1/m",
    ),
    row(
        "layer",
        "top:BSDF base:any",
        Code(layer),
        "`layer(top, base)`; the `interior` where the base is a volume",
    ),
    row(
        "roughness_anisotropy",
        "roughness:float=0 anisotropy:float=0",
        Code(roughness),
        "`roughness` and `anisotropy` of the library's bsdfs, whose anisotropy is 0.9 of this",
    ),
    row(
        "roughness_dual",
        "roughness:vector2=0",
        Code(roughness_dual),
        "the same from two roughnesses",
    ),
    row(
        "glossiness_anisotropy",
        "glossiness:float=1 anisotropy:float=0",
        Code(roughness),
        "the same from 1 - glossiness",
    ),
    row(
        "artistic_ior",
        "reflectivity:color3=0.944,0.776,0.373 edge_color:color3=0.998,0.981,0.751",
        Code(artistic_ior),
        "`artistic_ior(reflectivity, edge_color)`",
    ),
    row(
        "complex_to_artistic",
        "ior:color3 extinction:color3",
        Code(complex),
        "`ior_reflectivity` and `ior_edge_color`",
    ),
];

/// A named argument, unless the library has that value by default.
fn argument(
    call: &mut Call<'_, '_, '_>,
    input: &str,
    name: &str,
    default: &str,
) -> Result<String, ImportError> {
    let text = call.arg(input)?.text;
    Ok(if text == default {
        String::new()
    } else {
        format!(", {name}: {text}")
    })
}

/// The arguments `normal` and `tangent`, where the document gives them.
fn frame(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    let mut text = String::new();
    for name in ["normal", "tangent"] {
        if call.row.input_row(name).is_none() {
            continue;
        }
        let given = call
            .given(name)?
            .filter(|value| !value.is_zero() && value.text != name);
        if let Some(value) = given {
            text.push_str(&format!(", {name}: {}", value.text));
        }
    }
    Ok(text)
}

/// The arguments `roughness` and `anisotropy` for widths of microfacets.
fn microfacets(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    let widths = call.arg("roughness")?;
    if let Extra::Roughness(roughness, anisotropy) = &widths.extra {
        return Ok(if anisotropy == "0.0" {
            format!(", roughness: {roughness}")
        } else {
            format!(", roughness: {roughness}, anisotropy: {anisotropy}")
        });
    }
    if let Some(width) = widths.single() {
        return Ok(format!(", roughness: {}", rounded(width.max(0.0).sqrt())));
    }
    if let Some(Literal::Numbers(n)) = &widths.literal {
        let (x, y) = (n[0].max(1e-9), n[1].max(1e-9));
        let anisotropy = if x >= y {
            (1.0 - y / x) / 0.9
        } else {
            (x / y - 1.0) / 0.9
        };
        let roughness = (x * y).sqrt().sqrt();
        return Ok(format!(
            ", roughness: {}, anisotropy: {}",
            rounded(roughness),
            rounded(anisotropy)
        ));
    }
    let widths = call.named("widths", widths).text;
    let text = call.builder.source.names_in(&format!(
        ", roughness: #ggx_roughness({widths}), anisotropy: #ggx_anisotropy({widths})"
    ));
    Ok(text)
}

/// A number to six digits, as people write it.
fn rounded(value: f64) -> String {
    number((value * 1e6).round() / 1e6)
}

/// The arguments of a film, in nanometres.
fn film(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    if !call.differs("thinfilm_thickness")? {
        return Ok(String::new());
    }
    let thickness = film_of(&call.arg("thinfilm_thickness")?);
    let ior = argument(call, "thinfilm_ior", "thinfilm_ior", "1.5")?;
    Ok(format!("{thickness}{ior}"))
}

/// The argument `thinfilm_thickness` for a number of nanometres.
pub(super) fn film_of(thickness: &Value) -> String {
    let text = match thickness.single() {
        Some(nanometres) => format!("{} nm", number(nanometres).trim_end_matches(".0")),
        None => format!("{} * 1 nm", bound(&thickness.text, Level::Product)),
    };
    format!(", thinfilm_thickness: {text}")
}

/// A bsdf times its weight.
fn bsdf(call: &mut Call<'_, '_, '_>, template: &str, arguments: &str) -> Result<Made, ImportError> {
    let weight = call.arg("weight")?;
    let text = call.filled(template)?;
    let text = format!("{text}{arguments})").replace("(, ", "(");
    one(Value::new(Bsdf, weighted(&weight.text, &text)))
}

/// Refuses what the library's microfacets do not do.
fn check_microfacets(call: &mut Call<'_, '_, '_>) -> Result<(), ImportError> {
    if call.differs("retroreflective")? {
        let message = format!(
            "{} is retroreflective, for which it has no counterpart",
            call.described()
        );
        return Err(call
            .error(message)
            .hint("`std::bsdf::retroreflective` may do"));
    }
    Ok(())
}

fn oren_nayar(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call)?;
    if call.arg("roughness")?.is_zero() {
        return bsdf(call, "@bsdf::diffuse({color}", &frame);
    }
    let compensated = argument(call, "energy_compensation", "energy_compensation", "true")?;
    bsdf(
        call,
        "@bsdf::oren_nayar_diffuse({color}, {roughness}",
        &format!("{compensated}{frame}"),
    )
}

fn burley(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call)?;
    bsdf(call, "@bsdf::burley_diffuse({color}, {roughness}", &frame)
}

fn translucent(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call)?;
    bsdf(call, "@bsdf::translucent({color}", &frame)
}

fn dielectric(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    check_microfacets(call)?;
    let mode = call.text("scatter_mode")?;
    let mut arguments = microfacets(call)?;
    arguments.push_str(&argument(call, "tint", "tint", "color(1.0)")?);
    arguments.push_str(&film(call)?);
    arguments.push_str(&frame(call)?);
    let template = match mode.as_str() {
        "T" => "@bsdf::dielectric_transmission(ior: {ior} / exterior_ior",
        "RT" => "@bsdf::dielectric(ior: {ior} / exterior_ior",
        _ => "@bsdf::dielectric_reflection(ior: {ior}",
    };
    let made = bsdf(call, template, &arguments)?;
    let ior = call.arg("ior")?.text;
    Ok(if mode == "R" {
        made
    } else {
        filled_below(made, clear(ior))
    })
}

/// A bsdf that lets light into the object, with the medium there.
pub(super) fn filled_below(mut made: Made, medium: Medium) -> Made {
    if let Some((_, value)) = made.first_mut() {
        value.extra = Extra::Medium(medium);
    }
    made
}

/// What an index of refraction alone says of a medium.
fn clear(ior: String) -> Medium {
    Medium {
        ior,
        ..Medium::default()
    }
}

fn conductor(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    check_microfacets(call)?;
    let mut arguments = microfacets(call)?;
    arguments.push_str(&film(call)?);
    arguments.push_str(&frame(call)?);
    bsdf(call, "@bsdf::conductor({ior}, {extinction}", &arguments)
}

fn schlick(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    check_microfacets(call)?;
    let mode = call.text("scatter_mode")?;
    let (facets, film, frame) = (microfacets(call)?, film(call)?, frame(call)?);
    if mode == "T" || mode == "RT" {
        call.warn("what `generalized_schlick_bsdf` lets through is that of a dielectric as bright as `color0`");
        let ior = call.filled("#reflectance_ior({color0})")?;
        let ior = call.named("ior", Value::new(Float, ior)).text;
        let tint = argument(call, "color0", "tint", "color(1.0)")?;
        let template = match mode.as_str() {
            "T" => format!("@bsdf::dielectric_transmission(ior: {ior} / exterior_ior"),
            _ => format!("@bsdf::dielectric(ior: {ior} / exterior_ior"),
        };
        let made = bsdf(call, &template, &format!("{facets}{tint}{film}{frame}"))?;
        return Ok(filled_below(made, clear(ior)));
    }
    let mut arguments = argument(call, "color82", "color82", "color(1.0)")?;
    arguments.push_str(&argument(call, "color90", "color90", "color(1.0)")?);
    arguments.push_str(&argument(call, "exponent", "exponent", "5.0")?);
    arguments.push_str(&format!("{facets}{film}{frame}"));
    bsdf(call, "@bsdf::generalized_schlick({color0}", &arguments)
}

fn subsurface(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let anisotropy = argument(call, "anisotropy", "anisotropy", "0.0")?;
    let frame = frame(call)?;
    let radius = call.arg("radius")?;
    let radius = call.in_metres("radius", radius, false);
    let radius = match &radius.literal {
        Some(literal) => literal.written(Vector3),
        None => format!("vec3({})", call.named("radius", radius).text),
    };
    bsdf(
        call,
        &format!("@bsdf::subsurface({{color}}, {radius}"),
        &format!("{anisotropy}{frame}"),
    )
}

fn sheen(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call)?;
    match call.text("mode")?.as_str() {
        "zeltner" => bsdf(call, "@bsdf::sheen_zeltner({color}, {roughness}", &frame),
        _ => bsdf(
            call,
            "@bsdf::sheen_conty_kulla({color}, {roughness}",
            &frame,
        ),
    }
}

fn uniform(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let text = call.filled("@edf::uniform({color})")?;
    let radiance = call.arg("color")?.text;
    one(Value::new(Edf, text).with(Extra::Radiance(radiance)))
}

fn conical(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    if call
        .given("normal")?
        .is_some_and(|value| value.text != "normal")
    {
        call.warn("the cone of `conical_edf` stands on the surface, whatever `normal` says");
    }
    call.template("@edf::conical({color}, {inner_angle} * 1 deg, {outer_angle} * 1 deg)")
}

fn schlick_edf(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Extra::Radiance(radiance) = call.arg("base")?.extra else {
        let message = format!("the base of {} is no `uniform_edf`", call.described());
        return Err(call.error(message).expected("a `uniform_edf`"));
    };
    call.template(&format!(
        "@edf::generalized_schlick({radiance}, {{color0}}, {{color90}}, {{exponent}})"
    ))
}

fn volume(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let color = |value: Value| match value.literal {
        Some(_) if value.is_zero() => String::new(),
        Some(literal) => literal.written(Color3),
        None => format!("color({})", value.plain()),
    };
    let inverse = |call: &mut Call<'_, '_, '_>, name: &str| {
        let value = call.arg(name)?;
        Ok::<_, ImportError>(color(call.in_metres(name, value, true)))
    };
    let mut medium = Medium {
        absorption: inverse(call, "absorption")?,
        ..Medium::default()
    };
    if call.row.category == "anisotropic_vdf" {
        medium.scattering = inverse(call, "scattering")?;
        let anisotropy = call.arg("anisotropy")?;
        medium.anisotropy = if anisotropy.is_zero() {
            String::new()
        } else {
            anisotropy.text
        };
    }
    one(Value::new(Vdf, "").with(Extra::Medium(medium)))
}

fn layer(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let Some(base) = call.given("base")? else {
        return one(call.arg("top")?);
    };
    if base.ty == Vdf {
        let top = call.arg("top")?;
        let own = top.medium().cloned().unwrap_or_default();
        let medium = base.medium().cloned().unwrap_or_default().or(&own);
        return one(top.with(Extra::Medium(medium)));
    }
    if base.ty != Bsdf {
        let message = format!("the base of {} is a `{}`", call.described(), base.ty.name());
        return Err(call.error(message).expected("`BSDF` or `VDF`"));
    }
    let top = call.arg("top")?;
    let text = layer_of(&top.text, &base.text);
    with_medium(call, one(Value::new(Bsdf, text))?, &["top", "base"])
}

/// A layer over another; layers of layers are one, the top first.
pub(super) fn layer_of(top: &str, base: &str) -> String {
    let inner = base
        .strip_prefix("layer(")
        .and_then(|text| text.strip_suffix(')'));
    let base = inner.filter(|inner| closes(inner)).unwrap_or(base);
    format!("layer({top}, {base})")
}

/// Are the brackets of a text in pairs?
fn closes(text: &str) -> bool {
    let mut depth = 0i32;
    text.chars().all(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth >= 0
    })
}

fn roughness(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let roughness = match call.row.category {
        "glossiness_anisotropy" => match call.arg("glossiness")?.single() {
            Some(glossiness) => rounded(1.0 - glossiness),
            None => call.filled("1.0 - {glossiness}")?,
        },
        _ => call.arg("roughness")?.text,
    };
    let anisotropy = call.arg("anisotropy")?;
    // There the widths are in the ratio 1 - anisotropy, here 1 - 0.9 anisotropy.
    let anisotropy = match anisotropy.single() {
        Some(single) => rounded(single.clamp(0.0, 0.98) / 0.9),
        None => format!("{} / 0.9", bound(&anisotropy.text, Level::Product)),
    };
    // As a pair of numbers it is seldom asked for.
    let name = if is_simple(&roughness) {
        roughness.clone()
    } else {
        let name = format!("{}_roughness", call.name());
        call.builder.bind(&name, &roughness)
    };
    let aspect = format!(
        "sqrt(1.0 - clamp(0.9 * {}, 0.0, 0.98))",
        bound(&anisotropy, Level::Prefix)
    );
    let text = format!("vec2(min({name} * {name} / {aspect}, 1.0), {name} * {name} * {aspect})");
    one(Value::new(Vector2, text).with(Extra::Roughness(name, anisotropy)))
}

fn roughness_dual(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    if let Some(Literal::Numbers(n)) = call.arg("roughness")?.literal {
        let (x, y) = (n[0], if n[1] < 0.0 { n[0] } else { n[1] });
        let squares = vec![(x * x).clamp(1e-6, 1.0), (y * y).clamp(1e-6, 1.0)];
        return one(Value::of(Vector2, Literal::Numbers(squares)));
    }
    call.template("vec2({roughness}.x * {roughness}.x, if {roughness}.y < 0.0 { {roughness}.x * {roughness}.x } else { {roughness}.y * {roughness}.y })")
}

fn artistic_ior(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let text = call.filled("@color::artistic_ior({reflectivity}, {edge_color})")?;
    let name = call.name();
    let name = call.builder.bind(&name, &text);
    Ok(vec![
        ("ior", Value::new(Color3, format!("{name}.ior"))),
        (
            "extinction",
            Value::new(Color3, format!("{name}.extinction")),
        ),
    ])
}

fn complex(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let reflectivity = call.filled("@color::ior_reflectivity({ior}, {extinction})")?;
    let edge = call.filled("@color::ior_edge_color({ior}, {extinction})")?;
    Ok(vec![
        ("reflectivity", Value::new(Color3, reflectivity)),
        ("edge_color", Value::new(Color3, edge)),
    ])
}
