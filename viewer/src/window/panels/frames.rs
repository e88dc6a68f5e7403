//! The line below the picture on which frames lie, if something moves.

use eframe::egui::{DragValue, Slider, Ui};

use super::super::desk::Desk;
use super::super::keys::{self, Command};
use super::{named, params, quiet};

/// Does something move?
pub fn is_open(desk: &Desk) -> bool {
    desk.news.project.frames.is_some()
}

/// Draws it.
pub fn show(ui: &mut Ui, desk: &mut Desk) {
    let Some([first, last]) = desk.news.project.frames else {
        return;
    };
    let last = last.max(first);
    ui.horizontal(|ui| {
        let mut frame = desk.frame.clamp(first, last);
        let label = ui.label("Frame");
        for (text, command, step) in [("<", Command::LastFrame, -1), (">", Command::NextFrame, 1)] {
            let tip = keys::of(command).unwrap_or_default();
            let button = params::small(ui, text).on_hover_text(tip);
            named(
                &button,
                if step < 0 {
                    "Previous frame"
                } else {
                    "Next frame"
                },
            );
            if button.clicked() {
                frame = frame.saturating_add_signed(step);
            }
        }
        let field = DragValue::new(&mut frame).range(first..=last).speed(0.2);
        ui.add_sized([44.0, 20.0], field).labelled_by(label.id);
        ui.label(quiet(first.to_string()));
        ui.spacing_mut().slider_width = (ui.available_width() - 50.0).max(20.0);
        let slider = Slider::new(&mut frame, first..=last)
            .integer()
            .show_value(false);
        ui.add(slider).labelled_by(label.id);
        ui.label(quiet(last.to_string()));
        desk.go_to(frame);
    });
}
