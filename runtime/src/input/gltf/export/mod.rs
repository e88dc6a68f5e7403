//! Instances of `std::surface::gltf_pbr` as glTF files that hold a material and no geometry, by the table that materials are
//! read by.

use std::collections::BTreeSet;

use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::instance::{Argument, Channels, Exported, Instance, Value, Varying};
use serde_json::{Map, Value as Json, json};

use super::rows::{Channel, FILM, Kind, Of, ROWS, Row};

mod lookups;
#[cfg(test)]
mod tests;

use lookups::{picture_type, sampler, transform, uri};

/// The model that glTF has.
const MODEL: &str = "gltf_pbr";

const TRANSFORM: &str = "KHR_texture_transform";

/// The picture that alpha is in, too.
const BASE_MAP: &str = "baseColorTexture";

/// An instance as a glTF file; `pictures` says what its pictures are called there.
///
/// # Errors
/// What glTF cannot say, all of it.
pub fn to_gltf(instance: &Instance, pictures: &[String]) -> Result<Exported, Vec<Diagnostic>> {
    let model = &instance.model;
    if model != MODEL {
        let message = format!("`{model}` is no model of glTF");
        let wrong = Diagnostic::new(Code::NotExported, instance.span, message)
            .expected("an instance of `std::surface::gltf_pbr`")
            .hint("write the material with `gltf_pbr`, or export it `--to materialx`");
        return Err(vec![wrong]);
    }
    let mut written = Written {
        instance,
        pictures,
        material: json!({ "name": instance.name }),
        textures: Vec::new(),
        samplers: Vec::new(),
        images: Vec::new(),
        extensions: BTreeSet::new(),
        refused: Vec::new(),
        warnings: Vec::new(),
    };
    written.arguments();
    written.finished()
}

/// A file under way.
struct Written<'i> {
    instance: &'i Instance,
    pictures: &'i [String],
    material: Json,
    textures: Vec<Json>,
    samplers: Vec<Json>,
    /// Numbers of pictures of the instance.
    images: Vec<usize>,
    extensions: BTreeSet<&'static str>,
    refused: Vec<Diagnostic>,
    warnings: Vec<String>,
}

impl<'i> Written<'i> {
    fn arguments(&mut self) {
        for argument in &self.instance.arguments {
            let row = ROWS.iter().find(|row| row.name == argument.name);
            match (row, argument.name.as_str()) {
                (Some(row), _) => self.row(row, argument),
                (None, "iridescence_thickness") => {}
                (None, "alpha" | "alpha_mode" | "alpha_cutoff") => {}
                (None, "occlusion") => {
                    let left_out = "`occlusion` changes nothing in Impasto, and is left out";
                    self.warnings.push(left_out.into());
                }
                _ => self.refuse(argument, "glTF has no such property"),
            }
        }
        self.film();
        let share = self.alpha();
        self.fourth(share.unwrap_or(1.0));
        self.shared_pictures();
    }

    fn finished(self) -> Result<Exported, Vec<Diagnostic>> {
        if !self.refused.is_empty() {
            return Err(self.refused);
        }
        let mut file = json!({
            "asset": { "version": "2.0", "generator": "Impasto" },
            "materials": [self.material],
        });
        let image = |picture: &usize| json!({ "uri": uri(&self.pictures[*picture]) });
        let lists = [
            ("textures", self.textures),
            ("samplers", self.samplers),
            ("images", self.images.iter().map(image).collect()),
            (
                "extensionsUsed",
                self.extensions.iter().map(|e| json!(e)).collect(),
            ),
        ];
        for (name, list) in lists {
            if !list.is_empty() {
                file[name] = Json::Array(list);
            }
        }
        Ok(Exported {
            text: format!("{file:#}\n"),
            warnings: self.warnings,
        })
    }

    fn refuse(&mut self, argument: &Argument, why: &str) {
        self.refused.push(argument.refused(MODEL, why));
    }

    /// The object of the material that has a property.
    fn object(&mut self, of: Of) -> &mut Json {
        let own = match of {
            Of::Material => &mut self.material,
            Of::Base => &mut self.material["pbrMetallicRoughness"],
            Of::Extension(name) => {
                self.extensions.insert(name);
                &mut self.material["extensions"][name]
            }
        };
        if own.is_null() {
            *own = Json::Object(Map::new());
        }
        own
    }

    /// A parameter that is a property.
    fn row(&mut self, row: &Row, argument: &Argument) {
        match &argument.value {
            Value::Numbers(numbers) if row.map.is_none_or(|(_, c)| c != Channel::Normal) => {
                self.factor(row, argument, numbers);
            }
            Value::Varying(varying) => self.picture(row, argument, varying),
            Value::Normal(normal) => match row.map {
                Some((key, Channel::Normal)) if normal.map.is_plain() && !normal.flip_green => {
                    let Some(mut info) = self.texture(argument, &normal.map) else {
                        return;
                    };
                    if normal.scale != 1.0 {
                        info["scale"] = short(normal.scale);
                    }
                    self.object(row.of)[key] = info;
                }
                _ => self.refuse(
                    argument,
                    "glTF has normal maps as they are, with a scale; their green points up",
                ),
            },
            _ => self.refuse(argument, "glTF has a picture there, or nothing"),
        }
    }

    fn factor(&mut self, row: &Row, argument: &Argument, factor: &[f64]) {
        let most = match row.kind {
            Kind::Color | Kind::Share => 1.0,
            _ => f64::INFINITY,
        };
        if factor.iter().any(|x| !(0.0..=most).contains(x)) {
            let why = if most == 1.0 {
                "glTF has numbers from 0 to 1 there"
            } else {
                "glTF has numbers of 0 or more there"
            };
            let mut wrong = argument.refused(MODEL, why);
            if row.name == "emissive" {
                wrong = wrong.hint("put how bright it is into `emissive_strength`");
            }
            self.refused.push(wrong);
            return;
        }
        if factor != row.default {
            self.object(row.of)[row.factor] = numbers(factor);
        }
    }

    fn picture(&mut self, row: &Row, argument: &Argument, varying: &Varying) {
        let Some((key, channel)) = row.map.filter(|(_, c)| *c != Channel::Normal) else {
            return self.refuse(argument, "glTF has no picture there");
        };
        if varying.has_vertex_color {
            if row.name != "base_color" {
                return self.refuse(
                    argument,
                    "glTF multiplies the base color alone by that of corners",
                );
            }
            let note = "renderers multiply the base color by `COLOR_0` where a mesh has it";
            self.warnings.push(note.into());
        }
        if !varying.is_product() {
            return self.refuse(
                argument,
                "glTF multiplies pictures, and adds nothing to them",
            );
        }
        if let Some(texel) = varying.texel {
            if texel.channels != channels(channel) {
                let why = format!("glTF has it in {} of `{key}`", named(channel));
                return self.refuse(argument, &why);
            }
            let Some(info) = self.texture(argument, varying) else {
                return;
            };
            self.object(row.of)[key] = info;
        }
        self.factor(row, argument, &varying.factor);
        if row.name == "anisotropy_strength" {
            let note = "renderers take directions from red and green of `anisotropyTexture`, which Impasto does not read";
            self.warnings.push(note.into());
        }
    }

    /// What names the picture of an argument; nothing if glTF has no such lookup.
    fn texture(&mut self, argument: &Argument, varying: &Varying) -> Option<Json> {
        let lookup = &self.instance.lookups[varying.texel?.lookup];
        let file = self.pictures.get(lookup.picture)?;
        if picture_type(file).is_none() || file.contains("<UDIM>") || file.contains("<UVTILE>") {
            let why = format!("glTF has single pictures that are PNG or JPEG, and `{file}` is not");
            self.refuse(argument, &why);
            return None;
        }
        let (Some(sampler), Some(transform)) = (sampler(lookup), transform(&lookup.place)) else {
            let why = if sampler(lookup).is_none() {
                "glTF has neither BORDER nor BICUBIC"
            } else {
                "glTF moves, turns and scales pictures, and does not shear them"
            };
            self.refuse(argument, why);
            return None;
        };
        let source = position(&mut self.images, lookup.picture);
        let mut texture = json!({ "source": source });
        if let Some(sampler) = sampler {
            texture["sampler"] = json!(position(&mut self.samplers, sampler));
        }
        let mut info = json!({ "index": position(&mut self.textures, texture) });
        if lookup.place.set != 0 {
            info["texCoord"] = json!(lookup.place.set);
        }
        if let Some(transform) = transform {
            info["extensions"] = json!({ TRANSFORM: transform });
            self.extensions.insert(TRANSFORM);
        }
        Some(info)
    }

    /// The thickness of a film, which glTF always says where there is one: its default is another.
    fn film(&mut self) {
        const NM: f64 = 1e-9;
        /// The default of `gltf_pbr`.
        const DEFAULT: f64 = 100.0;
        let argument = self.instance.argument("iridescence_thickness");
        let Of::Extension(name) = FILM else { return };
        match argument.map(|argument| (argument, &argument.value)) {
            Some((_, Value::Numbers(thickness))) => {
                self.object(FILM)["iridescenceThicknessMaximum"] = short(thickness[0] / NM);
            }
            Some((argument, Value::Varying(varying))) => {
                let (least, range) = (varying.offset[0] / NM, varying.factor[0] / NM);
                let channel = varying.texel.map(|texel| texel.channels);
                if channel != Some(Channels::One(1)) || least < 0.0 || least + range < 0.0 {
                    return self.refuse(
                        argument,
                        "glTF has it in green of `iridescenceThicknessTexture`",
                    );
                }
                let Some(info) = self.texture(argument, varying) else {
                    return;
                };
                let film = self.object(FILM);
                film["iridescenceThicknessMinimum"] = short(least);
                film["iridescenceThicknessMaximum"] = short(least + range);
                film["iridescenceThicknessTexture"] = info;
            }
            Some((argument, _)) => self.refuse(argument, "glTF has a number or a picture there"),
            None if self.extensions.contains(name) => {
                self.object(FILM)["iridescenceThicknessMaximum"] = short(DEFAULT);
            }
            None => {}
        }
    }

    /// How much of the surface is there, times the alpha of the base color's picture; nothing where all is.
    fn alpha(&mut self) -> Option<f64> {
        let instance = self.instance;
        let value = |name: &str| instance.argument(name).map(|argument| &argument.value);
        let mode = match value("alpha_mode")? {
            Value::Int(1) => "MASK",
            Value::Int(2) => "BLEND",
            Value::Int(_) => return None,
            _ => {
                self.refuse_named("alpha_mode", "glTF has one for all of the surface");
                return None;
            }
        };
        self.material["alphaMode"] = json!(mode);
        match value("alpha_cutoff") {
            Some(Value::Numbers(cutoff)) if mode == "MASK" => {
                self.material["alphaCutoff"] = short(cutoff[0]);
            }
            Some(Value::Varying(_)) if mode == "MASK" => {
                self.refuse_named("alpha_cutoff", "glTF has no picture there");
            }
            _ => {}
        }
        let base = instance.argument("base_color");
        let (base_lookup, is_black) = match value("base_color") {
            Some(Value::Varying(varying)) => (varying.texel.map(|texel| texel.lookup), false),
            Some(Value::Numbers(numbers)) => (None, numbers.iter().all(|x| *x == 0.0)),
            _ => (None, false),
        };
        let argument = instance.argument("alpha");
        match argument.map(|argument| (argument, &argument.value)) {
            Some((argument, Value::Varying(varying))) => {
                let lookup = varying.texel.map(|texel| texel.lookup);
                let is_alpha = varying
                    .texel
                    .is_some_and(|t| t.channels == Channels::One(3));
                if !is_alpha || !varying.is_product() || !(lookup == base_lookup || is_black) {
                    let why = "glTF has it in alpha of the base color's picture, times a number";
                    self.refuse(argument, why);
                    return None;
                }
                // Nothing times its color is nothing.
                if is_black && let Some(info) = self.texture(argument, varying) {
                    self.object(Of::Base)[BASE_MAP] = info;
                }
                Some(varying.factor[0])
            }
            found => {
                if let (Some(base), Some(lookup)) = (argument.or(base), base_lookup) {
                    self.opaque(base, lookup);
                }
                match found {
                    Some((_, Value::Numbers(share))) => Some(share[0]),
                    _ => None,
                }
            }
        }
    }

    /// Adds alpha to the base color.
    fn fourth(&mut self, share: f64) {
        let factor = &self.material["pbrMetallicRoughness"]["baseColorFactor"];
        let is_given = factor.is_array();
        if !is_given && share == 1.0 {
            return;
        }
        let factor = &mut self.object(Of::Base)["baseColorFactor"];
        if !is_given {
            *factor = json!([1.0, 1.0, 1.0]);
        }
        if let Json::Array(numbers) = factor {
            numbers.push(short(share));
        }
    }

    /// Says that alpha would be that of a picture, where it can have one.
    fn opaque(&mut self, argument: &Argument, lookup: usize) {
        let picture = self.instance.lookups[lookup].picture;
        let file = self.pictures.get(picture).map_or("", String::as_str);
        if picture_type(file) == Some("jpeg") {
            return;
        }
        let why = "in glTF the alpha of the base color's picture counts, too";
        let wrong = argument.refused(MODEL, why);
        self.refused.push(
            wrong.hint(
                "multiply `alpha` by `image_alpha` of that picture, or make the picture a JPEG",
            ),
        );
    }

    fn refuse_named(&mut self, name: &str, why: &str) {
        if let Some(argument) = self.instance.argument(name) {
            self.refuse(argument, why);
        }
    }

    /// A picture that several properties have channels of is one, and multiplies all of them.
    fn shared_pictures(&mut self) {
        for row in ROWS {
            let Some((key, channel)) = row.map.filter(|(_, c)| *c != Channel::Normal) else {
                continue;
            };
            let Some((argument, lookup)) = self.looked_up(row) else {
                continue;
            };
            let others = ROWS.iter().filter(|other| {
                let is_same = other.map.is_some_and(|(own, _)| own == key) && other.of == row.of;
                is_same && other.name != row.name
            });
            for other in others {
                let is_fine = match self.looked_up(other) {
                    Some((_, own)) => own == lookup,
                    // Nothing times a picture is nothing.
                    None => self.constant(other).iter().all(|x| *x == 0.0),
                };
                if is_fine {
                    continue;
                }
                let (name, own) = (other.name, other.map.map_or(channel, |(_, own)| own));
                let why = format!("in glTF the picture `{key}` multiplies `{name}`, too");
                let hint = format!(
                    "give `{name}` {} of the same picture, at the same place, or 0",
                    named(own)
                );
                let wrong = argument.refused(MODEL, &why);
                self.refused.push(wrong.hint(hint));
            }
        }
    }

    /// The argument for a row and the lookup in it, if it has one.
    fn looked_up(&self, row: &Row) -> Option<(&'i Argument, usize)> {
        let argument = self.instance.argument(row.name)?;
        match &argument.value {
            Value::Varying(varying) => Some((argument, varying.texel?.lookup)),
            _ => None,
        }
    }

    /// The numbers that a row has without a picture.
    fn constant(&self, row: &Row) -> Vec<f64> {
        match self.instance.argument(row.name).map(|a| &a.value) {
            Some(Value::Numbers(numbers)) => numbers.clone(),
            _ => row.default.to_vec(),
        }
    }
}

/// What of a picture is meant by a channel.
fn channels(channel: Channel) -> Channels {
    match channel {
        Channel::Color => Channels::Color,
        Channel::Red => Channels::One(0),
        Channel::Green => Channels::One(1),
        Channel::Blue => Channels::One(2),
        Channel::Alpha => Channels::One(3),
        Channel::Normal => Channels::Data,
    }
}

fn named(channel: Channel) -> &'static str {
    match channel {
        Channel::Color => "the color",
        Channel::Red => "red",
        Channel::Green => "green",
        Channel::Blue => "blue",
        Channel::Alpha => "alpha",
        Channel::Normal => "normals",
    }
}

/// A number, or an array of several.
fn numbers(numbers: &[f64]) -> Json {
    match numbers {
        [number] => short(*number),
        all => all.iter().copied().map(short).collect(),
    }
}

/// A number as short as single precision allows.
fn short(number: f64) -> Json {
    let text = format!("{}", number as f32 + 0.0);
    json!(text.parse::<f64>().unwrap_or(number))
}

/// The place of an entry in a list, which is added if it is new.
fn position<T: PartialEq>(list: &mut Vec<T>, entry: T) -> usize {
    let found = list.iter().position(|own| *own == entry);
    found.unwrap_or_else(|| {
        list.push(entry);
        list.len() - 1
    })
}
