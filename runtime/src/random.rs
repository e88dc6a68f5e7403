//! Random numbers: which draws a path makes, and how a seed enters them.
//!
//! A draw gives four numbers at once, as a function of (pixel, sample, draw, seed); the
//! function itself is `kernels/random.wgsl`.

use std::fmt::Write;

/// Draws made once for a path, by their name in WGSL.
const PATH_DRAWS: [&str; 1] = [
    // Position in the pixel (2), position on the lens (2).
    "DRAW_CAMERA",
];

/// Draws made at every vertex of a path.
const VERTEX_DRAWS: [&str; 3] = [
    // Lobe and direction.
    "DRAW_SCATTERING",
    // Choice of the light and the point on it.
    "DRAW_LIGHT",
    // Survival (1).
    "DRAW_ROULETTE",
];

/// The WGSL constants of the tables above.
pub(crate) fn constants() -> String {
    let mut out = String::new();
    for names in [&PATH_DRAWS[..], &VERTEX_DRAWS[..]] {
        for (index, name) in names.iter().enumerate() {
            let _ = writeln!(out, "const {name}: u32 = {index}u;");
        }
    }
    let _ = writeln!(out, "const DRAWS_PER_PATH: u32 = {}u;", PATH_DRAWS.len());
    let count = VERTEX_DRAWS.len();
    let _ = writeln!(out, "const DRAWS_PER_VERTEX: u32 = {count}u;");
    out
}

/// A seed as the kernels get it: a bijection that spreads nearby seeds and powers of two over
/// all bits, so that no seed is special. The finaliser of MurmurHash3 (Appleby 2008) over an
/// odd offset, since it maps 0 to 0.
pub(crate) fn hash_seed(seed: u32) -> u32 {
    let mut bits = seed.wrapping_add(0x9e37_79b9);
    bits = (bits ^ (bits >> 16)).wrapping_mul(0x85eb_ca6b);
    bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
    bits ^ (bits >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_that_differ_in_one_bit_hash_to_words_that_differ_in_many() {
        for bit in 0..32 {
            let changed = (hash_seed(0) ^ hash_seed(1 << bit)).count_ones();
            assert!((6..=26).contains(&changed), "bit {bit}: {changed} changed");
        }
        assert_ne!(hash_seed(0), 0);
    }
}
