//! A fingerprint of bytes that is the same on every machine and in every version, for files that
//! outlive a process. It tells accidents apart, not forgeries.

/// The state of a fingerprint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fingerprint(u64);

/// An odd number without a pattern: the fraction of the golden ratio.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Self(FACTOR)
    }

    /// Adds bytes and their number, so that two texts are not one.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        for word in words {
            self.mix(u64::from_le_bytes(*word));
        }
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.mix(u64::from_le_bytes(last));
        self.mix(bytes.len() as u64);
    }

    /// A step that no two words (nor two states) take to the same place.
    fn mix(&mut self, word: u64) {
        let product = (self.0 ^ word).wrapping_mul(FACTOR);
        self.0 = product ^ (product >> 29);
    }

    pub(crate) fn finish(mut self) -> u64 {
        self.mix(0);
        self.0
    }
}

/// The fingerprint of some bytes.
pub fn of(bytes: &[u8]) -> u64 {
    let mut fingerprint = Fingerprint::new();
    fingerprint.add(bytes);
    fingerprint.finish()
}

/// Fingerprints that are taken side by side: with more, their states leave the registers.
const LANES: usize = 4;

/// The fingerprint of bytes that come in pieces: the same as of all of them at once, whatever the pieces.
#[derive(Clone, Debug)]
pub(crate) struct Running {
    state: Fingerprint,
    /// Bytes that do not fill a word yet.
    begun: [u8; 8],
    held: usize,
    length: u64,
}

impl Running {
    pub(crate) fn new() -> Self {
        Self {
            state: Fingerprint::new(),
            begun: [0; 8],
            held: 0,
            length: 0,
        }
    }

    /// Adds the next bytes.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        let (words, rest) = self.fill_word(bytes).as_chunks::<8>();
        for word in words {
            self.state.mix(u64::from_le_bytes(*word));
        }
        self.length += 8 * words.len() as u64;
        self.begin_word(rest);
    }

    /// Adds to several fingerprints the next bytes of each. A step of one waits for the step before it, so that the
    /// steps of others cost hardly any time in between.
    pub(crate) fn add_each(each: &mut [(&mut Running, &[u8])]) {
        for lanes in each.chunks_mut(LANES) {
            match lanes {
                [a, b, c, d] => Self::add_lanes([a, b, c, d]),
                [a, b, c] => Self::add_lanes([a, b, c]),
                [a, b] => Self::add_lanes([a, b]),
                _ => lanes.iter_mut().for_each(|(one, bytes)| one.add(bytes)),
            }
        }
    }

    fn add_lanes<const N: usize>(mut lanes: [&mut (&mut Running, &[u8]); N]) {
        let mut states = [Fingerprint::new(); N];
        for ((one, bytes), state) in lanes.iter_mut().map(|lane| &mut **lane).zip(&mut states) {
            *bytes = one.fill_word(bytes);
            *state = one.state;
        }
        let words = lanes.each_ref().map(|(_, bytes)| bytes.as_chunks::<8>().0);
        let common = words.iter().map(|words| words.len()).min().unwrap_or(0);
        let words = words.map(|words| &words[..common]);
        for at in 0..common {
            for (state, words) in states.iter_mut().zip(&words) {
                state.mix(u64::from_le_bytes(words[at]));
            }
        }
        for ((one, bytes), state) in lanes.into_iter().zip(states) {
            one.state = state;
            one.length += 8 * common as u64;
            one.add(&bytes[8 * common..]);
        }
    }

    /// Adds the bytes that a begun word lacks. Gives those after them, of which there are none while a word is begun.
    fn fill_word<'b>(&mut self, bytes: &'b [u8]) -> &'b [u8] {
        if self.held == 0 {
            return bytes;
        }
        let (head, rest) = bytes.split_at(bytes.len().min(8 - self.held));
        self.begin_word(head);
        if self.held == 8 {
            self.state.mix(u64::from_le_bytes(self.begun));
            (self.begun, self.held) = ([0; 8], 0);
        }
        rest
    }

    /// Adds bytes that do not go beyond the begun word.
    fn begin_word(&mut self, bytes: &[u8]) {
        self.begun[self.held..][..bytes.len()].copy_from_slice(bytes);
        self.held += bytes.len();
        self.length += bytes.len() as u64;
    }

    /// The fingerprint of the bytes so far, after which more may come.
    pub(crate) fn finish(&self) -> u64 {
        let mut state = self.state;
        state.mix(u64::from_le_bytes(self.begun));
        state.mix(self.length);
        state.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_counts_and_so_does_the_length() {
        let text: Vec<u8> = (0..100).collect();
        let mut seen = std::collections::BTreeSet::from([of(&text)]);
        for at in 0..text.len() {
            for bit in 0..8 {
                let mut other = text.clone();
                other[at] ^= 1 << bit;
                assert!(seen.insert(of(&other)), "byte {at}, bit {bit}");
            }
            assert!(seen.insert(of(&text[..at])), "{at} bytes");
        }
        assert_ne!(of(&[0]), of(&[0, 0]));
    }

    #[test]
    fn bytes_in_pieces_have_the_fingerprint_of_the_whole() {
        let text: Vec<u8> = (0..60).collect();
        for length in 0..text.len() {
            for piece in [1, 2, 3, 7, 8, 9, 16, 64] {
                let mut running = Running::new();
                text[..length].chunks(piece).for_each(|piece| {
                    running.add(piece);
                    running.add(&[]);
                });
                assert_eq!(running.finish(), of(&text[..length]), "{length} by {piece}");
            }
        }
    }

    /// However many there are, wherever their words begin, and however long each is.
    #[test]
    fn fingerprints_side_by_side_are_those_of_each() {
        let text: Vec<u8> = (0..200).collect();
        for count in 0..10 {
            for piece in [1, 5, 8, 19, 64] {
                let mut running = vec![Running::new(); count];
                let ends = |at: usize| (150 + 3 * at, 7 * at);
                for (at, one) in running.iter_mut().enumerate() {
                    one.add(&text[..ends(at).1]);
                }
                for first in (0..text.len()).step_by(piece) {
                    let of = |at: usize| {
                        let (end, begin) = ends(at);
                        let cut = |place: usize| place.clamp(begin, end);
                        &text[cut(begin + first)..cut(begin + first + piece)]
                    };
                    let each = running.iter_mut().enumerate();
                    let mut each: Vec<_> = each.map(|(at, one)| (one, of(at))).collect();
                    Running::add_each(&mut each);
                }
                for (at, one) in running.iter().enumerate() {
                    assert_eq!(one.finish(), of(&text[..ends(at).0]), "{at} of {count}");
                }
            }
        }
    }

    /// Files of one version have to be read by the next.
    #[test]
    fn fingerprints_do_not_change() {
        assert_eq!(of(b"impasto"), 6_826_307_666_424_168_983);
    }
}
