//! Plans that are renewed while rendering: whatever takes over and when, the picture has the same bits
//! and everything is counted once.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use impasto_compiler::partition::{Candidate, Expected, Form, Plan, Strategy, Workload};
use impasto_runtime::film::file::{FilmFile, Range};
use impasto_runtime::options::{Progress, RenderOptions};
use impasto_runtime::render::passes::Keeping;
use impasto_runtime::render::report::{KernelReport, Report};
use impasto_runtime::render::until::Goals;
use impasto_runtime::render::{Planner, Plans, Renderer, Rendering, Replanning};

use crate::gpu::plans::custom;
use crate::gpu::stub::{Kind, Materials, Room, gpu, materials, plan, samples};

fn room() -> Room {
    Room {
        width: 8,
        height: 8,
        ..crate::gpu::plans::room()
    }
}

fn surfaces() -> Materials {
    materials(&[
        Kind::Diffuse(0.6),
        Kind::Failing(0.5),
        Kind::Broken,
        Kind::Glowing(0.3, 1.0),
    ])
}

fn options(samples_a_pixel: u32) -> RenderOptions {
    RenderOptions {
        pool: Some(100),
        count_hits: true,
        ..samples(samples_a_pixel)
    }
}

/// A renderer with a kernel a material.
fn renderer(options: &RenderOptions) -> Renderer<'static> {
    let surfaces = surfaces();
    let own = plan(Strategy::OWN, &surfaces);
    Renderer::from_world(gpu(), &room().world(), &surfaces, &own, options)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Replans as soon as anything was counted.
fn at_once(planner: Planner) -> Replanning {
    Replanning {
        warm_iterations: 2,
        counted_iterations: 2,
        least_hits: 1.0,
        worthwhile: Duration::ZERO,
        trial: Duration::ZERO,
        trial_iterations: 2,
        wait: true,
        ..Replanning::new(Arc::new(surfaces()), planner)
    }
}

fn always(plan: Plan) -> Planner {
    in_turn(vec![plan])
}

/// The first, and the others as trials that promise much.
fn in_turn(plans: Vec<Plan>) -> Planner {
    let much = Expected {
        ratio: 0.01,
        error: 0.01,
    };
    trying(plans.into_iter().map(|plan| (plan, much)).collect())
}

/// The first, and the others as trials of which something is expected.
fn trying(plans: Vec<(Plan, Expected)>) -> Planner {
    let mut plans = plans.into_iter();
    let (first, _) = plans.next().expect("a plan to go on with");
    let others = plans.map(|(plan, expected)| Candidate { plan, expected });
    Box::new(move |_| {
        Ok(Plans {
            first,
            others: Box::new(others),
        })
    })
}

fn go_on(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn render(renderer: &mut Renderer<'_>) -> Rendering {
    let rendering = renderer.render(&mut go_on);
    rendering.unwrap_or_else(|e| panic!("{e}"))
}

fn replanned(options: &RenderOptions, replanning: Replanning) -> Rendering {
    let mut renderer = renderer(options);
    renderer.replan(replanning);
    render(&mut renderer)
}

fn evaluated(kernels: &[KernelReport]) -> u64 {
    let of_materials = kernels.iter().filter(|k| !k.materials.is_empty());
    of_materials.map(|k| k.items).sum()
}

fn named(kernels: &[KernelReport], name: &str) -> u64 {
    kernels
        .iter()
        .filter(|k| k.name == name)
        .map(|k| k.items)
        .sum()
}

/// All that both plans did must be what one did.
#[track_caller]
fn assert_same_work(report: &Report, whole: &Report) {
    let change = report.replanned.as_ref().expect("the plan was renewed");
    assert_eq!(change.kept, None);
    assert!(change.at_iteration > 0 && change.at_iteration < report.iterations);
    let both = [&change.kernels[..], &report.kernels[..]];
    let casts = |kernels: &[&[KernelReport]]| -> u64 {
        let kernels = kernels.iter().copied().flatten();
        kernels.filter_map(|k| k.items_of("extension")).sum()
    };
    assert_eq!(casts(&both), casts(&[&whole.kernels]));
    let logic: u64 = both.iter().map(|k| named(k, "logic")).sum();
    assert_eq!(logic, report.iterations * u64::from(report.pool_size));
    assert_eq!(report.paths, whole.paths);
    assert_eq!(report.nonfinite_samples, whole.nonfinite_samples);
    let dropped = both.iter().flat_map(|k| k.iter());
    let dropped: u64 = dropped.map(|k| k.nonfinite_samples).sum();
    let whole_dropped: u64 = whole.kernels.iter().map(|k| k.nonfinite_samples).sum();
    assert_eq!(dropped, whole_dropped);
    assert!(dropped > 0);
    assert_eq!(report.queue_overflow, 0);
    assert!(change.gpu_seconds > 0.0 && change.gpu_seconds < report.gpu_seconds);
    assert!(change.compile_seconds > 0.0);
}

#[test]
fn whatever_takes_over_renders_the_same_picture() {
    let whole = render(&mut renderer(&options(16)));
    for (to, queued) in [
        (custom(&[(Form::Mixed, &[0, 1, 2, 3])]), true),
        (custom(&[(Form::Binned, &[0, 1, 2, 3])]), true),
        (custom(&[(Form::Inline, &[0, 1, 2, 3])]), false),
        (
            custom(&[
                (Form::Inline, &[0]),
                (Form::Binned, &[1, 3]),
                (Form::Own, &[2]),
            ]),
            false,
        ),
        (
            custom(&[(Form::Own, &[3]), (Form::Mixed, &[0, 2]), (Form::Own, &[1])]),
            true,
        ),
    ] {
        let rendering = replanned(&options(16), at_once(always(to)));
        assert!(rendering.film == whole.film);
        let report = &rendering.report;
        assert_same_work(report, &whole.report);
        let change = report.replanned.as_ref().expect("a change");
        assert_eq!(change.from, "own:m0|own:m1|own:m2|own:m3");
        assert_eq!(change.to.as_ref(), Some(&report.plan));
        assert_eq!(change.counting_seconds.is_some(), queued);
        if queued {
            let all = evaluated(&change.kernels) + evaluated(&report.kernels);
            assert_eq!(all, evaluated(&whole.report.kernels));
        }
        assert!(evaluated(&change.kernels) > 0 && evaluated(&report.kernels) > 0);
    }
}

/// The plan with other workgroups for every second kernel.
fn wide(mut plan: Plan) -> Plan {
    for kernel in plan.kernels.iter_mut().step_by(2) {
        kernel.workgroup = Some(384);
    }
    plan
}

/// Whatever is tried, and whatever turns out to be faster: the picture has the same bits, everything is counted once, and what
/// is reported is what was done.
#[test]
fn plans_that_are_tried_render_the_same_picture() {
    let options = options(1500);
    let whole = render(&mut renderer(&options));
    let plans = || {
        vec![
            custom(&[(Form::Mixed, &[0, 1, 2, 3])]),
            custom(&[(Form::Own, &[0]), (Form::Mixed, &[1, 2, 3])]),
            // What the render began with, and the same by other workgroups.
            plan(Strategy::OWN, &surfaces()),
            wide(plan(Strategy::OWN, &surfaces())),
            // It lacks materials.
            custom(&[(Form::Own, &[0])]),
            custom(&[
                (Form::Binned, &[1, 3]),
                (Form::Own, &[0]),
                (Form::Own, &[2]),
            ]),
        ]
    };
    let rendering = replanned(&options, at_once(in_turn(plans())));
    assert!(rendering.film == whole.film);
    let report = &rendering.report;
    assert_same_work(report, &whole.report);
    let change = report.replanned.as_ref().expect("a change");
    let trials = &change.trials;
    let tried = trials.iter().map(|trial| trial.plan.as_str());
    // The plan that the render began with was timed: whether it is tried again depends on that.
    let tried: Vec<&str> = tried.filter(|plan| *plan != change.from).collect();
    assert_eq!(
        tried,
        [
            "own:m0|mixed:m1,m2,m3",
            "own/384:m0|own:m1|own/384:m2|own:m3",
            "own:m0",
            "binned:m1,m3|own:m0|own:m2"
        ]
    );
    let mut fastest = change.to.clone().expect("a plan");
    for trial in trials {
        if trial.plan == "own:m0" {
            assert!(
                trial
                    .failed
                    .as_ref()
                    .is_some_and(|why| why.contains("`m1`"))
            );
            assert_eq!((trial.seconds, trial.kept), (None, false));
            continue;
        }
        assert_eq!(trial.failed, None);
        let (Some(seconds), Some(before)) = (trial.seconds, trial.seconds_before) else {
            panic!("{trial:?}");
        };
        assert!(seconds > 0.0 && before > 0.0);
        assert_eq!(trial.kept, seconds < 0.995 * before);
        if trial.kept {
            fastest.clone_from(&trial.plan);
        }
    }
    assert_eq!(report.plan, fastest);
    assert_eq!(
        evaluated(&whole.report.kernels),
        evaluated(&change.kernels) + evaluated(&report.kernels)
    );
}

/// Inline materials have no queues: what they were tried for comes to the same picture, too.
#[test]
fn inline_materials_may_be_tried() {
    let options = options(1500);
    let whole = render(&mut renderer(&options));
    let inline = || custom(&[(Form::Inline, &[0, 1, 2, 3])]);
    let partly = || custom(&[(Form::Inline, &[0, 2]), (Form::Binned, &[1, 3])]);
    let mixed = || custom(&[(Form::Mixed, &[0, 1, 2, 3])]);
    for plans in [
        vec![inline(), partly(), mixed()],
        vec![plan(Strategy::OWN, &surfaces()), partly(), inline()],
    ] {
        let rendering = replanned(&options, at_once(in_turn(plans)));
        assert!(rendering.film == whole.film);
        let change = rendering.report.replanned.as_ref().expect("a change");
        assert_eq!(change.trials.len(), 2);
        assert!(change.trials.iter().all(|trial| trial.failed.is_none()));
        assert_same_work(&rendering.report, &whole.report);
    }
}

/// A trial costs time: what promises too little for it does not run, and those that follow do.
#[test]
fn what_promises_little_is_not_tried() {
    let expected = |ratio| Expected { ratio, error: 0.01 };
    let slow = custom(&[(Form::Mixed, &[0, 1, 2, 3])]);
    let fast = custom(&[(Form::Own, &[0]), (Form::Mixed, &[1, 2, 3])]);
    let first = plan(Strategy::OWN, &surfaces());
    let plans = vec![
        (first, expected(1.0)),
        (slow, expected(2.0)),
        (fast, expected(0.01)),
    ];
    let rendering = replanned(&options(1500), at_once(trying(plans)));
    let change = rendering.report.replanned.expect("a change");
    let tried: Vec<_> = change
        .trials
        .iter()
        .map(|it| (it.plan.as_str(), it.expected))
        .collect();
    assert_eq!(tried, [("own:m0|mixed:m1,m2,m3", Some(0.01))]);
}

/// If the plan is the one that runs, it goes on without counting.
#[test]
fn the_same_plan_goes_on_without_counting() {
    let whole = render(&mut renderer(&options(16)));
    let own = plan(Strategy::OWN, &surfaces());
    let mut renderer = renderer(&options(16));
    let counts = |renderer: &Renderer<'_>| {
        let text: String = renderer.kernels().map(|(_, wgsl)| wgsl).collect();
        text.contains("count_hits")
    };
    assert!(counts(&renderer));
    renderer.replan(at_once(always(own)));
    let rendering = render(&mut renderer);
    assert!(!counts(&renderer));
    assert!(rendering.film == whole.film);
    let report = rendering.report;
    let change = report.replanned.expect("a change");
    assert_eq!((change.kept, change.kernels), (None, Vec::new()));
    assert_eq!(change.to.as_ref(), Some(&change.from));
    assert!(change.counting_seconds.is_some());
    assert_eq!(evaluated(&report.kernels), evaluated(&whole.report.kernels));
    assert!(report.workload.is_some());
    // The next render begins with it, and is not planned anew.
    let again = render(&mut renderer);
    assert!(again.film == whole.film && again.report.replanned.is_none());
}

#[test]
fn what_cannot_take_over_leaves_the_plan_as_it_was() {
    let whole = render(&mut renderer(&options(8)));
    let surfaces = surfaces();
    let planners: [(Planner, &str); 4] = [
        (Box::new(|_| Err("no profile".into())), "no profile"),
        (always(custom(&[(Form::Own, &[0])])), "`m1`"),
        (always(plan(Strategy::MEGA, &surfaces)), "megakernel"),
        (
            Box::new(|_| panic!("a defect in a planner")),
            "planning broke off",
        ),
    ];
    for (planner, expected) in planners {
        let rendering = replanned(&options(8), at_once(planner));
        assert!(rendering.film == whole.film, "{expected}");
        let report = rendering.report;
        let change = report.replanned.as_ref().expect("an attempt");
        let kept = change.kept.as_deref().unwrap_or_default();
        assert!(kept.contains(expected), "{kept}");
        assert_eq!(report.plan, change.from);
        assert_eq!(evaluated(&report.kernels), evaluated(&whole.report.kernels));
    }
}

/// The planner is told what was counted since the mixture of paths became steady.
#[test]
fn planners_are_told_the_workload() {
    let (tell, told) = mpsc::channel();
    let planner: Planner = Box::new(move |workload: &Workload| {
        let _ = tell.send(workload.clone());
        always(custom(&[(Form::Mixed, &[0, 1, 2, 3])]))(workload)
    });
    let rendering = replanned(&options(16), at_once(planner));
    let workload = told.try_recv().expect("a workload");
    assert_eq!(rendering.report.workload.as_ref(), Some(&workload));
    assert_eq!(workload.pool, 100);
    let shares = workload.materials.iter().map(|m| m.share);
    assert!((0.2..=1.0).contains(&shares.sum::<f64>()), "{workload:?}");
    assert!(
        workload
            .materials
            .iter()
            .all(|m| m.present >= m.share * 100.0 / 128.0)
    );
}

#[test]
fn a_short_render_is_not_planned_anew() {
    let asked = Arc::new(AtomicBool::new(false));
    for (samples_a_pixel, patience) in [(2, Duration::ZERO), (16, Duration::from_secs(3600))] {
        let heard = asked.clone();
        let planner: Planner = Box::new(move |_| {
            heard.store(true, Ordering::Relaxed);
            Err("asked".into())
        });
        let replanning = Replanning {
            worthwhile: patience,
            least_hits: if patience.is_zero() { 1e9 } else { 1.0 },
            ..at_once(planner)
        };
        let rendering = replanned(&options(samples_a_pixel), replanning);
        assert!(rendering.report.replanned.is_none());
        assert!(rendering.report.workload.is_some());
    }
    assert!(!asked.load(Ordering::Relaxed));
    // Without counting there is nothing to plan by.
    let uncounted = RenderOptions {
        count_hits: false,
        ..options(16)
    };
    let rendering = replanned(&uncounted, at_once(Box::new(|_| Err("asked".into()))));
    assert!(rendering.report.replanned.is_none() && rendering.report.workload.is_none());
}

/// A render that is done before its new plan just ends.
#[test]
fn a_render_does_not_wait_for_its_plan() {
    let (finish, finished) = mpsc::channel::<()>();
    let planner: Planner = Box::new(move |_| {
        let _ = finished.recv_timeout(Duration::from_secs(60));
        Err("too late".into())
    });
    let replanning = Replanning {
        wait: false,
        ..at_once(planner)
    };
    let mut late = renderer(&options(16));
    late.replan(replanning);
    let rendering = render(&mut late);
    assert!(rendering.report.replanned.is_none());
    assert!(rendering.film == render(&mut renderer(&options(16))).film);
    drop(finish);
}

/// Rendering goes on while the plan is compiled, and changes when that is done. It is slow meanwhile, so
/// that it does not end first.
#[test]
fn a_plan_takes_over_in_the_midst_of_a_render() {
    let replanning = Replanning {
        wait: false,
        ..at_once(always(custom(&[(Form::Binned, &[0, 1, 2, 3])])))
    };
    // Whoever compiles has a share of the materials beside the renderer's and this one.
    let materials = replanning.source.clone();
    let is_compiled = || Arc::strong_count(&materials) <= 2;
    let mut renderer = renderer(&options(400));
    renderer.replan(replanning);
    let (mut landings, mut meanwhile) = (0, 0);
    let mut slowly = |_: &Progress| {
        landings += 1;
        if !is_compiled() {
            meanwhile += 1;
            std::thread::sleep(Duration::from_millis(50));
        }
        ControlFlow::Continue(())
    };
    let rendering = renderer.render(&mut slowly);
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    let whole = render(&mut self::renderer(&options(400)));
    assert!(rendering.film == whole.film);
    assert_same_work(&rendering.report, &whole.report);
    let change = rendering.report.replanned.expect("a change");
    assert!(change.at_iteration > 4, "it went on meanwhile");
    assert!(change.at_seconds >= change.planning_seconds + change.compile_seconds);
    assert!(landings > 3 && meanwhile > 0);
}

/// Passes end and begin around a change of plans, and what is kept between them is as without.
#[test]
fn plans_change_within_and_between_passes() {
    let kept = |renderer: &mut Renderer<'_>, start: Option<FilmFile>| {
        let mut kept = Vec::new();
        let mut keep = |film: &FilmFile| {
            kept.push(film.clone());
            Ok(())
        };
        let keeping = Keeping {
            start,
            every: Duration::from_nanos(1),
            keep: &mut keep,
        };
        let rendering = renderer.render_keeping(keeping, &mut go_on);
        (kept, rendering.unwrap_or_else(|e| panic!("{e}")))
    };
    let to = || always(custom(&[(Form::Binned, &[0, 3]), (Form::Inline, &[1, 2])]));
    let (reference, whole) = kept(&mut renderer(&options(6)), None);
    for warm in [0, 1, 3] {
        let mut renderer = renderer(&options(6));
        renderer.replan(Replanning {
            warm_iterations: warm,
            ..at_once(to())
        });
        let (films, rendering) = kept(&mut renderer, None);
        assert_eq!(films, reference, "after {warm} iterations");
        assert_same_work(&rendering.report, &whole.report);
    }
    // The same from a checkpoint on.
    let mut resumed = renderer(&options(6));
    resumed.replan(at_once(to()));
    let (films, rendering) = kept(&mut resumed, Some(reference[1].clone()));
    assert_eq!(films[..], reference[2..]);
    assert_eq!(rendering.report.resumed_samples, 2);
    assert!(
        rendering
            .report
            .replanned
            .is_some_and(|change| change.kept.is_none())
    );
    assert_eq!(
        rendering.report.nonfinite_samples,
        whole.report.nonfinite_samples
    );
}

/// A render that is stopped after its plan changed is one of fewer samples.
#[test]
fn a_stopped_render_that_was_replanned_is_one_of_fewer_samples() {
    let mut stopped = renderer(&options(1 << 20));
    stopped.replan(at_once(always(custom(&[(Form::Binned, &[0, 1, 2, 3])]))));
    let mut left = 20;
    let stop = &mut |_: &Progress| {
        left -= 1;
        if left > 0 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    let mut rendering = stopped.render(stop).unwrap_or_else(|e| panic!("{e}"));
    assert!(rendering.report.replanned.is_some());
    let [Range { first: 0, count }] = rendering.sums.about.ranges[..] else {
        panic!("{:?}", rendering.sums.about.ranges);
    };
    let same = render(&mut renderer(&options(count as u32)));
    rendering
        .sums
        .about
        .asked
        .clone_from(&same.sums.about.asked);
    assert_eq!(rendering.sums, same.sums);
    assert_eq!(rendering.report.paths, same.report.paths);
}

/// A render in halves whose plan is renewed in its midst: the bits of one by a single plan, every sample
/// counted once, and examples of samples that were left out by the seed of their half.
#[test]
fn a_render_until_a_goal_goes_on_with_another_plan() {
    let options = options(24);
    let until = |renderer: &mut Renderer<'_>| {
        let rendering = renderer.render_until(&Goals::default(), &mut |_| (), &mut go_on);
        rendering.unwrap_or_else(|e| panic!("{e}"))
    };
    let whole = until(&mut renderer(&options));
    let mut renewed = renderer(&options);
    let next = custom(&[(Form::Mixed, &[0, 1]), (Form::Binned, &[2, 3])]);
    renewed.replan(at_once(always(next)));
    let renewed = until(&mut renewed);
    assert!(
        renewed
            .report
            .replanned
            .as_ref()
            .is_some_and(|change| change.kept.is_none())
    );
    assert_eq!(renewed.film, whole.film);
    assert_eq!(renewed.report.paths, 8 * 8 * 24);
    assert_eq!(
        renewed.report.nonfinite_samples,
        whole.report.nonfinite_samples
    );
    assert!(whole.report.nonfinite_samples > 0);
    let courses = [&whole, &renewed].map(|rendering| {
        let checks = rendering.report.convergence.iter();
        checks
            .map(|c| (c.samples, c.rmse, c.relmse))
            .collect::<Vec<_>>()
    });
    assert_eq!(courses[0], courses[1]);
    let examples = whole.report.dropped.iter().flat_map(|d| &d.example);
    let mut replayed = 0;
    for example in examples {
        let [x, y] = example.pixel;
        let alone = RenderOptions {
            seed: example.seed,
            first_sample: example.sample,
            pixels: Some(Arc::from([y * 8 + x])),
            ..self::options(1)
        };
        assert_eq!(
            render(&mut renderer(&alone)).report.nonfinite_samples,
            1,
            "{example:?}"
        );
        replayed += 1;
    }
    assert!(replayed > 0);
}
