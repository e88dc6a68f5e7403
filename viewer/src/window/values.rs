//! What the metadata of a parameter makes of its value: the unit that it is shown in, the ends of its slider, the limits
//! that hold it, and the value that an order has.

use impasto_compiler::ParameterValue;
use impasto_compiler::interface::{ParamInterface, Value};

/// What a hand edits a parameter with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// A box to tick.
    Switch,
    /// A slider of whole numbers.
    Whole,
    /// A slider, in the unit.
    Number,
    /// A field for each component.
    Vector,
    /// A picker of colors.
    Color,
    /// The path of a picture.
    Path,
    /// An expression of the language, or what a later version may have.
    Text,
}

/// The control of a parameter.
pub fn control(interface: &ParamInterface, value: &Value) -> Control {
    match (value, interface.ty.as_str()) {
        (Value::Bool(_), _) => Control::Switch,
        (Value::Int(_), _) => Control::Whole,
        (Value::Number(_), _) => Control::Number,
        (Value::Components(c), "color") if c.len() == 3 => Control::Color,
        (Value::Components(_), _) => Control::Vector,
        (Value::Text(_), "texture") => Control::Path,
        (Value::Text(_), _) => Control::Text,
    }
}

/// The unit of a parameter, and how many metres or radians it is; none, and 1, of plain numbers.
pub fn unit(interface: &ParamInterface) -> (&'static str, f64) {
    let unit = interface.unit.filter(|unit| unit.size > 0.0);
    unit.map_or(("", 1.0), |unit| (unit.name, unit.size))
}

/// A number as people write it: `0.1` as a float is 0.10000000149 as a double, but nobody means that.
pub fn exact(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

/// A value in the parameter's unit.
pub fn shown(interface: &ParamInterface, x: f32) -> f64 {
    let (_, size) = unit(interface);
    rounded(exact(x) / size)
}

/// A value that is given in the parameter's unit.
pub fn given(interface: &ParamInterface, x: f64) -> f32 {
    let (_, size) = unit(interface);
    (x * size) as f32
}

/// To the seven digits that a float has.
fn rounded(x: f64) -> f64 {
    format!("{x:.6e}").parse().unwrap_or(x)
}

/// A slider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// The left end, in the parameter's unit.
    pub low: f64,
    /// The right end.
    pub high: f64,
    /// Are equal ratios equally far apart?
    pub is_log: bool,
}

/// The ends of a parameter's slider: the soft range, or else the hard one, or else one around the default.
pub fn ends(interface: &ParamInterface) -> Ends {
    let finite =
        |range: &[f32; 2]| range[0].is_finite() && range[1].is_finite() && range[0] < range[1];
    let range = interface
        .soft
        .filter(finite)
        .or(interface.hard.filter(finite));
    let [low, high] = range.unwrap_or_else(|| {
        let default = match &interface.default {
            Value::Number(x) => *x,
            Value::Int(i) => *i as f32,
            Value::Components(c) => c.iter().fold(0.0, |most: f32, x| most.max(x.abs())),
            Value::Bool(_) | Value::Text(_) => 0.0,
        };
        let high = if default == 0.0 || !default.is_finite() {
            given(interface, 1.0)
        } else {
            2.0 * default.abs()
        };
        let low = if default < 0.0 { -high } else { 0.0 };
        let [hard_low, hard_high] = interface.hard.unwrap_or([f32::NEG_INFINITY, f32::INFINITY]);
        let (low, high) = (
            low.clamp(hard_low, hard_high),
            high.clamp(hard_low, hard_high),
        );
        if low < high {
            [low, high]
        } else {
            [low, low + 1.0]
        }
    });
    let is_log = low > 0.0 && high / low >= 100.0;
    Ends {
        low: shown(interface, low),
        high: shown(interface, high),
        is_log,
    }
}

/// The limits of a parameter in its unit.
pub fn limits(interface: &ParamInterface) -> [f64; 2] {
    let hard = interface.hard.unwrap_or([f32::NEG_INFINITY, f32::INFINITY]);
    [hard[0], hard[1]].map(|x| match x.is_finite() {
        true => shown(interface, x),
        false if x > 0.0 => f64::INFINITY,
        false => f64::NEG_INFINITY,
    })
}

/// The nearest value that the limits allow, by component. What is no number is the low end, or 0.
pub fn held(interface: &ParamInterface, value: Value) -> Value {
    let [low, high] = interface.hard.unwrap_or([f32::MIN, f32::MAX]);
    let hold = |x: f32| {
        if x.is_nan() {
            low.max(0.0).min(high)
        } else {
            x.max(low).min(high)
        }
    };
    match value {
        Value::Number(x) => Value::Number(hold(x)),
        Value::Components(c) => Value::Components(c.into_iter().map(hold).collect()),
        Value::Int(i) => {
            // A float holds every int of a sane range; the limits are ints too.
            let (low, high) = (f64::from(low).ceil(), f64::from(high).floor());
            Value::Int(f64::from(i).max(low).min(high) as i32)
        }
        other => other,
    }
}

/// The value that an order has. Lengths and angles are expressions with their unit, which a scene file then has too.
pub fn ordered(interface: &ParamInterface, value: &Value) -> ParameterValue {
    match value {
        Value::Bool(b) => ParameterValue::Bool(*b),
        Value::Int(i) => ParameterValue::Int(i64::from(*i)),
        Value::Number(x) => match unit(interface) {
            ("", _) => ParameterValue::Float(exact(*x)),
            (name, _) => ParameterValue::Text(format!("{} {name}", shown(interface, *x))),
        },
        Value::Components(c) => ParameterValue::Floats(c.iter().map(|x| exact(*x)).collect()),
        Value::Text(path) if interface.ty == "texture" => ParameterValue::Texture(path.clone()),
        Value::Text(text) => ParameterValue::Text(text.clone()),
    }
}

/// Are two values the same to a hand?
pub fn alike(a: &Value, b: &Value) -> bool {
    let near = |a: f32, b: f32| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => near(*a, *b),
        (Value::Components(a), Value::Components(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(*a, *b))
        }
        (a, b) => a == b,
    }
}

/// A value in text: what a tooltip shows.
pub fn text(interface: &ParamInterface, value: &Value) -> String {
    match value {
        Value::Bool(b) => b.to_string(),
        Value::Int(i) => i.to_string(),
        Value::Number(x) => {
            let (name, _) = unit(interface);
            format!("{} {name}", shown(interface, *x))
                .trim_end()
                .to_owned()
        }
        Value::Components(c) => {
            let all: Vec<String> = c.iter().map(f32::to_string).collect();
            format!("({})", all.join(", "))
        }
        Value::Text(text) => text.clone(),
    }
}

/// A color as `srgb` of the language has it, `0x8c1010`, from linear values; cut at 1.
pub fn hex(linear: [f32; 3]) -> String {
    let [r, g, b] = linear.map(|x| (super::tone::srgb(x.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8);
    format!("{r:02x}{g:02x}{b:02x}")
}

/// The linear color of six digits, with what people write before them: `#8c1010`, `0x8c1010`, `srgb(0x8c1010)`.
pub fn from_hex(text: &str) -> Option<[f32; 3]> {
    let text = text.trim();
    let text = text
        .strip_prefix("srgb(")
        .and_then(|t| t.strip_suffix(')'))
        .unwrap_or(text);
    let digits = text
        .strip_prefix("0x")
        .or(text.strip_prefix('#'))
        .unwrap_or(text);
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let number = u32::from_str_radix(digits, 16).ok()?;
    let [_, r, g, b] = number.to_be_bytes();
    Some([r, g, b].map(|byte| super::tone::linear(f32::from(byte) / 255.0)))
}

/// Hue, saturation and value, from 0 to 1, of a color of the same kind of numbers, such as sRGB.
pub fn hsv([r, g, b]: [f32; 3]) -> [f32; 3] {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let width = most - least;
    if width <= 0.0 {
        return [0.0, 0.0, most];
    }
    let sector = match most {
        m if m == r => ((g - b) / width).rem_euclid(6.0),
        m if m == g => (b - r) / width + 2.0,
        _ => (r - g) / width + 4.0,
    };
    [sector / 6.0, width / most, most]
}

/// The color of a hue, a saturation and a value.
pub fn from_hsv([hue, saturation, value]: [f32; 3]) -> [f32; 3] {
    [0.0, 4.0, 2.0].map(|shift| {
        let distance = ((hue * 6.0 + shift).rem_euclid(6.0) - 3.0).abs() - 1.0;
        value * (1.0 - saturation + saturation * distance.clamp(0.0, 1.0))
    })
}

#[cfg(test)]
mod tests {
    use impasto_compiler::interface::UnitInterface;

    use super::*;

    fn interface(ty: &str, default: Value) -> ParamInterface {
        ParamInterface {
            name: "p".to_owned(),
            ty: ty.to_owned(),
            label: "P".to_owned(),
            group: None,
            docs: String::new(),
            settable: true,
            default,
            default_text: String::new(),
            hard: None,
            soft: None,
            unit: None,
        }
    }

    fn length() -> ParamInterface {
        ParamInterface {
            hard: Some([5e-5, 1.0]),
            soft: Some([1e-4, 5e-3]),
            unit: Some(UnitInterface {
                name: "mm",
                size: 1e-3,
            }),
            ..interface("length", Value::Number(6e-4))
        }
    }

    #[test]
    fn lengths_are_shown_and_ordered_in_their_unit() {
        let length = length();
        assert_eq!(shown(&length, 6e-4), 0.6);
        assert_eq!(given(&length, 0.6), 6e-4);
        let ordered = ordered(&length, &Value::Number(6e-4));
        assert_eq!(ordered, ParameterValue::Text("0.6 mm".to_owned()));
        assert_eq!(limits(&length), [0.05, 1000.0]);
        assert_eq!(ends(&length).low, 0.1);
        assert_eq!(ends(&length).high, 5.0);
        assert_eq!(text(&length, &Value::Number(6e-4)), "0.6 mm");
    }

    #[test]
    fn plain_values_are_those_of_the_language() {
        let float = interface("float", Value::Number(0.1));
        assert_eq!(
            ordered(&float, &Value::Number(0.1)),
            ParameterValue::Float(0.1)
        );
        let color = interface("color", Value::Components(vec![0.2; 3]));
        let floats = ordered(&color, &Value::Components(vec![0.2, 0.4, 0.1]));
        assert_eq!(floats, ParameterValue::Floats(vec![0.2, 0.4, 0.1]));
        let path = Value::Text("wood.png".to_owned());
        let texture = interface("texture", path.clone());
        let ordered_path = ordered(&texture, &path);
        assert_eq!(ordered_path, ParameterValue::Texture("wood.png".to_owned()));
        assert_eq!(
            ordered(&float, &Value::Bool(true)),
            ParameterValue::Bool(true)
        );
        assert_eq!(ordered(&float, &Value::Int(-3)), ParameterValue::Int(-3));
    }

    #[test]
    fn sliders_have_ends_whatever_the_metadata() {
        let zero = ends(&interface("float", Value::Number(0.0)));
        assert_eq!((zero.low, zero.high, zero.is_log), (0.0, 1.0, false));
        let two = ends(&interface("float", Value::Number(2.0)));
        assert_eq!((two.low, two.high), (0.0, 4.0));
        let below = ends(&interface("float", Value::Number(-2.0)));
        assert_eq!((below.low, below.high), (-4.0, 4.0));
        let half = ParamInterface {
            hard: Some([0.0, f32::INFINITY]),
            ..interface("float", Value::Number(3.0))
        };
        assert_eq!((ends(&half).low, ends(&half).high), (0.0, 6.0));
        assert_eq!(limits(&half), [0.0, f64::INFINITY]);
        let wide = ParamInterface {
            hard: Some([1e-4, 1.0]),
            ..interface("float", Value::Number(0.01))
        };
        assert!(ends(&wide).is_log);
        let above = ParamInterface {
            hard: Some([5.0, f32::INFINITY]),
            ..interface("float", Value::Number(0.0))
        };
        assert!(ends(&above).low < ends(&above).high);
    }

    #[test]
    fn limits_hold() {
        let hard = |ty: &str, range| ParamInterface {
            hard: Some(range),
            ..interface(ty, Value::Number(0.5))
        };
        let float = hard("float", [0.0, 1.0]);
        assert_eq!(held(&float, Value::Number(7.0)), Value::Number(1.0));
        assert_eq!(held(&float, Value::Number(f32::NAN)), Value::Number(0.0));
        let color = held(&float, Value::Components(vec![-1.0, 0.5, 2.0]));
        assert_eq!(color, Value::Components(vec![0.0, 0.5, 1.0]));
        let int = hard("int", [-5.0, 5.0]);
        assert_eq!(held(&int, Value::Int(9)), Value::Int(5));
        assert_eq!(held(&int, Value::Int(-9)), Value::Int(-5));
        let free = interface("int", Value::Int(0));
        assert_eq!(held(&free, Value::Int(i32::MAX)), Value::Int(i32::MAX));
    }

    #[test]
    fn controls_fit_the_values() {
        let color = interface("color", Value::Components(vec![0.2; 3]));
        assert_eq!(
            control(&color, &Value::Components(vec![0.2; 3])),
            Control::Color
        );
        let point = interface("point", Value::Components(vec![0.2; 3]));
        assert_eq!(
            control(&point, &Value::Components(vec![0.2; 3])),
            Control::Vector
        );
        assert_eq!(control(&point, &Value::Text("x".to_owned())), Control::Text);
        let texture = interface("texture", Value::Text(String::new()));
        assert_eq!(
            control(&texture, &Value::Text(String::new())),
            Control::Path
        );
    }

    #[test]
    fn hex_and_back() {
        for text in ["8c1010", "000000", "ffffff", "0a8B3f"] {
            let linear = from_hex(text).expect("six digits");
            assert_eq!(hex(linear), text.to_lowercase());
        }
        assert_eq!(from_hex("srgb(0x8c1010)"), from_hex("#8c1010"));
        for bad in ["", "8c101", "8c10100", "gggggg", "+8c101", "ä1c10"] {
            assert_eq!(from_hex(bad), None, "{bad}");
        }
        assert_eq!(hex([7.0, -1.0, 0.0]), "ff0000");
    }

    #[test]
    fn hues_and_back() {
        assert_eq!(hsv([1.0, 0.0, 0.0]), [0.0, 1.0, 1.0]);
        assert_eq!(hsv([0.5; 3]), [0.0, 0.0, 0.5]);
        assert_eq!(hsv([0.0; 3]), [0.0; 3]);
        for color in [
            [0.9, 0.1, 0.3],
            [0.2, 0.7, 0.1],
            [0.1, 0.2, 0.8],
            [0.3, 0.3, 0.1],
        ] {
            let back = from_hsv(hsv(color));
            let is_near = back.iter().zip(color).all(|(a, b)| (a - b).abs() < 1e-5);
            assert!(is_near, "{color:?} {back:?}");
        }
    }

    #[test]
    fn nearly_equal_is_equal() {
        assert!(alike(&Value::Number(0.1), &Value::Number(0.100_000_01)));
        assert!(!alike(&Value::Number(0.1), &Value::Number(0.1001)));
        assert!(!alike(&Value::Number(0.0), &Value::Int(0)));
        assert!(alike(
            &Value::Components(vec![1.0]),
            &Value::Components(vec![1.0])
        ));
    }
}
