//! Scenes that are hard on some stage from reading to rendering. [`all`] lists them: those whose geometry is
//! ([`crate::geometry`]), and here those of many materials, lights and textures. Each row writes a scene of a
//! size that the caller names.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use crate::geometry;

/// A row of a table of scenes.
#[derive(Clone, Copy, Debug)]
pub struct HostileScene {
    /// What it is called.
    pub name: &'static str,
    /// What is in it, where `n` is its size.
    pub what: &'static str,
    /// A size at which a renderer that takes time or memory in the square of it fails.
    pub size: usize,
    make: fn(usize) -> Parts,
}

/// What differs from row to row.
#[derive(Default)]
pub(crate) struct Parts {
    pub(crate) obj: String,
    pub(crate) placements: String,
    /// Keys of the `[[geometry]]` entry.
    pub(crate) entry: String,
    /// Entries of `[[lights]]`.
    pub(crate) lights: String,
    /// The material of `m.impasto` for all names; `matte` if it is empty.
    pub(crate) material: &'static str,
    /// Entries of `[materials]` instead.
    pub(crate) bindings: String,
    /// Definitions of `m.impasto` beside those that every scene has.
    pub(crate) definitions: String,
    /// Further files.
    pub(crate) files: Vec<(String, Vec<u8>)>,
}

/// Those of many things.
pub const SCENES: &[HostileScene] = &[
    row(
        "instances",
        "n names bound to one material with n values",
        10_000,
        instances,
    ),
    row(
        "values",
        "n names of an MTL file, each with values of its own",
        10_000,
        values,
    ),
    row(
        "baked",
        "n names bound to one material, baked with n values",
        10_000,
        baked,
    ),
    row(
        "constants",
        "n materials that are equal but for constants",
        10_000,
        constants,
    ),
    row("codes", "n materials, no two of one code", 10_000, codes),
    row("unused", "n bindings that no face uses", 10_000, unused),
    row("suns", "n distant lights", 10_000, suns),
    row("lamps", "n quad lights at n places", 10_000, lamps),
    row(
        "textures",
        "n textures, each of a binding of its own",
        2_000,
        textures,
    ),
];

/// The scenes of every table.
pub fn all() -> impl Iterator<Item = &'static HostileScene> {
    geometry::SCENES.iter().chain(SCENES)
}

pub(crate) const fn row(
    name: &'static str,
    what: &'static str,
    size: usize,
    make: fn(usize) -> Parts,
) -> HostileScene {
    HostileScene {
        name,
        what,
        size,
        make,
    }
}

impl HostileScene {
    /// The row of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static HostileScene> {
        all().find(|scene| scene.name == name)
    }

    /// Writes the scene at size `n` with its files into a folder; returns the path of the scene.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, n: usize, folder: &Path) -> io::Result<PathBuf> {
        let parts = (self.make)(n);
        std::fs::write(folder.join("g.obj"), &parts.obj)?;
        std::fs::write(
            folder.join("m.impasto"),
            MATERIALS.to_owned() + &parts.definitions,
        )?;
        if !parts.placements.is_empty() {
            std::fs::write(folder.join("placements.txt"), &parts.placements)?;
        }
        for (name, bytes) in &parts.files {
            std::fs::write(folder.join(name), bytes)?;
        }
        let material = if parts.material.is_empty() {
            "matte"
        } else {
            parts.material
        };
        let for_all = format!("[materials.\"*\"]\nfile = 'm.impasto'\nmaterial = '{material}'\n");
        let Parts {
            entry,
            lights,
            bindings,
            ..
        } = &parts;
        let bindings = if bindings.is_empty() {
            &for_all
        } else {
            bindings
        };
        let scene = format!(
            "film = {{ width = 48, height = 32 }}\nintegrator = {{ max_depth = 4 }}\n\
             camera = {{ position = [0.0, 0.0, 4.0], look_at = [0.0, 0.0, 0.0], fov = 40 }}\n\
             environment.color = 0.5\n\
             [[geometry]]\nobj = 'g.obj'\n{entry}\n{lights}\n{bindings}"
        );
        let path = folder.join("scene.toml");
        std::fs::write(&path, scene)?;
        Ok(path)
    }
}

const MATERIALS: &str = "use std::bsdf::diffuse;\nuse std::edf::uniform;\n\
    material matte { surface = diffuse(0.6); }\n\
    material bright { surface = diffuse(0.6); emission = uniform(color(1)); }\n\
    material paint { param tint: color = 0.6; surface = diffuse(tint); }\n";

/// Squares that fill the picture, each with a name of its own (`m0`, `m1`, ...) for its material.
fn tiles(n: usize) -> Parts {
    let side = (1..).find(|side| side * side >= n).unwrap_or(1);
    let step = 2.4 / side as f64;
    let mut obj = String::from("mtllib g.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n");
    let mut mtl = String::new();
    for i in 0..n {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        let [left, right, low, high] = [x, x + 1.0, y, y + 1.0].map(|at| at * step - 1.2);
        let _ = write!(
            obj,
            "v {left} {low} 0\nv {right} {low} 0\nv {right} {high} 0\nv {left} {high} 0\n\
             usemtl m{i}\nf -4/1 -3/2 -2/3 -1/4\n"
        );
        let _ = writeln!(mtl, "newmtl m{i}\nKd {} 0.5 0.3", share(i, n));
    }
    Parts {
        obj,
        files: vec![("g.mtl".to_owned(), mtl.into_bytes())],
        ..Parts::default()
    }
}

/// The same, with a binding of each name: what `keys` says of it.
fn bound(n: usize, keys: impl Fn(usize) -> String) -> Parts {
    let bindings = (0..n).map(|i| format!("[materials.m{i}]\nfile = 'm.impasto'\n{}\n", keys(i)));
    Parts {
        bindings: bindings.collect(),
        ..tiles(n)
    }
}

fn tinted(i: usize, n: usize) -> String {
    format!(
        "material = 'paint'\nparams = {{ tint = [{}, 0.5, 0.3] }}",
        share(i, n)
    )
}

fn instances(n: usize) -> Parts {
    bound(n, |i| tinted(i, n))
}

fn values(n: usize) -> Parts {
    Parts {
        bindings: "[materials.\"*\"]\nfile = 'm.impasto'\nmaterial = 'paint'\n\
                   params = { tint = '$Kd' }\n"
            .to_owned(),
        ..tiles(n)
    }
}

fn baked(n: usize) -> Parts {
    bound(n, |i| tinted(i, n) + "\nbake = true")
}

/// Definitions in one file: fewer than a file may have.
const DEFINED_TOGETHER: usize = 500;

/// A definition `d0`, `d1`, ... for each name.
fn defined(n: usize, define: impl Fn(usize) -> String) -> Parts {
    let file = |from: usize| {
        let to = n.min(from + DEFINED_TOGETHER);
        let text: String = (from..to).map(&define).collect();
        let name = format!("d{}.impasto", from / DEFINED_TOGETHER);
        (
            name,
            format!("use std::bsdf::diffuse;\n{text}").into_bytes(),
        )
    };
    let bindings = (0..n).map(|i| {
        let at = i / DEFINED_TOGETHER;
        format!("[materials.m{i}]\nfile = 'd{at}.impasto'\nmaterial = 'd{i}'\n")
    });
    let parts = tiles(n);
    let files = (0..n).step_by(DEFINED_TOGETHER).map(file);
    Parts {
        bindings: bindings.collect(),
        files: parts.files.into_iter().chain(files).collect(),
        ..parts
    }
}

fn constants(n: usize) -> Parts {
    let define = |i| {
        format!(
            "material d{i} {{ surface = diffuse({:?}); }}\n",
            share(i, n)
        )
    };
    defined(n, define)
}

/// The bits of a number say what is done to a value, one after the other.
fn codes(n: usize) -> Parts {
    let bits = usize::BITS - n.leading_zeros();
    defined(n, |i| {
        let mut value = String::from("position.x");
        for bit in 0..bits {
            let name = if i >> bit & 1 == 1 { "sin" } else { "cos" };
            value = format!("{name}({value})");
        }
        format!("material d{i} {{ surface = diffuse(color(0.5 + 0.4 * {value})); }}\n")
    })
}

fn unused(n: usize) -> Parts {
    Parts {
        obj: geometry::triangles([(1.0, 0.0)].into_iter())
            .obj
            .replace("f ", "usemtl m0\nf "),
        files: Vec::new(),
        ..instances(n)
    }
}

fn suns(n: usize) -> Parts {
    let sun = |i| {
        let angle = 0.5 * std::f64::consts::PI * share(i, n);
        format!(
            "[[lights]]\nkind = 'distant'\nto_light = [{}, 0.2, {}]\nirradiance = {}\nangle = 0.5\n",
            angle.cos(),
            angle.sin(),
            1.0 / n as f64
        )
    };
    Parts {
        lights: (0..n).map(sun).collect(),
        ..tiles(1)
    }
}

fn lamps(n: usize) -> Parts {
    let lamp = |i| {
        format!(
            "[[lights]]\nkind = 'quad'\ncorner = [{}, 1.0, -1.0]\nu = [{}, 0.0, 0.0]\n\
             v = [0.0, 0.0, 2.0]\nradiance = 3.0\n",
            2.0 * share(i, n) - 1.0,
            1.0 / n as f64
        )
    };
    Parts {
        lights: (0..n).map(lamp).collect(),
        ..tiles(1)
    }
}

const WALLPAPER: &str = "material wallpaper {\n\
    param picture: texture = \"t0.hdr\";\n\
    surface = diffuse(image(picture, uv));\n}\n";

fn textures(n: usize) -> Parts {
    let keys = |i| format!("material = 'wallpaper'\nparams = {{ picture = '\"t{i}.hdr\"' }}");
    let parts = bound(n, keys);
    Parts {
        definitions: WALLPAPER.to_owned(),
        files: parts.files.into_iter().chain((0..n).map(picture)).collect(),
        ..parts
    }
}

/// A picture of 4 x 4 pixels, as Radiance HDR without compression.
fn picture(i: usize) -> (String, Vec<u8>) {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\n".to_vec();
    for pixel in 0..16 {
        // First bytes below 3 are marks of compression.
        bytes.extend([(10 + i % 240) as u8, (10 + i / 240) as u8, 8 * pixel, 128]);
    }
    (format!("t{i}.hdr"), bytes)
}

fn share(index: usize, n: usize) -> f64 {
    (index + 1) as f64 / n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_name_of_its_own_and_its_size() {
        let scenes: Vec<&HostileScene> = all().collect();
        for (index, scene) in scenes.iter().enumerate() {
            assert!(scenes[..index].iter().all(|other| other.name != scene.name));
            let [small, large] = [10, 100].map(|n| {
                let parts = (scene.make)(n);
                parts.obj.len()
                    + parts.placements.len()
                    + parts.lights.len()
                    + parts.bindings.len()
                    + parts.definitions.len()
            });
            assert!(small < large, "{}", scene.name);
        }
        assert_eq!(HostileScene::named("star").map(|s| s.size), Some(100_000));
        assert_eq!(HostileScene::named("suns").map(|s| s.size), Some(10_000));
        assert!(HostileScene::named("stars").is_none());
    }
}
