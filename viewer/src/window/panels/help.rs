//! The list of keys and of what a hand does on the picture: the tables of `keys` as they are.

use eframe::egui::{Align2, Context, Grid, RichText, ScrollArea, Ui, Window, vec2};

use super::super::desk::Desk;
use super::super::keys::{MOUSE, TABLE};
use super::super::theme;

/// Draws it if it is open.
pub fn show(ctx: &Context, desk: &mut Desk) {
    if !desk.shows_help {
        return;
    }
    let mut is_open = true;
    let room = ctx.content_rect().size();
    let size = vec2(
        (room.x - 40.0).clamp(60.0, 920.0),
        (room.y - 90.0).clamp(60.0, 500.0),
    );
    Window::new("Keys")
        .open(&mut is_open)
        .collapsible(false)
        .fixed_size(size)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            ScrollArea::both()
                .auto_shrink([false, true])
                .show(ui, columns);
        });
    desk.shows_help &= is_open;
}

fn columns(ui: &mut Ui) {
    ui.horizontal_top(|ui| {
        let mut groups: Vec<&str> = TABLE.iter().map(|row| row.group).collect();
        groups.dedup();
        for column in groups.chunks(groups.len().div_ceil(2)) {
            ui.vertical(|ui| {
                ui.set_min_width(280.0);
                for group in column {
                    keys(ui, group);
                }
            });
        }
        ui.vertical(|ui| {
            ui.set_min_width(280.0);
            heading(ui, "On the picture");
            Grid::new("mouse")
                .num_columns(2)
                .spacing([14.0, 3.0])
                .show(ui, |ui| {
                    for (hand, about) in MOUSE {
                        row(ui, hand, about);
                    }
                });
        });
    });
}

fn heading(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).strong().color(theme::ACCENT));
    ui.add_space(2.0);
}

fn keys(ui: &mut Ui, group: &str) {
    heading(ui, group);
    Grid::new(group)
        .num_columns(2)
        .spacing([14.0, 3.0])
        .show(ui, |ui| {
            for of_group in TABLE.iter().filter(|row| row.group == group) {
                row(ui, &of_group.keys(), of_group.about);
            }
        });
    ui.add_space(10.0);
}

fn row(ui: &mut Ui, key: &str, about: &str) {
    ui.label(RichText::new(key).monospace());
    ui.label(RichText::new(about).color(theme::TEXT));
    ui.end_row();
}
