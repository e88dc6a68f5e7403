//! `plan`: what it explains, what it saves, and what it refuses. The hits come from a file but for one
//! test, which counts them on the GPU.

use serde_json::{Value, json};

use crate::cli::common::{Run, SCENE, folder, impasto, root, write};

const WORKLOAD: &str = "tests/plans/cornell.workload.json";

/// Explains the Cornell box with the H200's profile.
fn plan(more: &[&str]) -> Run {
    let all = [
        "plan",
        SCENE,
        "--workload",
        WORKLOAD,
        "--profile",
        "h200",
        "--samples",
        "64",
    ];
    impasto(&[&all, more].concat())
}

fn partition(run: &Run) -> String {
    let partition = run.json()["partition"].as_str().map(str::to_owned);
    partition.expect("a partition")
}

#[test]
fn it_explains_the_automatic_plan() {
    let text = plan(&[]).exits(0).stdout;
    for part in [
        "plan `auto`",
        "profile: NVIDIA H200",
        "8,388,608 paths",
        "does not know",
        "paper",
    ] {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
    let json = plan(&["--format", "json"]).exits(0).json();
    let kernels = json["kernels"].as_array().expect("a list");
    let members = kernels
        .iter()
        .flat_map(|k| k["members"].as_array().expect("a list"));
    let mut names: Vec<&str> = members
        .map(|m| m["material"].as_str().expect("a name"))
        .collect();
    names.sort_unstable();
    assert_eq!(
        names,
        ["car_paint", "checker_tiles", "glass", "gold", "matte"]
    );
    let seconds = |v: &Value| v["predicted"]["total"].as_f64().expect("a number");
    let sum: f64 = kernels.iter().map(seconds).sum();
    assert!((json["seconds"].as_f64().expect("a number") / sum - 1.0).abs() < 1e-9);
    assert_eq!(json["workload"]["pool"], 1 << 23);
    assert_eq!(json["scene"], SCENE);
}

#[test]
fn any_strategy_and_partition_can_be_explained() {
    for (strategy, expected) in [
        (
            "paper",
            "own:car_paint|own:gold|mixed:checker_tiles,matte,glass",
        ),
        (
            "threshold=300",
            "own:checker_tiles|own:car_paint|own:gold|mixed:matte,glass",
        ),
        ("shared", "mixed:checker_tiles,matte,car_paint,glass,gold"),
    ] {
        let run = plan(&["--strategy", strategy, "--format", "json"]).exits(0);
        assert_eq!(partition(&run), expected);
    }
    let given = "binned:gold,car_paint|inline:*";
    let run = plan(&["--partition", given, "--pool", "4096", "--format", "json"]).exits(0);
    assert_eq!(
        partition(&run),
        "binned:car_paint,gold|inline:checker_tiles,matte,glass"
    );
    assert_eq!(run.json()["pool"], 4096);
}

#[test]
fn a_saved_plan_reads_back() {
    let folder = folder();
    let saved = folder.path().join("plan.json").display().to_string();
    let hits = folder.path().join("hits.json").display().to_string();
    let first = plan(&[
        "--save",
        &saved,
        "--save-workload",
        &hits,
        "--format",
        "json",
    ])
    .exits(0);
    let again = [
        "plan",
        SCENE,
        "--workload",
        &hits,
        "--profile",
        "h200",
        "--samples",
        "64",
    ];
    let again = impasto(&[&again[..], &["--plan", &saved, "--format", "json"]].concat()).exits(0);
    assert_eq!(first.json(), again.json());
}

#[test]
fn hits_are_counted_on_the_gpu() {
    let folder = folder();
    let hits = folder.path().join("hits.json").display().to_string();
    let args = [
        "plan",
        SCENE,
        "--pool",
        "4096",
        "--samples",
        "16",
        "--save-workload",
        &hits,
    ];
    let json = impasto(&[&args[..], &["--format", "json"]].concat())
        .exits(0)
        .json();
    assert_eq!(json["pool"], 4096);
    let share = |m: &Value| m["share"].as_f64().expect("a number");
    let materials = json["workload"]["materials"].as_array().expect("a list");
    let sum: f64 = materials.iter().map(share).sum();
    assert!((0.3..=1.0).contains(&sum), "{materials:?}");
    let text = std::fs::read_to_string(&hits).expect("it was saved");
    let saved: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(saved, json["workload"]);
}

#[test]
fn materials_without_surface_get_no_kernel() {
    let folder = folder();
    let scene = std::fs::read_to_string(root().join(SCENE)).expect("the scene");
    let base = root().join("examples/cornell");
    let scene = scene.replace("../../", &format!("{}/../../", base.display()));
    let scene = scene.replace(
        "cornell.obj",
        &base.join("cornell.obj").display().to_string(),
    );
    // The camera is in water, which no surface is of.
    let scene = scene.replacen("[camera]\n", "[camera]\nmedium = \"sea\"\n", 1);
    let water = root().join("materials/water.impasto");
    let scene = format!("{scene}\n[materials.sea]\nfile = \"{}\"\n", water.display());
    let scene = write(folder.path(), "scene.toml", &scene);
    let text = std::fs::read_to_string(root().join(WORKLOAD)).expect("the workload");
    let mut hits: Value = serde_json::from_str(&text).expect("JSON");
    let water = json!({"material": "water", "on_surface": false, "share": 0.0, "present": 0.0,
        "loads": 64.0, "stores": 64.0});
    hits["materials"]
        .as_array_mut()
        .expect("a list")
        .push(water);
    let hits = write(folder.path(), "hits.json", hits.to_string());
    let args = [
        "plan",
        &scene,
        "--workload",
        &hits,
        "--profile",
        "h200",
        "--samples",
        "16",
    ];
    let text = impasto(&args).exits(0).stdout;
    assert!(
        text.contains("no surface uses `water`: no kernel"),
        "{text}"
    );
    assert_eq!(text.matches("water").count(), 1, "{text}");
}

#[test]
fn what_does_not_fit_is_said_before_anything_is_rendered() {
    let folder = folder();
    let broken = write(folder.path(), "broken.json", "{\"version\": 1,");
    let other = write(folder.path(), "other.json", "{\"version\": 99}");
    let lacking = "{\"version\": 1, \"strategy\": \"own\", \"organisation\": \"wavefront\",
        \"kernels\": [{\"form\": \"own\", \"materials\": [\"matte\"]}]}";
    let unused = lacking.replace(
        "}]",
        "}], \"unused\": [\"car_paint\", \"checker_tiles\", \"glass\", \"gold\"]",
    );
    let lacking = write(folder.path(), "lacking.json", lacking);
    let unused = write(folder.path(), "unused.json", &unused);
    for (args, part) in [
        (["--partition", "mate|*"], "did you mean `matte`?"),
        (
            ["--partition", "matte|glass"],
            "leaves out `checker_tiles`, `car_paint` and `gold`",
        ),
        (["--partition", "matte,gold|gold|*"], "names `gold` twice"),
        (
            ["--partition", "inline:gold|inline:*"],
            "several inline groups",
        ),
        (["--strategy", "oven"], "did you mean `own`?"),
        (["--strategy", "threshold=x"], "as in `threshold=1000`"),
        (["--strategy", "mega"], "knows nothing of megakernels"),
        (["--plan", &broken], "the plan cannot be read"),
        (["--plan", &other], "version 99"),
        (
            ["--plan", &lacking],
            "lacks `checker_tiles`, `car_paint`, `glass` and `gold`",
        ),
        (["--plan", &unused], "which is on a surface of the scene"),
        (
            ["--plan", "nowhere.json"],
            "cannot read `nowhere.json`: no such file",
        ),
        (["--pool", "0"], "is not in 1.."),
    ] {
        plan(&args).exits(2).says(part).prints_nothing();
    }
    plan(&["--plan", &broken, "--strategy", "own"])
        .exits(2)
        .says("cannot be used with");
    plan(&["--plan", &broken, "--partition", "*"])
        .exits(2)
        .says("cannot be used with");
    plan(&["--partition", "*", "--strategy", "own"])
        .exits(2)
        .says("cannot be used with");
    let with = |option: &str, value: &str| {
        let mut args = vec!["plan", SCENE, "--samples", "16", option, value];
        args.extend(match option {
            "--profile" => ["--workload", WORKLOAD],
            _ => ["--profile", "h200"],
        });
        impasto(&args).exits(2).prints_nothing()
    };
    with("--profile", "voodoo").says("hint: give a file, or one of h200, h100, llvmpipe");
    with("--profile", &broken)
        .says("the device profile cannot be read")
        .says("impasto calibrate");
    with("--profile", &other).says("the device profile has version 99");
    with("--workload", &broken).says("the workload cannot be read");
    with("--workload", "tests/plans/glasses.workload.json")
        .says("has `water`, which the scene lacks");
    with("--workload", "nowhere.json").says("no such file");
}
