//! What editors are told of a source: names, scopes and types, in texts that are right and in texts that are not.

use std::path::{Path, PathBuf};

use impasto_compiler::analysis::{Analysis, analyse, disagreements};
use impasto_compiler::{Loader, MemoryLoader};

/// The folders that have sources.
const FOLDERS: [&str; 4] = ["stdlib", "materials", "examples", "src"];

/// Every source below a folder of the repository.
fn sources(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .join(folder);
    let (mut found, mut folders) = (Vec::new(), vec![root]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "impasto") {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "{folder} has no sources");
    found
}

struct Disk;

impl Loader for Disk {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

#[test]
fn names_are_resolved_on_the_tree_as_the_checker_does() {
    let mut wrong = Vec::new();
    for path in FOLDERS.iter().flat_map(|f| sources(f)) {
        wrong.extend(disagreements(&path.to_string_lossy(), &mut Disk));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn of(text: &str) -> Analysis {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    analyse("m.impasto", &mut files)
}

/// Where the marks `<1>`, `<2>`, ... of a text stand, and the text without them.
fn marked(text: &str) -> (String, Vec<u32>) {
    let (mut plain, mut places) = (String::new(), Vec::new());
    let mut rest = text;
    loop {
        let mark = format!("<{}>", places.len() + 1);
        let Some(at) = rest.find(&mark) else { break };
        plain.push_str(&rest[..at]);
        places.push(plain.len() as u32);
        rest = &rest[at + mark.len()..];
    }
    plain.push_str(rest);
    (plain, places)
}

#[test]
fn a_name_leads_to_what_it_stands_for() {
    let (text, at) = marked(
        "use std::bsdf::diffuse;\n\
         struct Pair { <1>a: float, b: float }\n\
         const K: float = 0.5;\n\
         fn twice(<2>x: float) -> float { let <3>x = <4>x * 2.0; <5>x }\n\
         material m {\n\
             param <6>k: color = srgb(0x808080);\n\
             let p = Pair(1.0, b: 2.0);\n\
             var sum = 0.0;\n\
             for <7>i in 0 .. 4 { sum += float(<8>i) * p.<9>a; }\n\
             let w = twice(<10>x: <11>sum);\n\
             <12>surface = w * <13>K * diffuse(<14>k);\n\
         }\n",
    );
    let analysis = of(&text);
    assert!(
        analysis.diagnostics.is_empty(),
        "{:?}",
        analysis.diagnostics
    );
    let leads = |from: usize| {
        let occurrence = analysis.occurrence_at(at[from - 1]).expect("a name");
        let defined = analysis.definition(&occurrence.symbol)?;
        Some(defined.start)
    };
    let sum = text.find("sum = ").expect("it is there") as u32;
    let constant = text.find("K: ").expect("it is there") as u32;
    for (from, to) in [
        (4, at[1]),
        (5, at[2]),
        (8, at[6]),
        (9, at[0]),
        (10, at[1]),
        (11, sum),
        (13, constant),
        (14, at[5]),
    ] {
        assert_eq!(leads(from), Some(to), "<{from}>");
    }
    assert_eq!(leads(12), None, "an output is the language's");
}

#[test]
fn a_definition_that_does_not_parse_has_scopes_all_the_same() {
    let (text, at) = marked(
        "material m {\n\
             param tint: color = 0.5;\n\
             let a = 1.0;\n\
             for i in 0 .. 4 { let inner = 2.0; <1> }\n\
             let b = mix(a, tint.;<2>\n\
             let c = 3.0;\n\
         }\n",
    );
    let analysis = of(&text);
    let visible = |at: u32| -> Vec<String> {
        let found = analysis.visible_at(at).into_iter();
        found.map(|(name, _)| name.to_owned()).collect()
    };
    let inside = visible(at[0]);
    for name in ["inner", "i", "a", "tint"] {
        assert!(inside.iter().any(|n| n == name), "{name} of {inside:?}");
    }
    let behind = visible(at[1]);
    assert!(behind.iter().any(|n| n == "a"), "{behind:?}");
    assert!(
        !behind.iter().any(|n| n == "inner" || n == "c"),
        "{behind:?}"
    );
}

#[test]
fn types_are_those_that_authors_see() {
    let (text, at) = marked(
        "use std::bsdf::diffuse;\n\
         material m { let <1>size = position / 3 cm; let <2>tint = color(1, 0, 0) * 0.5; let <3>d = 3 cm;\n\
             surface = diffuse(tint * size.x + float(d)); }\n",
    );
    let analysis = of(&text);
    for (mark, ty) in [(1, "vec3"), (2, "color"), (3, "length")] {
        let span = analysis.occurrence_at(at[mark - 1]).expect("a name").span;
        let found = analysis.binding_type(span).map(|t| t.text.to_string());
        assert_eq!(found.as_deref(), Some(ty), "<{mark}>");
    }
}

#[test]
fn hints_that_can_be_done_are_changes() {
    for (text, fixed) in [
        ("material m { let a = perlln(position / 1 cm); }", None),
        ("material m { let a = mixx(0.0, 1.0, 0.5); }", Some("mix")),
        ("material m { param d: length = 3; }", Some("3 cm")),
        ("material m { let a = lerp(0.0, 1.0, 0.5); }", Some("mix")),
        ("material m { let a = 3 cn; }", Some("3 cm")),
        ("use bsdf::diffuse;", Some("std::bsdf")),
    ] {
        let analysis = of(text);
        let fixes = analysis.diagnostics.iter().flat_map(|d| &d.fixes);
        let texts: Vec<&str> = fixes.map(|f| f.text.as_str()).collect();
        match fixed {
            Some(fixed) => assert!(texts.contains(&fixed), "{text}: {texts:?}"),
            None => {
                let imports = analysis.diagnostics.iter().flat_map(|d| &d.fixes);
                let imports: Vec<_> = imports.flat_map(|f| &f.imports).collect();
                assert_eq!(imports, ["std::noise::perlin"], "{text}");
            }
        }
    }
}
