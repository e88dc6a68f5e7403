//! A strategy as it is asked for: a row of the table [`STRATEGIES`], with a number if it takes one. What
//! the command line accepts, prints and hints at is derived from the table.

use std::fmt;

use super::error::list;
use super::strategies::{Request, Requires, Rule, STRATEGIES, StrategyRow};
use super::{Calibrated, Groups, Plan, PlanError, PlanInputs};
use crate::diag::nearest;

/// A way to assign materials to kernels. Those that code asks for by name are constants, such as
/// [`Strategy::OWN`], each declared in the file of its strategy.
#[derive(Clone, Copy)]
pub struct Strategy {
    row: &'static StrategyRow,
    /// What stands behind `=`; 0 where the row takes no number.
    number: f64,
}

impl Strategy {
    /// The strategy of a row that takes no number. Rows need not be in the table: code may have a
    /// strategy of its own.
    pub const fn new(row: &'static StrategyRow) -> Strategy {
        Self::with_number(row, 0.0)
    }

    /// The strategy of a row that takes a number.
    pub const fn with_number(row: &'static StrategyRow, number: f64) -> Strategy {
        Strategy { row, number }
    }

    /// The strategy that the command line calls `text`.
    ///
    /// # Errors
    /// If there is none, or its number is none.
    pub fn parse(text: &str) -> Result<Strategy, PlanError> {
        let (name, value) = match text.split_once('=') {
            Some((name, value)) => (name, Some(value)),
            None => (text, None),
        };
        let called = |row: &&StrategyRow| row.name == name || row.older_names.contains(&name);
        let row = STRATEGIES.iter().copied().find(called);
        let row = row.ok_or_else(|| unknown(text))?;
        match (row.number, value) {
            (None, None) => Ok(Self::new(row)),
            (None, Some(_)) => Err(takes_no_value(name)),
            (Some(_), value) => number(row, value.unwrap_or_default()),
        }
    }

    /// The strategies whose plans the time model can set beside each other: those that come to a wavefront
    /// without being given a number or a GPU.
    pub fn comparable() -> impl Iterator<Item = Strategy> {
        let rows = STRATEGIES.iter().copied();
        rows.filter(|row| row.is_comparable()).map(Strategy::new)
    }

    /// Its row of the table.
    pub fn row(&self) -> &'static StrategyRow {
        self.row
    }

    /// What it must know.
    pub fn requires(&self) -> Requires {
        self.row.rule.requires()
    }

    /// The plan that it comes to.
    ///
    /// # Errors
    /// If it must know more than is known.
    pub fn plan(&self, inputs: &PlanInputs<'_>) -> Result<Plan, PlanError> {
        let materials = inputs.problem().materials;
        let request = Request {
            materials: &materials,
            number: self.number,
        };
        let costs = || {
            inputs
                .costs
                .ok_or_else(|| self.lacks("what materials cost"))
        };
        let groups = match self.row.rule {
            Rule::Names(rule) => rule(&request),
            Rule::Costs(rule) => rule(&request, costs()?),
            Rule::Model(rule) => {
                let model = Calibrated {
                    costs: costs()?,
                    workload: inputs
                        .workload
                        .ok_or_else(|| self.lacks("how paths hit materials"))?,
                    profile: inputs
                        .profile
                        .ok_or_else(|| self.lacks("what the GPU takes"))?,
                };
                rule(&request, &model)
            }
            Rule::Measured => {
                let error = self.lacks("what kernels take, measured");
                let hint = format!("measure with `impasto plan SCENE --strategy {self}`");
                return Err(error.hint(hint));
            }
        };
        Ok(self.assemble(inputs, groups))
    }

    /// The plan by a rule that must know nothing else.
    pub(super) fn plan_by_names(
        &self,
        rule: fn(&Request<'_>) -> Groups,
        names: &[String],
        unused: &[usize],
    ) -> Plan {
        let inputs = PlanInputs {
            unused,
            ..PlanInputs::of_names(names)
        };
        let request = Request {
            materials: &inputs.problem().materials,
            number: self.number,
        };
        self.assemble(&inputs, rule(&request))
    }

    /// The plan whose kernels are `groups`.
    fn assemble(&self, inputs: &PlanInputs<'_>, mut groups: Groups) -> Plan {
        groups.retain(|(_, members)| !members.is_empty());
        Plan {
            organisation: self.row.organisation,
            ..inputs.plan(&self.to_string(), groups)
        }
    }

    fn lacks(&self, what: &str) -> PlanError {
        PlanError::new(format!(
            "the strategy `{self}` must know {what}, and that is not known"
        ))
    }
}

impl PartialEq for Strategy {
    fn eq(&self, other: &Self) -> bool {
        (self.row.name, self.number) == (other.row.name, other.number)
    }
}

/// As on the command line.
impl fmt::Display for Strategy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.row.name)?;
        match self.row.number {
            Some(_) => write!(f, "={}", self.number),
            None => Ok(()),
        }
    }
}

impl fmt::Debug for Strategy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The strategy of a row that takes a number.
fn number(row: &'static StrategyRow, text: &str) -> Result<Strategy, PlanError> {
    let Some(about) = row.number else {
        return Err(takes_no_value(row.name));
    };
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number >= 0.0 => Ok(Strategy::with_number(row, number)),
        _ => {
            let (name, of) = (row.name, about.of);
            let error = PlanError::new(format!("`{name}={text}` has no number of {of}"));
            let example = about.example;
            Err(error.hint(format!("write one of at least 0, as in `{name}={example}`")))
        }
    }
}

fn takes_no_value(name: &str) -> PlanError {
    let usages = usages(|row| row.number.is_some());
    let does = if usages.len() == 1 { "does" } else { "do" };
    let all = list(usages.iter().map(String::as_str));
    let error = PlanError::new(format!("the strategy `{name}` takes no value"));
    error.hint(format!("only {all} {does}"))
}

fn unknown(text: &str) -> PlanError {
    let usages = usages(|_| true);
    let known = || usages.iter().map(String::as_str);
    let error = PlanError::new(format!("there is no strategy `{text}`"));
    match nearest(text, known()) {
        Some(near) => error.hint(format!("did you mean `{near}`?")),
        None => error.hint(format!("strategies are {}", list(known()))),
    }
}

/// How the strategies of such rows are written.
fn usages(such: impl Fn(&StrategyRow) -> bool) -> Vec<String> {
    let rows = STRATEGIES.iter().filter(|row| such(row));
    rows.map(|row| row.usage()).collect()
}
