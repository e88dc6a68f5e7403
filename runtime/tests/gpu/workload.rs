//! What the logic kernel counts of hits: the same as queues hold, whatever the plan and the way to
//! append, and in how many blocks of neighbouring slots.

use impasto_compiler::partition::{Form, Hits, Plan, Strategy, Workload};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::report::Report;
use impasto_runtime::render::{NOBODY, Rendering, profile_workload};
use impasto_runtime::technique::{Append, CameraRays, Sampler, SlotOrder, Stack, Technique};

use crate::gpu::plans::{custom, room, surfaces};
use crate::gpu::stub::{Kind, Materials, Room, gpu, materials, plan, render_plan, samples};

fn counting(samples_a_pixel: u32) -> RenderOptions {
    RenderOptions {
        count_hits: true,
        pool: Some(200),
        ..samples(samples_a_pixel)
    }
}

fn workload(rendering: &Rendering) -> &Workload {
    let workload = rendering.report.workload.as_ref();
    workload.expect("hits were counted")
}

/// Hits of each material in the whole render.
fn hits(rendering: &Rendering) -> Vec<u64> {
    let report = &rendering.report;
    let slots = report.iterations as f64 * f64::from(report.pool_size);
    let of = |hits: &Hits| {
        let count = hits.share * slots;
        assert!((count - count.round()).abs() < 1e-3, "{count} hits");
        count.round() as u64
    };
    workload(rendering).materials.iter().map(of).collect()
}

/// Items of the queues of each material's own kernel.
fn items(report: &Report) -> Vec<u64> {
    let kernels = report.kernels.iter().filter(|k| !k.materials.is_empty());
    kernels.map(|k| k.items).collect()
}

fn render(plan: &Plan, options: &RenderOptions) -> Rendering {
    render_plan(&room().world(), &surfaces(), plan, options)
}

#[test]
fn hits_are_what_queues_hold() {
    let own = plan(Strategy::OWN, &surfaces());
    let uncounted = render(&own, &samples(4));
    assert!(uncounted.report.workload.is_none());
    for (append, stack) in [
        (Append::Workgroup, Stack::Private),
        (Append::Subgroup, Stack::Private),
        (Append::Thread, Stack::Private),
        // Where stacks are, memory does not begin as zeros.
        (Append::Workgroup, Stack::Workgroup),
        (Append::Subgroup, Stack::Workgroup),
    ] {
        let mut options = counting(4);
        (options.technique.append, options.technique.stack) = (append, stack);
        let rendering = render(&own, &options);
        assert_eq!(hits(&rendering), items(&rendering.report), "{append:?}");
        assert!(rendering.film == uncounted.film, "{append:?}");
    }
}

#[test]
fn hits_are_the_same_in_every_form() {
    let own = render(&plan(Strategy::OWN, &surfaces()), &counting(4));
    for other in [
        plan(Strategy::MIXED, &surfaces()),
        plan(Strategy::BINNED, &surfaces()),
        plan(Strategy::INLINE, &surfaces()),
        custom(&[
            (Form::Binned, &[0, 3]),
            (Form::Inline, &[1]),
            (Form::Own, &[2]),
        ]),
    ] {
        let rendering = render(&other, &counting(4));
        assert_eq!(hits(&rendering), hits(&own), "{}", other.strategy);
        assert!(rendering.film == own.film, "{}", other.strategy);
    }
}

#[test]
fn megakernels_and_odd_workgroups_count_nothing() {
    let mega = render(&plan(Strategy::MEGA, &surfaces()), &counting(1));
    assert!(mega.report.workload.is_none());
    let mut options = counting(1);
    options.technique.workgroup = Some(48);
    let odd = render(&plan(Strategy::OWN, &surfaces()), &options);
    assert!(odd.report.workload.is_none());
}

/// Three materials on the walls of a room seen whole, each path one hit.
fn seen(width: u32, height: u32, samples_a_pixel: u32) -> (Rendering, f64) {
    let surfaces = three();
    let room = Room {
        materials: [0, 1, 2, 0, 1, 2, 0],
        emitters: vec![3],
        max_depth: 2,
        width,
        height,
        ..Room::default()
    };
    let pool = width * height * samples_a_pixel;
    let mut options = RenderOptions {
        pool: Some(pool),
        ..counting(samples_a_pixel)
    };
    options.technique.sampler = Sampler::Independent;
    // All hits are found by logic, in one iteration.
    options.technique.camera_rays = CameraRays::AtOnce;
    let own = plan(Strategy::OWN, &surfaces);
    let rendering = render_plan(&room.world(), &surfaces, &own, &options);
    // Paths keep step: there is one iteration in which all hit something.
    let iterations = rendering.report.iterations as f64;
    (rendering, iterations)
}

fn three() -> Materials {
    materials(&[Kind::Diffuse(0.5), Kind::Diffuse(0.6), Kind::Diffuse(0.7)])
}

/// Slots that all look at one wide pixel hit what chance has it.
#[test]
fn independent_neighbours_are_present_everywhere() {
    let (rendering, iterations) = seen(1, 1, 8192);
    let mut shares = 0.0;
    for material in &workload(&rendering).materials {
        let (share, present) = (material.share * iterations, material.present * iterations);
        let expected = 1.0 - (1.0 - share).powi(32);
        // 256 blocks: four standard errors.
        let error = 4.0 * (expected * (1.0 - expected) / 256.0).sqrt() + 1e-9;
        assert!(
            (present - expected).abs() < error,
            "{material:?}: {present}, {expected}"
        );
        assert!(present >= share && present <= 1.0 + 1e-9);
        shares += share;
    }
    assert!((shares - 1.0).abs() < 1e-9);
}

/// Neighbours that look at the same wall hit the same.
#[test]
fn coherent_neighbours_are_present_where_they_hit() {
    let (rendering, iterations) = seen(256, 32, 1);
    for material in &workload(&rendering).materials {
        let (share, present) = (material.share * iterations, material.present * iterations);
        // Each row of eight blocks has few borders; by chance it would be at least 0.8.
        assert!(
            present >= share && present < share + 0.15,
            "{share}, {present}"
        );
        assert!(share > 0.05);
    }
}

/// Of a pool of many workgroups an eighth of these counts, which says the same of all.
#[test]
fn what_some_workgroups_count_holds_for_all() {
    let pool = 4096 * 32;
    let profile = |workgroup| {
        let technique = Technique {
            workgroup: Some(workgroup),
            // Paths in order lie together within a workgroup, and so in more blocks of smaller ones.
            slot_order: SlotOrder::Fixed,
            ..Technique::default()
        };
        let world = room().world();
        let workload =
            profile_workload(gpu(), &world, &surfaces(), Some(pool), technique, 8, NOBODY);
        workload.unwrap_or_else(|e| panic!("{e}"))
    };
    let (all, some) = (profile(64), profile(32));
    assert_eq!((all.pool, some.pool), (pool, pool));
    let mut differ = false;
    for (a, b) in all.materials.iter().zip(&some.materials) {
        assert!((a.share - b.share).abs() < 0.01, "{a:?} {b:?}");
        assert!((a.present - b.present).abs() < 0.03, "{a:?} {b:?}");
        differ |= a.share != b.share;
    }
    assert!(differ, "an eighth was counted");
}

#[test]
fn a_profiling_pass_knows_a_scene_without_rendering_it() {
    let surfaces = surfaces();
    let room = Room {
        unbound: vec![1],
        materials: [0, 2, 2, 0, 3, 2, 2],
        ..room()
    };
    let profile = |pool| {
        let technique = Technique::default();
        let world = room.world();
        let workload = profile_workload(gpu(), &world, &surfaces, pool, technique, 16, NOBODY);
        workload.unwrap_or_else(|e| panic!("{e}"))
    };
    let small = profile(Some(512));
    assert_eq!(small.pool, 512);
    // Five fields and the triangle; six fields.
    let first = &small.materials[0];
    assert_eq!((first.loads, first.stores), (5.0 * 16.0 + 48.0, 6.0 * 16.0));
    assert!(small.logic_seconds > 0.0 && small.other_seconds > 0.0);
    let on_surface: Vec<bool> = small.materials.iter().map(|m| m.on_surface).collect();
    assert_eq!(on_surface, [true, false, true, true]);
    assert_eq!(
        (small.materials[1].share, small.materials[1].present),
        (0.0, 0.0)
    );
    let large = profile(Some(4096));
    for (a, b) in small.materials.iter().zip(&large.materials) {
        assert!((a.share - b.share).abs() < 0.05, "{a:?} {b:?}");
        assert!(a.share <= a.present && a.present <= 1.0, "{a:?}");
    }
    let hits: f64 = large.materials.iter().map(|m| m.share).sum();
    // A path that ends is followed at once by one that hits a wall.
    assert!((hits - 1.0).abs() < 1e-9, "{hits}");
    // Those of the camera's rays are some of them.
    assert!(large.begun > 0.1 && large.begun < hits, "{}", large.begun);
}
