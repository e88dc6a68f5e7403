//! `cargo experiments gallery`: a picture of everything in the library, and pages that show them.
//!
//! What there is and what it costs is asked of the library, and pictures come from `impasto render`:
//! this only arranges. A picture is rendered again when what it shows has changed, see [`manifest`].
//! Pages follow from the sources and the manifest alone, so that `--check` can compare them byte by byte
//! without a GPU.

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

use clap::Args;
use impasto::FileLoader;
use impasto::compiler::{compile, diag};
use impasto::cost::anywhere;
use impasto::files::write_whole;
use xtask::adapter;
use xtask::shell::{self, Result, cargo};

use example::Example;
use library::{Entry, Library};
use manifest::{Manifest, Record};
use page::Shown;
use render::{Settings, Studio};

/// Arguments of `cargo experiments gallery`.
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
    /// A built `impasto` command for rendering; otherwise the environment's IMPASTO, or one that is built now
    #[arg(long, value_name = "FILE")]
    impasto: Option<PathBuf>,
    /// Folder of the pages
    #[arg(long, value_name = "DIR", default_value = "docs/library")]
    out: PathBuf,
}

/// At how many points materials are evaluated to tell what they cost.
const SAMPLES: usize = 256;

/// What is known of the pictures, in the folder of the pages.
const MANIFEST: &str = "images/manifest.json";

pub(crate) fn run(args: &GalleryArgs) -> Result {
    let out = shell::root().join(&args.out);
    let library = library::read()?;
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
    let settings = if args.docs_only {
        None
    } else {
        Some(settings(args)?)
    };
    let stale = Stale {
        args,
        settings: settings.as_ref(),
        out: &out,
    };
    failures.extend(stale.update(&studio, &shown, &mut manifest));
    manifest::write(&manifest_path, &manifest)?;
    studio.remove();
    let written = page::pages(&shown, &manifest);
    for (name, text) in &written {
        write_whole(&out.join(name), text.as_bytes())?;
    }
    eprintln!("{} pages in {}", written.len(), out.display());
    all_well(&failures)
}

/// How pictures are made, by the command that renders.
fn settings(args: &GalleryArgs) -> Result<Settings> {
    Ok(Settings {
        impasto: command(args)?,
        size: args.size,
        spp: args.spp,
        seconds: args.seconds,
    })
}

/// The command that renders.
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
    adapter::look(&impasto)?;
    Ok(impasto)
}

/// An error that lists what failed. One entry that cannot be shown leaves the others their pictures.
fn all_well(failures: &[String]) -> Result {
    if failures.is_empty() {
        return Ok(());
    }
    Err(failures.join("\n"))
}

/// Everything with its example, and why some have none.
fn shown(library: &Library) -> (Vec<Shown<'_>>, Vec<String>) {
    let mut shown = Vec::new();
    let mut failures = Vec::new();
    for entry in &library.entries {
        let example = if entry.has_picture() {
            example::example(entry, library).map(Some)
        } else {
            Ok(None)
        };
        let example = example.unwrap_or_else(|why| {
            failures.push(why);
            None
        });
        shown.push(Shown { entry, example });
    }
    (shown, failures)
}

/// What is made anew.
struct Stale<'a> {
    args: &'a GalleryArgs,
    /// None if nothing is rendered: then all costs are measured.
    settings: Option<&'a Settings>,
    out: &'a Path,
}

impl Stale<'_> {
    /// Renders what is stale and measures what it costs; what failed.
    fn update(&self, studio: &Studio, shown: &[Shown], manifest: &mut Manifest) -> Vec<String> {
        let examples = shown
            .iter()
            .filter_map(|s| Some((s.entry, s.example.as_ref()?)));
        let wanted = examples.filter(|(entry, example)| self.wants(entry, example, manifest));
        let wanted: Vec<(&Entry, &Example)> = wanted.collect();
        let update = |(entry, example)| self.one(studio, entry, example, manifest).err();
        wanted.into_iter().filter_map(update).collect()
    }

    /// Is it asked for, and not there yet?
    fn wants(&self, entry: &Entry, example: &Example, manifest: &Manifest) -> bool {
        let Some(settings) = self.settings else {
            return true;
        };
        let (id, hash) = (entry.id(), manifest::hash(entry, example));
        let current = self.out.join(page::picture_path(entry)).is_file()
            && manifest.get(&id).is_some_and(|known| {
                known.hash == hash && known.size == settings.size && known.spp >= settings.spp
            });
        let only = self.args.only.as_deref();
        only.is_none_or(|glob| matches(glob, &id)) && (self.args.again || !current)
    }

    fn one(
        &self,
        studio: &Studio,
        entry: &Entry,
        example: &Example,
        manifest: &mut Manifest,
    ) -> Result {
        eprintln!("{}", entry.id());
        let operations = Some(studio.operations(entry, example)?);
        let Some(settings) = self.settings else {
            if let Some(known) = manifest.get_mut(&entry.id()) {
                known.operations = operations;
            }
            return Ok(());
        };
        let picture = studio.picture(entry, example, settings)?;
        keep(&self.out.join(page::picture_path(entry)), &picture)?;
        let record = Record {
            hash: manifest::hash(entry, example),
            size: settings.size,
            spp: settings.spp,
            operations,
        };
        manifest.insert(entry.id(), record);
        // With every picture, so that one that is interrupted goes on from there.
        manifest::write(&self.out.join(MANIFEST), manifest)
    }
}

/// Writes a picture, with its folder.
fn keep(path: &Path, bytes: &[u8]) -> Result {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)
            .map_err(|e| format!("cannot create the folder {}: {e}", folder.display()))?;
    }
    Ok(write_whole(path, bytes)?)
}

impl Studio {
    /// The operations of one evaluation of an example.
    fn operations(&self, entry: &Entry, example: &Example) -> Result<f64> {
        let sample = self.sample(entry, example)?.display().to_string();
        let mut loader = FileLoader::new("");
        let requests = impasto::file_requests(&sample, &mut loader);
        let compiled = compile(&requests, &mut loader);
        let program = compiled.program.ok_or_else(|| {
            let why = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
            format!("{} does not compile:\n{why}", entry.id())
        })?;
        let costs = anywhere(&program, SAMPLES);
        let ours = costs.iter().find(|m| m.name == example.material);
        ours.or(costs.first())
            .and_then(|m| Some(m.operations()?.mean))
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
    if wrong.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}\n`cargo experiments gallery` renders what is missing and writes the pages",
        wrong.join("\n")
    ))
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
