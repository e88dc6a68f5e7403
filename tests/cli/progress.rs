//! Progress where standard error is no terminal: plain lines that rise. Renders last for as long as they are told to,
//! so that there are some.

use crate::cli::common::{Run, SCENE, command, folder, impasto};

/// The percentages of the lines of progress.
#[track_caller]
fn percentages(run: &Run) -> Vec<u32> {
    let control = |c: char| c.is_control() && c != '\n';
    assert!(!run.stderr.contains(control), "{run:#?}");
    let lines = run
        .stderr
        .lines()
        .filter_map(|line| line.split_once(" %, "));
    let lines = lines.filter(|(_, rest)| rest.contains(" gone"));
    lines
        .map(|(percent, _)| percent.trim().parse().expect("a number"))
        .collect()
}

/// A line after 5, 10 and 15 seconds, each with a share of the time that was asked for.
#[test]
fn a_render_says_how_far_it_is() {
    let folder = folder();
    let out = folder.path().join("a.png").display().to_string();
    let arguments = ["render", SCENE, "--device", "cpu", "--size", "16x16"];
    let until = ["--until", "time=17s", "--out", &out];
    let run: Run = command(&[arguments.as_slice(), &until].concat())
        .output()
        .expect("it starts")
        .into();
    let run = run.exits(0).says("samples a pixel").says(" s left: ");
    let shown = percentages(&run);
    assert!((2..=4).contains(&shown.len()), "{shown:?} {run:#?}");
    assert!(shown.windows(2).all(|pair| pair[0] < pair[1]), "{shown:?}");
    assert!(
        shown.iter().all(|percent| (1..100).contains(percent)),
        "{shown:?}"
    );
}

/// Series, a reference and materials have one share, of the time that they may take.
#[test]
fn a_study_says_how_far_it_is_and_what_it_leaves_out() {
    let folder = folder();
    let out = folder.path().join("out").display().to_string();
    let arguments = ["converge", SCENE, "--device", "cpu", "--size", "12x8"];
    let limits = ["--seeds", "2", "--max-spp", "16777216", "--time", "12"];
    let more = ["--strategies", "mega,own", "--out", &out];
    let run = impasto(&[arguments.as_slice(), &limits, &more].concat());
    let run = run
        .exits(0)
        .says("warning: cornell: no time was left for ")
        .says("all renders of ")
        .says("more `--time`");
    for strategy in ["mega", "own"] {
        let name = format!("of `{strategy}` with `sobol`");
        assert!(run.stderr.contains(&name), "{run:#?}");
    }
    let shown = percentages(&run);
    assert!(!shown.is_empty(), "{run:#?}");
    assert!(shown.is_sorted(), "{shown:?}");
    let json = std::fs::read_to_string(folder.path().join("out/convergence.json"));
    let json: serde_json::Value = serde_json::from_str(&json.expect("there")).expect("JSON");
    let left = &json["scenes"][0]["series"][0]["left_out"];
    let last = left.as_array().and_then(|all| all.last()).expect("some");
    assert_eq!(last["samples"], 16_777_216, "{left}");
    assert_eq!(last["seeds"], serde_json::json!([0, 1]));
    let report = std::fs::read_to_string(folder.path().join("out/report.md")).expect("there");
    assert!(report.contains("no time was left for"), "{report}");
}
