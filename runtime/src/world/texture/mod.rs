//! The textures that materials read, as one storage buffer of half floats.
//!
//! It begins with a pair of words a texture: where its texels begin, and its size. Levels, which only
//! textures have that are looked up with a width, stand behind the picture's own texels, and the pairs
//! of these levels before them, in reverse: the pair of level n lies n before the first texel.
//!
//! A texture in tiles has no size, and the place of its table instead: how many rows of ten tiles it has, and
//! for each tile the number of its pair, which stands behind those of all textures.

use std::path::Path;

use half::f16;
use impasto_compiler::abi::{Lookups, TextureRef, TextureSpace};
use impasto_compiler::{ParameterValue, codegen};
use rayon::prelude::*;

use crate::error::{Excerpt, SceneError};
use crate::image_file::{self, Picture};
use crate::scene::Scene;
use crate::wgsl;
use crate::wgsl::template::template;
use crate::wgsl::{BufferData, ShaderPart};
pub use tiles::tiles;
use tiles::{Slot, Slots};

mod levels;
mod tiles;

/// Texels of all textures of a scene, levels not counted: 32 pictures of 4096 x 4096, 4 GiB.
const MAX_TEXELS: u64 = 1 << 29;

/// Texels of pictures that are decoded at a time: each takes up to 36 bytes meanwhile.
const DECODED_AT_ONCE: u64 = 1 << 25;

/// `texture_fetch`, and what else is asked of `textures`, whose order gives their slots and whose
/// paths are relative to `base`; `None` if there are none.
///
/// # Errors
/// If a picture cannot be read or is too large, or all together are.
pub fn part(textures: &[TextureRef], base: &Path) -> Result<Option<ShaderPart>, SceneError> {
    if textures.is_empty() {
        return Ok(None);
    }
    let slots = Slots::of(textures, base)?;
    let data = words(&slots, load_all(&slots.pictures, base)?);
    let all = textures.iter().map(|texture| texture.lookups);
    let all = all.fold(slots.lookups(), Lookups::and);
    let tiled = slots.is_tiled();
    let mut wgsl = String::new();
    if tiled {
        wgsl += &wgsl::constant_u32("NO_TILE", tiles::NO_TILE);
        wgsl += &format!("const CLAMPED_TILE: i32 = {};\n", tiles::CLAMPED);
    }
    wgsl += &template!("../texture.wgsl").wgsl(&[("tiles", tiled)]);
    if !all.is_plain() {
        wgsl += include_str!("../texture_levels.wgsl");
        wgsl += &codegen::lookups(all, tiled);
    }
    Ok(Some(ShaderPart {
        wgsl,
        buffers: vec![BufferData::new("texture_data", "array<vec2<u32>>", &data)],
    }))
}

/// Reads the headers of textures, and decodes none.
///
/// # Errors
/// If a picture cannot be read or is too large, or all together are.
pub fn check(textures: &[TextureRef], base: &Path) -> Result<(), SceneError> {
    sizes(&Slots::of(textures, base)?.pictures, base).map(drop)
}

/// The error with the line of `scene` that names the picture it is about, if a parameter does.
pub fn named(error: SceneError, scene: &Scene) -> SceneError {
    let is_it = |value: &ParameterValue| match value {
        ParameterValue::Texture(name) | ParameterValue::Text(name) => {
            let name = name.trim_matches('"');
            error.path.as_ref() == Some(&scene.base.join(name))
        }
        _ => false,
    };
    let place = scene.materials.iter().find_map(|binding| {
        let (name, _) = binding.params.iter().find(|(_, value)| is_it(value))?;
        let written = binding.written.as_ref()?;
        let value = written.param(name)?.value.clone();
        let path = Path::new(&written.path);
        Some(Excerpt::new(path, &written.text, value))
    });
    match place {
        Some(excerpt) => error.named_at(&excerpt),
        None => error,
    }
}

/// The buffer: pairs of textures and tiles, tables, then texels.
fn words(slots: &Slots, packed: Vec<Packed>) -> Vec<[u32; 2]> {
    let count = slots.slots.len();
    let whole = slots.slots.iter().filter(|s| matches!(s, Slot::Picture(_)));
    let whole = whole.count();
    // The pair of a tile.
    let tile = |picture: usize| (count + picture - whole) as u32;
    let pairs = count + packed.len() - whole;
    let mut data: Vec<[u32; 2]> = vec![[0; 2]; pairs];
    data.reserve(packed.iter().map(Packed::pairs).sum());
    let mut pair_of: Vec<usize> = (0..packed.len())
        .map(|picture| (picture + count).saturating_sub(whole))
        .collect();
    for (slot, of) in slots.slots.iter().enumerate() {
        match of {
            Slot::Picture(picture) => pair_of[*picture] = slot,
            Slot::Tiles(tiles) => {
                data[slot] = [data.len() as u32, 0];
                data.extend(tiles::table(tiles, tile));
            }
        }
    }
    for (picture, texture) in packed.into_iter().enumerate() {
        let first = (data.len() + texture.levels.len() - 1) as u32;
        data[pair_of[picture]] = [first, texture.levels[0].size];
        texture.write(first, &mut data);
    }
    data
}

/// The texels of each texture by its header; too many are refused before any is decoded.
fn sizes(textures: &[TextureRef], base: &Path) -> Result<Vec<u64>, SceneError> {
    let sizes: Vec<u64> = textures
        .par_iter()
        .map(|t| image_file::texels(&base.join(&t.path), "texture"))
        .collect::<Result<_, _>>()?;
    let total: u64 = sizes.iter().sum();
    if total > MAX_TEXELS {
        let message = format!("the scene's textures have {total} texels in all");
        let hint = format!("at most {MAX_TEXELS} fit; use smaller pictures");
        return Err(SceneError::new(message).hint(hint));
    }
    Ok(sizes)
}

/// Loads textures, as many at a time as memory is meant for.
fn load_all(textures: &[TextureRef], base: &Path) -> Result<Vec<Packed>, SceneError> {
    let sizes = sizes(textures, base)?;
    let mut packed = Vec::with_capacity(textures.len());
    let mut first = 0;
    while first < textures.len() {
        let mut texels = sizes[first];
        let mut end = first + 1;
        while end < textures.len() && texels + sizes[end] <= DECODED_AT_ONCE {
            texels += sizes[end];
            end += 1;
        }
        let loaded = textures[first..end].par_iter().map(|t| load(t, base));
        packed.extend(loaded.collect::<Result<Vec<_>, _>>()?);
        first = end;
    }
    Ok(packed)
}

/// One texture as the kernel reads it.
struct Packed {
    /// The picture, and the levels after it.
    levels: Vec<Level>,
}

struct Level {
    /// Width in the low half, height in the high half.
    size: u32,
    /// Four half floats each.
    texels: Vec<[u32; 2]>,
}

impl Packed {
    /// Pairs of words that it takes.
    fn pairs(&self) -> usize {
        self.levels.iter().map(|level| 1 + level.texels.len()).sum()
    }

    /// Adds everything but the first pair, where `first` is the place of the first texel.
    fn write(self, first: u32, data: &mut Vec<[u32; 2]>) {
        let mut at = first;
        let mut pairs = Vec::new();
        for level in &self.levels {
            pairs.push([at, level.size]);
            at += level.texels.len() as u32;
        }
        data.extend(pairs[1..].iter().rev());
        for level in self.levels {
            data.extend(level.texels);
        }
    }
}

fn load(texture: &TextureRef, base: &Path) -> Result<Packed, SceneError> {
    let path = base.join(&texture.path);
    let is_color = texture.space == TextureSpace::Color;
    let picture = image_file::load(&path, "texture", is_color)?;
    check_range(&picture, &path)?;
    let coverage = is_color && texture.lookups.alpha;
    let holes = |picture: &Picture| picture.texels.iter().any(|texel| texel[3] < 1.0);
    let mut levels = if texture.lookups.levels || (coverage && holes(&picture)) {
        levels::pyramid(picture, coverage)
    } else {
        vec![picture]
    };
    if !texture.lookups.levels {
        levels.truncate(1);
    }
    Ok(Packed {
        levels: levels.into_iter().map(pack).collect(),
    })
}

fn pack(picture: Picture) -> Level {
    let pair = |[x, y]: [f32; 2]| {
        let [x, y] = [x, y].map(|v| u32::from(f16::from_f32(v).to_bits()));
        x | y << 16
    };
    let texels = picture.texels.iter();
    Level {
        size: picture.width | picture.height << 16,
        texels: texels
            .map(|&[r, g, b, a]| [pair([r, g]), pair([b, a])])
            .collect(),
    }
}

fn check_range(picture: &Picture, path: &Path) -> Result<(), SceneError> {
    let largest = f16::MAX.to_f32();
    let outside = |texel: &[f32; 4]| !texel.iter().all(|v| v.abs() <= largest);
    let Some(index) = picture.texels.iter().position(outside) else {
        return Ok(());
    };
    let (x, y) = (index as u32 % picture.width, index as u32 / picture.width);
    let value = picture.texels[index];
    let message = format!("the texel in column {x}, row {y} is {value:?}");
    Err(SceneError::in_file(path, message)
        .hint(format!("textures hold finite values up to {largest}")))
}
