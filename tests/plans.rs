//! What `impasto plan` says of every example scene, with the H200's profile: a change of the time
//! model, of the search or of a material's cost shows here.
//!
//! Hits are those of `plans/NAME.workload.json`, so that no GPU is needed. `cargo xtask bless`
//! accepts changes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use impasto::compiler::partition::explain::{Subject, explain};
use impasto::compiler::partition::{Calibrated, DeviceProfile, Strategy, Workload};
use impasto::plan::SceneMaterials;

use crate::generated;

/// Points at which each material is evaluated: fewer than the command takes, to save time.
const SAMPLES: usize = 256;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scenes in `examples/`, by name.
fn scenes() -> Vec<String> {
    let folders = std::fs::read_dir(root().join("examples")).expect("examples/");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let with_scene = folders.filter(|folder| folder.join("scene.toml").exists());
    let names = with_scene.map(|folder| {
        folder
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned()
    });
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// The scene file, beside what belongs to it.
fn scene_file(name: &str, out: &Path) -> PathBuf {
    let scene = root().join(format!("examples/{name}/scene.toml"));
    let text = std::fs::read_to_string(&scene).expect("the scene");
    if text.contains("generated/") {
        generated::generated(name, out).into()
    } else {
        scene
    }
}

fn workload_file(name: &str) -> PathBuf {
    root().join(format!("tests/plans/{name}.workload.json"))
}

/// What is said of the plan that `strategy` makes for a scene.
fn explained(name: &str, strategy: Strategy) -> String {
    let out = tempfile::tempdir().expect("a folder");
    let scene =
        impasto::load(&scene_file(name, out.path())).unwrap_or_else(|e| panic!("{name}: {e}"));
    let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{name}: {e}"));
    let materials = SceneMaterials::new(&scene, &program, SAMPLES);
    let text = std::fs::read_to_string(workload_file(name)).unwrap_or_else(|e| {
        panic!(
            "{e}\nmake it on a GPU: impasto plan examples/{name}/scene.toml --save-workload \
             tests/plans/{name}.workload.json"
        )
    });
    let workload =
        Workload::parse(&text, &materials.names).unwrap_or_else(|e| panic!("{name}: {e}"));
    let profile = DeviceProfile::named("h200").expect("it is shipped");
    let plan = strategy
        .plan(&materials.inputs(&workload, &profile))
        .unwrap_or_else(|e| panic!("{e}"));
    let subject = Subject {
        plan: &plan,
        names: &materials.names,
        model: Calibrated {
            costs: &materials.costs,
            workload: &workload,
            profile: &profile,
        },
        exact: true,
    };
    explain(&subject)
        .unwrap_or_else(|e| panic!("{name}: {e}"))
        .to_string()
}

#[test]
fn every_example_scene() {
    let scenes = scenes();
    assert!(scenes.len() >= 8, "{scenes:?}");
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("plans");
    settings.set_prepend_module_to_snapshot(false);
    settings.bind(|| {
        for name in scenes {
            insta::assert_snapshot!(name.clone(), explained(&name, Strategy::AUTO));
        }
    });
}

/// A file that belongs to no scene would be kept, and believed, for ever.
#[test]
fn every_file_has_its_scene() {
    let scenes: BTreeSet<String> = scenes().into_iter().collect();
    for entry in std::fs::read_dir(root().join("tests/plans")).expect("tests/plans") {
        let file = entry.expect("an entry").file_name();
        let file = file.to_string_lossy();
        let scene = [".workload.json", ".snap", ".snap.new"]
            .iter()
            .find_map(|e| file.strip_suffix(e));
        let known = scene.is_some_and(|scene| scenes.contains(scene));
        assert!(known, "tests/plans/{file} has no scene any more: remove it");
    }
}
