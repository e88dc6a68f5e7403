//! Pictures to look at: the reference, renders, and where in them the error is.
//!
//! A picture of errors shows the relative squared error of every pixel by a ramp of colors that goes with
//! the logarithm, the same in all pictures, so that they can be held against each other.

use std::path::Path;

use impasto_runtime::error::RuntimeError;
use impasto_runtime::film::Film;
use impasto_runtime::film::output;
use impasto_runtime::technique::Sampler;

/// The pictures of all scenes, in the order of [`Convergence::scenes`](super::data::Convergence).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// A scene each.
    pub scenes: Vec<ScenePictures>,
}

/// The pictures of a scene. Files are named relative to the folder of results, with `/` between folders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenePictures {
    /// The reference, a PNG.
    pub reference: String,
    /// Some renders, series by series, few samples first.
    pub renders: Vec<RenderPictures>,
}

/// A render, and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderPictures {
    /// The strategy of its series.
    pub strategy: String,
    /// The sampler of its series.
    pub sampler: Sampler,
    /// Samples a pixel.
    pub samples: u32,
    /// What it looks like, a PNG.
    pub picture: String,
    /// The relative squared error of each pixel, a PNG in false color.
    pub error: String,
}

/// The relative squared errors at the two ends of the ramp of colors, as powers of ten.
pub const ERROR_DECADES: [f64; 2] = [-6.0, 0.0];

/// The ramp, evenly spaced, in linear light.
const RAMP: [[f32; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [0.03, 0.01, 0.25],
    [0.35, 0.01, 0.25],
    [0.85, 0.12, 0.02],
    [0.95, 0.6, 0.03],
    [1.0, 1.0, 0.9],
];

/// The color of a relative squared error, linear; what is no number is the end of the ramp.
pub fn error_color(error: f64) -> [f32; 3] {
    let [low, high] = ERROR_DECADES;
    let place = if error > 0.0 {
        ((error.log10() - low) / (high - low)).clamp(0.0, 1.0)
    } else if error <= 0.0 {
        0.0
    } else {
        1.0
    };
    let last = RAMP.len() - 1;
    let along = place * last as f64;
    let step = (along as usize).min(last - 1);
    let part = (along - step as f64) as f32;
    let mix = |channel| RAMP[step][channel] * (1.0 - part) + RAMP[step + 1][channel] * part;
    [0, 1, 2].map(mix)
}

/// Writes the relative squared errors of a picture of `width` columns in false color.
///
/// # Errors
/// If the file cannot be written.
pub fn write_errors(errors: &[f64], width: u32, path: &Path) -> Result<(), RuntimeError> {
    let film = Film {
        width,
        height: errors.len() as u32 / width.max(1),
        pixels: errors.iter().map(|error| error_color(*error)).collect(),
        samples: vec![1; errors.len()],
    };
    output::write(&film, path, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_go_with_the_logarithm_and_end_where_the_ramp_does() {
        assert_eq!(error_color(0.0), RAMP[0]);
        assert_eq!(error_color(1e-9), RAMP[0]);
        for error in [1.0, 1e9, f64::INFINITY, f64::NAN] {
            assert_eq!(error_color(error), RAMP[5], "{error}");
        }
        // A fifth of six decades each.
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(near(error_color(10f64.powf(-4.8)), RAMP[1]));
        assert!(near(error_color(10f64.powf(-1.2)), RAMP[4]));
        let luminance = |c: [f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        let steps = (0..=60).map(|i| luminance(error_color(10f64.powf(-0.1 * f64::from(i)))));
        let steps: Vec<f32> = steps.collect();
        assert!(steps.windows(2).all(|pair| pair[0] > pair[1]), "{steps:?}");
    }

    #[test]
    fn errors_are_written_row_by_row() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("e.png");
        write_errors(&[0.0, 1.0, 1e-3, 1e-3, 1.0, 0.0], 3, &path).expect("written");
        let read = output::read(&path, "picture").expect("read");
        assert_eq!((read.width, read.height), (3, 2));
        assert_eq!(read.pixels[0], [0.0; 3]);
        assert!(read.pixels[1][0] > 0.99 && read.pixels[4][0] > 0.99);
        assert_eq!(read.pixels[2], read.pixels[3]);
    }
}
