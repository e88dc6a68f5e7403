//! Imports documents, compiles what they become, and says how each fared: `mtlx [--out DIR] PATH...`, where a path is a
//! document or a folder of them.

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use impasto_compiler::diag::has_errors;
use impasto_compiler::{MemoryLoader, check};
use impasto_import::{Files, Imported, Options, import};

/// Files of the disk.
struct Disk;

impl Files for Disk {
    fn read(&mut self, path: &str, _most: usize) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|error| error.to_string())
    }

    fn exists(&mut self, path: &str) -> bool {
        Path::new(path).is_file()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut out = None;
    let mut documents = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().map(PathBuf::from),
            path => walk(Path::new(path), &mut documents)?,
        }
    }
    let options = Options {
        allow_outside: true,
        // Compiled below, and not counted.
        unchecked: true,
        ..Options::default()
    };
    let mut time = Duration::ZERO;
    let (mut whole, mut wrong, mut refused) = (0, 0, 0);
    for path in &documents {
        let start = Instant::now();
        let result = import(&path.to_string_lossy(), &mut Disk, &options);
        time += start.elapsed();
        match result {
            Ok(imported) => {
                let problems = problems(&imported);
                if problems.is_empty() {
                    whole += 1
                } else {
                    wrong += 1
                }
                println!(
                    "{} {}",
                    if problems.is_empty() {
                        "ok     "
                    } else {
                        "WRONG  "
                    },
                    path.display()
                );
                for warning in &imported.warnings {
                    println!("        {warning}");
                }
                for problem in problems {
                    println!("        {problem}");
                }
                if let Some(out) = &out {
                    std::fs::create_dir_all(out)?;
                    for (name, text) in &imported.files {
                        std::fs::write(out.join(name), text)?;
                    }
                }
            }
            Err(errors) => {
                refused += 1;
                println!("refused {}", path.display());
                for error in errors {
                    println!("        {error}");
                }
            }
        }
    }
    println!("{whole} whole, {wrong} wrong, {refused} refused, imported in {time:.3?}");
    Ok(())
}

/// What the compiler says against the sources.
fn problems(imported: &Imported) -> Vec<String> {
    let mut loader = MemoryLoader::default();
    for (path, text) in &imported.files {
        loader.add(path.to_string_lossy(), text.as_str());
    }
    let mut problems = Vec::new();
    for (path, _) in &imported.files {
        let checked = check(&path.to_string_lossy(), &mut loader);
        if has_errors(&checked.diagnostics) {
            for problem in checked.diagnostics.iter().filter(|d| d.is_error()).take(4) {
                problems.push(format!(
                    "{} {} {:?}",
                    problem.code.id(),
                    problem.message,
                    problem.hint
                ));
            }
        }
    }
    problems
}

fn walk(path: &Path, documents: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if !path.is_dir() {
        documents.push(path.to_owned());
        return Ok(());
    }
    let mut entries: Vec<PathBuf> = std::fs::read_dir(path)?
        .flatten()
        .map(|e| e.path())
        .collect();
    entries.sort();
    for entry in entries {
        let is_document = entry
            .extension()
            .is_some_and(|extension| extension == "mtlx");
        if entry.is_dir() || is_document {
            walk(&entry, documents)?;
        }
    }
    Ok(())
}
