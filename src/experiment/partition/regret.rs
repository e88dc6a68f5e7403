//! The picture of regret: a row a scene and a panel a pool, with a mark for each strategy.

use super::Result;
use crate::plot::{self, Area, COLORS, FAINT, GRID, INK, failed, text, ticks, write};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::measured::{BASELINES, Measured};
use super::plots::{paths, pools};

/// Pixels of a row, of a panel without and with what is beside it, and of the names of scenes.
const ROW: u32 = 22;
const PANEL: u32 = 400;
const PITCH: u32 = PANEL + 28;
const NAMES: u32 = 108;
/// Pixels above the panels, and of axes below the rows.
const HEAD: u32 = 70;
const AXIS: u32 = 48;
/// Pixels of a panel's name.
const TITLE: u32 = 22;

/// How many times the best plan's time each strategy takes.
pub fn picture(scenes: &[Measured]) -> Result<String> {
    let pools = pools(scenes);
    let mut names: Vec<&str> = Vec::new();
    for scene in scenes {
        if !names.contains(&scene.scene.name.as_str()) {
            names.push(&scene.scene.name);
        }
    }
    // Whole renders by mega may be faster than the best plan with iterations.
    let regrets = scenes.iter().flat_map(marks).map(|(_, regret)| regret);
    let (low, high) = regrets.fold((1.0, 1.2), |(low, high): (f64, f64), regret| {
        (low.min(regret), high.max(regret))
    });
    let range = [0.96 * low, 1.08 * high];
    let rows = ROW * names.len() as u32;
    let width = (NAMES + pools.len() as u32 * PITCH).max(NAMES + 8 * PANEL / 5);
    let size = (width, HEAD + TITLE + rows + AXIS);
    let title = "Time of an iteration over that of the best plan";
    plot::picture(size, title, |root| {
        legend(root, scenes)?;
        for (number, pool) in pools.iter().enumerate() {
            let left = NAMES + number as u32 * PITCH;
            let area = root
                .clone()
                .shrink((left, HEAD), (PANEL, TITLE + rows + AXIS));
            let rows: Vec<(&str, Option<&Measured>)> = names
                .iter()
                .map(|name| {
                    let of = |s: &&Measured| s.scene.name == *name && s.scene.pool == *pool;
                    (*name, scenes.iter().find(of))
                })
                .collect();
            let panel = Panel {
                title: format!("pool of {}", paths(*pool)),
                named: number == 0,
                range,
                rows,
            };
            panel.draw(root, &area)?;
        }
        Ok(())
    })
}

/// The regret of mega, which only whole renders tell: theirs relative to the chosen plan's.
pub fn mega_regret(scene: &Measured) -> Option<f64> {
    Some(scene.regret() * scene.render_ratio("mega")?)
}

/// The regret of each strategy.
fn marks(scene: &Measured) -> Vec<(&'static str, f64)> {
    let mut out: Vec<(&'static str, f64)> = BASELINES
        .iter()
        .filter_map(|name| Some((*name, scene.regret_of(name)?)))
        .collect();
    out.extend(mega_regret(scene).map(|regret| ("mega", regret)));
    // Last, so that it lies above the others.
    out.push(("auto", scene.regret()));
    out
}

/// The marks of the strategies that are shown.
fn legend(root: &Area<'_>, scenes: &[Measured]) -> Result {
    let shown: Vec<&str> = scenes.iter().flat_map(marks).map(|mark| mark.0).collect();
    let all = ["auto"].into_iter().chain(BASELINES).chain(["mega"]);
    let mut x = 20;
    for strategy in all.filter(|strategy| shown.contains(strategy)) {
        mark(root, strategy, (x, 46))?;
        write(root, strategy, (x + 11, 46), &text(12.0, INK, HPos::Left))?;
        x += 34 + (6.8 * strategy.len() as f64) as i32;
    }
    Ok(())
}

/// The scenes with one pool.
struct Panel<'a> {
    title: String,
    /// Do names of scenes stand beside it?
    named: bool,
    range: [f64; 2],
    /// Scenes by name, where they were measured with this pool.
    rows: Vec<(&'a str, Option<&'a Measured<'a>>)>,
}

impl Panel<'_> {
    fn draw(&self, root: &Area<'_>, area: &Area<'_>) -> Result {
        let middle = (PANEL as i32 / 2, TITLE as i32 / 2);
        write(area, &self.title, middle, &text(12.0, INK, HPos::Center))?;
        let [low, high] = self.range;
        let height = self.rows.len() as f64;
        let mut chart = ChartBuilder::on(area)
            .margin_top(TITLE)
            .x_label_area_size(AXIS)
            .build_cartesian_2d(
                (low..high).log_scale().with_key_points(ticks(self.range)),
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
            .x_desc("times the best; dashed: 1.05")
            .x_label_formatter(&|v| format!("{v}"))
            .draw()
            .map_err(failed)?;
        let line = |x: f64| [(x, 0.0), (x, height)];
        chart
            .draw_series([PathElement::new(line(1.0), INK)])
            .map_err(failed)?;
        chart
            .draw_series(DashedLineSeries::new(
                line(1.05),
                4,
                3,
                FAINT.stroke_width(1),
            ))
            .map_err(failed)?;
        for (row, (name, scene)) in self.rows.iter().enumerate() {
            let at = |regret: f64| chart.backend_coord(&(regret, row as f64 + 0.5));
            if self.named {
                let (_, y) = at(1.0);
                let style = text(12.0, INK, HPos::Right);
                write(root, name, (NAMES as i32 - 10, y), &style)?;
            }
            for (strategy, regret) in scene.map(marks).unwrap_or_default() {
                mark(root, strategy, at(regret))?;
            }
        }
        Ok(())
    }
}

/// Draws what stands for a strategy.
fn mark(root: &Area<'_>, strategy: &str, (x, y): (i32, i32)) -> Result {
    let [blue, vermilion, green, purple, orange, sky, black] = COLORS;
    let path = |points: &[(i32, i32)], color: RGBColor| {
        let points = points.iter().map(|(dx, dy)| (x + dx, y + dy));
        let path = PathElement::new(points.collect::<Vec<_>>(), color.stroke_width(2));
        root.draw(&path).map_err(failed)
    };
    let cross = |color| {
        path(&[(-4, -4), (4, 4)], color)?;
        path(&[(-4, 4), (4, -4)], color)
    };
    match strategy {
        "auto" => {
            let disc = Circle::new((x, y), 5, black.filled());
            root.draw(&disc).map_err(failed)
        }
        "own" => {
            let ring = Circle::new((x, y), 4, blue.stroke_width(2));
            root.draw(&ring).map_err(failed)
        }
        "mixed" => path(&[(-4, -4), (4, -4), (4, 4), (-4, 4), (-4, -4)], vermilion),
        "binned" => path(&[(0, -5), (5, 0), (0, 5), (-5, 0), (0, -5)], green),
        "inline" => path(&[(0, -5), (5, 4), (-5, 4), (0, -5)], purple),
        "paper" => {
            path(&[(-5, 0), (5, 0)], orange)?;
            path(&[(0, -5), (0, 5)], orange)
        }
        "mega" => cross(FAINT),
        _ => cross(sky),
    }
}
