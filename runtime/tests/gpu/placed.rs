//! Pictures of scenes whose objects are placed: in closed form, and against the same with copies.

use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::Rendering;
use impasto_runtime::scene::Scene;
use impasto_runtime::technique::{Copies, Leaves, RayFetch, Stack, Technique, Traversal};

use crate::gpu::scene::{load, render, room};
use crate::gpu::stub::{assert_mean, samples};

/// Pictures of a scene with its objects placed and copied, of the same paths.
fn both(toml: &str, spp: u32, technique: Technique) -> [Rendering; 2] {
    let (scene, program) = load(toml);
    assert!(!scene.objects.is_empty(), "nothing is placed");
    [Copies::Shared, Copies::Flat].map(|copies| {
        let options = RenderOptions {
            technique: Technique {
                copies,
                ..technique
            },
            ..samples(spp)
        };
        render(&scene, &program, "wavefront", &options)
    })
}

/// Fails if pictures differ by more than the few paths that rounding sends another way.
#[track_caller]
fn assert_same([placed, flat]: &[Rendering; 2]) {
    let pixels = placed.film.pixels.iter().zip(&flat.film.pixels);
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| {
        let difference = (0..3)
            .map(|c| (a[c] - b[c]).abs() / (0.05 + b[c]))
            .fold(0.0, f32::max);
        difference > 1e-3
    };
    let different = pixels.clone().filter(differs).count();
    assert!(
        different * 25 <= placed.film.pixels.len(),
        "{different} of {} pixels differ",
        placed.film.pixels.len()
    );
    let mean = |r: &Rendering| {
        let values = r.film.pixels.iter().flatten().map(|v| f64::from(*v));
        values.sum::<f64>() / (3 * r.film.pixels.len()) as f64
    };
    let (a, b) = (mean(placed), mean(flat));
    assert!((a - b).abs() < 0.01 * b, "{a} instead of {b}");
}

/// A room that emits, in which balls, mirrored and stretched, hang and lie.
fn crowded(size: f32) -> String {
    let mut toml = room(size, 0.0, 6);
    let at = |p: [f32; 3]| p.map(|v| v * size);
    for (index, material) in ["glass", "dull", "silver"].into_iter().enumerate() {
        let x = index as f32 - 1.0;
        toml += &format!(
            "[[geometry]]\nobj = 'ball.obj'\nshare = true\nmaterial = '{material}'\nplacements = [\n\
             {{ scale = {:?}, translate = {:?} }},\n\
             {{ scale = {:?}, rotate = [30, 50, 0], translate = {:?} }},\n]\n\
             [materials.{material}]\nfile = 'm.impasto'\nmaterial = '{material}'\n",
            at([0.5, 0.3, 0.4]),
            at([0.6 * x, 0.1, -0.5]),
            at([-0.3, 0.2, 0.4]),
            at([0.5 * x, -0.5, 0.3]),
        );
    }
    toml
}

#[test]
fn placed_objects_look_like_copies() {
    for size in [1.0, 1e-4, 1e4] {
        let pictures = both(&crowded(size), 4, Technique::default());
        let [placed, flat] = pictures.each_ref().map(|r| &r.report);
        assert_eq!((placed.objects, placed.placements), (1, 6));
        assert_eq!((flat.objects, flat.placements), (0, 0));
        assert_eq!(placed.placed_triangles, flat.triangles);
        assert!(placed.triangles < flat.triangles / 3);
        assert_same(&pictures);
    }
}

#[test]
fn every_way_to_cast_rays_finds_placed_objects() {
    let ways = [
        Technique {
            traversal: Traversal::Bvh2,
            ..Technique::default()
        },
        Technique {
            stack: Stack::Workgroup,
            leaves: Leaves::Together,
            ..Technique::default()
        },
        Technique {
            ray_fetch: RayFetch::Persistent,
            ..Technique::default()
        },
    ];
    for technique in ways {
        assert_same(&both(&crowded(1.0), 2, technique));
    }
}

#[test]
fn a_megakernel_traces_placed_objects_alike() {
    let (scene, program) = load(&crowded(1.0));
    let [wavefront, mega] = ["wavefront", "mega"].map(|s| render(&scene, &program, s, &samples(2)));
    assert_eq!(wavefront.film.pixels, mega.film.pixels);
}

/// Glass in glass, of different priorities, and a camera inside of some: media follow placements.
#[test]
fn media_nest_in_placements() {
    let toml = "film = { width = 24, height = 16 }\n\
        integrator = { max_depth = 24, roulette_start = 1000 }\n\
        environment = { color = [0.5, 1, 2] }\n\
        camera = { position = [0.1, 0.2, 3], look_at = [0, 0, 0], fov = 40 }\n\
        [[geometry]]\nobj = 'ball.obj'\nshare = true\nplacements = [\n\
        { material = 'outer' },\n\
        { material = 'inner', scale = [-0.5, 0.8, 0.5], translate = [0.3, 0, 0] },\n\
        { material = 'inner', scale = 0.3, translate = [-0.9, 0, 0] },\n]\n\
        [materials.outer]\nfile = 'm.impasto'\nmaterial = 'liquid'\n\
        params = { absorption = [1, 0.5, 0.1], priority = 1 }\n\
        [materials.inner]\nfile = 'm.impasto'\nmaterial = 'liquid'\n\
        params = { absorption = [0.1, 2, 0.3], ior = 1.2, priority = 2 }\n";
    assert_same(&both(toml, 4, Technique::default()));
    let inside = toml
        .replace("[0.1, 0.2, 3]", "[0.4, 0.1, 0]")
        .replace("fov = 40", "fov = 40, medium = ['outer', 'inner']");
    let inside = inside.replace("look_at = [0, 0, 0]", "look_at = [0, 0, -9]");
    let pictures = both(&inside, 4, Technique::default());
    assert_eq!(pictures[0].report.lost_paths, 0);
    assert_same(&pictures);
}

/// All walls emit 1 and reflect 0.7, though the room is placed by a matrix that mirrors it; light
/// samples and emission that is met must find the same sides.
#[test]
fn emission_in_a_mirrored_placement_fills_the_room() {
    let mirrored = |toml: String, share: bool| {
        toml.replace(
            "obj = 'room.obj'\n",
            &format!(
                "obj = 'room.obj'\nshare = {share}\nplacements = [{{ scale = [-1, 1, 1] }}]\n"
            ),
        )
    };
    for share in [true, false] {
        let (scene, program) = load(&mirrored(room(1.0, 0.0, 3), share));
        assert_eq!(scene.placements.len(), usize::from(share));
        let rendering = render(&scene, &program, "wavefront", &samples(64));
        assert!(rendering.report.items_of("shadow") > Some(0));
        assert_eq!(rendering.report.placements, 0, "each triangle is a light");
        assert_mean(&rendering, 1.0 + 0.7 + 0.49);
    }
}

#[test]
fn a_scene_of_placements_alone_renders() {
    let toml = "film = { width = 16, height = 16 }\n\
        integrator.max_depth = 8\nenvironment = { color = 1 }\n\
        camera = { position = [0, 2, 9], look_at = [0, 0, 0], fov = 40 }\n\
        [[geometry]]\nobj = 'ball.obj'\nshare = true\nplacements = 'p.txt'\n\
        [materials.'*']\nfile = 'm.impasto'\nmaterial = 'silver'\n";
    let toml = toml.replace(
        "'p.txt'",
        "[{}, { translate = [2, 0, 0], scale = [1, -1, 1] }]",
    );
    let (scene, program): (Scene, _) = load(&toml);
    // Mirrors under an even sky are as bright as the sky, but for paths that are cut short.
    let rendering = render(&scene, &program, "wavefront", &samples(16));
    assert_mean(&rendering, 1.0);
}
