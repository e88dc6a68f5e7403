//! Where a path in single precision parts from the same path in double precision.
//!
//! Rounding changes every number a little. It matters where it decides something: another triangle,
//! another end, or a number that differs by more than a thousandth.

use serde::Serialize;

use crate::path::{Path, Vertex};

/// Relative differences above this are no mere rounding.
const TOLERANCE: f64 = 1e-3;

/// The first thing that differs between two paths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parting {
    /// At which vertex, counted from 1.
    pub vertex: u32,
    /// What differs, as the text of a replay names it.
    pub what: &'static str,
    /// By how much, of the larger; infinite where that makes no sense.
    #[serde(skip_serializing_if = "is_infinite")]
    pub relative: f64,
}

fn is_infinite(x: &f64) -> bool {
    !x.is_finite()
}

/// Where two replays of the same sample part; `None` if they agree but for rounding.
pub fn parting(a: &Path, b: &Path) -> Option<Parting> {
    for (v, w) in a.vertices.iter().zip(&b.vertices) {
        let differs = |&(_, relative): &(&str, f64)| relative > TOLERANCE;
        if let Some((what, relative)) = differences(v, w).into_iter().find(differs) {
            let vertex = v.number;
            return Some(Parting {
                vertex,
                what,
                relative,
            });
        }
    }
    let last = a.vertices.len().min(b.vertices.len()) as u32;
    let by = |vertex, what, relative| {
        Some(Parting {
            vertex,
            what,
            relative,
        })
    };
    if a.vertices.len() != b.vertices.len() || a.end != b.end {
        return by(last, "end", f64::INFINITY);
    }
    match relative(&a.radiance, &b.radiance) {
        small if small <= TOLERANCE => None,
        large => by(last, "radiance", large),
    }
}

/// Every number of two vertices: what it is, and the relative difference.
fn differences(v: &Vertex, w: &Vertex) -> Vec<(&'static str, f64)> {
    let mut out = vec![("hit", other(v.hit.is_some() != w.hit.is_some()))];
    if let (Some(a), Some(b)) = (&v.hit, &w.hit) {
        out.push((
            "hit",
            other(a.primitive != b.primitive || a.front != b.front),
        ));
        out.push(("distance", relative(&[a.distance], &[b.distance])));
    }
    out.push(("media", other(v.media != w.media)));
    out.push(("arriving", relative(&v.arriving, &w.arriving)));
    let added = |v: &Vertex| v.emission.as_ref().map_or([0.0; 3], |e| e.added);
    out.push(("emission", relative(&added(v), &added(w))));
    if let (Some(a), Some(b)) = (&v.light, &w.light) {
        out.push(("light", other(a.kind != b.kind)));
        out.push(("light", relative(&a.wi, &b.wi)));
        out.push(("light", relative(&a.radiance, &b.radiance)));
        out.push(("reflected", relative(&a.throughput, &b.throughput)));
        out.push(("shadow ray", other(a.blocked != b.blocked)));
        out.push(("light added", relative(&a.added, &b.added)));
    }
    out.push(("light", other(v.light.is_some() != w.light.is_some())));
    let survived = |v: &Vertex| v.roulette.as_ref().map(|r| r.survived);
    out.push(("roulette", other(survived(v) != survived(w))));
    if let (Some(a), Some(b)) = (&v.scattering, &w.scattering) {
        out.push(("wi", relative(&a.wi, &b.wi)));
        out.push(("pdf", relative(&[a.pdf], &[b.pdf])));
        out.push(("weight", relative(&a.weight, &b.weight)));
    }
    out.push((
        "sampled",
        other(v.scattering.is_some() != w.scattering.is_some()),
    ));
    out
}

fn other(differs: bool) -> f64 {
    if differs { f64::INFINITY } else { 0.0 }
}

/// The largest difference of two vectors, of their largest number. That of numbers which are none is
/// infinite, unless both are.
fn relative(a: &[f64], b: &[f64]) -> f64 {
    let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
    if !finite(a) || !finite(b) {
        return other(finite(a) != finite(b));
    }
    let largest = a.iter().chain(b).fold(0f64, |m, x| m.max(x.abs()));
    let difference = a.iter().zip(b).fold(0f64, |m, (x, y)| m.max((x - y).abs()));
    if largest > 1e-30 {
        difference / largest
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_of_the_largest_number() {
        assert_eq!(relative(&[1.0, 0.0], &[1.0, 0.5]), 0.5);
        assert_eq!(relative(&[0.0; 3], &[0.0; 3]), 0.0);
        assert_eq!(relative(&[f64::NAN], &[1.0]), f64::INFINITY);
        assert_eq!(relative(&[f64::NAN], &[f64::INFINITY]), 0.0);
    }
}
