//! The right panel: how the picture is shown and compared, what is at a pixel, when the render ends, and what it costs.

use std::sync::Arc;

use eframe::egui::{
    Button, Checkbox, ComboBox, DragValue, Id, RichText, ScrollArea, Slider, TextEdit, Ui,
};

use super::super::canvas::Canvas;
use super::super::compare::Mode;
use super::super::desk::{Desk, OVERLAYS};
use super::super::keys::{self, Command};
use super::super::picture::{self, Channel};
use super::super::theme;
use super::super::tone::{Curve, Map};
use super::{errors, kernels, named, params, quiet, section};

/// Draws it.
pub fn show(ui: &mut Ui, desk: &mut Desk, canvas: &Canvas) {
    ScrollArea::vertical()
        .auto_shrink([false; 2])
        .show(ui, |ui| {
            section(ui, "Display", true, |ui| display(ui, desk));
            section(ui, "Compare", true, |ui| compare(ui, desk, canvas));
            section(ui, "Pixel", true, |ui| pixel(ui, desk));
            section(ui, "Render", true, |ui| render(ui, desk));
            section(ui, "Kernels", true, |ui| kernels::show(ui, desk));
            section(ui, "Error", true, |ui| errors::show(ui, desk));
        });
}

/// A name at the left, and a control at the same place in every line, which the name is the label of.
fn line<R>(ui: &mut Ui, name: &str, content: impl FnOnce(&mut Ui, Id) -> R) -> R {
    ui.horizontal(|ui| {
        let width = 66f32.min(0.4 * ui.available_width());
        let size = eframe::egui::vec2(width, ui.spacing().interact_size.y);
        let layout = eframe::egui::Layout::left_to_right(eframe::egui::Align::Center);
        let label = ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_width(width);
            ui.label(name).id
        });
        content(ui, label.inner)
    })
    .inner
}

fn key(command: Command) -> String {
    keys::of(command).unwrap_or_default()
}

fn display(ui: &mut Ui, desk: &mut Desk) {
    line(ui, "Exposure", |ui, name| {
        ui.spacing_mut().slider_width = (ui.available_width() - 70.0).max(30.0);
        let mut stops = desk.look.exposure;
        let slider = Slider::new(&mut stops, -8.0..=8.0)
            .clamping(eframe::egui::SliderClamping::Never)
            .show_value(false);
        let slider = ui.add(slider).labelled_by(name);
        slider.on_hover_text(format!("Stops ({})", key(Command::Brighter)));
        let field = DragValue::new(&mut stops)
            .range(-20.0..=20.0)
            .speed(0.05)
            .fixed_decimals(1);
        ui.add_sized([44.0, 20.0], field).labelled_by(name);
        if stops != desk.look.exposure {
            desk.expose(stops);
        }
    });
    line(ui, "Curve", |ui, name| {
        ComboBox::from_id_salt("curve")
            .selected_text(desk.look.curve.name())
            .width(ui.available_width() - 8.0)
            .show_ui(ui, |ui| {
                for curve in Curve::ALL {
                    ui.selectable_value(&mut desk.look.curve, curve, curve.name())
                        .on_hover_text(curve.about());
                }
            })
            .response
            .labelled_by(name);
    });
    line(ui, "Layer", |ui, name| layers(ui, desk, name));
    ui.horizontal(|ui| {
        for channel in Channel::ALL {
            ui.selectable_value(&mut desk.look.channel, channel, channel.name());
        }
    });
    let tip = format!("Light in false color ({})", key(Command::FalseColor));
    ui.checkbox(&mut desk.look.is_false, "False color")
        .on_hover_text(tip);
    if desk.shows_numbers() || desk.overlay.is_some() {
        colors(ui, desk);
    }
    line(ui, "Mark", |ui, _| {
        let tip = format!(
            "Red stripes above 1, blue ones below 0, after exposure ({})",
            key(Command::MarkClipped)
        );
        let tick = ui.checkbox(&mut desk.look.mark_clipped, "clipped");
        tick.on_hover_text(tip);
        let tip = format!(
            "Pixels that are not finite, or lost samples that were not ({})",
            key(Command::MarkNonfinite)
        );
        let tick = ui.checkbox(&mut desk.look.mark_nonfinite, "not finite");
        tick.on_hover_text(tip);
    });
    overlay(ui, desk);
}

fn layers(ui: &mut Ui, desk: &mut Desk, name: Id) {
    let shown = desk.layer.clone().unwrap_or_else(|| "picture".to_owned());
    ComboBox::from_id_salt("layer")
        .selected_text(shown)
        .width(ui.available_width() - 8.0)
        .show_ui(ui, |ui| {
            if ui
                .selectable_label(desk.layer.is_none(), "picture")
                .clicked()
            {
                desk.show(None);
            }
            for (layer, about) in desk.layers() {
                let is_there = desk.has_layer(&layer);
                let text = RichText::new(&layer);
                let text = if is_there {
                    text
                } else {
                    text.color(theme::QUIET)
                };
                let is_shown = desk.layer.as_deref() == Some(&layer);
                let row = ui.selectable_label(is_shown, text);
                let tip = match (is_there, desk.is_own(&layer)) {
                    (true, _) => about,
                    (false, true) => format!("{about}\nIt is there once the picture rests."),
                    (false, false) => format!("{about}\nIt is recorded once it is chosen."),
                };
                if row.on_hover_text(tip).clicked() {
                    desk.show(Some(layer));
                }
            }
        })
        .response
        .labelled_by(name);
}

fn overlay(ui: &mut Ui, desk: &mut Desk) {
    line(ui, "Overlay", |ui, name| {
        let shown = desk.overlay.clone().unwrap_or_else(|| "none".to_owned());
        ComboBox::from_id_salt("overlay")
            .selected_text(shown)
            .width(ui.available_width() - 8.0)
            .show_ui(ui, |ui| {
                if ui
                    .selectable_label(desk.overlay.is_none(), "none")
                    .clicked()
                {
                    desk.lay_over(None);
                }
                for layer in OVERLAYS {
                    let known = desk.layers().into_iter().find(|(known, _)| known == layer);
                    let is_over = desk.overlay.as_deref() == Some(layer);
                    let button = Button::selectable(is_over, layer);
                    let row = ui.add_enabled(known.is_some(), button);
                    let row = row.on_disabled_hover_text("This render has no such layer");
                    let tip = known.map_or(String::new(), |(_, about)| about);
                    if row.on_hover_text(tip).clicked() {
                        desk.lay_over(Some(layer.to_owned()));
                    }
                }
            })
            .response
            .labelled_by(name);
    });
    if desk.overlay.is_some() {
        line(ui, "Opacity", |ui, name| {
            ui.spacing_mut().slider_width = (ui.available_width() - 12.0).max(30.0);
            let slider = Slider::new(&mut desk.overlay_share, 0.0..=1.0).show_value(false);
            ui.add(slider).labelled_by(name);
        });
    }
}

fn colors(ui: &mut Ui, desk: &mut Desk) {
    let colors = &mut desk.look.colors;
    ui.horizontal(|ui| {
        let menu = ComboBox::from_id_salt("map")
            .selected_text(colors.map.name())
            .width(84.0)
            .show_ui(ui, |ui| {
                for map in Map::ALL {
                    ui.selectable_value(&mut colors.map, map, map.name());
                }
            });
        named(&menu.response, "Colors");
        ui.checkbox(&mut colors.is_log, "log");
        let mut has_ends = colors.ends.is_some();
        if ui
            .checkbox(&mut has_ends, "ends")
            .on_hover_text("Ends of the scale")
            .changed()
        {
            colors.ends = has_ends.then_some([1e-3, 1.0]);
        }
    });
    if let Some([low, high]) = &mut colors.ends {
        ui.horizontal(|ui| {
            for (end, name) in [(low, "Low end"), (high, "High end")] {
                let speed = (f64::from(end.abs()) * 0.02).max(1e-6);
                let field = ui.add(DragValue::new(end).speed(speed).max_decimals(6));
                named(&field, name);
            }
        });
    }
}

fn compare(ui: &mut Ui, desk: &mut Desk, canvas: &Canvas) {
    ui.horizontal(|ui| {
        let tip = format!(
            "Keeps the picture as it is now ({})",
            key(Command::Snapshot)
        );
        let has_picture = desk.picture().is_some();
        let take = ui.add_enabled(has_picture, Button::new("Snapshot"));
        if take.on_hover_text(tip).clicked() {
            desk.take_snapshot();
        }
        let mut mode = desk.compare;
        let menu = ComboBox::from_id_salt("compare")
            .selected_text(mode.name())
            .width(ui.available_width() - 8.0)
            .show_ui(ui, |ui| {
                for one in Mode::ALL {
                    ui.selectable_value(&mut mode, one, one.name())
                        .on_hover_text(one.about());
                }
            });
        named(&menu.response, "Compare by");
        if mode != desk.compare {
            desk.compare_by(mode);
        }
    });
    let mut forgotten = None;
    for (i, snapshot) in desk.snapshots.iter().enumerate() {
        ui.horizontal(|ui| {
            let row = ui.selectable_label(desk.chosen == i, &snapshot.name);
            if row.clicked() {
                desk.chosen = i;
            }
            if params::small(ui, "x").on_hover_text("Forgets it").clicked() {
                forgotten = Some(i);
            }
        });
    }
    if let Some(i) = forgotten {
        desk.forget(i);
    }
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 56.0).max(40.0);
        let field = TextEdit::singleline(&mut desk.read_from)
            .hint_text("reference.exr")
            .desired_width(width);
        let response = ui.add(field);
        named(&response, "File to compare with");
        let is_entered =
            response.lost_focus() && ui.input(|i| i.key_pressed(eframe::egui::Key::Enter));
        if params::small(ui, "Read").clicked() || is_entered {
            desk.read();
        }
    });
    if let Some(difference) = &canvas.difference {
        for (name, x) in [
            ("mean", difference.absolute),
            ("RMSE", difference.root_square),
            ("relMSE", difference.relative_square),
        ] {
            line(ui, name, |ui, _| ui.label(quiet(format!("{x:.3e}"))));
        }
    }
}

fn pixel(ui: &mut Ui, desk: &mut Desk) {
    let Some(picked) = desk.picked.clone() else {
        ui.label(quiet("Click on the picture."));
        return;
    };
    let bindings = Arc::clone(&desk.news.project);
    let binding = picked.binding.and_then(|i| bindings.bindings.get(i));
    let pixel = desk.picked_pixel();
    line(ui, "Pixel", |ui, _| {
        ui.label(match pixel {
            Some([column, row]) => format!("{column}, {row}"),
            None => "outside".to_owned(),
        })
    });
    if let Some(binding) = binding {
        line(ui, "Material", |ui, _| {
            let label = ui.link(&binding.name).on_hover_text("Shows its parameters");
            if label.clicked() {
                desk.reveal = picked.binding;
            }
        });
    }
    if let Some((file, line_number)) = &picked.source {
        line(ui, "Source", |ui, _| {
            let place = format!("{file}:{line_number}");
            let shown = std::path::Path::new(file).file_name();
            let shown = shown.map_or(place.clone(), |f| {
                format!("{}:{line_number}", f.to_string_lossy())
            });
            if ui
                .link(shown)
                .on_hover_text(format!("Copies {place}"))
                .clicked()
            {
                ui.ctx().copy_text(place.clone());
                desk.say(format!("Copied {place}"));
            }
        });
    }
    if let Some(object) = &picked.object {
        line(ui, "Object", |ui, _| {
            ui.add(eframe::egui::Label::new(object).truncate())
        });
    }
    let [x, y, z] = picked.position.map(picture::number);
    line(ui, "Position", |ui, _| ui.label(format!("{x}  {y}  {z} m")));
    line(ui, "Depth", |ui, _| {
        ui.label(format!("{} m", picture::number(picked.depth)))
    });
    if let (Some(picture), Some([column, row])) = (desk.picture(), pixel) {
        let index = row as usize * picture.width as usize + column as usize;
        let texts = picture::texts(picture, desk.layer.as_deref(), index);
        line(ui, "Value", |ui, _| ui.label(texts.join("  ")));
    }
    line(ui, "Path", |ui, name| {
        let mut sample = desk.sample;
        let field = DragValue::new(&mut sample)
            .prefix("sample ")
            .update_while_editing(false);
        ui.add(field).labelled_by(name);
        desk.sample = sample;
        if params::small(ui, "Trace")
            .on_hover_text(key(Command::ToolTrace))
            .clicked()
        {
            desk.trace(pixel.unwrap_or(picked.pixel), sample);
        }
    });
}

fn render(ui: &mut Ui, desk: &mut Desk) {
    line(ui, "Samples", |ui, name| {
        if desk.samples == 0 {
            // The first picture says how many; a field would make its least value of that.
            return;
        }
        let mut samples = desk.samples;
        let speed = (f64::from(samples) * 0.02).max(0.2);
        let field = DragValue::new(&mut samples)
            .range(1..=1_048_576)
            .speed(speed)
            .update_while_editing(false);
        let field = ui.add(field).labelled_by(name);
        if field
            .on_hover_text("Samples of a pixel after which to rest")
            .changed()
        {
            desk.take_samples(samples);
        }
    });
    goals(ui, desk);
    line(ui, "Size", |ui, name| sizes(ui, desk, name));
    line(ui, "Crop", |ui, _| match desk.crop {
        Some([from, to]) => {
            ui.label(format!("{} x {}", to[0] - from[0], to[1] - from[1]));
            if params::small(ui, "All").clicked() {
                desk.crop_to(None);
            }
        }
        None => {
            ui.label(quiet(format!(
                "none ({} and a drag)",
                key(Command::ToolCrop)
            )));
        }
    });
    outputs(ui, desk);
}

fn goals(ui: &mut Ui, desk: &mut Desk) {
    let mut asks = false;
    for goal in &mut desk.goals.0 {
        line(ui, goal.name, |ui, name| {
            let tick = ui.checkbox(&mut goal.is_on, "").labelled_by(name);
            asks |= tick.on_hover_text(goal.about).changed();
            let field = TextEdit::singleline(&mut goal.size).desired_width(60.0);
            let response = ui.add_enabled(goal.is_on, field).labelled_by(name);
            asks |= response.lost_focus();
        });
    }
    if asks {
        desk.order_goals();
    }
}

fn sizes(ui: &mut Ui, desk: &mut Desk, name: Id) {
    let written = desk.news.project.size;
    let now = desk.picture().map_or(written, |p| [p.width, p.height]);
    let mut next = now;
    ComboBox::from_id_salt("size")
        .selected_text(format!("{} x {}", now[0], now[1]))
        .width(ui.available_width() - 8.0)
        .show_ui(ui, |ui| {
            for (share, about) in [
                (0.25, "25 %"),
                (0.5, "50 %"),
                (1.0, "as written"),
                (2.0, "200 %"),
            ] {
                let size = written.map(|n| ((f64::from(n) * share).round() as u32).max(1));
                let text = format!("{} x {}  ({about})", size[0], size[1]);
                ui.selectable_value(&mut next, size, text);
            }
        })
        .response
        .labelled_by(name);
    if next != now {
        desk.resize(next);
    }
}

fn outputs(ui: &mut Ui, desk: &mut Desk) {
    let project = Arc::clone(&desk.news.project);
    if project.outputs.is_empty() {
        return;
    }
    let recorded = desk.recorded();
    ui.menu_button(format!("Record outputs ({})", recorded.len()), |ui| {
        ScrollArea::vertical().max_height(300.0).show(ui, |ui| {
            for (name, about) in &project.outputs {
                let mut is_on = recorded.contains(name);
                let tick = ui.add(Checkbox::new(&mut is_on, name)).on_hover_text(about);
                if tick.changed() {
                    desk.record(name, is_on);
                }
            }
        });
    });
}
