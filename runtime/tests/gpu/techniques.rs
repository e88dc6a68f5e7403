//! Techniques are ways to do the same work: each value of each choice renders the paths that the
//! default renders.

use std::fmt::Debug;

use crate::gpu::plans::{room, surfaces};
use crate::gpu::stub::{Room, gpu, plan, render_plan, samples};
use impasto_compiler::partition::Strategy;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::Rendering;
use impasto_runtime::technique::{
    Append, CameraRays, Choice, RayData, Regeneration, SlotOrder, StateLayout, Technique,
};

fn run(strategy: Strategy, technique: Technique) -> Rendering {
    run_in(&room(), strategy, technique)
}

fn run_in(room: &Room, strategy: Strategy, technique: Technique) -> Rendering {
    // A pool smaller than the picture, so that slots take path after path.
    let options = RenderOptions {
        pool: Some(700),
        technique,
        ..samples(8)
    };
    run_with(room, strategy, &options)
}

fn run_with(room: &Room, strategy: Strategy, options: &RenderOptions) -> Rendering {
    let surfaces = surfaces();
    render_plan(
        &room.world(),
        &surfaces,
        &plan(strategy, &surfaces),
        options,
    )
}

/// Renders with every value of a choice, and fails where pictures differ.
fn assert_equal<C: Choice + Debug>(strategy: Strategy, set: impl Fn(&mut Technique, C)) {
    assert_equal_in(&room(), strategy, set);
}

fn assert_equal_in<C: Choice + Debug>(
    room: &Room,
    strategy: Strategy,
    set: impl Fn(&mut Technique, C),
) {
    let reference = run_in(room, strategy, Technique::default());
    for (value, name, _) in C::ALL {
        let mut technique = Technique::default();
        set(&mut technique, *value);
        let rendering = run_in(room, strategy, technique);
        let pixels = rendering.film.pixels.iter().flatten();
        let pairs = pixels.zip(reference.film.pixels.iter().flatten());
        let astray = pairs.filter(|(a, b)| (**a - **b).abs() > 1e-5 * b.max(1.0));
        // Other drivers may round a kernel that is compiled another way differently.
        let allowed = match gpu().info().kind {
            "software" => 0,
            _ => reference.film.pixels.len() * 3 / 50,
        };
        assert!(astray.count() <= allowed, "{value:?}: the pictures differ");
        let ran = serde_json::to_value(rendering.report.technique).expect("JSON");
        let ran = ran.as_object().expect("an object");
        assert!(
            ran.values().any(|v| v == name),
            "`{name}` was asked for, {ran:?} ran"
        );
    }
}

#[test]
fn queues_are_appended_to_in_any_way() {
    for strategy in [Strategy::OWN, Strategy::MIXED] {
        assert_equal::<Append>(strategy, |t, value| t.append = value);
    }
}

#[test]
fn rays_may_lie_in_buffers_of_their_own() {
    for append in [Append::Workgroup, Append::Subgroup] {
        assert_equal::<RayData>(Strategy::OWN, |t, value| {
            t.append = append;
            t.ray_data = value;
        });
    }
}

#[test]
fn path_state_may_lie_in_either_order() {
    assert_equal::<StateLayout>(Strategy::OWN, |t, value| t.state = value);
}

#[test]
fn paths_may_keep_their_slots() {
    for strategy in [Strategy::OWN, Strategy::MIXED, Strategy::INLINE] {
        assert_equal::<SlotOrder>(strategy, |t, value| t.slot_order = value);
    }
    for layout in [StateLayout::Pairs, StateLayout::Structures] {
        assert_equal::<SlotOrder>(Strategy::OWN, |t, value| {
            t.state = layout;
            t.slot_order = value;
        });
    }
    assert_equal::<SlotOrder>(Strategy::INLINE, |t, value| {
        t.ray_data = RayData::Requests;
        t.slot_order = value;
    });
}

/// In a room, and where most rays of the camera meet nothing.
#[test]
fn rays_of_the_camera_may_be_cast_at_once() {
    let open = Room {
        walls: false,
        sky: 0.7,
        ..room()
    };
    for room in [room(), open] {
        for strategy in [Strategy::OWN, Strategy::INLINE] {
            assert_equal_in::<CameraRays>(&room, strategy, |t, value| t.camera_rays = value);
        }
        assert_equal_in::<CameraRays>(&room, Strategy::OWN, |t, value| {
            t.append = Append::Thread;
            t.camera_rays = value;
        });
    }
}

/// A path takes an iteration less. Its state is written once, whichever way it is laid out.
#[test]
fn what_the_camera_sees_goes_straight_to_its_material() {
    let run = |change: fn(&mut Technique)| {
        let mut technique = Technique::default();
        change(&mut technique);
        let options = RenderOptions {
            pool: Some(300),
            technique,
            ..samples(32)
        };
        run_with(&room(), Strategy::OWN, &options)
    };
    let at_once = run(|t| t.camera_rays = CameraRays::AtOnce);
    for straight in [
        run(|t| t.camera_rays = CameraRays::Straight),
        run(|t| (t.camera_rays, t.state) = (CameraRays::Straight, StateLayout::Pairs)),
        run(|t| (t.camera_rays, t.state) = (CameraRays::Straight, StateLayout::Structures)),
        run(|t| (t.camera_rays, t.slot_order) = (CameraRays::Straight, SlotOrder::Work)),
    ] {
        assert_eq!(straight.film, at_once.film);
        let iterations = [&straight, &at_once].map(|rendering| rendering.report.iterations);
        assert!(iterations[0] < iterations[1], "{iterations:?}");
    }
}

/// Rays that are not the path's own are cast with the others, and one that ends there is counted once.
#[test]
fn rays_of_the_camera_are_cast_at_once_where_nothing_else_is_asked_of_them() {
    let open = Room {
        walls: false,
        sky: 0.7,
        ..room()
    };
    for (ray_data, camera_rays) in [
        (RayData::Slots, CameraRays::Straight),
        (RayData::Requests, CameraRays::Queue),
    ] {
        let technique = Technique {
            ray_data,
            ..Technique::default()
        };
        let rendering = run_in(&open, Strategy::OWN, technique);
        assert_eq!(rendering.report.technique.camera_rays, camera_rays);
        assert!(rendering.film.samples.iter().all(|count| *count == 8));
    }
}

/// Threads that append on their own do not wait for each other, so that none may take another's slot.
#[test]
fn paths_move_only_where_workgroups_append_together() {
    for (append, order) in [
        (Append::Workgroup, SlotOrder::Work),
        (Append::Subgroup, SlotOrder::Fixed),
        (Append::Thread, SlotOrder::Fixed),
    ] {
        let technique = Technique {
            append,
            ..Technique::default()
        };
        let rendering = run(Strategy::OWN, technique);
        assert_eq!(rendering.report.technique.slot_order, order, "{append:?}");
    }
}

#[test]
fn a_megakernel_may_regenerate_paths_whenever_it_likes() {
    assert_equal::<Regeneration>(Strategy::MEGA, |t, value| t.regeneration = value);
}

#[test]
fn profiling_counts_lanes_and_leaves_the_picture_alone() {
    for strategy in [Strategy::OWN, Strategy::MEGA] {
        let reference = run(strategy, Technique::default());
        assert!(
            reference
                .report
                .kernels
                .iter()
                .all(|k| k.utilisation.is_none())
        );
        let technique = Technique {
            profile: true,
            ..Technique::default()
        };
        let profiled = run(strategy, technique);
        assert!(profiled.film.samples == reference.film.samples);
        for kernel in &profiled.report.kernels {
            let share = kernel.utilisation.expect("a share of lanes");
            assert!(share > 0.0 && share <= 1.0, "{}: {share}", kernel.name);
        }
        // Threads of a megakernel hit different materials; a queue's items are all at work.
        let of = |name: &str| {
            let kernel = profiled.report.kernels.iter().find(|k| k.name == name);
            kernel.and_then(|k| k.utilisation)
        };
        if strategy == Strategy::MEGA {
            assert!(of("mega").expect("a share") < 0.9);
        } else {
            assert!(of("new_path").expect("a share") > 0.8);
        }
    }
}

#[test]
fn workgroups_may_have_any_size() {
    for strategy in [Strategy::OWN, Strategy::MEGA] {
        let reference = run(strategy, Technique::default());
        for threads in [1, 32, 100, 256] {
            for append in [Append::Workgroup, Append::Subgroup] {
                let technique = Technique {
                    workgroup: Some(threads),
                    append,
                    ..Technique::default()
                };
                let film = run(strategy, technique).film;
                assert!(film.samples == reference.film.samples);
                if gpu().info().kind == "software" {
                    assert!(film == reference.film, "{strategy:?}, {threads} threads");
                }
            }
        }
    }
}
