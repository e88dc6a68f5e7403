//! The job as a template of OpenJD (2023-09): a description that other engines than Slurm take, such as the workers of
//! AWS Deadline Cloud and `openjd run`.
//!
//! Its tasks are ours (`impasto farm task`), so what a worker does and what Slurm does are the same command lines. There
//! is no shell between: a worker's SIGTERM reaches the direct child alone.

use super::job::{Job, Work};

/// Seconds that a task has to end well.
const NOTICE: u32 = 120;
/// Longest name of a job.
const MOST_NAME: usize = 64;

/// The text of `template.yaml`.
pub fn template(job: &Job) -> String {
    let name: String = job.name.chars().take(MOST_NAME).collect();
    let mut text = format!(
        "# Made by `impasto farm new`; job.json beside it is what it follows from. To run it here:\n\
         #     openjd run template.yaml\n\
         specificationVersion: jobtemplate-2023-09\n\
         name: {}\n\
         parameterDefinitions:\n\
         - name: Job\n  type: PATH\n  objectType: DIRECTORY\n  dataFlow: INOUT\n  default: .\n  \
         description: The folder of the job, which all workers share\n\
         - name: Impasto\n  type: STRING\n  default: {}\n  \
         description: The program, as workers find it\n\
         steps:\n",
        scalar(&name),
        scalar(&job.program.to_string_lossy()),
    );
    match &job.work {
        Work::Render(render) => {
            let pictures = ("Picture", render.pictures.len());
            let parts = ("Part", render.parts.len());
            let id = "render-{{Task.Param.Picture}}-{{Task.Param.Part}}";
            text += &step(
                job,
                "Render",
                None,
                job.gpus_per_task,
                &[pictures, parts],
                id,
            );
            let id = "merge-{{Task.Param.Picture}}";
            text += &step(job, "Merge", Some("Render"), 0, &[pictures], id);
        }
        Work::Commands(commands) => {
            let lines = ("Line", commands.lines.len());
            text += &step(
                job,
                "Run",
                None,
                job.gpus_per_task,
                &[lines],
                "run-{{Task.Param.Line}}",
            );
        }
    }
    text
}

fn step(
    job: &Job,
    name: &str,
    after: Option<&str>,
    gpus: u32,
    params: &[(&str, usize)],
    id: &str,
) -> String {
    let mut text = format!("- name: {name}\n");
    if let Some(after) = after {
        text += &format!("  dependencies:\n  - dependsOn: {after}\n");
    }
    if gpus > 0 {
        text += &format!(
            "  hostRequirements:\n    amounts:\n    - name: amount.worker.gpu\n      min: {gpus}\n"
        );
    }
    text += "  parameterSpace:\n    taskParameterDefinitions:\n";
    for (name, count) in params {
        let range = if *count == 1 {
            "1".to_owned()
        } else {
            format!("1-{count}")
        };
        text += &format!("    - name: {name}\n      type: INT\n      range: \"{range}\"\n");
    }
    text += "  script:\n    actions:\n      onRun:\n        command: \"{{Param.Impasto}}\"\n        args:\n";
    let digest = &job.digest;
    for word in [
        "--progress",
        "openjd",
        "farm",
        "task",
        "{{Param.Job}}",
        id,
        "--digest",
        digest,
    ] {
        text += &format!("        - {}\n", scalar(word));
    }
    text += &format!(
        "        cancelation:\n          mode: NOTIFY_THEN_TERMINATE\n          notifyPeriodInSeconds: {NOTICE}\n"
    );
    text
}

/// A text as YAML takes it, whatever it is: JSON's strings are YAML's.
fn scalar(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
