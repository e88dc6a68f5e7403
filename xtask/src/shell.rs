//! Running other programs, always showing what is run.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// What went wrong, in a sentence for people.
pub type Result<T = ()> = std::result::Result<T, String>;

/// How a command ends: what went wrong is told on standard error.
pub fn exit_code(result: Result) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

/// The root of the repository: where this was built, or the current folder if that is not there, since a
/// built command can be carried to another machine.
pub fn root() -> &'static Path {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    match manifest.parent() {
        Some(built) if built.is_dir() => built,
        _ => Path::new("."),
    }
}

/// The cargo that runs this.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// A headline, so that long output can be followed.
pub fn section(title: &str) {
    eprintln!("\n=== {title}");
}

/// Runs `command` with its output shown; an error unless it exits with 0.
pub fn run(command: &mut Command) -> Result {
    let line = shown(command);
    eprintln!("$ {line}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}` failed ({status})")),
        Err(error) => Err(format!("`{line}` could not be started: {error}")),
    }
}

/// Runs `command` quietly: its output if it exits with 0, else what it wrote to standard error.
pub fn capture(command: &mut Command) -> Result<String> {
    let output = command
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("`{}` could not be started: {error}", shown(command)))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end().to_owned();
    if output.status.success() {
        Ok(text(&output.stdout))
    } else {
        Err(text(&output.stderr))
    }
}

/// Is a program of that name on the search path?
pub fn exists(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

/// The built `impasto` command of a cargo profile's folder (`debug` or `release`).
///
/// The command that runs lies in one of those folders, whatever target directory is in use.
pub fn impasto(profile_folder: &str) -> Result<PathBuf> {
    let own = std::env::current_exe().map_err(|e| format!("cannot find the build folder: {e}"))?;
    let target = own
        .ancestors()
        .nth(2)
        .ok_or("cannot find the build folder")?;
    let name = format!("impasto{}", std::env::consts::EXE_SUFFIX);
    Ok(target.join(profile_folder).join(name))
}

/// The command as one would type it.
fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_name().unwrap_or(program.as_os_str());
    let words = std::iter::once(name).chain(command.get_args());
    let words: Vec<_> = words.map(|word| word.to_string_lossy()).collect();
    words.join(" ")
}
