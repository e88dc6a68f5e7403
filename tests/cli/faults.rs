//! What may befall a process: it is killed, the disk is full, a folder takes no files, nobody reads what it
//! prints, another works on the same file, files or the stack may not grow. A picture comes out with the bits
//! that it always has, or a clear refusal, and nothing half-written.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use impasto::runtime::film::file::FilmFile;
use impasto_fuzz::Random;

use crate::cli::common::{GOOD, Run, SCENE, command, folder, impasto, names, root, write};

/// A render that takes years unless it is killed.
const ENDLESS: &str = "--spp 100000000";

/// A scene whose kernels are made in no time.
const SMALL: &str = "camera = { position = [0, 0, 5], look_at = [0, 0, 0], fov = 40 }\n\
    environment.color = 1\n\
    geometry = [{ obj = 'triangle.obj' }]\n\
    materials.'*' = { file = 'plain.impasto' }\n";

/// Arguments of a small render, `{}` standing for the folder.
fn rendering(folder: &Path, arguments: &str) -> Vec<String> {
    let scene = folder.join("scene");
    if !scene.exists() {
        std::fs::create_dir(&scene).expect("a folder");
        write(&scene, "plain.impasto", GOOD);
        write(
            &scene,
            "triangle.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        );
        write(&scene, "scene.toml", SMALL);
    }
    let all = format!("render {{}}/scene/scene.toml --size 4x4 --device cpu {arguments}");
    let all = all.replace("{}", &folder.display().to_string());
    all.split_whitespace().map(str::to_owned).collect()
}

fn render(folder: &Path, arguments: &str) -> Run {
    let arguments = rendering(folder, arguments);
    impasto(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
}

fn start(folder: &Path, arguments: &str) -> Child {
    let arguments = rendering(folder, arguments);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    command(&arguments)
        .stderr(Stdio::null())
        .spawn()
        .expect("the command starts")
}

/// Runs the command in a shell that has done something before.
fn limited(before: &str, args: &[&str]) -> Run {
    let output = Command::new("sh")
        .args(["-c", &format!("{before}; exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_impasto"))
        .args(args)
        .current_dir(root())
        .output();
    output.expect("sh starts").into()
}

/// Samples of the checkpoint in a folder, which is whole whenever it is looked at.
fn kept(folder: &Path) -> u64 {
    let path = folder.join("c.film");
    if path.exists() {
        FilmFile::read(&path).expect("a whole checkpoint").samples()
    } else {
        0
    }
}

/// Waits until a render has kept more than `before` samples.
fn wait_for_more(folder: &Path, before: u64) {
    let begin = Instant::now();
    while kept(folder) <= before {
        let waited = begin.elapsed();
        assert!(waited < Duration::from_secs(300), "no checkpoint");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The moments are spread over starting, making kernels, sampling and writing.
#[test]
fn a_render_killed_at_fifty_moments_has_the_bits_of_one_that_was_not() {
    let halves: Vec<u32> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2)
            .map(|seed| scope.spawn(move || killed(25, seed)))
            .collect();
        let ended = threads.into_iter().map(|thread| thread.join());
        ended.map(|kept| kept.expect("a half passes")).collect()
    });
    eprintln!("of 25 runs, so many kept something before they were killed: {halves:?}");
}

/// Kills a render so many times, and compares what comes of it in the end. Gives how many of the runs had kept
/// something new.
fn killed(times: u32, seed: u64) -> u32 {
    let folder = folder();
    let at = folder.path();
    let keeping = "--checkpoint {}/c.film --checkpoint-every 0.01 --out {}/p.exr";
    let kill = |mut child: Child| {
        child.kill().expect("it is killed");
        child.wait().expect("it is gone");
    };
    let mut random = Random(seed);
    // The first run says how long a machine takes to the first checkpoint.
    let begin = Instant::now();
    let child = start(at, &format!("{ENDLESS} {keeping}"));
    wait_for_more(at, 0);
    let longest = begin.elapsed().as_millis() as usize * 3 / 2;
    kill(child);
    let mut runs = 1;
    for _ in 1..times {
        let before = kept(at);
        let child = start(at, &format!("{ENDLESS} {keeping}"));
        std::thread::sleep(Duration::from_millis(random.below(longest) as u64));
        kill(child);
        let now = kept(at);
        assert!(now >= before, "samples are lost");
        runs += u32::from(now > before);
    }
    let seen = kept(at);
    let spp = seen + 3;
    render(at, &format!("--spp {spp} {keeping}"))
        .exits(0)
        .says(&format!("going on from the {seen} samples"));
    // What runs left that were killed while they wrote is gone with the next that ends.
    assert_eq!(names(at), ["c.film", "p.exr", "p.png", "scene"]);
    render(at, &format!("--spp {spp} --out {{}}/whole.exr")).exits(0);
    let bytes = |name: &str| std::fs::read(at.join(name)).expect("a picture");
    assert_eq!(bytes("p.exr"), bytes("whole.exr"));
    assert_eq!(bytes("p.png"), bytes("whole.png"));
    runs
}

#[test]
fn a_second_render_on_a_checkpoint_is_refused_until_the_first_is_gone() {
    let folder = folder();
    let at = folder.path();
    let keeping = "--checkpoint {}/c.film --checkpoint-every 0.01";
    let mut first = start(at, &format!("{ENDLESS} {keeping} --out {{}}/a.exr"));
    wait_for_more(at, 0);
    let second = |arguments: &str| render(at, &format!("{arguments} {keeping} --out {{}}/b.exr"));
    second("--spp 4")
        .exits(75)
        .says("c.film` is in use by another process")
        .says("hint");
    // Reading it needs no lock: it is whole whenever it is read.
    let film = at.join("c.film").display().to_string();
    let out = at.join("m.png").display().to_string();
    impasto(&["merge", &film, "--out", &out]).exits(0);
    first.kill().expect("it is killed");
    first.wait().expect("it is gone");
    assert!(at.join("c.film.lock").exists());
    let spp = kept(at) + 1;
    second(&format!("--spp {spp}")).exits(0);
    assert_eq!(names(at), ["b.exr", "b.png", "c.film", "m.png", "scene"]);
}

#[test]
fn a_second_study_in_a_folder_is_refused_until_the_first_is_gone() {
    let folder = folder();
    let out = folder.path().join("study").display().to_string();
    let args = [
        "converge",
        SCENE,
        "--size",
        "4x4",
        "--max-spp",
        "16777216",
        "--out",
        &out,
    ];
    let mut first = command(&args)
        .stderr(Stdio::null())
        .spawn()
        .expect("the command starts");
    let begin = Instant::now();
    while !folder.path().join("study/cornell/study.json").exists() {
        assert!(begin.elapsed() < Duration::from_secs(300), "no study");
        std::thread::sleep(Duration::from_millis(5));
    }
    impasto(&args)
        .exits(75)
        .says("is in use by another process")
        .says("hint");
    first.kill().expect("it is killed");
    first.wait().expect("it is gone");
    // Who comes next is refused for what it asks for, and not for the one that is gone.
    let mut other = args;
    other[3] = "5x4";
    impasto(&other).exits(2).says("the size 4x4, not 5x4");
}

/// The limit comes with a signal that ends programs; the message is what it would be on a full disk.
#[test]
fn a_limit_on_the_size_of_files_is_an_error_and_no_death() {
    let folder = folder();
    let at = folder.path();
    let out = at.join("p.exr").display().to_string();
    let args = [
        "render", SCENE, "--size", "64x64", "--spp", "1", "--out", &out,
    ];
    limited("ulimit -f 8", &args)
        .exits(2)
        .says("cannot write")
        .says("p.exr")
        .says("`ulimit -f`");
    assert!(names(at).is_empty(), "{:?}", names(at));
    // The picture is a small PNG, the checkpoint is not: it is worth a warning, not the render.
    let (png, film) = (at.join("p.png"), at.join("c.film"));
    let (png, film) = (png.display().to_string(), film.display().to_string());
    let args = [
        "render", SCENE, "--size", "64x64", "--spp", "1", "--out", &png,
    ];
    let keeping = ["--checkpoint", &film];
    limited("ulimit -f 40", &[&args[..], &keeping].concat())
        .exits(0)
        .says("warning: no checkpoint")
        .says("`ulimit -f`");
    assert_eq!(names(at), ["p.png"]);
    // So is what a shell sends into a file.
    let printed = at.join("printed").display().to_string();
    let before = format!("ulimit -f 1; exec > '{printed}'");
    limited(&before, &["emit", "materials/asphalt.impasto"])
        .exits(2)
        .says("standard output");
}

/// A merge that cannot write says so by the name of the file, and leaves an older picture as it was.
#[test]
fn a_merge_without_room_leaves_what_was_there() {
    let folder = folder();
    let at = folder.path();
    let film = at.join("a.film").display().to_string();
    let size = ["--size", "64x64", "--spp", "1"];
    let part = ["render", SCENE, "--device", "cpu", "--out", &film];
    impasto(&[&part[..], &size].concat()).exits(0);
    for name in ["p.exr", "p.film", "p.png"] {
        let out = write(at, name, "old");
        limited("ulimit -f 2", &["merge", &film, "--out", &out])
            .exits(2)
            .says("cannot write")
            .says(name)
            .says("`ulimit -f`");
        assert_eq!(std::fs::read(at.join(name)).expect("a file"), b"old");
    }
    assert_eq!(names(at), ["a.film", "p.exr", "p.film", "p.png"]);
    for place in ["/proc/self/p.exr", "/proc/self/p.film"] {
        impasto(&["merge", &film, "--out", place])
            .exits(2)
            .says("cannot write")
            .says(place);
    }
    // Where it is said before anything is read, films need not even be there.
    impasto(&["merge", "none.film", "--out", "/proc/self/p.exr"])
        .exits(2)
        .says("/proc/self");
}

/// Merging takes the memory of one film, however many there are.
#[cfg(target_os = "linux")]
#[test]
fn the_memory_of_a_merge_does_not_grow_with_its_films() {
    let folder = folder();
    let at = folder.path();
    let mut films = Vec::new();
    for part in 0..48u32 {
        let film = at.join(format!("{part}.film")).display().to_string();
        let first = part.to_string();
        let size = ["--size", "256x256", "--spp", "1", "--samples-from", &first];
        let render = ["render", SCENE, "--device", "cpu", "--aov", "albedo,normal"];
        if part == 0 {
            impasto(&[&render[..], &size, &["--out", &film]].concat()).exits(0);
        } else {
            // The same sums as of another sample, which is rendered faster.
            let mut copy = FilmFile::read(&at.join("0.film")).expect("a film");
            copy.about.ranges[0].first = part.into();
            copy.about.asked[0].first = part.into();
            copy.write(film.as_ref()).expect("it is written");
        }
        films.push(film);
    }
    let bytes: u64 = films
        .iter()
        .map(|film| std::fs::metadata(film).expect("a film").len())
        .sum();
    // They would not fit.
    assert!(bytes / 1024 > 2 * MERGE_KIB, "{bytes} bytes");
    let out = at.join("p.film").display().to_string();
    let mut args = vec!["merge", "--samples", "0..48", "--out", &out];
    args.extend(films.iter().map(String::as_str));
    let (run, most) = with_memory(&args);
    run.exits(0).says("48 samples of 48 films");
    assert!((1..=MERGE_KIB).contains(&most), "{most} KiB");
}

/// Memory for the program and a small film.
#[cfg(target_os = "linux")]
const MERGE_KIB: u64 = 96 << 10;

/// What a run did, and the most memory that it had, in KiB, as the system told while it ran.
#[cfg(target_os = "linux")]
fn with_memory(args: &[&str]) -> (Run, u64) {
    let mut child = command(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0;
    while child.try_wait().expect("it is ours").is_none() {
        let status = std::fs::read_to_string(&status).unwrap_or_default();
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let peak = peak.and_then(|peak| peak.trim().strip_suffix(" kB"));
        most = peak.and_then(|peak| peak.parse().ok()).unwrap_or(most);
        std::thread::sleep(Duration::from_millis(1));
    }
    let output = child.wait_with_output();
    (output.expect("it has ended").into(), most)
}

#[test]
fn a_small_stack_is_enough() {
    let folder = folder();
    let at = folder.path();
    let deep = format!("{} 1.0 {}", "(".repeat(250), ")".repeat(250));
    let deep = write(at, "deep.impasto", GOOD.replace("0.5", &deep));
    limited("ulimit -s 256", &["check", &deep]).exits(0);
    limited("ulimit -s 256", &["cost", &deep]).exits(0);
    let out = at.join("p.exr").display().to_string();
    let args = [
        "render", SCENE, "--size", "4x4", "--spp", "2", "--out", &out,
    ];
    limited("ulimit -s 256", &args).exits(0);
    let whole = at.join("whole.exr").display().to_string();
    let mut args = args;
    args[7] = &whole;
    impasto(&args).exits(0);
    let bytes = |name: &str| std::fs::read(at.join(name)).expect("a picture");
    assert_eq!(bytes("p.exr"), bytes("whole.exr"));
}

/// Modes bind nobody who is root, as tests may be: these places take no file of anyone.
#[test]
fn places_that_take_no_file_are_refused_before_rendering() {
    let folder = folder();
    let at = folder.path();
    write(at, "file", "");
    let below = at.join("file/x").display().to_string();
    for place in ["/proc/self", &below] {
        let picture = format!("{place}/p.exr");
        for arguments in [
            format!("--out {picture}"),
            format!("--out {{}}/p.exr --report {place}/r.json"),
            format!("--out {{}}/p.exr --checkpoint {place}/c.film"),
        ] {
            let begin = Instant::now();
            let run = render(at, &format!("{ENDLESS} {arguments}"));
            run.exits(2).says("cannot write").says(place);
            assert!(begin.elapsed() < Duration::from_secs(60), "{arguments}");
        }
        let study = format!("{place}/study");
        impasto(&["converge", SCENE, "--out", &study])
            .exits(2)
            .says("cannot make the folder");
        let saved = format!("{place}/plan.json");
        impasto(&["plan", SCENE, "--save", &saved])
            .exits(2)
            .says("cannot write");
        impasto(&["new", &format!("{place}/m.impasto")])
            .exits(2)
            .says("cannot");
    }
    assert_eq!(names(at), ["file", "scene"]);
}

/// What each command prints, into a pipe that nobody reads, into a full disk, and into nothing at all.
#[test]
fn nobody_needs_to_listen() {
    let folder = folder();
    let at = folder.path();
    let good = write(at, "good.impasto", GOOD);
    let bad = write(at, "bad.impasto", GOOD.replace("0.5", "roughnes"));
    let commands: [(&[&str], i32); 7] = [
        (&["--help"], 0),
        (&["emit", &good], 0),
        (&["check", &bad], 1),
        (&["check", "--format", "json", &bad], 1),
        (&["explain"], 0),
        (&["cost", &good], 0),
        (&["completions", "bash"], 0),
    ];
    for (args, code) in commands {
        for closed in ["exec >&- 2>&-", "exec 2>/dev/full", "exec 2>&-"] {
            assert_eq!(limited(closed, args).code, code, "{closed}: {args:?}");
        }
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let status = command(args)
            .stdout(writer.try_clone().expect("the same pipe"))
            .stderr(writer)
            .status()
            .expect("the command starts");
        assert_eq!(status.code(), Some(code), "closed pipes: {args:?}");
    }
    limited("exec >/dev/full", &["emit", &good])
        .exits(75)
        .says("no space left on the device");
    let args = rendering(at, "--spp 2 --verbose --out {}/p.exr");
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let status = command(&args).stderr(writer).status();
    assert!(status.expect("the command starts").success());
    assert!(at.join("p.exr").exists());
}

/// Names of files are bytes, and not all of them are text.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_no_text_are_names() {
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let odd = folder.path().join(std::ffi::OsStr::from_bytes(b"\xff"));
    for args in [
        &["check"][..],
        &["render", "--out", "p.exr"],
        &["converge", "--out"],
    ] {
        let output = command(args)
            .arg(&odd)
            .output()
            .expect("the command starts");
        let run = Run::from(output);
        assert!(run.code == 1 || run.code == 2, "{args:?}: {run:#?}");
        assert!(!run.stderr.contains("panicked"), "{run:#?}");
    }
}
