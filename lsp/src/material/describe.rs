//! What there is to say of a symbol: its declaration as it is written, and its documentation.

use std::path::Path;

use impasto_compiler::analysis::manual::{self, Kind};
use impasto_compiler::analysis::{Analysis, LocalKind, Symbol, TypeOf, params};
use impasto_compiler::ast::{ClosureKind, Expr, Item, ItemKind, MaterialParam, TypeName};
use impasto_compiler::interface::prose;
use impasto_compiler::ir::Const;
use impasto_compiler::sema::ItemRef;
use impasto_compiler::source::Span;

/// What there is to say of a symbol.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// Its declaration, in the language.
    pub declaration: String,
    /// Its documentation, in Markdown.
    pub docs: String,
    /// Where it comes from, if not from the file itself.
    pub origin: Option<String>,
}

impl Description {
    /// All of it as Markdown.
    pub fn markdown(&self) -> String {
        let mut parts = vec![format!("```impasto\n{}\n```", self.declaration)];
        parts.extend(Some(self.docs.clone()).filter(|d| !d.is_empty()));
        parts.extend(self.origin.as_ref().map(|origin| format!("*{origin}*")));
        parts.join("\n\n")
    }
}

/// Describes a symbol.
pub fn describe(analysis: &Analysis, symbol: &Symbol) -> Option<Description> {
    match symbol {
        Symbol::Item(item) => Some(describe_item(analysis, *item)),
        Symbol::Param(item, index) => param(analysis, *item, *index),
        Symbol::Field(item, index) => field(analysis, *item, *index),
        Symbol::Local(index) => local(analysis, *index),
        Symbol::File(module) => {
            let module = &analysis.modules[module.0];
            let name = Path::new(&module.path).file_stem().unwrap_or_default();
            Some(Description {
                declaration: format!("use {}", name.to_string_lossy()),
                docs: prose(&module.ast.docs),
                origin: Some(module.path.clone()),
            })
        }
        Symbol::BuiltIn(name) => built_in(name),
        Symbol::Type(name) => Some(of_manual(manual::entry(name, &[Kind::Type])?)),
    }
}

/// The text at a span.
pub fn text(analysis: &Analysis, span: Span) -> &str {
    let source = &analysis.sources.file(span.file).text;
    source.get(span.range()).unwrap_or_default()
}

/// A definition.
pub fn describe_item(analysis: &Analysis, item: ItemRef) -> Description {
    let found = analysis.item(item);
    let module = &analysis.modules[item.module.0];
    let mut docs = prose(&found.docs);
    if docs.is_empty() && module.is_std {
        // A file of the library is about what it defines.
        docs = prose(&module.ast.docs);
    }
    if let ItemKind::Material(material) = &found.kind {
        docs += &parameters(analysis, &material.params);
    }
    Description {
        declaration: declaration(analysis, found),
        docs,
        origin: origin(analysis, item),
    }
}

/// The file that a definition is in, unless it is the one that is analysed.
fn origin(analysis: &Analysis, item: ItemRef) -> Option<String> {
    let module = &analysis.modules[item.module.0];
    (Some(item.module) != analysis.module).then(|| crate::library::canonical(&module.path))
}

/// A definition without its body.
pub fn declaration(analysis: &Analysis, item: &Item) -> String {
    let private = if item.private { "private " } else { "" };
    let name = &item.name.node;
    let list = || {
        let all = params(item);
        let shown = all
            .iter()
            .map(|p| param_text(analysis, p.name, p.ty, p.default));
        let shown: Vec<String> = shown.collect();
        let line = shown.join(", ");
        if line.len() <= 70 {
            line
        } else {
            format!("\n    {},\n", shown.join(",\n    "))
        }
    };
    let text = match &item.kind {
        ItemKind::Material(_) => format!("material {name}"),
        ItemKind::Closure(c) => {
            let kind = match c.kind {
                ClosureKind::Bsdf => "bsdf",
                ClosureKind::DeltaBsdf => "delta bsdf",
                ClosureKind::Edf => "edf",
            };
            format!("{kind} {name}({})", list())
        }
        ItemKind::Function(f) => format!("fn {name}({}) -> {}", list(), f.result.node),
        ItemKind::Struct(fields) => {
            let fields = fields
                .iter()
                .map(|f| format!("{}: {}", f.name.node, f.ty.node));
            format!(
                "struct {name} {{ {} }}",
                fields.collect::<Vec<_>>().join(", ")
            )
        }
        ItemKind::Const(c) => {
            format!(
                "const {name}: {} = {}",
                c.ty.node,
                text(analysis, c.value.span)
            )
        }
    };
    format!("{private}{text}")
}

/// `name: type = default`
pub fn param_text(
    analysis: &Analysis,
    name: &impasto_compiler::ast::Name,
    ty: &TypeName,
    default: Option<&Expr>,
) -> String {
    let default = default.map_or(String::new(), |d| format!(" = {}", text(analysis, d.span)));
    format!("{}: {}{default}", name.node, ty.node)
}

/// A table of a material's parameters.
fn parameters(analysis: &Analysis, params: &[MaterialParam]) -> String {
    if params.is_empty() {
        return String::new();
    }
    let mut out = "\n\n| parameter | default | range | |\n|---|---|---|---|\n".to_owned();
    for p in params {
        let range = p.range.as_ref().map_or(String::new(), |(low, high)| {
            let (low, high) = (text(analysis, low.span), text(analysis, high.span));
            format!("`{low} .. {high}`")
        });
        let docs = prose(&p.docs).replace('\n', " ").replace('|', "\\|");
        let (name, ty) = (&p.name.node, &p.ty.node);
        let default = text(analysis, p.default.span).replace('\n', " ");
        out += &format!("| `{name}: {ty}` | `{default}` | {range} | {docs} |\n");
    }
    out
}

fn param(analysis: &Analysis, item: ItemRef, index: usize) -> Option<Description> {
    let found = analysis.item(item);
    let all = params(found);
    let p = all.get(index)?;
    let mut declaration = param_text(analysis, p.name, p.ty, p.default);
    let mut docs = String::new();
    let owner = &found.name.node;
    if let Some(declared) = p.of_material {
        declaration = format!("param {declaration}");
        if let Some((low, high)) = &declared.range {
            let (low, high) = (text(analysis, low.span), text(analysis, high.span));
            declaration += &format!(" in {low} .. {high}");
        }
        docs = prose(&declared.docs);
        let told = declared.metadata.iter().map(|entry| {
            let high = entry.high.as_ref().map_or(String::new(), |high| {
                format!(" .. {}", text(analysis, high.span))
            });
            let value = text(analysis, entry.value.span);
            format!("- {}: `{value}{high}`", entry.key.node)
        });
        let told: Vec<String> = told.collect();
        if !told.is_empty() {
            docs += &format!("\n\n{}", told.join("\n"));
        }
    }
    if let Some(value) = p.default.and_then(|d| constant(analysis, d)) {
        docs += &format!("\n\nDefault: {value}");
    }
    let owner = match origin(analysis, item) {
        Some(file) => format!("parameter of `{owner}` in {file}"),
        None => format!("parameter of `{owner}`"),
    };
    Some(Description {
        declaration,
        docs: docs.trim().to_owned(),
        origin: Some(owner),
    })
}

fn field(analysis: &Analysis, item: ItemRef, index: usize) -> Option<Description> {
    let found = analysis.item(item);
    let ItemKind::Struct(fields) = &found.kind else {
        return None;
    };
    let field = fields.get(index)?;
    Some(Description {
        declaration: format!("{}: {}", field.name.node, field.ty.node),
        docs: prose(&field.docs),
        origin: Some(format!("field of `{}`", found.name.node)),
    })
}

fn local(analysis: &Analysis, index: usize) -> Option<Description> {
    let local = analysis.locals.get(index)?;
    let word = match local.kind {
        LocalKind::Let => "let ",
        LocalKind::Var => "var ",
        LocalKind::Loop => "for ",
        LocalKind::Argument => "",
    };
    let ty = type_text(analysis.binding_type(local.span));
    Some(Description {
        declaration: format!("{word}{}{ty}", local.name),
        docs: String::new(),
        origin: None,
    })
}

/// `: type`, or nothing where it is not known.
pub fn type_text(ty: Option<&TypeOf>) -> String {
    ty.map_or(String::new(), |ty| format!(": {}", ty.text))
}

/// What the language has.
pub fn built_in(name: &str) -> Option<Description> {
    let kinds = [
        Kind::Input,
        Kind::Function,
        Kind::Form,
        Kind::Output,
        Kind::Type,
        Kind::Unit,
        Kind::Method,
    ];
    let mut found = kinds
        .iter()
        .filter_map(|kind| manual::entry(name, &[*kind]));
    let first = found.next()?;
    let mut description = of_manual(first);
    for other in found.filter(|e| e.kind == Kind::Form || e.kind == Kind::Type) {
        let other = of_manual(other);
        description.declaration += &format!("\n{}", other.declaration);
        description.docs += &format!("\n\n{}", other.docs);
    }
    Some(description)
}

/// What the manual says.
pub fn of_manual(entry: &manual::Entry) -> Description {
    let name = &entry.name;
    let declaration = match (entry.kind, &entry.ty) {
        (Kind::Input | Kind::Output, Some(ty)) => format!("{name}: {ty}"),
        (Kind::Type, _) => format!("type {name}"),
        _ => entry.written.join("\n"),
    };
    let origin = match entry.kind {
        Kind::Input => "input of a material",
        Kind::Output => "output of a material",
        Kind::Unit => "unit",
        _ => "built in",
    };
    Description {
        declaration,
        docs: entry.about.clone(),
        origin: Some(origin.to_owned()),
    }
}

/// The value of an expression that is a constant and does not say so itself, as in `0.02 m`.
pub fn constant(analysis: &Analysis, expr: &Expr) -> Option<String> {
    let value = value(analysis, expr.span)?;
    let written = text(analysis, expr.span);
    (value != written && value != format!("{written}.0")).then(|| format!("`{value}`"))
}

/// The constant that the expression at a span is, with its unit.
pub fn value(analysis: &Analysis, span: Span) -> Option<String> {
    let unit = match analysis.type_at(span).map(|t| &*t.text) {
        Some("length") => " m",
        Some("angle") => " rad",
        Some("texture") => return None,
        _ => "",
    };
    Some(match analysis.constant_at(span)? {
        Const::Bool(b) => b.to_string(),
        Const::Int(i) => i.to_string(),
        Const::Float(v) => match v.as_slice() {
            [x] => format!("{}{unit}", number(*x)),
            all => {
                let all: Vec<String> = all.iter().map(|x| number(*x)).collect();
                format!("({})", all.join(", "))
            }
        },
    })
}

/// A number in single precision, which the values have in the end.
fn number(x: f64) -> String {
    format!("{}", x as f32)
}

/// Parts between commas that are in no brackets.
pub fn parts(text: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth) = (Vec::new(), 0, 0);
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(text[start..].trim());
    parts.retain(|p| !p.is_empty());
    parts
}
