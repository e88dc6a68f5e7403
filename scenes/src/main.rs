//! `cargo scenes [NAMES]`: writes the example scenes that are generated.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use clap::builder::PossibleValuesParser;
use impasto_scenes::GeneratedFile;
use xtask::shell;

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
    shell::exit_code(run(&Cli::parse()))
}

fn run(cli: &Cli) -> shell::Result {
    let root = cli.out.as_deref().unwrap_or(shell::root());
    let is_chosen = |known: &&str| cli.names.is_empty() || cli.names.iter().any(|n| n == known);
    for name in impasto_scenes::names().filter(is_chosen) {
        for file in impasto_scenes::write(name, root)? {
            say(&file)?;
        }
    }
    Ok(())
}

/// Says on standard output what was written.
fn say(file: &GeneratedFile) -> shell::Result {
    let kib = file.bytes.len().div_ceil(1024);
    let triangles = file.triangles();
    let triangles = triangles.map_or_else(String::new, |n| format!(", {n} triangles"));
    writeln!(std::io::stdout(), "{} ({kib} KiB{triangles})", file.path)
        .map_err(|error| format!("cannot write to standard output: {error}"))
}
