//! Requests of a client, one by one.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use gen_lsp_types as lsp;
use impasto_compiler::analysis::{Analysis, analyse};
use impasto_compiler::ast::ItemKind;
use impasto_compiler::format::{self, Unformatted};
use impasto_compiler::source::FileId;
use lsp_server::ErrorCode;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::capabilities::{COST_DIFF, PREVIEW, SHOW_PREVIEW};
use super::{Failed, Server, convert};
use crate::documents::{Document, Language, Overlay, path_of};
use crate::library;
use crate::margin;
use crate::material::completion::{self, Known};
use crate::material::{actions, colors, hover, outline, references, signature, tokens};
use crate::text::Text;

type Answer = Result<Value, Failed>;

/// A place in a file.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct At {
    pub(super) text_document: lsp::TextDocumentIdentifier,
    pub(super) position: lsp::Position,
}

/// A file.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct In {
    text_document: lsp::TextDocumentIdentifier,
}

/// A range of a file.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Within {
    text_document: lsp::TextDocumentIdentifier,
    range: lsp::Range,
}

/// The parameters of a request.
pub(super) fn params<T: DeserializeOwned>(params: Value) -> Result<T, Failed> {
    serde_json::from_value(params).map_err(|e| (ErrorCode::InvalidParams, e.to_string()))
}

impl Server<'_> {
    /// Answers a request. What is asked of a file that is not open is answered with nothing.
    pub(super) fn asked(&mut self, method: &str, given: Value) -> Answer {
        match method {
            "textDocument/completion" => {
                let trigger = given.pointer("/context/triggerCharacter");
                let trigger = trigger.and_then(Value::as_str).map(str::to_owned);
                self.completion(&params(given)?, trigger.as_deref())
            }
            "textDocument/hover" => self.hover(&params(given)?),
            "textDocument/signatureHelp" => self.signature_help(&params(given)?),
            "textDocument/definition" => self.definition(&params(given)?),
            "textDocument/references" => self.references(given),
            "textDocument/documentHighlight" => self.highlights(&params(given)?),
            "textDocument/documentSymbol" => self.document_symbols(&params(given)?),
            "workspace/symbol" => self.workspace_symbols(&given),
            "textDocument/codeAction" => self.code_actions(given),
            "textDocument/codeLens" => self.lenses(&params(given)?),
            "textDocument/formatting" => self.formatting(&params(given)?),
            "textDocument/rangeFormatting" => self.range_formatting(&params(given)?),
            "textDocument/prepareRename" => self.prepare_rename(&params(given)?),
            "textDocument/rename" => self.rename(given),
            "textDocument/documentColor" => self.document_colors(&params(given)?),
            "textDocument/colorPresentation" => self.color_presentations(given),
            "textDocument/foldingRange" => self.folding(&params(given)?),
            "textDocument/selectionRange" => self.selection(given),
            "textDocument/semanticTokens/full" => self.tokens(&params(given)?),
            "textDocument/semanticTokens/range" => self.tokens_within(&params(given)?),
            "textDocument/inlayHint" => self.inlay_hints(&params(given)?),
            "workspace/executeCommand" => self.command(given),
            "impasto/libraryText" => library_text(&given),
            other => Err((
                ErrorCode::MethodNotFound,
                format!("`{other}` is nothing that this server does"),
            )),
        }
    }

    fn document(&self, of: &lsp::TextDocumentIdentifier) -> Option<&Document> {
        self.documents.get(&of.uri)
    }

    /// An open source with its text and what it means.
    fn source(&mut self, of: &lsp::TextDocumentIdentifier) -> Option<(Text, Arc<Analysis>)> {
        let document = self.document(of)?;
        let (path, text) = (document.path.clone(), document.text.clone());
        Some((text, self.documents.analysis(&path)?))
    }

    fn is_scene(&self, of: &lsp::TextDocumentIdentifier) -> bool {
        self.document(of)
            .is_some_and(|d| d.language == Language::Scene)
    }

    /// `trigger` is the character after which a client asks by itself.
    fn completion(&mut self, at: &At, trigger: Option<&str>) -> Answer {
        let Some(document) = self.document(&at.text_document) else {
            return Ok(Value::Null);
        };
        let (path, text) = (document.path.clone(), document.text.clone());
        let offset = text.offset(at.position);
        if document.language == Language::Scene {
            let (word, list) = self.with_scene(&path, |scene| scene.complete(offset));
            let settings = &self.settings;
            let item = |(i, p)| convert::completion(&text, &word, i, p, Vec::new(), settings);
            let items: Vec<Value> = list.iter().enumerate().map(item).collect();
            return Ok(json!({ "isIncomplete": false, "items": items }));
        }
        let Some((now, last_good)) = self.documents.both(&path) else {
            return Ok(Value::Null);
        };
        // A list that nobody asked for must not take the next key, as a line break.
        if !completion::is_asked_by(text.as_str(), offset, trigger) {
            return Ok(Value::Null);
        }
        let texts = self.documents.texts();
        let mut patched = |range: std::ops::Range<usize>, new: &str| {
            let mut changed = text.as_str().to_owned();
            changed.replace_range(range, new);
            let mut texts = (*texts).clone();
            texts.insert(path.clone(), changed.into());
            analyse(&path, &mut Overlay::new(Arc::new(texts)))
        };
        let mut known = Known {
            text: text.as_str(),
            path: &path,
            now: &now,
            last_good: last_good.as_deref(),
            analyse: &mut patched,
        };
        let proposals = completion::complete(&mut known, offset);
        let settings = &self.settings;
        let item = |(index, proposal): (usize, &completion::Proposal)| {
            let import = proposal.import.as_ref();
            let import = import.and_then(|p| completion::import_edit(&now, text.as_str(), p));
            let more = import.map(|(range, new)| convert::edit(&text, range, &new));
            let more: Vec<Value> = more.into_iter().collect();
            convert::completion(&text, &proposals.word, index, proposal, more, settings)
        };
        let items: Vec<Value> = proposals.list.iter().enumerate().map(item).collect();
        Ok(json!({ "isIncomplete": false, "items": items }))
    }

    fn hover(&mut self, at: &At) -> Answer {
        let Some(document) = self.document(&at.text_document) else {
            return Ok(Value::Null);
        };
        let (path, text) = (document.path.clone(), document.text.clone());
        let offset = text.offset(at.position);
        let found = if self.is_scene(&at.text_document) {
            self.with_scene(&path, |scene| scene.hover(offset))
        } else {
            let both = self.documents.both(&path);
            both.and_then(|(now, last_good)| hover::hover(&now, last_good.as_deref(), offset))
        };
        Ok(match found {
            Some((markdown, range)) => json!({
                "contents": convert::documentation(&markdown, self.settings.markdown.hover),
                "range": text.range(range),
            }),
            None => Value::Null,
        })
    }

    fn signature_help(&mut self, at: &At) -> Answer {
        let Some(document) = self.document(&at.text_document) else {
            return Ok(Value::Null);
        };
        let (path, text) = (document.path.clone(), document.text.clone());
        let Some((now, last_good)) = self.documents.both(&path) else {
            return Ok(Value::Null);
        };
        let offset = text.offset(at.position);
        let found = signature::signatures(text.as_str(), &now, last_good.as_deref(), offset);
        if found.is_empty() {
            return Ok(Value::Null);
        }
        let shows_markdown = self.settings.markdown.signature;
        let signature = |s: &signature::Signature| {
            let params = s.params.iter().zip(&s.docs_of_params);
            let params: Vec<Value> = params
                .map(|(range, docs)| {
                    // Offsets in a label count units of UTF-16.
                    let units = |at: usize| s.label[..at].encode_utf16().count();
                    let mut param = json!({ "label": [units(range.start), units(range.end)] });
                    if !docs.is_empty() {
                        param["documentation"] = convert::documentation(docs, shows_markdown);
                    }
                    param
                })
                .collect();
            let mut value = json!({ "label": s.label, "parameters": params });
            if let Some(active) = s.active {
                value["activeParameter"] = json!(active);
            }
            if !s.docs.is_empty() {
                value["documentation"] = convert::documentation(&s.docs, shows_markdown);
            }
            value
        };
        let all: Vec<Value> = found.iter().map(signature).collect();
        let mut help = json!({ "signatures": all, "activeSignature": 0 });
        if let Some(active) = found[0].active {
            help["activeParameter"] = json!(active);
        }
        Ok(help)
    }

    fn highlights(&mut self, at: &At) -> Answer {
        let Some((text, analysis)) = self.source(&at.text_document) else {
            return Ok(Value::Null);
        };
        let found = references::highlights(&analysis, text.offset(at.position));
        let highlight = |(range, is_written)| {
            let kind = if is_written { 3 } else { 2 };
            json!({ "range": text.range(range), "kind": kind })
        };
        Ok(found.into_iter().map(highlight).collect())
    }

    fn document_symbols(&mut self, of: &In) -> Answer {
        if self.is_scene(&of.text_document) {
            return Ok(self.scene_symbols(&of.text_document));
        }
        let Some((text, analysis)) = self.source(&of.text_document) else {
            return Ok(Value::Null);
        };
        let entries = analysis
            .ast()
            .map_or(Vec::new(), |ast| outline::outline(ast));
        let entries = entries.iter();
        Ok(entries
            .map(|e| convert::document_symbol(&text, e))
            .collect())
    }

    fn code_actions(&mut self, given: Value) -> Answer {
        let of: Within = params(given.clone())?;
        let uri = of.text_document.uri.clone();
        if self.is_scene(&of.text_document) {
            return Ok(self.scene_actions(&of.text_document, of.range));
        }
        let Some((text, analysis)) = self.source(&of.text_document) else {
            return Ok(Value::Null);
        };
        let only = given.pointer("/context/only").and_then(Value::as_array);
        let is_wanted = only.is_none_or(|kinds| kinds.iter().any(|kind| kind == "quickfix"));
        if library::file_of(&path_of(&uri)).is_some() || !is_wanted {
            return Ok(json!([]));
        }
        let range = text.offset(of.range.start)..text.offset(of.range.end);
        let shown = given
            .pointer("/context/diagnostics")
            .and_then(Value::as_array);
        let shown = shown.cloned().unwrap_or_default();
        let action = |action: actions::Action| {
            let edits = action.edits.into_iter();
            let edits: Vec<Value> = edits
                .map(|(r, new)| convert::edit(&text, r, &new))
                .collect();
            let repaired = action.repairs.map(|index| &analysis.diagnostics[index]);
            let of_it: Vec<&Value> = repaired.map_or(Vec::new(), |d| {
                let start = d.span.map(|s| json!(text.position(s.start as usize)));
                let is_it = |v: &&Value| {
                    v["code"] == d.code.id() && Some(&v["range"]["start"]) == start.as_ref()
                };
                shown.iter().filter(is_it).collect()
            });
            let changes = json!({ uri.as_str(): edits });
            json!({
                "title": action.title,
                "kind": "quickfix",
                "diagnostics": of_it,
                "edit": { "changes": changes },
            })
        };
        let mut repaired = HashSet::new();
        let found = actions::actions(&analysis, range).into_iter().map(|found| {
            // Of what repairs a problem, the first is the likeliest.
            let is_first = found.repairs.is_some_and(|index| repaired.insert(index));
            let mut value = action(found);
            if is_first {
                value["isPreferred"] = json!(true);
            }
            value
        });
        Ok(found.collect())
    }

    fn lenses(&mut self, of: &In) -> Answer {
        if !self.settings.wanted.cost.lens {
            return Ok(json!([]));
        }
        if self.is_scene(&of.text_document) {
            return Ok(self.scene_lenses(&of.text_document));
        }
        let Some((text, analysis)) = self.source(&of.text_document) else {
            return Ok(Value::Null);
        };
        let Some(document) = self.document(&of.text_document) else {
            return Ok(Value::Null);
        };
        if library::file_of(&document.path).is_some() {
            return Ok(json!([]));
        }
        let (uri, path) = (document.uri.clone(), document.path.clone());
        let items = analysis.ast().map_or(&[][..], |ast| &ast.items);
        let is_only = super::materials_of(&analysis).len() == 1;
        let mut lenses = Vec::new();
        for item in items
            .iter()
            .filter(|i| matches!(i.kind, ItemKind::Material(_)))
        {
            let range = text.range(item.name.span.range());
            let mut lens = |title: String, command: &str, arguments: Value| {
                let command = json!({ "title": title, "command": command, "arguments": arguments });
                lenses.push(json!({ "range": range, "command": command }));
            };
            let name = &item.name.node;
            if let Some(title) = document.margin.lens(name) {
                lens(title, COST_DIFF, json!([uri, name]));
            }
            if let Some((title, why)) = self.kernel_of(&path, name, is_only) {
                lens(title, "impasto.explain", json!([why]));
            }
            let preview = if self.settings.has_commands {
                SHOW_PREVIEW
            } else {
                PREVIEW
            };
            lens("show preview".into(), preview, json!([uri]));
        }
        Ok(json!(lenses))
    }

    /// Which kernel the plan of the scene at hand gives a material of a file, and why.
    fn kernel_of(&self, path: &str, material: &str, is_only: bool) -> Option<(String, String)> {
        let scene = self.settings.scene()?;
        let plan = self.plans.get(&scene)?.as_ref().ok()?;
        let name = scene
            .parent()
            .and_then(|p| p.file_name())
            .unwrap_or_default();
        let name = format!(
            "{}/{}",
            name.to_string_lossy(),
            scene.file_name()?.to_string_lossy()
        );
        let is_it = |m: &&crate::host::PlannedMaterial| {
            m.file == Path::new(path)
                && m.material
                    .as_deref()
                    .map_or(is_only, |named| named == material)
        };
        let planned = plan.materials.iter().find(is_it)?;
        let why = format!("{}\n{}", planned.why, plan.about);
        Some((margin::kernel(planned, &name), why))
    }

    fn inlay_hints(&mut self, of: &Within) -> Answer {
        let Some(document) = self.document(&of.text_document) else {
            return Ok(Value::Null);
        };
        if !self.settings.wanted.cost.inlay_hints {
            return Ok(json!([]));
        }
        let text = &document.text;
        let asked = of.range.start.line as usize..=of.range.end.line as usize;
        let hints = document
            .margin
            .hints()
            .filter(|(line, ..)| asked.contains(line));
        let hint = |(line, short, long): (usize, String, String)| {
            json!({
                "position": text.position(text.line(line).end),
                "label": short,
                "tooltip": long,
                "paddingLeft": true,
            })
        };
        Ok(hints.map(hint).collect())
    }

    fn formatting(&mut self, of: &In) -> Answer {
        Ok(json!(self.formatted(&of.text_document)?))
    }

    fn range_formatting(&mut self, of: &Within) -> Answer {
        let Some(edits) = self.formatted(&of.text_document)? else {
            return Ok(Value::Null);
        };
        // What is formatted is formatted as a whole; of that, what the range touches.
        let touches = |e: &&lsp::TextEdit| {
            e.range.start.line <= of.range.end.line && of.range.start.line <= e.range.end.line
        };
        Ok(json!(edits.iter().filter(touches).collect::<Vec<_>>()))
    }

    /// The edits that lay a source out.
    fn formatted(
        &self,
        of: &lsp::TextDocumentIdentifier,
    ) -> Result<Option<Vec<lsp::TextEdit>>, Failed> {
        let is_own =
            |d: &&Document| d.language == Language::Material && library::file_of(&d.path).is_none();
        let Some(document) = self.document(of).filter(is_own) else {
            return Ok(None);
        };
        let text = &document.text;
        match format::format(FileId(0), text.as_str()) {
            Ok(formatted) => Ok(Some(text.edits_to(&formatted))),
            Err(Unformatted::Syntax(_)) => Err((
                ErrorCode::RequestFailed,
                "sources with syntax errors are not formatted".into(),
            )),
            Err(Unformatted::Lost) => Err((
                ErrorCode::RequestFailed,
                "formatting would lose something: this is a defect of the formatter".into(),
            )),
        }
    }

    fn document_colors(&mut self, of: &In) -> Answer {
        let Some(document) = self.document(&of.text_document) else {
            return Ok(Value::Null);
        };
        let (path, text) = (document.path.clone(), document.text.clone());
        let found = if self.is_scene(&of.text_document) {
            self.with_scene(&path, |scene| scene.swatches())
        } else {
            colors::swatches(text.as_str())
        };
        let color = |swatch: &colors::Swatch| {
            let [red, green, blue] = swatch.srgb;
            let color = json!({ "red": red, "green": green, "blue": blue, "alpha": 1.0 });
            json!({ "range": text.range(swatch.place.clone()), "color": color })
        };
        Ok(found.iter().map(color).collect())
    }

    fn color_presentations(&mut self, given: Value) -> Answer {
        #[derive(Deserialize)]
        struct Picked {
            red: f32,
            green: f32,
            blue: f32,
        }
        let of: Within = params(given.clone())?;
        let picked: Picked = params(given.get("color").cloned().unwrap_or_default())?;
        let Some(document) = self.document(&of.text_document) else {
            return Ok(Value::Null);
        };
        let text = &document.text;
        let range = text.offset(of.range.start)..text.offset(of.range.end);
        let old = text.as_str().get(range.clone()).unwrap_or_default();
        let srgb = [picked.red, picked.green, picked.blue];
        let presentations = if old.starts_with('[') {
            // A list in a scene is linear light.
            let [r, g, b] = srgb.map(|x| colors::number(colors::decoded(x)));
            vec![format!("[{r}, {g}, {b}]")]
        } else {
            colors::presentations(old, srgb)
        };
        let presentation = |new: String| {
            let edit = convert::edit(text, range.clone(), &new);
            json!({ "label": new, "textEdit": edit })
        };
        Ok(presentations.into_iter().map(presentation).collect())
    }

    fn folding(&mut self, of: &In) -> Answer {
        let Some(document) = self.document(&of.text_document) else {
            return Ok(Value::Null);
        };
        let text = &document.text;
        let fold = |(range, kind): (std::ops::Range<usize>, outline::FoldKind)| {
            let (start, end) = (text.line_of(range.start), text.line_of(range.end));
            // The line with the closing bracket stays visible.
            let is_block = kind == outline::FoldKind::Block;
            let last = if is_block { end.saturating_sub(1) } else { end };
            let mut value = json!({ "startLine": start, "endLine": last });
            match kind {
                outline::FoldKind::Block => {}
                outline::FoldKind::Comment => value["kind"] = json!("comment"),
                outline::FoldKind::Imports => value["kind"] = json!("imports"),
            }
            (last > start).then_some(value)
        };
        let folds = outline::folds(text.as_str());
        Ok(json!(
            folds.into_iter().filter_map(fold).collect::<Vec<_>>()
        ))
    }

    fn selection(&mut self, given: Value) -> Answer {
        let of: In = params(given.clone())?;
        let positions = given.get("positions").cloned().unwrap_or_default();
        let positions: Vec<lsp::Position> = params(positions)?;
        let Some((text, analysis)) = self.source(&of.text_document) else {
            return Ok(Value::Null);
        };
        let Some(ast) = analysis.ast() else {
            return Ok(Value::Null);
        };
        let around = |position: lsp::Position| {
            let at = text.offset(position);
            let ranges = outline::around(ast, text.as_str(), at).into_iter().rev();
            ranges.fold(Value::Null, |parent, range| {
                let mut value = json!({ "range": text.range(range) });
                if !parent.is_null() {
                    value["parent"] = parent;
                }
                value
            })
        };
        Ok(positions.into_iter().map(around).collect())
    }

    fn tokens(&mut self, of: &In) -> Answer {
        let all = lsp::Position::new(u32::MAX, 0);
        self.tokens_up_to(
            &of.text_document,
            lsp::Range::new(lsp::Position::new(0, 0), all),
        )
    }

    fn tokens_within(&mut self, of: &Within) -> Answer {
        self.tokens_up_to(&of.text_document, of.range)
    }

    fn tokens_up_to(&mut self, of: &lsp::TextDocumentIdentifier, range: lsp::Range) -> Answer {
        let Some((text, analysis)) = self.source(of) else {
            return Ok(Value::Null);
        };
        let lines = range.start.line..=range.end.line;
        let (mut line, mut start) = (0, 0);
        let mut data: Vec<u32> = Vec::new();
        for token in tokens::tokens(&analysis) {
            let at = text.position(token.place.start);
            if !lines.contains(&at.line) {
                continue;
            }
            let delta_start = if at.line == line {
                at.character - start
            } else {
                at.character
            };
            data.extend([
                at.line - line,
                delta_start,
                text.width(token.place),
                token.kind,
                token.modifiers,
            ]);
            (line, start) = (at.line, at.character);
        }
        Ok(json!({ "data": data }))
    }

    fn command(&mut self, given: Value) -> Answer {
        #[derive(Deserialize)]
        struct Command {
            command: String,
            #[serde(default)]
            arguments: Vec<Value>,
        }
        let given: Command = params(given)?;
        let uri = given
            .arguments
            .first()
            .and_then(Value::as_str)
            .unwrap_or_default();
        let path = uri
            .parse::<lsp::Uri>()
            .ok()
            .and_then(|u| u.to_file_path().ok());
        let Some(path) = path else {
            let message = format!("`{}` needs the URI of a file", given.command);
            return Err((ErrorCode::InvalidParams, message));
        };
        match given.command.as_str() {
            PREVIEW => match self.host.preview(&path) {
                Ok(()) => Ok(Value::Null),
                Err(why) => {
                    self.show(&why, true);
                    Ok(Value::Null)
                }
            },
            COST_DIFF => {
                let name = given
                    .arguments
                    .get(1)
                    .and_then(Value::as_str)
                    .unwrap_or_default();
                let path = crate::documents::normal(&path);
                let document = self.documents.at(&path);
                let text = document.and_then(|d| d.margin.lens(name));
                let text = text.unwrap_or_else(|| "its cost is not known yet".into());
                self.show(&format!("{name}: {text}"), false);
                Ok(Value::Null)
            }
            other => {
                let message = format!("there is no command `{other}`");
                Err((ErrorCode::InvalidParams, message))
            }
        }
    }
}

fn library_text(given: &Value) -> Answer {
    let uri = given.get("uri").and_then(Value::as_str).unwrap_or_default();
    match library::text(uri) {
        Some(text) => Ok(json!({ "text": text })),
        None => Err((
            ErrorCode::InvalidParams,
            format!("the library has no file `{uri}`"),
        )),
    }
}
