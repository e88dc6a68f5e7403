//! Requests that go over files: definitions, references, renaming, symbols.

use std::path::Path;
use std::sync::Arc;

use gen_lsp_types as lsp;
use impasto_compiler::analysis::{Analysis, Symbol, analyse};
use impasto_compiler::ast::ItemKind;
use impasto_compiler::source::{FileId, SourceMap, Span};
use impasto_compiler::{Loader, parser};
use impasto_runtime::input::mtlx;
use lsp_server::ErrorCode;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::requests::{At, params};
use super::{Failed, Server, convert, files};
use crate::documents::{self, Language, Overlay};
use crate::library;
use crate::material::references::{self, Definition};
use crate::material::{rename, symbols};
use crate::scene::features::{Scene, Target};
use crate::text::Text;

type Answer = Result<Value, Failed>;

impl Server<'_> {
    /// Where clients without virtual documents find copies of library files.
    fn copies(&self) -> Option<std::path::PathBuf> {
        (!self.settings.virtual_documents)
            .then(|| self.host.library_folder())
            .flatten()
    }

    fn uri(&self, path: &str) -> Option<lsp::Uri> {
        convert::uri_of(path, self.copies().as_deref())
    }

    /// The text of a file, as it is in the editor or else on the disk.
    fn text(&self, path: &str) -> Option<Text> {
        if let Some(document) = self.documents.at(path) {
            return Some(document.text.clone());
        }
        let text = match library::file_of(path) {
            Some(file) => file.text.to_owned(),
            None => documents::text_at(path)?,
        };
        Some(Text::new(text, self.documents.encoding()))
    }

    /// Adds the source that a file is read as.
    fn add_source(&self, path: &str, sources: &mut SourceMap) -> Option<FileId> {
        if !mtlx::is_document(Path::new(path)) {
            return Some(sources.add(path, self.text(path)?.as_str()));
        }
        let mut loader = Overlay::new(self.documents.texts());
        let text = String::from_utf8(loader.load(path).ok()?).ok()?;
        Some(match loader.origin(path) {
            Some(origin) => sources.add_made(path, text, origin),
            None => sources.add(path, text),
        })
    }

    /// A location for a client.
    fn location(&self, path: &str, place: std::ops::Range<usize>) -> Option<Value> {
        let text = self.text(path)?;
        Some(json!({ "uri": self.uri(path)?, "range": text.range(place) }))
    }

    pub(super) fn definition(&mut self, at: &At) -> Answer {
        let Some(document) = self.documents.get(&at.text_document.uri) else {
            return Ok(Value::Null);
        };
        let (path, language) = (document.path.clone(), document.language);
        let offset = document.text.offset(at.position);
        if language == Language::Scene {
            return Ok(self.scene_definition(&path, offset).unwrap_or(Value::Null));
        }
        let Some(analysis) = self.documents.analysis(&path) else {
            return Ok(Value::Null);
        };
        let found = analysis.occurrence_at(offset as u32);
        let definition = found.and_then(|o| match &o.symbol {
            Symbol::File(module) => Some(Definition {
                path: analysis.modules[module.0].path.clone(),
                place: 0..0,
                name: String::new(),
            }),
            symbol => references::of_symbol(&analysis, symbol),
        });
        let location = definition.and_then(|d| self.location(&d.path, d.place));
        Ok(location.unwrap_or(Value::Null))
    }

    fn scene_definition(&self, path: &str, offset: usize) -> Option<Value> {
        let target = self.with_scene(path, |scene| scene.definition(offset))?;
        match target {
            Target::Here(place) => self.location(path, place),
            Target::File(file) => {
                let uri = lsp::Uri::from_file_path(&file)
                    .ok()
                    .filter(|_| file.exists())?;
                let start = lsp::Position::new(0, 0);
                Some(json!({ "uri": uri, "range": lsp::Range::new(start, start) }))
            }
            Target::Material {
                file,
                material,
                param,
            } => {
                let path = match library::file_of(&file) {
                    Some(_) => file,
                    None => documents::normal(&Path::new(path).with_file_name(file)),
                };
                let mut sources = SourceMap::default();
                let file = self.add_source(&path, &mut sources)?;
                let (ast, _) = parser::parse(file, &sources.file(file).text);
                let wanted = |item: &&impasto_compiler::ast::Item| {
                    matches!(item.kind, ItemKind::Material(_))
                        && material.as_ref().is_none_or(|m| *m == item.name.node)
                };
                let item = ast.items.iter().find(wanted);
                let start = Span::new(sources.document(file), 0..0);
                let place = item.map_or(start, |item| {
                    let params = impasto_compiler::analysis::params(item);
                    let of_name = params.iter().find(|p| Some(&p.name.node) == param.as_ref());
                    sources.known(of_name.map_or(item.name.span, |p| p.name.span))
                });
                let path = &sources.file(place.file).name;
                self.location(path, place.range())
            }
        }
    }

    /// Where the symbol at a place is defined.
    fn defined(&mut self, at: &At) -> Option<(Arc<Analysis>, usize, Definition)> {
        let document = self.documents.get(&at.text_document.uri)?;
        let (path, offset) = (document.path.clone(), document.text.offset(at.position));
        let analysis = self.documents.analysis(&path)?;
        let definition = references::definition(&analysis, offset)?;
        Some((analysis, offset, definition))
    }

    /// Every source that may name what is defined somewhere: open ones, and those below the roots and beside the definition
    /// that have its letters; with what they mean.
    fn sources_with(&mut self, definition: &Definition) -> Vec<(String, Text, Arc<Analysis>)> {
        let mut paths: Vec<String> = self.documents.all().map(|d| d.path.clone()).collect();
        let mut roots = self.settings.roots.clone();
        if library::file_of(&definition.path).is_none() {
            roots.extend(Path::new(&definition.path).parent().map(Path::to_path_buf));
        }
        let found = files::below(&roots, &["impasto"]);
        paths.extend(found.iter().map(|p| documents::normal(p)));
        paths.push(definition.path.clone());
        paths.sort();
        paths.dedup();
        let mut sources = Vec::new();
        for path in paths {
            let Some(text) = self.text(&path) else {
                continue;
            };
            if !text.as_str().contains(&definition.name) {
                continue;
            }
            let analysis = match self.documents.analysis(&path) {
                Some(known) => known,
                None if self.documents.at(&path).is_some() => continue,
                None => {
                    let mut loader = Overlay::new(self.documents.texts());
                    Arc::new(analyse(&path, &mut loader))
                }
            };
            sources.push((path, text, analysis));
        }
        sources
    }

    pub(super) fn references(&mut self, given: Value) -> Answer {
        let at: At = params(given.clone())?;
        let declared = given.pointer("/context/includeDeclaration");
        let with_declaration = declared.and_then(Value::as_bool).unwrap_or(true);
        let Some((_, _, definition)) = self.defined(&at) else {
            return Ok(Value::Null);
        };
        let mut found: Vec<Value> = Vec::new();
        for (path, text, analysis) in self.sources_with(&definition) {
            let Some(uri) = self.uri(&path) else { continue };
            let occurrences = references::occurrences(&analysis, &definition);
            let is_wanted = |place: &std::ops::Range<usize>| {
                let is_definition =
                    library::canonical(&path) == definition.path && *place == definition.place;
                with_declaration || !is_definition
            };
            let places = occurrences.map(|o| o.span.range()).filter(is_wanted);
            found.extend(places.map(|p| json!({ "uri": uri, "range": text.range(p) })));
        }
        for (uri, text, places) in self.scenes_with(&definition) {
            let places = places.into_iter();
            found.extend(places.map(|p| json!({ "uri": uri, "range": text.range(p) })));
        }
        Ok(json!(found))
    }

    pub(super) fn prepare_rename(&mut self, at: &At) -> Answer {
        let Some(document) = self.documents.get(&at.text_document.uri) else {
            return Ok(Value::Null);
        };
        let (path, text) = (document.path.clone(), document.text.clone());
        let Some(analysis) = self.documents.analysis(&path) else {
            return Ok(Value::Null);
        };
        let target = rename::target(&analysis, text.offset(at.position));
        let target = target.map_err(|why| (ErrorCode::RequestFailed, why))?;
        Ok(json!({ "range": text.range(target.place), "placeholder": target.definition.name }))
    }

    pub(super) fn rename(&mut self, given: Value) -> Answer {
        #[derive(Deserialize)]
        #[serde(rename_all = "camelCase")]
        struct New {
            new_name: String,
        }
        let (at, New { new_name }): (At, New) = (params(given.clone())?, params(given)?);
        let failed = |why: String| (ErrorCode::RequestFailed, why);
        let Some(document) = self.documents.get(&at.text_document.uri) else {
            return Ok(Value::Null);
        };
        let (path, text) = (document.path.clone(), document.text.clone());
        let at_hand = path.clone();
        let Some(analysis) = self.documents.analysis(&path) else {
            return Ok(Value::Null);
        };
        let target = rename::target(&analysis, text.offset(at.position)).map_err(failed)?;
        let definition = target.definition;
        let mut changes = Map::new();
        let (sources, scenes) = if target.is_alias {
            (vec![(path, text, analysis)], Vec::new())
        } else {
            (
                self.sources_with(&definition),
                self.scenes_with(&definition),
            )
        };
        // The file at hand first: what is wrong with the name itself is told of no other.
        let is_other = |path: &String| *path != at_hand;
        let mut checked: Vec<_> = sources.iter().collect();
        checked.sort_by_key(|(path, ..)| is_other(path));
        for (path, _, analysis) in checked {
            if let Some(why) = rename::refused(analysis, &definition, &new_name) {
                let file = Path::new(path).file_name().unwrap_or_default();
                return Err(failed(if is_other(path) {
                    format!("{}: {why}", file.to_string_lossy())
                } else {
                    why
                }));
            }
        }
        for (path, text, analysis) in sources {
            let places = rename::changes(&analysis, &definition);
            let edits: Vec<Value> = places
                .into_iter()
                .map(|place| convert::edit(&text, place, &new_name))
                .collect();
            if let (Some(uri), false) = (self.uri(&path), edits.is_empty()) {
                changes.insert(uri.to_string(), json!(edits));
            }
        }
        for (uri, text, places) in scenes {
            let edits = places.into_iter();
            let edits: Vec<Value> = edits.map(|p| convert::edit(&text, p, &new_name)).collect();
            if !edits.is_empty() {
                changes.insert(uri.to_string(), json!(edits));
            }
        }
        Ok(json!({ "changes": changes }))
    }

    /// The places in scenes that name a material, or a parameter of one.
    fn scenes_with(
        &mut self,
        definition: &Definition,
    ) -> Vec<(lsp::Uri, Text, Vec<std::ops::Range<usize>>)> {
        let Some(source) = self.text(&definition.path) else {
            return Vec::new();
        };
        let (ast, _) = parser::parse(FileId(0), source.as_str());
        let is_material =
            |i: &&impasto_compiler::ast::Item| matches!(i.kind, ItemKind::Material(_));
        let materials: Vec<_> = ast.items.iter().filter(is_material).collect();
        let inside = |i: &&&impasto_compiler::ast::Item| {
            let place = &definition.place;
            i.span.range().contains(&place.start) || i.name.span.range() == *place
        };
        let Some(material) = materials.iter().find(inside) else {
            return Vec::new();
        };
        let is_itself = material.name.span.range() == definition.place;
        let params = impasto_compiler::analysis::params(material);
        let is_param = params
            .iter()
            .any(|p| p.name.span.range() == definition.place);
        if !is_itself && !is_param {
            return Vec::new();
        }
        let param = is_param.then_some(definition.name.as_str());
        let mut roots = self.settings.roots.clone();
        roots.extend(Path::new(&definition.path).parent().map(Path::to_path_buf));
        let open = self
            .documents
            .all()
            .filter(|d| d.language == Language::Scene);
        let mut paths: Vec<String> = open.map(|d| d.path.clone()).collect();
        let found = files::below(&roots, &["toml"]);
        paths.extend(found.iter().map(|p| documents::normal(p)));
        paths.sort();
        paths.dedup();
        let mut scenes = Vec::new();
        for path in paths {
            let Some(text) = self.text(&path) else {
                continue;
            };
            if !text.as_str().contains("[materials") {
                continue;
            }
            let mut loader = Overlay::new(self.documents.texts());
            let scene = Scene {
                path: Path::new(&path),
                text: text.as_str(),
                loader: &mut loader,
            };
            let is_only = materials.len() == 1;
            let places = scene.uses(&definition.path, &material.name.node, param, is_only);
            if let (Some(uri), false) = (self.uri(&path), places.is_empty()) {
                scenes.push((uri, text, places));
            }
        }
        scenes
    }

    pub(super) fn workspace_symbols(&mut self, given: &Value) -> Answer {
        /// Answers are for people.
        const MOST: usize = 500;
        let query = given
            .get("query")
            .and_then(Value::as_str)
            .unwrap_or_default();
        let mut paths: Vec<String> = files::below(&self.settings.roots, &["impasto"])
            .iter()
            .map(|p| documents::normal(p))
            .collect();
        let open = self
            .documents
            .all()
            .filter(|d| d.language == Language::Material);
        paths.extend(open.map(|d| d.path.clone()));
        paths.sort();
        paths.dedup();
        let mut found: Vec<Value> = Vec::new();
        for path in paths {
            if found.len() >= MOST {
                break;
            }
            let Some(text) = self.text(&path) else {
                continue;
            };
            let Some(uri) = self.uri(&path) else { continue };
            for symbol in symbols::find(text.as_str(), query) {
                found.push(json!({
                    "name": symbol.name,
                    "kind": convert::symbol_kind(symbol.kind),
                    "location": { "uri": uri, "range": text.range(symbol.place) },
                }));
            }
        }
        if !query.is_empty() {
            let copies = self.copies();
            for entry in symbols::library() {
                if found.len() >= MOST || !symbols::has_letters(&entry.item.name, query) {
                    continue;
                }
                let Some(uri) = library::uri(entry.file, copies.as_deref()) else {
                    continue;
                };
                let text = Text::new(entry.file.text, self.documents.encoding());
                found.push(json!({
                    "name": entry.item.name,
                    "kind": convert::symbol_kind(entry.item.kind),
                    "containerName": format!("std::{}", entry.file.folder),
                    "location": { "uri": uri, "range": text.range(entry.item.place.clone()) },
                }));
            }
        }
        Ok(json!(found))
    }
}
