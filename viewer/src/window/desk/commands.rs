//! What keys and buttons ask for.

use glam::Vec3;

use super::super::compare::Mode;
use super::super::keys::Command;
use super::super::navigate;
use super::super::picture::Channel;
use super::super::tone::Curve;
use super::{Desk, Tool};
use crate::engine::Order;

impl Desk {
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
            .filter(|name| self.has_layer(name) || self.is_own(name))
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
