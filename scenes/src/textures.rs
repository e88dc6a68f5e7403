//! Tileable textures: three facades for the city and the stone that `materials/` uses.

use glam::{DVec2, dvec2, dvec3};

use crate::image_file::png;
use crate::random::lattice;

/// Bricks in a running bond; a tile is 8 bricks of 25 cm by 24 courses of 8.33 cm: 2 m square.
pub(crate) fn brick() -> Result<Vec<u8>, String> {
    png(256, |uv| {
        let course = (uv.y * 24.0).floor();
        let along = uv.x * 8.0 + 0.5 * (course % 2.0);
        let brick = along.floor().rem_euclid(8.0);
        let (x, y) = (along.fract(), (uv.y * 24.0).fract());
        let in_mortar = x < 0.045 || y < 0.13;
        let grain = tiled_noise(uv, 48, 3, 5);
        if in_mortar {
            return dvec3(0.62, 0.59, 0.54) * (0.85 + 0.2 * grain);
        }
        let tone = lattice(brick as i64, course as i64, 0, 21);
        let fired = dvec3(0.56, 0.27, 0.19).lerp(dvec3(0.44, 0.20, 0.16), tone);
        let fired = if tone > 0.93 {
            dvec3(0.34, 0.19, 0.17)
        } else {
            fired
        };
        fired * (0.86 + 0.28 * grain)
    })
}

/// Cast concrete with the joints and tie holes of its formwork; a tile is 3 m square.
pub(crate) fn concrete() -> Result<Vec<u8>, String> {
    png(256, |uv| {
        let blotches = tiled_noise(uv, 4, 5, 31);
        let pores = tiled_noise(uv, 64, 2, 32);
        let streaks = tiled_noise(dvec2(uv.x, 0.5 + 0.06 * uv.y), 24, 2, 33);
        let mut tone =
            0.60 + 0.16 * (blotches - 0.5) + 0.07 * (pores - 0.5) + 0.06 * (streaks - 0.5);
        let panel = dvec2((uv.x * 2.0).fract(), uv.y);
        if panel.x < 0.008 || panel.y < 0.006 {
            tone *= 0.72;
        }
        let holes = [
            dvec2(0.25, 0.2),
            dvec2(0.75, 0.2),
            dvec2(0.25, 0.8),
            dvec2(0.75, 0.8),
        ];
        let scale = dvec2(1.5, 3.0);
        if holes
            .iter()
            .any(|hole| ((panel - *hole) * scale).length() < 0.03)
        {
            tone *= 0.55;
        }
        dvec3(1.0, 0.985, 0.955) * tone
    })
}

/// Blocks of sawn limestone; a tile is two courses of 50 cm, blocks of 1 m: 2 m by 1 m stretched
/// over a square.
pub(crate) fn limestone() -> Result<Vec<u8>, String> {
    png(256, |uv| {
        let course = (uv.y * 4.0).floor();
        let along = uv.x * 2.0 + 0.5 * (course % 2.0);
        let block = along.floor().rem_euclid(2.0);
        let (x, y) = (along.fract(), (uv.y * 4.0).fract());
        let tone = lattice(block as i64, course as i64, 0, 41);
        let veins = tiled_noise(uv, 6, 5, 42);
        let grain = tiled_noise(uv, 80, 2, 43);
        let warm = dvec3(0.80, 0.74, 0.64).lerp(dvec3(0.74, 0.69, 0.61), tone);
        let joint = if x < 0.012 || y < 0.025 { 0.72 } else { 1.0 };
        warm * joint * (0.80 + 0.22 * veins + 0.12 * grain)
    })
}

/// Grey granite for paving and as the default of materials with a texture.
pub(crate) fn stone() -> Result<Vec<u8>, String> {
    png(128, |uv| {
        let clouds = tiled_noise(uv, 4, 4, 51);
        let crystals = tiled_noise(uv, 40, 2, 52);
        let specks = lattice((uv.x * 128.0) as i64, (uv.y * 128.0) as i64, 0, 53);
        let tone = 0.60 + 0.22 * (clouds - 0.5) + 0.26 * (crystals - 0.5);
        let speck = if specks > 0.965 { 0.72 } else { 1.0 };
        dvec3(1.0, 0.98, 0.95) * (tone * speck)
    })
}

/// Fractal value noise in [0, 1] that repeats over the unit square; `cells` across at first.
fn tiled_noise(uv: DVec2, cells: i64, octaves: u32, seed: u64) -> f64 {
    let (mut sum, mut total, mut weight, mut cells) = (0.0, 0.0, 1.0, cells);
    for octave in 0..octaves {
        sum += weight * tiled_octave(uv, cells, seed + 100 * u64::from(octave));
        total += weight;
        weight *= 0.55;
        cells *= 2;
    }
    sum / total
}

fn tiled_octave(uv: DVec2, cells: i64, seed: u64) -> f64 {
    let place = uv * cells as f64;
    let corner = place.floor();
    let f = place - corner;
    let w = f * f * (3.0 - 2.0 * f);
    let at = |i: i64, j: i64| {
        let (x, y) = (corner.x as i64 + i, corner.y as i64 + j);
        lattice(x.rem_euclid(cells), y.rem_euclid(cells), 0, seed)
    };
    let row = |j| at(0, j) + (at(1, j) - at(0, j)) * w.x;
    row(0) + (row(1) - row(0)) * w.y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_over_the_square() {
        for y in [0.1, 0.45, 0.8] {
            let near = tiled_noise(dvec2(1e-9, y), 8, 4, 3);
            let far = tiled_noise(dvec2(1.0 - 1e-9, y), 8, 4, 3);
            assert!((near - far).abs() < 1e-6, "{near} and {far}");
        }
        assert_ne!(
            tiled_noise(dvec2(0.1, 0.1), 8, 4, 3),
            tiled_noise(dvec2(0.6, 0.1), 8, 4, 3)
        );
    }

    #[test]
    fn textures_are_neither_black_nor_white_and_vary() {
        for texture in [brick(), concrete(), limestone(), stone()] {
            let file = texture.expect("encodes");
            let picture = image::load_from_memory(&file).expect("decodes").to_rgb8();
            let tones: Vec<f64> = picture.pixels().map(|p| f64::from(p.0[1])).collect();
            let mean = tones.iter().sum::<f64>() / tones.len() as f64;
            let spread = tones.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / tones.len() as f64;
            assert!(
                (60.0..220.0).contains(&mean) && spread > 20.0,
                "{mean} {spread}"
            );
        }
    }
}
