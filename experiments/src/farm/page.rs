//! docs/farm-scale.md: tables of what the simulation says, and what follows from them.

use std::fmt::Write as _;

use xtask::shell::Result;

use super::inputs::{self, FILMS, Film, SIZES, farm};
use super::plot::{Line, lines};
use super::sim::{Farm, Job, Outcome, run};

/// Minutes of tasks that are tried, and those of the other tables.
const MINUTES: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 40.0];
const USUAL: f64 = 5.0;
/// Minutes that a job takes every GPU.
const HOUR: f64 = 60.0;
/// The farm of a thousand.
const THOUSAND: (usize, f64) = SIZES[2];
/// Films and seconds between checkpoints that are tried on farms of all sizes.
const KINDS: [Film; 3] = [
    FILMS[0],
    FILMS[1],
    Film {
        every: 300.0,
        ..FILMS[1]
    },
];
/// Most films of one merge, and the films of a picture.
const FAN_INS: [usize; 5] = [usize::MAX, 64, 32, 16, 8];
const PARTS: [usize; 5] = [8, 32, 128, 512, 1000];

/// Names and contents of all files of `docs/`.
///
/// # Errors
/// What the plotting library says.
pub(super) fn files() -> Result<Vec<(&'static str, String)>> {
    let (by_minutes, minutes) = minutes();
    let (by_parts, merges) = merges();
    let sections = [
        super::prose::CONCLUSIONS.to_owned(),
        by_minutes,
        limits(),
        traffic(),
        by_parts,
        failures(),
        inputs::section(),
    ];
    let axes = ("minutes of a task", "times the ideal time");
    let minutes = lines("4K with outputs, on farms of so many GPUs", axes, &minutes)?;
    let axes = ("films of the picture", "seconds from the last part on");
    let merges = lines("Merging one picture, by films of a merge", axes, &merges)?;
    Ok(vec![
        ("farm-scale.md", sections.join("\n")),
        ("images/farm-minutes.svg", minutes),
        ("images/farm-merges.svg", merges),
    ])
}

/// A row of a table.
fn row(cells: impl IntoIterator<Item = String>) -> String {
    format!(
        "| {} |\n",
        cells.into_iter().collect::<Vec<_>>().join(" | ")
    )
}

/// Whole numbers with marks at thousands.
pub(super) fn grouped(value: f64) -> String {
    let digits = format!("{value:.0}");
    let from_end = |at: usize| digits.len() - at;
    let mark = |at: usize| at > 0 && from_end(at).is_multiple_of(3);
    let marked = digits.char_indices();
    marked.fold(String::new(), |text, (at, digit)| {
        text + if mark(at) { "," } else { "" } + &digit.to_string()
    })
}

fn minutes() -> (String, Vec<Line>) {
    let mut text = String::from(super::prose::MINUTES);
    let mut large: Vec<Line> = Vec::new();
    let each = KINDS
        .into_iter()
        .flat_map(|film| SIZES.map(|size| (film, size)));
    for (film, size) in each {
        let points = MINUTES.map(|minutes| {
            let outcome = run(&farm(size), &film.work(size.0, HOUR, minutes));
            (minutes, outcome.times)
        });
        let best = points.iter().map(|p| p.1).fold(f64::MAX, f64::min);
        // The best are those that take at most 1 % longer than the least.
        let cell = |(_, times): (f64, f64)| {
            let is_best = times <= 1.01 * best;
            if is_best {
                format!("**{times:.2}**")
            } else {
                format!("{times:.2}")
            }
        };
        text += &row(kind(film, size)
            .into_iter()
            .chain(points.map(cell))
            .chain([rule(film, size)]));
        if film.name == FILMS[1].name && film.every == FILMS[1].every {
            large.push((grouped(size.0 as f64), points.to_vec()));
        }
    }
    (
        text + "\n![Time against minutes of a task](images/farm-minutes.svg)\n",
        large,
    )
}

/// The names of a row: of the film, its checkpoints and the GPUs.
fn kind(film: Film, (gpus, _): (usize, f64)) -> [String; 3] {
    [
        film.name.to_owned(),
        film.every.to_string(),
        grouped(gpus as f64),
    ]
}

/// The minutes that the rules of the page say.
fn rule(film: Film, (gpus, bandwidth): (usize, f64)) -> String {
    let (farm, job) = (farm((gpus, bandwidth)), film.job(1, 1, 1.0));
    let idle = farm.start + job.gather + 2.0 * job.film / farm.stream;
    // What all GPUs write at once, and with their checkpoints on the way.
    let round = gpus as f64 * job.film;
    let left = bandwidth - round / film.every;
    let moving = match 3.0 * round / bandwidth {
        short if short <= film.every => short,
        _ if left > 0.0 => 2.0 * round / left,
        _ => return "none".into(),
    };
    let least = [
        (2.0 * idle * 60.0 * HOUR).sqrt(),
        gpus as f64 / farm.dispatch,
        moving,
    ];
    format!("{:.0}", least.into_iter().fold(0.0, f64::max) / 60.0)
}

/// A limit that is taken away, by its name.
type Limit = (&'static str, fn(&mut Farm, &mut Job));

const LIMITS: [Limit; 6] = [
    ("start", |farm, _| farm.start = 0.0),
    ("gathering", |_, job| job.gather = 0.0),
    ("checkpoints", |_, job| job.every = f64::INFINITY),
    ("file system", |farm, _| farm.bandwidth = 1e15),
    ("scheduler", |farm, _| farm.dispatch = 1e9),
    ("unequal speeds", |farm, _| farm.spread = 0.0),
];

fn limits() -> String {
    let mut text = String::from(super::prose::LIMITS);
    for film in KINDS {
        for size in SIZES {
            let (farm, job) = (farm(size), film.work(size.0, HOUR, USUAL));
            let with = run(&farm, &job).times;
            let without = LIMITS.map(|(_, remove)| {
                let (mut farm, mut job) = (farm, job);
                remove(&mut farm, &mut job);
                run(&farm, &job).times
            });
            let least = without.into_iter().fold(f64::MAX, f64::min);
            let first = LIMITS
                .iter()
                .zip(without)
                .find(|(_, times)| *times <= least);
            let first = first.map_or("", |((name, _), _)| name);
            let times = [with].into_iter().chain(without).map(|t| format!("{t:.2}"));
            text += &row(kind(film, size)
                .into_iter()
                .chain(times)
                .chain([first.to_owned()]));
        }
    }
    text
}

fn traffic() -> String {
    let mut text = String::from(super::prose::TRAFFIC);
    for film in FILMS {
        for (minutes, every) in [
            (1f64, 30.0),
            (5.0, 30.0),
            (5.0, 300.0),
            (20.0, 30.0),
            (20.0, 300.0),
        ] {
            // Checkpoints on the way, the last one, the film, and its merge.
            let films = (60.0 * minutes / every - 1.0).max(0.0) + 3.0;
            let a_second = films * film.bytes() / (60.0 * minutes);
            let job = film.work(THOUSAND.0, HOUR, minutes);
            let tasks = (job.pictures * job.parts) as f64;
            text += &row([
                film.name.to_owned(),
                format!("{minutes}"),
                format!("{every}"),
                format!("{films}"),
                format!("{:.1}", a_second / 1e6),
                grouped(1e10 / a_second),
                if tasks > 10_000.0 {
                    format!("**{}**", grouped(tasks))
                } else {
                    grouped(tasks)
                },
                job.arrays().to_string(),
                grouped(4.0 * tasks + 5.0 * job.pictures as f64),
                format!("{:.1}", tasks * film.bytes() / 1e12),
            ]);
        }
    }
    text
}

fn merges() -> (String, Vec<Line>) {
    let mut text = String::from(super::prose::MERGES);
    let after = |outcome: Outcome| outcome.done - outcome.rendered;
    let (farm, film) = (farm(THOUSAND), KINDS[2]);
    let mut all = Vec::new();
    for fan_in in FAN_INS {
        let name = if fan_in == usize::MAX {
            "all".into()
        } else {
            fan_in.to_string()
        };
        let one = PARTS.map(|parts| {
            let job = Job {
                fan_in,
                ..film.job(1, parts, USUAL)
            };
            (parts as f64, after(run(&farm, &job)))
        });
        let many = Job {
            fan_in,
            ..film.work(THOUSAND.0, HOUR, USUAL)
        };
        let in_turn = Job {
            in_turn: true,
            ..many
        };
        let alone = Farm { mergers: 1, ..farm };
        let many = [run(&farm, &many), run(&farm, &in_turn), run(&alone, &many)];
        let cells = one.map(|(_, seconds)| format!("{seconds:.0}")).into_iter();
        let many = many.map(|outcome| format!("{:.2}", outcome.times));
        text += &row([name.clone()].into_iter().chain(cells).chain(many));
        all.push((name, one.to_vec()));
    }
    (
        text + "\n![Time of merging against the number of films](images/farm-merges.svg)\n",
        all,
    )
}

fn failures() -> String {
    let mut text = String::from(super::prose::FAILURES);
    for hours in [inputs::FAILURES / 3600.0, 300.0, 30.0, 3.0] {
        let farm = Farm {
            failures: 3600.0 * hours,
            ..farm(THOUSAND)
        };
        let mut cells = vec![grouped(hours)];
        for (minutes, every) in [
            (5.0, 30.0),
            (5.0, f64::INFINITY),
            (40.0, 30.0),
            (40.0, f64::INFINITY),
        ] {
            let job = Job {
                every,
                ..FILMS[0].work(THOUSAND.0, 8.0 * HOUR, minutes)
            };
            let outcome = run(&farm, &job);
            if cells.len() == 1 {
                cells.push(outcome.failed.to_string());
            }
            let mut cell = String::new();
            let _ = write!(cell, "{:.1} h, {:.2}", outcome.lost / 3600.0, outcome.times);
            cells.push(cell);
        }
        text += &row(cells);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_the_cells_of_their_heads() {
        for text in [limits(), traffic(), merges().0, inputs::section()] {
            let mut cells = 0;
            for line in text.lines() {
                let bars = line.matches('|').count();
                assert!(cells == 0 || bars == 0 || bars == cells, "{line}");
                cells = bars;
            }
        }
        assert_eq!(
            ["7", "700", "7,000", "1,234,567"],
            [7.0, 700.0, 7e3, 1_234_567.0].map(grouped)
        );
    }

    #[test]
    fn another_seed_says_the_same() {
        for film in FILMS {
            for (size, most) in SIZES.into_iter().zip([0.03, 0.02, 0.01]) {
                let (one, job) = (farm(size), film.work(size.0, HOUR, USUAL));
                let seeds = [77, 154, 231, 308].map(|seed| run(&Farm { seed, ..one }, &job).times);
                let off = seeds.map(|times| (times - run(&one, &job).times).abs());
                assert!(
                    off.into_iter().all(|off| off < most),
                    "{} by {off:?}",
                    size.0
                );
            }
        }
    }
}
