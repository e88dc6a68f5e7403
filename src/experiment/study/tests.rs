//! Study files: what is read, and what is said of what cannot be.

use super::*;

const GOOD: &str = r#"
title = "Mine"
publish = "../docs/mine"

[[scenes]]
name = "box"
file = "../scenes/box.toml"
samples = 8
given = { speedup = 1.5, stages = [1, 2.5] }

[[scenes]]
file = "../examples/city/scene.toml"

[[mix]]
name = "pair"
hits = "coherent"
materials = ["julia_40", "../materials/wood.impasto"]

[[mixes]]
name = "lot"
count = 3
seed = 5
materials = [2, 4]
classes = ["cheap", "loops"]

[[studies]]
kind = "partition"
scenes = ["box", "mixes"]
pools = [4096, 8192]
renders = "some"

[[studies]]
kind = "rates"
name = "speed"
scenes = ["box"]
strategies = ["own", "mega"]
pools = [1, 2]
params = { "wall.roughness" = [0.1, 0.2] }
columns = [{ of = "own, pool 1, wall.roughness 0.1" }, { head = "paper's", given = "speedup", bold = true }]
"#;

fn parse(text: &str) -> Result<Study, String> {
    Study::parse(Path::new("studies/mine.toml"), text).map_err(|e| e.to_string())
}

#[test]
fn scenes_mixes_and_parts_are_read() {
    let study = parse(GOOD).expect("it is sound");
    assert_eq!((&*study.name, &*study.title), ("mine", "Mine"));
    assert_eq!(study.publish.as_deref(), Some(Path::new("docs/mine")));
    let names: Vec<&str> = study.scenes.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["box", "city", "pair", "lot_01", "lot_02", "lot_03"]);
    assert_eq!(
        study.scenes[0].source,
        Source::File("scenes/box.toml".into())
    );
    assert_eq!(study.scenes[0].given["stages"], [1.0, 2.5]);
    let pair = study.scenes[2].mix().expect("a mix");
    assert_eq!(pair.materials[0], "julia_40");
    // Scenes are written elsewhere, so a file is named by its whole path.
    let file = Path::new(&pair.materials[1]);
    assert!(
        file.is_absolute() && file.ends_with("materials/wood.impasto"),
        "{file:?}"
    );
    assert_eq!(study.mixes().len(), 4);
    let [partition, speed] = &study.parts[..] else {
        panic!("{:?}", study.parts)
    };
    assert_eq!(
        (&*partition.name, &*partition.scenes),
        ("partition", &[0, 2, 3, 4, 5][..])
    );
    let Kind::Rates(rates) = &speed.kind else {
        panic!("{speed:?}")
    };
    assert_eq!(rates.variants.len(), 8);
    assert_eq!(
        rates.variants[7].options,
        ["--strategy=mega", "--pool=2", "--param=wall.roughness=0.2"]
    );
    let Layout::Scenes(columns) = &rates.layout else {
        panic!("{rates:?}")
    };
    assert!(columns[1].is_bold && columns[1].value == Value::Given("speedup".into()));
}

/// Changes of the file above, and what is said of them.
const BROKEN: [(&str, &str, &[&str]); 24] = [
    (
        "title = \"Mine\"",
        "titel = \"Mine\"",
        &["has no key `titel`", "did you mean `title`?", ":2:1"],
    ),
    (
        "title = \"Mine\"",
        "title = 7",
        &["`title` of the study must be a string", "not `7`"],
    ),
    ("title = \"Mine\"", "title = ", &["not valid TOML", ":2:"]),
    (
        "samples = 8",
        "smaples = 8",
        &["[[scenes]] has no key `smaples`", "did you mean `samples`?"],
    ),
    ("samples = 8", "samples = 0", &["an integer from 1"]),
    (
        "file = \"../scenes/box.toml\"",
        "",
        &["[[scenes]] needs `file`"],
    ),
    (
        "name = \"box\"",
        "name = \"a/b\"",
        &["`a/b` cannot be the name of a scene", "letters, digits"],
    ),
    (
        "name = \"pair\"",
        "name = \"box\"",
        &["there are two scenes `box`", "another `name`"],
    ),
    (
        "\"julia_40\"",
        "\"julai_40\"",
        &["no generated material `julai_40`", ".impasto"],
    ),
    (
        "\"julia_40\", ",
        "\"kinds 70\", ",
        &["`kinds N` with N from 1 to 64"],
    ),
    (
        "\"julia_40\", ",
        "\"dots\", \"dots\", ",
        &["the mix has `dots` twice"],
    ),
    (
        "[\"julia_40\", \"../materials/wood.impasto\"]",
        "[]",
        &["1 to 64 materials, and this one 0"],
    ),
    (
        "hits = \"coherent\"",
        "hits = \"coherant\"",
        &[
            "must be one of `random`, `coherent`",
            "did you mean `coherent`?",
        ],
    ),
    ("count = 3", "", &["[[mixes]] needs `count`"]),
    (
        "materials = [2, 4]",
        "materials = [4, 2]",
        &["the smaller one first"],
    ),
    (
        "classes = [\"cheap\"",
        "classes = [\"chaep\"",
        &["did you mean `cheap`?"],
    ),
    (
        "kind = \"partition\"",
        "kind = \"partitions\"",
        &["did you mean `partition`?"],
    ),
    (
        "name = \"speed\"",
        "name = \"partition\"",
        &["there are two parts `partition`"],
    ),
    (
        "scenes = [\"box\"]",
        "scenes = [\"bxo\"]",
        &["did you mean `box`?"],
    ),
    (
        "pools = [4096, 8192]",
        "pools = []",
        &["at least one number of paths"],
    ),
    (
        "strategies = [\"own\", \"mega\"]",
        "strategies = [\"won\"]",
        &["there is no strategy `won`", "did you mean `own`?"],
    ),
    (
        "of = \"own, pool 1, wall",
        "of = \"own, pool 3, wall",
        &["did you mean `own, pool"],
    ),
    (
        "given = \"speedup\", bold",
        "of = \"mega, pool 1, wall.roughness 0.1\", given = \"speedup\", bold",
        &["a column shows one thing"],
    ),
    (
        "renders = \"some\"",
        "renders = \"some\"\nlayout = \"variants\"",
        &["has no key `layout`"],
    ),
];

#[test]
fn what_cannot_be_read_is_said_with_its_place() {
    for (from, to, says) in BROKEN {
        assert!(GOOD.contains(from), "{from}");
        let text = GOOD.replacen(from, to, 1);
        let why = parse(&text).expect_err(to);
        for part in says {
            assert!(why.contains(part), "{part}\nis not in\n{why}");
        }
        assert!(why.starts_with("studies/mine.toml:"), "{why}");
    }
    assert!(parse("").is_err_and(|why| why.contains("needs `studies`")));
    assert!(parse("studies = []").is_err_and(|why| why.contains("measures nothing")));
    let none = "[[studies]]\nkind = 'rays'\n";
    assert!(parse(none).is_err_and(|why| why.contains("has no scenes")));
    let gone = Study::read(Path::new("gone.toml")).map_err(|e| e.to_string());
    assert!(gone.is_err_and(|why| why.contains("gone.toml: cannot read the study")));
}

#[test]
fn the_committed_studies_are_sound() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/studies");
    for (name, scenes, parts) in [
        ("partition", 26, 1),
        ("paper", 17, 6),
        ("convergence", 4, 5),
        ("mixes", 40, 1),
    ] {
        let study = Study::read(&folder.join(format!("{name}.toml")));
        let study = study.unwrap_or_else(|why| panic!("{why}"));
        assert_eq!(
            (study.scenes.len(), study.parts.len()),
            (scenes, parts),
            "{name}"
        );
        let files = study.scenes.iter().flat_map(|scene| match &scene.source {
            Source::Mix(mix) => mix.materials.clone(),
            Source::File(_) => Vec::new(),
        });
        for file in files.filter(|file| file.ends_with(".impasto")) {
            assert!(Path::new(&file).is_file(), "{file}");
        }
    }
}
