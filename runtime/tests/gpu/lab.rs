//! The laboratory: kernels are timed on the hits of one iteration, whichever plan they belong to.

use crate::gpu::plans::{room, surfaces};
use crate::gpu::stub::{Materials, gpu, plan, render_plan, samples};
use impasto_compiler::partition::{Form, Strategy};
use impasto_runtime::error::RuntimeError;
use impasto_runtime::gpu::{Gpu, GpuOptions, Timing};
use impasto_runtime::lab::{Candidate, Lab, LabOptions, Measured};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::world::World;

const POOL: u32 = 4000;

fn options() -> LabOptions {
    LabOptions {
        pool: Some(POOL),
        warm_iterations: 8,
        repetitions: 3,
        ..LabOptions::default()
    }
}

fn lab<'a>(world: &'a World, materials: &'a Materials) -> Lab<'a> {
    Lab::new(gpu(), world, materials, &options()).unwrap_or_else(|e| panic!("{e}"))
}

fn candidate(form: Form, members: &[usize]) -> Candidate {
    Candidate {
        form,
        members: members.to_vec(),
    }
}

fn measure(lab: &mut Lab<'_>, candidates: &[Candidate]) -> Vec<Measured> {
    let all = lab.kernels(candidates).unwrap_or_else(|e| panic!("{e}"));
    all.into_iter()
        .map(|one| one.unwrap_or_else(|why| panic!("{why}")))
        .collect()
}

#[test]
fn a_kernel_works_on_the_hits_of_its_members_and_no_others() {
    let (world, surfaces) = (room().world(), surfaces());
    let mut lab = lab(&world, &surfaces);
    let hits: Vec<u64> = lab
        .workload()
        .materials
        .iter()
        .map(|hits| (hits.share * f64::from(POOL)).round() as u64)
        .collect();
    assert!(hits.iter().all(|n| *n > 0), "{hits:?}");
    let candidates = [
        candidate(Form::Own, &[2]),
        candidate(Form::Mixed, &[0, 3]),
        candidate(Form::Mixed, &[0, 1, 2, 3]),
        candidate(Form::Binned, &[1, 2]),
        candidate(Form::Binned, &[0, 1, 2, 3]),
        candidate(Form::Own, &[0]),
    ];
    for (candidate, measured) in candidates.iter().zip(measure(&mut lab, &candidates)) {
        let expected: u64 = candidate.members.iter().map(|m| hits[*m]).sum();
        assert_eq!(measured.items, expected, "{candidate:?}");
        assert!(measured.seconds > 0.0 && measured.logic_seconds > 0.0);
    }
    // The same hits again, whatever ran in between.
    let plans = [Strategy::OWN, Strategy::MIXED, Strategy::BINNED].map(|s| plan(s, &surfaces));
    for iteration in lab.iterations(&plans).unwrap_or_else(|e| panic!("{e}")) {
        assert!(iteration.unwrap_or_else(|e| panic!("{e}")).seconds > 0.0);
    }
    assert_eq!(measure(&mut lab, &candidates[..1])[0].items, hits[2]);
}

#[test]
fn neighbours_share_blocks_only_where_they_hit_the_same() {
    let (world, surfaces) = (room().world(), surfaces());
    let lab = lab(&world, &surfaces);
    let workload = lab.workload();
    assert_eq!((workload.pool, lab.pool()), (POOL, POOL));
    let mut all = 0.0;
    for hits in &workload.materials {
        all += hits.share;
        // A block has at most 32 slots, and a material that is hit is in some block.
        assert!(hits.present >= hits.share && hits.present <= 32.0 * hits.share);
        assert!(hits.present <= 1.0);
    }
    assert!(all > 0.2 && all <= 1.0, "{all}");
    // Fields of 16 bytes, for light is sampled and rays are in the path's state, and a triangle.
    assert_eq!(
        (workload.materials[0].loads, workload.materials[0].stores),
        (5.0 * 16.0 + 48.0, 6.0 * 16.0)
    );
    assert!(workload.logic_seconds > 0.0 && workload.other_seconds > 0.0);
}

#[test]
fn neighbours_are_those_that_the_logic_kernel_meets() {
    let (world, surfaces) = (room().world(), surfaces());
    let rendered = render_plan(
        &world,
        &surfaces,
        &plan(Strategy::OWN, &surfaces),
        &RenderOptions {
            count_hits: true,
            pool: Some(POOL),
            ..samples(64)
        },
    );
    let rendered = rendered.report.workload.expect("hits were counted");
    let of_lab = lab(&world, &surfaces);
    for (lab, render) in of_lab.workload().materials.iter().zip(&rendered.materials) {
        // In the order of queues a block would be of one or two materials. A render begins with neighbours that are alike.
        assert!(lab.draws() > 0.8 * render.draws(), "{lab:?}, {render:?}");
        assert!(lab.draws() > 4.0, "{lab:?}");
    }
}

#[test]
fn an_iteration_takes_about_what_its_kernels_take() {
    let (world, surfaces) = (room().world(), surfaces());
    let mut lab = lab(&world, &surfaces);
    let own = plan(Strategy::OWN, &surfaces);
    let singles: Vec<Candidate> = (0..4).map(|m| candidate(Form::Own, &[m])).collect();
    let kernels: f64 = measure(&mut lab, &singles).iter().map(|m| m.seconds).sum();
    let added = kernels + lab.workload().logic_seconds + lab.workload().other_seconds;
    // Other tests may take the processor away from a software GPU within a measurement, but not within each.
    let mut attempts = (0..12).map(|_| {
        let own = std::slice::from_ref(&own);
        let mut iterations = lab.iterations(own).unwrap_or_else(|e| panic!("{e}"));
        iterations.remove(0).unwrap_or_else(|e| panic!("{e}"))
    });
    let whole = attempts.find(|whole| {
        let sum: f64 = whole.kernels.iter().map(|(_, seconds)| seconds).sum();
        (sum / whole.seconds - 1.0).abs() < 0.2
    });
    let whole = whole.expect("kernels that add up to the iteration");
    // The processor has other things to do meanwhile.
    let ratio = added / whole.seconds;
    assert!((0.2..5.0).contains(&ratio), "{added} and {whole:?}");
}

#[test]
fn inline_materials_are_what_they_add_to_logic() {
    let (world, surfaces) = (room().world(), surfaces());
    let mut lab = lab(&world, &surfaces);
    let all = candidate(Form::Inline, &[0, 1, 2, 3]);
    let inline = measure(&mut lab, &[all])[0];
    assert_eq!(inline.items, u64::from(POOL));
    // Less than logic with them by what logic takes without.
    assert!(inline.seconds < inline.logic_seconds && inline.logic_seconds > 0.0);
}

#[test]
fn what_cannot_be_measured_keeps_nothing_else_from_it() {
    let (world, surfaces) = (room().world(), surfaces());
    let mut lab = lab(&world, &surfaces);
    let wrong = [
        candidate(Form::Own, &[0, 1]),
        candidate(Form::Mixed, &[]),
        candidate(Form::Mixed, &[1, 0]),
        candidate(Form::Mixed, &[0, 0]),
        candidate(Form::Inline, &[4]),
        candidate(Form::Mixed, &[0, 1]),
    ];
    let all = lab.kernels(&wrong).unwrap_or_else(|e| panic!("{e}"));
    let (good, bad) = all.split_last().expect("results");
    for one in bad {
        let why = one.as_ref().expect_err("no kernel");
        assert!(why.contains("no kernel"), "{why}");
    }
    assert!(good.as_ref().is_ok_and(|m| m.seconds > 0.0));
    let mega = plan(Strategy::MEGA, &surfaces);
    let own = plan(Strategy::OWN, &surfaces);
    let iterations = lab.iterations(&[mega, own]);
    let iterations = iterations.unwrap_or_else(|e| panic!("{e}"));
    let why = iterations[0].as_ref().expect_err("no iterations");
    assert!(why.contains("megakernel"), "{why}");
    assert!(iterations[1].is_ok());
}

#[test]
fn a_gpu_without_timestamps_is_refused() {
    let options = GpuOptions {
        timing: Timing::None,
        ..GpuOptions::default()
    };
    let gpu = Gpu::new(&options).unwrap_or_else(|e| panic!("{e}"));
    let (world, surfaces) = (room().world(), surfaces());
    let refused = Lab::new(&gpu, &world, &surfaces, &LabOptions::default());
    match refused.err() {
        Some(error @ RuntimeError::NoTimestamps(_)) => {
            assert!(error.to_string().contains("hint"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}
