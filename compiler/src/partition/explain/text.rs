//! An explanation for people. Numbers have three digits, so that what differs by rounding reads the
//! same.

use std::fmt;

use super::{Alternative, Explanation, Kernel, Member, OtherPlan};
use crate::partition::Form;

/// Kernels, materials and names that are listed before the rest is only counted.
const LISTED: usize = 24;

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.head(f)?;
        let shown = self.kernels.iter().take(LISTED);
        for kernel in shown {
            writeln!(f)?;
            write_kernel(f, kernel)?;
        }
        if self.kernels.len() > LISTED {
            writeln!(f, "\n{} more kernels", self.kernels.len() - LISTED)?;
        }
        self.not_hit(f)?;
        writeln!(f, "\nother plans, by the same model:")?;
        for other in &self.strategies {
            self.other(f, other)?;
        }
        writeln!(f, "\nthis estimate does not know")?;
        self.unknown
            .iter()
            .try_for_each(|what| writeln!(f, "  - {what}"))
    }
}

impl Explanation {
    fn head(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inline = self.kernels.iter().any(|k| k.form == Form::Inline);
        let kernels = match (self.kernels.len() - usize::from(inline), inline) {
            (0, true) => "no material kernel, all is inline".to_owned(),
            (n, inline) => format!(
                "{n} material {}{}",
                if n == 1 { "kernel" } else { "kernels" },
                if inline { " and inline materials" } else { "" }
            ),
        };
        writeln!(f, "plan `{}`: {kernels}", self.strategy)?;
        writeln!(f, "partition: {}", self.partition)?;
        let profile = if self.exact {
            ""
        } else {
            " (scaled from another device's)"
        };
        writeln!(f, "profile: {}{profile}", self.device)?;
        let paths = grouped(self.pool.into());
        write!(
            f,
            "predicted: {} an iteration of {paths} paths",
            time(self.seconds)
        )?;
        if self.other_seconds > 0.0 {
            writeln!(
                f,
                ", beside {} for all else where hits were counted",
                time(self.other_seconds)
            )
        } else {
            writeln!(f)
        }
    }

    /// Materials without hits or surfaces.
    fn not_hit(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.unused.is_empty() {
            writeln!(f, "\nno surface uses {}: no kernel", names(&self.unused))?;
        }
        if !self.never_hit.is_empty() {
            let names = names(&self.never_hit);
            writeln!(f, "\nno path has hit {names} yet: counted as free")?;
        }
        Ok(())
    }

    fn other(&self, f: &mut fmt::Formatter<'_>, other: &OtherPlan) -> fmt::Result {
        let OtherPlan {
            strategy,
            seconds,
            times,
            ..
        } = other;
        let same = if other.partition == self.partition {
            ", the same"
        } else {
            ""
        };
        write!(f, "  {strategy:<10} {:>10}", time(*seconds))?;
        match times {
            Some(times) => writeln!(f, "  {times:.2} times{same}"),
            None => writeln!(f, "{same}"),
        }
    }
}

fn write_kernel(f: &mut fmt::Formatter<'_>, kernel: &Kernel) -> fmt::Result {
    let p = &kernel.predicted;
    let what = match kernel.form {
        Form::Inline => "inline, in the logic kernel".to_owned(),
        form => format!("`{}`, {}", kernel.name, form.name()),
    };
    let share = 100.0 * kernel.share;
    writeln!(
        f,
        "{what}: {}, {share:.0} % of the materials' time",
        time(p.total)
    )?;
    let parts = [
        ("launch", p.launch),
        ("latency", p.latency),
        ("issue", p.issue),
        ("memory", p.memory),
        ("logic", p.logic),
    ];
    let parts = parts.iter().filter(|(_, seconds)| *seconds > 0.0);
    let parts: Vec<String> = parts
        .map(|(name, s)| format!("{name} {}", time(*s)))
        .collect();
    if !parts.is_empty() {
        writeln!(f, "  {}", parts.join(", "))?;
    }
    if kernel.diverges >= 1.05 {
        writeln!(f, "  subgroups diverge {:.1} ways", kernel.diverges)?;
    }
    let width = kernel
        .members
        .iter()
        .map(|m| m.material.chars().count())
        .max();
    for member in kernel.members.iter().take(LISTED) {
        write_member(f, member, width.unwrap_or(0))?;
    }
    if kernel.members.len() > LISTED {
        writeln!(f, "    {} more", kernel.members.len() - LISTED)?;
    }
    match &kernel.alternative {
        Some(alternative) => write_alternative(f, alternative),
        None => Ok(()),
    }
}

fn write_member(f: &mut fmt::Formatter<'_>, member: &Member, width: usize) -> fmt::Result {
    let Member {
        material,
        share,
        run,
        operations,
        efficiency,
    } = member;
    write!(
        f,
        "    {material:<width$}  {:>5.1} % of slots",
        100.0 * share
    )?;
    if *share > 0.0 {
        write!(f, ", {run:>4.1} neighbours together")?;
    }
    match (operations, efficiency) {
        (Some(operations), Some(efficiency)) => writeln!(
            f,
            ", {} operations, {:.0} % of lanes at work",
            grouped(three_digits(*operations)),
            100.0 * efficiency
        ),
        _ => writeln!(f, ", cost not known"),
    }
}

fn write_alternative(f: &mut fmt::Formatter<'_>, other: &Alternative) -> fmt::Result {
    let Alternative {
        what,
        more,
        part,
        part_more,
        why,
        ..
    } = other;
    let verdict = if *more < 0.0 {
        "would be faster"
    } else {
        "best other way"
    };
    writeln!(f, "  {verdict}: {what}: {}", signed(*more))?;
    writeln!(f, "    {part} {}: {why}", signed(*part_more))
}

fn signed(seconds: f64) -> String {
    if seconds < 0.0 {
        format!("-{}", time(-seconds))
    } else {
        format!("+{}", time(seconds))
    }
}

/// Seconds with a unit and three digits.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s >= 0.9995 => (s, "s"),
        s if s >= 0.9995e-3 => (s * 1e3, "ms"),
        s => (s * 1e6, "us"),
    };
    match value {
        v if v >= 99.95 => format!("{v:.0} {unit}"),
        v if v >= 9.995 => format!("{v:.1} {unit}"),
        v if v >= 0.0005 => format!("{v:.2} {unit}"),
        _ => format!("0 {unit}"),
    }
}

/// A count, rounded to three digits.
fn three_digits(count: f64) -> u64 {
    let unit = 10f64.powi((count.max(1.0).log10().floor() as i32 - 2).max(0));
    ((count / unit).round() * unit) as u64
}

/// `1,048,576`.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

fn names(names: &[String]) -> String {
    super::super::error::list(names.iter().map(String::as_str))
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_kernel(f, self)
    }
}
