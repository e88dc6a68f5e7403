//! The settings of editors, tried in those that this machine has. For one that is missing, the test says so on standard
//! error, and what was not tried.

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

#[test]
fn emacs_compiles_the_mode_without_a_warning() {
    let compile = "(progn (require 'bytecomp) (setq byte-compile-error-on-warn t) \
                   (setq byte-compile-dest-file-function (lambda (_) null-device)) \
                   (unless (byte-compile-file \"editors/emacs/impasto-mode.el\") (kill-emacs 1)))";
    run(
        "editors/emacs",
        "emacs",
        &["-Q", "--batch", "--eval", compile],
    );
}
