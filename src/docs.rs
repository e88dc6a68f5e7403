//! What a file says about itself: doc comments and signatures of its definitions, for pages about them
//! (`impasto emit --what docs`, docs/library).
//!
//! Everything comes from the syntax tree: types, defaults and ranges are the text that the author
//! wrote, so a page shows `0.6 mm` where the compiler would know 0.0006. Nothing is checked; a file
//! that only parses has docs.

use std::collections::BTreeMap;

use impasto_compiler::ast::{
    self, ClosureKind, Entry, Expr, ExprKind, ItemKind, MaterialParam, Module, Param,
};
use impasto_compiler::source::SourceMap;
use impasto_compiler::{diag, parser};
use serde::{Deserialize, Serialize};

/// The docs of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileDocs {
    /// Its own doc comment, a line each.
    pub docs: Vec<String>,
    /// Its definitions, in their order.
    pub items: Vec<Item>,
}

/// A definition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Item {
    /// Its name.
    pub name: String,
    /// Its doc comment, a line each.
    pub docs: Vec<String>,
    /// Whether only its own file can use it.
    pub private: bool,
    /// What it takes and gives.
    #[serde(flatten)]
    pub definition: Definition,
}

/// What a definition takes and gives, by its kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Definition {
    /// A material.
    Material {
        /// What scenes set.
        parameters: Vec<Parameter>,
    },
    /// A BSDF with a density.
    Bsdf {
        /// What it takes.
        parameters: Vec<Parameter>,
    },
    /// A BSDF whose directions are discrete.
    #[serde(rename = "delta bsdf")]
    DeltaBsdf {
        /// What it takes.
        parameters: Vec<Parameter>,
    },
    /// An EDF.
    Edf {
        /// What it takes.
        parameters: Vec<Parameter>,
    },
    /// A function.
    Fn {
        /// What it takes.
        parameters: Vec<Parameter>,
        /// The type of what it gives.
        result: String,
    },
    /// A struct.
    Struct {
        /// What it consists of.
        fields: Vec<Field>,
    },
    /// A constant.
    Const {
        /// Its type.
        #[serde(rename = "type")]
        ty: String,
        /// Its value.
        value: String,
    },
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: String,
    /// Its value where a call does not say one.
    pub default: Option<String>,
    /// What else is told of the parameters of materials.
    #[serde(flatten)]
    pub setting: Option<Setting>,
}

/// What parameters of materials tell beside name, type and default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The ends of its range.
    pub range: Option<[String; 2]>,
    /// Its doc comment, a line each.
    pub docs: Vec<String>,
    /// What user interfaces are told, by key.
    pub metadata: BTreeMap<String, Told>,
}

/// A value of metadata.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Told {
    /// A text or an expression.
    Text(String),
    /// The two ends of a range.
    Range([String; 2]),
}

/// A field of a struct.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: String,
    /// Its doc comment, a line each.
    pub docs: Vec<String>,
}

impl Item {
    /// What it is, as a source writes it.
    pub fn kind(&self) -> &'static str {
        match self.definition {
            Definition::Material { .. } => "material",
            Definition::Bsdf { .. } => "bsdf",
            Definition::DeltaBsdf { .. } => "delta bsdf",
            Definition::Edf { .. } => "edf",
            Definition::Fn { .. } => "fn",
            Definition::Struct { .. } => "struct",
            Definition::Const { .. } => "const",
        }
    }

    /// What it takes; nothing of structs and constants.
    pub fn parameters(&self) -> &[Parameter] {
        match &self.definition {
            Definition::Material { parameters }
            | Definition::Bsdf { parameters }
            | Definition::DeltaBsdf { parameters }
            | Definition::Edf { parameters }
            | Definition::Fn { parameters, .. } => parameters,
            Definition::Struct { .. } | Definition::Const { .. } => &[],
        }
    }

    /// Its fields, if it is a struct.
    pub fn fields(&self) -> &[Field] {
        match &self.definition {
            Definition::Struct { fields } => fields,
            _ => &[],
        }
    }
}

impl Setting {
    /// The text that user interfaces are told by some key.
    pub fn told(&self, key: &str) -> Option<&str> {
        match self.metadata.get(key) {
            Some(Told::Text(text)) => Some(text),
            _ => None,
        }
    }
}

/// The docs of the file called `name`, whose text is `text`.
///
/// # Errors
/// What the parser says, as text for people.
pub fn of_text(name: &str, text: &str) -> Result<FileDocs, String> {
    let mut sources = SourceMap::default();
    let file = sources.add(name, text);
    let (module, diagnostics) = parser::parse(file, text);
    if diag::has_errors(&diagnostics) {
        return Err(diag::render::text(&sources, &diagnostics, false));
    }
    Ok(docs(&module, text))
}

/// The docs of a file; `text` is what `module` was parsed from.
pub fn docs(module: &Module, text: &str) -> FileDocs {
    FileDocs {
        docs: module.docs.clone(),
        items: module.items.iter().map(|i| item(i, text)).collect(),
    }
}

fn item(item: &ast::Item, text: &str) -> Item {
    Item {
        name: item.name.node.clone(),
        docs: item.docs.clone(),
        private: item.private,
        definition: definition(&item.kind, text),
    }
}

fn definition(kind: &ItemKind, text: &str) -> Definition {
    match kind {
        ItemKind::Material(m) => Definition::Material {
            parameters: m.params.iter().map(|p| setting(p, text)).collect(),
        },
        ItemKind::Closure(c) => {
            let parameters = parameters(&c.params, text);
            match c.kind {
                ClosureKind::Bsdf => Definition::Bsdf { parameters },
                ClosureKind::DeltaBsdf => Definition::DeltaBsdf { parameters },
                ClosureKind::Edf => Definition::Edf { parameters },
            }
        }
        ItemKind::Function(f) => Definition::Fn {
            parameters: parameters(&f.params, text),
            result: f.result.node.to_string(),
        },
        ItemKind::Struct(fields) => Definition::Struct {
            fields: fields.iter().map(field).collect(),
        },
        ItemKind::Const(constant) => Definition::Const {
            ty: constant.ty.node.to_string(),
            value: source(&constant.value, text),
        },
    }
}

/// The parameters of a function or closure.
fn parameters(params: &[Param], text: &str) -> Vec<Parameter> {
    let parameter = |p: &Param| Parameter {
        name: p.name.node.clone(),
        ty: p.ty.node.to_string(),
        default: p.default.as_ref().map(|d| source(d, text)),
        setting: None,
    };
    params.iter().map(parameter).collect()
}

/// A parameter of a material.
fn setting(param: &MaterialParam, text: &str) -> Parameter {
    let range = param.range.as_ref();
    Parameter {
        name: param.name.node.clone(),
        ty: param.ty.node.to_string(),
        default: Some(source(&param.default, text)),
        setting: Some(Setting {
            range: range.map(|(low, high)| [source(low, text), source(high, text)]),
            docs: param.docs.clone(),
            metadata: param.metadata.iter().map(|e| told(e, text)).collect(),
        }),
    }
}

/// What a parameter tells user interfaces: a key with its value.
fn told(entry: &Entry, text: &str) -> (String, Told) {
    let Entry { key, value, high } = entry;
    let told = match (&value.kind, high) {
        (_, Some(high)) => Told::Range([source(value, text), source(high, text)]),
        (ExprKind::Str(told), None) => Told::Text(told.to_string()),
        (_, None) => Told::Text(source(value, text)),
    };
    (key.node.clone(), told)
}

/// A field of a struct.
fn field(field: &ast::Field) -> Field {
    Field {
        name: field.name.node.clone(),
        ty: field.ty.node.to_string(),
        docs: field.docs.clone(),
    }
}

/// An expression as its author wrote it, in one line.
fn source(expr: &Expr, text: &str) -> String {
    let words = text.get(expr.span.range()).unwrap_or_default();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}
