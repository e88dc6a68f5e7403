//! Values of number tokens, and what is wrong with those that have none.

use super::Token;

/// A number token's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Number {
    /// An integer of at most 32 bits.
    Int(i64),
    /// An unsigned int: one that ends in `u`.
    Uint(u32),
    /// A float that is finite in 32-bit precision.
    Float(f64),
}

/// Reads the `text` of a number token. `negated` tells that a minus stands before it, which
/// lets the least 32-bit integer be written.
///
/// # Errors
/// Says what is wrong and what to try.
pub(crate) fn read(
    token: Token,
    text: &str,
    negated: bool,
) -> Result<Number, (String, &'static str)> {
    match (token, text.strip_suffix('u')) {
        (Token::Hex, Some(digits)) => read_hex(digits).map(|i| Number::Uint(i as u32)),
        (Token::Int, Some(digits)) => read_unsigned(digits).map(Number::Uint),
        (Token::Hex, None) => read_hex(text).map(Number::Int),
        (Token::Int, None) => read_int(text, negated).map(Number::Int),
        _ => read_float(text).map(Number::Float),
    }
}

/// The text as messages show it.
fn shown(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((end, _)) => format!("`{}...`", &text[..end]),
        None => format!("`{text}`"),
    }
}

fn read_int(text: &str, negated: bool) -> Result<i64, (String, &'static str)> {
    let largest = i64::from(i32::MAX) + i64::from(negated);
    match text.parse::<i64>() {
        Ok(value) if value <= largest => Ok(value),
        _ => Err((
            format!(
                "{} does not fit a 32-bit int, whose largest value is 2147483647",
                shown(text)
            ),
            "write a float, as in `4e9`, or an unsigned int, as in `4000000000u`",
        )),
    }
}

fn read_unsigned(digits: &str) -> Result<u32, (String, &'static str)> {
    digits.parse::<u32>().map_err(|_| {
        let number = shown(digits);
        (
            format!("{number} does not fit a uint, whose largest value is 4294967295"),
            "write a float, as in `4e9`",
        )
    })
}

fn read_hex(text: &str) -> Result<i64, (String, &'static str)> {
    let digits = &text[2..];
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Err((
            format!("{} is not a hexadecimal number", shown(text)),
            "hexadecimal digits are 0 to 9 and a to f",
        ));
    }
    u32::from_str_radix(digits, 16).map(i64::from).map_err(|_| {
        (
            format!("{} has more than 32 bits", shown(text)),
            "a hexadecimal int has at most 8 digits",
        )
    })
}

fn read_float(text: &str) -> Result<f64, (String, &'static str)> {
    match text.parse::<f64>() {
        Ok(value) if (value as f32).is_finite() => Ok(value),
        _ => Err((
            format!("{} is not finite in 32-bit precision", shown(text)),
            "the largest float is about 3.4e38",
        )),
    }
}
