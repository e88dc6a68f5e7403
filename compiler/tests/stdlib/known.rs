//! One BSDF of the library with fixed parameters, for tests against published formulas.

use super::text::Text;

/// A BSDF and the arguments it is called with.
pub struct Known {
    text: Text,
    name: String,
    args: Vec<Vec<f64>>,
}

impl Known {
    /// `std::bsdf::name` with all of its arguments, a bool as 0 or 1.
    pub fn new(name: &str, args: &[&[f64]]) -> Self {
        Self {
            text: Text::new(&format!(
                "use std::bsdf::{name};\nmaterial m {{ surface = {name}(); }}"
            )),
            name: name.to_owned(),
            args: args.iter().map(|a| a.to_vec()).collect(),
        }
    }

    fn call(&self, method: &str, rest: &[&[f64]]) -> Vec<f64> {
        let args = self.args.iter().map(Vec::as_slice);
        let all: Vec<&[f64]> = args.chain(rest.iter().copied()).collect();
        self.text
            .call::<f64>(&format!("{}_{method}", self.name), &all)
    }

    /// The value in the first channel.
    pub fn eval(&self, wo: [f64; 3], wi: [f64; 3]) -> f64 {
        self.call("eval", &[&wo, &wi])[0]
    }

    /// The density.
    pub fn pdf(&self, wo: [f64; 3], wi: [f64; 3]) -> f64 {
        self.call("pdf", &[&wo, &wi])[0]
    }

    /// The albedo in the first channel.
    pub fn albedo(&self, wo: [f64; 3]) -> f64 {
        self.call("albedo", &[&wo])[0]
    }

    /// The direction drawn.
    pub fn sample(&self, wo: [f64; 3], u: [f64; 3]) -> Vec<f64> {
        self.call("sample", &[&wo, &u])
    }
}

/// Fails unless `found` is `exact` to within `relative` of it.
pub fn assert_near(found: f64, exact: f64, relative: f64, what: &str) {
    let error = (found - exact).abs() / exact.abs().max(1e-9);
    assert!(error <= relative, "{what}: {found} instead of {exact}");
}
