//! Parts of a source lead back to the elements that they come from, in place and in files.

use std::sync::Arc;

use impasto_compiler::diag::render;
use impasto_compiler::source::{Origin, Part};
use impasto_compiler::{Loader, check};
use impasto_import::{Imported, MemoryFiles, Options, import};

use crate::common::{Disk, documents};

const IN_PLACE: Options = Options {
    in_place: true,
    unchecked: true,
    allow_outside: false,
    metres_per_unit: None,
};

fn in_place(path: &str) -> Imported {
    let imported = import(path, &mut Disk, &IN_PLACE);
    imported.unwrap_or_else(|errors| panic!("{}", errors[0]))
}

/// The text of the element that a part comes from.
fn element<'o>(origin: &'o Origin, part: &Part) -> &'o str {
    &origin.documents()[part.place.document].1[part.place.range.clone()]
}

#[test]
fn every_statement_comes_from_an_element() {
    for path in documents("documents") {
        let imported = in_place(&path.to_string_lossy());
        let text = imported.in_place();
        for part in imported.origin.parts() {
            let element = element(&imported.origin, part);
            assert!(
                element.starts_with('<') && element.ends_with('>'),
                "{element}"
            );
            assert!(text.get(part.range.clone()).is_some_and(|t| !t.is_empty()));
        }
        let mut at = 0;
        for line in text.split_inclusive('\n') {
            let start = at + line.len() - line.trim_start().len();
            at += line.len();
            let words = ["let ", "surface = ", "emission = ", "material = "];
            let is_statement = words.iter().any(|word| line.trim_start().starts_with(word));
            // Helpers come from the importer.
            let before = &text[..start];
            let material = before
                .rfind("\nmaterial ")
                .map_or("", |at| &before[at + 10..]);
            let material = material.split(' ').next().unwrap_or_default();
            let is_helper = !imported.materials.iter().any(|(name, _)| name == material);
            if !is_statement || is_helper || before.rfind("\n}\n") > before.rfind("\nmaterial ") {
                continue;
            }
            let part = imported
                .origin
                .part(start..start + 1)
                .expect("the document");
            let what = &part.place.what;
            assert!(what.contains("node `"), "{what}: {line}");
            if let Some(name) = line.trim().strip_prefix("let ") {
                let name = name.split(' ').next().unwrap_or_default();
                let element = element(&imported.origin, part);
                let own = element.split("name=\"").nth(1).unwrap_or_default();
                let own = own.split('"').next().unwrap_or_default().to_lowercase();
                assert!(name.to_lowercase().contains(&own), "{name} of {element}");
            }
        }
    }
}

#[test]
fn what_is_within_a_statement_comes_from_its_own_element() {
    let imported = in_place("tests/documents/definitions.mtlx");
    let text = imported.in_place();
    let of = |words: &str| {
        let at = text
            .find(words)
            .unwrap_or_else(|| panic!("{words}\n{text}"));
        let part = imported.origin.part(at..at + words.len()).expect("a part");
        let user = part.user.as_ref().map(|user| user.what.clone());
        (part.place.what.clone(), user.unwrap_or_default())
    };
    let (what, user) = of("fract(uv.x * 2.0)");
    assert_eq!(what, "the `fract` node `part`");
    assert_eq!(user, "the `two_stripes` node `wide`");
    assert_eq!(of("uv.x * 2.0").0, "the `multiply` node `multiply1`");
    assert_eq!(
        of("specular_roughness: narrow_part").0,
        "the input `specular_roughness` of `shader`"
    );
    assert_eq!(of("material sin_material {").0, "the material `sin`");
}

/// A source in place, as the compiler reads it.
struct Made(Imported);

impl Loader for Made {
    fn load(&mut self, _: &str) -> Result<Vec<u8>, String> {
        Ok(self.0.in_place().into_bytes())
    }

    fn origin(&mut self, _: &str) -> Option<Arc<Origin>> {
        Some(Arc::new(self.0.origin.clone()))
    }
}

#[test]
fn diagnostics_show_the_lines_of_the_document() {
    let mut made = Made(in_place("tests/bad/varying_medium.mtlx"));
    let checked = check("tests/bad/varying_medium.mtlx", &mut made);
    let text = render::text(&checked.sources, &checked.diagnostics, false);
    for said in [
        "error[E0316]: the absorption of the interior depends on `object_position`",
        "tests/bad/varying_medium.mtlx:2:",
        "<noise3d name=\"clouds\"",
        "^^^",
        "from: the `noise3d` node `clouds`, which becomes `perlin(object_position),`",
    ] {
        assert!(text.contains(said), "{said}\n{text}");
    }
    let json = render::json(&checked.sources, &checked.diagnostics);
    assert!(
        json.contains("\"line\": 2") && json.contains("\"notes\""),
        "{json}"
    );
}

#[test]
fn what_an_included_file_says_is_told_of_that_file() {
    let mut files = MemoryFiles::default();
    files.add(
        "art/a.mtlx",
        "<materialx version=\"1.39\" xmlns:xi=\"x\">\n <xi:include href=\"lib/b.mtlx\" />\n <standard_surface name=\"s\" \
         type=\"surfaceshader\">\n  <input name=\"base_color\" type=\"color3\" nodename=\"tint\" />\n \
         </standard_surface>\n</materialx>",
    );
    files.add(
        "art/lib/b.mtlx",
        "<materialx version=\"1.39\">\n <randomcolor name=\"tint\" type=\"color3\" />\n</materialx>",
    );
    let imported = import("art/a.mtlx", &mut files, &IN_PLACE).expect("it is imported");
    let names = imported
        .origin
        .documents()
        .iter()
        .map(|(name, _)| name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["art/a.mtlx", "art/lib/b.mtlx"]);
    let tint = imported
        .origin
        .parts()
        .iter()
        .find(|part| part.place.what.contains("`tint`"));
    assert_eq!(tint.map(|part| part.place.document), Some(1));
    let written = import("art/a.mtlx", &mut files, &Options::default()).expect("it is imported");
    let text = &written.files[0].1;
    assert!(text.contains("; // lib/b.mtlx:2"), "{text}");
    assert!(text.contains("; // a.mtlx:3"), "{text}");
}

#[test]
fn diagnostics_of_files_quote_the_comment_of_the_statement() {
    let imported = import("tests/documents/tiles.mtlx", &mut Disk, &Options::default());
    let mut imported = imported.expect("it is imported");
    let text = &mut imported.files[0].1;
    *text = text.replacen("uv * repeat;", "uv * repeated;", 1);
    let mut files = impasto_compiler::MemoryLoader::default();
    files.add("tiles.impasto", text.as_str());
    let checked = check("tiles.impasto", &mut files);
    let shown = render::text(&checked.sources, &checked.diagnostics, false);
    assert!(
        shown.contains("E0201") && shown.contains("from: tiles.mtlx:9"),
        "{shown}"
    );
}

#[test]
fn lengths_without_a_unit_are_as_long_as_the_scene_says() {
    let document = |unit: &str| {
        format!(
            "<materialx version=\"1.39\"><open_pbr_surface name=\"honey\" type=\"surfaceshader\">\
             <input name=\"transmission_weight\" type=\"float\" value=\"1\" />\
             <input name=\"transmission_depth\" type=\"float\" value=\"2\" {unit}/>\
             <input name=\"subsurface_weight\" type=\"float\" value=\"0.5\" />\
             </open_pbr_surface></materialx>"
        )
    };
    let source = |unit: &str, metres: Option<f64>| {
        let mut files = MemoryFiles::default();
        files.add("t.mtlx", document(unit));
        let options = Options {
            metres_per_unit: metres,
            ..Options::default()
        };
        let imported = import("t.mtlx", &mut files, &options).expect("it is imported");
        crate::common::compiled(&imported).to_owned()
    };
    let asks = source("", None);
    assert!(asks.contains("param scene_unit: length = 1 m"), "{asks}");
    assert!(
        asks.contains("transmission_depth: 2.0 * scene_unit"),
        "{asks}"
    );
    let told = source("", Some(0.01));
    assert!(told.contains("transmission_depth: 2 cm"), "{told}");
    assert!(told.contains("subsurface_radius: 1 cm"), "{told}");
    assert!(!told.contains("scene_unit"), "{told}");
    let metres = source("", Some(1.0));
    assert!(metres.contains("transmission_depth: 2 m"), "{metres}");
    assert!(!metres.contains("subsurface_radius"), "{metres}");
    let says = source("unit=\"centimeter\"", Some(0.5));
    assert!(says.contains("transmission_depth: 2 cm"), "{says}");
}
