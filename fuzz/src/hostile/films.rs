//! Film files with changed bytes, and a fingerprint as if they had been written so.

use crate::Random;

/// Factor of the fingerprint that ends a film file (`runtime/src/fingerprint.rs`).
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

/// Changes some bytes of a film, mostly of its head, mostly with the fingerprint that goes with them.
pub(super) fn mutated(random: &mut Random, film: &[u8]) -> Vec<u8> {
    let mut out = film.to_vec();
    // With its length, a film is mostly refused for nothing else.
    let ways = if random.below(4) == 0 { 6 } else { 3 };
    for _ in 0..=random.below(3) {
        let most = [40, 200, out.len()][random.below(3)].min(out.len());
        let at = random.below(most);
        match random.below(ways) {
            0 | 1 => flip(random, &mut out, at),
            2 => {
                let word = [0, 1, 2, 3, 0x7fff_ffff, u32::MAX, 1 << 16, 1 << 31][random.below(8)];
                let end = out.len().min(at / 4 * 4 + 4);
                let word = word.to_le_bytes();
                let to = &mut out[at / 4 * 4..end];
                to.copy_from_slice(&word[..to.len()]);
            }
            3 => drop(out.drain(at..(at + 1 + random.below(16)).min(film.len()).min(out.len()))),
            4 => drop(out.splice(at..at, vec![random.bits() as u8; 1 + random.below(16)])),
            _ => out.truncate(random.below(out.len() + 1)),
        }
        if out.is_empty() {
            return out;
        }
    }
    if random.below(8) != 0 {
        seal(&mut out);
    }
    out
}

fn flip(random: &mut Random, bytes: &mut [u8], at: usize) {
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.below(8);
    }
}

/// Writes the fingerprint of what is before it into the last eight bytes.
pub(super) fn seal(film: &mut [u8]) {
    let Some((content, end)) = film.split_last_chunk_mut::<8>() else {
        return;
    };
    *end = fingerprint(content).to_le_bytes();
}

fn fingerprint(bytes: &[u8]) -> u64 {
    let mix = |state: u64, word: u64| {
        let product = (state ^ word).wrapping_mul(FACTOR);
        product ^ (product >> 29)
    };
    let (words, rest) = bytes.as_chunks::<8>();
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    let words = words.iter().copied().chain([last]).map(u64::from_le_bytes);
    words.chain([bytes.len() as u64, 0]).fold(FACTOR, mix)
}

#[cfg(test)]
mod tests {
    /// The value that the test of runtime/src/fingerprint.rs has.
    #[test]
    fn the_fingerprint_is_that_of_films() {
        assert_eq!(super::fingerprint(b"impasto"), 6_826_307_666_424_168_983);
    }
}
