//! What plots have in common: colors, a picture to draw on, texts, and round values for logarithmic axes.
//!
//! Pictures bring their own white ground, so that they read the same on light and dark pages.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Text and axes.
pub const INK: RGBColor = RGBColor(0x1f, 0x23, 0x28);
/// Text that is less important.
pub const FAINT: RGBColor = RGBColor(0x6b, 0x72, 0x80);
/// Lines of the grid.
pub const GRID: RGBColor = RGBColor(0xe5, 0xe7, 0xeb);

/// Colors that people with any color vision tell apart. Source: Okabe and Ito 2008, "Color Universal
/// Design".
pub const COLORS: [RGBColor; 7] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x11, 0x11, 0x11),
];

/// A drawing area in a text.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A style of text of a size in pixels.
pub fn text(size: f64, color: RGBColor, anchor: HPos) -> TextStyle<'static> {
    // The library draws letters smaller by this factor than it is asked for.
    let style = ("sans-serif", size * 1.24).into_font().color(&color);
    style.pos(Pos::new(anchor, VPos::Center))
}

/// An SVG of some size, by what `draw` draws on white.
pub fn picture(
    (width, height): (u32, u32),
    title: &str,
    draw: impl FnOnce(&Area<'_>) -> Result<(), String>,
) -> Result<String, String> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        write(&root, title, (14, 18), &text(15.0, INK, HPos::Left))?;
        draw(&root)?;
        root.present().map_err(failed)?;
    }
    Ok(svg)
}

/// Writes a text at some pixel.
pub fn write(
    area: &Area<'_>,
    what: &str,
    at: (i32, i32),
    style: &TextStyle<'_>,
) -> Result<(), String> {
    area.draw_text(&printable(what), style, at).map_err(failed)
}

/// Why there is no picture, in a sentence.
pub fn failed(error: impl std::fmt::Display) -> String {
    format!("cannot draw a plot: {error}")
}

/// Round values in a range, about as many as there is room for.
pub fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let decades = (high / low).log10();
    let steps: &[f64] = match decades {
        wide if wide > 2.6 => &[1.0],
        wide if wide > 1.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
    };
    let every = (decades / 10.0).ceil().max(1.0) as i32;
    let range = (low.log10().floor() as i32)..=(high.log10().ceil() as i32);
    let range = range.filter(|decade| decade.rem_euclid(every) == 0);
    let all = range.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
    all.filter(|v| (low..=high).contains(v)).collect()
}

/// A text without the characters that neither XML nor a terminal bears.
pub fn printable(text: &str) -> String {
    let shown = |c: char| match c {
        c if c.is_control() => ' ',
        '\u{fffe}' | '\u{ffff}' => ' ',
        c => c,
    };
    text.chars().map(shown).collect()
}
