//! Several devices that render one picture together: the bits of one of them, whatever share each has, whichever is
//! lost, and however often what is done is kept.

use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::time::Duration;

use crate::gpu::passes::{room, surfaces};
use crate::gpu::stub::{Kind, Room, materials, plan, samples};
use impasto_compiler::partition::Strategy;
use impasto_runtime::cpu::{Cpu, CpuOptions};
use impasto_runtime::device::DeviceRef;
use impasto_runtime::error::RuntimeError;
use impasto_runtime::film::file::{FilmFile, Range};
use impasto_runtime::gpu::{Gpu, GpuOptions};
use impasto_runtime::multi::MultiRenderer;
use impasto_runtime::options::{Progress, RenderOptions};
use impasto_runtime::render::passes::Keeping;
use impasto_runtime::render::until::{Ending, Goals};
use impasto_runtime::render::{NOBODY, Rendering};

/// A GPU of its own, that can be lost without harm to other tests.
fn open() -> Gpu {
    Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn gpus() -> &'static [Gpu; 3] {
    static GPUS: OnceLock<[Gpu; 3]> = OnceLock::new();
    GPUS.get_or_init(|| [open(), open(), open()])
}

/// Processors with one thread each, whose bits are those of one with several.
fn processors() -> &'static [Cpu; 2] {
    static CPUS: OnceLock<[Cpu; 2]> = OnceLock::new();
    let cpu = || {
        let options = CpuOptions {
            threads: Some(1),
            ..CpuOptions::default()
        };
        Cpu::new(&options).unwrap_or_else(|e| panic!("{e}"))
    };
    CPUS.get_or_init(|| [cpu(), cpu()])
}

/// Each by another plan: plans have the same bits.
fn renderer<'g>(devices: &[DeviceRef<'g>], options: &RenderOptions) -> MultiRenderer<'g> {
    let surfaces = surfaces();
    let plans = [Strategy::OWN, Strategy::MEGA, Strategy::OWN].map(|s| plan(s, &surfaces));
    let devices: Vec<_> = devices.iter().copied().zip(&plans).collect();
    MultiRenderer::build(&devices, &room().world(), &surfaces, options, NOBODY)
        .unwrap_or_else(|e| panic!("{e}"))
        .worthwhile(0.0)
}

fn go_on(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn whole(devices: &[DeviceRef<'_>], options: &RenderOptions) -> Rendering {
    let rendering = renderer(devices, options).render(&mut go_on);
    rendering.unwrap_or_else(|e| panic!("{e}"))
}

/// Two kinds of devices, of which one and several are asked for the same.
fn kinds() -> [Vec<DeviceRef<'static>>; 2] {
    let gpus = gpus().iter().map(DeviceRef::from).collect();
    [gpus, processors().iter().map(DeviceRef::from).collect()]
}

#[test]
fn together_they_have_the_bits_of_one() {
    for devices in kinds() {
        for count in [1, 2, 37] {
            let options = RenderOptions {
                first_sample: 3,
                outputs: vec!["albedo".into(), "material".into(), "variance".into()],
                ..samples(count)
            };
            let one = whole(&devices[..1], &options);
            let all = whole(&devices, &options);
            assert_eq!(all.sums, one.sums, "{count}");
            assert_eq!(all.film, one.film);
            let (a, b) = (&all.report, &one.report);
            assert_eq!(
                (a.paths, a.nonfinite_samples),
                (b.paths, b.nonfinite_samples)
            );
            assert_eq!(a.samples_per_pixel, count);
            assert!(b.devices.is_empty());
            assert_eq!(a.devices.len(), devices.len());
            let taken: Vec<u64> = a.devices.iter().map(|device| device.samples).collect();
            assert_eq!(taken.iter().sum::<u64>(), u64::from(count), "{taken:?}");
            assert!(taken.iter().all(|t| *t > 0 || count < 3), "{taken:?}");
            let dropped: u64 = a.dropped.iter().map(|d| d.nonfinite).sum();
            assert_eq!(dropped, b.dropped.iter().map(|d| d.nonfinite).sum::<u64>());
        }
    }
}

/// Until one is slower than others, which then take over some of its samples, whenever that is.
#[test]
fn progress_is_of_all_and_ends_with_them() {
    let devices = &kinds()[0];
    let options = samples(60);
    let mut last = 0;
    let rendering = renderer(devices, &options).render(&mut |progress| {
        assert_eq!(progress.total, 16 * 8 * 60);
        assert!(progress.paths <= progress.total, "{progress:?}");
        last = progress.paths;
        ControlFlow::Continue(())
    });
    assert_eq!(
        rendering.unwrap_or_else(|e| panic!("{e}")).report.paths,
        16 * 8 * 60
    );
    assert!(last > 0);
}

/// What some devices keep first and at last of a render with some samples.
fn kept(devices: &[DeviceRef<'static>], count: u32) -> [FilmFile; 2] {
    let mut kept: Vec<FilmFile> = Vec::new();
    let mut keep = |film: &FilmFile| {
        kept.push(film.clone());
        Ok(())
    };
    let keeping = Keeping {
        start: None,
        every: Duration::from_nanos(1),
        keep: &mut keep,
    };
    let rendering = renderer(devices, &samples(count)).render_keeping(keeping, &mut go_on);
    let last = kept.last().expect("what is kept at the end").clone();
    assert_eq!(rendering.unwrap_or_else(|e| panic!("{e}")).sums, last);
    [kept.swap_remove(0), last]
}

#[test]
fn what_is_kept_is_gone_on_from_by_one_or_by_several() {
    for devices in kinds() {
        // Enough to take longer than all it takes to keep some, also where others take the processor away.
        let mut renders = [2_000, 8_000, 32_000]
            .into_iter()
            .map(|count| (count, kept(&devices, count)));
        let (count, [early, last]) = renders
            .find(|(count, [early, _])| early.samples() < u64::from(*count))
            .expect("samples that are kept before the end");
        let options = samples(count);
        let reference = whole(&devices[..1], &options).sums;
        assert_eq!(last, reference);
        for devices in [&devices[..1], &devices[..]] {
            let keeping = Keeping {
                start: Some(early.clone()),
                every: Duration::from_secs(60),
                keep: &mut |_| Ok(()),
            };
            let rendering = renderer(devices, &options).render_keeping(keeping, &mut go_on);
            let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(rendering.sums, reference);
            assert_eq!(rendering.report.paths, 16 * 8 * u64::from(count));
            assert_eq!(u64::from(rendering.report.resumed_samples), early.samples());
        }
    }
}

/// What is kept cannot always be written, which ends a render.
#[test]
fn who_cannot_keep_ends_the_render() {
    let mut keep = |_: &FilmFile| Err(RuntimeError::Validation("no room".into()));
    let keeping = Keeping {
        start: None,
        every: Duration::from_nanos(1),
        keep: &mut keep,
    };
    let rendering = renderer(&kinds()[1], &samples(100_000)).render_keeping(keeping, &mut go_on);
    assert!(rendering.is_err_and(|error| error.to_string().contains("no room")));
}

#[test]
fn a_stopped_render_is_one_of_the_samples_that_it_names() {
    let devices = &kinds()[0];
    let rendering = renderer(devices, &samples(1 << 20)).render(&mut |progress| {
        if progress.paths > 16 * 8 * 30 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    let stopped = rendering.unwrap_or_else(|e| panic!("{e}")).sums;
    assert!((30..1 << 20).contains(&stopped.samples()));
    assert_eq!(
        stopped.about.asked,
        [Range {
            first: 0,
            count: 1 << 20
        }]
    );
    let mut parts = stopped.about.ranges.iter().map(|range| {
        let options = RenderOptions {
            first_sample: range.first as u32,
            ..samples(range.count as u32)
        };
        whole(&devices[..1], &options).sums
    });
    let mut all = parts.next().expect("a range");
    parts.for_each(|part| all.merge(&part).expect("parts of one render"));
    assert_eq!(all.sums, stopped.sums);
}

/// Of three, one is lost while it renders, and one has nothing more to do by then.
#[test]
fn the_samples_of_a_lost_device_are_taken_by_the_others() {
    // So many that on a busy machine, too, the second has some left when it is lost.
    const SAMPLES: u32 = 1800;
    let [first, second] = [open(), open()];
    let options = samples(SAMPLES);
    let mut renderer = renderer(&[(&first).into(), (&second).into()], &options);
    let rendering = renderer.render(&mut |progress| {
        if progress.paths > 16 * 8 * 100 {
            second.lose();
        }
        ControlFlow::Continue(())
    });
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    let one = whole(&kinds()[0][..1], &options);
    assert_eq!(rendering.sums, one.sums);
    assert_eq!(rendering.film, one.film);
    let devices = &rendering.report.devices;
    assert_eq!(devices[0].lost, None);
    let lost = devices[1].lost.as_deref().expect("it is lost");
    assert!(lost.contains("the GPU was lost while rendering"), "{lost}");
    assert_eq!(devices[0].samples + devices[1].samples, u64::from(SAMPLES));
    assert_eq!(
        rendering.report.nonfinite_samples,
        one.report.nonfinite_samples
    );

    first.lose();
    assert!(renderer.render(&mut go_on).is_err(), "none is left");
}

#[test]
fn goals_are_pursued_together() {
    for devices in kinds() {
        let options = samples(64);
        let pursue = |devices: &[DeviceRef<'static>]| {
            let mut checks = Vec::new();
            let goals = Goals {
                relmse: Some(1e-9),
                ..Goals::default()
            };
            let mut look = |check: &impasto_runtime::render::until::Check| checks.push(*check);
            let rendering = renderer(devices, &options)
                .render_until(&goals, &mut look, &mut go_on)
                .unwrap_or_else(|e| panic!("{e}"));
            (rendering, checks)
        };
        let ((one, _), (all, checks)) = (pursue(&devices[..1]), pursue(&devices));
        assert_eq!(all.report.ended_by, Some(Ending::Samples));
        assert_eq!(all.sums, one.sums);
        let errors = |r: &Rendering| r.report.convergence.last().map(|c| (c.relmse, c.samples));
        assert_eq!(errors(&all), errors(&one));
        assert_eq!(checks, all.report.convergence);
        assert_eq!(all.report.samples_per_pixel, 64);
        // The options are those of before.
        let mut again = renderer(&devices, &options);
        again
            .render_until(&Goals::default(), &mut |_| (), &mut go_on)
            .unwrap_or_else(|e| panic!("{e}"));
        let plain = again.render(&mut go_on).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(plain.sums, whole(&devices[..1], &options).sums);
    }
}

#[test]
fn devices_that_render_other_things_do_not_go_together() {
    let surfaces = materials(&[Kind::Diffuse(0.6)]);
    let own = plan(Strategy::OWN, &surfaces);
    let make = |room: &Room, options: &RenderOptions| {
        let device = DeviceRef::from(&processors()[0]);
        impasto_runtime::render::Renderer::from_world(
            device,
            &room.world(),
            &surfaces,
            &own,
            options,
        )
        .unwrap_or_else(|e| panic!("{e}"))
    };
    let room = Room::default();
    let seeded = RenderOptions {
        seed: 1,
        ..samples(4)
    };
    let error = MultiRenderer::of(vec![make(&room, &samples(4)), make(&room, &seeded)]);
    assert!(error.is_err_and(|error| error.to_string().contains("the same")));
    assert!(MultiRenderer::of(Vec::new()).is_err());
}
