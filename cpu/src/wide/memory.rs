//! The memory of a thread that runs wide code: addresses, constants, and cells of eight lanes.

use std::collections::HashMap;

use super::inst::Constant;

/// Bytes of a cell.
pub(super) const CELL: i32 = 32;

/// Cells through which functions of the host get arguments and give results.
const EXCHANGE: i32 = 64;

/// Where things lie, in bytes from the beginning.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    buffers: u32,
    hooks: u32,
    /// The first byte that is free.
    pub end: i32,
    pub constants: Vec<(Constant, i32)>,
    known: HashMap<Constant, i32>,
    exchange: i32,
    /// Tables that code indexes.
    pub tables: Vec<(Vec<u32>, i32)>,
}

impl Memory {
    pub(super) fn new(buffers: usize, hooks: usize) -> Self {
        let addresses = 8 * (1 + buffers + hooks) as i32;
        let exchange = (addresses + CELL - 1) / CELL * CELL;
        Self {
            buffers: buffers as u32,
            hooks: hooks as u32,
            end: exchange + EXCHANGE * CELL,
            constants: Vec::new(),
            known: HashMap::new(),
            exchange,
            tables: Vec::new(),
        }
    }

    /// Where a table of words lies.
    pub(super) fn table(&mut self, words: Vec<u32>) -> i32 {
        if let Some((_, at)) = self.tables.iter().find(|(known, _)| *known == words) {
            return *at;
        }
        let at = self.cells(words.len().div_ceil(8));
        self.tables.push((words, at));
        at
    }

    /// The address of the flag that ends all loops.
    pub(super) fn stop(&self) -> i32 {
        0
    }

    /// The address of a buffer.
    pub(super) fn buffer(&self, index: u32) -> i32 {
        8 * (1 + index) as i32
    }

    /// What a function of the host is given along.
    pub(super) fn data(&self, hook: u32) -> i32 {
        debug_assert!(hook < self.hooks.max(1));
        8 * (1 + self.buffers + hook) as i32
    }

    pub(super) fn exchange(&self) -> i32 {
        self.exchange
    }

    /// How many cells fit there.
    pub(super) fn exchange_cells(&self) -> usize {
        EXCHANGE as usize
    }

    /// A cell of its own.
    pub(super) fn cell(&mut self) -> i32 {
        self.cells(1)
    }

    pub(super) fn cells(&mut self, count: usize) -> i32 {
        let at = self.end;
        self.end += CELL * count as i32;
        at
    }

    /// The cell that holds a constant.
    pub(super) fn constant(&mut self, constant: Constant) -> i32 {
        if let Some(at) = self.known.get(&constant) {
            return *at;
        }
        let at = self.cell();
        self.known.insert(constant, at);
        self.constants.push((constant, at));
        at
    }
}
