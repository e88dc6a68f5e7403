//! The levels of a texture: ever smaller versions of a picture, which lookups over a width read.
//!
//! A level has half the columns and rows of the one before, rounded down, and each of its texels is
//! the mean over the part of the picture that it covers. Where a side is odd, that is two texels and
//! a half or so: the box filter weights texels by the area that is covered, as in Guthe and Heckbert
//! 2005, "Non-power-of-two mipmapping" (NVIDIA), so every level has the mean of the picture.

use crate::image_file::Picture;

/// A picture and its levels down to one texel, largest first. If alpha is `coverage`, colors count by
/// it, and a texel without any takes the color of the smallest surroundings that have some.
pub(super) fn pyramid(picture: Picture, coverage: bool) -> Vec<Picture> {
    let mut levels = vec![if coverage {
        times_alpha(picture)
    } else {
        picture
    }];
    while let Some(last) = levels.last()
        && (last.width > 1 || last.height > 1)
    {
        let smaller = half(last);
        levels.push(smaller);
    }
    if coverage {
        // From the smallest: a level is filled from the one after it.
        for i in (0..levels.len()).rev() {
            let (larger, smaller) = levels.split_at_mut(i + 1);
            if let Some(level) = larger.last_mut() {
                over_alpha(level, smaller.first());
            }
        }
    }
    levels
}

/// A picture of half the size, each texel the mean of what it covers.
fn half(picture: &Picture) -> Picture {
    let (width, height) = ((picture.width / 2).max(1), (picture.height / 2).max(1));
    let columns = covered(picture.width, width);
    let rows = covered(picture.height, height);
    let row_mean = |from: &[[f32; 4]], taps: &Taps| {
        let mut sum = [0.0f64; 4];
        for (k, weight) in taps.weights.iter().enumerate() {
            let texel = from.get(taps.first + k).copied().unwrap_or_default();
            sum.iter_mut()
                .zip(texel)
                .for_each(|(s, x)| *s += weight * f64::from(x));
        }
        sum
    };
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0f64; 4];
            for (k, weight) in row.weights.iter().enumerate() {
                let line = picture.row(row.first + k);
                let mean = row_mean(line, column);
                sum.iter_mut().zip(mean).for_each(|(s, x)| *s += weight * x);
            }
            texels.push(sum.map(|x| x as f32));
        }
    }
    Picture {
        width,
        height,
        texels,
    }
}

/// The texels of a side that one of a smaller version covers: the first, and the share of each.
struct Taps {
    first: usize,
    weights: [f64; 3],
}

/// What each of `m` texels covers of `n`, where m is n / 2 rounded down, or both are 1.
fn covered(n: u32, m: u32) -> Vec<Taps> {
    let (n, m) = (f64::from(n), f64::from(m));
    let of = |i: u32| {
        // In units of 1 / m of a texel, so that the ends of every texel are whole numbers.
        let (start, end) = (f64::from(i) * n, f64::from(i + 1) * n);
        let first = (start / m).floor();
        let weights = [0.0, 1.0, 2.0].map(|k| {
            let (left, right) = ((first + k) * m, (first + k + 1.0) * m);
            (right.min(end) - left.max(start)).max(0.0) / n
        });
        Taps {
            first: first as usize,
            weights,
        }
    };
    (0..m as u32).map(of).collect()
}

fn times_alpha(mut picture: Picture) -> Picture {
    for [r, g, b, a] in &mut picture.texels {
        for color in [r, g, b] {
            *color *= *a;
        }
    }
    picture
}

/// Undoes `times_alpha`. A texel of alpha zero has the color of `smaller` at its place.
fn over_alpha(level: &mut Picture, smaller: Option<&Picture>) {
    let width = level.width as usize;
    let size = [level.width, level.height];
    for (i, texel) in level.texels.iter_mut().enumerate() {
        let [r, g, b, a] = *texel;
        let color = match (a > 0.0, smaller) {
            (true, _) => [r / a, g / a, b / a],
            (false, Some(smaller)) => {
                let place = |p: usize, n: u32, m: u32| (p * m as usize) / n.max(1) as usize;
                let x = place(i % width, size[0], smaller.width);
                let line = smaller.row(place(i / width, size[1], smaller.height));
                line.get(x).map_or([0.0; 3], |&[r, g, b, _]| [r, g, b])
            }
            (false, None) => [0.0; 3],
        };
        *texel = [color[0], color[1], color[2], a];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(picture: &Picture) -> [f64; 4] {
        let n = picture.texels.len() as f64;
        let sum = |c: usize| picture.texels.iter().map(|t| f64::from(t[c])).sum::<f64>();
        [0, 1, 2, 3].map(|c| sum(c) / n)
    }

    fn noise(width: u32, height: u32) -> Picture {
        let texel = |i: u32| {
            let x = (i.wrapping_mul(2_654_435_761) >> 16) as f32 / 65536.0;
            [x, x * x, 1.0 - x, if i.is_multiple_of(3) { 0.0 } else { x }]
        };
        Picture {
            width,
            height,
            texels: (0..width * height).map(texel).collect(),
        }
    }

    #[test]
    fn every_level_has_the_mean_of_the_picture() {
        for (width, height) in [
            (1, 1),
            (3, 5),
            (1, 37),
            (64, 1),
            (17, 16),
            (33, 63),
            (101, 7),
        ] {
            let picture = noise(width, height);
            let expected = mean(&picture);
            let levels = pyramid(picture, false);
            let side = width.max(height);
            assert_eq!(levels.len() as u32, side.ilog2() + 1, "{width} x {height}");
            for (i, level) in levels.iter().enumerate() {
                let size = [(width >> i).max(1), (height >> i).max(1)];
                assert_eq!([level.width, level.height], size);
                for (found, expected) in mean(level).into_iter().zip(expected) {
                    let off = (found - expected).abs();
                    assert!(
                        off < 1e-6,
                        "level {i} of {width} x {height}: {found}, {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn odd_sides_are_weighted_by_area() {
        let row = |values: &[f32]| Picture {
            width: values.len() as u32,
            height: 1,
            texels: values.iter().map(|&x| [x; 4]).collect(),
        };
        // Two texels cover five: two whole ones each, and a half of the middle one.
        let levels = pyramid(row(&[1.0, 2.0, 4.0, 8.0, 16.0]), false);
        let reds: Vec<f32> = levels[1].texels.iter().map(|t| t[0]).collect();
        assert_eq!(reds, [5.0 / 2.5, 26.0 / 2.5]);
    }

    #[test]
    fn colors_count_by_their_alpha() {
        let picture = Picture {
            width: 4,
            height: 1,
            texels: vec![
                [1.0, 0.0, 0.0, 1.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.5],
                [0.0, 1.0, 0.0, 0.0],
            ],
        };
        let levels = pyramid(picture, true);
        assert_eq!(levels[1].texels[0], [1.0, 0.0, 0.0, 0.5]);
        assert_eq!(levels[1].texels[1], [0.0, 0.0, 1.0, 0.25]);
        assert_eq!(levels[2].texels[0], [2.0 / 3.0, 0.0, 1.0 / 3.0, 0.375]);
        // What cannot be seen takes the color beside it, so that none comes in between.
        assert_eq!(levels[0].texels[1], [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(levels[0].texels[3], [0.0, 0.0, 1.0, 0.0]);
        assert_eq!(levels[0].texels[2], [0.0, 0.0, 1.0, 0.5]);
    }
}
