//! The picture of renders: a row a scene, a mark a variant, by paths a second.

use std::ops::RangeInclusive;

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::Made;
use crate::experiment::study::{Scene, Variant};
use crate::plot::{self, Area, COLORS, FAINT, GRID, INK, failed, text, ticks, write};

/// Pixels of a row, of the plot without names, and of the names of scenes.
const ROW: u32 = 22;
const PLOT: u32 = 560;
const NAMES: u32 = 150;
/// Pixels above the rows without the legend, of a line of the legend, and of the axis below.
const HEAD: u32 = 40;
const LINE: u32 = 18;
const AXIS: u32 = 48;
/// Columns of the legend.
const COLUMNS: usize = 3;

/// How many variants a picture is of: what is told apart, and more than nothing to compare.
pub const PLOTTED: RangeInclusive<usize> = 2..=2 * COLORS.len();

/// A picture; none if there is nothing to show, or more variants than can be told apart.
pub(super) fn picture(made: &Made<'_>, variants: &[Variant]) -> Result<Option<String>, String> {
    let scenes: Vec<&Scene> = made
        .scenes()
        .filter(|scene| made.is_measured(scene))
        .collect();
    let rate = |scene: &Scene, variant: &Variant| {
        let rate = made.rate(scene, &variant.label)? * 1e-6;
        (rate > 0.0).then_some(rate)
    };
    let all = scenes
        .iter()
        .flat_map(|scene| variants.iter().filter_map(|v| rate(scene, v)));
    let (low, high) = all.fold((f64::INFINITY, 0.0f64), |(low, high), rate| {
        (low.min(rate), high.max(rate))
    });
    if high <= 0.0 || !PLOTTED.contains(&variants.len()) {
        return Ok(None);
    }
    let range = [0.8 * low, 1.25 * high];
    let legend = LINE * variants.len().div_ceil(COLUMNS) as u32;
    let rows = ROW * scenes.len() as u32;
    let top = HEAD + legend;
    let size = (NAMES + PLOT + 24, top + rows + AXIS);
    let title = format!("{}: paths a second", made.part.name);
    let svg = plot::picture(size, &title, |root| {
        for (at, variant) in variants.iter().enumerate() {
            let (column, line) = (at % COLUMNS, at / COLUMNS);
            let x = 24 + (column as u32 * (size.0 - 24) / COLUMNS as u32) as i32;
            let y = (HEAD + LINE * line as u32) as i32;
            mark(root, at, (x, y))?;
            write(
                root,
                &variant.label,
                (x + 11, y),
                &text(12.0, INK, HPos::Left),
            )?;
        }
        let area = root.clone().shrink((NAMES, top), (PLOT, rows + AXIS));
        let height = scenes.len() as f64;
        let mut chart = ChartBuilder::on(&area)
            .x_label_area_size(AXIS)
            .build_cartesian_2d(
                (range[0]..range[1])
                    .log_scale()
                    .with_key_points(ticks(range)),
                height..0.0,
            )
            .map_err(failed)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .disable_y_axis()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(FAINT)
            .label_style(text(11.0, INK, HPos::Center))
            .axis_desc_style(text(11.0, FAINT, HPos::Center))
            .x_desc("Mpaths/s")
            .x_label_formatter(&|v| format!("{v}"))
            .draw()
            .map_err(failed)?;
        for (row, scene) in scenes.iter().enumerate() {
            let at = |rate: f64| chart.backend_coord(&(rate, row as f64 + 0.5));
            let (_, y) = at(range[0]);
            let name = (NAMES as i32 - 10, y);
            write(root, &scene.title, name, &text(12.0, INK, HPos::Right))?;
            for (number, variant) in variants.iter().enumerate() {
                if let Some(rate) = rate(scene, variant) {
                    mark(root, number, at(rate))?;
                }
            }
        }
        Ok(())
    });
    svg.map(Some)
}

/// What stands for a variant: a disc, or a ring once colors are used up.
fn mark(root: &Area<'_>, number: usize, at: (i32, i32)) -> Result<(), String> {
    let color = COLORS[number % COLORS.len()];
    let style = match number / COLORS.len() {
        0 => color.mix(0.8).filled(),
        _ => color.stroke_width(2),
    };
    root.draw(&Circle::new(at, 5, style)).map_err(failed)
}
