//! Diagnostics of open files, as they are typed.

use std::collections::{HashMap, HashSet};

use gen_lsp_types as lsp;
use impasto_compiler::diag::{self, Code, Diagnostic, Severity};
use impasto_compiler::source::{FileId, SourceMap, Span};
use impasto_runtime::input::mtlx::ImportError;
use serde_json::{Value, json};

use super::{Deep, Server, convert};
use crate::documents::Language;
use crate::library;
use crate::scene::features::Problem;
use crate::text::Text;

/// Most diagnostics of a file that are sent.
const MOST: usize = 320;

/// The texts that diagnostics point into.
type Related = HashMap<FileId, Text>;

impl Server<'_> {
    /// Sends the diagnostics of all files that changed.
    pub(super) fn publish_dirty(&mut self) {
        for path in std::mem::take(&mut self.dirty) {
            let Some(document) = self.documents.at(&path) else {
                continue;
            };
            let (uri, version, language) =
                (document.uri.clone(), document.version, document.language);
            let found = match language {
                // Nobody can change the library.
                Language::Material if library::file_of(&path).is_some() => Vec::new(),
                Language::Material => self.of_source(&path),
                Language::Scene => self.of_scene(&path),
                Language::MaterialX => self.of_document(&path),
                Language::Other => Vec::new(),
            };
            self.publish(&uri, Some(version), found);
        }
    }

    pub(super) fn publish(&self, uri: &lsp::Uri, version: Option<i32>, diagnostics: Vec<Value>) {
        let mut params = json!({ "uri": uri, "diagnostics": diagnostics });
        if let Some(version) = version {
            params["version"] = json!(version);
        }
        self.notify("textDocument/publishDiagnostics", params);
    }

    fn of_source(&mut self, path: &str) -> Vec<Value> {
        let Some(analysis) = self.documents.analysis(path) else {
            return Vec::new();
        };
        let Some(document) = self.documents.at(path) else {
            return Vec::new();
        };
        let text = &document.text;
        let own = analysis.file();
        let mut texts = Related::default();
        // Of an imported file: at the import that leads to it.
        let import = |other: FileId| {
            let module = analysis.modules.iter().position(|m| m.file == other);
            import_of(&analysis, module)
        };
        let shown = analysis.diagnostics.iter().take(MOST);
        let shown =
            shown.map(|d| self.diagnostic(text, &mut texts, &analysis.sources, own, d, import));
        let mut found: Vec<Value> = shown.collect();
        // What only code generation finds, while the text is the one that it was found in.
        let deep = self.deep.get(path);
        let Some(deep) = deep.filter(|d| d.version == document.version) else {
            return found;
        };
        let of_deep = self.of_deep(text, path, deep, true);
        let known: HashSet<String> = found.iter().map(Value::to_string).collect();
        found.extend(
            of_deep
                .into_iter()
                .filter(|d| !known.contains(&d.to_string())),
        );
        found
    }

    /// What is wrong with a document of MaterialX, at its own lines.
    fn of_document(&mut self, path: &str) -> Vec<Value> {
        let imported = self.documents.imported(path);
        let Some(document) = self.documents.at(path) else {
            return Vec::new();
        };
        let text = &document.text;
        match imported {
            Ok(analysis) => {
                let sources = &analysis.sources;
                let own = analysis.file().map(|file| sources.document(file));
                let mut texts = Related::default();
                let shown = analysis.diagnostics.iter().take(MOST);
                shown
                    .map(|d| self.diagnostic(text, &mut texts, sources, own, d, |_| None))
                    .collect()
            }
            Err(errors) => {
                let shown = errors.iter().take(MOST);
                shown.map(|error| refused(text, path, error)).collect()
            }
        }
    }

    /// What a whole check found in a file, and `with_others` in those that it names.
    fn of_deep(&self, text: &Text, path: &str, deep: &Deep, with_others: bool) -> Vec<Value> {
        let mut all = Vec::new();
        for found in &deep.found {
            let sources = &found.sources;
            let mut files = sources.files();
            let own = files.find(|(_, f)| f.name == path).map(|(id, _)| id);
            let mut texts = Related::default();
            let ordered = diag::render::ordered(sources, &found.diagnostics);
            let is_shown =
                |d: &&Diagnostic| with_others || d.span.is_none_or(|s| Some(s.file) == own);
            let shown = ordered.iter().filter(is_shown).take(MOST - all.len());
            all.extend(shown.map(|d| self.diagnostic(text, &mut texts, sources, own, d, |_| None)));
        }
        all
    }

    fn of_scene(&mut self, path: &str) -> Vec<Value> {
        let Some(document) = self.documents.at(path) else {
            return Vec::new();
        };
        let text = document.text.clone();
        let version = document.version;
        let mut problems = self.with_scene(path, |scene| scene.problems());
        let deep = self.deep.get(path).filter(|d| d.version == version);
        for problem in deep.iter().flat_map(|d| &d.problems) {
            let is_known = |p: &Problem| p.place == problem.place;
            if problem.is_warning || !problems.iter().any(is_known) {
                problems.push(problem.clone());
            }
        }
        let mut found: Vec<Value> = problems.iter().map(|p| of_problem(&text, p)).collect();
        if let Some(deep) = deep {
            found.extend(self.of_deep(&text, path, deep, false));
        }
        found
    }

    /// A diagnostic in the file `own` with this `text`. Where it is in another file, `place` may tell where this one leads
    /// there.
    fn diagnostic(
        &self,
        text: &Text,
        texts: &mut Related,
        sources: &SourceMap,
        own: Option<FileId>,
        diagnostic: &Diagnostic,
        place: impl Fn(FileId) -> Option<Span>,
    ) -> Value {
        let mut message = diagnostic.message.clone();
        if let Some(expected) = &diagnostic.expected {
            message += &format!("\nexpected: {expected}");
        }
        if let Some(hint) = &diagnostic.hint {
            message += &format!("\nhint: {hint}");
        }
        for note in &diagnostic.notes {
            message += &format!("\n{note}");
        }
        let mut related: Vec<Value> = Vec::new();
        let mut relate = |span: Span, message: &str| {
            let file = sources.file(span.file);
            let new = || Text::new(&*file.text, self.documents.encoding());
            let there = texts.entry(span.file).or_insert_with(new);
            let uri = convert::uri_of(&file.name, None);
            let Some(uri) = uri else { return };
            let location = json!({ "uri": uri, "range": there.range(span.range()) });
            related.push(json!({ "location": location, "message": message }));
        };
        for label in &diagnostic.labels {
            relate(label.span, &label.message);
        }
        let range = match diagnostic.span {
            Some(span) if Some(span.file) == own => span.range(),
            Some(span) => {
                relate(span, &diagnostic.message);
                message = format!("in {}: {message}", sources.file_line(span));
                place(span.file).map_or(0..0, Span::range)
            }
            None => 0..0,
        };
        let severity = match diagnostic.code.severity() {
            Severity::Error => 1,
            Severity::Warning => 2,
        };
        let is_unused = matches!(diagnostic.code, Code::Unused | Code::LobesNeverSampled);
        let mut value = json!({
            "range": text.range(range),
            "severity": severity,
            "code": diagnostic.code.id(),
            "source": "impasto",
            "message": message,
        });
        if !related.is_empty() {
            value["relatedInformation"] = json!(related);
        }
        if is_unused {
            value["tags"] = json!([1]);
        }
        value
    }
}

/// Where the analysed file names a file that it imports, directly.
fn import_of(
    analysis: &impasto_compiler::analysis::Analysis,
    module: Option<usize>,
) -> Option<Span> {
    let module = module?;
    let leads = |o: &&impasto_compiler::analysis::Occurrence| match &o.symbol {
        impasto_compiler::analysis::Symbol::File(m) => m.0 == module,
        impasto_compiler::analysis::Symbol::Item(item) => item.module.0 == module,
        _ => false,
    };
    analysis.occurrences.iter().find(leads).map(|o| o.span)
}

/// Why a document is not imported: at the line that says so, or at the start where that is in another file.
fn refused(text: &Text, path: &str, error: &ImportError) -> Value {
    let line = error.line.filter(|_| error.path == path);
    let (place, message) = match line {
        Some(line) => {
            let own = format!("{path}:{line}: ");
            let message = error.to_string();
            let message = message.strip_prefix(&own).unwrap_or(&message).to_owned();
            (line_of(text.as_str(), line as usize), message)
        }
        None => (0..0, error.to_string()),
    };
    json!({
        "range": text.range(place),
        "severity": 1,
        "source": "impasto",
        "message": message,
    })
}

/// The bytes of a line, counted from 1, without the blanks around it.
fn line_of(text: &str, line: usize) -> std::ops::Range<usize> {
    let mut start = 0;
    for (index, content) in text.split_inclusive('\n').enumerate() {
        if index + 1 == line {
            let end = content.trim_end().len();
            let blanks = content.len() - content.trim_start().len();
            return start + blanks.min(end)..start + end;
        }
        start += content.len();
    }
    0..0
}

fn of_problem(text: &Text, problem: &Problem) -> Value {
    let mut message = problem.message.clone();
    if let Some(instead) = &problem.instead
        && !message.contains("did you mean")
    {
        message += &format!("\nhint: did you mean `{instead}`?");
    }
    let mut value = json!({
        "range": text.range(problem.place.clone()),
        "severity": if problem.is_warning { 2 } else { 1 },
        "source": "impasto",
        "message": message,
    });
    if problem.is_warning && problem.message.contains("nothing uses") {
        value["tags"] = json!([1]);
    }
    value
}
