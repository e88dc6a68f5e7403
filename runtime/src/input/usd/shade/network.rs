//! A network of nodes as the text of a MaterialX document.

use std::collections::BTreeMap;
use std::fmt::Write;

use openusd::sdf::{Path, Value};

use crate::input::names;
use crate::input::usd::values;
use crate::input::usd::walk::Walk;

/// Connections in a row, and nodes of a network.
const LONGEST: usize = 64;
const MOST_NODES: usize = 4096;

/// Suffixes of a node's name that say its type.
const TYPES: [&str; 14] = [
    "float",
    "integer",
    "boolean",
    "string",
    "filename",
    "color3",
    "color4",
    "vector2",
    "vector3",
    "vector4",
    "matrix33",
    "matrix44",
    "surfaceshader",
    "material",
];

type Checked<T = ()> = Result<T, String>;

/// A network under way.
pub(super) struct Network<'w, 's> {
    walk: &'w mut Walk<'s>,
    text: String,
    /// Nodes by path: their names and types.
    known: BTreeMap<String, (String, String)>,
    /// What the texture coordinates are called that it reads.
    pub(super) coordinates: Vec<String>,
}

/// What an input has.
enum Given {
    Value(Value, Path),
    /// An output of a node.
    Output(Path, String),
    Nothing,
}

impl<'w, 's> Network<'w, 's> {
    pub(super) fn new(walk: &'w mut Walk<'s>) -> Self {
        Self {
            walk,
            text: String::new(),
            known: BTreeMap::new(),
            coordinates: Vec::new(),
        }
    }

    /// The document of what is connected to an output of a material; none if nothing is.
    pub(super) fn document(
        &mut self,
        path: &Path,
        output: &str,
        name: &str,
    ) -> Checked<Option<String>> {
        let attribute = path.append_property(output).map_err(|e| e.to_string())?;
        let Given::Output(node, port) = self.given(attribute)? else {
            return Ok(None);
        };
        let (node, ty) = self.node(&node, &port, 0)?;
        let nodes = std::mem::take(&mut self.text);
        let root = if ty == "material" {
            nodes
        } else {
            format!(
                "{nodes}  <surfacematerial name=\"{name}\" type=\"material\">\n    \
                 <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"{node}\" />\n  </surfacematerial>\n"
            )
        };
        Ok(Some(format!(
            "<?xml version=\"1.0\"?>\n<materialx version=\"1.39\">\n{root}</materialx>\n"
        )))
    }

    /// What an attribute is connected to, or its value.
    fn given(&self, attribute: Path) -> Checked<Given> {
        let stage = self.walk.reader.stage;
        let mut at = attribute;
        for _ in 0..LONGEST {
            let targets = stage.attribute(at.clone()).connections();
            let targets = targets.map_err(|e| format!("`{at}` cannot be read: {e:#}"))?;
            let Some(target) = targets.into_iter().next() else {
                let Some((prim, name)) = at.split_property() else {
                    return Ok(Given::Nothing);
                };
                let value = self.walk.reader.value(&prim, name)?;
                return Ok(value.map_or(Given::Nothing, |value| Given::Value(value, at.clone())));
            };
            let Some((prim, name)) = target.split_property() else {
                return Err(format!(
                    "`{at}` is connected to `{target}`, which is no attribute"
                ));
            };
            let kind = stage.prim(prim.clone()).type_name().ok().flatten();
            if let Some(output) = name.strip_prefix("outputs:")
                && kind.is_some_and(|kind| kind.as_str() == "Shader")
            {
                return Ok(Given::Output(prim, output.to_owned()));
            }
            at = target;
        }
        Err(format!("`{at}` is connected in a circle"))
    }

    /// Writes a node and those before it; its name and the type of an output.
    fn node(&mut self, path: &Path, port: &str, depth: usize) -> Checked<(String, String)> {
        if let Some((name, ty)) = self.known.get(path.as_str()) {
            if name.is_empty() {
                return Err(format!("the node `{path}` is connected in a circle"));
            }
            return Ok((name.clone(), ty.clone()));
        }
        if depth > LONGEST || self.known.len() >= MOST_NODES {
            return Err(format!("the network of `{path}` is too large"));
        }
        self.known
            .insert(path.as_str().to_owned(), Default::default());
        let reader = self.walk.reader;
        let id = reader.token(path, "info:id")?.ok_or_else(|| {
            format!("the node `{path}` does not say what it is\n  expected: `info:id` of UsdPreviewSurface or of MaterialX, `ND_...`")
        })?;
        let (category, suffix) = category(&id).ok_or_else(|| {
            format!("the node `{path}` is a `{id}`, which has no counterpart\n  expected: nodes of UsdPreviewSurface and of MaterialX, `ND_...`")
        })?;
        let ty = self.output_type(path, port, &category, &suffix);
        let name = format!(
            "{}_{}",
            names::identifier(path.name().unwrap_or("node"), &[]),
            self.known.len()
        );
        let properties = reader.stage.prim(path.clone()).property_names();
        let properties = properties.map_err(|e| format!("`{path}` cannot be read: {e:#}"))?;
        let mut inputs = String::new();
        for property in properties {
            if let Some(input) = property.as_str().strip_prefix("inputs:") {
                self.input(path, &category, input, &mut inputs, depth)?;
            }
        }
        // A picture has several outputs; of the node as a whole the color is one.
        let written = if ty == "textured" { "color3" } else { &ty };
        let _ = writeln!(
            self.text,
            "  <{category} name=\"{name}\" type=\"{written}\">\n{inputs}  </{category}>"
        );
        self.known
            .insert(path.as_str().to_owned(), (name.clone(), ty.clone()));
        Ok((name, ty))
    }

    fn input(
        &mut self,
        path: &Path,
        category: &str,
        input: &str,
        inputs: &mut String,
        depth: usize,
    ) -> Checked {
        let attribute = path
            .append_property(format!("inputs:{input}"))
            .map_err(|e| e.to_string())?;
        match self.given(attribute.clone())? {
            Given::Nothing => {}
            Given::Output(node, port) => {
                let (name, ty) = self.node(&node, &port, depth + 1)?;
                let (ty, port) = match (ty.as_str(), port.as_str()) {
                    ("textured", "rgb") => ("color3", Some("rgb")),
                    ("textured", port @ ("r" | "g" | "b" | "a")) => ("float", Some(port)),
                    ("textured", _) => ("color4", None),
                    (ty, "out" | "result" | "surface") => (ty, None),
                    (ty, port) => (ty, Some(port)),
                };
                let port = port.map_or(String::new(), |port| {
                    format!(" output=\"{}\"", escaped(port))
                });
                let input = escaped(input);
                let _ = writeln!(
                    inputs,
                    "    <input name=\"{input}\" type=\"{ty}\" nodename=\"{name}\"{port} />"
                );
            }
            Given::Value(value, from) => {
                let ty = self
                    .walk
                    .reader
                    .stage
                    .attribute(from.clone())
                    .type_name()
                    .ok()
                    .flatten();
                let ty = ty.map(|ty| ty.as_str().to_owned()).unwrap_or_default();
                self.value(category, input, &attribute, &value, &ty, inputs);
            }
        }
        Ok(())
    }

    /// Writes an input that has a value.
    fn value(
        &mut self,
        category: &str,
        input: &str,
        attribute: &Path,
        value: &Value,
        ty: &str,
        inputs: &mut String,
    ) {
        let mut space = String::new();
        let (ty, text) = match value {
            Value::AssetPath(asset) => {
                let Some(picture) = self.walk.picture(asset) else {
                    return;
                };
                if let Some((prim, name)) = attribute.split_property() {
                    space = self.color_space(&prim, name, category, asset.as_str());
                }
                ("filename", format!("images/{picture}"))
            }
            Value::Token(_) | Value::String(_) => {
                let text = values::text(value).unwrap_or_default();
                match (category, input) {
                    ("UsdUVTexture", "sourceColorSpace") => return,
                    ("UsdUVTexture", "wrapS" | "wrapT") => ("string", wrap(&text).to_owned()),
                    ("UsdPrimvarReader", "varname") | ("geompropvalue", "geomprop") => {
                        ("string", self.property(&text, attribute))
                    }
                    _ => ("string", text),
                }
            }
            Value::Bool(flag) => ("boolean", flag.to_string()),
            value => {
                let Some(numbers) = values::components(value) else {
                    return;
                };
                let ty = match (ty, numbers.len()) {
                    ("int" | "uint" | "int64", 1) => "integer",
                    (_, 1) => "float",
                    (_, 2) => "vector2",
                    (ty, 3) if ty.starts_with("color") => "color3",
                    (_, 3) => "vector3",
                    (ty, 4) if ty.starts_with("color") => "color4",
                    // Values of pictures are colors, though USD has them in four numbers.
                    _ if category == "UsdUVTexture" => "color4",
                    (_, 4) => "vector4",
                    (_, 9) => "matrix33",
                    _ => "matrix44",
                };
                let numbers: Vec<String> =
                    numbers.iter().map(|n| format!("{}", *n as f32)).collect();
                (ty, numbers.join(", "))
            }
        };
        let (input, text) = (escaped(input), escaped(&text));
        let _ = writeln!(
            inputs,
            "    <input name=\"{input}\" type=\"{ty}\" value=\"{text}\"{space} />"
        );
    }

    /// The property of the geometry that a node asks for, by the name that the importer knows.
    fn property(&mut self, name: &str, attribute: &Path) -> String {
        let name = name.strip_prefix("primvars:").unwrap_or(name);
        let is_pair = attribute.split_property().is_some_and(|(prim, _)| {
            let id = self.walk.reader.token(&prim, "info:id").ok().flatten();
            id.is_some_and(|id| id.ends_with("float2") || id.ends_with("vector2"))
        });
        if !is_pair {
            return name.to_owned();
        }
        let known = self.coordinates.iter().position(|own| own == name);
        let index = known.unwrap_or_else(|| {
            self.coordinates.push(name.to_owned());
            self.coordinates.len() - 1
        });
        match index {
            0 => "st".into(),
            1 => "UV1".into(),
            _ => name.to_owned(),
        }
    }

    /// In which colors a picture is.
    fn color_space(&self, node: &Path, name: &str, category: &str, file: &str) -> String {
        let reader = self.walk.reader;
        let said = if category == "UsdUVTexture" {
            reader.token(node, "inputs:sourceColorSpace").ok().flatten()
        } else {
            Some(
                reader
                    .field(node, name, "colorSpace")
                    .unwrap_or_else(|| "raw".into()),
            )
        };
        let is_float = [".exr", ".hdr"]
            .iter()
            .any(|end| file.to_ascii_lowercase().ends_with(end));
        let space = match said.as_deref() {
            Some("sRGB") => "srgb_texture",
            Some("raw" | "Raw" | "data" | "Non-Color") => return String::new(),
            None | Some("auto") if is_float => return String::new(),
            None | Some("auto") => "srgb_texture",
            Some(other) => other,
        };
        format!(" colorspace=\"{}\"", escaped(space))
    }

    /// The type of an output.
    fn output_type(&self, path: &Path, port: &str, category: &str, suffix: &str) -> String {
        if category == "UsdUVTexture" {
            return "textured".into();
        }
        let named = suffix
            .rsplit('_')
            .map(|part| part.strip_suffix("FA").unwrap_or(part));
        let mut named = named.filter(|part| TYPES.contains(part));
        let attribute = path.append_property(format!("outputs:{port}")).ok();
        let written = attribute.and_then(|a| {
            self.walk
                .reader
                .stage
                .attribute(a)
                .type_name()
                .ok()
                .flatten()
        });
        let written = written.as_ref().map_or("", |ty| ty.as_str());
        match written {
            _ if category == "UsdPreviewSurface" => "surfaceshader",
            _ if category == "UsdTransform2d" => "vector2",
            "float" | "half" | "double" => "float",
            "int" => "integer",
            "bool" => "boolean",
            "color3f" | "color3h" | "color3d" => "color3",
            "color4f" | "color4h" | "color4d" => "color4",
            "float2" | "texCoord2f" | "double2" | "half2" => "vector2",
            "float3" | "vector3f" | "normal3f" | "point3f" | "double3" => "vector3",
            "float4" | "double4" => "vector4",
            "matrix3d" => "matrix33",
            "matrix4d" => "matrix44",
            _ => return named.next().unwrap_or("surfaceshader").to_owned(),
        }
        .to_owned()
    }
}

/// The category of a node, and what its name says beyond.
fn category(id: &str) -> Option<(String, String)> {
    for own in [
        "UsdPreviewSurface",
        "UsdUVTexture",
        "UsdPrimvarReader",
        "UsdTransform2d",
    ] {
        let plain = id.strip_prefix("ND_").unwrap_or(id);
        if let Some(rest) = plain.strip_prefix(own)
            && (rest.is_empty() || rest.starts_with('_'))
        {
            return Some((own.to_owned(), rest.to_owned()));
        }
    }
    let rest = id.strip_prefix("ND_")?;
    let rows = impasto_import::node_rows().map(|row| row.category);
    let missing = impasto_import::MISSING.iter().map(|row| row.category);
    let extra = ["surfacematerial"];
    let known = rows.chain(missing).chain(extra).filter(|category| {
        let after = rest.strip_prefix(category);
        after.is_some_and(|after| after.is_empty() || after.starts_with('_'))
    });
    let category = known.max_by_key(|category| category.len())?;
    Some((category.to_owned(), rest[category.len()..].to_owned()))
}

fn wrap(mode: &str) -> &'static str {
    match mode {
        "clamp" => "clamp",
        "mirror" => "mirror",
        "black" => "constant",
        _ => "periodic",
    }
}

/// A text within an attribute of XML.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}
