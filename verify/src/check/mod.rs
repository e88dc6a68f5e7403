//! `impasto test`: every material of a file, and every bsdf that it defines, held to what any must keep and to what
//! its documentation promises.
//!
//! A file is read once ([`read`]); its [`Subject`]s are examined one by one ([`examine`]), so that a caller may do so
//! on several threads. What is found are diagnostics with the line of the promise, or else the name of the subject.

use std::ops::Range;

use impasto_compiler::ast::{Item, ItemKind};
use impasto_compiler::diag::{self, Code, Diagnostic};
use impasto_compiler::inspect::run_test;
use impasto_compiler::interface::{MaterialInterface, interface};
use impasto_compiler::source::{FileId, SourceMap, Span};
use impasto_compiler::{Checked, Loader, check, parser};

use crate::effort::Effort;
use crate::promise::joined_lines;

mod closures;
mod light;
mod materials;
mod measured;
mod promised;
#[cfg(test)]
mod tests;

pub use measured::{Bound, Measurement};

/// What a material or bsdf is held to, and how hard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Equal seeds give equal findings.
    pub seed: u64,
    /// How hard is tried.
    pub effort: Effort,
}

/// A file whose materials are tested.
pub struct File {
    /// Its path as the loader knows it.
    pub path: String,
    /// The texts that diagnostics point into.
    pub sources: SourceMap,
    /// What is wrong with the file; there is nothing to examine where one is an error.
    pub diagnostics: Vec<Diagnostic>,
    /// What is examined: materials and bsdfs in the order of the file, and tests.
    pub subjects: Vec<Subject>,
    text: String,
    /// What was checked of a file that has tests.
    checked: Option<Checked>,
}

/// A material, a bsdf or a test of a file.
pub struct Subject {
    /// Its name.
    pub name: String,
    /// Where that is written.
    pub span: Span,
    /// Its documentation, line by line, each with its place.
    pub lines: Vec<(String, Span)>,
    kind: Kind,
}

enum Kind {
    Material(MaterialInterface),
    Bsdf(Box<Item>),
    /// The number of a test of [`File::checked`].
    Test(usize),
}

impl Subject {
    /// Is it a material?
    pub fn is_material(&self) -> bool {
        matches!(self.kind, Kind::Material(_))
    }

    /// What it is, as a word of the language.
    pub fn kind(&self) -> &'static str {
        match self.kind {
            Kind::Material(_) => "material",
            Kind::Bsdf(_) => "bsdf",
            Kind::Test(_) => "test",
        }
    }

    /// The lines that begin with `topic`, without it.
    fn said<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = (&'a str, Span)> {
        let lines = self.lines.iter();
        lines.filter_map(move |(line, span)| Some((line.strip_prefix(topic)?.trim(), *span)))
    }

    /// The place of the first line that begins with `topic`, or else the name; without a topic, the name.
    fn place(&self, topic: &str) -> Span {
        let line = self.said(topic).next().filter(|_| !topic.is_empty());
        line.map_or(self.span, |(_, span)| span)
    }

    /// A line that states a promise in no form that is known.
    fn unread(&self, topic: &str, span: Span, form: &str) -> Diagnostic {
        let message = format!("`{}`: the line `{topic}` cannot be read", self.name);
        Diagnostic::new(Code::UnreadPromise, span, message).expected(form)
    }
}

/// What an examination gave.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// What is wrong.
    pub diagnostics: Vec<Diagnostic>,
    /// How many things were looked at.
    pub checks: usize,
    /// What was measured on the way.
    pub measured: Vec<Measurement>,
}

impl Verdict {
    /// Something was looked at, and this is wrong with it, if anything is.
    fn add(&mut self, found: Option<Diagnostic>) {
        self.checks += 1;
        self.diagnostics.extend(found);
    }
}

/// Reads a file, and finds what is to be examined in it.
pub fn read(path: &str, loader: &mut dyn Loader) -> File {
    let found = interface(path, loader);
    let mut file = File {
        path: path.to_owned(),
        sources: found.sources,
        diagnostics: found.diagnostics,
        subjects: Vec::new(),
        text: String::new(),
        checked: None,
    };
    if diag::has_errors(&file.diagnostics) {
        return file;
    }
    // Behind it come the documents that it was made from, the first by the same name.
    let own = file.sources.files().filter(|(id, _)| !id.is_library());
    let named = own.into_iter().find(|(_, f)| f.name == path);
    let Some((id, text)) = named.map(|(id, f)| (id, f.text.to_string())) else {
        return file;
    };
    let (ast, _) = parser::parse(id, &text);
    if !ast.tests.is_empty() {
        let checked = check(path, loader);
        if diag::has_errors(&checked.diagnostics) {
            file.sources = checked.sources;
            file.diagnostics = checked.diagnostics;
            return file;
        }
        file.checked = Some(checked);
    }
    let mut materials = found.materials.into_iter();
    let mut next = materials.next();
    for item in ast.items {
        let (name, span) = (item.name.node.clone(), item.name.span);
        let lines = lines(&item, id, &text);
        let is_edf = |item: &Item| match &item.kind {
            ItemKind::Closure(def) => !def.methods.iter().any(|m| m.name.node == "sample"),
            _ => true,
        };
        let kind = match &item.kind {
            // Materials that are private have no interface.
            ItemKind::Material(_) if next.as_ref().is_some_and(|m| m.name == name) => {
                let told = std::mem::replace(&mut next, materials.next());
                told.map(Kind::Material)
            }
            ItemKind::Closure(_) if !is_edf(&item) => Some(Kind::Bsdf(Box::new(item))),
            _ => None,
        };
        file.subjects.extend(kind.map(|kind| Subject {
            name,
            span,
            lines,
            kind,
        }));
    }
    let tests = file.checked.iter().flat_map(|c| c.tests.iter().enumerate());
    let tests = tests.map(|(index, test)| Subject {
        name: test.title.clone(),
        span: test.span,
        lines: Vec::new(),
        kind: Kind::Test(index),
    });
    file.subjects.extend(tests.collect::<Vec<_>>());
    file.text = text;
    file
}

/// Holds a subject of a file to all that it must keep.
pub fn examine(
    file: &File,
    subject: &Subject,
    loader: &mut dyn Loader,
    options: Options,
) -> Verdict {
    match &subject.kind {
        Kind::Material(told) => materials::examine((file, subject), told, loader, options),
        Kind::Bsdf(item) => closures::examine((file, subject), item, loader, options),
        Kind::Test(index) => asserted(file, *index),
    }
}

/// Runs a test of a file.
fn asserted(file: &File, index: usize) -> Verdict {
    let checked = file.checked.as_ref();
    let Some((checked, test)) = checked.and_then(|c| Some((c, c.tests.get(index)?))) else {
        return Verdict::default();
    };
    Verdict {
        diagnostics: run_test(checked, test),
        checks: test.assertions.len(),
        measured: Vec::new(),
    }
}

/// The seed of a subject: what else is tested changes none of its numbers.
fn seed_of(subject: &Subject, options: Options) -> u64 {
    // FNV-1a.
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = subject.name.bytes().fold(0xcbf2_9ce4_8422_2325, step);
    hash.wrapping_add(options.seed) >> 20
}

/// The lines of the doc comment above an item, each with its place; one that goes on in the next is one.
fn lines(item: &Item, file: FileId, text: &str) -> Vec<(String, Span)> {
    let above = text.get(..item.span.start as usize).unwrap_or("");
    let mut places: Vec<Range<usize>> = Vec::new();
    let mut end = above.len();
    for line in above.split_inclusive('\n').rev() {
        let start = end - line.len();
        let written = line.trim();
        if written.starts_with("///") {
            let from = start + (line.len() - line.trim_start().len());
            places.push(from..from + written.len());
        } else if !(written.is_empty() && places.is_empty()) {
            break;
        }
        end = start;
    }
    places.reverse();
    let spans: Vec<Span> = places.into_iter().map(|p| Span::new(file, p)).collect();
    let mut at = 0;
    let whole = joined_lines(&item.docs).into_iter().map(|(line, count)| {
        let span = spans
            .get(at..at + count)
            .and_then(|s| Some(s.first()?.to(*s.last()?)));
        at += count;
        (line, span.unwrap_or(item.name.span))
    });
    whole.collect()
}
