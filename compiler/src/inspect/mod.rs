//! Evaluates what a file defines at one point, with the interpreter: `impasto eval`.
//!
//! For a material it tells the parameters, the patterns, the lobes, what is scattered and emitted
//! and how many operations that takes; for a closure the same as if it were a material, and for a
//! function its value. In both precisions it also tells how far they are apart.

use std::sync::Arc;

use serde::Serialize;

use crate::diag::{self, Code, Diagnostic};
use crate::driver::{MaterialRequest, Parameters, check, compile};
use crate::ir::Module;
use crate::ir::ops::Counts;
use crate::loader::{Loader, MemoryLoader, library_text};
use crate::moment::Moment;
use crate::passes;
use crate::source::{FileId, Origin, SourceMap};
use crate::{lexer, parser};

mod asserted;
mod at;
mod difference;
mod items;
mod run;
mod values;

pub use asserted::run_test;
pub use at::At;
pub use difference::Difference;
pub use items::Kind;
pub use values::{Named, Shown, number};

use items::{Call, Item};
pub(crate) use run::{context, point};

/// Most operations of one evaluation.
pub const FUEL: u64 = 1 << 26;

/// What to evaluate, and where.
#[derive(Clone, Debug)]
pub struct Query {
    /// A file, or `std::folder::name`.
    pub file: String,
    /// Which of its definitions. Without, its materials; if it has none, its closures and
    /// functions, or of a module of the library the one that it is named for.
    pub item: Option<String>,
    /// Parameters that differ from their defaults: name, and value as source text.
    pub params: Vec<(String, String)>,
    /// Where.
    pub at: At,
    /// In which precisions.
    pub precisions: Vec<Precision>,
}

/// A precision of the interpreter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Precision {
    F32,
    F64,
}

impl Precision {
    /// Its name.
    pub fn text(self) -> &'static str {
        match self {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }
}

/// What evaluation gave.
pub struct Inspection {
    /// The texts that diagnostics point into.
    pub sources: SourceMap,
    /// Everything that was found; there are no answers where one is an error.
    pub diagnostics: Vec<Diagnostic>,
    /// One for each definition that was evaluated.
    pub answers: Vec<Answer>,
    /// Definitions that were not, and why.
    pub skipped: Vec<Skipped>,
}

/// A definition that was not evaluated.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    /// Its name.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// What a definition is at the point.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Parameters of a material with their values.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<Named>,
    /// Arguments that a closure or function was called with, as source text.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub arguments: Vec<Named>,
    /// In each precision.
    pub results: Vec<Results>,
    /// Where two precisions differ most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_difference: Option<Difference>,
}

/// What was computed in one precision.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    /// Which.
    pub precision: Precision,
    /// The value of a function.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<Shown>,
    /// The `let` values of a material.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub patterns: Vec<Named>,
    /// What a material scatters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<Surface>,
    /// The radiance toward `wo` of a material that emits, W/(m^2 sr).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emission: Option<Shown>,
    /// Further outputs of a material: opacity and the medium inside.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<Named>,
    /// Operations executed by a function, or by a material's code.
    pub operations: Counts,
}

/// How a material scatters.
#[derive(Clone, Debug, Serialize)]
pub struct Surface {
    /// Its lobes, in the order they are written.
    pub lobes: Vec<Lobe>,
    /// Share of the light that it scatters, seen from `wo`.
    pub albedo: Shown,
    /// Toward `wi`.
    pub toward: Toward,
    /// For the numbers `u`.
    pub sampled: Sampled,
}

/// A lobe seen from `wo`.
#[derive(Clone, Debug, Serialize)]
pub struct Lobe {
    /// Name of its bsdf.
    pub bsdf: String,
    /// Are its directions discrete?
    pub delta: bool,
    /// Its arguments.
    pub arguments: Vec<Named>,
    /// Color by which it counts.
    pub weight: Shown,
    /// Its directional albedo.
    pub albedo: Shown,
    /// The probability that it is the one sampled.
    pub share: Shown,
}

/// Scattering from `wi` to `wo`.
#[derive(Clone, Debug, Serialize)]
pub struct Toward {
    /// f |cos|, discrete directions left out, 1/sr.
    pub value: Shown,
    /// The density with which it is sampled, 1/sr.
    pub pdf: Shown,
}

/// A sampled direction.
#[derive(Clone, Debug, Serialize)]
pub struct Sampled {
    /// The direction; zero if there is none.
    pub wi: Shown,
    /// Its density, 1/sr; 0 if it is discrete.
    pub pdf: Shown,
    /// f |cos| / pdf.
    pub throughput: Shown,
    /// Is it on the other side of the surface?
    pub transmitted: bool,
}

/// Evaluates.
///
/// # Errors
/// Why the file cannot be read.
pub fn inspect(query: &Query, loader: &mut dyn Loader) -> Result<Inspection, String> {
    let mut source = Source::open(&query.file, loader)?;
    let checked = check(&query.file, &mut source);
    let mut inspection = Inspection {
        sources: checked.sources,
        diagnostics: checked.diagnostics,
        answers: Vec::new(),
        skipped: Vec::new(),
    };
    if diag::has_errors(&inspection.diagnostics) {
        return Ok(inspection);
    }
    let (ast, _) = parser::parse(FileId(0), &source.text);
    match chosen(query, items::items(&ast)) {
        Ok(items) => {
            let all = query.item.is_none() && items.len() > 1;
            for item in items {
                answer(query, &item, all, &mut source, &mut inspection);
            }
        }
        Err(problem) => inspection.diagnostics.push(problem),
    }
    if diag::has_errors(&inspection.diagnostics) {
        inspection.answers.clear();
    }
    Ok(inspection)
}

/// A file with text put behind its own.
struct Source<'l> {
    file: String,
    text: String,
    appended: String,
    inner: &'l mut dyn Loader,
}

impl<'l> Source<'l> {
    fn open(file: &str, inner: &'l mut dyn Loader) -> Result<Self, String> {
        let bytes = match library_text(file) {
            Some(text) => text?.as_bytes().to_vec(),
            None => inner.load(file)?,
        };
        Ok(Self {
            file: file.to_owned(),
            // What is no text is reported by the check.
            text: lexer::decode(file, &bytes).unwrap_or_default(),
            appended: String::new(),
            inner,
        })
    }
}

impl Loader for Source<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        if path != self.file || self.text.is_empty() {
            return self.inner.load(path);
        }
        Ok(format!("{}{}", self.text, self.appended).into_bytes())
    }

    fn origin(&mut self, path: &str) -> Option<Arc<Origin>> {
        self.inner.origin(path)
    }
}

/// The items that a query asks for.
fn chosen(query: &Query, items: Vec<Item>) -> Result<Vec<Item>, Diagnostic> {
    let named = |name: &str| items.iter().find(|i| i.name == name).cloned();
    if let Some(name) = &query.item {
        return named(name).map(|i| vec![i]).ok_or_else(|| {
            let names: Vec<&str> = items.iter().map(|i| i.name.as_str()).collect();
            let message = format!("`{}` defines no `{name}`", query.file);
            let expected = match names.as_slice() {
                [] => "a file that defines a material, closure or function".into(),
                names => format!("one of `{}`", names.join("`, `")),
            };
            Diagnostic::without_span(Code::NoMaterial, message)
                .expected(expected)
                .did_you_mean(name, names)
        });
    }
    let own = query
        .file
        .strip_prefix("std::")
        .and_then(|p| p.split_once("::"));
    if let Some(item) = own.and_then(|(_, name)| named(name)) {
        return Ok(vec![item]);
    }
    let is_material = |i: &Item| i.kind == Kind::Material;
    if items.iter().any(is_material) {
        Ok(items.into_iter().filter(is_material).collect())
    } else {
        Ok(items)
    }
}

/// Evaluates one item; `all` if it is one of many, where one that cannot be is left out.
fn answer(
    query: &Query,
    item: &Item,
    all: bool,
    source: &mut Source<'_>,
    inspection: &mut Inspection,
) {
    let call = match item.call(&query.params) {
        Ok(call) => call,
        Err((param, ty)) => {
            let name = item.name.clone();
            let reason = format!("nothing stands in for `{param}: {ty}`");
            if all {
                return inspection.skipped.push(Skipped { name, reason });
            }
            let message = format!("`{name}` needs a value for `{param}: {ty}`");
            let missing = Diagnostic::without_span(Code::MissingArgument, message)
                .expected(format!("`--param {param}=value`"));
            return inspection.diagnostics.push(missing);
        }
    };
    source.appended = format!("\n{}\n", call.text);
    let mut answer = Answer {
        name: item.name.clone(),
        kind: item.kind.clone(),
        parameters: Vec::new(),
        arguments: Vec::new(),
        results: Vec::new(),
        worst_difference: None,
    };
    let problems = match &item.kind {
        Kind::Function(_) => function(query, &call, source, &mut answer),
        kind => material(query, kind, &call, source, &mut answer),
    };
    source.appended.clear();
    match problems {
        Ok(()) => {
            if let [a, b] = answer.results.as_slice() {
                answer.worst_difference = difference::worst(a, b);
            }
            inspection.answers.push(answer);
        }
        Err((sources, problems)) => {
            inspection.sources = sources;
            inspection.diagnostics.extend(problems);
        }
    }
}

/// Why there is no answer: diagnostics with the texts they point into.
type Problems = (SourceMap, Vec<Diagnostic>);

/// An evaluation of `name` spent its budget, most of it in the loop `spent` if there was one.
fn too_long(name: &str, spent: run::Spent) -> Diagnostic {
    let message = format!("evaluating `{name}` takes too long: its budget is spent");
    let diagnostic = match spent.busiest_loop {
        Some(span) => Diagnostic::new(Code::TooLarge, span, message)
            .hint("of all loops this one took most turns"),
        None => Diagnostic::without_span(Code::TooLarge, message),
    };
    diagnostic.expected(format!("at most {FUEL} expressions"))
}

/// Runs a function of each precision that is asked for.
fn in_each<T>(query: &Query, in_f32: impl Fn() -> T, in_f64: impl Fn() -> T) -> Vec<T> {
    let run = |p: &Precision| match p {
        Precision::F32 => in_f32(),
        Precision::F64 => in_f64(),
    };
    query.precisions.iter().map(run).collect()
}

fn function(
    query: &Query,
    call: &Call,
    source: &mut Source<'_>,
    answer: &mut Answer,
) -> Result<(), Problems> {
    let checked = check(&query.file, source);
    let id = checked
        .ir
        .functions
        .iter()
        .rposition(|f| f.name == items::NAME);
    let (false, Some(id)) = (diag::has_errors(&checked.diagnostics), id) else {
        return Err((checked.sources, checked.diagnostics));
    };
    answer.arguments = texts(&call.arguments);
    let f = &checked.ir.functions[id];
    let results = in_each(
        query,
        || run::function::<f32>(&checked.ir, f, &query.at, Precision::F32),
        || run::function::<f64>(&checked.ir, f, &query.at, Precision::F64),
    );
    match results.into_iter().collect() {
        Ok(results) => answer.results = results,
        Err(spent) => return Err((checked.sources, vec![too_long(&answer.name, spent)])),
    }
    Ok(())
}

/// The function that `std::folder::name` is named for, called with defaults and stand-ins over
/// the context of [`items::CONTEXT`]: an optimised module, and the caller's index in it.
pub(crate) fn library_call(path: &str) -> Option<(Module, usize)> {
    let mut files = MemoryLoader::default();
    let mut source = Source::open(path, &mut files).ok()?;
    let (ast, _) = parser::parse(FileId(0), &source.text);
    let (_, name) = path.rsplit_once("::")?;
    let item = items::items(&ast).into_iter().find(|i| i.name == name)?;
    let call = item.call(&[]).ok()?;
    source.appended = format!("\n{}\n", call.text);
    let mut module = check(path, &mut source).ir;
    let index = module
        .functions
        .iter()
        .rposition(|f| f.name == items::NAME)?;
    passes::library(&mut module, 0);
    Some((module, index))
}

fn texts(arguments: &[(String, String)]) -> Vec<Named> {
    let named = |(name, text): &(String, String)| Named {
        name: name.clone(),
        value: Shown::Text(text.clone()),
    };
    arguments.iter().map(named).collect()
}

fn material(
    query: &Query,
    kind: &Kind,
    call: &Call,
    source: &mut Source<'_>,
    answer: &mut Answer,
) -> Result<(), Problems> {
    let own = *kind == Kind::Material;
    let name = if own { &answer.name } else { items::NAME };
    let request = MaterialRequest {
        written: None,
        apart: false,
        moment: Some(Moment {
            frame: query.at.frame,
            time: query.at.time,
        }),
        name: answer.name.clone(),
        file: query.file.clone(),
        material: Some(name.to_owned()),
        params: if own {
            let given = query.params.iter();
            let text = |(name, text): &(String, String)| (name.clone(), text.as_str().into());
            given.map(text).collect()
        } else {
            Vec::new()
        },
        parameters: Parameters::Baked,
    };
    let compiled = compile(std::slice::from_ref(&request), source);
    let Some(program) = compiled.program else {
        return Err((compiled.sources, compiled.diagnostics));
    };
    let Some(probed) = run::probed(&request, source) else {
        return Ok(());
    };
    if own {
        answer.parameters.clone_from(&probed.parameters);
    } else {
        answer.arguments = texts(&call.arguments);
    }
    let results = in_each(
        query,
        || run::material::<f32>(&program, &probed, &query.at, Precision::F32),
        || run::material::<f64>(&program, &probed, &query.at, Precision::F64),
    );
    match results.into_iter().collect() {
        Ok(results) => answer.results = results,
        Err(spent) => return Err((compiled.sources, vec![too_long(&answer.name, spent)])),
    }
    Ok(())
}
