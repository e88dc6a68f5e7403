//! Running the command that is measured, as a process of its own: what it takes is then what a user
//! waits for, and one that hangs can be ended.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use impasto::runtime::render::report::Report;
use xtask::shell::{self, Result, cargo};

/// The command to measure: `given`, or the one that is built from this checkout.
pub(crate) fn command(given: Option<&Path>) -> Result<PathBuf> {
    if let Some(impasto) = given {
        return Ok(impasto.to_owned());
    }
    shell::section("Building impasto");
    shell::run(cargo().args(["build", "--release", "--package", "impasto"]))?;
    shell::impasto("release")
}

/// The commit that is measured, unless the caller knows better.
pub(crate) fn version(given: Option<&str>) -> Result<String> {
    if let Some(version) = given {
        return Ok(version.to_owned());
    }
    let mut git = Command::new("git");
    git.current_dir(shell::root())
        .args(["rev-parse", "--short", "HEAD"]);
    shell::capture(&mut git)
        .map_err(|why| format!("cannot tell what is measured: {why}\n  hint: give `--version`"))
}

/// Writes those scenes that were not generated yet.
pub(crate) fn generate<'a>(names: impl IntoIterator<Item = &'a str>) -> Result {
    for name in names {
        let folder = shell::root().join(format!("examples/{name}/generated"));
        if !folder.is_dir() {
            eprintln!("generating {name}");
            impasto_scenes::write(name, shell::root())?;
        }
    }
    Ok(())
}

/// Renders a scene, relative to the repository, with those options: the report of the render.
///
/// # Errors
/// What the command says, or that it took longer than `limit`.
pub(crate) fn render(
    impasto: &Path,
    scene: &str,
    options: &[String],
    limit: Duration,
) -> Result<Report> {
    let folder = scratch("render");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let report = folder.join("report.json");
    let mut command = Command::new(impasto);
    command
        .arg("render")
        .arg(shell::root().join(scene))
        .args(options)
        .arg("--quiet")
        .arg("--out")
        .arg(folder.join("picture.exr"))
        .arg("--report")
        .arg(&report);
    let outcome = capture(&mut command, limit).and_then(|_| {
        let text = std::fs::read_to_string(&report).map_err(|e| e.to_string())?;
        serde_json::from_str(&text).map_err(|e| format!("the report is not as expected: {e}"))
    });
    // Scratch files; leaving them does no harm.
    let _ = std::fs::remove_dir_all(&folder);
    outcome
}

/// A temporary path of this process.
fn scratch(what: &str) -> PathBuf {
    std::env::temp_dir().join(format!("impasto-{what}-{}", std::process::id()))
}

/// Runs a command: its standard output if it exits with 0 within `limit`, else why not.
pub(crate) fn capture(command: &mut Command, limit: Duration) -> Result<String> {
    let scratch = scratch("output");
    let file = |kind: &str| {
        let path = scratch.with_extension(kind);
        let file = std::fs::File::create(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok::<_, String>((path, file))
    };
    // Files and no pipes: a pipe that nobody reads from while waiting would block the command.
    let (out_path, out) = file("out")?;
    let (err_path, err) = file("err")?;
    let child = command.stdin(Stdio::null()).stdout(out).stderr(err).spawn();
    let mut child = child.map_err(|e| {
        format!(
            "`{}` could not be started: {e}",
            command.get_program().display()
        )
    })?;
    let finished = wait(&mut child, limit);
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let (text, errors) = (read(&out_path), read(&err_path));
    for path in [out_path, err_path] {
        // As above: scratch files.
        let _ = std::fs::remove_file(path);
    }
    match finished? {
        Some(true) => Ok(text),
        Some(false) => Err(first_lines(&errors)),
        None => Err(format!("it took more than {} s", limit.as_secs())),
    }
}

/// What a command says is wrong, without hints at its usage.
fn first_lines(errors: &str) -> String {
    let lines = errors.lines().filter(|line| !line.trim().is_empty());
    lines.take(2).collect::<Vec<_>>().join("; ")
}

/// Whether the child succeeded; none if it had to be stopped.
fn wait(child: &mut Child, limit: Duration) -> Result<Option<bool>> {
    let begun = Instant::now();
    loop {
        let status = child
            .try_wait()
            .map_err(|e| format!("cannot wait for a command: {e}"))?;
        if let Some(status) = status {
            return Ok(Some(status.success()));
        }
        if begun.elapsed() > limit {
            // It may just have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn commands_end_or_are_ended() {
        let shell = |line: &str, limit| {
            let mut command = Command::new("sh");
            capture(command.args(["-c", line]), Duration::from_millis(limit))
        };
        assert_eq!(shell("echo yes", 5000).as_deref(), Ok("yes\n"));
        assert_eq!(shell("echo no >&2; exit 3", 5000), Err("no".into()));
        assert!(shell("exec sleep 30", 50).is_err_and(|why| why.contains("more than")));
    }
}
