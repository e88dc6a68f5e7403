//! Source texts and positions in them.
//!
//! Every token, node and IR expression carries a [`Span`], so that a diagnostic,
//! a WGSL comment or a cost can name the line it comes from.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

mod origin;

pub use origin::{IMPORTED, Origin, Part, Place};

/// Longest source text that is read, in bytes; a longer one is an error, not a wait.
pub const MAX_SOURCE_BYTES: usize = 1 << 20;

/// A source text of a [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u32);

impl FileId {
    /// Is it a file of the standard library? Those come first, in every compilation.
    pub fn is_library(self) -> bool {
        (self.0 as usize) < impasto_stdlib::files().len()
    }
}

/// A half-open byte range in one file.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The span of `range` in `file`.
    pub fn new(file: FileId, range: Range<usize>) -> Self {
        let clamp = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            file,
            start: clamp(range.start),
            end: clamp(range.end),
        }
    }

    /// The smallest span that covers both; `other` is taken to be in the same file.
    pub fn to(self, other: Span) -> Self {
        Self {
            file: self.file,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }

    /// The span as a byte range.
    pub fn range(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

impl std::fmt::Debug for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}..{}", self.start, self.end)
    }
}

/// A value with the place it was written at.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Spanned<T> {
    /// The value.
    pub node: T,
    /// Where it was written.
    pub span: Span,
}

impl<T: std::fmt::Debug> std::fmt::Debug for Spanned<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} @ {:?}", self.node, self.span)
    }
}

/// A source text with its name and line starts.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// The path as the user gave it, or `std::bsdf/diffuse.impasto` for the standard library.
    pub name: String,
    /// The text.
    pub text: Cow<'static, str>,
    /// Found when something asks for a line: of most files, nothing does.
    line_starts: OnceLock<Vec<u32>>,
    /// What it was made from, and the id of the first document of that.
    made_from: Option<(Arc<Origin>, FileId)>,
}

/// Where in a document a place of a source comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written<'s> {
    /// The element.
    pub span: Span,
    /// What it is, in words.
    pub what: &'s str,
}

impl SourceFile {
    fn line_starts(&self) -> &[u32] {
        self.line_starts.get_or_init(|| {
            let newlines = self.text.match_indices('\n').map(|(i, _)| i as u32 + 1);
            std::iter::once(0).chain(newlines).collect()
        })
    }

    /// The line, from 0, that byte `at` is in; the last one behind the end.
    pub fn line_index(&self, at: usize) -> usize {
        self.line_starts()
            .partition_point(|&start| start as usize <= at)
            .saturating_sub(1)
    }

    /// The bytes of a line, counted from 0, with its line break; empty behind the last line.
    pub fn line_range(&self, line: usize) -> Range<usize> {
        let start = |line: usize| {
            let start = self.line_starts().get(line);
            start.map_or(self.text.len(), |&start| start as usize)
        };
        start(line)..start(line + 1)
    }
}

/// Every source text of one compilation, in the order they were read.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

impl SourceMap {
    /// Adds a text and returns its id.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        self.add_text(name.into(), Cow::Owned(text.into()))
    }

    /// Adds a text of the library, without a copy of it.
    pub(crate) fn add_library(&mut self, name: String, text: &'static str) -> FileId {
        self.add_text(name, Cow::Borrowed(text))
    }

    fn add_text(&mut self, name: String, text: Cow<'static, str>) -> FileId {
        self.files.push(SourceFile {
            name,
            text,
            line_starts: OnceLock::new(),
            made_from: None,
        });
        FileId(self.files.len() as u32 - 1)
    }

    /// Adds a text that was made from documents, and these behind it.
    pub fn add_made(
        &mut self,
        name: impl Into<String>,
        text: impl Into<String>,
        origin: Arc<Origin>,
    ) -> FileId {
        let name = name.into();
        let id = self.add(name.as_str(), text);
        // The path of the source may be relative; those of documents are told as it is.
        let own = origin.documents().first().map_or("", |(path, _)| path);
        let base = own.strip_suffix(name.as_str()).unwrap_or_default();
        for (path, text) in origin.documents() {
            let path = path.strip_prefix(base).unwrap_or(path);
            self.add(path, &**text);
        }
        self.files[id.0 as usize].made_from = Some((origin, FileId(id.0 + 1)));
        id
    }

    /// The document that a source was made from; the source itself if it was written as it is.
    pub fn document(&self, id: FileId) -> FileId {
        let made_from = &self.file(id).made_from;
        made_from.as_ref().map_or(id, |(_, first)| *first)
    }

    /// Where in a document a place comes from, and the user of that if it is a definition; nothing for what was written
    /// as it is.
    pub fn written(&self, span: Span) -> Option<(Written<'_>, Option<Written<'_>>)> {
        let (origin, first) = self.file(span.file).made_from.as_ref()?;
        let part = origin.part(span.range())?;
        fn told(first: FileId, place: &Place) -> Written<'_> {
            let file = FileId(first.0 + place.document as u32);
            Written {
                span: Span::new(file, place.range.clone()),
                what: &place.what,
            }
        }
        let user = part.user.as_ref();
        Some((
            told(*first, &part.place),
            user.map(|place| told(*first, place)),
        ))
    }

    /// The place in a document, `marble.mtlx:12`, that a comment names as the origin of what is at `span`.
    pub fn noted(&self, span: Span) -> Option<&str> {
        origin::noted(&self.file(span.file).text, span.start as usize)
    }

    /// The place that people know: in a document, if the source was made from one.
    pub fn known(&self, span: Span) -> Span {
        self.written(span).map_or(span, |(place, _)| place.span)
    }

    /// The file of `id`.
    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[id.0 as usize]
    }

    /// All files with their ids.
    pub fn files(&self) -> impl Iterator<Item = (FileId, &SourceFile)> {
        self.files
            .iter()
            .enumerate()
            .map(|(i, f)| (FileId(i as u32), f))
    }

    /// Line and column of the start of `span`, both from 1; columns count characters.
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let file = self.file(span.file);
        let line_starts = file.line_starts();
        let line = line_starts.partition_point(|&s| s <= span.start).max(1);
        let start = line_starts[line - 1] as usize;
        let end = (span.start as usize).min(file.text.len());
        let column = file.text.get(start..end).map_or(0, |s| s.chars().count()) + 1;
        (line, column)
    }

    /// `name:line` of a span, as written in WGSL comments; of a document, where the source was made from one.
    pub fn file_line(&self, span: Span) -> String {
        let span = self.known(span);
        let file = self.file(span.file);
        format!("{}:{}", file.name, file.line_index(span.start as usize) + 1)
    }
}
