//! docs/stability.md, made of the rows.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::Ended;
use super::rows::Row;
use xtask::shell;

/// What is tested, by the number or name that rows carry.
const TOPICS: [(&str, &str); 40] = [
    ("1", "GGX at alpha 1e-2 to 1e-4"),
    ("2", "one alpha 0, the other not"),
    ("3", "smooth to delta"),
    ("4", "half vector at the horizon"),
    ("5", "ior exactly 1"),
    ("6", "ior next to 1"),
    ("7", "ior 0, negative or infinite"),
    ("8", "edge of total internal reflection"),
    ("9", "metals at their ends"),
    ("10", "cosines of 0 and 1e-7"),
    ("11", "random numbers 0 and next to 1"),
    ("12", "densities whose squares overflow"),
    ("13", "functions outside of their domain"),
    ("14", "normals and tangents that are none"),
    ("15", "frame around (0, 0, -1)"),
    ("16", "shading normal behind the view"),
    ("17", "bumped normals: eval as sample"),
    ("18", "triangles without area"),
    ("19", "scenes scaled and moved"),
    ("20", "tiny, skinny and distant lights"),
    ("21", "noise at large coordinates"),
    ("22", "poles of environments, black lights"),
    ("23", "many samples and dimensions"),
    ("24", "seeds 0 and powers of two"),
    ("25", "roulette"),
    ("26", "white furnaces at roughness 1"),
    ("27", "weights of exactly 0 and 1"),
    ("28", "a sun beside a dim sky"),
    ("29", "a closed white box"),
    ("30", "deep nests of layers, many lobes"),
    ("31", "long loops"),
    ("32", "camera inside of glass, nested media"),
    ("chi-squared", "samples follow the density (least p)"),
    ("density", "integral of the density"),
    ("energy", "energy and albedo"),
    ("weight", "value over density"),
    ("furnace", "white furnaces"),
    ("reciprocity", "directions exchanged"),
    ("precision", "single precision against double"),
    ("finite", "answers are finite and not negative"),
];

/// The page.
pub(super) fn page(rows: &[Row], ended: &[Ended], command: &str, machine: Option<&str>) -> String {
    let mut text = head(ended, command, machine);
    topics(&mut text, rows);
    for table in [
        "precision",
        "energy",
        "furnace",
        "weight",
        "chi-squared",
        "reciprocity",
    ] {
        subjects(&mut text, rows, table);
    }
    bad(&mut text, rows);
    text
}

fn head(ended: &[Ended], command: &str, on: Option<&str>) -> String {
    let on = on.map_or_else(machine, str::to_owned);
    let mut text =
        format!("# Numerical stability\n\nWritten by `{command}` on {on}.\n\n{INTRODUCTION}\n");
    if ended.is_empty() {
        return text;
    }
    text += "| tests | seconds | all passed |\n|---|---|---|\n";
    for e in ended {
        let passed = if e.failed { "**no**" } else { "yes" };
        let _ = writeln!(
            text,
            "| {} | {:.0} | {passed} |",
            e.name,
            e.took.as_secs_f64()
        );
    }
    text
}

const INTRODUCTION: &str = "\
A test measured every number here, and fails if the number is beyond its bound. The tests walk the
BSDFs of `stdlib/bsdf` and the materials of `materials/` from their folders. The reference is the
interpreter of the compiler's IR in double precision. Errors are relative to the value, or to a
ten-thousandth of the light where less is reflected.

Bounds come from the doc comment of each BSDF:

- `Region:` where single precision is off by more than 1e-4, and by how much;
- `Furnace:` what a white surface keeps;
- `Albedo:` how near the albedo is to the integral;
- `Weights:` the greatest value over density (4 where nothing is said).

Cases that a search once found to fail are lines of `compiler/tests/stdlib/regressions/`.

Each row is the worst of many cases, and says for which it was measured. A verdict is good where the
worst keeps to its bound. Rows with a number test what the second column names. The others mean:

- `chi-squared`: the least probability of counts as uneven as those that sampling gave, over cells
  of directions whose shares are integrals of `pdf`. Right sampling stays above the bound, which is
  0.01 shared among all cases of a BSDF or material, in 99 of 100 runs.
- `density`, `energy`: integrals of `pdf` and of what is reflected, over all directions; `energy`
  also compares them with what sampling gives and with `albedo`.
- `weight`: the greatest value over density, which is how bright a single sample can be.
- `furnace`: what is left of light 1 from everywhere on a surface that absorbs nothing.
- `reciprocity`: the value with the directions exchanged, in double precision.
- `precision`: single against double precision at the same numbers. The error of a BSDF is the
  greatest that a search finds. Of a material, it is the share of directions whose error is above
  1e-3 and above what the last digits of the point and of `wo` change in double precision. Of an
  example scene, it is the share of paths that meet another triangle, end elsewhere, or have a number
  that differs by more than 1e-3; scenes whose triangles are hardly larger than the last digits of
  their coordinates may have as many as the same paths of a camera that stands one such digit aside.
- `finite`: answers that are not finite, or negative.
";

/// Processor and system, without names of anybody's machine.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info
        .lines()
        .find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    let model = model.map_or("a processor that has no name here", |(_, name)| name);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let version = shell::capture(
        std::process::Command::new("git")
            .current_dir(shell::root())
            .args(["rev-parse", "--short", "HEAD"]),
    );
    let version = version.map(|v| format!(", commit {v}")).unwrap_or_default();
    format!("{model} ({cores} cores), {}{version}", std::env::consts::OS)
}

/// A row for each row of the table of extremes, with the worst over all that it was tested on.
fn topics(text: &mut String, rows: &[Row]) {
    *text += "\n## What was tested\n\n";
    *text += "| row | input | tested on | worst | bound | of | verdict |\n|---|---|---|---|---|---|---|\n";
    for (table, title) in TOPICS {
        let of: Vec<&Row> = rows.iter().filter(|r| r.table == table).collect();
        let Some(worst) = of
            .iter()
            .max_by(|a, b| a.nearness().total_cmp(&b.nearness()))
        else {
            continue;
        };
        let mut subjects: Vec<&str> = of.iter().map(|r| r.subject.as_str()).collect();
        subjects.dedup();
        let verdict = verdict(of.iter().all(|r| r.good));
        let _ = writeln!(
            text,
            "| {table} | {title} | {} | {} | {} {} | {}: {} | {verdict} |",
            subjects.len(),
            number(worst.worst),
            worst
                .sign
                .replace("<=", "at most")
                .replace(">=", "at least"),
            number(worst.bound),
            worst.subject,
            cell(&worst.what),
        );
    }
}

/// A table of one kind of test, a row for each BSDF or material, a column for what was measured.
fn subjects(text: &mut String, rows: &[Row], table: &str) {
    let of = rows.iter().filter(|r| r.table == table);
    let mut by_subject: BTreeMap<&str, BTreeMap<&str, &Row>> = BTreeMap::new();
    for row in of {
        by_subject
            .entry(&row.subject)
            .or_default()
            .insert(&row.what, row);
    }
    if by_subject.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## {}\n", title(table));
    *text += "| of | what | worst | bound | where | verdict |\n|---|---|---|---|---|---|\n";
    for (subject, measured) in by_subject {
        for (what, row) in measured {
            let _ = writeln!(
                text,
                "| {subject} | {} | {} | {} | {} | {} |",
                cell(what),
                number(row.worst),
                number(row.bound),
                shortened(&row.place),
                verdict(row.good),
            );
        }
    }
}

fn bad(text: &mut String, rows: &[Row]) {
    let bad: Vec<&Row> = rows.iter().filter(|r| !r.good).collect();
    if bad.is_empty() {
        *text += "\nNo verdict is bad.\n";
        return;
    }
    *text += "\n## Bad verdicts\n\n";
    for r in bad {
        let _ = writeln!(
            text,
            "- row {}, {}: {} {} instead of {} {}, at `{}`",
            r.table,
            r.subject,
            r.what,
            number(r.worst),
            r.sign,
            number(r.bound),
            r.place
        );
    }
}

fn title(table: &str) -> &'static str {
    let topic = TOPICS.iter().find(|(name, _)| *name == table);
    topic.map_or("", |(_, title)| title)
}

fn verdict(good: bool) -> &'static str {
    if good { "good" } else { "**bad**" }
}

fn cell(text: &str) -> String {
    text.replace('|', "/")
}

/// Three digits, in powers of ten where that is shorter.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        a if (1e-3..1e4).contains(&a) => {
            let text = format!("{x:.4}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => format!("{x:.1e}"),
    }
}

/// A place in code quotes, numbers in it cut to four digits: the whole is in the test's output.
fn shortened(place: &str) -> String {
    let mut out = String::new();
    let mut digits = 0;
    let mut fraction = false;
    for c in place.chars() {
        match c {
            '.' => (fraction, digits) = (true, 0),
            c if c.is_ascii_digit() => digits += 1,
            _ => fraction = false,
        }
        if !(fraction && c.is_ascii_digit() && digits > 4) {
            out.push(c);
        }
    }
    if out.is_empty() {
        out
    } else {
        format!("`{}`", out.replace('|', "/"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_tells_the_worst_and_what_is_bad() {
        let row = |table: &str, subject: &str, worst: f64, good: bool| Row {
            table: table.to_owned(),
            subject: subject.to_owned(),
            what: "relative error".to_owned(),
            worst,
            sign: "<=".to_owned(),
            bound: 1e-4,
            good,
            place: "metal(roughness: 0.1234567890) | 1e0".to_owned(),
        };
        let rows = [
            row("6", "glass", 1e-7, true),
            row("precision", "glass", 9e-5, true),
            row("precision", "metal", 2e-4, false),
        ];
        let text = page(&rows, &[], "cargo experiments stress --fast --no-gpu", None);
        assert!(
            text.contains("`cargo experiments stress --fast --no-gpu`"),
            "{text}"
        );
        assert!(
            text.contains("| 6 | ior next to 1 | 1 | 1.0e-7 | at most 1.0e-4 |"),
            "{text}"
        );
        assert!(text.contains("| metal | relative error | 2.0e-4 | 1.0e-4 | `metal(roughness: 0.1234) / 1e0` | **bad** |"), "{text}");
        assert!(text.contains("## Bad verdicts"), "{text}");
        assert!(page(&rows[..2], &[], "", Some("there")).contains("No verdict is bad."));
    }
}
