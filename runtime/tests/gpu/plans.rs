//! Plans organise the same computation: wavefront, megakernel and what is between them must
//! render the same picture, and count the same work.

use std::ops::ControlFlow;

use crate::stub::{Kind, Materials, Room, gpu, materials, plan, render_plan, samples};
use impasto_compiler::partition::{Form, Organisation, Plan, PlanKernel, Strategy};
use impasto_runtime::error::RuntimeError;
use impasto_runtime::film::Film;
use impasto_runtime::gpu::{Gpu, GpuOptions, Timing};
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::report::Report;

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

fn custom(kernels: &[(Form, &[usize])]) -> Plan {
    let kernel = |(index, (form, members)): (usize, &(Form, &[usize]))| PlanKernel {
        name: format!("material_{index}"),
        form: *form,
        materials: members.to_vec(),
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
    let (reference, _) = run(&plan(Strategy::Own, &surfaces));
    for other in [
        plan(Strategy::Mixed, &surfaces),
        plan(Strategy::Mega, &surfaces),
        custom(&[
            (Form::Mixed, &[0, 2]),
            (Form::Inline, &[1]),
            (Form::Own, &[3]),
        ]),
        custom(&[(Form::Inline, &[0, 1, 2, 3])]),
    ] {
        let (film, report) = run(&other);
        assert_equal_but_for_rounding(&film, &reference);
        assert_eq!(report.queue_overflow, 0);
    }
}

#[test]
fn kernels_count_their_items() {
    let (_, own) = run(&plan(Strategy::Own, &surfaces()));
    let (_, shared) = run(&plan(Strategy::Mixed, &surfaces()));
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
    let cast = items(&own, "extension");
    assert!(cast > own.paths && cast < own.paths + a);
}

#[test]
fn reports_say_what_ran() {
    let (_, report) = run(&plan(Strategy::Mega, &surfaces()));
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
    for strategy in [Strategy::Own, Strategy::Mega] {
        let needless = texts(&Room::default().scattering(), &surfaces, strategy);
        let shadowed = texts(&Room::default(), &surfaces, strategy);
        for name in [
            "fn shadow(",
            "fn choose_light(",
            "light_throughput(slot",
            "wants_shadow",
        ] {
            assert!(!needless.contains(name), "{strategy:?}: {name}");
            assert!(shadowed.contains(name), "{strategy:?}: {name}");
        }
        let glowing = materials(&[Kind::Glowing(0.5, 1.0)]);
        let glowing = texts(&Room::default(), &glowing, strategy);
        assert!(
            glowing.contains("= material_emission(") || glowing.contains("* material_emission(")
        );
        assert!(!shadowed.contains("material_emission("));
        // The stub's materials neither transmit nor need a lens.
        assert!(!shadowed.contains("let entered") && !shadowed.contains("LENS_RADIUS"));
    }
}

/// Checked kernels and coarser timing are for finding defects and for lesser GPUs; they must
/// not change a picture.
#[test]
fn checks_and_timing_do_not_change_the_picture() {
    let surfaces = surfaces();
    let plan = plan(Strategy::Own, &surfaces);
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
                Timing::None => assert_eq!((report.timing, timed), ("wall", 0)),
                _ => assert_eq!((report.timing, timed), ("timestamps", report.kernels.len())),
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

#[test]
fn settings_that_cannot_be_rendered_are_named() {
    let refused = |room: Room, options| {
        let (world, surfaces) = (room.world(), surfaces());
        let plan = plan(Strategy::Own, &surfaces);
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
        message.contains("max_") && message.contains("154618822656"),
        "{message}"
    );
}

#[test]
fn invalid_material_code_is_an_error_with_its_place() {
    let mut world = room().world();
    world.parts.surface.wgsl += "fn broken() -> u32 { return 1.5; }\n";
    let surfaces = surfaces();
    let plan = plan(Strategy::Own, &surfaces);
    match Renderer::from_world(gpu(), &world, &surfaces, &plan, &samples(1)) {
        Err(RuntimeError::Shader { kernel, message }) => {
            assert_eq!(kernel, "logic");
            assert!(
                message.contains("broken") || message.contains("1.5"),
                "{message}"
            );
        }
        other => panic!("not refused: {:?}", other.err()),
    }
}
