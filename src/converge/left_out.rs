//! What a limit on time left out of a series, in words.

use super::data::Series;
use crate::runtime::technique::Choice;

/// `3 of 4 renders of 4 samples, and all of 16 and 64 samples`, and why; none of a series that has all renders.
pub fn text(series: &Series) -> Option<String> {
    let first = series.left_out.first()?;
    let there = |samples: u32| {
        let point = series.points.iter().find(|p| p.samples == samples);
        point.map_or(0, |point| point.runs.len())
    };
    let mut parts = Vec::new();
    let mut whole = Vec::new();
    for left in &series.left_out {
        match (there(left.samples), left.seeds.len()) {
            (0, _) => whole.push(left.samples.to_string()),
            (made, left_out) => parts.push(format!(
                "{left_out} of {} renders of {}",
                made + left_out,
                samples(left.samples)
            )),
        }
    }
    if !whole.is_empty() {
        parts.push(format!("all renders of {} samples", list(&whole)));
    }
    // Of a series whose renders were all kept from an earlier run, nothing is known.
    let needed = match first.seconds {
        0.0 => String::new(),
        seconds => format!(
            "one of {} takes about {seconds:.1} s, and ",
            samples(first.samples)
        ),
    };
    Some(format!(
        "no time was left for {}: {needed}{:.1} s of the time limit were left for the renders of `{}` with \
         `{}`, after {:.1} s of compiling",
        parts.join(" and "),
        first.seconds_left,
        series.strategy,
        series.sampler.name(),
        series.compile_seconds,
    ))
}

fn samples(number: u32) -> String {
    format!("{number} sample{}", if number == 1 { "" } else { "s" })
}

/// `4, 16 and 64`.
fn list(names: &[String]) -> String {
    match names {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        names => names.join(""),
    }
}

#[cfg(test)]
mod tests {
    use super::super::data::{Errors, LeftOut, Point, Run};
    use super::*;
    use crate::runtime::technique::Sampler;

    fn series(made: &[(u32, u32)], left: &[(u32, u32)]) -> Series {
        let run = |seed| Run {
            seed,
            gpu_seconds: 1.0,
            errors: Errors::default(),
            dropped: 0,
        };
        Series {
            strategy: "own".into(),
            sampler: Sampler::Owen,
            compile_seconds: 28.0,
            points: made
                .iter()
                .map(|(samples, runs)| Point {
                    samples: *samples,
                    runs: (0..*runs).map(run).collect(),
                })
                .collect(),
            fits: Default::default(),
            left_out: left
                .iter()
                .map(|(samples, runs)| LeftOut {
                    samples: *samples,
                    seeds: (0..*runs).collect(),
                    seconds: 2.5,
                    seconds_left: 0.125,
                })
                .collect(),
        }
    }

    #[test]
    fn what_is_left_out_is_said_with_its_reason() {
        assert_eq!(text(&series(&[(1, 4), (4, 4)], &[])), None);
        let why = "takes about 2.5 s, and 0.1 s of the time limit were left for the renders of `own` with \
                   `owen`, after 28.0 s of compiling";
        assert_eq!(
            text(&series(&[(1, 1)], &[(1, 3), (4, 4), (16, 4), (64, 4)])),
            Some(format!(
                "no time was left for 3 of 4 renders of 1 sample and all renders of 4, 16 and 64 samples: \
                 one of 1 sample {why}"
            ))
        );
        assert_eq!(
            text(&series(&[(1, 4)], &[(4, 4)])),
            Some(format!(
                "no time was left for all renders of 4 samples: one of 4 samples {why}"
            ))
        );
    }
}
