//! The window itself. It shows what an [`Engine`] has and asks it for what hands want.
//!
//! [`desk::Desk`] is what the window knows; [`Canvas`] is the picture; `panels/` is everything around it. They are drawn
//! anew when the engine has news or a hand moves, and not in between.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use eframe::egui::{self, CentralPanel, Context, Frame, Panel, Ui, ViewportBuilder, vec2};

use crate::engine::{Engine, Order};

pub mod canvas;
pub mod compare;
pub mod desk;
pub mod goals;
mod hands;
pub mod keys;
pub mod navigate;
mod panels;
pub mod picture;
pub mod project;
pub mod theme;
pub mod tone;
pub mod values;
pub mod view;

use canvas::Canvas;
use desk::Desk;
use goals::Goals;
use keys::Command;

/// How a window opens.
#[derive(Clone, Debug, Default)]
pub struct WindowOptions {
    /// What its title bar says; the name of what is shown if it is empty.
    pub title: String,
    /// Its size in points, without frame.
    pub size: Option<[f32; 2]>,
    /// Pixels for each point; what the system says if there is none.
    pub scale: Option<f32>,
    /// Stops of exposure.
    pub exposure: f32,
    /// Where the picture is saved unless a hand says otherwise.
    pub save_as: Option<PathBuf>,
    /// A picture to compare with from the start.
    pub compare_with: Option<PathBuf>,
    /// The goals that the engine pursues from the start, as `--until` has them.
    pub until: Option<String>,
}

/// Opens a window and shows what `engine` has until it is closed; then the engine is asked to quit.
///
/// # Errors
/// If there is no display or no GPU for a window, in words that say what to do instead.
pub fn run(engine: Box<dyn Engine>, options: WindowOptions) -> Result<(), String> {
    let [width, height] = options.size.unwrap_or([1280.0, 800.0]);
    let title = if options.title.is_empty() {
        "Impasto".to_owned()
    } else {
        options.title.clone()
    };
    let viewport = ViewportBuilder::default()
        .with_title(&title)
        .with_app_id("impasto")
        .with_inner_size(vec2(width.max(64.0), height.max(64.0)))
        .with_min_inner_size(vec2(320.0, 200.0))
        .with_icon(egui::IconData::default());
    let native = eframe::NativeOptions {
        viewport,
        // The bytes of the picture are those of a PNG.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let has_opened = AtomicBool::new(false);
    let open = || {
        eframe::run_native(
            &title,
            native,
            Box::new(|context| {
                has_opened.store(true, Ordering::Relaxed);
                if let Some(scale) = options.scale {
                    context.egui_ctx.set_pixels_per_point(scale.clamp(0.5, 8.0));
                }
                Ok(Box::new(Window::new(&context.egui_ctx, engine, &options)))
            }),
        )
    };
    // winit panics where a library of the display is missing, such as libxkbcommon-x11.
    match catch_unwind(AssertUnwindSafe(open)) {
        Ok(ended) => ended.map_err(|error| unopened(&error)),
        Err(panic) if has_opened.load(Ordering::Relaxed) => resume_unwind(panic),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text.or(panic.downcast_ref::<&str>().map(|&text| text.to_owned()));
            let why = text.unwrap_or_else(|| "no reason is known".to_owned());
            Err(instead("no window could be opened", &why, NO_DISPLAY))
        }
    }
}

const NO_DISPLAY: &str =
    "on a machine without a display, `ssh -X` or a virtual display (Xvfb) can lend one";
const NO_GPU: &str =
    "a window needs Vulkan, Metal or DirectX 12; Mesa's llvmpipe (mesa-vulkan-drivers) will do";

/// Why no window opened, and what to do instead.
fn unopened(error: &eframe::Error) -> String {
    let (why, help) = match error {
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => {
            ("no window could be opened: there is no display", NO_DISPLAY)
        }
        eframe::Error::Wgpu(_) => (
            "no window could be opened: no GPU draws to this display",
            NO_GPU,
        ),
        _ => ("no window could be opened", NO_DISPLAY),
    };
    instead(why, &error.to_string(), help)
}

fn instead(why: &str, detail: &str, help: &str) -> String {
    let detail = detail.lines().next().unwrap_or_default();
    // Without the place in winit's sources where it was found.
    let place = detail
        .rsplit_once(".rs:")
        .and_then(|(_, rest)| rest.split_once(": "));
    let detail = place.map_or(detail, |(_, rest)| rest).trim_end_matches('.');
    format!(
        "{why} ({detail})\nhint: {help}\nhint: `impasto render --watch` renders at each save without a window, and \
         `impasto view --tev` shows the picture in tev"
    )
}

/// The window: what it knows, and the engine that it asks.
pub struct Window {
    engine: Box<dyn Engine>,
    /// What it knows.
    pub desk: Desk,
    /// The picture in it.
    pub canvas: Canvas,
    title: String,
    has_quit: bool,
    /// What hands did behind the end of the last frame.
    later: Vec<egui::Event>,
}

impl Window {
    /// A window on `engine`, which wakes `ctx` when it has news.
    pub fn new(ctx: &Context, engine: Box<dyn Engine>, options: &WindowOptions) -> Self {
        theme::apply(ctx);
        let waker = ctx.clone();
        engine.on_news(Box::new(move || waker.request_repaint()));
        let mut desk = Desk::default();
        desk.look.exposure = options.exposure;
        if let Some(path) = &options.save_as {
            desk.save_as = path.display().to_string();
        }
        if let Some(goals) = &options.until {
            desk.goals = Goals::of(goals);
        }
        if let Some(path) = &options.compare_with {
            desk.read_from = path.display().to_string();
            desk.read();
        }
        Self {
            engine,
            desk,
            canvas: Canvas::default(),
            title: options.title.clone(),
            has_quit: false,
            later: Vec::new(),
        }
    }

    /// Draws all of the window.
    pub fn ui(&mut self, ui: &mut Ui) {
        let now = ui.input(|i| i.time);
        let name = self.desk.news.project.name.clone();
        self.desk
            .take(self.engine.news(), self.engine.answers(), now);
        if self.title.is_empty() && name != self.desk.news.project.name {
            let title = format!("{} - Impasto", self.desk.news.project.name);
            ui.ctx()
                .send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
        for command in keys::pressed(ui.ctx()) {
            self.command(command);
        }
        let mut commands = Vec::new();
        self.panels(ui, &mut commands);
        for command in commands {
            // Part of the window is drawn already.
            ui.ctx().request_repaint();
            self.command(command);
        }
        let is_down = ui.input(|i| i.pointer.any_down());
        for order in self.desk.settle(is_down, now) {
            self.engine.order(order);
        }
        if let Some(seconds) = self.desk.waits() {
            let wait = std::time::Duration::from_secs_f64(seconds);
            ui.ctx().request_repaint_after(wait);
        }
    }

    fn command(&mut self, command: Command) {
        self.canvas.command(command);
        self.desk.command(command);
    }

    fn panels(&mut self, ui: &mut Ui, commands: &mut Vec<Command>) {
        let desk = &mut self.desk;
        let bar = Frame::new()
            .fill(theme::PANEL)
            .inner_margin(egui::Margin::symmetric(8, 5));
        Panel::top("bar")
            .frame(bar)
            .resizable(false)
            .show(ui, |ui| panels::bar::show(ui, desk, &self.canvas, commands));
        let status = Frame::new()
            .fill(theme::PANEL)
            .inner_margin(egui::Margin::symmetric(8, 3));
        Panel::bottom("status")
            .frame(status)
            .resizable(false)
            .show(ui, |ui| panels::status::show(ui, desk, &self.canvas));
        let width = ui.available_width();
        if desk.shows_panels && width > 500.0 {
            let side = Frame::new()
                .fill(theme::PANEL)
                .inner_margin(egui::Margin::same(8));
            Panel::left("scene")
                .frame(side)
                .resizable(true)
                .default_size((0.25 * width).clamp(200.0, 310.0))
                .size_range(180.0..=(0.4 * width).max(181.0))
                .show(ui, |ui| panels::scene::show(ui, desk));
            Panel::right("look")
                .frame(side)
                .resizable(true)
                .default_size((0.22 * width).clamp(180.0, 272.0))
                .size_range(160.0..=(0.4 * width).max(161.0))
                .show(ui, |ui| panels::side::show(ui, desk, &self.canvas));
        }
        if panels::drawer::is_open(desk) {
            let height = ui.available_height();
            let drawer = Frame::new()
                .fill(theme::PANEL)
                .inner_margin(egui::Margin::same(8));
            Panel::bottom("drawer")
                .frame(drawer)
                .resizable(true)
                .default_size((0.3 * height).clamp(60.0, 230.0))
                .size_range(40.0..=(0.7 * height).max(41.0))
                .show(ui, |ui| panels::drawer::show(ui, desk));
        }
        if panels::frames::is_open(desk) {
            let line = Frame::new()
                .fill(theme::PANEL)
                .inner_margin(egui::Margin::symmetric(8, 4));
            Panel::bottom("frames")
                .frame(line)
                .resizable(false)
                .show(ui, |ui| panels::frames::show(ui, desk));
        }
        CentralPanel::default()
            .frame(Frame::new().fill(theme::SURROUND))
            .show(ui, |ui| self.canvas.show(ui, desk));
        panels::help::show(ui.ctx(), desk);
        panels::save::show(ui.ctx(), desk);
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        Self::ui(self, ui);
    }

    fn raw_input_hook(&mut self, ctx: &Context, input: &mut egui::RawInput) {
        input.events.splice(0..0, self.later.drain(..));
        self.later = hands::cut(&mut input.events);
        if !self.later.is_empty() {
            ctx.request_repaint();
        }
    }

    fn on_exit(&mut self) {
        self.has_quit = true;
        self.engine.order(Order::Quit);
    }
}

impl Drop for Window {
    /// A window that never opened, or that tests drop, ends its engine as well.
    fn drop(&mut self) {
        if !self.has_quit {
            self.engine.order(Order::Quit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_say_what_to_do_instead() {
        let detail =
            "os error at some/where/winit/mod.rs:788: Failed to open connection to X server.\nmore";
        let expected = "no window (Failed to open connection to X server)\nhint: some help\nhint: `impasto render";
        let said = instead("no window", detail, "some help");
        assert!(said.starts_with(expected), "{said}");
        assert!(instead("no window", "plain", "help").starts_with("no window (plain)\n"));
        let said = unopened(&eframe::Error::AppCreation("what".into()));
        assert!(said.contains("what") && said.contains("--tev"), "{said}");
    }
}
