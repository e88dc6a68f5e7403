//! What the compiler makes of every file of `materials/` and `stdlib/`: syntax tree, IR, WGSL.
//!
//! Files are found by walking the folders, so that a new one is tested because it is there. A
//! library file has no material: a probe is written that uses everything it defines.
//!
//! The WGSL of every material is kept as a file, since that is what people review, and so is
//! everything of the files that [`IN_FULL`] lists, which together show each construct. Of the rest a
//! digest is kept, a line a file and stage. What a changed line is about, the texts tell:
//! `IMPASTO_TEXTS=DIR` has the tests write all of them into a folder, to be compared with those of
//! another commit. `cargo xtask bless` accepts changes; nothing else writes snapshots.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use impasto::FileLoader;
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, Loader, MaterialRequest, Program, parser};

use crate::probe;

/// Files of which every stage is kept in full.
const IN_FULL: [&str; 17] = [
    "materials/car_paint",
    "materials/glass",
    "materials/leaf",
    "materials/light",
    "materials/mandelbrot_wall",
    "materials/textured",
    "stdlib/bsdf/sheen_conty_kulla",
    "stdlib/bsdf/thin_dielectric",
    "stdlib/bsdf/transparent",
    "stdlib/core/lattice",
    "stdlib/edf/generalized_schlick",
    "stdlib/noise/gabor_2d",
    "stdlib/noise/simplex",
    "stdlib/noise/turbulence",
    "stdlib/pattern/band",
    "stdlib/pattern/triplanar",
    "stdlib/surface/gltf_pbr",
];

/// What printed trees and IR call the constructs of the language: those files have each of them.
const CONSTRUCTS: [(&str, &str); 2] = [
    (
        "ast",
        "use const struct fn material bsdf delta-bsdf edf param doc in when method let var block if \
         then else for while limit call . ! - + * / % & && || < > >= <= == != = += *=",
    ),
    (
        "ir",
        "struct fn var if else for loop return call texture bsdf edf material sample eval pdf albedo \
         passes emit delta surface emission interior lobe layer mix add select",
    ),
];

/// The environment variable that names a folder for all texts.
const TEXTS: &str = "IMPASTO_TEXTS";

/// What the compiler makes of a file at one stage.
struct Text {
    /// The path of the file, without its extension.
    path: String,
    /// `ast`, `ir` or `wgsl`.
    stage: &'static str,
    text: String,
}

impl Text {
    fn is_whole(&self) -> bool {
        let shown = self.stage == "wgsl" && self.path.starts_with("materials/");
        shown || IN_FULL.contains(&self.path.as_str())
    }

    /// The name of its snapshot.
    fn name(&self) -> String {
        format!("{}@{}", self.stage, self.path.replace('/', "__"))
    }

    /// Its line among the digests.
    fn line(&self) -> String {
        // As snapshots keep texts: without the end of the last line.
        let text = self.text.trim_end();
        let (path, stage, lines) = (&self.path, self.stage, text.lines().count());
        let digest = fnv(text.as_bytes());
        format!("{path:<40} {stage:<4} {lines:>6} lines  {digest:016x}\n")
    }
}

/// The 64-bit hash of Fowler, Noll and Vo (FNV-1a).
fn fnv(bytes: &[u8]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}

/// Every text of every file, materials first.
static TEXTS_OF_ALL: LazyLock<Vec<Text>> = LazyLock::new(|| {
    let materials = sources("materials").into_iter();
    let mut all: Vec<Text> = materials.flat_map(|path| of_material(&path)).collect();
    let folders = std::fs::read_dir(root().join("stdlib")).expect("stdlib");
    let mut folders: Vec<PathBuf> = folders.map(|e| e.expect("an entry").path()).collect();
    folders.retain(|path| path.is_dir());
    folders.sort();
    for folder in folders {
        let library = sources(&format!("stdlib/{}", file_name(&folder)));
        all.extend(library.iter().flat_map(|path| of_library(path)));
    }
    if let Some(folder) = std::env::var_os(TEXTS) {
        write_all(Path::new(&folder), &all);
    }
    all
});

/// The Impasto files of a folder as paths from the root, sorted.
fn sources(folder: &str) -> Vec<PathBuf> {
    let files = names(&root().join(folder)).into_iter();
    files.map(|name| Path::new(folder).join(name)).collect()
}

fn of_material(path: &Path) -> Vec<Text> {
    let mut loader = FileLoader::new(root().join("materials"));
    let program = compile(&file_name(path), &mut loader);
    vec![
        text(path, "ast", ast(path)),
        text(path, "ir", ir(path)),
        text(path, "wgsl", wgsl(&program)),
    ]
}

fn of_library(path: &Path) -> Vec<Text> {
    let mut texts = vec![text(path, "ast", ast(path)), text(path, "ir", ir(path))];
    if let Some(source) = probe::source(&root().join(path)) {
        let program = compile("probe.impasto", &mut Probe(&source));
        texts.push(text(path, "wgsl", wgsl(&program)));
    }
    texts
}

fn text(path: &Path, stage: &'static str, text: String) -> Text {
    let path = path.with_extension("").display().to_string();
    Text { path, stage, text }
}

/// Writes every text into a folder, a file each.
fn write_all(folder: &Path, texts: &[Text]) {
    for t in texts {
        let file = folder.join(format!("{}.{}", t.path, t.stage));
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        std::fs::write(&file, &t.text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    }
}

#[test]
fn texts_kept_in_full() {
    let whole = || TEXTS_OF_ALL.iter().filter(|t| t.is_whole());
    let changed: Vec<String> = named(|| {
        let differs = |t: &&Text| {
            let compare = || insta::assert_snapshot!(t.name(), t.text);
            catch_unwind(AssertUnwindSafe(compare)).is_err()
        };
        whole().filter(differs).map(Text::name).collect()
    });
    assert!(changed.is_empty(), "{changed:#?} differ");
}

#[test]
fn digests_of_the_rest() {
    let mut lines = String::new();
    for t in TEXTS_OF_ALL.iter().filter(|t| !t.is_whole()) {
        let _ = lines.write_str(&t.line());
    }
    named(|| insta::assert_snapshot!("digests", lines));
}

/// Files are called what the tests call them.
fn named<T>(compare: impl FnOnce() -> T) -> T {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(compare)
}

#[test]
fn files_in_full_show_each_construct() {
    for (stage, words) in CONSTRUCTS {
        let texts = TEXTS_OF_ALL
            .iter()
            .filter(|t| t.stage == stage && IN_FULL.contains(&t.path.as_str()));
        let of_text = |t: &'static Text| t.text.split(|c: char| c.is_whitespace() || c == '(');
        let shown: BTreeSet<&str> = texts.flat_map(of_text).collect();
        let missing: Vec<&str> = words.split(' ').filter(|w| !shown.contains(w)).collect();
        assert!(missing.is_empty(), "{stage}: no file shows {missing:?}");
    }
    let known = |path: &&str| TEXTS_OF_ALL.iter().any(|t| t.path == **path);
    assert!(IN_FULL.iter().all(known), "{IN_FULL:?}");
}

/// A snapshot whose source was renamed or removed would be kept, and believed, for ever.
#[test]
fn every_snapshot_has_its_source() {
    let whole = TEXTS_OF_ALL.iter().filter(|t| t.is_whole());
    let mut known: BTreeSet<String> = whole.map(|t| format!("{}.snap", t.name())).collect();
    known.insert("digests.snap".into());
    for snapshot in std::fs::read_dir(root().join("tests/snapshots")).expect("snapshots") {
        let name = file_name(&snapshot.expect("an entry").path());
        // What a failing comparison leaves behind is ignored by git.
        assert!(
            name.ends_with(".new") || known.contains(&name),
            "tests/snapshots/{name} has no source any more: remove it"
        );
    }
}

/// Two compilations of everything give the same bytes, whatever was compiled before.
#[test]
fn equal_input_gives_equal_output() {
    let before = TEXTS_OF_ALL.iter().filter(|t| t.stage == "wgsl");
    let before = before.filter(|t| t.path.starts_with("materials/"));
    let before: Vec<&str> = before.map(|t| t.text.as_str()).collect();
    let again = |path: PathBuf| {
        let mut loader = FileLoader::new(root().join("materials"));
        wgsl(&compile(&file_name(&path), &mut loader))
    };
    let again: Vec<String> = sources("materials").into_iter().map(again).collect();
    assert_eq!(before, again);
}

/// One text under every name.
struct Probe<'a>(&'a str);

impl Loader for Probe<'_> {
    fn load(&mut self, _: &str) -> Result<Vec<u8>, String> {
        Ok(self.0.as_bytes().to_vec())
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().expect("a name");
    name.to_string_lossy().into_owned()
}

/// The Impasto files of a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let sources = paths.filter(|path: &PathBuf| path.extension().is_some_and(|e| e == "impasto"));
    let mut names: Vec<String> = sources.map(|path| file_name(&path)).collect();
    names.sort();
    names
}

fn ast(path: &Path) -> String {
    let text = std::fs::read_to_string(root().join(path)).expect("a source");
    let file = SourceMap::default().add(file_name(path), text.as_str());
    let (module, diagnostics) = parser::parse(file, &text);
    assert!(diagnostics.is_empty(), "{diagnostics:#?}");
    parser::print(&module)
}

fn ir(path: &Path) -> String {
    let name = file_name(path);
    let folder = root().join(path.parent().expect("a folder"));
    let checked = compiler::check(&name, &mut FileLoader::new(folder));
    impasto::ir_text(&checked, &name, None)
}

/// Compiles every material of a file; no errors, and no warnings either.
fn compile(file: &str, loader: &mut dyn Loader) -> Program {
    let checked = compiler::check(file, loader);
    let requests: Vec<MaterialRequest> = checked
        .materials
        .iter()
        .map(|name| MaterialRequest {
            apart: false,
            moment: None,
            written: None,
            name: name.clone(),
            file: file.into(),
            material: Some(name.clone()),
            params: Vec::new(),
            parameters: compiler::Parameters::Agreed,
        })
        .collect();
    let compiled = compiler::compile(&requests, loader);
    let text = compiler::diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    assert!(text.is_empty(), "{text}");
    compiled
        .program
        .expect("a program, since there are no errors")
}

fn wgsl(program: &Program) -> String {
    let all: Vec<usize> = (0..program.materials().len()).collect();
    program.wgsl(&all)
}
