//! Colors in sources: where they are, and how another one is written in their place.

use std::ops::Range;

use impasto_compiler::lexer::{Token, lex};
use impasto_compiler::source::FileId;

/// A color in a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Swatch {
    /// The bytes that say it.
    pub place: Range<usize>,
    /// Red, green and blue as displays take them (sRGB), from 0 to 1.
    pub srgb: [f32; 3],
    /// Is it written in sRGB, and not as linear light?
    pub is_encoded: bool,
}

/// The colors that a source writes as numbers: `srgb(0x8c1010)`, `srgb(0.5, 0.1, 0.1)`, `color(0.2, 0.0, 0.0)`.
pub fn swatches(text: &str) -> Vec<Swatch> {
    let (tokens, _) = lex(FileId(0), text);
    let mut found = Vec::new();
    for (index, (token, span)) in tokens.iter().enumerate() {
        let name = text.get(span.range()).unwrap_or_default();
        let is_encoded = name == "srgb";
        if *token != Token::Ident || !(is_encoded || name == "color") {
            continue;
        }
        let rest = &tokens[index + 1..];
        let Some(end) = rest.iter().position(|(t, _)| *t == Token::RightParen) else {
            continue;
        };
        let inside: Vec<(Token, &str)> = rest[..end]
            .iter()
            .map(|(t, s)| (*t, text.get(s.range()).unwrap_or_default()))
            .collect();
        let Some(values) = numbers(&inside, is_encoded) else {
            continue;
        };
        let place = span.start as usize..rest[end].1.end as usize;
        let srgb = if is_encoded {
            values
        } else {
            values.map(encoded)
        };
        found.push(Swatch {
            place,
            srgb,
            is_encoded,
        });
    }
    found
}

/// The numbers between brackets, if there is nothing else.
fn numbers(inside: &[(Token, &str)], is_encoded: bool) -> Option<[f32; 3]> {
    let is_number = |t: Token| matches!(t, Token::Int | Token::Float);
    match inside {
        [(Token::LeftParen, _), (Token::Hex, hex)] if is_encoded => {
            let value = u32::from_str_radix(hex.get(2..)?, 16).ok()?;
            let byte = |shift: u32| ((value >> shift) & 255) as f32 / 255.0;
            Some([byte(16), byte(8), byte(0)])
        }
        [(Token::LeftParen, _), (a, grey)] if is_number(*a) && !is_encoded => {
            let grey: f32 = grey.parse().ok()?;
            Some([grey; 3])
        }
        [
            (Token::LeftParen, _),
            (a, r),
            (Token::Comma, _),
            (b, g),
            (Token::Comma, _),
            (c, blue),
        ] if [a, b, c].into_iter().all(|t| is_number(*t)) => {
            Some([r.parse().ok()?, g.parse().ok()?, blue.parse().ok()?])
        }
        _ => None,
    }
}

/// How a color may be written in the place of one, likeliest first. Displays say it in sRGB.
pub fn presentations(old: &str, srgb: [f32; 3]) -> Vec<String> {
    let encoded = encoded_text(srgb);
    let linear = linear_text(srgb);
    if old.starts_with("color") {
        vec![linear, encoded]
    } else {
        vec![encoded, linear]
    }
}

/// `srgb(0x8c1010)`
pub fn encoded_text(srgb: [f32; 3]) -> String {
    let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u32;
    let [r, g, b] = srgb.map(byte);
    format!("srgb(0x{:06x})", r << 16 | g << 8 | b)
}

fn linear_text(srgb: [f32; 3]) -> String {
    let [r, g, b] = srgb.map(|x| number(decoded(x)));
    format!("color({r}, {g}, {b})")
}

/// A number with three places, as an author would write it.
pub fn number(x: f32) -> String {
    let text = format!("{x:.3}");
    let short = text.trim_end_matches('0');
    if short.ends_with('.') {
        format!("{short}0")
    } else {
        short.to_owned()
    }
}

/// Linear light as displays take it (IEC 61966-2-1).
pub fn encoded(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

/// The linear light of what displays take.
pub fn decoded(x: f32) -> f32 {
    if x <= 0.040_45 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_of_numbers_are_found_and_others_are_not() {
        let text = "srgb(0x8c1010) color(0.5, 0, 1.0) color(0.2) color(x, 0, 0) srgb(0xff)// srgb(0x111111)";
        let found = swatches(text);
        let texts: Vec<&str> = found.iter().map(|s| &text[s.place.clone()]).collect();
        assert_eq!(
            texts,
            [
                "srgb(0x8c1010)",
                "color(0.5, 0, 1.0)",
                "color(0.2)",
                "srgb(0xff)"
            ]
        );
        assert!((found[0].srgb[0] - 140.0 / 255.0).abs() < 1e-6);
        assert!((found[1].srgb[0] - 0.7354).abs() < 1e-3);
    }

    #[test]
    fn a_color_is_written_as_the_old_one_was() {
        assert_eq!(
            presentations("srgb(0x000000)", [1.0, 0.5, 0.0])[0],
            "srgb(0xff8000)"
        );
        assert_eq!(
            presentations("color(0, 0, 0)", [1.0, 0.5, 0.0])[0],
            "color(1.0, 0.214, 0.0)"
        );
    }
}
