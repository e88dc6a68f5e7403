//! Ways to cast rays are ways to find the same hits: pictures of a room of several lights, with a
//! mirrored ball of a thousand triangles in it, do not depend on them.

use impasto_runtime::render::{RenderOptions, Rendering};
use impasto_runtime::technique::{Choice, Stack, Technique, Traversal};

use crate::scene::{load, render, room};
use crate::stub::{gpu, samples};

/// Renders with `technique`; the pool is smaller than the picture, so that queues vary in length.
fn picture(strategy: &str, technique: Technique) -> Rendering {
    let toml = room(1.0, 0.0, 6)
        + "[materials.ball]\nfile = 'm.impasto'\nmaterial = 'silver'\n\
           [materials.block]\nfile = 'm.impasto'\nmaterial = 'dull'\n\
           [[geometry]]\nobj = 'ball.obj'\n\
           [[geometry]]\nobj = 'block.obj'\nscale = 0.3\ntranslate = [0.5, -0.6, 0.3]\n";
    let (scene, program) = load(&toml);
    let options = RenderOptions {
        pool: Some(300),
        technique,
        ..samples(4)
    };
    render(&scene, &program, strategy, &options)
}

/// Fails where the picture of `technique` is another than the default's. Which of two triangles a
/// ray through their common edge hits may depend on the order in which they are tested.
#[track_caller]
fn assert_same(strategy: &str, technique: Technique, reference: &Rendering) {
    let rendering = picture(strategy, technique);
    let pixels = rendering.film.pixels.iter().flatten();
    let pairs = pixels.zip(reference.film.pixels.iter().flatten());
    let astray = pairs.filter(|(a, b)| (**a - **b).abs() > 1e-5 * b.max(1.0));
    let allowed = match (gpu().info().kind, technique.traversal) {
        ("software", Traversal::Cwbvh) => 0,
        _ => reference.film.pixels.len() * 3 / 50,
    };
    let astray = astray.count();
    assert!(
        astray <= allowed,
        "{strategy}, {technique:?}: {astray} differ"
    );
}

#[test]
fn every_tree_and_stack_finds_the_same_hits() {
    for strategy in ["own", "mega"] {
        let reference = picture(strategy, Technique::default());
        let trees = Traversal::ALL.iter();
        for (traversal, stack) in trees.flat_map(|t| Stack::ALL.iter().map(move |s| (t.0, s.0))) {
            let technique = Technique {
                traversal,
                stack,
                ..Technique::default()
            };
            assert_same(strategy, technique, &reference);
        }
    }
}
