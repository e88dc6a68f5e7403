//! Points of the Sobol sequence, computed on the host, and the tables that kernels look them up in.
//!
//! Sources: Sobol 1967; Joe and Kuo, "Constructing Sobol Sequences with Better Two-Dimensional
//! Projections", SIAM J. Sci. Comput. 30(5), 2008, whose polynomials and initial direction numbers
//! (`new-joe-kuo-6.21201`) are used for the first 32 dimensions.

/// Dimensions that direction numbers are at hand for.
pub(super) const DIMENSIONS: usize = 32;

/// Bits of a sample's index that one table resolves, and how many tables make an index.
const CHUNK_BITS: u32 = 8;
const CHUNKS: u32 = 32 / CHUNK_BITS;

/// For each dimension after the first: the coefficients of its primitive polynomial between the
/// first and the last, as bits, and its initial direction numbers, as many as the degree.
const JOE_KUO: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, &[1, 1, 3, 13, 7, 35, 63]),
    (8, &[1, 3, 5, 9, 1, 25, 53]),
    (14, &[1, 3, 1, 13, 9, 35, 107]),
    (19, &[1, 3, 1, 5, 27, 61, 31]),
    (21, &[1, 1, 5, 11, 19, 41, 61]),
    (28, &[1, 3, 5, 3, 3, 13, 69]),
    (31, &[1, 1, 7, 13, 1, 19, 1]),
    (32, &[1, 3, 7, 5, 13, 19, 59]),
    (37, &[1, 1, 3, 9, 25, 29, 41]),
    (41, &[1, 3, 5, 13, 23, 1, 55]),
    (42, &[1, 3, 7, 3, 13, 59, 17]),
];

/// What each bit of an index adds (by XOR) to the point in one dimension, lowest bit first; a
/// point is a fraction of 2^32.
fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0; 32];
    let Some((coefficients, initial)) = dimension.checked_sub(1).and_then(|i| JOE_KUO.get(i))
    else {
        // Dimension 0 is van der Corput's sequence: the index, its bits reversed.
        return std::array::from_fn(|bit| 1 << (31 - bit));
    };
    let degree = initial.len();
    for bit in 0..32 {
        v[bit] = match initial.get(bit) {
            Some(m) => m << (31 - bit),
            None => {
                let first = v[bit - degree] ^ (v[bit - degree] >> degree);
                let used = (1..degree).filter(|k| coefficients >> (degree - 1 - k) & 1 == 1);
                used.fold(first, |sum, k| sum ^ v[bit - k])
            }
        };
    }
    v
}

/// The point with an index in one dimension. The order is that of the index itself, in which
/// every aligned block of 2^k points is stratified, not that of its Gray code.
fn point(directions: &[u32; 32], index: u32) -> u32 {
    let used = (0..32).filter(|bit| index >> bit & 1 == 1);
    used.fold(0, |sum, bit| sum ^ directions[bit])
}

/// Tables of points in four dimensions, 0 where there is none. A point is a linear function of
/// its index over GF(2), so the point of any index is the XOR of the points of its bytes: entry
/// `256 k + b` is the point of the index `b << 8k`. `word` maps an index and a point in one
/// dimension to what the kernel wants to find.
pub(super) fn tables(
    dimensions: [Option<usize>; 4],
    word: impl Fn(&dyn Fn(u32) -> u32, u32) -> u32,
) -> Vec<[u32; 4]> {
    let directions = dimensions.map(|d| d.map_or([0; 32], directions));
    let entry = |at: u32| {
        let index = (at & 0xff) << (CHUNK_BITS * (at >> CHUNK_BITS));
        directions.map(|d| word(&|i| point(&d, i), index))
    };
    (0..CHUNKS << CHUNK_BITS).map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(dimension: usize, count: u32) -> Vec<u32> {
        let directions = directions(dimension);
        (0..count).map(|i| point(&directions, i)).collect()
    }

    /// The first points that Joe and Kuo's program prints in 10 dimensions, which go in the order
    /// of the Gray code; and one point of all 32 dimensions, from an independent implementation.
    #[test]
    fn points_are_those_of_joe_and_kuo() {
        let expected = [
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25, 0.25, 0.75],
            [0.25, 0.75, 0.75, 0.75, 0.25],
            [0.375, 0.375, 0.625, 0.875, 0.375],
            [0.875, 0.875, 0.125, 0.375, 0.875],
            [0.625, 0.125, 0.875, 0.625, 0.625],
            [0.125, 0.625, 0.375, 0.125, 0.125],
            [0.1875, 0.3125, 0.9375, 0.4375, 0.5625],
            [0.6875, 0.8125, 0.4375, 0.9375, 0.0625],
        ];
        let gray = |i: u32| i ^ (i >> 1);
        for dimension in 0..5 {
            let directions = directions(dimension);
            for (i, row) in (0..).zip(expected) {
                let value = f64::from(point(&directions, gray(i))) / f64::from(1u32 << 31) / 2.0;
                assert_eq!(value, row[dimension], "point {i}, dimension {dimension}");
            }
        }
        let thousandth = [
            943718400, 415236096, 2227175424, 2906652672, 1203765248, 3896508416, 197132288,
            3862953984, 2151677952, 297795584, 364904448, 1094713344, 692060160, 1648361472,
            616562688, 1589641216, 3091202048, 1480589312, 4257218560, 3116367872, 2243952640,
            2361393152, 4081057792, 2319450112, 2503999488, 3896508416, 171966464, 4206886912,
            255852544, 1463812096, 633339904, 624951296,
        ];
        for (dimension, expected) in thousandth.into_iter().enumerate() {
            let found = point(&directions(dimension), gray(1000));
            assert_eq!(found, expected, "dimension {dimension}");
        }
    }

    #[test]
    fn every_aligned_block_has_one_point_in_each_stratum() {
        for dimension in 0..DIMENSIONS {
            let points = points(dimension, 1 << 12);
            for k in 0..=12 {
                for block in points.chunks(1 << k) {
                    let mut strata: Vec<u64> =
                        block.iter().map(|p| u64::from(*p) >> (32 - k)).collect();
                    strata.sort_unstable();
                    assert!(strata.into_iter().eq(0..1 << k), "{dimension}: 2^{k}");
                }
            }
        }
    }

    /// The first two dimensions are a (0,2)-sequence: 2^(a+b) points have one in each of
    /// 2^a x 2^b boxes, of whatever shape.
    #[test]
    fn the_first_pair_is_stratified_in_boxes_of_every_shape() {
        let (x, y) = (points(0, 1 << 10), points(1, 1 << 10));
        for k in 0..=10 {
            for a in 0..=k {
                for (xs, ys) in x.chunks(1 << k).zip(y.chunks(1 << k)) {
                    let cell = |(x, y): (&u32, &u32)| {
                        let (x, y) = (u64::from(*x), u64::from(*y));
                        (x >> (32 - a)) << (k - a) | y >> (32 - (k - a))
                    };
                    let mut cells: Vec<u64> = xs.iter().zip(ys).map(cell).collect();
                    cells.sort_unstable();
                    assert!(cells.into_iter().eq(0..1 << k), "2^{a} x 2^{}", k - a);
                }
            }
        }
    }

    #[test]
    fn tables_hold_the_point_of_every_index() {
        let table = tables([Some(1), Some(0), None, Some(31)], |point, i| point(i));
        for index in [0, 1, 255, 256, 70_000, 0x0102_0304, u32::MAX] {
            let entry = |k: u32| table[(256 * k + (index >> (8 * k) & 0xff)) as usize];
            let sum = |lane: usize| (0..4).fold(0, |sum, k| sum ^ entry(k)[lane]);
            let expected = [1, 0, 31].map(|d| point(&directions(d), index));
            assert_eq!([sum(0), sum(1), sum(3)], expected, "{index}");
            assert_eq!(sum(2), 0);
        }
    }
}
