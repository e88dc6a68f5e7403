//! What stands around the picture. Each panel reads the desk and tells it what hands do; none keeps a state of its own.

use eframe::egui::{CollapsingHeader, Response, RichText, Ui};

use super::theme;

pub mod bar;
pub mod drawer;
mod errors;
pub mod frames;
pub mod help;
mod kernels;
mod params;
mod picker;
pub mod save;
pub mod scene;
pub mod side;
pub mod status;

/// A part of a panel that folds.
fn section<R>(ui: &mut Ui, title: &str, is_open: bool, content: impl FnOnce(&mut Ui) -> R) {
    let header = CollapsingHeader::new(RichText::new(title).strong()).default_open(is_open);
    header.show_unindented(ui, |ui| {
        ui.add_space(2.0);
        content(ui);
        ui.add_space(6.0);
    });
}

/// A quiet text.
fn quiet(text: impl Into<String>) -> RichText {
    RichText::new(text).color(theme::QUIET).size(12.0)
}

/// Gives a control that has no label beside it a name for screen readers.
fn named(response: &Response, name: &str) {
    let name = name.to_owned();
    response
        .ctx
        .accesskit_node_builder(response.id, |node| node.set_label(name));
}
