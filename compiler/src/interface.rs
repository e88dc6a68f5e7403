//! What user interfaces are told of the materials of a file: names, documentation, and parameters
//! with types, defaults and ranges. `docs/params.md` describes the JSON that this becomes.

use serde::Serialize;

use crate::ast::{self, Expr, ExprKind, ItemKind, Unit};
use crate::diag;
use crate::diag::Diagnostic;
use crate::ir::Const;
use crate::loader::Loader;
use crate::sema::{Checker, Declared, Metadata, Origin};
use crate::source::SourceMap;

/// The version of the format: it grows when a field changes its meaning or goes.
pub const VERSION: u32 = 1;

/// What reading a file gave.
pub struct Interface {
    /// The texts that diagnostics point into.
    pub sources: SourceMap,
    /// Everything that was found; there are no materials where one is an error.
    pub diagnostics: Vec<Diagnostic>,
    /// The materials of the file that are not private, in their order.
    pub materials: Vec<MaterialInterface>,
}

/// What a user interface is told of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialInterface {
    /// Its name.
    pub name: String,
    /// Its documentation, lines joined by line breaks.
    pub docs: String,
    /// Its parameters in the order in which they are declared.
    pub params: Vec<ParamInterface>,
}

/// What a user interface is told of a parameter. Lengths are in metres, angles in radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParamInterface {
    /// Its name.
    pub name: String,
    /// Its type in the language, such as `color`.
    #[serde(rename = "type")]
    pub ty: String,
    /// Its name for people.
    pub label: String,
    /// What it stands together with.
    pub group: Option<String>,
    /// Its documentation, lines joined by line breaks.
    pub docs: String,
    /// Can a scene set it? Others only callers give; their default is an input.
    pub settable: bool,
    /// The default: a bool, an int, a number, components, or a text (the path of a texture, the
    /// name of an input).
    pub default: Value,
    /// The default as it is written.
    pub default_text: String,
    /// Least and greatest value that is allowed.
    pub hard: Option<[f32; 2]>,
    /// Least and greatest value of a slider.
    pub soft: Option<[f32; 2]>,
    /// What its values are shown in.
    pub unit: Option<UnitInterface>,
}

/// A unit of length or angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UnitInterface {
    /// Its name, such as `mm`.
    pub name: &'static str,
    /// How many metres or radians it is.
    pub size: f64,
}

/// A value of any type.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum Value {
    Bool(bool),
    Int(i32),
    Number(f32),
    Components(Vec<f32>),
    Text(String),
}

impl Value {
    /// A constant; a texture is not.
    pub fn of(value: &Const) -> Self {
        match value {
            Const::Bool(b) => Self::Bool(*b),
            Const::Int(i) => Self::Int(*i),
            Const::Float(v) => match v.as_slice() {
                [x] => Self::Number(*x as f32),
                all => Self::Components(all.iter().map(|&x| x as f32).collect()),
            },
        }
    }
}

/// Reads the materials of the file at `path`. Of what they compute, nothing is checked.
pub fn interface(path: &str, loader: &mut dyn Loader) -> Interface {
    let mut checker = Checker::new(loader);
    let mut materials = Vec::new();
    if let Some(module) = checker.load(path) {
        let ast = checker.ast(module);
        for (index, item) in ast.items.iter().enumerate() {
            let ItemKind::Material(material) = &item.kind else {
                continue;
            };
            if let Some(declared) = checker.declared(module, index).filter(|_| !item.private) {
                materials.push(described(&checker.sources, item, material, &declared));
            }
        }
    }
    let Checker {
        sources,
        diagnostics,
        ..
    } = checker;
    if diag::has_errors(&diagnostics) {
        materials.clear();
    }
    Interface {
        sources,
        diagnostics,
        materials,
    }
}

fn described(
    sources: &SourceMap,
    item: &ast::Item,
    material: &ast::Material,
    declared: &[Option<Declared>],
) -> MaterialInterface {
    let params = material.params.iter().zip(declared);
    let params = params.filter_map(|(p, d)| Some(param(sources, p, d.as_ref()?)));
    MaterialInterface {
        name: item.name.node.clone(),
        docs: prose(&item.docs),
        params: params.collect(),
    }
}

fn param(sources: &SourceMap, p: &ast::MaterialParam, declared: &Declared) -> ParamInterface {
    let written = &sources.file(p.default.span.file).text;
    let Metadata {
        label,
        group,
        soft,
        unit,
    } = &declared.metadata;
    let (settable, default, hard) = match &declared.origin {
        Origin::Settable(param) => (true, value(&param.default, &p.default), param.range),
        Origin::Input(input) => (false, Value::Text(input.clone()), None),
    };
    ParamInterface {
        name: p.name.node.clone(),
        ty: p.ty.node.clone(),
        label: label.clone().unwrap_or_else(|| readable(&p.name.node)),
        group: group.clone(),
        docs: prose(&p.docs),
        settable,
        default,
        default_text: written.get(p.default.span.range()).unwrap_or("").to_owned(),
        hard: hard.map(limits),
        soft: soft.map(|(range, _)| limits(range)),
        unit: unit.or_else(|| written_unit(p)).map(|unit| UnitInterface {
            name: unit.name(),
            size: unit.scale(),
        }),
    }
}

/// Parameters are single precision when a material is evaluated.
fn limits((low, high): (f64, f64)) -> [f32; 2] {
    [low as f32, high as f32]
}

fn value(value: &Const, written: &Expr) -> Value {
    match &written.kind {
        ExprKind::Str(path) => Value::Text(path.clone()),
        _ => Value::of(value),
    }
}

/// The unit that lengths and angles are shown in unless metadata says so: the one that the default
/// is written in, or else the one that values are in.
fn written_unit(p: &ast::MaterialParam) -> Option<Unit> {
    match (&p.default.kind, p.ty.node.as_str()) {
        (ExprKind::Quantity(_, unit), "length" | "angle") => Some(unit.node),
        (_, "length") => Some(Unit::Metre),
        (_, "angle") => Some(Unit::Radian),
        _ => None,
    }
}

/// A name for people: `coat_ior` is `Coat IOR`.
fn readable(name: &str) -> String {
    let mut label = String::new();
    for word in name.split('_').filter(|w| !w.is_empty()) {
        let mut letters = word.chars();
        match (word, letters.next()) {
            ("ior" | "uv" | "id", _) => label.push_str(&word.to_uppercase()),
            (_, Some(first)) if label.is_empty() => {
                label.extend(first.to_uppercase());
                label.push_str(letters.as_str());
            }
            _ => label.push_str(word),
        }
        label.push(' ');
    }
    match label.trim_end() {
        "" => name.to_owned(),
        label => label.to_owned(),
    }
}

/// What a line of a doc comment begins with that tells tests of the library what to try, and to
/// what a definition is held.
const FOR_TESTS: [&str; 14] = [
    "Albedo",
    "Cost",
    "Furnace",
    "Gain",
    "Gallery",
    "Lines",
    "Precision",
    "Range",
    "Reciprocal",
    "Region",
    "Registers",
    "Try",
    "Value",
    "Weights",
];

/// A doc comment as a person reads it: without what is for tests, which goes on to the next empty line
/// or the next word of the kind.
pub fn prose(lines: &[String]) -> String {
    let mut shown: Vec<&str> = Vec::new();
    let mut hidden = false;
    for line in lines {
        let word = line.split_once(':').map_or("", |(word, _)| word);
        hidden = !line.is_empty() && (FOR_TESTS.contains(&word) || hidden && word != "Source");
        if !hidden {
            shown.push(line);
        }
    }
    shown.join("\n").trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::prose;

    #[test]
    fn what_is_for_tests_is_not_shown() {
        let lines =
            "A metal.\n\nBoth sides: alike.\n\nTry: roughness = 0 |\n    1\nRange: ior = 1 .. 2\n\
             Source: Walter 2007,\nHeitz 2014.\n\nTry: ior = 3"
                .lines()
                .map(str::to_owned);
        let lines: Vec<String> = lines.collect();
        let expected = "A metal.\n\nBoth sides: alike.\n\nSource: Walter 2007,\nHeitz 2014.";
        assert_eq!(prose(&lines), expected);
    }
}
