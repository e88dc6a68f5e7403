//! `impasto fmt`: sources in the layout of the language.
//!
//! A file is replaced as a whole or not at all, and only where something changes. Sources with
//! syntax errors are reported and left alone.

use std::path::Path;

use clap::{Args, ValueHint};
use impasto::FileLoader;
use impasto::compiler::diag::Diagnostic;
use impasto::compiler::format::{self, Unformatted};
use impasto::compiler::source::SourceMap;
use impasto::compiler::{Loader, lexer};
use impasto::files::{self, STDIN};
use impasto::runtime::input::mtlx;
use serde_json::{Value, json};
use similar::TextDiff;

use super::{Failure, Global, Outcome, count, print};

#[derive(Args)]
pub(super) struct FmtArgs {
    /// Files, and folders whose `.impasto` files are formatted; `-` is standard input, formatted to
    /// standard output
    #[arg(value_name = "PATH", default_value = ".", value_hint = ValueHint::AnyPath)]
    paths: Vec<String>,
    /// Write nothing; exit with 1 if a file is not formatted
    #[arg(long)]
    check: bool,
    /// Write nothing but the differences, to standard output
    #[arg(long)]
    diff: bool,
}

/// What became of all files together.
#[derive(Default)]
struct Done {
    files: usize,
    changed: Vec<String>,
    /// Files with syntax errors.
    broken: usize,
    /// What went wrong with files otherwise.
    failures: Vec<String>,
    diagnostics: Vec<Value>,
}

pub(super) fn run(args: &FmtArgs, global: &Global) -> Outcome {
    let mut done = Done::default();
    let mut names = Vec::new();
    for path in &args.paths {
        match super::sources::named(path, is_source) {
            Ok(found) => names.extend(found),
            Err(why) => done.failures.push(why),
        }
    }
    for name in &names {
        done.files += 1;
        if let Err(why) = one(name, args, global, &mut done) {
            done.failures.push(why);
        }
    }
    summary(args, global, &done)?;
    for failure in &done.failures {
        super::say(&format!("{}: {failure}", global.error_word()));
    }
    let unformatted = args.check && !done.changed.is_empty();
    match done {
        Done { failures, .. } if !failures.is_empty() => {
            let files = count(failures.len(), "file");
            Err(Failure::Error(format!("{files} could not be formatted")))
        }
        Done { broken: 1.., .. } => Err(Failure::Diagnostics),
        _ if unformatted => Err(Failure::Diagnostics),
        _ => Ok(()),
    }
}

/// Formats one file.
fn one(name: &str, args: &FmtArgs, global: &Global, done: &mut Done) -> Result<(), String> {
    if mtlx::is_document(Path::new(name)) {
        let hint = "`impasto import` makes a source of it";
        return Err(format!(
            "`{name}` is a MaterialX document, not a source\n  hint: {hint}"
        ));
    }
    let bytes = FileLoader::new("").load(name);
    let bytes = bytes.map_err(|why| format!("cannot read `{name}`: {why}"))?;
    let mut sources = SourceMap::default();
    let text = match lexer::decode(name, &bytes) {
        Ok(text) => text,
        Err(diagnostic) => {
            broken(&sources, &[diagnostic], global, done);
            return Ok(());
        }
    };
    let file = sources.add(name, &*text);
    let formatted = match format::format(file, &text) {
        Ok(formatted) => formatted,
        Err(Unformatted::Syntax(diagnostics)) => {
            broken(&sources, &diagnostics, global, done);
            return Ok(());
        }
        Err(Unformatted::Lost) => {
            return Err(format!(
                "formatting `{name}` would lose a part of it, so it is left as it is\n\
                 hint: this is a defect of the formatter; please report it with the source"
            ));
        }
    };
    let changes = formatted != text;
    if changes {
        done.changed.push(name.to_owned());
    }
    let failed = |failure| match failure {
        Failure::Error(why) => why,
        _ => String::new(),
    };
    if args.diff && changes && !global.json() {
        print(&difference(name, &text, &formatted)).map_err(failed)
    } else if args.check || args.diff {
        Ok(())
    } else if name == STDIN {
        print(&formatted).map_err(failed)
    } else if changes {
        Ok(files::write_whole(Path::new(name), formatted.as_bytes())?)
    } else {
        Ok(())
    }
}

fn broken(sources: &SourceMap, diagnostics: &[Diagnostic], global: &Global, done: &mut Done) {
    done.broken += 1;
    if global.json() {
        done.diagnostics.extend(super::json(sources, diagnostics));
    } else {
        global.report(sources, diagnostics);
    }
}

fn summary(args: &FmtArgs, global: &Global, done: &Done) -> Outcome {
    let reads_only = args.check || args.diff;
    if global.json() && !args.paths.iter().any(|p| p == STDIN && !reads_only) {
        let result = json!({
            "files": done.files,
            "changed": done.changed,
            "written": !reads_only,
            "diagnostics": done.diagnostics,
        });
        return print(&format!("{result:#}\n"));
    }
    for name in &done.changed {
        if reads_only {
            global.note(&format!("not formatted: {name}"));
        } else {
            global.detail(&format!("formatted {name}"));
        }
    }
    let changed = done.changed.len();
    let verb = if reads_only {
        "not formatted"
    } else {
        "formatted"
    };
    let broken = match done.broken {
        0 => String::new(),
        n => format!(", {} with syntax errors left alone", count(n, "file")),
    };
    let files = count(done.files, "file");
    global.note(&format!("{files}: {changed} {verb}{broken}"));
    Ok(())
}

/// The lines that differ, as `diff -u` writes them.
fn difference(name: &str, before: &str, after: &str) -> String {
    let diff = TextDiff::from_lines(before, after);
    diff.unified_diff()
        .context_radius(3)
        .header(name, &format!("{name} (formatted)"))
        .to_string()
}

fn is_source(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "impasto")
}
