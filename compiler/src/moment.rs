//! When a material is seen.

/// The frame that is rendered, and the time that it is of: the values of the inputs `frame` and `time`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// The number of the frame.
    pub frame: f64,
    /// Seconds since frame 0.
    pub time: f64,
}

impl Moment {
    /// A frame of so many a second.
    pub fn of_frame(frame: f64, frames_per_second: f64) -> Self {
        Self {
            frame,
            time: frame / frames_per_second,
        }
    }
}
