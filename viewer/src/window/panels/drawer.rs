//! The drawer below the picture: what is wrong with the files, and the path that was traced, as text.

use std::sync::Arc;

use eframe::egui::{Align, Label, Layout, RichText, ScrollArea, Ui};

use super::super::desk::{Desk, Drawer};
use super::super::theme;
use super::params;
use crate::engine::Problem;

/// Is there something in it?
pub fn is_open(desk: &Desk) -> bool {
    !desk.news.problems.is_empty() || desk.shows_trace && desk.traced.is_some()
}

/// Draws it.
pub fn show(ui: &mut Ui, desk: &mut Desk) {
    let problems = Arc::clone(&desk.news.problems);
    let has_trace = desk.shows_trace && desk.traced.is_some();
    let shown = match (desk.drawer, problems.is_empty(), has_trace) {
        (Drawer::Trace, _, true) | (_, true, true) => Drawer::Trace,
        _ => Drawer::Problems,
    };
    ui.horizontal(|ui| {
        if !problems.is_empty() {
            let text = title(&problems);
            if ui
                .selectable_label(shown == Drawer::Problems, text)
                .clicked()
            {
                desk.drawer = Drawer::Problems;
            }
        }
        if let Some(traced) = desk.traced.as_ref().filter(|_| has_trace) {
            let [column, row] = traced.pixel;
            let text = format!("Path of {column},{row}, sample {}", traced.sample);
            if ui.selectable_label(shown == Drawer::Trace, text).clicked() {
                desk.drawer = Drawer::Trace;
            }
        }
        if shown == Drawer::Trace {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                trace_buttons(ui, desk)
            });
        }
    });
    ui.add_space(2.0);
    ScrollArea::both()
        .auto_shrink([false; 2])
        .id_salt(match shown {
            Drawer::Problems => "problems",
            Drawer::Trace => "trace",
        })
        .show(ui, |ui| match shown {
            Drawer::Problems => problems.iter().for_each(|p| problem(ui, desk, p)),
            Drawer::Trace => {
                let text = desk.traced.as_ref().map_or("", |t| t.text.as_str());
                let text = RichText::new(text).monospace();
                ui.add(Label::new(text).extend().selectable(true));
            }
        });
}

fn trace_buttons(ui: &mut Ui, desk: &mut Desk) {
    let Some(traced) = &desk.traced else {
        return;
    };
    let (pixel, sample) = (traced.pixel, traced.sample);
    let text = traced.text.clone();
    if params::small(ui, "Close").clicked() {
        desk.traced = None;
        desk.shows_trace = false;
        return;
    }
    if params::small(ui, "Copy").clicked() {
        ui.ctx().copy_text(text);
        desk.say("Copied the path".to_owned());
    }
    if params::small(ui, "Next sample").clicked() {
        desk.trace(pixel, sample.saturating_add(1));
    }
    if params::small(ui, "Previous").clicked() && sample > 0 {
        desk.trace(pixel, sample - 1);
    }
}

fn title(problems: &[Problem]) -> String {
    let warnings = problems.iter().filter(|p| p.is_warning).count();
    let errors = problems.len() - warnings;
    let count = |n: usize, one: &str| match n {
        1 => format!("1 {one}"),
        n => format!("{n} {one}s"),
    };
    match (errors, warnings) {
        (0, warnings) => count(warnings, "warning"),
        (errors, 0) => count(errors, "error"),
        (errors, warnings) => format!("{}, {}", count(errors, "error"), count(warnings, "warning")),
    }
}

fn problem(ui: &mut Ui, desk: &mut Desk, problem: &Problem) {
    let color = if problem.is_warning {
        theme::WARNING
    } else {
        theme::BAD
    };
    ui.horizontal(|ui| {
        let code = problem
            .code
            .as_deref()
            .map(|c| format!("{c}  "))
            .unwrap_or_default();
        let text = format!("{code}{}", problem.message);
        ui.label(RichText::new(text).color(color).strong());
        if let Some((file, line, column)) = &problem.place {
            let place = format!("{file}:{line}");
            let link = ui.link(format!("{place}:{column}"));
            if link.on_hover_text(format!("Copies {place}")).clicked() {
                ui.ctx().copy_text(place.clone());
                desk.say(format!("Copied {place}"));
            }
        }
    });
    if !problem.text.is_empty() {
        let text = RichText::new(problem.text.trim_end())
            .monospace()
            .color(theme::TEXT);
        ui.add(Label::new(text).extend().selectable(true));
    }
    ui.add_space(6.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn problems_are_counted() {
        let problem = |is_warning| Problem {
            is_warning,
            code: None,
            message: String::new(),
            place: None,
            text: String::new(),
        };
        assert_eq!(title(&[problem(false)]), "1 error");
        assert_eq!(title(&[problem(true), problem(true)]), "2 warnings");
        assert_eq!(
            title(&[problem(true), problem(false)]),
            "1 error, 1 warning"
        );
    }
}
