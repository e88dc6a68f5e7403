//! Jobs on the cluster, and what may befall them.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use xtask::shell::{self, Result};

use super::cluster::wait;
use super::{Bench, Check};

pub(super) const CHECKS: &[(&str, Check)] = &[
    ("overhead", overhead),
    ("crash", crash),
    ("orphan", orphan),
    ("term", term),
    ("permanent", permanent),
    ("transient", transient),
    ("parts", parts),
    ("disk", disk),
    ("arrays", arrays),
];

fn submit(bench: &Bench, job: &Path) -> Result {
    bench
        .well(&["farm", "submit", &job.to_string_lossy()])
        .map(drop)
}

/// What the farm adds to a task on a cluster that has nothing else to do.
fn overhead(bench: &Bench) -> Result<String> {
    let samples = 24;
    let begin = Instant::now();
    for frame in 1..=2 {
        bench.render(frame, samples, "whole")?;
    }
    let alone = begin.elapsed().as_secs_f64();
    let job = bench.job("overhead", "1-6", samples, 1, &[])?;
    let begin = Instant::now();
    submit(bench, &job)?;
    let picture = |frame: u32| job.join(format!("pictures/glow.{frame:04}.png"));
    wait("pictures", Duration::from_secs(60), || {
        Ok((1..=6).all(|frame| picture(frame).exists()))
    })?;
    let all = begin.elapsed().as_secs_f64();
    bench.finish()?;
    bench.compare(&job, 1..=6, samples)?;
    let each = all / 12.0;
    let one = {
        let job = bench.job("one", "1", samples, 1, &[])?;
        let begin = Instant::now();
        submit(bench, &job)?;
        let path = job.join("pictures/glow.0001.png");
        wait("a picture", Duration::from_secs(60), || Ok(path.exists()))?;
        (begin.elapsed().as_secs_f64() - alone / 2.0).max(0.0) / 2.0
    };
    let most = 3.0;
    let render = alone / 2.0;
    if each > most || one > most {
        return Err(format!(
            "{each:.2} s a task of twelve, or {one:.2} s a task of two that follow each other: more than {most} s"
        ));
    }
    Ok(format!(
        "6 parts and 6 merges take {all:.2} s, {each:.2} s a task with its work; a part and its merge alone {one:.2} s \
         each beyond the render, which takes {render:.2} s"
    ))
}

/// A fault that comes after what it is to interrupt shows nothing. Machines get faster once others leave them alone, so
/// it is tried again with four times the samples.
fn in_time(fault: impl Fn(&str, u32) -> Result<Option<String>>) -> Result<String> {
    for (name, times) in [("in_time", 1), ("in_time_again", 4)] {
        if let Some(shown) = fault(name, times)? {
            return Ok(shown);
        }
    }
    Err("what was to be interrupted was done before, with four times the samples as well".into())
}

/// Two frames of three parts; the node of one is unplugged in the middle, and the controller is started again.
fn crash(bench: &Bench) -> Result<String> {
    in_time(|name, times| crash_in_time(bench, &format!("crash_{name}"), times))
}

fn crash_in_time(bench: &Bench, name: &str, times: u32) -> Result<Option<String>> {
    let samples = 3 * times * bench.seconds(3);
    let job = bench.job(name, "1-2", samples, 3, &[])?;
    submit(bench, &job)?;
    bench.refused(&["farm", "submit", name], 2, "is in the queue already")?;
    let node = bench.node_of(&job, 2, 1)?;
    bench.cluster.crash(&node)?;
    bench.cluster.restart_controller()?;
    bench.finish()?;
    bench.compare(&job, 1..=2, samples)?;
    let log = bench.log(&job, "render-2-1");
    let attempts = log.lines().filter(|line| line.starts_with("===")).count();
    if attempts < 2 {
        return Ok(None);
    }
    if !log.contains("going on from the") {
        return Err(format!("the task did not go on from its checkpoint: {log}"));
    }
    let from = log
        .lines()
        .rfind(|line| line.contains("going on from the"))
        .unwrap_or_default();
    Ok(Some(format!(
        "{node} was lost in mid-part and the controller started again; {}",
        from.split(" of `").next().unwrap_or(from)
    )))
}

/// A node's daemon is gone, and its task renders on beside the retry.
fn orphan(bench: &Bench) -> Result<String> {
    in_time(|name, times| orphan_in_time(bench, &format!("orphan_{name}"), times))
}

fn orphan_in_time(bench: &Bench, name: &str, times: u32) -> Result<Option<String>> {
    let samples = times * bench.seconds(22);
    let job = bench.job(name, "3", samples, 1, &[])?;
    submit(bench, &job)?;
    let node = bench.node_of(&job, 1, 1)?;
    bench.cluster.kill(&node)?;
    let log = || bench.log(&job, "render-1-1");
    wait("the retry", Duration::from_secs(60), || {
        Ok(log().matches("===").count() >= 2 || bench.queue()?.is_empty())
    })?;
    bench.finish()?;
    bench.compare(&job, 3..=3, samples)?;
    let engine: String = fs::read_dir(job.join("logs"))
        .map_err(|error| error.to_string())?
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with("slurm-"))
        .filter_map(|entry| fs::read_to_string(entry.path()).ok())
        .collect();
    // A machine that got faster meanwhile: the engine's second try found nothing to do.
    if engine.contains("render-1-1: done before") {
        return Ok(Some(format!(
            "{node} was given up, its orphan was done before the retry began, and the bytes are right"
        )));
    }
    if log().matches("===").count() < 2 {
        return Ok(None);
    }
    if !engine.contains("rendering beside it") {
        return Err(format!("nobody rendered beside the orphan: {engine}"));
    }
    Ok(Some(format!(
        "{node} was given up, its orphan and the retry rendered side by side, and the bytes are right"
    )))
}

/// A job is cancelled and submitted again.
fn term(bench: &Bench) -> Result<String> {
    let samples = bench.seconds(8);
    let job = bench.job("term", "4", samples, 1, &[])?;
    submit(bench, &job)?;
    bench.node_of(&job, 1, 1)?;
    std::thread::sleep(Duration::from_secs(2));
    bench.well(&["farm", "cancel", "term"])?;
    bench.finish()?;
    let state = fs::read_to_string(job.join("state/render-1-1.json")).unwrap_or_default();
    if !state.contains("\"stopped\"") {
        return Err(format!("the task did not end well: {state}"));
    }
    submit(bench, &job)?;
    bench.finish()?;
    bench.compare(&job, 4..=4, samples)?;
    let log = bench.log(&job, "render-1-1");
    let number = |line: &str| {
        line.split(|c: char| !c.is_ascii_digit())
            .find_map(|word| word.parse::<u32>().ok())
    };
    let written = log
        .lines()
        .find(|line| line.starts_with("wrote"))
        // Names of processors have brackets, too.
        .and_then(|line| line.split_once(" ("));
    let kept = log.lines().find(|line| line.starts_with("going on"));
    let (Some(kept), Some((_, written))) = (kept.and_then(number), written) else {
        return Err(format!("it did not go on: {log}"));
    };
    let had = number(written).unwrap_or(0);
    if had != kept || had >= samples {
        return Err(format!("it had {had} samples, and went on from {kept}"));
    }
    Ok(format!(
        "cancelled at {had} of {samples} samples, and went on from {kept}"
    ))
}

/// A value that the material does not take: its merge does not come, and the other picture does.
fn permanent(bench: &Bench) -> Result<String> {
    let job = bench.job("permanent", "1", 8, 2, &["--param", "wear=0.1,7,0.3"])?;
    submit(bench, &job)?;
    bench.finish()?;
    let is_there = |wear: &str| {
        job.join(format!("pictures/glow.wear={wear}.0001.exr"))
            .exists()
    };
    if [is_there("0.1"), is_there("7"), is_there("0.3")] != [true, false, true] {
        return Err("not the pictures of two values".into());
    }
    let status = bench.well(&["farm", "status", "permanent"])?;
    if !status.contains("2 failed") || job.join("logs/merge-2.log").exists() {
        return Err(format!(
            "its merge was begun, or nobody says what failed: {status}"
        ));
    }
    if bench.log(&job, "render-2-1").matches("===").count() != 1 {
        return Err("what will not work was tried again".into());
    }
    Ok("a picture whose parts fail for good has no merge, and the others are there".into())
}

/// A task that dies twice, and then works.
fn transient(bench: &Bench) -> Result<String> {
    let path = bench.folder.join("commands.txt");
    let script = "echo x >> tries.txt; [ $(wc -l < tries.txt) -ge 3 ] || kill -9 $$; echo worked";
    let text = format!("bash -c '{script}'\nemit glow.impasto --what tokens # of this program\n");
    fs::write(&path, text).map_err(|error| error.to_string())?;
    bench.well(&[
        "farm",
        "new",
        "--commands",
        "commands.txt",
        "--out",
        "transient",
    ])?;
    let job = bench.folder.join("transient");
    submit(bench, &job)?;
    bench.finish()?;
    let printed = fs::read_to_string(job.join("outputs/run-1.txt")).unwrap_or_default();
    let tries = bench.log(&job, "run-1").matches("===").count();
    if printed != "worked\n" || tries != 3 || !job.join("outputs/run-2.txt").is_file() {
        return Err(format!("{tries} tries printed `{printed}`"));
    }
    Ok("a task was killed twice and worked at its third try".into())
}

/// Parts that are not what they should be are refused by name, and what lacks is submitted again.
fn parts(bench: &Bench) -> Result<String> {
    let samples = 12;
    let job = bench.job("parts", "5", samples, 3, &["--gpus-per-task", "0"])?;
    bench.well(&["farm", "run", "parts", "--jobs", "2"])?;
    let film = |part: u32| job.join(format!("parts/1-{part}.film"));
    let read = |part| fs::read(film(part)).map_err(|error| error.to_string());
    let write =
        |part, bytes: &[u8]| fs::write(film(part), bytes).map_err(|error| error.to_string());
    let forget = || {
        for name in ["glow.0005.exr", "glow.0005.png"] {
            let _ = fs::remove_file(job.join("pictures").join(name));
        }
    };
    let whole = read(2)?;
    let mut flipped = whole.clone();
    let middle = flipped.len() / 2 + 8;
    flipped[middle] ^= 1;
    let merge = ["farm", "task", "parts", "merge-1"];
    for (bytes, says) in [
        (&whole[..whole.len() - 5], "1-2.film`: it is damaged"),
        (&flipped, "1-2.film`: it is damaged"),
        (&read(1)?, "1-2.film` is another's: it holds"),
        (b"", "1-2.film`: it is no film file"),
    ] {
        forget();
        write(2, bytes)?;
        bench.refused(&merge, 2, says)?;
    }
    forget();
    fs::remove_file(film(2))
        .or_else(|_| fs::remove_file(job.join("parts/1-2.film.damaged")))
        .map_err(|e| e.to_string())?;
    bench.refused(&merge, 2, "1-2.film` is missing")?;
    submit(bench, &job)?;
    bench.finish()?;
    bench.compare(&job, 5..=5, samples)?;
    Ok("parts that are cut, flipped, another's or missing are refused by name, and submitted again".into())
}

/// A disk that is full may be emptied, and one that takes nothing will not.
fn disk(bench: &Bench) -> Result<String> {
    let mount = bench.folder.join("disk");
    fs::create_dir_all(&mount).map_err(|error| error.to_string())?;
    let mounted = |options: &str| {
        let mut mount_it = std::process::Command::new("mount");
        shell::capture(
            mount_it
                .args(["-t", "tmpfs", "-o", options, "tmpfs"])
                .arg(&mount),
        )
    };
    if let Err(why) = mounted("size=1m") {
        return Ok(format!(
            "NOT CHECKED: no file system can be mounted here: {why}"
        ));
    }
    let checked = full_and_read_only(bench, &mount, &mounted);
    shell::capture(
        std::process::Command::new("umount")
            .arg("--lazy")
            .arg(&mount),
    )?;
    checked
}

fn full_and_read_only(
    bench: &Bench,
    mount: &Path,
    mounted: &dyn Fn(&str) -> Result<String>,
) -> Result<String> {
    let job = bench.job("disk/job", "6", 8, 2, &["--gpus-per-task", "0"])?;
    let filler = mount.join("filler");
    // It ends where the disk does; what a record and a log need is given back.
    let _ = fs::write(&filler, vec![0u8; 2 << 20]);
    let file = fs::OpenOptions::new()
        .write(true)
        .open(&filler)
        .map_err(|e| e.to_string())?;
    let length = file.metadata().map_err(|e| e.to_string())?.len();
    file.set_len(length.saturating_sub(24 << 10))
        .map_err(|e| e.to_string())?;
    drop(file);
    let task = ["farm", "task", "disk/job", "render-1-1"];
    bench.refused(&task, 75, "no space left on the device")?;
    fs::remove_file(&filler).map_err(|error| error.to_string())?;
    mounted("remount,ro")?;
    bench.refused(&task, 2, "the file system is read-only")?;
    bench.refused(
        &["farm", "run", "disk/job"],
        2,
        "the file system is read-only",
    )?;
    mounted("remount,rw")?;
    bench.well(&["farm", "run", "disk/job"])?;
    bench.compare(&job, 6..=6, 8)?;
    Ok(
        "a full disk is 75 and a read-only one 2, and the same job goes on once there is room"
            .into(),
    )
}

/// More tasks than an array may have.
fn arrays(bench: &Bench) -> Result<String> {
    let job = bench.job("arrays", "1-5", 2, 2, &[])?;
    bench.well(&["farm", "submit", "arrays", "--array-limit", "4"])?;
    let listed = fs::read_to_string(job.join("slurm/submitted.json")).unwrap_or_default();
    bench.finish()?;
    bench.compare(&job, 1..=5, 2)?;
    let arrays = listed.matches("\"job\"").count();
    if arrays != 6 {
        return Err(format!("{arrays} arrays: {listed}"));
    }
    shell::capture(bench.cluster.slurm("scontrol").arg("ping"))?;
    Ok(format!("15 tasks in {arrays} arrays of at most three"))
}
