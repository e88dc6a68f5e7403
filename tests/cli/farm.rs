//! `farm` without an engine: what `new` makes and refuses, tasks that are done once whatever they find, and runs here
//! that end with the bits of the undivided render. `cargo xtask farm` has the engines.

use std::path::Path;
use std::time::{Duration, SystemTime};

use impasto::runtime::film::file::FilmFile;

use crate::cli::common::{Run, command, folder, impasto, names, write};

/// A material that changes with its frame and a parameter.
const GLOW: &str = "use std::bsdf::diffuse;
use std::edf::uniform;
material glow {
    param wear: float = 0.1 in 0.0 .. 1.0;
    surface = diffuse(color(0.5 + 0.1 * wear));
    emission = uniform(color(0.1 * frame + time));
}
";

/// Options of every render.
const SMALL: &str = "--turntable 4 --size 16x16";

/// A folder with a material in it.
fn bench() -> tempfile::TempDir {
    let folder = folder();
    write(folder.path(), "glow.impasto", GLOW);
    folder
}

/// Runs the command in a folder, with the words of a line.
fn run(at: &Path, line: &str) -> Run {
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut command = command(&words);
    for name in ["SLURM_JOB_ID", "SLURM_CONF", "SLURMD_NODENAME"] {
        command.env_remove(name);
    }
    let output = command.current_dir(at).output();
    output.expect("the command starts").into()
}

/// Makes a job called `job`.
fn new(at: &Path, options: &str) {
    let line = format!(
        "farm new glow.impasto --out job {SMALL} --gpus-per-task 0 {options} -- --device cpu"
    );
    run(at, &line).exits(0).says("made `job`");
}

/// Fails unless a picture is what an undivided render makes.
fn compare(at: &Path, picture: &str, options: &str) {
    let line = format!("render glow.impasto {SMALL} --device cpu --out whole.exr {options}");
    run(at, &line).exits(0);
    let bytes = |name: &str| std::fs::read(at.join(name)).expect("a picture");
    for extension in ["exr", "png"] {
        let merged = bytes(&format!("job/pictures/{picture}.{extension}"));
        assert!(
            merged == bytes(&format!("whole.{extension}")),
            "{picture}.{extension}"
        );
    }
}

#[test]
fn a_job_that_runs_here_has_the_bits_of_undivided_renders() {
    let bench = bench();
    let at = bench.path();
    new(
        at,
        "--frames 2-4x2 --param wear=0.1,1 --spp 7 --parts 3 --seed 5 --aov albedo,depth",
    );
    assert_eq!(
        names(&at.join("job")),
        [
            "job.json",
            "logs",
            "parts",
            "pictures",
            "slurm",
            "state",
            "template.yaml"
        ]
    );
    assert_eq!(
        names(&at.join("job/slurm")),
        ["merge.sbatch", "task.sbatch"]
    );
    let json = run(at, "farm status job --format json").exits(0).json();
    assert_eq!((&json["tasks"], &json["missing"]), (&16.into(), &16.into()));
    run(at, "farm run job --jobs 2")
        .exits(0)
        .says("did 16 tasks of 16");
    for wear in ["0.1", "1"] {
        for frame in [2, 4] {
            compare(
                at,
                &format!("glow.wear={wear}.{frame:04}"),
                &format!("--frame {frame} --param wear={wear} --spp 7 --seed 5 --aov albedo,depth"),
            );
        }
    }
    let status = run(at, "farm status job").exits(0);
    assert!(
        status.stdout.contains("glow: 16 tasks: 16 done; 100 %"),
        "{status:?}"
    );
    assert!(status.stdout.contains("7/7  100  made"), "{status:?}");
    // What is done is not done again.
    run(at, "farm run job")
        .exits(0)
        .says("did 0 tasks of 16, 16 were done before");
    run(at, "farm task job render-1-1")
        .exits(0)
        .says("done before");
    assert!(
        !names(&at.join("job/parts"))
            .iter()
            .any(|name| name.contains("checkpoint"))
    );
}

/// Frames are rendered as one picture, and are those of `--frames`.
#[test]
fn one_frame_is_that_of_several() {
    let bench = bench();
    let at = bench.path();
    let small = format!("render glow.impasto {SMALL} --device cpu --spp 3");
    run(at, &format!("{small} --frames 3 --out several.exr")).exits(0);
    run(
        at,
        &format!("{small} --frame 3 --checkpoint c.film --out one.exr"),
    )
    .exits(0);
    let bytes = |name: &str| std::fs::read(at.join(name)).expect("a picture");
    assert!(bytes("several.0003.exr") == bytes("one.exr"));
    run(at, &format!("{small} --frame 2 --out other.exr")).exits(0);
    assert!(bytes("other.exr") != bytes("one.exr"));
    run(at, &format!("{small} --frame 3 --frames 3 --out a.exr"))
        .exits(2)
        .says("--frames");
    run(
        at,
        &format!("{small} --frame 3 --param wear=0,1 --out a.png"),
    )
    .exits(2)
    .says("no place for `--frame`");
    run(at, &format!("{small} --frame 1000001 --out a.png"))
        .exits(2)
        .says("1000000");
}

#[test]
fn what_makes_no_job_is_refused_before_anything_is_made() {
    let bench = bench();
    let at = bench.path();
    for (line, says) in [
        ("", "SCENE"),
        ("none.impasto", "cannot read `none.impasto`: no such file"),
        ("none.toml", "cannot read `none.toml`: no such file"),
        ("glow.impasto --frames 3-1", "end before they begin"),
        ("glow.impasto --param wear", "expected NAME=VALUE"),
        ("glow.impasto --param x.wear=1", "there is no `x`"),
        ("glow.impasto --parts 0", "--parts"),
        ("glow.impasto --minutes 0", "expected a number of minutes"),
        ("glow.impasto --rate 0", "above 0"),
        (
            "glow.impasto --parts 1 --on wall",
            "`render` does not take the options",
        ),
        (
            "glow.impasto --parts 1 -- --nonsense",
            "unexpected argument '--nonsense'",
        ),
        ("glow.impasto --parts 1 -- --until time=3s", "--until"),
        (
            "glow.impasto --parts 1 -- --samples-from 3",
            "--samples-from",
        ),
        (
            "glow.impasto --commands glow.impasto",
            "cannot be used with",
        ),
        ("--commands none.txt", "cannot read `none.txt`"),
    ] {
        run(at, &format!("farm new --out job {line}"))
            .exits(2)
            .says(says);
    }
    // What only rendering finds, measuring finds.
    run(
        at,
        "farm new glow.impasto --param wear=7 --out job -- --device cpu",
    )
    .exits(2)
    .says("wear");
    assert_eq!(names(at), ["glow.impasto"]);
    new(at, "--parts 1 --spp 1");
    run(at, "farm new glow.impasto --out job")
        .exits(2)
        .says("holds a job already")
        .says("hint");
    run(at, "farm run none")
        .exits(2)
        .says("cannot open the job `none`: no such file");
    run(at, "farm status .")
        .exits(2)
        .says("there is no job in")
        .says("hint: `impasto farm new");
}

#[test]
fn parts_are_as_long_as_is_asked_for() {
    let bench = bench();
    let at = bench.path();
    // 16 x 16 pixels and 75 samples are 19,200 paths: two minutes at 160 a second.
    let parts = |options: &str| {
        let line = format!(
            "farm new glow.impasto --out j --size 16x16 --spp 75 {options} -- --device cpu"
        );
        let run = run(at, &line).exits(0);
        let text = std::fs::read_to_string(at.join("j/job.json")).expect("a job");
        std::fs::remove_dir_all(at.join("j")).expect("removed");
        let job: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        (
            job["work"]["render"]["parts"]
                .as_array()
                .expect("parts")
                .len(),
            run.stderr,
        )
    };
    let (count, said) = parts("--rate 0.00016 --minutes 0.5");
    assert_eq!(count, 4);
    assert!(
        said.contains("1 picture of 16x16 and 75 samples in 4 parts each: 5 tasks"),
        "{said}"
    );
    assert!(said.contains("a part takes about 30 s"), "{said}");
    assert_eq!(parts("--rate 0.00016").0, 1);
    assert_eq!(parts("--parts 1000").0, 75);
    assert_eq!(parts("").0, 1, "measured here");
}

/// Whatever lies where a part or its checkpoint should be, a task ends with the part, and loses nothing of others.
#[test]
fn a_task_takes_no_film_for_another() {
    let bench = bench();
    let at = bench.path();
    new(at, "--frames 1 --spp 8 --parts 2");
    let part = |name: &str| at.join("job/parts").join(name);
    run(at, "farm task job render-1-1").exits(0);
    let good = std::fs::read(part("1-1.film")).expect("a film");
    let film = |options: &str| {
        let small = if options.contains("--size") {
            "--turntable 4"
        } else {
            SMALL
        };
        let line = format!(
            "render glow.impasto {small} --device cpu --frame 1 --out other.film {options}"
        );
        run(at, &line).exits(0);
        std::fs::read(at.join("other.film")).expect("a film")
    };
    let mut flipped = good.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 4;
    let cases = [
        (good[..good.len() / 2].to_vec(), "damaged"),
        (flipped, "damaged"),
        (b"IMPASTOF".to_vec(), "damaged"),
        (film("--spp 8"), "foreign"),
        (film("--spp 4 --samples-from 3"), "foreign"),
        (film("--spp 4 --seed 1"), "foreign"),
        (film("--spp 4 --size 8x8"), "foreign"),
    ];
    for (bytes, what) in &cases {
        for name in ["1-1.film", "1-1.checkpoint.film"] {
            std::fs::remove_file(part("1-1.film")).expect("removed");
            std::fs::write(part(name), bytes).expect("written");
            run(at, "farm task job render-1-1")
                .exits(0)
                .says(&format!("parts/{name}` is {what}, and is now"));
            let aside = part(&format!("{name}.{what}"));
            assert!(std::fs::read(&aside).expect("kept") == *bytes);
            std::fs::remove_file(aside).expect("removed");
            assert!(std::fs::read(part("1-1.film")).expect("a film") == good);
        }
    }
    // A part of fewer samples is begun.
    std::fs::write(part("1-1.checkpoint.film"), film("--spp 3")).expect("written");
    std::fs::remove_file(part("1-1.film")).expect("removed");
    run(at, "farm task job render-1-1").exits(0);
    let log = std::fs::read_to_string(at.join("job/logs/render-1-1.log")).expect("a log");
    assert!(log.contains("going on from the 3 samples"), "{log}");
    // A scene that was changed meanwhile is another one, and the films say so.
    write(at, "glow.impasto", GLOW.replace("0.5 +", "0.4 +"));
    run(at, "farm task job render-1-2").exits(0);
    run(at, "farm task job merge-1")
        .exits(2)
        .says("1-2.film")
        .says("the scene differs");
}

#[test]
fn a_merge_names_what_lacks_and_does_not_trust_clocks() {
    let bench = bench();
    let at = bench.path();
    new(at, "--frames 1 --spp 6 --parts 3");
    run(at, "farm task job merge-1")
        .exits(2)
        .says("1-1.film` is missing")
        .says("1-3.film` is missing")
        .says("hint");
    run(at, "farm run job").exits(0);
    let file = |name: &str| at.join("job").join(name);
    let set_time = |name: &str, time: SystemTime| {
        let opened = std::fs::OpenOptions::new()
            .write(true)
            .open(file(name))
            .expect("a file");
        opened.set_modified(time).expect("a time");
    };
    // Clocks of other machines: parts of the next century and a picture of the last one are still what they are.
    let day = Duration::from_secs(86_400);
    set_time("parts/1-1.film", SystemTime::UNIX_EPOCH + 40_000 * day);
    set_time("pictures/glow.0001.exr", SystemTime::UNIX_EPOCH + day);
    run(at, "farm task job merge-1")
        .exits(0)
        .says("done before");
    // Another picture is not ours, whatever its time.
    std::fs::write(file("pictures/glow.0001.exr"), "mine").expect("written");
    run(at, "farm task job merge-1")
        .exits(0)
        .says("merge-1: done\n");
    compare(at, "glow.0001", "--frame 1 --spp 6");
    // Parts may go once the picture is there.
    std::fs::remove_file(file("parts/1-2.film")).expect("removed");
    run(at, "farm run job").exits(0).says("did 0 tasks of 4");
    run(at, "farm task job render-1-2")
        .exits(0)
        .says("done before");
    std::fs::remove_file(file("pictures/glow.0001.exr")).expect("removed");
    run(at, "farm run job").exits(0).says("did 2 tasks of 4");
    compare(at, "glow.0001", "--frame 1 --spp 6");
}

#[test]
fn tasks_that_are_none_and_jobs_that_are_others_are_refused() {
    let bench = bench();
    let at = bench.path();
    new(at, "--frames 1-2 --spp 1 --parts 1");
    for id in ["render-3-1", "render-1-2", "merge-0", "run-1"] {
        run(at, &format!("farm task job {id}"))
            .exits(2)
            .says("has no task")
            .says("2 pictures of 1 parts");
    }
    run(at, "farm task job render")
        .exits(2)
        .says("expected `render-PICTURE-PART`");
    run(at, "farm task job merge-1 --digest 0123")
        .exits(2)
        .says("holds another job than was submitted");
    let path = at.join("job/job.json");
    let text = std::fs::read_to_string(&path).expect("a job");
    std::fs::write(&path, text.replace("\"seed\": 0", "\"seed\": 1")).expect("written");
    run(at, "farm task job render-1-1")
        .exits(2)
        .says("it was changed after it was made");
    std::fs::write(&path, "{").expect("written");
    run(at, "farm status job").exits(2).says("is no job");
}

/// What fails for good stops its picture alone; what may pass is tried again.
#[test]
fn a_picture_that_fails_stops_no_other() {
    let bench = bench();
    let at = bench.path();
    new(at, "--frames 1 --param wear=0.2,7,0.4 --spp 2 --parts 2");
    run(at, "farm run job --jobs 2")
        .exits(2)
        .says("2 tasks failed")
        .says("wear");
    let made = |wear: &str| {
        at.join(format!("job/pictures/glow.wear={wear}.0001.exr"))
            .exists()
    };
    assert_eq!(["0.2", "7", "0.4"].map(made), [true, false, true]);
    let status = run(at, "farm status job").exits(0).stdout;
    assert!(status.contains("6 done, 2 failed, 1 missing"), "{status}");
    assert!(status.contains("! render-2-1: "), "{status}");
}

#[cfg(unix)]
#[test]
fn commands_are_tasks_too() {
    let bench = bench();
    let at = bench.path();
    write(
        at,
        "commands.txt",
        "# what to do\nemit glow.impasto --what tokens\n\
         sh -c 'echo x >> tries; [ $(wc -l < tries) -ge 2 ] || exit 75; echo done'\nfalse\n",
    );
    run(
        at,
        "farm new --commands commands.txt --out job --gpus-per-task 0",
    )
    .exits(0)
    .says("3 tasks");
    run(at, "farm run job")
        .exits(2)
        .says("run-2: it failed; its log is")
        .says("restart 1 of 3")
        .says("1 task failed, such as run-3");
    let output = |number| {
        std::fs::read_to_string(at.join(format!("job/outputs/run-{number}.txt")))
            .expect("an output")
    };
    assert!(output(1).contains("material"), "{}", output(1));
    assert_eq!(output(2), "done\n");
    run(at, "farm run job")
        .exits(2)
        .says("did 0 tasks of 3, 2 were done before");
    // Words of this program are checked when the job is made.
    write(at, "commands.txt", "render glow.impasto --nonsense\n");
    run(at, "farm new --commands commands.txt --out other")
        .exits(2)
        .says("--nonsense");
    // A program that is not there is no reason to try again.
    write(at, "commands.txt", "no-such-program\n");
    run(at, "farm new --commands commands.txt --out missing")
        .exits(0)
        .says("there is no program `no-such-program` here");
    run(at, "farm task missing run-1")
        .exits(2)
        .says("cannot start `no-such-program`: no such file");
}

/// SIGTERM at a task reaches its render, which keeps what it has; a second try goes on from there.
#[cfg(unix)]
#[test]
fn a_task_that_is_asked_to_end_keeps_its_samples() {
    let bench = bench();
    let at = bench.path();
    new(at, "--frames 2 --spp 40000 --parts 1");
    let words = ["farm", "task", "job", "render-1-1"];
    let mut child = command(&words)
        .current_dir(at)
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the command starts");
    let film = at.join("job/parts/1-1.film");
    let log = at.join("job/logs/render-1-1.log");
    let begin = std::time::Instant::now();
    while !std::fs::read_to_string(&log).is_ok_and(|log| log.contains("render")) {
        assert!(begin.elapsed() < Duration::from_secs(60), "no log");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(700));
    let terminate = std::process::Command::new("kill")
        .arg(child.id().to_string())
        .status();
    assert!(terminate.expect("kill starts").success());
    let code = child.wait().expect("it ends").code();
    assert_eq!(code, Some(130));
    let about = FilmFile::about(&film).expect("a partial film");
    assert!(about.samples() < 40_000, "it was faster than the signal");
    let status = run(at, "farm status job").exits(0).stdout;
    assert!(
        status.contains(&format!("{}/40000", about.samples())),
        "{status}"
    );
    run(at, "farm task job merge-1")
        .exits(2)
        .says("1-1.film` is partial: it holds");
    let kept = FilmFile::about(&at.join("job/parts/1-1.checkpoint.film")).expect("a checkpoint");
    assert_eq!(kept.samples(), about.samples(), "nothing is lost");
}

#[cfg(unix)]
#[test]
fn without_slurm_its_commands_say_so() {
    let bench = bench();
    let at = bench.path();
    new(at, "--frames 1 --spp 1 --parts 1");
    for verb in ["submit", "cancel"] {
        let output = command(&["farm", verb, "job"])
            .current_dir(at)
            .env("PATH", "/nowhere")
            .output();
        Run::from(output.expect("the command starts"))
            .exits(2)
            .says("cannot start `squeue`: no such file")
            .says("impasto farm run");
    }
}

/// Lines that workers of OpenJD take, on standard output alone.
#[test]
fn progress_is_told_as_openjd_takes_it() {
    let bench = bench();
    let at = bench.path();
    let done = run(
        at,
        &format!(
            "render glow.impasto {SMALL} --device cpu --spp 2 --frame 1 --out p.png --progress openjd"
        ),
    );
    assert!(done.exits(0).stdout.ends_with("openjd_progress: 100.0\n"));
    let failed = run(at, "--progress openjd merge none.film --out p.png").exits(2);
    assert!(
        failed
            .stdout
            .starts_with("openjd_fail: cannot use the film `none.film`: "),
        "{failed:?}"
    );
    assert!(!failed.stdout.contains("100.0"));
    impasto(&["info", "--progress", "bar"])
        .exits(2)
        .says("openjd");
}
