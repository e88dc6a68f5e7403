//! A set of small numbers that knows how many it holds.

/// A set of numbers from 0 on.
#[derive(Clone, Debug, Default)]
pub(super) struct Set {
    words: Vec<u64>,
    count: usize,
}

impl Set {
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn contains(&self, n: u32) -> bool {
        let (word, bit) = place(n);
        self.words.get(word).is_some_and(|w| w & bit != 0)
    }

    pub fn add(&mut self, n: u32) {
        let (word, bit) = place(n);
        if self.words.len() <= word {
            self.words.resize(word + 1, 0);
        }
        self.count += usize::from(self.words[word] & bit == 0);
        self.words[word] |= bit;
    }

    pub fn remove(&mut self, n: u32) {
        let (word, bit) = place(n);
        if let Some(w) = self.words.get_mut(word) {
            self.count -= usize::from(*w & bit != 0);
            *w &= !bit;
        }
    }

    pub fn add_all(&mut self, other: &Set) {
        if self.words.len() < other.words.len() {
            self.words.resize(other.words.len(), 0);
        }
        for (w, o) in self.words.iter_mut().zip(&other.words) {
            *w |= o;
        }
        self.count = self.words.iter().map(|w| w.count_ones() as usize).sum();
    }
}

fn place(n: u32) -> (usize, u64) {
    (n as usize / 64, 1 << (n % 64))
}
