//! `cargo xtask partition`: is the automatic partition the best there is?
//!
//! The paper leaves open which materials should share a kernel. Here all kernels that some materials can share
//! are timed, all partitions of up to six materials are added up from them, and what the time model chose is held
//! against the fastest, as is what the model said of each kernel and plan. Measurements are records in
//! files of their own; partition.json is what the page and the plots are made of.

mod answer;
mod cases;
mod checks;
#[cfg(test)]
mod fixture;
mod measured;
mod page;
mod plans;
mod plot;
mod plots;
mod record;
mod results;
mod statistics;
mod tables;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;

use crate::paper::{self, write_whole};
use crate::shell::{self, Result};
use cases::{Case, Renders};
use measured::Measured;
use record::{Bench, Record};
use results::{Fit, Results};

#[derive(Args)]
pub(crate) struct PartitionArgs {
    /// The command to measure [default: built from this checkout]
    #[arg(long, value_name = "FILE")]
    impasto: Option<PathBuf>,
    /// Where partition.json, partition.md and images/partition-*.svg are written
    #[arg(long, value_name = "FOLDER", default_value = "docs")]
    out: PathBuf,
    /// Where the records of measurements are kept, which a later run goes on from
    #[arg(long, value_name = "FOLDER", default_value = "out/partition")]
    records: PathBuf,
    /// Measure these scenes only [default: all]
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Paths in flight, instead of 2^20 and 2^22
    #[arg(long, value_name = "PATHS")]
    pool: Vec<u64>,
    /// Small pools and pictures, to try the way on any machine
    #[arg(long)]
    quick: bool,
    /// Which whole renders are made
    #[arg(long, value_enum, default_value = "some")]
    renders: Renders,
    /// How often each render is made; the fastest counts
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=99))]
    rounds: u32,
    /// Seconds after which a scene's measurements are given up
    #[arg(long, value_name = "SECONDS", default_value_t = 120)]
    limit: u64,
    /// Seconds after which no further scene is begun
    #[arg(long, value_name = "SECONDS")]
    budget: Option<u64>,
    /// What measured, as the page should call it, such as a commit
    #[arg(long, value_name = "TEXT")]
    version: Option<String>,
    /// Write page and plots from the JSON that is there, without measuring
    #[arg(long)]
    page: bool,
}

pub(crate) fn run(args: &PartitionArgs) -> Result {
    let json = args.out.join("partition.json");
    let mut results = Results::load(&json)?;
    if !args.page {
        measure(args, &mut results)?;
        write_whole(&json, &results.text()?)?;
    }
    let scenes: Result<Vec<Measured>> = results.scenes.iter().map(Measured::new).collect();
    let scenes = scenes?;
    for (name, svg) in plots::all(&scenes) {
        write_whole(&args.out.join("images").join(name), &svg)?;
    }
    let page = args.out.join("partition.md");
    write_whole(&page, &page::page(&results, &scenes))?;
    eprintln!("{} and {} are written", json.display(), page.display());
    Ok(())
}

/// Measures what is not there yet, and puts all of it into `results`.
fn measure(args: &PartitionArgs, results: &mut Results) -> Result {
    let impasto = paper::command(args.impasto.as_deref())?;
    let version = paper::version(args.version.as_deref())?;
    let bench = bench(args, &impasto, &version);
    let pools = match (args.pool.as_slice(), args.quick) {
        ([], true) => Vec::from(cases::QUICK_POOLS),
        ([], false) => Vec::from(cases::POOLS),
        (pools, _) => pools.to_vec(),
    };
    let cases = chosen(&args.only, cases::all()?)?;
    let begun = Instant::now();
    for (round, &pool) in pools.iter().enumerate() {
        for (number, case) in cases.iter().enumerate() {
            if args
                .budget
                .is_some_and(|s| begun.elapsed() > Duration::from_secs(s))
            {
                eprintln!("the time is up; run this again to go on from here");
                return Ok(());
            }
            let place = round * cases.len() + number + 1;
            let count = pools.len() * cases.len();
            eprint!("[{place}/{count}] {} with {pool} paths", case.name);
            let at = Instant::now();
            match one(args, &bench, case, pool, round == 0) {
                Ok((record, line)) => {
                    eprintln!(": {line} ({:.1} s)", at.elapsed().as_secs_f64());
                    put(results, case, &record)?;
                }
                Err(why) => eprintln!("\n  left out: {why}"),
            }
        }
    }
    results.version = version;
    Ok(())
}

fn bench<'a>(args: &'a PartitionArgs, impasto: &'a Path, version: &'a str) -> Bench<'a> {
    let quick = |options: &[&str]| match args.quick {
        true => options.iter().map(|o| o.to_string()).collect(),
        false => Vec::new(),
    };
    Bench {
        impasto,
        version,
        records: &args.records,
        rounds: args.rounds as usize,
        plan_options: quick(&["--repetitions=1"]),
        render_options: quick(&["--size=32x32"]),
        samples: args.quick.then_some(1),
        limit: Duration::from_secs(args.limit),
    }
}

/// The scenes that are named, or all.
fn chosen(only: &[String], cases: Vec<Case>) -> Result<Vec<Case>> {
    if let Some(unknown) = only
        .iter()
        .find(|name| !cases.iter().any(|c| c.name == **name))
    {
        let known: Vec<&str> = cases.iter().map(|c| c.name.as_str()).collect();
        return Err(format!(
            "there is no scene `{unknown}`; known are {}",
            known.join(", ")
        ));
    }
    let wanted = |case: &Case| only.is_empty() || only.contains(&case.name);
    Ok(cases.into_iter().filter(wanted).collect())
}

/// Measures a scene, and says in a line how it went.
fn one(
    args: &PartitionArgs,
    bench: &Bench,
    case: &Case,
    pool: u64,
    first: bool,
) -> Result<(Record, String)> {
    let mut record = bench.kernels(case, pool)?;
    let scene = record.scene(case)?;
    let measured = Measured::new(&scene)?;
    if let Some(why) = measured.disagreement(&answer::read(&record.answer)?) {
        eprint!("\n  {why}\n ");
    }
    let best = measured.text(&measured.best);
    let ways = cases::ways(case, first, args.renders, &scene.auto, Some(&best));
    bench.renders(case, pool, &ways, &mut record)?;
    let line = format!(
        "{} kernels, regret {:.3}",
        scene.kernels.len(),
        measured.regret()
    );
    Ok((record, line))
}

/// Puts a record into the results.
fn put(results: &mut Results, case: &Case, record: &Record) -> Result {
    let answer = answer::read(&record.answer)?;
    results.adapter = answer.adapter;
    if !answer.profile.is_empty() {
        results.fit = fit(&answer.profile)?;
        results.profile = answer.profile;
    }
    results.put(record.scene(case)?);
    Ok(())
}

/// What a profile of the repository, or a file, says of its fit; nothing if there is no such file.
fn fit(profile: &str) -> Result<Option<Fit>> {
    #[derive(serde::Deserialize)]
    struct Profile {
        fit: Fit,
    }
    let shipped = shell::root().join(format!("compiler/src/partition/profiles/{profile}.json"));
    let text = std::fs::read_to_string(shipped).or_else(|_| std::fs::read_to_string(profile));
    let Ok(text) = text else {
        return Ok(None);
    };
    let read: std::result::Result<Profile, _> = serde_json::from_str(&text);
    let read = read.map_err(|e| format!("cannot read the profile {profile}: {e}"))?;
    Ok(Some(read.fit))
}
