//! Pictures in a terminal that can show them: by the protocols of kitty and iTerm2, or of two colors a character where
//! colors are true. Elsewhere nothing is shown.

use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write as _};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use impasto::runtime::film::{Film, output};

use super::super::{Failure, progress};

/// Bytes of text that kitty takes at once.
const CHUNK: usize = 4096;
/// Black columns between two pictures.
const GAP: u32 = 4;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Kitty,
    Iterm,
    Blocks,
}

impl Way {
    /// How the terminal shows pictures, by what it says of itself.
    fn of(var: impl Fn(&str) -> Option<String>) -> Option<Self> {
        let is = |name: &str, values: &[&str]| {
            var(name).is_some_and(|v| values.iter().any(|value| v.contains(value)))
        };
        if var("KITTY_WINDOW_ID").is_some()
            || is("TERM", &["kitty", "ghostty"])
            || is("TERM_PROGRAM", &["ghostty"])
        {
            Some(Way::Kitty)
        } else if is("TERM_PROGRAM", &["iTerm", "WezTerm", "mintty", "vscode"]) {
            Some(Way::Iterm)
        } else {
            is("COLORTERM", &["truecolor", "24bit"]).then_some(Way::Blocks)
        }
    }
}

/// Shows the picture of a snapshot and what it is now, beside each other.
pub(super) fn show(old: Option<&Film>, new: &Film) -> Result<(), Failure> {
    if !io::stderr().is_terminal() {
        return Ok(());
    }
    let Some(way) = Way::of(|name| std::env::var(name).ok()) else {
        return Ok(());
    };
    let both = old.map_or_else(|| new.clone(), |old| beside(old, new));
    let text = match way {
        Way::Blocks => blocks(&both),
        Way::Kitty => kitty(&png(&both)?),
        Way::Iterm => iterm(&png(&both)?),
    };
    let written = progress::aside(|| io::stderr().lock().write_all(text.as_bytes()));
    written.map_err(|why| Failure::Error(format!("cannot write to the terminal: {why}")))
}

fn png(film: &Film) -> Result<Vec<u8>, Failure> {
    output::png(film, 0.0).map_err(|why| Failure::Error(format!("cannot make a picture: {why}")))
}

/// One picture of two.
fn beside(a: &Film, b: &Film) -> Film {
    let (width, height) = (a.width + GAP + b.width, a.height.max(b.height));
    let mut pixels = vec![[0.0; 3]; (width * height) as usize];
    for (film, left) in [(a, 0), (b, a.width + GAP)] {
        for (i, pixel) in film.pixels.iter().enumerate() {
            let (x, y) = (i as u32 % film.width, i as u32 / film.width);
            pixels[(y * width + left + x) as usize] = *pixel;
        }
    }
    Film {
        width,
        height,
        samples: vec![0; pixels.len()],
        pixels,
    }
}

fn kitty(png: &[u8]) -> String {
    let text = STANDARD.encode(png);
    let mut out = String::new();
    let mut rest = text.as_str();
    let mut first = "a=T,f=100,";
    while !rest.is_empty() {
        let (chunk, more) = rest.split_at(rest.len().min(CHUNK));
        // Writing to a string cannot fail.
        let _ = write!(
            out,
            "\x1b_G{first}m={};{chunk}\x1b\\",
            u8::from(!more.is_empty())
        );
        (rest, first) = (more, "");
    }
    out + "\n"
}

fn iterm(png: &[u8]) -> String {
    let text = STANDARD.encode(png);
    format!(
        "\x1b]1337;File=inline=1;size={};preserveAspectRatio=1:{text}\x07\n",
        png.len()
    )
}

/// Two rows of pixels a row of characters, every second pixel.
fn blocks(film: &Film) -> String {
    let at = |x: u32, y: u32| {
        let index = (y.min(film.height - 1) * film.width + x) as usize;
        film.pixels[index].map(output::srgb_byte)
    };
    let mut out = String::new();
    for y in (0..film.height).step_by(4) {
        for x in (0..film.width).step_by(2) {
            let ([r, g, b], [s, t, u]) = (at(x, y), at(x, y + 2));
            let _ = write!(out, "\x1b[38;2;{r};{g};{b};48;2;{s};{t};{u}m\u{2580}");
        }
        out += "\x1b[0m\n";
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_known_by_what_they_say() {
        let of = |name: &'static str, value: &'static str| {
            Way::of(|asked| (asked == name).then(|| value.to_owned()))
        };
        assert_eq!(of("TERM", "xterm-kitty"), Some(Way::Kitty));
        assert_eq!(of("TERM_PROGRAM", "iTerm.app"), Some(Way::Iterm));
        assert_eq!(of("COLORTERM", "truecolor"), Some(Way::Blocks));
        assert_eq!(of("TERM", "xterm-256color"), None);
    }

    #[test]
    fn pictures_stand_beside_each_other() {
        let film = |value: f32, height: u32| Film {
            width: 2,
            height,
            samples: vec![0; 2 * height as usize],
            pixels: vec![[value; 3]; 2 * height as usize],
        };
        let both = beside(&film(1.0, 1), &film(0.5, 2));
        assert_eq!((both.width, both.height), (2 + GAP + 2, 2));
        let row = |y: usize| -> Vec<f32> {
            let width = both.width as usize;
            both.pixels[y * width..][..width]
                .iter()
                .map(|p| p[0])
                .collect()
        };
        assert_eq!(row(0), [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5]);
        assert_eq!(row(1), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5]);
        assert!(kitty(&[0; 9000]).matches("\x1b_G").count() == 3);
    }
}
