//! `impasto explain`: a code with its examples, the list, the page of the documentation.

use crate::cli::common::{impasto, root};

#[test]
fn a_code_is_explained_with_a_source_that_provokes_it() {
    let run = impasto(&["explain", "e0303"]).exits(0);
    for part in [
        "error[E0303]: a unit is needed",
        "It comes from:",
        "Repaired:",
        "0.5 mm;",
    ] {
        assert!(run.stdout.contains(part), "`{part}` is not in {run:#?}");
    }
    let run = impasto(&["explain", "E0205"]).exits(0);
    assert!(run.stdout.contains("  shades.impasto:"), "{run:#?}");
    let run = impasto(&["explain", "E0214"]).exits(0);
    assert!(run.stdout.contains("A scene sets `colour`"), "{run:#?}");
}

#[test]
fn json_holds_the_examples() {
    let json = impasto(&["explain", "W0001", "--format", "json"])
        .exits(0)
        .json();
    let text = json[0]["example"]["files"][0]["text"].as_str();
    assert!(text.is_some_and(|text| text.contains("diffuse(0.8) + mirror()")));
    assert_eq!(json[0]["repaired"]["files"][0]["name"], "example.impasto");
}

#[test]
fn the_page_is_that_of_the_documentation() {
    let page = std::fs::read_to_string(root().join("docs/diagnostics.md")).expect("the page");
    assert_eq!(impasto(&["explain", "--markdown"]).exits(0).stdout, page);
}

#[test]
fn unknown_codes_get_a_suggestion() {
    impasto(&["explain", "E2001"])
        .exits(2)
        .says("did you mean E0201?");
    impasto(&["explain", "E0201", "--markdown"]).exits(2);
}
