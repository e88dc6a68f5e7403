//! Requests about scene files.

use std::ops::Range;
use std::path::Path;

use gen_lsp_types as lsp;
use impasto_runtime::error::SceneError;
use serde_json::{Value, json};

use super::capabilities::{PREVIEW, SHOW_PREVIEW};
use super::{Server, convert};
use crate::documents::Overlay;
use crate::scene::features::{Problem, Scene};
use crate::scene::outline::outline;

impl Server<'_> {
    /// Asks something of the open scene at a path; of nothing if it is not open.
    pub(super) fn with_scene<T>(&self, path: &str, ask: impl FnOnce(&mut Scene<'_>) -> T) -> T {
        let text = self.documents.at(path).map(|d| d.text.clone());
        let text = text.as_ref().map_or("", |t| t.as_str());
        let path = Path::new(path);
        let base = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut loader = Overlay::within(self.documents.texts(), base);
        ask(&mut Scene {
            path,
            text,
            loader: &mut loader,
        })
    }

    /// What loading a scene found, at its places in the text.
    pub(super) fn scene_problems(
        &self,
        path: &str,
        error: Option<&SceneError>,
        warnings: &[String],
    ) -> Vec<Problem> {
        self.with_scene(path, |scene| {
            let mut found: Vec<Problem> = error.iter().map(|e| scene.of_error(e)).collect();
            let bindings = outline(scene.text).bindings;
            for warning in warnings {
                let named = |b: &&crate::scene::outline::BindingAt| {
                    warning == &format!("nothing uses the material `{}`", b.name.value)
                };
                let binding = bindings.iter().find(named);
                found.push(Problem {
                    place: binding.map_or(0..0, |b| b.name.place.clone()),
                    message: warning.clone(),
                    is_warning: true,
                    instead: None,
                });
            }
            found
        })
    }

    pub(super) fn scene_symbols(&self, of: &lsp::TextDocumentIdentifier) -> Value {
        let Some(document) = self.documents.get(&of.uri) else {
            return Value::Null;
        };
        let text = &document.text;
        let outline = outline(text.as_str());
        let ends = outline.tables.iter().skip(1).map(|t| t.place.start);
        let ends = ends.chain([text.as_str().len()]);
        let tables = outline.tables.iter().zip(ends);
        let symbol = |(table, end): (&crate::scene::outline::TableAt, usize)| {
            let is_material = table.name.starts_with("materials.");
            json!({
                "name": if table.name.is_empty() { "?" } else { &table.name },
                "kind": if is_material { 5 } else { 3 },
                "range": text.range(table.place.start..end),
                "selectionRange": text.range(table.place.clone()),
            })
        };
        tables.map(symbol).collect()
    }

    pub(super) fn scene_actions(
        &self,
        of: &lsp::TextDocumentIdentifier,
        range: lsp::Range,
    ) -> Value {
        let Some(document) = self.documents.get(&of.uri) else {
            return Value::Null;
        };
        let text = &document.text;
        let asked = text.offset(range.start)..text.offset(range.end);
        let problems = self.with_scene(&document.path, |scene| scene.problems());
        let touches = |place: &Range<usize>| place.start <= asked.end && asked.start <= place.end;
        let fixable = problems.into_iter().filter(|p| touches(&p.place));
        let action = |problem: Problem| {
            let instead = problem.instead?;
            let edits = [convert::edit(text, problem.place, &instead)];
            Some(json!({
                "title": format!("write `{instead}`"),
                "kind": "quickfix",
                "edit": { "changes": { document.uri.as_str(): edits } },
            }))
        };
        fixable.filter_map(action).collect()
    }

    pub(super) fn scene_lenses(&self, of: &lsp::TextDocumentIdentifier) -> Value {
        let Some(document) = self.documents.get(&of.uri) else {
            return Value::Null;
        };
        let text = &document.text;
        let uri = &document.uri;
        let lens = |place: Range<usize>, title: String, command: &str, arguments: Value| {
            let command = json!({ "title": title, "command": command, "arguments": arguments });
            json!({ "range": text.range(place), "command": command })
        };
        let preview = if self.settings.has_commands {
            SHOW_PREVIEW
        } else {
            PREVIEW
        };
        let mut lenses = vec![lens(0..0, "show preview".into(), preview, json!([uri]))];
        let plan = self.plans.get(Path::new(&document.path));
        if let Some(Ok(plan)) = plan {
            for binding in outline(text.as_str()).bindings {
                let of_it = |m: &&crate::host::PlannedMaterial| m.binding == binding.name.value;
                if let Some(planned) = plan.materials.iter().find(of_it) {
                    let why = json!([format!("{}\n{}", planned.why, plan.about)]);
                    let place = binding.name.place.clone();
                    lenses.push(lens(place, planned.kernel.clone(), "impasto.explain", why));
                }
            }
        }
        json!(lenses)
    }
}
