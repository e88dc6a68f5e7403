//! `cargo experiments paper`: measures what Laine, Karras and Aila, "Megakernels Considered Harmful"
//! (2013) report, on this machine's GPU, and writes it as JSON and as a page.
//!
//! Every number comes from the report of an `impasto render` that the file names. A run that was
//! cut off goes on where it stopped, and the page can be written again from the JSON alone.

mod experiments;
mod page;
mod rays;
mod record;
mod tables;

use std::path::PathBuf;

use clap::Args;
use impasto::files::write_whole;
use xtask::shell::Result;

use crate::process;
use record::Paper;

#[derive(Args)]
pub(crate) struct PaperArgs {
    /// The command to measure [default: built from this checkout]
    #[arg(long, value_name = "FILE")]
    impasto: Option<PathBuf>,
    /// Where paper.json and paper.md are written
    #[arg(long, value_name = "FOLDER", default_value = "docs")]
    out: PathBuf,
    /// Measure these sections only [default: all]
    #[arg(long, value_name = "SECTION", value_parser = experiments::SECTIONS)]
    only: Vec<String>,
    /// Divide samples by this and render once instead of three times, for a quick look
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    quick: u32,
    /// The kitchen of the crate obvhs (assets/kitchen.obj, unpacked) for the section `rays`
    #[arg(long, value_name = "OBJ")]
    kitchen: Option<PathBuf>,
    /// What measured, as the page should call it, such as a commit
    #[arg(long, value_name = "TEXT")]
    version: Option<String>,
    /// Write the page from the JSON that is there, without measuring
    #[arg(long)]
    page: bool,
}

pub(crate) fn run(args: &PaperArgs) -> Result {
    let json = args.out.join("paper.json");
    let mut paper = Paper::load(&json)?;
    if !args.page {
        let impasto = process::command(args.impasto.as_deref())?;
        paper.version = process::version(args.version.as_deref())?;
        process::generate(experiments::GENERATED)?;
        let wanted =
            |section: &str| args.only.is_empty() || args.only.iter().any(|only| only == section);
        let experiments: Vec<_> = experiments::all(args.quick)
            .into_iter()
            .filter(|e| wanted(e.section))
            .collect();
        for (index, experiment) in experiments.iter().enumerate() {
            eprintln!(
                "[{}/{}] {}",
                index + 1,
                experiments.len(),
                experiment.line()
            );
            if paper.measure(&impasto, experiment)? {
                paper.save(&json)?;
            }
        }
        if wanted("rays") {
            rays::measure(&mut paper, &impasto, args.kitchen.as_deref())?;
            paper.save(&json)?;
        }
    }
    let page = args.out.join("paper.md");
    write_whole(&page, page::page(&paper).as_bytes())?;
    eprintln!("{} and {} are written", json.display(), page.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use xtask::shell;

    /// Whoever changes the page or the numbers writes the page anew: `cargo experiments paper --page`.
    #[test]
    fn the_page_is_that_of_its_numbers() {
        let docs = shell::root().join("docs");
        let paper = Paper::load(&docs.join("paper.json")).expect("the numbers");
        assert!(!paper.records.is_empty());
        let written = std::fs::read_to_string(docs.join("paper.md")).expect("the page");
        assert!(
            written == page::page(&paper),
            "docs/paper.md is not docs/paper.json's"
        );
    }

    #[test]
    fn every_experiment_is_told_from_the_others() {
        let experiments = experiments::all(1);
        for (index, a) in experiments.iter().enumerate() {
            for b in &experiments[..index] {
                let same = a.section == b.section && a.scene == b.scene && a.label == b.label;
                assert!(!same, "{} and {}", a.line(), b.line());
            }
        }
    }
}
