//! The text of `impasto trace`: a block of rows for each vertex, with a column a precision.

use std::fmt::Write;

use impasto_trace::{Light, Path, Triple, Vertex};

use super::Replay;

/// What is said of a number that is no light.
const NOT_FINITE: &str = "not finite";
const NEGATIVE: &str = "below zero";

/// A line: what it is, and a value.
struct Row {
    name: &'static str,
    value: String,
    /// What is wrong with it.
    wrong: Option<&'static str>,
}

fn row(name: &'static str, value: String) -> Row {
    Row {
        name,
        value,
        wrong: None,
    }
}

/// A row of numbers, of which any may be no number.
fn plain(name: &'static str, numbers: &[f64]) -> Row {
    let infinite = numbers.iter().any(|x| !x.is_finite());
    Row {
        wrong: infinite.then_some(NOT_FINITE),
        ..row(name, vector(numbers))
    }
}

/// A row of numbers that must not be below zero either.
fn light(name: &'static str, numbers: &[f64]) -> Row {
    let row = plain(name, numbers);
    let negative = numbers.iter().any(|x| *x < 0.0);
    Row {
        wrong: row.wrong.or(negative.then_some(NEGATIVE)),
        ..row
    }
}

/// A replay for people.
pub fn text(replay: &Replay) -> String {
    let paths: Vec<&Path> = [&replay.double, &replay.single]
        .into_iter()
        .flatten()
        .collect();
    let Some(first) = paths.first() else {
        return String::new();
    };
    let [x, y] = first.pixel;
    let precisions: Vec<String> = paths.iter().map(|p| format!("f{}", p.precision)).collect();
    let mut out = format!(
        "pixel {x},{y}, sample {}, seed {}, in {}\n",
        first.sample,
        first.seed,
        precisions.join(" and ")
    );
    block(
        &mut out,
        "camera",
        &columns(&paths, |path| Some(camera(path))),
        &precisions,
    );
    let longest = paths.iter().map(|p| p.vertices.len()).max().unwrap_or(0);
    for at in 0..longest {
        let vertex = |path: &Path| path.vertices.get(at).map(rows);
        let parts = replay.parting.filter(|p| p.vertex as usize == at + 1);
        let mut title = format!("vertex {}", at + 1);
        if let Some(parting) = parts {
            let _ = write!(title, "  <- f64 and f32 part here, by {}", parting.what);
            if parting.relative.is_finite() {
                let _ = write!(title, " ({:.1e} of it)", parting.relative);
            }
        }
        block(&mut out, &title, &columns(&paths, vertex), &precisions);
    }
    block(
        &mut out,
        "end",
        &columns(&paths, |path| Some(end(path))),
        &precisions,
    );
    out
}

fn columns(paths: &[&Path], rows: impl Fn(&Path) -> Option<Vec<Row>>) -> Vec<Vec<Row>> {
    paths
        .iter()
        .map(|path| rows(path).unwrap_or_default())
        .collect()
}

/// Rows of the same name side by side. A row that one column lacks is empty there.
fn block(out: &mut String, title: &str, columns: &[Vec<Row>], precisions: &[String]) {
    let _ = writeln!(out, "\n{title}");
    let mut names: Vec<&str> = Vec::new();
    for row in columns.iter().flatten() {
        if !names.contains(&row.name) {
            names.push(row.name);
        }
    }
    let find = |column: &'_ [Row], name: &str| column.iter().position(|row| row.name == name);
    let width = |column: &Vec<Row>| {
        let values = column.iter().map(|row| row.value.chars().count());
        values.max().unwrap_or(0)
    };
    let widths: Vec<usize> = columns.iter().map(width).collect();
    for name in names {
        let mut line = format!("  {name:<17}");
        let mut wrong = Vec::new();
        for ((column, width), precision) in columns.iter().zip(&widths).zip(precisions) {
            let row = find(column, name).map(|at| &column[at]);
            let value = row.map_or("", |row| &row.value);
            let _ = write!(line, "  {value:<width$}");
            if let Some(what) = row.and_then(|row| row.wrong) {
                wrong.push(match columns.len() {
                    1 => what.to_owned(),
                    _ => format!("{what} in {precision}"),
                });
            }
        }
        let _ = write!(out, "{}", line.trim_end());
        if !wrong.is_empty() {
            let _ = write!(out, "  ! {}", wrong.join(", "));
        }
        out.push('\n');
    }
}

fn camera(path: &Path) -> Vec<Row> {
    let [origin, direction] = &path.camera;
    vec![plain("from", origin), plain("toward", direction)]
}

fn end(path: &Path) -> Vec<Row> {
    let mut rows = vec![
        row("because", path.end.text().to_owned()),
        light("radiance", &path.radiance),
    ];
    if path.left_out {
        rows.push(row(
            "added to film",
            "nothing: it is no light, and counted as left out".into(),
        ));
    }
    rows
}

fn rows(vertex: &Vertex) -> Vec<Row> {
    let mut out = Vec::new();
    match &vertex.hit {
        None => out.push(row("hit", "nothing".into())),
        Some(hit) => {
            let side = match hit.front {
                Some(true) => ", front",
                Some(false) => ", back",
                None => "",
            };
            let on = match (&hit.instance, &hit.material) {
                (Some(instance), Some(material)) if instance == material => instance.clone(),
                (Some(instance), Some(material)) => format!("{instance} ({material})"),
                _ => "a light".to_owned(),
            };
            out.push(row(
                "hit",
                format!("{on}, triangle {}{side}", hit.primitive),
            ));
            out.push(plain("position", &hit.position));
            out.push(plain("distance", &[hit.distance]));
        }
    }
    out.push(plain("wo", &vertex.wo));
    if vertex.media.iter().any(|m| *m != 0) {
        let media = vertex.media.iter().filter(|m| **m != 0);
        let media: Vec<String> = media.map(|m| (m & 0xffff).to_string()).collect();
        out.push(row("in media", media.join(" in ")));
    }
    out.push(light("arriving", &vertex.arriving));
    if let Some(emission) = &vertex.emission {
        out.push(light("emission", &emission.radiance));
        out.push(plain("  MIS weight", &[emission.weight]));
        out.push(light("  added", &emission.added));
    }
    if let Some(light) = &vertex.light {
        light_rows(light, &mut out);
    }
    if let Some(roulette) = &vertex.roulette {
        let fate = if roulette.survived {
            "went on"
        } else {
            "ended"
        };
        let probability = number(roulette.probability);
        out.push(row(
            "roulette",
            format!("{fate}, chance to go on {probability}"),
        ));
    }
    if let Some(sample) = &vertex.scattering {
        let crosses = if sample.transmitted {
            ", into another medium"
        } else {
            ""
        };
        out.push(plain("u", &sample.u));
        let wi = plain("wi", &sample.wi);
        out.push(Row {
            value: wi.value + crosses,
            ..wi
        });
        out.push(light("pdf", &[sample.pdf]));
        out.push(light("weight", &sample.weight));
        out.push(light("throughput", &vertex.throughput));
    }
    out.push(light("radiance so far", &vertex.radiance));
    if let Some(value) = vertex.dropped {
        out.push(row("left out", format!("its {value} is no light")));
    }
    out
}

fn light_rows(sample: &Light, out: &mut Vec<Row>) {
    if sample.radiance == Triple::default() {
        out.push(row("light", "none is seen from here".into()));
        return;
    }
    out.push(row("light", sample.kind.to_owned()));
    out.push(plain("  wi", &sample.wi));
    out.push(if sample.distance < 1e30 {
        plain("  distance", &[sample.distance])
    } else {
        row("  distance", "infinite".into())
    });
    out.push(light("  radiance / pdf", &sample.radiance));
    out.push(if sample.pdf > 0.0 {
        light("  pdf", &[sample.pdf])
    } else {
        row("  pdf", "discrete".into())
    });
    out.push(light("  reflected", &sample.throughput));
    out.push(light("  bsdf pdf", &[sample.bsdf_pdf]));
    out.push(plain("  MIS weight", &[sample.weight]));
    let seen = match sample.blocked {
        Some(true) => "blocked",
        Some(false) => "free",
        None => "not cast",
    };
    out.push(row("  shadow ray", seen.into()));
    out.push(light("  light added", &sample.added));
}

fn vector(numbers: &[f64]) -> String {
    match numbers {
        [one] => number(*one),
        _ => {
            let all: Vec<String> = numbers.iter().map(|x| number(*x)).collect();
            format!("({})", all.join(", "))
        }
    }
}

/// Six digits.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{x:.5e}");
    }
    let before = size.log10().floor() as i32;
    let digits = (5 - before).clamp(0, 9) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        for (x, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-0.125, "-0.125"),
            (1234.5678, "1234.57"),
            (0.000123456789, "0.000123457"),
            (1e-9, "1.00000e-9"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn what_is_wrong_is_marked() {
        assert_eq!(light("x", &[0.0, -1.0]).wrong, Some(NEGATIVE));
        assert_eq!(light("x", &[-1.0, f64::NAN]).wrong, Some(NOT_FINITE));
        assert_eq!(plain("x", &[-1.0]).wrong, None);
    }
}
