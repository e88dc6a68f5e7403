//! The table of nodes: a row for each category that has a counterpart.
//!
//! A row declares inputs with types and defaults, and what becomes of the node: a template, or code where a template does
//! not do. Dispatch, checks of inputs and docs/materialx.md follow from it.

mod channels;
mod choices;
mod closures;
mod color;
mod compositing;
mod geometry;
mod images;
mod lama;
mod maths;
pub(crate) mod matrices;
mod missing;
mod noise;
mod patterns;
pub(in crate::mtlx) mod surfaces;

use std::collections::HashMap;
use std::sync::OnceLock;

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::types::Type;
use crate::mtlx::value::Value;

pub use missing::{MISSING, Missing};

/// One category of nodes.
#[derive(Clone, Copy)]
pub struct NodeRow {
    /// The category: `multiply`.
    pub category: &'static str,
    /// What kind of node it is, for the page that lists them.
    pub group: &'static str,
    /// Its inputs, with blanks between them: `NAME:KIND=DEFAULT`. A kind is the name of a type; `same` for the type of
    /// the node; `scalar` for that or a float; or `any`. A default is a value without blanks, one number for all
    /// components, or `@` and a property of the geometry. `->TYPE` stands for the type that the node must have.
    pub inputs: &'static str,
    /// What it becomes, and what differs, for the page that lists them; nothing where the template says it all.
    pub note: &'static str,
    pub(crate) make: Make,
}

/// What becomes of a node.
#[derive(Clone, Copy)]
pub(crate) enum Make {
    /// A template: `{in}` is the input `in`, `{~in}` the same where a point or direction may stand as such. `@a::b` is
    /// a definition of the library, `#name` one of the helpers, `$T` the type of the node.
    Text(&'static str),
    /// A template for each of these types of the node, or of its first input.
    Each(&'static [(&'static [Type], &'static str)]),
    /// Code, which gives the outputs by name.
    Code(fn(&mut Call<'_, '_, '_>) -> Result<Made, ImportError>),
}

/// The outputs of a node by name; the first where an input names none.
pub(crate) type Made = Vec<(&'static str, Value)>;

/// A single output.
pub(crate) fn one(value: Value) -> Result<Made, ImportError> {
    Ok(vec![("out", value)])
}

pub(crate) const fn row(
    category: &'static str,
    inputs: &'static str,
    make: Make,
    note: &'static str,
) -> NodeRow {
    NodeRow {
        category,
        group: "",
        inputs,
        note,
        make,
    }
}

/// Tables and the group of their rows, in the order of the page.
const TABLES: &[(&str, &[NodeRow])] = &[
    ("Surfaces", surfaces::ROWS),
    ("Closures", closures::ROWS),
    ("Lama", lama::ROWS),
    ("Images", images::ROWS),
    ("Noise", noise::ROWS),
    ("Patterns", patterns::ROWS),
    ("Geometry", geometry::ROWS),
    ("Mathematics", maths::ROWS),
    ("Choices", choices::ROWS),
    ("Channels", channels::ROWS),
    ("Color", color::ROWS),
    ("Compositing", compositing::ROWS),
];

/// All rows, by group and in the order of the table.
pub fn node_rows() -> impl Iterator<Item = NodeRow> {
    TABLES
        .iter()
        .flat_map(|(group, rows)| rows.iter().map(|row| NodeRow { group, ..*row }))
}

/// The row of a category.
pub(crate) fn find(category: &str) -> Option<&'static NodeRow> {
    static ROWS: OnceLock<HashMap<&'static str, NodeRow>> = OnceLock::new();
    let rows = ROWS.get_or_init(|| node_rows().map(|row| (row.category, row)).collect());
    rows.get(category)
}

/// One input of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct InputRow {
    pub name: &'static str,
    pub kind: Kind,
    /// The default as it is written in the table; nothing if the input has none.
    pub default: Option<&'static str>,
}

/// Which types an input takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// That of the node.
    Same,
    /// That of the node, or a float for all components.
    Scalar,
    /// Any.
    Any,
    /// This one.
    Of(Type),
}

impl NodeRow {
    /// The inputs.
    pub(crate) fn input_rows(&self) -> impl Iterator<Item = InputRow> {
        let inputs = self.inputs.split_whitespace();
        inputs.filter(|text| !text.starts_with("->")).map(|text| {
            let (name, rest) = text.split_once(':').unwrap_or((text, "any"));
            let (kind, default) = match rest.split_once('=') {
                Some((kind, default)) => (kind, Some(default)),
                None => (rest, None),
            };
            let kind = match kind {
                "same" => Kind::Same,
                "scalar" => Kind::Scalar,
                kind => Type::of(kind).map_or(Kind::Any, Kind::Of),
            };
            InputRow {
                name,
                kind,
                default,
            }
        })
    }

    /// The type that the node must have, if there is one alone.
    pub(crate) fn result(&self) -> Option<Type> {
        let mut tokens = self.inputs.split_whitespace();
        tokens.find_map(|token| token.strip_prefix("->").and_then(Type::of))
    }

    /// May the node be of this type? Closures and shaders are for few.
    pub(crate) fn takes(&self, ty: Type) -> bool {
        let is_value =
            !ty.impasto().is_empty() && !matches!(ty, Type::Bsdf | Type::Edf | Type::Vdf);
        let is_known = matches!(ty, Type::Matrix44 | Type::Several | Type::Text);
        let is_combined = matches!(
            self.category,
            "add" | "multiply" | "mix" | "dot" | "convert"
        );
        let is_closure = matches!(self.group, "Surfaces" | "Closures" | "Lama");
        match self.result() {
            Some(result) => ty == result,
            None => is_value || is_known || is_combined || is_closure,
        }
    }

    /// The input of a name.
    pub(crate) fn input_row(&self, name: &str) -> Option<InputRow> {
        self.input_rows().find(|input| input.name == name)
    }

    /// What the page says of it: the note, or the template.
    pub fn becomes(&self) -> String {
        match (self.note, self.make) {
            ("", Make::Text(text)) => format!("`{}`", shown(text)),
            ("", Make::Each(rows)) => {
                let texts = rows.first().map(|(_, text)| shown(text));
                format!("`{}`", texts.unwrap_or_default())
            }
            (note, _) => note.to_owned(),
        }
    }
}

/// A template for readers.
fn shown(template: &str) -> String {
    let plain = template
        .replace(['{', '}', '~', '#'], "")
        .replace("$T", "TYPE");
    // Paths of the library without their folder.
    let mut text = String::new();
    for part in plain.split('@') {
        match part.split_once("::") {
            Some((_, rest)) if !text.is_empty() || plain.starts_with('@') => text.push_str(rest),
            _ => text.push_str(part),
        }
    }
    text.replace('|', "\\|")
}
