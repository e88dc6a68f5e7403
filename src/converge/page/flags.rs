//! What a reader must know before trusting numbers: tails, references that are too noisy, samples that
//! were left out.

use super::numbers::{label, number, percent};
use crate::converge::data::{Metric, Reference, SceneConvergence, Series};
use crate::converge::fit::means;
use crate::converge::left_out;

/// The largest error of a reference, relative to the smallest of any render.
const REFERENCE_SHARE: f64 = 0.05;
/// From this share of a tail's error on, the reference's own error explains the tail.
const EXPLAINS: f64 = 0.3;

/// An error that is so many times the least before it has risen.
const RISE: f64 = 1.5;
/// So many times as large as another is an error of the same number of samples that met what the other did not.
const SPREAD: f64 = 4.0;

/// All flags of a scene.
pub(super) fn flags(scene: &SceneConvergence) -> Vec<String> {
    let mut flags: Vec<String> = of_reference(&scene.reference).into_iter().collect();
    if scene.series.iter().all(|s| s.points.is_empty()) {
        flags.push("There are no renders.".into());
    } else if scene.series.iter().all(is_exact) {
        flags.push(
            "Every render equals the reference, as in a scene without light: there is no error to plot."
                .into(),
        );
    }
    for series in &scene.series {
        flags.extend(of_series(series, &scene.reference));
    }
    flags
}

fn of_reference(reference: &Reference) -> Option<String> {
    match reference.relative_error {
        Some(share) if share > REFERENCE_SHARE => Some(format!(
            "The reference's own error is {} of the smallest error of a render, more than {}: errors near \
             it are not to be trusted. {}",
            percent(share),
            percent(REFERENCE_SHARE),
            if reference.cut_short {
                "The time was up before that; more time helps."
            } else {
                "A reference of more samples helps."
            }
        )),
        Some(_) => None,
        None if reference.error.is_some() => None,
        None => Some("Nothing is known of the reference's own error, since it was given.".into()),
    }
}

fn is_exact(series: &Series) -> bool {
    let runs = series.points.iter().flat_map(|p| &p.runs);
    runs.map(|r| r.errors.mse).all(|mse| mse == 0.0)
}

fn of_series(series: &Series, reference: &Reference) -> Vec<String> {
    let mut flags: Vec<String> = Metric::ALL
        .into_iter()
        .filter_map(|metric| tail(series, metric, reference))
        .collect();
    flags.extend(left_out::text(series).map(|text| format!("{text}.")));
    if series.points.len() == 1 {
        flags.push("there is one number of samples, which has no slope.".into());
    }
    let runs = series.points.iter().flat_map(|p| &p.runs);
    let dropped: u64 = runs.map(|r| r.dropped).sum();
    if dropped > 0 {
        flags.push(format!(
            "{dropped} samples were no numbers, negative or too large, and were left out or cut."
        ));
    }
    let name = label(series);
    flags
        .into_iter()
        .map(|flag| format!("{name}: {flag}"))
        .collect()
}

/// Where an error stops falling, and what may be why.
fn tail(series: &Series, metric: Metric, reference: &Reference) -> Option<String> {
    let from = series.fits.get(&metric)?.flat_from?;
    let means = means(&series.points, metric);
    let last = means.last()?.error;
    let tail = means.iter().skip_while(|mean| mean.samples < from);
    let least = tail.map(|mean| mean.error).fold(f64::INFINITY, f64::min);
    let own = reference.error.as_ref().map(|e| metric.of(e));
    let why = match own.map(|own| own / last) {
        Some(share) if share >= EXPLAINS => format!(
            "noise of the reference, whose own error is {} of it",
            percent(share)
        ),
        // A bias is the same for all seeds, and lets no error rise.
        _ if last > RISE * least || spread(series, metric, from) > SPREAD => {
            "bright samples so rare that only some renders met one; more seeds tell more".into()
        }
        Some(share) => format!(
            "bias, since the reference's own error is only {} of it",
            percent(share)
        ),
        None => "bias, or noise of the reference, whose error is unknown".into(),
    };
    Some(format!(
        "{} stops falling at {from} samples, near {}: {why}.",
        metric.name(),
        number(last)
    ))
}

/// How many times as large as the least the largest error of renders of one number of samples is, from some
/// samples on.
fn spread(series: &Series, metric: Metric, from: u32) -> f64 {
    let tail = series.points.iter().filter(|point| point.samples >= from);
    let ratios = tail.map(|point| {
        let errors = point.runs.iter().map(|run| metric.of(&run.errors));
        let [least, largest] = errors.fold([f64::INFINITY, 0.0], |[a, b], e| [e.min(a), e.max(b)]);
        largest / least
    });
    ratios.filter(|ratio| ratio.is_finite()).fold(1.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;
    use crate::converge::data::{Errors, LeftOut};

    fn flags_with(change: impl Fn(&mut SceneConvergence)) -> Vec<String> {
        let mut scene = example::convergence().scenes.remove(0);
        change(&mut scene);
        flags(&scene)
    }

    #[test]
    fn a_scene_that_is_well_has_none() {
        assert_eq!(flags_with(|_| ()), Vec::<String>::new());
    }

    #[test]
    fn references_are_judged() {
        let noisy = flags_with(|s| s.reference.relative_error = Some(0.2));
        assert!(noisy.len() == 1 && noisy[0].contains("20.0 %"), "{noisy:?}");
        let given = flags_with(|s| {
            s.reference.relative_error = None;
            s.reference.error = None;
        });
        assert!(
            given.len() == 1 && given[0].contains("since it was given"),
            "{given:?}"
        );
    }

    #[test]
    fn tails_are_explained_by_the_reference_or_by_bias() {
        let flat = |own: Option<f64>| {
            let flags = flags_with(|s| {
                s.reference.error = own.map(|own| Errors {
                    relmse: own,
                    ..Errors::default()
                });
                let fit = s.series[0].fits.get_mut(&Metric::Relmse).expect("a fit");
                fit.flat_from = Some(16);
            });
            flags.join("\n")
        };
        let last = example::LAST_RELMSE;
        assert!(
            flat(Some(0.9 * last)).contains("noise of the reference, whose own error is 90.0 %")
        );
        assert!(flat(Some(0.01 * last)).contains("at 16 samples, near 0.0156: bias, since"));
        assert!(flat(None).contains("bias, or noise of the reference"));
    }

    #[test]
    fn rare_bright_samples_are_no_bias() {
        let flags = flags_with(|s| {
            let series = &mut s.series[0];
            series
                .fits
                .get_mut(&Metric::Relmse)
                .expect("a fit")
                .flat_from = Some(16);
            let last = series.points.last_mut().expect("a point");
            last.runs[0].errors.relmse *= 100.0;
        });
        assert!(
            flags.join("\n").contains("bright samples so rare"),
            "{flags:?}"
        );
    }

    #[test]
    fn samples_left_out_and_black_scenes_are_told() {
        let dropped = flags_with(|s| s.series[1].points[0].runs[0].dropped = 7);
        assert!(
            dropped.len() == 1 && dropped[0].starts_with("auto, owen: 7 samples"),
            "{dropped:?}"
        );
        let black = flags_with(|s| {
            let points = s.series.iter_mut().flat_map(|s| &mut s.points);
            points
                .flat_map(|p| &mut p.runs)
                .for_each(|r| r.errors = Errors::default());
        });
        assert!(black[0].contains("equals the reference"), "{black:?}");
        let late = flags_with(|s| {
            s.reference.relative_error = Some(0.2);
            s.reference.cut_short = true;
            s.series[1].left_out.push(LeftOut {
                samples: 256,
                seeds: vec![0, 1, 2],
                seconds: 9.0,
                seconds_left: 1.0,
            });
        });
        assert!(
            late.len() == 2
                && late[0].contains("The time was up")
                && late[1].starts_with("auto, owen: no time was left for all renders of 256"),
            "{late:?}"
        );
        let none = flags_with(|s| s.series.clear());
        assert_eq!(none, ["There are no renders."]);
        let one = flags_with(|s| s.series[0].points.truncate(1));
        assert!(one.len() == 1 && one[0].contains("has no slope"), "{one:?}");
    }
}
