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
    pub(crate) fn add(&mut self, mut bytes: &[u8]) {
        self.length += bytes.len() as u64;
        if self.held > 0 {
            let (head, rest) = bytes.split_at(bytes.len().min(8 - self.held));
            self.begun[self.held..][..head.len()].copy_from_slice(head);
            self.held += head.len();
            bytes = rest;
            if self.held < 8 {
                return;
            }
            self.state.mix(u64::from_le_bytes(self.begun));
        }
        let (words, rest) = bytes.as_chunks::<8>();
        for word in words {
            self.state.mix(u64::from_le_bytes(*word));
        }
        self.begun = [0; 8];
        self.begun[..rest.len()].copy_from_slice(rest);
        self.held = rest.len();
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

    /// Files of one version have to be read by the next.
    #[test]
    fn fingerprints_do_not_change() {
        assert_eq!(of(b"impasto"), 6_826_307_666_424_168_983);
    }
}
