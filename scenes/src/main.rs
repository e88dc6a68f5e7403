//! `cargo scenes [NAMES]`: writes the example scenes that are generated.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use clap::builder::PossibleValuesParser;
use impasto_scenes::GeneratedFile;

/// Generates the geometry, environment maps and textures of the example scenes
#[derive(Parser)]
#[command(bin_name = "cargo scenes")]
struct Cli {
    /// What to generate [default: all of them]
    #[arg(value_parser = PossibleValuesParser::new(impasto_scenes::names()))]
    names: Vec<String>,
    /// Folder that takes the place of the repository's root
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> Result<(), String> {
    let root = cli.out.as_deref().unwrap_or(root());
    let is_chosen = |known: &&str| cli.names.is_empty() || cli.names.iter().any(|n| n == known);
    for name in impasto_scenes::names().filter(is_chosen) {
        for file in impasto_scenes::write(name, root)? {
            say(&file)?;
        }
    }
    Ok(())
}

/// The root of the repository: where this was built, or the current folder if that is not there.
fn root() -> &'static Path {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    match manifest.parent() {
        Some(built) if built.is_dir() => built,
        _ => Path::new("."),
    }
}

/// Says on standard output what was written.
fn say(file: &GeneratedFile) -> Result<(), String> {
    let kib = file.bytes.len().div_ceil(1024);
    let triangles = file.triangles();
    let triangles = triangles.map_or_else(String::new, |n| format!(", {n} triangles"));
    writeln!(std::io::stdout(), "{} ({kib} KiB{triangles})", file.path)
        .map_err(|error| format!("cannot write to standard output: {error}"))
}
