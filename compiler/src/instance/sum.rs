//! What a number is made of: a sum of products of what is not known before rendering.
//!
//! `0.2 + 0.5 * image_data(map, uv).x` is the sum of 0.2 and 0.5 times one texel. What no such sum says, such as a
//! sine of a position, has a reason instead.

use std::collections::BTreeMap;
use std::rc::Rc;

use crate::source::Span;

/// Most products of a sum, and most factors of a product; what is larger is no argument that another format has.
const MOST_TERMS: usize = 32;
const MOST_FACTORS: usize = 4;

/// A number that is known only where a surface is hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Atom {
    /// A component of a field of the surface point.
    Input(u32, u8),
    /// A channel of a lookup: 0 to 3 as data, from [`COLOR`] on as a color.
    Texel(u32, u8),
    /// A component of the normal that a normal map gives.
    Bent(u32, u8),
}

/// The channel of a texel from which on it is read as a color.
pub(super) const COLOR: u8 = 4;

/// Why a number is no sum.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Why {
    /// Where it is computed.
    pub span: Span,
    /// What it depends on, in words.
    pub what: Rc<str>,
}

/// A sum of products.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sum(BTreeMap<Vec<Atom>, f64>);

/// A number, or why it is no sum.
pub(super) type Part = Result<Sum, Why>;

impl Sum {
    pub fn constant(value: f64) -> Self {
        Self::term(Vec::new(), value)
    }

    pub fn atom(atom: Atom) -> Self {
        Self::term(vec![atom], 1.0)
    }

    fn term(factors: Vec<Atom>, coefficient: f64) -> Self {
        let mut sum = Self::default();
        sum.push(factors, coefficient);
        sum
    }

    fn push(&mut self, factors: Vec<Atom>, coefficient: f64) {
        let own = self.0.entry(factors.clone()).or_default();
        *own = finite(*own + coefficient);
        if *own == 0.0 {
            self.0.remove(&factors);
        }
    }

    /// Its value, if it is a constant.
    pub fn known(&self) -> Option<f64> {
        self.0
            .keys()
            .all(Vec::is_empty)
            .then(|| self.constant_term())
    }

    /// What it is where all else is zero.
    pub fn constant_term(&self) -> f64 {
        self.0.get(&Vec::new()).copied().unwrap_or(0.0)
    }

    /// Its products, without the constant.
    pub fn products(&self) -> impl Iterator<Item = (&[Atom], f64)> {
        let varying = self.0.iter().filter(|(factors, _)| !factors.is_empty());
        varying.map(|(factors, coefficient)| (factors.as_slice(), *coefficient))
    }

    pub fn plus(&self, other: &Self) -> Option<Self> {
        let mut sum = self.clone();
        for (factors, coefficient) in &other.0 {
            sum.push(factors.clone(), *coefficient);
        }
        sum.small()
    }

    pub fn times(&self, other: &Self) -> Option<Self> {
        let mut product = Self::default();
        for (a, x) in &self.0 {
            for (b, y) in &other.0 {
                let mut factors: Vec<Atom> = a.iter().chain(b).copied().collect();
                factors.sort_unstable();
                product.push(factors, x * y);
            }
        }
        product.small()
    }

    /// Each coefficient as `f` makes it.
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        let mut sum = Self::default();
        for (factors, coefficient) in &self.0 {
            sum.push(factors.clone(), f(*coefficient));
        }
        sum
    }

    fn small(self) -> Option<Self> {
        let is_small = self.0.len() <= MOST_TERMS && self.0.keys().all(|f| f.len() <= MOST_FACTORS);
        is_small.then_some(self)
    }

    /// Numbers that it is never below or above, where texels are from 0 to 1; none if it depends on other things.
    pub fn range(&self) -> Option<(f64, f64)> {
        let is_texel = |atom: &Atom| matches!(atom, Atom::Texel(..));
        let only_texels = self.0.keys().flatten().all(is_texel);
        only_texels.then(|| {
            let constant = self.constant_term();
            let part = |limit: fn(f64, f64) -> f64| {
                let coefficients = self.products().map(|(_, c)| limit(c, 0.0));
                constant + coefficients.sum::<f64>()
            };
            (part(f64::min), part(f64::max))
        })
    }
}

/// The nearest number of single precision's range, as constants of the language are held to it.
fn finite(value: f64) -> f64 {
    const MAX: f64 = f32::MAX as f64;
    if value.is_nan() {
        0.0
    } else {
        value.clamp(-MAX, MAX)
    }
}
