//! Models of kernels' times, and what they say of a measured mix.

use std::collections::BTreeMap;
use std::path::Path;

use impasto_compiler::cost::Cost;
use impasto_compiler::diag::nearest;
use impasto_compiler::partition::{
    Calibrated, DeviceProfile, Form, Plan, PlanInputs, Strategy, candidates,
};
use impasto_runtime::input;
use impasto_runtime::lab::statistics::median;

use crate::calibrate;
use crate::files::reason;
use crate::measure::{Kernel, Measurement};

/// A model.
#[derive(Clone, Debug)]
pub enum Model {
    /// This project's, with the constants of a device.
    Profile(String, Box<DeviceProfile>),
    /// The same, with trials of at most so many plans beside the one that it finds fastest.
    Tried(String, Box<DeviceProfile>, usize),
    /// This project's, with constants that are fitted to every second mix and scored on the others, and the other way round.
    Fitted,
    /// Predictions that somebody made: seconds by mix and kernel.
    Table(String, BTreeMap<(String, String), f64>),
    /// Every kernel takes the same.
    Constant,
    /// A time for each kernel and one for each operation.
    Operations,
    /// No model: a strategy that asks none.
    Strategy(Strategy),
}

/// The baselines by name, in the order of tables.
pub const BASELINES: [&str; 7] = [
    "constant",
    "operations",
    "own",
    "mixed",
    "binned",
    "inline",
    "paper",
];

impl Model {
    /// The model that `given` names: a baseline, a device profile, or a table in a file.
    ///
    /// # Errors
    /// If there is none, with what there is.
    pub fn parse(given: &str) -> Result<Self, String> {
        match given {
            "fitted" => return Ok(Self::Fitted),
            "constant" => return Ok(Self::Constant),
            "operations" => return Ok(Self::Operations),
            name if BASELINES.contains(&name) => {
                let strategy = Strategy::parse(name).map_err(|e| e.to_string())?;
                return Ok(Self::Strategy(strategy));
            }
            _ => {}
        }
        if let Some((name, trials)) = given.rsplit_once('+')
            && let (Ok(trials), Some(profile)) = (trials.parse(), DeviceProfile::named(name))
        {
            return Ok(Self::Tried(name.into(), Box::new(profile), trials));
        }
        if let Some(profile) = DeviceProfile::named(given) {
            return Ok(Self::Profile(given.into(), Box::new(profile)));
        }
        let path = Path::new(given);
        let text = input::read_to_string(path).map_err(|e| unread(given, &reason(&e)))?;
        let named = |why: String| format!("`{given}`: {why}");
        if path.extension().is_some_and(|e| e == "csv") {
            return Ok(Self::Table(given.into(), of_csv(&text).map_err(named)?));
        }
        let value: serde_json::Value = serde_json::from_str(&text).map_err(|e| {
            named(format!(
                "it is no JSON: {e}\n  hint: tables end in `.csv` or `.json`"
            ))
        })?;
        if value.get("weights").is_some() {
            let profile = DeviceProfile::parse(&text).map_err(|e| named(e.to_string()))?;
            return Ok(Self::Profile(given.into(), Box::new(profile)));
        }
        Ok(Self::Table(given.into(), of_json(&value).map_err(named)?))
    }

    /// What it is called in tables.
    pub fn name(&self) -> String {
        match self {
            Self::Profile(name, _) => format!("profile {name}"),
            Self::Table(name, _) => {
                let stem = Path::new(name).file_stem().unwrap_or_default();
                stem.to_string_lossy().into_owned()
            }
            Self::Tried(name, _, trials) => {
                format!("profile {name}, {trials} trials")
            }
            Self::Fitted => "fitted to the other half".into(),
            Self::Constant => "constant".into(),
            Self::Operations => "operations".into(),
            Self::Strategy(strategy) => format!("always {strategy}"),
        }
    }

    /// The models that take its place on mixes at even and at odd places.
    ///
    /// # Errors
    /// If they cannot be fitted.
    pub(super) fn of_halves(&self, all: &[&Measurement]) -> Result<[Self; 2], String> {
        if !matches!(self, Self::Fitted) {
            return Ok([self.clone(), self.clone()]);
        }
        let fitted = |rest: usize| {
            let half = all.iter().skip(rest).step_by(2);
            let half: Vec<Measurement> = half.map(|set| (*set).clone()).collect();
            let fitted = calibrate::fit(&half, &calibrate::start(&half)?);
            Ok::<_, String>(Self::Profile("fitted".into(), Box::new(fitted.profile)))
        };
        let failed = |why| format!("nothing can be fitted to half of the mixes: {why}");
        Ok([fitted(1).map_err(failed)?, fitted(0).map_err(failed)?])
    }

    /// The plan of a strategy, which asks no model, and those that are tried; none of other models.
    ///
    /// # Errors
    /// If the strategy must know what is not known.
    pub(super) fn plans(&self, set: &Measurement) -> Result<Vec<Plan>, String> {
        let (strategy, profile, trials) = match self {
            Self::Strategy(strategy) => (*strategy, None, 0),
            Self::Tried(_, profile, trials) => (Strategy::AUTO, Some(&**profile), *trials),
            _ => return Ok(Vec::new()),
        };
        let (names, costs) = (names(set), costs(set));
        let hits = set.workload.materials.iter().enumerate();
        let unused = hits.filter(|(_, hits)| !hits.on_surface);
        let unused: Vec<usize> = unused.map(|(at, _)| at).collect();
        let inputs = PlanInputs {
            unused: &unused,
            costs: Some(&costs),
            workload: Some(&set.workload),
            profile,
            ..PlanInputs::of_names(&names)
        };
        let plan = strategy.plan(&inputs);
        let plan = plan.map_err(|e| format!("`{}`: {e}", set.scene))?;
        let others = candidates(&inputs, &plan, trials).into_iter();
        let others: Vec<Plan> = others.map(|candidate| candidate.plan).collect();
        Ok([vec![plan], others].concat())
    }

    /// The seconds that it says of the kernels of a mix, in their order. Constants that a baseline has are fitted to
    /// `all` mixes.
    pub(super) fn predict(&self, set: &Measurement, all: &[&Measurement]) -> Vec<Option<f64>> {
        match self {
            Self::Profile(_, profile) => {
                let costs = costs(set);
                let model = Calibrated {
                    costs: &costs,
                    workload: &set.workload,
                    profile,
                };
                let total = |k: &Kernel| model.predict(k.form, &set.members(k)).total;
                set.kernels.iter().map(|k| Some(total(k))).collect()
            }
            Self::Table(_, table) => {
                let key = |k: &Kernel| (set.scene.clone(), key(set, k));
                let kernels = set.kernels.iter();
                kernels.map(|k| table.get(&key(k)).copied()).collect()
            }
            Self::Constant => {
                let kernels = all.iter().flat_map(|set| &set.kernels);
                let one = median(kernels.map(|k| k.measured));
                vec![one; set.kernels.len()]
            }
            Self::Operations => {
                let [launch, each] = line(all);
                let one = |k: &Kernel| Some(launch + each * operations(set, k));
                set.kernels.iter().map(one).collect()
            }
            Self::Strategy(_) | Self::Tried(..) | Self::Fitted => vec![None; set.kernels.len()],
        }
    }
}

fn names(set: &Measurement) -> Vec<String> {
    set.materials.iter().map(|m| m.name.clone()).collect()
}

fn costs(set: &Measurement) -> Vec<Option<Cost>> {
    set.materials.iter().map(|m| m.cost.clone()).collect()
}

/// A kernel as tables name it: `mixed:a,b`, materials in alphabetical order.
fn key(set: &Measurement, kernel: &Kernel) -> String {
    let members = set.members(kernel);
    let mut members: Vec<&str> = members
        .iter()
        .map(|m| set.materials[*m].name.as_str())
        .collect();
    members.sort_unstable();
    format!("{}:{}", kernel.form.name(), members.join(","))
}

/// Operations of all hits of a kernel in an iteration.
fn operations(set: &Measurement, kernel: &Kernel) -> f64 {
    let one = |m: usize| {
        let mean = set.materials[m]
            .cost
            .as_ref()
            .map_or(0.0, |c| c.operations.mean);
        mean * set.workload.materials[m].share * f64::from(set.pool)
    };
    set.members(kernel).into_iter().map(one).sum()
}

/// A time for each kernel, that of the fastest with a queue, and one for each operation, the median of what is left.
fn line(all: &[&Measurement]) -> [f64; 2] {
    let kernels = || {
        all.iter()
            .flat_map(|set| set.kernels.iter().map(move |k| (*set, k)))
    };
    let queued = kernels().filter(|(_, k)| k.form != Form::Inline);
    let launch = queued
        .map(|(_, k)| k.measured)
        .min_by(f64::total_cmp)
        .unwrap_or(0.0);
    let each = kernels().filter_map(|(set, k)| {
        let operations = operations(set, k);
        (operations > 0.0).then(|| (k.measured - launch) / operations)
    });
    [launch, median(each).unwrap_or(0.0).max(0.0)]
}

/// What a table needs.
const FORMAT: &str = "hint: a table has rows `mix,kernel,seconds` (CSV), or is an object of objects \
                      {\"mix\": {\"kernel\": seconds}} (JSON), as in `mix_7_01,\"mixed:dots,wood\",2.1e-5`";

fn of_csv(text: &str) -> Result<BTreeMap<(String, String), f64>, String> {
    let mut table = BTreeMap::new();
    for (at, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') || at == 0 && line.starts_with("mix,") {
            continue;
        }
        let fields = line.split_once(',').and_then(|(mix, rest)| {
            let (kernel, seconds) = rest.rsplit_once(',')?;
            let seconds = seconds.trim().trim_matches('"').parse::<f64>().ok()?;
            Some((
                mix.trim().trim_matches('"'),
                kernel.trim().trim_matches('"'),
                seconds,
            ))
        });
        let fields = fields.filter(|(.., seconds)| seconds.is_finite());
        let (mix, kernel, seconds) = fields
            .ok_or_else(|| format!("line {} is no prediction: {line}\n  {FORMAT}", at + 1))?;
        table.insert((mix.to_owned(), sorted(kernel)), seconds);
    }
    filled(table)
}

fn of_json(value: &serde_json::Value) -> Result<BTreeMap<(String, String), f64>, String> {
    let wrong = |what: String| format!("{what}\n  {FORMAT}");
    let mixes = value
        .as_object()
        .ok_or_else(|| wrong("it is no table".into()))?;
    let mut table = BTreeMap::new();
    for (mix, kernels) in mixes {
        let kernels = kernels.as_object();
        let kernels = kernels.ok_or_else(|| wrong(format!("`{mix}` has no kernels")))?;
        for (kernel, seconds) in kernels {
            let seconds = seconds.as_f64().filter(|seconds| seconds.is_finite());
            let seconds =
                seconds.ok_or_else(|| wrong(format!("`{kernel}` of `{mix}` has no seconds")))?;
            table.insert((mix.clone(), sorted(kernel)), seconds);
        }
    }
    filled(table)
}

fn filled<T>(table: BTreeMap<T, f64>) -> Result<BTreeMap<T, f64>, String> {
    if table.is_empty() {
        return Err(format!("it has no predictions\n  {FORMAT}"));
    }
    Ok(table)
}

/// The name of a kernel with its materials in alphabetical order.
fn sorted(kernel: &str) -> String {
    let Some((form, members)) = kernel.split_once(':') else {
        return kernel.to_owned();
    };
    let mut members: Vec<&str> = members.split(',').map(str::trim).collect();
    members.sort_unstable();
    format!("{form}:{}", members.join(","))
}

fn unread(given: &str, why: &str) -> String {
    let known: Vec<&str> = DeviceProfile::shipped_names()
        .chain(["fitted"])
        .chain(BASELINES)
        .collect();
    let hint = match nearest(given, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("give a file, or one of {}", known.join(", ")),
    };
    format!("there is no model `{given}`: {why}\n  hint: {hint}")
}
