//! Contact sheets: pictures in rows and columns, with a label below each.

use font8x8::legacy::BASIC_LEGACY;
use impasto_runtime::film::Film;
use impasto_runtime::scene::FilmSettings;

/// Pixels between pictures, and around them.
const MARGIN: u32 = 8;
/// Pixels of a side of a letter, before it is enlarged for large pictures.
const LETTER: u32 = 8;
/// Pixels between lines.
const LEADING: u32 = 4;
/// A picture's side for each size of letters.
const PER_SCALE: u32 = 400;
/// Most pixels of a sheet, and of its longest side.
const MAX_PIXELS: u64 = 1 << 27;
const MAX_SIDE: u64 = 65_536;
/// Linear radiance of paper and letters.
const PAPER: f32 = 0.012;
const INK: f32 = 0.75;

/// Where pictures and labels are on a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    columns: u32,
    rows: u32,
    lines: u32,
    cell: FilmSettings,
    /// By how much letters are enlarged.
    scale: u32,
}

impl Layout {
    /// Of `count` pictures of the size `cell` in `columns`, with `lines` of text below each.
    ///
    /// # Errors
    /// If the sheet is too large for a picture.
    pub fn new(
        count: usize,
        columns: usize,
        lines: usize,
        cell: FilmSettings,
    ) -> Result<Self, String> {
        let columns = columns.clamp(1, count.max(1));
        let layout = Self {
            columns: columns as u32,
            rows: count.div_ceil(columns) as u32,
            lines: lines as u32,
            cell,
            scale: (cell.width / PER_SCALE + 1).min(8),
        };
        let [width, height] = layout.size_64();
        if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_PIXELS {
            return Err(format!(
                "a sheet of {count} pictures of {}x{} would have {width}x{height} pixels\n  hint: ask for fewer or for smaller ones (`--size`)",
                cell.width, cell.height
            ));
        }
        Ok(layout)
    }

    fn size_64(&self) -> [u64; 2] {
        let side = |n: u32, pitch: u64| u64::from(n) * pitch + u64::from(MARGIN);
        let [x, y] = self.pitch();
        [side(self.columns, x), side(self.rows, y)]
    }

    /// From a picture to the next one.
    fn pitch(&self) -> [u64; 2] {
        let text = self.lines * (LETTER + LEADING) * self.scale + LEADING;
        let sides = [self.cell.width, self.cell.height + text];
        sides.map(|side| u64::from(side) + u64::from(MARGIN))
    }

    /// A sheet without pictures.
    pub fn sheet(&self) -> Sheet {
        let [width, height] = self.size_64().map(|side| side as u32);
        let count = width as usize * height as usize;
        Sheet {
            layout: *self,
            film: Film {
                width,
                height,
                pixels: vec![[PAPER; 3]; count],
                samples: vec![1; count],
            },
        }
    }
}

/// A sheet that is filled with pictures.
#[derive(Clone, Debug)]
pub struct Sheet {
    layout: Layout,
    /// What is on it so far.
    pub film: Film,
}

impl Sheet {
    /// Puts picture number `index` and its label in their place. Letters keep their brightness when the sheet is
    /// brightened by `exposure` stops.
    pub fn put(&mut self, index: usize, picture: &Film, label: &[String], exposure: f32) {
        let layout = self.layout;
        let index = index as u32;
        let [x, y] = layout.pitch().map(|pitch| pitch as u32);
        let corner = [
            MARGIN + index % layout.columns * x,
            MARGIN + index / layout.columns * y,
        ];
        for row in 0..picture.height.min(layout.cell.height) {
            for column in 0..picture.width.min(layout.cell.width) {
                let value = picture.pixels[(row * picture.width + column) as usize];
                self.set(corner[0] + column, corner[1] + row, value);
            }
        }
        let ink = INK * (-exposure).exp2();
        for (line, text) in label.iter().enumerate() {
            let pitch = (LETTER + LEADING) * layout.scale;
            let top = corner[1] + layout.cell.height + LEADING + line as u32 * pitch;
            self.write(text, [corner[0], top], ink);
        }
    }

    /// Writes a line as far as it fits; one that is too long ends in `..`.
    fn write(&mut self, text: &str, [left, top]: [u32; 2], ink: f32) {
        let (scale, width) = (self.layout.scale, self.layout.cell.width);
        let room = (width / (LETTER * scale)) as usize;
        let mut letters: Vec<char> = text.chars().collect();
        if letters.len() > room {
            letters.truncate(room.saturating_sub(2));
            letters.extend("..".chars().take(room));
        }
        for (at, letter) in letters.into_iter().enumerate() {
            let glyph = BASIC_LEGACY.get(letter as usize).copied();
            let glyph = glyph.unwrap_or(BASIC_LEGACY['?' as usize]);
            for y in 0..LETTER * scale {
                let bits = glyph[(y / scale) as usize];
                for x in 0..LETTER * scale {
                    if bits >> (x / scale) & 1 == 1 {
                        let column = left + at as u32 * LETTER * scale + x;
                        self.set(column, top + y, [ink; 3]);
                    }
                }
            }
        }
    }

    fn set(&mut self, x: u32, y: u32, value: [f32; 3]) {
        if x < self.film.width && y < self.film.height {
            self.film.pixels[(y * self.film.width + x) as usize] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: FilmSettings = FilmSettings {
        width: 64,
        height: 32,
    };

    #[test]
    fn pictures_and_labels_have_places_of_their_own() {
        let layout = Layout::new(3, 2, 1, CELL).expect("it fits");
        let mut sheet = layout.sheet();
        let picture = Film {
            width: 64,
            height: 32,
            pixels: vec![[0.5; 3]; 64 * 32],
            samples: vec![1; 64 * 32],
        };
        let lit = |sheet: &Sheet| sheet.film.pixels.iter().filter(|p| p[0] == 0.5).count();
        for index in 0..3 {
            sheet.put(index, &picture, &["a = 1, and more than fits".into()], 0.0);
            assert_eq!(lit(&sheet), (index + 1) * 64 * 32);
        }
        assert!(sheet.film.pixels.contains(&[INK; 3]));
    }

    #[test]
    fn sheets_that_no_picture_holds_are_refused() {
        let large = FilmSettings {
            width: 16_384,
            height: 16_384,
        };
        assert!(Layout::new(2, 2, 1, large).is_err());
        let huge = FilmSettings {
            width: u32::MAX / 2,
            height: 1,
        };
        assert!(Layout::new(1024, 8, 2, huge).is_err());
    }
}
