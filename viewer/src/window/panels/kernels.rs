//! Kernels and what they take, as a bar that lives, with the plan's reasons and a choice of strategies.

use std::sync::Arc;

use eframe::egui::{Color32, ComboBox, DragValue, Label, Rect, RichText, Sense, Ui, pos2, vec2};

use super::super::desk::Desk;
use super::super::theme;
use super::super::tone::index_color;
use super::quiet;
use crate::engine::Kernel;

/// Draws it.
pub fn show(ui: &mut Ui, desk: &mut Desk) {
    let kernels = Arc::clone(&desk.news.kernels);
    if kernels.kernels.is_empty() {
        ui.label(quiet("There are none yet."));
        return;
    }
    ui.label(quiet(&kernels.device));
    strategy(ui, desk);
    let shares: Vec<f32> = kernels
        .kernels
        .iter()
        .map(|k| k.share.filter(|s| s.is_finite()).unwrap_or(0.0).max(0.0))
        .collect();
    let sum: f32 = shares.iter().sum();
    if sum > 0.0 {
        bar(ui, &shares, sum, &kernels.kernels);
    }
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        ui.spacing_mut().interact_size.y = 15.0;
        for (i, kernel) in kernels.kernels.iter().enumerate() {
            row(ui, i, kernel);
        }
    });
    if sum == 0.0 {
        ui.label(quiet("This device times no kernels."));
    }
    if !kernels.reasons.is_empty() {
        ui.collapsing(quiet("Why so"), |ui| {
            for reason in &kernels.reasons {
                ui.label(quiet(reason));
            }
        });
    }
}

fn row(ui: &mut Ui, index: usize, kernel: &Kernel) {
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(9.0, 14.0), Sense::hover());
        let swatch = Rect::from_center_size(rect.center(), vec2(9.0, 9.0));
        ui.painter().rect_filled(swatch, 2.0, color(index));
        let share = match kernel.share {
            Some(share) => format!("{:4.1} %", 100.0 * share),
            None => "      ".to_owned(),
        };
        ui.label(
            RichText::new(share)
                .monospace()
                .size(11.0)
                .color(theme::QUIET),
        );
        let label = ui.add(Label::new(RichText::new(&kernel.name).size(12.0)).truncate());
        if !kernel.materials.is_empty() {
            label.on_hover_text(kernel.materials.join("\n"));
        }
    });
}

fn strategy(ui: &mut Ui, desk: &mut Desk) {
    let project = Arc::clone(&desk.news.project);
    if project.strategies.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("Strategy");
        let mut next = desk.strategy().to_owned();
        ComboBox::from_id_salt("strategy")
            .selected_text(next.clone())
            .width(ui.available_width() - 8.0)
            .show_ui(ui, |ui| {
                for (name, about) in &project.strategies {
                    ui.selectable_value(&mut next, name.clone(), name)
                        .on_hover_text(about);
                }
            })
            .response
            .labelled_by(label.id);
        if next != desk.strategy() {
            desk.plan_by(&next);
        }
    });
    number(ui, desk);
}

/// The number of a strategy that takes one.
fn number(ui: &mut Ui, desk: &mut Desk) {
    let strategy = desk.strategy().to_owned();
    let Some((name, number)) = strategy.split_once('=') else {
        return;
    };
    let Ok(now) = number.parse::<f64>() else {
        return;
    };
    // A plan is made anew for each number: only when the hand lets go.
    let at = ui.scope_id().with("number");
    let mut number = ui.data(|d| d.get_temp(at)).unwrap_or(now);
    ui.horizontal(|ui| {
        let label = ui.label(quiet(name));
        let speed = (number.abs() * 0.02).max(0.1);
        let field = DragValue::new(&mut number)
            .range(0.0..=1e9)
            .speed(speed)
            .max_decimals(1)
            .update_while_editing(false);
        let response = ui.add(field).labelled_by(label.id);
        if response.changed() {
            ui.data_mut(|d| d.insert_temp(at, number));
        }
        if !response.dragged()
            && let Some(number) = ui.data_mut(|d| d.remove_temp::<f64>(at))
        {
            desk.plan_by(&format!("{name}={number}"));
        }
    });
}

fn color(index: usize) -> Color32 {
    let [r, g, b] = index_color(index);
    Color32::from_rgb(r, g, b)
}

fn bar(ui: &mut Ui, shares: &[f32], sum: f32, kernels: &[Kernel]) {
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width() - 4.0, 16.0), Sense::hover());
    let painter = ui.painter();
    let mut left = rect.left();
    let mut pointed = None;
    for (i, share) in shares.iter().enumerate() {
        let right = left + rect.width() * share / sum;
        let part = Rect::from_min_max(pos2(left, rect.top()), pos2(right, rect.bottom()));
        painter.rect_filled(part.shrink2(vec2(0.5, 0.0)), 2.0, color(i));
        if response.hover_pos().is_some_and(|at| part.contains(at)) {
            pointed = Some(i);
        }
        left = right;
    }
    if let Some(i) = pointed {
        let text = format!("{}: {:.1} %", kernels[i].name, 100.0 * shares[i]);
        response.on_hover_text(text);
    }
}
