//! `impasto cost --diff OLD NEW`: what an edit did to the cost of each material.

use std::fmt::Write;

use impasto::compiler::cost::{Cost, Walks};
use impasto::cost::{Change, Difference, LineChange, MaterialCost, difference};
use serde_json::json;

use super::table::{percent, shortened};
use super::{CostArgs, Failure, Global, Outcome, complete, one_source, print};

pub fn run(args: &CostArgs, global: &Global) -> Outcome {
    let [old, new] = args.files.as_slice() else {
        let message = format!(
            "`--diff` compares two files or two scenes, the old and the new, and {} {} given\n\
             hint: `impasto cost --diff OLD NEW`",
            args.files.len(),
            if args.files.len() == 1 { "is" } else { "are" },
        );
        return Err(Failure::Error(message));
    };
    let before = one_source(old, args.effort(), global)?;
    let after = one_source(new, args.effort(), global)?;
    let found = difference(&before, &after);
    if found.materials.is_empty() {
        return Err(Failure::Error(nothing_in_common(old, &before, new, &after)));
    }
    if global.json() {
        print(&format!("{:#}\n", json(args, &found)))?;
    } else {
        print(&text(args, old, new, &found))?;
    }
    complete(&before, global).and(complete(&after, global))
}

fn nothing_in_common(
    old: &str,
    before: &[MaterialCost],
    new: &str,
    after: &[MaterialCost],
) -> String {
    let names = |all: &[MaterialCost]| {
        let names: Vec<String> = all
            .iter()
            .take(8)
            .map(|m| format!("`{}`", m.name))
            .collect();
        let more = if all.len() > names.len() { ", ..." } else { "" };
        names.join(", ") + more
    };
    format!(
        "`{old}` and `{new}` have no material in common\n\
         expected: materials of one name in both; `{old}` has {}, `{new}` has {}",
        names(before),
        names(after)
    )
}

fn json(args: &CostArgs, found: &Difference) -> serde_json::Value {
    let efficiency = |cost: &Option<Cost>| cost.as_ref().map(Cost::efficiency);
    let material = |m: &Change| {
        json!({
            "name": m.name,
            "same": m.same,
            "old": m.old,
            "new": m.new,
            "old_walks": m.old_walks,
            "new_walks": m.new_walks,
            "old_efficiency": efficiency(&m.old),
            "new_efficiency": efficiency(&m.new),
            "lines": m.lines,
        })
    };
    json!({
        "old": args.files[0],
        "new": args.files[1],
        "samples": args.samples,
        "materials": found.materials.iter().map(material).collect::<Vec<_>>(),
        "only_old": found.only_old,
        "only_new": found.only_new,
    })
}

// ---- Text --------------------------------------------------------------------------------

fn text(args: &CostArgs, old: &str, new: &str, found: &Difference) -> String {
    let samples = args.samples;
    let mut out =
        format!("from {old}\nto   {new}\noperations of one evaluation, at {samples} points\n");
    let (same, changed): (Vec<&Change>, Vec<&Change>) =
        found.materials.iter().partition(|m| m.same);
    changed.iter().for_each(|m| material(&mut out, args, m));
    if !same.is_empty() {
        let names: Vec<&str> = same.iter().map(|m| m.name.as_str()).collect();
        let _ = writeln!(out, "\nno difference: {}", names.join(", "));
    }
    for (file, only) in [(old, &found.only_old), (new, &found.only_new)] {
        if !only.is_empty() {
            let _ = writeln!(out, "\nonly in {file}: {}", only.join(", "));
        }
    }
    out
}

fn material(out: &mut String, args: &CostArgs, m: &Change) {
    let (Some(old), Some(new)) = (&m.old, &m.new) else {
        let on = |cost: &Option<Cost>| match cost {
            Some(cost) => format!("{:.0} operations", cost.operations.mean),
            None => "on no surface".to_owned(),
        };
        let _ = writeln!(out, "\n{}: was {}, is {}", m.name, on(&m.old), on(&m.new));
        return;
    };
    let _ = writeln!(
        out,
        "\n{:22} {:>9} {:>9} {:>9}",
        m.name, "old", "new", "change"
    );
    row(out, "operations", old.operations.mean, new.operations.mean);
    let (a, b) = (&old.operations.classes, &new.operations.classes);
    let rows = [
        ("  float", a.alu, b.alu),
        ("  special", a.special, b.special),
        ("  integer", a.integer, b.integer),
        ("  texture", a.texture, b.texture),
        ("  turns", a.turns, b.turns),
        ("numbers alive", f64::from(old.live), f64::from(new.live)),
        ("code", f64::from(old.code), f64::from(new.code)),
        ("loops", f64::from(old.loops), f64::from(new.loops)),
        ("bytes read", old.bytes, new.bytes),
        (
            "walks in 100",
            100.0 * share(&m.old_walks),
            100.0 * share(&m.new_walks),
        ),
        ("ray casts a walk", casts(&m.old_walks), casts(&m.new_walks)),
    ];
    for (what, old, new) in rows.into_iter().filter(|(_, old, new)| shows(*old, *new)) {
        row(out, what, old, new);
    }
    let change = 100.0 * (new.efficiency() - old.efficiency());
    let _ = writeln!(
        out,
        "  {:20} {:>9} {:>9} {change:>+9.1}",
        "SIMT efficiency",
        percent(old),
        percent(new)
    );
    let shown = m.lines.iter().filter(|l| shows(l.old, l.new));
    lines(out, &shown.take(args.lines).collect::<Vec<_>>());
}

fn share(walks: &Option<Walks>) -> f64 {
    walks.map_or(0.0, |w| w.share)
}

fn casts(walks: &Option<Walks>) -> f64 {
    walks.map_or(0.0, |w| w.casts)
}

/// Is a change large enough for a number with one decimal?
fn shows(old: f64, new: f64) -> bool {
    (new - old).abs() >= 0.05
}

fn row(out: &mut String, what: &str, old: f64, new: f64) {
    let change = new - old;
    let _ = write!(out, "  {what:20} {old:>9.0} {new:>9.0} {change:>+9.1}");
    let _ = if old > 0.0 {
        writeln!(out, "  {:>+6.1} %", 100.0 * change / old)
    } else {
        writeln!(out)
    };
}

/// Lines of the source: `+` were not there before or cost nothing, `-` are not there now.
fn lines(out: &mut String, lines: &[&LineChange]) {
    let texts = lines.iter().map(|l| shortened(&l.text).chars().count());
    let texts = texts.max().unwrap_or(0);
    for line in lines {
        let mark = match (line.old_line, line.new_line) {
            (None, _) => '+',
            (_, None) => '-',
            _ => ' ',
        };
        let _ = writeln!(
            out,
            "  {mark} {:>4}  {:texts$} {:>9.0} {:>9.0} {:>+9.1}",
            line.new_line.or(line.old_line).unwrap_or(0),
            shortened(&line.text),
            line.old,
            line.new,
            line.change(),
        );
    }
}
