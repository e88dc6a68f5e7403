//! Sources that were almost right: materials with a few words changed. Whatever is made of them,
//! the compiler neither panics nor hangs, and what it accepts is valid WGSL.
//!
//! Random text seldom gets past the parser; these reach checking, lowering and the passes, whose
//! verifier runs after each in debug builds.

use std::path::Path;
use std::time::Duration;

use impasto_compiler::{MemoryLoader, check, diag};
use impasto_fuzz::Stopwatch;
use proptest::prelude::*;

/// A material with one of everything that outputs and closures can be made of.
const EVERYTHING: &str = "
use std::bsdf::{diffuse, mirror, specular, translucent};
use std::edf::uniform;
use std::noise::perlin;
use std::pattern::{bump, normal_map};
const STEP: length = 800 nm;
fn height(p: point, s: float) -> float = perlin(p * s);
fn coat(base: bsdf, w: float, on: bool) -> bsdf {
    let c = mirror(fresnel: 1.0 + w);
    if on { layer(w * c, base) } else { mix(base, c, w) }
}
fn glow(e: edf, k: float) -> edf = layer(specular(k), k * e + 0.5 * e);
fn inner(a: medium, b: medium, on: bool) -> medium = if on { a } else { b };
material m {
    param a: float = 0.5 in 0.0 .. 1.0;
    param n: int = 3 in 0 .. 10;
    param c: color = color(0.2, 0.4, 0.6);
    param on: bool = true;
    let g = gradient(height(position, 2.0 + a), step: STEP);
    let bent = bump(normal, g * a);
    let mapped = normal_map(c, bent, tangent, scale: a);
    var k = a;
    for i in 0 .. min(n, 4) { if k > 0.7 { break; } k += 0.1 * a; }
    let w = filter_width(k * position).x;
    surface = coat(coat(diffuse(c, normal: mapped), a + w, on), uv.x * a / exterior_ior, uv.y > 0.5) + 0.1 * translucent(c);
    emission = glow(uniform(c), saturate(a * uv.x));
    interior = inner(medium(absorption: c * k, ior: 1.0 + a, priority: n), medium(ior: 1.5 / (1.0 + k)), on);
    opacity = smoothstep(0.2, 0.8, uv.x + a);
}
";

/// Words that change what is around them.
const WORDS: [&str; 25] = [
    "medium",
    "bsdf",
    "edf",
    "gradient",
    "filter_width",
    "layer",
    "mix",
    "opacity",
    "interior",
    "surface",
    "position",
    "exterior_ior",
    "if",
    "else",
    "{",
    "}",
    "(",
    ")",
    ",",
    ";",
    "*",
    "0.0",
    "1 mm",
    "uv.x",
    "true",
];

/// Longest that a source of this size may take.
const LONGEST: Duration = Duration::from_secs(3);

/// Names and numbers whole, everything else a character at a time.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut inside = false;
    for c in text.chars() {
        let part = c.is_ascii_alphanumeric() || c == '_' || c == '.';
        match words.last_mut() {
            Some(word) if inside && part => word.push(c),
            _ => words.push(c.into()),
        }
        inside = part;
    }
    words
}

/// What to start from: every material of `materials/`, without comments, and [`EVERYTHING`].
fn sources() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let entries = std::fs::read_dir(folder).expect("materials/").flatten();
    let mut paths: Vec<_> = entries.map(|e| e.path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "impasto"));
    paths.sort();
    let code = |line: &str| line.split("//").next().unwrap_or("").to_owned() + "\n";
    let read = |p| std::fs::read_to_string(p).expect("a material is readable");
    let mut sources: Vec<String> = paths
        .iter()
        .map(|p| read(p).lines().map(code).collect())
        .collect();
    // Half of the cases start from the text that has all the constructs.
    let twice = sources.len();
    sources.extend(std::iter::repeat_n(EVERYTHING.to_owned(), twice));
    sources
}

/// One change: what to do, and where, as shares of the length.
type Change = (u8, f64, f64, usize);

fn change(text: &mut Vec<String>, (kind, a, b, word): Change) {
    let at = |share: f64| (share * text.len() as f64) as usize;
    let (i, j) = (at(a), at(b));
    match kind {
        0 => drop(text.remove(i)),
        1 => text.insert(i, text[j].clone()),
        2 => text.swap(i, j),
        3 => text[i] = WORDS[word].into(),
        _ => {
            let copied: Vec<String> = text[j..(j + 12).min(text.len())].to_vec();
            text.splice(i..i, copied);
        }
    }
}

fn compiled(text: &str) -> Result<(), TestCaseError> {
    let start = Stopwatch::start();
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let checked = check("m.impasto", &mut files);
    prop_assert!(start.elapsed() < LONGEST, "took {:?}", start.elapsed());
    let shown = diag::render::text(&checked.sources, &checked.diagnostics, false);
    let invalid = checked.diagnostics.iter().any(|d| d.code.id() == "E0901");
    prop_assert!(!invalid, "{shown}");
    Ok(())
}

#[test]
fn the_text_with_everything_is_right() {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", EVERYTHING);
    let checked = check("m.impasto", &mut files);
    let shown = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(!diag::has_errors(&checked.diagnostics), "{shown}");
    assert_eq!(checked.materials, ["m"]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_sources_end_in_code_or_errors(
        source in prop::sample::select(sources()),
        changes in prop::collection::vec((0u8..5, 0.0..1.0, 0.0..1.0, 0..WORDS.len()), 1..4),
    ) {
        let mut text = words(&source);
        for c in changes {
            change(&mut text, c);
        }
        compiled(&text.concat())?;
    }
}
