//! `render` by every kind of plan: the picture is the same, the report says what ran, and plans that
//! cannot be are refused before anything is rendered.

use std::path::Path;

use crate::cli::common::{Run, SCENE, command, folder, impasto, root, write};

/// Renders the example, small and with few samples, into a film file.
fn film(folder: &Path, more: &[&str]) -> (Vec<u8>, serde_json::Value, Run) {
    sized_film(folder, ["12x12", "2"], more)
}

/// Renders the example into a film file; its bytes and the report.
fn sized_film(
    folder: &Path,
    [size, spp]: [&str; 2],
    more: &[&str],
) -> (Vec<u8>, serde_json::Value, Run) {
    let [film, report] = ["p.film", "r.json"].map(|n| folder.join(n).display().to_string());
    let mut args = vec![
        "render", SCENE, "--device", "gpu", "--size", size, "--spp", spp,
    ];
    args.extend(["--out", &film, "--report", &report]);
    args.extend(more);
    let run = impasto(&args).exits(0);
    let bytes = std::fs::read(&film).expect("the film");
    let text = std::fs::read_to_string(&report).expect("the report");
    let json = serde_json::from_str(&text).expect("JSON");
    (bytes, json, run)
}

/// The same film, but for drivers that round another way in another kernel.
fn is_exact() -> bool {
    impasto(&["info", "--device", "gpu", "--format", "json"])
        .exits(0)
        .json()["kind"]
        == "software"
}

#[test]
fn every_way_to_plan_renders_the_same_picture() {
    let folder = folder();
    let exact = is_exact();
    let plan = folder.path().join("plan.json").display().to_string();
    let names = ["checker_tiles", "matte", "car_paint", "glass", "gold"];
    let own = names.map(|name| format!("own:{name}")).join("|");
    let (reference, report, _) = film(folder.path(), &["--strategy", "own"]);
    assert_eq!(
        (&report["strategy"], &report["plan"]),
        (&"own".into(), &own.clone().into())
    );
    assert!(report["workload"].is_null() && report["replanned"].is_null());
    let all = names.join(",");
    for (options, strategy, expected) in [
        (vec![], "auto", own.clone()),
        (vec!["--strategy", "wavefront"], "own", own.clone()),
        (
            vec!["--strategy", "binned"],
            "binned",
            format!("binned:{all}"),
        ),
        (
            vec!["--strategy", "shared"],
            "mixed",
            format!("mixed:{all}"),
        ),
        (
            vec!["--strategy", "inline"],
            "inline",
            format!("inline:{all}"),
        ),
        (vec!["--strategy", "mega"], "mega", "mega".to_owned()),
        (
            vec!["--partition", "inline:matte|binned:gold,glass|*"],
            "partition",
            "inline:matte|binned:glass,gold|mixed:checker_tiles,car_paint".to_owned(),
        ),
    ] {
        let (bytes, report, _) = film(folder.path(), &options);
        assert!(!exact || bytes == reference, "{options:?}");
        assert_eq!(report["strategy"], strategy, "{options:?}");
        assert_eq!(report["plan"], expected, "{options:?}");
        assert_eq!(report["queue_overflow"], 0);
        // A short render is counted, and not planned anew.
        assert_eq!(
            !report["workload"].is_null(),
            strategy == "auto",
            "{options:?}"
        );
        assert!(report["replanned"].is_null());
    }
    // The paper's choice, kept in a file and rendered from it.
    let (_, by_hand, _) = film(folder.path(), &["--strategy", "paper"]);
    let partition = by_hand["plan"].as_str().expect("a plan").to_owned();
    let kept = [
        "plan",
        SCENE,
        "--device",
        "gpu",
        "--pool",
        "1024",
        "--partition",
        &partition,
        "--save",
        &plan,
    ];
    impasto(&kept).exits(0);
    let (bytes, report, _) = film(folder.path(), &["--plan", &plan]);
    assert!(!exact || bytes == reference);
    assert_eq!(report["plan"], by_hand["plan"]);
}

/// A render that takes a while begins with a kernel a material, and goes on with the plan that the time
/// model chooses. The film has the same bits.
#[test]
fn the_automatic_plan_takes_over_while_rendering() {
    let folder = folder();
    let render = |strategy| {
        let options = ["--pool", "4096", "--strategy", strategy];
        sized_film(folder.path(), ["24x24", "1500"], &options)
    };
    let (reference, ..) = render("own");
    let (bytes, report, run) = render("auto");
    assert!(!is_exact() || bytes == reference);
    let change = &report["replanned"];
    assert!(!change.is_null() && change["kept"].is_null(), "{report:#}");
    assert_eq!(change["to"], report["plan"]);
    let first = change["from"].as_str().unwrap_or_default();
    assert!(first.starts_with("own:checker_tiles|own:matte"), "{first}");
    for field in [
        "at_iteration",
        "at_seconds",
        "planning_seconds",
        "compile_seconds",
        "gpu_seconds",
    ] {
        assert!(
            change[field].as_f64().is_some_and(|n| n > 0.0),
            "{field}: {change:#}"
        );
    }
    assert!(change["at_iteration"].as_u64() < report["iterations"].as_u64());
    let shares = report["workload"]["materials"].as_array().expect("hits");
    assert_eq!(shares.len(), 5);
    let summary = if change["to"] == change["from"] {
        "best plan"
    } else {
        "planned after"
    };
    run.says(summary);
}

#[test]
fn plans_that_cannot_be_are_refused() {
    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    let broken = write(folder.path(), "broken.json", "{ \"kernels\": 3 }");
    let refused = |options: &[&str]| {
        let mut args = vec![
            "render", SCENE, "--device", "gpu", "--spp", "1", "--out", &out,
        ];
        args.extend(options);
        let run = impasto(&args).exits(2).prints_nothing();
        assert!(!Path::new(&out).exists(), "{options:?}");
        run
    };
    refused(&["--partition", "own:matte|own:matte|*"]).says("`matte`");
    refused(&["--partition", "own:marble|*"]).says("marble");
    refused(&["--partition", "own:matte"]).says("glass");
    refused(&["--partition", "inline:matte|inline:*"]).says("inline");
    refused(&["--partition", "*", "--strategy", "own"]).says("cannot be used with");
    refused(&["--plan", &broken]).says("broken.json");
    refused(&["--plan", "no_such_plan.json"]).says("no_such_plan.json");
    refused(&["--strategy", "exhaustive"]).says("impasto plan");
    refused(&["--device-profile", "no_such_gpu"]).says("h200");
    refused(&["--device-profile", &broken]).says("broken.json");
}

/// A scene of which the camera is in something that nothing is made of: that has no kernel.
#[test]
fn what_is_on_no_surface_has_no_kernel() {
    let folder = folder();
    write(
        folder.path(),
        "wall.obj",
        "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n",
    );
    let materials = root().join("materials").display().to_string();
    let scene = format!(
        "[camera]\nposition = [0, 0, 2]\nlook_at = [0, 0, 0]\nfov = 40\nmedium = \"inside\"\n\
         [film]\nwidth = 8\nheight = 8\n\
         [[geometry]]\nobj = \"wall.obj\"\nmaterial = \"wall\"\n\
         [materials.wall]\nfile = \"{materials}/matte.impasto\"\n\
         [materials.inside]\nfile = \"{materials}/glass.impasto\"\n\
         [environment]\ncolor = [1, 1, 1]\n"
    );
    let scene = write(folder.path(), "scene.toml", scene);
    let [film, report] = ["p.film", "r.json"].map(|n| folder.path().join(n).display().to_string());
    let output = command(&[
        "render", &scene, "--device", "gpu", "--spp", "2", "--out", &film, "--report", &report,
    ]);
    let mut output = output;
    Run::from(output.output().expect("the command starts")).exits(0);
    let text = std::fs::read_to_string(&report).expect("the report");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["plan"], "own:matte");
    assert_eq!(json["material_count"], 2);
    let kernels = json["kernels"].as_array().expect("kernels");
    assert!(
        kernels.iter().all(|k| k["name"] != "material_glass"),
        "{text}"
    );
    let on_surface = |i: usize| &json["workload"]["materials"][i]["on_surface"];
    assert_ne!(on_surface(0), on_surface(1));
}
