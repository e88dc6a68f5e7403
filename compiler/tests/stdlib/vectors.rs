//! A little vector algebra, apart from the library that it tests.

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

pub fn length(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

pub fn reflect(wo: &[f64], n: &[f64]) -> Vec<f64> {
    let twice = 2.0 * dot(wo, n);
    wo.iter().zip(n).map(|(w, n)| twice * n - w).collect()
}
