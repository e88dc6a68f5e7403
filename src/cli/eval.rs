//! `impasto eval`: what a material, closure or function is at one point.

use std::fmt::Write;

use clap::{Args, ValueEnum, ValueHint};
use impasto::FileLoader;
use impasto::compiler::diag;
use impasto::compiler::inspect::{
    self, Answer, At, Inspection, Lobe, Named, Precision, Query, Results, Shown, Surface, number,
};
use serde_json::json;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct EvalArgs {
    /// A material file or module of the library, such as `std::bsdf::diffuse`; `-` is standard input
    #[arg(value_hint = ValueHint::FilePath)]
    file: String,
    /// The material, closure or function to evaluate; by default all materials, or everything if there
    /// are none
    #[arg(long, visible_alias = "item", value_name = "NAME")]
    material: Option<String>,
    /// A parameter and its value, as in a source: `coat_ior=1.33`, `flake_size="0.2 mm"`
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = setting)]
    params: Vec<(String, String)>,
    /// The point: `position=(x, y, z), normal=(..), tangent=(..), uv=(u, v), wo=(..), wi=(..), u=(..)`;
    /// keys that are left out have defaults
    #[arg(long, value_name = "POINT", default_value = "")]
    at: At,
    /// Precision of the evaluation; `both` also says where the two differ most
    #[arg(long, default_value = "f64")]
    precision: Precisions,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Precisions {
    /// Single precision, as on the GPU
    F32,
    /// Double precision
    F64,
    /// Both, and their difference
    Both,
}

/// Reads `name=value`.
pub(super) fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("write `name=value`, with the value as in a source".into()),
    }
}

pub(super) fn run(args: &EvalArgs, global: &Global) -> Outcome {
    let query = Query {
        file: args.file.clone(),
        item: args.material.clone(),
        params: args.params.clone(),
        at: args.at,
        precisions: match args.precision {
            Precisions::F32 => vec![Precision::F32],
            Precisions::F64 => vec![Precision::F64],
            Precisions::Both => vec![Precision::F64, Precision::F32],
        },
    };
    let found = inspect::inspect(&query, &mut FileLoader::new(""))
        .map_err(|message| format!("cannot read `{}`: {message}", args.file))?;
    if global.json() {
        print(&format!("{:#}\n", json(&query, &found)))?;
    } else {
        global.report(&found.sources, &found.diagnostics);
        print(&text(&query, &found))?;
        if found.answers.is_empty() && !diag::has_errors(&found.diagnostics) {
            let file = &query.file;
            global.note(&format!("`{file}` defines nothing that can be evaluated"));
        }
    }
    if diag::has_errors(&found.diagnostics) {
        Err(Failure::Diagnostics)
    } else {
        Ok(())
    }
}

fn json(query: &Query, found: &Inspection) -> serde_json::Value {
    json!({
        "file": query.file,
        "at": query.at,
        "answers": found.answers,
        "skipped": found.skipped,
        "diagnostics": super::json(&found.sources, &found.diagnostics),
    })
}

// ---- Text --------------------------------------------------------------------------------

fn text(query: &Query, found: &Inspection) -> String {
    let mut out = String::new();
    if !found.answers.is_empty() {
        let entries = query.at.entries();
        let entry = |(key, numbers): &(&str, Vec<f64>)| format!("{key}={}", Shown::floats(numbers));
        let entries: Vec<String> = entries.iter().map(entry).collect();
        section(&mut out, "", "at", &entries);
    }
    for answer in &found.answers {
        out.push('\n');
        item(&mut out, answer);
    }
    for skipped in &found.skipped {
        line(
            &mut out,
            &format!("\n{} is left out: {}", skipped.name, skipped.reason),
        );
    }
    out
}

fn line(out: &mut String, text: &str) {
    out.push_str(text);
    out.push('\n');
}

/// A heading and indented lines, or nothing without lines.
fn section(out: &mut String, indent: &str, heading: &str, lines: &[String]) {
    if lines.is_empty() {
        return;
    }
    line(out, &format!("{indent}{heading}"));
    for entry in lines {
        line(out, &format!("{indent}  {entry}"));
    }
}

fn named(values: &[Named]) -> Vec<String> {
    let width = values.iter().map(|v| v.name.chars().count()).max();
    let width = width.unwrap_or(0);
    let entry = |v: &Named| format!("{:width$}  {}", v.name, v.value);
    values.iter().map(entry).collect()
}

fn item(out: &mut String, answer: &Answer) {
    line(out, &format!("{} {}", answer.kind.text(), answer.name));
    section(out, "  ", "parameters", &named(&answer.parameters));
    section(out, "  ", "arguments", &named(&answer.arguments));
    let several = answer.results.len() > 1;
    for results in &answer.results {
        let indent = if several {
            line(out, &format!("  in {}", results.precision.text()));
            "    "
        } else {
            "  "
        };
        values(out, indent, results);
    }
    if let Some(worst) = &answer.worst_difference {
        let [a, b] = worst.values.map(number);
        let relative = worst.relative;
        let text = format!("{relative:.1e} relative, of {}: {a} and {b}", worst.of);
        section(out, "  ", "worst difference", &[text]);
    }
}

fn values(out: &mut String, indent: &str, results: &Results) {
    if let Some(value) = &results.value {
        section(out, indent, "value", &[value.to_string()]);
    }
    section(out, indent, "patterns", &named(&results.patterns));
    if let Some(surface) = &results.surface {
        scattering(out, indent, surface);
    }
    if let Some(emission) = &results.emission {
        let text = format!("{emission} W/(m^2 sr)");
        section(out, indent, "emission toward wo", &[text]);
    }
    section(out, indent, "outputs", &named(&results.outputs));
    let n = &results.operations;
    let text = format!(
        "alu {}, special {}, integer {}, texture {}, calls {}, turns of loops {}",
        n.alu, n.special, n.integer, n.texture, n.calls, n.turns
    );
    section(out, indent, "operations", &[text]);
}

fn scattering(out: &mut String, indent: &str, surface: &Surface) {
    line(out, &format!("{indent}lobes"));
    for lobe in &surface.lobes {
        let inner = format!("{indent}  ");
        section(out, &inner, &call(lobe), &weights(lobe));
    }
    let toward = [
        format!("f |cos|     {}", surface.toward.value),
        format!("pdf         {}", surface.toward.pdf),
    ];
    section(out, indent, "toward wi", &toward);
    let crosses = if surface.sampled.transmitted {
        ", on the other side"
    } else {
        ""
    };
    let sampled = [
        format!("wi          {}{crosses}", surface.sampled.wi),
        format!("pdf         {}", surface.sampled.pdf),
        format!("throughput  {}", surface.sampled.throughput),
    ];
    section(out, indent, "sampled by u", &sampled);
    let albedo = [format!("{}", surface.albedo)];
    section(out, indent, "albedo", &albedo);
}

/// A lobe as it would be written.
fn call(lobe: &Lobe) -> String {
    let mut text = format!("{}(", lobe.bsdf);
    for (i, argument) in lobe.arguments.iter().enumerate() {
        let comma = if i > 0 { ", " } else { "" };
        let _ = write!(text, "{comma}{}: {}", argument.name, argument.value);
    }
    text.push(')');
    if lobe.delta {
        text.push_str(", discrete");
    }
    text
}

fn weights(lobe: &Lobe) -> Vec<String> {
    vec![
        format!("weight  {}", lobe.weight),
        format!("albedo  {}", lobe.albedo),
        format!("share   {}", lobe.share),
    ]
}
