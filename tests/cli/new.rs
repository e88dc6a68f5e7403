//! `impasto new`: what it makes is right from the first line, and nothing is ever overwritten.

use std::path::Path;

use crate::cli::common::{Run, command, folder, impasto, names};

const TEMPLATES: [&str; 5] = ["matte", "layered", "paint", "bsdf", "scene"];

fn new_in(folder: &Path, args: &[&str]) -> Run {
    let run = command(&["new"]).args(args).current_dir(folder).output();
    run.expect("the command starts").into()
}

#[test]
fn every_template_is_a_formatted_source_without_a_word_to_say() {
    let temporary = folder();
    for template in TEMPLATES {
        let args = [&format!("my_{template}"), "--template", template, "--scene"];
        new_in(temporary.path(), &args)
            .exits(0)
            .says("impasto render");
        let made = temporary.path().join(format!("my_{template}"));
        let wanted = [
            "ball.obj".to_owned(),
            format!("my_{template}.impasto"),
            "scene.toml".to_owned(),
            "table.impasto".to_owned(),
            "table.obj".to_owned(),
        ];
        assert_eq!(names(&made), wanted);
        for source in [format!("my_{template}.impasto"), "table.impasto".to_owned()] {
            let path = made.join(source).display().to_string();
            let checked = impasto(&["check", &path]).exits(0);
            checked.says("checked 1 file: 0 errors, 0 warnings");
            impasto(&["fmt", "--check", &path]).exits(0);
        }
    }
    assert_eq!(names(temporary.path()).len(), TEMPLATES.len(), "no litter");
}

#[test]
fn a_scene_renders_at_once() {
    let temporary = folder();
    for template in ["paint", "scene"] {
        new_in(
            temporary.path(),
            &["thing", "--template", template, "--scene"],
        )
        .exits(0);
        let scene = temporary
            .path()
            .join("thing/scene.toml")
            .display()
            .to_string();
        let picture = temporary.path().join("thing.png");
        let out = picture.display().to_string();
        let size = ["--size", "32x24", "--spp", "4"];
        impasto(&[&["render", &scene, "--out", &out], &size[..]].concat()).exits(0);
        let pixels = image::open(&picture).expect("a picture").to_rgb8();
        let middle = pixels.get_pixel(16, 12).0;
        assert!(
            middle.iter().any(|c| *c > 20),
            "the ball is lit: {middle:?}"
        );
        std::fs::remove_dir_all(temporary.path().join("thing")).expect("it is removed");
    }
}

#[test]
fn one_file_without_a_scene() {
    let temporary = folder();
    let run = new_in(temporary.path(), &["red", "--format", "json"]).exits(0);
    assert_eq!(run.json()["written"][0], "red.impasto");
    assert_eq!(names(temporary.path()), ["red.impasto"]);
    let text = std::fs::read_to_string(temporary.path().join("red.impasto"));
    assert!(text.expect("the file").contains("material red {"));
}

#[test]
fn nothing_is_overwritten() {
    let temporary = folder();
    let path = temporary.path().join("red.impasto");
    std::fs::write(&path, "mine").expect("it is written");
    new_in(temporary.path(), &["red"])
        .exits(2)
        .says("`red.impasto` exists already");
    assert_eq!(std::fs::read(&path).expect("the file"), b"mine");
    std::fs::create_dir(temporary.path().join("blue")).expect("a folder");
    new_in(temporary.path(), &["blue", "--scene"])
        .exits(2)
        .says("`blue` exists already");
    assert_eq!(names(temporary.path()), ["blue", "red.impasto"]);
    assert!(names(&temporary.path().join("blue")).is_empty());
}

#[test]
fn names_that_no_material_can_have_are_refused() {
    let temporary = folder();
    let inner = temporary.path().join("inner");
    std::fs::create_dir(&inner).expect("a folder");
    let long = "a".repeat(65);
    let names_and_reasons = [
        ("../up", "it is a path"),
        ("/tmp/up", "it is a path"),
        ("a\\b", "it is a path"),
        (".", "it is a path"),
        ("", "it is empty"),
        ("two words", "` ` is in it"),
        ("caf\u{e9}", "is in it"),
        ("3d", "it starts with a digit"),
        ("layer\n", "is in it"),
        ("material", "it is a word of the language"),
        ("private", "it is a word of the language"),
        ("diffuse", "it means something else already"),
        ("table", "it is reserved"),
        (&long, "more than 64 characters"),
    ];
    for (name, why) in names_and_reasons {
        for more in [&[][..], &["--scene"]] {
            let run = new_in(&inner, &[&[name], more].concat()).exits(2);
            run.says(why).says("hint: ").prints_nothing();
        }
    }
    assert!(names(&inner).is_empty());
    assert_eq!(names(temporary.path()), ["inner"]);
    new_in(&inner, &["red", "--template", "gold"])
        .exits(2)
        .says("matte");
}
