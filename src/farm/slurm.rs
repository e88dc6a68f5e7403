//! Slurm: scripts that people can read and submit, arrays of what lacks, the queue, and ending what is in it.
//!
//! Slurm's arrays depend on each other element by element (`aftercorr`). So where there are more pictures than parts, an
//! array has one part of every picture, and the merges are an array that follows all of those: a picture is merged as
//! soon as its own parts are done, and a part that failed for good ends the merge of its own picture alone. Where there
//! are more parts than pictures, an array has all parts of a picture, and its merge follows it (`afterok`). Either way
//! a job of T tasks is at most about twice the root of T calls of `sbatch`. Elements are numbered within the largest
//! that the cluster takes, and a second number says what to add.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use super::job::{Folder, Id, Job, Work};
use super::state::{self, Queued};
use super::tasks::quoted;
use super::{FarmError, IS_TASK, TRANSIENT, count};
use crate::files::{self, Lock, LockError};

/// How often a task is begun again that failed for a reason that may pass.
pub const RESTARTS: u32 = 3;
/// The script of tasks that render or run commands.
const TASK_SCRIPT: &str = "task.sbatch";
/// The script of merges, which need no GPU.
const MERGE_SCRIPT: &str = "merge.sbatch";
/// What was submitted.
const SUBMITTED: &str = "submitted.json";
/// Elements of an array where the cluster does not say: Slurm's own limit.
const USUAL_LIMIT: u32 = 1001;

/// The scripts of a job: their names and texts.
pub fn scripts(job: &Job, folder: &Folder) -> Vec<(&'static str, String)> {
    let mut scripts = vec![(
        TASK_SCRIPT,
        script(job, folder, job.gpus_per_task, by_hand(job, folder)),
    )];
    if matches!(job.work, Work::Render(_)) {
        let text =
            "# Merges the parts of pictures. How it is submitted, task.sbatch says.\n".to_owned();
        scripts.push((MERGE_SCRIPT, script(job, folder, 0, text)));
    }
    scripts
}

/// How the script is submitted by hand.
fn by_hand(job: &Job, folder: &Folder) -> String {
    let at = |name: &str| quoted(&folder.slurm().join(name).to_string_lossy());
    let (task, merge) = (at(TASK_SCRIPT), at(MERGE_SCRIPT));
    let mut text =
        "# Does tasks of a job. `impasto farm submit` submits what lacks; by hand it is\n#\n"
            .to_owned();
    match &job.work {
        Work::Render(render) => {
            let (pictures, parts) = (render.pictures.len(), render.parts.len());
            for part in 1..=parts.min(3) {
                text += &format!("#     sbatch --array=1-{pictures} {task} render-%-{part}\n");
            }
            if parts > 3 {
                text += &format!("#     ... and so on to render-%-{parts}\n");
            }
            text += &format!(
                "#     sbatch --array=1-{pictures} --dependency=aftercorr:JOB:JOB.. --kill-on-invalid-dep=yes {merge} merge-%\n"
            );
        }
        Work::Commands(commands) => {
            text += &format!(
                "#     sbatch --array=1-{} {task} run-%\n",
                commands.lines.len()
            );
        }
    }
    text += "#\n# where the number in the array takes the place of the `%`, plus a second argument if there is one.\n";
    text
}

fn script(job: &Job, folder: &Folder, gpus: u32, about: String) -> String {
    let name = job.queue_name();
    let log = folder.root.join("logs/slurm-%A_%a.log");
    // A percent sign of a folder's own is no pattern.
    let root = folder.root.to_string_lossy().replace('%', "%%");
    let log = log
        .to_string_lossy()
        .replacen(&*folder.root.to_string_lossy(), &root, 1);
    let gres = if gpus > 0 {
        format!("#SBATCH --gres=gpu:{gpus}\n")
    } else {
        String::new()
    };
    let (program, root) = (
        quoted(&job.program.to_string_lossy()),
        quoted(&folder.root.to_string_lossy()),
    );
    let (digest, last) = (&job.digest, RESTARTS);
    format!(
        r#"#!/bin/bash
{about}#SBATCH --job-name={name}
#SBATCH --output="{log}"
#SBATCH --open-mode=append
#SBATCH --requeue
#SBATCH --ntasks=1
{gres}
task="${{1//%/$((${{SLURM_ARRAY_TASK_ID:-0}} + ${{2:-0}}))}}"
export {IS_TASK}=1
{program} farm task {root} "$task" --digest {digest} &
pid=$!

# Ending well takes until the sample that is being taken is done.
trap 'kill -TERM $pid 2>/dev/null' TERM INT HUP
while wait $pid; code=$?; kill -0 $pid 2>/dev/null; do :; done

# {TRANSIENT} may work on another machine, as may what was ended by a signal: 137 is a memory that was full. Those that ask
# for an end (129, 130, 143) are followed.
case $code in
129 | 130 | 143) ;;
{TRANSIENT} | 12[89] | 1[3-9]?)
    if [ "${{SLURM_RESTART_COUNT:-0}}" -lt {last} ]; then
        echo "$task: exit code $code, restart $((${{SLURM_RESTART_COUNT:-0}} + 1)) of {last}"
        # The controller may be away for a moment. Once it has heard, it ends this script.
        for _ in 1 2 3 4 5 6; do
            scontrol requeue "$SLURM_JOB_ID" && exec sleep 120
            sleep 10
        done
    fi ;;
esac
exit $code
"#
    )
}

/// An array to submit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    /// Its script.
    pub script: &'static str,
    /// The task, with `%` for the number.
    pub pattern: String,
    /// The numbers of its elements, less the offset; ascending.
    pub elements: Vec<usize>,
    /// What is added to them.
    pub offset: usize,
    /// The arrays that it follows, by their place among all, and how.
    pub after: Option<(After, Vec<usize>)>,
}

/// How an array follows others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum After {
    /// Each element when the elements of its number are done.
    Corresponding,
    /// When they are done.
    All,
}

impl Array {
    /// The tasks that its elements are.
    pub fn tasks(&self) -> impl Iterator<Item = (usize, Id)> {
        self.elements.iter().filter_map(|element| {
            let number = (element + self.offset).to_string();
            Some((*element, self.pattern.replace('%', &number).parse().ok()?))
        })
    }

    /// Its numbers as `sbatch` takes them: `1-3,7`.
    pub fn range(&self) -> String {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for element in &self.elements {
            match runs.last_mut() {
                Some((_, last)) if *last + 1 == *element => *last = *element,
                _ => runs.push((*element, *element)),
            }
        }
        let run = |(first, last): &(usize, usize)| {
            if first == last {
                first.to_string()
            } else {
                format!("{first}-{last}")
            }
        };
        runs.iter().map(run).collect::<Vec<_>>().join(",")
    }
}

/// Numbers with an offset each, so that the elements stay below `limit`.
fn chunks(numbers: &[usize], limit: u32) -> Vec<(usize, Vec<usize>)> {
    // Elements are below the limit, and 0 is not used.
    let most = (limit.max(2) - 1) as usize;
    let mut chunks: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for number in numbers {
        let offset = (number - 1) / most * most;
        chunks.entry(offset).or_default().push(number - offset);
    }
    chunks.into_iter().collect()
}

/// The arrays that do some tasks of a job. Pictures that lack the same parts are submitted together.
pub fn arrays(lacking: &[Id], limit: u32) -> Vec<Array> {
    let mut arrays: Vec<Array> = Vec::new();
    let (mut runs, mut parts): (Vec<usize>, BTreeMap<usize, Vec<usize>>) = Default::default();
    let mut merges = Vec::new();
    for id in lacking {
        match *id {
            Id::Run(line) => runs.push(line),
            Id::Merge(picture) => merges.push(picture),
            Id::Part(picture, part) => parts.entry(picture).or_default().push(part),
        }
    }
    let mut groups: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for picture in merges {
        let lacks = parts.remove(&picture).unwrap_or_default();
        groups.entry(lacks).or_default().push(picture);
    }
    let array = |script, pattern: String, offset, elements: &[usize], after| Array {
        script,
        pattern,
        elements: elements.to_vec(),
        offset,
        after,
    };
    for (offset, elements) in chunks(&runs, limit) {
        arrays.push(array(TASK_SCRIPT, "run-%".into(), offset, &elements, None));
    }
    for (parts, pictures) in groups {
        if pictures.len() < parts.len() {
            for picture in pictures {
                let first = arrays.len();
                for (offset, elements) in chunks(&parts, limit) {
                    let pattern = format!("render-{picture}-%");
                    arrays.push(array(TASK_SCRIPT, pattern, offset, &elements, None));
                }
                let after = Some((After::All, (first..arrays.len()).collect()));
                let merge = chunks(&[picture], limit);
                for (offset, elements) in merge {
                    arrays.push(array(
                        MERGE_SCRIPT,
                        "merge-%".into(),
                        offset,
                        &elements,
                        after.clone(),
                    ));
                }
            }
            continue;
        }
        for (offset, elements) in chunks(&pictures, limit) {
            let first = arrays.len();
            for part in &parts {
                let pattern = format!("render-%-{part}");
                arrays.push(array(TASK_SCRIPT, pattern, offset, &elements, None));
            }
            let after: Vec<usize> = (first..arrays.len()).collect();
            let after = (!after.is_empty()).then_some((After::Corresponding, after));
            arrays.push(array(
                MERGE_SCRIPT,
                "merge-%".into(),
                offset,
                &elements,
                after,
            ));
        }
    }
    arrays
}

/// What is asked for when a job is submitted.
#[derive(Clone, Debug, Default)]
pub struct Wish {
    /// The partition.
    pub partition: Option<String>,
    /// The time limit of a task.
    pub time: Option<String>,
    /// No array has an element of this number or above; what the cluster says by default.
    pub limit: Option<u32>,
    /// Ask for no GPU.
    pub no_gpu: bool,
    /// Further options of `sbatch`.
    pub more: Vec<String>,
}

/// An array that was submitted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Submitted {
    /// Slurm's number of it.
    pub job: u32,
    /// The task, with `%` for the number of an element.
    pub pattern: String,
    /// What is added to that number.
    pub offset: usize,
}

/// Everything that was ever submitted of a job, the last at the end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ledger {
    /// The arrays.
    pub arrays: Vec<Submitted>,
}

impl Ledger {
    /// What is kept in the job's folder.
    ///
    /// # Errors
    /// If it is not what was written.
    pub fn read(folder: &Folder) -> Result<Self, FarmError> {
        let path = folder.slurm().join(SUBMITTED);
        if !path.exists() {
            return Ok(Self::default());
        }
        let bad = |why: String| format!("cannot read `{}`: {why}", path.display());
        let text = fs::read_to_string(&path).map_err(|error| bad(files::reason(&error)))?;
        Ok(serde_json::from_str(&text).map_err(|error| bad(error.to_string()))?)
    }

    fn write(&self, folder: &Folder) -> Result<(), FarmError> {
        let text = serde_json::to_string_pretty(self).map_err(|error| error.to_string())?;
        let path = folder.slurm().join(SUBMITTED);
        Ok(files::write_whole(&path, format!("{text}\n").as_bytes())?)
    }

    /// The task that an element of an array is.
    fn task(&self, job: u32, element: Option<usize>) -> Option<Id> {
        let array = self.arrays.iter().rev().find(|array| array.job == job)?;
        let number = (element? + array.offset).to_string();
        array.pattern.replace('%', &number).parse().ok()
    }
}

/// Submits what lacks of a job, and gives the arrays; none if nothing lacks.
///
/// # Errors
/// If it is in the queue already, or Slurm does not take it.
pub fn submit(job: &Job, folder: &Folder, wish: &Wish) -> Result<Vec<Array>, FarmError> {
    let _lock = Lock::take(&folder.slurm().join(SUBMITTED)).map_err(|why| match why {
        LockError::InUse(_) => FarmError::Permanent(format!(
            "`{}` is being submitted by another process\n  hint: `impasto farm status` shows what becomes of it",
            folder.root.display()
        )),
        LockError::Failed(why) => FarmError::Permanent(why),
    })?;
    let mut ledger = Ledger::read(folder)?;
    let lines = in_queue(job)?;
    if !lines.is_empty() {
        let numbers = lines.iter().filter_map(|line| line.split('|').next());
        let numbers: BTreeSet<u32> = numbers.filter_map(|number| number.parse().ok()).collect();
        let numbers: Vec<String> = numbers.iter().map(u32::to_string).collect();
        return Err(FarmError::Permanent(format!(
            "`{}` is in the queue already: {} of the jobs {}, called `{}`\n  hint: wait for it (`impasto farm status {0} --watch`), or end it (`impasto farm cancel {0}`)",
            folder.root.display(),
            count(lines.len(), "task"),
            numbers.join(", "),
            job.queue_name(),
        )));
    }
    let lacking = state::lacking(job, folder);
    let limit = wish.limit.or_else(array_limit).unwrap_or(USUAL_LIMIT);
    let arrays = arrays(&lacking, limit);
    let mut ids: Vec<u32> = Vec::new();
    for array in &arrays {
        match sbatch(folder, array, &ids, wish) {
            Ok(id) => {
                ids.push(id);
                ledger.arrays.push(Submitted {
                    job: id,
                    pattern: array.pattern.clone(),
                    offset: array.offset,
                });
                ledger.write(folder)?;
            }
            Err(why) => {
                // Half a job is none: its merges would never come.
                let _ = scancel(&ids);
                return Err(why);
            }
        }
    }
    Ok(arrays)
}

fn sbatch(folder: &Folder, array: &Array, ids: &[u32], wish: &Wish) -> Result<u32, FarmError> {
    let mut command = Command::new("sbatch");
    command.args(["--parsable", &format!("--array={}", array.range())]);
    if let Some((how, after)) = &array.after {
        let how = match how {
            After::Corresponding => "aftercorr",
            After::All => "afterok",
        };
        let after: String = after
            .iter()
            .filter_map(|at| ids.get(*at))
            .map(|id| format!(":{id}"))
            .collect();
        command.args([
            &format!("--dependency={how}{after}"),
            "--kill-on-invalid-dep=yes",
        ]);
    }
    let is_merge = array.script == MERGE_SCRIPT;
    if wish.no_gpu && !is_merge {
        command.arg("--gres=none");
    }
    command.args(
        wish.partition
            .iter()
            .map(|partition| format!("--partition={partition}")),
    );
    command.args(wish.time.iter().map(|time| format!("--time={time}")));
    command.args(&wish.more);
    command
        .arg(folder.slurm().join(array.script))
        .args([&array.pattern, &array.offset.to_string()]);
    let printed = asked(&mut command)?;
    // With several clusters it is `JOB;CLUSTER`.
    let id = printed
        .trim()
        .split(';')
        .next()
        .and_then(|id| id.parse().ok());
    id.ok_or_else(|| {
        FarmError::Permanent(format!(
            "`sbatch` printed no number of a job, but `{}`",
            printed.trim()
        ))
    })
}

/// What a program of Slurm prints.
fn asked(command: &mut Command) -> Result<String, FarmError> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output().map_err(|error| {
        let why = files::reason(&error);
        format!("cannot start `{name}`: {why}\n  hint: is this a machine of a cluster with Slurm? `impasto farm run` needs none (docs/farm.md)")
    })?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let said = said.trim();
    let is_away = [
        "Unable to contact",
        "timed out",
        "Connection refused",
        "Socket timed",
    ];
    let message = format!(
        "`{name}` failed: {}",
        said.strip_prefix(&format!("{name}: error: "))
            .unwrap_or(said)
    );
    let lacks = ["generic resource", "node configuration is not available"];
    let message = if lacks.iter().any(|text| said.contains(text)) {
        format!(
            "{message}\n  hint: has a node so many GPUs? `--no-gpu` asks for none, and `--gpus-per-task` of `farm new` for another number"
        )
    } else {
        message
    };
    if is_away.iter().any(|text| said.contains(text)) {
        return Err(FarmError::Transient(message));
    }
    Err(FarmError::Permanent(message))
}

/// What no element of an array may be, as the cluster says.
fn array_limit() -> Option<u32> {
    let config = asked(Command::new("scontrol").args(["show", "config"])).ok()?;
    let value = config
        .lines()
        .find_map(|line| line.trim().strip_prefix("MaxArraySize"));
    value?.trim_start_matches([' ', '=']).trim().parse().ok()
}

/// What of a job is in the queue.
///
/// # Errors
/// If Slurm does not say.
pub fn queue(job: &Job, folder: &Folder) -> Result<Vec<Queued>, FarmError> {
    let ledger = Ledger::read(folder)?;
    let lines = in_queue(job)?;
    Ok(lines
        .iter()
        .filter_map(|line| queued(&ledger, line))
        .collect())
}

/// The lines of `squeue` that are the job's, whether we know of them or not.
fn in_queue(job: &Job) -> Result<Vec<String>, FarmError> {
    let name = format!("--name={}", job.queue_name());
    let mut command = Command::new("squeue");
    command.args(["--noheader", "--array", &name, "--format=%F|%K|%T|%N|%r"]);
    Ok(asked(&mut command)?
        .lines()
        .map(|line| line.trim().to_owned())
        .collect())
}

/// A line of `squeue`: array, element, state, nodes, reason.
fn queued(ledger: &Ledger, line: &str) -> Option<Queued> {
    let fields: Vec<&str> = line.trim().split('|').collect();
    let [array, element, state, nodes, reason] = fields[..] else {
        return None;
    };
    let id = ledger.task(array.parse().ok()?, element.parse().ok())?;
    let is_running = matches!(
        state,
        "RUNNING" | "COMPLETING" | "CONFIGURING" | "SUSPENDED" | "STOPPED"
    );
    Some(Queued {
        id,
        is_running,
        place: if is_running { nodes } else { reason }.to_owned(),
    })
}

/// Ends what of a job is in the queue, and tells how many tasks that were.
///
/// # Errors
/// If Slurm does not.
pub fn cancel(job: &Job) -> Result<usize, FarmError> {
    let ended = in_queue(job)?.len();
    if ended > 0 {
        asked(Command::new("scancel").arg(format!("--name={}", job.queue_name())))?;
    }
    Ok(ended)
}

fn scancel(ids: &[u32]) -> Result<(), FarmError> {
    if ids.is_empty() {
        return Ok(());
    }
    asked(Command::new("scancel").args(ids.iter().map(u32::to_string))).map(drop)
}

/// What was submitted, in words.
pub fn said(arrays: &[Array]) -> String {
    let tasks = arrays.iter().map(|array| array.elements.len()).sum();
    format!(
        "{} in {}",
        count(tasks, "task"),
        count(arrays.len(), "array")
    )
}
