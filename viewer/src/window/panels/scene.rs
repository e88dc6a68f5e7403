//! The left panel: what the scene binds, with the parameters of each material, and the camera.

use std::sync::Arc;

use eframe::egui::{
    Align, CollapsingHeader, DragValue, Label, Layout, RichText, ScrollArea, TextEdit, Ui,
};
use glam::Vec3;
use impasto_runtime::scene::Camera;

use super::super::desk::Desk;
use super::super::{navigate, theme};
use super::{named, params, quiet, section};
use crate::engine::{Binding, ParamId};

/// Draws it.
pub fn show(ui: &mut Ui, desk: &mut Desk) {
    head(ui, desk);
    ui.separator();
    ScrollArea::vertical()
        .auto_shrink([false; 2])
        .show(ui, |ui| {
            let project = Arc::clone(&desk.news.project);
            let is_short = project.bindings.len() <= 4;
            for (index, binding) in project.bindings.iter().enumerate() {
                show_binding(ui, desk, index, binding, is_short || index == 0);
            }
            ui.separator();
            section(ui, "Camera", false, |ui| camera(ui, desk));
        });
    desk.reveal = None;
}

fn head(ui: &mut Ui, desk: &mut Desk) {
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 150.0).clamp(50.0, 140.0);
        let filter = TextEdit::singleline(&mut desk.filter)
            .hint_text("Filter")
            .desired_width(width);
        let filter = ui.add(filter);
        named(&filter, "Filter parameters");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let count = desk.count_set();
            if desk.news.project.is_scene {
                let write = ui
                    .add_enabled_ui(count > 0, |ui| params::small(ui, "Write back"))
                    .inner;
                let write = write.on_hover_text("Writes what was set into the scene file");
                if write.clicked() {
                    desk.write_back();
                }
            }
            let reset = ui
                .add_enabled_ui(count > 0, |ui| params::small(ui, "Reset all"))
                .inner;
            if reset.on_hover_text(format!("{count} set")).clicked() {
                desk.reset_all();
            }
        });
    });
}

fn show_binding(ui: &mut Ui, desk: &mut Desk, index: usize, binding: &Binding, is_open: bool) {
    let filter = desk.filter.trim().to_lowercase();
    let fits = |text: &str| text.to_lowercase().contains(&filter);
    let is_named = fits(&binding.name) || fits(&binding.material);
    let shown: Vec<usize> = binding
        .params
        .iter()
        .enumerate()
        .filter(|(_, p)| is_named || fits(&p.interface.label) || fits(&p.interface.name))
        .map(|(i, _)| i)
        .collect();
    if !filter.is_empty() && shown.is_empty() {
        return;
    }
    let is_picked = desk
        .picked
        .as_ref()
        .is_some_and(|p| p.binding == Some(index));
    let color = if is_picked {
        theme::ACCENT
    } else {
        theme::TEXT
    };
    let title = RichText::new(&binding.name).strong().color(color);
    let is_revealed = desk.reveal == Some(index);
    let open = (is_revealed || !filter.is_empty()).then_some(true);
    let header = CollapsingHeader::new(title)
        .id_salt(("binding", &binding.name))
        .default_open(is_open)
        .open(open)
        .show_unindented(ui, |ui| {
            let operations = desk.news.kernels.operations.get(index).copied().flatten();
            let about = quiet(format!("{} in {}", binding.material, binding.file));
            let about = ui.add(Label::new(about).truncate());
            about.on_hover_text(&binding.docs);
            // The line is there before the number, so that nothing moves below a hand.
            let cost = operations.map_or("operations not counted".to_owned(), |operations| {
                format!("{operations:.0} operations")
            });
            ui.label(quiet(cost));
            let mut group: Option<&str> = None;
            for (place, i) in shown.iter().enumerate() {
                let param = &binding.params[*i];
                let own = param.interface.group.as_deref();
                if own != group || place == 0 && own.is_some() {
                    params::group(ui, own.unwrap_or("Other"));
                    group = own;
                }
                let id = ParamId {
                    binding: binding.name.clone(),
                    param: param.interface.name.clone(),
                };
                ui.push_id(&id, |ui| params::show(ui, desk, &id, param));
            }
            if binding.params.is_empty() {
                ui.label(quiet("no parameters"));
            }
            ui.add_space(8.0);
        });
    if is_revealed {
        header.header_response.scroll_to_me(Some(Align::Min));
    }
}

fn camera(ui: &mut Ui, desk: &mut Desk) {
    let Some(before) = desk.camera() else {
        ui.label(quiet("There is none yet."));
        return;
    };
    let mut camera = before;
    vector(ui, "Position", &mut camera.position);
    vector(ui, "Look at", &mut camera.look_at);
    scalar(ui, "View", &mut camera.fov, 0.2, 0.5..=175.0, " deg");
    scalar(
        ui,
        "Aperture",
        &mut camera.aperture,
        0.0005,
        0.0..=10.0,
        " m",
    );
    scalar(ui, "Focus", &mut camera.focus, 0.01, 1e-4..=1e6, " m");
    let is_seeing = camera.basis()[1] != Vec3::ZERO && camera.basis()[2] != Vec3::ZERO;
    if camera != before && is_seeing {
        desk.look_from(navigate::lens(&camera, camera.fov));
    }
    ui.horizontal(|ui| {
        if params::small(ui, "Copy as TOML").clicked() {
            ui.ctx().copy_text(toml(&camera));
            desk.say("Copied the camera".to_owned());
        }
        if desk.has_moved() {
            ui.label(quiet("moved"));
        }
    });
}

fn vector(ui: &mut Ui, name: &str, vector: &mut Vec3) {
    ui.horizontal(|ui| {
        ui.add_sized([58.0, 18.0], Label::new(name));
        let width = (ui.available_width() - 18.0) / 3.0;
        let axes = [
            (&mut vector.x, "x"),
            (&mut vector.y, "y"),
            (&mut vector.z, "z"),
        ];
        for (component, axis) in axes {
            let field = DragValue::new(component)
                .speed(0.01)
                .max_decimals(4)
                .update_while_editing(false);
            let response = ui.add_sized([width.max(20.0), 20.0], field);
            named(&response, &format!("{name} {axis}"));
        }
    });
}

fn scalar(
    ui: &mut Ui,
    name: &str,
    value: &mut f32,
    speed: f64,
    range: std::ops::RangeInclusive<f32>,
    suffix: &str,
) {
    ui.horizontal(|ui| {
        let label = ui.add_sized([58.0, 18.0], Label::new(name));
        let field = DragValue::new(value)
            .speed(speed)
            .range(range)
            .max_decimals(4)
            .suffix(suffix)
            .update_while_editing(false);
        ui.add_sized([90.0, 20.0], field).labelled_by(label.id);
    });
}

/// The camera as a scene file has it.
fn toml(camera: &Camera) -> String {
    let list = |v: Vec3| format!("[{}, {}, {}]", v.x, v.y, v.z);
    let mut text = format!(
        "[camera]\nposition = {}\nlook_at = {}\nup = {}\nfov = {}\n",
        list(camera.position),
        list(camera.look_at),
        list(camera.up),
        camera.fov
    );
    if camera.aperture > 0.0 {
        text += &format!("aperture = {}\nfocus = {}\n", camera.aperture, camera.focus);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_copied_as_scenes_have_it() {
        let camera = Camera {
            position: Vec3::new(0.0, 1.5, 5.0),
            look_at: Vec3::ZERO,
            up: Vec3::Y,
            fov: 40.0,
            aperture: 0.01,
            focus: 5.0,
        };
        let expected = "[camera]\nposition = [0, 1.5, 5]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 40\n\
                        aperture = 0.01\nfocus = 5\n";
        assert_eq!(toml(&camera), expected);
        let pinhole = Camera {
            aperture: 0.0,
            ..camera
        };
        assert!(!toml(&pinhole).contains("aperture"));
    }
}
