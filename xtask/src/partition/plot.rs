//! Drawing: SVG text, logarithmic axes, marks.
//!
//! Pictures bring their own white ground, so that they read the same on light and dark pages.

use std::fmt::Write as _;

/// Text, axes and grid.
const INK: &str = "#1f2328";
const FAINT: &str = "#6b7280";
const GRID: &str = "#e5e7eb";

/// Colors that people with any color vision tell apart. Source: Okabe and Ito 2008, "Color Universal
/// Design".
pub(super) const BLUE: &str = "#0072b2";
pub(super) const VERMILION: &str = "#d55e00";
pub(super) const GREEN: &str = "#009e73";
pub(super) const PURPLE: &str = "#cc79a7";
pub(super) const ORANGE: &str = "#e69f00";
pub(super) const SKY: &str = "#56b4e9";
pub(super) const BLACK: &str = "#111111";
pub(super) const GREY: &str = "#8a8f98";

/// A picture while it is drawn, in pixels from the upper left corner.
pub(super) struct Svg {
    size: (f64, f64),
    title: String,
    body: String,
}

/// Where a text is fastened.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Disc,
    Ring,
    Square,
    Diamond,
    Triangle,
    Plus,
    Cross,
}

impl Svg {
    pub(super) fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self {
            size: (width, height),
            title: escaped(title),
            body: String::new(),
        };
        svg.text(
            16.0,
            26.0,
            15.0,
            INK,
            Anchor::Start,
            &format!("<b>{}", escaped(title)),
        );
        svg
    }

    /// Writes `text`; it is bold if it begins with `<b>`, and must be escaped.
    fn text(&mut self, x: f64, y: f64, size: f64, color: &str, anchor: Anchor, text: &str) {
        let (weight, text) = match text.strip_prefix("<b>") {
            Some(text) => (" font-weight=\"600\"", text),
            None => ("", text),
        };
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" fill=\"{color}\"{anchor}{weight}>{text}</text>"
        );
    }

    /// Writes in the usual size.
    pub(super) fn label(&mut self, x: f64, y: f64, anchor: Anchor, text: &str) {
        self.text(x, y, 12.0, INK, anchor, &escaped(text));
    }

    /// Writes what is less important.
    pub(super) fn note(&mut self, x: f64, y: f64, anchor: Anchor, text: &str) {
        self.text(x, y, 11.0, FAINT, anchor, &escaped(text));
    }

    /// Writes upwards around (x, y).
    pub(super) fn upright(&mut self, x: f64, y: f64, text: &str) {
        let _ = writeln!(
            self.body,
            "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" font-size=\"12\" fill=\"{INK}\" \
             text-anchor=\"middle\">{}</text>",
            escaped(text)
        );
    }

    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), color: &str, dashes: &str) {
        let dashes = match dashes {
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        let _ = writeln!(
            self.body,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"{color}\"{dashes}/>",
            from.0, from.1, to.0, to.1
        );
    }

    /// Many points in one path, so that files stay small.
    pub(super) fn points(&mut self, color: &str, width: f64, points: &[(f64, f64)]) {
        if points.is_empty() {
            return;
        }
        let path = points.iter().fold(String::new(), |mut path, (x, y)| {
            let _ = write!(path, "M{x:.1} {y:.1}h0");
            path
        });
        let _ = writeln!(
            self.body,
            "<path d=\"{path}\" stroke=\"{color}\" stroke-width=\"{width}\" stroke-linecap=\"round\" \
             stroke-opacity=\"0.55\"/>"
        );
    }

    pub(super) fn mark(&mut self, mark: Mark, (x, y): (f64, f64), color: &str) {
        let path = |d: &str, fill: &str| {
            format!(
                "<path transform=\"translate({x:.1} {y:.1})\" d=\"{d}\" stroke=\"{color}\" stroke-width=\"1.6\" fill=\"{fill}\"/>\n"
            )
        };
        self.body += &match mark {
            Mark::Disc => {
                format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.6\" fill=\"{color}\"/>\n")
            }
            Mark::Ring => format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.8\" stroke=\"{color}\" stroke-width=\"1.6\"/>\n"
            ),
            Mark::Square => path("M-3.4-3.4h6.8v6.8h-6.8z", "none"),
            Mark::Diamond => path("M0-4.8L4.8 0L0 4.8L-4.8 0z", "none"),
            Mark::Triangle => path("M0-4.4L4.4 3.4h-8.8z", "none"),
            Mark::Plus => path("M-4.4 0h8.8M0-4.4v8.8", "none"),
            Mark::Cross => path("M-3.4-3.4l6.8 6.8M-3.4 3.4l6.8-6.8", "none"),
        };
    }

    /// The file.
    pub(super) fn finish(self) -> String {
        let (w, h) = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
             font-family=\"system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif\" fill=\"none\">\n\
             <title>{}</title>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.title, self.body
        )
    }
}

/// Text as XML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// An axis whose steps are factors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Log {
    /// Values at its ends.
    pub low: f64,
    pub high: f64,
    /// Pixels of its ends.
    pub from: f64,
    pub to: f64,
}

impl Log {
    /// Where a value is; outside values are at the ends.
    pub(super) fn at(&self, value: f64) -> f64 {
        let t = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + t.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// Round values within, about as many as there is room for.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let steps: &[f64] = match (self.high / self.low).log10() {
            wide if wide > 3.3 => &[1.0],
            wide if wide > 1.2 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0],
        };
        let decades = (self.low.log10().floor() as i32)..=(self.high.log10().ceil() as i32);
        let all = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
        let slack = 1.0 + 1e-9;
        all.filter(|v| *v >= self.low / slack && *v <= self.high * slack)
            .collect()
    }

    /// A line across at every tick, with its value: of a horizontal axis below `across.1`.
    pub(super) fn draw_below(
        &self,
        svg: &mut Svg,
        across: (f64, f64),
        shown: impl Fn(f64) -> String,
    ) {
        for tick in self.ticks() {
            let x = self.at(tick);
            svg.line((x, across.0), (x, across.1), GRID, "");
            svg.note(x, across.1 + 16.0, Anchor::Middle, &shown(tick));
        }
    }

    /// The same of a vertical axis, left of `across.0`.
    pub(super) fn draw_left(
        &self,
        svg: &mut Svg,
        across: (f64, f64),
        shown: impl Fn(f64) -> String,
    ) {
        for tick in self.ticks() {
            let y = self.at(tick);
            svg.line((across.0, y), (across.1, y), GRID, "");
            svg.note(across.0 - 7.0, y + 4.0, Anchor::End, &shown(tick));
        }
    }
}

/// A time in the unit that suits it.
pub(super) fn time(seconds: f64) -> String {
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

    #[test]
    fn equal_factors_are_equal_distances() {
        let axis = Log {
            low: 1.0,
            high: 100.0,
            from: 50.0,
            to: 250.0,
        };
        assert!((axis.at(10.0) - 150.0).abs() < 1e-9);
        assert_eq!((axis.at(0.1), axis.at(1e9)), (50.0, 250.0));
        assert_eq!(axis.ticks(), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
    }

    #[test]
    fn times_have_units() {
        assert_eq!(time(1e-6), "1 µs");
        assert_eq!(time(2.5e-3), "2.5 ms");
        assert_eq!(time(1e-3), "1 ms");
        assert_eq!(time(3.0), "3 s");
    }
}
