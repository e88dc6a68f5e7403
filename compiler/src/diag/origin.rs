//! Diagnostics of sources that were made from documents, told as problems of those: people see the lines that they know.

use super::{Diagnostic, Label};
use crate::source::{SourceMap, Span};

/// Longest line of a source that a note quotes, in characters.
const MOST_QUOTED: usize = 160;

/// The diagnostic with places of documents in the place of those of sources that were made from them, and with a note
/// of what stands in the source. Others stay as they are, and so does what was told already.
pub(super) fn told(sources: &SourceMap, diagnostic: &Diagnostic) -> Diagnostic {
    let mut told = diagnostic.clone();
    let Some(span) = diagnostic.span else {
        return told;
    };
    for label in &mut told.labels {
        label.span = sources.known(label.span);
    }
    let Some((place, user)) = sources.written(span) else {
        if let Some(origin) = sources.noted(span) {
            let note = format!("from: {origin}");
            if !told.notes.contains(&note) {
                told.notes.push(note);
            }
        }
        return told;
    };
    told.span = Some(place.span);
    told.notes.push(format!(
        "from: {}, which becomes `{}`",
        place.what,
        quoted(sources, span)
    ));
    // A change of the source is none of the document.
    told.fixes.clear();
    told.labels.retain(|label| label.span != place.span);
    if let Some(user) = user {
        told.labels.push(Label {
            span: user.span,
            message: format!("used by {}", user.what),
        });
    }
    told
}

/// The line of the source where a span begins.
fn quoted(sources: &SourceMap, span: Span) -> String {
    let file = sources.file(span.file);
    let line = file.line_range(file.line_index(span.start as usize));
    let line = file.text.get(line).unwrap_or_default().trim();
    if line.chars().count() <= MOST_QUOTED {
        return line.to_owned();
    }
    let start: String = line.chars().take(MOST_QUOTED).collect();
    format!("{start} ...")
}
