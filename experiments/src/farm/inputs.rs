//! What goes into the simulation: films, farms, and where each number is from.

use std::fmt::Write as _;

use super::sim::{Farm, Job, NODE};

/// The films of a kind of picture.
#[derive(Clone, Copy)]
pub(super) struct Film {
    pub name: &'static str,
    pub size: (u32, u32),
    /// Planes that its file holds: those that are not all zero.
    pub planes: u32,
    /// Planes of the film on the GPU.
    pub all_planes: u32,
    /// Seconds between two checkpoints.
    pub every: f64,
}

pub(super) const FILMS: [Film; 2] = [
    Film {
        name: "HD",
        size: (1920, 1080),
        planes: 7,
        all_planes: 10,
        every: 30.0,
    },
    Film {
        name: "4K with outputs",
        size: (3840, 2160),
        planes: 32,
        all_planes: 56,
        every: 30.0,
    },
];

/// Seconds in which a byte of a film is read from the GPU and put in order.
const GATHER: f64 = 3.8 / 1.83e9;
/// Seconds between two failures of a node: 6.5 in a thousand days of a node.
pub(super) const FAILURES: f64 = 24_000.0 / 6.5 * 3600.0;
/// Farms of so many GPUs, and the bytes a second of their file systems.
pub(super) const SIZES: [(usize, f64); 4] =
    [(10, 1.2e9), (100, 5e9), (1000, 20e9), (10_000, 100e9)];

impl Film {
    /// Bytes of its file.
    pub fn bytes(&self) -> f64 {
        self.of(self.planes)
    }

    /// Words of 4 bytes, one a pixel and plane.
    fn of(&self, planes: u32) -> f64 {
        4.0 * f64::from(planes) * f64::from(self.size.0) * f64::from(self.size.1)
    }

    pub fn gather(&self) -> f64 {
        GATHER * self.of(self.all_planes)
    }

    /// A job of pictures in parts of some minutes.
    pub fn job(&self, pictures: usize, parts: usize, minutes: f64) -> Job {
        Job {
            pictures,
            parts,
            seconds: 60.0 * minutes,
            every: self.every,
            film: self.bytes(),
            gather: self.gather(),
            fan_in: usize::MAX,
            in_turn: false,
        }
    }

    /// A job that takes every GPU so many minutes, in pictures of 200 minutes each.
    pub fn work(&self, gpus: usize, each: f64, minutes: f64) -> Job {
        let pictures = (gpus as f64 * each / 200.0).round().max(1.0) as usize;
        let parts = (200.0 / minutes).round().max(1.0);
        self.job(pictures, parts as usize, 200.0 / parts)
    }
}

/// A farm as it is assumed to be.
pub(super) fn farm((gpus, bandwidth): (usize, f64)) -> Farm {
    Farm {
        gpus,
        start: 5.0,
        spread: 0.1,
        failures: FAILURES,
        notice: 300.0,
        repair: 3600.0,
        dispatch: 20.0,
        bandwidth,
        stream: 1.14e9,
        mergers: gpus.div_ceil(NODE),
        merge_start: 1.0,
        seed: 1,
    }
}

/// What goes in, for the page.
pub(super) fn section() -> String {
    let mut text = String::from(super::prose::INPUTS);
    for film in FILMS {
        let (width, height) = film.size;
        let _ = writeln!(
            text,
            "| {} | {width} x {height} | {} of {} | {:.3} GB | {:.1} s |",
            film.name,
            film.planes,
            film.all_planes,
            film.bytes() / 1e9,
            film.gather()
        );
    }
    text + super::prose::ASSUMED
}
