//! Lama: RenderMan's layered materials, as MaterialX defines them by its own closures.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::closures::{filled_below, film_of, layer_of};
use crate::mtlx::nodes::maths::with_medium;
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::text::{Level, bound, weighted};
use crate::mtlx::types::Type::*;
use crate::mtlx::types::{Literal, number};
use crate::mtlx::value::{Extra, Medium, Outputs, Shader, Value};

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "LamaDiffuse",
        "color:color3=0.18 roughness:float=0 normal:vector3=@Nworld energyCompensation:float=1",
        Code(diffuse),
        "`oren_nayar_diffuse` of half the squared roughness, with energy kept",
    ),
    row(
        "LamaTranslucent",
        "color:color3=0.18 roughness:float=0 normal:vector3=@Nworld energyCompensation:float=1",
        Code(translucent),
        "`translucent`",
    ),
    row(
        "LamaSheen",
        "color:color3=1 roughness:float=0.1 normal:vector3=@Nworld",
        Code(sheen),
        "`sheen_conty_kulla`",
    ),
    row(
        "LamaConductor",
        "tint:color3=1 fresnelMode:integer=0 IOR:vector3=0.18,0.42,1.37 extinction:vector3=3.42,2.35,1.77 \
         reflectivity:color3=0.945,0.7772,0.3737 edgeColor:color3=0.7137,0.7373,0.455 roughness:float=0.1 \
         normal:vector3=@Nworld anisotropy:float=0 anisotropyDirection:vector3=@Tworld anisotropyRotation:float=0",
        Code(conductor),
        "`conductor`",
    ),
    row(
        "LamaDielectric",
        "reflectionTint:color3=1 transmissionTint:color3=1 fresnelMode:integer=0 IOR:float=1.5 reflectivity:float=0.04 \
         roughness:float=0.1 normal:vector3=@Nworld anisotropy:float=0 direction:vector3=@Tworld rotation:float=0 \
         absorptionColor:color3=1 absorptionRadius:float=1 scatterColor:color3=0 scatterAnisotropy:float=0",
        Code(dielectric),
        "`dielectric`, filled with the medium",
    ),
    row(
        "LamaGeneralizedSchlick",
        "reflectionTint:color3=1 transmissionTint:color3=1 fresnelMode:integer=0 IOR:vector3=1.5 \
         reflectivity:color3=0.04 reflectivity90:color3=1 reflectivityProfile:float=0.2 roughness:float=0.1 \
         normal:vector3=@Nworld anisotropy:float=0 anisotropyDirection:vector3=@Tworld anisotropyRotation:float=0 \
         absorptionColor:color3=1 absorptionRadius:float=1 scatterColor:color3=0 scatterAnisotropy:float=0",
        Code(schlick),
        "`generalized_schlick` over what a dielectric as bright lets through",
    ),
    row(
        "LamaIridescence",
        "roughness:float=0.01 anisotropy:float=0 anisotropyDirection:vector3=@Tworld anisotropyRotation:float=0 \
         relativeFilmThickness:float=0.5 minFilmThickness:float=400 maxFilmThickness:float=800 filmIOR:float=1.3",
        Code(iridescence),
        "`dielectric` of the index 1 under a film",
    ),
    row(
        "LamaSSS",
        "color:color3=0.18 normal:vector3=@Nworld sssRadius:color3=0 sssScale:float=1 sssMode:integer=0 sssIOR:float=1 \
         sssAnisotropy:float=0 sssBleed:float=0 sssFollowTopology:float=0 sssSubset:string= \
         sssContinuationRays:integer=0 sssUnitLength:float=0.00328 mode:integer=0 albedoInversionMethod:integer=0",
        Code(subsurface),
        "`subsurface` with the radius `sssRadius * sssScale * sssUnitLength` in metres",
    ),
    row(
        "LamaEmission",
        "color:color3=0",
        Text("@edf::uniform({color})"),
        "",
    ),
    row(
        "LamaLayer",
        "materialTop:BSDF materialBase:BSDF topMix:float=1 topThickness:float=0",
        Code(layer),
        "`layer(topMix * materialTop, materialBase)`",
    ),
    row(
        "LamaMix",
        "material1:same material2:same mix:float=0",
        Code(mix),
        "`mix(material1, material2, mix)`",
    ),
    row(
        "LamaAdd",
        "material1:same material2:same weight1:float=1 weight2:float=0",
        Code(add),
        "the sum, weighted",
    ),
    row(
        "LamaSurface",
        "materialFront:BSDF materialBack:BSDF presence:float=1",
        Code(surface),
        "a material; its back side is left out",
    ),
];

/// The arguments of microfacets: `roughness` along the direction, and nearer to 1 (or 0) across it.
fn microfacets(call: &mut Call<'_, '_, '_>) -> Result<String, ImportError> {
    let (roughness, anisotropy) = (call.arg("roughness")?, call.arg("anisotropy")?);
    if anisotropy.is_zero() {
        return Ok(format!(", roughness: {}", roughness.text));
    }
    let rest = match anisotropy.single() {
        Some(a) if a < 0.0 => "{roughness}",
        Some(_) => "(1.0 - {roughness})",
        None => "(if {anisotropy} >= 0.0 { 1.0 - {roughness} } else { {roughness} })",
    };
    let across = call.filled(&format!(
        "saturate({{roughness}} + {{anisotropy}} * {rest})"
    ))?;
    let across = call.named("across", Value::new(Float, across)).text;
    let along = call.named("along", roughness).text;
    let widths = format!("vec2({along} * {along}, {across} * {across})");
    let widths = call.named("widths", Value::new(Vector2, widths)).text;
    Ok(call.builder.source.names_in(&format!(
        ", roughness: #ggx_roughness({widths}), anisotropy: #ggx_anisotropy({widths})"
    )))
}

/// The arguments `normal` and `tangent`, where the document gives them.
fn frame(
    call: &mut Call<'_, '_, '_>,
    direction: &str,
    rotation: &str,
) -> Result<String, ImportError> {
    let mut text = String::new();
    let mut normal = "normal".to_owned();
    if call.row.input_row("normal").is_some()
        && let Some(given) = call.given("normal")?.filter(|value| !value.is_zero())
    {
        normal = given.text;
        if normal != "normal" {
            text.push_str(&format!(", normal: {normal}"));
        }
    }
    if call.row.input_row(direction).is_none() {
        return Ok(text);
    }
    let turned = match call.arg(rotation)?.single() {
        Some(0.0) => None,
        Some(turns) => Some(format!(
            "{} deg",
            number(-360.0 * turns).trim_end_matches(".0")
        )),
        None => Some(call.filled(&format!("{{{rotation}}} * -360 deg"))?),
    };
    if let Some(angle) = turned {
        let turned = call.filled(&format!(
            "#rotated_about({{~{direction}}}, {angle}, {normal})"
        ))?;
        text.push_str(&format!(", tangent: {turned}"));
    } else if let Some(given) = call
        .given(direction)?
        .filter(|value| value.text != "tangent")
    {
        text.push_str(&format!(", tangent: {}", given.text));
    }
    Ok(text)
}

fn bsdf(call: &mut Call<'_, '_, '_>, template: &str, arguments: &str) -> Result<Made, ImportError> {
    let text = call.filled(template)?;
    one(Value::new(
        Bsdf,
        format!("{text}{arguments})").replace("(, ", "("),
    ))
}

fn diffuse(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call, "", "")?;
    if call.arg("roughness")?.is_zero() {
        return bsdf(call, "@bsdf::diffuse({color}", &frame);
    }
    let kept = match call.arg("energyCompensation")?.single() {
        Some(0.0) => ", energy_compensation: false",
        _ => "",
    };
    let arguments = format!("{kept}{frame}");
    bsdf(
        call,
        "@bsdf::oren_nayar_diffuse({color}, 0.5 * {roughness} * {roughness}",
        &arguments,
    )
}

fn translucent(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call, "", "")?;
    bsdf(call, "@bsdf::translucent({color}", &frame)
}

fn sheen(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call, "", "")?;
    let roughness = match call.arg("roughness")?.single() {
        Some(roughness) => number(((0.9 * roughness + 0.1).powi(2) * 1e6).round() / 1e6),
        None => "pow(0.9 * {roughness} + 0.1, 2.0)".to_owned(),
    };
    bsdf(
        call,
        &format!("@bsdf::sheen_conty_kulla({{color}}, {roughness}"),
        &frame,
    )
}

/// Is Fresnel's reflectance said by indices?
fn has_indices(call: &mut Call<'_, '_, '_>) -> Result<bool, ImportError> {
    match call.arg("fresnelMode")?.single() {
        Some(mode) => Ok(mode == 1.0),
        None => {
            let message = format!(
                "the input `fresnelMode` of {} is not known",
                call.described()
            );
            Err(call
                .error(message)
                .expected("a number that the document says"))
        }
    }
}

fn conductor(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let facets = microfacets(call)?;
    let frame = frame(call, "anisotropyDirection", "anisotropyRotation")?;
    let indices = if has_indices(call)? {
        "@bsdf::conductor(color({IOR}), color({extinction})".to_owned()
    } else {
        let text = call.filled("@color::artistic_ior({reflectivity}, {edgeColor})")?;
        let name = call.named("ior", Value::new(Color3, text)).text;
        format!("@bsdf::conductor({name}.ior, {name}.extinction")
    };
    let mut made = bsdf(call, &indices, &format!("{facets}{frame}"))?;
    let tint = call.arg("tint")?.text;
    if let Some((_, value)) = made.first_mut() {
        value.text = weighted(&tint, &value.text);
    }
    Ok(made)
}

/// The medium behind a boundary.
fn medium(call: &mut Call<'_, '_, '_>, ior: String) -> Result<Medium, ImportError> {
    let mut radius = call.arg("absorptionRadius")?;
    let absorption = call.arg("absorptionColor")?;
    if !absorption.is_zero() {
        radius = call.in_metres("absorptionRadius", radius, false);
    }
    let absorption = match (absorption.literal, radius.single()) {
        (Some(Literal::Numbers(color)), Some(radius)) if radius > 0.0 => {
            Literal::Numbers(color.iter().map(|c| c / radius).collect()).written(Color3)
        }
        _ => {
            let radius = call.named("radius", radius).text;
            call.filled(&format!("{{absorptionColor}} / {radius}"))?
        }
    };
    let (scattering, anisotropy) = (call.arg("scatterColor")?, call.arg("scatterAnisotropy")?);
    let given = |value: Value| {
        if value.is_zero() {
            String::new()
        } else {
            value.text
        }
    };
    Ok(Medium {
        absorption,
        scattering: given(scattering),
        anisotropy: given(anisotropy),
        ior,
    })
}

fn dielectric(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let facets = microfacets(call)?;
    let frame = frame(call, "direction", "rotation")?;
    let ior = if has_indices(call)? {
        call.arg("IOR")?.text
    } else {
        let ior = call.filled("#reflectance_ior(color({reflectivity}))")?;
        call.named("ior", Value::new(Float, ior)).text
    };
    let mut tints = String::new();
    for (input, name) in [
        ("transmissionTint", "tint"),
        ("reflectionTint", "reflection_tint"),
    ] {
        if call.differs(input)? {
            tints.push_str(&format!(", {name}: {}", call.arg(input)?.text));
        }
    }
    let template = format!("@bsdf::dielectric(ior: {ior} / exterior_ior");
    let made = bsdf(call, &template, &format!("{facets}{tints}{frame}"))?;
    let medium = medium(call, ior)?;
    Ok(filled_below(made, medium))
}

fn schlick(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let facets = microfacets(call)?;
    let frame = frame(call, "anisotropyDirection", "anisotropyRotation")?;
    let color0 = if has_indices(call)? {
        "pow((color({IOR}) - 1.0) / (color({IOR}) + 1.0), color(2.0))"
    } else {
        "{reflectivity}"
    };
    let color0 = call.filled(color0)?;
    let color0 = call.named("reflectivity", Value::new(Color3, color0)).text;
    let exponent = match call.arg("reflectivityProfile")?.single() {
        Some(profile) if profile > 0.0 => number(1.0 / profile),
        _ => call.filled("1.0 / {reflectivityProfile}")?,
    };
    let arguments = format!(", exponent: {exponent}{facets}{frame}");
    let template = format!("@bsdf::generalized_schlick({color0}, color90: {{reflectivity90}}");
    let reflected = bsdf(call, &template, &arguments)?;
    let ior = call
        .builder
        .source
        .names_in(&format!("#reflectance_ior({color0})"));
    let ior = call.named("ior", Value::new(Float, ior)).text;
    let through = call.filled("@bsdf::dielectric_transmission")?;
    let through = format!("{through}(ior: {ior} / exterior_ior{facets}{frame})");
    let tints = (
        call.arg("reflectionTint")?.text,
        call.arg("transmissionTint")?.text,
    );
    let reflected = reflected
        .first()
        .map(|(_, value)| weighted(&tints.0, &value.text));
    let text = format!(
        "layer({}, {})",
        reflected.unwrap_or_default(),
        weighted(&tints.1, &through)
    );
    let medium = medium(call, ior)?;
    Ok(filled_below(one(Value::new(Bsdf, text))?, medium))
}

fn iridescence(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let facets = microfacets(call)?;
    let frame = frame(call, "anisotropyDirection", "anisotropyRotation")?;
    let ends = [
        call.arg("minFilmThickness")?,
        call.arg("maxFilmThickness")?,
        call.arg("relativeFilmThickness")?,
    ];
    let thickness = match [ends[0].single(), ends[1].single(), ends[2].single()] {
        [Some(low), Some(high), Some(share)] => {
            Value::of(Float, Literal::Numbers(vec![low + (high - low) * share]))
        }
        _ => Value::new(
            Float,
            call.filled("mix({minFilmThickness}, {maxFilmThickness}, {relativeFilmThickness})")?,
        ),
    };
    let film = format!(
        "{}, thinfilm_ior: {}",
        film_of(&thickness),
        call.arg("filmIOR")?.text
    );
    bsdf(
        call,
        "@bsdf::dielectric(ior: 1.0",
        &format!("{facets}{film}{frame}"),
    )
}

fn subsurface(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let frame = frame(call, "", "")?;
    let (scale, unit) = (call.arg("sssScale")?, call.arg("sssUnitLength")?);
    let scale = match (scale.single(), unit.single()) {
        (Some(scale), Some(unit)) => number(scale * unit),
        _ => call.filled("{sssScale} * {sssUnitLength}")?,
    };
    let radius = match call.arg("sssRadius")?.literal {
        Some(literal) => literal.written(Vector3),
        None => "vec3({sssRadius})".to_owned(),
    };
    let anisotropy = match call.arg("sssAnisotropy")? {
        value if value.is_zero() => String::new(),
        value => format!(", anisotropy: {}", value.text),
    };
    let template = format!(
        "@bsdf::subsurface({{color}}, {} * {radius}",
        bound(&scale, Level::Product)
    );
    bsdf(call, &template, &format!("{anisotropy}{frame}"))
}

fn layer(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let mut top = call.arg("materialTop")?;
    top.text = weighted(&call.arg("topMix")?.text, &top.text);
    let base = call.arg("materialBase")?;
    let text = layer_of(&top.text, &base.text);
    with_medium(
        call,
        one(Value::new(Bsdf, text))?,
        &["materialTop", "materialBase"],
    )
}

fn mix(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let made = call.template("mix({material1}, {material2}, {mix})")?;
    with_medium(call, made, &["material1", "material2"])
}

fn add(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (a, b) = (call.arg("material1")?, call.arg("material2")?);
    let (wa, wb) = (call.arg("weight1")?, call.arg("weight2")?);
    let text = format!(
        "{} + {}",
        weighted(&wa.text, &a.text),
        weighted(&wb.text, &b.text)
    );
    with_medium(
        call,
        one(Value::new(call.ty, text))?,
        &["material1", "material2"],
    )
}

fn surface(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    if call.given("materialBack")?.is_some() {
        let message = format!("the back side of {} is left out", call.described());
        call.warn(message);
    }
    let front = call.given("materialFront")?;
    let presence = call.arg("presence")?.text;
    let outputs = Outputs {
        interior: front.as_ref().and_then(Value::medium).map(Medium::text),
        surface: front.map(|front| front.text),
        opacity: (presence != "1.0").then_some(presence),
        emission: None,
    };
    one(Value::new(SurfaceShader, "").with(Extra::Shader(Shader::Outputs(outputs))))
}
