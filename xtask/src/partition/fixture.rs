//! Answers of `impasto plan --strategy exhaustive` by hand, for tests: three materials whose best plan and
//! whose regret are known, and one that is on no surface.

use super::answer;
use super::cases::Case;
use super::results::{Render, Results, Scene};

/// Microseconds of a kernel: form, members, predicted, measured.
///
/// The least sum is that of `mixed:a,b|inline:c`: 30 + 15. What was predicted makes
/// `own:a|own:b|own:c` look best: 12 + 14 + 20, where 20 + 18 + 22 = 60 was measured.
const KERNELS: [(&str, &str, f64, f64); 18] = [
    ("own", "a", 12.0, 20.0),
    ("own", "b", 14.0, 18.0),
    ("own", "c", 20.0, 22.0),
    ("mixed", "a b", 35.0, 30.0),
    ("mixed", "a c", 40.0, 44.0),
    ("mixed", "b c", 41.0, 45.0),
    ("mixed", "a b c", 60.0, 90.0),
    ("binned", "a b", 33.0, 36.0),
    ("binned", "a c", 37.0, 43.0),
    ("binned", "b c", 38.0, 42.0),
    ("binned", "a b c", 50.0, 55.0),
    ("inline", "a", 25.0, 27.0),
    ("inline", "b", 26.0, 28.0),
    ("inline", "c", 28.0, 15.0),
    ("inline", "a b", 45.0, 50.0),
    ("inline", "a c", 48.0, 52.0),
    ("inline", "b c", 49.0, 53.0),
    ("inline", "a b c", 70.0, 95.0),
];

/// Strategy, partition, microseconds of a whole iteration if one was timed. Logic takes 40, all else 60.
const PLANS: [(&str, &str, Option<f64>); 8] = [
    ("auto", "own:a|own:b|own:c", Some(161.0)),
    ("own", "own:a|own:b|own:c", Some(161.0)),
    ("mixed", "mixed:a,b,c", None),
    ("binned", "binned:a,b,c", None),
    ("inline", "inline:a,b,c", None),
    ("paper", "own:c|mixed:a,b", Some(150.0)),
    ("threshold=1000", "own:a|mixed:b,c", None),
    ("sample", "own:b|binned:a,c", Some(168.0)),
];

/// The answer as JSON.
pub(super) fn answer_json() -> serde_json::Value {
    let kernels = KERNELS.map(|(form, members, predicted, measured)| {
        let members: Vec<&str> = members.split(' ').collect();
        serde_json::json!({
            "form": form, "members": members,
            "predicted": { "launch": 0.0, "total": predicted * 1e-6 },
            "measured": measured * 1e-6, "spread": 0.01,
        })
    });
    let plans = PLANS.map(|(strategy, partition, measured)| {
        serde_json::json!({
            "strategy": strategy, "partition": partition, "measured": measured.map(|us| us * 1e-6),
        })
    });
    let hits = |name: &str, on_surface: bool, share: f64, present: f64| serde_json::json!({ "material": name, "on_surface": on_surface, "share": share, "present": present });
    serde_json::json!({
        "scene": "tiny", "adapter": { "name": "GPU", "backend": "vulkan", "driver": "1.0" },
        "profile": "", "pool": 1048576, "repetitions": 9,
        "workload": {
            "pool": 1048576,
            "materials": [hits("a", true, 0.5, 0.9), hits("b", true, 0.25, 0.8), hits("c", true, 0.125, 0.125),
                          hits("ghost", false, 0.0, 0.0)],
            "loads": 64.0, "stores": 48.0, "logic_seconds": 4e-5, "other_seconds": 6e-5,
        },
        "materials": [{ "name": "a", "cost": { "operations": { "mean": 1200.0 } } }, { "name": "b", "cost": null }],
        "kernels": kernels, "logic_seconds": 4e-5, "other_seconds": 6e-5, "plans": plans,
        "auto": "own:a|own:b|own:c", "best": "mixed:a,b|inline:c", "regret": 60.0 / 45.0,
        "planning_seconds": 1e-4,
    })
}

/// What is measured.
pub(super) fn case() -> Case {
    Case {
        name: "tiny".into(),
        about: "three of a kind".into(),
        hits: "random".into(),
        shares: "even".into(),
        scene: "examples/mixes/generated/tiny.toml".into(),
        samples: 1,
        paper: false,
    }
}

/// A scene of the fixture.
pub(super) fn scene() -> Scene {
    let answer = answer::read(&answer_json()).expect("an answer");
    let mut scene = Scene::new(&case(), "abc", "impasto plan", &answer).expect("a scene");
    let render = |label: &str, rates: [f64; 2]| Render {
        label: label.into(),
        options: vec![format!("--strategy={label}")],
        rates: rates.into(),
    };
    scene.renders = vec![
        render("auto's plan", [1.0e8, 1.1e8]),
        render("mega", [0.5e8, 0.55e8]),
    ];
    scene
}

/// Results with the scene alone.
pub(super) fn results() -> Results {
    let mut results = Results {
        schema: 1,
        version: "abc".into(),
        ..Results::default()
    };
    results.adapter.name = "GPU".into();
    results.put(scene());
    results
}
