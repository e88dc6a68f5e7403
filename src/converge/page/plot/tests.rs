//! Plots are well-formed, keep to their frame, and bear what is not there.

use super::super::{bars::bars, example};
use super::*;
use crate::converge::data::Convergence;

/// Fails unless `text` is one element with properly nested elements and escaped texts.
#[track_caller]
fn check_xml(text: &str) {
    let mut open = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('<') {
        assert!(!before.contains('>'), "{before}");
        for entity in before.split('&').skip(1) {
            let known = ["lt;", "gt;", "amp;", "quot;", "apos;"];
            assert!(known.iter().any(|k| entity.starts_with(k)), "&{entity}");
        }
        let (tag, after) = after.split_once('>').expect("a tag ends");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name.to_owned()));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap_or("").to_owned());
        }
        rest = after;
    }
    assert!(open.is_empty() && text.starts_with("<svg"), "{open:?}");
    assert!(!text.chars().any(|c| c.is_control() && c != '\n'));
}

/// All plots of a scene.
fn all(convergence: &Convergence) -> Vec<String> {
    let scene = &convergence.scenes[0];
    let plots = Metric::ALL
        .into_iter()
        .flat_map(|metric| [true, false].map(|time| curves(scene, metric, time).expect("drawn")));
    plots.chain([bars(scene).expect("drawn")]).collect()
}

/// Values of an attribute of all elements.
fn attributes(svg: &str, tag: &str, attribute: &str) -> Vec<f64> {
    let elements = svg.split('<').filter(|e| e.starts_with(tag));
    let value = |e: &str| {
        let (_, after) = e.split_once(&format!(" {attribute}=\""))?;
        after.split('"').next()?.parse().ok()
    };
    elements.filter_map(value).collect()
}

#[test]
fn plots_are_well_formed_and_within_their_frame() {
    for svg in all(&example::convergence()) {
        check_xml(&svg);
        let [width, height] = ["width", "height"].map(|a| attributes(&svg, "svg", a)[0]);
        for (tag, x, y) in [
            ("circle", "cx", "cy"),
            ("text", "x", "y"),
            ("rect", "x", "y"),
        ] {
            assert!(
                attributes(&svg, tag, x)
                    .iter()
                    .all(|v| (0.0..=width).contains(v)),
                "{tag}"
            );
            assert!(
                attributes(&svg, tag, y)
                    .iter()
                    .all(|v| (0.0..=height).contains(v)),
                "{tag}"
            );
        }
    }
}

/// Twelve renders and four means of two series are dots, and two of the legend; equal factors are equal
/// distances.
#[test]
fn dots_are_where_numbers_are() {
    let svg = curves(&example::convergence().scenes[0], Metric::Relmse, false).expect("drawn");
    assert_eq!(attributes(&svg, "circle", "cx").len(), 2 * (12 + 4) + 2);
    let circles = svg
        .split("<circle")
        .filter(|c| c.contains("r=\"4\"") && c.contains("#0072B2"));
    let at = |c: &str, a: &str| attributes(&format!("circle{c}"), "circle", a)[0];
    let means: Vec<(f64, f64)> = circles
        .map(|c| (at(c, "cx"), at(c, "cy")))
        .take(4)
        .collect();
    for pair in means.windows(2) {
        let step = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let first = (means[1].0 - means[0].0, means[1].1 - means[0].1);
        assert!(
            (step.0 - first.0).abs() <= 1.0 && (step.1 - first.1).abs() <= 1.0,
            "{means:?}"
        );
        assert!(step.0 > 0.0 && step.1 > 0.0);
    }
}

/// Both series have the same numbers of samples; the second takes half as much time again.
#[test]
fn times_are_drawn_against_times() {
    let scene = &example::convergence().scenes[0];
    let first_dots = |against_time| -> Vec<f64> {
        let svg = curves(scene, Metric::Rmse, against_time).expect("drawn");
        let first = |color: &str| {
            let mut circles = svg.split("<circle").filter(|c| c.contains(color));
            let circle = circles.next().expect("a dot");
            attributes(&format!("circle{circle}"), "circle", "cx")[0]
        };
        ["#0072B2", "#D55E00"].map(first).into()
    };
    let (times, samples) = (first_dots(true), first_dots(false));
    assert!(times[1] > times[0] + 5.0, "{times:?}");
    assert_eq!(samples[0], samples[1]);
}

#[test]
fn what_is_not_there_is_not_drawn() {
    for svg in all(&example::black()) {
        check_xml(&svg);
    }
    for svg in all(&example::empty()) {
        check_xml(&svg);
        assert!(!svg.contains("circle"));
    }
    let mut one = example::convergence();
    one.scenes[0].series.truncate(1);
    one.scenes[0].series[0].points.truncate(1);
    one.scenes[0].series[0].points[0].runs.truncate(1);
    one.scenes[0].reference.error = None;
    one.scenes[0].materials[0].mse = f64::NAN;
    for svg in all(&one) {
        check_xml(&svg);
    }
}

#[test]
fn extremes_are_drawn() {
    for (scale, seconds) in [(1e-25, 1e-9), (1e25, 1e9), (f64::MAX, 0.0)] {
        let mut wide = example::convergence();
        for series in &mut wide.scenes[0].series {
            series.strategy = "a very long plan of <many> & \"quoted\" kernels \u{7}".repeat(9);
            let runs = series.points.iter_mut().flat_map(|p| &mut p.runs);
            runs.for_each(|run| {
                run.errors.mse *= scale;
                run.gpu_seconds *= seconds;
            });
        }
        let share = wide.scenes[0].materials[0].clone();
        wide.scenes[0].materials = vec![share; 100];
        for svg in all(&wide) {
            check_xml(&svg);
        }
    }
}

#[test]
fn there_are_ticks_in_every_range() {
    for (low, factor) in [
        (1e-9, 1.7),
        (0.3, 2.0),
        (0.01, 30.0),
        (1e-6, 1e9),
        (1e-30, 1e60),
    ] {
        let ticks = ticks([low, low * factor]);
        assert!(
            (2..=14).contains(&ticks.len()),
            "{low} x {factor}: {ticks:?}"
        );
    }
    assert_eq!(
        [1e-5, 0.5, 1.0, 2000.0].map(tick),
        ["1e-5", "0.5", "1", "2000"]
    );
}
