//! A run of the command in a process with limits, and whether it ended as it may.

use std::io;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Address space of a process in KiB: a software device takes much of it and uses little.
const MEMORY_KIB: u64 = 4 << 20;
/// Time of the processor in seconds, which does not depend on what else a machine does.
const SECONDS: u64 = 20;
/// Time on the clock, for what waits and never ends.
const WAITED: Duration = Duration::from_secs(90);

/// How a process ended.
pub(super) struct Ended {
    pub(super) ending: Ending,
    pub(super) time: Duration,
    pub(super) stderr: String,
}

/// Whether that was right.
pub(super) enum Ending {
    /// With an exit code from 0 to 2.
    Right(u8),
    /// Otherwise, in words.
    Wrong(String),
}

/// Runs the command in a folder.
pub(super) fn run_limited(
    impasto: &Path,
    arguments: &[String],
    folder: &Path,
) -> io::Result<Ended> {
    // Of standard error only a file takes any length without being read.
    let errors = folder.join(".stderr");
    let begin = Instant::now();
    let mut child = Command::new("sh")
        .args(["-c", &format!("{}; exec \"$0\" \"$@\"", limits())])
        .arg(impasto)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&errors)?)
        .spawn()?;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        if begin.elapsed() > WAITED {
            child.kill()?;
            child.wait()?;
            break None;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let time = begin.elapsed();
    let stderr = String::from_utf8_lossy(&std::fs::read(&errors)?).into_owned();
    std::fs::remove_file(errors)?;
    let ending = ending(status, &stderr);
    Ok(Ended {
        ending,
        time,
        stderr,
    })
}

fn limits() -> String {
    format!("ulimit -v {MEMORY_KIB}; ulimit -t {SECONDS}; ulimit -c 0")
}

fn ending(status: Option<ExitStatus>, stderr: &str) -> Ending {
    let Some(status) = status else {
        return Ending::Wrong(format!("it did not end within {} s", WAITED.as_secs()));
    };
    let mut lines = stderr.lines().skip_while(|line| !line.contains("panicked"));
    if let Some(line) = lines.next() {
        let place = line.split("panicked at ").nth(1).unwrap_or(line);
        return Ending::Wrong(format!(
            "panic at {place} {}",
            lines.next().unwrap_or_default()
        ));
    }
    let last = stderr.lines().last().unwrap_or_default();
    match (status.code(), status.signal()) {
        (Some(code @ 0..=2), _) => Ending::Right(code as u8),
        (Some(code), _) => Ending::Wrong(format!("exit code {code}: {last}")),
        (None, Some(signal)) => Ending::Wrong(format!("signal {signal}: {last}")),
        (None, None) => Ending::Wrong(format!("no exit code: {last}")),
    }
}

/// A script that runs it again, in the folder of its files.
pub(super) fn script(impasto: &Path, arguments: &[String]) -> String {
    let quoted = |text: &str| format!("'{}'", text.replace('\'', r"'\''"));
    let words: Vec<String> = arguments.iter().map(|word| quoted(word)).collect();
    format!(
        "cd \"$(dirname \"$0\")\"\n{}\nexec {} {}\n",
        limits(),
        quoted(&impasto.display().to_string()),
        words.join(" ")
    )
}
