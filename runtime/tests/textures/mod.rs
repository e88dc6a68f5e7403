//! Textures: how they are looked up, and what becomes of files of every kind, pictures or not.

mod damaged;
mod formats;
mod lookups;

use image::{DynamicImage, ImageBuffer, ImageFormat};
use impasto_compiler::abi::{Lookups, TextureRef, TextureSpace};
use impasto_runtime::wgsl::ShaderPart;
use impasto_runtime::world::texture;

/// The bytes of a picture file.
fn encode<P, C>(picture: ImageBuffer<P, C>, format: ImageFormat) -> Vec<u8>
where
    DynamicImage: From<ImageBuffer<P, C>>,
    P: image::Pixel,
    C: std::ops::Deref<Target = [P::Subpixel]>,
{
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = DynamicImage::from(picture);
    picture.write_to(&mut bytes, format).expect("it is encoded");
    bytes.into_inner()
}

/// The texture part of files, each with how it is read and looked up.
fn part(files: &[(&str, Vec<u8>, TextureSpace, Lookups)]) -> Result<ShaderPart, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let texture = |(name, bytes, space, lookups): &(&str, Vec<u8>, TextureSpace, Lookups)| {
        std::fs::write(folder.path().join(name), bytes).expect("it is written");
        TextureRef {
            path: (*name).into(),
            space: *space,
            lookups: *lookups,
        }
    };
    let textures: Vec<TextureRef> = files.iter().map(texture).collect();
    match texture::part(&textures, folder.path()) {
        Ok(part) => Ok(part.expect("there are textures")),
        Err(error) => Err(error.to_string()),
    }
}
