//! The bar above the picture: what is shown, tools, and what concerns the whole.

use eframe::egui::{Align, Button, Layout, RichText, Ui};

use super::super::canvas::Canvas;
use super::super::desk::{Desk, Tool};
use super::super::keys::{self, Command};
use super::super::theme;

/// Draws it. What its buttons ask for goes to `commands`.
pub fn show(ui: &mut Ui, desk: &mut Desk, canvas: &Canvas, commands: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        let name = match desk.news.project.name.as_str() {
            "" => "Impasto",
            name => name,
        };
        let path = desk.news.project.path.display().to_string();
        ui.label(RichText::new(name).strong()).on_hover_text(path);
        ui.separator();
        for (tool, command) in Tool::ALL {
            let button = Button::selectable(desk.tool == tool, tool.name());
            if ui.add(button).on_hover_text(tip(command)).clicked() {
                commands.push(command);
            }
        }
        ui.separator();
        for (text, command) in [("Home", Command::Home), ("Frame", Command::Frame)] {
            button(ui, text, command, commands);
        }
        ui.separator();
        let pause = if desk.is_paused { "Go on" } else { "Pause" };
        for (text, command) in [
            (pause, Command::Pause),
            ("Restart", Command::Restart),
            ("Reload", Command::Reload),
        ] {
            button(ui, text, command, commands);
        }
        ui.separator();
        button(ui, "Save", Command::Save, commands);
        if ui.available_width() > 190.0 {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                for (text, command) in PLACE.iter().rev() {
                    button(ui, text, *command, commands);
                }
                magnification(ui, canvas);
            });
        } else {
            // In a narrow window they take part in its lines.
            ui.separator();
            for (text, command) in PLACE {
                button(ui, text, command, commands);
            }
            magnification(ui, canvas);
        }
    });
}

/// What is about the picture's place in the window.
const PLACE: [(&str, Command); 3] = [
    ("Fit", Command::Fit),
    ("1:1", Command::ActualPixels),
    ("?", Command::Help),
];

fn magnification(ui: &mut Ui, canvas: &Canvas) {
    if let Some(zoom) = canvas.zoom() {
        let text = format!("{:.0} %", 100.0 * zoom);
        ui.label(RichText::new(text).color(theme::QUIET));
    }
}

fn button(ui: &mut Ui, text: &str, command: Command, commands: &mut Vec<Command>) {
    if ui.button(text).on_hover_text(tip(command)).clicked() {
        commands.push(command);
    }
}

/// What a command does, and its key.
fn tip(command: Command) -> String {
    let about = keys::TABLE.iter().find(|row| row.command == command);
    about.map_or_else(String::new, |row| format!("{} ({})", row.about, row.keys()))
}
