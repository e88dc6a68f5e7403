//! What a fit came to, for people to read.

use std::fmt::Write;

use super::constants::{constant, named};
use super::errors::Errors;
use super::fit::{Fitted, Residual};

/// How many of the kernels that fit worst are listed, unless all are wanted.
const WORST: usize = 20;

/// The text of `impasto calibrate`; with `all`, every kernel is listed.
pub fn text(fitted: &Fitted, all: bool) -> String {
    let mut out = format!("{} ({})\n\n", fitted.profile.device, fitted.profile.driver);
    out += &kernels(&fitted.residuals, all);
    out += "\n";
    out += &table("errors", &fitted.forms);
    out += &rows(std::slice::from_ref(&fitted.held_out));
    out += &rows(std::slice::from_ref(&fitted.before));
    out += "\n";
    out += &table("scene", &fitted.scenes);
    out += "\n";
    out += &constants(fitted);
    if let Some(r) = &fitted.registers {
        let _ = writeln!(
            out,
            "\nregisters = {:.1} + {:.3} x live numbers, off by {:.1}, rank correlation {:.3} ({} kernels)",
            r.base, r.slope, r.residual, r.rank_correlation, r.kernels
        );
    }
    out
}

/// Kernels, those that fit worst first.
fn kernels(residuals: &[Residual], all: bool) -> String {
    let mut sorted: Vec<&Residual> = residuals.iter().collect();
    let off = |r: &Residual| r.ratio.ln().abs();
    sorted.sort_by(|a, b| off(b).total_cmp(&off(a)));
    let shown = if all {
        sorted.len()
    } else {
        WORST.min(sorted.len())
    };
    let mut out = format!(
        "{:>12} {:>12} {:>7}  kernel ({shown} of {}, those that fit worst first)\n",
        "predicted",
        "measured",
        "ratio",
        sorted.len()
    );
    for r in &sorted[..shown] {
        let _ = writeln!(
            out,
            "{:>12} {:>12} {:>7.2}  {}:{} in {} ({} paths)",
            microseconds(r.predicted),
            microseconds(r.measured),
            r.ratio,
            r.form.name(),
            r.members.join(","),
            r.scene,
            r.pool,
        );
    }
    out
}

fn microseconds(seconds: f64) -> String {
    format!("{:.2} us", 1e6 * seconds)
}

fn table(what: &str, errors: &[Errors]) -> String {
    let head = format!(
        "{what:<32} {:>8} {:>8} {:>10} {:>8} {:>8}\n",
        "kernels", "median", "1 in 10", "bias", "rank"
    );
    head + &rows(errors)
}

fn rows(errors: &[Errors]) -> String {
    let row = |e: &Errors| {
        let of: String = e.of.chars().take(32).collect();
        format!(
            "{of:<32} {:>8} {:>6.1} % {:>8.1} % {:>8.3} {:>8.4}\n",
            e.kernels,
            100.0 * e.median,
            100.0 * e.tenth,
            e.bias,
            e.rank_correlation,
        )
    };
    errors.iter().map(row).collect()
}

fn constants(fitted: &Fitted) -> String {
    let mut out = String::new();
    for (name, value) in named(&fitted.profile.weights) {
        let constant = constant(&name);
        let [least, most] = constant.bounds;
        let mark = match value {
            v if v <= least * 1.001 => ", as low as it can be",
            v if v >= most * 0.999 => ", as high as it can be",
            _ => "",
        };
        let _ = writeln!(out, "{name:<16} {value:>11.4e}  {}{mark}", constant.meaning);
    }
    out
}
