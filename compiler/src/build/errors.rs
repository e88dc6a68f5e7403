//! What may be wrong with a material that checked: it takes too much, or gives too much.

use crate::closure::{Excess, Gain};
use crate::diag::{Code, Diagnostic};
use crate::ir::Material;
use crate::passes::HOIST_FUEL;

/// Most expressions of a material after its calls are put in line, as a GPU driver does.
pub(super) const MAX_SIZE: u64 = 400_000;

/// Most expressions of one function as it is printed, with the constants that they read and the
/// variables that they are stored to. Naga, which reads every shader, takes time with the square.
pub(super) const MAX_TEXT: u64 = 50_000;

/// A material of whose code too much stands in one function.
pub(super) fn too_long_a_function(material: &Material, size: u64) -> Diagnostic {
    let message = format!(
        "`{}` needs a function of {size} operations, constants and assignments",
        material.name
    );
    Diagnostic::new(Code::TooLarge, material.span, message)
        .expected(format!("at most {MAX_TEXT} in one function"))
        .hint("repeat code in loops, or by functions that are called several times")
}

/// A material whose calls multiply beyond what a driver can compile.
pub(super) fn too_large(material: &Material, size: u64) -> Diagnostic {
    let message = format!(
        "`{}` grows to {size} operations once its calls are expanded",
        material.name
    );
    Diagnostic::new(Code::TooLarge, material.span, message)
        .expected(format!("at most {MAX_SIZE}"))
        .hint("call functions in a loop instead of writing the calls out, or share results with `let`")
}

/// A material whose parameters take too long to work with.
pub(crate) fn too_long(material: &Material, instance: &str) -> Diagnostic {
    let message = format!("what depends only on the parameters of `{instance}` takes too long");
    Diagnostic::new(Code::TooLarge, material.span, message)
        .expected(format!("at most {HOIST_FUEL} operations"))
        .hint("shorten loops whose length depends on a parameter")
}

/// A material that sends out more light than it gets, seen from somewhere.
pub(super) fn gains(material: &Material, gain: Gain) -> Diagnostic {
    let Gain { angle, albedo } = gain;
    let message = format!(
        "seen at {angle:.0} degrees from its normal, `{}` scatters {albedo:.2} of the light that falls on it",
        material.name
    );
    Diagnostic::new(Code::EnergyGain, material.span, message)
        .expected("weights that depend on the view to keep the albedo up to 1")
        .hint("use `mix(a, b, t)` with a `t` that depends on `facing`, or divide the weight by its largest value")
}

/// A lobe that scatters more light than falls on it, with the values of the setting `name`.
pub(super) fn too_bright(material: &Material, excess: &Excess, name: &str) -> Diagnostic {
    let by: Vec<String> = excess
        .params
        .iter()
        .map(|p| format!("`{}`", material.params[*p].name))
        .collect();
    let by = if by.is_empty() {
        String::new()
    } else {
        format!("with {} of `{name}`, ", by.join(" and "))
    };
    let message = format!(
        "{by}`{}` scatters {} times the light that falls on it",
        excess.bsdf, excess.albedo as f32
    );
    Diagnostic::new(Code::AboveOne, excess.span, message)
        .expected("reflectances from 0 to 1 in each component")
        .hint("a color in bytes is written `srgb(0xff8000)`")
}
