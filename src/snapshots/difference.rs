//! What of a material is not as its snapshot has it, in diagnostics that name the source's lines.

use std::collections::BTreeMap;

use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::source::{SourceMap, Span};
use serde_json::Value;

use super::picture::{self, MOST, SEED};
use super::wgsl::{self, Changed};
use super::{Stored, Subject, Taken};

/// What a snapshot keeps of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aspect {
    /// The generated code.
    Wgsl,
    /// Costs.
    Cost,
    /// Names, types, defaults and ranges of parameters.
    Parameters,
    /// The picture.
    Picture,
}

/// Something that is not as the snapshot has it.
#[derive(Clone, Debug)]
pub struct Difference {
    /// What.
    pub aspect: Aspect,
    /// In words, at the lines that cause it.
    pub diagnostic: Diagnostic,
    /// The lines of WGSL.
    pub changed: Vec<Changed>,
}

/// Most lines of sources that are named.
const LABELS: usize = 6;

/// Everything in which a material is not as its snapshot.
pub fn differences(
    subject: Subject<'_>,
    stored: &Stored,
    taken: &Taken,
    sources: &SourceMap,
) -> Vec<Difference> {
    let mut found = Vec::new();
    let changed = wgsl::changed(&stored.wgsl, &taken.wgsl);
    if !changed.is_empty() {
        found.push(Difference {
            aspect: Aspect::Wgsl,
            diagnostic: code(subject, &changed, taken, sources),
            changed,
        });
    }
    let facts: Value = serde_json::from_str(&taken.facts).unwrap_or_default();
    let mut add = |aspect, what: Option<(String, String)>| {
        found.extend(what.map(|(message, expected)| Difference {
            aspect,
            diagnostic: differs(subject, message).expected(expected),
            changed: Vec::new(),
        }));
    };
    add(Aspect::Cost, cost(&stored.facts["cost"], &facts["cost"]));
    let parameters = (&stored.facts["parameters"], &facts["parameters"]);
    add(Aspect::Parameters, parameter(parameters.0, parameters.1));
    add(Aspect::Picture, seen(stored, taken));
    found
}

fn differs(subject: Subject<'_>, what: String) -> Diagnostic {
    let message = format!("`{}`: {what}", subject.name);
    Diagnostic::new(Code::SnapshotDiffers, subject.span, message)
        .hint("`impasto test --review` shows both; `--accept` takes what is")
}

/// WGSL that changed, at the lines of the sources that it comes from.
fn code(
    subject: Subject<'_>,
    changed: &[Changed],
    taken: &Taken,
    sources: &SourceMap,
) -> Diagnostic {
    let lines: usize = changed.iter().map(|c| c.old.len().max(c.new.len())).sum();
    let what = match lines {
        1 => "1 line of its WGSL is not that of the snapshot".to_owned(),
        lines => format!("{lines} lines of its WGSL are not those of the snapshot"),
    };
    let mut places: BTreeMap<(String, usize), usize> = BTreeMap::new();
    for change in changed {
        // Lines that are gone come from what is around them.
        let around = change.new.start.saturating_sub(1)..change.new.end.max(change.new.start + 1);
        let range = if change.new.is_empty() {
            around
        } else {
            change.new.clone()
        };
        for place in range.filter_map(|line| taken.from.get(line)?.clone()) {
            *places.entry(place).or_default() += 1;
        }
    }
    let mut wrong = differs(subject, what);
    let mut named: Vec<(Span, usize)> = places
        .iter()
        .filter_map(|((file, line), n)| Some((line_of(sources, file, *line)?, *n)))
        .collect();
    // The author's own lines before those of the library.
    named.sort_by_key(|(span, n)| (span.file != subject.span.file, std::cmp::Reverse(*n)));
    if let Some((span, _)) = named.first()
        && span.file == subject.span.file
    {
        wrong.span = Some(*span);
    }
    for (span, n) in named.into_iter().take(LABELS) {
        let plural = if n == 1 { "line" } else { "lines" };
        wrong = wrong.label(span, format!("{n} {plural} of WGSL"));
    }
    wrong
}

/// A line of a source, without the blanks around it.
fn line_of(sources: &SourceMap, file: &str, line: usize) -> Option<Span> {
    // Comments tell names as short as they are clear.
    let is_it = |name: &str| {
        let folder = name.strip_suffix(file);
        folder.is_some_and(|folder| folder.is_empty() || folder.ends_with('/'))
    };
    let (id, file) = sources.files().find(|(_, f)| is_it(&f.name))?;
    let range = file.line_range(line.checked_sub(1)?);
    let text = file.text.get(range.clone())?;
    let start = range.start + (text.len() - text.trim_start().len());
    Some(Span::new(id, start..start + text.trim().len()))
}

/// The cost that differs most telling: operations first.
fn cost(old: &Value, new: &Value) -> Option<(String, String)> {
    let (was, is) = (old.as_object()?, new.as_object()?);
    let differs = |key: &&String| was.get(*key) != is.get(*key);
    let keys = ["operations".to_owned(), "registers".to_owned()];
    let all: Vec<&String> = keys.iter().chain(is.keys()).chain(was.keys()).collect();
    let key = all.into_iter().find(differs)?;
    let number = |map: &serde_json::Map<String, Value>| map.get(key).and_then(Value::as_f64);
    let shown = |x: Option<f64>| x.map_or("nothing".to_owned(), |x| format!("{x}"));
    let (was, is) = (number(was), number(is));
    let share = match (was, is) {
        (Some(was), Some(is)) if was > 0.0 => match 100.0 * (is / was - 1.0) {
            little if little.abs() < 0.05 => format!(" ({little:+.0e} %)"),
            percent => format!(" ({percent:+.1} %)"),
        },
        _ => String::new(),
    };
    let message = format!("its cost has {key} = {}{share}", shown(is));
    Some((message, format!("{key} = {}", shown(was))))
}

/// The first parameter that differs.
fn parameter(old: &Value, new: &Value) -> Option<(String, String)> {
    let (was, is) = (old.as_array()?, new.as_array()?);
    let name = |p: &Value| p["name"].as_str().unwrap_or("?").to_owned();
    let by_name = |all: &[Value], n: &str| all.iter().find(|p| name(p) == n).cloned();
    for p in was {
        match by_name(is, &name(p)) {
            None => {
                return Some((
                    format!("its parameter `{}` is gone", name(p)),
                    "it is kept".into(),
                ));
            }
            Some(now) if now != *p => {
                let fields = p.as_object().into_iter().flatten();
                let key = fields
                    .map(|(key, _)| key)
                    .find(|key| p[*key] != now[*key])
                    .cloned();
                let added = now.as_object()?.keys().find(|key| p[*key].is_null());
                let key = key.or(added.cloned())?;
                return Some((
                    format!(
                        "`{key}` of its parameter `{}` is {}",
                        name(p),
                        shown(&now[&key])
                    ),
                    shown(&p[&key]),
                ));
            }
            Some(_) => {}
        }
    }
    if let Some(added) = is.iter().find(|p| by_name(was, &name(p)).is_none()) {
        return Some((
            format!("its parameter `{}` is new", name(added)),
            "the parameters of the snapshot".into(),
        ));
    }
    let order = was.iter().map(name).ne(is.iter().map(name));
    order.then(|| {
        (
            "its parameters have another order".to_owned(),
            "that of the snapshot".to_owned(),
        )
    })
}

fn shown(value: &Value) -> String {
    if value.is_null() {
        "not there".to_owned()
    } else {
        value.to_string()
    }
}

/// A picture that people see to be another.
fn seen(stored: &Stored, taken: &Taken) -> Option<(String, String)> {
    let expected = format!("a mean FLIP of at most {MOST}");
    match picture::differs(&taken.picture.film, &stored.picture) {
        Ok(flip) if flip <= MOST => None,
        Ok(flip) => Some((
            format!(
                "its picture differs from the snapshot by a mean FLIP of {flip:.3} (seed {SEED})"
            ),
            expected,
        )),
        Err(why) => Some((format!("its picture cannot be compared: {why}"), expected)),
    }
}
