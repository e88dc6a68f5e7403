//! What the server can do, as it tells a client at the beginning.

use serde_json::{Value, json};

use super::settings::Settings;
use crate::material::tokens;
use crate::text::Encoding;

/// Commands that the server does itself.
pub const PREVIEW: &str = "impasto.preview";
/// Says what an edit did to the cost of a file.
pub const COST_DIFF: &str = "impasto.costDiff";
/// The command of clients that opens a preview by themselves.
pub const SHOW_PREVIEW: &str = "impasto.showPreview";

/// The answer to `initialize`.
pub fn answer(settings: &Settings) -> Value {
    let encoding = match settings.encoding {
        Encoding::Utf8 => "utf-8",
        Encoding::Utf16 => "utf-16",
    };
    json!({
        "serverInfo": { "name": "impasto", "version": env!("CARGO_PKG_VERSION") },
        "capabilities": {
            "positionEncoding": encoding,
            "textDocumentSync": { "openClose": true, "change": 2, "save": true },
            "completionProvider": { "triggerCharacters": [".", ":", "/", "\"", " "] },
            "hoverProvider": true,
            "signatureHelpProvider": {
                "triggerCharacters": ["(", ","],
                "retriggerCharacters": [":"],
            },
            "definitionProvider": true,
            "referencesProvider": true,
            "documentHighlightProvider": true,
            "documentSymbolProvider": true,
            "workspaceSymbolProvider": true,
            "codeActionProvider": { "codeActionKinds": ["quickfix"] },
            "codeLensProvider": { "resolveProvider": false },
            "documentFormattingProvider": true,
            "documentRangeFormattingProvider": true,
            "renameProvider": { "prepareProvider": true },
            "colorProvider": true,
            "foldingRangeProvider": true,
            "selectionRangeProvider": true,
            "semanticTokensProvider": {
                "legend": { "tokenTypes": tokens::TYPES, "tokenModifiers": tokens::MODIFIERS },
                "full": true,
                "range": true,
            },
            "inlayHintProvider": true,
            "executeCommandProvider": { "commands": [PREVIEW, COST_DIFF] },
            "workspace": { "workspaceFolders": { "supported": true, "changeNotifications": true } },
        },
    })
}
