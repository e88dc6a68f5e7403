//! `impasto fmt`: what it writes, prints and returns.

use std::path::Path;

use crate::cli::common::{folder, impasto, impasto_with, names, root, write};

const UGLY: &str = "fn f(x:float)->float=x*2.0; // twice\n";
const NEAT: &str = "fn f(x: float) -> float = x * 2.0; // twice\n";
const WRONG: &str = "fn f( -> float = 1.0;\n";

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).expect("the file")
}

#[test]
fn files_and_folders_are_formatted_in_place() {
    let temporary = folder();
    let base = temporary.path();
    std::fs::create_dir_all(base.join("sub/.hidden")).expect("folders");
    let single = write(base, "single.txt", UGLY);
    write(base, "a.impasto", UGLY);
    write(base, "sub/b.impasto", NEAT);
    write(base, "sub/notes.md", UGLY);
    write(base, "sub/.hidden/c.impasto", UGLY);
    let run = impasto(&["fmt", &single, &base.display().to_string()]).exits(0);
    run.says("3 files: 2 formatted").prints_nothing();
    assert_eq!(read(single), NEAT);
    assert_eq!(read(base.join("a.impasto")), NEAT);
    assert_eq!(read(base.join("sub/notes.md")), UGLY);
    assert_eq!(read(base.join("sub/.hidden/c.impasto")), UGLY);
    assert_eq!(names(base), ["a.impasto", "single.txt", "sub"]);
}

#[test]
fn a_formatted_file_is_not_written() {
    let temporary = folder();
    let path = write(temporary.path(), "a.impasto", NEAT);
    let before = std::fs::metadata(&path).and_then(|m| m.modified());
    impasto(&["fmt", &path])
        .exits(0)
        .says("1 file: 0 formatted");
    let after = std::fs::metadata(&path).and_then(|m| m.modified());
    assert_eq!(before.expect("a time"), after.expect("a time"));
}

#[test]
fn check_writes_nothing_and_tells() {
    let temporary = folder();
    let path = write(temporary.path(), "a.impasto", UGLY);
    let run = impasto(&["fmt", "--check", &path]).exits(1);
    run.says("not formatted: ")
        .says("a.impasto")
        .prints_nothing();
    assert_eq!(read(&path), UGLY);
    write(temporary.path(), "a.impasto", NEAT);
    impasto(&["fmt", "--check", &path]).exits(0);
    let json = impasto(&["fmt", "--check", "--format", "json", &path])
        .exits(0)
        .json();
    assert_eq!(json["files"], 1);
    assert_eq!(json["changed"].as_array().map(Vec::len), Some(0));
}

#[test]
fn diff_prints_what_would_change() {
    let temporary = folder();
    let path = write(temporary.path(), "a.impasto", UGLY);
    let run = impasto(&["fmt", "--diff", &path]).exits(0);
    assert!(run.stdout.contains(&format!("-{UGLY}+{NEAT}")), "{run:#?}");
    assert!(run.stdout.starts_with("--- "), "{run:#?}");
    assert_eq!(read(&path), UGLY);
    impasto(&["fmt", "--diff", "--check", &path]).exits(1);
}

#[test]
fn standard_input_goes_to_standard_output() {
    let run = impasto_with(&["fmt", "-"], UGLY.as_bytes()).exits(0);
    assert_eq!(run.stdout, NEAT);
    let run = impasto_with(&["fmt", "-"], NEAT.as_bytes()).exits(0);
    assert_eq!(run.stdout, NEAT);
    impasto_with(&["fmt", "-", "--check"], UGLY.as_bytes())
        .exits(1)
        .prints_nothing();
}

#[test]
fn what_is_wrong_is_reported_and_left_alone() {
    let temporary = folder();
    let wrong = write(temporary.path(), "wrong.impasto", WRONG);
    let ugly = write(temporary.path(), "ugly.impasto", UGLY);
    let binary = write(temporary.path(), "binary.impasto", [0xff, 0xfe, 0]);
    let run = impasto(&["fmt", &wrong, &binary, &ugly]).exits(1);
    let run = run.says("wrong.impasto:1:").says("E0102");
    run.says("2 files with syntax errors left alone");
    assert_eq!(read(&wrong), WRONG);
    assert_eq!(read(&ugly), NEAT, "the others are formatted");
    impasto(&["fmt", "nowhere.impasto"])
        .exits(2)
        .says("cannot read `nowhere.impasto`: no such file");
}

#[test]
fn the_library_and_the_materials_are_formatted() {
    impasto(&["fmt", "--check", "stdlib", "materials"]).exits(0);
    assert!(root().join("stdlib/bsdf").is_dir());
}
