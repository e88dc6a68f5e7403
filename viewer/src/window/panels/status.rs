//! The line below everything: what the engine is at, how far, and what is under the hand.

use eframe::egui::{Align, Color32, Layout, RichText, Sense, Ui, vec2};

use super::super::canvas::Canvas;
use super::super::desk::Desk;
use super::super::picture;
use super::super::theme;
use crate::engine::State;

/// Draws it.
pub fn show(ui: &mut Ui, desk: &Desk, canvas: &Canvas) {
    ui.horizontal(|ui| {
        let (text, color) = state(desk);
        let (rect, _) = ui.allocate_exact_size(vec2(8.0, 8.0), Sense::hover());
        ui.painter().circle_filled(rect.center(), 4.0, color);
        let shown = ui.label(RichText::new(&text).color(theme::TEXT));
        if let State::Failed(why) = &desk.news.state {
            shown.on_hover_text(why);
        }
        if let Some(picture) = desk.picture() {
            let seconds = picture.elapsed.as_secs_f64();
            let mut text = format!(
                "{} of {} spp   {}   {} x {}",
                picture.samples,
                picture.samples_asked,
                time(seconds),
                picture.width,
                picture.height
            );
            if let Some(last) = desk.news.errors.last() {
                text += &format!("   relMSE {:.2e}", last.relmse);
            }
            ui.separator();
            ui.label(RichText::new(text).color(theme::QUIET));
            if picture.nonfinite > 0 {
                let text = format!("{} samples not finite", picture.nonfinite);
                ui.label(RichText::new(text).color(theme::WARNING));
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if let Some(text) = under_the_hand(desk, canvas) {
                ui.label(RichText::new(text).monospace().color(theme::TEXT));
            } else if let Some(note) = &desk.note {
                let color = if note.is_bad {
                    theme::BAD
                } else {
                    theme::QUIET
                };
                let line = note.text.lines().next().unwrap_or_default();
                let label = eframe::egui::Label::new(RichText::new(line).color(color)).truncate();
                ui.add(label).on_hover_text(&note.text);
            }
        });
    });
}

fn state(desk: &Desk) -> (String, Color32) {
    match &desk.news.state {
        State::Reading => ("Reading".to_owned(), theme::WARNING),
        State::Compiling => ("Compiling".to_owned(), theme::WARNING),
        State::Building if desk.picture().is_some_and(|picture| picture.stands_in) => (
            "Building kernels; the processor stands in".to_owned(),
            theme::WARNING,
        ),
        State::Building => ("Building kernels".to_owned(), theme::WARNING),
        State::Rendering => ("Rendering".to_owned(), theme::ACCENT),
        State::Done => ("Done".to_owned(), theme::GOOD),
        State::Paused => ("Paused".to_owned(), theme::QUIET),
        State::Broken => ("Errors in the files".to_owned(), theme::BAD),
        State::Failed(why) => {
            let line = why.lines().next().unwrap_or_default();
            (format!("Failed: {line}"), theme::BAD)
        }
    }
}

fn under_the_hand(desk: &Desk, canvas: &Canvas) -> Option<String> {
    let [column, row] = canvas.hover?;
    let picture = desk.picture()?;
    let index = row as usize * picture.width as usize + column as usize;
    let mut text = format!("{column},{row}");
    if let Some(difference) = &canvas.difference {
        let pixel = difference.pixels.get(index)?;
        text += &format!("  difference {}", pixel.map(picture::number).join(" "));
        return Some(text);
    }
    let share = (column as f32 + 0.5) / picture.width.max(1) as f32;
    let seen = desk.seen_at(share)?;
    let index = row as usize * seen.width as usize + column as usize;
    for value in picture::texts(seen, desk.layer.as_deref(), index) {
        text += &format!("  {value}");
    }
    if let Some(samples) = seen.counts.get(index).filter(|_| desk.layer.is_none()) {
        text += &format!("  {samples} spp");
    }
    Some(text)
}

/// Seconds in words.
pub fn time(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", 1e3 * s),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!(
            "{:.0} min {:02.0} s",
            (s / 60.0).floor(),
            (s % 60.0).floor()
        ),
        s => format!(
            "{:.0} h {:02.0} min",
            (s / 3600.0).floor(),
            (s % 3600.0 / 60.0).floor()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::time;

    #[test]
    fn times_in_words() {
        let shown = [0.25, 7.04, 61.0, 3725.0].map(time);
        assert_eq!(shown, ["250 ms", "7.0 s", "1 min 01 s", "1 h 02 min"]);
    }
}
