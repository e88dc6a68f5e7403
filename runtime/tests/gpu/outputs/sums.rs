//! Outputs as sums: the same bits whatever the plan, parts that merge to the whole, and groups of lights that add
//! up to the picture.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use impasto_runtime::film::file::FilmFile;
use impasto_runtime::film::outputs::ALL_GROUPS;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::Samples;
use impasto_runtime::render::until::Goals;

use crate::gpu::outputs::studio::{
    STUDIO, asking, assert_near, at, everything, load, render, renderer, value,
};

/// A sum in units is the same whatever adds to it first, and so is the picture without outputs.
#[test]
fn every_plan_gives_the_same_bits_and_the_picture_of_none() {
    let outputs = everything();
    let studio = load(STUDIO, &outputs);
    let none = render(&studio, "own", &asking(&[], 5));
    let first = render(&studio, "own", &asking(&outputs, 5));
    assert_eq!(first.film, none.film);
    assert!(none.report.path_state_bytes < first.report.path_state_bytes);
    for strategy in ["mixed", "binned", "inline", "mega"] {
        let options = RenderOptions {
            pool: Some(77),
            ..asking(&outputs, 5)
        };
        let other = render(&studio, strategy, &options);
        assert!(other.sums.sums == first.sums.sums, "{strategy}");
    }
}

#[test]
fn parts_merge_to_the_bits_of_the_whole_and_halves_record_too() {
    let outputs = everything();
    let studio = load(STUDIO, &outputs);
    let mut renderer = renderer(&studio, "own", &asking(&outputs, 6));
    let mut go_on = |_: &_| ControlFlow::Continue(());
    let mut part = |first, count| {
        let samples = Samples {
            seed: 0,
            first,
            count,
        };
        renderer.select(&samples).expect("samples");
        renderer.render(&mut go_on).expect("a part").sums
    };
    let whole = part(0, 6);
    let folder = tempfile::tempdir().expect("a folder");
    let mut merged = part(3, 3);
    for (name, film) in [("a.film", part(0, 1)), ("b.film", part(1, 2))] {
        let path = folder.path().join(name);
        film.write(&path).expect("written");
        let read = FilmFile::read(&path).expect("read");
        assert!(read == film, "{name}");
        merged.merge(&read).expect("merged");
    }
    assert!(merged == whole);

    // Two halves by two seeds have the outputs of both.
    renderer
        .select(&Samples {
            seed: 0,
            first: 0,
            count: 16,
        })
        .expect("samples");
    let halves = renderer.render_until(&Goals::default(), &mut |_| (), &mut go_on);
    let halves = halves.expect("a render");
    let pixel = at(-0.3, -0.3);
    assert_near(&value(&halves, "samples", pixel), &[16.0], 0.0);
    assert_near(&value(&halves, "alpha", pixel), &[1.0], 0.0);
    assert_near(&value(&halves, "albedo", pixel), &[0.8, 0.4, 0.2], 1e-6);
}

#[test]
fn groups_of_lights_add_up_to_the_picture() {
    let varying = STUDIO.replace("material = 'glow'\ngroup", "material = 'shade'\ngroup");
    for toml in [STUDIO, &varying] {
        let studio = load(toml, &[]);
        let seen = render(&studio, "own", &asking(&[ALL_GROUPS], 8));
        let groups = ["light_default", "light_key", "light_rim", "light_sky"];
        assert_eq!(seen.sums.sums.layers().names(), groups);
        let mut lit = BTreeMap::new();
        for (pixel, picture) in seen.film.pixels.iter().enumerate() {
            let mut sum = [0.0f64; 3];
            for group in groups {
                for (sum, part) in sum.iter_mut().zip(value(&seen, group, pixel)) {
                    *sum += f64::from(part);
                    *lit.entry(group).or_insert(0.0) += part;
                }
            }
            for (sum, value) in sum.into_iter().zip(picture) {
                let off = (sum - f64::from(*value)).abs();
                assert!(
                    off < 1e-6 * (1.0 + sum),
                    "pixel {pixel}: {sum} is not {value}"
                );
            }
        }
        assert!(lit.values().all(|light| *light > 1.0), "{lit:?}");
        // A group alone has the bits that it has among all.
        let one = render(&studio, "mega", &asking(&["light_key"], 8));
        assert_eq!(
            one.sums.sums.values("light_key"),
            seen.sums.sums.values("light_key")
        );
        // The sky is seen where nothing is.
        assert_near(
            &value(&seen, "light_sky", at(-1.5, 1.5)),
            &[0.2, 0.3, 0.5],
            1e-6,
        );
    }
}
