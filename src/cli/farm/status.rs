//! `impasto farm status`: how far a job is, as a table, as a live one, or as JSON.

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueHint};
use impasto::farm::FarmError;
use impasto::farm::job::{Folder, Job, Work};
use impasto::farm::slurm;
use impasto::farm::state::{self, Row, Status};

use super::JobArgs;
use crate::cli::{Failure, Global, Outcome, interrupt, print};

/// The time between two tables.
const EVERY: Duration = Duration::from_secs(2);
/// Rows of a live table, and of one that is not asked for in full.
const MOST_ROWS: usize = 30;

#[derive(Args)]
pub(in crate::cli) struct StatusArgs {
    /// The folder of the job
    #[arg(value_name = "DIR", value_hint = ValueHint::DirPath)]
    dir: PathBuf,
    /// Show it again and again until all is done, or nothing is left that runs or waits
    #[arg(long)]
    watch: bool,
}

pub(super) fn run(args: &StatusArgs, global: &Global) -> Outcome {
    let (job, folder) = JobArgs {
        dir: args.dir.clone(),
    }
    .open()?;
    if !args.watch {
        return show(&job, &look(&job, &folder, global)?, usize::MAX, global);
    }
    interrupt::install()?;
    let is_terminal = io::stdout().is_terminal() && !global.json();
    loop {
        let status = look(&job, &folder, global)?;
        if is_terminal {
            // From the top left on, and nothing of before.
            print("\x1b[H\x1b[2J")?;
        }
        show(
            &job,
            &status,
            if is_terminal { MOST_ROWS } else { usize::MAX },
            global,
        )?;
        if status.running + status.waiting == 0 {
            return Ok(());
        }
        for _ in 0..20 {
            if interrupt::requested() {
                return Err(Failure::Interrupted);
            }
            std::thread::sleep(EVERY / 20);
        }
    }
}

/// Looks at the files, and at Slurm's queue if something was submitted.
fn look(job: &Job, folder: &Folder, global: &Global) -> Result<Status, Failure> {
    let was_submitted = !slurm::Ledger::read(folder)?.arrays.is_empty();
    let queue = match was_submitted.then(|| slurm::queue(job, folder)) {
        None => None,
        Some(Ok(queue)) => Some(queue),
        Some(Err(FarmError::Interrupted)) => return Err(Failure::Interrupted),
        // The files say as much as they can.
        Some(Err(why)) => {
            global.note(&format!("warning: the queue is not known: {why}"));
            None
        }
    };
    Ok(state::status(job, folder, queue.as_deref()))
}

fn show(job: &Job, status: &Status, most: usize, global: &Global) -> Outcome {
    if global.json() {
        return print(&format!("{:#}\n", serde_json::json!(status)));
    }
    print(&text(job, status, most))
}

fn text(job: &Job, status: &Status, most: usize) -> String {
    let noun = match &job.work {
        Work::Render(_) => "picture",
        Work::Commands(_) => "command",
    };
    let samples = match &job.work {
        Work::Render(render) => Some(render.samples),
        Work::Commands(_) => None,
    };
    let head = [
        "", noun, "done", "runs", "waits", "failed", "missing", "samples", "%", "where",
    ];
    let line = |row: &Row| -> [String; 10] {
        let samples = samples.map_or(String::new(), |all| format!("{}/{all}", row.samples));
        let name: String = row.name.chars().take(48).collect();
        let mut hosts = row.hosts.join(",");
        if row.made && noun == "picture" {
            hosts = "made".into();
        }
        let counts = [row.done, row.running, row.waiting, row.failed, row.missing];
        let [done, runs, waits, failed, missing] =
            counts.map(|n| if n == 0 { "-".into() } else { n.to_string() });
        let percent = format!("{:.0}", row.percent.floor());
        [
            row.number.to_string(),
            name,
            done,
            runs,
            waits,
            failed,
            missing,
            samples,
            percent,
            hosts,
        ]
    };
    let mut lines = vec![head.map(str::to_owned)];
    // Of many, those that are of interest.
    let is_quiet = |row: &&Row| row.made || row.running + row.failed + row.errors.len() == 0;
    let all = status.rows.len();
    let shown: Vec<&Row> = if all <= most {
        status.rows.iter().collect()
    } else {
        let busy = status.rows.iter().filter(|row| !is_quiet(row));
        busy.take(most).collect()
    };
    lines.extend(shown.iter().map(|row| line(row)));
    let widths: Vec<usize> = (0..10)
        .map(|column| {
            lines
                .iter()
                .map(|line| line[column].chars().count())
                .max()
                .unwrap_or(0)
        })
        .collect();
    let mut out = String::new();
    for line in &lines {
        let mut text = String::new();
        for (column, cell) in line.iter().enumerate() {
            let width = widths[column];
            // Names and places begin at the left, and numbers end at the right.
            text += &if matches!(column, 1 | 9) {
                format!("{cell:<width$}  ")
            } else {
                format!("{cell:>width$}  ")
            };
        }
        out += text.trim_end();
        out += "\n";
    }
    if shown.len() < all {
        out += &format!("... and {} more\n", all - shown.len());
    }
    let errors: Vec<&String> = status.rows.iter().flat_map(|row| &row.errors).collect();
    for error in errors.iter().take(5) {
        out += &format!("! {error}\n");
    }
    if errors.len() > 5 {
        out += &format!("! and {} more\n", errors.len() - 5);
    }
    out + &total(status)
}

fn total(status: &Status) -> String {
    let of = [
        (status.done, "done"),
        (status.running, "running"),
        (status.waiting, "waiting"),
        (status.failed, "failed"),
        (status.missing, "missing"),
    ];
    let of = of.iter().filter(|(count, _)| *count > 0);
    let of: Vec<String> = of.map(|(count, what)| format!("{count} {what}")).collect();
    let left = match status.seconds_left {
        Some(seconds) if seconds > 0.0 && status.done < status.tasks => {
            let how = if status.running == 0 {
                " one after another"
            } else {
                ""
            };
            format!(", about {} left{how}", time(seconds))
        }
        _ => String::new(),
    };
    format!(
        "{}: {} tasks: {}; {:.0} %{left}\n",
        status.name,
        status.tasks,
        of.join(", "),
        status.percent.floor()
    )
}

/// `12 s`, `3 min 20 s`, `2 h 5 min`.
pub(super) fn time(seconds: f64) -> String {
    // Conversion saturates.
    let seconds = seconds.max(0.0).round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}
