//! Textures for replays: lookups as kernels make them, from the same words, in double precision.

use impasto_compiler::Program;
use impasto_compiler::abi::{TextureRef, TextureSpace, texture_mode};
use impasto_compiler::ir::interp::TextureRequest;

/// Most taps along the longer side of a width, as in the compiler's `codegen::lookups`.
const TAPS: f64 = 8.0;

/// How tiles are looked up within.
const CLAMPED: i32 = texture_mode(2, 2, 0);

/// The texels of a program's textures.
pub(super) struct Textures {
    words: Vec<u32>,
    /// The program's slots by texture of the IR, for colors and for data.
    slots: Vec<[Option<usize>; 2]>,
}

/// A version of a picture: where its texels begin, and its columns and rows.
#[derive(Clone, Copy)]
struct Level {
    first: u32,
    size: [u32; 2],
}

/// How a lookup goes on beyond the picture, by the values of `std::core`.
#[derive(Clone, Copy)]
struct Wrap(i32);

impl Textures {
    /// Those of a program, whose texels are in `words`.
    pub(super) fn new(program: &Program, words: Vec<u32>) -> Self {
        let slots: Vec<TextureRef> = program.textures();
        let slot = |path: &String, space| {
            slots
                .iter()
                .position(|slot| slot.path == *path && slot.space == space)
        };
        let textures = program.ir().textures.iter();
        let slots = textures
            .map(|path| [TextureSpace::Color, TextureSpace::Data].map(|space| slot(path, space)));
        Self {
            slots: slots.collect(),
            words,
        }
    }

    /// What a lookup gives.
    pub(super) fn fetch(&self, of: &TextureRequest) -> [f64; 4] {
        let data = usize::from(of.op.texture_space() == Some(TextureSpace::Data));
        let last = self.slots.len().saturating_sub(1);
        let slot = self.slots.get(of.texture.min(last)).and_then(|s| s[data]);
        slot.and_then(|slot| self.fetched(slot, of))
            .unwrap_or_default()
    }

    /// What a lookup of a slot gives, or of its tile there.
    fn fetched(&self, slot: usize, of: &TextureRequest) -> Option<[f64; 4]> {
        let [table, size] = self.pair(slot)?;
        if size != 0 {
            return self.mean(slot, of);
        }
        let [rows, _] = self.pair(table as usize)?;
        let [u, v] = of.uv.map(f64::floor);
        let is_there = (0.0..10.0).contains(&u) && (0.0..f64::from(rows)).contains(&v);
        let place = is_there.then_some(table as usize + 1 + u as usize + 10 * v as usize)?;
        let [tile, _] = self.pair(place)?;
        let of = TextureRequest {
            uv: [of.uv[0] - u, of.uv[1] - v],
            mode: CLAMPED + (of.mode & 0x30),
            ..*of
        };
        (tile != u32::MAX).then(|| self.mean(tile as usize, &of))?
    }

    fn pair(&self, at: usize) -> Option<[u32; 2]> {
        Some([*self.words.get(2 * at)?, *self.words.get(2 * at + 1)?])
    }

    /// The mean over the width of a lookup.
    fn mean(&self, slot: usize, of: &TextureRequest) -> Option<[f64; 4]> {
        if of.width == [0.0; 2] {
            return self.filter(self.level(slot, 0)?, of.uv, of.mode);
        }
        let picture = self.level(slot, 0)?;
        let sides = [0, 1].map(|a| (of.width[a].abs() * f64::from(picture.size[a])).min(1e6));
        let longer = sides[0].max(sides[1]);
        let shorter = sides[0].min(sides[1]).max(longer / TAPS).max(1.0);
        let last = picture.size[0].max(picture.size[1]).max(1).ilog2();
        let detail = shorter.log2().min(f64::from(last));
        let taps = (longer / shorter).ceil().max(1.0);
        let axis = usize::from(sides[0] <= sides[1]);
        let mut sum = [0.0; 4];
        for i in 0..taps as u32 {
            let mut uv = of.uv;
            uv[axis] += (f64::from(i) + 0.5 - 0.5 * taps) * of.width[axis] / taps;
            let fine = self.filter(self.level(slot, detail as u32)?, uv, of.mode)?;
            let weight = detail.fract();
            let coarse = if weight > 0.0 {
                self.filter(self.level(slot, detail as u32 + 1)?, uv, of.mode)?
            } else {
                fine
            };
            (0..4).for_each(|c| sum[c] += fine[c] + (coarse[c] - fine[c]) * weight);
        }
        Some(sum.map(|x| x / taps))
    }

    fn level(&self, slot: usize, level: u32) -> Option<Level> {
        let [picture, _] = self.pair(slot)?;
        let [first, size] = match level {
            0 => self.pair(slot)?,
            _ => self.pair(picture.checked_sub(level)? as usize)?,
        };
        let size = [(size & 0xffff).max(1), (size >> 16).max(1)];
        Some(Level { first, size })
    }

    /// One level, between its texels as `mode` says.
    fn filter(&self, level: Level, uv: [f64; 2], mode: i32) -> Option<[f64; 4]> {
        let wraps = [Wrap(mode & 3), Wrap(mode >> 2 & 3)];
        let at = [wraps[0].reduce(uv[0]), 1.0 - wraps[1].reduce(uv[1])];
        let at = [0, 1].map(|a| at[a] * f64::from(level.size[a]));
        let taps = at.map(|x| taps(x, mode >> 4));
        let mut sum = [0.0; 4];
        for &(y, row) in &taps[1] {
            for &(x, column) in &taps[0] {
                let place = [
                    wraps[0].index(x, level.size[0]),
                    wraps[1].index(y, level.size[1]),
                ];
                if let [Some(x), Some(y)] = place {
                    let texel = self.texel((level.first + y * level.size[0] + x) as usize)?;
                    (0..4).for_each(|c| sum[c] += row * column * texel[c]);
                }
            }
        }
        Some(sum)
    }

    fn texel(&self, index: usize) -> Option<[f64; 4]> {
        let [low, high] = [self.words.get(2 * index)?, self.words.get(2 * index + 1)?];
        let half = |bits: u32| half::f16::from_bits(bits as u16).to_f64();
        Some([half(*low), half(low >> 16), half(*high), half(high >> 16)])
    }
}

/// The texels along a side that count at `x`, with their weights.
fn taps(x: f64, filter: i32) -> Vec<(i64, f64)> {
    let cell = (x - 0.5).floor();
    let (first, t) = (cell as i64, x - 0.5 - cell);
    match filter {
        1 => vec![(x.floor() as i64, 1.0)],
        2 => {
            let end = |t: f64| t.powi(3) / 6.0;
            let inner = |t: f64| 2.0 / 3.0 - t * t + t.powi(3) / 2.0;
            let weights = [end(1.0 - t), inner(t), inner(1.0 - t), end(t)];
            (first - 1..).zip(weights).collect()
        }
        _ => vec![(first, 1.0 - t), (first + 1, t)],
    }
}

impl Wrap {
    fn reduce(self, x: f64) -> f64 {
        match self.0 {
            0 => x - x.floor(),
            1 => x - 2.0 * (0.5 * x).floor(),
            _ => x.clamp(-3.0, 4.0),
        }
    }

    /// Which of `n` texels stands at place `i`.
    fn index(self, i: i64, n: u32) -> Option<u32> {
        let n = i64::from(n);
        let index = match self.0 {
            0 => i.rem_euclid(n),
            1 => {
                let j = i.rem_euclid(2 * n);
                j.min(2 * n - 1 - j)
            }
            2 => i.clamp(0, n - 1),
            _ => return u32::try_from(i).ok().filter(|&i| i64::from(i) < n),
        };
        Some(index as u32)
    }
}
