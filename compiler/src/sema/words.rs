//! Names that the language itself gives a meaning: for hints, editors, and whoever must not take them.

use crate::ir::ops::Op;

pub use super::expr::{NO_MEDIUM, PICTURES};
use super::types::NAMED;
use super::{array, inputs, matrix, outputs, test};

/// Functions of the language that are no row of the op table.
const FORMS: [&str; 6] = [
    "filter_width",
    "gradient",
    "layer",
    "medium",
    test::NEAR,
    "srgb",
];

/// Functions that a source can call without a definition; conversions to types apart.
pub fn built_in_functions() -> impl Iterator<Item = &'static str> {
    let callable = Op::ALL.iter().filter(|op| op.info().callable);
    callable
        .map(|op| op.info().text)
        .chain(FORMS)
        .chain(matrix::FUNCTIONS)
        .chain(array::FUNCTIONS)
        .chain(inputs::FUNCTIONS)
}

/// The types that have names.
pub fn type_names() -> impl Iterator<Item = &'static str> {
    NAMED.iter().map(|(name, _)| *name)
}

/// Is it the name of a type of the language?
pub fn is_type(name: &str) -> bool {
    type_names().any(|ty| ty == name)
}

/// What a material is told by name: of its surface, and when it is seen.
pub fn input_names() -> impl Iterator<Item = &'static str> {
    inputs::names().chain(inputs::MOMENT)
}

/// Is it the name of an input of the surface?
pub fn is_input(name: &str) -> bool {
    inputs::is_input(name)
}

/// Is it the name of what a material is told of the moment?
pub fn is_moment(name: &str) -> bool {
    inputs::MOMENT.contains(&name)
}

/// What a material assigns.
pub fn output_names() -> impl Iterator<Item = &'static str> {
    outputs::OUTPUTS.into_iter().map(|(name, _)| name)
}

/// Is it the name of an output?
pub fn is_output(name: &str) -> bool {
    output_names().any(|output| output == name)
}
