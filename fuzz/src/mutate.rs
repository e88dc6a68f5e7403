//! Random numbers, and what they do to a text.

use crate::MAX_INPUT;

/// Random numbers that are the same for the same seed (splitmix64, Steele et al. 2014).
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to below `n`; 0 if that is 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    /// One of some things.
    pub fn one<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> Option<&'a T> {
        let i = self.below(of.len());
        of.get(i).copied()
    }

    /// A range within a text of `length` bytes, mostly short.
    fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length + 1);
        let most = [4, 40, 400, length][self.below(4)];
        let end = start + self.below(most + 1);
        start..end.min(length)
    }
}

/// Numbers that programs treat specially.
const NUMBERS: [&str; 14] = [
    "0",
    "1",
    "-1",
    "2147483647",
    "-2147483648",
    "4294967295",
    "65536",
    "65537",
    "1e38",
    "1e-38",
    "3.5e38",
    "0.0",
    "1.0",
    "0.99999999",
];

/// Changes a text in one to eight places. `others` are texts to take parts from, `words` are words
/// of the language.
pub fn mutate(random: &mut Random, text: &[u8], others: &[Vec<u8>], words: &[&str]) -> Vec<u8> {
    let mut out = text.to_vec();
    for _ in 0..=random.below(8) {
        once(random, &mut out, others, words);
        out.truncate(MAX_INPUT);
    }
    out
}

fn once(random: &mut Random, text: &mut Vec<u8>, others: &[Vec<u8>], words: &[&str]) {
    let range = random.range(text.len());
    match random.below(12) {
        0 => {
            if let Some(byte) = text.get_mut(range.start) {
                *byte ^= 1 << random.below(8);
            }
        }
        1 => text.truncate(range.start),
        2 => drop(text.drain(range)),
        3 => {
            let copy = text[range.clone()].to_vec();
            let to = random.below(text.len() + 1);
            drop(text.splice(to..to, copy));
        }
        4 => {
            // Many copies of a part, one after the other.
            let times = [3, 30, 300, 3000][random.below(4)];
            let copies = text[range.clone()].repeat(times);
            let room = MAX_INPUT.saturating_sub(text.len()).min(copies.len());
            drop(text.splice(range.start..range.start, copies[..room].iter().copied()));
        }
        5 => {
            let other = &others[random.below(others.len())];
            let part = random.range(other.len());
            drop(text.splice(range, other[part].iter().copied()));
        }
        6 | 7 => replace_word(random, text, |random| {
            random.one(words).unwrap_or_default().as_bytes().to_vec()
        }),
        8 => replace_word(random, text, |random| {
            random.one(&NUMBERS).unwrap_or_default().as_bytes().to_vec()
        }),
        9 => {
            // A word by another of the same text.
            let from = word(text, random.below(text.len() + 1));
            let other = text[from].to_vec();
            replace_word(random, text, |_| other.clone());
        }
        10 => {
            let depth = [2, 20, 200, 2000][random.below(4)];
            let (open, close) = [
                ("(", ")"),
                ("{", "}"),
                ("-", ""),
                ("[", "]"),
                ("if x {", "}"),
            ][random.below(5)];
            text.splice(range.end..range.end, close.repeat(depth).into_bytes());
            text.splice(range.start..range.start, open.repeat(depth).into_bytes());
        }
        _ => {
            let insert = random.one(words).unwrap_or_default().as_bytes().to_vec();
            drop(text.splice(range.start..range.start, insert));
        }
    }
}

/// Puts other values in the place of one to three numbers or quoted texts, so that what is around them is still
/// read.
pub fn revalue(random: &mut Random, text: &[u8], values: &[&str]) -> Vec<u8> {
    let mut out = text.to_vec();
    for _ in 0..=random.below(3) {
        let places = values_of(&out);
        let Some(place) = places.get(random.below(places.len())) else {
            break;
        };
        // Mostly a text for a text, and a number for a number: what is of the wrong type is read no further.
        let is_text = out[place.start] == b'"';
        let is_number = |value: &&&str| value.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        let same: Vec<&str> = match random.below(4) {
            0 => values.to_vec(),
            _ if is_text => values
                .iter()
                .filter(|v| v.starts_with('"'))
                .copied()
                .collect(),
            _ => values.iter().filter(is_number).copied().collect(),
        };
        let value = random.one(&same).unwrap_or_default().bytes();
        drop(out.splice(place.clone(), value));
    }
    out
}

/// Where a text has numbers, and texts in quotes.
fn values_of(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut places = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let length = match text[at] {
            b'"' => text[at + 1..]
                .iter()
                .position(|b| *b == b'"')
                .map_or(1, |end| end + 2),
            b'0'..=b'9' | b'-' | b'.' => {
                let in_number = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
                text[at..].iter().take_while(|b| in_number(b)).count()
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                let in_name = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
                at += text[at..].iter().take_while(|b| in_name(b)).count();
                continue;
            }
            _ => {
                at += 1;
                continue;
            }
        };
        // What a colon follows is the key of a JSON object.
        let is_key = text[at] == b'"' && text.get(at + length) == Some(&b':');
        if !is_key {
            places.push(at..at + length);
        }
        at += length;
    }
    places
}

fn replace_word(random: &mut Random, text: &mut Vec<u8>, by: impl Fn(&mut Random) -> Vec<u8>) {
    let place = word(text, random.below(text.len() + 1));
    let by = by(random);
    text.splice(place, by);
}

/// The word around or after a place.
fn word(text: &[u8], at: usize) -> std::ops::Range<usize> {
    let in_word = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_' || *b == b'.';
    let skipped = text[at..].iter().take_while(|b| !in_word(b)).count();
    let at = at + skipped;
    let before = text[..at].iter().rev().take_while(|b| in_word(b)).count();
    let after = text[at..].iter().take_while(|b| in_word(b)).count();
    at - before..at + after
}

/// Words in random order.
pub fn soup(random: &mut Random, words: &[&str], count: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for _ in 0..count {
        out.extend(random.one(words).unwrap_or_default().bytes());
        out.push(b" \n"[usize::from(random.below(8) == 0)]);
    }
    out.truncate(MAX_INPUT);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_numbers_and_texts_and_no_names() {
        let text = b"v1 = [-1.5e3, \"a 2\"] # x2";
        let found: Vec<&[u8]> = values_of(text).into_iter().map(|p| &text[p]).collect();
        assert_eq!(found, [b"-1.5e3".as_slice(), b"\"a 2\""]);
        assert_eq!(values_of(br#"{"key": "x"}"#).first(), Some(&(8..11)));
        assert_eq!(revalue(&mut Random(1), b"names", &["1"]), b"names");
    }
}
