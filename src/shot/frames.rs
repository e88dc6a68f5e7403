//! Frames: which of them, and the names of their pictures.

use std::path::{Path, PathBuf};

use impasto_runtime::scene::MAX_FRAME;

/// Most pictures of one run.
pub const MAX_COUNT: u32 = 100_000;

/// Frames from one to another, every so many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    first: u32,
    last: u32,
    step: u32,
}

impl Frames {
    /// Those from 1 to `last`.
    pub fn up_to(last: u32) -> Self {
        Self {
            first: 1,
            last,
            step: 1,
        }
    }

    /// Reads `5`, `1-120`, and `1-120x2` or `1-120:2`, every second one of them.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        const EXPECTED: &str = "expected frames, as in `5`, `1-120` or `1-120x2`";
        let number = |text: &str| -> Result<u32, String> {
            let text = text.trim();
            if text.is_empty() || !text.chars().all(|c| c.is_ascii_digit()) {
                return Err(EXPECTED.into());
            }
            let number = text.parse().ok().filter(|n| *n <= MAX_FRAME);
            number.ok_or_else(|| format!("the frame {text} is beyond the last, {MAX_FRAME}"))
        };
        let (range, step) = match text.split_once(['x', ':']) {
            Some((range, step)) => (range, number(step)?),
            None => (text, 1),
        };
        let (first, last) = match range.split_once('-') {
            Some((first, last)) => (number(first)?, number(last)?),
            None => (number(range)?, number(range)?),
        };
        if step == 0 {
            return Err("every 0th frame is none; expected a step of at least 1".into());
        }
        if first > last {
            return Err(format!("the frames end before they begin, at {last}"));
        }
        let frames = Self { first, last, step };
        match frames.count() {
            count if count > MAX_COUNT => Err(format!(
                "{count} frames are too many for one run: at most {MAX_COUNT}"
            )),
            _ => Ok(frames),
        }
    }

    /// How many there are.
    pub fn count(self) -> u32 {
        (self.last - self.first) / self.step + 1
    }

    /// Their numbers.
    pub fn numbers(self) -> impl Iterator<Item = u32> {
        (self.first..=self.last).step_by(self.step as usize)
    }

    /// The picture of a frame: `turn.exr` is `turn.0001.exr`, and `####` in a name is where the number goes.
    pub fn path(self, out: &Path, frame: u32) -> PathBuf {
        let digits = self.last.to_string().len().max(4);
        let stem = out.file_stem().unwrap_or_default().to_string_lossy();
        let name = match stem.find('#') {
            Some(at) => {
                let run = stem[at..].chars().take_while(|c| *c == '#').count();
                let digits = self.last.to_string().len().max(run);
                let (before, after) = (&stem[..at], &stem[at + run..]);
                format!("{before}{frame:0digits$}{after}")
            }
            None => format!("{stem}.{frame:0digits$}"),
        };
        let mut path = out.with_file_name(name);
        if let Some(extension) = out.extension() {
            path.as_mut_os_string().push(".");
            path.as_mut_os_string().push(extension);
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_one_or_a_range_with_steps() {
        let of = |text: &str| -> Vec<u32> {
            let frames = Frames::parse(text).expect(text);
            let numbers: Vec<u32> = frames.numbers().collect();
            assert_eq!(numbers.len() as u32, frames.count());
            numbers
        };
        assert_eq!(of("5"), [5]);
        assert_eq!(of("1-3"), [1, 2, 3]);
        assert_eq!(of("1-6x2"), [1, 3, 5]);
        assert_eq!(of("0-6:3"), [0, 3, 6]);
        assert_eq!(of("1-10000").len(), 10_000);
        for text in [
            "",
            "-",
            "1-",
            "-3",
            "a",
            "3-1",
            "1-3x0",
            "1-3x",
            "1-9999999",
            "0-1000000",
            "1.5",
        ] {
            assert!(Frames::parse(text).is_err(), "`{text}` is taken");
        }
    }

    #[test]
    fn pictures_are_numbered_where_the_name_says() {
        let name = |out: &str, frame| {
            let path = Frames::up_to(120).path(Path::new(out), frame);
            path.display().to_string()
        };
        assert_eq!(name("a/turn.exr", 7), "a/turn.0007.exr");
        assert_eq!(name("a/turn_##.png", 7), "a/turn_007.png");
        assert_eq!(name("t#####x.png", 120), "t00120x.png");
        assert_eq!(name("a/turn", 7), "a/turn.0007");
    }
}
