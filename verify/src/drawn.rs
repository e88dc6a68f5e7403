//! Values for the parameters of a material, drawn from what it declares of them.

use impasto_compiler::ParameterValue;
use impasto_compiler::interface::ParamInterface;

use crate::statistics::Numbers;

/// A parameter and its value, as source text.
pub type Setting = (String, String);

/// Which values are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum From {
    /// Anywhere in their ranges, the ends often; lengths stay as they are: a pattern of a tenth of a millimetre a metre
    /// from its origin has few digits left.
    Ranges,
    /// The ends of the ranges alone, of lengths too.
    Ends,
}

/// Values for those parameters that a scene can set, which equal seeds give equally.
pub fn drawn(params: &[ParamInterface], from: From, seed: u64) -> Vec<Setting> {
    let mut n = Numbers::new(seed);
    let settable = params.iter().filter(|p| p.settable);
    let values = settable.filter_map(|p| Some((p.name.clone(), value(p, from, &mut n)?)));
    values.collect()
}

/// A value of a parameter; none, if it is not told what may be drawn.
fn value(p: &ParamInterface, from: From, n: &mut Numbers) -> Option<String> {
    let range = p.hard.map(|ends| ends.map(f64::from));
    let mut number = |[low, high]: [f64; 2]| match (n.unit(), from) {
        (u, From::Ranges) if u < 0.2 => low,
        (u, From::Ranges) if u < 0.4 => high,
        (_, From::Ranges) => n.between(low, high),
        (u, From::Ends) if u < 0.5 => low,
        (_, From::Ends) => high,
    };
    // Numbers as single precision has them: those of a range are, and what is written must not lie outside of it.
    let text = |x: f64| format!("{:?}", x as f32);
    Some(match p.ty.as_str() {
        "color" => {
            let range = range.unwrap_or([0.0, 1.0]);
            let [r, g, b] = [(); 3].map(|()| match from {
                From::Ranges => n.between(range[0], range[1]),
                From::Ends => range[usize::from(n.unit() < 0.5)],
            });
            format!("color({}, {}, {})", text(r), text(g), text(b))
        }
        "float" => text(number(range?)),
        "int" => format!("{}", number(range?).round() as i32),
        "bool" => (n.unit() < 0.5).to_string(),
        "length" if from == From::Ends => format!("{} m", text(number(range?))),
        "angle" if from == From::Ends => format!("{} rad", text(number(range?))),
        _ => return None,
    })
}

/// Settings as a request takes them.
pub fn values(settings: &[Setting]) -> Vec<(String, ParameterValue)> {
    let each = settings.iter();
    each.map(|(name, value)| (name.clone(), ParameterValue::Text(value.clone())))
        .collect()
}

/// Settings as a person writes them; `its defaults` if there are none.
pub fn shown(settings: &[Setting]) -> String {
    if settings.is_empty() {
        return "its defaults".to_owned();
    }
    let each: Vec<String> = settings.iter().map(|(n, v)| format!("{n} = {v}")).collect();
    each.join(", ")
}

/// `a = 1, b = color(1.0, 0.5, 0.0)`: settings as a doc comment writes them. Commas within brackets part nothing.
pub fn read(text: &str) -> Option<Vec<Setting>> {
    let text = text.trim().trim_end_matches('.');
    if text.is_empty() {
        return Some(Vec::new());
    }
    let mut parts = vec![String::new()];
    let mut depth = 0usize;
    for c in text.chars() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        match parts.last_mut() {
            Some(part) if c != ',' || depth > 0 => part.push(c),
            _ => parts.push(String::new()),
        }
    }
    let pair = |part: &String| {
        let (name, value) = part.split_once('=')?;
        Some((name.trim().to_owned(), value.trim().to_owned()))
    };
    parts.iter().map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::{From, drawn, read};
    use impasto_compiler::MemoryLoader;
    use impasto_compiler::interface::interface;

    #[test]
    fn settings_are_read_with_their_brackets() {
        let read = read(" a = color(0.1, 0.2, 0.3), b = 1 cm.").expect("settings");
        let expected = [("a", "color(0.1, 0.2, 0.3)"), ("b", "1 cm")];
        assert_eq!(read, expected.map(|(n, v)| (n.to_owned(), v.to_owned())));
        assert_eq!(super::read("a"), None);
    }

    #[test]
    fn what_is_drawn_lies_in_its_range_and_ends_are_ends() {
        let text = "use std::bsdf::diffuse;\nmaterial m {
            param a: float = 0.5 in 0.25 .. 0.75;
            param b: length = 1 mm in 0.1 mm .. 1 m;
            param c: float = 0.5;
            param d: normal = normal;
            surface = diffuse(a + c);
        }";
        let mut files = MemoryLoader::default();
        files.add("m.impasto", text);
        let params = &interface("m.impasto", &mut files).materials[0].params;
        for seed in 0..50 {
            let found = drawn(params, From::Ranges, seed);
            let [(name, value)] = &found[..] else {
                panic!("{found:?}")
            };
            let value: f64 = value.parse().expect("a number");
            assert!(name == "a" && (0.25..=0.75).contains(&value), "{found:?}");
            let ends = drawn(params, From::Ends, seed);
            assert!(["0.25", "0.75"].contains(&&*ends[0].1), "{ends:?}");
            assert!(["0.0001 m", "1.0 m"].contains(&&*ends[1].1), "{ends:?}");
        }
    }
}
