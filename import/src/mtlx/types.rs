//! MaterialX's types, what they are in Impasto, and how their values are written.

/// A type of MaterialX.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Type {
    Boolean,
    Integer,
    Float,
    Color3,
    Color4,
    Vector2,
    Vector3,
    Vector4,
    Matrix33,
    Matrix44,
    Text,
    Filename,
    Bsdf,
    Edf,
    Vdf,
    SurfaceShader,
    DisplacementShader,
    VolumeShader,
    LightShader,
    Material,
    /// A node with several outputs, each of a type of its own.
    Several,
}

use Type::*;

/// Every type: its name in MaterialX, its name in Impasto (empty where no expression has it), and how many numbers it
/// has.
const TYPES: &[(Type, &str, &str, usize)] = &[
    (Boolean, "boolean", "bool", 1),
    (Integer, "integer", "int", 1),
    (Float, "float", "float", 1),
    (Color3, "color3", "color", 3),
    (Color4, "color4", "vec4", 4),
    (Vector2, "vector2", "vec2", 2),
    (Vector3, "vector3", "vec3", 3),
    (Vector4, "vector4", "vec4", 4),
    (Matrix33, "matrix33", "mat3", 9),
    (Matrix44, "matrix44", "", 16),
    (Type::Text, "string", "", 0),
    (Filename, "filename", "texture", 0),
    (Bsdf, "BSDF", "bsdf", 0),
    (Edf, "EDF", "edf", 0),
    (Vdf, "VDF", "medium", 0),
    (SurfaceShader, "surfaceshader", "", 0),
    (DisplacementShader, "displacementshader", "", 0),
    (VolumeShader, "volumeshader", "", 0),
    (LightShader, "lightshader", "", 0),
    (Material, "material", "", 0),
    (Several, "multioutput", "", 0),
    // Of version 1.36.
    (Vector2, "color2", "vec2", 2),
];

impl Type {
    /// The type of a name.
    pub fn of(name: &str) -> Option<Self> {
        TYPES.iter().find(|row| row.1 == name).map(|row| row.0)
    }

    /// Names of all types.
    pub fn names() -> impl Iterator<Item = &'static str> {
        TYPES.iter().map(|row| row.1)
    }

    fn row(self) -> (&'static str, &'static str, usize) {
        let row = TYPES.iter().find(|row| row.0 == self);
        row.map_or(("", "", 0), |row| (row.1, row.2, row.3))
    }

    /// Its name in MaterialX.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Its name in Impasto.
    pub fn impasto(self) -> &'static str {
        self.row().1
    }

    /// How many numbers a value has.
    pub fn count(self) -> usize {
        self.row().2
    }

    /// Is it made of floats that operators work on one by one?
    pub fn is_numeric(self) -> bool {
        matches!(
            self,
            Float | Color3 | Color4 | Vector2 | Vector3 | Vector4 | Integer
        )
    }
}

/// A value that is written in a document.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Literal {
    Boolean(bool),
    Integer(i32),
    Numbers(Vec<f64>),
    Text(String),
}

impl Literal {
    /// Reads a value of a type. One number stands for a vector of equal ones.
    ///
    /// # Errors
    /// What was expected, in words.
    pub fn read(text: &str, ty: Type) -> Result<Self, String> {
        let text = text.trim();
        match ty {
            Boolean => match text {
                "true" | "1" => Ok(Self::Boolean(true)),
                "false" | "0" => Ok(Self::Boolean(false)),
                _ => Err("`true` or `false`".into()),
            },
            Integer => {
                let value: Result<i32, _> = text.parse();
                value
                    .map(Self::Integer)
                    .map_err(|_| "a whole number of 32 bits".into())
            }
            Type::Text | Filename => Ok(Self::Text(text.to_owned())),
            _ if ty.count() > 0 => {
                let expected = || match ty.count() {
                    1 => "a number".to_owned(),
                    count => format!("{count} numbers with commas between them"),
                };
                let parts = text.split([',', ' ', '\t', '\n', '\r']);
                let parts = parts.filter(|part| !part.is_empty());
                let numbers: Result<Vec<f64>, _> = parts.take(17).map(str::parse).collect();
                let mut numbers = numbers.map_err(|_| expected())?;
                if numbers.len() == 1 && ty.count() <= 4 {
                    numbers = vec![numbers[0]; ty.count()];
                }
                let finite = numbers.iter().all(|n| (*n as f32).is_finite());
                let fits = numbers.len() == ty.count() && finite;
                if fits {
                    Ok(Self::Numbers(numbers))
                } else {
                    Err(expected())
                }
            }
            _ => Err("no value: it is connected to a node".into()),
        }
    }

    /// The value as an expression of Impasto.
    pub fn written(&self, ty: Type) -> String {
        match self {
            Self::Boolean(value) => value.to_string(),
            Self::Integer(value) => value.to_string(),
            Self::Text(text) => quoted(text),
            Self::Numbers(numbers) if ty == Matrix33 => {
                // Rows there are columns here: MaterialX multiplies vectors from the left.
                let rows = numbers.chunks(3).map(|row| format!("vec3({})", list(row)));
                format!("mat3({})", rows.collect::<Vec<_>>().join(", "))
            }
            Self::Numbers(numbers) if numbers.len() <= 1 => {
                number(numbers.first().copied().unwrap_or(0.0))
            }
            Self::Numbers(numbers) => {
                let name = if ty.impasto().is_empty() {
                    "vec4"
                } else {
                    ty.impasto()
                };
                if numbers.windows(2).all(|pair| pair[0] == pair[1]) {
                    format!("{name}({})", number(numbers[0]))
                } else {
                    format!("{name}({})", list(numbers))
                }
            }
        }
    }

    /// The single number that it is, or that all of its numbers are.
    pub fn single(&self) -> Option<f64> {
        match self {
            Self::Integer(value) => Some(f64::from(*value)),
            Self::Numbers(numbers) if numbers.windows(2).all(|p| p[0] == p[1]) => {
                numbers.first().copied()
            }
            _ => None,
        }
    }
}

/// Numbers with commas between them.
pub(crate) fn list(numbers: &[f64]) -> String {
    numbers
        .iter()
        .map(|n| number(*n))
        .collect::<Vec<_>>()
        .join(", ")
}

/// The shortest float literal of Impasto that gives this number in single precision.
pub(crate) fn number(value: f64) -> String {
    let value = value as f32;
    let value = if value == 0.0 { 0.0 } else { value };
    let plain = format!("{value:?}");
    // Rust writes 1e-5, Impasto reads it so, too.
    plain
}

/// A text in quotes, without what a string of Impasto cannot hold.
pub(crate) fn quoted(text: &str) -> String {
    let safe = text
        .chars()
        .filter(|c| !c.is_control() && *c != '"' && *c != '\\');
    format!("\"{}\"", safe.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_written_as_expressions() {
        let cases = [
            ("0.5", Float, "0.5"),
            ("1", Float, "1.0"),
            ("-0.0", Float, "0.0"),
            ("1e-7", Float, "1e-7"),
            ("3", Integer, "3"),
            ("true", Boolean, "true"),
            ("1, 0.5, 0", Color3, "color(1.0, 0.5, 0.0)"),
            ("0.944 0.776 0.373", Color3, "color(0.944, 0.776, 0.373)"),
            ("1, 1", Vector2, "vec2(1.0)"),
            ("2", Vector3, "vec3(2.0)"),
            ("wood.jpg", Filename, "\"wood.jpg\""),
        ];
        for (text, ty, written) in cases {
            let literal = Literal::read(text, ty);
            assert_eq!(literal.map(|l| l.written(ty)), Ok(written.into()), "{text}");
        }
    }

    #[test]
    fn values_of_another_shape_are_refused() {
        for (text, ty) in [
            ("1, 2", Color3),
            ("a", Float),
            ("", Float),
            ("inf", Float),
            ("1e60", Float),
            ("0.5", Integer),
            ("yes", Boolean),
            ("1", Bsdf),
        ] {
            assert!(Literal::read(text, ty).is_err(), "{text}");
        }
    }
}
