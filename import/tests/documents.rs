//! Every document of `documents/` against its source, which compiles and is formatted.

use impasto_compiler::format::format;
use impasto_compiler::source::FileId;
use impasto_import::{Options, import};

use crate::common::{Disk, compiled, documents};

#[test]
fn documents_become_these_sources() {
    for path in documents("documents") {
        let name = path
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let imported = import(&path.to_string_lossy(), &mut Disk, &Options::default());
        let imported = imported.unwrap_or_else(|errors| panic!("{name}: {errors:?}"));
        let text = compiled(&imported).to_owned();
        let again = format(FileId(0), &text);
        assert_eq!(
            again.as_deref(),
            Ok(text.as_str()),
            "{name} is not formatted"
        );
        let mut shown = text;
        for warning in &imported.warnings {
            shown.push_str(&format!("// warning: {warning}\n"));
        }
        for texture in &imported.textures {
            shown.push_str(&format!("// {} is {}\n", texture.written, texture.found));
        }
        for assignment in &imported.assignments {
            let what = (&assignment.look, &assignment.geometry, &assignment.material);
            shown.push_str(&format!("// {what:?}\n"));
        }
        insta::assert_snapshot!(name, shown.replace('\\', "/"));
    }
}

#[test]
fn every_prefix_of_a_document_is_imported_or_refused() {
    for path in documents("documents") {
        let text = std::fs::read_to_string(path).expect("a text");
        for end in (0..text.len())
            .step_by(29)
            .filter(|end| text.is_char_boundary(*end))
        {
            let part = &text[..end];
            // What stands there so far, closed.
            let whole = format!(
                "{}</materialx>",
                part.rsplit_once('\n').map_or("", |(p, _)| p)
            );
            let _ = crate::common::of_text(part);
            if let Ok(imported) = crate::common::of_text(&whole) {
                assert!(!imported.materials.is_empty());
            }
        }
    }
}
