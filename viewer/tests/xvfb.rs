//! The window on a screen (`screen`), on the ball of `testing`: the process of the window is this program itself. The
//! ball is a function of camera, values and samples, so that what is seen is held to the bytes that a PNG would have, and
//! to itself. Where a program is missing that a screen takes, this says aloud that nothing was checked.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod screen;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use eframe::egui::{Rect, Role, pos2, vec2};
use impasto_viewer::engine::{Engine, Order};
use impasto_viewer::testing::{BallEngine, SAMPLES, SIZE};
use impasto_viewer::window::tone::{Curve, Encoder};
use impasto_viewer::window::{WindowOptions, run};
use screen::{AWAY, Places, Screen, Shot};

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
    if let Some(why) = screen::missing() {
        println!("NOT CHECKED: the window on a screen, {why}");
        return;
    }
    let mut screen = Screen::open(|folder| {
        let scene = folder.join("scene");
        std::fs::write(&scene, "fine").unwrap();
        let mut app = own();
        app.arg(scene);
        app
    });
    if let Some(why) = screen.wait_for_window() {
        println!("NOT CHECKED: the window on a screen: {why}");
        return;
    }
    let start = Instant::now();
    drive(&mut screen);
    println!("on a screen: ok, {:.0} s", start.elapsed().as_secs_f64());
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
    screen.move_to(AWAY);

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
    screen.move_to(AWAY);
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
    screen.move_to(AWAY);
    let picked = screen.changed("pick", &back, picture);
    let marked = picked.differences(&back, picture);
    assert!((10..400).contains(&marked), "a mark of {marked} pixels");
    screen.key("3");
    screen.click(picture.center() + vec2(30.0, 20.0));
    screen.move_to(AWAY);
    let traced = screen.changed("trace", &picked, picture);
    for key in ["Escape", "Escape", "Escape"] {
        screen.key(key);
    }
    let left = screen.changed("trace-left", &traced, picture);
    assert_eq!(left.differences(&back, picture), 0);

    screen.write("scene", "an error");
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
    screen.write("scene", "fine");
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
        let id = screen.window();
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
