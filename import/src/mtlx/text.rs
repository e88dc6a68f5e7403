//! Expressions of Impasto as text, and templates that are filled with them.
//!
//! A text knows how loosely it binds, so that a template puts parentheses only where they are needed.

/// How loosely an expression binds, loosest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    /// `if`, `||`, `&&`, comparisons.
    Choice,
    Sum,
    Product,
    Prefix,
    /// A name, a number, a call, a field.
    Atom,
}

/// How loosely a text binds: by the operators outside its brackets, which have a blank on both sides.
pub(crate) fn level(text: &str) -> Level {
    let mut depth = 0i32;
    let mut found = Level::Atom;
    let bytes = text.as_bytes();
    if text.starts_with("if ") {
        return Level::Choice;
    }
    if text.starts_with(['-', '!']) {
        found = Level::Prefix;
    }
    let mut quoted = false;
    for (at, byte) in bytes.iter().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth -= 1,
            b' ' if depth == 0 => {
                let operator = match bytes.get(at + 1) {
                    Some(b'+' | b'-') if bytes.get(at + 2) == Some(&b' ') => Level::Sum,
                    Some(b'*' | b'/' | b'%') => Level::Product,
                    Some(b'<' | b'>' | b'=' | b'!' | b'&' | b'|' | b'^') => Level::Choice,
                    _ => continue,
                };
                found = found.min(operator);
            }
            _ => {}
        }
    }
    found
}

/// The text, in parentheses if it binds more loosely than `least`.
pub(crate) fn bound(text: &str, least: Level) -> String {
    if level(text) < least {
        format!("({text})")
    } else {
        text.to_owned()
    }
}

/// A product of a weight and a text, without a weight of 1.
pub(crate) fn weighted(weight: &str, text: &str) -> String {
    if weight == "1.0" || weight == "color(1.0)" {
        return text.to_owned();
    }
    let text = bound(text, Level::Prefix);
    format!("{} * {text}", bound(weight, Level::Product))
}

/// Is it a name, perhaps with fields, or a number? Then it may be repeated.
pub(crate) fn is_simple(text: &str) -> bool {
    text.len() <= 40
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '.')
}

/// The holes of a template, `{name}`, in order, with repetitions.
pub(crate) fn holes(template: &str) -> Vec<&str> {
    let pieces = template.split('{').skip(1);
    pieces
        .filter_map(|piece| piece.split_once('}').map(|(name, _)| name))
        .filter(|name| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'))
        .filter(|name| !name.is_empty())
        .collect()
}

/// The template with its holes filled.
pub(crate) fn filled(template: &str, value: &dyn Fn(&str) -> String) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some(open) = rest.find('{') {
        let Some(length) = rest[open..].find('}') else {
            break;
        };
        let name = &rest[open + 1..open + length];
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            // A block of the language.
            text.push_str(&rest[..=open]);
            rest = &rest[open + 1..];
            continue;
        }
        text.push_str(&rest[..open]);
        rest = &rest[open + length + 1..];
        let least = least(&text, rest);
        text.push_str(&bound(&value(name), least));
    }
    text.push_str(rest);
    text
}

/// How tightly an expression must bind between what stands before and after it.
fn least(before: &str, after: &str) -> Level {
    if after.starts_with('.') || after.starts_with('[') {
        return Level::Atom;
    }
    let left = match before.trim_end().chars().next_back() {
        Some('+') => Level::Sum,
        Some('-') if before.ends_with("- ") => Level::Product,
        Some('-' | '!') => Level::Atom,
        Some('*' | '/' | '%') => Level::Prefix,
        Some('<' | '>' | '=' | '&' | '|') => Level::Sum,
        _ => Level::Choice,
    };
    let right = match after.trim_start().chars().next() {
        Some('+' | '-') => Level::Sum,
        Some('*' | '/' | '%') => Level::Product,
        Some('<' | '>' | '=' | '!' | '&' | '|') => Level::Sum,
        _ => Level::Choice,
    };
    left.max(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parentheses_stand_where_they_are_needed() {
        let value = |name: &str| {
            match name {
                "sum" => "a + b",
                "product" => "a * b",
                "minus" => "-x",
                "call" => "f(a + b, c)",
                _ => "if c { a } else { b }",
            }
            .to_owned()
        };
        for (template, text) in [
            ("{sum} + {sum}", "a + b + a + b"),
            ("{sum} - {sum}", "a + b - (a + b)"),
            ("{sum} * {product}", "(a + b) * (a * b)"),
            ("{product} / {call}", "a * b / f(a + b, c)"),
            ("f({sum}, {choice})", "f(a + b, if c { a } else { b })"),
            ("{sum}.x", "(a + b).x"),
            ("{call}.x", "f(a + b, c).x"),
            ("{minus} * 2.0", "-x * 2.0"),
            ("2.0 * {minus}", "2.0 * -x"),
            ("-{product}", "-(a * b)"),
            ("{choice} + 1.0", "(if c { a } else { b }) + 1.0"),
        ] {
            assert_eq!(filled(template, &value), text, "{template}");
        }
    }
}
