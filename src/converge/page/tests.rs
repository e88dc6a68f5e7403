//! Pages of small convergences made by hand, of nothing, and of names that mean to break out.

use super::super::pictures::{RenderPictures, ScenePictures};
use super::*;
use crate::runtime::technique::Sampler;

fn pictures() -> Pictures {
    let render = RenderPictures {
        strategy: "own".into(),
        sampler: Sampler::Independent,
        samples: 64,
        picture: "cornell/own 64.png".into(),
        error: "cornell/own 64-error.png".into(),
    };
    Pictures {
        scenes: vec![ScenePictures {
            reference: "cornell/reference.png".into(),
            renders: vec![render],
        }],
    }
}

#[test]
fn the_report_of_a_small_study() {
    insta::assert_snapshot!(markdown(&example::convergence()));
}

#[test]
fn all_files_are_written_and_every_link_leads_to_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path().join("new");
    write(&dir, &example::convergence(), &pictures()).expect("written");
    let json = std::fs::read_to_string(dir.join("convergence.json")).expect("there");
    let read: Convergence = serde_json::from_str(&json).expect("valid");
    // Numbers read from JSON may differ in their last bit, which no page shows.
    assert_eq!(markdown(&read), markdown(&example::convergence()));
    let page = std::fs::read_to_string(dir.join("index.html")).expect("there");
    let links: Vec<&str> = page
        .split("src=\"")
        .skip(1)
        .filter_map(|p| p.split('"').next())
        .collect();
    let (plots, images): (Vec<&str>, Vec<&str>) = links.iter().partition(|l| l.ends_with(".svg"));
    assert_eq!(
        images,
        [
            "cornell/reference.png",
            "cornell/own%2064.png",
            "cornell/own%2064-error.png"
        ]
    );
    assert_eq!(plots.len(), 7);
    let report = std::fs::read_to_string(dir.join("report.md")).expect("there");
    for plot in plots {
        assert!(dir.join(plot).is_file(), "{plot}");
        assert!(report.contains(&format!("]({plot})")), "{plot}");
    }
    assert_eq!(std::fs::read_dir(&dir).expect("there").count(), 7 + 4);
    // Written again, it is the same.
    write(&dir, &example::convergence(), &pictures()).expect("written");
    assert_eq!(
        std::fs::read_to_string(dir.join("index.html")).expect("there"),
        page
    );
}

#[test]
fn nothing_and_blackness_have_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    for convergence in [example::empty(), example::black()] {
        write(folder.path(), &convergence, &Pictures::default()).expect("written");
    }
    assert!(markdown(&example::empty()).contains("There are no renders."));
    assert!(markdown(&example::black()).contains("equals the reference"));
    assert!(
        !markdown(&example::black()).contains("Equal time"),
        "of one series"
    );
}

#[test]
fn names_stay_names() {
    let mut convergence = example::convergence();
    let name = "</title><script>alert(1)</script> | `x` & \u{1b}[0m";
    convergence.scenes[0].name = name.into();
    convergence.scenes[0].series[0].strategy = name.into();
    convergence.scenes[0].materials[0].name = Some(name.into());
    convergence.command = name.into();
    let same = convergence.scenes[0].clone();
    convergence.scenes.push(same);
    let page = html(&convergence, &Pictures::default());
    assert!(!page.contains("<script") && !page.contains('\u{1b}'));
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &convergence, &Pictures::default()).expect("written");
    let files = std::fs::read_dir(folder.path()).expect("there").count();
    assert_eq!(
        files,
        2 * 7 + 4,
        "two scenes of one name have their own files"
    );
    // In a table every row keeps its number of cells.
    let text = markdown(&convergence);
    let cells = |line: &str| line.replace("\\|", "").matches('|').count();
    for table in text.split("\n\n").filter(|p| p.starts_with('|')) {
        let counts: Vec<usize> = table.lines().map(cells).collect();
        assert!(counts.iter().all(|c| *c == counts[0]), "{table}");
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_written_is_told() {
    let missing = Path::new("/dev/null/folder");
    let error = write(missing, &example::convergence(), &pictures()).expect_err("refused");
    assert!(error.contains("/dev/null/folder"), "{error}");
}
