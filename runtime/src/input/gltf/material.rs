//! Materials of a glTF file as sources: an instance of `std::surface::gltf_pbr`, whose numbers are parameters and whose
//! pictures are looked up, with only what differs from its defaults.

use std::fmt::Write;

use serde_json::Value;

use super::Model;
use super::rows::{Channel, Kind, Of, ROWS, Row};
use crate::input::names;

/// Where a picture is looked up that is moved, turned and scaled.
pub(super) const TRANSFORMED: &str = "
/// Where a picture is looked up that is scaled, turned and moved, in this order. In glTF v goes down.
/// Source: KHR_texture_transform.
fn transformed(place: vec2, offset: vec2, turn: float, scale: vec2) -> vec2 {
    let p = scale * vec2(place.x, 1.0 - place.y);
    let turned = vec2(cos(turn) * p.x + sin(turn) * p.y, cos(turn) * p.y - sin(turn) * p.x);
    vec2(turned.x + offset.x, 1.0 - turned.y - offset.y)
}
";

impl Model {
    /// The source of the material of that name; none if there is none.
    pub(super) fn source(&self, name: &str) -> Option<String> {
        let number = self.source_names.iter().position(|own| own == name)?;
        let title = &self.material_names[number];
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let material = Written {
            model: self,
            json: self.materials.get(number)?,
            has_colors: self.colored.contains(&number),
            params: String::new(),
            arguments: Vec::new(),
            maps: Vec::new(),
            transforms: false,
            bends: false,
        };
        Some(material.source(name, title, &file))
    }
}

/// What scenes call the materials of a file, by their number, and the names of their sources.
pub(super) fn names(document: &gltf::Document) -> (Vec<String>, Vec<String>) {
    let materials = document.materials().enumerate();
    let names = materials.map(|(index, m)| Model::named(m.name(), "material", index));
    let names: Vec<String> = unique(names);
    let sources = unique(names.iter().map(|name| identifier(name)));
    (names, sources)
}

/// The names, with numbers after those that were there already.
fn unique(all: impl Iterator<Item = String>) -> Vec<String> {
    let mut unique = names::Unique::default();
    all.map(|name| unique.name(name)).collect()
}

/// A name as the language has them, and none that sources of materials use.
fn identifier(name: &str) -> String {
    let used = ["gltf_pbr", "normal_map", "uniform", "transformed"];
    names::identifier(name, &used)
}

/// A source under way.
struct Written<'m> {
    model: &'m Model,
    json: &'m Value,
    has_colors: bool,
    /// Declarations of parameters.
    params: String,
    /// What `gltf_pbr` is called with.
    arguments: Vec<String>,
    /// Pictures that are declared, by their parameters.
    maps: Vec<String>,
    /// Are lookups transformed, and normals bent?
    transforms: bool,
    bends: bool,
}

impl Written<'_> {
    fn source(mut self, name: &str, title: &str, file: &str) -> String {
        let is_unlit = self.extension("KHR_materials_unlit").is_object();
        for row in ROWS {
            if !is_unlit || row.name == "base_color" {
                self.row(row);
            }
        }
        self.film();
        self.alpha();
        let mut uses = String::new();
        if is_unlit {
            uses.push_str("use std::edf::uniform;\n");
        }
        if self.bends {
            uses.push_str("use std::pattern::normal_map;\n");
        }
        if !is_unlit {
            uses.push_str("use std::surface::gltf_pbr;\n");
        }
        let helper = if self.transforms { TRANSFORMED } else { "" };
        let body = if is_unlit {
            let color = self
                .arguments
                .iter()
                .find_map(|a| a.strip_prefix("base_color: "));
            let alpha = self
                .arguments
                .iter()
                .find_map(|a| a.strip_prefix("alpha: "));
            let opacity = alpha.map(|a| format!("    opacity = {a};\n"));
            let color = color.unwrap_or("color(1.0)");
            format!(
                "    emission = uniform({color});\n{}",
                opacity.unwrap_or_default()
            )
        } else {
            let arguments = self.arguments.iter().map(|a| format!("        {a},\n"));
            let arguments: String = arguments.collect();
            if arguments.is_empty() {
                "    material = gltf_pbr();\n".to_owned()
            } else {
                format!("    material = gltf_pbr(\n{arguments}    );\n")
            }
        };
        let gap = if self.params.is_empty() { "" } else { "\n" };
        format!(
            "//! From `{}`.\n\n{uses}{helper}\n/// The material `{}`.\nmaterial {name} {{\n{}{gap}{body}}}\n",
            one_line(file),
            one_line(title),
            self.params
        )
    }

    fn extension(&self, name: &str) -> &Value {
        &self.json["extensions"][name]
    }

    fn object(&self, of: Of) -> &Value {
        match of {
            Of::Material => self.json,
            Of::Base => &self.json["pbrMetallicRoughness"],
            Of::Extension(name) => self.extension(name),
        }
    }

    /// Declares what the file says of a parameter, and gives it to the model.
    fn row(&mut self, row: &Row) {
        let object = self.object(row.of).clone();
        let factor = numbers(&object[row.factor]);
        let factor = factor.filter(|f| f.len() >= row.default.len());
        let factor = factor.map(|f| f[..row.default.len()].to_vec());
        let value = factor.unwrap_or_else(|| row.default.to_vec());
        let map = row.map.and_then(|(key, channel)| {
            let lookup = self.lookup(&object[key], &snake(key), channel)?;
            Some((lookup, channel))
        });
        let argument = match map {
            Some((lookup, Channel::Normal)) => Some(lookup),
            // A picture times nothing is nothing, and times white itself.
            Some((lookup, _)) if value.iter().all(|v| *v == 1.0) => Some(lookup),
            Some((lookup, _)) if value.iter().any(|v| *v != 0.0) => {
                self.declare(row.name, row.kind, &value);
                Some(format!("{} * {lookup}", row.name))
            }
            _ if value != row.default => {
                self.declare(row.name, row.kind, &value);
                Some(row.name.to_owned())
            }
            _ => None,
        };
        let argument = match argument {
            argument if row.name == "base_color" && self.has_colors => {
                let of_corners = argument.map(|argument| format!("{argument} * vertex_color"));
                Some(of_corners.unwrap_or_else(|| "vertex_color".into()))
            }
            argument => argument,
        };
        self.arguments
            .extend(argument.map(|argument| format!("{}: {argument}", row.name)));
    }

    /// The thickness of a film: between two of them, where a picture says how far.
    fn film(&mut self) {
        let film = self.extension("KHR_materials_iridescence").clone();
        if !film.is_object() {
            return;
        }
        let number = |key: &str, default| film[key].as_f64().unwrap_or(default);
        let most = number("iridescenceThicknessMaximum", 400.0);
        let least = number("iridescenceThicknessMinimum", 100.0);
        let key = "iridescenceThicknessTexture";
        let lookup = self.lookup(&film[key], &snake(key), Channel::Green);
        self.declare("iridescence_thickness", Kind::Nanometers, &[most]);
        let thickness = match lookup {
            Some(lookup) => {
                let name = "iridescence_thickness_minimum";
                self.declare(name, Kind::Nanometers, &[least]);
                format!("mix({name}, iridescence_thickness, {lookup})")
            }
            None => "iridescence_thickness".into(),
        };
        let argument = format!("iridescence_thickness: {thickness}");
        self.arguments.push(argument);
    }

    /// How much of the surface is there.
    fn alpha(&mut self) {
        let mode = match self.json["alphaMode"].as_str() {
            Some("MASK") => 1,
            Some("BLEND") => 2,
            _ => return,
        };
        let base = self.json["pbrMetallicRoughness"].clone();
        let factor = base["baseColorFactor"][3].as_f64().unwrap_or(1.0);
        let map = self.lookup(&base["baseColorTexture"], "base_color", Channel::Alpha);
        if factor != 1.0 || map.is_none() {
            self.declare("alpha", Kind::Share, &[factor]);
        }
        let alpha = match map {
            Some(map) if factor != 1.0 => format!("alpha * {map}"),
            Some(map) => map,
            None => "alpha".into(),
        };
        self.arguments.push(format!("alpha: {alpha}"));
        self.arguments.push(format!("alpha_mode: {mode}"));
        if let (1, Some(cutoff)) = (mode, self.json["alphaCutoff"].as_f64()) {
            self.declare("alpha_cutoff", Kind::Share, &[cutoff]);
            self.arguments.push("alpha_cutoff: alpha_cutoff".into());
        }
    }

    fn declare(&mut self, name: &str, kind: Kind, value: &[f64]) {
        let numbers: Vec<String> = value.iter().map(|v| float(*v)).collect();
        let one = &numbers[0];
        let line = match kind {
            Kind::Color | Kind::Tint => format!("color = color({})", numbers.join(", ")),
            Kind::Share => {
                let share = float(value[0].clamp(0.0, 1.0));
                format!("float = {share} in 0.0 .. 1.0")
            }
            Kind::Float => format!("float = {one}"),
            Kind::Meters => format!("length = {one} m"),
            Kind::Nanometers => format!("length = {one} nm"),
            Kind::Radians => format!("angle = {one} rad"),
        };
        // Writing to a string cannot fail.
        let _ = writeln!(self.params, "    param {name}: {line};");
    }

    /// A lookup of the picture that `info` names, which is declared as a parameter; none if it names none.
    fn lookup(&mut self, info: &Value, name: &str, channel: Channel) -> Option<String> {
        let texture = usize::try_from(info["index"].as_u64()?).ok()?;
        let texture = self.model.document.textures().nth(texture)?;
        let image = texture.source().index();
        let map = format!("{name}_map");
        if !self.maps.contains(&map) {
            let _ = writeln!(
                self.params,
                "    param {map}: texture = \"images/{image}\";"
            );
            self.maps.push(map.clone());
        }
        let place = self.place(info);
        let wraps = wraps(&texture.sampler());
        Some(match channel {
            Channel::Color => format!("image({map}, {place}{wraps})"),
            Channel::Alpha => format!("image_alpha({map}, {place}{wraps})"),
            Channel::Red => format!("image_data({map}, {place}{wraps}).x"),
            Channel::Green => format!("image_data({map}, {place}{wraps}).y"),
            Channel::Blue => format!("image_data({map}, {place}{wraps}).z"),
            Channel::Normal => {
                self.bends = true;
                let scale = info["scale"].as_f64().filter(|s| *s != 1.0);
                let scale = scale.map_or(String::new(), |s| format!(", scale: {}", float(s)));
                let texel = format!("color(image_data({map}, {place}{wraps}).xyz)");
                format!("normal_map({texel}, normal, tangent{scale})")
            }
        })
    }

    /// Where a picture is looked up.
    fn place(&mut self, info: &Value) -> String {
        let transform = &info["extensions"]["KHR_texture_transform"];
        let set = transform["texCoord"].as_u64().or(info["texCoord"].as_u64());
        let uv = if set == Some(1) { "uv1" } else { "uv" };
        if !transform.is_object() {
            return uv.to_owned();
        }
        let pair = |key: &str, default: f64| {
            let found = numbers(&transform[key]).filter(|n| n.len() == 2);
            let [x, y] = found.map_or([default; 2], |n| [n[0], n[1]]);
            format!("vec2({}, {})", float(x), float(y))
        };
        let turn = float(transform["rotation"].as_f64().unwrap_or(0.0));
        self.transforms = true;
        format!(
            "transformed({uv}, {}, {turn}, {})",
            pair("offset", 0.0),
            pair("scale", 1.0)
        )
    }
}

/// How a sampler continues a picture beyond its edges, where that is not by repeating it.
fn wraps(sampler: &gltf::texture::Sampler<'_>) -> String {
    use gltf::texture::WrappingMode;
    let name = |mode| match mode {
        WrappingMode::ClampToEdge => "CLAMP",
        WrappingMode::MirroredRepeat => "MIRROR",
        WrappingMode::Repeat => "REPEAT",
    };
    match (name(sampler.wrap_s()), name(sampler.wrap_t())) {
        ("REPEAT", "REPEAT") => String::new(),
        (u, v) if u == v => format!(", wrap: {u}"),
        (u, v) => format!(", wrap_u: {u}, wrap_v: {v}"),
    }
}

/// A number, or numbers.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Number(n) => Some(vec![n.as_f64()?]),
        Value::Array(items) => items.iter().map(Value::as_f64).collect(),
        _ => None,
    }
}

/// A number as sources have it: as short as single precision allows.
fn float(value: f64) -> String {
    const MAX: f64 = f32::MAX as f64;
    format!("{:?}", value.clamp(-MAX, MAX) as f32)
}

/// `baseColorTexture` as `base_color`.
fn snake(key: &str) -> String {
    let mut out = String::new();
    for c in key.strip_suffix("Texture").unwrap_or(key).chars() {
        if c.is_ascii_uppercase() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

/// A name that stays in its line of documentation.
fn one_line(text: &str) -> String {
    let visible = |c: char| if c.is_control() { ' ' } else { c };
    text.chars().map(visible).collect()
}
