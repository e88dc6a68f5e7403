//! `impasto farm`: jobs of many tasks, for Slurm, for OpenJD, and for this machine. What a job is and how its tasks are
//! done, the library knows (`impasto::farm`); here are its options and what people are told.

mod new;
mod status;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use impasto::farm::FarmError;
use impasto::farm::job::{Folder, Id, Job};
use impasto::farm::local::{self, Show};
use impasto::farm::slurm;
use impasto::farm::tasks::{self, Done, Watch};

use super::progress::Meter;
use super::{Failure, Global, Outcome, count, interrupt};

#[derive(Subcommand)]
pub(super) enum FarmCommand {
    /// Make a job of tasks: pictures in parts that are merged, or command lines
    New(Box<new::NewArgs>),
    /// Submit what lacks of a job to Slurm
    Submit(SubmitArgs),
    /// Show how far a job is
    Status(status::StatusArgs),
    /// End what of a job is in Slurm's queue
    Cancel(JobArgs),
    /// Do what lacks of a job here, without an engine
    Run(RunArgs),
    /// Do one task of a job, unless it is done; this is what engines run
    Task(TaskArgs),
}

#[derive(Args)]
pub(super) struct JobArgs {
    /// The folder of the job
    #[arg(value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    dir: PathBuf,
}

#[derive(Args)]
pub(super) struct SubmitArgs {
    #[command(flatten)]
    job: JobArgs,
    /// The partition
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,
    /// The time limit of a task, as `sbatch` takes it
    #[arg(long, value_name = "TIME")]
    time: Option<String>,
    /// No array has an element of this number or above; by default what the cluster says (MaxArraySize)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    array_limit: Option<u32>,
    /// Ask for no GPU, on a cluster without any
    #[arg(long)]
    no_gpu: bool,
    /// More options of `sbatch`, after `--`
    #[arg(last = true, value_name = "OPTION", allow_hyphen_values = true)]
    more: Vec<String>,
}

#[derive(Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    job: JobArgs,
    /// So many tasks at a time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    jobs: u32,
}

#[derive(Args)]
pub(super) struct TaskArgs {
    #[command(flatten)]
    job: JobArgs,
    /// The task: `render-PICTURE-PART`, `merge-PICTURE` or `run-LINE`, counted from 1
    #[arg(value_name = "ID")]
    id: Id,
    /// Fail unless the job has this digest: another job may have taken its folder meanwhile
    #[arg(long, value_name = "DIGEST")]
    digest: Option<String>,
}

pub(super) fn run(command: &FarmCommand, global: &Global) -> Outcome {
    match command {
        FarmCommand::New(args) => new::run(args, global),
        FarmCommand::Submit(args) => submit(args, global),
        FarmCommand::Status(args) => status::run(args, global),
        FarmCommand::Cancel(args) => cancel(args, global),
        FarmCommand::Run(args) => here(args, global),
        FarmCommand::Task(args) => task(args, global),
    }
}

impl JobArgs {
    fn open(&self) -> Result<(Job, Folder), FarmError> {
        let folder = Folder::open(&self.dir)?;
        Ok((Job::read(&folder)?, folder))
    }
}

fn submit(args: &SubmitArgs, global: &Global) -> Outcome {
    let (job, folder) = args.job.open()?;
    let wish = slurm::Wish {
        partition: args.partition.clone(),
        time: args.time.clone(),
        limit: args.array_limit,
        no_gpu: args.no_gpu,
        more: args.more.clone(),
    };
    let arrays = slurm::submit(&job, &folder, &wish)?;
    global.note(&if arrays.is_empty() {
        "nothing to submit: all is done".to_owned()
    } else {
        format!(
            "submitted {}, as `{}`",
            slurm::said(&arrays),
            job.queue_name()
        )
    });
    Ok(())
}

fn cancel(args: &JobArgs, global: &Global) -> Outcome {
    let (job, _) = args.open()?;
    global.note(&match slurm::cancel(&job)? {
        0 => "nothing to cancel: no task of the job is in the queue".to_owned(),
        tasks => format!("cancelled {}; what they had is kept", count(tasks, "task")),
    });
    Ok(())
}

fn task(args: &TaskArgs, global: &Global) -> Outcome {
    interrupt::install()?;
    let (job, folder) = args.job.open()?;
    if let Some(digest) = args.digest.as_ref().filter(|digest| **digest != job.digest) {
        return Err(Failure::Error(format!(
            "`{}` holds another job than was submitted: its digest is {}, and not {digest}\n  hint: submit the job that is there (`impasto farm submit`)",
            folder.root.display(),
            job.digest
        )));
    }
    let meter = Meter::new(global);
    let id = args.id;
    let watch = Watch {
        progress: &|share, status| {
            if !status.is_empty() {
                meter.show(share, format!("{id}: {status}"));
            }
        },
        stop: &interrupt::requested,
        note: &|line| global.note(&format!("{id}: {line}")),
    };
    let done = tasks::perform(&job, &folder, id, &watch);
    drop(meter);
    match done {
        Ok(done) => {
            let what = match done {
                Done::Now => "done",
                Done::Before => "done before",
            };
            global.note(&format!("{id}: {what}"));
            Ok(())
        }
        Err(error) => Err(error.into()),
    }
}

/// Does everything here.
fn here(args: &RunArgs, global: &Global) -> Outcome {
    interrupt::install()?;
    let (job, folder) = args.job.open()?;
    let meter = Meter::new(global);
    let show = Show {
        progress: &|share, status| meter.show(share, status),
        stop: &interrupt::requested,
        note: &|line| global.note(line),
    };
    let ended = local::run(&job, &folder, args.jobs as usize, &show)?;
    drop(meter);
    let before = match ended.before {
        0 => String::new(),
        before => format!(", {before} were done before"),
    };
    global.note(&format!(
        "did {} of {}{before}",
        count(ended.done, "task"),
        job.task_count()
    ));
    if let Some((id, error)) = ended
        .failed
        .iter()
        .find(|(_, e)| matches!(e, FarmError::Permanent(_)))
    {
        let failed = count(ended.failed.len(), "task");
        return Err(Failure::Error(format!(
            "{failed} failed, such as {id}: {error}"
        )));
    }
    if ended.interrupted {
        global.note("interrupted: what was begun is kept, and the same command goes on");
        return Err(Failure::Interrupted);
    }
    match ended.failed.first() {
        Some((id, error)) => {
            let failed = count(ended.failed.len(), "task");
            Err(Failure::Transient(format!(
                "{failed} failed, such as {id}: {error}"
            )))
        }
        None => Ok(()),
    }
}
