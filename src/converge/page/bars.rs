//! Bars of who makes the noise: for each material its shares of pixels, error and time.

use plotters::element::Rectangle;
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

use super::content::material_name;
use super::numbers::{percent, shortened};
use crate::converge::data::{MaterialShare, SceneConvergence};
use crate::plot::{Area, COLORS, FAINT, GRID, INK, failed, picture, text, write};

/// The most materials that are drawn; the others are one.
const MOST: usize = 16;
/// Pixels of a bar, and of a material.
const BAR: i32 = 11;
const ROW: i32 = 4 * BAR + 14;
/// Pixels of the names, of a full bar, and of the number behind it.
const NAMES: i32 = 200;
const FULL: i32 = 480;
const NUMBER: i32 = 70;
/// Pixels above the bars.
const TOP: i32 = 66;

/// The shares, as they are called.
const SHARES: [&str; 4] = ["pixels", "MSE", "relMSE", "GPU time"];

/// The picture of a scene that has materials.
pub(super) fn bars(scene: &SceneConvergence) -> Result<String, String> {
    let rows = rows(&scene.materials);
    let height = TOP + ROW * rows.len() as i32 + 8;
    let width = NAMES + FULL + NUMBER;
    let title = shortened(
        &format!("{}: shares by the material seen first", scene.name),
        72,
    );
    picture((width as u32, height as u32), &title, |root| {
        legend(root)?;
        let shares = rows.iter().flat_map(|r| r.1);
        let largest = shares.filter(|s| s.is_finite()).fold(0.0, f64::max);
        for (index, (name, shares)) in rows.iter().enumerate() {
            let top = TOP + ROW * index as i32;
            row(root, top, name, shares, largest)?;
        }
        Ok(())
    })
}

/// A name, and its shares.
type Row = (String, [f64; 4]);

fn rows(materials: &[MaterialShare]) -> Vec<Row> {
    let shares = |m: &MaterialShare| [m.pixels, m.mse, m.relmse, m.seconds];
    let shown = if materials.len() > MOST {
        MOST - 1
    } else {
        MOST
    };
    let named = materials.iter().take(shown);
    let mut rows: Vec<Row> = named
        .map(|m| (shortened(&material_name(m), 28), shares(m)))
        .collect();
    if materials.len() > shown {
        let rest = materials[shown..].iter().map(shares);
        let sum = rest.fold([0.0; 4], |sum, s| [0, 1, 2, 3].map(|i| sum[i] + s[i]));
        rows.push((format!("{} more", materials.len() - shown), sum));
    }
    rows
}

fn legend(root: &Area<'_>) -> Result<(), String> {
    for (index, (name, color)) in SHARES.iter().zip(COLORS).enumerate() {
        let x = NAMES + 110 * index as i32;
        let mark = Rectangle::new([(x, 40), (x + 12, 52)], color.filled());
        root.draw(&mark).map_err(failed)?;
        write(root, name, (x + 18, 46), &text(12.0, INK, HPos::Left))?;
    }
    Ok(())
}

fn row(
    root: &Area<'_>,
    top: i32,
    name: &str,
    shares: &[f64; 4],
    largest: f64,
) -> Result<(), String> {
    let middle = top + 2 * BAR;
    write(
        root,
        name,
        (NAMES - 10, middle),
        &text(12.0, INK, HPos::Right),
    )?;
    let below = top + ROW - 7;
    let rule = Rectangle::new(
        [(14, below), (NAMES + FULL + NUMBER - 14, below + 1)],
        GRID.filled(),
    );
    root.draw(&rule).map_err(failed)?;
    for (index, (share, color)) in shares.iter().zip(COLORS).enumerate() {
        let y = top + BAR * index as i32;
        let part = (share / largest).clamp(0.0, 1.0);
        // A share that is no number, or all of nothing, has no bar.
        let length = if part.is_finite() {
            (part * f64::from(FULL)) as i32
        } else {
            0
        };
        let bar = Rectangle::new(
            [(NAMES, y), (NAMES + length.max(1), y + BAR - 2)],
            color.filled(),
        );
        root.draw(&bar).map_err(failed)?;
        let place = (NAMES + length + 6, y + BAR / 2);
        write(
            root,
            &percent(*share),
            place,
            &text(10.0, FAINT, HPos::Left),
        )?;
    }
    Ok(())
}
