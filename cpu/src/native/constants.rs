//! Tables of constants that code indexes: they live as long as the code does.

use std::sync::{Mutex, PoisonError};

use crate::code::Scalar;

/// The tables of a kernel.
#[derive(Debug, Default)]
pub(super) struct Constants {
    tables: Mutex<Vec<Box<[u32]>>>,
}

impl Constants {
    /// The address of a table of cells, which stays where it is.
    pub(super) fn table(&self, cells: &[Scalar]) -> usize {
        let word = |cell: &Scalar| match *cell {
            Scalar::Float(x) => x.to_bits(),
            Scalar::Word(x) => x,
            Scalar::Bool(x) => x.into(),
        };
        let words: Box<[u32]> = cells.iter().map(word).collect();
        let mut tables = self.tables.lock().unwrap_or_else(PoisonError::into_inner);
        let known = tables.iter().find(|table| **table == words);
        if let Some(known) = known {
            return known.as_ptr() as usize;
        }
        let address = words.as_ptr() as usize;
        tables.push(words);
        address
    }
}
