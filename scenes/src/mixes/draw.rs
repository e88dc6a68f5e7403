//! Mixes by lot: as many as are asked for, which cover numbers of materials, shares, coherence and classes of cost.
//!
//! What must be covered is not left to chance: numbers of materials are strata of the range, hits and shares take turns.
//! Chance puts the three together, and picks materials.

use std::ops::RangeInclusive;

use super::mix::{Hits, MOST, Mix, Shares, kinds};
use crate::random::Random;

/// Materials whose kernels take long for the same reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Some ten operations and one or two lobes.
    Cheap,
    /// A pattern and a lobe: some hundred operations.
    Middling,
    /// Evaluations of noise, 1 to 16.
    Noise,
    /// Two to four lobes over each other, and next to no pattern.
    Lobes,
    /// Sines, powers and exponentials, 12 to 144.
    Functions,
    /// Integers that are stirred 16 to 192 times.
    Integers,
    /// Numbers that are alive at once, 8 to 64.
    Registers,
    /// Loops whose turns depend on the place.
    Loops,
}

impl Class {
    /// Every class.
    pub const ALL: [Class; 8] = [
        Class::Cheap,
        Class::Middling,
        Class::Noise,
        Class::Lobes,
        Class::Functions,
        Class::Integers,
        Class::Registers,
        Class::Loops,
    ];

    /// As pages, options and study files write it.
    pub fn name(self) -> &'static str {
        match self {
            Class::Cheap => "cheap",
            Class::Middling => "middling",
            Class::Noise => "noise",
            Class::Lobes => "lobes",
            Class::Functions => "functions",
            Class::Integers => "integers",
            Class::Registers => "registers",
            Class::Loops => "loops",
        }
    }

    /// A material of this class by lot.
    fn draw(self, lot: &mut Random) -> String {
        let number = |base: &str, low: f64, high: f64, lot: &mut Random| {
            // By its logarithm: twice as many are as likely among few as among many.
            let n = low * (high / low).powf(lot.unit());
            format!("{base}_{}", n.round() as usize)
        };
        match self {
            Class::Cheap => lot.pick(&["mtl", "dots", "weave"]).into(),
            Class::Middling => lot.pick(&kinds(64).iter().collect::<Vec<_>>()).clone(),
            Class::Noise if lot.chance(0.15) => "cells".into(),
            Class::Noise => number("fbm", 1.0, 16.0, lot),
            Class::Lobes => lot.pick(&["lacquer", "alloy", "velvet"]).into(),
            Class::Functions => number("spectral", 4.0, 48.0, lot),
            Class::Integers => number("hashes", 16.0, 192.0, lot),
            Class::Registers => number("wide", 8.0, 64.0, lot),
            Class::Loops => match lot.pick(&[0, 1, 2, 3]) {
                0 => number("julia", 40.0, 480.0, lot),
                1 => number("march", 24.0, 144.0, lot),
                2 => number("newton", 16.0, 96.0, lot),
                _ => number("collatz", 60.0, 360.0, lot),
            },
        }
    }
}

/// What mixes to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// How many.
    pub count: usize,
    /// Equal seeds give equal mixes.
    pub seed: u64,
    /// Numbers of materials, at most [`MOST`].
    pub materials: RangeInclusive<usize>,
    /// What neighbouring paths may hit.
    pub hits: Vec<Hits>,
    /// How the surface may be shared out.
    pub shares: Vec<Shares>,
    /// The classes that materials are of.
    pub classes: Vec<Class>,
}

impl Default for Draw {
    /// 40 mixes of 1 to 16 materials of all classes.
    fn default() -> Self {
        Self {
            count: 40,
            seed: 0,
            materials: 1..=16,
            hits: Hits::ALL.into(),
            shares: Shares::ALL.into(),
            classes: Class::ALL.into(),
        }
    }
}

/// The mixes of a draw; none of an empty list or range.
pub fn draw(of: &Draw) -> Vec<Mix> {
    if of.hits.is_empty() || of.shares.is_empty() || of.classes.is_empty() {
        return Vec::new();
    }
    let mut lot = Random::new(of.seed);
    let mut sizes = sizes(of);
    for i in (1..sizes.len()).rev() {
        sizes.swap(i, (lot.unit() * (i + 1) as f64) as usize);
    }
    let mix = |(i, size): (usize, usize)| {
        let classes = some(&of.classes, &mut lot);
        let materials = materials(size, &classes, &of.classes, &mut lot);
        let names: Vec<&str> = classes.iter().map(|class| class.name()).collect();
        Mix {
            name: format!("mix_{}_{:02}", of.seed, i + 1),
            about: format!("{} of {}", materials.len(), names.join(", ")),
            hits: of.hits[i % of.hits.len()],
            shares: of.shares[i / of.hits.len() % of.shares.len()],
            materials,
        }
    };
    sizes.into_iter().enumerate().map(mix).collect()
}

/// Numbers of materials, ascending: all of the range if there are mixes enough, and small ones more often, since
/// every partition of theirs can be measured.
fn sizes(of: &Draw) -> Vec<usize> {
    let (low, high) = (*of.materials.start(), *of.materials.end());
    let (low, high) = (low.clamp(1, MOST), high.clamp(1, MOST));
    if low > high {
        return Vec::new();
    }
    let wide = (high - low + 1) as f64;
    let size = |i: usize| {
        let t = (i as f64 + 0.5) / of.count as f64;
        (low + (wide * t.powf(1.4)) as usize).min(high)
    };
    (0..of.count).map(size).collect()
}

/// One or more of the classes.
fn some(classes: &[Class], lot: &mut Random) -> Vec<Class> {
    let count = 1 + (lot.unit() * classes.len().min(4) as f64) as usize;
    let mut rest = classes.to_vec();
    let taken = |_| rest.swap_remove((lot.unit() * rest.len() as f64) as usize);
    let mut out: Vec<Class> = (0..count.min(classes.len())).map(taken).collect();
    out.sort_by_key(|class| Class::ALL.iter().position(|c| c == class));
    out
}

/// So many materials, each once: of the `classes`, and of `all` where those have no more.
fn materials(size: usize, classes: &[Class], all: &[Class], lot: &mut Random) -> Vec<String> {
    const TRIES: usize = 64;
    let mut out: Vec<String> = Vec::new();
    for place in 0..size {
        let tries = (0..3 * TRIES).find_map(|turn| {
            let class = match turn {
                // Every class has a material before one has two.
                0 => classes[place % classes.len()],
                1..TRIES => lot.pick(classes),
                _ => lot.pick(all),
            };
            let material = class.draw(lot);
            (!out.contains(&material)).then_some(material)
        });
        out.extend(tries);
    }
    out
}
