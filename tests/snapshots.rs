//! What the compiler makes of every file of `materials/` and `stdlib/`: syntax tree, IR, WGSL.
//!
//! Files are found by walking the folders, so that a new one is tested because it is there. A
//! library file has no material: a probe is written that uses everything it defines.
//! `cargo xtask bless` accepts changes; nothing else writes snapshots.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use impasto::FileLoader;
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, Loader, MaterialRequest, Program, parser};

use crate::probe;

#[test]
fn materials() {
    let _kept = named();
    insta::glob!("../materials", "*.impasto", |path| {
        insta::assert_snapshot!("snapshots__material_ast", ast(path));
        let name = file_name(path);
        let mut loader = FileLoader::new(root().join("materials"));
        let program = compile(&name, &mut loader);
        insta::assert_snapshot!("snapshots__material_ir", ir(path));
        insta::assert_snapshot!("snapshots__material_wgsl", wgsl(&program));
    });
}

#[test]
fn standard_library() {
    let _kept = named();
    insta::glob!("../stdlib", "*/*.impasto", |path| {
        insta::assert_snapshot!("snapshots__std_ast", ast(path));
        insta::assert_snapshot!("snapshots__std_ir", ir(path));
        let Some(source) = probe::source(path) else {
            return;
        };
        let program = compile("probe.impasto", &mut Text(&source));
        insta::assert_snapshot!("snapshots__std_wgsl", wgsl(&program));
    });
}

/// Files are called what the tests call them.
fn named() -> insta::internals::SettingsBindDropGuard {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.bind_to_scope()
}

/// A snapshot whose source was renamed or removed would be kept, and believed, for ever.
#[test]
fn every_snapshot_has_its_source() {
    let materials = names(&root().join("materials"), "");
    let folders = std::fs::read_dir(root().join("stdlib")).expect("stdlib");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let library = folders.filter(|path| path.is_dir()).flat_map(|folder| {
        let prefix = format!("{}__", file_name(&folder));
        names(&folder, &prefix)
    });
    let sources: BTreeSet<String> = materials.into_iter().chain(library).collect();
    for snapshot in std::fs::read_dir(root().join("tests/snapshots")).expect("snapshots") {
        let name = file_name(&snapshot.expect("an entry").path());
        if name.ends_with(".new") {
            continue; // what a failing comparison leaves behind, ignored by git
        }
        let source = name
            .split_once('@')
            .map(|(_, rest)| rest.trim_end_matches(".snap"));
        let known = source.is_some_and(|source| sources.contains(source));
        assert!(
            known,
            "tests/snapshots/{name} has no source any more: remove it"
        );
    }
}

/// Two compilations of everything give the same bytes, whatever was compiled before.
#[test]
fn equal_input_gives_equal_output() {
    let files = names(&root().join("materials"), "");
    let compile_all = || -> Vec<String> {
        let one = |file: &String| {
            let mut loader = FileLoader::new(root().join("materials"));
            wgsl(&compile(file, &mut loader))
        };
        files.iter().map(one).collect()
    };
    assert_eq!(compile_all(), compile_all());
}

/// One text under every name.
struct Text<'a>(&'a str);

impl Loader for Text<'_> {
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

/// The Impasto files of a folder, sorted, with something before their names.
fn names(folder: &Path, prefix: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let sources = paths.filter(|path: &PathBuf| path.extension().is_some_and(|e| e == "impasto"));
    let mut names: Vec<String> = sources
        .map(|p| format!("{prefix}{}", file_name(&p)))
        .collect();
    names.sort();
    names
}

fn ast(path: &Path) -> String {
    let text = std::fs::read_to_string(path).expect("a source");
    let file = SourceMap::default().add(file_name(path), text.as_str());
    let (module, diagnostics) = parser::parse(file, &text);
    assert!(diagnostics.is_empty(), "{diagnostics:#?}");
    parser::print(&module)
}

fn ir(path: &Path) -> String {
    let name = file_name(path);
    let folder = path.parent().expect("a folder");
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
