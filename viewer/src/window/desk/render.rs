//! How the picture is rendered: until when, by which kernels, how large; and where it is saved.

use std::path::PathBuf;

use super::{Desk, FIRST_NUMBER};
use crate::engine::Order;

impl Desk {
    /// Ends at another number of samples.
    pub fn take_samples(&mut self, samples: u32) {
        if self.samples != samples && samples > 0 {
            self.samples = samples;
            self.order(Order::Samples(samples));
        }
    }

    /// Asks for the goals as they stand.
    pub fn order_goals(&mut self) {
        self.order(Order::Until(self.goals.text()));
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
}
