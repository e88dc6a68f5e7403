//! The language server in an editor: Neovim without a screen, which does what an author does (`editor/session.lua`).

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How long all of the session may take: machines of tests are busy.
const PATIENCE: Duration = Duration::from_secs(180);

const SCENE: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40\n\n[[geometry]]\n\
    obj = \"triangle.obj\"\n\n[materials.paint]\nfile = \"car_paint.impasto\"\nparams = { flake_amount = 0.5 }\n";

#[test]
fn neovim_and_the_language_server_understand_each_other() {
    let is_there = Command::new("nvim").arg("--version").output();
    if let Err(error) = is_there {
        eprintln!(
            "NOT CHECKED: the language server in Neovim, since `nvim` cannot be run: {error}"
        );
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a folder");
    // By the name that the editor gives it.
    let path = folder.path().canonicalize().expect("a path");
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("written");
    let paint = root.join("materials/car_paint.impasto");
    write(
        "car_paint.impasto",
        &std::fs::read_to_string(paint).expect("a source"),
    );
    write("scene.toml", SCENE);
    write(
        "triangle.obj",
        "usemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    );
    // A file takes as much as is said; a pipe would stop the editor.
    let said = std::fs::File::create(path.join("said.txt")).expect("a file");
    let mut editor = Command::new("nvim")
        .args(["--headless", "-n", "-u", "NONE", "-i", "NONE", "-S"])
        .arg(root.join("tests/editor/session.lua"))
        .arg("+qa!")
        .env("IMPASTO", env!("CARGO_BIN_EXE_impasto"))
        .env("FOLDER", &path)
        // Copies of the library, and the log of the editor.
        .env("XDG_CACHE_HOME", path.join("cache"))
        .env("XDG_STATE_HOME", path.join("state"))
        .stdin(Stdio::null())
        .stdout(said.try_clone().expect("a file"))
        .stderr(said)
        .spawn()
        .expect("nvim");
    let begin = Instant::now();
    while editor.try_wait().expect("a state").is_none() {
        if begin.elapsed() > PATIENCE {
            editor.kill().expect("killed");
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let said = std::fs::read_to_string(path.join("said.txt")).expect("text");
    assert!(said.contains("DONE") && !said.contains("FAILED"), "{said}");
    let steps = said.matches("ok: ").count();
    assert_eq!(steps, 14, "{said}");
}
