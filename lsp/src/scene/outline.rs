//! What a scene file says, as far as it can be read: its tables, what it binds, and the files that it names, each with its
//! place.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A scene file.
#[derive(Clone, Debug, Default)]
pub struct SceneOutline {
    /// What is no TOML: places and messages.
    pub errors: Vec<(Range<usize>, String)>,
    /// Its tables, in the order of the file.
    pub tables: Vec<TableAt>,
    /// What it binds.
    pub bindings: Vec<BindingAt>,
    /// Files that it names, other than those of materials.
    pub files: Vec<At<String>>,
    /// Names of materials that geometry asks for.
    pub asked: Vec<At<String>>,
}

/// A value with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct At<T> {
    /// The value.
    pub value: T,
    /// Its bytes; of a string without the quotes.
    pub place: Range<usize>,
}

/// A table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableAt {
    /// Its name, as `camera` or `materials.brass`.
    pub name: String,
    /// The bytes of its header.
    pub place: Range<usize>,
}

/// A binding of a material.
#[derive(Clone, Debug)]
pub struct BindingAt {
    /// Its name.
    pub name: At<String>,
    /// The file of the material.
    pub file: Option<At<String>>,
    /// Which material of the file.
    pub material: Option<At<String>>,
    /// Values of parameters.
    pub params: Vec<ParamAt>,
}

/// A value of a parameter.
#[derive(Clone, Debug)]
pub struct ParamAt {
    /// The parameter.
    pub name: At<String>,
    /// The bytes of the value.
    pub value: Range<usize>,
    /// Its numbers, if it is a list of them.
    pub numbers: Option<Vec<f32>>,
}

/// Reads a scene file.
pub fn outline(text: &str) -> SceneOutline {
    let (document, errors) = DeTable::parse_recoverable(text);
    let mut outline = SceneOutline {
        errors: errors
            .iter()
            .map(|e| (e.span().unwrap_or(0..0), e.message().to_owned()))
            .collect(),
        tables: tables(text),
        ..SceneOutline::default()
    };
    let root = document.get_ref();
    let section = |name: &str| root.get(name).map(Spanned::get_ref);
    if let Some(DeValue::Table(materials)) = section("materials") {
        outline.bindings = materials
            .iter()
            .map(|(name, value)| binding(text, name, value))
            .collect();
        outline.bindings.sort_by_key(|b| b.name.place.start);
    }
    for list in ["geometry", "lights"] {
        if let Some(DeValue::Array(entries)) = section(list) {
            for entry in entries.iter() {
                if let DeValue::Table(table) = entry.get_ref() {
                    outline.entry(text, table);
                }
            }
        }
    }
    if let Some(DeValue::Table(environment)) = section("environment") {
        outline.files.extend(string(text, environment, "file"));
    }
    outline
}

impl SceneOutline {
    /// What an entry of geometry names.
    fn entry(&mut self, text: &str, table: &DeTable<'_>) {
        for key in ["file", "obj", "gltf", "uv1", "placements"] {
            self.files.extend(string(text, table, key));
        }
        self.asked.extend(string(text, table, "material"));
        let placements = table.get("placements").map(Spanned::get_ref);
        if let Some(DeValue::Array(placements)) = placements {
            for placement in placements.iter() {
                if let DeValue::Table(placement) = placement.get_ref() {
                    self.asked.extend(string(text, placement, "material"));
                }
            }
        }
    }
}

fn binding(
    text: &str,
    name: &Spanned<std::borrow::Cow<'_, str>>,
    value: &Spanned<DeValue<'_>>,
) -> BindingAt {
    let mut binding = BindingAt {
        name: At {
            value: name.get_ref().to_string(),
            place: unquoted(text, name.span()),
        },
        file: None,
        material: None,
        params: Vec::new(),
    };
    let DeValue::Table(table) = value.get_ref() else {
        return binding;
    };
    binding.file = string(text, table, "file");
    binding.material = string(text, table, "material");
    for key in ["params", "keys"] {
        let Some(DeValue::Table(params)) = table.get(key).map(Spanned::get_ref) else {
            continue;
        };
        binding
            .params
            .extend(params.iter().map(|(name, value)| ParamAt {
                name: At {
                    value: name.get_ref().to_string(),
                    place: unquoted(text, name.span()),
                },
                value: value.span(),
                numbers: numbers(value.get_ref()),
            }));
    }
    binding.params.sort_by_key(|p| p.name.place.start);
    binding
}

fn numbers(value: &DeValue<'_>) -> Option<Vec<f32>> {
    let number = |item: &Spanned<DeValue<'_>>| match item.get_ref() {
        DeValue::Integer(i) => i.as_str().parse().ok(),
        DeValue::Float(f) => f.as_str().parse().ok(),
        _ => None,
    };
    value.as_array()?.iter().map(number).collect()
}

fn string(text: &str, table: &DeTable<'_>, key: &str) -> Option<At<String>> {
    let value = table.get(key)?;
    let DeValue::String(written) = value.get_ref() else {
        return None;
    };
    Some(At {
        value: written.to_string(),
        place: unquoted(text, value.span()),
    })
}

/// The inside of a string's place.
fn unquoted(text: &str, place: Range<usize>) -> Range<usize> {
    let written = text.get(place.clone()).unwrap_or_default();
    let is_quoted = written.len() > 1 && written.starts_with(['"', '\'']);
    if is_quoted {
        place.start + 1..place.end - 1
    } else {
        place
    }
}

fn tables(text: &str) -> Vec<TableAt> {
    let (mut found, mut at) = (Vec::new(), 0);
    for line in text.split_inclusive('\n') {
        let header = line.trim();
        let is_header = header.starts_with('[')
            && header
                .split('#')
                .next()
                .is_some_and(|h| h.trim_end().ends_with(']'))
            && !header.contains('=')
            && !header.contains(',');
        if is_header {
            let names = super::cursor::names(header);
            let start = at + line.len() - line.trim_start().len();
            found.push(TableAt {
                name: names.join("."),
                place: start..at + line.trim_end().len(),
            });
        }
        at += line.len();
    }
    found
}
