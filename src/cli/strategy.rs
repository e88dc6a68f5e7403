//! The options that say how materials share kernels, the same for every command that plans.

use std::path::PathBuf;

use clap::Args;
use impasto::compiler::partition::{PlanError, STRATEGIES, file, text};
use impasto::{Plan, Strategy};

use super::Failure;
use super::completions::Known;

/// How materials share kernels.
#[derive(Args)]
pub(super) struct PlanArgs {
    /// How materials share kernels
    #[arg(long, value_name = "NAME", value_parser = Known::new(parse, names), hide_possible_values = true, long_help = help())]
    strategy: Option<Strategy>,
    /// Use the plan of this file, which `impasto plan --save` wrote
    #[arg(long, value_name = "P.json", conflicts_with_all = ["strategy", "partition"])]
    plan: Option<PathBuf>,
    /// Use this partition: groups of materials with their forms, as in
    /// `own:paint|binned:wood,marble|inline:*`
    #[arg(long, value_name = "GROUPS", conflicts_with = "strategy")]
    partition: Option<String>,
}

/// Where a plan comes from.
pub(super) enum Source {
    /// A strategy is still to make it.
    Strategy(Strategy),
    /// It was given.
    Given(Plan),
}

impl PlanArgs {
    /// The option that is given, if one is.
    pub(super) fn given(&self) -> Option<&'static str> {
        let given = [
            ("--strategy", self.strategy.is_some()),
            ("--plan", self.plan.is_some()),
            ("--partition", self.partition.is_some()),
        ];
        given
            .into_iter()
            .find(|(_, given)| *given)
            .map(|(name, _)| name)
    }

    /// Is the plan found by measuring kernels?
    pub(super) fn measures(&self) -> bool {
        self.strategy == Some(Strategy::EXHAUSTIVE)
    }

    /// What was asked for, of materials called `names` of which no surface binds `unused`; `default` if
    /// nothing was.
    pub(super) fn source(
        &self,
        names: &[String],
        unused: &[usize],
        default: Strategy,
    ) -> Result<Source, Failure> {
        let error = |e: PlanError| Failure::Error(e.to_string());
        if let Some(path) = &self.plan {
            let of_file = |e| Failure::Error(format!("`{}`: {e}", path.display()));
            let plan = file::read(&super::read_text(path)?, names).map_err(of_file)?;
            plan.check_unused(unused, names).map_err(of_file)?;
            return Ok(Source::Given(plan));
        }
        if let Some(groups) = &self.partition {
            let plan = text::parse(groups, names, unused).map_err(error)?;
            return Ok(Source::Given(plan));
        }
        Ok(Source::Strategy(self.strategy.unwrap_or(default)))
    }
}

/// What is said where the device renders by a strategy in place of what was asked for.
pub(super) fn replaced(asked: &str, chosen: Strategy) -> String {
    format!(
        "note: the processor renders by `{chosen}` in place of `{asked}` (`impasto plan --device cpu` says why)"
    )
}

fn parse(name: &str) -> Result<Strategy, String> {
    Strategy::parse(name).map_err(|error| error.to_string())
}

/// The names of all strategies.
pub(super) fn names() -> Vec<&'static str> {
    STRATEGIES.iter().map(|row| row.name).collect()
}

/// The table of strategies.
fn help() -> String {
    let mut help = "How materials share kernels\n".to_owned();
    for row in STRATEGIES {
        help += &format!("\n{:<12} {}", row.usage(), row.help);
    }
    help
}
