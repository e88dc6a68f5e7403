//! What the window knows and what it asks for, without a window: news and hands come in, orders go out.
//!
//! Everything that hands do is a method here, so that tests do it too. Orders are gathered during a frame and leave at
//! its end ([`Desk::settle`]): a value that is dragged is sent once a frame, and once more when the hand lets go.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;
use impasto_compiler::interface::Value;
use impasto_runtime::scene::Camera;

use super::compare::{Mode, Snapshot};
use super::keys::Command;
use super::navigate;
use super::picture::{Channel, Look, SAMPLES};
use super::tone::Curve;
use super::values;
use crate::engine::{
    Answer, LayerKind, News, Order, Param, ParamId, Picked, Picture, Project, State, Traced,
};

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
    /// The goal: which, and how large, as texts.
    pub goal: (Goal, String),
    /// The strategy that was asked for.
    pub strategy: Option<String>,
    /// Is the engine asked to rest?
    pub is_paused: bool,
    /// Outputs that were asked for; those that the engine began with if none were.
    outputs: Option<Vec<String>>,
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

/// Goals at which a render ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Goal {
    /// When all samples are taken.
    #[default]
    Samples,
    /// The relative mean squared error.
    RelMse,
    /// The root of the mean squared error.
    Rmse,
    /// A time.
    Time,
}

impl Goal {
    /// All, in the order of the menu.
    pub const ALL: [Self; 4] = [Self::Samples, Self::RelMse, Self::Rmse, Self::Time];

    /// What the menu calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples alone",
            Self::RelMse => "relMSE",
            Self::Rmse => "RMSE",
            Self::Time => "time",
        }
    }

    /// What stands in its field first.
    fn first(self) -> &'static str {
        match self {
            Self::Samples => "",
            Self::RelMse => "1e-3",
            Self::Rmse => "0.01",
            Self::Time => "60s",
        }
    }

    fn order(self, size: &str) -> Option<String> {
        let name = match self {
            Self::Samples => return None,
            Self::RelMse => "relmse",
            Self::Rmse => "rmse",
            Self::Time => "time",
        };
        Some(format!("{name}={}", size.trim()))
    }
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
            goal: (Goal::default(), String::new()),
            strategy: None,
            is_paused: false,
            outputs: None,
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
        std::mem::take(&mut self.orders)
    }

    /// Seconds until something is to be looked at again though nothing came.
    pub fn waits(&self) -> Option<f64> {
        (!self.edits.is_empty()).then_some(PATIENCE)
    }

    /// The value that is shown for a parameter: a hand's, or else the engine's.
    pub fn value<'a>(&'a self, id: &ParamId, param: &'a Param) -> &'a Value {
        self.edits.get(id).map_or(&param.value, |edit| &edit.value)
    }

    /// Does a parameter have another value than the scene has?
    pub fn is_set(&self, id: &ParamId, param: &Param) -> bool {
        param.is_set || self.edits.contains_key(id)
    }

    /// Gives a parameter a value, within its limits.
    pub fn set(&mut self, id: &ParamId, value: Value) {
        let Some(before) = self.put(id, value) else {
            return;
        };
        if let Some(before) = before {
            self.undo.push((id.clone(), before));
            if self.undo.len() > UNDO {
                self.undo.remove(0);
            }
            self.redo.clear();
        }
    }

    /// Gives a value. What was there before, unless a hand already holds it; nothing if nothing changes.
    fn put(&mut self, id: &ParamId, value: Value) -> Option<Option<Value>> {
        let project = Arc::clone(&self.news.project);
        let param = param_of(&project, id)?;
        if param.is_animated || !param.interface.settable {
            return None;
        }
        let value = values::held(&param.interface, value);
        let before = self.value(id, param).clone();
        let is_held = self.edits.get(id).is_some_and(|edit| edit.is_held);
        if before == value {
            return None;
        }
        self.edits.insert(
            id.clone(),
            Edit {
                value,
                is_new: true,
                is_held: true,
                released: 0.0,
            },
        );
        Some((!is_held).then_some(before))
    }

    /// Takes the last value back.
    fn undo(&mut self) {
        if let Some((id, value)) = self.undo.pop()
            && let Some(Some(before)) = self.put(&id, value)
        {
            self.redo.push((id, before));
        }
    }

    fn redo(&mut self) {
        if let Some((id, value)) = self.redo.pop()
            && let Some(Some(before)) = self.put(&id, value)
        {
            self.undo.push((id, before));
        }
    }

    /// A parameter as it is written.
    pub fn reset(&mut self, id: &ParamId) {
        self.edits.remove(id);
        self.order(Order::Reset(id.clone()));
    }

    /// All of them.
    pub fn reset_all(&mut self) {
        self.edits.clear();
        self.order(Order::ResetAll);
    }

    /// How many parameters have another value than the scene has.
    pub fn count_set(&self) -> usize {
        let bindings = self.news.project.bindings.iter();
        let params = bindings.flat_map(|binding| {
            binding.params.iter().map(|param| {
                let id = ParamId {
                    binding: binding.name.clone(),
                    param: param.interface.name.clone(),
                };
                self.is_set(&id, param)
            })
        });
        params.filter(|is_set| *is_set).count()
    }

    /// The camera that is asked for, or else that of the scene.
    pub fn camera(&self) -> Option<Camera> {
        self.camera.or(self.news.project.camera)
    }

    /// Has a hand moved the camera?
    pub fn has_moved(&self) -> bool {
        self.camera.is_some()
    }

    /// The picture from here.
    pub fn look_from(&mut self, camera: Camera) {
        if self.camera() != Some(camera) {
            self.camera = Some(camera);
            self.camera_is_new = true;
        }
    }

    /// The point that the camera turns about.
    pub fn pivot(&self) -> Vec3 {
        let looked_at = self.camera().map(|c| c.look_at);
        self.pivot.or(looked_at).unwrap_or_default()
    }

    fn least_distance(&self) -> f64 {
        let bounds = self.news.project.bounds;
        let size =
            bounds.map(|[low, high]| f64::from((Vec3::from(high) - Vec3::from(low)).length()));
        size.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0) * 1e-4
    }

    /// A hand turns the camera by so many heights of the picture: to the right and down.
    pub fn drag_orbit(&mut self, right: f32, down: f32) {
        if let Some(camera) = self.camera() {
            let (yaw, pitch) = (f64::from(right), -f64::from(down));
            let half = std::f64::consts::PI;
            self.look_from(navigate::orbit(
                &camera,
                self.pivot(),
                half * yaw,
                half * pitch,
            ));
        }
    }

    /// A hand moves the camera sideways.
    pub fn drag_pan(&mut self, right: f32, down: f32) {
        if let Some(camera) = self.camera() {
            self.look_from(navigate::pan(
                &camera,
                self.pivot(),
                right.into(),
                down.into(),
            ));
        }
    }

    /// A hand moves the camera nearer by so many notches of a wheel.
    pub fn dolly(&mut self, notches: f32) {
        if let Some(camera) = self.camera() {
            let factor = 0.9f64.powf(f64::from(notches.clamp(-50.0, 50.0)));
            self.look_from(navigate::dolly(
                &camera,
                self.pivot(),
                factor,
                self.least_distance(),
            ));
        }
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

    /// Keeps the picture as it is now.
    pub fn take_snapshot(&mut self) {
        let Some(picture) = self.picture().map(Arc::clone) else {
            return;
        };
        self.taken += 1;
        let name = format!("{}: {} spp", self.taken, picture.samples);
        self.keep(name, picture);
    }

    fn keep(&mut self, name: String, picture: Arc<Picture>) {
        if self.snapshots.len() == SNAPSHOTS {
            self.snapshots.remove(0);
        }
        self.say(format!("Snapshot {name}"));
        self.snapshots.push(Snapshot { name, picture });
        self.chosen = self.snapshots.len() - 1;
    }

    /// Forgets a snapshot.
    pub fn forget(&mut self, index: usize) {
        if index < self.snapshots.len() {
            self.snapshots.remove(index);
            if self.chosen > index || self.chosen >= self.snapshots.len() {
                self.chosen = self.chosen.saturating_sub(1);
            }
        }
        if self.snapshots.is_empty() {
            self.compare = Mode::Off;
        }
    }

    /// The picture that is seen at a share of its width: it, or the snapshot that stands in its place.
    pub fn seen_at(&self, share: f32) -> Option<&Arc<Picture>> {
        let is_snapshot = match self.compare {
            Mode::Flip => true,
            Mode::Wipe => share >= self.wipe,
            _ => false,
        };
        let snapshot = self.reference().filter(|_| is_snapshot);
        snapshot.map(|s| &s.picture).or(self.picture())
    }

    /// The snapshot that the picture is compared with, if it is compared.
    pub fn reference(&self) -> Option<&Snapshot> {
        let snapshot = self.snapshots.get(self.chosen);
        snapshot.filter(|_| self.compare != Mode::Off)
    }

    /// Compares in this way; takes a snapshot if there is none.
    pub fn compare_by(&mut self, mode: Mode) {
        if mode != Mode::Off && self.snapshots.is_empty() {
            self.take_snapshot();
        }
        self.compare = if self.snapshots.is_empty() {
            Mode::Off
        } else {
            mode
        };
    }

    /// Names of layers that can be shown, and what they are: those of the picture, and outputs that could be recorded.
    pub fn layers(&self) -> Vec<(String, String)> {
        let mut layers: Vec<(String, String)> = Vec::new();
        if let Some(picture) = self.picture() {
            for layer in &picture.layers {
                layers.push((layer.name.clone(), layer.about.clone()));
            }
            if !layers.iter().any(|(name, _)| name == SAMPLES) {
                layers.push((
                    SAMPLES.to_owned(),
                    "How many samples the pixel has.".to_owned(),
                ));
            }
        }
        for (name, about) in &self.news.project.outputs {
            if !layers.iter().any(|(known, _)| known == name) {
                layers.push((name.clone(), about.clone()));
            }
        }
        layers
    }

    /// Does the picture have this layer?
    pub fn has_layer(&self, name: &str) -> bool {
        let picture = self.picture();
        name == SAMPLES || picture.is_some_and(|p| p.layers.iter().any(|l| l.name == name))
    }

    /// Shows a layer, and has it recorded if it is not.
    pub fn show(&mut self, layer: Option<String>) {
        if let Some(name) = &layer {
            self.record_if_needed(name);
        }
        self.layer = layer;
    }

    /// Lays a layer over the picture.
    pub fn lay_over(&mut self, layer: Option<String>) {
        if let Some(name) = &layer {
            self.record_if_needed(name);
        }
        self.overlay = layer;
    }

    fn record_if_needed(&mut self, name: &str) {
        let can_be = self
            .news
            .project
            .outputs
            .iter()
            .any(|(known, _)| known == name);
        if can_be && !self.has_layer(name) {
            self.record(name, true);
        }
    }

    /// Outputs that are recorded: those that were asked for, or else those that the picture came with.
    pub fn recorded(&self) -> Vec<String> {
        if let Some(outputs) = &self.outputs {
            return outputs.clone();
        }
        let is_output = |name: &String| {
            let outputs = &self.news.project.outputs;
            outputs.iter().any(|(known, _)| known == name)
        };
        let layers = self.picture().map_or(&[][..], |p| &p.layers);
        let names = layers.iter().map(|layer| layer.name.clone());
        names.filter(is_output).collect()
    }

    /// Records an output from now on, or no longer.
    pub fn record(&mut self, name: &str, is_on: bool) {
        let mut outputs = self.recorded();
        if outputs.iter().any(|known| known == name) == is_on {
            return;
        }
        if is_on {
            outputs.push(name.to_owned());
        } else {
            outputs.retain(|known| known != name);
        }
        self.outputs = Some(outputs.clone());
        self.order(Order::Outputs(outputs));
    }

    /// Ends at another number of samples.
    pub fn take_samples(&mut self, samples: u32) {
        if self.samples != samples && samples > 0 {
            self.samples = samples;
            self.order(Order::Samples(samples));
        }
    }

    /// Ends by another goal.
    pub fn end_by(&mut self, goal: Goal) {
        if self.goal.0 != goal {
            self.goal = (goal, goal.first().to_owned());
            self.order_goal();
        }
    }

    /// Asks for the goal as it stands.
    pub fn order_goal(&mut self) {
        let (goal, size) = &self.goal;
        self.order(Order::Until(goal.order(size)));
    }

    /// Which materials share kernels. A strategy that takes a number, such as `threshold=`, begins with one.
    pub fn plan_by(&mut self, strategy: &str) {
        let mut strategy = strategy.to_owned();
        if strategy.ends_with('=') {
            strategy += FIRST_NUMBER;
        }
        if self.strategy() != strategy {
            self.strategy = Some(strategy.clone());
            self.order(Order::Strategy(strategy));
        }
    }

    /// The strategy that was asked for, or else that of the plan.
    pub fn strategy(&self) -> &str {
        self.strategy
            .as_deref()
            .unwrap_or(&self.news.kernels.strategy)
    }

    /// Another frame of what moves.
    pub fn go_to(&mut self, frame: u32) {
        if let Some([first, last]) = self.news.project.frames {
            let frame = frame.clamp(first, last.max(first));
            if frame != self.frame {
                self.frame = frame;
                self.order(Order::Frame(frame));
            }
        }
    }

    /// A picture of another size.
    pub fn resize(&mut self, size: [u32; 2]) {
        let size = size.map(|n| n.clamp(1, 16_384));
        let is_other = self.picture().is_none_or(|p| [p.width, p.height] != size);
        if is_other || self.has_sized {
            self.has_sized = true;
            self.order(Order::Size(size));
        }
    }

    /// Writes the picture to the file of the dialog, with this extension if one is given.
    pub fn save(&mut self, extension: Option<&str>) {
        let mut path = PathBuf::from(self.save_as.trim());
        if path.as_os_str().is_empty() {
            self.complain("The file needs a name".to_owned());
            return;
        }
        if let Some(extension) = extension {
            path.set_extension(extension);
        }
        self.save_as = path.display().to_string();
        let exposure = self.look.exposure;
        self.order(Order::Save { path, exposure });
        self.shows_save = false;
    }

    /// Reads a picture to compare with.
    pub fn read(&mut self) {
        let path = self.read_from.trim();
        if !path.is_empty() {
            self.order(Order::Read(PathBuf::from(path)));
        }
    }

    /// Writes values into the scene file.
    pub fn write_back(&mut self) {
        if self.news.project.is_scene {
            self.order(Order::WriteBack)
        } else {
            self.complain("This is no scene file: there is nothing to write into".to_owned())
        }
    }

    /// Is the window busy with something that takes a while?
    pub fn is_working(&self) -> bool {
        matches!(
            self.news.state,
            State::Reading | State::Compiling | State::Building | State::Rendering
        )
    }

    /// Does the layer that is shown have numbers, so that it is shown in colors?
    pub fn shows_numbers(&self) -> bool {
        match &self.layer {
            None => self.look.is_false,
            Some(name) => {
                let picture = self.picture();
                let layer = picture.and_then(|p| p.layers.iter().find(|l| l.name == *name));
                layer.map_or(name == SAMPLES, |l| l.kind == LayerKind::Number)
            }
        }
    }

    /// Does what a key or a button asks for, but for what concerns the picture's place in the window.
    pub fn command(&mut self, command: Command) {
        match command {
            Command::Help => self.shows_help = !self.shows_help,
            Command::Leave => self.leave(),
            Command::Home => {
                self.camera = None;
                self.camera_is_new = false;
                self.pivot = None;
                self.order(Order::LookAsWritten);
            }
            Command::Frame => self.frame_selection(),
            Command::ToolOrbit => self.tool = Tool::Orbit,
            Command::ToolFocus => self.tool = Tool::Focus,
            Command::ToolTrace => self.tool = Tool::Trace,
            Command::ToolCrop => self.tool = Tool::Crop,
            Command::Pause => {
                self.is_paused = !self.is_paused;
                self.order(Order::Pause(self.is_paused));
            }
            Command::Restart => self.order(Order::Restart),
            Command::Reload => self.order(Order::Reload),
            Command::NextFrame => self.go_to(self.frame.saturating_add(1)),
            Command::LastFrame => self.go_to(self.frame.saturating_sub(1)),
            Command::Brighter => self.expose(self.look.exposure + 0.5),
            Command::Darker => self.expose(self.look.exposure - 0.5),
            Command::Exposure0 => self.expose(0.0),
            Command::NextCurve => self.look.curve = after(&Curve::ALL, self.look.curve),
            Command::NextChannel => self.look.channel = after(&Channel::ALL, self.look.channel),
            Command::NextLayer => self.next_layer(),
            Command::FalseColor => self.look.is_false = !self.look.is_false,
            Command::MarkClipped => self.look.mark_clipped = !self.look.mark_clipped,
            Command::MarkNonfinite => self.look.mark_nonfinite = !self.look.mark_nonfinite,
            Command::Snapshot => self.take_snapshot(),
            Command::Wipe => self.toggle(Mode::Wipe),
            Command::Flip => self.toggle(Mode::Flip),
            Command::Difference => self.compare_by(match self.compare {
                Mode::Absolute => Mode::Relative,
                Mode::Relative => Mode::Squared,
                Mode::Squared => Mode::Off,
                _ => Mode::Absolute,
            }),
            Command::Panels => self.shows_panels = !self.shows_panels,
            Command::Undo => self.undo(),
            Command::Redo => self.redo(),
            Command::WriteBack => self.write_back(),
            Command::Save => {
                self.shows_save = !self.shows_save;
                self.has_opened_save = self.shows_save;
            }
            Command::Fit | Command::ActualPixels | Command::Larger | Command::Smaller => {}
        }
    }

    /// Sets the exposure, in stops.
    pub fn expose(&mut self, stops: f32) {
        self.look.exposure = stops.clamp(-20.0, 20.0);
    }

    fn toggle(&mut self, mode: Mode) {
        self.compare_by(if self.compare == mode {
            Mode::Off
        } else {
            mode
        });
    }

    fn leave(&mut self) {
        if self.shows_help || self.shows_save {
            self.shows_help = false;
            self.shows_save = false;
        } else if self.tool != Tool::Orbit {
            self.tool = Tool::Orbit;
        } else if self.crop.is_some() {
            self.crop_to(None);
        } else if self.traced.is_some() {
            self.traced = None;
            self.shows_trace = false;
        } else {
            self.picked = None;
            self.note = None;
        }
    }

    /// What was picked in the middle of the picture, or else everything.
    fn frame_selection(&mut self) {
        let Some(camera) = self.camera() else {
            return;
        };
        let aspect = f64::from(self.aspect());
        let picked = self.picked.as_ref();
        let framed = match (
            picked,
            picked.and_then(|p| p.bounds),
            self.news.project.bounds,
        ) {
            (Some(_), Some(bounds), _) | (None, _, Some(bounds)) => {
                self.pivot = Some((Vec3::from(bounds[0]) + Vec3::from(bounds[1])) * 0.5);
                navigate::frame(&camera, bounds, aspect)
            }
            (Some(picked), None, _) => navigate::aim(&camera, Vec3::from(picked.position)),
            (None, _, None) => return,
        };
        self.look_from(framed);
    }

    fn next_layer(&mut self) {
        let there: Vec<String> = self.layers().into_iter().map(|(name, _)| name).collect();
        let there: Vec<String> = there
            .into_iter()
            .filter(|name| self.has_layer(name))
            .collect();
        let next = match &self.layer {
            None => there.first().cloned(),
            Some(now) => {
                let place = there.iter().position(|name| name == now);
                place.and_then(|place| there.get(place + 1).cloned())
            }
        };
        self.layer = next;
    }
}

fn after<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let place = all.iter().position(|one| *one == now);
    place.map_or(now, |place| all[(place + 1) % all.len()])
}

fn param_of<'a>(project: &'a Project, id: &ParamId) -> Option<&'a Param> {
    let binding = project.bindings.iter().find(|b| b.name == id.binding)?;
    binding.params.iter().find(|p| p.interface.name == id.param)
}

#[cfg(test)]
#[path = "desk_tests.rs"]
mod tests;
