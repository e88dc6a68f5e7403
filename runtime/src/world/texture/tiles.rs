//! Pictures in tiles: a path with `<UDIM>` in it stands for a picture for each unit square of texture
//! coordinates.
//!
//! The tile at column u from 0 to 9 and row v has the number 1001 + u + 10 v in the place of the mark.
//! Which tiles there are is what files there are.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use impasto_compiler::abi::{FILTERS, Lookups, TextureRef, WRAPS, texture_mode};

use crate::error::SceneError;
use crate::input;

/// What stands for the number of a tile.
const MARK: &str = "<UDIM>";
/// The number of the first tile.
const FIRST: u32 = 1001;
/// Tiles in a row.
const COLUMNS: u32 = 10;
/// The greatest number has four digits.
const LAST: u32 = 9999;

/// How tiles are looked up within: at their edges they go on as they end.
pub(super) const CLAMPED: i32 = texture_mode(2, 2, 0);
const _: () = assert!(matches!(WRAPS[2].as_bytes(), b"CLAMP"));
const _: () = assert!(matches!(FILTERS[0].as_bytes(), b"BILINEAR"));

/// The pictures of some textures.
pub(super) struct Slots {
    /// What is to be loaded: textures that are one picture in their order, then all tiles.
    pub pictures: Vec<TextureRef>,
    /// What each texture is.
    pub slots: Vec<Slot>,
}

/// What a texture is.
pub(super) enum Slot {
    /// A picture, by its place among all.
    Picture(usize),
    /// Tiles row by row, each a picture by its place among all.
    Tiles(Vec<Option<usize>>),
}

impl Slots {
    /// Of textures whose paths are relative to `base`.
    ///
    /// # Errors
    /// A texture is in tiles, and there is none.
    pub fn of(textures: &[TextureRef], base: &Path) -> Result<Self, SceneError> {
        let whole = textures.iter().filter(|t| !t.path.contains(MARK));
        let mut pictures: Vec<TextureRef> = whole.cloned().collect();
        let mut next = 0;
        let mut slots = Vec::with_capacity(textures.len());
        for texture in textures {
            if !texture.path.contains(MARK) {
                slots.push(Slot::Picture(next));
                next += 1;
                continue;
            }
            let mut table = Vec::new();
            for (place, path) in files(&texture.path, base)? {
                table.resize(table.len().max(place + 1), None);
                table[place] = Some(pictures.len());
                pictures.push(TextureRef {
                    path,
                    ..texture.clone()
                });
            }
            slots.push(Slot::Tiles(table));
        }
        Ok(Self { pictures, slots })
    }

    /// What lookups of tiles need beside what sources ask for.
    pub fn lookups(&self) -> Lookups {
        if self.is_tiled() {
            Lookups::of_mode(CLAMPED)
        } else {
            Lookups::default()
        }
    }

    /// Is any texture in tiles?
    pub fn is_tiled(&self) -> bool {
        self.slots.iter().any(|s| matches!(s, Slot::Tiles(_)))
    }
}

/// The files that a path with the mark stands for, each with its place in the table, ascending.
fn files(path: &str, base: &Path) -> Result<Vec<(usize, String)>, SceneError> {
    let (folder, name) = path.rsplit_once('/').map_or(("", path), |(f, n)| (f, n));
    let whole = base.join(path);
    let error = |message: String| SceneError::in_file(&whole, message);
    let Some((before, after)) = name.split_once(MARK) else {
        let message = format!("`{MARK}` stands for a part of a file's name, not of a folder's");
        return Err(error(message));
    };
    // An empty path is no folder, but that of a scene in the working directory is empty.
    let folder = Path::new(".").join(base).join(folder);
    let numbers = numbers(&folder, before, after).map_err(|e| {
        error(format!(
            "cannot read the folder of the tiles: {}",
            input::reason(&e)
        ))
    })?;
    let file = |number: u32| {
        let path = path.replacen(MARK, &number.to_string(), 1);
        ((number - FIRST) as usize, path)
    };
    let found: Vec<(usize, String)> = numbers.into_iter().map(file).collect();
    if found.is_empty() {
        let example = name.replacen(MARK, &FIRST.to_string(), 1);
        let hint = format!(
            "the tile of u and v from 0 to 1 is `{example}`, the one right of it 1002, the one above 1011"
        );
        return Err(error("there are no tiles of this name".into()).hint(hint));
    }
    Ok(found)
}

/// The numbers of the tiles in a folder whose names have these parts before and after them, ascending.
fn numbers(folder: &Path, before: &str, after: &str) -> io::Result<Vec<u32>> {
    let number = |file: OsString| {
        let digits = file.to_str()?.strip_prefix(before)?.strip_suffix(after)?;
        let digits = Some(digits).filter(|n| n.len() == 4 && n.bytes().all(|b| b.is_ascii_digit()));
        let number = digits?.parse::<u32>().ok();
        number.filter(|n| (FIRST..=LAST).contains(n))
    };
    let entries = std::fs::read_dir(folder)?.flatten();
    let mut numbers: Vec<u32> = entries.filter_map(|e| number(e.file_name())).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

/// The files that there are now of the tiles at `path`; none if it is the path of one picture.
pub fn tiles(path: &Path) -> Option<Vec<PathBuf>> {
    let (before, after) = path.file_name()?.to_str()?.split_once(MARK)?;
    let folder = path.parent()?;
    // A folder that is not there has no tiles.
    let numbers = numbers(&Path::new(".").join(folder), before, after).unwrap_or_default();
    let file = |number| folder.join(format!("{before}{number}{after}"));
    Some(numbers.into_iter().map(file).collect())
}

/// The words of a table: how many rows, then for each tile its slot, or [`NO_TILE`].
pub(super) fn table(tiles: &[Option<usize>], slot: impl Fn(usize) -> u32) -> Vec<[u32; 2]> {
    let rows = (tiles.len() as u32).div_ceil(COLUMNS);
    let tile = |place: u32| {
        let picture = tiles.get(place as usize).copied().flatten();
        [picture.map_or(NO_TILE, &slot), 0]
    };
    let tiles = (0..rows * COLUMNS).map(tile);
    std::iter::once([rows, 0]).chain(tiles).collect()
}

/// Stands for a tile that there is not.
pub(super) const NO_TILE: u32 = u32::MAX;

#[cfg(test)]
mod tests {
    use super::*;

    /// The base of a scene in the working directory is empty.
    #[test]
    fn tiles_may_be_in_the_working_directory() {
        let none = files("tile.<UDIM>.png", Path::new("")).expect_err("there are none");
        assert_eq!(none.message, "there are no tiles of this name");
    }
}
