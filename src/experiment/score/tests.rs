//! Scores: of a model that is right, of one that was planted to be wrong, of tables, and of files that are none.

use impasto_compiler::partition::DeviceProfile;

use super::*;
use crate::calibrate::{all_measured_by, measured_by};
use crate::experiment::records::Stamp;

fn truth() -> DeviceProfile {
    DeviceProfile::named("h200").expect("it is shipped")
}

fn profile(name: &str, change: impl Fn(&mut DeviceProfile)) -> Model {
    let mut profile = truth();
    change(&mut profile);
    Model::Profile(name.into(), Box::new(profile))
}

/// The table whose seconds are `of` those measured, as CSV.
fn table(sets: &[Measurement], of: impl Fn(f64) -> f64) -> String {
    let mut out = String::from("mix,kernel,seconds\n");
    for set in sets {
        for kernel in &set.kernels {
            // In whatever order.
            let members: Vec<&str> = kernel.members.iter().rev().map(String::as_str).collect();
            let kernel_name = format!("{}:{}", kernel.form.name(), members.join(","));
            let seconds = of(kernel.measured);
            out += &format!("{},\"{kernel_name}\",{seconds:e}\n", set.scene);
        }
    }
    out
}

fn written(name: &str, text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    let path = path.display().to_string();
    (folder, path)
}

#[test]
fn a_planted_model_ranks_below_the_one_that_is_right() {
    let sets = measured_by(&truth());
    let planted = profile("planted", |profile| {
        profile.weights.launch = 1e-9;
        profile.weights.alu *= 1e-3;
        profile.weights.memory = 1e-9;
        profile.weights.inline_loads = 2.0;
    });
    let models = [
        profile("h200", |_| ()),
        planted,
        Model::Constant,
        Model::Operations,
    ];
    let scores = score(&sets, &models).expect("scored");
    let [ours, planted, constant, operations] = &scores[..] else {
        panic!("{scores:?}")
    };
    assert!(ours.median_error.is_some_and(|e| e < 1e-9) && ours.kernels > 100);
    assert!(ours.rank_correlation.is_some_and(|r| r > 0.999));
    let worst = |score: &Score| score.regret().map(|(_, worst, _)| worst);
    assert!(worst(ours).is_some_and(|w| w < 1.0 + 1e-9), "{ours:?}");
    for bad in [planted, constant, operations] {
        assert!(worst(bad) > worst(ours), "{bad:?}");
        assert!(bad.median_error > ours.median_error);
        assert!(bad.rank_correlation < ours.rank_correlation);
        assert!(bad.worst_kernels() > ours.worst_kernels());
    }
    let table = super::table(&scores);
    assert!(
        table.contains("| profile h200 | 0.0 % | 0.0 % | 1.000 |"),
        "{table}"
    );
    assert_eq!(scores_text(&scores).lines().count(), 5);
    assert!(
        by_size(&scores).contains("| constant | - |"),
        "{}",
        by_size(&scores)
    );
}

#[test]
fn strategies_are_scored_by_their_plans_alone() {
    let sets = measured_by(&truth());
    let models = ["own", "binned", "inline"].map(|name| Model::parse(name).expect("a baseline"));
    let scores = score(&sets, &models).expect("scored");
    for (score, form) in scores.iter().zip(["own", "binned", "inline"]) {
        assert_eq!((score.kernels, score.median_error), (0, None));
        assert_eq!(score.mixes.len(), sets.len());
        assert!(
            score.mixes.iter().all(|lost| lost.plan.starts_with(form)),
            "{score:?}"
        );
        assert!(score.mixes.iter().all(|lost| lost.regret >= 1.0 - 1e-12));
    }
}

#[test]
fn tables_of_predictions_are_scored() {
    let sets = measured_by(&truth());
    let (_folder, right) = written("right.csv", &table(&sets, |seconds| seconds));
    let (_other, wrong) = written("wrong.csv", &table(&sets, |seconds| 1e-9 / seconds));
    let models = [right, wrong].map(|path| Model::parse(&path).expect("a table"));
    let scores = score(&sets, &models).expect("scored");
    let [right, wrong] = &scores[..] else {
        panic!("{scores:?}")
    };
    assert_eq!((&*right.model, right.best()), ("right", 1.0));
    assert!(right.median_error.is_some_and(|e| e < 1e-9));
    assert!(
        right
            .regret()
            .is_some_and(|(_, worst, _)| worst < 1.0 + 1e-9)
    );
    assert!(
        wrong.regret().is_some_and(|(_, worst, _)| worst > 1.02),
        "{wrong:?}"
    );
    assert!(wrong.rank_correlation.is_some_and(|r| r < 0.8), "{wrong:?}");
    assert!(wrong.median_error.is_some_and(|e| e > 0.5));
    // The same as JSON, of one mix alone.
    let kernels = sets[0].kernels.iter().map(|k| {
        let name = format!("{}:{}", k.form.name(), k.members.join(","));
        (name, serde_json::json!(k.measured))
    });
    let kernels: serde_json::Map<String, serde_json::Value> = kernels.collect();
    let json = serde_json::json!({ (&*sets[0].scene): kernels });
    let (_third, path) = written("one.json", &json.to_string());
    let model = Model::parse(&path).expect("a table");
    let scores = score(&sets, &[model]).expect("scored");
    let same = sets.iter().filter(|set| set.scene == sets[0].scene).count();
    assert_eq!(
        (scores[0].mixes.len(), scores[0].without_plan),
        (same, sets.len() - same)
    );
    assert!(super::table(&scores).contains("`one` has no plan for"));
}

#[test]
fn constants_are_fitted_to_the_mixes_that_they_are_not_scored_on() {
    let mut truth = truth();
    truth.weights.launch *= 3.0;
    truth.weights.memory *= 2.0;
    let sets = measured_by(&truth);
    let models = ["h200", "fitted"].map(|name| Model::parse(name).expect("a model"));
    let scores = score(&sets, &models).expect("scored");
    assert_eq!(scores[1].model, "fitted to the other half");
    assert!(
        scores[1].median_error < scores[0].median_error,
        "{scores:?}"
    );
    let alone = score(&sets[..1], &models[1..]).expect_err("nothing to fit to");
    assert!(
        alone.contains("half of the mixes: there are no measurements"),
        "{alone}"
    );
    // Beside models that need no fit it is told, and they are scored.
    let beside = score(&sets[..1], &models).expect("one has a score");
    assert!(beside[0].none.is_none() && beside[0].mixes.len() == 1);
    let page = super::table(&beside);
    assert!(page.contains("| fitted to the other half | - |"), "{page}");
    assert!(
        page.contains("`fitted to the other half` has no score: nothing"),
        "{page}"
    );
}

#[test]
fn what_is_no_model_is_refused() {
    let why = Model::parse("constnat").expect_err("misspelt");
    assert!(why.contains("no model `constnat`") && why.contains("did you mean `constant`?"));
    for (name, text, says) in [
        (
            "a.csv",
            "mix,kernel,seconds\nm,own:a\n",
            "line 2 is no prediction: m,own:a",
        ),
        ("b.csv", "m,own:a,NaN\n", "line 1 is no prediction"),
        ("c.csv", "mix,kernel,seconds\n", "it has no predictions"),
        ("d.json", "{", "it is no JSON"),
        ("e.json", "[1]", "it is no table"),
        ("f.json", "{\"m\": 3}", "`m` has no kernels"),
        (
            "g.json",
            "{\"m\": {\"own:a\": \"x\"}}",
            "`own:a` of `m` has no seconds",
        ),
        ("h.json", "{\"version\": 9, \"weights\": {}}", "version 9"),
    ] {
        let (_folder, path) = written(name, text);
        let why = Model::parse(&path).expect_err(text);
        assert!(
            why.contains(says) && why.contains(name),
            "{says} is not in {why}"
        );
    }
    let (_folder, path) = written("other.csv", "elsewhere,own:a,1\n");
    let model = Model::parse(&path).expect("a table");
    let why = score(&measured_by(&truth()), &[model]).expect_err("of other mixes");
    assert!(
        why.contains("`other`: it has a plan for none of the mixes"),
        "{why}"
    );
}

#[test]
fn data_are_rounded_and_read_again() {
    let sets = measured_by(&truth());
    let data = Dataset {
        stamps: vec![Stamp::default(); sets.len()],
        sets,
    };
    let text = data.text().expect("text");
    let again = Dataset::parse(&text).expect("data");
    assert_eq!(again.text().expect("text"), text);
    assert_eq!(
        (again.sets.len(), again.stamps.len()),
        (data.sets.len(), data.stamps.len())
    );
    let (a, b) = (&again.sets[0].kernels[3], &data.sets[0].kernels[3]);
    assert!((a.measured / b.measured - 1.0).abs() < 1e-4 && a.members == b.members);
    // `impasto calibrate --from` takes it as it is.
    assert!(crate::measure::Data::parse(&text).is_ok());
    for (text, says) in [
        ("{\"version\": 1, \"sets\": []}", "no measurements"),
        ("{\"version\": 3, \"sets\": []}", "version 3"),
        (&text[..text.len() / 2], "cannot be read"),
    ] {
        assert!(
            Dataset::parse(text).is_err_and(|why| why.contains(says)),
            "{says}"
        );
    }
}

/// On a GPU that is otherwise than the model, trials lose less than the model alone, and no more than the best strategy.
#[test]
fn trials_lose_less_than_the_model() {
    let mut other = truth();
    other.weights.pressure = 8.0;
    other.weights.launch *= 5.0;
    let sets = all_measured_by(&other);
    let names = ["h200", "h200+8", "own", "mixed", "binned", "inline"];
    let models = names.map(|name| Model::parse(name).expect("a model"));
    let scores = score(&sets, &models).expect("scored");
    let [alone, tried, strategies @ ..] = &scores[..] else {
        panic!("{scores:?}")
    };
    assert_eq!(tried.model, "profile h200, 8 trials");
    assert_eq!((tried.kernels, tried.without_plan), (0, 0));
    // Of material kernels alone: what takes the same in every plan would dilute it.
    let sum = |score: &Score| {
        let all = score.mixes.iter().filter_map(|lost| lost.kernels_regret);
        all.sum::<f64>()
    };
    assert!(sum(alone) > 1.002 * sets.len() as f64, "{}", sum(alone));
    assert!(sum(tried) < sum(alone), "{} of {}", sum(tried), sum(alone));
    for strategy in strategies {
        for (ours, theirs) in tried.mixes.iter().zip(&strategy.mixes) {
            assert!(ours.regret <= theirs.regret + 1e-9, "{ours:?} {theirs:?}");
        }
    }
    assert!(Model::parse("h200+x").is_err() && Model::parse("+8").is_err());
}
