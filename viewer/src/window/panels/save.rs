//! The dialog in which the picture is saved.

use eframe::egui::{Align2, Context, Key, RichText, TextEdit, Window, vec2};

use super::super::desk::Desk;
use super::super::theme;
use super::named;

/// Formats, and what they hold.
const FORMATS: [(&str, &str, &str); 3] = [
    ("EXR", "exr", "Linear radiance and all layers"),
    ("PNG", "png", "sRGB at this exposure, for looking"),
    (
        "Film",
        "film",
        "Exact sums, for `impasto merge` and to go on from",
    ),
];

/// Draws it if it is open.
pub fn show(ctx: &Context, desk: &mut Desk) {
    if !desk.shows_save {
        return;
    }
    let mut is_open = true;
    Window::new("Save the picture")
        .open(&mut is_open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            let response = ui.add(TextEdit::singleline(&mut desk.save_as).desired_width(320.0));
            named(&response, "File");
            if std::mem::take(&mut desk.has_opened_save) {
                response.request_focus();
            }
            if response.lost_focus() {
                if ui.input(|i| i.key_pressed(Key::Enter)) {
                    desk.save(None);
                } else if ui.input(|i| i.key_pressed(Key::Escape)) {
                    desk.shows_save = false;
                }
            }
            ui.add_space(4.0);
            ui.horizontal(|ui| {
                for (name, extension, about) in FORMATS {
                    if ui.button(name).on_hover_text(about).clicked() {
                        desk.save(Some(extension));
                    }
                }
                ui.label(
                    RichText::new("Enter: by its extension")
                        .color(theme::QUIET)
                        .size(12.0),
                );
            });
        });
    desk.shows_save &= is_open;
}
