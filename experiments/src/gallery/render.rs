//! Renders one picture with the `impasto` command, and makes a small PNG of it.
//!
//! The scene and generated sources are temporary files. A render ends after its samples or its
//! time, whichever comes first, so that a heavy material cannot hold up the rest.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use impasto::files::write_whole;
use impasto_scenes::mesh::Mesh;
use impasto_scenes::obj::obj_text;
use xtask::shell::{self, Result};

use super::example::{Example, Stand};
use super::library::Entry;
use super::stage;

/// Most bytes of a picture: two hundred of them stay below 8 MB.
pub(super) const MOST_BYTES: usize = 38_000;

/// How pictures are made.
pub(super) struct Settings {
    pub(super) impasto: PathBuf,
    /// Width and height in pixels.
    pub(super) size: u32,
    pub(super) spp: u32,
    /// Seconds for one picture.
    pub(super) seconds: u32,
}

/// The picture that examples of textures may name, of `materials/textures`.
const PICTURE: &str = "stone.png";

/// The temporary folder with what all scenes share.
pub(super) struct Studio {
    folder: PathBuf,
}

impl Studio {
    /// Writes the stages into `folder`.
    pub(super) fn new(folder: PathBuf) -> Result<Self> {
        fs::create_dir_all(&folder)
            .map_err(|e| format!("cannot create the folder {}: {e}", folder.display()))?;
        let write = |name: &str, bytes: &[u8]| write_whole(&folder.join(name), bytes);
        let obj = |mesh: &Mesh| obj_text(mesh, "stage.mtl");
        write("stage.mtl", b"")?;
        write("ball.obj", &obj(&stage::ball()))?;
        write("tile.obj", &obj(&stage::tile()))?;
        write("lamp.obj", &obj(&stage::lamp()))?;
        write("surroundings.hdr", &stage::surroundings()?)?;
        write("stage.impasto", STAGE.as_bytes())?;
        let picture = shell::root().join("materials/textures").join(PICTURE);
        let picture =
            fs::read(&picture).map_err(|e| format!("cannot read {}: {e}", picture.display()))?;
        write(PICTURE, &picture)?;
        Ok(Self { folder })
    }

    /// The file with the material of an example.
    pub(super) fn sample(&self, entry: &Entry, example: &Example) -> Result<PathBuf> {
        if example.material != "example" {
            // In its place, since its textures lie beside it.
            return fs::canonicalize(&entry.path)
                .map_err(|e| format!("cannot find {}: {e}", entry.path.display()));
        }
        let path = self.folder.join("sample.impasto");
        write_whole(&path, example.picture.as_bytes())?;
        Ok(path)
    }

    /// Deletes the temporary files. If that fails, they stay: it is a temporary folder.
    pub(super) fn remove(self) {
        let _ = fs::remove_dir_all(&self.folder);
    }

    /// The PNG of an example.
    pub(super) fn picture(
        &self,
        entry: &Entry,
        example: &Example,
        settings: &Settings,
    ) -> Result<Vec<u8>> {
        let sample = self.sample(entry, example)?;
        let scene = self.folder.join("scene.toml");
        write_whole(&scene, scene_text(example, &sample).as_bytes())?;
        let film = self.folder.join("picture.exr");
        // Tiles are light without noise: samples only smooth their edges.
        let spp = match example.stand {
            Stand::Tile => settings.spp.min(64),
            _ => settings.spp,
        };
        let mut render = Command::new(&settings.impasto);
        render
            .arg("--quiet")
            .arg("render")
            .arg(&scene)
            .arg("--out")
            .arg(&film)
            .arg("--size")
            .arg(format!("{0}x{0}", settings.size))
            .args(["--spp", &spp.to_string()])
            .args(["--until", &format!("time={}s", settings.seconds)]);
        shell::capture(&mut render)
            .map_err(|why| format!("{} does not render:\n{why}", entry.id()))?;
        let picture = image::open(&film)
            .map_err(|e| format!("the picture of {} cannot be read: {e}", entry.id()))?;
        png(&picture.into_rgb32f(), example.stand != Stand::Tile)
    }
}

/// What is not the sample: grey paper with a checkered middle, a neutral core, black metal.
const STAGE: &str = "//! What stands around the sample.

use std::bsdf::diffuse;
use std::pattern::checker;

/// The ground: squares near the ball that fade into plain grey.
material ground {
    let near = 1.0 - smoothstep(2.5, 7.0, length(uv - vec2(160.0)));
    surface = diffuse(mix(0.34, mix(0.16, 0.52, checker(uv)), near));
}

/// The core of the ball, and walls.
material core { surface = diffuse(0.4); }

/// The housing of the lamp.
material dark { surface = diffuse(0.03); }
";

/// The scene of an example whose material is in the file `sample`.
fn scene_text(example: &Example, sample: &Path) -> String {
    let s = example.size / 0.1;
    let v = |x: f64, y: f64, z: f64| format!("[{:.6}, {:.6}, {:.6}]", x * s, y * s, z * s);
    let obj = match example.stand {
        Stand::Ball => "ball.obj",
        Stand::Tile => "tile.obj",
        Stand::Lamp => "lamp.obj",
    };
    let core = match example.stand {
        Stand::Lamp => "dark",
        _ => "core",
    };
    let mut text = format!(
        "name = \"gallery\"\ngeometry = [{{ obj = \"{obj}\", scale = {scale} }}]\n\n\
         [materials]\n\
         sample = {{ file = {sample:?}, material = \"{material}\" }}\n",
        scale = 0.01 * s,
        material = example.material,
    );
    let bound: &[(&str, &str)] = match example.stand {
        Stand::Ball => &[("core", core), ("ground", "ground")],
        Stand::Tile => &[],
        Stand::Lamp => &[("core", core), ("ground", "core"), ("wall", "core")],
    };
    for (name, material) in bound {
        text += &format!("{name} = {{ file = \"stage.impasto\", material = \"{material}\" }}\n");
    }
    text += &match example.stand {
        Stand::Ball => format!(
            "\n[camera]\nposition = {}\nlook_at = {}\nfov = 17.5\n\
             \n[integrator]\nmax_depth = 32\n\
             \n[environment]\nfile = \"surroundings.hdr\"\n\
             \n[[lights]]\nkind = \"quad\"\ncorner = {}\nu = {}\nv = {}\nradiance = [17.0, 16.2, 15.0]\n\
             \n[[lights]]\nkind = \"quad\"\ncorner = {}\nu = {}\nv = {}\nradiance = [9.0, 9.7, 11.0]\n",
            v(0.0, 0.20, 0.45),
            v(0.002, 0.0495, 0.0),
            // Key: from the upper left, in front. Its u x v points to the ball.
            v(-0.33, 0.30, 0.10),
            v(0.06, 0.14, -0.08),
            v(0.16, 0.0, 0.13),
            // Rim: a strip from the right behind.
            v(0.34, 0.04, -0.08),
            v(0.0, 0.24, 0.0),
            v(-0.10, 0.0, -0.20),
        ),
        Stand::Tile => format!(
            "\n[camera]\nposition = {}\nlook_at = {}\nfov = 5.7248\n\n[integrator]\nmax_depth = 1\n",
            v(0.05, 0.05, 1.0043),
            v(0.05, 0.05, 0.0),
        ),
        Stand::Lamp => format!(
            "\n[camera]\nposition = {}\nlook_at = {}\nfov = 20\n\
             \n[integrator]\nmax_depth = 6\n\n[environment]\ncolor = 0.02\n",
            v(0.0, 0.075, 0.50),
            v(0.0, 0.068, 0.0),
        ),
    };
    text
}

/// A PNG of linear radiance: sRGB, where `soft` with highlights that roll off, and with as many
/// bits a channel as fit.
fn png(film: &image::Rgb32FImage, soft: bool) -> Result<Vec<u8>> {
    for bits in [8, 7, 6, 5] {
        let step = 256.0 / f64::from(1 << bits);
        let bytes: Vec<u8> = film
            .as_raw()
            .iter()
            .map(|&x| {
                let x = f64::from(x).max(0.0);
                let x = if soft { shoulder(x) } else { x.min(1.0) };
                ((encoded(x) * 255.0 / step).round() * step).min(255.0) as u8
            })
            .collect();
        let mut file = Vec::new();
        PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Adaptive)
            .write_image(&bytes, film.width(), film.height(), ExtendedColorType::Rgb8)
            .map_err(|e| format!("cannot encode a picture: {e}"))?;
        if file.len() <= MOST_BYTES || bits == 5 {
            return Ok(file);
        }
    }
    Err("no number of bits was tried".to_owned())
}

/// Linear up to a knee, then towards 1 ever slower.
fn shoulder(x: f64) -> f64 {
    const KNEE: f64 = 0.6;
    if x <= KNEE {
        return x;
    }
    1.0 - (1.0 - KNEE) * (-(x - KNEE) / (1.0 - KNEE)).exp()
}

/// The sRGB encoding of a linear value in [0, 1]. Source: IEC 61966-2-1.
fn encoded(x: f64) -> f64 {
    if x <= 0.003_130_8 {
        return 12.92 * x;
    }
    1.055 * x.powf(1.0 / 2.4) - 0.055
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noisy_pictures_give_up_bits_to_stay_small() {
        let mut state = 1u32;
        let noise = image::Rgb32FImage::from_fn(192, 192, |_, _| {
            image::Rgb([0; 3].map(|_: u32| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                0.2 + 0.02 * (state >> 8) as f32 / (1 << 24) as f32
            }))
        });
        let file = png(&noise, true).expect("encodes");
        assert!(file.len() <= MOST_BYTES, "{} bytes", file.len());
        let read = image::load_from_memory(&file).expect("decodes").into_rgb8();
        let first = f64::from(read.get_pixel(9, 9).0[0]) / 255.0;
        assert!((first - encoded(0.21)).abs() < 0.04, "{first}");
    }

    #[test]
    fn highlights_roll_off_without_a_step() {
        assert_eq!(shoulder(0.3), 0.3);
        assert!((shoulder(0.6 + 1e-9) - 0.6).abs() < 1e-8);
        assert!(shoulder(5.0) < 1.0 && shoulder(5.0) > 0.99);
    }
}
