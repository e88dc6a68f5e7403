//! `render` of material files, with values for parameters, as sweeps, frame by frame, and at each save.

use std::path::Path;

use crate::cli::common::{GOOD, SCENE, command, folder, impasto, names, write};

/// A material of one color, which may be any.
const PAINT: &str = "use std::bsdf::diffuse;
use std::edf::uniform;

material paint {
    param color: color = color(0.5) in 0.0 .. 1.0;
    param size: length = 1 mm in 1 um .. 1 m;
    param wear: float = 0.0 in 0.0 .. 1.0;
    surface = diffuse(color * (1.0 - wear) * (size / 1 m));
    emission = uniform(color * (1.0 - wear));
}
";

/// A material that glows more with each frame.
const GLOW: &str = "use std::edf::uniform;
material glow { emission = uniform(color(0.1 * frame + time)); }
";

/// Renders quickly with more arguments.
fn render(file: &str, out: &Path, more: &[&str]) -> crate::cli::common::Run {
    let out = out.display().to_string();
    let mut args = vec!["render", file, "--size", "24x24", "--spp", "1"];
    args.extend(["--out", &out]);
    args.extend(more);
    impasto(&args)
}

fn pixels(path: &Path) -> image::RgbImage {
    image::open(path).expect("a picture").to_rgb8()
}

#[test]
fn a_material_file_makes_a_picture_on_each_set() {
    let folder = folder();
    let file = write(folder.path(), "paint.impasto", PAINT);
    let mut seen = Vec::new();
    for on in ["ball", "cloth", "plane"] {
        let out = folder.path().join(format!("{on}.png"));
        render(&file, &out, &["--on", on])
            .exits(0)
            .says(&out.display().to_string());
        let picture = pixels(&out);
        assert!(!seen.contains(&picture), "{on} looks like another");
        seen.push(picture);
    }
    let out = folder.path().join("std.png");
    render("std::bsdf::diffuse", &out, &[]).exits(1);
    render("std::surface::gltf_pbr", &out, &[]).exits(0);
}

#[test]
fn a_picture_is_called_as_the_file_where_nobody_says() {
    let folder = folder();
    write(folder.path(), "paint.impasto", PAINT);
    let mut command = crate::cli::common::command(&[]);
    command.args(["render", "paint.impasto", "--size", "8x8", "--spp", "1"]);
    let output = command.current_dir(folder.path()).output();
    let run: crate::cli::common::Run = output.expect("it runs").into();
    run.exits(0).says("wrote paint.png");
    assert_eq!(names(folder.path()), ["paint.impasto", "paint.png"]);
}

#[test]
fn of_several_materials_one_is_named() {
    let folder = folder();
    let two = format!("{PAINT}\nmaterial other {{ surface = diffuse(color(0.1)); }}\n");
    let file = write(folder.path(), "two.impasto", two);
    let out = folder.path().join("p.png");
    render(&file, &out, &[])
        .exits(1)
        .says("one of `paint`, `other`")
        .says("--material NAME");
    render(&file, &out, &["--material", "otter"])
        .exits(1)
        .says("did you mean `other`?");
    render(&file, &out, &["--material", "other"]).exits(0);
}

#[test]
fn files_that_are_no_materials_are_refused() {
    let folder = folder();
    let out = folder.path().join("p.png");
    render("missing.impasto", &out, &[])
        .exits(2)
        .says("cannot read `missing.impasto`: no such file or folder");
    let broken = write(folder.path(), "broken.impasto", "material m {");
    render(&broken, &out, &[]).exits(1).says("E0108");
    let is_folder = folder.path().join("f.impasto");
    std::fs::create_dir(&is_folder).expect("a folder");
    render(&is_folder.display().to_string(), &out, &[])
        .exits(2)
        .says("it is a folder");
    // The command names file and material: no line of the built-in set is to blame.
    let whole = write(folder.path(), "whole.impasto", PAINT);
    let missing = render(&whole, &out, &["--material", "other"]);
    assert!(!missing.stderr.contains("ball:"), "{missing:#?}");
    missing.exits(1).says("has no material `other`");
    std::fs::remove_file(&whole).expect("removed");
    render(&broken, &out, &["--skip-existing"])
        .exits(2)
        .says("required arguments were not provided");
    let shader = write(folder.path(), "a.osl", "shader a() { }");
    render(&shader, &out, &[])
        .exits(2)
        .says("scenes are `.toml`, glTF (`.gltf`, `.glb`) and USD files");
    std::fs::remove_file(&shader).expect("removed");
    for option in [["--on", "ball"], ["--material", "m"], ["--turntable", "3"]] {
        render(SCENE, &out, &option)
            .exits(2)
            .says("is for material files");
    }
    assert_eq!(names(folder.path()), ["broken.impasto", "f.impasto"]);
}

#[test]
fn parameters_take_what_scenes_take() {
    let folder = folder();
    let file = write(folder.path(), "paint.impasto", PAINT);
    let of = |name: &str, params: &[&str]| {
        let out = folder.path().join(name);
        let params = params.iter().flat_map(|p| ["--param", p]);
        let more: Vec<&str> = params.collect();
        render(&file, &out, &more).exits(0);
        pixels(&out)
    };
    let plain = of("a.png", &[]);
    assert_eq!(plain, of("b.png", &["color=0.5"]));
    assert_ne!(plain, of("c.png", &["color=srgb(0x8c1010)"]));
    assert_eq!(
        of("d.png", &["color=[0.2, 0.4, 0.6]", "size=500 mm"]),
        of("e.png", &["size=0.5 m", "color=color(0.2, 0.4, 0.6)"])
    );
}

#[test]
fn values_that_do_not_fit_are_told_with_their_option() {
    let folder = folder();
    let file = write(folder.path(), "paint.impasto", PAINT);
    let out = folder.path().join("p.png");
    let refused = |param: &str, code: i32, text: &str| {
        render(&file, &out, &["--param", param])
            .exits(code)
            .says(text);
    };
    refused(
        "colour=1",
        1,
        "--param colour: material `paint` has no parameter `colour`",
    );
    refused("colour=1", 1, "did you mean `color`?");
    refused("color=2", 1, "--param color:1:1");
    refused("wear=nan", 1, "unknown name `nan`");
    refused("size=0.2", 1, "--param size");
    refused("paint.wear=0", 2, "write `--param wear=...`");
    refused("time=1", 1, "has no parameter `time`");
    refused("wear", 2, "expected NAME=VALUE");
    refused("wear=0:1", 2, "expected FROM:TO:COUNT");
    refused("wear=0:1:1000000", 2, "2 to 256 steps, not 1000000");
    render(&file, &out, &["--param", "wear=0", "--param", "wear=1"])
        .exits(2)
        .says("is there twice");
    assert_eq!(names(folder.path()), ["paint.impasto"]);
}

#[test]
fn parameters_of_scenes_are_those_of_bindings() {
    let folder = folder();
    let out = folder.path().join("p.png");
    render(SCENE, &out, &["--param", "color=1"])
        .exits(2)
        .says("a parameter of which material?");
    render(SCENE, &out, &["--param", "wal.color=1"])
        .exits(2)
        .says("--param wal.color: the scene has no material `wal`");
    render(SCENE, &out, &["--param", "red.roughness=1"])
        .exits(1)
        .says("--param red.roughness");
    let plain = folder.path().join("plain.png");
    render(SCENE, &plain, &[]).exits(0);
    render(SCENE, &out, &["--param", "red.albedo=[0, 0, 1]"]).exits(0);
    assert_ne!(pixels(&plain), pixels(&out));
    // Where there is one binding, its name says nothing more.
    write(folder.path(), "paint.impasto", PAINT);
    write(folder.path(), "quad.obj", QUAD);
    let one = write(folder.path(), "one.toml", MOVING);
    render(&one, &plain, &["--param", "wall.wear=0.75"]).exits(0);
    render(&one, &out, &["--param", "wear=0.75"]).exits(0);
    assert_eq!(pixels(&plain), pixels(&out));
}

#[test]
fn sweeps_make_sheets() {
    let folder = folder();
    let file = write(folder.path(), "paint.impasto", PAINT);
    let out = folder.path().join("s.exr");
    let sweep = ["--param", "wear=0:1:3", "--param", "color=0.2,0.9"];
    render(&file, &out, &sweep).exits(0);
    assert_eq!(names(folder.path()), ["paint.impasto", "s.exr", "s.png"]);
    let sheet = pixels(&folder.path().join("s.png"));
    // Three pictures and four margins wide, two high with two lines of text below each.
    assert_eq!(sheet.dimensions(), (3 * 24 + 4 * 8, 8 + 2 * (24 + 28 + 8)));
    // Each picture is the one that a render of its own makes: that of the full wear and the bright color.
    let alone = folder.path().join("a.png");
    render(
        &file,
        &alone,
        &["--param", "wear=1", "--param", "color=0.9"],
    )
    .exits(0);
    let alone = pixels(&alone);
    let (left, top) = (8 + 2 * 32, 8 + 60);
    for (x, y, pixel) in alone.enumerate_pixels() {
        assert_eq!(sheet.get_pixel(left + x, top + y), pixel, "at {x}, {y}");
    }
}

#[test]
fn sheets_that_cannot_be_are_refused_before_anything_is_rendered() {
    let folder = folder();
    let file = write(folder.path(), "paint.impasto", PAINT);
    let out = folder.path().join("s.png");
    let refused = |more: &[&str], text: &str| {
        render(&file, &out, more).exits(2).says(text);
    };
    let (a, b, c) = ("wear=0:1:200", "color=0:1:200", "size=1 mm:9 mm:3");
    refused(
        &["--param", a, "--param", b],
        "a sheet of 40000 pictures is too large",
    );
    refused(
        &["--param", a, "--param", b, "--param", c],
        "at most two parameters",
    );
    let large = [
        "render",
        &file,
        "--size",
        "4000x4000",
        "--param",
        "wear=0:1:250",
    ];
    impasto(&large)
        .exits(2)
        .says("ask for fewer or for smaller");
    refused(&["--param", c, "--aov", "albedo"], "no place for --aov");
    for more in [["--param", c], ["--frames", "1-2"], ["--on", "ball"]] {
        let watch = (more[0] == "--on").then_some("--watch");
        let options = more.into_iter().chain(["--strategy", "own"]).chain(watch);
        refused(
            &options.collect::<Vec<_>>(),
            "`--strategy` is for one picture",
        );
    }
    refused(
        &["--param", c, "--frames", "1-2"],
        "a sweep makes one sheet",
    );
    // One step that does not fit is an error of all.
    render(&file, &out, &["--param", "wear=0:2:3"])
        .exits(1)
        .says("outside its range");
    assert_eq!(names(folder.path()), ["paint.impasto"]);
}

#[test]
fn frames_are_numbered_files_and_tell_materials_the_time() {
    let folder = folder();
    let file = write(folder.path(), "glow.impasto", GLOW);
    let out = folder.path().join("g.png");
    render(&file, &out, &["--frames", "1-5x2"])
        .exits(0)
        .says("wrote 3 frames");
    assert_eq!(
        names(folder.path()),
        ["g.0001.png", "g.0003.png", "g.0005.png", "glow.impasto"]
    );
    let brightness = |name: &str| -> u64 {
        let picture = pixels(&folder.path().join(name));
        picture.pixels().map(|p| u64::from(p.0[0])).sum()
    };
    assert!(brightness("g.0001.png") < brightness("g.0003.png"));
    assert!(brightness("g.0003.png") < brightness("g.0005.png"));
    std::fs::write(folder.path().join("g.0003.png"), "mine").expect("written");
    render(&file, &out, &["--frames", "1-5x2", "--skip-existing"]).exits(0);
    let kept = std::fs::read(folder.path().join("g.0003.png")).expect("it is there");
    assert_eq!(kept, b"mine");
    for (frames, text) in [
        ("0", "wrote 1 frame"),
        ("3-1", "the frames end before they begin"),
        ("1-9999999", "beyond the last, 1000000"),
        ("0-1000000", "too many for one run"),
        ("-5", "unexpected argument"),
        ("1-", "expected frames"),
    ] {
        let run = render(&file, &folder.path().join("x.png"), &["--frames", frames]);
        let code = if frames == "0" { 0 } else { 2 };
        run.exits(code).says(text);
    }
}

/// A quad before a camera that goes around it, and a wall of a material with keys.
const MOVING: &str = r#"
[camera]
position = [0, 0, 3]
look_at = [0, 0, 0]
fov = 30
turntable = 4
[animation]
frames_per_second = 10
[[geometry]]
file = "quad.obj"
material = "wall"
keys = { rotate = [[0, [0, 0, 0]], [8, [0, 360, 0]]] }
[materials.wall]
file = "paint.impasto"
keys = { wear = [[1, 0.0], [3, 1.0]], color = [[0, [1, 0, 0]], [4, [1, 0, 0]]] }
[environment]
color = 0
"#;

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

#[test]
fn keys_and_turntables_move_scenes() {
    let folder = folder();
    write(folder.path(), "paint.impasto", PAINT);
    write(folder.path(), "quad.obj", QUAD);
    let scene = write(folder.path(), "scene.toml", MOVING);
    let out = folder.path().join("m.png");
    render(&scene, &out, &["--frames", "0-4"]).exits(0);
    let lit = |frame: u32| {
        let picture = pixels(&folder.path().join(format!("m.{frame:04}.png")));
        let centre = picture.get_pixel(12, 12).0;
        assert_eq!(centre[1], 0, "frame {frame} is {centre:?}");
        centre[0]
    };
    // The camera goes around twice as fast as the wall turns: it sees its edge in frame 2, and its back in frame 4.
    assert_eq!((lit(0), lit(4)), (255, 0));
    assert!(lit(1) > lit(2), "{} and {}", lit(1), lit(2));
    assert_eq!(lit(3), 0);
}

/// A ball of marble is turned by 90 degrees, and the camera with it: the picture stays. Without the camera it changes.
#[test]
fn marble_turns_with_its_ball() {
    let folder = folder();
    let at = folder.path();
    let mut new = command(&["new", "starter", "--scene"]);
    assert!(
        new.current_dir(at)
            .output()
            .expect("it runs")
            .status
            .success()
    );
    let marble = concat!(env!("CARGO_MANIFEST_DIR"), "/materials/marble.impasto");
    let picture = |name: &str, camera: [f32; 3], turn: u32| {
        let text = format!(
            "[camera]\nposition = {camera:?}\nlook_at = [0, 0, 0]\nfov = 30\n\
             [[geometry]]\nobj = \"starter/ball.obj\"\nrotate = [0, {turn}, 0]\nmaterial = \"ball\"\n\
             [materials.ball]\nfile = {marble:?}\n[environment]\ncolor = 0.8\n"
        );
        let scene = write(at, "scene.toml", text);
        let out = at.join(name);
        let size = ["--size", "24x24", "--spp", "64"];
        impasto(
            &[
                &["render", &scene, "--out", &out.display().to_string()],
                &size[..],
            ]
            .concat(),
        )
        .exits(0);
        pixels(&out)
    };
    let front = picture("front.png", [0.0, 0.0, 0.5], 0);
    let with_camera = picture("with.png", [0.5, 0.0, 0.0], 90);
    let without = picture("without.png", [0.0, 0.0, 0.5], 90);
    let distance = |a: &image::RgbImage, b: &image::RgbImage| {
        let each = a
            .iter()
            .zip(b.iter())
            .map(|(a, b)| f64::from(a.abs_diff(*b)));
        each.sum::<f64>() / a.len() as f64
    };
    let (same, other) = (distance(&front, &with_camera), distance(&front, &without));
    assert!(same < 2.0 && other > 3.0 * same, "{same} {other}");
}

#[test]
fn keys_that_make_no_sense_are_told_with_their_place() {
    let folder = folder();
    write(folder.path(), "paint.impasto", PAINT);
    write(folder.path(), "quad.obj", QUAD);
    let out = folder.path().join("m.png");
    for (from, to, text) in [
        (
            "turntable = 4",
            "turntable = 0",
            "`turntable` of [camera] must be an integer from 1",
        ),
        ("= 10", "= 0", "must be a number above 0"),
        ("= 10", "= nan", "must be a number above 0"),
        (
            "[[1, 0.0], [3, 1.0]]",
            "[[3, 0.0], [1, 1.0]]",
            "1 does not come after the frame before it",
        ),
        ("[[1, 0.0], [3, 1.0]]", "[]", "must be keys"),
        (
            "[[1, 0.0], [3, 1.0]]",
            "[[nan, 0.0]]",
            "must be a frame's number",
        ),
        (
            "[[1, 0.0], [3, 1.0]]",
            "[[1, true], [3, 0.5]]",
            "there is nothing between",
        ),
        ("[3, 1.0]", "[3]", "must be a frame and a value"),
        ("rotate =", "turn =", "has no key `turn`"),
        ("wear =", "wears =", "has no parameter `wears`"),
    ] {
        let text_of_scene = MOVING.replace(from, to);
        assert_ne!(text_of_scene, MOVING, "{from}");
        let scene = write(folder.path(), "scene.toml", text_of_scene);
        let run = render(&scene, &out, &["--frames", "2"]);
        let code = if from == "wear =" { 1 } else { 2 };
        run.exits(code).says(text);
    }
}

#[test]
fn time_is_an_input_of_materials_alone() {
    let folder = folder();
    let text = "use std::bsdf::diffuse;
        fn f(x: float) -> float { x * time }
        material m { surface = diffuse(color(f(1.0))); }";
    let file = write(folder.path(), "m.impasto", text);
    impasto(&["check", &file])
        .exits(1)
        .says("functions see no surface: make `time` a parameter and pass it");
    let glow = write(folder.path(), "glow.impasto", GLOW);
    let at = |at: &str| impasto(&["eval", &glow, "--at", at]);
    assert!(at("time=2, frame=10").exits(0).stdout.contains('3'));
    at("time=nan").exits(2).says("must be finite");
    at("frame=inf").exits(2).says("must be finite");
    // A name of the author's own goes first.
    let own = "use std::bsdf::diffuse;
        material m { param time: float = 0.5; surface = diffuse(color(time)); }";
    let own = write(folder.path(), "own.impasto", own);
    impasto(&["check", &own]).exits(0);
    // What does not use it carries nothing of it.
    let plain = write(folder.path(), "plain.impasto", GOOD);
    let ir = impasto(&["emit", &plain, "--what", "ir"]).exits(0).stdout;
    assert!(!ir.contains("input"), "{ir}");
    let ir = impasto(&["emit", &glow, "--what", "ir"]).exits(0).stdout;
    assert!(ir.contains("time: float = 0.0 input"), "{ir}");
}

#[cfg(unix)]
mod watching {
    use std::io::{BufRead, BufReader};
    use std::process::{Child, ChildStderr, Stdio};
    use std::time::{Duration, Instant};

    use super::*;
    use crate::cli::common::command;

    /// A command that renders at each save, and what it says.
    struct Watcher {
        child: Child,
        said: std::sync::mpsc::Receiver<String>,
    }

    impl Watcher {
        fn of(file: &str, out: &Path, more: &[&str]) -> Self {
            let out = out.display().to_string();
            let mut args = vec!["render", file, "--watch", "--size", "16x16", "--spp", "1"];
            args.extend(["--out", &out]);
            args.extend(more);
            let mut child = command(&args)
                .stderr(Stdio::piped())
                .spawn()
                .expect("it starts");
            let (tell, said) = std::sync::mpsc::channel();
            let stderr: ChildStderr = child.stderr.take().expect("a pipe");
            std::thread::spawn(move || {
                let lines = BufReader::new(stderr).lines();
                lines
                    .map_while(Result::ok)
                    .try_for_each(|line| tell.send(line))
            });
            Self { child, said }
        }

        /// Waits until it says `text`.
        #[track_caller]
        fn says(&self, text: &str) {
            let (begin, mut all) = (Instant::now(), Vec::new());
            while begin.elapsed() < Duration::from_secs(60) {
                let Ok(line) = self.said.recv_timeout(Duration::from_secs(60)) else {
                    break;
                };
                if line.contains(text) {
                    return;
                }
                all.push(line);
            }
            panic!("`{text}` is not in {all:#?}");
        }

        /// Ends it as Ctrl-C does; its exit code.
        fn end(mut self) -> Option<i32> {
            let id = self.child.id().to_string();
            let sent = std::process::Command::new("kill")
                .args(["-INT", &id])
                .status();
            assert!(sent.expect("kill runs").success());
            self.child.wait().expect("it ends").code()
        }
    }

    impl Drop for Watcher {
        fn drop(&mut self) {
            let _ = self.child.kill();
        }
    }

    #[test]
    fn pictures_follow_files() {
        let folder = folder();
        let file = write(folder.path(), "paint.impasto", PAINT);
        let out = folder.path().join("p.png");
        let watcher = Watcher::of(&file, &out, &[]);
        watcher.says("wrote");
        let first = std::fs::read(&out).expect("a picture");
        write(
            folder.path(),
            "paint.impasto",
            PAINT.replace("color(0.5)", "color(1.0, 0.0, 0.0)"),
        );
        watcher.says("wrote");
        let second = std::fs::read(&out).expect("a picture");
        assert_ne!(first, second);
        // Half a file, then no file, then a folder: each is told, and the picture stays.
        write(folder.path(), "paint.impasto", &PAINT[..PAINT.len() / 2]);
        watcher.says("error[E");
        watcher.says("the last picture stays");
        std::fs::remove_file(&file).expect("removed");
        watcher.says("no such file or folder");
        watcher.says("the last picture stays");
        std::fs::create_dir(&file).expect("a folder");
        watcher.says("it is a folder");
        watcher.says("the last picture stays");
        assert_eq!(std::fs::read(&out).expect("a picture"), second);
        std::fs::remove_dir(&file).expect("removed");
        watcher.says("the last picture stays");
        // An editor saves by another file.
        let other = write(folder.path(), "other", PAINT);
        std::fs::rename(other, &file).expect("renamed");
        watcher.says("wrote");
        assert_eq!(std::fs::read(&out).expect("a picture"), first);
        assert_eq!(watcher.end(), Some(130));
    }

    #[test]
    fn scenes_are_watched_with_all_that_they_name() {
        let folder = folder();
        write(folder.path(), "lib.impasto", "const LEVEL: float = 0.5;\n");
        let user = "use lib::LEVEL;\nuse std::edf::uniform;\n\
            material paint { param wear: float = 0.0; param color: color = color(LEVEL); \
            emission = uniform(color * (1.0 - wear)); }\n";
        write(folder.path(), "paint.impasto", user);
        write(folder.path(), "quad.obj", QUAD);
        let scene = write(folder.path(), "scene.toml", MOVING);
        let out = folder.path().join("p.png");
        let watcher = Watcher::of(&scene, &out, &["--param", "wall.wear=0.1"]);
        watcher.says("wrote");
        write(folder.path(), "lib.impasto", "const LEVEL: float = 0.75;\n");
        watcher.says("wrote");
        write(
            folder.path(),
            "quad.obj",
            QUAD.replace("v 1 1 0", "v 1 0.5 0"),
        );
        watcher.says("wrote");
        write(folder.path(), "quad.obj", "f 1 2 3\n");
        watcher.says("the last picture stays");
        write(folder.path(), "quad.obj", QUAD);
        watcher.says("wrote");
        write(
            folder.path(),
            "scene.toml",
            MOVING.replace("fov = 30", "fov = 300"),
        );
        watcher.says("an angle in degrees");
        write(folder.path(), "scene.toml", MOVING);
        watcher.says("wrote");
        assert_eq!(watcher.end(), Some(130));
    }

    /// A scene may name what comes only later.
    #[test]
    fn files_that_come_later_are_noticed() {
        let folder = folder();
        write(folder.path(), "paint.impasto", PAINT);
        let scene = write(folder.path(), "scene.toml", MOVING);
        let out = folder.path().join("p.png");
        let watcher = Watcher::of(&scene, &out, &[]);
        watcher.says("quad.obj: cannot read the OBJ file");
        watcher.says("the last picture stays");
        write(folder.path(), "quad.obj", QUAD);
        watcher.says("wrote");
        assert_eq!(watcher.end(), Some(130));
    }

    #[test]
    fn a_file_that_was_never_there_is_not_waited_for() {
        let folder = folder();
        let out = folder.path().join("p.png");
        render("missing.impasto", &out, &["--watch"])
            .exits(2)
            .says("cannot read `missing.impasto`");
    }
}
