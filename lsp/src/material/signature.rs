//! The parameters of the call that a cursor is in.

use std::ops::Range;

use impasto_compiler::analysis::manual::{self, Kind};
use impasto_compiler::analysis::{Analysis, params};
use impasto_compiler::ast::ItemKind;

use super::cursor::{Call, cursor};
use super::describe;

/// A way to call something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// How it is called.
    pub label: String,
    /// The bytes of each parameter in the label.
    pub params: Vec<Range<usize>>,
    /// What each parameter is, in Markdown.
    pub docs_of_params: Vec<String>,
    /// What it is, in Markdown.
    pub docs: String,
    /// The parameter that the cursor gives a value.
    pub active: Option<usize>,
}

/// The ways to call what byte `at` is in a call of.
pub fn signatures(
    text: &str,
    now: &Analysis,
    last_good: Option<&Analysis>,
    at: usize,
) -> Vec<Signature> {
    let cursor = cursor(text, at);
    for call in &cursor.calls {
        for analysis in [Some(now), last_good].into_iter().flatten() {
            if let Some(signature) = of_item(analysis, call) {
                return vec![signature];
            }
        }
        let of_language = of_language(call);
        if !of_language.is_empty() {
            return of_language;
        }
    }
    Vec::new()
}

fn of_item(analysis: &Analysis, call: &Call) -> Option<Signature> {
    let item = analysis.lookup(analysis.module?, &call.callee)?;
    let found = analysis.item(item);
    let mut names = Vec::new();
    let mut shown: Vec<(String, String)> = Vec::new();
    if let ItemKind::Struct(fields) = &found.kind {
        for field in fields {
            names.push(field.name.node.clone());
            let docs = impasto_compiler::interface::prose(&field.docs);
            shown.push((format!("{}: {}", field.name.node, field.ty.node), docs));
        }
    }
    for p in params(found) {
        names.push(p.name.node.clone());
        let docs = p.of_material.map_or(String::new(), |m| {
            impasto_compiler::interface::prose(&m.docs)
        });
        shown.push((
            describe::param_text(analysis, p.name, p.ty, p.default),
            docs,
        ));
    }
    let active = match &call.named {
        Some(named) => names.iter().position(|n| n == named),
        None => Some(call.position),
    };
    let result = match &found.kind {
        ItemKind::Function(f) => format!(" -> {}", f.result.node),
        _ => String::new(),
    };
    let description = describe::describe_item(analysis, item);
    let docs = description.docs.split("\n\n| parameter").next();
    Some(built(
        &call.callee,
        shown,
        &result,
        docs.unwrap_or_default().to_owned(),
        active,
    ))
}

fn built(
    name: &str,
    shown: Vec<(String, String)>,
    result: &str,
    docs: String,
    active: Option<usize>,
) -> Signature {
    let mut label = format!("{name}(");
    let (mut params, mut docs_of_params) = (Vec::new(), Vec::new());
    for (i, (param, docs)) in shown.into_iter().enumerate() {
        if i > 0 {
            label += ", ";
        }
        params.push(label.len()..label.len() + param.len());
        label += &param;
        docs_of_params.push(docs);
    }
    label += ")";
    label += result;
    let active = active.filter(|a| *a < params.len());
    Signature {
        label,
        params,
        docs_of_params,
        docs,
        active,
    }
}

fn of_language(call: &Call) -> Vec<Signature> {
    let entry = manual::entry(&call.callee, &[Kind::Function, Kind::Form]);
    let Some(entry) = entry else {
        return Vec::new();
    };
    let calls = entry.written.iter().filter_map(|written| {
        let inside = written.strip_prefix(&call.callee)?;
        let inside = inside.strip_prefix('(')?.strip_suffix(')')?;
        let shown: Vec<(String, String)> = describe::parts(inside)
            .into_iter()
            .map(|p| (p.to_owned(), String::new()))
            .collect();
        let named = |p: &(String, String)| {
            let name = p.0.split(':').next().unwrap_or_default();
            call.named.as_deref() == Some(name.trim())
        };
        let active = match &call.named {
            Some(_) => shown.iter().position(named),
            None => {
                let last = shown.last().is_some_and(|p| p.0 == "...");
                let most = shown.len().saturating_sub(1);
                Some(if last {
                    call.position.min(most)
                } else {
                    call.position
                })
            }
        };
        Some(built(&call.callee, shown, "", entry.about.clone(), active))
    });
    let mut all: Vec<Signature> = calls.collect();
    // Those that have a place for the argument come first.
    all.sort_by_key(|s| s.active.is_none());
    all
}
