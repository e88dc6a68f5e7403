//! What a window wants to see, as its orders leave it: of several that replace each other, the last one counts.

use std::collections::BTreeMap;
use std::time::Instant;

use impasto_compiler::ParameterValue;
use impasto_compiler::partition::{Requires, Strategy};
use impasto_runtime::film::outputs;
use impasto_runtime::render::until::{Goals, LEAST_SAMPLES};
use impasto_runtime::scene::{Camera, MAX_FRAME};
use impasto_viewer::engine::{Order, ParamId, Problem};

use super::problems;
use crate::goal;

/// Longest side of a picture in pixels.
const MAX_SIDE: u32 = 16_384;

/// A part of a picture: the first column and row, and those behind the last.
pub(super) type Area = [[u32; 2]; 2];

/// All that decides what is rendered.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wanted {
    /// From where, unless as the scene has it.
    pub camera: Option<Camera>,
    /// Columns and rows, unless as the scene has them.
    pub size: Option<[u32; 2]>,
    pub crop: Option<Area>,
    /// Values that were set.
    pub values: BTreeMap<ParamId, ParameterValue>,
    /// When the picture was last asked to be another one.
    pub moved: Instant,
    /// Is a hand at it?
    pub dragged: bool,
    pub frame: Option<u32>,
    pub outputs: Vec<String>,
    /// Is it looked at what pixels see, and by which kernels?
    pub surveys: bool,
    pub samples: u32,
    pub goals: Option<Goals>,
    pub strategy: Option<Strategy>,
    pub paused: bool,
    /// Counts when the picture was asked to begin again.
    pub restarts: u64,
    /// Counts when files were to be read again.
    pub reads: u64,
    pub quit: bool,
    /// Orders that could not be followed, by what they were about.
    pub complaints: BTreeMap<&'static str, Problem>,
}

/// What an order does to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// Nothing.
    None,
    /// It goes on differently.
    Course,
    /// It is another picture.
    Picture,
}

impl Wanted {
    /// Takes note of an order.
    pub(super) fn take(&mut self, order: Order) -> Effect {
        let before = (!matches!(order, Order::Set { .. })).then(|| self.clone());
        let effect = self.note(order);
        if before.is_some_and(|before| before == *self) {
            return Effect::None;
        }
        if effect == Effect::Picture {
            self.moved = Instant::now();
        }
        effect
    }

    fn note(&mut self, order: Order) -> Effect {
        match order {
            Order::Look(camera) => {
                if is_camera(&camera) {
                    self.camera = Some(camera);
                }
            }
            Order::LookAsWritten => self.camera = None,
            Order::Size(size) => self.size = Some(size.map(|side| side.clamp(1, MAX_SIDE))),
            Order::Crop(crop) => self.crop = crop,
            Order::Set {
                param,
                value,
                dragged,
            } => {
                self.dragged = dragged;
                let old = self.values.insert(param.clone(), value);
                // That the hand lets go changes no picture.
                if old.as_ref() == self.values.get(&param) {
                    self.moved = Instant::now();
                    return Effect::Course;
                }
            }
            Order::Reset(param) => {
                self.values.remove(&param);
                self.dragged = false;
            }
            Order::ResetAll => {
                self.values.clear();
                self.dragged = false;
            }
            Order::Frame(frame) => self.frame = Some(frame.min(MAX_FRAME)),
            Order::Outputs(names) => self.set_outputs(names),
            Order::Restart => self.restarts += 1,
            Order::Strategy(name) => self.set_strategy(&name),
            Order::Reload => {
                // Perhaps nothing changed that shows.
                self.reads += 1;
                return Effect::Course;
            }
            Order::Quit => self.quit = true,
            Order::Until(text) => {
                let had_goals = self.goals.is_some();
                self.set_goals(text.as_deref());
                // Samples of two seeds are not those of one.
                if had_goals == self.goals.is_some() {
                    return Effect::Course;
                }
            }
            Order::Survey(surveys) => {
                self.surveys = surveys;
                return Effect::Course;
            }
            Order::Samples(samples) => {
                self.samples = samples.max(1);
                return Effect::Course;
            }
            Order::Pause(paused) => {
                self.paused = paused;
                return Effect::Course;
            }
            // These are errands.
            Order::WriteBack
            | Order::Pick(_)
            | Order::Trace { .. }
            | Order::Save { .. }
            | Order::Read(_) => return Effect::None,
        }
        Effect::Picture
    }

    fn complain(&mut self, about: &'static str, why: Option<String>) {
        match why {
            Some(why) => self.complaints.insert(about, problems::of_order(why)),
            None => self.complaints.remove(about),
        };
    }

    fn set_outputs(&mut self, names: Vec<String>) {
        let wrong = names
            .iter()
            .find_map(|name| outputs::check_name(name).err());
        if wrong.is_none() {
            self.outputs = names;
        }
        self.complain("outputs", wrong);
    }

    /// Takes a strategy that can be had without measuring kernels first.
    pub(super) fn set_strategy(&mut self, name: &str) {
        let parsed = Strategy::parse(name).map_err(|e| e.to_string());
        let wrong = match parsed {
            Ok(strategy) if strategy.requires() == Requires::Measurements => Some(format!(
                "`{name}` measures every plan, which takes minutes\n  hint: `impasto plan SCENE --strategy {name}` does it"
            )),
            Ok(strategy) => {
                self.strategy = Some(strategy);
                None
            }
            Err(wrong) => Some(wrong),
        };
        self.complain("strategy", wrong);
    }

    /// Takes goals as `--until` has them, several with commas between.
    pub(super) fn set_goals(&mut self, text: Option<&str>) {
        let read = |text: &str| -> Result<Goals, String> {
            let mut goals = Goals::default();
            for part in text.split(',') {
                goal::parse(part.trim())?.add_to(&mut goals);
            }
            Ok(goals)
        };
        let wrong = match text.map(read).transpose() {
            Ok(goals) => {
                self.goals = goals;
                None
            }
            Err(wrong) => Some(wrong),
        };
        self.complain("until", wrong);
    }

    /// How many samples of a pixel there will be: an error is estimated by no fewer than some, half of them by each of
    /// two seeds.
    pub(super) fn most_samples(&self) -> u32 {
        match self.goals {
            Some(_) => self.samples.max(LEAST_SAMPLES) / 2 * 2,
            None => self.samples,
        }
    }
}

/// Can one see anything by a camera?
fn is_camera(camera: &Camera) -> bool {
    let numbers = [camera.position, camera.look_at, camera.up];
    let finite = numbers.iter().all(|v| v.is_finite());
    finite
        && camera.basis().iter().all(|v| v.length_squared() > 0.5)
        && camera.fov > 0.0
        && camera.fov < 180.0
        && (0.0..=f32::MAX).contains(&camera.aperture)
        && camera.focus > 0.0
        && camera.focus.is_finite()
}
