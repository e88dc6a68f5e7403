//! `impasto explain`: what a diagnostic code means.

use clap::Args;
use impasto::compiler::diag::{self, Code, Severity};
use serde_json::json;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct ExplainArgs {
    /// A code such as E0201, in either case; without one, all codes are listed
    code: Option<String>,
}

pub(super) fn run(args: &ExplainArgs, global: &Global) -> Outcome {
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
    format!("{severity}[{id}]: {title}\n\n{text}\n")
}

fn listed(code: Code) -> String {
    format!("{}  {:<8} {}\n", code.id(), severity(code), code.title())
}

fn as_json(code: Code) -> serde_json::Value {
    json!({
        "code": code.id(),
        "severity": severity(code),
        "title": code.title(),
        "explanation": code.explanation(),
    })
}

fn severity(code: Code) -> &'static str {
    match code.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}
