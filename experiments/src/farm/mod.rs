//! `cargo experiments farm`: what many GPUs would do with renders in parts, by simulation, and docs/farm-scale.md.
//!
//! Nothing is measured here. What was measured elsewhere goes in as [`inputs`], each with the command that printed it,
//! and so does what is only assumed.

mod inputs;
mod page;
mod plot;
mod prose;
mod sim;

use std::path::PathBuf;

use clap::Args;
use impasto::files::write_whole;
use xtask::shell::Result;

#[derive(Args)]
pub(crate) struct FarmArgs {
    /// Where farm-scale.md and images/farm-*.svg are written
    #[arg(long, value_name = "FOLDER", default_value = "docs")]
    out: PathBuf,
}

pub(crate) fn run(args: &FarmArgs) -> Result {
    for (name, text) in page::files()? {
        let path = args.out.join(name);
        write_whole(&path, text.as_bytes())?;
        eprintln!("{} is written", path.display());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use xtask::shell;

    /// Whoever changes the simulation, its inputs or the page writes them anew: `cargo experiments farm`.
    #[test]
    fn the_page_is_what_the_simulation_says() {
        for (name, text) in page::files().expect("drawn") {
            let written = std::fs::read_to_string(shell::root().join("docs").join(name));
            assert!(
                written.is_ok_and(|written| written == text),
                "docs/{name} is not what `cargo experiments farm` writes"
            );
        }
    }
}
