//! Diagnostics as text for people and as JSON for programs.
//!
//! The JSON form is an array with one object a diagnostic:
//!
//! | key | value |
//! |---|---|
//! | `code` | identity, such as `"E0201"` |
//! | `severity` | `"error"` or `"warning"` |
//! | `message` | what is wrong, one line |
//! | `file` | name of the source, or null when the problem has no place |
//! | `line`, `column` | first character, from 1; columns count characters; null without a place |
//! | `end_line`, `end_column` | one past the last character |
//! | `start`, `end` | the same as byte offsets in the file |
//! | `expected`, `hint` | text or null |
//! | `notes` | what else to know of the place: texts |
//! | `labels` | further places: objects with `message`, `file` and the six position keys |
//! | `fixes` | changes that may repair it: objects with `title`, `text` (what takes the place), `imports` (paths to import) and the place as in `labels` |
//!
//! Both forms are sorted by file and place and leave out repetitions, so that they depend on
//! the source only. Of a source that was made from a document, places are those of the document.

use codespan_reporting::diagnostic as codespan;
use codespan_reporting::files::{Error, Files};
use codespan_reporting::term::termcolor::Buffer;
use codespan_reporting::term::{Config, DisplayStyle, emit_into_string, emit_to_write_style};
use serde::Serialize;

use super::{Diagnostic, Fix, Severity};
use crate::source::{FileId, SourceMap, Span};

/// Source lines longer than this, in bytes, are not shown under a diagnostic.
const MAX_SHOWN_LINE: usize = 400;

/// All of `diagnostics` for a terminal, with the lines they are about.
pub fn text(sources: &SourceMap, diagnostics: &[Diagnostic], color: bool) -> String {
    let files = View(sources);
    let mut out = String::new();
    for diagnostic in &ordered(sources, diagnostics) {
        let display_style = style(sources, diagnostic);
        let short = matches!(display_style, DisplayStyle::Medium);
        let config = Config {
            display_style,
            ..Config::default()
        };
        let rendered = render(&config, &files, &to_codespan(sources, diagnostic), color);
        // The files are at hand, so only the message itself can be shown if that fails.
        out.push_str(&rendered.unwrap_or_else(|_| plain(diagnostic)));
        if short {
            out.push('\n');
        }
    }
    out
}

/// `2 errors, 1 warning`; empty if there is nothing to count.
pub fn summary(sources: &SourceMap, diagnostics: &[Diagnostic]) -> String {
    let shown = ordered(sources, diagnostics);
    let count = |severity| {
        shown
            .iter()
            .filter(|d| d.code.severity() == severity)
            .count()
    };
    let words = |count: usize, word: &str| match count {
        0 => None,
        1 => Some(format!("1 {word}")),
        _ => Some(format!("{count} {word}s")),
    };
    let errors = words(count(Severity::Error), "error");
    let warnings = words(count(Severity::Warning), "warning");
    let parts: Vec<String> = errors.into_iter().chain(warnings).collect();
    parts.join(", ")
}

/// All of `diagnostics` as a JSON array; the module's documentation describes it.
pub fn json(sources: &SourceMap, diagnostics: &[Diagnostic]) -> String {
    let shown = ordered(sources, diagnostics);
    let list: Vec<JsonDiagnostic<'_>> = shown.iter().map(|d| to_json(sources, d)).collect();
    // Strings and numbers always have a JSON form.
    serde_json::to_string_pretty(&list).unwrap_or_default()
}

/// As people are told them: with places of documents in the place of those of sources that were made from them, sorted by
/// file and place, problems without a place first, without repetitions.
pub fn ordered(sources: &SourceMap, diagnostics: &[Diagnostic]) -> Vec<Diagnostic> {
    let mut list: Vec<Diagnostic> = Vec::with_capacity(diagnostics.len());
    let told = diagnostics.iter().map(|d| super::origin::told(sources, d));
    let mut sorted: Vec<Diagnostic> = told.collect();
    sorted.sort_by_key(|d| (d.span.map(|s| (s.file, s.start, s.end)), d.code));
    for diagnostic in sorted {
        let same_place = list.iter().rev().take_while(|d| d.span == diagnostic.span);
        if !same_place.into_iter().any(|d| *d == diagnostic) {
            list.push(diagnostic);
        }
    }
    list
}

fn render(
    config: &Config,
    files: &View<'_>,
    diagnostic: &codespan::Diagnostic<FileId>,
    color: bool,
) -> Result<String, Error> {
    if !color {
        let text = emit_into_string(config, files, diagnostic)?;
        return Ok(trim_lines(&text));
    }
    let mut buffer = Buffer::ansi();
    emit_to_write_style(&mut buffer, config, files, diagnostic)?;
    Ok(String::from_utf8_lossy(buffer.as_slice()).into_owned())
}

/// Takes away the blanks that empty lines of a frame end in.
fn trim_lines(text: &str) -> String {
    text.lines().flat_map(|l| [l.trim_end(), "\n"]).collect()
}

/// The one-line form for lines that no terminal can show.
fn style(sources: &SourceMap, diagnostic: &Diagnostic) -> DisplayStyle {
    let labels = diagnostic.labels.iter().map(|l| l.span);
    let too_long = labels.chain(diagnostic.span).any(|span| {
        let file = sources.file(span.file);
        let last = file.line_index(span.end as usize);
        let lines = file.line_index(span.start as usize)..=last;
        lines
            .into_iter()
            .any(|l| file.line_range(l).len() > MAX_SHOWN_LINE)
    });
    if too_long {
        DisplayStyle::Medium
    } else {
        DisplayStyle::Rich
    }
}

fn plain(diagnostic: &Diagnostic) -> String {
    let severity = severity_name(diagnostic.code.severity());
    let id = diagnostic.code.id();
    format!("{severity}[{id}]: {}\n", diagnostic.message)
}

fn severity_name(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}

fn to_codespan(sources: &SourceMap, diagnostic: &Diagnostic) -> codespan::Diagnostic<FileId> {
    let severity = match diagnostic.code.severity() {
        Severity::Error => codespan::Severity::Error,
        Severity::Warning => codespan::Severity::Warning,
    };
    let primary = diagnostic
        .span
        .map(|s| codespan::Label::primary(s.file, bytes(sources, s)));
    let secondary = diagnostic.labels.iter().map(|label| {
        codespan::Label::secondary(label.span.file, bytes(sources, label.span))
            .with_message(&label.message)
    });
    let expected = diagnostic.expected.iter().map(|e| format!("expected: {e}"));
    let hint = diagnostic.hint.iter().map(|h| format!("hint: {h}"));
    let notes = diagnostic.notes.iter();
    codespan::Diagnostic::new(severity)
        .with_code(diagnostic.code.id())
        .with_message(&diagnostic.message)
        .with_labels(primary.into_iter().chain(secondary).collect())
        .with_notes(notes.cloned().chain(expected).chain(hint).collect())
}

/// The span as a byte range that is inside the text and starts and ends between characters.
fn bytes(sources: &SourceMap, span: Span) -> std::ops::Range<usize> {
    let text = &sources.file(span.file).text;
    let start = text.floor_char_boundary(span.start as usize);
    let end = text.ceil_char_boundary((span.end as usize).min(text.len()));
    start..end.max(start)
}

/// The sources as the renderer reads them.
struct View<'s>(&'s SourceMap);

impl<'a> Files<'a> for View<'_> {
    type FileId = FileId;
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, id: FileId) -> Result<&'a str, Error> {
        Ok(&self.0.file(id).name)
    }

    fn source(&'a self, id: FileId) -> Result<&'a str, Error> {
        Ok(&self.0.file(id).text)
    }

    fn line_index(&'a self, id: FileId, at: usize) -> Result<usize, Error> {
        Ok(self.0.file(id).line_index(at))
    }

    fn line_range(&'a self, id: FileId, line: usize) -> Result<std::ops::Range<usize>, Error> {
        Ok(self.0.file(id).line_range(line))
    }
}

#[derive(Serialize)]
struct JsonDiagnostic<'a> {
    code: &'static str,
    severity: Severity,
    message: &'a str,
    #[serde(flatten)]
    place: Place<'a>,
    expected: Option<&'a str>,
    hint: Option<&'a str>,
    notes: &'a [String],
    labels: Vec<JsonLabel<'a>>,
    fixes: Vec<JsonFix<'a>>,
}

#[derive(Serialize)]
struct JsonFix<'a> {
    title: &'a str,
    text: &'a str,
    imports: &'a [String],
    #[serde(flatten)]
    place: Place<'a>,
}

#[derive(Serialize)]
struct JsonLabel<'a> {
    message: &'a str,
    #[serde(flatten)]
    place: Place<'a>,
}

#[derive(Default, Serialize)]
struct Place<'a> {
    file: Option<&'a str>,
    line: Option<usize>,
    column: Option<usize>,
    end_line: Option<usize>,
    end_column: Option<usize>,
    start: Option<u32>,
    end: Option<u32>,
}

fn to_json<'a>(sources: &'a SourceMap, diagnostic: &'a Diagnostic) -> JsonDiagnostic<'a> {
    let labels = diagnostic.labels.iter().map(|label| JsonLabel {
        message: &label.message,
        place: place(sources, label.span),
    });
    // One whose place says something else is not what was meant.
    let is_meant = |fix: &&'a Fix| {
        let there = sources.file(fix.span.file).text.get(fix.span.range());
        fix.was.as_deref().is_none_or(|was| there == Some(was))
    };
    let fixes = diagnostic.fixes.iter().filter(is_meant).map(|fix| JsonFix {
        title: &fix.title,
        text: &fix.text,
        imports: &fix.imports,
        place: place(sources, fix.span),
    });
    JsonDiagnostic {
        code: diagnostic.code.id(),
        severity: diagnostic.code.severity(),
        message: &diagnostic.message,
        place: diagnostic
            .span
            .map_or_else(Place::default, |span| place(sources, span)),
        expected: diagnostic.expected.as_deref(),
        hint: diagnostic.hint.as_deref(),
        notes: &diagnostic.notes,
        labels: labels.collect(),
        fixes: fixes.collect(),
    }
}

fn place(sources: &SourceMap, span: Span) -> Place<'_> {
    let (line, column) = sources.line_column(span);
    let end = Span {
        start: span.end,
        ..span
    };
    let (end_line, end_column) = sources.line_column(end);
    Place {
        file: Some(&sources.file(span.file).name),
        line: Some(line),
        column: Some(column),
        end_line: Some(end_line),
        end_column: Some(end_column),
        start: Some(span.start),
        end: Some(span.end),
    }
}
