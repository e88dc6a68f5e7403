//! MaterialX 1.36 to 1.39: documents as sources, one source a document.

mod call;
mod color_spaces;
mod document;
pub(crate) mod export;
mod graph;
mod helpers;
mod material;
mod names;
pub(crate) mod nodes;
mod origin;
mod parameters;
mod roots;
mod source;
mod text;
mod types;
mod units;
mod upgrade;
mod value;
mod xml;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use impasto_compiler::diag::Diagnostic;
use impasto_compiler::diag::render::ordered;
use impasto_compiler::source::{IMPORTED, Origin};
use impasto_compiler::{Loader, check};

use crate::error::ImportError;
use crate::files::Files;
use crate::imported::{Assignment, Imported, Options};
use crate::mtlx::document::{Document, Id};
use crate::mtlx::graph::Graphs;
use crate::mtlx::names::Names;
use crate::mtlx::roots::Root;
use crate::mtlx::source::SourceText;

/// Most errors that are listed.
const MOST_ERRORS: usize = 64;

/// Most materials that a source may have (docs/language.md).
const MOST_MATERIALS: usize = 1024;

/// Imports the MaterialX document at `path`.
pub(crate) fn import(
    path: &str,
    files: &mut dyn Files,
    options: &Options,
) -> Result<Imported, Vec<ImportError>> {
    let document = xml::read(path, files, options.allow_outside)?;
    upgrade::check_version(&document).map_err(|error| vec![error])?;
    let mut graphs = Graphs::new(&document);
    let folder = path.rfind('/').map_or("", |end| &path[..=end]);
    let mut source = SourceText::new(options.in_place.then(|| folder.to_owned()));
    let roots = roots::find(&document, &mut source);
    if roots.len() > MOST_MATERIALS {
        let message = format!(
            "the document has {} materials or nodes to show",
            roots.len()
        );
        let error = ImportError::new(path, message);
        return Err(vec![error.expected(format!("at most {MOST_MATERIALS}"))]);
    }
    let mut errors: Vec<ImportError> = Vec::new();
    let mut materials: HashMap<Id, String> = HashMap::new();
    let mut names = Vec::new();
    for root in &roots {
        let name = source.names.unique(&root.name(&document), "material");
        match roots::written(root, &name, &mut graphs, &mut source, options) {
            Ok(Some(material)) => {
                source.add(material);
                materials.insert(root.element(), name.clone());
                names.push(name);
            }
            Ok(None) => {}
            Err(more) => {
                // Materials share nodes: each error is listed once.
                for error in more {
                    if !errors.contains(&error) && errors.len() < MOST_ERRORS {
                        errors.push(error);
                    }
                }
                if errors.len() >= MOST_ERRORS {
                    break;
                }
            }
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    if names.is_empty() {
        let error = ImportError::new(path, "there is no material in the document");
        let error = error
            .expected("a `surfacematerial`, a surface shader, or an output of colors or numbers");
        let said = source
            .warnings
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>();
        return Err(vec![error.maybe_hint(said.first().cloned())]);
    }
    let file = file_name(path);
    let header = format!("{IMPORTED}{}.\n", path.rsplit('/').next().unwrap_or(path));
    let (text, marks) = source
        .finished(path, &header)
        .map_err(|error| vec![error])?;
    let origin = origin::origin(&document, &text, &marks);
    let mut compiled = Compiled {
        text: &text,
        origin: Arc::new(origin),
    };
    if !options.unchecked {
        compiled.check(path)?;
    }
    let textures = source.textures(&text, files);
    let assignments = assignments(&document, &roots, &materials, &mut source);
    let origin = Arc::unwrap_or_clone(compiled.origin);
    let text = if options.in_place {
        text
    } else {
        origin::commented(&document, &text, &marks)
    };
    Ok(Imported {
        textures,
        origin,
        warnings: source.warnings,
        materials: names.into_iter().map(|name| (name, file.clone())).collect(),
        assignments,
        files: vec![(file, text)],
    })
}

/// A source as the compiler reads it, with its origin.
struct Compiled<'t> {
    text: &'t str,
    origin: Arc<Origin>,
}

impl Loader for Compiled<'_> {
    fn load(&mut self, _: &str) -> Result<Vec<u8>, String> {
        Ok(self.text.as_bytes().to_vec())
    }

    fn origin(&mut self, _: &str) -> Option<Arc<Origin>> {
        Some(self.origin.clone())
    }
}

impl Compiled<'_> {
    /// What the compiler says against the source: nothing is written that does not compile. Nodes have no such errors of
    /// their own, but what they are put together to may have, such as a medium that varies over its surface.
    fn check(&mut self, path: &str) -> Result<(), Vec<ImportError>> {
        let checked = check(path, self);
        let shown = ordered(&checked.sources, &checked.diagnostics);
        let errors = shown.into_iter().filter(Diagnostic::is_error);
        let told = errors.map(|problem| {
            let (code, message) = (problem.code.id(), &problem.message);
            let message = format!("{code}: {message}\n  {}", problem.notes.join("\n  "));
            let message = message.trim_end();
            let error = match problem.span {
                Some(span) => {
                    let (line, _) = checked.sources.line_column(span);
                    let file = checked.sources.file(span.file).name.as_str();
                    ImportError::new(file, message).line(line as u32)
                }
                None => ImportError::new(path, message),
            };
            let mut error = error.maybe_hint(problem.hint);
            error.expected = problem.expected;
            error
        });
        let problems: Vec<ImportError> = told.take(MOST_ERRORS).collect();
        if problems.is_empty() {
            Ok(())
        } else {
            Err(problems)
        }
    }
}

/// The source of a document: its name, as other sources can import it.
fn file_name(path: &str) -> PathBuf {
    let file = path.rsplit(['/', '\\']).next().unwrap_or(path);
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    PathBuf::from(format!(
        "{}.impasto",
        Names::default().unique(stem, "document")
    ))
}

/// What the looks of the document say.
fn assignments(
    document: &Document,
    roots: &[Root],
    materials: &HashMap<Id, String>,
    source: &mut SourceText,
) -> Vec<Assignment> {
    let by_name: HashMap<&str, &String> = roots
        .iter()
        .filter_map(|root| {
            let name = materials.get(&root.element())?;
            Some((document.name(root.element()), name))
        })
        .collect();
    let mut found = Vec::new();
    for look in document.top().filter(|id| document.category(*id) == "look") {
        for assign in document.children(look, "materialassign") {
            let asked = document.attribute(assign, "material").unwrap_or_default();
            let geometry = document.attribute(assign, "geom");
            let collection = document.attribute(assign, "collection");
            match (by_name.get(asked), geometry.or(collection)) {
                (Some(material), Some(geometry)) => found.push(Assignment {
                    look: document.name(look).to_owned(),
                    geometry: geometry.to_owned(),
                    material: (*material).clone(),
                }),
                (None, _) => {
                    let message = format!("there is no material `{asked}` to assign");
                    source.warn(document.warning(assign, message));
                }
                (_, None) => {
                    let message = format!("`{asked}` is assigned to no geometry");
                    source.warn(document.warning(assign, message));
                }
            }
        }
    }
    found
}
