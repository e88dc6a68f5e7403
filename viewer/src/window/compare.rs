//! A picture beside another: snapshots, files, a wipe, differences, and how large they are.

use std::sync::Arc;

use crate::engine::Picture;

/// How a picture is compared with a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Not at all.
    #[default]
    Off,
    /// The picture left of a line that a hand moves, the snapshot right of it.
    Wipe,
    /// The snapshot alone, to flip between the two.
    Flip,
    /// |a - b|
    Absolute,
    /// |a - b| / (|b| + 0.01)
    Relative,
    /// (a - b)^2
    Squared,
}

impl Mode {
    /// All, in the order of the menu.
    pub const ALL: [Self; 6] = [
        Self::Off,
        Self::Wipe,
        Self::Flip,
        Self::Absolute,
        Self::Relative,
        Self::Squared,
    ];

    /// What the menu calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "Off",
            Self::Wipe => "Wipe",
            Self::Flip => "Snapshot alone",
            Self::Absolute => "Absolute difference",
            Self::Relative => "Relative difference",
            Self::Squared => "Squared difference",
        }
    }

    /// What it does, in a sentence.
    pub fn about(self) -> &'static str {
        match self {
            Self::Off => "The picture alone.",
            Self::Wipe => {
                "The picture to the left of a line, the snapshot to the right. Drag the line."
            }
            Self::Flip => "The snapshot in the picture's place.",
            Self::Absolute => "|a - b|, of the picture a and the snapshot b.",
            Self::Relative => "|a - b| / (|b| + 0.01), of the picture a and the snapshot b.",
            Self::Squared => "(a - b)^2, of the picture a and the snapshot b.",
        }
    }

    /// Is it one of the differences?
    pub fn is_difference(self) -> bool {
        matches!(self, Self::Absolute | Self::Relative | Self::Squared)
    }

    fn apart(self, a: f32, b: f32) -> f32 {
        let distance = (a - b).abs();
        match self {
            Self::Relative => distance / (b.abs() + 0.01),
            Self::Squared => distance * distance,
            _ => distance,
        }
    }
}

/// A picture that is kept.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// What the list calls it.
    pub name: String,
    /// The picture.
    pub picture: Arc<Picture>,
}

/// How far apart two pictures of one size are.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The difference of each pixel.
    pub pixels: Vec<[f32; 3]>,
    /// The mean of |a - b|.
    pub absolute: f64,
    /// The root of the mean of (a - b)^2.
    pub root_square: f64,
    /// The mean of (a - b)^2 / (b^2 + 0.01).
    pub relative_square: f64,
}

/// The difference of a picture to a reference; nothing if they have different sizes.
pub fn difference(picture: &Picture, reference: &Picture, mode: Mode) -> Option<Difference> {
    let is_alike = (picture.width, picture.height) == (reference.width, reference.height)
        && picture.pixels.len() == reference.pixels.len();
    if !is_alike {
        return None;
    }
    let (mut absolute, mut square, mut relative) = (0.0, 0.0, 0.0);
    let pairs = picture.pixels.iter().zip(reference.pixels.iter());
    let pixels = pairs.map(|(a, b)| {
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            let apart = (a - b).abs();
            if apart.is_finite() {
                absolute += apart;
                square += apart * apart;
                relative += apart * apart / (b * b + 0.01);
            }
        }
        std::array::from_fn(|i| mode.apart(a[i], b[i]))
    });
    let pixels: Vec<[f32; 3]> = pixels.collect();
    let count = (3 * pixels.len()).max(1) as f64;
    Some(Difference {
        pixels,
        absolute: absolute / count,
        root_square: (square / count).sqrt(),
        relative_square: relative / count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, pixels: &[[f32; 3]]) -> Picture {
        Picture {
            width,
            height: pixels.len() as u32 / width,
            pixels: Arc::new(pixels.to_vec()),
            ..Picture::default()
        }
    }

    #[test]
    fn differences_are_those_of_their_formulas() {
        let a = picture(1, &[[0.5, 0.0, 1.0]]);
        let b = picture(1, &[[0.25, 0.0, 3.0]]);
        let of = |mode| difference(&a, &b, mode).expect("of one size").pixels[0];
        assert_eq!(of(Mode::Absolute), [0.25, 0.0, 2.0]);
        assert_eq!(of(Mode::Squared), [0.0625, 0.0, 4.0]);
        let relative = of(Mode::Relative);
        assert!(
            (relative[0] - 0.25 / 0.26).abs() < 1e-6 && (relative[2] - 2.0 / 3.01).abs() < 1e-6
        );
        let all = difference(&a, &b, Mode::Absolute).expect("of one size");
        assert!((all.absolute - 2.25 / 3.0).abs() < 1e-9);
        assert!((all.root_square - (4.0625f64 / 3.0).sqrt()).abs() < 1e-9);
        let relative = (0.0625 / 0.0725 + 4.0 / 9.01) / 3.0;
        assert!((all.relative_square - relative).abs() < 1e-9);
    }

    #[test]
    fn other_sizes_have_none_and_what_is_no_number_counts_for_nothing() {
        let a = picture(2, &[[0.5; 3]; 4]);
        assert_eq!(
            difference(&a, &picture(4, &[[0.5; 3]; 4]), Mode::Absolute),
            None
        );
        let mut bad = picture(2, &[[0.5; 3]; 4]);
        bad.pixels = Arc::new(vec![[f32::NAN; 3], [0.5; 3], [0.5; 3], [0.5; 3]]);
        let apart = difference(&a, &bad, Mode::Absolute).expect("of one size");
        assert_eq!(apart.absolute, 0.0);
        assert!(apart.pixels[0][0].is_nan());
        let none = difference(&Picture::default(), &Picture::default(), Mode::Squared);
        assert_eq!(none.expect("of one size").absolute, 0.0);
    }
}
