//! The settings of editors, tried in those that this machine has. For one that is missing, the test says so on standard
//! error, and what was not tried.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::root;

/// Runs an editor in the folder of the repository.
fn run(what: &str, program: &str, arguments: &[&str]) {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(root())
        .output();
    let output = match output {
        Ok(output) => output,
        Err(error) => {
            eprintln!("NOT CHECKED: {what}, since `{program}` cannot be run: {error}");
            return;
        }
    };
    let said = [output.stdout, output.stderr].concat();
    assert!(
        output.status.success(),
        "{what}: {}",
        String::from_utf8_lossy(&said)
    );
}

#[test]
fn neovim_colors_indents_and_starts_the_server() {
    let arguments = [
        "--headless",
        "-u",
        "NONE",
        "-c",
        "set runtimepath^=editors/neovim",
        "-c",
        "luafile editors/neovim/test/editor.lua",
    ];
    run("editors/neovim", "nvim", &arguments);
}

#[test]
fn emacs_colors_indents_and_names_the_server() {
    let arguments = [
        "-Q",
        "--batch",
        "-L",
        "editors/emacs",
        "-l",
        "editors/emacs/test/impasto-mode-test.el",
        "-f",
        "ert-run-tests-batch-and-exit",
    ];
    run("editors/emacs", "emacs", &arguments);
}

/// The compiler puts its output in the place of a file, so it gets a folder of its own.
#[test]
fn emacs_compiles_the_mode_without_a_warning() {
    let folder = std::env::temp_dir().join(format!("impasto-emacs-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    let copy = folder.join("impasto-mode.el");
    fs::copy(root().join("editors/emacs/impasto-mode.el"), &copy).expect("a copy");
    let strict = "(setq byte-compile-error-on-warn t)";
    let copy = copy.to_str().expect("a path in UTF-8");
    run(
        "editors/emacs",
        "emacs",
        &[
            "-Q",
            "--batch",
            "--eval",
            strict,
            "-f",
            "batch-byte-compile",
            copy,
        ],
    );
    fs::remove_dir_all(&folder).expect("the folder is removed");
}

/// The generator that wrote `src/parser.c`; others write other text.
const GENERATOR: &str = "tree-sitter 0.27.";

/// Whoever changes the grammar has the generator, and is told to run it.
#[test]
fn the_parser_is_that_of_the_grammar() {
    let version = Command::new("tree-sitter").arg("--version").output();
    let version = version.map(|o| String::from_utf8_lossy(&o.stdout).into_owned());
    if !version.is_ok_and(|version| version.starts_with(GENERATOR)) {
        eprintln!("NOT CHECKED: whether src/parser.c is that of grammar.js, without {GENERATOR}");
        return;
    }
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = std::env::temp_dir().join(format!("impasto-parser-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    let grammar = own.join("grammar.js");
    let paths = [&folder, &grammar].map(|path| path.to_str().expect("a path in UTF-8"));
    run(
        "whether src/parser.c is that of grammar.js",
        "tree-sitter",
        &["generate", "--output", paths[0], paths[1]],
    );
    for name in ["parser.c", "grammar.json"] {
        let made = folder.join(name);
        if made.exists() {
            let same = fs::read(made).ok() == fs::read(own.join("src").join(name)).ok();
            assert!(same, "src/{name} is old: run `tree-sitter generate`");
        }
    }
    fs::remove_dir_all(&folder).expect("the folder is removed");
}
