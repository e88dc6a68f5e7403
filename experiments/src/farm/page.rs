//! docs/farm-scale.md.
use super::inputs::{FILMS, SIZES, farm};
use super::sim::{Farm, Job, run};
use std::time::Instant;
use xtask::shell::Result;

pub(super) fn files() -> Result<Vec<(&'static str, String)>> {
    for film in FILMS {
        eprintln!("{} {} {}", film.name, film.bytes() / 1e9, film.gather());
        for size in SIZES {
            for minutes in [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0] {
                let b = Instant::now();
                let job = film.work(size.0, 60.0, minutes);
                let o = run(&farm(size), &job);
                eprintln!(
                    "{} min {minutes} ({}x{}): times {:.3} rendered {:.0} done {:.0} failed {} moved {:.1} TB; {:.2} s",
                    size.0,
                    job.pictures,
                    job.parts,
                    o.times,
                    o.rendered,
                    o.done,
                    o.failed,
                    o.moved / 1e12,
                    b.elapsed().as_secs_f64()
                );
            }
        }
        for size in SIZES {
            let job = film.work(size.0, 60.0, 5.0);
            let f = farm(size);
            let t = |f: &Farm, j: &Job| run(f, j).times;
            let base = t(&f, &job);
            let b = Instant::now();
            eprintln!(
                "{}: {base:.3} start {:.3} spread {:.3} fail {:.3} dispatch {:.3} bandwidth {:.3} stream {:.3} gather {:.3} every {:.3} every300 {:.3} merge {:.3} tree16 {:.3}; {:.1}",
                size.0,
                t(&Farm { start: 0.0, ..f }, &job),
                t(&Farm { spread: 0.0, ..f }, &job),
                t(
                    &Farm {
                        failures: f64::INFINITY,
                        ..f
                    },
                    &job
                ),
                t(&Farm { dispatch: 1e9, ..f }, &job),
                t(
                    &Farm {
                        bandwidth: 1e15,
                        ..f
                    },
                    &job
                ),
                t(&Farm { stream: 1e12, ..f }, &job),
                t(&f, &Job { gather: 0.0, ..job }),
                t(
                    &f,
                    &Job {
                        every: f64::INFINITY,
                        ..job
                    }
                ),
                t(
                    &f,
                    &Job {
                        every: 300.0,
                        ..job
                    }
                ),
                t(
                    &Farm {
                        mergers: 1000000,
                        ..f
                    },
                    &job
                ),
                t(&f, &Job { fan_in: 16, ..job }),
                b.elapsed().as_secs_f64()
            );
        }
    }
    Ok(vec![])
}
