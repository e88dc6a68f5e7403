//! What a job is made of: its tasks, its names, its scripts and template, and what is submitted of it. All of it is
//! plain data; that engines take it, `cargo xtask farm` shows.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::job::*;
use super::slurm::{After, Array, arrays, scripts};
use super::*;
use crate::shot::frames::Frames;
use crate::shot::param;

fn render(pictures: usize, parts: u32, samples: u32) -> Render {
    let frames = Frames::parse(&format!("1-{pictures}")).expect("frames");
    Render {
        scene: "/shared/turn/scene.toml".into(),
        samples,
        parts: job::parts(samples, parts),
        size: (64, 48),
        options: Options::default(),
        estimate: None,
        pictures: job::pictures("turn", Some(frames), &[]).expect("pictures"),
    }
}

fn job(work: Work) -> Job {
    Job::new("turn".into(), "/usr/bin/impasto".into(), 2, work).expect("a job")
}

#[test]
fn samples_are_cut_evenly_and_none_is_lost() {
    for (samples, count, expected) in [
        (7, 3, vec![(0, 3), (3, 2), (5, 2)]),
        (4, 9, vec![(0, 1), (1, 1), (2, 1), (3, 1)]),
        (64, 1, vec![(0, 64)]),
        (64, 0, vec![(0, 64)]),
    ] {
        let parts = job::parts(samples, count);
        let parts: Vec<(u32, u32)> = parts.iter().map(|p| (p.first, p.count)).collect();
        assert_eq!(parts, expected);
    }
    let most = job::parts(u32::MAX, 1000);
    assert_eq!(
        most.iter().map(|p| u64::from(p.count)).sum::<u64>(),
        u64::from(u32::MAX)
    );
    assert!(
        most.windows(2)
            .all(|pair| pair[0].first + pair[0].count == pair[1].first)
    );
}

#[test]
fn parts_take_the_time_that_is_asked_for() {
    // A million pixels, a thousand samples, a million paths a second: a thousand seconds.
    let parts = |seconds| parts_of(1000, (1000, 1000), 1e6, seconds);
    assert_eq!(
        [parts(300.0), parts(100.0), parts(1e6), parts(0.01)],
        [4, 10, 1, 1000]
    );
    assert_eq!(parts_of(1, (1, 1), f64::MIN_POSITIVE, 1.0), 1);
}

#[test]
fn pictures_are_every_value_at_every_frame() {
    let params = [
        "wall.wear=0:1:3",
        "color=color(1, 0, 0),color(0, 0, 1)",
        "size=3 mm",
    ];
    let params: Vec<_> = params
        .iter()
        .map(|p| param::parse(p).expect("one"))
        .collect();
    let pictures = job::pictures("turn", Some(Frames::up_to(2)), &params).expect("pictures");
    assert_eq!(pictures.len(), 12);
    assert_eq!(
        pictures[3].name,
        "turn.wall.wear=0.5.color=color_1__0__0_.0002"
    );
    assert_eq!(pictures[3].frame, Some(2));
    assert_eq!(
        pictures[3].params,
        ["wall.wear=0.5", "color=color(1, 0, 0)", "size=3 mm"]
    );
    let names: BTreeSet<&str> = pictures.iter().map(|p| &*p.name).collect();
    assert_eq!(names.len(), 12, "names are apart");
    // Values as they are written are read as what they were.
    for picture in &pictures {
        for param in &picture.params {
            let again = param::parse(param).expect("a value");
            assert_eq!(again.values.len(), 1, "{param}");
        }
    }
    let one = job::pictures("turn", None, &[]).expect("a picture");
    assert_eq!((&*one[0].name, one[0].frame), ("turn", None));
    // What differs in nothing but what names cannot hold has a number instead.
    let odd = [param::parse("a=\"x/1\",\"x:1\"").expect("texts")];
    let odd = job::pictures("t", None, &odd).expect("pictures");
    assert_ne!(odd[0].name, odd[1].name);
    assert!(odd.iter().all(|p| !p.name.contains('/')), "{odd:?}");
    let many = Frames::parse("1-100000").expect("frames");
    let refused = job::pictures("t", Some(many), &params).expect_err("too many");
    assert!(refused.contains("at most 100000"), "{refused}");
}

#[test]
fn jobs_are_named_after_their_scenes() {
    for (scene, name) in [
        ("/a/cornell/scene.toml", "cornell"),
        ("/a/turn.toml", "turn"),
        ("/a/my glaze.impasto", "my_glaze"),
        ("std::surface::gltf_pbr", "gltf_pbr"),
        ("/scene.toml", "scene"),
    ] {
        assert_eq!(name_of(scene), name);
    }
}

#[test]
fn tasks_have_names_that_are_read_back() {
    for id in [Id::Part(2, 1), Id::Merge(48), Id::Run(7)] {
        assert_eq!(id.to_string().parse(), Ok(id));
    }
    for text in [
        "",
        "render",
        "render-1",
        "render-1-2-3",
        "merge-",
        "merge--1",
        "run-x",
        "run-+1",
        "merge-99999999999999999999999",
    ] {
        let refused = text.parse::<Id>().expect_err(text);
        assert!(
            refused.contains("expected `render-PICTURE-PART`"),
            "{refused}"
        );
    }
    let job = job(Work::Render(render(2, 3, 9)));
    let tasks: Vec<String> = job.tasks().iter().map(Id::to_string).collect();
    assert_eq!(
        tasks.join(" "),
        "render-1-1 render-1-2 render-1-3 merge-1 render-2-1 render-2-2 render-2-3 merge-2"
    );
    assert!(job.tasks().iter().all(|id| job.has(*id)));
    for id in [
        Id::Part(0, 1),
        Id::Part(3, 1),
        Id::Part(1, 4),
        Id::Merge(3),
        Id::Run(1),
    ] {
        assert!(!job.has(id), "{id}");
    }
    let refused = Job::new(
        "t".into(),
        "i".into(),
        1,
        Work::Render(render(2000, 999, 999)),
    );
    assert!(refused.expect_err("too many").contains("2000000 tasks"));
}

#[test]
fn command_lines_are_read_as_shells_read_them() {
    let own = |word: &str| word == "converge";
    let text = "# studies\nconverge a.toml --out 'my folder'\n\n./target/impasto plan b.toml --strategy exhaustive # slow\n\
                cargo experiments \"paper \\\"x\\\"\" a\\ b ''\n";
    let lines = job::lines(text, &own).expect("lines");
    let lines: Vec<(Option<&str>, Vec<&str>)> = lines
        .iter()
        .map(|line| {
            (
                line.program.as_deref(),
                line.words.iter().map(|w| &**w).collect(),
            )
        })
        .collect();
    assert_eq!(
        lines,
        [
            (None, vec!["converge", "a.toml", "--out", "my folder"]),
            (None, vec!["plan", "b.toml", "--strategy", "exhaustive"]),
            (Some("cargo"), vec!["experiments", "paper \"x\"", "a b", ""]),
        ]
    );
    for (text, why) in [
        ("", "no command"),
        ("# nothing", "no command"),
        ("a\nb 'c", "line 2: a quote (') has no end"),
        ("a > b", "line 1: `>` is for shells"),
        ("a $HOME", "`$` is for shells"),
    ] {
        let refused = job::lines(text, &own).expect_err(text);
        assert!(refused.contains(why), "{refused}");
    }
}

/// Every task once, and merges after the parts of their pictures.
fn check(lacking: &[Id], arrays: &[Array], limit: u32) {
    let mut seen: Vec<Id> = Vec::new();
    for (at, array) in arrays.iter().enumerate() {
        assert!(!array.elements.is_empty());
        assert!(
            array
                .elements
                .iter()
                .all(|element| (1..limit as usize).contains(element))
        );
        for (element, id) in array.tasks() {
            seen.push(id);
            let Id::Merge(picture) = id else { continue };
            let parts: BTreeSet<Id> = lacking
                .iter()
                .copied()
                .filter(|id| matches!(id, Id::Part(p, _) if *p == picture))
                .collect();
            let mut waits: BTreeSet<Id> = BTreeSet::new();
            if let Some((how, after)) = &array.after {
                assert!(
                    after.iter().all(|other| *other < at),
                    "it is submitted before"
                );
                for other in after {
                    let tasks = arrays[*other].tasks();
                    let same = |(other, _): &(usize, Id)| *how == After::All || *other == element;
                    waits.extend(tasks.filter(same).map(|(_, id)| id));
                }
            }
            assert_eq!(waits, parts, "{id}");
        }
    }
    let count = seen.len();
    let seen: BTreeSet<Id> = seen.into_iter().collect();
    assert_eq!(
        (count, seen),
        (lacking.len(), lacking.iter().copied().collect())
    );
}

#[test]
fn few_arrays_do_many_tasks() {
    for (pictures, parts, limit, expected) in [
        // A part of all pictures is an array, and so are all merges.
        (48, 3, 1001, 4),
        // All parts of a picture are an array, and its merge is one.
        (1, 100, 1001, 2),
        (2, 100, 1001, 4),
        // 2,000 parts, and beyond what one array holds.
        (2000, 1, 1001, 4),
        (1, 2000, 1001, 3),
        (40, 50, 1001, 80),
        (2500, 2, 1001, 9),
        (7, 2, 3, 12),
    ] {
        let tasks = job(Work::Render(render(pictures, parts, parts))).tasks();
        let arrays = arrays(&tasks, limit);
        assert_eq!(arrays.len(), expected, "{pictures} x {parts}");
        check(&tasks, &arrays, limit);
    }
    let lines = |count| (1..=count).map(Id::Run).collect::<Vec<_>>();
    assert_eq!(arrays(&lines(2000), 1001).len(), 2);
    assert_eq!(arrays(&[], 1001), []);
    let range = |numbers: &[usize]| {
        let tasks: Vec<Id> = numbers.iter().map(|n| Id::Run(*n)).collect();
        arrays(&tasks, 1001)[0].range()
    };
    assert_eq!(range(&[1, 2, 3, 7, 9, 10]), "1-3,7,9-10");
}

proptest! {
    /// Whatever lacks is submitted once, within the cluster's limit, and no merge comes before its parts.
    #[test]
    fn what_lacks_is_submitted(
        lacks in proptest::collection::vec(proptest::collection::vec(any::<bool>(), 4), 1..20),
        limit in 2u32..12,
    ) {
        let mut tasks = Vec::new();
        for (at, parts) in lacks.iter().enumerate() {
            let parts = parts.iter().enumerate().filter(|(_, lacks)| **lacks);
            tasks.extend(parts.map(|(part, _)| Id::Part(at + 1, part + 1)));
            tasks.push(Id::Merge(at + 1));
        }
        check(&tasks, &arrays(&tasks, limit), limit);
    }
}

/// The digest depends on the program's version, which changes.
fn steady(text: &str, job: &Job) -> String {
    text.replace(&job.digest, "DIGEST")
        .replace(&job.digest[..12], "DIGEST")
}

#[test]
fn scripts_are_what_people_read() {
    let folder = Folder {
        root: PathBuf::from("/shared/job 100%"),
    };
    let job = job(Work::Render(render(48, 2, 64)));
    let scripts = scripts(&job, &folder);
    let names: Vec<&str> = scripts.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["task.sbatch", "merge.sbatch"]);
    insta::assert_snapshot!("task.sbatch", steady(&scripts[0].1, &job));
    assert!(scripts[0].1.contains("#SBATCH --gres=gpu:2\n"));
    assert!(!scripts[1].1.contains("--gres"), "merges need no GPU");
}

#[test]
fn the_template_is_of_openjd() {
    let job = job(Work::Render(render(48, 1, 64)));
    insta::assert_snapshot!("template.yaml", steady(&openjd::template(&job), &job));
}

#[test]
fn a_job_that_was_changed_or_is_none_is_refused() {
    let at = tempfile::tempdir().expect("a folder");
    let path = at.path().join("job");
    let refused = |path: &Path| {
        let folder = Folder::open(path).expect("a folder");
        Job::read(&folder).expect_err("refused").to_string()
    };
    assert!(refused(at.path()).contains("there is no job in"));
    let job = job(Work::Render(render(2, 2, 8)));
    let folder = Folder::make(&path, &job).expect("made");
    assert_eq!(Job::read(&folder), Ok(job.clone()));
    let again = Folder::make(&path, &job).expect_err("there is one");
    assert!(again.to_string().contains("holds a job already"), "{again}");
    let text = std::fs::read_to_string(folder.job()).expect("text");
    for (from, to, why) in [
        (
            "\"samples\": 8",
            "\"samples\": 9",
            "it was changed after it was made",
        ),
        ("\"format\": 1", "\"format\": 2", "it is of version 2"),
        ("\"work\"", "\"play\"", "missing field `work`"),
        ("}", "", "is no job"),
    ] {
        std::fs::write(folder.job(), text.replacen(from, to, 1)).expect("written");
        assert!(refused(&path).contains(why), "{}", refused(&path));
    }
}
