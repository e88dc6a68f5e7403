//! Small pictures of materials: on the ball, by the processor, so that every machine makes the same.

use std::path::Path;

use impasto_runtime::device::{Choice, Device, DeviceOptions};
use impasto_runtime::film::{Film, output};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::Renderer;
use impasto_runtime::scene::{Asked, FilmSettings};

use crate::Strategy;
use crate::converge::flip;
use crate::driver;
use crate::set::{Sample, Set};

/// Width and height in pixels.
pub const SIZE: u32 = 96;
/// Samples of each pixel.
pub const SAMPLES: u32 = 64;
/// The seed of its random numbers.
pub const SEED: u32 = 0;

/// The most that two pictures of a material may differ, as the mean of FLIP. docs/testing.md says what other seeds make.
pub const MOST: f64 = 0.08;

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// As a PNG file.
    pub png: Vec<u8>,
    /// As that file shows it, linear.
    pub film: Film,
}

/// What renders pictures.
#[derive(Debug)]
pub struct Studio {
    device: Device,
    seed: u32,
}

impl Studio {
    /// One that renders on the processor.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn open() -> Result<Self, String> {
        Self::with_seed(SEED)
    }

    /// One of other random numbers, as tests of the bound need.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn with_seed(seed: u32) -> Result<Self, String> {
        let options = DeviceOptions {
            choice: Choice::Cpu,
            ..DeviceOptions::default()
        };
        let device = Device::open(&options).map_err(|why| why.to_string())?;
        Ok(Self { device, seed })
    }

    /// Renders a material with its defaults.
    ///
    /// # Errors
    /// Why it cannot be.
    pub fn picture(&self, file: &str, material: &str) -> Result<Picture, String> {
        let film = self.film(file, material)?;
        // What is compared is what is kept: eight bits a channel.
        Ok(Picture {
            png: output::png(&film, 0.0)?,
            film: output::shown(&film, 0.0),
        })
    }

    fn film(&self, file: &str, material: &str) -> Result<Film, String> {
        let sample = Sample {
            file: file.to_owned(),
            material: Some(material.to_owned()),
            turntable: None,
        };
        let set = Set::Ball.open(&sample).map_err(|why| why.to_string())?;
        let scene = set.scene(&Asked::default());
        let mut scene = scene.map_err(|why| why.to_string())?;
        scene.film = FilmSettings {
            width: SIZE,
            height: SIZE,
        };
        let program = driver::compile(&scene).map_err(|why| why.to_string())?;
        let plan = driver::plan(&program, Strategy::OWN).map_err(|why| why.to_string())?;
        let options = RenderOptions {
            samples: SAMPLES,
            seed: self.seed,
            ..RenderOptions::default()
        };
        let renderer = Renderer::new(&self.device, &scene, &program, &plan, &options);
        let mut renderer = renderer.map_err(|why| why.to_string())?;
        let rendering = renderer.render(&mut |_| std::ops::ControlFlow::Continue(()));
        Ok(rendering.map_err(|why| why.to_string())?.film)
    }
}

/// Reads a picture of a snapshot.
pub(super) fn read(path: &Path) -> Result<Film, String> {
    output::read(path, "picture of the snapshot").map_err(|why| why.to_string())
}

/// How much people see two pictures differ: the mean of FLIP, from 0 to 1. Both are made half as large first, since what
/// noise is left in them is no difference.
///
/// # Errors
/// In words, if the sizes differ.
pub fn differs(picture: &Film, reference: &Film) -> Result<f64, String> {
    let (picture, reference) = (halved(picture), halved(reference));
    // Both are as a screen shows them.
    let map = flip::flip_at(&picture, &reference, 0.0, flip::PIXELS_PER_DEGREE)?;
    Ok(map.mean())
}

/// Means of two by two pixels.
fn halved(film: &Film) -> Film {
    let (width, height) = (film.width / 2, film.height / 2);
    let pixel = |i: u32| {
        let (x, y) = (2 * (i % width), 2 * (i / width));
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let at = |(dx, dy)| film.pixels[((y + dy) * film.width + x + dx) as usize];
        let sum = corners
            .map(at)
            .iter()
            .fold([0.0f32; 3], |sum, p| std::array::from_fn(|c| sum[c] + p[c]));
        sum.map(|s| s / 4.0)
    };
    let pixels: Vec<[f32; 3]> = (0..width * height).map(pixel).collect();
    Film {
        width,
        height,
        samples: vec![0; pixels.len()],
        pixels,
    }
}
