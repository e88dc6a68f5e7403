//! `impasto check`: every problem of every file, and nothing else.

use clap::{Args, ValueHint};
use impasto::FileLoader;
use impasto::compiler::{self, Loader, diag};
use serde_json::{Value, json};

use super::{Failure, Global, Outcome, count, print};

#[derive(Args)]
pub(super) struct CheckArgs {
    /// Material files; `-` is standard input
    #[arg(required = true, value_name = "FILE", value_hint = ValueHint::FilePath)]
    files: Vec<String>,
}

/// What was found in all files together.
#[derive(Default)]
struct Findings {
    errors: usize,
    warnings: usize,
    unreadable: usize,
    diagnostics: Vec<Value>,
}

pub(super) fn run(args: &CheckArgs, global: &Global) -> Outcome {
    let mut found = Findings::default();
    for file in &args.files {
        check(file, global, &mut found);
    }
    if global.json() {
        let result = json!({
            "files": args.files.len(),
            "errors": found.errors,
            "warnings": found.warnings,
            "diagnostics": found.diagnostics,
        });
        print(&format!("{result:#}\n"))?;
    } else {
        let files = count(args.files.len(), "file");
        let errors = count(found.errors, "error");
        let warnings = count(found.warnings, "warning");
        global.note(&format!("checked {files}: {errors}, {warnings}"));
    }
    match found {
        Findings {
            unreadable: 1.., ..
        } => Err(Failure::Error(format!(
            "{} could not be read",
            count(found.unreadable, "file")
        ))),
        Findings { errors: 1.., .. } => Err(Failure::Diagnostics),
        _ => Ok(()),
    }
}

/// Checks one file, reporting as text at once and collecting what JSON output needs.
fn check(file: &str, global: &Global, found: &mut Findings) {
    let mut loader = FileLoader::new("");
    if let Err(message) = loader.load(file) {
        found.unreadable += 1;
        let error = global.error_word();
        super::say(&format!("{error}: cannot read `{file}`: {message}"));
        return;
    }
    let checked = compiler::check(file, &mut loader);
    let shown = diag::render::ordered(&checked.diagnostics);
    let errors = shown.iter().filter(|d| d.is_error()).count();
    found.errors += errors;
    found.warnings += shown.len() - errors;
    if global.json() {
        let json = super::json(&checked.sources, &checked.diagnostics);
        found.diagnostics.extend(json);
    } else {
        global.report(&checked.sources, &checked.diagnostics);
    }
}
