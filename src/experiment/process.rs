//! Running the command that is measured, as a process of its own: what it takes is then what a user waits for, one that
//! hangs can be ended, and a GPU that it loses is not ours.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::cache;
use crate::files::{Lock, LockError, reason};

/// The time between two looks at a process.
const LOOK: Duration = Duration::from_millis(20);
/// The time between two looks at a lock.
const WAIT: Duration = Duration::from_millis(200);

/// Why a command gave no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failed {
    /// What it said, or what became of it.
    Said(String),
    /// It was ended because everything was to end.
    Interrupted,
}

impl From<String> for Failed {
    fn from(why: String) -> Self {
        Self::Said(why)
    }
}

/// Runs a command: its standard output if it exits with 0 within `limit`, else why not. It is asked to end once `stop`
/// says so.
pub fn capture(
    command: &mut Command,
    limit: Duration,
    stop: &dyn Fn() -> bool,
) -> Result<String, Failed> {
    // The time to build kernels is that of a first start.
    command.env(cache::VARIABLE, cache::OFF);
    let folder = tempfile::tempdir().map_err(|e| format!("no temporary folder: {}", reason(&e)))?;
    let file = |name: &str| {
        let path = folder.path().join(name);
        let file = std::fs::File::create(&path);
        let file =
            file.map_err(|e| format!("cannot write `{}`: {}", path.display(), reason(&e)))?;
        Ok::<_, String>((path, file))
    };
    // Files and no pipes: a pipe that nobody reads from while waiting would block the command.
    let (out_path, out) = file("out")?;
    let (err_path, err) = file("err")?;
    let child = command.stdin(Stdio::null()).stdout(out).stderr(err).spawn();
    let mut child = child.map_err(|e| {
        let program = command.get_program().display();
        format!("`{program}` could not be started: {}", reason(&e))
    })?;
    let finished = wait(&mut child, limit, stop)?;
    let read = |path: &Path| std::fs::read(path).unwrap_or_default();
    let text = |path: &Path| String::from_utf8_lossy(&read(path)).into_owned();
    match finished {
        Finished::Well => Ok(text(&out_path)),
        Finished::Ill => Err(first_lines(&text(&err_path)).into()),
        Finished::Late => Err(format!("it took more than {} s", limit.as_secs()).into()),
        Finished::Stopped => Err(Failed::Interrupted),
    }
}

/// What a command says is wrong, without hints at its usage.
fn first_lines(errors: &str) -> String {
    let lines = errors
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty());
    let said = lines.filter(|line| !line.starts_with("note:")).take(2);
    let said = said.collect::<Vec<_>>().join("; ");
    match said.strip_prefix("error: ").unwrap_or(&said) {
        "" => "it failed and said nothing".into(),
        said => said.into(),
    }
}

/// How a process came to its end.
enum Finished {
    Well,
    Ill,
    Late,
    Stopped,
}

fn wait(child: &mut Child, limit: Duration, stop: &dyn Fn() -> bool) -> Result<Finished, String> {
    let begun = Instant::now();
    loop {
        let status = child.try_wait();
        let status = status.map_err(|e| format!("cannot wait for a command: {}", reason(&e)))?;
        let stopped = stop();
        if let Some(status) = status {
            return Ok(match (status.success(), stopped) {
                (true, _) => Finished::Well,
                (false, true) => Finished::Stopped,
                (false, false) => Finished::Ill,
            });
        }
        let late = begun.elapsed() > limit;
        if late || stopped {
            // It may just have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
            return Ok(if stopped {
                Finished::Stopped
            } else {
                Finished::Late
            });
        }
        std::thread::sleep(LOOK);
    }
}

/// Keeps the GPU of this process from other measurements on this machine, and waits until no other has it. What tells
/// GPUs apart is what chooses them: the options of the command and what a scheduler says.
pub fn alone(device: &[String], stop: &dyn Fn() -> bool) -> Result<Lock, Failed> {
    let said = ["CUDA_VISIBLE_DEVICES", "SLURM_JOB_GPUS", "SLURM_STEP_GPUS"];
    let said = said.map(|name| std::env::var(name).unwrap_or_default());
    let key = impasto_runtime::fingerprint::of(format!("{device:?} {said:?}").as_bytes());
    let folder = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    let folder = folder.filter(|folder| folder.is_dir());
    let folder = folder.unwrap_or_else(std::env::temp_dir);
    let path = folder.join(format!("impasto-measures-{key:016x}"));
    loop {
        match Lock::take(&path) {
            Ok(lock) => return Ok(lock),
            Err(LockError::InUse(_)) if !stop() => std::thread::sleep(WAIT),
            Err(LockError::InUse(_)) => return Err(Failed::Interrupted),
            Err(LockError::Failed(why)) => return Err(why.into()),
        }
    }
}

/// What is measured, as pages call it: the commit of the checkout in which the program was built, or its version.
pub fn version(program: &Path) -> String {
    let mut git = Command::new("git");
    git.args(["rev-parse", "--short", "HEAD"]);
    git.current_dir(program.parent().unwrap_or(Path::new(".")));
    let answer = git.stdin(Stdio::null()).output();
    let commit = answer.ok().filter(|answer| answer.status.success());
    let commit = commit.map(|answer| String::from_utf8_lossy(&answer.stdout).trim().to_owned());
    commit
        .filter(|commit| !commit.is_empty())
        .unwrap_or_else(|| env!("CARGO_PKG_VERSION").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn commands_end_or_are_ended() {
        let shell = |line: &str, limit, stop: bool| {
            let mut command = Command::new("sh");
            let limit = Duration::from_millis(limit);
            capture(command.args(["-c", line]), limit, &|| stop)
        };
        assert_eq!(shell("echo yes", 5000, false).as_deref(), Ok("yes\n"));
        let said = |text: &str| Err(Failed::Said(text.into()));
        assert_eq!(
            shell("echo 'error: no' >&2; exit 3", 5000, false),
            said("no")
        );
        assert_eq!(
            shell("exit 3", 5000, false),
            said("it failed and said nothing")
        );
        assert_eq!(
            shell("exec sleep 30", 50, false),
            said("it took more than 0 s")
        );
        assert_eq!(shell("exec sleep 30", 5000, true), Err(Failed::Interrupted));
    }

    #[test]
    fn a_gpu_is_one_measurements_at_a_time() {
        let device = [format!("--gpu=test-{}", std::process::id())];
        let first = alone(&device, &|| false).expect("it is free");
        assert_eq!(alone(&device, &|| true).err(), Some(Failed::Interrupted));
        drop(first);
        assert!(alone(&device, &|| true).is_ok());
    }
}
