//! Tests of passes on IR as text, and of the text itself.
//!
//! A file of `cases/` names passes in its first line, `// pass: NAME, NAME`, then has IR, and after
//! a line `// ----` what the passes make of it. Whatever a case expects, its functions must also
//! compute the same before and after.
//!
//! `IMPASTO_BLESS=1` rewrites what the cases expect; read the difference as part of your change.

mod closures;
mod files;
mod hoisting;
mod lowered;
mod meaning;
mod table;
mod text;

use impasto_compiler::passes::PIPELINE;

/// A line between the IR of a case and what passes make of it.
const RULE: &str = "// ----\n";

#[test]
fn passes_make_of_each_case_what_it_expects() {
    let mut problems = Vec::new();
    let mut count = 0;
    for case in files::cases() {
        count += 1;
        if let Err(problem) = files::check(&case) {
            problems.push(format!("{}: {problem}", case.name));
        }
    }
    assert!(count > 0, "there are no cases");
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn every_pass_has_a_case_of_its_own() {
    let cases = files::cases();
    // What lowering makes of a material, `compiler/tests/closures.rs` and the snapshots show.
    let names = PIPELINE.iter().map(|p| p.name);
    for pass in names.filter(|name| *name != "lowering") {
        assert!(
            cases.iter().any(|c| c.passes == [pass]),
            "compiler/tests/passes/cases has no file that begins `// pass: {pass}`"
        );
    }
}
