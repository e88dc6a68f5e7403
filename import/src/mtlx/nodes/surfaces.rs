//! Surface shaders: models that the library has as materials, and surfaces made of closures.

use std::collections::HashMap;
use std::sync::OnceLock;

use impasto_compiler::diag::nearest;

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::helpers;
use crate::mtlx::nodes::Make::Code;
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::text::{Level, bound, weighted};
use crate::mtlx::types::Type::{self, *};
use crate::mtlx::types::{Literal, number};
use crate::mtlx::units::length;
use crate::mtlx::value::{Extra, Outputs, Shader, Value};

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "standard_surface",
        "*",
        Code(model),
        "the material `std::surface::standard_surface`",
    ),
    row(
        "open_pbr_surface",
        "*",
        Code(model),
        "the material `std::surface::open_pbr`",
    ),
    row(
        "gltf_pbr",
        "*",
        Code(model),
        "the material `std::surface::gltf_pbr`",
    ),
    row(
        "disney_principled",
        "*",
        Code(model),
        "the material `std::surface::disney_principled`; `subsurfaceDistance` is left out",
    ),
    row(
        "UsdPreviewSurface",
        "*",
        Code(model),
        "a material in the source; `normal` is one of the world where it is connected to \
        `normalmap`, else a texel's direction; the metal is a conductor as there",
    ),
    row(
        "surface",
        "bsdf:BSDF edf:EDF opacity:float=1 thin_walled:boolean=false",
        Code(surface),
        "the outputs `surface`, `emission`, `opacity`; `interior` where a closure lets light in and it is not thin-walled",
    ),
    row(
        "surface_unlit",
        "emission:float=1 emission_color:color3=1 transmission:float=0 transmission_color:color3=1 \
        opacity:float=1",
        Code(unlit),
        "`uniform` emission and `transparent`",
    ),
];

/// A parameter of a model.
#[derive(Clone, Debug)]
pub(in crate::mtlx) struct Parameter {
    pub name: &'static str,
    /// Its type in Impasto.
    pub ty: &'static str,
    default: &'static str,
    /// What it may be, if numbers say so.
    range: Option<(f64, f64)>,
}

impl Parameter {
    /// The unit that documents have its values in, of a length or an angle.
    pub fn unit(&self) -> &'static str {
        match self.default.split_once(' ') {
            _ if self.name == "anisotropy_rotation" => "rad",
            Some((_, unit)) => unit,
            None => "m",
        }
    }

    /// The type of its values in documents.
    pub fn input_type(&self) -> Type {
        match self.ty {
            "int" => Integer,
            "bool" => Boolean,
            "color" => Color3,
            "normal" | "vector" => Vector3,
            _ => Float,
        }
    }
}

/// Nodes, and the materials that they are.
pub(in crate::mtlx) const MODELS: &[(&str, &str)] = &[
    ("standard_surface", "standard_surface"),
    ("open_pbr_surface", "open_pbr"),
    ("gltf_pbr", "gltf_pbr"),
    ("disney_principled", "disney_principled"),
    ("UsdPreviewSurface", "usd_preview_surface"),
];

/// Lengths whose default is a unit: the model, the input, and the input without which it says nothing.
const METRIC: &[(&str, &str, &str)] = &[
    ("standard_surface", "subsurface_scale", "subsurface"),
    ("open_pbr_surface", "subsurface_radius", "subsurface_weight"),
];

/// Parameters of materials that their nodes in MaterialX 1.39 lack. Documents of others that have them are read.
pub(in crate::mtlx) const LACKING: &[(&str, &[&str])] = &[(
    "disney_principled",
    &["diffTrans", "flatness", "scatterDistance", "thin"],
)];

/// The parameters of a model, as its source declares them.
pub(in crate::mtlx) fn parameters(material: &str) -> &'static [Parameter] {
    static ALL: OnceLock<HashMap<&'static str, Vec<Parameter>>> = OnceLock::new();
    let all = ALL.get_or_init(|| {
        let read = |(_, material): &(&str, &'static str)| {
            let file = impasto_stdlib::file("surface", material).map(|file| file.text);
            let file = file.or(helpers::find(material).map(|helper| helper.file));
            (
                *material,
                file.unwrap_or_default()
                    .lines()
                    .filter_map(declared)
                    .collect(),
            )
        };
        MODELS.iter().map(read).collect()
    });
    all.get(material).map(Vec::as_slice).unwrap_or_default()
}

/// The parameter that a line declares.
fn declared(line: &'static str) -> Option<Parameter> {
    let (name, rest) = line.trim().strip_prefix("param ")?.split_once(": ")?;
    let (ty, rest) = rest.split_once(" = ")?;
    let rest = rest
        .split_once(" {")
        .map_or(rest, |(rest, _)| rest)
        .trim_end_matches(';');
    let (default, range) = rest
        .split_once(" in ")
        .map_or((rest, None), |(d, r)| (d, Some(r)));
    let range = range.and_then(|range| {
        let (low, high) = range.split_once(" .. ")?;
        Some((low.parse().ok()?, high.parse().ok()?))
    });
    Some(Parameter {
        name,
        ty,
        default,
        range,
    })
}

fn model(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let category = call.row.category;
    let material = MODELS
        .iter()
        .find(|(node, _)| *node == category)
        .map_or("", |(_, m)| *m);
    let known = parameters(material);
    let document = call.builder.graphs.document;
    let inputs: Vec<_> = document.inputs(call.key.node).collect();
    let mut arguments = Vec::new();
    for input in inputs {
        let name = document.name(input);
        let Some(parameter) = known.iter().find(|parameter| parameter.name == name) else {
            unknown_input(call, name, known);
            continue;
        };
        let Some(value) = call.given(name)? else {
            continue;
        };
        let Some(text) = argument(call, parameter, &value)? else {
            continue;
        };
        if text != parameter.default {
            arguments.push(format!("{name}: {text}"));
        }
    }
    // What is not given is a length all the same.
    for (_, name, of) in METRIC.iter().filter(|(model, _, _)| *model == category) {
        let needed = document.input(call.key.node, of).is_some();
        let given = document.input(call.key.node, name).is_some();
        let parameter = known.iter().find(|parameter| parameter.name == *name);
        if let Some(parameter) = parameter.filter(|_| needed && !given) {
            let one = Value::of(Float, Literal::Numbers(vec![1.0]));
            let text = argument(call, parameter, &one)?.unwrap_or_default();
            if text != parameter.default {
                arguments.push(format!("{name}: {text}"));
            }
        }
    }
    let callee = match helpers::find(material) {
        Some(_) => format!("#{material}"),
        None => format!("@surface::{material}"),
    };
    let callee = call.builder.source.names_in(&callee);
    let text = format!("{callee}({})", arguments.join(", "));
    one(Value::new(SurfaceShader, "").with(Extra::Shader(Shader::Call(text))))
}

fn unknown_input(call: &mut Call<'_, '_, '_>, name: &str, known: &[Parameter]) {
    let near = nearest(name, known.iter().map(|parameter| parameter.name));
    let near = near
        .map(|near| format!("; did you mean `{near}`?"))
        .unwrap_or_default();
    let message = format!(
        "{} has no input `{name}`, which is left out{near}",
        call.described()
    );
    call.warn(message);
}

/// The argument for a parameter; nothing if the value says nothing.
fn argument(
    call: &mut Call<'_, '_, '_>,
    parameter: &Parameter,
    value: &Value,
) -> Result<Option<String>, ImportError> {
    let fits = matches!(
        (parameter.ty, value.ty),
        ("float" | "length" | "angle", Float | Integer)
            | ("int", Integer)
            | ("bool", Boolean)
            | ("color", Color3)
            | ("normal" | "vector", Vector3)
    );
    if !fits {
        let message = format!(
            "the input `{}` of {} has the type `{}`",
            parameter.name,
            call.described(),
            value.ty.name()
        );
        return Err(call
            .error(message)
            .expected(format!("`{}`", parameter.input_type().name()))
            .hint("put a `convert` between them"));
    }
    let is_length = |(model, name, _): &(&str, &str, &str)| {
        *model == call.row.category && *name == parameter.name
    };
    let metric = METRIC.iter().any(is_length) && parameter.ty == "float";
    let value = &if metric {
        call.in_metres(parameter.name, value.clone(), false)
    } else {
        value.clone()
    };
    Ok(Some(match parameter.ty {
        // Documents of some programs write directions that are not given so.
        "normal" | "vector" if value.is_zero() => return Ok(None),
        "normal" if call.row.category == "UsdPreviewSurface" && !value.is_geometric => {
            if value.text == "vec3(0.0, 0.0, 1.0)" {
                return Ok(None);
            }
            let map = call.builder.source.names_in("@pattern::normal_map");
            let texel = bound(&value.text, Level::Prefix);
            format!("{map}(color(0.5 * {texel} + 0.5), normal, tangent)")
        }
        "length" if parameter.unit() == "m" => call.length(parameter.name, value),
        "length" | "angle" => {
            let unit = parameter.unit();
            match value.single() {
                Some(single) => length(single, unit),
                None => format!("{} * 1 {unit}", bound(&value.text, Level::Product)),
            }
        }
        "float" => match (value.single(), parameter.range) {
            (Some(single), Some((low, high))) if single < low || single > high => {
                let held = single.clamp(low, high);
                let message = format!("{}: {single} is held at {held}", parameter.name);
                call.warn(message);
                number(held)
            }
            (Some(single), _) => number(single),
            _ => value.text.clone(),
        },
        _ => value.text.clone(),
    }))
}

/// A surface of closures.
fn surface(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let thin = call.arg("thin_walled")?;
    let bsdf = call.given("bsdf")?;
    let edf = call.given("edf")?;
    let medium = bsdf.as_ref().and_then(Value::medium).cloned();
    let interior = medium
        .map(|medium| medium.text())
        .and_then(|medium| match thin.text.as_str() {
            "true" => None,
            "false" => Some(medium),
            thin => Some(format!("if {thin} {{ none }} else {{ {medium} }}")),
        });
    let opacity = call.arg("opacity")?.text;
    let surface = bsdf.map(|value| value.text);
    let emission = edf.map(|value| value.text);
    let nothing = surface.is_none() && emission.is_none();
    let black = nothing.then(|| call.builder.source.names_in("@bsdf::diffuse(0.0)"));
    let outputs = Outputs {
        surface: surface.or(black),
        emission,
        opacity: (opacity != "1.0").then_some(opacity),
        interior,
    };
    one(Value::new(SurfaceShader, "").with(Extra::Shader(Shader::Outputs(outputs))))
}

fn unlit(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (emission, color) = (call.arg("emission")?, call.arg("emission_color")?);
    let radiance = if color.single() == Some(1.0) && !emission.is_zero() {
        format!("color({})", emission.text)
    } else {
        weighted(&emission.text, &color.text)
    };
    let transmission = call.arg("transmission")?;
    let surface = if transmission.is_zero() {
        None
    } else {
        let clear = call.filled("@bsdf::transparent({transmission_color})")?;
        Some(weighted(&transmission.text, &clear))
    };
    let opacity = call.arg("opacity")?.text;
    let uniform = call.builder.source.names_in("@edf::uniform");
    let outputs = Outputs {
        surface,
        emission: Some(format!("{uniform}({radiance})")),
        opacity: (opacity != "1.0").then_some(opacity),
        interior: None,
    };
    one(Value::new(SurfaceShader, "").with(Extra::Shader(Shader::Outputs(outputs))))
}

/// A value as a surface that shows it.
pub(super) fn shown(call: &mut Call<'_, '_, '_>, from: Type) -> Result<Made, ImportError> {
    let value = call.arg("in")?;
    let value = call.named("in", value).plain();
    let (color, opacity) = match from {
        Color3 => (value, None),
        Color4 | Vector4 => (format!("color({value}.xyz)"), Some(format!("{value}.w"))),
        Vector2 => (format!("color({value}.x, {value}.y, 0.0)"), None),
        Boolean => (
            format!("if {value} {{ color(1.0) }} else {{ color(0.0) }}"),
            None,
        ),
        _ => (format!("color({value})"), None),
    };
    let uniform = call.builder.source.names_in("@edf::uniform");
    let outputs = Outputs {
        emission: Some(format!("{uniform}({color})")),
        opacity,
        ..Outputs::default()
    };
    one(Value::new(SurfaceShader, "").with(Extra::Shader(Shader::Outputs(outputs))))
}

/// A mix of surfaces.
pub(super) fn mixed(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let t = call.arg("mix")?;
    let t = call.named("mix", t).text;
    let below = outputs(call, "bg")?;
    let above = outputs(call, "fg")?;
    let both = |a: &Option<String>, b: &Option<String>, none: &str| match (a, b) {
        (None, None) => None,
        (a, b) => {
            let text = |x: &Option<String>| x.clone().unwrap_or_else(|| none.to_owned());
            Some(format!("mix({}, {}, {t})", text(a), text(b)))
        }
    };
    let black = call.builder.source.names_in("@bsdf::diffuse(0.0)");
    let dark = call.builder.source.names_in("@edf::uniform(0.0)");
    let interior = match (below.interior, above.interior) {
        (Some(below), Some(above)) if below != above => {
            call.warn("a mix of two surfaces is filled with what the first is filled with");
            Some(below)
        }
        (below, above) => below.or(above),
    };
    let outputs = Outputs {
        surface: both(&below.surface, &above.surface, &black),
        emission: both(&below.emission, &above.emission, &dark),
        opacity: both(&below.opacity, &above.opacity, "1.0"),
        interior,
    };
    one(Value::new(SurfaceShader, "").with(Extra::Shader(Shader::Outputs(outputs))))
}

/// The outputs of a surface that is an input.
fn outputs(call: &mut Call<'_, '_, '_>, input: &str) -> Result<Outputs, ImportError> {
    let Some(value) = call.given(input)? else {
        return Ok(Outputs::default());
    };
    match value.extra {
        Extra::Shader(Shader::Outputs(outputs)) => Ok(outputs),
        Extra::Shader(Shader::Call(text)) => {
            let name = format!("{}_{input}", call.name());
            let name = call.builder.bind(&name, &text);
            let field = |field: &str| Some(format!("{name}.{field}"));
            Ok(Outputs {
                surface: field("surface"),
                emission: field("emission"),
                opacity: field("opacity"),
                interior: field("interior"),
            })
        }
        _ => Ok(Outputs::default()),
    }
}
