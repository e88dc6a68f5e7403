//! Outputs beside the picture: what `--aov` takes, what it refuses, and that parts with outputs merge.

use std::collections::BTreeMap;
use std::path::Path;

use exr::prelude::read_first_flat_layer_from_file;
use impasto::runtime::film::outputs;

use crate::cli::common::{Run, SCENE, folder, impasto, names};

/// Renders the example into a folder with more arguments, `{}` standing for the folder.
fn render(folder: &Path, arguments: &str) -> Run {
    run(folder, &["render", SCENE, "--size", "12x8"], arguments)
}

fn run(folder: &Path, first: &[&str], arguments: &str) -> Run {
    let arguments = arguments.replace("{}", &folder.display().to_string());
    let mut all = first.to_vec();
    all.extend(arguments.split_whitespace());
    impasto(&all)
}

/// The channels of a file, as bits.
fn channels(folder: &Path, name: &str) -> BTreeMap<String, Vec<u32>> {
    let image = read_first_flat_layer_from_file(folder.join(name)).expect("an EXR");
    let list = image.layer_data.channel_data.list.into_iter();
    list.map(|c| {
        let values = c.sample_data.values_as_f32();
        (c.name.to_string(), values.map(f32::to_bits).collect())
    })
    .collect()
}

/// Metadata is not an output: pictures have it without.
#[test]
fn a_picture_without_outputs_says_what_it_is_of() {
    let folder = folder();
    let at = folder.path();
    render(at, "--spp 3 --seed 5 --out {}/a.exr").exits(0);
    let image = read_first_flat_layer_from_file(at.join("a.exr")).expect("an EXR");
    let texts = image.layer_data.attributes.other.iter();
    let texts = texts.map(|(key, value)| (key.to_string(), format!("{value:?}")));
    let texts: BTreeMap<String, String> = texts.collect();
    for (key, expected) in [("impasto/samples", "3"), ("impasto/seed", "5")] {
        assert!(texts[key].contains(expected), "{texts:?}");
    }
    assert_eq!(channels(at, "a.exr").len(), 3);
}

#[test]
fn what_no_output_is_called_is_refused_with_the_nearest() {
    let folder = folder();
    let at = folder.path();
    let mut run = render(at, "--spp 1 --aov depth,albeddo --out {}/a.exr")
        .exits(2)
        .prints_nothing()
        .says("`albeddo`")
        .says("did you mean `albedo`?");
    for name in outputs::names() {
        run = run.says(name);
    }
    render(at, "--spp 1 --aov light_kee --out {}/a.exr")
        .exits(2)
        .says("no light of the scene is in the group `kee`")
        .says("light_default");
    render(at, "--spp 1 --aov albedo --out {}/a.png")
        .exits(2)
        .says("`--aov albedo` needs a file that holds more");
    assert_eq!(names(at), [""; 0]);
}

#[test]
fn help_lists_every_output() {
    let help = impasto(&["render", "--help"]).exits(0);
    for name in outputs::names() {
        assert!(help.stdout.contains(name), "{name}");
    }
}

#[test]
fn parts_with_outputs_merge_to_the_layers_of_the_whole() {
    let folder = folder();
    let at = folder.path();
    let aov = "--aov albedo,material,lights,depth";
    render(
        at,
        &format!("--spp 3 {aov} --out {{}}/whole.exr --report {{}}/r.json"),
    )
    .exits(0);
    render(at, "--spp 3 --out {}/plain.exr").exits(0);
    render(at, &format!("--spp 1 {aov} --out {{}}/a.film")).exits(0);
    // A checkpoint is a part as well, and is gone on from with the same outputs only.
    render(
        at,
        &format!("--spp 2 --samples-from 1 {aov} --checkpoint {{}}/b.film --out {{}}/b.exr"),
    )
    .exits(0);
    render(
        at,
        "--spp 2 --samples-from 1 --checkpoint {}/b.film --out {}/b.exr",
    )
    .exits(2)
    .says("its outputs are others: one has no outputs beside the picture");
    run(at, &["merge"], "{}/a.film {}/b.film --out {}/merged.exr").exits(0);
    let whole = channels(at, "whole.exr");
    assert_eq!(channels(at, "merged.exr"), whole);
    for (name, values) in channels(at, "plain.exr") {
        assert_eq!(whole[&name], values, "{name}");
    }
    for name in ["albedo.R", "Z", "CryptoMaterial00.R", "light_default.G"] {
        assert!(whole.contains_key(name), "{name}");
    }
    let png = |name: &str| std::fs::read(at.join(name)).expect("a picture");
    assert_eq!(png("merged.png"), png("plain.png"));
    let report = std::fs::read_to_string(at.join("r.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["outputs"][0], "albedo");
    assert_eq!(report["lost_ids"], 0);

    render(at, "--spp 1 --samples-from 3 --aov depth --out {}/c.film").exits(0);
    run(at, &["merge"], "{}/a.film {}/c.film --out {}/d.exr")
        .exits(2)
        .says("their outputs differ")
        .says("the outputs depth");
}
