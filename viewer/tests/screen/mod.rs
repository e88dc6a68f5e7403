//! A window on a screen: Xvfb shows it, xdotool is the hand, and ImageMagick's `import` the eye. Where things are is known
//! from the same window without a screen. `IMPASTO_SHOTS=DIR` keeps the screenshots.

// Each test that is built with this uses its own part of it.
#![allow(dead_code)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use eframe::egui::{Pos2, Rect, Role, Ui, UiBuilder, Vec2, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use impasto_viewer::engine::Engine;
use impasto_viewer::window::{Window, WindowOptions};

/// Points of the window and the screen.
pub const SCREEN: [u32; 2] = [1280, 800];
/// Where the dot of the state is: of a warm color while something is done.
const DOT: (usize, usize) = (12, 787);
/// Where a hand lights nothing.
pub const AWAY: Pos2 = pos2(640.0, 795.0);

/// Which programs are missing here that a screen needs; none if all are there.
pub fn missing() -> Option<String> {
    let programs = [
        ("Xvfb", "-help"),
        ("xdotool", "version"),
        ("import", "-version"),
    ];
    let is_missing = |(program, argument): &(&str, &str)| {
        let mut command = Command::new(program);
        let quiet = command.arg(argument).stdout(Stdio::null());
        quiet.stderr(Stdio::null()).status().is_err()
    };
    let missing: Vec<&str> = programs
        .iter()
        .filter(|program| is_missing(program))
        .map(|(program, _)| *program)
        .collect();
    let is_here = missing.is_empty() && cfg!(target_os = "linux");
    (!is_here).then(|| {
        let missing = missing.join(", ");
        format!("for want of {missing} (on Debian: xvfb xdotool imagemagick)")
    })
}

/// Ends a process when it is no longer needed, whatever happened.
pub struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What is seen.
pub struct Shot {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Shot {
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// Pixels of a part of the screen that are others than in `other`.
    pub fn differences(&self, other: &Self, part: Rect) -> usize {
        let columns = part.left() as usize..part.right() as usize;
        let rows = part.top() as usize..part.bottom() as usize;
        rows.flat_map(|y| columns.clone().map(move |x| (x, y)))
            .filter(|&(x, y)| self.at(x, y) != other.at(x, y))
            .count()
    }
}

/// A screen with the window on it.
pub struct Screen {
    app: Process,
    _xvfb: Process,
    pub display: String,
    pub folder: tempfile::TempDir,
    kept: Option<PathBuf>,
    count: usize,
}

impl Screen {
    /// A screen, and on it what `app` runs, which is given a folder for its files.
    pub fn open(app: impl FnOnce(&Path) -> Command) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [width, height] = SCREEN;
        // Without -noreset the server starts anew when its only client leaves. Whoever connects meanwhile is refused: the
        // window, when the eye has looked before it came.
        let mut xvfb = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"])
            .args(["-screen", "0"])
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
        let app = app(folder.path())
            .env("DISPLAY", &display)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
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
    pub fn wait_for_window(&mut self) -> Option<String> {
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
        let id = self.window();
        self.hand(&["windowfocus", &id]);
        None
    }

    pub fn hand(&mut self, arguments: &[&str]) {
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

    pub fn said(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }

    pub fn move_to(&mut self, at: Pos2) {
        let [x, y] = [at.x, at.y].map(|x| format!("{:.0}", x));
        self.hand(&["mousemove", &x, &y]);
    }

    pub fn key(&mut self, key: &str) {
        self.hand(&["key", key]);
    }

    pub fn click(&mut self, at: Pos2) {
        self.move_to(at);
        self.hand(&["click", "1"]);
    }

    pub fn drag(&mut self, from: Pos2, step: Vec2, steps: u32) {
        self.move_to(from);
        self.hand(&["mousedown", "1"]);
        for i in 1..=steps {
            self.move_to(from + step * i as f32);
        }
        self.hand(&["mouseup", "1"]);
        // Away, so that nothing is lit because of the pointer.
        self.move_to(AWAY);
    }

    pub fn look(&self) -> Shot {
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
    pub fn settled(&mut self, name: &str) -> Shot {
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
    pub fn changed(&mut self, name: &str, before: &Shot, part: Rect) -> Shot {
        let start = Instant::now();
        while self.look().differences(before, part) == 0 {
            let waited = start.elapsed();
            assert!(waited < Duration::from_secs(30), "{name}: nothing changes");
        }
        self.settled(name)
    }

    pub fn keep(&mut self, name: &str) {
        if let Some(kept) = &self.kept {
            let to = kept.join(format!("{:02}-{name}.png", self.count));
            std::fs::copy(self.folder.path().join("shot.png"), to).unwrap();
        }
        self.count += 1;
    }

    /// The window, as xdotool names it.
    pub fn window(&self) -> String {
        let found = Command::new("xdotool")
            .args(["search", "--name", "Impasto"])
            .env("DISPLAY", &self.display)
            .output()
            .unwrap();
        let found = String::from_utf8_lossy(&found.stdout);
        found.lines().next().unwrap().to_owned()
    }

    /// Saves a file of the folder, whole at once.
    pub fn write(&self, name: &str, text: &str) {
        let new = self.folder.path().join("new");
        std::fs::write(&new, text).unwrap();
        std::fs::rename(new, self.folder.path().join(name)).unwrap();
    }
}

/// Where things are, by the same window without a screen.
pub struct Places {
    harness: Harness<'static, Option<Window>>,
}

impl Places {
    /// Of a window on an engine.
    pub fn new<E: Engine + Clone + 'static>(engine: &E) -> Self {
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

    pub fn of(&self, role: Role, label: &str) -> Rect {
        self.harness.get_by_role_and_label(role, label).rect()
    }

    pub fn picture(&self) -> Rect {
        let window = self.harness.state().as_ref().unwrap();
        window.canvas.placed().unwrap()
    }
}

/// All of the window, without the margin that the harness leaves.
fn whole(ui: &mut Ui) -> Ui {
    let rect = ui.ctx().content_rect();
    let mut whole = ui.new_child(UiBuilder::new().max_rect(rect));
    whole.set_clip_rect(rect);
    whole
}
