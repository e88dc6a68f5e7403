//! `impasto explain`: what a diagnostic code means, with a source that provokes it and the same
//! source repaired.

use std::fmt::Write;

use clap::Args;
use impasto::compiler::diag::examples::{self, Example};
use impasto::compiler::diag::{self, Code, Severity};
use serde_json::json;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct ExplainArgs {
    /// A code such as E0201, in either case; without one, all codes are listed
    code: Option<String>,
    /// All codes as a page of Markdown, which is docs/diagnostics.md
    #[arg(long, conflicts_with = "code")]
    markdown: bool,
}

pub(super) fn run(args: &ExplainArgs, global: &Global) -> Outcome {
    if args.markdown {
        return print(&examples::page());
    }
    let codes = match &args.code {
        Some(id) => vec![find(id)?],
        None => Code::ALL.to_vec(),
    };
    if global.json() {
        let values: Vec<_> = codes.iter().map(|code| as_json(*code)).collect();
        return print(&format!("{:#}\n", json!(values)));
    }
    match args.code {
        Some(_) => codes.iter().try_for_each(|code| print(&explained(*code))),
        None => codes.iter().try_for_each(|code| print(&listed(*code))),
    }
}

fn find(id: &str) -> Result<Code, Failure> {
    Code::from_id(id).ok_or_else(|| {
        let hint = match diag::nearest(&id.to_uppercase(), Code::ALL.iter().map(|c| c.id())) {
            Some(near) => format!("did you mean {near}?"),
            None => "`impasto explain` lists all codes".into(),
        };
        Failure::Error(format!("there is no diagnostic `{id}`\nhint: {hint}"))
    })
}

fn explained(code: Code) -> String {
    let severity = severity(code);
    let (id, title, text) = (code.id(), code.title(), code.explanation());
    let mut out = format!("{severity}[{id}]: {title}\n\n{text}\n");
    if let Some((broken, repaired)) = code.example() {
        show(&mut out, "It comes from", &broken);
        show(&mut out, "Repaired", &repaired);
    }
    out
}

fn show(out: &mut String, title: &str, example: &Example) {
    // Writing to a string cannot fail.
    let _ = write!(out, "\n{title}:");
    for note in example.notes() {
        let _ = write!(out, " {note}");
    }
    out.push_str("\n\n");
    for (name, text) in &example.files {
        if name != examples::FILE {
            let _ = write!(out, "\n  {name}:\n\n");
        }
        for line in text.lines() {
            let _ = writeln!(out, "{}", format!("    {line}").trim_end());
        }
    }
}

fn listed(code: Code) -> String {
    format!("{}  {:<8} {}\n", code.id(), severity(code), code.title())
}

fn as_json(code: Code) -> serde_json::Value {
    let example = |example: &Example| {
        let files = example.files.iter();
        let files: Vec<_> = files
            .map(|(name, text)| json!({ "name": name, "text": text }))
            .collect();
        json!({ "files": files, "notes": example.notes() })
    };
    let examples = code.example();
    json!({
        "code": code.id(),
        "severity": severity(code),
        "title": code.title(),
        "explanation": code.explanation(),
        "example": examples.as_ref().map(|(broken, _)| example(broken)),
        "repaired": examples.as_ref().map(|(_, repaired)| example(repaired)),
    })
}

fn severity(code: Code) -> &'static str {
    match code.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}
