//! `cargo xtask gallery`: a picture of everything in the library, and pages that show them.
//!
//! What there is comes from the compiler (`impasto emit --what docs`), what it costs from
//! `impasto cost`, and pictures from `impasto render`: xtask only arranges. A picture is rendered
//! again when what it shows has changed, see [`manifest`]. Pages follow from the sources and the
//! manifest alone, so that `--check` can compare them byte by byte without a GPU.

mod example;
mod library;
mod manifest;
mod page;
mod prose;
mod render;
mod stage;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;

use crate::adapter;
use crate::scenes::obj::write_atomically;
use crate::shell::{self, Result, cargo};
use library::{Entry, Library};
use manifest::{Manifest, Record};
use page::Shown;
use render::{Settings, Studio};

/// Arguments of `cargo xtask gallery`.
#[derive(Args)]
pub(crate) struct GalleryArgs {
    /// Width and height of a picture in pixels
    #[arg(long, default_value_t = 192, value_parser = clap::value_parser!(u32).range(16..=1024))]
    size: u32,
    /// Samples per pixel, at least 16; a picture that was made with more is kept
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(16..))]
    spp: u32,
    /// Seconds after which a picture is taken as it is
    #[arg(long, default_value_t = 60)]
    seconds: u32,
    /// Render only entries whose name, as in `bsdf/conductor`, matches this; `*` is any text
    #[arg(long, value_name = "GLOB")]
    only: Option<String>,
    /// Render pictures that are current, too
    #[arg(long)]
    again: bool,
    /// Render nothing: measure costs and write the pages
    #[arg(long)]
    docs_only: bool,
    /// Write nothing, and fail if a page or picture is missing or stale
    #[arg(long, conflicts_with_all = ["docs_only", "again", "only"])]
    check: bool,
    /// A built `impasto` command; otherwise the environment's IMPASTO, or one that is built now
    #[arg(long, value_name = "FILE")]
    impasto: Option<PathBuf>,
    /// Folder of the pages
    #[arg(long, value_name = "DIR", default_value = "docs/library")]
    out: PathBuf,
}

/// What is known of the pictures, in the folder of the pages.
const MANIFEST: &str = "images/manifest.json";

pub(crate) fn run(args: &GalleryArgs) -> Result {
    let impasto = command(args)?;
    let out = shell::root().join(&args.out);
    let library = library::read(&impasto)?;
    let (shown, mut failures) = shown(&library);
    let manifest_path = out.join(MANIFEST);
    let mut manifest = manifest::read(&manifest_path)?;
    if args.check {
        return check(&shown, failures, &manifest, &out);
    }
    let known: Vec<String> = shown.iter().map(|s| s.entry.id()).collect();
    manifest.retain(|id, _| known.contains(id));
    let studio =
        Studio::new(std::env::temp_dir().join(format!("impasto-gallery-{}", std::process::id())))?;
    failures.extend(update(args, &impasto, &studio, &shown, &mut manifest, &out));
    manifest::write(&manifest_path, &manifest)?;
    studio.remove();
    let written = page::pages(&shown, &manifest);
    for (name, text) in &written {
        write_atomically(&out.join(name), text.as_bytes())?;
    }
    eprintln!("{} pages in {}", written.len(), out.display());
    all_well(&failures)
}

/// The command that knows the language.
fn command(args: &GalleryArgs) -> Result<PathBuf> {
    let given = args
        .impasto
        .clone()
        .or_else(|| std::env::var_os("IMPASTO").map(PathBuf::from));
    if let Some(path) = given {
        return fs::canonicalize(&path)
            .map_err(|e| format!("no command at {}: {e}", path.display()));
    }
    shell::run(cargo().args(["build", "--package", "impasto"]))?;
    let impasto = shell::impasto("debug")?;
    if !args.check && !args.docs_only {
        adapter::prepare()?;
        adapter::require(&impasto)?;
    }
    Ok(impasto)
}

/// An error that lists what failed. One entry that cannot be shown leaves the others their pictures.
fn all_well(failures: &[String]) -> Result {
    match failures.is_empty() {
        true => Ok(()),
        false => Err(failures.join("\n")),
    }
}

/// Everything with its example, and why some have none.
fn shown(library: &Library) -> (Vec<Shown<'_>>, Vec<String>) {
    let mut shown = Vec::new();
    let mut failures = Vec::new();
    for entry in &library.entries {
        let example = match entry.has_picture() {
            true => example::example(entry, library).map(Some),
            false => Ok(None),
        };
        let example = example.unwrap_or_else(|why| {
            failures.push(why);
            None
        });
        shown.push(Shown { entry, example });
    }
    (shown, failures)
}

/// Renders what is stale and measures what it costs; what failed.
fn update(
    args: &GalleryArgs,
    impasto: &Path,
    studio: &Studio,
    shown: &[Shown],
    manifest: &mut Manifest,
    out: &Path,
) -> Vec<String> {
    let settings = Settings {
        impasto: impasto.to_owned(),
        size: args.size,
        spp: args.spp,
        seconds: args.seconds,
    };
    let mut failures = Vec::new();
    for Shown { entry, example } in shown {
        let Some(example) = example else { continue };
        let (id, hash) = (entry.id(), manifest::hash(entry, example));
        let picture = out.join(page::picture_path(entry));
        let known = manifest.get(&id);
        let current = picture.is_file()
            && known.is_some_and(|k| k.hash == hash && k.size == args.size && k.spp >= args.spp);
        let wanted = args.only.as_deref().is_none_or(|glob| matches(glob, &id));
        let render = wanted && !args.docs_only && (args.again || !current);
        if !render && !args.docs_only {
            continue;
        }
        eprintln!("{id}");
        let operations = match studio.operations(entry, example, impasto) {
            Ok(operations) => Some(operations),
            Err(why) => {
                failures.push(why);
                continue;
            }
        };
        if !render {
            if let Some(known) = manifest.get_mut(&id) {
                known.operations = operations;
            }
            continue;
        }
        let made = studio.picture(entry, example, &settings);
        match made.and_then(|bytes| keep(&picture, &bytes)) {
            Ok(()) => {
                let (size, spp) = (args.size, args.spp);
                manifest.insert(
                    id,
                    Record {
                        hash,
                        size,
                        spp,
                        operations,
                    },
                );
                // With every picture, so that one that is interrupted goes on from there.
                if let Err(why) = manifest::write(&out.join(MANIFEST), manifest) {
                    failures.push(why);
                }
            }
            Err(why) => failures.push(why),
        }
    }
    failures
}

/// Writes a picture, with its folder.
fn keep(path: &Path, bytes: &[u8]) -> Result {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)
            .map_err(|e| format!("cannot create the folder {}: {e}", folder.display()))?;
    }
    write_atomically(path, bytes)
}

impl Studio {
    /// The operations of one evaluation of an example.
    fn operations(&self, entry: &Entry, example: &example::Example, impasto: &Path) -> Result<f64> {
        let sample = self.sample(entry, example)?;
        let mut cost = Command::new(impasto);
        cost.args(["--format", "json", "cost", "--samples", "256"])
            .arg(&sample);
        let json = shell::capture(&mut cost)
            .map_err(|why| format!("{} does not compile:\n{why}", entry.id()))?;
        let value: serde_json::Value = serde_json::from_str(&json)
            .map_err(|e| format!("cannot understand the cost of {}: {e}", entry.id()))?;
        let materials = value["materials"].as_array();
        let ours =
            materials.and_then(|m| m.iter().find(|m| m["name"] == example.material.as_str()));
        let ours = ours.or_else(|| materials.and_then(|m| m.first()));
        ours.and_then(|m| m["operations"]["mean"].as_f64())
            .ok_or_else(|| format!("{} has no cost", entry.id()))
    }
}

/// Compares what is there with what would be written.
fn check(shown: &[Shown], failures: Vec<String>, manifest: &Manifest, out: &Path) -> Result {
    let mut wrong = failures;
    for Shown { entry, example } in shown {
        let Some(example) = example else { continue };
        let id = entry.id();
        let hash = manifest::hash(entry, example);
        let problem = match manifest.get(&id) {
            None => Some("has no picture"),
            Some(_) if !out.join(page::picture_path(entry)).is_file() => Some("lost its picture"),
            Some(record) if record.hash != hash => Some("has a stale picture"),
            Some(_) => None,
        };
        wrong.extend(problem.map(|p| format!("{id} {p}")));
    }
    let expected: BTreeMap<String, String> = page::pages(shown, manifest);
    for (name, text) in &expected {
        let path = out.join(name);
        if fs::read_to_string(&path).ok().as_ref() != Some(text) {
            wrong.push(format!("the page {} is missing or stale", path.display()));
        }
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "{}\n`cargo xtask gallery` renders what is missing and writes the pages",
            wrong.join("\n")
        )),
    }
}

/// Whether `text` is what `glob` says, in which `*` stands for any text.
fn matches(glob: &str, text: &str) -> bool {
    let Some((first, rest)) = glob.split_once('*') else {
        return glob == text;
    };
    let Some(after) = text.strip_prefix(first) else {
        return false;
    };
    let ends = (0..=after.len()).filter(|i| after.is_char_boundary(*i));
    ends.into_iter().any(|i| matches(rest, &after[i..]))
}
