//! Files that never end: FIFOs that nobody writes to and devices are refused by their kind, wherever a file is
//! named.

use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::cli::common::{GOOD, Run, command, folder, impasto, write};

/// A scene of one triangle; `{}` stands where something more may be named.
const SCENE: &str = r#"
[camera]
position = [0, 0, 5]
look_at = [0, 0, 0]
fov = 40
{}
[materials."*"]
file = "tinted.impasto"
params = { tint = "$Kd" }

[[lights]]
kind = "quad"
corner = [0, 3, 0]
u = [1, 0, 0]
v = [0, 0, 1]
radiance = [1, 2, 3]
"#;

const TINTED: &str = "use std::bsdf::diffuse;\n\
    material tinted { param tint: color = color(0.5); surface = diffuse(tint); }\n";

const TRIANGLE: &str = "usemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn make_fifo(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status();
    assert!(made.is_ok_and(|status| status.success()));
}

/// Plans a scene with `more` in its file.
fn planned(folder: &Path, more: &str) -> Run {
    write(folder, "tinted.impasto", TINTED);
    write(folder, "triangle.obj", TRIANGLE);
    write(folder, "with_mtl.obj", format!("mtllib pipe\n{TRIANGLE}"));
    let scene = write(folder, "scene.toml", SCENE.replace("{}", more));
    impasto(&["plan", &scene])
}

#[test]
fn a_fifo_is_refused_in_every_place_of_a_file() {
    let folder = folder();
    let at = folder.path();
    let pipe = at.join("pipe");
    make_fifo(&pipe);
    let pipe = pipe.display().to_string();
    for args in [
        &["check", &pipe][..],
        &["emit", &pipe],
        &["fmt", "--check", &pipe],
        &["plan", &pipe],
        &["render", &pipe, "--out", "x.exr"],
        &["merge", &pipe, "--out", "x.exr"],
    ] {
        let run = impasto(args);
        assert!(run.code == 1 || run.code == 2, "{args:?}: {run:#?}");
        run.says("it is a FIFO, which may never end");
    }
    let triangle = "[[geometry]]\nobj = \"triangle.obj\"\n";
    for more in [
        "[[geometry]]\nobj = \"pipe\"\n".to_owned(),
        "[[geometry]]\nobj = \"with_mtl.obj\"\n".to_owned(),
        "[[geometry]]\nobj = \"triangle.obj\"\nplacements = \"pipe\"\n".to_owned(),
        format!("{triangle}[environment]\nfile = \"pipe\"\n"),
    ] {
        planned(at, &more).exits(2).says("it is a FIFO");
    }
    planned(at, triangle).exits(0);
}

#[test]
fn devices_and_sockets_are_refused() {
    let folder = folder();
    let socket = folder.path().join("socket");
    let _listener = UnixListener::bind(&socket).expect("a socket");
    let socket = socket.display().to_string();
    impasto(&["check", "/dev/zero"])
        .exits(2)
        .says("it is a device");
    impasto(&["check", &socket]).exits(2).says("it is a socket");
}

/// Who names standard input means to wait for it.
#[test]
fn standard_input_is_read_by_its_name_as_a_file() {
    let mut child = command(&["check", "/dev/stdin"])
        .stdin(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut stdin, GOOD.as_bytes()).expect("written");
    drop(stdin);
    assert!(child.wait().expect("it ends").success());
}
