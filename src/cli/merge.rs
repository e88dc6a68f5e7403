//! `impasto merge`: parts of a render, taken apart, become the picture of all their samples.
//!
//! What each film says of itself is read and judged first, since sums may be very much to read. Then they are added one
//! after another. A film may change in between, as the checkpoint of a running render does, so that it is judged again
//! by what was read.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::Args;
use impasto::RuntimeError;
use impasto::runtime::film::file::{FilmFile, Range};
use impasto::runtime::film::merge::{Together, merge_files, survey};
use impasto::runtime::film::outputs::ID_SLOTS;
use impasto::runtime::film::ranges::{missing, said};

use super::outputs::{Outputs, parse_exposure};
use super::progress::Meter;
use super::{Failure, Global, Outcome, count, interrupt, runtime};

#[derive(Args)]
pub(super) struct MergeArgs {
    /// Film files: what `render` writes to names that end in .film, and checkpoints
    #[arg(required = true, value_name = "FILM")]
    films: Vec<PathBuf>,
    /// The picture: `.exr` (a `.png` is written beside it), `.png` alone, or `.film` to merge further
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Fail unless the films hold exactly these samples, as in 0..64 for the samples 0 to 63
    #[arg(long, value_name = "A..B", value_parser = Range::parse, conflicts_with = "partial")]
    samples: Option<Range>,
    /// Say nothing of samples that lack: they are meant to
    #[arg(long)]
    partial: bool,
    /// Brighten the PNG by this many stops; the EXR stays as it is (docs/outputs.md, "The PNG")
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
}

pub(super) fn run(args: &MergeArgs, global: &Global) -> Outcome {
    let outputs = Outputs::of(&args.out)?;
    interrupt::install()?;
    let before = survey(&args.films).map_err(runtime)?;
    let are_all_known = |t: &&Together| t.parts.len() == args.films.len();
    if let Some(together) = before.as_ref().filter(are_all_known) {
        args.check(together)?;
    }
    let bytes = before.map_or(0, |together| together.bytes);
    let (merged, together) = args.merge(bytes, global)?;
    args.check(&together)?;
    outputs.write(&merged.sums.picture(), &merged, args.exposure)?;
    if !args.partial && args.samples.is_none() {
        what_lacks(&together).for_each(|line| global.note(&line));
    }
    unlike_devices(&together)
        .iter()
        .for_each(|line| global.note(line));
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
        said(&merged.about.ranges).trim_start_matches("the ")
    ));
    Ok(())
}

impl MergeArgs {
    /// Adds all films, of which so many bytes are known to be read.
    fn merge(&self, bytes: u64, global: &Global) -> Result<(FilmFile, Together), Failure> {
        let meter = Meter::new(global);
        let mut read = 0;
        let mut watch = |more: u64| {
            read += more;
            let share = read as f64 / bytes.max(1) as f64;
            meter.show(share.min(1.0), format!("{} MB of films", read / 1_000_000));
            if interrupt::requested() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let merged = merge_files(&self.films, &mut watch);
        drop(meter);
        match merged {
            Ok(Some(merged)) => Ok(merged),
            Ok(None) => Err("there is no film to merge".to_string().into()),
            Err(RuntimeError::Stopped) => {
                global.note("interrupted while films were read: nothing is written");
                Err(Failure::Interrupted)
            }
            Err(error) => Err(runtime(error)),
        }
    }

    /// Fails unless the films hold the samples that were asked for, and no others.
    fn check(&self, together: &Together) -> Result<(), String> {
        let Some(wanted) = self.samples else {
            return Ok(());
        };
        let held = &together.about.ranges;
        let lacking = missing(&[wanted], held);
        if let [first, ..] = lacking[..] {
            let (from, spp) = (first.first, first.count);
            let unfinished: String = unfinished(together)
                .map(|line| format!("\n  {line}"))
                .collect();
            return Err(format!(
                "no film holds {} of {}{unfinished}\n  hint: render them \
                 (`--samples-from {from} --spp {spp}`), or name their films too",
                said(&lacking),
                said(&[wanted]),
            ));
        }
        let more = missing(held, &[wanted]);
        if more.is_empty() {
            return Ok(());
        }
        let has_more = |ranges: &[Range]| !missing(ranges, &[wanted]).is_empty();
        let parts = together.parts.iter().filter(|part| has_more(&part.ranges));
        let names: Vec<String> = parts.map(|p| format!("`{}`", p.path.display())).collect();
        Err(format!(
            "{} hold {}, which are none of {}\n  hint: leave them out, or ask for more (`--samples`)",
            names.join(", "),
            said(&more),
            said(&[wanted]),
        ))
    }
}

/// Each film of a render that was ended early, with what lacks for it.
fn unfinished(together: &Together) -> impl Iterator<Item = String> {
    together.unfinished().map(|(part, lacks)| {
        let (name, asked) = (part.path.display(), said(&part.asked));
        format!("`{name}` is partial: of {asked} it lacks {}", said(&lacks))
    })
}

/// Warnings of samples that lack.
fn what_lacks(together: &Together) -> impl Iterator<Item = String> {
    let gaps = together.gaps();
    let gaps = (!gaps.is_empty()).then(|| format!("no film holds {}", said(&gaps)));
    let lines = unfinished(together).chain(gaps);
    lines.map(|line| format!("warning: {line}; `--partial` says that this is meant"))
}

/// A warning if films are of several devices.
fn unlike_devices(together: &Together) -> Option<String> {
    let makers = together.makers();
    if makers.is_empty() {
        return None;
    }
    let line =
        |(maker, film): &(_, &std::path::Path)| format!("\n  {maker}, as of `{}`", film.display());
    let lines: String = makers.iter().map(line).collect();
    Some(format!(
        "warning: the samples are of different devices or drivers, so that the bits may not be those of one:{lines}"
    ))
}
