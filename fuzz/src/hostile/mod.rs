//! Hostile files for the built command: what it may read, changed until it is not what it should be.
//!
//! Nothing is kept as a file: every case is made from a seed and its number, so that a seed always gives the
//! same cases. Each runs in a process of its own, with limits on time and memory. Right is exit code 0, 1 or 2;
//! a panic, a signal or an end by a limit is a finding. `cargo xtask hostile` runs it for long.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

mod films;
mod foreign;
mod kinds;
mod pictures;
mod process;
mod scenes;
mod usd;

pub use kinds::{KINDS, Kind};
use process::{Ending, run_limited};

use crate::Random;

/// How much is tried.
#[derive(Clone, Copy, Debug)]
pub enum Amount {
    /// So many cases of each kind.
    Cases(u64),
    /// Cases of all kinds in turn until this long has passed.
    Time(Duration),
}

/// What a run of the corpus is of.
#[derive(Clone, Copy, Debug)]
pub struct Hostile<'a> {
    /// The built command.
    pub impasto: &'a Path,
    /// A folder for cases while they run, and for those that are findings.
    pub folder: &'a Path,
    /// Of which random numbers the cases are made.
    pub seed: u64,
    /// How much is tried.
    pub amount: Amount,
    /// Only kinds of this name, if it is given.
    pub only: Option<&'a str>,
}

/// How the cases of a kind ended.
#[derive(Clone, Debug, Default)]
pub struct Count {
    /// By exit code: 0, 1, 2.
    pub codes: [u64; 3],
    /// Those that ended otherwise.
    pub findings: u64,
    /// The longest that one took.
    pub longest: Duration,
}

/// A case that ended as none may.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Its kind.
    pub kind: &'static str,
    /// Its number, which with the seed makes it again.
    pub case: u64,
    /// What happened.
    pub what: String,
    /// The folder with its files, and with the command in `run.sh`.
    pub folder: PathBuf,
}

/// What came out.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// By the name of the kind.
    pub counts: BTreeMap<&'static str, Count>,
    /// The first of each sort.
    pub findings: Vec<Finding>,
}

impl Hostile<'_> {
    /// Runs the cases on all cores.
    ///
    /// # Errors
    /// If files to begin with cannot be made, or the folder cannot be written to.
    pub fn run(&self) -> Result<Tally, String> {
        let kinds: Vec<&Kind> = KINDS
            .iter()
            .filter(|kind| self.only.is_none_or(|only| only == kind.name))
            .collect();
        if kinds.is_empty() {
            let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
            return Err(format!(
                "there is no such kind; there are {}",
                names.join(", ")
            ));
        }
        let _ = std::fs::remove_dir_all(self.folder);
        let seeds = kinds::Seeds::new(self.impasto, &self.folder.join("seeds"))?;
        let (next, tally) = (AtomicU64::new(0), Mutex::new(Tally::default()));
        let begin = Instant::now();
        let work = |worker: usize| -> Result<(), String> {
            let place = self.folder.join(format!("work-{worker}"));
            loop {
                let case = next.fetch_add(1, Ordering::Relaxed);
                let over = match self.amount {
                    Amount::Cases(each) => case >= each * kinds.len() as u64,
                    Amount::Time(time) => begin.elapsed() >= time,
                };
                if over {
                    return Ok(());
                }
                let kind = kinds[(case % kinds.len() as u64) as usize];
                self.try_case(kind, case, &seeds, &place, &tally)?;
            }
        };
        let workers = std::thread::available_parallelism().map_or(1, usize::from);
        let results: Vec<Result<(), String>> = std::thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> = (0..workers).map(|w| scope.spawn(move || work(w))).collect();
            let ended = threads.into_iter().map(|thread| thread.join());
            ended
                .map(|e| e.unwrap_or_else(|_| Err("a case could not be made".into())))
                .collect()
        });
        for worker in 0..workers {
            let _ = std::fs::remove_dir_all(self.folder.join(format!("work-{worker}")));
        }
        results.into_iter().collect::<Result<(), String>>()?;
        Ok(tally.into_inner().unwrap_or_else(|e| e.into_inner()))
    }

    fn try_case(
        &self,
        kind: &Kind,
        case: u64,
        seeds: &kinds::Seeds,
        place: &Path,
        tally: &Mutex<Tally>,
    ) -> Result<(), String> {
        let failed = |e: std::io::Error| format!("{}: {e}", place.display());
        let _ = std::fs::remove_dir_all(place);
        std::fs::create_dir_all(place).map_err(failed)?;
        // Neighboring numbers are far apart after a step.
        let mut random =
            Random(Random(self.seed).bits() ^ case.wrapping_mul(0xd134_2543_de82_ef95));
        let arguments = (kind.make)(seeds, &mut random, place).map_err(failed)?;
        let ended = run_limited(self.impasto, &arguments, place).map_err(failed)?;
        let mut tally = tally.lock().unwrap_or_else(|e| e.into_inner());
        let Tally { counts, findings } = &mut *tally;
        let count = counts.entry(kind.name).or_default();
        count.longest = count.longest.max(ended.time);
        match ended.ending {
            Ending::Right(code) => count.codes[usize::from(code)] += 1,
            Ending::Wrong(what) => {
                count.findings += 1;
                if findings
                    .iter()
                    .any(|f| f.kind == kind.name && like(&f.what, &what))
                {
                    return Ok(());
                }
                let folder = self.folder.join(format!("{}-{case}", kind.name));
                std::fs::write(place.join("stderr.txt"), &ended.stderr).map_err(failed)?;
                let script = process::script(self.impasto, &arguments);
                std::fs::write(place.join("run.sh"), script).map_err(failed)?;
                std::fs::rename(place, &folder).map_err(failed)?;
                findings.push(Finding {
                    kind: kind.name,
                    case,
                    what,
                    folder,
                });
            }
        }
        Ok(())
    }
}

impl Tally {
    /// What was tried, for people.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{:<12} {:>7} {:>7} {:>7} {:>7} {:>8} {:>9}\n",
            "kind", "tried", "exit 0", "exit 1", "exit 2", "findings", "longest"
        );
        let mut all = 0;
        for (name, count) in &self.counts {
            let [fine, diagnosed, refused] = count.codes;
            let tried = fine + diagnosed + refused + count.findings;
            all += tried;
            let (findings, longest) = (count.findings, count.longest.as_secs_f64());
            let _ = writeln!(
                out,
                "{name:<12} {tried:>7} {fine:>7} {diagnosed:>7} {refused:>7} {findings:>8} {longest:>7.1} s"
            );
        }
        let _ = writeln!(
            out,
            "{all} cases, {} sorts of findings",
            self.findings.len()
        );
        for finding in &self.findings {
            let (kind, case, what) = (finding.kind, finding.case, &finding.what);
            let _ = writeln!(
                out,
                "{kind}, case {case}: {what}\n  sh {}",
                finding.folder.join("run.sh").display()
            );
        }
        out
    }
}

/// Are two findings likely to be one?
fn like(a: &str, b: &str) -> bool {
    let head = |s: &str| s.chars().take(60).collect::<String>();
    head(a) == head(b)
}

const USAGE: &str = "hostile IMPASTO [--minutes N] [--cases N] [--seed N] [--only KIND]";

/// Runs as the command line says. The exit code is 1 with findings.
pub fn main() -> ExitCode {
    match from_command_line() {
        Ok(tally) => {
            eprint!("{}", tally.text());
            u8::from(!tally.findings.is_empty()).into()
        }
        Err(problem) => {
            eprintln!("error: {problem}");
            2.into()
        }
    }
}

fn from_command_line() -> Result<Tally, String> {
    let mut words = std::env::args().skip(1);
    let impasto = words.next().ok_or(USAGE)?;
    let impasto = std::path::absolute(&impasto).map_err(|e| format!("{impasto}: {e}"))?;
    let (mut seed, mut amount, mut only) = (1, Amount::Time(Duration::from_secs(60)), None);
    while let Some(word) = words.next() {
        let value = words.next().ok_or(USAGE)?;
        let number = value.parse::<u64>().map_err(|_| USAGE);
        match word.as_str() {
            "--minutes" => amount = Amount::Time(Duration::from_secs(60 * number?)),
            "--cases" => amount = Amount::Cases(number?),
            "--seed" => seed = number?,
            "--only" => only = Some(value),
            _ => return Err(USAGE.into()),
        }
    }
    let folder = crate::corpus::root().join("target/hostile");
    let folder = std::path::absolute(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let hostile = Hostile {
        impasto: &impasto,
        folder: &folder,
        seed,
        amount,
        only: only.as_deref(),
    };
    hostile.run()
}
