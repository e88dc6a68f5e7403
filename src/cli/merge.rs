//! `impasto merge`: parts of a render, taken apart, become the picture of all their samples.

use std::path::PathBuf;

use clap::Args;
use impasto::runtime::film::file::{FilmFile, Range};
use impasto::runtime::film::outputs::ID_SLOTS;

use super::outputs::{Outputs, parse_exposure};
use super::{Global, Outcome, count, runtime};

#[derive(Args)]
pub(super) struct MergeArgs {
    /// Film files: what `render` writes to names that end in .film, and checkpoints
    #[arg(required = true, value_name = "FILM")]
    films: Vec<PathBuf>,
    /// The picture: `.exr` (a `.png` is written beside it), `.png` alone, or `.film` to merge further
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Brighten the PNG by this many stops; the EXR stays as it is (docs/outputs.md, "The PNG")
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
}

pub(super) fn run(args: &MergeArgs, global: &Global) -> Outcome {
    let outputs = Outputs::of(&args.out)?;
    let mut merged: Option<FilmFile> = None;
    for path in &args.films {
        let film = FilmFile::read(path).map_err(runtime)?;
        match &mut merged {
            None => merged = Some(film),
            Some(merged) => merged.merge(&film).map_err(|reason| {
                let name = path.display();
                format!("cannot merge `{name}` with the films before it: {reason}")
            })?,
        }
    }
    let Some(merged) = merged else {
        return Err("there is no film to merge".to_string().into());
    };
    outputs.write(&merged.sums.picture(), &merged, args.exposure)?;
    let lost = merged.sums.lost_ids();
    if lost > 0 {
        global.note(&format!(
            "warning: the ids of {lost} samples found no room in their pixels, which tell {ID_SLOTS} apart"
        ));
    }
    global.note(&format!(
        "wrote {} ({} of {}: {})",
        outputs.names(),
        count(merged.samples() as usize, "sample"),
        count(args.films.len(), "film"),
        ranges(&merged.ranges)
    ));
    Ok(())
}

/// `samples 0 to 63, 128 to 191`
fn ranges(ranges: &[Range]) -> String {
    let range = |r: &Range| format!("{} to {}", r.first, r.first + r.count - 1);
    let texts: Vec<String> = ranges.iter().map(range).collect();
    format!("samples {}", texts.join(", "))
}
