//! Outputs of the film beside the picture: every one against what is known of a small scene, exact whatever
//! the plan and however a render is parted, and without an effect on the picture.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use exr::prelude::{AttributeValue, FlatSamples, Text, read_first_flat_layer_from_file};
use impasto_compiler::partition::{Form, PlanInputs, Strategy};
use impasto_compiler::{Loader, MaterialRequest, Program, compile, compile_with_looks};
use impasto_runtime::film::file::FilmFile;
use impasto_runtime::film::outputs::{ALL_GROUPS, At, Kind, LIGHT_GROUP, OUTPUTS, ask_for_looks};
use impasto_runtime::film::{cryptomatte, exr as exr_file};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::until::Goals;
use impasto_runtime::render::{Renderer, Rendering, Samples};
use impasto_runtime::scene::{self, Scene};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::{World, first_hit};

use crate::gpu::stub::gpu;

/// A card from -1 to 1 in the plane z = 0 with coordinates from 0 to 1, in two parts; a tile before it whose normals
/// lean; and a tile behind the camera.
const CARD: &str = "
v -1 -1 0\nv 0 -1 0\nv 0 1 0\nv -1 1 0\nv 1 -1 0\nv 1 1 0
vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 1 0\nvt 1 1
o left\nusemtl left\nf 1/1 2/2 3/3 4/4
o right\nusemtl right\nf 2/2 5/5 6/6 3/3
";
/// A square of side 0.4 about the origin, whose vertex normals lean to the right.
const TILE: &str = "
v -.2 -.2 0\nv .2 -.2 0\nv .2 .2 0\nv -.2 .2 0\nvn 0.6 0 0.8
g tile\nusemtl tile\nf 1//1 2//1 3//1 4//1
";
/// A cube from -0.5 to 0.5.
const BLOCK: &str = "
v -.5 -.5 -.5\nv .5 -.5 -.5\nv .5 .5 -.5\nv -.5 .5 -.5\nv -.5 -.5 .5\nv .5 -.5 .5\nv .5 .5 .5\nv -.5 .5 .5
usemtl block
f 4 3 2 1\nf 5 6 7 8\nf 8 4 1 5\nf 3 7 6 2\nf 8 7 3 4\nf 1 2 6 5
";
const MATERIALS: &str = "
use std::bsdf::{diffuse, smooth_dielectric, specular};
use std::edf::uniform;
material plain { param color: color = 0.5; surface = diffuse(color); }
material coated { surface = mix(specular(color(1.0)), diffuse(color(0.2, 0.4, 0.6)), 0.5); }
material bumpy { surface = diffuse(0.5, normal: vec3(0.0, 0.6, 0.8)); }
material glow { surface = diffuse(0.3); emission = uniform(color(2, 1, 0.5)); }
material shade { surface = diffuse(0.3); emission = uniform(color(1 + position.x)); }
material liquid {
    param ior: float = 1.5;
    param priority: int = 0;
    surface = smooth_dielectric(ior: ior / exterior_ior);
    interior = medium(absorption: color(0.5), ior: ior, priority: priority);
}
";

struct Folder<'a>(&'a Path);

impl Loader for Folder<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.0.join(path)).map_err(|e| e.to_string())
    }
}

/// A scene with its materials, compiled for some outputs.
fn load(toml: &str, outputs: &[&str]) -> (Scene, Program) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [
        ("card.obj", CARD),
        ("tile.obj", TILE),
        ("block.obj", BLOCK),
        ("m.impasto", MATERIALS),
        ("scene.toml", toml),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let scene = impasto_runtime::world::load(&folder.path().join("scene.toml"))
        .unwrap_or_else(|e| panic!("{e}"));
    let request = |binding: &scene::MaterialBinding| MaterialRequest {
        material: binding.material.clone(),
        params: binding.params.clone(),
        ..MaterialRequest::new(binding.name.clone(), binding.file.clone())
    };
    let requests: Vec<_> = scene.materials.iter().map(request).collect();
    let compiled = match ask_for_looks(&strings(outputs)) {
        true => compile_with_looks(&requests, &mut Folder(folder.path())),
        false => compile(&requests, &mut Folder(folder.path())),
    };
    let program = compiled.program;
    (
        scene,
        program.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics)),
    )
}

fn strings(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn asking(outputs: &[&str], samples: u32) -> RenderOptions {
    RenderOptions {
        samples,
        outputs: strings(outputs),
        ..RenderOptions::default()
    }
}

fn renderer(
    (scene, program): &(Scene, Program),
    strategy: &str,
    options: &RenderOptions,
) -> Renderer<'static> {
    let names: Vec<String> = program.infos().into_iter().map(|m| m.name).collect();
    let inline = strategy == "inline";
    let strategy = Strategy::parse(if inline { "mixed" } else { strategy });
    let plan = strategy.and_then(|strategy| strategy.plan(&PlanInputs::of_names(&names)));
    let mut plan = plan.unwrap_or_else(|e| panic!("{e}"));
    for kernel in &mut plan.kernels {
        if inline {
            kernel.form = Form::Inline;
        }
    }
    Renderer::new(gpu(), scene, program, &plan, options).unwrap_or_else(|e| panic!("{e}"))
}

fn render(scene: &(Scene, Program), strategy: &str, options: &RenderOptions) -> Rendering {
    let rendering = renderer(scene, strategy, options).render(&mut |_| ControlFlow::Continue(()));
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rendering.report.nonfinite_samples, 0);
    assert_eq!(rendering.report.clamped_samples, 0);
    rendering
}

const SIZE: usize = 16;

/// The card seen from 4 m away, 16 pixels being 3.2 m wide, with a tile 1 m before its right half, and light of every
/// kind in four groups.
const STUDIO: &str = "
film = { width = 16, height = 16 }
integrator = { max_depth = 4, roulette_start = 2 }
camera = { position = [0, 0, 4], look_at = [0, 0, 0], fov = 43.60282 }
environment = { color = [0.2, 0.3, 0.5], sample = true, group = 'sky' }
[[geometry]]
obj = 'card.obj'
[[geometry]]
obj = 'tile.obj'
translate = [0.45, 0, 1]
[[geometry]]
obj = 'tile.obj'
translate = [-0.6, 0.6, 0.5]
material = 'glow'
[materials.left]
file = 'm.impasto'
material = 'plain'
params.color = [0.8, 0.4, 0.2]
[materials.right]
file = 'm.impasto'
material = 'coated'
[materials.tile]
file = 'm.impasto'
material = 'bumpy'
[materials.glow]
file = 'm.impasto'
material = 'glow'
group = 'key'
[[lights]]
kind = 'quad'
corner = [-1.5, -1.4, 0.2]
u = [0.6, 0, 0]
v = [0, 0.3, 0]
radiance = [3, 3, 2]
two_sided = true
[[lights]]
kind = 'distant'
to_light = [0.3, 0.2, 1]
irradiance = [1, 1, 1]
angle = 10
group = 'key'
[[lights]]
kind = 'distant'
to_light = [-0.3, 0.4, 1]
irradiance = [0.2, 0.4, 0.3]
group = 'rim'
";

/// Every name of the table, and the groups of the studio.
fn everything() -> Vec<&'static str> {
    let plain = OUTPUTS.iter().filter(|o| o.at != At::Light);
    plain.map(|o| o.name).chain([ALL_GROUPS]).collect()
}

/// The pixel at a place of the card's plane.
fn at(x: f32, y: f32) -> usize {
    let column = ((x + 1.6) / 0.2) as usize;
    column + SIZE * (((1.6 - y) / 0.2) as usize)
}

/// What a layer has at a pixel.
fn value(rendering: &Rendering, name: &str, pixel: usize) -> Vec<f32> {
    let values = rendering.sums.sums.values(name);
    assert!(!values.is_empty(), "{name}");
    values.iter().map(|channel| channel[pixel]).collect()
}

#[track_caller]
fn assert_near(found: &[f32], expected: &[f32], within: f32) {
    let far = |(a, b): (&f32, &f32)| (a - b).abs() > within;
    let apart = found.len() != expected.len() || found.iter().zip(expected).any(far);
    assert!(!apart, "{found:?} is not {expected:?}");
}

/// The names of the ids in a pixel, with their coverage.
fn names(rendering: &Rendering, layer: &str, pixel: usize) -> Vec<(String, f32)> {
    let sums = &rendering.sums.sums;
    let found = sums.layers().iter().find(|l| l.name == layer);
    let names = &found.expect("a layer").names;
    let samples = rendering.film.samples[pixel] as f32;
    let ids = sums.ids(layer, pixel).into_iter();
    ids.map(|id| (names[id.id as usize].clone(), id.count as f32 / samples))
        .collect()
}

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
    for (pixel, expected) in first_hit::materials(&studio.0).into_iter().enumerate() {
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

/// The table is walked: each row by itself is recorded, changes no picture, and is in the file under its names.
#[test]
fn every_row_of_the_table_is_an_output() {
    let outputs = everything();
    // Of one material, whose kernels are built sooner.
    let plain = ["coated", "bumpy", "glow"]
        .iter()
        .fold(STUDIO.to_owned(), |toml, name| {
            toml.replace(&format!("material = '{name}'\n"), "material = 'plain'\n")
        });
    let studio = load(
        &plain.replace("material = 'plain'\n[materials.left]", "[materials.left]"),
        &outputs,
    );
    let none = render(&studio, "own", &asking(&[], 2));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    for output in &OUTPUTS {
        let name = output.name.replace(LIGHT_GROUP, "light_key");
        let seen = render(&studio, "own", &asking(&[&name], 2));
        assert_eq!(seen.film, none.film, "{name}");
        assert!(seen.report.outputs.contains(&name));
        exr_file::write(&seen.sums, &path).expect("written");
        let channels = channels(&path);
        for channel in output.channels {
            let channel = match output.kind {
                Kind::Ids => format!("{channel}00.R"),
                _ => channel.replace(LIGHT_GROUP, "light_key"),
            };
            let values = channels
                .get(&channel)
                .unwrap_or_else(|| panic!("{channel}"));
            assert!(values.iter().all(|v| v.is_finite()), "{channel}");
        }
        assert!(
            channels
                .iter()
                .any(|(c, v)| c.len() > 1 && v.iter().any(|v| *v != 0.0))
                || ["A", "Z"].contains(&output.channels[0]),
            "{name} is 0 everywhere"
        );
    }
}

fn channels(path: &Path) -> BTreeMap<String, Vec<f32>> {
    let image = read_first_flat_layer_from_file(path).expect("an EXR");
    let list = image.layer_data.channel_data.list;
    let channel = |c: exr::image::AnyChannel<FlatSamples>| {
        (c.name.to_string(), c.sample_data.values_as_f32().collect())
    };
    list.into_iter().map(channel).collect()
}

#[test]
fn files_have_the_picture_the_layers_and_what_they_are_of() {
    let outputs = ["albedo", "depth", "material"];
    let studio = load(STUDIO, &outputs);
    let seen = render(&studio, "own", &asking(&outputs, 4));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    exr_file::write(&seen.sums, &path).expect("written");
    let channels = channels(&path);
    for (at, name) in ["R", "G", "B"].into_iter().enumerate() {
        let expected: Vec<f32> = seen.film.pixels.iter().map(|p| p[at]).collect();
        assert_eq!(channels[name], expected, "{name}");
    }
    assert_eq!(channels["albedo.G"], seen.sums.sums.values("albedo")[1]);
    assert_eq!(channels["Z"], seen.sums.sums.values("depth")[0]);
    let card = at(-0.3, -0.3);
    assert_eq!(
        channels["CryptoMaterial00.R"][card],
        cryptomatte::id("left")
    );
    assert_eq!(channels["CryptoMaterial00.G"][card], 1.0);
    assert_eq!(channels["CryptoMaterial03.A"][card], 0.0);
    assert_eq!(channels.len(), 3 + 3 + 1 + 16);
    // Pictures alone read as they do without layers.
    let read = impasto_runtime::film::output::read(&path, "picture").expect("read");
    assert_eq!(read.pixels, seen.film.pixels);

    let image = read_first_flat_layer_from_file(&path).expect("an EXR");
    let text = |key: &str| {
        let found = image.attributes.other.get(&Text::from(key));
        let found = found.or_else(|| image.layer_data.attributes.other.get(&Text::from(key)));
        match found {
            Some(AttributeValue::Text(text)) => text.to_string(),
            other => panic!("{key}: {other:?}"),
        }
    };
    assert!(image.attributes.chromaticities.is_some());
    assert_eq!(text("impasto/samples"), "4");
    assert_eq!(text("impasto/seed"), "0");
    let key = format!("cryptomatte/{}", cryptomatte::key("CryptoMaterial"));
    assert_eq!(text(&format!("{key}/name")), "CryptoMaterial");
    assert_eq!(text(&format!("{key}/hash")), "MurmurHash3_32");
    let manifest = text(&format!("{key}/manifest"));
    let manifest: BTreeMap<String, String> = serde_json::from_str(&manifest).expect("JSON");
    assert_eq!(manifest.len(), 4);
    let left = format!("{:08x}", cryptomatte::id("left").to_bits());
    assert_eq!(manifest["left"], left);
}

/// What cannot be recorded is said before anything is built.
#[test]
fn outputs_that_a_scene_cannot_have_are_refused() {
    let refused = |toml: &str, name: &str| {
        let (scene, program) = load(toml, &[]);
        let world = World::of_render(&scene, &program, &Technique::default(), &strings(&[name]));
        world.expect_err("refused").to_string()
    };
    let error = refused(STUDIO, "light_kee");
    assert!(
        error.contains("did you mean `light_key`? there are light_default"),
        "{error}"
    );
    let error = refused(STUDIO, "albedo");
    assert!(error.contains("compiled without"), "{error}");
    let error = refused(STUDIO, "noraml");
    assert!(error.contains("did you mean `normal`"), "{error}");
    let bare = "environment.color = 1\ncamera = { position = [0, 0, 4], look_at = [0, 0, 0], fov = 40 }\n\
        [[geometry]]\nobj = 'tile.obj'\n[materials.tile]\nfile = 'm.impasto'\nmaterial = 'plain'\n";
    let error = refused(bare, "uv");
    assert!(
        error.contains("`uv` cannot be recorded: no triangle"),
        "{error}"
    );
}
