//! `impasto view` on a screen (`screen`), with the engine that renders: what an author does with hand, editor and eye, and
//! that the picture on the screen has the bytes of the one that `impasto render` writes.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use eframe::egui::{Rect, Role, pos2, vec2};
use impasto::live::engine::Engine;
use impasto::live::{Live, LiveOptions};

use crate::screen::{AWAY, Places, Screen, Shot, missing};

const PAINT: &str = "use std::bsdf::{clear_coat, diffuse};

/// Paint under a coat.
material paint {
    /// How rough its coat is.
    param roughness: float = 0.25 in 0.0 .. 1.0;
    surface = layer(clear_coat(roughness: roughness), diffuse(color(0.1, 0.3, 0.6)));
}
";

/// So large that each pixel of the picture is one of the screen.
const SIZE: [u32; 2] = [400, 300];
const SAMPLES: u32 = 2;

fn impasto() -> Command {
    Command::new(env!("CARGO_BIN_EXE_impasto"))
}

fn size() -> String {
    format!("{}x{}", SIZE[0], SIZE[1])
}

/// The picture that `impasto render` makes of a file, as bytes of red, green and blue.
fn written(file: &Path) -> Vec<[u8; 3]> {
    let folder = tempfile::tempdir().expect("a folder");
    let png = folder.path().join("shot.png");
    let output = impasto()
        .arg("render")
        .arg(file)
        .args(["--size", &size(), "--spp", &SAMPLES.to_string(), "-o"])
        .arg(&png)
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let image = image::open(&png).expect("a picture").into_rgb8();
    assert_eq!([image.width(), image.height()], SIZE);
    image.pixels().map(|pixel| pixel.0).collect()
}

/// The pixels of the screen at a picture's place have these bytes.
#[track_caller]
fn check_bytes(shot: &Shot, place: Rect, written: &[[u8; 3]]) {
    let (left, top) = (place.left() as usize, place.top() as usize);
    let at = |i: usize| shot.at(left + i % SIZE[0] as usize, top + i / SIZE[0] as usize);
    let wrong = (0..written.len()).filter(|i| at(*i) != written[*i]).count();
    assert_eq!(
        wrong,
        0,
        "pixels of {} are others than in the file",
        written.len()
    );
}

/// Where things are in the window of a file.
fn places(file: &Path) -> Places {
    let options = LiveOptions {
        size: Some(SIZE),
        samples: 1,
        ..LiveOptions::default()
    };
    let live = Arc::new(Live::new(file, options).expect("threads"));
    let begun = Instant::now();
    let is_known = || {
        let news = live.news();
        news.picture.is_some() && news.kernels.operations.iter().any(Option::is_some)
    };
    while !is_known() {
        assert!(begun.elapsed() < Duration::from_secs(90), "no picture");
        std::thread::sleep(Duration::from_millis(20));
    }
    Places::new(&live)
}

#[test]
fn an_author_works_in_the_window() {
    if let Some(why) = missing() {
        eprintln!("NOT CHECKED: `impasto view` on a screen, {why}");
        return;
    }
    let mut screen = Screen::open(|folder| {
        let file = folder.join("paint.impasto");
        std::fs::write(&file, PAINT).expect("written");
        let mut view = impasto();
        view.arg("view")
            .arg(file)
            .args(["--size", &size(), "--spp", &SAMPLES.to_string()]);
        view
    });
    if let Some(why) = screen.wait_for_window() {
        eprintln!("NOT CHECKED: `impasto view` on a screen: {why}");
        return;
    }
    let file = screen.folder.path().join("paint.impasto");
    let places = places(&file);
    let picture = places.picture();
    let area = (SIZE[0] * SIZE[1]) as usize;
    screen.move_to(AWAY);

    let first = screen.settled("first");
    check_bytes(&first, picture, &written(&file));

    // Hands: a value, the camera, and the way back.
    let slider = places.of(Role::Slider, "Roughness");
    let grip = slider.left_center() + vec2(0.25 * slider.width(), 0.0);
    screen.drag(grip, vec2(6.0, 0.0), 8);
    let rough = screen.changed("dragged", &first, picture);
    let changed = rough.differences(&first, picture);
    assert!(changed > area / 50, "a slider changes {changed} pixels");
    screen.drag(picture.center(), vec2(12.0, 5.0), 6);
    let turned = screen.changed("orbited", &rough, picture);
    assert!(turned.differences(&rough, picture) > area / 4, "it turns");
    screen.key("Home");
    let home = screen.changed("home", &turned, picture);
    assert_eq!(
        home.differences(&rough, picture),
        0,
        "Home is where it began"
    );

    // The editor: a change, an error, and its end. The value that the hand has set stays.
    let green = PAINT.replace("color(0.1, 0.3, 0.6)", "color(0.1, 0.6, 0.2)");
    screen.write("paint.impasto", &green);
    let edited = screen.changed("edited", &home, picture);
    let greener = |shot: &Shot| {
        let [r, g, b] = shot.at(picture.center().x as usize, picture.center().y as usize);
        g > r && g > b
    };
    assert!(greener(&edited) && !greener(&home), "paint is green now");
    screen.write(
        "paint.impasto",
        &green.replace("diffuse(color", "difuse(color"),
    );
    let below = Rect::from_min_max(pos2(320.0, 600.0), pos2(960.0, 760.0));
    let broken = screen.changed("broken", &edited, below);
    let has_moved_up = (20..300usize).any(|up| {
        let (left, top) = (picture.left() as usize, picture.top() as usize);
        let is_same =
            |x: usize, y: usize| broken.at(left + x, top + y - up) == edited.at(left + x, top + y);
        top + 10 > up && (0..SIZE[0] as usize).all(|x| is_same(x, 10) && is_same(x, 150))
    });
    assert!(
        has_moved_up,
        "the last good picture stays above the problems"
    );
    screen.write("paint.impasto", &green);
    let mended = screen.changed("mended", &broken, below);
    assert_eq!(mended.differences(&edited, picture), 0);

    // Comparing: the edit at the left, what is blue again at the right.
    screen.key("s");
    screen.write("paint.impasto", PAINT);
    let blue = screen.changed("blue", &mended, picture);
    assert_eq!(blue.differences(&home, picture), 0, "it is as it was");
    screen.key("w");
    let wipe = screen.changed("wiped", &blue, picture);
    let (mut now, mut kept) = (picture, picture);
    now.max.x = picture.center().x - 4.0;
    kept.min.x = picture.center().x + 4.0;
    // What is written beside the line.
    (now.min.y, kept.min.y) = (now.min.y + 40.0, kept.min.y + 40.0);
    assert_eq!(
        wipe.differences(&blue, now),
        0,
        "the picture is at the left"
    );
    assert_eq!(
        wipe.differences(&mended, kept),
        0,
        "the snapshot is at the right"
    );
    screen.key("w");
    let alone = screen.changed("alone", &wipe, picture);
    assert_eq!(alone.differences(&blue, picture), 0);

    // Asking: what is at a pixel, and which kernels pixels have.
    screen.click(picture.center());
    screen.move_to(AWAY);
    let picked = screen.changed("picked", &alone, picture);
    let marked = picked.differences(&alone, picture);
    assert!((10..400).contains(&marked), "a mark of {marked} pixels");
    screen.key("Escape");
    let left = screen.changed("left", &picked, picture);
    for _layer in ["error", "cost", "kernel"] {
        screen.key("l");
    }
    let kernels = screen.changed("kernels", &left, picture);
    let colors: std::collections::BTreeSet<[u8; 3]> = (0..area)
        .map(|i| {
            let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
            kernels.at(picture.left() as usize + x, picture.top() as usize + y)
        })
        .collect();
    assert!(
        (2..=4).contains(&colors.len()),
        "colors of kernels: {colors:?}"
    );
}

/// An editor opens the preview of what it edits, and the preview follows its saves.
#[test]
fn an_editor_opens_the_window() {
    let nvim = Command::new("nvim").arg("--version").output();
    let why = missing().or(nvim
        .err()
        .map(|error| format!("for want of Neovim: {error}")));
    if let Some(why) = why {
        eprintln!("NOT CHECKED: the preview of an editor, {why}");
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut screen = Screen::open(|folder| {
        let file = folder.join("paint.impasto");
        std::fs::write(&file, PAINT).expect("written");
        // It saves when the test says so, and else waits.
        let program = env!("CARGO_BIN_EXE_impasto");
        let script = format!(
            "require('impasto').setup({{ path = '{program}' }})
            vim.cmd('edit {file}')
            vim.cmd('ImpastoPreview')
            vim.wait(60000, function() return vim.fn.filereadable('{folder}/go') == 1 end, 50)
            vim.cmd('silent %substitute/0.1, 0.3, 0.6/0.6, 0.1, 0.1/')
            vim.cmd('silent write')
            vim.wait(60000, function() return false end, 50)",
            file = file.display(),
            folder = folder.display(),
        );
        std::fs::write(folder.join("session.lua"), script).expect("written");
        let mut editor = Command::new("nvim");
        editor
            .args(["--headless", "-n", "-u", "NONE", "-i", "NONE"])
            .arg("--cmd")
            .arg(format!(
                "set runtimepath^={}/editors/neovim",
                root.display()
            ))
            .args(["--cmd", "filetype plugin on", "-S"])
            .arg(folder.join("session.lua"))
            .env("XDG_CACHE_HOME", folder.join("cache"))
            .env("XDG_STATE_HOME", folder.join("state"));
        editor
    });
    if let Some(why) = screen.wait_for_window() {
        eprintln!("NOT CHECKED: the preview of an editor: {why}");
        return;
    }
    let color = |shot: &Shot| shot.at(640, 400);
    let begun = Instant::now();
    let mut shot = screen.look();
    while color(&shot)[2] <= color(&shot)[0] {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "it shows no paint"
        );
        std::thread::sleep(Duration::from_millis(200));
        shot = screen.look();
    }
    screen.write("go", "");
    while color(&shot)[0] <= color(&shot)[2] {
        assert!(
            begun.elapsed() < Duration::from_secs(90),
            "it follows no save"
        );
        std::thread::sleep(Duration::from_millis(200));
        shot = screen.look();
    }
    screen.keep("followed");
}
