//! The window on a screen: Xvfb shows it, xdotool is the hand, and ImageMagick's `import` the eye.
//!
//! The process of the window is this program itself, on the ball of `testing`. Where things are is known from the same
//! window without a screen. The ball is a function of camera, values and samples, so that what is seen is held to the bytes
//! that a PNG would have, and to itself. Where one of the three programs is missing, this says aloud that nothing was
//! checked. `IMPASTO_SHOTS=DIR` keeps the screenshots.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use eframe::egui::{Pos2, Rect, Role, Ui, UiBuilder, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use impasto_viewer::engine::{Engine, Order};
use impasto_viewer::testing::{BallEngine, SAMPLES, SIZE};
use impasto_viewer::window::tone::{Curve, Encoder};
use impasto_viewer::window::{Window, WindowOptions, run};

/// Points of the window and the screen.
const SCREEN: [u32; 2] = [1280, 800];
/// Where the dot of the state is: of a warm color while something is done.
const DOT: (usize, usize) = (12, 787);

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    match arguments.next() {
        Some(first) if first == "--window" => {
            let file = arguments.next().map(PathBuf::from);
            window(file.as_deref())
        }
        Some(first) if first == "--list" => ExitCode::SUCCESS,
        // Who asks for tests by another name does not ask for these.
        Some(name) if !name.to_string_lossy().starts_with('-') && name != "xvfb" => {
            ExitCode::SUCCESS
        }
        _ => {
            without_a_display();
            on_a_screen();
            ExitCode::SUCCESS
        }
    }
}

/// The process of the window.
fn window(file: Option<&Path>) -> ExitCode {
    let engine = BallEngine::progressive(file);
    match run(Box::new(engine), WindowOptions::default()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn own() -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .arg("--window")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    command
}

/// Without a display the window says what to do instead.
fn without_a_display() {
    if !cfg!(target_os = "linux") {
        return;
    }
    for display in [None, Some(":987")] {
        let mut command = own();
        match display {
            Some(display) => command.env("DISPLAY", display),
            None => command.env_remove("DISPLAY"),
        };
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{said}");
        for words in ["no display", "hint: `impasto render --watch`", "--tev"] {
            assert!(said.contains(words), "{words} is missing:\n{said}");
        }
        assert!(!said.contains("panicked"), "{said}");
    }
    println!("without a display: ok");
}

fn on_a_screen() {
    let missing: Vec<&str> = [
        ("Xvfb", "-help"),
        ("xdotool", "version"),
        ("import", "-version"),
    ]
    .into_iter()
    .filter(|(program, argument)| {
        let mut command = Command::new(program);
        command
            .arg(argument)
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command.status().is_err()
    })
    .map(|(program, _)| program)
    .collect();
    if !missing.is_empty() || !cfg!(target_os = "linux") {
        println!(
            "NOT CHECKED: the window on a screen, for want of {} (on Debian: xvfb xdotool imagemagick)",
            missing.join(", ")
        );
        return;
    }
    let mut screen = Screen::open();
    if let Some(why) = screen.wait_for_window() {
        println!("NOT CHECKED: the window on a screen: {why}");
        return;
    }
    let start = Instant::now();
    drive(&mut screen);
    println!("on a screen: ok, {:.0} s", start.elapsed().as_secs_f64());
}

/// Ends a process when it is no longer needed, whatever happened.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What is seen.
struct Shot {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Shot {
    fn at(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// Pixels of a part of the screen that are others than in `other`.
    fn differences(&self, other: &Self, part: Rect) -> usize {
        let columns = part.left() as usize..part.right() as usize;
        let rows = part.top() as usize..part.bottom() as usize;
        rows.flat_map(|y| columns.clone().map(move |x| (x, y)))
            .filter(|&(x, y)| self.at(x, y) != other.at(x, y))
            .count()
    }
}

/// A screen with the window on it.
struct Screen {
    app: Process,
    _xvfb: Process,
    display: String,
    folder: tempfile::TempDir,
    kept: Option<PathBuf>,
    count: usize,
}

impl Screen {
    fn open() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [width, height] = SCREEN;
        let mut xvfb = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0"])
            .arg(format!("{width}x{height}x24"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(xvfb.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let xvfb = Process(xvfb);
        let display = format!(":{}", line.trim());
        let log = std::fs::File::create(folder.path().join("log")).unwrap();
        let scene = folder.path().join("scene");
        std::fs::write(&scene, "fine").unwrap();
        let app = own()
            .arg(&scene)
            .env("DISPLAY", &display)
            .stderr(log)
            .spawn()
            .unwrap();
        let kept = std::env::var_os("IMPASTO_SHOTS").map(PathBuf::from);
        if let Some(kept) = &kept {
            std::fs::create_dir_all(kept).unwrap();
        }
        Self {
            app: Process(app),
            _xvfb: xvfb,
            display,
            folder,
            kept,
            count: 0,
        }
    }

    /// Why there is no window: only for want of a driver, or this fails.
    fn wait_for_window(&mut self) -> Option<String> {
        let start = Instant::now();
        loop {
            if self.app.0.try_wait().unwrap().is_some() {
                let said = std::fs::read_to_string(self.folder.path().join("log")).unwrap();
                assert!(said.contains("no GPU draws"), "{said}");
                return Some(said);
            }
            let shot = self.look();
            if shot.at(640, 400) != [0; 3] && shot.at(640, 40) != [0; 3] {
                break;
            }
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "the window does not come"
            );
            std::thread::sleep(Duration::from_millis(200));
        }
        // Without a window manager nobody gives it the keyboard.
        let found = Command::new("xdotool")
            .args(["search", "--name", "Impasto"])
            .env("DISPLAY", &self.display)
            .output()
            .unwrap();
        let id = String::from_utf8_lossy(&found.stdout)
            .lines()
            .next()
            .unwrap()
            .to_owned();
        self.hand(&["windowfocus", &id]);
        None
    }

    fn hand(&mut self, arguments: &[&str]) {
        let status = Command::new("xdotool")
            .args(arguments)
            .env("DISPLAY", &self.display)
            .status()
            .unwrap();
        assert!(status.success(), "xdotool {arguments:?}");
        std::thread::sleep(Duration::from_millis(60));
        assert!(
            self.app.0.try_wait().unwrap().is_none(),
            "the window has ended: {}",
            self.said()
        );
    }

    fn said(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }

    fn move_to(&mut self, at: Pos2) {
        let [x, y] = [at.x, at.y].map(|x| format!("{:.0}", x));
        self.hand(&["mousemove", &x, &y]);
    }

    fn key(&mut self, key: &str) {
        self.hand(&["key", key]);
    }

    fn click(&mut self, at: Pos2) {
        self.move_to(at);
        self.hand(&["click", "1"]);
    }

    fn drag(&mut self, from: Pos2, step: eframe::egui::Vec2, steps: u32) {
        self.move_to(from);
        self.hand(&["mousedown", "1"]);
        for i in 1..=steps {
            self.move_to(from + step * i as f32);
        }
        self.hand(&["mouseup", "1"]);
        // Away, so that nothing is lit because of the pointer.
        self.move_to(pos2(640.0, 795.0));
    }

    fn look(&self) -> Shot {
        let path = self.folder.path().join("shot.png");
        let status = Command::new("import")
            .args(["-window", "root"])
            .arg(&path)
            .env("DISPLAY", &self.display)
            .status()
            .unwrap();
        assert!(status.success(), "import");
        let image = image::open(&path).unwrap().into_rgb8();
        Shot {
            width: image.width() as usize,
            pixels: image.pixels().map(|p| p.0).collect(),
        }
    }

    /// What is seen once the render is done, or the files are broken, and nothing changes any more.
    fn settled(&mut self, name: &str) -> Shot {
        let start = Instant::now();
        let mut before = self.look();
        loop {
            std::thread::sleep(Duration::from_millis(300));
            let now = self.look();
            let [r, g, b] = now.at(DOT.0, DOT.1);
            let is_working = r > g && g > 130 && g > b + 10;
            if now.pixels == before.pixels && !is_working {
                break;
            }
            before = now;
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "{name}: it never rests"
            );
        }
        self.keep(name);
        before
    }

    /// The same once something else than before is seen in a part of the screen.
    fn changed(&mut self, name: &str, before: &Shot, part: Rect) -> Shot {
        let start = Instant::now();
        while self.look().differences(before, part) == 0 {
            let waited = start.elapsed();
            assert!(waited < Duration::from_secs(30), "{name}: nothing changes");
        }
        self.settled(name)
    }

    fn keep(&mut self, name: &str) {
        if let Some(kept) = &self.kept {
            let to = kept.join(format!("{:02}-{name}.png", self.count));
            std::fs::copy(self.folder.path().join("shot.png"), to).unwrap();
        }
        self.count += 1;
    }

    /// Saves the scene, whole at once.
    fn write(&self, text: &str) {
        let new = self.folder.path().join("new");
        std::fs::write(&new, text).unwrap();
        std::fs::rename(new, self.folder.path().join("scene")).unwrap();
    }
}

/// Where things are, by the same window without a screen.
struct Places {
    harness: Harness<'static, Option<Window>>,
}

impl Places {
    fn new(engine: &BallEngine) -> Self {
        let engine = engine.clone();
        let mut harness = Harness::builder()
            .with_size(vec2(SCREEN[0] as f32, SCREEN[1] as f32))
            .build_ui_state(
                move |ui, window: &mut Option<Window>| {
                    let options = WindowOptions::default();
                    let make = || Window::new(ui.ctx(), Box::new(engine.clone()), &options);
                    window.get_or_insert_with(make).ui(&mut whole(ui));
                },
                None,
            );
        harness.run_steps(4);
        Self { harness }
    }

    fn of(&self, role: Role, label: &str) -> Rect {
        self.harness.get_by_role_and_label(role, label).rect()
    }

    fn picture(&self) -> Rect {
        let window = self.harness.state().as_ref().unwrap();
        window.canvas.placed().unwrap()
    }
}

fn drive(screen: &mut Screen) {
    let engine = BallEngine::still();
    engine.order(Order::Size(SIZE));
    engine.order(Order::Samples(SAMPLES));
    engine.order(Order::Restart);
    let places = Places::new(&engine);
    let picture = places.picture();
    assert_eq!(picture.size(), vec2(SIZE[0] as f32, SIZE[1] as f32));
    let area = picture.width() as usize * picture.height() as usize;
    screen.move_to(pos2(640.0, 795.0));

    let first = screen.settled("first");
    same_bytes(&first, &engine, picture);

    for step in 0..6 {
        screen.move_to(picture.center() + vec2(20.0 * step as f32, 10.0));
    }
    let hovered = screen.settled("hover");
    assert_eq!(
        hovered.differences(&first, picture),
        0,
        "a hand that passes changes the picture"
    );

    let slider = places.of(Role::Slider, "Roughness");
    screen.drag(
        slider.left_center() + vec2(0.3 * slider.width(), 0.0),
        vec2(8.0, 0.0),
        6,
    );
    let rough = screen.changed("slider", &first, picture);
    let changed = rough.differences(&first, picture);
    assert!(changed > area / 50, "a slider changes {changed} pixels");

    screen.drag(picture.center(), vec2(15.0, 6.0), 6);
    let turned = screen.changed("orbit", &rough, picture);
    assert!(
        turned.differences(&rough, picture) > area / 4,
        "a drag turns the camera"
    );
    screen.move_to(picture.center());
    for _ in 0..3 {
        screen.hand(&["click", "4"]);
    }
    screen.move_to(pos2(640.0, 795.0));
    let nearer = screen.changed("wheel", &turned, picture);
    assert!(
        nearer.differences(&turned, picture) > area / 4,
        "the wheel moves the camera"
    );
    screen.key("Home");
    let home = screen.changed("home", &nearer, picture);
    assert_eq!(
        home.differences(&rough, picture),
        0,
        "Home is where it began"
    );

    screen.key("question");
    let help = screen.changed("help", &home, picture);
    assert!(
        help.differences(&home, picture) > area / 2,
        "the keys are shown"
    );
    screen.key("Escape");
    let left = screen.changed("help-left", &help, picture);
    assert_eq!(left.differences(&home, picture), 0);

    screen.key("s");
    let field = places.of(Role::Slider, "Roughness");
    screen.drag(
        field.left_center() + vec2(0.8 * field.width(), 0.0),
        vec2(-8.0, 0.0),
        6,
    );
    let other = screen.changed("snapshot", &home, picture);
    screen.key("w");
    let wipe = screen.changed("wipe", &other, picture);
    let (mut now, mut kept) = (picture, picture);
    // Without what is written beside the line.
    now.max.x = picture.center().x - 4.0;
    kept.min.x = picture.center().x + 4.0;
    now.min.y += 40.0;
    kept.min.y += 40.0;
    assert_eq!(
        wipe.differences(&other, now),
        0,
        "the picture is at the left"
    );
    assert_eq!(
        wipe.differences(&home, kept),
        0,
        "the snapshot is at the right"
    );
    assert!(wipe.differences(&home, now) > 100, "they differ");
    screen.drag(picture.center(), vec2(-20.0, 0.0), 5);
    let moved = screen.changed("wipe-moved", &wipe, picture);
    assert!(moved.differences(&wipe, picture) > 100, "the line moves");
    screen.key("d");
    screen.key("x");
    let apart = screen.changed("difference", &moved, picture);
    for key in ["x", "d", "d", "d"] {
        screen.key(key);
    }
    let back = screen.changed("compare-left", &apart, picture);
    assert_eq!(back.differences(&other, picture), 0);

    screen.click(picture.center());
    screen.move_to(pos2(640.0, 795.0));
    let picked = screen.changed("pick", &back, picture);
    let marked = picked.differences(&back, picture);
    assert!((10..400).contains(&marked), "a mark of {marked} pixels");
    screen.key("3");
    screen.click(picture.center() + vec2(30.0, 20.0));
    screen.move_to(pos2(640.0, 795.0));
    let traced = screen.changed("trace", &picked, picture);
    for key in ["Escape", "Escape", "Escape"] {
        screen.key(key);
    }
    let left = screen.changed("trace-left", &traced, picture);
    assert_eq!(left.differences(&back, picture), 0);

    screen.write("an error");
    let below = Rect::from_min_max(pos2(320.0, 600.0), pos2(1000.0, 760.0));
    let broken = screen.changed("broken", &left, below);
    assert!(
        broken.differences(&left, below) > 1000,
        "problems stand below"
    );
    // The picture has moved up and is whole.
    let shift = (0..300usize).find(|up| {
        let at = |x: usize, y: usize| {
            let (x, y) = (picture.left() as usize + x, picture.top() as usize + y);
            y >= *up && broken.at(x, y - up) == left.at(x, y)
        };
        (0..SIZE[0] as usize)
            .step_by(7)
            .all(|x| at(x, 10) && at(x, 200) && at(x, 390))
    });
    assert!(
        shift.is_some_and(|up| up > 20),
        "the last good picture stays: {shift:?}"
    );
    screen.write("fine");
    let repaired = screen.changed("repaired", &broken, picture);
    assert_eq!(repaired.differences(&left, picture), 0);

    let plate = places.of(Role::ColorWell, "Base color color");
    screen.click(plate.center());
    screen.changed("color", &repaired, picture);
    screen.key("Escape");
    screen.click(pos2(640.0, 80.0));
    for (size, name) in [
        (["340", "240"], "small"),
        (["900", "500"], "middle"),
        (["1280", "800"], "whole"),
    ] {
        let found = Command::new("xdotool")
            .args(["search", "--name", "Impasto"])
            .env("DISPLAY", &screen.display)
            .output()
            .unwrap();
        let id = String::from_utf8_lossy(&found.stdout)
            .lines()
            .next()
            .unwrap()
            .to_owned();
        screen.hand(&["windowsize", &id, size[0], size[1]]);
        std::thread::sleep(Duration::from_millis(400));
        screen.settled(name);
    }
}

/// The picture on the screen has the bytes that a PNG of it would have.
fn same_bytes(shot: &Shot, engine: &BallEngine, place: Rect) {
    let picture = engine.news().picture.unwrap();
    let encoder = Encoder::new(Curve::Srgb, 0.0);
    let mut wrong = 0;
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let (column, row) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
        let seen = shot.at(place.left() as usize + column, place.top() as usize + row);
        wrong += usize::from(pixel.map(|x| encoder.byte(x)) != seen);
    }
    assert_eq!(
        wrong,
        0,
        "pixels that have other bytes than the PNG, of {}",
        picture.pixels.len()
    );
}

/// All of the window, without the margin that the harness leaves.
fn whole(ui: &mut Ui) -> Ui {
    let rect = ui.ctx().content_rect();
    let mut whole = ui.new_child(UiBuilder::new().max_rect(rect));
    whole.set_clip_rect(rect);
    whole
}
