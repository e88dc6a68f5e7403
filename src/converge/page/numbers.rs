//! Numbers and names as pages show them.

use crate::converge::data::Series;
use crate::runtime::technique::Choice;

/// Three significant digits; what is very large or small as a power of ten.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "-".into() };
    }
    if !(0.999_5e-3..9_995.0).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = (2 - size.log10().floor() as i32).max(0) as usize;
    format!("{value:.digits$}")
}

/// A time in the unit that suits it.
pub(super) fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if !s.is_finite() => return "-".into(),
        s if s == 0.0 || s >= 0.999_5 => (s, "s"),
        s if s >= 0.999_5e-3 => (s * 1e3, "ms"),
        s => (s * 1e6, "µs"),
    };
    format!("{} {unit}", number(value))
}

/// A share in percent.
pub(super) fn percent(share: f64) -> String {
    if share.is_finite() {
        format!("{:.1} %", 100.0 * share)
    } else {
        "-".into()
    }
}

/// What something absent is shown as.
pub(super) fn or_dash<T>(value: Option<T>, shown: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "-".into(), shown)
}

/// What a series is called.
pub(super) fn label(series: &Series) -> String {
    format!("{}, {}", series.strategy, series.sampler.name())
}

/// At most so many characters of a text.
pub(super) fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let start: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{}…", start.trim_end())
}

/// A name as a part of names of files: letters, digits and hyphens.
pub(super) fn file_name(name: &str) -> String {
    let kept = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '-'
        }
    };
    let name: String = name.chars().take(60).map(kept).collect();
    match name.trim_matches('-') {
        "" => "scene".into(),
        name => name.into(),
    }
}

/// A relative path as a part of an address.
pub(super) fn address(path: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-._~/".contains(&b);
    let part = |b: u8| {
        if plain(b) {
            char::from(b).to_string()
        } else {
            format!("%{b:02X}")
        }
    };
    path.bytes().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::printable;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (0.012_345, "0.0123"),
            (1.0, "1.00"),
            (-0.5, "-0.500"),
            (98.76, "98.8"),
            (999.7, "1000"),
            (1234.0, "1234"),
            (123_456.0, "1.23e5"),
            (1.5e-7, "1.50e-7"),
            (f64::NAN, "-"),
        ];
        for (value, expected) in cases {
            assert_eq!(number(value), expected);
        }
        assert_eq!(time(0.001), "1.00 ms");
        assert_eq!(time(2.5e-5), "25.0 µs");
        assert_eq!(time(90.0), "90.0 s");
        assert_eq!(percent(0.0321), "3.2 %");
    }

    #[test]
    fn names_become_what_files_and_addresses_may_be() {
        assert_eq!(file_name("A scene/<2>"), "a-scene--2");
        assert_eq!(file_name("???"), "scene");
        assert_eq!(address("a b/é#1.png"), "a%20b/%C3%A9%231.png");
        assert_eq!(shortened("abcdef", 4), "abc…");
        assert_eq!(printable("a\u{1b}[1m\u{0}b"), "a [1m b");
    }
}
