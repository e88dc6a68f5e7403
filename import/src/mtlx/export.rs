//! Instances of surface models as documents of MaterialX 1.39.
//!
//! Inputs have the names of the model's parameters, as when documents are imported, and only what differs from their
//! defaults is written.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use impasto_compiler::abi::{FILTERS, WRAPS};
use impasto_compiler::ast::Unit;
use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::instance::{
    Channels, Exported, Instance, Lookup, NormalMap, Place, Texel, Value, Varying,
};

use crate::mtlx::nodes::surfaces::{LACKING, MODELS, Parameter, parameters};

/// An instance as a document with one material; `pictures` says what its pictures are called there.
///
/// # Errors
/// What MaterialX has no input for, all of it.
pub fn to_materialx(instance: &Instance, pictures: &[String]) -> Result<Exported, Vec<Diagnostic>> {
    let model = instance.model.as_str();
    let Some((category, _)) = MODELS.iter().find(|(_, material)| *material == model) else {
        let message = format!("MaterialX has no node for `{model}`");
        let known: Vec<String> = MODELS
            .iter()
            .filter(|(_, material)| impasto_stdlib::file("surface", material).is_some())
            .map(|(_, material)| format!("`{material}`"))
            .collect();
        let wrong = Diagnostic::new(Code::NotExported, instance.span, message);
        return Err(vec![wrong.expected(format!("one of {}", known.join(", ")))]);
    };
    let shader = format!("{}_shader", instance.name);
    let mut written = Written {
        instance,
        pictures,
        nodes: String::new(),
        known: BTreeMap::new(),
        taken: [instance.name.clone(), shader.clone()].into(),
    };
    let known = parameters(model);
    let lacks = |name: &str| {
        let mut lacking = LACKING.iter().filter(|(own, _)| *own == model);
        lacking.any(|(_, names)| names.contains(&name))
    };
    let mut inputs = String::new();
    let mut refused = Vec::new();
    for argument in &instance.arguments {
        let Some(parameter) = known
            .iter()
            .find(|p| p.name == argument.name && !lacks(p.name))
        else {
            let why = format!("the node `{category}` has no input of this name");
            refused.push(argument.refused(model, &why));
            continue;
        };
        let input = written.argument(parameter, &argument.value);
        let ty = parameter.input_type().name();
        inputs.push_str(&input_line(&argument.name, ty, &input));
    }
    if !refused.is_empty() {
        return Err(refused);
    }
    let name = &instance.name;
    let surface = input_line(
        "surfaceshader",
        "surfaceshader",
        &Input::Node(shader.clone()),
    );
    let text = format!(
        "<?xml version=\"1.0\"?>\n<materialx version=\"1.39\" colorspace=\"lin_rec709\">\n{}{}{}</materialx>\n",
        written.nodes,
        node_text(category, &shader, "surfaceshader", &inputs),
        node_text("surfacematerial", name, "material", &surface),
    );
    Ok(Exported {
        text,
        warnings: Vec::new(),
    })
}

/// What an input has.
enum Input {
    Value(String),
    /// The node that it is connected to.
    Node(String),
    /// A picture, and the color space of its texels.
    File(String, Option<&'static str>),
}

/// A document under way.
struct Written<'i> {
    instance: &'i Instance,
    pictures: &'i [String],
    nodes: String,
    /// Names of nodes, by what they are.
    known: BTreeMap<String, String>,
    /// All names that there are.
    taken: BTreeSet<String>,
}

impl Written<'_> {
    fn argument(&mut self, parameter: &Parameter, value: &Value) -> Input {
        let size = match parameter.ty {
            "length" | "angle" => Unit::from_name(parameter.unit()).map_or(1.0, Unit::scale),
            _ => 1.0,
        };
        let ty = parameter.input_type().name();
        match value {
            Value::Bool(b) => Input::Value(b.to_string()),
            Value::Int(i) => Input::Value(i.to_string()),
            Value::Numbers(numbers) => {
                let scaled: Vec<f64> = numbers.iter().map(|x| x / size).collect();
                Input::Value(list(&scaled))
            }
            Value::Varying(varying) => {
                let mut scaled = varying.clone();
                let numbers = scaled.factor.iter_mut().chain(&mut scaled.offset);
                numbers.for_each(|x| *x /= size);
                Input::Node(self.varying(parameter.name, ty, &scaled))
            }
            Value::Normal(normal) => Input::Node(self.normal(parameter.name, normal)),
        }
    }

    /// A node that is given inputs, each with its name and type, and would like to be called `wish`.
    fn node(
        &mut self,
        category: &str,
        ty: &str,
        wish: &str,
        inputs: &[(&str, &str, Input)],
    ) -> String {
        let lines = inputs
            .iter()
            .map(|(name, ty, input)| input_line(name, ty, input));
        let inputs: String = lines.collect();
        let key = format!("{category} {ty}\n{inputs}");
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let mut numbered = (2..).map(|n| format!("{wish}_{n}"));
        let mut name = wish.to_owned();
        while !self.taken.insert(name.clone()) {
            name = numbered.next().unwrap_or_default();
        }
        self.nodes
            .push_str(&node_text(category, &name, ty, &inputs));
        self.known.insert(key, name.clone());
        name
    }

    /// `offset + factor * texel * vertex color`, which the input `name` is connected to.
    fn varying(&mut self, name: &str, ty: &str, varying: &Varying) -> String {
        let mut product = match varying.texel {
            Some(texel) => self.texel(name, ty, texel),
            None => String::new(),
        };
        if varying.has_vertex_color {
            let color = self.node("geomcolor", ty, "vertex_color", &[]);
            product = match product.as_str() {
                "" => color,
                texel => self.combined(
                    "multiply",
                    ty,
                    &format!("{name}_colored"),
                    texel,
                    Input::Node(color),
                ),
            };
        }
        if varying.factor.iter().any(|x| *x != 1.0) {
            let factor = Input::Value(list(&varying.factor));
            product = self.combined("multiply", ty, &format!("{name}_scaled"), &product, factor);
        }
        if !varying.is_product() {
            let offset = Input::Value(list(&varying.offset));
            product = self.combined("add", ty, &format!("{name}_raised"), &product, offset);
        }
        product
    }

    /// Two values of one type.
    fn combined(&mut self, category: &str, ty: &str, wish: &str, a: &str, b: Input) -> String {
        let inputs = [("in1", ty, Input::Node(a.to_owned())), ("in2", ty, b)];
        self.node(category, ty, wish, &inputs)
    }

    /// What a picture has where it is looked up, as a value of a type.
    fn texel(&mut self, name: &str, ty: &str, texel: Texel) -> String {
        let lookup = &self.instance.lookups[texel.lookup];
        let (looked_up, channel) = match texel.channels {
            Channels::Color => (self.image(name, "color3", true, lookup), None),
            Channels::OneOfColor(c) => (
                self.image(name, "color3", true, lookup),
                Some(("color3", c)),
            ),
            Channels::Data => (self.image(name, ty, false, lookup), None),
            Channels::One(0) => (self.image(name, "float", false, lookup), None),
            Channels::One(3) => (
                self.image(name, "vector4", false, lookup),
                Some(("vector4", 3)),
            ),
            Channels::One(c) => (
                self.image(name, "vector3", false, lookup),
                Some(("vector3", c)),
            ),
        };
        let is_float = matches!(texel.channels, Channels::One(_) | Channels::OneOfColor(_));
        let mut value = looked_up;
        if let Some((from, channel)) = channel {
            let inputs = [
                ("in", from, Input::Node(value)),
                ("index", "integer", Input::Value(channel.to_string())),
            ];
            value = self.node("extract", "float", &format!("{name}_channel"), &inputs);
        }
        let own = match texel.channels {
            _ if is_float => "float",
            Channels::Color => "color3",
            _ => ty,
        };
        if own != ty {
            let inputs = [("in", own, Input::Node(value))];
            value = self.node("convert", ty, &format!("{name}_wide"), &inputs);
        }
        value
    }

    /// The node that looks up a picture.
    fn image(&mut self, name: &str, ty: &str, is_color: bool, lookup: &Lookup) -> String {
        let file = self
            .pictures
            .get(lookup.picture)
            .cloned()
            .unwrap_or_default();
        let space = ty.starts_with("color").then(|| {
            if is_color && !holds_floats(&file) {
                "srgb_texture"
            } else {
                "lin_rec709"
            }
        });
        let mut inputs = vec![("file", "filename", Input::File(file, space))];
        let Place {
            set,
            matrix,
            offset,
        } = &lookup.place;
        let [[a, b], [c, d]] = *matrix;
        let is_plain = *set == 0 && *matrix == Place::PLAIN && *offset == [0.0; 2];
        let repeats = lookup.wrap == [0, 0];
        let is_tiled = !is_plain && *set == 0 && repeats && b == 0.0 && c == 0.0;
        if is_tiled {
            inputs.push(("uvtiling", "vector2", Input::Value(list(&[a, d]))));
            if *offset != [0.0; 2] {
                let back = offset.map(|x| -x);
                inputs.push(("uvoffset", "vector2", Input::Value(list(&back))));
            }
        } else if !is_plain {
            let place = self.place(name, &lookup.place);
            inputs.push(("texcoord", "vector2", Input::Node(place)));
        }
        for (input, wrap) in ["uaddressmode", "vaddressmode"]
            .into_iter()
            .zip(lookup.wrap)
        {
            let mode = match WRAPS.get(wrap) {
                Some(&"MIRROR") => "mirror",
                Some(&"CLAMP") => "clamp",
                Some(&"BORDER") => "constant",
                _ => continue,
            };
            inputs.push((input, "string", Input::Value(mode.to_owned())));
        }
        let filter = match FILTERS.get(lookup.filter) {
            Some(&"NEAREST") => Some("closest"),
            Some(&"BICUBIC") => Some("cubic"),
            _ => None,
        };
        let filter = filter.map(|filter| Input::Value(filter.to_owned()));
        inputs.extend(filter.map(|filter| ("filtertype", "string", filter)));
        let category = if is_tiled { "tiledimage" } else { "image" };
        self.node(category, ty, &format!("{name}_image"), &inputs)
    }

    /// Texture coordinates.
    fn place(&mut self, name: &str, place: &Place) -> String {
        let index = Input::Value(place.set.to_string());
        let wish = format!("uv{}", place.set);
        let uv = self.node("texcoord", "vector2", &wish, &[("index", "integer", index)]);
        let [[a, b], [c, d]] = place.matrix;
        let mut at = if b == 0.0 && c == 0.0 {
            match (a, d) {
                (1.0, 1.0) => uv,
                scale => {
                    let scale = Input::Value(list(&[scale.0, scale.1]));
                    self.combined("multiply", "vector2", &format!("{name}_tiled"), &uv, scale)
                }
            }
        } else {
            let rows = place.matrix.map(|row| {
                let inputs = [
                    ("in1", "vector2", Input::Node(uv.clone())),
                    ("in2", "vector2", Input::Value(list(&row))),
                ];
                self.node("dotproduct", "float", &format!("{name}_along"), &inputs)
            });
            let [u, v] = rows.map(Input::Node);
            let inputs = [("in1", "float", u), ("in2", "float", v)];
            self.node("combine2", "vector2", &format!("{name}_turned"), &inputs)
        };
        if place.offset != [0.0; 2] {
            let offset = Input::Value(list(&place.offset));
            at = self.combined("add", "vector2", &format!("{name}_moved"), &at, offset);
        }
        at
    }

    fn normal(&mut self, name: &str, normal: &NormalMap) -> String {
        let mut map = normal.map.clone();
        if normal.flip_green {
            map.factor[1] = -map.factor[1];
            map.offset[1] = 1.0 - map.offset[1];
        }
        let texel = self.varying(name, "vector3", &map);
        let mut inputs = vec![("in", "vector3", Input::Node(texel))];
        if normal.scale != 1.0 {
            inputs.push(("scale", "float", Input::Value(list(&[normal.scale]))));
        }
        self.node("normalmap", "vector3", &format!("{name}_bent"), &inputs)
    }
}

/// Are the texels of a file floats, which are linear whoever reads them?
fn holds_floats(file: &str) -> bool {
    let extension = file.rsplit_once('.').map_or("", |(_, extension)| extension);
    ["exr", "hdr"]
        .iter()
        .any(|own| extension.eq_ignore_ascii_case(own))
}

fn node_text(category: &str, name: &str, ty: &str, inputs: &str) -> String {
    if inputs.is_empty() {
        return format!("  <{category} name=\"{name}\" type=\"{ty}\" />\n");
    }
    format!("  <{category} name=\"{name}\" type=\"{ty}\">\n{inputs}  </{category}>\n")
}

fn input_line(name: &str, ty: &str, input: &Input) -> String {
    let mut line = format!("    <input name=\"{name}\" type=\"{ty}\"");
    // Writing to a string cannot fail.
    let _ = match input {
        Input::Value(value) => write!(line, " value=\"{}\"", escaped(value)),
        Input::Node(node) => write!(line, " nodename=\"{node}\""),
        Input::File(path, None) => write!(line, " value=\"{}\"", escaped(path)),
        Input::File(path, Some(space)) => {
            write!(line, " value=\"{}\" colorspace=\"{space}\"", escaped(path))
        }
    };
    line.push_str(" />\n");
    line
}

/// Numbers as documents have them, as short as single precision allows.
fn list(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers
        .iter()
        .map(|x| format!("{}", *x as f32 + 0.0))
        .collect();
    texts.join(", ")
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            // What XML cannot hold is no part of a path that can be read.
            c if c.is_control() => {}
            c => out.push(c),
        }
    }
    out
}
