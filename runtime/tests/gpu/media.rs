//! Media: what layers let pass by Fresnel, Beer and Lambert, which of several that overlap is
//! seen, and that a scene carries no more of it than it needs.

use impasto_compiler::partition::Strategy;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::world::MaterialSource;
use impasto_runtime::world::media::Media;

use crate::gpu::planes::{Light, Plane, Planes, Solid, Solids, Surface, planned, render, slab};
use crate::gpu::stub::{gpu, mean};
use crate::record::{Bound, Row};
use crate::support::{Random, run};

const CLEAR: [f32; 3] = [0.0; 3];

/// A layer between two boundaries: thickness, absorption and index.
pub type Layer = (f64, [f32; 3], f64);

/// What a stack of layers in air lets pass and reflects at right angles, in each channel: layers
/// and boundaries are added one after the other, with all reflections between what lies before
/// and behind (Stokes 1862).
pub fn stack(layers: &[Layer], channel: usize) -> [f64; 2] {
    // Passes either way, reflects from the front, reflects from the back.
    let (mut t, mut front, mut back) = (1.0, 0.0, 0.0);
    let mut add = |pass: f64, reflect: f64| {
        let between = 1.0 / (1.0 - back * reflect);
        front += t * t * reflect * between;
        back = reflect + pass * pass * back * between;
        t *= pass * between;
    };
    let mut before = 1.0;
    for (thickness, absorption, ior) in layers {
        let r = ((ior - before) / (ior + before)).powi(2);
        add(1.0 - r, r);
        add((-f64::from(absorption[channel]) * thickness).exp(), 0.0);
        before = *ior;
    }
    let r = ((1.0 - before) / (1.0 + before)).powi(2);
    add(1.0 - r, r);
    [t, front]
}

#[track_caller]
pub fn assert_channel(rendering: &Rendering, channel: usize, expected: f64) {
    let values = rendering.film.pixels.iter();
    let (mean, error) = mean(values.map(|p| f64::from(p[channel])));
    let test = std::thread::current();
    let (apart, tolerance) = ((mean - expected).abs(), 4.0 * error + 1e-4 * expected);
    let good = Row {
        table: "32",
        subject: test.name().unwrap_or("media"),
        what: "difference of a channel's mean from its closed form, in its tolerance",
        // What must be black has no tolerance.
        worst: if apart == 0.0 { 0.0 } else { apart / tolerance },
        bound: Bound::AtMost(1.0),
        place: &format!("channel {channel}, {expected}"),
    }
    .note();
    assert!(
        good,
        "channel {channel}: {mean} +- {error}, expected {expected}"
    );
}

/// Fails if the picture does not show what the layers let pass of a sky of 1 behind them and
/// reflect of a sky of 0.3.
#[track_caller]
fn assert_layers(rendering: &Rendering, layers: &[Layer]) {
    for channel in 0..3 {
        let [passed, reflected] = stack(layers, channel);
        assert_channel(rendering, channel, passed + 0.3 * reflected);
    }
}

fn seen(planes: Vec<Plane>, solids: &Solids, strategy: Strategy) -> Rendering {
    let planes = Planes {
        planes,
        sky: [0.3, 1.0],
        ..Planes::default()
    };
    let rendering = render(&planes, solids, strategy, 256);
    assert_eq!(rendering.report.media_overflow, 0);
    assert_eq!(rendering.report.lost_paths, 0);
    rendering
}

#[test]
fn the_closed_form_is_that_of_a_plate() {
    let (r, a): (f64, f64) = (0.04, (-0.5f64).exp());
    let [t, front] = stack(&[(0.5, [1.0, 0.0, 0.0], 1.5)], 0);
    assert!((t - (1.0 - r).powi(2) * a / (1.0 - r * r * a * a)).abs() < 1e-12);
    let expected = r + (1.0 - r).powi(2) * r * a * a / (1.0 - r * r * a * a);
    assert!((front - expected).abs() < 1e-12);
}

#[test]
fn a_slab_absorbs_by_its_thickness() {
    let absorption = [0.2, 1.0, 4.0];
    let tinted = Solids(vec![Solid::smooth(absorption, 1.5, 0)]);
    for thickness in [0.5, 2.0] {
        let rendering = seen(slab(0, 0.0, thickness).into(), &tinted, Strategy::OWN);
        assert_layers(&rendering, &[(f64::from(thickness), absorption, 1.5)]);
    }
}

/// Walls of glass at 0..1 and 2.5..3.5, and water from 0.5 to 3, whose surfaces are in the glass.
fn filled_glass(glass: u32, water: u32) -> (Vec<Plane>, Solids) {
    let planes = [slab(0, 0.0, 1.0), slab(1, 0.5, 3.0), slab(0, 2.5, 3.5)];
    let solids = vec![
        Solid::smooth([0.5, 0.1, 0.2], 1.5, glass),
        Solid::smooth([0.1, 0.3, 0.6], 1.33, water),
    ];
    (planes.concat(), Solids(solids))
}

#[test]
fn of_media_that_overlap_the_one_of_higher_priority_is_there() {
    const GLASS: [f32; 3] = [0.5, 0.1, 0.2];
    const WATER: [f32; 3] = [0.1, 0.3, 0.6];
    let layers = |wall, fill| [(wall, GLASS, 1.5), (fill, WATER, 1.33), (wall, GLASS, 1.5)];
    let (planes, solids) = filled_glass(7, 3);
    let reference = seen(planes.clone(), &solids, Strategy::OWN);
    assert_layers(&reference, &layers(1.0, 1.5));
    for strategy in [Strategy::MIXED, Strategy::MEGA] {
        let other = seen(planes.clone(), &solids, strategy);
        if gpu().info().kind == "software" {
            assert!(other.film == reference.film, "{strategy:?} differs");
        }
        assert_layers(&other, &layers(1.0, 1.5));
    }
    let (planes, solids) = filled_glass(3, 7);
    let swapped = seen(planes, &solids, Strategy::OWN);
    assert_layers(&swapped, &layers(0.5, 2.5));
}

/// Water around glass around ice: nothing overlaps, and each boundary has the next medium outside.
#[test]
fn a_boundary_has_the_index_of_what_it_lies_in() {
    let solids = Solids(vec![
        Solid::smooth(CLEAR, 1.33, 0),
        Solid::smooth(CLEAR, 2.4, 1),
        Solid::smooth([0.0, 0.0, 1.0], 1.6, 2),
    ]);
    let planes = [slab(0, 0.0, 5.0), slab(1, 1.0, 4.0), slab(2, 2.0, 3.0)].concat();
    let rendering = seen(planes, &solids, Strategy::OWN);
    let layers = [
        (1.0, CLEAR, 1.33),
        (1.0, CLEAR, 2.4),
        (1.0, [0.0, 0.0, 1.0], 1.6),
        (1.0, CLEAR, 2.4),
        (1.0, CLEAR, 1.33),
    ];
    assert_layers(&rendering, &layers);
}

#[test]
fn what_is_thin_walled_or_opaque_changes_no_medium() {
    let absorption = [0.5, 1.0, 2.0];
    let solids = Solids(vec![
        Solid::smooth(absorption, 1.5, 0),
        Solid::empty(Surface::Window),
    ]);
    // The windows' other faces are not where they would have to be to leave what was entered.
    let mut planes = slab(0, 0.0, 1.0).to_vec();
    for z in [-0.5, 0.3, 0.6, 1.5] {
        planes.push(Plane {
            z,
            outward: z > 0.4,
            solid: 1,
        });
    }
    let rendering = seen(planes, &solids, Strategy::OWN);
    assert_layers(&rendering, &[(1.0, absorption, 1.5)]);
}

#[test]
fn a_camera_in_a_medium_sees_through_it() {
    let absorption = [0.3, 1.0, 3.0];
    let solids = Solids(vec![
        Solid::smooth(absorption, 1.5, 0),
        Solid::empty(Surface::Glow(2.0)),
        Solid::smooth([9.0; 3], 1.1, 1),
    ]);
    let glow = Plane {
        z: 1.5,
        outward: false,
        solid: 1,
    };
    let planes = |around: Vec<u32>, inner: &[Plane]| Planes {
        planes: [&[glow], inner].concat(),
        camera: 0.0,
        around,
        ..Planes::default()
    };
    let inside = render(&planes(vec![0], &[]), &solids, Strategy::OWN, 1);
    for (channel, a) in absorption.iter().enumerate() {
        assert_channel(&inside, channel, 2.0 * f64::from(-1.5 * a).exp());
    }
    let outside = render(&planes(vec![], &[]), &solids, Strategy::OWN, 1);
    assert_channel(&outside, 1, 2.0);
    // In the inner of two, which ends at 0.25.
    let end = Plane {
        z: 0.25,
        outward: true,
        solid: 2,
    };
    let nested = render(&planes(vec![0, 2], &[end]), &solids, Strategy::OWN, 256);
    let r = f64::powi((1.5 - 1.1) / (1.5 + 1.1), 2);
    for (channel, a) in absorption.iter().enumerate() {
        let way = 0.25 * 9.0 + 1.25 * f64::from(*a);
        assert_channel(&nested, channel, 2.0 * (1.0 - r) * (-way).exp());
    }
}

/// What a Lambertian plane sends back of a light in the same medium, and one that transmits of
/// a light in the medium behind it.
#[test]
fn light_is_absorbed_on_its_way_from_light_to_surface() {
    let absorption = [0.3, 1.0, 3.0];
    let ground = Solid::empty(Surface::Diffuse(0.8));
    let medium = Solid::smooth(absorption, 1.0, 0);
    let plane = |solid, outward| Plane {
        z: 1.0,
        outward,
        solid,
    };
    let lit = Planes {
        planes: vec![plane(0, false)],
        sky: [0.0; 2],
        light: Light::Point(0.25, 5.0),
        camera: 0.5,
        around: vec![1],
        max_depth: 2,
    };
    let rendering = render(&lit, &Solids(vec![ground, medium]), Strategy::OWN, 1);
    let irradiance = 5.0 / (0.75 * 0.75);
    for (channel, a) in absorption.iter().enumerate() {
        let way = f64::from(*a) * (0.5 + 0.75);
        let expected = 0.8 * std::f64::consts::FRAC_1_PI * irradiance * (-way).exp();
        assert_channel(&rendering, channel, expected);
    }
    let skin = Solid {
        surface: Surface::Translucent(0.6),
        ..medium
    };
    let behind = Planes {
        planes: vec![plane(0, false)],
        light: Light::Point(1.5, 5.0),
        around: Vec::new(),
        ..lit
    };
    for strategy in [Strategy::OWN, Strategy::MEGA] {
        let rendering = render(&behind, &Solids(vec![skin]), strategy, 1);
        for (channel, a) in absorption.iter().enumerate() {
            let way = f64::from(*a) * 0.5;
            let expected = 0.6 * std::f64::consts::FRAC_1_PI * 5.0 / 0.25 * (-way).exp();
            assert_channel(&rendering, channel, expected);
        }
    }
}

/// A surface of albedo 0.7 under an even sky shows 0.7 of it, whatever clear thing lies between:
/// all of these block light samples, so that scattering has to count in full.
#[test]
fn light_behind_what_blocks_its_samples_counts_once() {
    let solids = Solids(vec![
        Solid::empty(Surface::Diffuse(0.7)),
        Solid::empty(Surface::Window),
        Solid::smooth(CLEAR, 1.0, 0),
        Solid::smooth(CLEAR, 1.0, 5),
    ]);
    let ground = Plane {
        z: 3.0,
        outward: false,
        solid: 0,
    };
    let window = Plane {
        z: 2.0,
        outward: false,
        solid: 1,
    };
    for (name, between, around) in [
        ("nothing", vec![], vec![]),
        ("a window", vec![window], vec![]),
        ("a medium", slab(2, 1.0, 2.0).to_vec(), vec![]),
        ("a hidden medium", slab(2, 1.0, 2.0).to_vec(), vec![3]),
    ] {
        let planes = Planes {
            planes: [vec![ground], between].concat(),
            sky: [1.0; 2],
            light: Light::Sky,
            camera: 2.5,
            around,
            max_depth: 8,
        };
        let rendering = render(&planes, &solids, Strategy::OWN, 64);
        let values = rendering.film.pixels.iter().map(|p| f64::from(p[0]));
        let (mean, error) = mean(values);
        let difference = (mean - 0.7).abs();
        assert!(
            difference <= 4.0 * error + 1e-6,
            "{name}: {mean} +- {error}"
        );
    }
}

#[test]
fn hidden_boundaries_cost_no_depth_but_end_somewhere() {
    let solids = Solids(vec![
        Solid::smooth([0.1; 3], 1.0, 1),
        Solid::smooth([50.0; 3], 2.0, 0),
        Solid::empty(Surface::Glow(2.0)),
    ]);
    let glow = Plane {
        z: 4.0,
        outward: false,
        solid: 2,
    };
    let shells = |count: u32| Planes {
        planes: (0..count)
            .map(|i| i as f32 * 0.002 + 0.001)
            .flat_map(|z| slab(1, z, z + 0.001))
            .chain([glow])
            .collect(),
        camera: 0.0,
        around: vec![0],
        max_depth: 1,
        ..Planes::default()
    };
    for strategy in [Strategy::OWN, Strategy::MEGA] {
        let few = render(&shells(32), &solids, strategy, 1);
        assert_eq!(few.report.lost_paths, 0);
        assert_channel(&few, 0, 2.0 * (-0.4f64).exp());
        let many = render(&shells(1000), &solids, strategy, 1);
        assert_eq!(many.report.lost_paths, many.report.paths);
        assert_channel(&many, 0, 0.0);
    }
}

#[test]
fn a_fifth_medium_is_counted_and_left_out() {
    let weak = |priority| Solid::smooth([0.1; 3], 1.0, priority);
    let solids = Solids((0..5).map(weak).collect());
    let planes: Vec<Plane> = (0..5)
        .flat_map(|i| slab(i, i as f32, 10.0 - i as f32))
        .collect();
    let planes = Planes {
        planes,
        ..Planes::default()
    };
    let rendering = render(&planes, &solids, Strategy::OWN, 1);
    assert_eq!(rendering.report.media_overflow, rendering.report.paths);
    assert_channel(&rendering, 0, (-1.0f64).exp());
}

/// The text of all kernels.
fn texts(solids: &Solids, strategy: Strategy) -> String {
    let options = RenderOptions::default();
    let planes = Planes {
        planes: slab(0, 0.0, 1.0).to_vec(),
        light: Light::Point(0.0, 1.0),
        ..Planes::default()
    };
    let plan = planned(solids, strategy);
    let world = planes.world(solids);
    let renderer = Renderer::from_world(gpu(), &world, solids, &plan, &options);
    let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    renderer.kernels().map(|(_, wgsl)| wgsl).collect()
}

#[test]
fn kernels_follow_media_as_far_as_a_scene_needs() {
    let ground = Solid::empty(Surface::Diffuse(0.5));
    let skin = |priority| Solid {
        surface: Surface::Translucent(0.5),
        ..Solid::smooth(CLEAR, 1.5, priority)
    };
    let follows = ["fn active_medium(", "load_media(", "CAMERA_MEDIA"];
    let reads = "fn exterior_index(";
    let absorbs = "transmittance(";
    let overlaps = ["is_false_boundary(", "trace_to_boundary("];
    for strategy in [Strategy::OWN, Strategy::MEGA] {
        let assert = |solids: Vec<Solid>, present: &[&str], absent: &[&str]| {
            let text = texts(&Solids(solids), strategy);
            for name in present {
                assert!(text.contains(name), "{strategy:?} misses {name}");
            }
            for name in absent {
                assert!(!text.contains(name), "{strategy:?} has {name}");
            }
        };
        let [follow, read] = [&follows[..], &[reads]];
        let none = [follow, read, &[absorbs], &overlaps].concat();
        // Nothing depends on the medium of a clear thing without Fresnel.
        assert(vec![ground, skin(0)], &[], &none);
        let clear = vec![ground, Solid::smooth(CLEAR, 1.5, 0)];
        let rest = [&[absorbs][..], &overlaps].concat();
        assert(clear, &[follow, read].concat(), &rest);
        let tinted = vec![ground, Solid::smooth([1.0; 3], 1.5, 0)];
        assert(tinted, &[follow, &[absorbs]].concat(), &overlaps);
        let two = vec![ground, skin(0), skin(1)];
        assert(two, &[follow, &overlaps].concat(), &[absorbs]);
    }
}

/// The media that a path is in as a list, the one entered last first.
#[derive(Clone, Debug, Default, PartialEq)]
struct Entered(Vec<u32>);

impl Entered {
    fn words(&self) -> [u32; 4] {
        std::array::from_fn(|i| self.0.get(i).copied().unwrap_or(0))
    }

    fn of(words: [u32; 4]) -> Self {
        Self(words.into_iter().take_while(|word| *word != 0).collect())
    }

    /// Of equal priorities the one entered last.
    fn active(&self) -> u32 {
        let rank = |word: u32| word >> 16;
        let better = |best: u32, word: &u32| {
            if rank(*word) > rank(best) {
                *word
            } else {
                best
            }
        };
        self.0
            .iter()
            .fold(self.0.first().copied().unwrap_or(0), better)
    }

    fn without(&self, medium: u32) -> Self {
        let mut left = self.clone();
        if let Some(at) = left.0.iter().position(|word| *word == medium) {
            left.0.remove(at);
        }
        left
    }

    fn beyond(&self, medium: u32, inside: bool) -> Self {
        if inside {
            return self.without(medium);
        }
        let mut entered = self.clone();
        if self.0.len() < 4 {
            entered.0.insert(0, medium);
        }
        entered
    }
}

/// Kernels follow media as a list does, however deep they nest and in whatever order they are left.
#[test]
fn media_are_entered_and_left_in_any_order() {
    let glass = Solid::smooth(CLEAR, 1.5, 0);
    let glass = Solids(vec![glass]);
    let media = Media::build(&glass.infos(), &glass.instances(), &[]).expect("few media");
    let mut part = media.part.expect("glass is filled");
    part.wgsl += "const COUNTER_MEDIA_OVERFLOW: u32 = 0u;\nvar<workgroup> counters: array<atomic<u32>, 1>;\n";
    // Three priorities, two media of each.
    let media: Vec<u32> = (0..6).map(|i| (1 + i / 2) << 16 | (1 + i)).collect();
    let mut random = Random::new(4);
    let mut stack = Entered::default();
    let mut input = Vec::new();
    for _ in 0..4000 {
        let medium = media[random.bits() as usize % media.len()];
        let inside = random.bits().is_multiple_of(2);
        input.extend([stack.words(), [medium, u32::from(inside), 0, 0]]);
        stack = stack.beyond(medium, inside);
    }
    let count = input.len() / 2;
    let body = "
        let stack = input[2u * i];
        let medium = input[2u * i + 1u].x;
        let inside = input[2u * i + 1u].y == 1u;
        result[2u * i] = cross_boundary(stack, medium, inside);
        let hidden = select(0u, 1u, is_false_boundary(stack, medium, inside));
        result[2u * i + 1u] = vec4<u32>(active_medium(stack), hidden, 0u, 0u);";
    let rows = run(&[&part], body, &input, count, 2 * count);
    let mut deepest = 0;
    for (asked, answer) in input.chunks(2).zip(rows.chunks(2)) {
        let (stack, medium, inside) = (Entered::of(asked[0]), asked[1][0], asked[1][1] == 1);
        let outside = if inside {
            stack.without(medium)
        } else {
            stack.clone()
        };
        let is_hidden = outside.active() >> 16 > medium >> 16;
        assert_eq!(
            answer[0],
            stack.beyond(medium, inside).words(),
            "{asked:x?}"
        );
        let expected = [stack.active(), u32::from(is_hidden)];
        assert_eq!(answer[1][..2], expected, "{asked:x?}");
        deepest = deepest.max(stack.0.len());
    }
    assert_eq!(deepest, 4);
}
