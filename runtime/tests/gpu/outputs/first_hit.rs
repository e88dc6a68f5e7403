//! What outputs say of the first hit, against what is known of scenes: places, normals, albedos and ids.

use impasto_runtime::film::outputs::{At, Kind, OUTPUTS};
use impasto_runtime::world::first_hit::FirstHits;

use crate::gpu::outputs::studio::{
    STUDIO, asking, assert_near, at, everything, load, names, render, value,
};

#[test]
fn every_output_is_what_is_known_of_the_scene() {
    let outputs = everything();
    let studio = load(STUDIO, &outputs);
    let seen = render(&studio, "own", &asking(&outputs, 8));
    let miss = at(-1.5, 1.5);
    for output in OUTPUTS
        .iter()
        .filter(|o| o.at != At::Light && o.kind != Kind::Ids)
    {
        let expected = match output.name {
            "samples" => vec![8.0],
            // The environment is the same everywhere.
            "variance" => vec![0.0; 3],
            _ => vec![0.0; output.channels.len()],
        };
        assert_near(&value(&seen, output.name, miss), &expected, 1e-7);
    }
    assert_eq!(names(&seen, "material", miss), []);

    // The left half of the card.
    let card = at(-0.3, -0.3);
    assert_near(&value(&seen, "alpha", card), &[1.0], 0.0);
    assert_near(&value(&seen, "albedo", card), &[0.8, 0.4, 0.2], 1e-6);
    assert_near(&value(&seen, "normal", card), &[0.0, 0.0, 1.0], 1e-6);
    assert_near(
        &value(&seen, "geometric_normal", card),
        &[0.0, 0.0, 1.0],
        1e-6,
    );
    assert_near(&value(&seen, "depth", card), &[4.0], 1e-5);
    let place = value(&seen, "position", card);
    assert_near(&place, &[-0.3, -0.3, 0.0], 0.05);
    let uv = [0.5 * (place[0] + 1.0), 0.5 * (place[1] + 1.0)];
    assert_near(&value(&seen, "uv", card), &uv, 1e-5);
    assert_eq!(names(&seen, "material", card), [("left".to_owned(), 1.0)]);
    assert_eq!(
        names(&seen, "object", card),
        [("card/left".to_owned(), 1.0)]
    );
    // Half a mirror, and half of a diffuse surface.
    let right = at(0.9, 0.9);
    assert_near(&value(&seen, "albedo", right), &[0.6, 0.7, 0.8], 1e-6);
    assert_eq!(
        names(&seen, "object", right),
        [("card/right".to_owned(), 1.0)]
    );

    // The tile before it, at 3 m: its bump counts, whatever its corners say.
    let tile = at(0.6, 0.1);
    assert_near(&value(&seen, "depth", tile), &[3.0], 1e-5);
    assert_near(&value(&seen, "normal", tile), &[0.0, 0.6, 0.8], 1e-6);
    assert_near(
        &value(&seen, "geometric_normal", tile),
        &[0.0, 0.0, 1.0],
        1e-6,
    );
    assert_near(&value(&seen, "position", tile)[2..], &[1.0], 1e-6);
    assert_eq!(
        names(&seen, "object", tile),
        [("tile/tile".to_owned(), 1.0)]
    );
    // The one that glows has the normals of its corners, which are stored in 16 bits.
    let glow = at(-0.7, 0.7);
    assert_near(&value(&seen, "normal", glow), &[0.6, 0.0, 0.8], 1e-4);
    assert_eq!(
        names(&seen, "object", glow),
        [("tile/tile.001".to_owned(), 1.0)]
    );
    // The quad light is an object without a material, and reflects nothing.
    let quad = at(-1.3, -1.3);
    assert_near(&value(&seen, "albedo", quad), &[0.0; 3], 0.0);
    assert_near(&value(&seen, "normal", quad), &[0.0, 0.0, 1.0], 1e-6);
    assert_eq!(names(&seen, "material", quad), []);
    assert_eq!(names(&seen, "object", quad), [("lights/1".to_owned(), 1.0)]);
}

/// What the host finds by rays of its own.
#[test]
fn ids_are_those_that_rays_of_the_host_meet() {
    let studio = load(STUDIO, &[]);
    let seen = render(&studio, "own", &asking(&["material", "alpha"], 16));
    let alpha = seen.sums.sums.values("alpha");
    let mut whole = 0;
    let seen_by_host = FirstHits::new(&studio.0).materials(&studio.0.camera);
    for (pixel, expected) in seen_by_host.into_iter().enumerate() {
        let ids = names(&seen, "material", pixel);
        let covered: f32 = ids.iter().map(|(_, coverage)| coverage).sum();
        assert!(covered <= alpha[0][pixel] + 1e-6, "{pixel}: {ids:?}");
        let Some((first, coverage)) = ids.first().filter(|(_, c)| *c > 0.9) else {
            continue;
        };
        whole += 1;
        assert!(*coverage <= covered);
        let expected = expected.map(|m| studio.0.materials[m as usize].name.clone());
        assert_eq!(Some(first), expected.as_ref(), "pixel {pixel}");
    }
    assert!(whole > 80, "{whole}");
}

/// Paths that end at the first hit are asked how that looks all the same.
#[test]
fn materials_are_asked_where_paths_end_at_once() {
    let outputs = ["albedo", "normal", "position"];
    for (depth, roulette) in [(1, 8), (4, 1)] {
        let integrator = format!("max_depth = {depth}, roulette_start = {roulette}");
        let toml = STUDIO.replace("max_depth = 4, roulette_start = 2", &integrator);
        let studio = load(&toml, &outputs);
        for strategy in ["own", "inline", "mega"] {
            let none = render(&studio, strategy, &asking(&[], 8));
            let seen = render(&studio, strategy, &asking(&outputs, 8));
            assert_eq!(seen.film, none.film, "{strategy}, {integrator}");
            let card = at(-0.3, -0.3);
            assert_near(&value(&seen, "albedo", card), &[0.8, 0.4, 0.2], 1e-6);
            assert_near(
                &value(&seen, "normal", at(0.6, 0.1)),
                &[0.0, 0.6, 0.8],
                1e-6,
            );
        }
    }
}

/// Objects that are stored once and placed, one of them mirrored, in a world that is far away.
#[test]
fn placed_objects_and_worlds_far_away_are_where_they_are() {
    for (far, share) in [(0.0, true), (0.0, false), (4096.0, true), (4096.0, false)] {
        let toml = format!(
            "film = {{ width = 16, height = 16 }}\nintegrator.max_depth = 1\nenvironment.color = 1\n\
             camera = {{ position = [{far}, 0, 4], look_at = [{far}, 0, 0], fov = 43.60282 }}\n\
             [[geometry]]\nobj = 'tile.obj'\nshare = {share}\nplacements = [\n\
             {{ translate = [{}, 0, 0], scale = 2 }},\n\
             {{ translate = [{}, 0, -1], scale = [-2, 2, 2] }} ]\n\
             [materials.tile]\nfile = 'm.impasto'\nmaterial = 'plain'\n",
            far - 0.6,
            far + 0.6,
        );
        let outputs = ["object", "position", "normal", "depth"];
        let world = load(&toml, &outputs);
        assert_eq!(world.0.placements.len(), if share { 2 } else { 0 });
        assert_eq!(world.0.origin == Default::default(), far == 0.0);
        let seen = render(&world, "own", &asking(&outputs, 4));
        let (first, second) = (at(-0.5, 0.1), at(0.5, 0.1));
        assert_eq!(
            names(&seen, "object", first),
            [("tile/tile".to_owned(), 1.0)]
        );
        assert_eq!(
            names(&seen, "object", second),
            [("tile/tile.001".to_owned(), 1.0)]
        );
        assert_near(
            &value(&seen, "position", first),
            &[far - 0.5, 0.1, 0.0],
            0.07,
        );
        assert_near(&value(&seen, "normal", first), &[0.6, 0.0, 0.8], 1e-4);
        assert_near(&value(&seen, "normal", second), &[-0.6, 0.0, 0.8], 1e-4);
        assert_near(&value(&seen, "depth", second), &[5.0], 1e-5);
    }
}

/// From within a medium, through boundaries that are hidden by it, to the first surface that is one.
#[test]
fn hidden_boundaries_are_no_first_hit() {
    let toml = "film = { width = 8, height = 8 }\nintegrator.max_depth = 3\nenvironment.color = 1\n\
         camera = { position = [0, 0, 1], look_at = [0, 0, 0], fov = 2, medium = 'big' }\n\
         [[geometry]]\nobj = 'block.obj'\nscale = 4\nmaterial = 'big'\n\
         [[geometry]]\nobj = 'block.obj'\ntranslate = [0, 0, -0.5]\nscale = 0.5\nmaterial = 'small'\n\
         [materials.big]\nfile = 'm.impasto'\nmaterial = 'liquid'\nparams.priority = 5\n\
         [materials.small]\nfile = 'm.impasto'\nmaterial = 'liquid'\nparams = { priority = 1, ior = 1.3 }\n";
    let outputs = ["depth", "material", "geometric_normal", "position"];
    let world = load(toml, &outputs);
    for strategy in ["own", "mega"] {
        let seen = render(&world, strategy, &asking(&outputs, 2));
        assert_eq!(names(&seen, "material", 27), [("big".to_owned(), 1.0)]);
        assert_near(&value(&seen, "depth", 27), &[3.0], 1e-5);
        assert_near(&value(&seen, "position", 27)[2..], &[-2.0], 1e-5);
        // The side that is seen is the inside.
        assert_near(
            &value(&seen, "geometric_normal", 27),
            &[0.0, 0.0, 1.0],
            1e-6,
        );
    }
}
