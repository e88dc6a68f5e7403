//! Tells Zed how to start the language server of Impasto: by the command on `PATH`, or the one that the settings name.

use zed_extension_api::settings::LspSettings;
use zed_extension_api::{
    Command, Extension, LanguageServerId, Result, Worktree, register_extension, serde_json,
};

struct Impasto;

impl Extension for Impasto {
    fn new() -> Self {
        Self
    }

    fn language_server_command(
        &mut self,
        id: &LanguageServerId,
        worktree: &Worktree,
    ) -> Result<Command> {
        let settings = LspSettings::for_worktree(id.as_ref(), worktree)?;
        let binary = settings.binary.as_ref();
        let command = binary
            .and_then(|binary| binary.path.clone())
            .or_else(|| worktree.which("impasto"));
        let command = command.ok_or(
            "The command `impasto` was not found. Build it in the repository of Impasto with `cargo install --path . \
             --locked`, or name it in the settings: lsp.impasto.binary.path",
        )?;
        let arguments = binary.and_then(|binary| binary.arguments.clone());
        Ok(Command {
            command,
            args: arguments.unwrap_or_else(|| vec!["lsp".to_owned()]),
            env: worktree.shell_env(),
        })
    }

    /// The server takes its settings at the start, too.
    fn language_server_initialization_options(
        &mut self,
        id: &LanguageServerId,
        worktree: &Worktree,
    ) -> Result<Option<serde_json::Value>> {
        let settings = LspSettings::for_worktree(id.as_ref(), worktree)?;
        Ok(settings.initialization_options.or(settings.settings))
    }

    fn language_server_workspace_configuration(
        &mut self,
        id: &LanguageServerId,
        worktree: &Worktree,
    ) -> Result<Option<serde_json::Value>> {
        let settings = LspSettings::for_worktree(id.as_ref(), worktree)?;
        Ok(settings
            .settings
            .map(|own| serde_json::json!({ "impasto": own })))
    }
}

register_extension!(Impasto);
