//! Small plots of some lines, both axes logarithmic.

use impasto::plot::{COLORS, FAINT, GRID, INK, failed, picture, text, ticks, write};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use xtask::shell::Result;

/// Pixels of a picture.
const SIZE: (u32, u32) = (560, 360);

/// A name and points.
pub(super) type Line = (String, Vec<(f64, f64)>);

/// A picture of lines, with what its axes are of.
pub(super) fn lines(title: &str, (x, y): (&str, &str), lines: &[Line]) -> Result<String> {
    picture(SIZE, title, |root| {
        let points = || lines.iter().flat_map(|(_, points)| points);
        let range = |of: fn(&(f64, f64)) -> f64| {
            let [low, high] = points().map(of).fold([f64::MAX, 0.0], |[low, high], v| {
                [low.min(v), f64::max(high, v)]
            });
            [low / 1.2, high * 1.1]
        };
        let (of_x, of_y) = (range(|p| p.0), range(|p| p.1));
        let axis = |r: [f64; 2]| (r[0]..r[1]).log_scale().with_key_points(ticks(r));
        let (_, area) = root.split_vertically(54);
        let mut chart = ChartBuilder::on(&area)
            .margin_left(12)
            .margin_right(20)
            .margin_bottom(6)
            .x_label_area_size(42)
            .y_label_area_size(60)
            .build_cartesian_2d(axis(of_x), axis(of_y))
            .map_err(failed)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(FAINT)
            .label_style(text(11.0, INK, HPos::Center))
            .axis_desc_style(text(12.0, INK, HPos::Center))
            .x_desc(x)
            .y_desc(y)
            .x_label_formatter(&|v| format!("{v}"))
            .y_label_formatter(&|v| format!("{v}"))
            .draw()
            .map_err(failed)?;
        let mut left = 62;
        for ((name, points), color) in lines.iter().zip(COLORS) {
            let line = LineSeries::new(points.iter().copied(), color.stroke_width(2));
            chart.draw_series(line).map_err(failed)?;
            let dots = points.iter().map(|p| Circle::new(*p, 3, color.filled()));
            chart.draw_series(dots).map_err(failed)?;
            let dot = Circle::new((left, 40), 4, color.filled());
            root.draw(&dot).map_err(failed)?;
            write(root, name, (left + 9, 40), &text(12.0, INK, HPos::Left))?;
            left += 34 + (6.6 * name.chars().count() as f64) as i32;
        }
        Ok(())
    })
}
