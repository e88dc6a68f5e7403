//! Media that scatter: that nothing is lost where nothing is absorbed, what slabs and half spaces
//! reflect and let pass, and that light is counted once however it is found.

use impasto_compiler::abi::Medium;
use impasto_compiler::partition::Strategy;
use impasto_runtime::render::Rendering;

use crate::gpu::media::assert_channel;
use crate::gpu::planes::{Light, Plane, Planes, Solid, Solids, Surface, picture, render, slab};
use crate::gpu::scene::{self, load_with};
use crate::gpu::stub::{gpu, mean, red, samples};

/// A solid with smooth surfaces.
fn cloudy(medium: Medium) -> Solid {
    Solid {
        surface: Surface::Smooth,
        medium: Some(medium),
    }
}

/// Seen along the z axis between a sky of 0.3 behind the camera and one of `front` before it.
fn seen(planes: Vec<Plane>, solids: &Solids, front: f32, samples: u32) -> Rendering {
    let planes = Planes {
        planes,
        sky: [0.3, front],
        max_depth: 2000,
        ..Planes::default()
    };
    let rendering = picture(&planes, solids, samples);
    assert_eq!(rendering.report.lost_paths, 0);
    rendering
}

/// What a slab of `medium` at index 1 reflects and lets pass of light at right angles, in one
/// channel, by following `count` photons in double precision: [reflected, passed].
fn photons(medium: &Medium, channel: usize, thickness: f64, count: u32) -> [f64; 2] {
    let scattering = f64::from(medium.scattering[channel]);
    let rate = scattering + f64::from(medium.absorption[channel]);
    let g = f64::from(medium.anisotropy);
    let mut state = 0x9E37_79B9_7F4A_7C15u64 + channel as u64;
    let mut uniform = move || {
        // Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number Generators".
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
    };
    let mut out = [0.0; 2];
    for _ in 0..count {
        let (mut depth, mut cosine, mut weight) = (0.0, 1.0, 1.0);
        loop {
            depth -= cosine * (1.0 - uniform()).ln() / rate;
            if !(0.0..=thickness).contains(&depth) {
                out[usize::from(depth > 0.0)] += weight;
                break;
            }
            weight *= scattering / rate;
            if weight < 1e-6 {
                break;
            }
            // The usual inverse of Henyey and Greenstein's function, and the law of cosines.
            let turn = if g.abs() < 1e-6 {
                2.0 * uniform() - 1.0
            } else {
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * uniform());
                (1.0 + g * g - s * s) / (2.0 * g)
            };
            let azimuth = (std::f64::consts::TAU * uniform()).cos();
            let sines = ((1.0 - turn * turn) * (1.0 - cosine * cosine))
                .max(0.0)
                .sqrt();
            cosine = (cosine * turn + sines * azimuth).clamp(-1.0, 1.0);
        }
    }
    out.map(|o| o / f64::from(count))
}

/// Chandrasekhar's H for isotropic scattering of albedo `w`, seen at right angles: his equation by
/// iteration ("Radiative Transfer", 1960, section 38).
fn h_function(w: f64) -> f64 {
    const NODES: usize = 400;
    let node = |i: usize| (i as f64 + 0.5) / NODES as f64;
    let root = (1.0 - w).sqrt();
    let mut h = vec![1.0; NODES];
    let next = |mu: f64, h: &[f64]| {
        let terms = h.iter().enumerate();
        let integral: f64 = terms.map(|(i, v)| node(i) * v / (mu + node(i))).sum();
        1.0 / (root + 0.5 * w * integral / NODES as f64)
    };
    for _ in 0..200 {
        h = (0..NODES).map(|i| next(node(i), &h)).collect();
    }
    next(1.0, &h)
}

#[test]
fn where_nothing_is_absorbed_an_even_sky_is_seen_evenly() {
    for ior in [1.0, 1.5] {
        let medium = Medium {
            scattering: [1.0, 3.0, 10.0],
            anisotropy: 0.5,
            ior,
            ..Medium::AIR
        };
        let rendering = seen(
            slab(0, 0.0, 1.0).into(),
            &Solids(vec![cloudy(medium)]),
            0.3,
            32,
        );
        for channel in 0..3 {
            assert_channel(&rendering, channel, 0.3);
        }
    }
}

#[test]
fn a_slab_reflects_and_passes_what_photons_do() {
    for anisotropy in [0.0, 0.8, -0.6] {
        let medium = Medium {
            absorption: [0.5, 0.1, 0.0],
            scattering: [1.0, 4.0, 2.0],
            anisotropy,
            ..Medium::AIR
        };
        let rendering = seen(
            slab(0, 0.0, 1.0).into(),
            &Solids(vec![cloudy(medium)]),
            1.0,
            256,
        );
        for channel in 0..3 {
            let [reflected, passed] = photons(&medium, channel, 1.0, 1 << 20);
            assert_channel(&rendering, channel, passed + 0.3 * reflected);
        }
    }
}

#[test]
fn a_half_space_reflects_by_chandrasekhar() {
    let albedo = [0.5, 0.9, 0.98];
    let medium = Medium {
        absorption: albedo.map(|w| 10.0 * (1.0 - w)),
        scattering: albedo.map(|w| 10.0 * w),
        ..Medium::AIR
    };
    let rendering = seen(
        slab(0, 0.0, 100.0).into(),
        &Solids(vec![cloudy(medium)]),
        0.0,
        256,
    );
    for (channel, w) in albedo.into_iter().enumerate() {
        let reflected = 1.0 - (1.0 - f64::from(w)).sqrt() * h_function(f64::from(w));
        assert_channel(&rendering, channel, 0.3 * reflected);
    }
}

/// Between boundaries that scatter too, the sky can be sampled from them, or be found by chance only.
#[test]
fn light_is_counted_once_however_it_is_found() {
    let medium = Medium {
        absorption: [0.2, 0.0, 0.1],
        scattering: [0.5, 2.0, 4.0],
        anisotropy: 0.3,
        ..Medium::AIR
    };
    let solids = Solids(vec![Solid {
        surface: Surface::Translucent(0.9),
        medium: Some(medium),
    }]);
    let by = |light, strategy, samples| {
        let planes = Planes {
            planes: slab(0, 0.0, 1.0).into(),
            sky: [0.3, 1.0],
            light,
            ..Planes::default()
        };
        render(&planes, &solids, strategy, samples)
    };
    let chance = by(Light::None, Strategy::OWN, 2048);
    let sampled = by(Light::Sky, Strategy::OWN, 256);
    let mega = by(Light::Sky, Strategy::MEGA, 256);
    if gpu().info().kind == "software" {
        assert!(mega.film == sampled.film);
    }
    for channel in 0..3 {
        let values = chance.film.pixels.iter().map(|p| f64::from(p[channel]));
        assert_channel(&sampled, channel, crate::gpu::stub::mean(values).0);
    }
}

/// What is hidden by a medium of higher priority scatters nothing there.
#[test]
fn a_hidden_medium_does_not_scatter() {
    let clear = Medium {
        absorption: [0.3, 0.1, 0.5],
        priority: 2,
        ..Medium::AIR
    };
    let milk = Medium {
        absorption: [0.1; 3],
        scattering: [2.0, 1.0, 0.5],
        priority: 1,
        ..Medium::AIR
    };
    let solids = Solids(vec![cloudy(clear), cloudy(milk)]);
    // Of the milk from 0.25 to 1 only what lies beyond 0.5 is there.
    let planes = [slab(0, 0.0, 0.5), slab(1, 0.25, 1.0)].concat();
    let rendering = seen(planes, &solids, 1.0, 256);
    for channel in 0..3 {
        let through = (-0.5 * f64::from(clear.absorption[channel])).exp();
        let [reflected, passed] = photons(&milk, channel, 0.5, 1 << 20);
        // Light that comes back passes the clear part at an angle, and some of what it meets there
        // is lost: followed in the direction of the sky of 0.3 it is bounded by both ends.
        let values = rendering.film.pixels.iter().map(|p| f64::from(p[channel]));
        let (mean, error) = crate::gpu::stub::mean(values);
        let most = through * (passed + 0.3 * reflected * through);
        let least = through * passed;
        assert!(
            mean < most + 4.0 * error && mean > least + 4.0 * error,
            "{mean} in {least} {most}"
        );
    }
}

/// A lamp in fog over a floor: light that the floor scatters and the fog turns into the lamp is found by
/// chance only, and light samples take nothing from its weight.
#[test]
fn light_that_fog_turns_counts_in_full_beside_light_samples() {
    const FLOOR: &str = "v -4 0 -4\nv -4 0 4\nv 4 0 4\nv 4 0 -4\nusemtl floor\nf 1 2 3 4\n";
    const FOG: &str = "use std::bsdf::{diffuse, transparent};
material fog { surface = transparent(); interior = medium(scattering: color(0.8)); }
material floor { surface = diffuse(0.8); }
";
    let toml = |sample: bool| {
        format!(
            "film = {{ width = 8, height = 8 }}\n\
             integrator = {{ max_depth = 3, roulette_start = 1000 }}\n\
             camera = {{ position = [0, 0.6, 1], look_at = [0, 0, 0], fov = 40, medium = 'block' }}\n\
             [[geometry]]\nobj = 'floor.obj'\n\
             [[geometry]]\nobj = 'block.obj'\nscale = 40\n\
             [materials.floor]\nfile = 'fog.impasto'\nmaterial = 'floor'\n\
             [materials.block]\nfile = 'fog.impasto'\nmaterial = 'fog'\n\
             [[lights]]\nkind = 'quad'\ncorner = [-1.5, 1.5, -1.5]\nu = [3, 0, 0]\nv = [0, 0, 3]\n\
             radiance = [5, 5, 5]\nsample = {sample}\n"
        )
    };
    let of = |sample| {
        let files = [("floor.obj", FLOOR), ("fog.impasto", FOG)];
        let (scene, program) = load_with(&toml(sample), &files);
        scene::render(&scene, &program, "wavefront", &samples(512))
    };
    let (by_chance, with_samples) = (of(false), of(true));
    assert!(with_samples.report.items_of("shadow") > Some(0));
    let pairs = red(&by_chance).zip(red(&with_samples));
    let (difference, error) = mean(pairs.map(|(a, b)| a - b));
    assert!(
        difference.abs() <= 4.0 * error,
        "{difference} +- {error} are missing"
    );
}
