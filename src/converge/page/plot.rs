//! Plots of errors against time and samples, both axes logarithmic.
//!
//! Legends stand beside the plot, never over data. Only what has a logarithm is drawn; ranges are never
//! empty, which the plotting library could not bear.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::numbers::{label, number, shortened, time};
use crate::converge::data::{Metric, SceneConvergence, Series};
use crate::converge::fit::means;
use crate::plot::{Area, COLORS, FAINT, GRID, INK, failed, picture, text, ticks, write};

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    /// An error against GPU seconds.
    Seconds(Metric),
    /// An error against samples a pixel.
    Samples(Metric),
    /// Who makes the noise.
    Materials,
}

/// Height of a picture, and the width of its plot without the legend, in pixels.
const HEIGHT: u32 = 440;
const PLOT: u32 = 560;
/// Height of the title.
const TITLE: u32 = 34;
/// The most characters of a label in a legend.
const LABEL: usize = 40;

/// What is drawn of a series.
struct Curve {
    label: String,
    color: RGBColor,
    /// Every render.
    runs: Vec<(f64, f64)>,
    /// Means by number of samples.
    means: Vec<(f64, f64)>,
}

impl Curve {
    fn of(series: &Series, color: RGBColor, metric: Metric, against_time: bool) -> Self {
        let x = |seconds: f64, samples: u32| {
            if against_time {
                seconds
            } else {
                f64::from(samples)
            }
        };
        let mut all = Vec::new();
        for point in &series.points {
            let run = |r: &crate::converge::data::Run| {
                (x(r.gpu_seconds, point.samples), metric.of(&r.errors))
            };
            all.extend(point.runs.iter().map(run));
        }
        let means = means(&series.points, metric).into_iter();
        Self {
            label: shortened(&label(series), LABEL),
            color,
            runs: drawable(all),
            means: drawable(means.map(|m| (x(m.seconds, m.samples), m.error)).collect()),
        }
    }
}

/// The points that have logarithms, and which floats tell apart.
fn drawable(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let good = |v: f64| v.is_finite() && (1e-30..=1e30).contains(&v);
    points.retain(|(x, y)| good(*x) && good(*y));
    points
}

/// The plot of an error against time or samples.
pub(super) fn curves(
    scene: &SceneConvergence,
    metric: Metric,
    against_time: bool,
) -> Result<String, String> {
    let colors = COLORS.into_iter().cycle();
    let curves = scene.series.iter().zip(colors);
    let curves: Vec<Curve> = curves
        .map(|(s, c)| Curve::of(s, c, metric, against_time))
        .collect();
    let own = scene.reference.error.as_ref().map(|e| metric.of(e));
    let plot = Plot {
        x_name: if against_time {
            "GPU seconds"
        } else {
            "samples a pixel"
        },
        against_time,
        metric,
        reference: own.filter(|e| !drawable(vec![(1.0, *e)]).is_empty()),
        curves,
    };
    let title = shortened(
        &format!("{}: {} against {}", scene.name, metric.name(), plot.x_name),
        72,
    );
    picture((PLOT + plot.legend_width(), HEIGHT), &title, |root| {
        plot.draw(root)
    })
}

struct Plot {
    x_name: &'static str,
    against_time: bool,
    metric: Metric,
    /// The reference's own error.
    reference: Option<f64>,
    curves: Vec<Curve>,
}

impl Plot {
    fn draw(&self, root: &Area<'_>) -> Result<(), String> {
        let (_, below) = root.split_vertically(TITLE);
        let (left, right) = below.split_horizontally(PLOT);
        match self.ranges() {
            Some((x, y)) => self.draw_curves(&left, x, y)?,
            None => {
                let middle = (PLOT as i32 / 2, HEIGHT as i32 / 3);
                let style = text(14.0, FAINT, HPos::Center);
                write(
                    &left,
                    "nothing to draw: no error above zero",
                    middle,
                    &style,
                )?;
            }
        }
        self.draw_legend(&right)
    }

    /// Lowest and highest values with some room around them.
    fn ranges(&self) -> Option<([f64; 2], [f64; 2])> {
        let points = self
            .curves
            .iter()
            .flat_map(|c| c.runs.iter().chain(&c.means));
        let (xs, mut ys): (Vec<f64>, Vec<f64>) = points.copied().unzip();
        if ys.is_empty() {
            return None;
        }
        ys.extend(self.reference);
        Some((range(&xs), range(&ys)))
    }

    fn draw_curves(&self, area: &Area<'_>, x: [f64; 2], y: [f64; 2]) -> Result<(), String> {
        let mut chart = ChartBuilder::on(area)
            .margin_left(10)
            .margin_right(16)
            .margin_top(4)
            .margin_bottom(8)
            .x_label_area_size(46)
            .y_label_area_size(74)
            .build_cartesian_2d(
                (x[0]..x[1]).log_scale().with_key_points(self.x_ticks(x)),
                (y[0]..y[1]).log_scale().with_key_points(ticks(y)),
            )
            .map_err(failed)?;
        let x_label = |v: &f64| {
            if self.against_time {
                time(*v).replace(".00 ", " ").replace(".0 ", " ")
            } else {
                format!("{v:.0}")
            }
        };
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(FAINT)
            .label_style(("sans-serif", 12.0 * 1.24).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 13.0 * 1.24).into_font().color(&INK))
            .x_desc(self.x_name)
            .y_desc(self.metric.name())
            .x_label_formatter(&x_label)
            .y_label_formatter(&|v| tick(*v))
            .draw()
            .map_err(failed)?;
        let dashed = |from, to, color: RGBColor, on: i32, off: i32| {
            DashedLineSeries::new([from, to], on, off, color.stroke_width(1))
        };
        if let Some((from, to)) = self.guide(x, y) {
            chart
                .draw_series(dashed(from, to, FAINT, 2, 4))
                .map_err(failed)?;
        }
        if let Some(error) = self.reference {
            let (from, to) = ((x[0], error), (x[1], error));
            chart
                .draw_series(dashed(from, to, INK, 7, 4))
                .map_err(failed)?;
        }
        for curve in &self.curves {
            let faint = curve.color.mix(0.35).filled();
            let runs = curve.runs.iter().map(|p| Circle::new(*p, 3, faint));
            chart.draw_series(runs).map_err(failed)?;
            let line = PathElement::new(curve.means.clone(), curve.color.stroke_width(2));
            chart.draw_series([line]).map_err(failed)?;
            let means = curve
                .means
                .iter()
                .map(|p| Circle::new(*p, 4, curve.color.filled()));
            chart.draw_series(means).map_err(failed)?;
        }
        Ok(())
    }

    /// Round times, or the numbers of samples that were rendered.
    fn x_ticks(&self, range: [f64; 2]) -> Vec<f64> {
        let points = self.curves.iter().flat_map(|c| &c.means);
        let mut samples: Vec<f64> = points.map(|p| p.0).collect();
        samples.sort_by(f64::total_cmp);
        samples.dedup();
        if self.against_time || samples.len() > 10 {
            ticks(range)
        } else {
            samples
        }
    }

    /// A line with the slope of independent samples, below the first curve's first point and on.
    fn guide(&self, x: [f64; 2], y: [f64; 2]) -> Option<((f64, f64), (f64, f64))> {
        let slope = self.metric.independent_slope()?;
        let first = self.curves.iter().find_map(|c| c.means.first())?;
        let start = (first.0, (0.5 * first.1).max(y[0]));
        let along = |to: f64| start.1 * (to / start.0).powf(slope);
        let lowest = start.0 * (y[0] / start.1).powf(1.0 / slope);
        let end = x[1].min(lowest);
        (end > start.0).then(|| (start, (end, along(end).max(y[0]))))
    }

    fn legend(&self) -> Vec<(String, RGBColor, Stroke)> {
        let curves = self.curves.iter();
        let mut rows: Vec<_> = curves
            .map(|c| (c.label.clone(), c.color, Stroke::Solid))
            .collect();
        if self.reference.is_some() {
            rows.push((
                "the reference's own error".into(),
                INK,
                Stroke::Dashed(7, 4),
            ));
        }
        if let Some(slope) = self.metric.independent_slope() {
            rows.push((format!("slope {slope}"), FAINT, Stroke::Dashed(2, 4)));
        }
        rows
    }

    fn legend_width(&self) -> u32 {
        let longest = self.legend().iter().map(|row| row.0.chars().count()).max();
        50 + 7 * longest.unwrap_or(0) as u32
    }

    fn draw_legend(&self, area: &Area<'_>) -> Result<(), String> {
        for (row, (label, color, stroke)) in self.legend().into_iter().enumerate() {
            let y = 14 + 22 * row as i32;
            let (from, to) = ((4, y), (30, y));
            match stroke {
                Stroke::Solid => {
                    let line = PathElement::new([from, to], color.stroke_width(2));
                    area.draw(&line).map_err(failed)?;
                    area.draw(&Circle::new((17, y), 4, color.filled()))
                        .map_err(failed)?;
                }
                Stroke::Dashed(on, off) => {
                    let points = [from, to].into_iter();
                    let line = DashedPathElement::new(points, on, off, color.stroke_width(1));
                    area.draw(&line).map_err(failed)?;
                }
            }
            write(area, &label, (38, y), &text(12.0, INK, HPos::Left))?;
        }
        Ok(())
    }
}

/// How a row of a legend is drawn.
enum Stroke {
    Solid,
    /// Pixels of dashes and gaps.
    Dashed(i32, i32),
}

/// From the smallest to the largest of some values, with a quarter of a factor of two around.
fn range(values: &[f64]) -> [f64; 2] {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(0.0, f64::max);
    [low / 1.3, high * 1.3]
}

/// A round value without needless zeros.
fn tick(value: f64) -> String {
    let text = number(value);
    match text.split_once('e') {
        Some((digits, exponent)) => {
            let digits = digits.trim_end_matches('0').trim_end_matches('.');
            format!("{digits}e{exponent}")
        }
        None if text.contains('.') => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests;
