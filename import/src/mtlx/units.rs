//! Units of values. What the document says counts; a length without a unit is so many units of the scene, which the
//! caller knows, or else a parameter of the material says.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::document::{Document, Id};
use crate::mtlx::graph::{ScopeId, Source};
use crate::mtlx::material::Builder;
use crate::mtlx::text::{Level, bound};
use crate::mtlx::types::{Literal, number};
use crate::mtlx::value::Value;

/// What the parameter is called that says how long a unit is.
const SCENE_UNIT: &str = "scene_unit";

/// Names of units, and what they are in metres or degrees.
const UNITS: &[(&str, f64)] = &[
    ("nanometer", 1e-9),
    ("micron", 1e-6),
    ("millimeter", 1e-3),
    ("centimeter", 1e-2),
    ("inch", 0.0254),
    ("foot", 0.3048),
    ("yard", 0.9144),
    ("meter", 1.0),
    ("kilometer", 1e3),
    ("mile", 1609.344),
    ("degree", 1.0),
    ("radian", 180.0 / std::f64::consts::PI),
];

/// What the unit of a value is in metres or degrees, if the document says it.
pub(crate) fn stated(document: &Document, at: Id) -> Result<Option<f64>, ImportError> {
    let Some(unit) = document.attribute(at, "unit") else {
        return Ok(None);
    };
    let found = UNITS.iter().find(|(name, _)| *name == unit);
    found.map(|(_, size)| Some(*size)).ok_or_else(|| {
        let names: Vec<&str> = UNITS.iter().map(|(name, _)| *name).collect();
        let error = document.error(at, format!("the unit `{unit}` is not known"));
        error.expected(names.join(", "))
    })
}

/// How long a unit of the scene is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SceneUnit {
    Metres(f64),
    /// As a parameter says.
    Parameter(String),
}

impl Builder<'_, '_> {
    /// How long a unit of the scene is. Where nobody knows, the material has a parameter for it from now on.
    fn scene_unit(&mut self) -> SceneUnit {
        if let Some(metres) = self.options.metres_per_unit {
            return SceneUnit::Metres(metres);
        }
        if self.scene_unit.is_none() {
            self.scene_unit = Some(self.unique(SCENE_UNIT));
        }
        SceneUnit::Parameter(self.scene_unit.clone().unwrap_or_default())
    }

    /// Does the document say the unit of a value?
    fn says_unit(&mut self, scope: ScopeId, element: Id) -> bool {
        let document = self.graphs.document;
        match self.graphs.source(scope, element) {
            Ok(Source::Value(at) | Source::Parameter(at)) => {
                document.attribute(at, "unit").is_some()
            }
            _ => false,
        }
    }
}

/// The declaration of the parameter.
pub(crate) fn declaration(name: &str) -> String {
    format!(
        "/// How long a unit of lengths is, which the document does not say.\n\
         param {name}: length = 1 m in 1 um .. 1 km {{ label: \"Scene unit\", soft: 1 mm .. 1 m }};\n"
    )
}

impl Call<'_, '_, '_> {
    /// The unit of an input that is a length, unless the document says it or the value is zero.
    fn unit_of(&mut self, name: &str, value: &Value) -> Option<SceneUnit> {
        let element = self.builder.graphs.document.input(self.key.node, name);
        let says = element.is_some_and(|at| self.builder.says_unit(self.key.scope, at));
        (!says && !value.is_zero()).then(|| self.builder.scene_unit())
    }

    /// The length that an input is: a number with a unit, or a product with one.
    pub fn length(&mut self, name: &str, value: &Value) -> String {
        let product = |unit: &str| format!("{} * {unit}", bound(&value.text, Level::Product));
        match (value.single(), self.unit_of(name, value)) {
            (Some(single), None) => length(single, "m"),
            (Some(single), Some(SceneUnit::Metres(metres))) => length(single * metres, "m"),
            (Some(1.0), Some(SceneUnit::Parameter(unit))) => unit,
            (_, Some(SceneUnit::Parameter(unit))) => product(&unit),
            (None, Some(SceneUnit::Metres(metres))) => product(&length(metres, "m")),
            (None, None) => product("1 m"),
        }
    }

    /// The value of an input in metres, or in 1/m, as a number or numbers.
    pub fn in_metres(&mut self, name: &str, value: Value, is_inverse: bool) -> Value {
        match self.unit_of(name, &value) {
            None | Some(SceneUnit::Metres(1.0)) => value,
            Some(SceneUnit::Metres(metres)) => {
                let factor = if is_inverse { 1.0 / metres } else { metres };
                match value.literal {
                    Some(Literal::Numbers(numbers)) => {
                        let scaled = numbers.into_iter().map(|x| x * factor).collect();
                        Value::of(value.ty, Literal::Numbers(scaled))
                    }
                    _ => {
                        let factor = number(factor);
                        let text = bound(&value.text, Level::Prefix);
                        Value::new(value.ty, format!("{factor} * {text}"))
                    }
                }
            }
            Some(SceneUnit::Parameter(unit)) => {
                let operator = if is_inverse { '/' } else { '*' };
                let text = bound(&value.text, Level::Product);
                Value::new(value.ty, format!("{text} {operator} float({unit})"))
            }
        }
    }
}

/// A number of units; short lengths in smaller ones.
pub(crate) fn length(value: f64, unit: &str) -> String {
    const SMALLER: [(&str, f64); 2] = [("cm", 1e2), ("mm", 1e3)];
    let smaller = SMALLER.iter().find(|(_, count)| value * count >= 1.0);
    let (unit, value) = match smaller.filter(|_| unit == "m" && value < 0.1) {
        Some((unit, count)) => (*unit, value * count),
        None => (unit, value),
    };
    format!("{} {unit}", number(value).trim_end_matches(".0"))
}
