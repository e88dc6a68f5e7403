//! Whole pictures at the ends of what light and materials can be: closed forms, and two ways to
//! the same mean.

use std::f64::consts::PI;
use std::path::PathBuf;

use impasto_compiler::abi::Emission;
use impasto_runtime::render::Rendering;

use crate::gpu::scene::{load, load_with, render, room};
use crate::gpu::stub::{Kind, Room, materials, mean, red, samples};
use crate::record::{Bound, Row, effort};

/// Samples a pixel, fewer or many.
fn spp(fast: u32, full: u32) -> u32 {
    effort(fast as usize, full as usize) as u32
}

/// Notes and holds a mean against what it should be, in standard errors.
#[track_caller]
fn hold_mean(table: &str, subject: &str, place: &str, rendering: &Rendering, expected: f64) {
    let (found, error) = mean(red(rendering));
    let z = (found - expected).abs() / error.max(2e-6 * expected);
    hold_z(table, subject, place, z);
}

#[track_caller]
fn hold_z(table: &str, subject: &str, place: &str, z: f64) {
    let good = Row {
        table,
        subject,
        what: "difference of means, in standard errors",
        worst: z,
        bound: Bound::AtMost(4.0),
        place,
    }
    .note();
    assert!(good, "{subject}, {place}: z = {z}");
}

/// The sum that a path of at most `depth` segments gathers between walls that emit 1.
fn series(albedo: f64, depth: i32) -> f64 {
    (0..depth).map(|k| albedo.powi(k)).sum()
}

/// Row 25: albedos over 1 and next to none.
#[test]
fn roulette_is_fair_at_throughputs_over_one_and_near_none() {
    for (albedo, depth) in [
        (1.2, 6),
        (3.0, 3),
        (1.0, 10),
        (0.3, 8),
        (1e-4, 4),
        (1e-8, 3),
    ] {
        for start in [1, 2] {
            let room = Room {
                max_depth: depth as u32,
                roulette_start: start,
                ..Room::default()
            };
            let surfaces = materials(&[Kind::Diffuse(albedo as f32)]);
            let place = format!("albedo {albedo}, {depth} segments, from segment {start}");
            let options = samples(spp(64, 4096));
            let expected = series(f64::from(albedo as f32), depth);
            let both = crate::gpu::stub::picture(&room.world(), &surfaces, &options);
            hold_mean("25", "roulette in a closed room", &place, &both, expected);
            let scattered =
                crate::gpu::stub::picture(&room.scattering().world(), &surfaces, &options);
            hold_mean(
                "25",
                "roulette in a closed room, by scattering",
                &place,
                &scattered,
                expected,
            );
            if albedo >= 0.3 && (albedo < 0.95 || start == 1) {
                let (_, error) = mean(red(&scattered));
                assert!(error > 1e-6, "{place}: roulette ended no path");
            }
        }
    }
}

/// Row 28: a sun of 1e6 in a sky of 1e-3 above a diffuse plane, whose light is a sum over texels.
#[test]
fn a_sun_of_a_million_in_a_dark_sky_is_neither_lost_nor_too_much() {
    let (width, height) = (16u32, 8u32);
    let sun = |x: u32, y: u32| if (x, y) == (4, 2) { 1e6f32 } else { 1e-3 };
    let texels: Vec<f32> = (0..width * height)
        .map(|i| sun(i % width, i / width))
        .collect();
    let picture = image::Rgb32FImage::from_fn(width, height, |x, y| image::Rgb([sun(x, y); 3]));
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sky.exr");
    picture.save(&file).expect("written");
    let toml = |sample: bool| {
        format!(
            "film = {{ width = 24, height = 16 }}\n\
             integrator = {{ max_depth = 2, roulette_start = 1000 }}\n\
             camera = {{ position = [0, 0.9, 0.01], look_at = [0, 0.4, 0], fov = 20 }}\n\
             environment = {{ file = '{}', sample = {sample} }}\n\
             [[geometry]]\nobj = 'block.obj'\n\
             [materials.block]\nfile = 'm.impasto'\nmaterial = 'dull'\n",
            file.display()
        )
    };
    let expected = 0.6 / PI * irradiance(&texels, width, height);
    let (scene, program) = load(&toml(true));
    let rendering = render(&scene, &program, "processor", &samples(spp(64, 4096)));
    hold_mean(
        "28",
        "a sun of 1e6 in a sky of 1e-3",
        "over a diffuse plane",
        &rendering,
        expected,
    );
    assert_eq!(rendering.report.nonfinite_samples, 0);
    let (_, error) = mean(red(&rendering));
    assert!(
        error < 0.02 * expected,
        "{error} of {expected}: the sun is not sampled"
    );
}

/// What a plane that faces up receives: the bilinear lookup, summed finely.
fn irradiance(texels: &[f32], width: u32, height: u32) -> f64 {
    let fine = 64;
    let at = |x: i64, y: i64| {
        let x = x.rem_euclid(i64::from(width)) as u32;
        let y = y.clamp(0, i64::from(height) - 1) as u32;
        f64::from(texels[(y * width + x) as usize])
    };
    let (columns, rows) = (fine * i64::from(width), fine * i64::from(height));
    let mut sum = 0.0;
    for j in 0..rows / 2 {
        let edge = |j: i64| (PI * j as f64 / rows as f64).cos();
        // cos theta sin theta d theta is half the difference of squared cosines.
        let weight = 0.5 * (edge(j).powi(2) - edge(j + 1).powi(2)) * 2.0 * PI / columns as f64;
        let y = (j as f64 + 0.5) / fine as f64 - 0.5;
        for i in 0..columns {
            let x = (i as f64 + 0.5) / fine as f64 - 0.5;
            let (left, top) = (x.floor() as i64, y.floor() as i64);
            let (a, b) = (x - x.floor(), y - y.floor());
            let row = |y| (1.0 - a) * at(left, y) + a * at(left + 1, y);
            sum += weight * ((1.0 - b) * row(top) + b * row(top + 1));
        }
    }
    sum
}

/// Row 28: a glossy block beside a small bright lamp. Scattering alone and both strategies together
/// find the same light.
#[test]
fn glossy_surfaces_see_sharp_lights_alike_by_either_strategy() {
    const GLOSSY: &str = "use std::bsdf::conductor;
material glossy { param roughness: float = 0.1; surface = conductor(ior: color(0.2), extinction: color(3), roughness: roughness); }
";
    for roughness in [0.08, 0.3] {
        let toml = |sample: bool| {
            format!(
                "film = {{ width = 16, height = 12 }}\n\
                 integrator = {{ max_depth = 2, roulette_start = 1000 }}\n\
                 camera = {{ position = [0.3, 1.4, 1.6], look_at = [0, 0.4, 0], fov = 20 }}\n\
                 [[geometry]]\nobj = 'block.obj'\n\
                 [materials.block]\nfile = 'glossy.impasto'\nparams.roughness = {roughness:?}\n\
                 [[lights]]\nkind = 'quad'\ncorner = [-0.5, 1.9, -2.1]\nu = [0.5, 0, 0]\nv = [0, 0.2, 0.2]\n\
                 radiance = [1000, 1000, 1000]\nsample = {sample}\ntwo_sided = true\n"
            )
        };
        let of = |sample, count| {
            let (scene, program) = load_with(&toml(sample), &[("glossy.impasto", GLOSSY)]);
            render(&scene, &program, "wavefront", &samples(count))
        };
        let (both, found) = (of(true, spp(128, 4096)), of(false, spp(1024, 65_536)));
        assert!(both.report.items_of("shadow") > Some(0));
        assert!(red(&both).filter(|v| *v > 1.0).count() > 3, "no highlight");
        let (difference, error) = mean(red(&both).zip(red(&found)).map(|(a, b)| a - b));
        let place = format!("roughness {roughness}");
        hold_z(
            "28",
            "a glossy block beside a small lamp",
            &place,
            difference.abs() / error,
        );
    }
}

/// Every pixel sees the mean of what lies behind it: half a pixel aside would be 6 standard errors.
#[test]
fn pixels_see_where_the_camera_says() {
    let (width, height, distance, fov) = (24, 16, 2.6, 10.0f64);
    let toml = format!(
        "film = {{ width = {width}, height = {height} }}\nintegrator.max_depth = 1\n\
         camera = {{ position = [0.02, 0.03, 3], look_at = [0.02, 0.03, 0], fov = {fov} }}\n\
         [[geometry]]\nobj = 'block.obj'\n\
         [materials.block]\nfile = 'm.impasto'\nmaterial = 'chart'\n"
    );
    let (scene, program) = load(&toml);
    let rendering = render(&scene, &program, "processor", &samples(64));
    let pixel = 2.0 * distance * (0.5 * fov.to_radians()).tan() / f64::from(height);
    let mut worst = 0.0f64;
    for (index, [r, g, _]) in rendering.film.pixels.iter().enumerate() {
        let (column, row) = (index % width as usize, index / width as usize);
        let x = 0.02 + pixel * (column as f64 + 0.5 - 0.5 * f64::from(width));
        let y = 0.03 - pixel * (row as f64 + 0.5 - 0.5 * f64::from(height));
        let apart = [f64::from(*r) - 1.0 - x, f64::from(*g) - 1.0 - y];
        worst = apart.into_iter().fold(worst, |w, d| w.max(d.abs() / pixel));
    }
    let good = Row {
        table: "11",
        subject: "camera",
        what: "largest distance of a pixel's mean from its centre, in pixels",
        worst,
        bound: Bound::AtMost(0.2),
        place: "64 samples a pixel",
    }
    .note();
    assert!(good, "{worst} pixels");
}

/// A lens samples all of its disc evenly: out of focus, the edge of a light is as bright as the part of
/// the disc that sees it.
#[test]
fn an_edge_out_of_focus_is_seen_by_its_share_of_the_lens() {
    // Rays through a point of the lens meet at 2 m, and come to half of that on the other side at 3 m.
    for (radius, edge) in [(0.2, 0.05), (0.2, -0.05), (0.4, 0.15)] {
        let toml = format!(
            "film = {{ width = 4, height = 4 }}\nintegrator.max_depth = 1\n\
             camera = {{ position = [0, 0, 3], look_at = [0, 0, 0], fov = 0.01, aperture = {}, focus = 2 }}\n\
             [[geometry]]\nobj = 'block.obj'\ntranslate = [0, 0, -9]\n\
             [materials.block]\nfile = 'm.impasto'\nmaterial = 'net'\n\
             [[lights]]\nkind = 'quad'\ncorner = [{edge}, -5, 0]\nu = [9, 0, 0]\nv = [0, 10, 0]\n\
             radiance = [1, 1, 1]\n",
            2.0 * radius
        );
        let (scene, program) = load(&toml);
        let rendering = render(&scene, &program, "processor", &samples(spp(256, 4096)));
        // The segment of the disc beyond a chord.
        let chord: f64 = 2.0 * edge / radius;
        let share = (chord.acos() - chord * (1.0 - chord * chord).sqrt()) / PI;
        let (found, error) = mean(red(&rendering));
        let place = format!("lens of {radius}, edge at {edge}");
        hold_z("11", "lens", &place, (found - share).abs() / error);
    }
}

/// White furnace: no material that does not emit is brighter than the even sky around it.
#[test]
fn no_material_is_brighter_than_an_even_sky() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("materials")
        .flatten()
        .map(|e| e.path())
        .collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "impasto"));
    files.sort();
    assert!(files.len() >= 20, "only {} materials", files.len());
    for file in files {
        let name = file
            .file_stem()
            .and_then(|n| n.to_str())
            .expect("a name")
            .to_owned();
        let toml = format!(
            "film = {{ width = 12, height = 8 }}\n\
             integrator = {{ max_depth = 32, roulette_start = 1000 }}\n\
             camera = {{ position = [0.9, 0.8, 1.1], look_at = [0, 0, 0], fov = 30 }}\n\
             environment = {{ color = 1, sample = true }}\n\
             [[geometry]]\nobj = 'ball.obj'\n\
             [materials.ball]\nfile = '{}'\nmaterial = '{name}'\n",
            file.display()
        );
        let (scene, program) = load(&toml);
        let emits = program
            .instances()
            .iter()
            .any(|i| i.info.emission != Emission::None);
        let rendering = render(&scene, &program, "processor", &samples(spp(16, 4096)));
        assert_eq!(rendering.report.nonfinite_samples, 0, "{name}");
        if emits {
            continue;
        }
        let channel = |c: usize| mean(rendering.film.pixels.iter().map(|p| f64::from(p[c])));
        let over = |(mean, error): (f64, f64)| (mean - 1.0) / error.max(2.5e-3);
        let worst = [0, 1, 2]
            .map(|c| over(channel(c)))
            .into_iter()
            .fold(f64::MIN, f64::max);
        let good = Row {
            table: "furnace",
            subject: &name,
            what: "what a ball in an even sky of 1 has more than 1, in standard errors (of 0.0025 at least)",
            worst,
            bound: Bound::AtMost(4.0),
            place: "materials/, whole renders",
        }
        .note();
        assert!(good, "{name}: {:?}", [0, 1, 2].map(channel));
    }
}

/// Row 29 with light samples and roulette of the real kernels, in a room of compiled walls.
#[test]
fn a_nearly_white_room_keeps_its_closed_form() {
    const WALLS: &str = "use std::bsdf::diffuse; use std::edf::uniform;
material white { surface = diffuse(0.98); emission = uniform(color(0.02)); }
";
    let toml = room(1.0, 0.0, 1000)
        .replace("m.impasto", "white.impasto")
        .replace("'glowing'", "'white'")
        + "[integrator]\n";
    let toml = toml
        .replace(
            "integrator.max_depth = 1000\n",
            "integrator = { max_depth = 1000, roulette_start = 900 }\n",
        )
        .replace("[integrator]\n", "");
    let (scene, program) = load_with(&toml, &[("white.impasto", WALLS)]);
    let rendering = render(&scene, &program, "processor", &samples(spp(1, 64)));
    hold_mean(
        "29",
        "a room of albedo 0.98 and emission 0.02",
        "1000 segments",
        &rendering,
        1.0,
    );
}

/// White materials under an even sky give back what they get, within a hundredth.
#[test]
fn white_surfaces_vanish_in_an_even_sky() {
    const WHITES: &str = "use std::bsdf::{dielectric, diffuse, generalized_schlick, metal};
material rough_metal { surface = metal(reflectance: 1, edge: 1, roughness: 1); }
material satin_metal { surface = metal(reflectance: 1, edge: 1, roughness: 0.5); }
material rough_schlick { surface = generalized_schlick(color0: 1, color82: 1, color90: 1, roughness: 1); }
material frosted { surface = dielectric(ior: 1.5, roughness: 0.5); }
material chalk { surface = diffuse(1); }
";
    for name in [
        "rough_metal",
        "satin_metal",
        "rough_schlick",
        "frosted",
        "chalk",
    ] {
        let toml = format!(
            "film = {{ width = 16, height = 16 }}\n\
             integrator = {{ max_depth = 64, roulette_start = 1000 }}\n\
             camera = {{ position = [0.9, 0.8, 1.1], look_at = [0, 0, 0], fov = 24 }}\n\
             environment = {{ color = 1, sample = true }}\n\
             [[geometry]]\nobj = 'ball.obj'\n\
             [materials.ball]\nfile = 'whites.impasto'\nmaterial = '{name}'\n",
        );
        let (scene, program) = load_with(&toml, &[("whites.impasto", WHITES)]);
        let rendering = render(&scene, &program, "processor", &samples(spp(64, 8192)));
        let (found, error) = mean(red(&rendering));
        let good = Row {
            table: "26",
            subject: name,
            what: "what a white ball in an even sky of 1 has more or less than 1",
            worst: (found - 1.0).abs(),
            bound: Bound::AtMost(0.01),
            place: "whole renders",
        }
        .note();
        assert!(good, "{name}: {found} +- {error}");
    }
}

/// Row 16: on a coarse ball with smooth normals these face away from the view near the rim; what is
/// seen there is not black.
#[test]
fn normals_that_face_away_leave_no_black_spots() {
    const SHINY: &str = "use std::bsdf::{conductor, diffuse, smooth_conductor};
material dull { surface = diffuse(0.8); }
material glossy { surface = conductor(ior: color(0.2), extinction: color(4), roughness: 0.3); }
material silver { surface = smooth_conductor(ior: color(0.2), extinction: color(4)); }
";
    let ball = super::places::smooth_ball();
    for name in ["dull", "glossy", "silver"] {
        let toml = format!(
            "film = {{ width = 32, height = 32 }}\n\
             integrator = {{ max_depth = 8, roulette_start = 1000 }}\n\
             camera = {{ position = [0.9, 0.8, 1.1], look_at = [0, 0, 0], fov = 36 }}\n\
             environment = {{ color = 1, sample = true }}\n\
             [[geometry]]\nobj = 'smooth.obj'\n\
             [materials.ball]\nfile = 'shiny.impasto'\nmaterial = '{name}'\n",
        );
        let (scene, program) = load_with(&toml, &[("shiny.impasto", SHINY), ("smooth.obj", &ball)]);
        let rendering = render(&scene, &program, "processor", &samples(spp(32, 4096)));
        let darkest = red(&rendering).fold(f64::INFINITY, f64::min);
        let good = Row {
            table: "16",
            subject: name,
            what: "darkest pixel of a coarse smooth ball in an even sky of 1",
            worst: darkest,
            bound: Bound::AtLeast(0.5),
            place: "rim of the ball",
        }
        .note();
        assert!(good, "{name}: {darkest}");
        assert_eq!(rendering.report.nonfinite_samples, 0, "{name}");
    }
}
