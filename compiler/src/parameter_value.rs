//! Values that scenes and geometry files give to parameters.
//!
//! A file says `0.4` or `[1, 0.5, 0]`. Whether that is a float, a color or a normal only the
//! parameter tells, so numbers reach the checker as numbers, in the precision that they were read
//! in. What needs the language (units, names, arithmetic) reaches it as source text.

use std::fmt;

/// A value for a parameter whose type is not known yet.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// True or false.
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A number.
    Float(f64),
    /// A vector of two to four components, or a color.
    Floats(Vec<f64>),
    /// An image file, relative to the scene.
    Texture(String),
    /// A constant expression of the language, such as `0.6 mm`.
    Text(String),
    /// Any of these, from somewhere else than the scene, which diagnostics name instead: `--param wall.roughness`.
    From(String, Box<ParameterValue>),
}

impl ParameterValue {
    /// The value, and who gave it if that is not the scene.
    pub fn origin(&self) -> (Option<&str>, &ParameterValue) {
        match self {
            Self::From(origin, value) => (Some(origin), value.origin().1),
            value => (None, value),
        }
    }
}

/// The value as a constant expression, which is what diagnostics show. Three components are called
/// a color.
impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Bool(b) => write!(f, "{b}"),
            Self::Int(i) => write!(f, "{i}"),
            Self::Float(x) => write!(f, "{x:?}"),
            Self::Floats(v) => {
                let name = match v.len() {
                    2 => "vec2",
                    3 => "color",
                    _ => "vec4",
                };
                let components: Vec<String> = v.iter().map(|x| format!("{x:?}")).collect();
                write!(f, "{name}({})", components.join(", "))
            }
            Self::Texture(path) => write!(f, "\"{path}\""),
            Self::Text(text) => f.write_str(text),
            Self::From(_, value) => value.fmt(f),
        }
    }
}

impl From<&str> for ParameterValue {
    /// A constant expression.
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for ParameterValue {
    /// A constant expression.
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}
