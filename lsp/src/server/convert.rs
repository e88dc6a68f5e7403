//! From bytes to positions, and from what the features find to what the protocol has.

use std::ops::Range;
use std::path::Path;

use gen_lsp_types as lsp;
use serde_json::{Value, json};

use crate::library;
use crate::material::completion::{Proposal, ProposalKind};
use crate::material::outline::{Entry, EntryKind};
use crate::text::Text;

use super::settings::Settings;

/// The URI of a file as the compiler calls it; copies of the library lie below `copies`, for clients that need them.
pub fn uri_of(path: &str, copies: Option<&Path>) -> Option<lsp::Uri> {
    match library::file_of(path) {
        Some(file) => library::uri(file, copies),
        None => lsp::Uri::from_file_path(path)
            .ok()
            .or_else(|| path.parse().ok()),
    }
}

/// A change of a range of bytes.
pub fn edit(text: &Text, range: Range<usize>, new: &str) -> Value {
    json!({ "range": text.range(range), "newText": new })
}

/// A text of Markdown for a client, or as plain text where that does not say that it shows Markdown.
pub fn documentation(text: &str, markdown: bool) -> Value {
    if markdown {
        return json!({ "kind": "markdown", "value": text });
    }
    let lines = text.lines().filter(|line| !line.starts_with("```"));
    let lines: Vec<String> = lines.map(|line| line.replace(['`', '*'], "")).collect();
    json!({ "kind": "plaintext", "value": lines.join("\n") })
}

/// A proposal that takes the place of `word`, with the edits that it brings along.
pub fn completion(
    text: &Text,
    word: &Range<usize>,
    index: usize,
    proposal: &Proposal,
    more: Vec<Value>,
    settings: &Settings,
) -> Value {
    let snippets = settings.snippets;
    let new = if snippets {
        proposal.snippet.clone()
    } else {
        without_places(&proposal.snippet)
    };
    let mut item = json!({
        "label": proposal.label,
        "kind": completion_kind(proposal.kind),
        "sortText": format!("{index:05}"),
        "insertTextFormat": if snippets { 2 } else { 1 },
        "textEdit": edit(text, word.clone(), &new),
    });
    if !proposal.detail.is_empty() {
        item["detail"] = json!(proposal.detail);
    }
    if !proposal.docs.is_empty() {
        let markdown = settings.markdown.completion;
        item["documentation"] = documentation(&proposal.docs, markdown);
    }
    if !more.is_empty() {
        item["additionalTextEdits"] = json!(more);
    }
    item
}

/// A snippet as plain text: its places are what stands in them.
pub fn without_places(snippet: &str) -> String {
    let mut out = String::new();
    let mut rest = snippet;
    while let Some(at) = rest.find(['$', '\\']) {
        out.push_str(&rest[..at]);
        let tail = &rest[at..];
        if let Some(escaped) = tail.strip_prefix('\\') {
            let mut letters = escaped.chars();
            out.extend(letters.next());
            rest = letters.as_str();
        } else if let Some(inside) = tail.strip_prefix("${") {
            let end = inside.find('}').unwrap_or(inside.len());
            out.push_str(inside[..end].split_once(':').map_or("", |(_, name)| name));
            rest = inside.get(end + 1..).unwrap_or("");
        } else {
            rest = tail[1..].trim_start_matches(|c: char| c.is_ascii_digit());
        }
    }
    out + rest
}

fn completion_kind(kind: ProposalKind) -> u32 {
    match kind {
        ProposalKind::Keyword => 14,
        ProposalKind::Snippet => 15,
        ProposalKind::Function => 3,
        ProposalKind::Closure => 4,
        ProposalKind::Material => 7,
        ProposalKind::Struct => 22,
        ProposalKind::Constant => 21,
        ProposalKind::Variable => 6,
        ProposalKind::Parameter => 10,
        ProposalKind::Field => 5,
        ProposalKind::Input => 6,
        ProposalKind::Output => 10,
        ProposalKind::Type => 25,
        ProposalKind::Unit => 11,
        ProposalKind::Module => 9,
        ProposalKind::File => 17,
    }
}

/// The kind of a symbol in a list.
pub fn symbol_kind(kind: ProposalKind) -> u32 {
    match kind {
        ProposalKind::Material => 5,
        ProposalKind::Struct => 23,
        ProposalKind::Constant => 14,
        ProposalKind::Module => 2,
        _ => 12,
    }
}

/// A definition in an outline.
pub fn document_symbol(text: &Text, entry: &Entry) -> Value {
    let kind = match entry.kind {
        EntryKind::Material => 5,
        EntryKind::Closure | EntryKind::Function => 12,
        EntryKind::Struct => 23,
        EntryKind::Constant => 14,
        EntryKind::Parameter | EntryKind::Output => 7,
        EntryKind::Variable => 13,
        EntryKind::Method => 6,
        EntryKind::Test => 24,
        EntryKind::Field => 8,
    };
    let children = entry.children.iter();
    let children: Vec<Value> = children.map(|c| document_symbol(text, c)).collect();
    json!({
        "name": if entry.name.is_empty() { "?" } else { &entry.name },
        "detail": entry.detail,
        "kind": kind,
        "range": text.range(entry.whole.clone()),
        "selectionRange": text.range(entry.place.clone()),
        "children": children,
    })
}

#[cfg(test)]
mod tests {
    use super::without_places;

    #[test]
    fn a_snippet_without_places_is_what_stands_in_them() {
        for (snippet, plain) in [
            ("mix(${1:a}, ${2:b}, $3)$0", "mix(a, b, )"),
            ("a\\$b", "a$b"),
            ("plain", "plain"),
            ("${1:open", "open"),
        ] {
            assert_eq!(without_places(snippet), plain);
        }
    }
}
