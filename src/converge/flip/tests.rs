//! FLIP against what its authors' own program says of small pictures (NVlabs/flip 1.7, `flip_evaluator`,
//! linear input), and the properties that it must have.

use super::*;

fn film(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f32; 3]) -> Film {
    let at = |i: u32| pixel(i % width, i / width);
    Film {
        width,
        height,
        pixels: (0..width * height).map(at).collect(),
        samples: vec![1; (width * height) as usize],
    }
}

fn even(color: [f32; 3]) -> Film {
    film(24, 16, |_, _| color)
}

/// A picture with edges and colours everywhere.
fn pattern(twist: u32) -> Film {
    film(24, 16, |x, y| {
        [0, 1, 2].map(|c| ((x * 7 + y * 3 + c * 5 + twist * x * y) % 11) as f32 / 10.0)
    })
}

/// The map's mean and its values in the upper left corner and in the middle.
#[track_caller]
fn expect(reference: &Film, picture: &Film, ppd: f64, expected: [f64; 3]) {
    let map = flip_at(picture, reference, 0.0, ppd).expect("comparable");
    let middle = map.values[8 * 24 + 12];
    let found = [map.mean(), f64::from(map.values[0]), f64::from(middle)];
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-3,
            "{found} instead of {expected}"
        );
    }
}

#[test]
fn even_colors_are_as_far_apart_as_published() {
    let all = |v: f64| [v; 3];
    expect(&even([0.0; 3]), &even([1.0; 3]), 67.0, all(0.967_387));
    let (green, blue) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    expect(&even(green), &even(blue), 67.0, all(1.0));
    expect(&even([0.18; 3]), &even([0.2; 3]), 67.0, all(0.104_388));
}

#[test]
fn a_point_an_edge_and_a_pattern_differ_as_published() {
    let grey = even([0.18; 3]);
    let dot = film(24, 16, |x, y| {
        [if (x, y) == (12, 8) { 1.0 } else { 0.18 }; 3]
    });
    expect(&grey, &dot, 67.0, [0.012_346, 0.0, 0.410_889]);
    expect(&grey, &dot, 20.0, [0.004_488, 0.0, 0.957_094]);
    let half = |from| film(24, 16, move |x, _| [if x < from { 0.1 } else { 0.9 }; 3]);
    expect(&half(12), &half(13), 67.0, [0.098_514, 0.0, 0.457_036]);
    expect(&half(12), &half(13), 20.0, [0.066_517, 0.0, 0.950_986]);
    let (a, b) = (pattern(0), pattern(1));
    expect(&a, &b, 67.0, [0.383_739, 0.161_937, 0.268_759]);
    expect(&a, &b, 20.0, [0.689_289, 0.051_296, 0.734_615]);
}

#[test]
fn equal_pictures_do_not_differ_and_order_does_not_matter() {
    let (a, b) = (pattern(0), pattern(1));
    assert_eq!(
        flip(&a, &a, PIXELS_PER_DEGREE).expect("comparable").mean(),
        0.0
    );
    let there = flip_at(&a, &b, 0.0, PIXELS_PER_DEGREE).expect("comparable");
    let back = flip_at(&b, &a, 0.0, PIXELS_PER_DEGREE).expect("comparable");
    assert_eq!(there.values, back.values);
    assert!(there.values.iter().all(|v| (0.0..=1.0).contains(v)));
}

/// Radiance in other units is seen at another exposure, so that the difference stays.
#[test]
fn the_scale_of_radiance_does_not_matter() {
    let scaled = |film: &Film, factor: f32| Film {
        pixels: film.pixels.iter().map(|p| p.map(|v| v * factor)).collect(),
        ..film.clone()
    };
    let (a, b) = (pattern(0), pattern(1));
    let usual = flip(&b, &a, PIXELS_PER_DEGREE).expect("comparable").mean();
    for factor in [1e-6, 1e6] {
        let (a, b) = (scaled(&a, factor), scaled(&b, factor));
        let found = flip(&b, &a, PIXELS_PER_DEGREE).expect("comparable").mean();
        assert!((found - usual).abs() < 1e-3, "{found} instead of {usual}");
    }
}

#[test]
fn the_exposure_makes_the_median_of_lit_pixels_grey() {
    let lit = film(4, 1, |x, _| [[0.0, 0.09, 0.09, 50.0][x as usize]; 3]);
    assert!((exposure(&lit) - 1.0).abs() < 1e-4);
    assert_eq!(exposure(&even([0.0; 3])), 0.0);
    for extreme in [f32::MIN_POSITIVE, f32::MAX / 2.0] {
        let film = even([extreme; 3]);
        assert!(exposure(&film).is_finite());
        assert_eq!(
            flip(&film, &film, PIXELS_PER_DEGREE).map(|m| m.mean()),
            Ok(0.0)
        );
    }
}

#[test]
fn pictures_smaller_than_the_filters_are_compared() {
    for (width, height) in [(1, 1), (1, 5), (7, 1)] {
        let [a, b] = [0.2, 0.4].map(|v| film(width, height, |_, _| [v; 3]));
        let found = flip_at(&a, &b, 0.0, PIXELS_PER_DEGREE).expect("comparable");
        assert_eq!(found.values.len(), (width * height) as usize);
        assert!(found.mean() > 0.1 && found.mean() < 1.0);
    }
    assert!(flip(&even([0.0; 3]), &film(1, 1, |_, _| [0.0; 3]), 67.0).is_err());
}
