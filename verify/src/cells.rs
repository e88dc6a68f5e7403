//! A partition of the sphere that follows a density, and integrals over its cells.
//!
//! Cells are rectangles in the cosine `z` and the azimuth, whose product is solid angle. They
//! are halved until none holds many samples, so sharp lobes get fine cells and need no special
//! treatment.

use std::f64::consts::TAU;

use crate::effort::Effort;
use crate::lanes::Stuck;
use crate::statistics::direction;

/// A rectangle in z and azimuth.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    z: [f64; 2],
    phi: [f64; 2],
}

/// What is integrated: a density, and a value in three channels.
pub type Measures = [f64; 4];

/// Density and value toward directions.
pub type Measure<'a> = dyn Fn(&[[f64; 3]]) -> Result<Vec<Measures>, Stuck> + 'a;

/// Rows and columns of a hemisphere before samples refine it.
const ROWS: usize = 6;
const COLUMNS: usize = 12;

/// Relative error at which the integral over a cell is good, and the absolute one.
pub const RELATIVE: f64 = 3e-4;
const ABSOLUTE: f64 = 3e-7;

/// Samples from which a cell is cut where they gather, before it is integrated: where as many as
/// are in a window keep to less than this share of what they would take if they lay evenly.
const UNEVEN: usize = 8;
const WINDOW: usize = 6;
const DENSE: f64 = 0.2;

/// Samples beyond which a cell is cut before it is integrated in any case.
fn some(effort: Effort) -> usize {
    effort.of(64, 24)
}

/// Samples below which a cell is left as it is.
const FEW: usize = 4;

/// Least width of a cell, well above the rounding of cosines near 1.
const NARROWEST: f64 = 1e-12;

/// Halvings of a cell in each direction, at most.
const DEEPEST: usize = 14;

/// An integral of the density explains the samples of a cell if it is at least this share of theirs.
/// Below, the few points of the rule have missed where the density is: the tails of a lobe that is
/// next to a direction are in cells far wider than the tails. One sample alone says little.
const EXPLAINED: f64 = 0.2;
const SAYS_LITTLE: usize = 1;

/// Nodes and weights of Gauss and Legendre's rule with four points on [0, 1].
const NODES: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

impl Cell {
    fn width(&self) -> f64 {
        self.phi[1] - self.phi[0]
    }

    fn area(&self) -> f64 {
        (self.z[1] - self.z[0]) * self.width()
    }

    /// Is it longer from the pole than around it?
    fn is_tall(&self) -> bool {
        let angle = |z: f64| z.clamp(-1.0, 1.0).acos();
        let [low, high] = self.z.map(angle);
        let around = self.width() * (0.5 * (low + high)).sin();
        (low - high).abs() > around
    }

    fn halves(self, tall: bool, cut: f64) -> [Cell; 2] {
        if tall {
            [
                Cell {
                    z: [self.z[0], cut],
                    ..self
                },
                Cell {
                    z: [cut, self.z[1]],
                    ..self
                },
            ]
        } else {
            [
                Cell {
                    phi: [self.phi[0], cut],
                    ..self
                },
                Cell {
                    phi: [cut, self.phi[1]],
                    ..self
                },
            ]
        }
    }

    /// Is a place in it, or on its edges?
    fn holds(&self, [z, phi]: &[f64; 2]) -> bool {
        let in_range = |r: [f64; 2], x: f64| r[0] <= x && x <= r[1];
        in_range(self.z, *z) && in_range(self.phi, *phi)
    }

    fn quarters(self) -> [Cell; 4] {
        let middle = |r: [f64; 2]| 0.5 * (r[0] + r[1]);
        let [a, b] = self.halves(true, middle(self.z));
        let [[c, d], [e, f]] = [a, b].map(|h| h.halves(false, middle(self.phi)));
        [c, d, e, f]
    }

    fn points(&self) -> impl Iterator<Item = [f64; 3]> + use<> {
        let (z, phi) = (self.z, self.phi);
        NODES.into_iter().flat_map(move |(s, _)| {
            NODES.into_iter().map(move |(t, _)| {
                direction(z[0] + s * (z[1] - z[0]), phi[0] + t * (phi[1] - phi[0]))
            })
        })
    }
}

/// Cosine and azimuth of a direction, the latter in [0, 2 pi).
fn place(w: &[f64; 3]) -> [f64; 2] {
    let phi = w[1].atan2(w[0]).rem_euclid(TAU);
    // The remainder of next to nothing below 0 rounds to all of the turn.
    [w[2].clamp(-1.0, 1.0), if phi < TAU { phi } else { 0.0 }]
}

/// Cells, and what each is put together of for integration: finer where a sharp lobe lies in a
/// corner of a cell.
pub struct Partition {
    /// The cells.
    pub cells: Vec<Cell>,
    parts: Vec<Part>,
    /// How many samples made it.
    samples: usize,
}

/// A part of cell number `of`, with the places of the samples in it.
#[derive(Clone)]
struct Part {
    of: usize,
    cell: Cell,
    inside: Vec<[f64; 2]>,
}

impl Part {
    fn quarters(self) -> [Part; 4] {
        let mut inside = self.inside;
        self.cell.quarters().map(|cell| {
            let (here, rest) = inside.iter().partition(|p| cell.holds(p));
            inside = rest;
            Part {
                of: self.of,
                cell,
                inside: here,
            }
        })
    }
}

/// Cells over the whole sphere, none with more than `most` of the `samples`; halves of the
/// sphere are never in one cell.
pub fn partition(samples: &[[f64; 3]], most: usize, effort: Effort) -> Partition {
    let mut open: Vec<(Cell, Vec<[f64; 2]>)> = Vec::new();
    for row in 0..2 * ROWS {
        for column in 0..COLUMNS {
            let z = [row, row + 1].map(|r| r as f64 / ROWS as f64 - 1.0);
            let phi = [column, column + 1].map(|c| c as f64 / COLUMNS as f64 * TAU);
            open.push((Cell { z, phi }, Vec::new()));
        }
    }
    for [z, phi] in samples.iter().map(place) {
        let row = (((z + 1.0) * ROWS as f64) as usize).min(2 * ROWS - 1);
        let column = ((phi / TAU * COLUMNS as f64) as usize).min(COLUMNS - 1);
        open[row * COLUMNS + column].1.push([z, phi]);
    }
    let done = divided(open, &|range, inside| halving(range, inside, most));
    let mut parts = Vec::new();
    for (of, (cell, inside)) in done.iter().enumerate() {
        let finer = divided(vec![(*cell, inside.clone())], &|range, inside| {
            gathered(range, inside, some(effort))
        });
        let finer = finer.into_iter();
        parts.extend(finer.map(|(cell, inside)| Part { of, cell, inside }));
    }
    Partition {
        cells: done.into_iter().map(|(cell, _)| cell).collect(),
        parts,
        samples: samples.len(),
    }
}

/// A cell with the places of the samples in it.
type Filled = (Cell, Vec<[f64; 2]>);

/// Where to cut a side of a cell, by the sorted coordinates of its samples along it.
type Rule<'a> = dyn Fn([f64; 2], &[f64]) -> Option<f64> + 'a;

/// Cuts cells until the rule leaves them all.
fn divided(mut open: Vec<Filled>, rule: &Rule<'_>) -> Vec<Filled> {
    let mut done = Vec::new();
    while let Some((cell, inside)) = open.pop() {
        let Some((tall, cut)) = cut(&cell, &inside, rule) else {
            done.push((cell, inside));
            continue;
        };
        let axis = usize::from(!tall);
        let (below, above) = inside.iter().partition(|p| p[axis] < cut);
        let [a, b] = cell.halves(tall, cut);
        open.extend([(a, below), (b, above)]);
    }
    done
}

/// Halves a cell of more than `most` samples, and cuts off what is empty.
fn halving(range: [f64; 2], inside: &[f64], most: usize) -> Option<f64> {
    match inside {
        few if few.len() < FEW => None,
        many if many.len() > most => Some(many[many.len() / 2]),
        [first, .., last] => flank(range, *first, *last),
        _ => None,
    }
}

/// Cuts cells until samples are few and lie evenly: at the edge of where they gather, or in half.
fn gathered(range: [f64; 2], inside: &[f64], some: usize) -> Option<f64> {
    let count = inside.len();
    if count < UNEVEN {
        return halving(range, inside, UNEVEN);
    }
    let width = |w: &[f64]| w[WINDOW - 1] - w[0];
    let dense = inside
        .windows(WINDOW)
        .min_by(|a, b| width(a).total_cmp(&width(b)))?;
    let even = (range[1] - range[0]) * WINDOW as f64 / count as f64;
    if width(dense) < DENSE * even {
        // The edge from which more of the cell remains.
        let below = dense[0] - range[0] > range[1] - dense[WINDOW - 1];
        return Some(if below { dense[0] } else { dense[WINDOW - 1] });
    }
    (count > some).then(|| inside[count / 2])
}

/// Along which side to cut a cell, and where; nothing for a cell that is fine.
fn cut(cell: &Cell, inside: &[[f64; 2]], rule: &Rule<'_>) -> Option<(bool, f64)> {
    let tall = cell.is_tall();
    for tall in [tall, !tall] {
        let axis = usize::from(!tall);
        let range = if tall { cell.z } else { cell.phi };
        let mut along: Vec<f64> = inside.iter().map(|p| p[axis]).collect();
        along.sort_unstable_by(f64::total_cmp);
        let cut = rule(range, &along);
        let fits = |c: &f64| range[0] + NARROWEST < *c && *c < range[1] - NARROWEST;
        if let Some(cut) = cut.filter(fits) {
            return Some((tall, cut));
        }
    }
    None
}

/// Where to cut a cell whose samples keep to a small part of it: half of what is empty goes. Cells
/// become the finer the nearer to the samples, so no flank of a lobe hides in a corner.
fn flank(range: [f64; 2], first: f64, last: f64) -> Option<f64> {
    let margin = 2.0 * (last - first);
    let (below, above) = (first - range[0], range[1] - last);
    if below > margin {
        Some(first - 0.5 * below)
    } else {
        (above > margin).then_some(last + 0.5 * above)
    }
}

/// How many of `samples` fall into each cell.
pub fn counts(cells: &[Cell], samples: &[[f64; 3]]) -> Vec<usize> {
    let mut found = vec![0; cells.len()];
    // Between two bounds of z, the cells lie beside each other around the pole.
    let mut bounds: Vec<f64> = cells.iter().flat_map(|c| c.z).collect();
    bounds.sort_unstable_by(f64::total_cmp);
    bounds.dedup();
    let strip = |z: f64| {
        bounds
            .partition_point(|b| *b <= z)
            .clamp(1, bounds.len() - 1)
            - 1
    };
    let mut strips = vec![Vec::new(); bounds.len() - 1];
    for (i, cell) in cells.iter().enumerate() {
        let [low, high] = cell.z.map(|z| bounds.partition_point(|b| *b < z));
        strips[low..high].iter_mut().for_each(|s| s.push(i));
    }
    for strip in &mut strips {
        strip.sort_unstable_by(|&a, &b| cells[a].phi[0].total_cmp(&cells[b].phi[0]));
    }
    for [z, phi] in samples.iter().map(place) {
        let around = &strips[strip(z)];
        let next = around.partition_point(|&i| cells[i].phi[0] <= phi);
        let inside = |i: usize| {
            let c = &cells[i];
            let in_z = c.z[0] <= z && (z < c.z[1] || (z >= 1.0 && c.z[1] >= 1.0));
            in_z && c.phi[0] <= phi && phi < c.phi[1]
        };
        let cell = next
            .checked_sub(1)
            .map(|k| around[k])
            .filter(|&i| inside(i));
        // Cells cover the sphere: a direction in none is no direction.
        if let Some(cell) = cell {
            found[cell] += 1;
        }
    }
    found
}

/// Integrals over each cell. `measure` answers many directions at once; its density is the one that
/// the samples of the partition were drawn from, or above it.
///
/// # Errors
/// What `measure` fails with.
pub fn integrate(partition: &Partition, measure: &Measure<'_>) -> Result<Vec<Measures>, Stuck> {
    let mut totals = vec![[0.0; 4]; partition.cells.len()];
    let parts: Vec<Cell> = partition.parts.iter().map(|p| p.cell).collect();
    let mut open: Vec<(Part, Measures)> = partition
        .parts
        .iter()
        .cloned()
        .zip(rule(&parts, measure)?)
        .collect();
    let share = EXPLAINED / partition.samples.max(1) as f64;
    for depth in 0..=DEEPEST {
        let quarters: Vec<Cell> = open.iter().flat_map(|(p, _)| p.cell.quarters()).collect();
        let finer = rule(&quarters, measure)?;
        let mut next = Vec::new();
        for ((part, coarse), finer) in open.into_iter().zip(finer.chunks(4)) {
            let sum: Measures = std::array::from_fn(|c| finer.iter().map(|p| p[c]).sum());
            let samples = part.inside.len();
            let explained = samples <= SAYS_LITTLE || sum[0] >= share * samples as f64;
            let good =
                (0..4).all(|c| (sum[c] - coarse[c]).abs() <= RELATIVE * sum[c].abs() + ABSOLUTE);
            if (good && explained) || depth == DEEPEST {
                (0..4).for_each(|c| totals[part.of][c] += sum[c]);
            } else {
                next.extend(part.quarters().into_iter().zip(finer.iter().copied()));
            }
        }
        if next.is_empty() {
            break;
        }
        open = next;
    }
    Ok(totals)
}

/// The four-by-four rule over each cell.
fn rule(cells: &[Cell], measure: &Measure<'_>) -> Result<Vec<Measures>, Stuck> {
    let mut sums = Vec::with_capacity(cells.len());
    for chunk in cells.chunks(1024) {
        let points: Vec<[f64; 3]> = chunk.iter().flat_map(Cell::points).collect();
        let values = measure(&points)?;
        for (cell, values) in chunk.iter().zip(values.chunks(16)) {
            let weights = NODES
                .iter()
                .flat_map(|(_, s)| NODES.iter().map(move |(_, t)| s * t));
            let mut sum = [0.0; 4];
            for (w, v) in weights.zip(values) {
                (0..4).for_each(|c| sum[c] += w * v[c] * cell.area());
            }
            sums.push(sum);
        }
    }
    Ok(sums)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cover_the_sphere_once_and_integrate_it() {
        let mut n = crate::statistics::Numbers::new(3);
        let lobe: Vec<[f64; 3]> = (0..4000)
            .map(|_| direction(1.0 - 1e-4 * n.unit(), 6.0 * n.unit()))
            .collect();
        let partition = partition(&lobe, 50, Effort::Quick);
        let cells = &partition.cells;
        assert!(cells.len() > 100);
        for area in [
            cells.iter().map(Cell::area).sum::<f64>(),
            partition.parts.iter().map(|p| p.cell.area()).sum(),
        ] {
            assert!((area - 2.0 * TAU).abs() < 1e-9);
        }
        assert_eq!(counts(cells, &lobe).iter().sum::<usize>(), 4000);
        // Integrals of 1, cos on the upper side, z^2, and a sharp lobe of known integral.
        let sharp = |w: &[f64; 3]| (1e5 * (w[2] - 1.0)).exp();
        let value = |w: &[f64; 3]| [1.0, w[2].max(0.0), w[2] * w[2], sharp(w)];
        let sums =
            integrate(&partition, &|ws| Ok(ws.iter().map(value).collect())).expect("answers");
        let sum: Measures = std::array::from_fn(|c| sums.iter().map(|s| s[c]).sum());
        for (found, exact) in sum
            .iter()
            .zip([2.0 * TAU, 0.5 * TAU, 2.0 * TAU / 3.0, TAU * 1e-5])
        {
            assert!(
                (found / exact - 1.0).abs() < 1e-3,
                "{found} instead of {exact}"
            );
        }
    }
}
