//! Holds every discrete BSDF to scattering into directions of the right masses.

use super::library::{Bsdf, Case};
use super::sampling::{BATCH, distribution, view};
use impasto_verify::distribution::VIEWS;
use impasto_verify::statistics::Numbers;

/// Directions drawn for each case and view.
const SAMPLES: usize = 1 << 15;

/// One of the directions that a view scatters into.
struct Found {
    wi: [f64; 3],
    times: f64,
    mass: f64,
    value: [f64; 3],
}

/// The directions that `sample` gives, and how many samples fail.
fn directions(bsdf: &Bsdf, case: &Case, wo: [f64; 3], seed: u64) -> (Vec<Found>, f64) {
    let d = distribution(bsdf, case, wo);
    let mut n = Numbers::new(seed);
    let mut found: Vec<Found> = Vec::new();
    let mut failed = 0.0;
    for _ in 0..SAMPLES / BATCH {
        let u: Vec<[f64; 4]> = (0..BATCH).map(|_| n.four()).collect();
        for wi in (d.sample)(&u).expect("directions") {
            let same = |f: &&mut Found| (0..3).all(|c| (f.wi[c] - wi[c]).abs() < 1e-9);
            if wi == [0.0; 3] {
                failed += 1.0;
            } else if let Some(known) = found.iter_mut().find(same) {
                known.times += 1.0;
            } else {
                let [mass, value @ ..] = (d.measure)(&[wi]).expect("a density")[0];
                found.push(Found {
                    wi,
                    times: 1.0,
                    mass,
                    value,
                });
            }
        }
        assert!(found.len() < 8, "{}: more than a few directions", d.label);
    }
    (found, failed)
}

/// The mirror direction, or the one that Snell's law gives for the index `ior`.
fn is_specular(wo: [f64; 3], wi: [f64; 3], ior: f64) -> bool {
    let n = if wo[2] * wi[2] > 0.0 {
        1.0
    } else if wo[2] > 0.0 {
        ior
    } else {
        1.0 / ior
    };
    let length = wi.iter().map(|x| x * x).sum::<f64>();
    (0..2).all(|c| (wi[c] * n + wo[c]).abs() < 1e-9) && (length - 1.0).abs() < 1e-9
}

#[test]
fn masses_are_frequencies_and_values_are_the_albedo() {
    let all = super::library::bsdfs();
    let work: Vec<(&Bsdf, &Case, f64)> = all
        .iter()
        .filter(|b| b.delta)
        .flat_map(|b| b.cases.iter().flat_map(move |c| VIEWS.map(|v| (b, c, v))))
        .collect();
    assert!(work.len() > 50, "only {} cases", work.len());
    super::each_in_parallel(&work, |i, (bsdf, case, degrees)| {
        let wo = view(*degrees);
        let (found, failed) = directions(bsdf, case, wo, i as u64);
        let mut faults = Vec::new();
        let mut fault = |holds: bool, text: String| faults.extend((!holds).then_some(text));
        for f in &found {
            let Found {
                wi,
                times,
                mass,
                value,
            } = f;
            fault(
                is_specular(wo, *wi, case.ior),
                format!("{wi:?} is neither mirrored nor refracted"),
            );
            let expected = mass * SAMPLES as f64;
            // A number of 24 bits is 0 more often than it is below a mass of less than that: a
            // direction of next to no mass may be seen once.
            let once = f64::from(u8::from(*mass > 0.0 && *mass < 1.0));
            let most = 5.0 * (expected * (1.0 - mass).max(0.0)).sqrt() + once + 1e-6;
            fault(
                (times - expected).abs() <= most,
                format!("{wi:?}: {times} times, expected {expected}"),
            );
            fault(
                value.iter().all(|v| v.is_finite() && *v >= 0.0),
                format!("value {value:?}"),
            );
            fault(
                value.iter().all(|v| v / mass < 1.0 + 1e-9),
                format!("weight {value:?} / {mass}"),
            );
        }
        // A direction of so little mass that it was not drawn may be missing.
        let masses: f64 = found.iter().map(|f| f.mass).sum::<f64>() + failed / SAMPLES as f64;
        fault(
            (masses - 1.0).abs() < 5e-4,
            format!("masses add up to {masses}"),
        );
        let said = super::sampling::albedo(bsdf, case, wo);
        for (c, said) in said.iter().enumerate() {
            let sum: f64 = found.iter().map(|f| f.value[c]).sum();
            fault(
                (sum - said).abs() < bsdf.albedo_within + 5e-4,
                format!("albedo {}, values {sum}", said),
            );
            fault(
                (0.0..=1.0 + 1e-12).contains(said),
                format!("albedo {}", said),
            );
        }
        (format!("{} from {degrees} degrees", case.label), faults)
    });
}

#[test]
fn what_goes_one_way_goes_the_other() {
    for bsdf in super::library::bsdfs()
        .iter()
        .filter(|b| b.delta && b.reciprocal)
    {
        for (i, case) in bsdf.cases.iter().enumerate() {
            for degrees in VIEWS {
                let wo = view(degrees);
                for f in directions(bsdf, case, wo, i as u64).0 {
                    let [_, back @ ..] =
                        (distribution(bsdf, case, f.wi).measure)(&[wo]).expect("a density")[0];
                    for (there, back) in f.value.iter().zip(back) {
                        assert!(
                            (there - back).abs() < 1e-9,
                            "{} from {degrees}: {there}, {back}",
                            case.label
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn clear_glass_keeps_all_light() {
    let all = super::library::bsdfs();
    let glass = all
        .iter()
        .find(|b| b.name == "smooth_dielectric")
        .expect("std::bsdf::smooth_dielectric");
    for case in glass.cases.iter().filter(|c| !c.label.contains("tint")) {
        for degrees in VIEWS {
            let (found, failed) = directions(glass, case, view(degrees), 1);
            let sum: f64 = found.iter().map(|f| f.value[0]).sum();
            assert!(
                failed == 0.0 && (sum - 1.0).abs() < 5e-4,
                "{} from {degrees}: {sum}",
                case.label
            );
        }
    }
}
