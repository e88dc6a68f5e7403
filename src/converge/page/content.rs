//! What a page says, in order; how it looks is up to `document`.

use super::document::{Block, Figure, Table};
use super::flags::flags;
use super::numbers::{label, number, or_dash, percent, time};
use super::{Drawn, plot};
use crate::converge::compare::{Comparison, Reading, equal_error, equal_time};
use crate::converge::data::{Convergence, Fit, MaterialShare, Metric, SceneConvergence, Series};
use crate::converge::fit::means;
use crate::converge::pictures::{ERROR_DECADES, ScenePictures};
use crate::runtime::technique::Choice;

/// The head of a page.
pub(super) fn head(convergence: &Convergence) -> Vec<Block> {
    let adapter = &convergence.adapter;
    vec![
        Block::Heading(1, "Error against run time".into()),
        Block::Text(format!(
            "Made with Impasto {} on {} ({}, {}) by",
            convergence.version, adapter.name, adapter.backend, adapter.driver
        )),
        Block::Code(convergence.command.clone()),
        Block::Text(
            "Times are those in which the GPU rendered; compiling is part of none of them and stands \
             apart. RMSE is the root of the mean squared error of linear radiance; relMSE is the mean of \
             (x - r)^2 / (r^2 + 0.01) for a value x and its reference r; FLIP (Andersson et al. 2020) is how \
             large the differences are that people see, from 0 to 1, of tone-mapped pictures at 67 pixels a \
             degree and the exposure at which the reference's median luminance is 0.18."
                .into(),
        ),
    ]
}

/// All about a scene.
pub(super) fn scene(
    scene: &SceneConvergence,
    drawn: &[Drawn],
    pictures: Option<&ScenePictures>,
) -> Vec<Block> {
    let mut blocks = vec![
        Block::Heading(2, scene.name.clone()),
        Block::Text(reference(scene)),
    ];
    let flags = flags(scene);
    if !flags.is_empty() {
        blocks.push(Block::Flags(flags));
    }
    blocks.push(Block::Figures(figures(drawn, |d| {
        d.of != plot::Of::Materials
    })));
    if !scene.series.is_empty() {
        blocks.extend(series(scene));
    }
    if !scene.materials.is_empty() {
        blocks.extend(materials(scene, drawn));
    }
    if let Some(pictures) = pictures {
        blocks.extend(gallery(pictures));
    }
    blocks
}

fn figures(drawn: &[Drawn], wanted: impl Fn(&Drawn) -> bool) -> Vec<Figure> {
    let drawn = drawn.iter().filter(|d| wanted(d));
    let figure = |d: &Drawn| Figure {
        file: d.file.clone(),
        caption: d.caption.clone(),
    };
    drawn.map(figure).collect()
}

/// `640x480 pixels, against ...`
fn reference(scene: &SceneConvergence) -> String {
    let ((width, height), reference) = (scene.size, &scene.reference);
    let mut text = format!(
        "{width}x{height} pixels. The reference is {}",
        reference.file
    );
    if let Some(samples) = reference.samples {
        let seconds = time(reference.gpu_seconds);
        text += &format!(" of {samples} samples a pixel, which took {seconds}");
    }
    text += ".";
    if let Some(errors) = &reference.error {
        let errors = Metric::ALL.map(|m| format!("{} {}", m.name(), number(m.of(errors))));
        text += &format!(
            " Its own error, estimated from its halves: {}",
            errors.join(", ")
        );
        text += &match reference.relative_error {
            Some(share) => format!(
                "; of the smallest RMSE of a render this is {}.",
                percent(share)
            ),
            None => ".".into(),
        };
    }
    text
}

fn series(scene: &SceneConvergence) -> Vec<Block> {
    let mut blocks = vec![
        Block::Heading(3, "Series".into()),
        Block::Text(
            "Slopes are those of the error against samples in logarithms, with one standard error, before \
             an error stops falling; independent samples have -0.5 for RMSE and -1 for relMSE. Efficiency is \
             1 / (squared error x seconds), which does not depend on the number of samples where they are \
             independent."
                .into(),
        ),
        Block::Table(slopes(&scene.series)),
    ];
    if scene.series.len() > 1 {
        blocks.extend(comparisons(&scene.series));
    }
    blocks.push(Block::Heading(3, "Renders".into()));
    blocks.push(Block::Table(renders(&scene.series)));
    blocks
}

fn comparisons(series: &[Series]) -> Vec<Block> {
    vec![
        Block::Heading(3, "Equal time".into()),
        Block::Text(
            "The error after the same GPU time, between renders by a power law; in parentheses how many \
             times smaller it is than that of the first series."
                .into(),
        ),
        Block::Table(compared(series, equal_time, "after", time, number)),
        Block::Heading(3, "Equal error".into()),
        Block::Text(
            "The GPU time until the same error; in parentheses how many times faster than the first series."
                .into(),
        ),
        Block::Table(compared(series, equal_error, "of", number, time)),
    ]
}

fn slopes(series: &[Series]) -> Table {
    let mut table = Table::new([
        "series",
        "compile time",
        "slope of RMSE",
        "slope of relMSE",
        "slope of FLIP",
        "1/(MSE t)",
        "1/(relMSE t)",
    ]);
    for series in series {
        let fit = |metric| series.fits.get(&metric);
        let mut row = vec![label(series), time(series.compile_seconds)];
        row.extend(Metric::ALL.map(|m| or_dash(fit(m), slope)));
        let efficiency = |fit: &Fit| or_dash(fit.efficiency, number);
        row.extend([Metric::Rmse, Metric::Relmse].map(|m| or_dash(fit(m), efficiency)));
        table.rows.push(row);
    }
    table
}

/// `-0.500 ± 0.002`
fn slope(fit: &Fit) -> String {
    let error = fit
        .slope_error
        .map(|e| format!(" ± {e:.3}"))
        .unwrap_or_default();
    let flat = fit
        .flat_from
        .map(|n| format!(", flat from {n}"))
        .unwrap_or_default();
    or_dash(fit.slope, |slope| format!("{slope:.3}{error}{flat}"))
}

/// A row each series, a column each measure with what is equal in its head.
fn compared(
    series: &[Series],
    compare: impl Fn(&[Series], Metric) -> Option<Comparison>,
    word: &str,
    equal: impl Fn(f64) -> String,
    other: impl Fn(f64) -> String,
) -> Table {
    let columns = Metric::ALL.map(|metric| (metric, compare(series, metric)));
    let head = columns.iter().map(|(metric, comparison)| match comparison {
        Some(comparison) => format!("{} {word} {}", metric.name(), equal(comparison.at)),
        None => metric.name().to_owned(),
    });
    let mut table = Table::new(["series".to_owned()].into_iter().chain(head));
    let shown = |reading: &Reading| {
        let bound = if reading.at_most { "≤ " } else { "" };
        format!(
            "{bound}{} ({})",
            other(reading.value),
            number(reading.ratio)
        )
    };
    for (index, series) in series.iter().enumerate() {
        let reading = |(_, comparison): &(Metric, Option<Comparison>)| {
            let values = comparison.as_ref().map(|c| &c.values);
            or_dash(values.and_then(|v| v.get(index)?.as_ref()), shown)
        };
        let readings = columns.iter().map(reading);
        table
            .rows
            .push([label(series)].into_iter().chain(readings).collect());
    }
    table
}

fn renders(series: &[Series]) -> Table {
    let mut table = Table::new([
        "series", "samples", "seeds", "GPU time", "RMSE", "relMSE", "FLIP", "left out",
    ]);
    for series in series {
        let of = |metric| means(&series.points, metric);
        let (rmse, relmse, flip) = (of(Metric::Rmse), of(Metric::Relmse), of(Metric::Flip));
        for ((rmse, relmse), flip) in rmse.iter().zip(&relmse).zip(&flip) {
            let points = series.points.iter().filter(|p| p.samples == rmse.samples);
            let runs: Vec<_> = points.flat_map(|p| &p.runs).collect();
            table.rows.push(vec![
                label(series),
                rmse.samples.to_string(),
                runs.len().to_string(),
                time(rmse.seconds),
                number(rmse.error),
                number(relmse.error),
                number(flip.error),
                runs.iter().map(|r| r.dropped).sum::<u64>().to_string(),
            ]);
        }
    }
    table
}

fn materials(scene: &SceneConvergence, drawn: &[Drawn]) -> Vec<Block> {
    let mut table = Table::new(["material", "pixels", "of MSE", "of relMSE", "of GPU time"]);
    for material in &scene.materials {
        let shares = [
            material.pixels,
            material.mse,
            material.relmse,
            material.seconds,
        ];
        let row = [material_name(material)]
            .into_iter()
            .chain(shares.map(percent));
        table.rows.push(row.collect());
    }
    vec![
        Block::Heading(3, "Materials".into()),
        Block::Text(
            "Pixels by the material that is seen first in them: their share of the picture, of the error of \
             the first series with the most samples, and of the GPU time when only they are rendered."
                .into(),
        ),
        Block::Figures(figures(drawn, |d| d.of == plot::Of::Materials)),
        Block::Table(table),
    ]
}

/// What a row of materials is called.
pub(super) fn material_name(material: &MaterialShare) -> String {
    material
        .name
        .clone()
        .unwrap_or_else(|| "(light or background)".into())
}

fn gallery(pictures: &ScenePictures) -> Vec<Block> {
    let mut figures = vec![Figure {
        file: pictures.reference.clone(),
        caption: "reference".into(),
    }];
    figures.retain(|f| !f.file.is_empty());
    for render in &pictures.renders {
        let (sampler, samples) = (render.sampler.name(), render.samples);
        let name = format!("{}, {sampler}, {samples} samples", render.strategy);
        figures.push(Figure {
            file: render.picture.clone(),
            caption: name.clone(),
        });
        figures.push(Figure {
            file: render.error.clone(),
            caption: format!("relative squared error of {name}"),
        });
    }
    let [low, high] = ERROR_DECADES.map(|decade| number(10f64.powf(decade)));
    vec![
        Block::Heading(3, "Pictures".into()),
        Block::Text(format!(
            "Errors are (x - r)^2 / (r^2 + 0.01) of each pixel, from {low} or less (black) by the logarithm \
             to {high} or more (white)."
        )),
        Block::Figures(figures),
    ]
}
