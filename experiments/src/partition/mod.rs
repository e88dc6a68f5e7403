//! `cargo experiments partition`: is the automatic partition the best there is?
//!
//! The paper leaves open which materials should share a kernel. Here all kernels that some materials can share
//! are timed, all partitions of up to six materials are added up from them, and what the time model chose is held
//! against the fastest, as is what the model said of each kernel and plan. Measurements are records in
//! files of their own; partition.json is what the page and the plots are made of.

mod cases;
mod checks;
#[cfg(test)]
mod fixture;
mod measured;
mod page;
mod plans;
mod plots;
mod record;
mod regret;
mod results;
mod scatter;
mod tables;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use impasto::calibrate::{self, Errors};
use impasto::compiler::partition::DeviceProfile;
use impasto::files::write_whole;
use impasto::measure::{Data, Measurement};
use impasto::runtime::render::report::AdapterReport;
use xtask::shell::Result;

use crate::process;
use cases::{Case, Renders};
use measured::Measured;
use record::{Bench, Record};
use results::{Results, rounded};

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
    /// Fit the time model to the records of half of the materials (`impasto calibrate --from`), and report its
    /// errors on the other half; needs no GPU
    #[arg(long)]
    held_out: bool,
    /// Measure nothing: predict anew, with this profile and this version of the model, what the records
    /// measured, and choose plans anew
    #[arg(long, value_name = "NAME|FILE")]
    repredict: Option<String>,
    /// Write page and plots from the JSON that is there, without measuring
    #[arg(long)]
    page: bool,
}

pub(crate) fn run(args: &PartitionArgs) -> Result {
    let json = args.out.join("partition.json");
    let mut results = Results::load(&json)?;
    match &args.repredict {
        Some(profile) => repredict(args, profile, &mut results)?,
        None if args.page => {}
        None => measure(args, &mut results)?,
    }
    if args.held_out {
        results.held_out = Some(held_out(args)?);
    }
    if args.held_out || args.repredict.is_some() || !args.page {
        write_whole(&json, results.text()?.as_bytes())?;
    }
    let scenes: Result<Vec<Measured>> = results.scenes.iter().map(Measured::new).collect();
    let scenes = scenes?;
    for (name, svg) in plots::all(&scenes)? {
        write_whole(&args.out.join("images").join(name), svg.as_bytes())?;
    }
    let page = args.out.join("partition.md");
    write_whole(&page, page::page(&results, &scenes).as_bytes())?;
    eprintln!("{} and {} are written", json.display(), page.display());
    Ok(())
}

/// Measures what is not there yet, and puts all of it into `results`.
fn measure(args: &PartitionArgs, results: &mut Results) -> Result {
    let impasto = process::command(args.impasto.as_deref())?;
    let version = process::version(args.version.as_deref())?;
    process::generate(cases::GENERATED)?;
    let bench = bench(args, &impasto, &version);
    let pools = match (args.pool.as_slice(), args.quick) {
        ([], true) => Vec::from(cases::QUICK_POOLS),
        ([], false) => Vec::from(cases::POOLS),
        (pools, _) => pools.to_vec(),
    };
    let cases = chosen(&args.only, cases::all())?;
    results.version.clone_from(&version);
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
            eprintln!("[{place}/{count}] {} with {pool} paths", case.name);
            let at = Instant::now();
            match one(args, &bench, case, pool, round == 0) {
                Ok((record, line)) => {
                    eprintln!("  {line} ({:.1} s)", at.elapsed().as_secs_f64());
                    put(results, case, &record)?;
                }
                Err(why) => eprintln!("  left out: {why}"),
            }
        }
    }
    Ok(())
}

fn bench<'a>(args: &'a PartitionArgs, impasto: &'a Path, version: &'a str) -> Bench<'a> {
    let quick = |options: &[&str]| {
        let options = options.iter().filter(|_| args.quick);
        options.map(|o| o.to_string()).collect::<Vec<_>>()
    };
    let mut plan_options = quick(&["--repetitions=1"]);
    // Kernels may use most of a scene's time; what is left is for building, iterations and renders.
    plan_options.push(format!("--limit={}", (args.limit / 2).max(1)));
    Bench {
        impasto,
        version,
        records: &args.records,
        rounds: args.rounds as usize,
        plan_options,
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
    if let Some(why) = measured.disagreement(&record.answer) {
        eprintln!("  {why}");
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
    let answer = &record.answer;
    let adapter = answer.measurement.adapter.clone();
    results.adapter = AdapterReport {
        name: adapter.name,
        backend: adapter.backend,
        driver: adapter.driver,
    };
    if !answer.profile.is_empty() {
        results.fit = profile(&answer.profile).ok().map(|profile| profile.fit);
        results.profile.clone_from(&answer.profile);
    }
    results.put(record.scene(case)?);
    Ok(())
}

/// Replaces predictions and chosen plans of all records by those of a profile.
fn repredict(args: &PartitionArgs, name: &str, results: &mut Results) -> Result {
    if let Some(version) = &args.version {
        results.version.clone_from(version);
    }
    let profile = profile(name)?;
    let cases = chosen(&args.only, cases::all())?;
    let mut records: Vec<(u64, usize, PathBuf)> = Vec::new();
    for path in record::paths(&args.records)? {
        let of_path = record::case_of(&path).and_then(|(name, pool)| {
            Some((pool, cases.iter().position(|case| case.name == name)?))
        });
        records.extend(of_path.map(|(pool, case)| (pool, case, path)));
    }
    records.sort();
    for (_, case, path) in records {
        let Some(mut record) = Record::load(&path)? else {
            continue;
        };
        let scored = calibrate::score(&measurements(&path)?, (name, &profile))?;
        let scored = scored.first().ok_or("a record holds no measurement")?;
        record
            .repredict(scored)
            .map_err(|e| format!("{}: {e}", path.display()))?;
        record.save(&path)?;
        put(results, &cases[case], &record)?;
    }
    results.fit = Some(profile.fit);
    name.clone_into(&mut results.profile);
    Ok(())
}

/// The errors of a fit to half of the materials on the other half.
fn held_out(args: &PartitionArgs) -> Result<Errors> {
    let mut sets = Vec::new();
    for path in record::paths(&args.records)? {
        sets.extend(measurements(&path)?);
    }
    let fitted = calibrate::fit(&sets, &calibrate::start(&sets)?);
    Ok(told(&fitted.held_out))
}

/// Errors as the results keep them.
fn told(errors: &Errors) -> Errors {
    Errors {
        of: String::new(),
        kernels: errors.kernels,
        median: rounded(errors.median),
        tenth: rounded(errors.tenth),
        bias: rounded(errors.bias),
        rank_correlation: rounded(errors.rank_correlation),
    }
}

/// What was measured of a record.
fn measurements(path: &Path) -> Result<Vec<Measurement>> {
    let failed = |why: String| format!("cannot read {}: {why}", path.display());
    let text = std::fs::read_to_string(path).map_err(|e| failed(e.to_string()))?;
    Ok(Data::parse(&text).map_err(failed)?.sets)
}

/// The device profile of that name, or of that file.
fn profile(name: &str) -> Result<DeviceProfile> {
    if let Some(profile) = DeviceProfile::named(name) {
        return Ok(profile);
    }
    let failed = |why: String| format!("cannot read the profile {name}: {why}");
    let text = std::fs::read_to_string(name).map_err(|e| failed(e.to_string()))?;
    DeviceProfile::parse(&text).map_err(|e| failed(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_held_out_kernels_are_told() {
        let held = told(&Errors {
            of: "held out".into(),
            kernels: 40,
            median: 0.1234567,
            tenth: 0.5,
            bias: 1.02,
            rank_correlation: 0.9,
        });
        assert_eq!(held.median, 0.12346);
        let results = Results {
            held_out: Some(held),
            ..Results::default()
        };
        let text = checks::held_out(&results);
        assert!(
            text.contains("On the 40 kernels over the others the median error is 12.3 %"),
            "{text}"
        );
        assert_eq!(checks::held_out(&Results::default()), "");
    }

    #[test]
    fn profiles_are_found_by_name() {
        assert!(profile("h200").is_ok_and(|profile| profile.fit.points > 0));
        assert!(profile("nothing").is_err_and(|why| why.contains("nothing")));
    }

    #[test]
    fn scenes_are_chosen_by_name() {
        let cases = || {
            vec![
                Case {
                    name: "a".into(),
                    ..fixture::case()
                },
                fixture::case(),
            ]
        };
        let names = |only: &[String]| {
            chosen(only, cases()).map(|cs| cs.iter().map(|c| c.name.clone()).collect::<Vec<_>>())
        };
        assert_eq!(names(&[]), Ok(vec!["a".into(), "tiny".into()]));
        assert_eq!(names(&["tiny".into()]), Ok(vec!["tiny".into()]));
        assert!(
            names(&["b".into()]).is_err_and(|why| why.contains("`b`") && why.contains("a, tiny"))
        );
    }
}
