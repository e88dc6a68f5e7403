//! Outputs by name: the rows of their table, the channels and metadata of EXR files, and names that are refused.

use std::collections::BTreeMap;
use std::path::Path;

use exr::prelude::{AttributeValue, FlatSamples, Text, read_first_flat_layer_from_file};
use impasto_runtime::film::outputs::{Kind, LIGHT_GROUP, OUTPUTS};
use impasto_runtime::film::{cryptomatte, exr as exr_file};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::World;

use crate::gpu::outputs::studio::{STUDIO, asking, at, everything, load, render, strings};

/// The table is walked: each row by itself is recorded, changes no picture, and is in the file under its names.
#[test]
fn every_row_of_the_table_is_an_output() {
    let outputs = everything();
    // Of one material, whose kernels are built sooner.
    let plain = ["coated", "bumpy", "glow"]
        .iter()
        .fold(STUDIO.to_owned(), |toml, name| {
            toml.replace(&format!("material = '{name}'\n"), "material = 'plain'\n")
        });
    let studio = load(
        &plain.replace("material = 'plain'\n[materials.left]", "[materials.left]"),
        &outputs,
    );
    let none = render(&studio, "own", &asking(&[], 2));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    for output in &OUTPUTS {
        let name = output.name.replace(LIGHT_GROUP, "light_key");
        let seen = render(&studio, "own", &asking(&[&name], 2));
        assert_eq!(seen.film, none.film, "{name}");
        assert!(seen.report.outputs.contains(&name));
        exr_file::write(&seen.sums, &path).expect("written");
        let channels = channels(&path);
        for channel in output.channels {
            let channel = match output.kind {
                Kind::Ids => format!("{channel}00.R"),
                _ => channel.replace(LIGHT_GROUP, "light_key"),
            };
            let values = channels
                .get(&channel)
                .unwrap_or_else(|| panic!("{channel}"));
            assert!(values.iter().all(|v| v.is_finite()), "{channel}");
        }
        assert!(
            channels
                .iter()
                .any(|(c, v)| c.len() > 1 && v.iter().any(|v| *v != 0.0))
                || ["A", "Z"].contains(&output.channels[0]),
            "{name} is 0 everywhere"
        );
    }
}

fn channels(path: &Path) -> BTreeMap<String, Vec<f32>> {
    let image = read_first_flat_layer_from_file(path).expect("an EXR");
    let list = image.layer_data.channel_data.list;
    let channel = |c: exr::image::AnyChannel<FlatSamples>| {
        (c.name.to_string(), c.sample_data.values_as_f32().collect())
    };
    list.into_iter().map(channel).collect()
}

#[test]
fn files_have_the_picture_the_layers_and_what_they_are_of() {
    let outputs = ["albedo", "depth", "material"];
    let studio = load(STUDIO, &outputs);
    let seen = render(&studio, "own", &asking(&outputs, 4));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    exr_file::write(&seen.sums, &path).expect("written");
    let channels = channels(&path);
    for (at, name) in ["R", "G", "B"].into_iter().enumerate() {
        let expected: Vec<f32> = seen.film.pixels.iter().map(|p| p[at]).collect();
        assert_eq!(channels[name], expected, "{name}");
    }
    assert_eq!(channels["albedo.G"], seen.sums.sums.values("albedo")[1]);
    assert_eq!(channels["Z"], seen.sums.sums.values("depth")[0]);
    let card = at(-0.3, -0.3);
    assert_eq!(
        channels["CryptoMaterial00.R"][card],
        cryptomatte::id("left")
    );
    assert_eq!(channels["CryptoMaterial00.G"][card], 1.0);
    assert_eq!(channels["CryptoMaterial03.A"][card], 0.0);
    assert_eq!(channels.len(), 3 + 3 + 1 + 16);
    // Pictures alone read as they do without layers.
    let read = impasto_runtime::film::output::read(&path, "picture").expect("read");
    assert_eq!(read.pixels, seen.film.pixels);

    let image = read_first_flat_layer_from_file(&path).expect("an EXR");
    let text = |key: &str| {
        let found = image.attributes.other.get(&Text::from(key));
        let found = found.or_else(|| image.layer_data.attributes.other.get(&Text::from(key)));
        match found {
            Some(AttributeValue::Text(text)) => text.to_string(),
            other => panic!("{key}: {other:?}"),
        }
    };
    assert!(image.attributes.chromaticities.is_some());
    assert_eq!(text("impasto/samples"), "4");
    assert_eq!(text("impasto/seed"), "0");
    let key = format!("cryptomatte/{}", cryptomatte::key("CryptoMaterial"));
    assert_eq!(text(&format!("{key}/name")), "CryptoMaterial");
    assert_eq!(text(&format!("{key}/hash")), "MurmurHash3_32");
    let manifest = text(&format!("{key}/manifest"));
    let manifest: BTreeMap<String, String> = serde_json::from_str(&manifest).expect("JSON");
    assert_eq!(manifest.len(), 4);
    let left = format!("{:08x}", cryptomatte::id("left").to_bits());
    assert_eq!(manifest["left"], left);
}

/// What cannot be recorded is said before anything is built.
#[test]
fn outputs_that_a_scene_cannot_have_are_refused() {
    let refused = |toml: &str, name: &str| {
        let (scene, program) = load(toml, &[]);
        let world = World::of_render(&scene, &program, &Technique::default(), &strings(&[name]));
        world.expect_err("refused").to_string()
    };
    let error = refused(STUDIO, "light_kee");
    assert!(
        error.contains("did you mean `light_key`? there are light_default"),
        "{error}"
    );
    let error = refused(STUDIO, "albedo");
    assert!(error.contains("compiled without"), "{error}");
    let error = refused(STUDIO, "noraml");
    assert!(error.contains("did you mean `normal`"), "{error}");
    let bare = "environment.color = 1\ncamera = { position = [0, 0, 4], look_at = [0, 0, 0], fov = 40 }\n\
        [[geometry]]\nobj = 'tile.obj'\n[materials.tile]\nfile = 'm.impasto'\nmaterial = 'plain'\n";
    let error = refused(bare, "uv");
    assert!(
        error.contains("`uv` cannot be recorded: no triangle"),
        "{error}"
    );
}
