//! Samples that are no light: never in the picture, and counted by kernel and material, each with an
//! example of where it was.

use crate::gpu::stub::{Kind, Materials, Room, materials, plan, red, render_plan, samples};
use impasto_compiler::partition::Strategy;
use impasto_runtime::kernels::dropped::Dropped;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::Rendering;
use impasto_runtime::technique::{Sampler, Technique};
use impasto_runtime::world::lights::Lights;
use impasto_trace::{End, MaterialCode, Replayer};

/// One wall of each kind of wrong material, and what is wrong with it: the value, and whether that is
/// below zero.
const WRONG: [(&str, &str, bool); 5] = [
    (
        "sample.throughput.y = sqrt(-1.0 - u.x)",
        "throughput",
        false,
    ),
    ("sample.throughput.z = -0.5", "throughput", true),
    ("sample.pdf = exp2(200.0 + u.x)", "pdf", false),
    ("sample.wi.x = exp2(200.0 + u.x)", "direction", false),
    ("sample.light_throughput.x = -1.0", "light throughput", true),
];

/// The room: what of it the camera sees is of [`WRONG`].
fn room() -> (Room, Materials) {
    let wrong = WRONG.iter().map(|(assignment, ..)| Kind::Wrong(assignment));
    let kinds: Vec<Kind> = std::iter::once(Kind::Diffuse(0.5)).chain(wrong).collect();
    let room = Room {
        materials: [1, 2, 3, 0, 5, 0, 4],
        plate: true,
        width: 16,
        height: 12,
        max_depth: 3,
        ..Room::default()
    };
    (room, materials(&kinds))
}

fn rendered(strategy: Strategy, options: &RenderOptions) -> Rendering {
    let (room, surfaces) = room();
    let plan = plan(strategy, &surfaces);
    render_plan(&room.world(), &surfaces, &plan, options)
}

fn of<'r>(rendering: &'r Rendering, material: &str) -> &'r Dropped {
    let mut entries = rendering.report.dropped.iter();
    let found = entries.find(|d| d.material.as_deref() == Some(material));
    found.unwrap_or_else(|| panic!("{material}: {:?}", rendering.report.dropped))
}

#[test]
fn what_a_material_gets_wrong_is_counted_for_it_in_every_kind_of_plan() {
    let options = RenderOptions {
        seed: 5,
        first_sample: 40,
        ..samples(3)
    };
    let mut counts = Vec::new();
    for (strategy, kernel) in [
        (Strategy::OWN, "material_m1"),
        (Strategy::MIXED, "material_mixed"),
        (Strategy::BINNED, "material_binned"),
        (Strategy::INLINE, "logic"),
        (Strategy::MEGA, "mega"),
    ] {
        let rendering = rendered(strategy, &options);
        let report = &rendering.report;
        assert_eq!(report.dropped.len(), WRONG.len(), "{:?}", report.dropped);
        assert_eq!(of(&rendering, "m1").kernel, kernel);
        for (index, (_, value, negative)) in WRONG.iter().enumerate() {
            let entry = of(&rendering, &format!("m{}", index + 1));
            let [some, none] = if *negative {
                [entry.negative, entry.nonfinite]
            } else {
                [entry.nonfinite, entry.negative]
            };
            assert!(some > 0 && none == 0, "{entry:?}");
            let example = entry.example.as_ref().expect("an example");
            assert_eq!(&example.value, value, "{entry:?}");
            assert_eq!(example.seed, 5);
            assert!((40..43).contains(&example.sample), "{entry:?}");
            assert!(example.pixel[0] < 16 && example.pixel[1] < 12, "{entry:?}");
            assert!((1..3).contains(&example.vertex), "{entry:?}");
        }
        let all: u64 = report.dropped.iter().map(Dropped::samples).sum();
        let negative: u64 = report.dropped.iter().map(|d| d.negative).sum();
        assert_eq!(report.nonfinite_samples, all);
        assert_eq!(report.negative_samples, negative);
        let of_kernels: u64 = report.kernels.iter().map(|k| k.nonfinite_samples).sum();
        assert_eq!(of_kernels, all);
        assert!(red(&rendering).all(|v| v.is_finite() && v >= 0.0));
        let names = (1..=WRONG.len()).map(|index| of(&rendering, &format!("m{index}")).samples());
        counts.push(names.collect::<Vec<u64>>());
    }
    for other in &counts[1..] {
        assert_eq!(&counts[0], other, "own kernels and another plan");
    }
}

/// The example is of the pixel and sample that it names: rendered alone, that drops it again.
#[test]
fn an_example_is_where_it_says() {
    let all = rendered(Strategy::OWN, &samples(4));
    let example = of(&all, "m3").example.clone().expect("an example");
    let again = rendered(
        Strategy::MEGA,
        &RenderOptions {
            first_sample: example.sample,
            ..samples(1)
        },
    );
    // Every path of the room meets m3 or not by its pixel and sample alone.
    let entry = of(&again, "m3");
    assert!(entry.nonfinite > 0 && entry.nonfinite <= 2 * 16 * 12);
    let other = rendered(
        Strategy::OWN,
        &RenderOptions {
            technique: Technique {
                sampler: Sampler::Independent,
                ..Technique::default()
            },
            seed: 1,
            ..samples(4)
        },
    );
    assert_eq!(of(&other, "m3").example.as_ref().map(|e| e.seed), Some(1));
}

#[test]
fn emission_that_is_no_number_is_the_materials() {
    let room = Room {
        materials: [1, 0, 0, 0, 0, 0, 0],
        width: 8,
        height: 8,
        max_depth: 3,
        ..Room::default()
    };
    let surfaces = materials(&[Kind::Diffuse(0.5), Kind::GlowingWrong]);
    let plan = plan(Strategy::OWN, &surfaces);
    let rendering = render_plan(&room.world(), &surfaces, &plan, &samples(4));
    let entry = of(&rendering, "m1");
    assert!(entry.nonfinite > 0 && entry.negative == 0);
    let value = entry.example.as_ref().map(|e| e.value.as_str());
    assert_eq!(value, Some("emission"));
    assert_eq!(rendering.report.dropped.len(), 1, "the film got none of it");
}

/// Every example leads to the vertex and value that the render complained of.
#[test]
fn an_example_replays() {
    let (room, surfaces) = room();
    let world = room.world();
    for sampler in [Sampler::Owen, Sampler::Independent] {
        let technique = Technique {
            sampler,
            ..Technique::default()
        };
        let options = RenderOptions {
            seed: 11,
            first_sample: 7,
            technique,
            ..samples(2)
        };
        let rendering = rendered(Strategy::OWN, &options);
        let examples: Vec<_> = rendering
            .report
            .dropped
            .iter()
            .flat_map(|d| &d.example)
            .collect();
        assert_eq!(examples.len(), WRONG.len());
        let replayer = Replayer::of_source(&world, &surfaces, sampler).expect("a kernel");
        let code = replayer.code(MaterialCode::Wgsl).expect("known code");
        let mut session = replayer.session::<f32>(&code).expect("known buffers");
        for example in examples {
            let path = session
                .path(example.pixel, example.sample, example.seed)
                .expect("a path");
            let vertex = &path.vertices[example.vertex as usize - 1];
            assert_eq!(vertex.dropped, Some(example.value.as_str()), "{path:?}");
            assert_eq!(path.end, End::Dropped, "{path:?}");
        }
    }
}

/// Radiance that is wrong when a path ends is counted by the kernel that fills the film, for no
/// material.
#[test]
fn radiance_that_is_no_light_is_counted_where_it_would_be_added() {
    for (radiance, negative) in [(f32::MAX, false), (-1.0, true)] {
        for (strategy, kernel) in [(Strategy::OWN, "logic"), (Strategy::MEGA, "mega")] {
            let surfaces = materials(&[Kind::Diffuse(0.5)]);
            let mut world = Room {
                walls: false,
                width: 4,
                height: 2,
                ..Room::default()
            }
            .scattering()
            .world();
            let Lights::ByHand { part: lights, .. } = &mut world.parts.lights else {
                panic!("they are written by hand");
            };
            let wrong = format!("(3.0 + direction.x) * {radiance:e}");
            lights.wgsl = lights.wgsl.replace("weight * SKY", &wrong);
            let plan = plan(strategy, &surfaces);
            let rendering = render_plan(&world, &surfaces, &plan, &samples(3));
            let [entry] = &rendering.report.dropped[..] else {
                panic!("one row: {:?}", rendering.report.dropped);
            };
            assert_eq!((entry.kernel.as_str(), &entry.material), (kernel, &None));
            let counts = [entry.nonfinite, entry.negative];
            assert_eq!(counts, if negative { [0, 24] } else { [24, 0] });
            let example = entry.example.as_ref().expect("an example");
            assert_eq!((example.value.as_str(), example.vertex), ("radiance", 1));
            assert_eq!(rendering.report.nonfinite_samples, 24);
            assert!(red(&rendering).all(|v| v == 0.0));
        }
    }
}
