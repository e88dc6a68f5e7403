//! The curve of the error against time, on logarithmic axes: a path tracer without surprises draws a line that falls by ten
//! for ten times the time.

use eframe::egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::super::desk::Desk;
use super::super::picture::number;
use super::super::theme;
use super::quiet;
use crate::engine::ErrorPoint;

/// Draws it.
pub fn show(ui: &mut Ui, desk: &Desk) {
    let points: Vec<ErrorPoint> = desk.news.errors.iter().copied().filter(is_drawn).collect();
    let Some(axes) = Axes::around(&points, goal(desk)) else {
        ui.label(quiet("No error is known yet."));
        return;
    };
    let width = (ui.available_width() - 4.0).max(40.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 0.58 * width), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, Color32::from_gray(0x1a));
    let inner = Rect::from_min_max(rect.min + vec2(34.0, 6.0), rect.max - vec2(14.0, 18.0));
    if !inner.is_positive() {
        return;
    }
    let font = FontId::proportional(10.0);
    let grid = Stroke::new(1.0, Color32::from_gray(0x2c));
    for power in axes.powers(0) {
        let x = axes.place(inner, 10f64.powi(power), 1.0).x;
        painter.line_segment([pos2(x, inner.top()), pos2(x, inner.bottom())], grid);
        let at = pos2(x, inner.bottom() + 3.0);
        painter.text(
            at,
            Align2::CENTER_TOP,
            seconds(power),
            font.clone(),
            theme::QUIET,
        );
    }
    for power in axes.powers(1) {
        let y = axes.place(inner, 1.0, 10f64.powi(power)).y;
        painter.line_segment([pos2(inner.left(), y), pos2(inner.right(), y)], grid);
        let at = pos2(inner.left() - 4.0, y);
        painter.text(
            at,
            Align2::RIGHT_CENTER,
            format!("1e{power}"),
            font.clone(),
            theme::QUIET,
        );
    }
    if let Some(goal) = goal(desk) {
        let y = axes.place(inner, 1.0, goal).y;
        let stroke = Stroke::new(1.0, theme::GOOD);
        painter.line_segment([pos2(inner.left(), y), pos2(inner.right(), y)], stroke);
    }
    let places: Vec<Pos2> = points
        .iter()
        .map(|p| axes.place(inner, p.seconds, p.relmse))
        .collect();
    for pair in places.windows(2) {
        painter.line_segment([pair[0], pair[1]], Stroke::new(1.5, theme::ACCENT));
    }
    for place in &places {
        painter.circle_filled(*place, 2.0, theme::ACCENT);
    }
    let near = response.hover_pos().and_then(|at| {
        let far = |i: &usize| (places[*i].x - at.x).abs();
        (0..places.len()).min_by(|a, b| far(a).total_cmp(&far(b)))
    });
    if let Some(i) = near {
        painter.circle_stroke(places[i], 4.0, Stroke::new(1.0, Color32::WHITE));
        let point = points[i];
        response.on_hover_text(format!(
            "relMSE {:.3e} after {} and {} samples",
            point.relmse,
            super::status::time(point.seconds),
            point.samples
        ));
    }
    if let Some(last) = points.last() {
        ui.label(quiet(format!(
            "relMSE {:.2e} after {} s",
            last.relmse,
            number(last.seconds as f32)
        )));
    }
}

fn is_drawn(point: &ErrorPoint) -> bool {
    let is_positive = |x: f64| x.is_finite() && x > 0.0;
    is_positive(point.seconds) && is_positive(point.relmse)
}

fn goal(desk: &Desk) -> Option<f64> {
    desk.goals.relmse()
}

fn seconds(power: i32) -> String {
    match power {
        ..=-4 => format!("1e{power} s"),
        -3..=-1 => format!("{} ms", 10f64.powi(power + 3)),
        _ => format!("{} s", 10f64.powi(power)),
    }
}

/// Logarithmic axes: seconds and errors, from one power of ten to another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axes {
    low: [f64; 2],
    high: [f64; 2],
}

impl Axes {
    fn around(points: &[ErrorPoint], goal: Option<f64>) -> Option<Self> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for point in points {
            for (axis, x) in [point.seconds, point.relmse].into_iter().enumerate() {
                low[axis] = low[axis].min(x.log10());
                high[axis] = high[axis].max(x.log10());
            }
        }
        if points.is_empty() {
            return None;
        }
        if let Some(goal) = goal {
            low[1] = low[1].min(goal.log10());
            high[1] = high[1].max(goal.log10());
        }
        for axis in 0..2 {
            low[axis] = (low[axis] - 0.1).floor();
            high[axis] = (high[axis] + 0.1).ceil().max(low[axis] + 1.0);
        }
        Some(Self { low, high })
    }

    fn place(&self, rect: Rect, seconds: f64, error: f64) -> Pos2 {
        let share = |axis: usize, x: f64| {
            ((x.log10() - self.low[axis]) / (self.high[axis] - self.low[axis])) as f32
        };
        pos2(
            rect.left() + share(0, seconds) * rect.width(),
            rect.bottom() - share(1, error) * rect.height(),
        )
    }

    /// Powers of ten along an axis, at most some of them.
    fn powers(&self, axis: usize) -> impl Iterator<Item = i32> {
        let (low, high) = (self.low[axis] as i32, self.high[axis] as i32);
        let step = ((high - low) / 5).max(1) as usize;
        (low..=high).step_by(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_all_points_between_powers_of_ten() {
        let point = |seconds, relmse| ErrorPoint {
            seconds,
            samples: 1,
            relmse,
        };
        assert_eq!(Axes::around(&[], None), None);
        let points = [point(0.03, 0.2), point(4.0, 0.002)];
        let axes = Axes::around(&points, Some(1e-4)).expect("there are points");
        assert_eq!(axes.low, [-2.0, -5.0]);
        assert_eq!(axes.high, [1.0, 0.0]);
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(300.0, 100.0));
        let place = axes.place(rect, 0.1, 1e-5);
        assert!((place - pos2(100.0, 100.0)).length() < 1e-3, "{place:?}");
        let one = Axes::around(&[point(1.0, 1.0)], None).expect("a point");
        assert!(one.high[0] > one.low[0] && one.high[1] > one.low[1]);
        assert!(!is_drawn(&point(0.0, 1.0)) && !is_drawn(&point(1.0, f64::NAN)));
        assert_eq!(
            [seconds(-3), seconds(0), seconds(2)],
            ["1 ms", "1 s", "100 s"]
        );
    }
}
