//! Renders of some pixels only: they have the bits that they have in the whole picture, and the others
//! are not touched.

use std::ops::ControlFlow;

use crate::gpu::stub::{Kind, Materials, Room, Way, materials, plan, samples};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering, Samples};
use impasto_runtime::world::World;

const SIZE: (u32, u32) = (16, 8);

fn world() -> World {
    let room = Room {
        plate: true,
        emitters: vec![3],
        max_depth: 5,
        roulette_start: 2,
        width: SIZE.0,
        height: SIZE.1,
        materials: [0, 1, 0, 0, 1, 0, 2],
        ..Room::default()
    };
    room.world()
}

fn surfaces() -> Materials {
    materials(&[Kind::Diffuse(0.6), Kind::Failing(0.5), Kind::Mirror])
}

fn renderer(way: Way, options: &RenderOptions) -> Renderer<'static> {
    let surfaces = surfaces();
    let plan = plan(way.strategy(), &surfaces);
    Renderer::from_world(way.device(), &world(), &surfaces, &plan, options)
        .unwrap_or_else(|e| panic!("{e}"))
}

fn rendering(renderer: &mut Renderer<'_>) -> Rendering {
    renderer
        .render(&mut |_| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn check(some: &Rendering, chosen: &[u32], whole: &Rendering, samples: u32) {
    for (pixel, count) in (0..).zip(&some.film.samples) {
        let at = pixel as usize;
        if chosen.contains(&pixel) {
            assert_eq!(*count, samples, "pixel {pixel}");
            assert_eq!(some.film.pixels[at], whole.film.pixels[at], "pixel {pixel}");
        } else {
            assert_eq!(*count, 0, "pixel {pixel}");
            assert_eq!(some.film.pixels[at], [0.0; 3], "pixel {pixel}");
        }
    }
    let paths = chosen.len() as u64 * u64::from(samples);
    assert_eq!(some.report.paths, paths);
    assert!(some.report.paths_per_second > 0.0);
}

#[test]
fn some_pixels_have_the_bits_of_the_whole_and_others_no_samples() {
    let odd: Vec<u32> = (0..SIZE.0 * SIZE.1).filter(|p| p % 3 == 1).collect();
    for way in Way::ALL {
        let whole = rendering(&mut renderer(way, &samples(6)));
        // Pools that hold all paths, part of a sample's, and one path.
        for (pool, chosen) in [
            (None, odd.clone()),
            (Some(10), odd.clone()),
            (Some(1), vec![127]),
            (Some(50), vec![0]),
        ] {
            let options = RenderOptions {
                pool,
                pixels: Some(chosen.clone().into()),
                ..samples(6)
            };
            let some = rendering(&mut renderer(way, &options));
            check(&some, &chosen, &whole, 6);
        }
    }
}

#[test]
fn other_pixels_are_chosen_without_building_kernels_anew() {
    Way::ALL.into_iter().for_each(choose_others);
}

fn choose_others(way: Way) {
    let all: Vec<u32> = (0..SIZE.0 * SIZE.1).collect();
    let options = RenderOptions {
        pixels: Some(all.clone().into()),
        ..samples(5)
    };
    let mut whole = renderer(way, &samples(5));
    let whole = rendering(&mut whole);
    let mut some = renderer(way, &options);
    check(&rendering(&mut some), &all, &whole, 5);
    let last: Vec<u32> = (100..128).collect();
    some.select_pixels(last.clone().into()).expect("they exist");
    let of_last = rendering(&mut some);
    check(&of_last, &last, &whole, 5);
    // Films of some pixels are no part of those of others, nor of the whole.
    some.select_pixels((101..128).collect())
        .expect("they exist");
    let of_others = rendering(&mut some);
    for other in [&of_others, &whole] {
        let mut merged = of_last.sums.clone();
        let refused = merged.merge(&other.sums).expect_err("refused");
        assert!(refused.contains("scene"), "{refused}");
    }
    // More than before fit as well, and other samples.
    some.select_pixels(all.clone().into()).expect("they exist");
    let selected = Samples {
        seed: 0,
        first: 0,
        count: 5,
    };
    some.select(&selected).expect("they exist");
    check(&rendering(&mut some), &all, &whole, 5);
}

#[test]
fn pixels_that_are_none_are_refused() {
    let built = |pixels: &[u32]| {
        let options = RenderOptions {
            pixels: Some(pixels.into()),
            ..samples(1)
        };
        let (world, surfaces) = (world(), surfaces());
        let plan = plan(Way::Wavefront.strategy(), &surfaces);
        let built =
            Renderer::from_world(Way::Wavefront.device(), &world, &surfaces, &plan, &options);
        built.map(|_| ()).expect_err("refused").to_string()
    };
    for (pixels, says) in [
        (&[][..], "empty"),
        (&[5, 5][..], "not ascending"),
        (&[6, 5][..], "not ascending"),
        (&[0, 128][..], "up to 128"),
    ] {
        let error = built(pixels);
        assert!(
            error.contains(says) && error.contains("below 128"),
            "{error}"
        );
    }
    let mut whole = renderer(Way::Wavefront, &samples(1));
    let error = whole.select_pixels([3].into()).expect_err("refused");
    assert!(
        error.to_string().contains("RenderOptions::pixels"),
        "{error}"
    );
    let all = renderer(Way::Wavefront, &samples(1));
    // Code and buffer exist only where some pixels are chosen.
    let text = |renderer: &Renderer<'_>| renderer.kernels().map(|(_, w)| w).collect::<String>();
    assert!(!text(&all).contains("pixel_list") && !text(&all).contains("run.pixels"));
    let options = RenderOptions {
        pixels: Some([3].into()),
        ..samples(1)
    };
    assert!(text(&renderer(Way::Wavefront, &options)).contains("pixel_list"));
}
