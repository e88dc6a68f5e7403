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
mod parameters;
mod roots;
mod source;
mod text;
mod types;
mod upgrade;
mod value;
mod xml;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use impasto_compiler::diag::Diagnostic;
use impasto_compiler::{MemoryLoader, check};

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
    let mut source = SourceText::new();
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
        match roots::written(root, &name, &mut graphs, &mut source, options.allow_outside) {
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
    let header = format!(
        "//! Imported from {}.\n",
        path.rsplit('/').next().unwrap_or(path)
    );
    let text = source
        .finished(path, &header)
        .map_err(|error| vec![error])?;
    let problems = if options.unchecked {
        Vec::new()
    } else {
        problems(path, &file, &text)
    };
    if !problems.is_empty() {
        return Err(problems);
    }
    let textures = source.textures(&text, files);
    let assignments = assignments(&document, &roots, &materials, &mut source);
    Ok(Imported {
        textures,
        warnings: source.warnings,
        materials: names.into_iter().map(|name| (name, file.clone())).collect(),
        assignments,
        files: vec![(file, text)],
    })
}

/// What the compiler says against a source: nothing is written that does not compile. Nodes have no such errors of their
/// own, but what they are put together to may have, such as a medium that varies over its surface.
fn problems(path: &str, file: &Path, text: &str) -> Vec<ImportError> {
    let name = file.to_string_lossy();
    let mut loader = MemoryLoader::default();
    loader.add(name.as_ref(), text);
    let checked = check(&name, &mut loader);
    let errors = checked.diagnostics.into_iter().filter(Diagnostic::is_error);
    let told = errors.map(|problem| {
        let line = problem.span.map(|span| {
            let (line, _) = checked.sources.line_column(span);
            let text = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
            format!(" in `{}`", text.trim())
        });
        let message = format!(
            "what the document becomes does not compile: {}: {}{}",
            problem.code.id(),
            problem.message,
            line.unwrap_or_default()
        );
        let mut error = ImportError::new(path, message).maybe_hint(problem.hint);
        error.expected = problem.expected;
        error
    });
    told.take(MOST_ERRORS).collect()
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
