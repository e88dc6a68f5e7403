//! Values for parameters, as a command line gives them: `roughness=0.2`, `wall.roughness=0:1:5`.

use std::path::Path;

use impasto_compiler::ParameterValue;
use impasto_runtime::scene::GivenParam;

use super::Subject;
use super::sweep::{Axis, MAX_STEPS};
use crate::set::SAMPLE;

/// Extensions by which a value is told to be the name of a picture. (Shells take its quotes away.)
const PICTURES: [&str; 5] = ["png", "jpg", "jpeg", "hdr", "exr"];

/// One value or several for a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamOption {
    /// The binding of the scene, unless there is only one.
    pub binding: Option<String>,
    /// The parameter.
    pub name: String,
    /// What it is to be: one value, or those of a sweep.
    pub values: Vec<ParameterValue>,
}

/// Reads `NAME=VALUE`, `BINDING.NAME=VALUE`, and sweeps: `NAME=FROM:TO:COUNT` and `NAME=A,B,C`.
///
/// # Errors
/// What is wrong with it, and what was expected.
pub fn parse(text: &str) -> Result<ParamOption, String> {
    const EXPECTED: &str = "expected NAME=VALUE, as in `roughness=0.2` or `wall.roughness=0.2`";
    let (target, value) = text.split_once('=').ok_or(EXPECTED)?;
    let (binding, name) = match target.trim().rsplit_once('.') {
        Some((binding, name)) => (Some(binding.trim().to_owned()), name.trim()),
        None => (None, target.trim()),
    };
    let is_part = |c: char| c == '_' || c.is_alphanumeric();
    if name.is_empty() || !name.chars().all(is_part) || binding.as_deref() == Some("") {
        return Err(EXPECTED.into());
    }
    let value = value.trim();
    if value.is_empty() {
        return Err(format!("there is no value after `{target}=`"));
    }
    let values = match (split(value, ':')?, split(value, ',')?) {
        (parts, items) if parts.len() == 1 && items.len() == 1 => vec![self::value(value)],
        (parts, items) if parts.len() == 1 => {
            if items.iter().any(|item| item.is_empty()) {
                return Err(format!("`{value}` has an empty item"));
            }
            check_steps(items.len() as u64)?;
            items.into_iter().map(self::value).collect()
        }
        (parts, _) => steps(value, &parts)?,
    };
    Ok(ParamOption {
        binding,
        name: name.to_owned(),
        values,
    })
}

/// The parts of a text between separators that are in no brackets and no quotes.
fn split(text: &str, separator: char) -> Result<Vec<&str>, String> {
    let (mut parts, mut start, mut depth, mut quoted) = (Vec::new(), 0, 0i32, false);
    for (at, c) in text.char_indices() {
        match c {
            '"' => quoted = !quoted,
            _ if quoted => {}
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ if c == separator && depth == 0 => {
                parts.push(text[start..at].trim());
                start = at + c.len_utf8();
            }
            _ => {}
        }
        if depth < 0 {
            return Err(format!("`{text}` closes a bracket that it does not open"));
        }
    }
    parts.push(text[start..].trim());
    Ok(parts)
}

/// One value: what the parameter's type makes of it, the compiler knows.
fn value(text: &str) -> ParameterValue {
    let finite = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let inside = text.strip_prefix('[').and_then(|t| t.strip_suffix(']'));
    let numbers = inside.and_then(|t| t.split(',').map(finite).collect::<Option<Vec<f64>>>());
    let extension = Path::new(text).extension().and_then(|e| e.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match (text, text.parse::<i64>(), finite(text), numbers) {
        ("true", ..) => ParameterValue::Bool(true),
        ("false", ..) => ParameterValue::Bool(false),
        (_, Ok(integer), ..) => ParameterValue::Int(integer),
        (_, _, Some(number), _) => ParameterValue::Float(number),
        (.., Some(numbers)) => ParameterValue::Floats(numbers),
        _ if PICTURES.contains(&&*extension) && !text.contains(['"', '(']) => {
            ParameterValue::Texture(text.to_owned())
        }
        _ => ParameterValue::Text(text.to_owned()),
    }
}

fn check_steps(count: u64) -> Result<(), String> {
    if (2..=MAX_STEPS).contains(&count) {
        return Ok(());
    }
    Err(format!("a sweep has 2 to {MAX_STEPS} steps, not {count}"))
}

/// The values of `FROM:TO:COUNT`.
fn steps(text: &str, parts: &[&str]) -> Result<Vec<ParameterValue>, String> {
    let wrong = || format!("`{text}` is no sweep: expected FROM:TO:COUNT, as in `0:1:5`");
    let [from, to, count] = parts else {
        return Err(wrong());
    };
    if from.is_empty() || to.is_empty() {
        return Err(wrong());
    }
    if count.is_empty() || !count.chars().all(|c| c.is_ascii_digit()) {
        return Err(format!("`{count}` is no number of steps"));
    }
    // What does not fit is too much.
    let count = count.parse().unwrap_or(u64::MAX);
    check_steps(count)?;
    Ok((0..count)
        .map(|i| between(from, to, i, count - 1))
        .collect())
}

/// Step number `step`, of which the last is `last`. Numbers, with or without a unit, stay numbers.
fn between(from: &str, to: &str, step: u64, last: u64) -> ParameterValue {
    match step {
        0 => return value(from),
        _ if step == last => return value(to),
        _ => {}
    }
    let t = step as f64 / last as f64;
    let ((a, unit), (b, other)) = (quantity(from), quantity(to));
    match (a, b) {
        (Some(a), Some(b)) if unit == other => {
            let number = rounded(a + t * (b - a));
            let is_whole = !from.contains('.') && !to.contains('.');
            match unit {
                "" if is_whole && number.fract() == 0.0 => value(&format!("{number}")),
                "" => ParameterValue::Float(number),
                unit => ParameterValue::Text(format!("{number} {unit}")),
            }
        }
        _ => ParameterValue::Text(format!("({from}) * {:?} + ({to}) * {t:?}", 1.0 - t)),
    }
}

/// A number and its unit, if that is all that a text is.
fn quantity(text: &str) -> (Option<f64>, &str) {
    let text = text.trim();
    let is_unit = |c: char| c.is_alphabetic();
    let end = text.trim_end_matches(is_unit).len();
    let (number, unit) = text.split_at(end);
    match number.trim().parse() {
        Ok(number) => (Some(number), unit),
        Err(_) => (None, ""),
    }
}

/// A number without what is left of rounding in its last places, for labels.
fn rounded(x: f64) -> f64 {
    format!("{x:.9e}").parse().unwrap_or(x)
}

/// The values that options give to parameters, and the sweeps among them.
///
/// # Errors
/// If a binding is missing or too much, or something is given twice.
pub fn given(
    options: &[ParamOption],
    subject: &Subject,
    bindings: &[String],
) -> Result<(Vec<GivenParam>, Vec<Axis>), String> {
    let (mut given, mut axes): (Vec<GivenParam>, Vec<Axis>) = Default::default();
    for option in options {
        let name = &option.name;
        let target = match &option.binding {
            Some(binding) => format!("{binding}.{name}"),
            None => name.clone(),
        };
        let origin = format!("--param {target}");
        let binding = match (&option.binding, subject) {
            (None, Subject::Set(_)) => SAMPLE.to_owned(),
            (Some(binding), Subject::Set(_)) => {
                return Err(format!(
                    "`{origin}`: a material file binds nothing, so there is no `{binding}`\n  hint: write `--param {name}=...`"
                ));
            }
            (Some(binding), Subject::Scene(_)) => binding.clone(),
            (None, Subject::Scene(_)) if bindings.len() == 1 => bindings[0].clone(),
            (None, Subject::Scene(_)) => {
                let names: Vec<String> = bindings.iter().map(|b| format!("`{b}`")).collect();
                let first = bindings.first().map_or("NAME", |b| b.as_str());
                return Err(format!(
                    "`{origin}`: a parameter of which material?\n  hint: write `--param {first}.{name}=...`; the scene's materials are {}",
                    names.join(", ")
                ));
            }
        };
        let is_it = |g: &GivenParam| g.binding == binding && g.param == *name;
        if given.iter().any(is_it) || axes.iter().any(|axis| is_it(&axis.steps[0])) {
            return Err(format!("`{origin}` is there twice"));
        }
        let one = |value: &ParameterValue| GivenParam {
            binding: binding.clone(),
            param: name.clone(),
            value: value.clone(),
            origin: origin.clone(),
        };
        match &option.values[..] {
            [value] => given.push(one(value)),
            values => axes.push(Axis {
                label: target,
                steps: values.iter().map(one).collect(),
            }),
        }
    }
    Ok((given, axes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        let option = parse(text).expect(text);
        option.values.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn values_are_what_scenes_take() {
        use ParameterValue::*;
        let of = |text: &str| parse(text).expect(text).values;
        assert_eq!(of("a=0.2"), [Float(0.2)]);
        assert_eq!(of("a=3"), [Int(3)]);
        assert_eq!(of("a=true"), [Bool(true)]);
        assert_eq!(of("a=3 mm"), [Text("3 mm".into())]);
        assert_eq!(of("a=[1, 0.5, 0]"), [Floats(vec![1.0, 0.5, 0.0])]);
        assert_eq!(of("a=srgb(0x8c1010)"), [Text("srgb(0x8c1010)".into())]);
        assert_eq!(of("a=color(1, 0, 0)"), [Text("color(1, 0, 0)".into())]);
        assert_eq!(of("a=x/b.png"), [Texture("x/b.png".into())]);
        assert_eq!(of("a=nan"), [Text("nan".into())]);
        let bound = parse("left wall.roughness = 0.5").expect("it is one");
        assert_eq!(bound.binding.as_deref(), Some("left wall"));
        assert_eq!(bound.name, "roughness");
    }

    #[test]
    fn sweeps_have_even_steps() {
        assert_eq!(values("a=0:1:5"), ["0", "0.25", "0.5", "0.75", "1"]);
        assert_eq!(values("a=1:3:3"), ["1", "2", "3"]);
        assert_eq!(values("a=0.1:0.7:3"), ["0.1", "0.4", "0.7"]);
        assert_eq!(values("a=1 mm:10 mm:4"), ["1 mm", "4 mm", "7 mm", "10 mm"]);
        assert_eq!(values("a=1, 4,9"), ["1", "4", "9"]);
        assert_eq!(values("a=color(1,0,0),color(0,1,0)").len(), 2);
        let colors = values("a=srgb(0x000000):srgb(0xffffff):3");
        assert_eq!(colors[1], "(srgb(0x000000)) * 0.5 + (srgb(0xffffff)) * 0.5");
    }

    #[test]
    fn what_is_no_value_is_refused() {
        for text in [
            "",
            "a",
            "=1",
            "a=",
            ".a=1",
            "a.=1",
            "a b=1",
            "a=0:1",
            "a=0:1:2:3",
            "a=0:1:x",
            "a=0:1:1",
            "a=:1:3",
            "a=0:1:1000000",
            "a=0:1:99999999999999999999",
            "a=0:1:-3",
            "a=1,,2",
            "a=)",
        ] {
            assert!(parse(text).is_err(), "`{text}` is taken");
        }
        let said = parse("a=0:1:1000000").expect_err("too many");
        assert!(said.contains("at most") || said.contains("2 to"), "{said}");
    }
}
