//! `plan --strategy exhaustive` and `calibrate`: kernels are measured, the constants of the model
//! fitted to them, and a plan made with those.

use crate::cli::common::{folder, impasto, write};

/// A scene with a floor, a wall and a post of a material each, and one that nothing binds.
fn scene(at: &std::path::Path) -> String {
    let quads = "v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -2 2 -2\nv 2 2 -2\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                 usemtl floor\nf 1 4 3 2\nusemtl wall\nf 1 2 6 5\nusemtl post\nf 7 8 9 10\n";
    write(at, "a.obj", quads);
    let material = |name: &str, albedo: &str| {
        let text = format!(
            "use std::bsdf::diffuse;\nmaterial {name} {{ surface = diffuse(color({albedo})); }}\n"
        );
        write(at, &format!("{name}.impasto"), text);
    };
    material("floor", "0.5 + 0.4 * sin(100.0 * position.x)");
    material("wall", "0.7");
    material("post", "0.2 + 0.1 * exp(-position.y)");
    let text = "camera.position = [0, 1, 3]\ncamera.look_at = [0, 0.6, 0]\ncamera.fov = 50\n\
                film = { width = 16, height = 16 }\nenvironment.color = 1.0\n\
                [[geometry]]\nobj = \"a.obj\"\n\
                [materials.floor]\nfile = \"floor.impasto\"\n\
                [materials.wall]\nfile = \"wall.impasto\"\n\
                [materials.post]\nfile = \"post.impasto\"\n";
    write(at, "scene.toml", text)
}

#[test]
fn what_is_measured_of_a_scene_makes_a_profile_that_plans() {
    let folder = folder();
    let scene = scene(folder.path());
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (best, profile) = (path("best.json"), path("profile.json"));
    let measure = [
        "plan",
        &scene,
        "--strategy=exhaustive",
        "--pool=512",
        "--repetitions=2",
        "--format=json",
        "--save",
        &best,
    ];
    let run = impasto(&measure).exits(0);
    let answer = run.json();
    // Three materials: 3 own, 7 inline, and 4 subsets of two and three both mixed and binned.
    let kernels = answer["kernels"].as_array().expect("a list");
    assert_eq!(kernels.len(), 3 + 7 + 2 * 4, "{:#}", answer["failed"]);
    for kernel in kernels {
        assert!(
            kernel["measured"].is_number() && kernel["spread"].is_number(),
            "{kernel}"
        );
        assert!(kernel["predicted"]["total"].is_number(), "{kernel}");
        let queued = kernel["form"] != "inline";
        assert!(
            !queued || kernel["measured"].as_f64() > Some(0.0),
            "{kernel}"
        );
    }
    for field in ["logic_seconds", "other_seconds", "planning_seconds"] {
        assert!(answer[field].as_f64() > Some(0.0), "{field}");
    }
    let plans = answer["plans"].as_array().expect("a list");
    let named = |name: &str| plans.iter().filter(|plan| plan["strategy"] == name).count();
    for strategy in [
        "auto", "own", "mixed", "binned", "inline", "paper", "best", "worst",
    ] {
        assert_eq!(named(strategy), 1, "{strategy}");
    }
    assert!(named("sample") > 0);
    // No plan is better than the best, and none is worse than the worst.
    let added =
        |plan: &serde_json::Value| plan["added"].as_f64().expect("every kernel is measured");
    let of = |name: &str| {
        plans
            .iter()
            .find(|plan| plan["strategy"] == name)
            .map(added)
    };
    if of("best") > Some(0.0) {
        let regret = of("auto").expect("a plan") / of("best").expect("a plan");
        let said = answer["regret"].as_f64().expect("a number");
        assert!((said / regret - 1.0).abs() < 1e-9, "{said} {regret}");
    }
    let partition = |name: &str| {
        plans
            .iter()
            .find(|p| p["strategy"] == name)
            .map(|p| &p["partition"])
    };
    assert_eq!(partition("best"), Some(&answer["best"]));
    assert_eq!(partition("auto"), Some(&answer["auto"]));
    let (least, most) = (of("best").expect("a plan"), of("worst").expect("a plan"));
    for plan in plans {
        assert!(
            added(plan) >= least - 1e-12 && added(plan) <= most + 1e-12,
            "{plan}"
        );
        assert!(plan["measured"].as_f64() > Some(0.0), "{plan}");
    }
    let own = plans
        .iter()
        .find(|plan| plan["strategy"] == "own")
        .expect("a plan");
    let sum: f64 = kernels
        .iter()
        .filter(|kernel| kernel["form"] == "own")
        .filter_map(|kernel| kernel["measured"].as_f64())
        .sum();
    assert!((added(own) / sum - 1.0).abs() < 1e-9);

    let data = write(folder.path(), "data.json", &run.stdout);
    let fit = impasto(&[
        "calibrate",
        "--from",
        &data,
        &data,
        "--out",
        &profile,
        "--format=json",
    ]);
    let fitted = fit.exits(0).json();
    assert_eq!(fitted["residuals"].as_array().map(Vec::len), Some(2 * 18));
    assert_eq!(fitted["profile"]["fit"]["points"], 36);
    let text = impasto(&["calibrate", "--from", &data]).exits(0).stdout;
    for part in ["predicted", "held out", "launch", "rank"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let planned = impasto(&["plan", &scene, "--profile", &profile, "--pool=512"]).exits(0);
    assert!(planned.stdout.contains("floor"), "{planned:#?}");
    let as_saved = impasto(&["plan", &scene, "--plan", &best, "--pool=512"]).exits(0);
    assert!(as_saved.stdout.contains("wall"), "{as_saved:#?}");
}

#[test]
fn measuring_ends_when_its_time_is_used_up() {
    let folder = folder();
    let scene = scene(folder.path());
    // No workload is taken where everything is measured.
    impasto(&[
        "plan",
        &scene,
        "--strategy=exhaustive",
        "--workload",
        "w.json",
    ])
    .exits(2)
    .says("takes no `--workload`");
    impasto(&["plan", &scene, "--strategy=exhaustive", "--limit=0"])
        .exits(2)
        .says("--limit");
    // However short the time is, the kernels of strategies' plans are timed: there is a best plan.
    let words = [
        "plan",
        &scene,
        "--strategy=exhaustive",
        "--limit=1",
        "--pool=512",
    ];
    let more = ["--repetitions=1", "--format=json"];
    let told = impasto(&[&words[..], &more].concat()).exits(0).json();
    assert!(
        told["best"].as_str().is_some_and(|best| !best.is_empty()),
        "{told}"
    );
    assert!(
        told["kernels"].as_array().is_some_and(|k| k.len() > 3),
        "{told}"
    );
}

#[test]
fn files_that_cannot_be_fitted_are_named_with_what_to_do() {
    let folder = folder();
    let refused = |text: &str, part: &str| {
        let file = write(folder.path(), "data.json", text);
        impasto(&["calibrate", "--from", &file])
            .exits(2)
            .prints_nothing()
            .says("data.json")
            .says(part)
            .says("hint: measure again");
    };
    refused("not JSON", "cannot be read");
    refused("{\"version\": 99, \"sets\": []}", "version 99");
    refused("{\"kernels\": []}", "missing field");
    impasto(&["calibrate", "--from", "no/such/file.json"])
        .exits(2)
        .says("no such file");
    let empty = write(
        folder.path(),
        "empty.json",
        "{\"version\": 1, \"sets\": []}",
    );
    impasto(&["calibrate", "--from", &empty])
        .exits(2)
        .says("there are no measurements");
    impasto(&["calibrate", "--from", &empty, "--quick"]).exits(2);
    impasto(&[
        "calibrate",
        "--from",
        &empty,
        "--out",
        "no/such/folder/p.json",
    ])
    .exits(2)
    .says("there is no folder");
    impasto(&["calibrate", "--gpu", "voodoo"])
        .exits(75)
        .says("no GPU is called `voodoo`");
}
