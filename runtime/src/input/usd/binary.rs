//! What is looked at in a `.usdc` layer before the reader has it. That one takes memory for as many elements as a file says
//! it has, calls itself for dictionaries within dictionaries, and follows jumps wherever they lead: here it is seen that
//! there is what the file speaks of, that it is bounded, and that paths are a tree. Indices are left to the reader, which
//! panics at a wrong one, and no more.
//!
//! Source: OpenUSD, `pxr/usd/sdf/crateFile.cpp`, and the Core Specification of AOUSD, section 16.3.

use super::binary::values::Values;

mod values;

/// What such a layer begins with.
pub(super) const MAGIC: &[u8] = b"PXR-USDC";

/// What a value, or a table, may take in memory, in bytes; and so many for each byte of the file. An array of one
/// number over and over takes next to nothing in a file.
const LEAST: u64 = 64 << 20;
const GROWTH: u64 = 16;

/// A byte of LZ4 becomes at most so many, and each of these at most four integers of two bits.
const EXPANSION: u64 = 255;
const INTEGERS: u64 = 4;

/// Prims within prims, and bytes of a path.
const DEEPEST: usize = 128;

/// Versions that are read: before, tables were not compressed.
const OLDEST: [u8; 3] = [0, 4, 0];
const NEWEST_MINOR: u8 = 12;

type Checked<T = ()> = Result<T, String>;

/// Fails if the layer is damaged so that it must not be read.
pub(super) fn check(bytes: &[u8]) -> Checked {
    let mut layer = Layer {
        bytes,
        most: LEAST + GROWTH * bytes.len() as u64,
        version: [0; 3],
        longest_token: 0,
        longest_path: 0,
    };
    let fields = layer.tables()?;
    let mut values = Values::new(&layer);
    fields.iter().try_for_each(|rep| values.field(*rep))
}

/// A layer, and what is known of it.
struct Layer<'b> {
    bytes: &'b [u8],
    /// What a value or table may take in memory.
    most: u64,
    version: [u8; 3],
    /// In bytes.
    longest_token: u64,
    longest_path: u64,
}

fn damaged(what: &str) -> String {
    format!("the layer is damaged: {what}")
}

impl<'b> Layer<'b> {
    /// Looks at all tables; the values of fields.
    fn tables(&mut self) -> Checked<Vec<u64>> {
        let mut start = At {
            bytes: self.bytes,
            at: 8,
        };
        let version = start.take(3)?;
        self.version = [version[0], version[1], version[2]];
        if self.version < OLDEST || self.version[0] != 0 || self.version[1] > NEWEST_MINOR {
            let [major, minor, patch] = self.version;
            return Err(format!(
                "the layer is of version {major}.{minor}.{patch}; 0.4 to 0.{NEWEST_MINOR} are read"
            ));
        }
        let table = self.at(At {
            bytes: self.bytes,
            at: 16,
        }
        .u64()?);
        let mut table = table?;
        let count = table.u64()?;
        if count > 64 {
            return Err(damaged("it has too many sections"));
        }
        let mut sections = Vec::new();
        for _ in 0..count {
            let name = table.take(16)?;
            let name: Vec<u8> = name.iter().copied().take_while(|b| *b != 0).collect();
            sections.push((name, table.u64()?));
            table.u64()?;
        }
        // The first of a name counts. Tokens are needed to know the others.
        let section = |name: &str| {
            sections
                .iter()
                .find(|(own, _)| own == name.as_bytes())
                .map(|(_, at)| *at)
        };
        let mut lengths = Vec::new();
        if let Some(at) = section("TOKENS") {
            lengths = self.tokens(at)?;
        }
        if let Some(at) = section("STRINGS") {
            let mut at = self.at(at)?;
            let count = at.u64()?;
            at.elements(count, 4)?;
        }
        if let Some(at) = section("FIELDSETS") {
            let mut at = self.at(at)?;
            let count = at.u64()?;
            self.skip_integers(&mut at, count)?;
        }
        if let Some(at) = section("PATHS") {
            self.paths(at, &lengths)?;
        }
        if let Some(at) = section("SPECS") {
            let mut at = self.at(at)?;
            let count = at.u64()?;
            for _ in 0..3 {
                self.skip_integers(&mut at, count)?;
            }
            self.afford(count, 128)?;
        }
        match section("FIELDS") {
            Some(at) => self.fields(at),
            None => Ok(Vec::new()),
        }
    }

    fn at(&self, position: u64) -> Checked<At<'b>> {
        let at = usize::try_from(position)
            .ok()
            .filter(|at| *at <= self.bytes.len());
        let at = at.ok_or_else(|| damaged("an offset leads behind its end"))?;
        Ok(At {
            bytes: self.bytes,
            at,
        })
    }

    /// Fails if so many elements of a size take too much memory.
    fn afford(&self, count: u64, size: u64) -> Checked {
        match count.checked_mul(size) {
            Some(all) if all <= self.most => Ok(()),
            _ => Err(damaged(&format!("something has {count} elements"))),
        }
    }

    /// What `size` bytes of LZ4 become, of which there are at most `most`.
    fn unpacked(&self, at: &mut At<'b>, most: u64) -> Checked<Vec<u8>> {
        let size = at.u64()?;
        let packed = at.take(size)?;
        let [0, packed @ ..] = packed else {
            return Err(damaged("something is compressed in an unknown way"));
        };
        let most = most.min(EXPANSION * size + 64);
        self.afford(most, 1)?;
        let mut bytes = vec![0; most as usize];
        let length = lz4_flex::block::decompress_into(packed, &mut bytes);
        let length = length.map_err(|_| damaged("something cannot be decompressed"))?;
        bytes.truncate(length);
        Ok(bytes)
    }

    /// Passes compressed integers, of which there are so many.
    fn skip_integers(&self, at: &mut At<'b>, count: u64) -> Checked {
        let size = at.u64()?;
        at.take(size)?;
        if count > INTEGERS * (EXPANSION * size + 64) {
            return Err(damaged("it has fewer integers than it says"));
        }
        self.afford(count, 12)
    }

    /// So many compressed integers of 32 bits.
    fn integers(&self, at: &mut At<'b>, count: u64) -> Checked<Vec<i32>> {
        let short = || damaged("it has fewer integers than it says");
        self.afford(count, 12)?;
        if count == 0 {
            self.skip_integers(at, 0)?;
            return Ok(Vec::new());
        }
        let codes = count.div_ceil(INTEGERS);
        let bytes = self.unpacked(at, 4 + codes + 4 * count)?;
        let codes = bytes.get(4..4 + codes as usize).ok_or_else(short)?;
        let common = At {
            bytes: &bytes,
            at: 0,
        }
        .u32()? as i32;
        let mut rest = At {
            bytes: &bytes,
            at: 4 + codes.len(),
        };
        let mut last = 0_i32;
        let mut all = Vec::with_capacity(count as usize);
        for number in 0..count as usize {
            let step = match codes[number / 4] >> (2 * (number % 4)) & 3 {
                0 => common,
                1 => i32::from(rest.take(1)?[0] as i8),
                2 => {
                    let two = rest.take(2)?;
                    i32::from(i16::from_le_bytes([two[0], two[1]]))
                }
                _ => rest.u32()? as i32,
            };
            last = last.wrapping_add(step);
            all.push(last);
        }
        Ok(all)
    }

    /// The lengths of tokens.
    fn tokens(&mut self, position: u64) -> Checked<Vec<usize>> {
        let mut at = self.at(position)?;
        let count = at.u64()?;
        let size = at.u64()?;
        self.afford(size, 2)?;
        self.afford(count, 32)?;
        let text = self.unpacked(&mut at, size)?;
        let lengths: Vec<usize> = text.split(|b| *b == 0).map(<[u8]>::len).collect();
        self.longest_token = lengths.iter().max().copied().unwrap_or_default() as u64;
        Ok(lengths)
    }

    fn fields(&self, position: u64) -> Checked<Vec<u64>> {
        let mut at = self.at(position)?;
        let count = at.u64()?;
        self.skip_integers(&mut at, count)?;
        self.afford(count, 24)?;
        let values = self.unpacked(&mut at, 8 * count)?;
        let values = values.chunks_exact(8);
        Ok(values
            .map(|v| u64::from_le_bytes(v.try_into().unwrap_or_default()))
            .collect())
    }

    /// Looks at the tree of paths: each element is come to once, none lies too deep, and all together are not too long.
    fn paths(&mut self, position: u64, tokens: &[usize]) -> Checked {
        let mut at = self.at(position)?;
        let paths = at.u64()?;
        self.afford(paths, 64)?;
        let count = at.u64()?;
        self.skip_integers(&mut at, count)?;
        let elements = self.integers(&mut at, count)?;
        let jumps = self.integers(&mut at, count)?;
        let mut waiting = vec![(0_usize, 0_usize, 0_u64)];
        let (mut seen, mut all) = (0_u64, 0_u64);
        while let Some((mut index, mut depth, above)) = waiting.pop() {
            if jumps.is_empty() {
                break;
            }
            let mut above = above;
            loop {
                seen += 1;
                let (Some(jump), Some(element)) = (jumps.get(index), elements.get(index)) else {
                    return Err(damaged("its paths lead behind their end"));
                };
                let token = tokens.get(element.unsigned_abs() as usize).copied();
                let length = above + 1 + token.unwrap_or_default() as u64;
                all += length;
                self.longest_path = self.longest_path.max(length);
                if seen > count {
                    return Err(damaged("its paths are no tree"));
                }
                if depth > DEEPEST {
                    return Err(format!(
                        "prims lie more than {DEEPEST} deep within each other"
                    ));
                }
                self.afford(all, 1)?;
                let has_child = *jump > 0 || *jump == -1;
                if has_child && *jump > 0 {
                    waiting.push((index + *jump as usize, depth, above));
                }
                if has_child {
                    (depth, above) = (depth + 1, length);
                } else if *jump < 0 {
                    break;
                }
                index += 1;
            }
        }
        Ok(())
    }
}

/// A place in the bytes.
#[derive(Clone, Copy)]
struct At<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> At<'b> {
    fn take(&mut self, length: u64) -> Checked<&'b [u8]> {
        let end = usize::try_from(length)
            .ok()
            .and_then(|length| self.at.checked_add(length));
        let part = end.and_then(|end| self.bytes.get(self.at..end));
        let part = part.ok_or_else(|| damaged("it is cut off"))?;
        self.at += part.len();
        Ok(part)
    }

    /// Passes so many elements of a size.
    fn elements(&mut self, count: u64, size: u64) -> Checked {
        let length = count
            .checked_mul(size)
            .ok_or_else(|| damaged("it is cut off"))?;
        self.take(length).map(|_| ())
    }

    fn u32(&mut self) -> Checked<u32> {
        let bytes = self.take(4)?;
        Ok(u32::from_le_bytes(bytes.try_into().unwrap_or_default()))
    }

    fn u64(&mut self) -> Checked<u64> {
        let bytes = self.take(8)?;
        Ok(u64::from_le_bytes(bytes.try_into().unwrap_or_default()))
    }
}
