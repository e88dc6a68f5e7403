//! The parameter table: where the values lie that instances of one material may differ in.
//!
//! A value is what [`ExprKind::TableValue`](crate::ir::ExprKind::TableValue) names in a compiled material:
//! not a parameter as the author declared it, but what is left once all work that depends on
//! parameters only has moved to the host (pass `hoist`). Values are packed into rows of four
//! words; the rows of an instance lie together.

use crate::ir::{Const, Type};

/// Words of a row.
const ROW: usize = 4;

/// Where a value lies in the rows of its instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Row, from the first of the instance.
    pub row: u32,
    /// First word in the row.
    pub word: u8,
    /// Type of the value.
    pub ty: Type,
}

/// The layout of one material's values.
#[derive(Clone, Debug, Default)]
pub struct TableLayout {
    /// The place of each value, by index.
    pub places: Vec<Place>,
    /// Rows of an instance.
    pub rows: u32,
}

impl TableLayout {
    /// Packs values of the given types: wide ones first, narrow ones into the gaps they leave.
    pub fn new(types: &[Type]) -> Self {
        let mut order: Vec<usize> = (0..types.len()).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(words(types[i])));
        let unplaced = |ty| Place {
            row: 0,
            word: 0,
            ty,
        };
        let mut places: Vec<Place> = types.iter().map(|&ty| unplaced(ty)).collect();
        let mut used: Vec<usize> = Vec::new();
        for i in order {
            let wanted = words(types[i]);
            let row = used.iter().position(|&n| n + wanted <= ROW);
            let row = row.unwrap_or_else(|| {
                used.push(0);
                used.len() - 1
            });
            (places[i].row, places[i].word) = (row as u32, used[row] as u8);
            used[row] += wanted;
        }
        Self {
            places,
            rows: used.len() as u32,
        }
    }

    /// The words of an instance whose values are `values`: bits of floats and ints, 0 or 1 of bools.
    pub fn pack(&self, values: &[Const]) -> Vec<u32> {
        let mut out = vec![0; self.rows as usize * ROW];
        for (place, value) in self.places.iter().zip(values) {
            let first = place.row as usize * ROW + usize::from(place.word);
            for (slot, word) in out[first..].iter_mut().zip(bits(value)) {
                *slot = word;
            }
        }
        out
    }
}

/// Words that a value of a type takes.
fn words(ty: Type) -> usize {
    ty.width().unwrap_or(1)
}

fn bits(value: &Const) -> Vec<u32> {
    match value {
        Const::Bool(b) => vec![u32::from(*b)],
        Const::Int(i) => vec![*i as u32],
        Const::Float(v) => v.iter().map(|&x| finite(x).to_bits()).collect(),
    }
}

/// The nearest finite f32: kernels may assume that there is nothing else.
fn finite(x: f64) -> f32 {
    let x = x as f32;
    if x.is_finite() {
        x
    } else {
        f32::MAX.copysign(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_share_rows_and_never_words() {
        use Type::*;
        let types = [Float, Vec3, Int, Vec2, Vec4, Vec3, Bool, Vec2, Float];
        let layout = TableLayout::new(&types);
        let mut taken = std::collections::BTreeSet::new();
        for place in &layout.places {
            let width = words(place.ty) as u32;
            assert!(
                u32::from(place.word) + width <= 4,
                "{place:?} leaves its row"
            );
            for word in 0..width {
                assert!(taken.insert(4 * place.row + u32::from(place.word) + word));
            }
        }
        // 18 words fit five rows.
        assert_eq!(layout.rows, 5);
    }

    #[test]
    fn words_are_the_bits_of_the_values() {
        let layout = TableLayout::new(&[Type::Float, Type::Vec3, Type::Int]);
        let values = [
            Const::Float(vec![1e300]),
            Const::Float(vec![0.25, 1e-40, -2.0]),
            Const::Int(-1),
        ];
        let words = layout.pack(&values);
        let expected = [0.25f32, 1e-40, -2.0, f32::MAX].map(f32::to_bits);
        assert_eq!(words[..4], expected);
        assert_eq!(words[4], u32::MAX);
    }
}
