//! How a profile as it is does on measurements that were kept, such as those of another version of the
//! model: what it predicts of every kernel, and which plan it would choose. No GPU is needed.

use std::fmt::Write;

use impasto_compiler::cost::Cost;
use impasto_compiler::partition::{Calibrated, DeviceProfile, Form, PlanInputs, Strategy, text};
use impasto_runtime::lab::statistics::median;
use serde::Serialize;

use crate::measure::Measurement;

/// What a profile says of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Scored {
    /// The scene.
    pub scene: String,
    /// Paths in flight.
    pub pool: u32,
    /// The profile's name.
    pub profile: String,
    /// The partition that it chooses.
    pub auto: String,
    /// Every kernel of the measurement, in its order.
    pub kernels: Vec<Scores>,
}

/// A kernel.
#[derive(Clone, Debug, Serialize)]
pub struct Scores {
    /// Its form.
    pub form: Form,
    /// Its materials.
    pub members: Vec<String>,
    /// Seconds.
    pub predicted: f64,
    /// Seconds.
    pub measured: f64,
}

/// What the profile of that name says of measurements.
///
/// # Errors
/// If it cannot choose a plan for one of them.
pub fn score(sets: &[Measurement], profile: (&str, &DeviceProfile)) -> Result<Vec<Scored>, String> {
    sets.iter().map(|set| one(set, profile)).collect()
}

fn one(set: &Measurement, (name, profile): (&str, &DeviceProfile)) -> Result<Scored, String> {
    let names: Vec<String> = set.materials.iter().map(|m| m.name.clone()).collect();
    let costs: Vec<Option<Cost>> = set.materials.iter().map(|m| m.cost.clone()).collect();
    let hits = set.workload.materials.iter().enumerate();
    let unused: Vec<usize> = hits
        .filter(|(_, h)| !h.on_surface)
        .map(|(m, _)| m)
        .collect();
    let inputs = PlanInputs {
        names: &names,
        unused: &unused,
        costs: Some(&costs),
        workload: Some(&set.workload),
        profile: Some(profile),
    };
    let plan = Strategy::AUTO.plan(&inputs);
    let plan = plan.map_err(|error| format!("`{}`: {error}", set.scene))?;
    let model = Calibrated {
        costs: &costs,
        workload: &set.workload,
        profile,
    };
    let kernels = set.kernels.iter().map(|kernel| Scores {
        form: kernel.form,
        members: kernel.members.clone(),
        predicted: model.predict(kernel.form, &set.members(kernel)).total,
        measured: kernel.measured,
    });
    Ok(Scored {
        scene: set.scene.clone(),
        pool: set.pool,
        profile: name.into(),
        auto: text::print(&plan, &names),
        kernels: kernels.collect(),
    })
}

/// Scores for people to read: a line a measurement.
pub fn scores_text(scored: &[Scored]) -> String {
    let mut out = format!(
        "{:<20} {:>9} {:>8} {:>8}  auto\n",
        "scene", "paths", "kernels", "median"
    );
    for set in scored {
        let positive = set.kernels.iter().filter(|k| k.measured > 0.0);
        let median = median(positive.map(|k| (k.predicted / k.measured - 1.0).abs()))
            .map_or_else(|| "-".into(), |e| format!("{:.1} %", 100.0 * e));
        let (scene, count) = (&set.scene, set.kernels.len());
        let _ = writeln!(
            out,
            "{scene:<20} {:>9} {count:>8} {median:>8}  {}",
            set.pool, set.auto
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::fit::tests::measured_by;
    use super::*;

    #[test]
    fn predictions_are_those_of_the_profile_and_its_choice_follows() {
        let truth = DeviceProfile::named("h200").expect("shipped");
        let sets = measured_by(&truth);
        let scored = score(&sets, ("h200", &truth)).expect("plans");
        assert_eq!(scored.len(), sets.len());
        for (scored, set) in scored.iter().zip(&sets) {
            assert_eq!(scored.kernels.len(), set.kernels.len());
            assert!(scored.kernels.iter().all(|k| k.predicted == k.measured));
        }
        assert!(scores_text(&scored).contains("0.0 %"));
        // Where a dispatch takes a second, no plan has one.
        let mut slow = truth;
        slow.weights.launch = 1.0;
        for scored in score(&sets, ("slow", &slow)).expect("plans") {
            let auto = &scored.auto;
            assert!(auto.starts_with("inline:") && !auto.contains('|'), "{auto}");
            let own = scored.kernels.iter().find(|k| k.form == Form::Own);
            assert!(own.expect("an own kernel").predicted > 1.0);
        }
    }
}
