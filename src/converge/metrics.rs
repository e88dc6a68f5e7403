//! How far a picture is from the truth: squared errors of radiance, and FLIP of what is seen.

use super::data::Errors;
use super::flip;
use crate::runtime::film::Film;

/// Keeps relative errors of dark pixels finite: 0.01 is the square of a tenth.
pub const RELATIVE_FLOOR: f64 = 0.01;

/// All errors of a picture against a reference of the same size.
///
/// # Errors
/// In words, if the sizes differ, a picture has no pixels or not as many as its size says, or a
/// value is no number or infinite.
pub fn errors(picture: &Film, reference: &Film) -> Result<Errors, String> {
    let [mse, relmse] = mean_squared(picture, reference)?;
    let seen = flip::flip(picture, reference, flip::PIXELS_PER_DEGREE)?;
    Ok(Errors {
        mse,
        relmse,
        flip: seen.mean(),
    })
}

/// Mean squared error and relative mean squared error, over pixels and channels.
///
/// # Errors
/// As [`errors`].
pub fn mean_squared(picture: &Film, reference: &Film) -> Result<[f64; 2], String> {
    check(picture, reference)?;
    let pixels = picture.pixels.iter().zip(&reference.pixels);
    let mut sums = [Sum::default(); 2];
    for (a, b) in pixels {
        for (sum, error) in sums.iter_mut().zip(pixel(a, b)) {
            sum.add(error);
        }
    }
    let count = picture.pixels.len() as f64;
    Ok(sums.map(|sum| sum.value() / count))
}

/// Squared error, and squared error relative to the square of the reference plus 0.01, of each pixel:
/// means over its channels. As many as the smaller of the pictures has pixels.
pub fn squared(picture: &Film, reference: &Film) -> Vec<[f64; 2]> {
    let pixels = picture.pixels.iter().zip(&reference.pixels);
    pixels.map(|(a, b)| pixel(a, b)).collect()
}

fn pixel(picture: &[f32; 3], reference: &[f32; 3]) -> [f64; 2] {
    let (mut squared, mut relative) = (0.0, 0.0);
    for (x, r) in picture.iter().zip(reference) {
        let (x, r) = (f64::from(*x), f64::from(*r));
        let error = (x - r) * (x - r);
        squared += error;
        relative += error / (r * r + RELATIVE_FLOOR);
    }
    [squared / 3.0, relative / 3.0]
}

/// Fails, in words, unless two pictures can be compared.
pub(super) fn check(picture: &Film, reference: &Film) -> Result<(), String> {
    let size = |film: &Film| format!("{}x{}", film.width, film.height);
    if (picture.width, picture.height) != (reference.width, reference.height) {
        return Err(format!(
            "the picture is {}, the reference {}; both must have one size",
            size(picture),
            size(reference)
        ));
    }
    check_values("picture", picture)?;
    check_values("reference", reference)
}

fn check_values(name: &str, film: &Film) -> Result<(), String> {
    let expected = film.width as usize * film.height as usize;
    if expected == 0 || film.pixels.len() != expected {
        return Err(format!(
            "the {name} is {}x{}, but has {} pixels",
            film.width,
            film.height,
            film.pixels.len()
        ));
    }
    let bad = |pixel: &[f32; 3]| pixel.iter().any(|value| !value.is_finite());
    match film.pixels.iter().position(bad) {
        None => Ok(()),
        Some(at) => {
            let (x, y) = (at % film.width as usize, at / film.width as usize);
            Err(format!(
                "the {name} has a value at pixel {x},{y} (counted from 0, from the upper left) that is \
                 no finite number"
            ))
        }
    }
}

/// A sum that keeps what rounding takes away, so that many small errors count beside a firefly.
/// Source: Neumaier 1974, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen".
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    pub(super) fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        self.lost += if self.sum.abs() >= value.abs() {
            (self.sum - sum) + value
        } else {
            (value - sum) + self.sum
        };
        self.sum = sum;
    }

    pub(super) fn value(self) -> f64 {
        // The squares of the largest floats may overflow a sum of many, where nothing is lost.
        if self.sum.is_finite() {
            self.sum + self.lost
        } else {
            self.sum
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(width: u32, pixels: &[[f32; 3]]) -> Film {
        Film {
            width,
            height: pixels.len() as u32 / width,
            samples: vec![1; pixels.len()],
            pixels: pixels.to_vec(),
        }
    }

    #[test]
    fn errors_are_means_over_pixels_and_channels() {
        let reference = film(2, &[[1.0, 0.0, 3.0], [0.0; 3]]);
        let picture = film(2, &[[1.5, 0.0, 1.0], [0.0, 0.1, 0.0]]);
        let [mse, relmse] = mean_squared(&picture, &reference).expect("comparable");
        let expected = (0.25 + 4.0 + 0.01) / 6.0;
        assert!((mse - expected).abs() < 1e-8, "{mse}");
        let expected = (0.25 / 1.01 + 4.0 / 9.01 + 1.0) / 6.0;
        assert!((relmse - expected).abs() < 1e-7, "{relmse}");
        let all = errors(&picture, &reference).expect("comparable");
        assert_eq!([all.mse, all.relmse], [mse, relmse]);
        assert!(all.flip > 0.0 && all.flip < 1.0);
    }

    #[test]
    fn errors_of_pixels_average_to_those_of_the_picture() {
        let reference = film(3, &[[1.0, 0.2, 3.0], [0.0; 3], [7.0, 8.0, 9.0]]);
        let picture = film(3, &[[1.1, 0.0, 2.0], [0.5; 3], [7.0, 8.0, 9.0]]);
        let each = squared(&picture, &reference);
        assert_eq!(each[2], [0.0; 2]);
        let means = mean_squared(&picture, &reference).expect("comparable");
        for (i, mean) in means.into_iter().enumerate() {
            let sum: f64 = each.iter().map(|e| e[i]).sum();
            assert!((sum / 3.0 - mean).abs() < 1e-12);
        }
        // The relative error is relative to the reference, so that it has a direction.
        let back = mean_squared(&reference, &picture).expect("comparable");
        assert_eq!(back[0], means[0]);
        assert_ne!(back[1], means[1]);
    }

    #[test]
    fn pictures_that_cannot_be_compared_are_refused_in_words() {
        let (a, b) = (film(2, &[[0.0; 3]; 2]), film(1, &[[0.0; 3]; 2]));
        let other_size = errors(&a, &b).expect_err("refused");
        assert!(
            other_size.contains("2x1") && other_size.contains("1x2"),
            "{other_size}"
        );
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let bad = film(2, &[[0.0; 3], [0.0, value, 0.0]]);
            let picture = errors(&bad, &a).expect_err("refused");
            assert!(
                picture.contains("the picture") && picture.contains("1,0"),
                "{picture}"
            );
            let reference = errors(&a, &bad).expect_err("refused");
            assert!(reference.contains("the reference"), "{reference}");
        }
        let mut short = a.clone();
        short.pixels.pop();
        assert!(errors(&short, &a).is_err_and(|e| e.contains("1 pixels")));
    }

    #[test]
    fn small_errors_count_beside_a_firefly() {
        let mut sum = Sum::default();
        let firefly = f64::powi(2.0, 60);
        sum.add(firefly);
        (0..1 << 20).for_each(|_| sum.add(1.0));
        assert_eq!(sum.value() - firefly, f64::from(1 << 20));
        let extremes = film(1, &[[f32::MAX; 3]]);
        let black = film(1, &[[0.0; 3]]);
        let [mse, relmse] = mean_squared(&extremes, &black).expect("comparable");
        assert!(mse.is_finite() && relmse.is_finite());
    }
}
