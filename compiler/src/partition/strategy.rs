//! Strategies: ways to come to a plan, by their names on the command line.
//!
//! [`Strategy`] needs to know nothing of the materials but how many there are; [`Wanted`] is any
//! strategy, with those that ask for costs, for hits or for a GPU. [`STRATEGIES`] is the table of all.

use std::fmt;

use super::error::list;
use super::search::{Automatic, Problem, Search};
use super::{Calibrated, DeviceProfile, Form, Groups, Organisation, Plan, PlanError, Workload};
use crate::cost::Cost;
use crate::diag::nearest;

/// A way to assign materials to kernels that needs to know nothing of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// Wavefront; each material has its own kernel.
    Own,
    /// Wavefront; all materials share one queue and kernel.
    Mixed,
    /// Wavefront; each material has its own queue, and one kernel works on all of them.
    Binned,
    /// Wavefront; materials are evaluated where hits are found.
    Inline,
    /// One kernel for everything.
    Mega,
}

impl Strategy {
    /// Every strategy with its name on the command line.
    pub const ALL: [(Strategy, &'static str); 7] = [
        (Strategy::Own, "own"),
        (Strategy::Own, "wavefront"),
        (Strategy::Mixed, "mixed"),
        (Strategy::Mixed, "shared"),
        (Strategy::Binned, "binned"),
        (Strategy::Inline, "inline"),
        (Strategy::Mega, "mega"),
    ];

    /// The strategy called `name`.
    pub fn from_name(name: &str) -> Option<Strategy> {
        Self::ALL.iter().find(|(_, n)| *n == name).map(|(s, _)| *s)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        // The table holds every strategy.
        let found = Self::ALL.iter().find(|(s, _)| *s == self);
        found.map_or("", |(_, name)| name)
    }

    /// The plan for materials called `names`, in program order.
    pub fn plan(self, names: &[String]) -> Plan {
        let all = || (0..names.len()).collect::<Vec<usize>>();
        let one = |form| vec![(form, all())];
        let groups = match self {
            Strategy::Own => all().into_iter().map(|m| (Form::Own, vec![m])).collect(),
            Strategy::Mixed => one(Form::Mixed),
            Strategy::Binned => one(Form::Binned),
            Strategy::Inline | Strategy::Mega => one(Form::Inline),
        };
        let groups = groups
            .into_iter()
            .filter(|(_, members)| !members.is_empty());
        let plan = Plan::wavefront(self.name(), groups, Vec::new(), names);
        match self {
            Strategy::Mega => Plan {
                organisation: Organisation::Mega,
                ..plan
            },
            _ => plan,
        }
    }
}

/// Mean operations from which on [`Wanted::Paper`] gives a material a kernel of its own.
///
/// Laine, Karras and Aila 2013 decide by hand, and leave choosing by a machine open: what is expensive
/// and procedural has its own kernel, and what is simple shares one. One noise evaluation is where the
/// two part in their scenes: every material that they call complex evaluates noise or a loop (868
/// operations and more, as Impasto counts), and none of the others does (430 and less).
pub const PAPER_OPERATIONS: f64 = 600.0;

/// A strategy as it is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// What the time model likes best.
    Auto,
    /// A strategy that needs to know nothing.
    Fixed(Strategy),
    /// Materials of at least so many mean operations have their own kernel, the others share a mixed one.
    Threshold(f64),
    /// The hand choice of Laine, Karras and Aila 2013: [`PAPER_OPERATIONS`].
    Paper,
    /// What is best when every kernel is measured.
    Exhaustive,
}

/// What a strategy must know besides the materials' names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// What materials cost.
    Costs,
    /// That, how paths hit them, and what the GPU takes.
    Workload,
    /// A GPU on which kernels are measured.
    Measurements,
}

/// A row of [`STRATEGIES`].
#[derive(Clone, Copy, Debug)]
pub struct StrategyRow {
    /// As on the command line; `=N` stands for a number.
    pub name: &'static str,
    /// What it does, in a line.
    pub help: &'static str,
    /// What it must know.
    pub needs: Needs,
}

/// Every strategy. `wavefront` and `shared` are older names of `own` and `mixed`.
pub const STRATEGIES: [StrategyRow; 9] = [
    row(
        "auto",
        "what the time model predicts to be fastest",
        Needs::Workload,
    ),
    row("own", "a kernel for each material", Needs::Nothing),
    row(
        "mixed",
        "one kernel for all materials, which switches",
        Needs::Nothing,
    ),
    row(
        "binned",
        "one dispatch for all materials, of which each workgroup evaluates one",
        Needs::Nothing,
    ),
    row(
        "inline",
        "materials are evaluated where hits are found",
        Needs::Nothing,
    ),
    row("mega", "one kernel for whole paths", Needs::Nothing),
    row(
        "threshold=N",
        "materials of N operations and more each have a kernel, the others share one",
        Needs::Costs,
    ),
    row(
        "paper",
        "the hand choice of Laine, Karras and Aila 2013: threshold=600",
        Needs::Costs,
    ),
    row(
        "exhaustive",
        "what is fastest when every kernel is measured; `impasto plan` only",
        Needs::Measurements,
    ),
];

const fn row(name: &'static str, help: &'static str, needs: Needs) -> StrategyRow {
    StrategyRow { name, help, needs }
}

/// What is known of a scene's materials.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a> {
    /// The names of the program's materials, in its order.
    pub names: &'a [String],
    /// Those that no surface binds.
    pub unused: &'a [usize],
    /// What each costs, if that is known.
    pub costs: Option<&'a [Option<Cost>]>,
    /// How paths hit them, if that is known.
    pub workload: Option<&'a Workload>,
    /// What the GPU takes, if that is known.
    pub profile: Option<&'a DeviceProfile>,
}

impl Wanted {
    /// The strategy that the command line calls `text`.
    ///
    /// # Errors
    /// If there is none, or its number is none.
    pub fn parse(text: &str) -> Result<Wanted, PlanError> {
        if let Some(strategy) = Strategy::from_name(text) {
            return Ok(Wanted::Fixed(strategy));
        }
        match text.split_once('=') {
            Some(("threshold", number)) => return threshold(number),
            Some((name, _)) if Self::parse(name).is_ok() => {
                let message = format!("the strategy `{name}` takes no value");
                return Err(PlanError::new(message).hint("only `threshold=N` does"));
            }
            _ => {}
        }
        match text {
            "auto" => Ok(Wanted::Auto),
            "paper" => Ok(Wanted::Paper),
            "exhaustive" => Ok(Wanted::Exhaustive),
            "threshold" => threshold(""),
            _ => Err(unknown(text)),
        }
    }

    /// The row of the table that it is.
    pub fn row(&self) -> &'static StrategyRow {
        let name = match self {
            Wanted::Auto => "auto",
            Wanted::Fixed(strategy) => strategy.name(),
            Wanted::Threshold(_) => "threshold=N",
            Wanted::Paper => "paper",
            Wanted::Exhaustive => "exhaustive",
        };
        let found = STRATEGIES.iter().find(|row| row.name == name);
        found.unwrap_or(&STRATEGIES[0])
    }

    /// The plan that it comes to.
    ///
    /// # Errors
    /// If it needs to know more than is known.
    pub fn plan(&self, known: &Known) -> Result<Plan, PlanError> {
        let costs = || known.costs.ok_or_else(|| self.lacks("what materials cost"));
        let groups = match self {
            Wanted::Fixed(strategy) => {
                return Ok(strategy.plan(known.names).leaving_out(known.unused));
            }
            Wanted::Threshold(least) => above(known, costs()?, *least),
            Wanted::Paper => above(known, costs()?, PAPER_OPERATIONS),
            Wanted::Auto => {
                let model = Calibrated {
                    costs: costs()?,
                    workload: known
                        .workload
                        .ok_or_else(|| self.lacks("how paths hit materials"))?,
                    profile: known
                        .profile
                        .ok_or_else(|| self.lacks("what the GPU takes"))?,
                };
                Automatic.search(&known.problem(), &model)
            }
            Wanted::Exhaustive => {
                let error = self.lacks("what kernels take, measured");
                return Err(error.hint("measure with `impasto plan SCENE --strategy exhaustive`"));
            }
        };
        Ok(known.plan(&self.to_string(), groups))
    }

    fn lacks(&self, what: &str) -> PlanError {
        PlanError::new(format!(
            "the strategy `{self}` must know {what}, and that is not known"
        ))
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Wanted::Threshold(least) => write!(f, "threshold={least}"),
            other => f.write_str(other.row().name),
        }
    }
}

impl Known<'_> {
    /// The materials that are on some surface, to be placed in kernels of any form.
    pub fn problem(&self) -> Problem {
        Problem::new((0..self.names.len()).filter(|m| !self.unused.contains(m)))
    }

    /// The wavefront of `groups`, which a strategy called `strategy` has made.
    pub fn plan(&self, strategy: &str, groups: Groups) -> Plan {
        Plan::wavefront(strategy, groups, self.unused.to_vec(), self.names)
    }
}

fn threshold(number: &str) -> Result<Wanted, PlanError> {
    match number.trim().parse::<f64>() {
        Ok(least) if least.is_finite() && least >= 0.0 => Ok(Wanted::Threshold(least)),
        _ => {
            let message = format!("`threshold={number}` has no number of operations");
            Err(PlanError::new(message).hint("write one of at least 0, as in `threshold=1000`"))
        }
    }
}

fn unknown(text: &str) -> PlanError {
    let known = || STRATEGIES.iter().map(|row| row.name);
    let error = PlanError::new(format!("there is no strategy `{text}`"));
    match nearest(text, known()) {
        Some(near) => error.hint(format!("did you mean `{near}`?")),
        None => error.hint(format!("strategies are {}", list(known()))),
    }
}

/// Each material of at least `least` operations on its own, the others in one mixed kernel.
fn above(known: &Known, costs: &[Option<Cost>], least: f64) -> Groups {
    let mean = |m: usize| {
        costs
            .get(m)
            .and_then(Option::as_ref)
            .map_or(0.0, |c| c.operations.mean)
    };
    let all = known.problem().materials.into_iter();
    let (own, rest): (Vec<usize>, Vec<usize>) = all.partition(|m| mean(*m) >= least);
    let mut groups: Groups = own.into_iter().map(|m| (Form::Own, vec![m])).collect();
    match rest.len() {
        0 => {}
        1 => groups.push((Form::Own, rest)),
        _ => groups.push((Form::Mixed, rest)),
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::super::Hits;
    use super::super::text::print;
    use super::*;
    use crate::cost::{Classes, LANES, Operations};

    fn cost(mean: f64) -> Option<Cost> {
        let classes = Classes {
            alu: mean,
            ..Classes::default()
        };
        let operations = Operations {
            evaluations: 1,
            mean,
            min: 0,
            max: mean as u64,
            classes,
        };
        Some(Cost {
            operations,
            issued: [classes; LANES.len()],
            live: 20,
            code: mean as u32,
            loops: 0,
            bytes: 0.0,
        })
    }

    fn names() -> Vec<String> {
        ["paint", "glass", "wall", "asphalt", "lost"]
            .map(String::from)
            .to_vec()
    }

    fn costs() -> Vec<Option<Cost>> {
        vec![cost(3300.0), cost(236.0), cost(600.0), cost(599.0), None]
    }

    fn workload() -> Workload {
        let hits = |material: &String| Hits {
            material: material.clone(),
            on_surface: material != "lost",
            share: 0.2,
            present: 0.9,
            loads: 64.0,
            stores: 64.0,
        };
        Workload {
            pool: 1 << 20,
            materials: names().iter().map(hits).collect(),
            logic_seconds: 0.0,
            other_seconds: 0.0,
        }
    }

    fn planned(wanted: &str) -> String {
        let (names, costs, workload) = (names(), costs(), workload());
        let profile = DeviceProfile::named("h200").expect("it is shipped");
        let known = Known {
            names: &names,
            unused: &[4],
            costs: Some(&costs),
            workload: Some(&workload),
            profile: Some(&profile),
        };
        let wanted = Wanted::parse(wanted).unwrap_or_else(|e| panic!("{e}"));
        let plan = wanted.plan(&known).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(plan.check_named(&names), Ok(()), "{wanted}");
        assert_eq!(
            (&plan.unused, &plan.strategy),
            (&vec![4], &wanted.to_string())
        );
        print(&plan, &names)
    }

    #[test]
    fn strategies_come_to_their_plans() {
        assert_eq!(planned("own"), "own:paint|own:glass|own:wall|own:asphalt");
        assert_eq!(planned("shared"), "mixed:paint,glass,wall,asphalt");
        assert_eq!(planned("mega"), "inline:paint,glass,wall,asphalt");
        assert_eq!(planned("paper"), "own:paint|own:wall|mixed:glass,asphalt");
        assert_eq!(planned("threshold=600"), planned("paper"));
        assert_eq!(planned("threshold=0"), planned("own"));
        assert_eq!(planned("threshold=599.5"), planned("paper"));
        assert_eq!(planned("threshold=1e9"), planned("mixed"));
        assert_eq!(
            planned("threshold=240"),
            "own:paint|own:wall|own:asphalt|own:glass"
        );
        assert!(planned("auto").contains("paint"));
    }

    #[test]
    fn every_row_of_the_table_is_a_strategy() {
        for row in STRATEGIES {
            let text = row.name.replace('N', "7");
            let wanted = Wanted::parse(&text).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(wanted.to_string(), text);
            assert_eq!(wanted.row().name, row.name);
            assert_eq!(wanted.row().needs, row.needs);
        }
        for (strategy, name) in Strategy::ALL {
            assert_eq!(Wanted::parse(name), Ok(Wanted::Fixed(strategy)));
        }
    }

    #[test]
    fn what_is_no_strategy_is_said() {
        let refused = |text: &str, part: &str| {
            let error = Wanted::parse(text).expect_err(text).to_string();
            assert!(error.contains(part), "{error}");
        };
        refused("bined", "did you mean `binned`?");
        refused("quick", "strategies are `auto`, `own`");
        refused("threshold", "as in `threshold=1000`");
        refused("threshold=many", "`threshold=many` has no number");
        refused("threshold=-1", "at least 0");
        refused("threshold=NaN", "at least 0");
        refused("own=3", "`own` takes no value");
        refused("", "there is no strategy ``");
    }

    #[test]
    fn what_is_not_known_is_said() {
        let names = names();
        let known = Known {
            names: &names,
            unused: &[],
            costs: None,
            workload: None,
            profile: None,
        };
        for wanted in [
            Wanted::Auto,
            Wanted::Paper,
            Wanted::Threshold(1.0),
            Wanted::Exhaustive,
        ] {
            let error = wanted
                .plan(&known)
                .expect_err("it is not known")
                .to_string();
            assert!(error.contains(&format!("`{wanted}` must know")), "{error}");
        }
        let costs = costs();
        let some = Known {
            costs: Some(&costs),
            ..known
        };
        assert!(Wanted::Paper.plan(&some).is_ok());
        assert!(Wanted::Auto.plan(&some).is_err());
        assert!(Wanted::Fixed(Strategy::Own).plan(&known).is_ok());
    }
}
