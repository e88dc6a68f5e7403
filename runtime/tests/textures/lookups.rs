//! How lookups wrap, filter and choose levels, against a host that does the same from definitions.

use image::{ImageBuffer, ImageFormat, Rgba};
use impasto_compiler::abi::{Lookups, TextureSpace, texture_mode};
use impasto_runtime::wgsl::ShaderPart;

use crate::support::{Row, floats, run};
use crate::textures::{encode, part};

/// Everything that a lookup can be.
const ALL: Lookups = Lookups {
    levels: true,
    ..Lookups::ANY_MODE
};

/// The numbers of a picture, the top row first.
struct Numbers {
    width: usize,
    height: usize,
    texels: Vec<f64>,
}

impl Numbers {
    /// Without any pattern, so that no texel stands for another; exact in 8 bits.
    fn scattered(width: usize, height: usize) -> Self {
        let level = |i: usize| ((i * 97 + i * i * 13 + 41) % 256) as f64 / 255.0;
        Self {
            width,
            height,
            texels: (0..width * height).map(level).collect(),
        }
    }

    fn file(&self) -> Vec<u8> {
        let (width, height) = (self.width as u32, self.height as u32);
        let picture = ImageBuffer::from_fn(width, height, |x, y| {
            let level = self.texels[y as usize * self.width + x as usize] * 255.0;
            Rgba([level.round() as u8, 0, 0, 255])
        });
        encode(picture, ImageFormat::Png)
    }

    /// What stands at any column and row: its wrap decides along each.
    fn at(&self, i: i64, j: i64, wraps: [i32; 2]) -> f64 {
        let place = |i: i64, n: usize, wrap: i32| {
            let n = n as i64;
            match wrap {
                0 => Some(i.rem_euclid(n)),
                // Copies, every other one backwards.
                1 if i.div_euclid(n) % 2 != 0 => Some(n - 1 - i.rem_euclid(n)),
                1 => Some(i.rem_euclid(n)),
                2 => Some(i.max(0).min(n - 1)),
                _ => (0..n).contains(&i).then_some(i),
            }
        };
        let column = place(i, self.width, wraps[0]);
        let row = place(j, self.height, wraps[1]);
        match (column, row) {
            (Some(x), Some(y)) => self.texels[y as usize * self.width + x as usize],
            _ => 0.0,
        }
    }

    /// The sum over all texels near (x, y), in texels from the upper left corner, of their values by
    /// the weight that `kernel` has at their distance along each axis.
    fn convolved(&self, [x, y]: [f64; 2], wraps: [i32; 2], kernel: impl Fn(f64) -> f64) -> f64 {
        let near = |c: f64| c.floor() as i64 - 3..=c.floor() as i64 + 3;
        let mut sum = 0.0;
        for j in near(y) {
            for i in near(x) {
                let weight = kernel(x - (i as f64 + 0.5)) * kernel(y - (j as f64 + 0.5));
                if weight != 0.0 {
                    sum += weight * self.at(i, j, wraps);
                }
            }
        }
        sum
    }

    /// A lookup without a width.
    fn lookup(&self, [u, v]: [f64; 2], wraps: [i32; 2], filter: i32) -> f64 {
        let at = [u * self.width as f64, (1.0 - v) * self.height as f64];
        match filter {
            0 => self.convolved(at, wraps, |d| (1.0 - d.abs()).max(0.0)),
            1 => self.at(at[0].floor() as i64, at[1].floor() as i64, wraps),
            _ => self.convolved(at, wraps, b_spline),
        }
    }

    /// The picture with half as many texels along each side, which must be even or 1.
    fn half(&self) -> Self {
        let step = |n: usize| if n > 1 { 2 } else { 1 };
        let (sx, sy) = (step(self.width), step(self.height));
        let (width, height) = (self.width / sx, self.height / sy);
        let mean = |k: usize| {
            let (x, y) = (sx * (k % width), sy * (k / width));
            let block = (0..sx * sy).map(|t| self.texels[(y + t / sx) * self.width + x + t % sx]);
            block.sum::<f64>() / (sx * sy) as f64
        };
        Self {
            width,
            height,
            texels: (0..width * height).map(mean).collect(),
        }
    }
}

fn b_spline(d: f64) -> f64 {
    let d = d.abs();
    if d < 1.0 {
        2.0 / 3.0 - d * d + d * d * d / 2.0
    } else {
        (2.0 - d).max(0.0).powi(3) / 6.0
    }
}

/// A place, a width and a mode.
#[derive(Clone, Copy, Debug)]
struct Asked {
    slot: u32,
    uv: [f32; 2],
    width: [f32; 2],
    mode: i32,
}

/// What the functions of kernels give: `texture_fetch_wide` where a width is asked for.
fn fetch(part: &ShaderPart, asked: &[Asked]) -> Vec<[f32; 4]> {
    let rows = |a: &Asked| {
        let at = [a.uv[0], a.uv[1], a.width[0], a.width[1]];
        [at.map(f32::to_bits), [a.slot, a.mode as u32, 0, 0]]
    };
    let input: Vec<Row> = asked.iter().flat_map(rows).collect();
    let body = "
        let at = bitcast<vec4<f32>>(input[2u * i]);
        let question = input[2u * i + 1u];
        var texel = texture_fetch_wide(question.x, at, i32(question.y));
        if all(at.zw == vec2<f32>(0.0)) {
            texel = texture_fetch_as(question.x, at.xy, i32(question.y));
        }
        result[i] = bitcast<vec4<u32>>(texel);";
    let rows = run(&[part], body, &input, asked.len(), asked.len());
    rows.into_iter().map(floats).collect()
}

const SIZES: [(usize, usize); 6] = [(4, 2), (3, 5), (1, 1), (1, 7), (6, 1), (2, 3)];

#[test]
fn every_way_to_wrap_and_filter_is_what_it_is_by_definition() {
    let pictures: Vec<Numbers> = SIZES.map(|(w, h)| Numbers::scattered(w, h)).into();
    let names: Vec<String> = (0..pictures.len()).map(|i| format!("{i}.png")).collect();
    let named = names.iter().zip(&pictures);
    let files: Vec<_> = named
        .map(|(name, p)| (name.as_str(), p.file(), TextureSpace::Data, ALL))
        .collect();
    let part = part(&files).expect("they load");
    let mut asked = Vec::new();
    let mut expected = Vec::new();
    for (slot, picture) in pictures.iter().enumerate() {
        let (w, h) = (picture.width as f64, picture.height as f64);
        for mode in 0..48 {
            // Centres, edges and what lies between, from two pictures before to two after.
            for k in 0..80u32 {
                let (a, b) = (f64::from(k % 10), f64::from(k / 10));
                let step = |k: f64, n: f64| (k * 0.47 - 2.1) + (0.25 + (k % 2.0) * 0.25) / n;
                let uv = [step(a, w), step(b, h)].map(|c| c as f32);
                asked.push(Asked {
                    slot: slot as u32,
                    uv,
                    width: [0.0; 2],
                    mode,
                });
                let exact = uv.map(f64::from);
                let wraps = [mode & 3, mode >> 2 & 3];
                expected.push(picture.lookup(exact, wraps, mode >> 4));
            }
            // Exactly on centres, beyond all four edges too: no average, or a whole texel off.
            for (i, j) in [(0, 0), (-1, 0), (0, -1), (5, 2), (-3, 7), (1, 1)] {
                let uv = [(f64::from(i) + 0.5) / w, 1.0 - (f64::from(j) + 0.5) / h];
                asked.push(Asked {
                    slot: slot as u32,
                    uv: uv.map(|c| c as f32),
                    width: [0.0; 2],
                    mode,
                });
                let wraps = [mode & 3, mode >> 2 & 3];
                expected.push(match mode >> 4 {
                    2 => picture.lookup(uv, wraps, 2),
                    _ => picture.at(i64::from(i), i64::from(j), wraps),
                });
            }
        }
    }
    assert_eq!(texture_mode(3, 3, 2), 47, "every mode was asked for");
    let mut wrong = Vec::new();
    for ((asked, expected), [found, ..]) in asked.iter().zip(&expected).zip(fetch(&part, &asked)) {
        if (f64::from(found) - expected).abs() > 1e-3 {
            wrong.push(format!("{found} instead of {expected} for {asked:?}"));
        }
    }
    let first: Vec<&String> = wrong.iter().take(8).collect();
    assert!(
        wrong.is_empty(),
        "{} of {}: {first:#?}",
        wrong.len(),
        expected.len()
    );
}

#[test]
fn levels_are_chosen_by_the_shorter_side_and_taps_go_along_the_longer() {
    let picture = Numbers::scattered(16, 16);
    let mut levels = vec![Numbers::scattered(16, 16)];
    while levels[levels.len() - 1].width > 1 {
        let next = levels[levels.len() - 1].half();
        levels.push(next);
    }
    let file = ("a.png", picture.file(), TextureSpace::Data, ALL);
    let part = part(&[file]).expect("it loads");
    let level = |l: usize, uv: [f64; 2]| levels[l].lookup(uv, [0, 0], 0);
    // Widths in texels, and what they mean at a place.
    type Meaning<'m> = Box<dyn Fn([f64; 2]) -> f64 + 'm>;
    let taps = |l: usize, n: i32, width: f64, axis: usize| {
        move |uv: [f64; 2]| {
            let at = |i: i32| {
                let mut uv = uv;
                uv[axis] += (f64::from(i) + 0.5 - 0.5 * f64::from(n)) * width / 16.0 / f64::from(n);
                uv
            };
            (0..n).map(|i| level(l, at(i))).sum::<f64>() / f64::from(n)
        }
    };
    let cases: Vec<([f64; 2], Meaning<'_>)> = vec![
        ([0.3, 0.7], Box::new(|uv| level(0, uv))),
        ([1.0, 1.0], Box::new(|uv| level(0, uv))),
        ([2.0, 2.0], Box::new(|uv| level(1, uv))),
        ([-4.0, 4.0], Box::new(|uv| level(2, uv))),
        ([8.0, 8.0], Box::new(|uv| level(3, uv))),
        ([16.0, 16.0], Box::new(|uv| level(4, uv))),
        ([500.0, 500.0], Box::new(|uv| level(4, uv))),
        (
            [8f64.sqrt(), 8f64.sqrt()],
            Box::new(|uv| 0.5 * (level(1, uv) + level(2, uv))),
        ),
        ([4.0, 1.0], Box::new(taps(0, 4, 4.0, 0))),
        ([1.0, 4.0], Box::new(taps(0, 4, 4.0, 1))),
        ([2.0, 6.0], Box::new(taps(1, 3, 6.0, 1))),
        // No more than eight taps: the shorter side counts as an eighth of the longer.
        ([16.0, 0.0], Box::new(taps(1, 8, 16.0, 0))),
        ([0.0, 16.0], Box::new(taps(1, 8, 16.0, 1))),
    ];
    let places = [[0.5, 0.5], [0.031_25, 0.9], [0.71, -0.33], [3.4, 0.999]];
    for (width, meaning) in &cases {
        let asked = places.map(|uv: [f64; 2]| Asked {
            slot: 0,
            uv: uv.map(|c| c as f32),
            width: width.map(|w| (w / 16.0) as f32),
            mode: 0,
        });
        for (uv, [found, ..]) in places.into_iter().zip(fetch(&part, &asked)) {
            let expected = meaning(uv);
            let off = (f64::from(found) - expected).abs();
            assert!(
                off < 1e-3,
                "{found} instead of {expected} at {uv:?}, {width:?} texels wide"
            );
        }
    }
}

#[test]
fn the_widest_lookup_is_the_mean_of_the_picture_whatever_its_size() {
    for (width, height) in [(1, 1), (3, 5), (1, 37), (17, 16), (33, 63), (100, 3)] {
        let picture = Numbers::scattered(width, height);
        let mean = picture.texels.iter().sum::<f64>() / picture.texels.len() as f64;
        let file = ("a.png", picture.file(), TextureSpace::Data, ALL);
        let part = part(&[file]).expect("it loads");
        let asked = [[0.0, 0.0], [0.37, 0.81]].map(|uv| Asked {
            slot: 0,
            uv,
            width: [64.0, 64.0],
            mode: 0,
        });
        for [found, ..] in fetch(&part, &asked) {
            let off = (f64::from(found) - mean).abs();
            assert!(off < 5e-4, "{width} x {height}: {found} instead of {mean}");
        }
    }
}

#[test]
fn what_no_lookup_asks_for_is_not_there() {
    let file = |name, lookups| {
        let picture = Numbers::scattered(8, 8).file();
        (name, picture, TextureSpace::Data, lookups)
    };
    let bytes = |part: &ShaderPart| part.buffers[0].bytes.len();
    let plain = part(&[file("a.png", Lookups::default())]).expect("it loads");
    for word in ["texture_fetch_as", "texture_level", "texture_filter"] {
        assert!(!plain.wgsl.contains(word), "{word}");
    }
    assert_eq!(bytes(&plain), 8 * (1 + 64));
    // Levels belong to the texture that is averaged, not to the one beside it.
    let wide = Lookups {
        levels: true,
        ..Lookups::of_mode(0)
    };
    let both = part(&[file("a.png", Lookups::default()), file("b.png", wide)]).expect("they load");
    assert_eq!(bytes(&both), 8 * (2 + 64 + 64 + 3 + 16 + 4 + 1));
    for (word, there) in [
        ("texture_fetch_wide", true),
        ("wrap == ", false),
        ("bicubic", false),
    ] {
        assert_eq!(both.wgsl.contains(word), there, "{word}");
    }
    let clamped =
        part(&[file("a.png", Lookups::of_mode(texture_mode(2, 0, 0)))]).expect("it loads");
    for (word, there) in [
        ("wrap == 2", true),
        ("wrap == 1", false),
        ("wrap == 3", false),
        ("texture_fetch_wide", false),
    ] {
        assert_eq!(clamped.wgsl.contains(word), there, "{word}");
    }
    assert_eq!(bytes(&clamped), 8 * (1 + 64));
}
