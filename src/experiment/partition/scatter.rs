//! Plots of predicted against measured times, both axes logarithmic and of the same range.

use std::collections::BTreeSet;

use super::Result;
use crate::plot::{Area, FAINT, GRID, INK, failed, picture, text, ticks, write};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::measured::Pair;

/// Points of one color.
pub struct Series {
    pub name: String,
    pub color: RGBColor,
    pub points: Vec<Pair>,
}

/// Pixels of the picture, and those above the plot, of title and legend.
const SIZE: (u32, u32) = (742, 764);
const HEAD: i32 = 60;
/// The dashed lines are so far off, as a factor.
const OFF: f64 = 1.15;

/// Predicted over measured seconds. Only what has a logarithm is drawn.
pub fn scatter(title: &str, series: &[Series]) -> Result<String> {
    picture(SIZE, title, |root| {
        legend(root, series)?;
        let (_, plot) = root.split_vertically(HEAD);
        draw(&plot, series, range(series))
    })
}

/// A point with its series' color, and how many points that has.
fn legend(root: &Area<'_>, series: &[Series]) -> Result {
    let mut x = 84;
    for series in series {
        let name = format!("{} ({})", series.name, series.points.len());
        let dot = Circle::new((x, 44), 4, series.color.filled());
        root.draw(&dot).map_err(failed)?;
        write(root, &name, (x + 10, 44), &text(12.0, INK, HPos::Left))?;
        x += 32 + (6.6 * name.chars().count() as f64) as i32;
    }
    let note = text(11.0, FAINT, HPos::Right);
    write(root, "dashed: 15 % off", (SIZE.0 as i32 - 24, 44), &note)
}

/// Lowest and highest times with some room around them.
fn range(series: &[Series]) -> [f64; 2] {
    let values = series.iter().flat_map(|s| &s.points);
    let values = values.flat_map(|p| [p.predicted, p.measured]);
    let positive: Vec<f64> = values.filter(|v| *v > 0.0).collect();
    let low = positive.iter().copied().min_by(f64::total_cmp);
    let high = positive.iter().copied().max_by(f64::total_cmp);
    low.zip(high)
        .map_or([1e-6, 1e-3], |(low, high)| [low / 1.25, high * 1.25])
}

fn draw(area: &Area<'_>, series: &[Series], [low, high]: [f64; 2]) -> Result {
    let axis = || (low..high).log_scale().with_key_points(ticks([low, high]));
    let mut chart = ChartBuilder::on(area)
        .margin_left(10)
        .margin_right(24)
        .margin_top(4)
        .margin_bottom(8)
        .x_label_area_size(46)
        .y_label_area_size(68)
        .build_cartesian_2d(axis(), axis())
        .map_err(failed)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(FAINT)
        .label_style(text(11.0, INK, HPos::Center))
        .axis_desc_style(text(12.0, INK, HPos::Center))
        .x_desc("measured")
        .y_desc("predicted")
        .x_label_formatter(&|v| time(*v))
        .y_label_formatter(&|v| time(*v))
        .draw()
        .map_err(failed)?;
    for series in series {
        let drawable = series.points.iter().copied();
        let drawable = drawable.filter(|p| p.predicted > 0.0 && p.measured > 0.0);
        // Of points on the same pixel one is drawn, so that files stay small.
        let mut taken = BTreeSet::new();
        let points: Vec<(f64, f64)> = drawable
            .map(|p| (p.measured, p.predicted))
            .filter(|p| taken.insert(chart.backend_coord(p)))
            .collect();
        let style = series.color.mix(0.55).filled();
        let dots = points.into_iter().map(|p| Circle::new(p, 2, style));
        chart.draw_series(dots).map_err(failed)?;
    }
    let diagonal = PathElement::new([(low, low), (high, high)], INK);
    chart.draw_series([diagonal]).map_err(failed)?;
    let above = [(low, low * OFF), (high / OFF, high)];
    for line in [above, above.map(|(x, y)| (y, x))] {
        let dashed = DashedLineSeries::new(line, 5, 4, FAINT.stroke_width(1));
        chart.draw_series(dashed).map_err(failed)?;
    }
    Ok(())
}

/// A time in the unit that suits it.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s >= 0.9995 => (s, "s"),
        s if s >= 0.9995e-3 => (s * 1e3, "ms"),
        s => (s * 1e6, "µs"),
    };
    let digits = format!("{value:.3}");
    format!(
        "{} {unit}",
        digits.trim_end_matches('0').trim_end_matches('.')
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::COLORS;

    #[test]
    fn times_have_units() {
        assert_eq!(time(1e-6), "1 µs");
        assert_eq!(time(2.5e-3), "2.5 ms");
        assert_eq!(time(1e-3), "1 ms");
        assert_eq!(time(3.0), "3 s");
    }

    #[test]
    fn what_was_predicted_too_long_is_above_the_diagonal() {
        let pair = |predicted, measured| Pair {
            predicted,
            measured,
        };
        let series = [Series {
            name: "one".into(),
            color: COLORS[0],
            points: vec![pair(1e-3, 1e-6), pair(1e-6, 1e-3), pair(1e-5, -1e-6)],
        }];
        let svg = scatter("title", &series).expect("drawn");
        let circles = svg.split("<circle").skip(1);
        let dots: Vec<[i32; 2]> = circles
            .filter(|c| c.contains("r=\"2\""))
            .map(|c| {
                ["cx=\"", "cy=\""].map(|key| {
                    let value = c.split(key).nth(1).and_then(|v| v.split('"').next());
                    value.and_then(|v| v.parse().ok()).expect("a number")
                })
            })
            .collect();
        assert_eq!(dots.len(), 2, "less than no time is on no logarithmic axis");
        let [above, below] = [dots[0], dots[1]];
        assert!(above[0] < below[0] && above[1] < below[1], "{dots:?}");
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        assert!(scatter("title", &[]).is_ok_and(|svg| !svg.contains("<circle")));
    }
}
