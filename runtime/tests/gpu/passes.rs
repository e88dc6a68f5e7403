//! Renders in parts: passes with a film that is kept between them, renders that go on from one,
//! ranges of samples rendered apart, and renders that are stopped. All give the bits of the whole.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::gpu::stub::{Kind, Materials, Room, Way, materials, plan, samples};
use impasto_runtime::error::RuntimeError;
use impasto_runtime::film::file::{FilmFile, Range};
use impasto_runtime::options::{Progress, RenderOptions};
use impasto_runtime::render::passes::Keeping;
use impasto_runtime::render::until::Goals;
use impasto_runtime::render::{Renderer, Rendering};

pub(super) fn room() -> Room {
    Room {
        plate: true,
        emitters: vec![3],
        max_depth: 5,
        roulette_start: 2,
        width: 16,
        height: 8,
        materials: [0, 1, 0, 0, 1, 0, 2],
        ..Room::default()
    }
}

pub(super) fn surfaces() -> Materials {
    materials(&[Kind::Diffuse(0.6), Kind::Failing(0.5), Kind::Mirror])
}

fn renderer(way: Way, room: &Room, options: &RenderOptions) -> Renderer<'static> {
    let surfaces = surfaces();
    let plan = plan(way.strategy(), &surfaces);
    Renderer::from_world(way.device(), &room.world(), &surfaces, &plan, options)
        .unwrap_or_else(|e| panic!("{e}"))
}

fn whole(way: Way, options: &RenderOptions) -> Rendering {
    renderer(way, &room(), options)
        .render(&mut |_| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Renders in passes of few samples; what was kept, and the end.
fn in_passes(
    way: Way,
    options: &RenderOptions,
    start: Option<FilmFile>,
) -> Result<(Vec<FilmFile>, Rendering), RuntimeError> {
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
    let total = 16 * 8 * u64::from(options.samples);
    let mut last = 0;
    let progress = &mut |progress: &Progress| {
        assert_eq!(progress.total, total);
        assert!((last..=total).contains(&progress.paths), "{progress:?}");
        last = progress.paths;
        ControlFlow::Continue(())
    };
    let rendering = renderer(way, &room(), options).render_keeping(keeping, progress)?;
    Ok((kept, rendering))
}

#[test]
fn passes_give_the_bits_of_the_whole() {
    for way in Way::ALL {
        let options = RenderOptions {
            first_sample: 3,
            ..samples(6)
        };
        let reference = whole(way, &options);
        let (kept, rendering) = in_passes(way, &options, None).expect("it renders");
        assert_eq!(rendering.film, reference.film, "{way:?}");
        assert_eq!(rendering.sums, reference.sums, "{way:?}");
        assert_eq!(rendering.report.paths, reference.report.paths);
        assert_eq!(rendering.report.resumed_samples, 0);
        // A sample a pass, and what is kept of each is the render of so many samples.
        assert_eq!(kept.len(), 6, "{way:?}");
        for (count, film) in (1..).zip(&kept) {
            let fewer = RenderOptions {
                samples: count,
                ..options.clone()
            };
            // But that it knows of the samples that were still to come.
            assert_eq!(film.about.asked[0].count, 6, "{way:?}: {count}");
            let film = as_asked(film.clone());
            assert_eq!(film, whole(way, &fewer).sums, "{way:?}: {count}");
        }
        let items = |r: &Rendering| {
            r.report
                .kernels
                .iter()
                .map(|k| (k.name.clone(), k.items))
                .collect::<Vec<_>>()
        };
        let of_materials = |r| {
            items(r)
                .into_iter()
                .filter(|(n, _)| n.starts_with("material"))
                .collect::<Vec<_>>()
        };
        assert_eq!(of_materials(&rendering), of_materials(&reference));
    }
}

#[test]
fn a_render_goes_on_from_what_was_kept() {
    for way in Way::ALL {
        let options = samples(5);
        let reference = whole(way, &options);
        let (kept, _) = in_passes(way, &options, None).expect("it renders");
        for start in kept {
            let done = start.samples();
            let (more, rendering) = in_passes(way, &options, Some(start)).expect("it goes on");
            assert_eq!(rendering.sums, reference.sums, "{way:?} from {done}");
            assert_eq!(u64::from(rendering.report.resumed_samples), done);
            assert_eq!(rendering.report.paths, reference.report.paths);
            assert_eq!(more.last(), Some(&reference.sums));
        }
        let longer = RenderOptions {
            samples: 8,
            ..options
        };
        let start = Some(reference.sums);
        let (_, rendering) = in_passes(way, &longer, start).expect("it goes on");
        assert_eq!(rendering.sums, whole(way, &longer).sums);
    }
}

#[test]
fn a_render_does_not_go_on_from_another() {
    let film = whole(Way::Wavefront, &samples(4)).sums;
    let refused = |options: &RenderOptions, part: &str| {
        let result = in_passes(Way::Wavefront, options, Some(film.clone()));
        let error = result.expect_err("refused").to_string();
        assert!(error.contains(part), "{error}");
    };
    let seeded = RenderOptions {
        seed: 9,
        ..samples(8)
    };
    refused(&seeded, "the seed 9, the other 0");
    refused(&samples(3), "more than the 3");
    let later = RenderOptions {
        first_sample: 1,
        ..samples(8)
    };
    refused(&later, "starts at 1");
}

#[test]
fn ranges_rendered_apart_merge_to_the_bits_of_the_whole() {
    for way in [Way::Wavefront, Way::Processor] {
        merge_ranges(way);
    }
}

fn merge_ranges(way: Way) {
    let reference = whole(way, &samples(9));
    // In other pools, and one of them in the other organisation of the same kernels.
    let part = |first_sample, count, pool| {
        let options = RenderOptions {
            first_sample,
            pool: Some(pool),
            ..samples(count)
        };
        whole(way, &options).sums
    };
    let parts = [part(0, 4, 77), part(4, 1, 1), part(5, 4, 1000)];
    for order in [[0, 1, 2], [2, 0, 1]] {
        let mut merged = parts[order[0]].clone();
        for next in &order[1..] {
            merged.merge(&parts[*next]).expect("they belong together");
        }
        assert_eq!(merged, reference.sums);
        assert_eq!(merged.sums.picture(), reference.film);
    }
    let mut twice = parts[0].clone();
    assert!(twice.merge(&parts[0]).is_err_and(|e| e.contains("0 to 3")));
}

#[test]
fn only_what_changes_the_picture_changes_its_identity() {
    let identity =
        |room: Room, way, options: RenderOptions| *renderer(way, &room, &options).identity();
    let base = identity(room(), Way::Wavefront, samples(1));
    let pool = RenderOptions {
        pool: Some(99),
        ..samples(7)
    };
    for way in Way::ALL {
        assert_eq!(identity(room(), way, pool.clone()), base, "{way:?}");
    }
    let deeper = Room {
        max_depth: 6,
        ..room()
    };
    let brighter = Room {
        radiance: 1.5,
        ..room()
    };
    let painted = Room {
        materials: [0; 7],
        ..room()
    };
    for other in [deeper, brighter, painted] {
        assert_ne!(
            identity(other, Way::Wavefront, samples(1)).scene,
            base.scene
        );
    }
}

/// A stopped render is the render of fewer samples, not a mean of the shorter paths.
#[test]
fn a_stopped_render_is_one_of_fewer_samples() {
    for way in Way::ALL {
        let mut options = samples(1 << 20);
        options.pool = Some(333);
        let mut after = 40;
        let stop = &mut |progress: &Progress| {
            assert!(progress.paths < progress.total);
            after -= 1;
            if after > 0 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        };
        let stopped = renderer(way, &room(), &options).render(stop);
        let stopped = stopped.unwrap_or_else(|e| panic!("{e}"));
        let [Range { first: 0, count }] = stopped.sums.about.ranges[..] else {
            panic!("{:?}", stopped.sums.about.ranges);
        };
        assert!((1..1 << 20).contains(&count), "{count}");
        let same = RenderOptions {
            samples: count as u32,
            ..options
        };
        let reference = whole(way, &same);
        assert_eq!(stopped.sums.about.asked[0].count, 1 << 20, "{way:?}");
        assert_eq!(as_asked(stopped.sums), reference.sums, "{way:?}");
        assert_eq!(stopped.report.paths, reference.report.paths);
    }
}

/// The film of a render that was asked for what there is, and no more.
fn as_asked(mut film: FilmFile) -> FilmFile {
    film.about.asked.clone_from(&film.about.ranges);
    film
}

/// Half of its samples are by another seed, which no other part of a render has.
#[test]
fn a_render_in_two_halves_merges_with_no_other() {
    let options = samples(16);
    let rest = RenderOptions {
        first_sample: 16,
        ..samples(16)
    };
    for way in [Way::Wavefront, Way::Processor] {
        let rest = whole(way, &rest).sums;
        let mut plain = whole(way, &options).sums;
        plain.merge(&rest).expect("parts of one render");
        let mut go_on = |_: &Progress| ControlFlow::Continue(());
        let mut halves = renderer(way, &room(), &options)
            .render_until(&Goals::default(), &mut |_| (), &mut go_on)
            .unwrap_or_else(|e| panic!("{e}"))
            .sums;
        let refusal = halves.merge(&rest).expect_err("it is of another render");
        assert!(refusal.contains("different renders"), "{refusal}");
    }
}
