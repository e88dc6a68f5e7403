//! Values of fields in a `.usdc` layer: what each would take in memory.

use super::{At, Checked, EXPANSION, INTEGERS, Layer, damaged};

/// Values within values.
const DEEPEST: usize = 16;

/// Bits of a value: an array, one in place of where it is, a compressed one.
const ARRAY: u64 = 1 << 63;
const INLINED: u64 = 1 << 62;
const COMPRESSED: u64 = 1 << 61;

/// Fewer elements than this are not compressed.
const LEAST_COMPRESSED: u64 = 4;

/// What a reference takes in memory.
const REFERENCE: u64 = 256;

/// The values of a layer.
pub(super) struct Values<'l> {
    layer: &'l Layer<'l>,
    /// Parts of values that may still be looked at, so that one part cannot be in many.
    parts: u64,
}

impl<'l> Values<'l> {
    pub(super) fn new(layer: &'l Layer<'l>) -> Self {
        Self {
            layer,
            parts: 1 << 20 | layer.bytes.len() as u64,
        }
    }

    /// Looks at the value of a field.
    pub(super) fn field(&mut self, rep: u64) -> Checked {
        let size = self.value(rep, 0)?;
        self.layer.afford(size, 1)
    }

    /// What a value takes in memory.
    fn value(&mut self, rep: u64, depth: usize) -> Checked<u64> {
        self.parts = self
            .parts
            .checked_sub(1)
            .ok_or_else(|| damaged("its values are in each other"))?;
        if depth > DEEPEST {
            return Err(damaged("its values nest too deeply"));
        }
        let position = rep & ((1 << 48) - 1);
        let kind = rep >> 48 & 0xff;
        let is_array = rep & ARRAY != 0;
        if rep & INLINED != 0 {
            return Ok(self.layer.longest_token + 64);
        }
        if let Some(size) = size(kind)
            && is_array
        {
            return self.array(position, kind, size, rep & COMPRESSED != 0);
        }
        let mut at = self.layer.at(position)?;
        let token = self.layer.longest_token + 32;
        let path = self.layer.longest_path + 32;
        match kind {
            // Texts, paths to files and expressions as lists.
            10 | 12 | 57 if is_array => self.list(&mut at, 4, token),
            50 | 41 => self.list(&mut at, 4, token),
            40 => self.list(&mut at, 4, path),
            49 => self.list(&mut at, 16, 16),
            48 => self.array(position, 9, 8, rep & COMPRESSED != 0),
            58 => self.list(&mut at, 8, 2 * path),
            45 => self.list(&mut at, 8, 2 * token),
            32 | 33 | 54 => self.lists(&mut at, 4, token),
            34 => self.lists(&mut at, 4, path),
            36 | 38 => self.lists(&mut at, 4, 4),
            37 | 39 => self.lists(&mut at, 8, 8),
            35 | 55 => self.arcs(&mut at, kind == 35, depth),
            31 => self.dictionary(&mut at, depth),
            46 => self.samples(&mut at, depth),
            _ => Ok(token + path + REFERENCE),
        }
    }

    /// An array of elements that take so many bytes.
    fn array(&self, position: u64, kind: u64, size: u64, is_compressed: bool) -> Checked<u64> {
        if position == 0 {
            return Ok(0);
        }
        let version = self.layer.version;
        let mut at = self.layer.at(position)?;
        if version < [0, 5, 0] {
            at.u32()?;
        }
        let count = if version < [0, 7, 0] {
            u64::from(at.u32()?)
        } else {
            at.u64()?
        };
        let memory = if kind == 11 {
            self.layer.longest_token + 32
        } else {
            size
        };
        self.layer.afford(count, memory)?;
        let can_be = match kind {
            3..=6 => version >= [0, 5, 0],
            7..=9 | 56 => version >= [0, 6, 0],
            _ => false,
        };
        if is_compressed && can_be && count >= LEAST_COMPRESSED {
            let is_float = !(3..=6).contains(&kind);
            if is_float && at.take(1)?[0] == b't' {
                let known = at.u32()?;
                at.elements(u64::from(known), size)?;
            }
            let length = at.u64()?;
            at.take(length)?;
            if count > INTEGERS * (EXPANSION * length + 64) {
                return Err(damaged("an array has fewer elements than it says"));
            }
            // The reader has room for what the integers are before they are decoded.
            self.layer.afford(count, memory + 12)?;
        } else {
            at.elements(count, size)?;
        }
        Ok(count * memory)
    }

    /// A list of elements of so many bytes, which become others.
    fn list(&self, at: &mut At<'_>, size: u64, memory: u64) -> Checked<u64> {
        let count = at.u64()?;
        at.elements(count, size)?;
        self.layer.afford(count, memory)?;
        Ok(count * memory)
    }

    /// The lists of what is put before, behind and so on.
    fn lists(&self, at: &mut At<'_>, size: u64, memory: u64) -> Checked<u64> {
        let header = at.take(1)?[0];
        let mut all = 0;
        for _ in 0..(header >> 1).count_ones() {
            all += self.list(at, size, memory)?;
        }
        Ok(all)
    }

    /// The same of references or payloads.
    fn arcs(&mut self, at: &mut At<'_>, are_references: bool, depth: usize) -> Checked<u64> {
        let header = at.take(1)?[0];
        let each = REFERENCE + self.layer.longest_token + self.layer.longest_path;
        let mut all = 0_u64;
        for _ in 0..(header >> 1).count_ones() {
            let count = at.u64()?;
            // Of what is not there no memory is taken.
            let least = if are_references { 32 } else { 8 };
            At::clone(at).elements(count, least)?;
            self.layer.afford(count, each)?;
            all += count * each;
            for _ in 0..count {
                let has_times = are_references || self.layer.version >= [0, 8, 0];
                at.take(8 + if has_times { 16 } else { 0 })?;
                if are_references {
                    all += self.dictionary(at, depth)?;
                    self.layer.afford(all, 1)?;
                }
            }
        }
        Ok(all)
    }

    fn dictionary(&mut self, at: &mut At<'_>, depth: usize) -> Checked<u64> {
        let count = at.u64()?;
        let mut all = 0_u64;
        for _ in 0..count {
            at.u32()?;
            self.elsewhere(at)?;
            let rep = at.u64()?;
            all += self.layer.longest_token + 128 + self.value(rep, depth + 1)?;
            self.layer.afford(all, 1)?;
        }
        Ok(all)
    }

    fn samples(&mut self, at: &mut At<'_>, depth: usize) -> Checked<u64> {
        self.elsewhere(at)?;
        let times = at.u64()?;
        let mut all = self.value(times, depth + 1)?;
        self.elsewhere(at)?;
        let count = at.u64()?;
        At::clone(at).elements(count, 8)?;
        self.layer.afford(count, 64)?;
        for _ in 0..count {
            let rep = at.u64()?;
            all += 64 + self.value(rep, depth + 1)?;
            self.layer.afford(all, 1)?;
        }
        Ok(all)
    }

    /// Goes where the offset that is here leads.
    fn elsewhere(&self, at: &mut At<'_>) -> Checked {
        let here = at.at as i64;
        let offset = at.u64()? as i64;
        let there = here
            .checked_add(offset)
            .and_then(|there| u64::try_from(there).ok());
        let there = there.ok_or_else(|| damaged("an offset leads before its start"))?;
        at.at = self.layer.at(there)?.at;
        Ok(())
    }
}

/// Bytes of an element of a kind that is stored as it is, or as an index.
fn size(kind: u64) -> Option<u64> {
    Some(match kind {
        // Of numbers alone.
        1 | 2 => 1,
        7 => 2,
        3 | 4 | 8 | 11 => 4,
        5 | 6 | 9 | 56 => 8,
        // Of two, three and four: doubles, floats, halves and integers.
        19 => 16,
        20 | 22 => 8,
        21 => 4,
        23 => 24,
        24 | 26 => 12,
        25 => 6,
        27 => 32,
        28 | 30 => 16,
        29 => 8,
        // Quaternions and matrices.
        16 | 13 => 32,
        17 => 16,
        18 => 8,
        14 => 72,
        15 => 128,
        _ => return None,
    })
}
