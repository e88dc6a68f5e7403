//! Holds every continuous BSDF to being a distribution: `sample` draws what `pdf` says, nothing
//! that `eval` reflects is left out, no light is made, and `albedo` is the integral.

use std::f64::consts::TAU;

use impasto_compiler::ir::{Const, Function};
use impasto_compiler::passes;

use super::cells::{self, Measures};
use super::lanes::{self, Lanes};
use super::library::{Bsdf, Case};
use super::statistics::{Numbers, chi_squared_tail, direction, sidak};
use super::tally::Tally;
use crate::common::record::{Bound, effort, share};

/// Directions drawn for each case and view; a quarter decides on the cells. At full effort that is
/// over ten million for every BSDF.
fn samples() -> usize {
    effort(1 << 16, 1 << 18)
}

/// Significance of all chi-squared tests of a BSDF together.
const SIGNIFICANCE: f64 = 0.01;

/// Angles of `wo` to the normal in degrees; above 90 is inside.
pub const VIEWS: [f64; 7] = [0.0, 30.0, 60.0, 80.0, 89.0, 130.0, 175.0];

/// Lanes evaluated together.
pub const BATCH: usize = 1 << 14;

/// Is test `i`, of every case from every view in turn, one of those to run? Of a share, each case is
/// seen from two or three views, and each view sees a third of the cases.
fn chosen(i: usize) -> bool {
    let (case, view) = (i / VIEWS.len(), i % VIEWS.len());
    !share() || (case + view).is_multiple_of(3)
}

/// The unit direction at `degrees` from the normal.
pub fn view(degrees: f64) -> [f64; 3] {
    direction(degrees.to_radians().cos(), 0.7)
}

/// Draws directions from uniform numbers; zero where it fails.
pub type Sample<'a> = dyn Fn(&[[f64; 4]]) -> Vec<[f64; 3]> + 'a;

/// Density and value toward directions.
pub type Measure<'a> = dyn Fn(&[[f64; 3]]) -> Vec<Measures> + 'a;

/// A distribution of directions seen from one side: a BSDF with its parameters and `wo`.
pub struct Distribution<'a> {
    /// What it is, for messages.
    pub label: String,
    /// How it is sampled.
    pub sample: Box<Sample<'a>>,
    /// What it says about directions.
    pub measure: Box<Measure<'a>>,
}

/// What sampling and integrating a distribution gave.
pub struct Outcome {
    /// Chi-squared probability of deviations as large as those found.
    pub fit: f64,
    /// Integral of the density.
    pub total: f64,
    /// Integral of the value, by quadrature and by sampling with its standard error.
    pub energy: [f64; 3],
    pub sampled_energy: [f64; 3],
    pub error: [f64; 3],
    /// The greatest value over density.
    pub greatest_weight: f64,
}

/// A BSDF seen from `wo`.
pub fn distribution<'a>(bsdf: &'a Bsdf, case: &'a Case, wo: [f64; 3]) -> Distribution<'a> {
    let [sample, measure] = functions(bsdf, case);
    distribution_of(bsdf, case, wo, sample, measure)
}

/// The same for very many directions. Its functions are optimised as in a kernel, with the case's arguments for
/// constants: what density and value share is computed once, and what the case does not need is not.
fn optimised<'a>(bsdf: &'a Bsdf, case: &'a Case, wo: [f64; 3]) -> Distribution<'a> {
    let [sample, measure] = functions(bsdf, case).map(|mut function| {
        passes::run(&bsdf.module, &mut function);
        function
    });
    distribution_of(bsdf, case, wo, sample, measure)
}

/// What samples directions, and what gives their density and value.
fn functions(bsdf: &Bsdf, case: &Case) -> [Function; 2] {
    [&[bsdf.sample][..], &[bsdf.pdf, bsdf.eval]].map(|methods| bsdf.answers(case, methods))
}

fn distribution_of<'a>(
    bsdf: &'a Bsdf,
    case: &'a Case,
    wo: [f64; 3],
    sampled: Function,
    measured: Function,
) -> Distribution<'a> {
    let ask = move |function: &Function, second: Lanes| {
        lanes::run(&bsdf.module, function, vec![lanes::uniform(&wo), second])
    };
    let sample = move |u: &[[f64; 4]]| {
        let numbers = (0..3).map(|c| lanes::floats(u.iter().map(|u| u[c]).collect()));
        let wi = ask(&sampled, numbers.collect());
        (0..u.len())
            .map(|l| std::array::from_fn(|c| lanes::float_at(&wi, c, l)))
            .collect()
    };
    let measure = move |wi: &[[f64; 3]]| {
        let found = ask(&measured, lanes::vectors(wi));
        let answer = |(l, wi): (usize, &[f64; 3])| {
            let power = bsdf.power_over_radiance(case, wo[2], wi[2]);
            let v = |c: usize| power * lanes::float_at(&found, 1 + c, l);
            [lanes::float_at(&found, 0, l), v(0), v(1), v(2)]
        };
        wi.iter().enumerate().map(answer).collect()
    };
    Distribution {
        label: format!(
            "{} from {:.0} degrees",
            case.label,
            wo[2].acos().to_degrees()
        ),
        sample: Box::new(sample),
        measure: Box::new(measure),
    }
}

/// Added to the seed where a fault is looked at again.
pub const AGAIN: u64 = 1 << 32;

/// How much more than 1 the density or what is reflected may integrate to.
pub const GAIN: f64 = 2e-3;

/// Adds an outcome to what is kept of a BSDF or material, which may reflect `gain` more than 1.
pub fn tell(tally: &Tally, (name, gain): (&str, f64), o: &Outcome, tests: usize, label: &str) {
    let least = Bound::AtLeast(sidak(SIGNIFICANCE, tests));
    let energy = o.energy.iter().fold(0.0f64, |a, &b| a.max(b));
    tally.add(
        ("chi-squared", name, "least probability"),
        o.fit,
        least,
        label,
    );
    tally.add(
        ("density", name, "integral of the density"),
        o.total,
        Bound::AtMost(1.0 + GAIN),
        label,
    );
    tally.add(
        ("energy", name, "most that is reflected of 1, integrated"),
        energy,
        Bound::AtMost(1.0 + gain),
        label,
    );
}

/// Samples and integrates. Panics on answers that no distribution gives.
pub fn examine(d: &Distribution<'_>, samples: usize, seed: u64) -> Outcome {
    let mut n = Numbers::new(seed);
    let mut drawn: Vec<[f64; 3]> = Vec::with_capacity(samples);
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    let mut greatest_weight: f64 = 0.0;
    for _ in 0..samples.div_ceil(BATCH) {
        let u: Vec<[f64; 4]> = (0..BATCH).map(|_| n.four()).collect();
        let wi: Vec<[f64; 3]> = (d.sample)(&u)
            .into_iter()
            .filter(|w| *w != [0.0; 3])
            .collect();
        if wi.is_empty() {
            continue;
        }
        for (w, m) in wi.iter().zip((d.measure)(&wi)) {
            let length = w.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(
                (length - 1.0).abs() < 1e-6,
                "{}: sampled {w:?}, not unit",
                d.label
            );
            assert!(
                m.iter().all(|x| x.is_finite() && *x >= 0.0),
                "{}: {m:?} at {w:?}",
                d.label
            );
            assert!(m[0] > 0.0, "{}: density 0 at the sampled {w:?}", d.label);
            for c in 0..3 {
                let weight = m[c + 1] / m[0];
                greatest_weight = greatest_weight.max(weight);
                sum[c] += weight;
                squares[c] += weight * weight;
            }
        }
        drawn.extend(wi);
    }
    let all = (samples.div_ceil(BATCH) * BATCH) as f64;
    let sampled_energy = sum.map(|s| s / all);
    let deviation =
        |c: usize| ((squares[c] / all - sampled_energy[c].powi(2)).max(0.0) / all).sqrt();

    let (pilot, tested) = drawn.split_at(drawn.len() / 4);
    let partition = cells::partition(pilot, (pilot.len() / 128).max(16));
    let integrals = cells::integrate(&partition, &*d.measure);
    let total: f64 = integrals.iter().map(|m| m[0]).sum();
    let found = cells::counts(&partition.cells, tested);
    let count = 0.75 * all;
    let expected = integrals.iter().map(|m| m[0] * count);
    let mut pairs: Vec<(f64, f64)> = expected.zip(found.iter().map(|&n| n as f64)).collect();
    // Failed samples are one more cell. What is missing in the integral is known no better than the
    // integral itself is.
    let failed = (count - tested.len() as f64).max(0.0);
    let [low, high] = [-cells::RELATIVE, cells::RELATIVE].map(|e| (1.0 - total + e).max(0.0));
    pairs.push((failed.clamp(low * count, high * count), failed));
    Outcome {
        fit: chi_squared(&pairs),
        total,
        energy: std::array::from_fn(|c| integrals.iter().map(|m| m[c + 1]).sum()),
        sampled_energy,
        error: std::array::from_fn(deviation),
        greatest_weight,
    }
}

/// The probability of deviations as large as between expected and found counts. Cells in which
/// few are expected are taken together.
fn chi_squared(pairs: &[(f64, f64)]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0.0);
    let mut rare = (0.0, 0.0);
    let mut add = |(expected, found): (f64, f64)| {
        statistic += (found - expected).powi(2) / expected;
        cells += 1.0;
    };
    for &(expected, found) in pairs {
        if expected >= 10.0 {
            add((expected, found));
        } else {
            rare = (rare.0 + expected, rare.1 + found);
        }
    }
    if rare.0 >= 5.0 {
        add(rare);
    } else if rare.1 > 30.0 {
        // Found where next to nothing is expected.
        return 0.0;
    }
    if cells < 2.0 {
        1.0
    } else {
        chi_squared_tail(statistic, cells - 1.0)
    }
}

/// What is wrong with an outcome, if it is not that of a distribution that keeps energy. `tests`
/// is how many share the significance level.
pub fn faults(o: &Outcome, tests: usize) -> Vec<String> {
    let mut faults = Vec::new();
    if o.total > 1.0 + GAIN {
        faults.push(format!("the density integrates to {}", o.total));
    }
    if o.fit < sidak(SIGNIFICANCE, tests) {
        faults.push(format!(
            "samples do not follow the density: p = {:.1e}",
            o.fit
        ));
    }
    for c in 0..3 {
        let (exact, sampled) = (o.energy[c], o.sampled_energy[c]);
        if exact > 1.0 + GAIN {
            faults.push(format!("reflects {exact}"));
        }
        if (exact - sampled).abs() > 5.0 * o.error[c] + 2e-3 * exact + 1e-5 {
            faults.push(format!(
                "reflects {exact} by integration, {sampled} by sampling"
            ));
        }
    }
    faults
}

#[test]
fn samples_follow_the_density_and_keep_energy() {
    let all = super::library::bsdfs();
    let continuous: Vec<&Bsdf> = all.iter().filter(|b| !b.delta).collect();
    let work: Vec<(&Bsdf, &Case, f64)> = continuous
        .iter()
        .flat_map(|b| {
            let cases = b.cases.iter();
            cases.flat_map(move |c| VIEWS.map(|v| (*b, c, v)))
        })
        .collect();
    let tests = work.len();
    let tally = Tally::default();
    super::each_in_parallel(&work, |i, (bsdf, case, degrees)| {
        if !super::asked_for(&bsdf.name) || !chosen(i) {
            return (case.label.clone(), Vec::new());
        }
        let wo = view(*degrees);
        let d = optimised(bsdf, case, wo);
        let found = |seed: u64| {
            let outcome = examine(&d, samples(), seed);
            let mut faults = faults(&outcome, tests);
            let good = faults.is_empty();
            // Rough lobes are sampled where they are bright: no weight is far above the albedo.
            if outcome.greatest_weight > 4.0 {
                faults.push(format!("weight {}", outcome.greatest_weight));
            }
            faults.extend(albedo_fault(bsdf, case, wo, &outcome));
            if good || seed >= AGAIN {
                tell(&tally, (&bsdf.name, GAIN), &outcome, tests, &d.label);
            }
            faults
        };
        // Among thousands of partitions into cells, one or two are integrated badly where a lobe is
        // very sharp: a fault counts if other samples, and so other cells, show one too.
        let first = found(i as u64);
        let faults = if first.is_empty() {
            first
        } else {
            found(i as u64 + AGAIN)
        };
        (d.label, faults)
    });
}

/// What the BSDF's `albedo` says.
pub fn albedo(bsdf: &Bsdf, case: &Case, wo: [f64; 3]) -> [f64; 3] {
    let mut args: Vec<Lanes> = case.args.iter().map(lanes::constant).collect();
    args.push(lanes::uniform(&wo));
    let albedo = lanes::call(&bsdf.module, bsdf.albedo, args);
    std::array::from_fn(|c| lanes::float_at(&albedo, c, 0))
}

#[test]
fn bsdfs_pass_no_more_than_they_leave() {
    let all = super::library::bsdfs();
    let passing = all.iter().filter_map(|b| Some((b, b.passes?)));
    let mut seen = 0;
    for (bsdf, passes) in passing {
        // Defaults are white or grey: what the brightest channel leaves counts where they differ.
        let cases: Vec<Case> = bsdf.cases.iter().flat_map(plain_and_colored).collect();
        for (case, degrees) in cases.iter().flat_map(|c| VIEWS.map(|v| (c, v))) {
            let wo = view(degrees);
            let mut args: Vec<Lanes> = case.args.iter().map(lanes::constant).collect();
            args.push(lanes::uniform(&wo));
            let passed = lanes::call(&bsdf.module, passes, args);
            let reflected = albedo(bsdf, case, wo);
            for (c, reflected) in reflected.into_iter().enumerate() {
                let passed = lanes::float_at(&passed, c, 0);
                let sound = passed >= 0.0 && passed + reflected <= 1.0 + 1e-9;
                assert!(
                    sound,
                    "{} from {degrees} degrees: passes {passed}, reflects {reflected}",
                    case.label
                );
            }
        }
        seen += 1;
    }
    assert!(seen >= 3, "only {seen} bsdfs say what they pass");
}

/// A case, and the same with a color of unequal channels in place of every color.
fn plain_and_colored(case: &Case) -> [Case; 2] {
    let colored = |value: &Const| match value {
        Const::Float(parts) if parts.len() == 3 => Const::Float(vec![0.9, 0.4, 0.1]),
        other => other.clone(),
    };
    let with = |label: String, args| Case {
        label,
        args,
        ior: case.ior,
    };
    [
        with(case.label.clone(), case.args.clone()),
        with(
            format!("{} in color", case.label),
            case.args.iter().map(colored).collect(),
        ),
    ]
}

/// `albedo` is the integral, within what its documentation promises.
fn albedo_fault(bsdf: &Bsdf, case: &Case, wo: [f64; 3], outcome: &Outcome) -> Option<String> {
    let said = albedo(bsdf, case, wo);
    let within = if (wo[2] > 0.0) == (case.ior >= 1.0) {
        bsdf.albedo_within
    } else {
        bsdf.albedo_within_inside
    };
    let right = (0..3).all(|c| {
        let close = (said[c] - outcome.energy[c]).abs() < within + 1e-3;
        close && (0.0..=1.0).contains(&said[c])
    });
    (!right).then(|| format!("albedo says {said:?}, the integral is {:?}", outcome.energy))
}

#[test]
fn the_test_sees_wrong_densities() {
    // A cosine lobe whose density is wrong by 3 %, lacks its cosine, or whose sample is uniform.
    let cosine = |u: &[[f64; 4]]| {
        u.iter()
            .map(|u| direction((1.0 - u[0]).sqrt(), TAU * u[1]))
            .collect()
    };
    let uniform = |u: &[[f64; 4]]| {
        u.iter()
            .map(|u| direction(1.0 - u[0], TAU * u[1]))
            .collect()
    };
    let density = |scale: f64, power: i32| {
        move |w: &[[f64; 3]]| -> Vec<Measures> {
            let at = |w: &[f64; 3]| {
                if w[2] > 0.0 {
                    scale * w[2].powi(power) / TAU
                } else {
                    0.0
                }
            };
            w.iter().map(|w| [at(w), at(w), at(w), at(w)]).collect()
        }
    };
    let fit = |sample: &Sample<'_>, scale, power| {
        let d = Distribution {
            label: String::new(),
            sample: Box::new(sample),
            measure: Box::new(density(scale, power)),
        };
        examine(&d, 1 << 16, 1).fit
    };
    assert!(fit(&cosine, 2.0, 1) > 1e-4);
    assert!(fit(&cosine, 1.94, 1) < 1e-6);
    assert!(fit(&cosine, 1.0, 0) < 1e-6);
    assert!(fit(&uniform, 2.0, 1) < 1e-6);
}
