//! `impasto completions`: a completion script for a shell.
//!
//! An option completes what it takes: one of its values, a file if it takes files, or nothing. What each takes is
//! derived from the options themselves.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::{Arg, Args, Command, CommandFactory, ValueHint};
use clap_complete::Shell;

use super::{Cli, Outcome, print};

#[derive(Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

pub(super) fn run(args: &CompletionsArgs) -> Outcome {
    let mut script = Vec::new();
    let mut command = hinted(Cli::command());
    clap_complete::generate(args.shell, &mut command, "impasto", &mut script);
    print(&String::from_utf8_lossy(&script))
}

/// The command whose options complete nothing where they have neither values nor a word about files: without that,
/// shells would offer files for numbers.
fn hinted(command: Command) -> Command {
    let hinted_arg = |arg: Arg| {
        let takes = arg.get_action().takes_values();
        let has_values = arg.get_value_parser().possible_values().is_some();
        if takes && !has_values && arg.get_value_hint() == ValueHint::Unknown {
            arg.value_hint(ValueHint::Other)
        } else {
            arg
        }
    };
    command.mut_args(hinted_arg).mut_subcommands(hinted)
}

/// A parser whose most frequent values are known, though it takes others as well or says itself what is wrong.
#[derive(Clone)]
pub(super) struct Known<P> {
    parse: P,
    names: fn() -> Vec<&'static str>,
}

impl<P: TypedValueParser> Known<P> {
    /// Takes what `parse` takes, of which `names` are offered. The argument should hide its possible values, which
    /// its help or its errors tell in their own way.
    pub(super) fn new(parse: P, names: fn() -> Vec<&'static str>) -> Self {
        Self { parse, names }
    }
}

impl<P: TypedValueParser> TypedValueParser for Known<P> {
    type Value = P::Value;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<Self::Value, clap::Error> {
        self.parse.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.names)().into_iter().map(PossibleValue::new)))
    }
}
