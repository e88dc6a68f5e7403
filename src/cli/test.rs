//! `impasto test`: holds every material and every bsdf of sources to what any must keep and to what its documentation
//! promises.
//!
//! A line for each goes to standard output, in the order of the files; what is wrong follows on standard error.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum, ValueHint};
use impasto::FileLoader;
use impasto::compiler::source::SourceMap;
use impasto::compiler::{Loader, diag};
use impasto::files;
use impasto::verify::check::{Bound, File, Measurement, Options, Subject, Verdict, examine, read};
use impasto::verify::effort::Effort;
use serde_json::{Value, json};

use super::progress::{Meter, lock};
use super::{Failure, Global, Outcome, count, print};

mod cache;
mod junit;
mod pictures;
mod review;
mod snapshots;

use cache::Cache;
use snapshots::{Keeper, Mode};

#[derive(Args)]
pub(super) struct TestArgs {
    /// Material files, MaterialX documents, modules of the library such as std::surface::open_pbr, `-` for standard
    /// input, and folders whose `.impasto` files are tested
    #[arg(value_name = "PATH", default_value = ".", value_hint = ValueHint::AnyPath)]
    paths: Vec<String>,
    /// How many are tested at the same time; all cores by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Test one of N equal parts of all, such as 2/3
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<(usize, usize)>,
    /// Draw other parameters, directions and random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// How hard is tried
    #[arg(long, value_name = "EFFORT", default_value = "quick")]
    effort: HowHard,
    /// Test what did not change since it passed, too
    #[arg(long)]
    all: bool,
    /// Make what materials are now their snapshots, in folders that keep none yet too
    #[arg(long, conflicts_with_all = ["review", "update"])]
    accept: bool,
    /// Show what is not as its snapshot has it, and ask
    #[arg(long, conflicts_with_all = ["update", "format"])]
    review: bool,
    /// Which snapshots are written without being asked for; with the variable CI set, none
    #[arg(long, value_name = "WHICH")]
    update: Option<Update>,
    /// Remove snapshots that belong to no material
    #[arg(long)]
    prune: bool,
    /// Write what was found as JUnit's XML, for CI
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    junit: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum HowHard {
    /// As much as one waits for
    Quick,
    /// Every case of a bsdf, with more samples: seconds to minutes
    Thorough,
    /// More directions, samples and restarts, too: minutes a material
    Full,
}

impl From<HowHard> for Effort {
    fn from(how: HowHard) -> Self {
        match how {
            HowHard::Quick => Effort::Quick,
            HowHard::Thorough => Effort::Thorough,
            HowHard::Full => Effort::Full,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Update {
    /// None
    Never,
    /// Those of materials that have none, in folders that keep snapshots
    New,
}

/// `I/N`: a part, from 1, and how many there are.
fn shard(text: &str) -> Result<(usize, usize), String> {
    let wrong = || "a shard is I/N, with I from 1 to N, such as 2/3".to_owned();
    let (part, parts) = text.split_once('/').ok_or_else(wrong)?;
    let part: usize = part.parse().map_err(|_| wrong())?;
    let parts: usize = parts.parse().map_err(|_| wrong())?;
    let is_part = (1..=parts).contains(&part);
    is_part.then_some((part, parts)).ok_or_else(wrong)
}

/// A file that is tested, and a loader that has read it: all of a run sees one version of each source.
struct Source {
    file: File,
    loader: FileLoader,
}

/// A material or bsdf, and what became of it.
struct Tested<'a> {
    file: &'a File,
    subject: &'a Subject,
    verdict: Verdict,
    /// What became of its snapshot.
    kept: snapshots::Outcome,
    /// Did all of it pass before, and nothing change since?
    unchanged: bool,
    took: Duration,
}

impl Tested<'_> {
    fn passed(&self) -> bool {
        self.verdict.diagnostics.is_empty() && self.kept.diagnostics.is_empty()
    }

    /// The texts that what is wrong with its snapshot points into.
    fn kept_sources(&self) -> &SourceMap {
        self.kept.sources.as_ref().unwrap_or(&self.file.sources)
    }

    fn checks(&self) -> usize {
        self.verdict.checks + self.kept.checks
    }

    /// The line of one that was tested.
    fn line(&self) -> String {
        let verdict = match (self.passed(), self.kept.written) {
            (false, _) => "FAILED",
            (true, true) => "ok, snapshot written",
            (true, false) => "ok",
        };
        let (path, name) = (&self.file.path, &self.subject.name);
        format!("{} {path}::{name} ... {verdict}\n", self.subject.kind())
    }
}

pub(super) fn run(args: &TestArgs, global: &Global) -> Outcome {
    if let Some(path) = &args.junit {
        files::check_writable(path)?;
    }
    let sources = sources(args)?;
    let files: Vec<&File> = sources.iter().map(|s| &s.file).collect();
    let homeless = files
        .iter()
        .find(|f| !impasto::snapshots::has_place(&f.path));
    if let (true, Some(file)) = (args.accept || args.review, homeless) {
        let why = format!(
            "snapshots are kept beside files, and `{}` is none",
            file.path
        );
        return Err(Failure::Error(why));
    }
    let mut broken = 0;
    for file in &files {
        global.report(&file.sources, &file.diagnostics);
        broken += usize::from(diag::has_errors(&file.diagnostics));
    }
    let all = sources
        .iter()
        .flat_map(|s| s.file.subjects.iter().map(move |subject| (s, subject)));
    let (part, parts) = args.shard.unwrap_or((1, 1));
    let all: Vec<(&Source, &Subject)> = all.skip(part - 1).step_by(parts).collect();
    let mut tested = tested(&all, args, global)?;
    reviewed(&mut tested, global)?;
    for t in tested.iter().filter(|t| !t.passed()) {
        global.report(&t.file.sources, &t.verdict.diagnostics);
        // A review has shown them.
        if t.kept.review.is_none() {
            global.report(t.kept_sources(), &t.kept.diagnostics);
        }
    }
    snapshots::orphans(&files, args.prune, global)?;
    if let Some(path) = &args.junit {
        files::write_whole(path, junit::text(&files, &tested).as_bytes())?;
    }
    summary(&files, &tested, broken, global)?;
    if broken > 0 || tested.iter().any(|t| !t.passed()) {
        return Err(Failure::Diagnostics);
    }
    Ok(())
}

/// The files that arguments name, each once.
fn sources(args: &TestArgs) -> Result<Vec<Source>, Failure> {
    let is_source = |path: &Path| path.extension().is_some_and(|e| e == "impasto");
    let mut names: Vec<String> = Vec::new();
    for path in &args.paths {
        let found = super::sources::named(path, is_source)?;
        if found.is_empty() {
            let why = format!("cannot test `{path}`: the folder has no `.impasto` file");
            return Err(Failure::Error(why));
        }
        for name in found {
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    let loaded = |name: &String| {
        let mut loader = FileLoader::new("");
        let bytes = loader.load(name);
        bytes.map_err(|why| Failure::Error(format!("cannot read `{name}`: {why}")))?;
        let file = read(name, &mut loader);
        Ok(Source { file, loader })
    };
    names.iter().map(loaded).collect()
}

/// Asks about snapshots that differ, if it was asked to.
fn reviewed(tested: &mut [Tested<'_>], global: &Global) -> Outcome {
    let at: Vec<usize> = (0..tested.len())
        .filter(|i| tested[*i].kept.review.is_some())
        .collect();
    let asked = at.iter().filter_map(|i| {
        let t = &tested[*i];
        let subject = snapshots::subject(t.file, t.subject);
        Some((t.file, subject, &**t.kept.review.as_ref()?))
    });
    let accepted = review::ask(&asked.collect::<Vec<_>>(), global)?;
    for (i, _) in at.iter().zip(accepted).filter(|(_, accepted)| *accepted) {
        let t = &tested[*i];
        global.note(&format!(
            "{}::{}: snapshot written",
            t.file.path, t.subject.name
        ));
        tested[*i].kept = snapshots::Outcome {
            checks: tested[*i].kept.checks,
            written: true,
            ..snapshots::Outcome::default()
        };
    }
    Ok(())
}

/// Tests them all, and prints their lines in order, each as soon as those before it are done.
fn tested<'a>(
    all: &[(&'a Source, &'a Subject)],
    args: &TestArgs,
    global: &Global,
) -> Result<Vec<Tested<'a>>, Failure> {
    let options = Options {
        seed: args.seed,
        effort: args.effort.into(),
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.map_or(cores, usize::from).min(all.len());
    let meter = Meter::new(global);
    let cache = Cache::open();
    let keeper = Keeper {
        mode: Mode::of(args),
        cache: &cache,
        all: args.all,
        studio: OnceLock::new(),
    };
    let next = AtomicUsize::new(0);
    let failed: Mutex<Option<Failure>> = Mutex::default();
    let done: Mutex<BTreeMap<usize, Tested<'a>>> = Mutex::default();
    let printed = Mutex::new((0usize, Ok(())));
    let work = || {
        while let Some((i, (source, subject))) =
            Some(next.fetch_add(1, Relaxed)).and_then(|i| Some((i, *all.get(i)?)))
        {
            let begin = Instant::now();
            let file = &source.file;
            let (verdict, unchanged) = verdict(&keeper, source, subject, options);
            let kept = match keeper.examine(file, subject, &mut source.loader.clone()) {
                Ok(kept) => kept,
                Err(why) => {
                    lock(&failed).get_or_insert(why);
                    return;
                }
            };
            let one = Tested {
                file,
                subject,
                verdict,
                kept,
                unchanged,
                took: begin.elapsed(),
            };
            let mut printed = lock(&printed);
            let mut done = lock(&done);
            done.insert(i, one);
            let (at, outcome) = &mut *printed;
            while let Some(one) = done.get(at) {
                if !global.json() && outcome.is_ok() {
                    *outcome = print(&one.line());
                }
                *at += 1;
            }
            let share = done.len() as f64 / all.len() as f64;
            meter.show(share, format!("{} of {} tested", done.len(), all.len()));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(work);
        }
    });
    drop(meter);
    if let Some(why) = lock(&failed).take() {
        return Err(why);
    }
    cache.tidy();
    let unlocked = |e: std::sync::PoisonError<_>| e.into_inner();
    printed.into_inner().unwrap_or_else(unlocked).1?;
    let done = done
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    Ok(done.into_values().collect())
}

/// What any material is held to, unless it was and nothing changed; tells whether that is so.
fn verdict(
    keeper: &Keeper<'_>,
    source: &Source,
    subject: &Subject,
    options: Options,
) -> (Verdict, bool) {
    let effort = options.effort.among(0, 1, 2);
    let more = ("checks", options.seed, effort, subject.kind());
    let key = keeper.cache.key(&source.file, &subject.name, &more);
    let known = keeper.cache.passed(key).filter(|_| !keeper.all);
    if let Some(checks) = known {
        let passed = Verdict {
            checks,
            ..Verdict::default()
        };
        return (passed, true);
    }
    let mut loader = source.loader.clone();
    let found = examine(&source.file, subject, &mut loader, options);
    if found.diagnostics.is_empty() {
        keeper.cache.note(key, found.checks, &[]);
    }
    (found, false)
}

fn summary(files: &[&File], tested: &[Tested<'_>], broken: usize, global: &Global) -> Outcome {
    let failed = tested.iter().filter(|t| !t.passed()).count();
    let checks: usize = tested.iter().map(Tested::checks).sum();
    let unchanged = tested.iter().filter(|t| t.unchanged).count();
    if global.json() {
        let each: Vec<Value> = tested.iter().map(as_json).collect();
        let read = files
            .iter()
            .flat_map(|f| super::json(&f.sources, &f.diagnostics));
        let result = json!({
            "files": files.len(),
            "broken": broken,
            "passed": tested.len() - failed,
            "failed": failed,
            "checks": checks,
            "unchanged": unchanged,
            "tested": each,
            "diagnostics": read.collect::<Vec<Value>>(),
        });
        return print(&format!("{result:#}\n"));
    }
    let of = |kind: &str| tested.iter().filter(|t| t.subject.kind() == kind).count();
    let counts = ["material", "bsdf", "test"].map(|kind| (of(kind), kind));
    let present = counts.iter().filter(|(n, _)| *n > 0);
    let tested_here: Vec<String> = present.map(|(n, kind)| count(*n, kind)).collect();
    let passed = tested.len() - failed;
    let mut text = format!(
        "{}: {}, {checks} checks: {passed} passed, {failed} failed",
        count(files.len(), "file"),
        tested_here.join(", ")
    );
    if unchanged > 0 {
        text += &format!(" ({unchanged} as they were when they passed; `--all` tests them too)");
    }
    if broken > 0 {
        text += &format!("; {} with errors not tested", count(broken, "file"));
    }
    global.note(&text);
    Ok(())
}

fn measured(m: &Measurement) -> Value {
    let (bound, limit) = match m.bound {
        Bound::AtMost(most) => ("at_most", most),
        Bound::AtLeast(least) => ("at_least", least),
    };
    json!({
        "topic": m.topic,
        "what": m.what,
        "worst": m.worst,
        bound: limit,
        "place": m.place,
    })
}

fn as_json(t: &Tested<'_>) -> Value {
    json!({
        "file": t.file.path,
        "kind": t.subject.kind(),
        "name": t.subject.name,
        "passed": t.passed(),
        "checks": t.checks(),
        "unchanged": t.unchanged,
        "snapshot_written": t.kept.written,
        "measured": t.verdict.measured.iter().map(measured).collect::<Vec<Value>>(),
        "diagnostics": super::json(&t.file.sources, &t.verdict.diagnostics)
            .into_iter()
            .chain(super::json(t.kept_sources(), &t.kept.diagnostics))
            .collect::<Vec<Value>>(),
    })
}
