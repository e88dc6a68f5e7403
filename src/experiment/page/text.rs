//! The text of a page: a template with its blocks filled in, without the sections that have nothing to say.

use std::fmt::Write as _;
use std::path::Path;

use impasto_runtime::input;

use super::Content;
use super::blocks::{block, failures};
use crate::experiment::rates;
use crate::experiment::study::{Kind, Study};
use crate::files::reason;

/// The page.
pub(super) fn page(content: &Content<'_>) -> Result<String, String> {
    let study = content.study;
    let (path, text) = match &study.template {
        Some(path) => {
            let text = input::read_to_string(path);
            let cannot = |e| format!("cannot read `{}`: {}", path.display(), reason(&e));
            (path.clone(), text.map_err(cannot)?)
        }
        None => (study.path.clone(), general(study)),
    };
    let mut out = String::new();
    let mut has_failures = false;
    for section in sections(&text) {
        has_failures |= section.iter().any(|(_, line)| line.contains("{{failures"));
        out += &filled(content, &path, &section)?;
    }
    let failures = failures(content);
    if !has_failures && !failures.is_empty() {
        let _ = write!(out, "\n## What failed\n\n{failures}");
    }
    Ok(format!("{}\n", out.trim_end()))
}

/// The general text of a study's kinds.
fn general(study: &Study) -> String {
    let mut out = include_str!("../templates/head.md").to_owned();
    for part in &study.parts {
        let text = match part.kind {
            Kind::Partition(_) => include_str!("../templates/partition.md"),
            Kind::Rates(_) => include_str!("../templates/rates.md"),
            Kind::Rays(_) => include_str!("../templates/rays.md"),
            Kind::Convergence(_) => continue,
        };
        let text = text.replace("PART", &part.name);
        let text = match &part.kind {
            // A plot is of some variants, but not of any number.
            Kind::Rates(of) if !rates::PLOTTED.contains(&of.variants.len()) => {
                text.lines()
                    .filter(|line| !line.starts_with("!["))
                    .collect::<Vec<_>>()
                    .join("\n")
                    + "\n"
            }
            _ => text,
        };
        let about = match part.about.as_str() {
            "" => String::new(),
            about => format!("{about}\n\n"),
        };
        out += &text.replace("ABOUT\n\n", &about);
    }
    if study
        .parts
        .iter()
        .any(|part| matches!(part.kind, Kind::Convergence(_)))
    {
        out += include_str!("../templates/convergence.md");
    }
    out + include_str!("../templates/tail.md")
}

/// Lines with their numbers, cut before every heading of the second order.
fn sections(text: &str) -> Vec<Vec<(usize, &str)>> {
    let mut all: Vec<Vec<(usize, &str)>> = vec![Vec::new()];
    let mut in_code = false;
    for (at, line) in text.lines().enumerate() {
        in_code ^= line.starts_with("```");
        if line.starts_with("## ") && !in_code {
            all.push(Vec::new());
        }
        if let Some(last) = all.last_mut() {
            last.push((at + 1, line));
        }
    }
    all
}

/// A section with its blocks; empty if it has some and all of them are empty.
fn filled(content: &Content<'_>, path: &Path, section: &[(usize, &str)]) -> Result<String, String> {
    let (mut blocks, mut found) = (0, 0);
    let mut out = String::new();
    for (number, line) in section {
        let error = |why: String| {
            let place = format!("{}:{number}", path.display());
            format!("{place}: {why}")
        };
        let alone = line
            .strip_prefix("{{")
            .and_then(|line| line.strip_suffix("}}"));
        if let Some(words) = alone.filter(|words| !words.contains("{{")) {
            let text = block(content, words).map_err(error)?;
            blocks += 1;
            found += usize::from(!text.is_empty());
            out += &text;
            if !text.is_empty() && !text.ends_with('\n') {
                out.push('\n');
            }
            continue;
        }
        let mut rest = *line;
        while let Some((before, after)) = rest.split_once("{{") {
            let (words, after) = after.split_once("}}").ok_or_else(|| {
                error("`{{` has no `}}`\n  hint: a block is written as in `{{regret}}`".into())
            })?;
            out += before;
            out += block(content, words).map_err(error)?.trim_end();
            rest = after;
        }
        out += rest;
        out.push('\n');
    }
    Ok(if blocks > 0 && found == 0 {
        String::new()
    } else {
        out
    })
}
