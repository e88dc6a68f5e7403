//! What is said of an automatic plan after a render: when it was there, and what trials beside it came to.

use impasto::runtime::render::report::{ReplanReport, TrialReport};

/// What became of the automatic plan.
pub(super) fn note(change: &ReplanReport) -> String {
    let (iteration, seconds) = (change.at_iteration, change.at_seconds);
    match (&change.kept, &change.to) {
        (Some(why), _) => format!("warning: the first plan went on: {why}"),
        (None, Some(plan)) if *plan != change.from => {
            let tried = tried(change);
            format!("planned after {iteration} iterations ({seconds:.1} s): {plan}{tried}")
        }
        _ => {
            let tried = tried(change);
            format!("a kernel a material is the best plan, found after {seconds:.1} s{tried}")
        }
    }
}

/// What trials beside the plan came to.
fn tried(change: &ReplanReport) -> String {
    let ran = |trial: &&TrialReport| trial.seconds.is_some();
    let tried = match change.trials.iter().filter(ran).count() {
        0 => return String::new(),
        1 => "another plan was".into(),
        n => format!("{n} other plans were"),
    };
    let mut faster = change.trials.iter().filter(|trial| trial.kept);
    // Each is held against the fastest before it.
    let share = faster.clone().map(|trial| {
        let times = trial.seconds.zip(trial.seconds_before);
        times.map_or(1.0, |(seconds, before)| seconds / before)
    });
    let share: f64 = share.product();
    match faster.next_back() {
        None => format!("; {tried} tried, none faster"),
        Some(trial) => {
            let (plan, less) = (&trial.plan, 100.0 * (1.0 - share));
            format!("; {tried} tried, and {plan} takes {less:.1} % less time")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(trials: serde_json::Value) -> ReplanReport {
        let report = serde_json::json!({
            "at_iteration": 32, "at_seconds": 0.44, "planning_seconds": 0.1, "compile_seconds": 0.2,
            "from": "own:a|own:b", "to": "mixed:a,b", "gpu_seconds": 0.4, "kernels": [], "trials": trials,
        });
        serde_json::from_value(report).expect("a report")
    }

    #[test]
    fn trials_are_summed_up() {
        let planned = "planned after 32 iterations (0.4 s): mixed:a,b";
        assert_eq!(note(&change(serde_json::json!([]))), planned);
        let slower = |plan: &str| serde_json::json!({"plan": plan, "compile_seconds": 0.1, "seconds": 0.011, "seconds_before": 0.01, "kept": false});
        let faster = |plan: &str, seconds: f64, before: f64| serde_json::json!({"plan": plan, "compile_seconds": 0.1, "seconds": seconds, "seconds_before": before, "kept": true});
        let failed = serde_json::json!({"plan": "own:a", "compile_seconds": 0.0, "kept": false, "failed": "no"});
        let said = |trials: &[serde_json::Value]| note(&change(trials.to_vec().into()));
        assert_eq!(
            said(&[slower("own:a|own:b"), failed]),
            format!("{planned}; another plan was tried, none faster")
        );
        assert_eq!(
            said(&[
                faster("inline:a,b", 0.008, 0.01),
                slower("own:a|own:b"),
                faster("own:a|inline:b", 0.006, 0.008),
            ]),
            format!(
                "{planned}; 3 other plans were tried, and own:a|inline:b takes 40.0 % less time"
            )
        );
    }
}
