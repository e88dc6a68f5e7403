//! Pictures that scenes need: encoding, and the loops over their pixels.

use std::io::Cursor;

use glam::{DVec2, DVec3, dvec2, dvec3};
use image::codecs::hdr::HdrEncoder;
use image::{ImageFormat, Rgb, RgbImage};

/// The PNG of a color given by texture coordinates in [0, 1), v up; colors are sRGB in [0, 1].
pub fn png(size: u32, color: impl Fn(DVec2) -> DVec3) -> Result<Vec<u8>, String> {
    let picture = RgbImage::from_fn(size, size, |x, y| {
        let u = (f64::from(x) + 0.5) / f64::from(size);
        let v = 1.0 - (f64::from(y) + 0.5) / f64::from(size);
        let bytes = (color(dvec2(u, v)).clamp(DVec3::ZERO, DVec3::ONE) * 255.0).round();
        Rgb(bytes.to_array().map(|c| c as u8))
    });
    let mut file = Cursor::new(Vec::new());
    picture
        .write_to(&mut file, ImageFormat::Png)
        .map_err(|error| format!("cannot encode a texture: {error}"))?;
    Ok(file.into_inner())
}

/// The Radiance picture of an environment given by direction (unit, y up), `width` by half of it.
/// The top row looks up; the middle column looks along -z, and +x is to its right.
pub fn environment(width: usize, radiance: impl Fn(DVec3) -> DVec3) -> Result<Vec<u8>, String> {
    use std::f64::consts::{PI, TAU};
    let height = width / 2;
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let polar = (y as f64 + 0.5) / height as f64 * PI;
        for x in 0..width {
            let azimuth = ((x as f64 + 0.5) / width as f64 - 0.5) * TAU;
            let (sin, cos) = azimuth.sin_cos();
            let direction = dvec3(polar.sin() * sin, polar.cos(), -polar.sin() * cos);
            pixels.push(Rgb(radiance(direction).as_vec3().to_array()));
        }
    }
    let mut file = Vec::new();
    HdrEncoder::new(&mut file)
        .encode(&pixels, width, height)
        .map_err(|error| format!("cannot encode an environment map: {error}"))?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_an_environment_go_from_up_to_down() {
        let up = |d: DVec3| if d.y > 0.0 { DVec3::ONE } else { DVec3::ZERO };
        let file = environment(8, up).expect("encodes");
        let picture = image::load_from_memory(&file).expect("decodes").to_rgb32f();
        assert_eq!(picture.dimensions(), (8, 4));
        assert!(picture.get_pixel(3, 0).0[0] > 0.9 && picture.get_pixel(3, 3).0[0] < 0.1);
    }

    #[test]
    fn textures_have_v_up() {
        let file = png(4, |uv| DVec3::splat(uv.y)).expect("encodes");
        let picture = image::load_from_memory(&file).expect("decodes").to_rgb8();
        assert!(picture.get_pixel(0, 0).0[0] > picture.get_pixel(0, 3).0[0]);
    }
}
