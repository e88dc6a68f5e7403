//! How far answers in single precision are from those in double precision.

/// Below this share of the light, or this density, errors are no longer relative: a thousandth
/// of it is what single precision can tell of numbers next to 1.
const FLOOR: f64 = 1e-4;

/// Relative errors of density, value and their quotient.
pub fn errors(exact: &[f64; 4], found: &[f64; 4], is_free: bool) -> [f64; 3] {
    let relative = |a: f64, b: f64, scale: f64| {
        let error = (a - b).abs() / a.abs().max(FLOOR * scale.max(1.0));
        if error.is_finite() {
            error
        } else {
            f64::INFINITY
        }
    };
    let mut errors = [relative(exact[0], found[0], 1.0), 0.0, 0.0];
    for c in 1..4 {
        errors[1] = errors[1].max(relative(exact[c], found[c], exact[0]));
        if !is_free && exact[0] > FLOOR {
            let quotient = relative(exact[c] / exact[0], found[c] / found[0], 1.0);
            errors[2] = errors[2].max(quotient);
        }
    }
    errors
}
