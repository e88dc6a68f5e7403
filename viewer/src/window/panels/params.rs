//! A parameter: its name, what a hand changes it with, and what takes the change back. All of it follows its metadata.

use eframe::egui::{
    self, Align, Button, Color32, DragValue, Key, Label, Layout, Popup, PopupCloseBehavior, Rect,
    Response, RichText, Role, Sense, Slider, SliderClamping, TextEdit, Ui, WidgetInfo, pos2, vec2,
};
use impasto_compiler::interface::Value;

use super::super::desk::Desk;
use super::super::theme;
use super::super::values::{self, Control};
use super::{named, picker};
use crate::engine::{Param, ParamId};

/// Points that a name has, and a field of a number.
const NAME: f32 = 96.0;
const FIELD: f32 = 68.0;

/// Draws a parameter.
pub fn show(ui: &mut Ui, desk: &mut Desk, id: &ParamId, param: &Param) {
    let value = desk.value(id, param).clone();
    let is_set = desk.is_set(id, param);
    let is_open = param.interface.settable && !param.is_animated;
    let control = values::control(&param.interface, &value);
    let mut next = None;
    ui.horizontal(|ui| {
        let name = name(ui, param, is_set, is_open);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            reset(ui, desk, id, param, is_set);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.add_enabled_ui(is_open, |ui| {
                    next = edited(ui, id, param, control, &value, &name);
                })
                .response
                .on_disabled_hover_text(why_closed(param));
            });
        });
    });
    if control == Control::Vector
        && let Value::Components(components) = &value
    {
        ui.add_enabled_ui(is_open, |ui| {
            if let Some(components) = fields(ui, param, components) {
                next = Some(Value::Components(components));
            }
        });
    }
    if let Some(next) = next {
        desk.set(id, next);
    }
}

fn why_closed(param: &Param) -> &'static str {
    if param.is_animated {
        "Keys of the scene move it: edit them in the file"
    } else {
        "It is an input of the surface, which a scene cannot set"
    }
}

fn name(ui: &mut Ui, param: &Param, is_set: bool, is_open: bool) -> Response {
    let interface = &param.interface;
    let color = match (is_set, is_open) {
        (true, _) => theme::ACCENT,
        (false, true) => theme::TEXT,
        (false, false) => theme::QUIET,
    };
    let text = RichText::new(&interface.label).color(color);
    let width = NAME.min(0.34 * ui.available_width());
    let size = vec2(width, ui.spacing().interact_size.y);
    let (rect, area) = ui.allocate_exact_size(size, Sense::hover());
    let mut inside = ui.new_child(
        egui::UiBuilder::new()
            .max_rect(rect)
            .layout(Layout::left_to_right(Align::Center)),
    );
    let label = Label::new(text).truncate().show_tooltip_when_elided(false);
    let label = inside.add(label.selectable(false));
    // All of the room for a name tells of it, and not its letters alone.
    area.on_hover_ui(|ui| tooltip(ui, param, is_open));
    label
}

fn tooltip(ui: &mut Ui, param: &Param, is_open: bool) {
    let interface = &param.interface;
    ui.set_max_width(340.0);
    ui.label(RichText::new(&interface.label).strong());
    if !interface.docs.is_empty() {
        ui.label(&interface.docs);
    }
    if !is_open {
        ui.label(RichText::new(why_closed(param)).color(theme::WARNING));
    }
    let mut facts = format!("{}: {}", interface.name, interface.ty);
    if interface.hard.is_some() {
        let [low, high] = values::limits(interface);
        let (unit, _) = values::unit(interface);
        facts += &format!(" in {low} .. {high} {unit}");
    }
    ui.label(super::quiet(facts.trim_end()));
    ui.label(super::quiet(format!("default {}", interface.default_text)));
}

/// A dot where the value is another than that of the scene; a click takes it back.
fn reset(ui: &mut Ui, desk: &mut Desk, id: &ParamId, param: &Param, is_set: bool) {
    let size = vec2(14.0, ui.spacing().interact_size.y);
    if !is_set {
        ui.allocate_exact_size(size, Sense::hover());
        return;
    }
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let label = format!("Reset {}", param.interface.label);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &label));
    let radius = if response.hovered() { 5.0 } else { 3.5 };
    ui.painter()
        .circle_filled(rect.center(), radius, theme::ACCENT);
    let response = response.on_hover_text(match &param.written {
        Some(written) => format!("Reset to {written}, as the scene has it"),
        None => format!("Reset to the default, {}", param.interface.default_text),
    });
    if response.clicked() {
        desk.reset(id);
    }
}

/// The control; what a hand made of the value.
fn edited(
    ui: &mut Ui,
    id: &ParamId,
    param: &Param,
    control: Control,
    value: &Value,
    name: &Response,
) -> Option<Value> {
    match (control, value) {
        (Control::Switch, Value::Bool(is_on)) => {
            let mut is_on = *is_on;
            let response = ui.checkbox(&mut is_on, "").labelled_by(name.id);
            response.changed().then_some(Value::Bool(is_on))
        }
        (Control::Whole, Value::Int(i)) => {
            let x = number(ui, param, f64::from(*i), true, name)?;
            Some(Value::Int(x.round() as i32))
        }
        (Control::Number, Value::Number(x)) => {
            let shown = values::shown(&param.interface, *x);
            let x = number(ui, param, shown, false, name)?;
            Some(Value::Number(values::given(&param.interface, x)))
        }
        (Control::Color, Value::Components(c)) => {
            let linear = [c[0], c[1], c[2]];
            let next = color(ui, id, param, linear)?;
            Some(Value::Components(next.to_vec()))
        }
        (Control::Path | Control::Text, Value::Text(text)) => {
            let next = path(ui, id, text, name)?;
            Some(Value::Text(next))
        }
        _ => None,
    }
}

/// A slider between the soft limits, and a field within the hard ones.
fn number(ui: &mut Ui, param: &Param, shown: f64, is_whole: bool, name: &Response) -> Option<f64> {
    let interface = &param.interface;
    let ends = values::ends(interface);
    let [low, high] = values::limits(interface);
    let (unit, _) = values::unit(interface);
    let mut next = shown;
    let width = ui.available_width() - FIELD - ui.spacing().item_spacing.x;
    let mut has_changed = false;
    if width > 24.0 {
        ui.spacing_mut().slider_width = width;
        let mut slider = Slider::new(&mut next, ends.low..=ends.high)
            .logarithmic(ends.is_log)
            .clamping(SliderClamping::Never)
            .show_value(false);
        if is_whole {
            slider = slider.integer();
        }
        has_changed |= ui.add(slider).labelled_by(name.id).changed();
    }
    let speed = if is_whole {
        0.1
    } else {
        ((ends.high - ends.low) / 400.0).max(1e-9)
    };
    let mut field = DragValue::new(&mut next)
        .range(low..=high)
        .speed(speed)
        .max_decimals(if is_whole {
            0
        } else {
            decimals(ends.high - ends.low)
        })
        .update_while_editing(false);
    if !unit.is_empty() {
        field = field.suffix(format!(" {unit}"));
    }
    let size = vec2(
        FIELD.min(ui.available_width()),
        ui.spacing().interact_size.y,
    );
    has_changed |= ui.add_sized(size, field).labelled_by(name.id).changed();
    (has_changed && next != shown).then_some(next)
}

/// Digits behind the point that matter in a range of this width.
fn decimals(width: f64) -> usize {
    let digits = (3.0 - width.abs().max(1e-12).log10()).ceil();
    digits.clamp(0.0, 9.0) as usize
}

/// A field for each component.
fn fields(ui: &mut Ui, param: &Param, components: &[f32]) -> Option<Vec<f32>> {
    let interface = &param.interface;
    let ends = values::ends(interface);
    let [low, high] = values::limits(interface);
    let mut next = components.to_vec();
    let mut has_changed = false;
    ui.horizontal(|ui| {
        ui.add_space(8.0);
        let gaps = ui.spacing().item_spacing.x * components.len() as f32;
        let width = (ui.available_width() - 20.0 - gaps) / components.len().max(1) as f32;
        for (i, component) in next.iter_mut().enumerate() {
            let mut shown = values::shown(interface, *component);
            let axis = ["x ", "y ", "z ", "w "].get(i).copied().unwrap_or("");
            let field = DragValue::new(&mut shown)
                .range(low..=high)
                .speed(((ends.high - ends.low) / 400.0).max(1e-9))
                .max_decimals(4)
                .prefix(axis)
                .update_while_editing(false);
            let size = vec2(width.max(20.0), ui.spacing().interact_size.y);
            let response = ui.add_sized(size, field);
            named(&response, &format!("{} {}", interface.label, axis.trim()));
            if response.changed() {
                *component = values::given(interface, shown);
                has_changed = true;
            }
        }
    });
    has_changed.then_some(next)
}

/// A plate of the color, which opens a picker.
fn color(ui: &mut Ui, id: &ParamId, param: &Param, linear: [f32; 3]) -> Option<[f32; 3]> {
    let strength = linear.iter().fold(1.0, |most: f32, x| most.max(*x));
    let shown = linear.map(|x| super::super::tone::srgb((x / strength).clamp(0.0, 1.0)));
    let [r, g, b] = shown.map(|x| (255.0 * x + 0.5) as u8);
    let height = ui.spacing().interact_size.y;
    let width = (ui.available_width() - FIELD - ui.spacing().item_spacing.x).max(30.0);
    let (rect, button) = ui.allocate_exact_size(vec2(width, height), Sense::click());
    let label = format!("{} color", param.interface.label);
    button.widget_info(|| WidgetInfo::labeled(Role::ColorWell, ui.is_enabled(), &label));
    plate(ui, rect, Color32::from_rgb(r, g, b), &button);
    let mut next = None;
    let mut digits = values::hex(linear.map(|x| x / strength));
    let at = ui.scope_id().with((id, "digits"));
    if let Some(draft) = ui.data(|d| d.get_temp::<String>(at)) {
        digits = draft;
    }
    let field = TextEdit::singleline(&mut digits)
        .font(egui::FontId::monospace(11.5))
        .margin(egui::Margin::symmetric(5, 3))
        .desired_width(FIELD - 10.0);
    let field = ui.add(field).on_hover_text("sRGB, six digits");
    named(&field, &format!("{} digits", param.interface.label));
    if field.has_focus() {
        ui.data_mut(|d| d.insert_temp(at, digits.clone()));
    }
    if field.lost_focus() {
        ui.data_mut(|d| d.remove_temp::<String>(at));
        let typed = values::from_hex(&digits).filter(|_| !ui.input(|i| i.key_pressed(Key::Escape)));
        next = typed.map(|c| c.map(|x| x * strength));
    }
    Popup::from_toggle_button_response(&button)
        .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| {
            if let Some(picked) = picker::show(ui, &param.interface.label, linear, strength) {
                next = Some(picked);
            }
        });
    next.filter(|next| *next != linear)
}

fn plate(ui: &Ui, rect: Rect, color: Color32, response: &Response) {
    let painter = ui.painter();
    let shade = if ui.is_enabled() {
        color
    } else {
        color.gamma_multiply(0.4)
    };
    painter.rect_filled(rect, 3.0, shade);
    let edge = if response.hovered() { 0xb0 } else { 0x50 };
    let stroke = egui::Stroke::new(1.0, Color32::from_gray(edge));
    painter.rect_stroke(rect, 3.0, stroke, egui::StrokeKind::Inside);
}

/// A text that counts when it is entered, and not letter by letter.
fn path(ui: &mut Ui, id: &ParamId, text: &str, name: &Response) -> Option<String> {
    let at = ui.scope_id().with((id, "draft"));
    let draft = ui.data(|d| d.get_temp::<String>(at));
    let mut shown = draft.unwrap_or_else(|| text.to_owned());
    let field = TextEdit::singleline(&mut shown).desired_width(ui.available_width() - 8.0);
    let response = ui.add(field).labelled_by(name.id);
    if response.has_focus() {
        ui.data_mut(|d| d.insert_temp(at, shown.clone()));
    }
    if response.lost_focus() {
        ui.data_mut(|d| d.remove_temp::<String>(at));
        let is_left = ui.input(|i| i.key_pressed(Key::Escape));
        return (!is_left && shown != text).then_some(shown);
    }
    None
}

/// A small button at the end of a line.
pub fn small(ui: &mut Ui, text: &str) -> Response {
    ui.add(Button::new(RichText::new(text).size(12.0)).min_size(vec2(0.0, 18.0)))
}

/// A thin line under a group's name.
pub fn group(ui: &mut Ui, name: &str) {
    ui.add_space(3.0);
    ui.horizontal(|ui| {
        let label = ui.label(super::quiet(name));
        let y = label.rect.center().y;
        let line = [
            pos2(label.rect.right() + 6.0, y),
            pos2(ui.max_rect().right() - 4.0, y),
        ];
        ui.painter()
            .line_segment(line, egui::Stroke::new(1.0, Color32::from_gray(0x36)));
    });
}
