//! Plans organise the same computation: wavefront, megakernel and what is between them must
//! render the same picture, and count the same work.

use std::ops::ControlFlow;

use crate::gpu::stub::{Kind, Materials, Room, gpu, materials, plan, render_plan, samples};
use impasto_compiler::partition::{Form, Organisation, Plan, PlanKernel, Strategy};
use impasto_runtime::error::RuntimeError;
use impasto_runtime::film::Film;
use impasto_runtime::gpu::{Gpu, GpuOptions, Timing};
use impasto_runtime::render::report::{Report, TimeSource};
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::technique::{Append, Choice, RayData, RayOrder};
use impasto_runtime::world::surface::Surface;

pub fn room() -> Room {
    Room {
        plate: true,
        emitters: vec![3],
        max_depth: 6,
        roulette_start: 3,
        materials: [0, 1, 2, 0, 3, 1, 2],
        ..Room::default()
    }
}

pub fn surfaces() -> Materials {
    materials(&[
        Kind::Diffuse(0.6),
        Kind::Failing(0.5),
        Kind::Mirror,
        Kind::Glowing(0.3, 1.0),
    ])
}

pub fn custom(kernels: &[(Form, &[usize])]) -> Plan {
    let kernel = |(index, (form, members)): (usize, &(Form, &[usize]))| PlanKernel {
        name: format!("material_{index}"),
        form: *form,
        materials: members.to_vec(),
        workgroup: None,
    };
    Plan {
        strategy: "custom".into(),
        organisation: Organisation::Wavefront,
        kernels: kernels.iter().enumerate().map(kernel).collect(),
        unused: Vec::new(),
    }
}

fn run(plan: &Plan) -> (Film, Report) {
    let rendering = render_plan(&room().world(), &surfaces(), plan, &samples(16));
    (rendering.film, rendering.report)
}

/// The same body is compiled into several kernels, where a GPU's driver may contract or
/// reorder arithmetic in its own way; a path that goes astray changes its pixel. Mesa's
/// software driver does not, and gives equal bits.
#[track_caller]
fn assert_equal_but_for_rounding(a: &Film, b: &Film) {
    if gpu().info().kind == "software" {
        assert!(a == b, "the films differ");
    }
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    let astray = pairs
        .filter(|(a, b)| (**a - **b).abs() > 1e-5 * a.max(1.0))
        .count();
    let allowed = a.pixels.len() * 3 / 50;
    assert!(
        astray <= allowed,
        "{astray} of {} values differ",
        a.pixels.len() * 3
    );
}

#[test]
fn every_plan_renders_the_same_paths() {
    let surfaces = surfaces();
    let (reference, _) = run(&plan(Strategy::OWN, &surfaces));
    for other in [
        plan(Strategy::MIXED, &surfaces),
        plan(Strategy::MEGA, &surfaces),
        custom(&[
            (Form::Mixed, &[0, 2]),
            (Form::Inline, &[1]),
            (Form::Own, &[3]),
        ]),
        custom(&[(Form::Inline, &[0, 1, 2, 3])]),
        plan(Strategy::BINNED, &surfaces),
    ] {
        let (film, report) = run(&other);
        assert_equal_but_for_rounding(&film, &reference);
        assert_eq!(report.queue_overflow, 0);
    }
}

/// Every way to part `members` into groups.
fn partitions(members: &[usize]) -> Vec<Vec<Vec<usize>>> {
    let Some((last, rest)) = members.split_last() else {
        return vec![Vec::new()];
    };
    let mut all = Vec::new();
    for groups in partitions(rest) {
        for joined in 0..=groups.len() {
            let mut groups = groups.clone();
            match groups.get_mut(joined) {
                Some(group) => group.push(*last),
                None => groups.push(vec![*last]),
            }
            all.push(groups);
        }
    }
    all
}

/// Every way to evaluate the groups, at most one of them inline.
fn assignments(groups: &[Vec<usize>]) -> Vec<Vec<(Form, &[usize])>> {
    let mut all = vec![Vec::new()];
    for group in groups {
        let forms: &[Form] = match group.len() {
            1 => &[Form::Own, Form::Inline],
            _ => &[Form::Mixed, Form::Binned, Form::Inline],
        };
        let is_inline = |kernels: &[(Form, &[usize])]| kernels.iter().any(|k| k.0 == Form::Inline);
        let extended = all.iter().flat_map(|kernels| {
            let allowed = forms
                .iter()
                .filter(|form| **form != Form::Inline || !is_inline(kernels));
            allowed.map(|form| {
                let mut kernels: Vec<(Form, &[usize])> = kernels.clone();
                kernels.push((*form, group));
                kernels
            })
        });
        all = extended.collect();
    }
    all
}

/// Evaluations of each of `count` materials, where reports say them apart; all of them otherwise.
fn evaluations(report: &Report) -> u64 {
    let queued = report.kernels.iter().filter(|k| !k.materials.is_empty());
    queued.map(|k| k.items).sum()
}

/// Four materials in every partition, each group in every form.
#[test]
fn every_assignment_renders_the_same_paths() {
    let room = Room {
        width: 8,
        height: 8,
        ..room()
    };
    let (world, surfaces) = (room.world(), surfaces());
    let own = render_plan(
        &world,
        &surfaces,
        &plan(Strategy::OWN, &surfaces),
        &samples(4),
    );
    let mut tried = 0;
    for groups in partitions(&[0, 1, 2, 3]) {
        for kernels in assignments(&groups) {
            let rendering = render_plan(&world, &surfaces, &custom(&kernels), &samples(4));
            assert_equal_but_for_rounding(&rendering.film, &own.film);
            if kernels.iter().all(|(form, _)| *form != Form::Inline) {
                let (a, b) = (evaluations(&rendering.report), evaluations(&own.report));
                assert!(a.abs_diff(b) <= b / 100, "{kernels:?}: {a} and {b}");
            }
            tried += 1;
        }
    }
    assert_eq!(tried, 94);
}

/// The prepare kernel gives each queue as many workgroups as its own kernel needs.
#[test]
fn kernels_may_have_workgroups_of_their_own() {
    let kernels = [
        (Form::Own, &[0][..]),
        (Form::Binned, &[1, 3]),
        (Form::Own, &[2]),
    ];
    let (reference, report) = run(&custom(&kernels));
    let expected = evaluations(&report);
    for workgroups in [
        [Some(1), Some(33), None],
        [Some(384), None, Some(64)],
        [None, Some(1024), Some(512)],
    ] {
        let mut plan = custom(&kernels);
        for (kernel, workgroup) in plan.kernels.iter_mut().zip(workgroups) {
            kernel.workgroup = workgroup;
        }
        let (film, report) = run(&plan);
        assert_equal_but_for_rounding(&film, &reference);
        let found = evaluations(&report);
        assert!(
            found.abs_diff(expected) <= expected / 100,
            "{workgroups:?}: {found} and {expected}"
        );
    }
}

/// Queues of unequal length and more than the threads that prepare dispatches, workgroups from
/// one thread up: every item finds its queue. (Mesa's software driver cannot nest a `switch` of more
/// than about 80 cases.)
#[test]
fn binned_kernels_of_many_materials_evaluate_every_item() {
    let kinds = (0..132).map(|i| Kind::Diffuse(0.2 + 0.005 * i as f32));
    let surfaces = materials(&kinds.collect::<Vec<_>>());
    let room = Room {
        materials: [3, 131, 62, 64, 0, 128, 63],
        width: 8,
        height: 8,
        ..room()
    };
    let world = room.world();
    let render = |kernels: &[(Form, std::ops::Range<usize>)], workgroup| {
        let members: Vec<Vec<usize>> = kernels.iter().map(|(_, m)| m.clone().collect()).collect();
        let kernels = kernels.iter().zip(&members);
        let kernels: Vec<(Form, &[usize])> = kernels.map(|((f, _), m)| (*f, &m[..])).collect();
        let mut options = samples(8);
        options.technique.workgroup = Some(workgroup);
        render_plan(&world, &surfaces, &custom(&kernels), &options)
    };
    use Form::{Binned, Mixed, Own};
    let mixed = render(&[(Mixed, 0..61), (Mixed, 61..129), (Mixed, 129..132)], 64);
    let expected = evaluations(&mixed.report);
    for workgroup in [1, 32, 256] {
        let kernels = [
            (Binned, 0..60),
            (Own, 60..61),
            (Binned, 61..129),
            (Binned, 129..132),
        ];
        let binned = render(&kernels, workgroup);
        assert_equal_but_for_rounding(&binned.film, &mixed.film);
        let found = evaluations(&binned.report);
        assert!(
            found.abs_diff(expected) <= expected / 100,
            "{found} and {expected}"
        );
    }
}

/// More workgroups than a dimension of a dispatch has: a binned kernel goes on in a second row, whose
/// last workgroups have no queue.
#[test]
fn binned_kernels_go_on_in_a_second_row() {
    let room = Room {
        width: 280,
        height: 256,
        ..room()
    };
    let (world, surfaces) = (room.world(), surfaces());
    let render = |strategy, workgroup| {
        let mut options = samples(1);
        options.technique.workgroup = Some(workgroup);
        let plan = plan(strategy, &surfaces);
        render_plan(&world, &surfaces, &plan, &options).film
    };
    let reference = render(Strategy::OWN, 64);
    assert_equal_but_for_rounding(&render(Strategy::BINNED, 1), &reference);
}

/// Kernels of every form append and ask for rays in every way.
#[test]
fn every_form_renders_by_every_technique() {
    let room = Room {
        width: 8,
        height: 8,
        ..room()
    };
    let (world, surfaces) = (room.world(), surfaces());
    let reference = render_plan(
        &world,
        &surfaces,
        &plan(Strategy::OWN, &surfaces),
        &samples(4),
    );
    let forms = custom(&[
        (Form::Binned, &[0, 3]),
        (Form::Inline, &[1]),
        (Form::Own, &[2]),
    ]);
    let binned = plan(Strategy::BINNED, &surfaces);
    for (append, _, _) in Append::ALL {
        for (ray_data, ray_order) in [
            (RayData::Slots, RayOrder::Queue),
            (RayData::Requests, RayOrder::Queue),
            (RayData::Slots, RayOrder::Coarse),
        ] {
            let mut options = samples(4);
            options.technique.append = *append;
            options.technique.ray_data = ray_data;
            options.technique.ray_order = ray_order;
            for plan in [&forms, &binned] {
                let rendering = render_plan(&world, &surfaces, plan, &options);
                assert_equal_but_for_rounding(&rendering.film, &reference.film);
            }
        }
    }
}

/// A kernel by any name that has one material is the kernel that this material has of its own.
#[test]
fn kernels_of_one_material_have_the_same_text() {
    let texts = |form| {
        let surfaces = surfaces();
        let plan = custom(&[(Form::Mixed, &[0, 1, 2]), (form, &[3])]);
        let renderer = Renderer::from_world(gpu(), &room().world(), &surfaces, &plan, &samples(1))
            .unwrap_or_else(|e| panic!("{e}"));
        let texts = renderer.kernels().map(|(_, wgsl)| wgsl.to_string());
        texts.collect::<Vec<_>>()
    };
    assert_eq!(texts(Form::Mixed), texts(Form::Own));
    assert_eq!(texts(Form::Binned), texts(Form::Own));
    assert!(!texts(Form::Own).concat().contains("FIRST_GROUP"));
}

/// Plans may call kernels what they like; reports tell them apart.
#[test]
fn kernels_of_the_same_name_are_numbered() {
    let mut plan = custom(&[
        (Form::Binned, &[0, 1]),
        (Form::Own, &[2]),
        (Form::Own, &[3]),
    ]);
    for kernel in &mut plan.kernels {
        kernel.name = "new_path".into();
    }
    let (_, report) = run(&plan);
    let names: Vec<&str> = report.kernels.iter().map(|k| k.name.as_str()).collect();
    let expected = [
        "new_path",
        "prepare_materials",
        "new_path_2",
        "new_path_3",
        "new_path_4",
    ];
    assert_eq!(names[2..7], expected);
}

#[test]
fn kernels_count_their_items() {
    let (_, own) = run(&plan(Strategy::OWN, &surfaces()));
    let (_, shared) = run(&plan(Strategy::MIXED, &surfaces()));
    let items = |report: &Report, name: &str| {
        let named = report.kernels.iter().filter(|k| k.name.starts_with(name));
        named.map(|k| k.items).sum::<u64>()
    };
    assert_eq!(
        items(&own, "new_path"),
        own.paths + u64::from(own.pool_size)
    );
    assert!(items(&own, "material_m2") > 0);
    let (a, b) = (items(&own, "material_m"), items(&shared, "material"));
    assert!(a.abs_diff(b) < a / 100, "{a} and {b} materials evaluated");
    // Every path casts one ray, and every scattering that did not fail another.
    let cast = own.items_of("extension").expect("extension rays");
    assert!(cast > own.paths && cast < own.paths + a);
}

#[test]
fn reports_say_what_ran() {
    let (_, report) = run(&plan(Strategy::MEGA, &surfaces()));
    assert_eq!(report.path_state_bytes, 0);
    let mega = report.kernels.last().expect("a kernel");
    assert_eq!((mega.name.as_str(), mega.items), ("mega", report.paths));
    assert_eq!(mega.materials, ["m0", "m1", "m2", "m3"]);
    assert!(report.gpu_seconds > 0.0 && report.paths_per_second > 0.0);
    let json = serde_json::to_value(&report).expect("JSON");
    assert_eq!(json["strategy"], "mega");
    assert_eq!(json["kernels"][1]["form"], "inline");
    assert!(json["kernels"][0].get("form").is_none());
}

/// The text of all kernels of a room.
fn texts(room: &Room, surfaces: &Materials, strategy: Strategy) -> String {
    let plan = plan(strategy, surfaces);
    let renderer = Renderer::from_world(gpu(), &room.world(), surfaces, &plan, &samples(1))
        .unwrap_or_else(|e| panic!("{e}"));
    renderer.kernels().map(|(_, wgsl)| wgsl).collect()
}

#[test]
fn what_a_scene_does_not_need_is_absent_from_its_kernels() {
    let surfaces = materials(&[Kind::Diffuse(0.5)]);
    for strategy in [Strategy::OWN, Strategy::MEGA] {
        let needless = texts(&Room::default().scattering(), &surfaces, strategy);
        let shadowed = texts(&Room::default(), &surfaces, strategy);
        for name in [
            "fn shadow(",
            "fn light_contribution(",
            "store_contribution(",
            "wants_shadow",
        ] {
            assert!(!needless.contains(name), "{strategy:?}: {name}");
            assert!(shadowed.contains(name), "{strategy:?}: {name}");
        }
        let glowing = materials(&[Kind::Glowing(0.5, 1.0)]);
        let glowing = texts(&Room::default(), &glowing, strategy);
        assert!(glowing.contains("(material_emission("));
        assert!(!shadowed.contains("material_emission("));
        // The stub's materials neither transmit nor need a lens.
        assert!(!shadowed.contains("let entered") && !shadowed.contains("camera.lens_radius"));
    }
}

/// Checked kernels and coarser timing are for finding defects and for lesser GPUs; they must
/// not change a picture.
#[test]
fn checks_and_timing_do_not_change_the_picture() {
    let surfaces = surfaces();
    let plan = plan(Strategy::OWN, &surfaces);
    let (reference, _) = run(&plan);
    for (timing, checked) in [(Timing::AroundPass, false), (Timing::None, true)] {
        let options = GpuOptions {
            timing,
            checked,
            ..GpuOptions::default()
        };
        let gpu = Gpu::new(&options).unwrap_or_else(|e| panic!("{e}"));
        let mut renderer =
            Renderer::from_world(&gpu, &room().world(), &surfaces, &plan, &samples(16))
                .unwrap_or_else(|e| panic!("{e}"));
        // Twice, since a renderer starts anew each time.
        for _ in 0..2 {
            let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
            let Rendering { film, report, .. } = rendering.unwrap_or_else(|e| panic!("{e}"));
            assert_equal_but_for_rounding(&film, &reference);
            let timed = report
                .kernels
                .iter()
                .filter(|k| k.gpu_seconds > 0.0)
                .count();
            match timing {
                Timing::None => assert_eq!((report.timing, timed), (TimeSource::Wall, 0)),
                _ => assert_eq!(
                    (report.timing, timed),
                    (TimeSource::Timestamps, report.kernels.len())
                ),
            }
            assert!(report.gpu_seconds > 0.0 && report.gpu_seconds <= report.wall_seconds);
        }
    }
}

#[test]
fn plans_that_miss_or_repeat_a_material_are_refused() {
    for kernels in [
        &[(Form::Own, &[0, 1, 2][..])][..],
        &[(Form::Mixed, &[0, 1, 2, 3]), (Form::Own, &[3])],
        &[(Form::Mixed, &[0, 1, 2, 4])],
        &[(Form::Mixed, &[0, 1, 2, 3]), (Form::Mixed, &[])],
    ] {
        let made = Renderer::from_world(
            gpu(),
            &room().world(),
            &surfaces(),
            &custom(kernels),
            &samples(1),
        );
        assert!(
            matches!(made, Err(RuntimeError::Plan { .. })),
            "{kernels:?}"
        );
    }
}

/// What is on no surface needs no kernel, and none knows of it; what is on one does.
#[test]
fn unbound_materials_need_no_kernel() {
    let surfaces = materials(&[
        Kind::Diffuse(0.6),
        Kind::Mirror,
        Kind::Glowing(0.3, 1.0),
        Kind::Diffuse(0.4),
    ]);
    let room = |unbound: &[usize]| Room {
        materials: [0, 3, 0, 3, 0, 3, 0],
        unbound: unbound.to_vec(),
        ..room()
    };
    let groups: [&[(Form, &[usize])]; 4] = [
        &[(Form::Own, &[0]), (Form::Own, &[3])],
        &[(Form::Binned, &[0, 3])],
        &[(Form::Own, &[3]), (Form::Inline, &[0])],
        &[(Form::Mixed, &[0, 3])],
    ];
    let world = room(&[1, 2]).world();
    let all = render_plan(
        &world,
        &surfaces,
        &plan(Strategy::OWN, &surfaces),
        &samples(2),
    );
    for kernels in groups {
        let plan = Plan {
            unused: vec![1, 2],
            ..custom(kernels)
        };
        let renderer = Renderer::from_world(gpu(), &world, &surfaces, &plan, &samples(1))
            .unwrap_or_else(|e| panic!("{e}"));
        let texts: String = renderer.kernels().map(|(_, wgsl)| wgsl).collect();
        // A mirror and a glowing material would be looked up here.
        for (question, answer) in [
            ("scatters_sampled_light", true),
            ("needs_last_evaluation", false),
        ] {
            let known = format!("fn {question}(instance: u32) -> bool {{ return {answer}; }}");
            assert!(texts.contains(&known), "{kernels:?}: {question}");
        }
        let fewer = render_plan(&world, &surfaces, &plan, &samples(2));
        assert_equal_but_for_rounding(&fewer.film, &all.film);
        let refused =
            Renderer::from_world(gpu(), &room(&[1]).world(), &surfaces, &plan, &samples(1));
        let message = refused.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(
            message.contains("`m2`") && message.contains("surface"),
            "{message}"
        );
    }
    // A megakernel leaves them out as well.
    let mega = plan(Strategy::MEGA, &surfaces).leaving_out(&[1, 2]);
    let mega = render_plan(&world, &surfaces, &mega, &samples(2));
    assert_equal_but_for_rounding(&mega.film, &all.film);
    assert_eq!(mega.report.kernels[1].materials, ["m0", "m3"]);
}

#[test]
fn settings_that_cannot_be_rendered_are_named() {
    let refused = |room: Room, options| {
        let (world, surfaces) = (room.world(), surfaces());
        let plan = plan(Strategy::OWN, &surfaces);
        match Renderer::from_world(gpu(), &world, &surfaces, &plan, &options) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("not refused"),
        }
    };
    let wide = Room { width: 0, ..room() };
    assert!(refused(wide, samples(1)).contains("0 x 16"));
    let deep = Room {
        max_depth: 10_000,
        ..room()
    };
    assert!(refused(deep, samples(1)).contains("8190"));
    assert!(refused(room(), samples(0)).contains("samples"));
    let mut large = samples(1 << 20);
    large.pool = Some(1 << 30);
    let message = refused(room(), large);
    assert!(
        message.contains("max_") && message.contains("103079215104"),
        "{message}"
    );
}

#[test]
fn invalid_material_code_is_an_error_with_its_place() {
    let mut world = room().world();
    let begin = "fn hit_position(primitive: u32, uv: vec2<f32>) -> vec3<f32> {";
    let broken = format!("{begin} let broken: u32 = 1.5;");
    let Surface::ByHand(surface) = &mut world.parts.surface else {
        panic!("it is written by hand");
    };
    surface.wgsl = surface.wgsl.replace(begin, &broken);
    let surfaces = surfaces();
    let plan = plan(Strategy::OWN, &surfaces);
    match Renderer::from_world(gpu(), &world, &surfaces, &plan, &samples(1)) {
        Err(RuntimeError::Shader { kernel, message }) => {
            assert!(kernel.starts_with("material"), "{kernel}");
            assert!(
                message.contains("broken") || message.contains("1.5"),
                "{message}"
            );
        }
        other => panic!("not refused: {:?}", other.err()),
    }
}
