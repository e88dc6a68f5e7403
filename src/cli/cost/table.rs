//! Costs as text: a table of materials, and below it the lines of their sources.

use std::collections::BTreeSet;
use std::fmt::Write;

use impasto::compiler::cost::{Cost, LineCost, Operations};
use impasto::cost::MaterialCost;

use super::{CostArgs, NoiseCost};

/// What Laine, Karras and Aila 2013, section 3, count: instructions of a Kepler GPU.
const PAPER: [(&str, &str); 3] = [
    ("one noise evaluation", "477"),
    ("car paint", "4200"),
    ("casting a ray", "2000 to 3000"),
];

/// Characters of the longest bar.
const BAR: f64 = 20.0;

/// Characters of a line's text that are shown.
const TEXT: usize = 56;

/// Materials, noise beside them, what the paper has, and the lines that cost most.
pub fn text(args: &CostArgs, materials: &[MaterialCost], noise: &[NoiseCost]) -> String {
    let names = materials.iter().map(|m| &m.name);
    let names = names.chain(noise.iter().map(|n| &n.name));
    let paper = PAPER.iter().map(|(what, _)| what.len());
    let width = names.map(|n| n.chars().count()).chain(paper).max();
    let width = width.unwrap_or(0);
    let samples = args.samples;
    let mut out = format!("operations of one evaluation, at {samples} points\n\n");
    let _ = writeln!(
        out,
        "{:width$}  {:>7} {:>7} {:>7}  {:>7} {:>7} {:>7} {:>7} {:>7}  {:>7} {:>7} {:>5}",
        "",
        "mean",
        "least",
        "most",
        "float",
        "special",
        "integer",
        "texture",
        "turns",
        "alive",
        "code",
        "SIMT"
    );
    for m in materials {
        material(&mut out, width, m);
    }
    out.push('\n');
    for n in noise {
        let _ = writeln!(out, "{}", row(width, &n.name, &n.operations));
    }
    walks(&mut out, width, materials);
    out.push_str("\ninstructions in Laine, Karras and Aila 2013, section 3\n\n");
    for (what, count) in PAPER {
        let _ = writeln!(out, "{what:width$}  {count:>7}");
    }
    if args.lines > 0 {
        materials.iter().for_each(|m| lines(&mut out, args, m));
    }
    out
}

fn material(out: &mut String, width: usize, m: &MaterialCost) {
    let Some(cost) = &m.cost else {
        let _ = writeln!(out, "{:width$}  on no surface", m.name);
        return;
    };
    let row = row(width, &m.name, &cost.operations);
    let efficiency = percent(cost);
    let _ = writeln!(
        out,
        "{row}  {:>7} {:>7} {efficiency:>5}{}",
        cost.live,
        cost.code,
        if m.spent.is_some() {
            "  incomplete"
        } else {
            ""
        }
    );
}

/// What light costs that walks below surfaces.
fn walks(out: &mut String, width: usize, materials: &[MaterialCost]) {
    let walks = materials.iter().filter_map(|m| Some((&m.name, m.walks?)));
    for (index, (name, walks)) in walks.enumerate() {
        if index == 0 {
            out.push_str("\nlight that walks below the surface\n\n");
        }
        let share = 100.0 * walks.share;
        let casts = walks.casts;
        let _ = writeln!(
            out,
            "{name:width$}  {share:>5.0} % of evaluations, {casts:.0} ray casts each"
        );
    }
}

/// `93 %`: the forecast of SIMT efficiency.
pub fn percent(cost: &Cost) -> String {
    format!("{:.0} %", 100.0 * cost.efficiency())
}

fn row(width: usize, name: &str, o: &Operations) -> String {
    let c = &o.classes;
    format!(
        "{name:width$}  {:>7.0} {:>7} {:>7}  {:>7.0} {:>7.0} {:>7.0} {:>7.0} {:>7.0}",
        o.mean, o.min, o.max, c.alu, c.special, c.integer, c.texture, c.turns
    )
}

// ---- Lines -------------------------------------------------------------------------------

/// The lines of a material that cost most, with what they call.
fn lines(out: &mut String, args: &CostArgs, m: &MaterialCost) {
    let shown: Vec<&LineCost> = m
        .lines
        .iter()
        .filter(|l| args.library || !l.library)
        .take(args.lines)
        .collect();
    if shown.is_empty() {
        return;
    }
    let files: BTreeSet<&str> = shown.iter().map(|l| l.file.as_str()).collect();
    let _ = match files.first() {
        Some(file) if files.len() == 1 => writeln!(out, "\n{} in {file}", m.name),
        _ => writeln!(out, "\n{}", m.name),
    };
    let place = |l: &LineCost| match files.len() {
        1 => l.line.to_string(),
        _ => format!("{}:{}", l.file, l.line),
    };
    let wide = |text: String| text.chars().count();
    let places = shown.iter().map(|l| wide(place(l))).max().unwrap_or(0);
    let texts = shown.iter().map(|l| wide(shortened(&l.text))).max();
    let texts = texts.unwrap_or(0);
    for line in shown {
        let bar = "#".repeat((BAR * line.share).round() as usize);
        let row = format!(
            "{:>width$}  {:texts$}  {:>7.0}  {:>3.0} %  {bar}",
            place(line),
            shortened(&line.text),
            line.with_calls,
            100.0 * line.share,
            width = places + 2,
        );
        let _ = writeln!(out, "{}", row.trim_end());
    }
}

/// A line's text, cut where it is long.
pub fn shortened(text: &str) -> String {
    match text.char_indices().nth(TEXT) {
        Some((end, _)) => format!("{}...", text[..end].trim_end()),
        None => text.to_owned(),
    }
}
