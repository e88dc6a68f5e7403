//! What the window knows and what it asks for, without a window: news and hands come in, orders go out.
//!
//! Everything that hands do is a method here, so that tests do it too. Orders are gathered during a frame and leave at
//! its end ([`Desk::settle`]): a value that is dragged is sent once a frame, and once more when the hand lets go.

mod camera;
mod commands;
mod edits;
mod render;
mod show;

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;
use impasto_compiler::interface::Value;
use impasto_runtime::scene::Camera;

use super::compare::{Mode, Snapshot};
use super::goals::Goals;
use super::keys::Command;
use super::navigate;
use super::picture::{Look, SAMPLES};
use super::values;
use crate::engine::{Answer, News, Order, Param, ParamId, Picked, Picture, Project, State, Traced};

/// How long a value stays that a hand gave and the engine has not taken over, in seconds.
const PATIENCE: f64 = 2.0;
/// Values that can be taken back.
const UNDO: usize = 200;
/// Snapshots that are kept.
pub const SNAPSHOTS: usize = 16;
/// What a strategy that takes a number begins with.
const FIRST_NUMBER: &str = "1000";
/// Layers that lie over the picture.
pub const OVERLAYS: [&str; 4] = [SAMPLES, "error", "cost", "kernel"];
/// Those of them that the engine finds only when it is asked to.
const SURVEYED: [&str; 2] = ["cost", "kernel"];

/// What a click and a drag on the picture do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// A drag turns the camera, a click picks.
    #[default]
    Orbit,
    /// A click focuses.
    Focus,
    /// A click traces a path.
    Trace,
    /// A drag crops.
    Crop,
}

impl Tool {
    /// All, in the order of the buttons.
    pub const ALL: [(Self, Command); 4] = [
        (Self::Orbit, Command::ToolOrbit),
        (Self::Focus, Command::ToolFocus),
        (Self::Trace, Command::ToolTrace),
        (Self::Crop, Command::ToolCrop),
    ];

    /// What its button has on it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Orbit => "Orbit",
            Self::Focus => "Focus",
            Self::Trace => "Trace",
            Self::Crop => "Crop",
        }
    }
}

/// What a picked point is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Inspect,
    Focus,
    Aim,
}

/// A value that a hand gave.
#[derive(Clone, Debug)]
struct Edit {
    value: Value,
    /// Not sent yet.
    is_new: bool,
    /// The hand has not let go.
    is_held: bool,
    released: f64,
}

/// A line that says what came of an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The line.
    pub text: String,
    /// Is it about something that went wrong?
    pub is_bad: bool,
}

/// What lies in the drawer below the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drawer {
    /// What is wrong with the files, if anything is.
    #[default]
    Problems,
    /// The path that was traced.
    Trace,
}

/// All that the window knows.
pub struct Desk {
    /// What the engine said last.
    pub news: News,
    /// How pictures are shown.
    pub look: Look,
    /// The layer that is shown; the picture if none.
    pub layer: Option<String>,
    /// The layer that lies over the picture.
    pub overlay: Option<String>,
    /// How much of the picture it covers.
    pub overlay_share: f32,
    /// What hands do on the picture.
    pub tool: Tool,
    /// Pictures that are kept.
    pub snapshots: Vec<Snapshot>,
    /// The one that the picture is compared with.
    pub chosen: usize,
    /// How it is compared.
    pub compare: Mode,
    /// Where the line of the wipe is, from 0 to 1.
    pub wipe: f32,
    /// The part that is rendered.
    pub crop: Option<[[u32; 2]; 2]>,
    /// What was picked last, and whether it is still there.
    pub picked: Option<Picked>,
    /// The path that was traced last.
    pub traced: Option<Traced>,
    /// The sample whose path is traced.
    pub sample: u32,
    /// What the drawer shows.
    pub drawer: Drawer,
    /// Is the drawer of the path open?
    pub shows_trace: bool,
    /// Is the list of keys open?
    pub shows_help: bool,
    /// Is the dialog open in which the picture is saved?
    pub shows_save: bool,
    /// Has it just been opened, so that a hand can type at once?
    pub has_opened_save: bool,
    /// Are the panels there?
    pub shows_panels: bool,
    /// The file to save to.
    pub save_as: String,
    /// The file to compare with.
    pub read_from: String,
    /// What filters the parameters.
    pub filter: String,
    /// The binding whose parameters should come into view.
    pub reveal: Option<usize>,
    /// What came of the last order that said so.
    pub note: Option<Note>,
    /// The frame of what moves.
    pub frame: u32,
    /// Samples to take.
    pub samples: u32,
    /// The goals at which the render ends.
    pub goals: Goals,
    /// The strategy that was asked for.
    pub strategy: Option<String>,
    /// Is the engine asked to rest?
    pub is_paused: bool,
    /// Outputs that were asked for; those that the engine began with if none were.
    outputs: Option<Vec<String>>,
    /// Is the engine to find what pixels see?
    surveys: bool,
    /// The camera that was asked for; that of the scene if none.
    camera: Option<Camera>,
    camera_is_new: bool,
    pivot: Option<Vec3>,
    edits: BTreeMap<ParamId, Edit>,
    undo: Vec<(ParamId, Value)>,
    redo: Vec<(ParamId, Value)>,
    asked: VecDeque<Purpose>,
    orders: Vec<Order>,
    taken: u32,
    has_sized: bool,
    /// The picture that a point was picked in: its camera and size.
    picked_in: Option<(Option<Camera>, [u32; 2])>,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            news: News::default(),
            look: Look {
                mark_nonfinite: true,
                ..Look::default()
            },
            layer: None,
            overlay: None,
            overlay_share: 0.6,
            tool: Tool::default(),
            snapshots: Vec::new(),
            chosen: 0,
            compare: Mode::default(),
            wipe: 0.5,
            crop: None,
            picked: None,
            traced: None,
            sample: 0,
            drawer: Drawer::default(),
            shows_trace: false,
            shows_help: false,
            shows_save: false,
            has_opened_save: false,
            shows_panels: true,
            save_as: String::new(),
            read_from: String::new(),
            filter: String::new(),
            reveal: None,
            note: None,
            frame: 0,
            samples: 0,
            goals: Goals::default(),
            strategy: None,
            is_paused: false,
            outputs: None,
            surveys: false,
            camera: None,
            camera_is_new: false,
            pivot: None,
            edits: BTreeMap::new(),
            undo: Vec::new(),
            redo: Vec::new(),
            asked: VecDeque::new(),
            orders: Vec::new(),
            taken: 0,
            has_sized: false,
            picked_in: None,
        }
    }
}

impl Desk {
    /// Takes what the engine says, at a time in seconds.
    pub fn take(&mut self, news: News, answers: Vec<Answer>, now: f64) {
        let is_other = !Arc::ptr_eq(&news.project, &self.news.project);
        if self.news.problems.is_empty() && !news.problems.is_empty() {
            self.drawer = Drawer::Problems;
        }
        self.news = news;
        if is_other {
            self.take_over(now);
        }
        if let Some(picture) = &self.news.picture
            && self.samples == 0
        {
            self.samples = picture.samples_asked;
        }
        for answer in answers {
            self.answer(answer);
        }
    }

    /// A project was read: values that hands gave and it has are its own from now on.
    fn take_over(&mut self, now: f64) {
        let project = Arc::clone(&self.news.project);
        self.edits.retain(|id, edit| {
            let Some(param) = param_of(&project, id) else {
                return false;
            };
            let is_over = !edit.is_held && now - edit.released > PATIENCE;
            edit.is_new || edit.is_held || !(is_over || values::alike(&param.value, &edit.value))
        });
        if let Some([first, last]) = project.frames {
            self.frame = self.frame.clamp(first, last.max(first));
        }
        if self.save_as.is_empty() && !project.name.is_empty() {
            let stem = PathBuf::from(&project.name);
            let stem = stem.file_stem().unwrap_or_default().to_string_lossy();
            self.save_as = format!("{stem}.exr");
        }
    }

    fn answer(&mut self, answer: Answer) {
        match answer {
            Answer::Picked(picked) => {
                let purpose = self.asked.pop_front().unwrap_or(Purpose::Inspect);
                self.take_pick(purpose, picked);
            }
            Answer::Traced(traced) => {
                self.sample = traced.sample;
                self.traced = Some(traced);
                self.shows_trace = true;
                self.drawer = Drawer::Trace;
            }
            Answer::Saved(Ok(path)) => self.say(format!("Wrote {}", path.display())),
            Answer::Saved(Err(why)) => self.complain(why),
            Answer::Read(Ok(picture)) => {
                let name = PathBuf::from(&self.read_from);
                let name = name.file_name().map(|n| n.to_string_lossy().into_owned());
                self.keep(name.unwrap_or_else(|| "file".to_owned()), picture);
            }
            Answer::Read(Err(why)) => self.complain(why),
        }
    }

    fn take_pick(&mut self, purpose: Purpose, picked: Option<Picked>) {
        let point = picked.as_ref().map(|p| Vec3::from(p.position));
        if let Some(point) = point.filter(|p| p.is_finite()) {
            self.pivot = Some(point);
        }
        match (purpose, &picked) {
            (Purpose::Inspect, Some(found)) => {
                self.reveal = found.binding;
                self.picked_in = self.picture_seen();
                self.picked = picked;
            }
            (Purpose::Inspect, None) => {
                self.picked = None;
                self.say("Nothing is there.".to_owned());
            }
            (_, None) => self.say("Nothing is there.".to_owned()),
            (Purpose::Focus, Some(found)) => {
                if let Some(camera) = self.camera() {
                    self.look_from(navigate::focus(&camera, found.depth));
                    self.say(if camera.aperture > 0.0 {
                        format!("In focus: {} m", super::picture::number(found.depth))
                    } else {
                        "Focused; the aperture is 0, so that all is sharp".to_owned()
                    });
                }
            }
            (Purpose::Aim, Some(_)) => {
                if let (Some(camera), Some(point)) = (self.camera(), point) {
                    self.look_from(navigate::aim(&camera, point));
                }
            }
        }
    }

    fn picture_seen(&self) -> Option<(Option<Camera>, [u32; 2])> {
        let picture = self.picture()?;
        Some((picture.camera, [picture.width, picture.height]))
    }

    /// The pixel at which what was picked is now; none if it is outside of the picture.
    pub fn picked_pixel(&self) -> Option<[u32; 2]> {
        let picked = self.picked.as_ref()?;
        let seen = self.picture_seen()?;
        if Some(seen) == self.picked_in {
            return Some(picked.pixel);
        }
        let (camera, size) = seen;
        let at = Vec3::from(picked.position);
        let [x, y] = super::project::point(&camera?, self.aspect(), at)?;
        let is_inside = (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y);
        is_inside.then(|| [(x * size[0] as f32) as u32, (y * size[1] as f32) as u32])
    }

    /// Says what came of something.
    pub fn say(&mut self, text: String) {
        self.note = Some(Note {
            text,
            is_bad: false,
        });
    }

    fn complain(&mut self, text: String) {
        self.note = Some(Note { text, is_bad: true });
    }

    /// The picture that is there.
    pub fn picture(&self) -> Option<&Arc<Picture>> {
        self.news.picture.as_ref()
    }

    /// Width over height of the picture that is there, or else asked for.
    pub fn aspect(&self) -> f32 {
        let size = self.picture().map(|p| [p.width, p.height]);
        let [width, height] = size.unwrap_or(self.news.project.size);
        if width == 0 || height == 0 {
            return 1.0;
        }
        width as f32 / height as f32
    }

    /// Something to ask for at the end of the frame.
    pub fn order(&mut self, order: Order) {
        self.orders.push(order);
    }

    /// The orders of this frame. `is_down` says whether a hand holds anything.
    pub fn settle(&mut self, is_down: bool, now: f64) -> Vec<Order> {
        let project = Arc::clone(&self.news.project);
        for (id, edit) in &mut self.edits {
            let is_released = edit.is_held && !is_down;
            if edit.is_new || is_released {
                if let Some(param) = param_of(&project, id) {
                    self.orders.push(Order::Set {
                        param: id.clone(),
                        value: values::ordered(&param.interface, &edit.value),
                        dragged: is_down,
                    });
                }
                edit.is_new = false;
                edit.is_held = is_down;
                edit.released = now;
            }
        }
        if std::mem::take(&mut self.camera_is_new)
            && let Some(camera) = self.camera
        {
            self.orders.push(Order::Look(camera));
        }
        // What takes a while to find is asked for while it is looked at.
        let looked_at = [&self.layer, &self.overlay];
        let surveys = looked_at
            .into_iter()
            .flatten()
            .any(|name| SURVEYED.contains(&name.as_str()) && self.is_own(name));
        if surveys != self.surveys {
            self.surveys = surveys;
            self.orders.push(Order::Survey(surveys));
        }
        std::mem::take(&mut self.orders)
    }

    /// Seconds until something is to be looked at again though nothing came.
    pub fn waits(&self) -> Option<f64> {
        (!self.edits.is_empty()).then_some(PATIENCE)
    }

    fn ask(&mut self, pixel: [u32; 2], purpose: Purpose) {
        self.asked.push_back(purpose);
        self.order(Order::Pick(pixel));
    }

    /// A click on a pixel, by a tool.
    pub fn click(&mut self, pixel: [u32; 2], tool: Tool) {
        match tool {
            Tool::Orbit => self.ask(pixel, Purpose::Inspect),
            Tool::Focus => self.ask(pixel, Purpose::Focus),
            Tool::Trace => self.trace(pixel, self.sample),
            Tool::Crop => {}
        }
    }

    /// A double click on a pixel.
    pub fn aim(&mut self, pixel: [u32; 2]) {
        self.ask(pixel, Purpose::Aim);
    }

    /// The path of a pixel's sample.
    pub fn trace(&mut self, pixel: [u32; 2], sample: u32) {
        self.sample = sample;
        self.order(Order::Trace { pixel, sample });
    }

    /// Only the pixels between two, the first and the one behind the last; all if there are none.
    pub fn crop_to(&mut self, crop: Option<[[u32; 2]; 2]>) {
        let [width, height] = self.picture().map_or([0, 0], |p| [p.width, p.height]);
        let whole = [[0, 0], [width, height]];
        let crop = crop.map(|[from, to]| {
            [
                [from[0].min(width), from[1].min(height)],
                [to[0].min(width), to[1].min(height)],
            ]
        });
        let crop = crop.filter(|[from, to]| from[0] < to[0] && from[1] < to[1]);
        let crop = crop.filter(|crop| *crop != whole);
        if self.crop != crop {
            self.crop = crop;
            self.order(Order::Crop(crop));
        }
    }

    /// Is the window busy with something that takes a while?
    pub fn is_working(&self) -> bool {
        matches!(
            self.news.state,
            State::Reading | State::Compiling | State::Building | State::Rendering
        )
    }
}

fn param_of<'a>(project: &'a Project, id: &ParamId) -> Option<&'a Param> {
    let binding = project.bindings.iter().find(|b| b.name == id.binding)?;
    binding.params.iter().find(|p| p.interface.name == id.param)
}

#[cfg(test)]
mod tests;
