//! `impasto emit --what docs`: what a file says about itself, for programs that write pages of it.
//!
//! Everything comes from the syntax tree: types, defaults and ranges are the text that the author
//! wrote, so a page shows `0.6 mm` where the compiler would know 0.0006. Nothing is checked; a file
//! that only parses has docs.

use impasto::compiler::ast::{
    ClosureKind, Const, Entry, Expr, ExprKind, Field, Item, ItemKind, MaterialParam, Module, Param,
};
use serde_json::{Value, json};

/// The docs of a file, as JSON; `text` is what `module` was parsed from.
pub(super) fn docs(module: &Module, text: &str) -> String {
    let items: Vec<Value> = module.items.iter().map(|i| item(i, text)).collect();
    let value = json!({ "docs": module.docs, "items": items });
    format!("{value:#}\n")
}

/// A definition: its kind, its docs, and what it takes and gives.
fn item(item: &Item, text: &str) -> Value {
    let mut value = match &item.kind {
        ItemKind::Material(m) => {
            let parameters: Vec<Value> = m.params.iter().map(|p| setting(p, text)).collect();
            json!({ "kind": "material", "parameters": parameters })
        }
        ItemKind::Closure(c) => {
            let kind = match c.kind {
                ClosureKind::Bsdf => "bsdf",
                ClosureKind::DeltaBsdf => "delta bsdf",
                ClosureKind::Edf => "edf",
            };
            json!({ "kind": kind, "parameters": parameters(&c.params, text) })
        }
        ItemKind::Function(f) => json!({
            "kind": "fn",
            "parameters": parameters(&f.params, text),
            "result": f.result.node,
        }),
        ItemKind::Struct(fields) => {
            let fields: Vec<Value> = fields.iter().map(field).collect();
            json!({ "kind": "struct", "fields": fields })
        }
        ItemKind::Const(Const { ty, value }) => json!({
            "kind": "const",
            "type": ty.node,
            "value": source(value, text),
        }),
    };
    value["name"] = json!(item.name.node);
    value["docs"] = json!(item.docs);
    value["private"] = json!(item.private);
    value
}

/// The parameters of a function or closure.
fn parameters(params: &[Param], text: &str) -> Vec<Value> {
    let parameter = |p: &Param| {
        json!({
            "name": p.name.node,
            "type": p.ty.node,
            "default": p.default.as_ref().map(|d| source(d, text)),
        })
    };
    params.iter().map(parameter).collect()
}

/// A parameter of a material.
fn setting(param: &MaterialParam, text: &str) -> Value {
    let range = param.range.as_ref();
    json!({
        "name": param.name.node,
        "type": param.ty.node,
        "default": source(&param.default, text),
        "range": range.map(|(low, high)| [source(low, text), source(high, text)]),
        "docs": param.docs,
        "metadata": metadata(param, text),
    })
}

/// What a parameter tells user interfaces, by key: text, or the two ends of a range.
fn metadata(param: &MaterialParam, text: &str) -> Value {
    let mut value = json!({});
    for Entry {
        key,
        value: told,
        high,
    } in &param.metadata
    {
        value[&key.node] = match (&told.kind, high) {
            (_, Some(high)) => json!([source(told, text), source(high, text)]),
            (ExprKind::Str(told), None) => json!(told),
            (_, None) => json!(source(told, text)),
        };
    }
    value
}

/// A field of a struct.
fn field(field: &Field) -> Value {
    json!({ "name": field.name.node, "type": field.ty.node, "docs": field.docs })
}

/// An expression as its author wrote it, in one line.
fn source(expr: &Expr, text: &str) -> String {
    let words = text.get(expr.span.range()).unwrap_or_default();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}
