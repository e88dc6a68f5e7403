//! `impasto lsp`: the language server, on standard input and output.

use std::sync::Arc;

use clap::Args;
use impasto::editor::Workbench;

use super::info::DeviceArgs;
use super::{Failure, Outcome};

#[derive(Args)]
pub(super) struct LspArgs {
    /// Standard input and output carry the protocol, as they always do; editors like to say so
    #[arg(long)]
    stdio: bool,
    #[command(flatten)]
    device: DeviceArgs,
}

pub(super) fn run(args: &LspArgs) -> Outcome {
    args.device.check()?;
    let host = Arc::new(Workbench::new(args.device.options(super::say)));
    impasto_lsp::run(host).map_err(Failure::Error)
}
