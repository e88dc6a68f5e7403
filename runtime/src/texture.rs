//! The textures that materials read, as one storage buffer of half floats.

use std::path::Path;

use half::f16;
use impasto_compiler::abi::{TextureRef, TextureSpace};
use rayon::prelude::*;

use crate::image_file::{self, Picture};
use crate::scene::SceneError;
use crate::shader_part::{BufferData, ShaderPart};

/// `texture_fetch` for `textures`, whose order gives their slots and whose paths are relative to
/// `base`; `None` if there are none.
pub fn part(textures: &[TextureRef], base: &Path) -> Result<Option<ShaderPart>, SceneError> {
    if textures.is_empty() {
        return Ok(None);
    }
    let packed: Vec<Packed> = textures
        .par_iter()
        .map(|texture| load(texture, base))
        .collect::<Result<_, _>>()?;
    let total: usize = packed.iter().map(|p| p.texels.len()).sum();
    if u32::try_from(packed.len() + total).is_err() {
        let message = format!("the scene's textures have {total} texels in all");
        return Err(SceneError::new(message).hint("at most 2^32 fit; use smaller pictures"));
    }
    let mut first = packed.len() as u32;
    let mut data: Vec<[u32; 2]> = Vec::with_capacity(packed.len() + total);
    for texture in &packed {
        data.push([first, texture.size]);
        first += texture.texels.len() as u32;
    }
    data.extend(packed.iter().flat_map(|texture| &texture.texels));
    Ok(Some(ShaderPart {
        wgsl: include_str!("kernels/texture.wgsl").to_owned(),
        buffers: vec![BufferData::new("texture_data", "array<vec2<u32>>", &data)],
    }))
}

/// One texture as the kernel reads it.
struct Packed {
    /// Width in the low half, height in the high half.
    size: u32,
    /// Four half floats each.
    texels: Vec<[u32; 2]>,
}

fn load(texture: &TextureRef, base: &Path) -> Result<Packed, SceneError> {
    let path = base.join(&texture.path);
    let picture = image_file::load(&path, "texture", texture.space == TextureSpace::Color)?;
    check_range(&picture, &path)?;
    let pack = |[x, y]: [f32; 2]| {
        let [x, y] = [x, y].map(|v| u32::from(f16::from_f32(v).to_bits()));
        x | y << 16
    };
    Ok(Packed {
        size: picture.width | picture.height << 16,
        texels: picture
            .texels
            .iter()
            .map(|&[r, g, b, a]| [pack([r, g]), pack([b, a])])
            .collect(),
    })
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
