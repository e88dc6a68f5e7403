//! What a client can do and wants.

use std::path::PathBuf;

use gen_lsp_types as lsp;
use serde::Deserialize;

use crate::documents;
use crate::text::Encoding;

/// What a client can do and wants.
#[derive(Clone, Debug)]
pub struct Settings {
    /// In what it counts columns.
    pub encoding: Encoding,
    /// Folders that it works in.
    pub roots: Vec<PathBuf>,
    /// Does it open `impasto-std:` documents?
    pub virtual_documents: bool,
    /// Does it fill in snippets?
    pub snippets: bool,
    /// Where does it show Markdown?
    pub markdown: Markdown,
    /// Can it be told that hints changed?
    pub refreshes_hints: bool,
    /// Can it be told that lenses changed?
    pub refreshes_lenses: bool,
    /// Does it tell of files that change, if it is asked to?
    pub watches: bool,
    /// Does it do commands of its own, such as `impasto.showPreview`?
    pub has_commands: bool,
    /// What its user wants.
    pub wanted: Wanted,
}

/// Where a client shows Markdown.
#[derive(Clone, Copy, Debug)]
pub struct Markdown {
    /// Below the hand.
    pub hover: bool,
    /// Beside proposals.
    pub completion: bool,
    /// Beside signatures.
    pub signature: bool,
}

/// What a user wants, in the section `impasto` of the settings.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Wanted {
    /// The scene whose plan is shown.
    pub scene: Option<String>,
    /// What is shown of costs.
    pub cost: WantedCost,
}

/// What is shown of costs.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct WantedCost {
    /// Operations behind lines.
    pub inlay_hints: bool,
    /// Operations above materials.
    pub lens: bool,
}

impl Default for WantedCost {
    fn default() -> Self {
        Self {
            inlay_hints: true,
            lens: true,
        }
    }
}

/// What a client sends beside its capabilities.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Options {
    virtual_documents: bool,
    commands: bool,
    #[serde(flatten)]
    wanted: Wanted,
}

impl Settings {
    /// Those of a client that begins.
    pub fn new(params: &lsp::InitializeParams) -> Self {
        let client = serde_json::to_value(&params.capabilities).unwrap_or_default();
        let can = |path: &str| client.pointer(path).and_then(|v| v.as_bool()) == Some(true);
        let shows_markdown = |path: &str| {
            let formats = client.pointer(&format!("/textDocument/{path}"));
            let formats = formats.and_then(|f| f.as_array());
            formats.is_some_and(|f| f.iter().any(|f| f == "markdown"))
        };
        let encodings = client.pointer("/general/positionEncodings");
        let encodings = encodings
            .and_then(|e| e.as_array().cloned())
            .unwrap_or_default();
        let encoding = if encodings.iter().any(|e| e == "utf-8") {
            Encoding::Utf8
        } else {
            Encoding::Utf16
        };
        let options = params.initialization_options.clone().unwrap_or_default();
        let options: Options = serde_json::from_value(options).unwrap_or_default();
        Self {
            encoding,
            roots: roots(params),
            virtual_documents: options.virtual_documents,
            snippets: can("/textDocument/completion/completionItem/snippetSupport"),
            markdown: Markdown {
                hover: shows_markdown("hover/contentFormat"),
                completion: shows_markdown("completion/completionItem/documentationFormat"),
                signature: shows_markdown("signatureHelp/signatureInformation/documentationFormat"),
            },
            refreshes_hints: can("/workspace/inlayHint/refreshSupport"),
            refreshes_lenses: can("/workspace/codeLens/refreshSupport"),
            watches: can("/workspace/didChangeWatchedFiles/dynamicRegistration"),
            has_commands: options.commands || options.virtual_documents,
            wanted: options.wanted,
        }
    }

    /// Takes over settings that a client sends later: the section itself, or all with the section in it.
    pub fn change(&mut self, settings: serde_json::Value) {
        let section = match settings.get("impasto") {
            Some(section) => section.clone(),
            None => settings,
        };
        if let Ok(wanted) = serde_json::from_value(section) {
            self.wanted = wanted;
        }
    }

    /// Takes over folders that came and went.
    pub fn change_roots(&mut self, params: &serde_json::Value) {
        let folders = |list: &str| {
            let folders = params.pointer(list).and_then(|f| f.as_array());
            let uris = folders
                .into_iter()
                .flatten()
                .filter_map(|f| f.get("uri")?.as_str());
            uris.filter_map(path).collect::<Vec<_>>()
        };
        let gone = folders("/event/removed");
        self.roots.retain(|root| !gone.contains(root));
        self.roots.extend(folders("/event/added"));
    }

    /// The scene whose plan is shown.
    pub fn scene(&self) -> Option<PathBuf> {
        let scene = self.wanted.scene.as_ref().filter(|s| !s.is_empty())?;
        let root = self.roots.first().cloned().unwrap_or_default();
        Some(documents::normal(&root.join(scene)).into())
    }
}

#[allow(deprecated)]
fn roots(params: &lsp::InitializeParams) -> Vec<PathBuf> {
    let value = serde_json::to_value(params).unwrap_or_default();
    let folders = value.get("workspaceFolders").and_then(|f| f.as_array());
    let uris = folders
        .into_iter()
        .flatten()
        .filter_map(|f| f.get("uri")?.as_str());
    let uris: Vec<&str> = match uris.collect::<Vec<_>>() {
        uris if uris.is_empty() => value
            .get("rootUri")
            .and_then(|u| u.as_str())
            .into_iter()
            .collect(),
        uris => uris,
    };
    uris.into_iter().filter_map(path).collect()
}

/// The path of a folder.
fn path(uri: &str) -> Option<PathBuf> {
    uri.parse::<lsp::Uri>().ok()?.to_file_path().ok()
}
