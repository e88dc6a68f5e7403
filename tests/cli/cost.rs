//! `cost`: what it counts, what it prints, and that the counts in the paper's scenes are true.

use std::path::Path;

use crate::cli::common::{folder, impasto, write};
use crate::generated::{generate, generated};

/// The operations of a material's only evaluation class, from JSON.
fn operations(source: &str) -> serde_json::Value {
    let folder = folder();
    let file = write(folder.path(), "m.impasto", source);
    let run = impasto(&["cost", &file, "--format", "json", "--samples", "512"]).exits(0);
    run.json()["materials"][0]["operations"].clone()
}

fn emitting(value: &str) -> String {
    format!("use std::edf::uniform;\nmaterial m {{ emission = uniform({value}); }}\n")
}

#[test]
fn an_operation_is_one_number_of_a_vector() {
    let of = |value: &str, class: &str| {
        let found = operations(&emitting(value))["classes"][class].as_f64();
        found.expect("a number")
    };
    let plain = of("color(position.xyz)", "alu");
    assert_eq!(of("color(position.xyz + normal)", "alu"), plain + 3.0);
    assert_eq!(of("color(dot(position.xyz, normal))", "alu"), plain + 6.0);
    assert_eq!(of("color(position.zyx)", "alu"), plain);
    assert_eq!(of("color(sqrt(position.xyz))", "special"), 3.0);
    assert_eq!(of("color(float(hash(int(position.x))))", "integer"), 10.0);
}

#[test]
fn branches_and_loops_count_as_often_as_they_are_taken() {
    let source = emitting("color(turns(uv.x))");
    let found = operations(&format!(
        "{source}fn turns(x: float) -> float {{
             var sum = x;
             if x < 0.25 {{ for i in 0 .. 100 {{ sum = sqrt(sum + float(i)); }} }}
             sum
         }}\n"
    ));
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let turns = number(&found["classes"]["turns"]);
    assert!((turns - 25.0).abs() < 6.0, "{found:#}");
    let (min, mean, max) = (&found["min"], &found["mean"], &found["max"]);
    assert!(number(max) >= number(min) + 300.0, "{found:#}");
    assert!(
        number(min) < number(mean) && number(mean) < number(max),
        "{found:#}"
    );
    let classes = found["classes"].as_object().expect("classes");
    let sum: f64 = classes.values().map(number).sum();
    assert!((sum - number(mean)).abs() < 1e-6, "{found:#}");
}

/// A budget that is spent is told with what took it, and grants what it says where it suffices.
#[test]
fn a_spent_budget_leaves_costs_incomplete() {
    let folder = folder();
    let source = "use std::edf::uniform;
fn spin(x: float) -> float {
    var sum = x;
    for i in 0 .. 4096 { sum = sqrt(sum + float(i)); }
    sum
}
material m { emission = uniform(color(spin(uv.x))); }
";
    let file = write(folder.path(), "m.impasto", source);
    let cost = |budget: &str, format: &str| {
        let args = ["--samples", "16", "--budget", budget, "--format", format];
        impasto(&[&["cost", file.as_str()], args.as_slice()].concat())
    };
    let spent = cost("1000", "text").exits(1);
    let row = spent.stdout.lines().find(|line| line.starts_with("m "));
    assert!(
        row.is_some_and(|row| row.ends_with("incomplete")),
        "{row:?}"
    );
    let place = format!("{file}:4");
    spent
        .says("the cost of `m` is incomplete")
        .says("the budget of 16000 expressions was spent after 0 of 16 evaluations")
        .says(&format!("most of it by the loop at {place}"))
        .says("`--budget` grants more");

    let json = cost("1000", "json").exits(1).json();
    let spent = &json["materials"][0]["spent"];
    assert_eq!(spent["budget"], 16_000);
    assert_eq!(spent["evaluations"], 0);
    assert_eq!(spent["place"], place);

    let enough = cost("100000", "json").exits(0).json();
    let whole = &enough["materials"][0];
    assert!(whole.get("spent").is_none_or(serde_json::Value::is_null));
    assert_eq!(whole["operations"]["evaluations"], 16);
    assert_eq!(whole["operations"]["classes"]["turns"], 4096.0);
}

#[test]
fn what_cannot_be_counted_is_refused() {
    impasto(&["cost", "nothing.impasto"])
        .exits(2)
        .says("nothing.impasto");
    impasto(&["cost", "nothing.toml"])
        .exits(2)
        .says("nothing.toml");
    let (scene, file) = ("examples/cornell/scene.toml", "materials/matte.impasto");
    impasto(&["cost", file, scene])
        .exits(2)
        .says("give it alone");
    impasto(&["cost", file, "--samples", "0"]).exits(2);
    let folder = folder();
    let broken = write(folder.path(), "m.impasto", "material m { surface = 1; }");
    impasto(&["cost", &broken]).exits(1).prints_nothing();
    let empty = write(folder.path(), "e.impasto", "const A: float = 1.0;");
    impasto(&["cost", &empty]).exits(1).prints_nothing();
}

#[test]
fn instances_of_a_scene_are_counted_with_the_code_they_share() {
    let run = impasto(&["cost", "examples/cornell/scene.toml", "--format", "json"]).exits(0);
    let json = run.json();
    let materials = json["materials"].as_array().expect("a list");
    let matte = materials.iter().find(|m| m["name"] == "matte");
    let matte = matte.expect("the walls are matte");
    assert!(matte["instances"].as_u64() > Some(1), "{matte:#}");
    assert_eq!(matte["operations"]["evaluations"], 1024);
}

/// Two squares of one material that loops as often as its parameter says; the second has three
/// times the area of the first.
const LOOPS: [(&str, &str); 3] = [
    (
        "loops.impasto",
        "use std::bsdf::diffuse;
         material loops {
             param turns: int = 1;
             surface = diffuse(color(slow(position.x, turns)));
         }
         fn slow(x: float, turns: int) -> float {
             var sum = x;
             for i in 0 .. min(turns, 100) { sum = sqrt(sum + float(i)); }
             sum
         }\n",
    ),
    (
        "squares.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 4 0 0\nv 4 1 0\n\
         usemtl few\nf 1 2 3 4\nusemtl many\nf 2 5 6 3\n",
    ),
    (
        "scene.toml",
        "camera = { position = [0, 0, 5], look_at = [0, 0, 0], fov = 40 }
         geometry = [{ obj = \"squares.obj\" }]
         [materials]
         few = { file = \"loops.impasto\", params.turns = 8 }
         many = { file = \"loops.impasto\", params.turns = 40 }\n",
    ),
];

#[test]
fn instances_count_with_their_own_values_and_by_their_area() {
    let folder = folder();
    let [_, _, scene] = LOOPS.map(|(name, text)| write(folder.path(), name, text));
    let json = impasto(&["cost", &scene, "--format", "json"])
        .exits(0)
        .json();
    let found = &json["materials"][0];
    assert_eq!(found["instances"], 2, "{found:#}");
    let turns = found["operations"]["classes"]["turns"].as_f64();
    // What evaluating a lobe loops itself is the same for both.
    let plain = write(
        folder.path(),
        "plain.toml",
        LOOPS[2]
            .1
            .replace("turns = 8", "turns = 0")
            .replace("turns = 40", "turns = 0"),
    );
    let json = impasto(&["cost", &plain, "--format", "json"])
        .exits(0)
        .json();
    let own = json["materials"][0]["operations"]["classes"]["turns"].as_f64();
    let (turns, own) = (turns.expect("a number"), own.expect("a number"));
    let expected = 0.25 * 8.0 + 0.75 * 40.0;
    assert!(
        (turns - own - expected).abs() < 0.1,
        "{turns} less {own} is not {expected}"
    );
}

/// Means of the materials of a generated crossover scene, by name.
fn means(scene: &Path) -> Vec<(String, f64)> {
    let scene = scene.display().to_string();
    let json = impasto(&["cost", &scene, "--format", "json", "--samples", "64"])
        .exits(0)
        .json();
    let materials = json["materials"].as_array().expect("a list").iter();
    let mean = |m: &serde_json::Value| m["operations"]["mean"].as_f64().expect("it is used");
    materials
        .map(|m| (m["name"].as_str().expect("a name").to_owned(), mean(m)))
        .collect()
}

#[test]
fn crossover_scenes_differ_in_their_number_and_nothing_else() {
    let folder = folder();
    generate("crossover", folder.path());
    let mut plain = 0.0;
    let members = impasto_scenes::crossover::all();
    assert_eq!(members.len(), 13);
    for member in members {
        let (scene, number) = (&member.scene, member.number);
        let found = means(&folder.path().join(scene));
        if member.family == "materials" {
            assert_eq!(found.len(), number, "{scene} shares code");
            assert!(
                found.iter().all(|(_, mean)| (400.0..2000.0).contains(mean)),
                "{scene}: {found:?}"
            );
            continue;
        }
        let [(_, mean)] = found.as_slice() else {
            panic!("{scene} has several materials");
        };
        if number == 0 {
            plain = *mean;
        }
        // None is left out, and little is added.
        let each = (mean - plain) / number.max(1) as f64;
        assert!(
            number == 0 || (450.0..520.0).contains(&each),
            "{scene}: {each} operations a noise"
        );
    }
}

/// Do two lines of a table say the same? Numbers may differ by 2 %: sines round differently on
/// other machines, and branches with them.
fn agree(written: &str, counted: &str) -> bool {
    let (a, b): (Vec<&str>, Vec<&str>) = (
        written.split_whitespace().collect(),
        counted.split_whitespace().collect(),
    );
    let near = |(a, b): (&&str, &&str)| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 1.0f64.max(0.02 * b),
        _ => a == b,
    };
    a.len() == b.len() && a.iter().zip(&b).all(near)
}

#[test]
fn the_papers_scenes_carry_the_counts_of_their_materials() {
    let folder = folder();
    for name in ["carpaint", "city", "conference"] {
        let scene = generated(name, folder.path());
        let text = std::fs::read_to_string(&scene).expect("the scene");
        let comment: Vec<&str> = text
            .lines()
            .skip_while(|line| !line.starts_with("# operations of one evaluation"))
            .map(|line| line.trim_start_matches('#').trim())
            .collect();
        let counted = impasto(&["cost", "--lines", "0", &scene]).exits(0).stdout;
        let lines: Vec<&str> = counted.lines().collect();
        let same =
            comment.len() == lines.len() && comment.iter().zip(&lines).all(|(a, b)| agree(a, b));
        assert!(
            same,
            "the comment at the end of examples/{name}/scene.toml should be what `impasto cost \
             --lines 0 examples/{name}/scene.toml` prints:\n{counted}"
        );
    }
}
