//! The picker of a color: a square of saturation and value and a strip of hues, in sRGB as screens have it. What it gives is
//! linear, as the language has it.

use eframe::egui::{
    Color32, DragValue, Mesh, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke,
    StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use super::super::{tone, values};
use super::{named, quiet};

/// Squares along the side of a gradient.
const STEPS: u32 = 16;

/// Draws it for a linear color whose greatest component is `strength` if that is above 1: the picker shows it without, and
/// gives it with. What a hand made of the color.
pub fn show(ui: &mut Ui, name: &str, linear: [f32; 3], strength: f32) -> Option<[f32; 3]> {
    // Greys have no hue, and black no saturation: what they had is kept while the color is what was made last.
    let at = ui.scope_id().with("made");
    let made: Option<([f32; 3], [f32; 3])> = ui.data(|d| d.get_temp(at));
    let srgb = linear.map(|x| tone::srgb((x / strength).clamp(0.0, 1.0)));
    let before = match made {
        Some((color, hsv)) if color == linear => hsv,
        _ => values::hsv(srgb),
    };
    let mut hsv = before;
    square(ui, name, &mut hsv);
    ui.add_space(4.0);
    strip(ui, name, &mut hsv);
    ui.add_space(4.0);
    let mut next = None;
    if hsv != before {
        let color = values::from_hsv(hsv).map(|x| tone::linear(x) * strength);
        ui.data_mut(|d| d.insert_temp(at, (color, hsv)));
        next = Some(color);
    }
    numbers(ui, linear).or(next)
}

fn square(ui: &mut Ui, name: &str, hsv: &mut [f32; 3]) {
    let (rect, response) = ui.allocate_exact_size(vec2(216.0, 150.0), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::ColorWell, true, format!("{name} shade")));
    if let Some(at) = held(&response) {
        hsv[1] = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        hsv[2] = ((rect.bottom() - at.y) / rect.height()).clamp(0.0, 1.0);
    }
    let hue = hsv[0];
    gradient(ui.painter(), rect, STEPS, STEPS, |x, y| [hue, x, 1.0 - y]);
    let at = pos2(
        rect.left() + hsv[1] * rect.width(),
        rect.bottom() - hsv[2] * rect.height(),
    );
    ring(ui.painter(), at, color(*hsv));
}

fn strip(ui: &mut Ui, name: &str, hsv: &mut [f32; 3]) {
    let (rect, response) = ui.allocate_exact_size(vec2(216.0, 14.0), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::ColorWell, true, format!("{name} hue")));
    if let Some(at) = held(&response) {
        hsv[0] = ((at.x - rect.left()) / rect.width()).clamp(0.0, 0.9999);
    }
    gradient(ui.painter(), rect, 6 * STEPS, 1, |x, _| [x, 0.85, 0.9]);
    let at = pos2(rect.left() + hsv[0] * rect.width(), rect.center().y);
    ring(ui.painter(), at, color([hsv[0], 0.85, 0.9]));
}

/// Where a hand holds a widget.
fn held(response: &Response) -> Option<Pos2> {
    let is_held = response.is_pointer_button_down_on();
    response.interact_pointer_pos().filter(|_| is_held)
}

fn color(hsv: [f32; 3]) -> Color32 {
    let [r, g, b] = values::from_hsv(hsv).map(|x| (255.0 * x.clamp(0.0, 1.0) + 0.5) as u8);
    Color32::from_rgb(r, g, b)
}

fn gradient(
    painter: &Painter,
    rect: Rect,
    columns: u32,
    rows: u32,
    hsv: impl Fn(f32, f32) -> [f32; 3],
) {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let (x, y) = (column as f32 / columns as f32, row as f32 / rows as f32);
            let at = rect.min + vec2(x, y) * rect.size();
            mesh.colored_vertex(at, color(hsv(x, y)));
        }
    }
    let stride = columns + 1;
    for row in 0..rows {
        for column in 0..columns {
            let corner = row * stride + column;
            mesh.add_triangle(corner, corner + 1, corner + stride);
            mesh.add_triangle(corner + 1, corner + stride, corner + stride + 1);
        }
    }
    painter.add(Shape::mesh(mesh));
    let edge = Stroke::new(1.0, Color32::from_gray(0x50));
    painter.rect_stroke(rect, 0.0, edge, StrokeKind::Outside);
}

fn ring(painter: &Painter, at: Pos2, fill: Color32) {
    painter.circle(
        at,
        6.0,
        fill,
        Stroke::new(2.5, Color32::from_black_alpha(160)),
    );
    painter.circle_stroke(at, 6.0, Stroke::new(1.2, Color32::WHITE));
}

/// The linear components, as numbers.
fn numbers(ui: &mut Ui, linear: [f32; 3]) -> Option<[f32; 3]> {
    let mut components = linear;
    ui.horizontal(|ui| {
        ui.label(quiet("linear"));
        for (component, prefix) in components.iter_mut().zip(["r ", "g ", "b "]) {
            let mut shown = values::exact(*component);
            let field = DragValue::new(&mut shown)
                .range(0.0..=f64::INFINITY)
                .speed(0.004)
                .max_decimals(3)
                .prefix(prefix)
                .update_while_editing(false);
            let response = ui.add_sized([52.0, 20.0], field);
            named(&response, &format!("linear {prefix}"));
            if response.changed() {
                *component = shown as f32;
            }
        }
    });
    (components != linear).then_some(components)
}
