//! Inputs of graphs as parameters, with what a document says for user interfaces.

use crate::mtlx::document::{Document, Id};
use crate::mtlx::types::{Literal, Type, number, quoted};
use crate::mtlx::value::Value;

/// Longest line of a comment.
const MOST_COLUMNS: usize = 92;

/// The declaration of a parameter.
pub(crate) fn declaration(
    document: &Document,
    at: Id,
    name: &str,
    ty: Type,
    value: &Value,
) -> String {
    let mut text = String::new();
    let docs = document.attribute(at, "doc").unwrap_or_default();
    for line in wrapped(docs) {
        text.push_str(&format!("/// {line}\n"));
    }
    text.push_str(&format!("param {name}: {} = {}", ty.impasto(), value.text));
    let hard = range(document, at, ("uimin", "uimax"), ty, value);
    if let Some((low, high)) = &hard {
        text.push_str(&format!(" in {low} .. {high}"));
    }
    let mut metadata = Vec::new();
    if let Some(label) = document.attribute(at, "uiname") {
        metadata.push(format!("label: {}", quoted(&ascii(label))));
    }
    if let Some(group) = document.attribute(at, "uifolder") {
        metadata.push(format!("group: {}", quoted(&ascii(group))));
    }
    if let Some((low, high)) =
        range(document, at, ("uisoftmin", "uisoftmax"), ty, value).filter(|_| hard.is_none())
    {
        metadata.push(format!("soft: {low} .. {high}"));
    }
    if !metadata.is_empty() {
        text.push_str(&format!(" {{ {} }}", metadata.join(", ")));
    }
    text.push_str(";\n");
    text
}

/// A range that holds the default. One number is the limit of all components.
fn range(
    document: &Document,
    at: Id,
    (low, high): (&str, &str),
    ty: Type,
    value: &Value,
) -> Option<(String, String)> {
    if !ty.is_numeric() {
        return None;
    }
    let end = |name: &str| {
        let literal = Literal::read(document.attribute(at, name)?, ty).ok()?;
        literal.single()
    };
    let (low, high) = (end(low)?, end(high)?);
    let holds = match value.literal.as_ref()? {
        Literal::Integer(value) => (low..=high).contains(&f64::from(*value)),
        Literal::Numbers(numbers) => numbers.iter().all(|n| (low..=high).contains(n)),
        _ => false,
    };
    if !holds || low >= high {
        return None;
    }
    let written = |end: f64| match ty {
        Type::Integer => format!("{}", end as i32),
        _ => number(end),
    };
    Some((written(low), written(high)))
}

/// A text without what is not ASCII: labels are strings, which may be anything, but quotes and control characters.
fn ascii(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// A comment in lines.
pub(crate) fn wrapped(text: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        if !line.is_empty() && line.len() + word.len() >= MOST_COLUMNS {
            lines.push(std::mem::take(&mut line));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}
