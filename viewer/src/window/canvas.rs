//! The picture in the window: where hands turn the camera, pick, crop and wipe, and over which paths and legends lie.
//!
//! Pixels become a texture when the picture or how it is shown changes, and not when a hand only moves over it.

use std::sync::Arc;

use eframe::egui::{
    Align2, Color32, ColorImage, Context, CornerRadius, CursorIcon, FontId, Modifiers, Painter,
    PointerButton, Pos2, Rect, Response, Role, Sense, Stroke, StrokeKind, TextureFilter,
    TextureHandle, TextureOptions, Ui, WidgetInfo, pos2, vec2,
};
use glam::Vec3;

use super::compare::{self, Difference, Mode};
use super::desk::{Desk, Tool};
use super::keys::Command;
use super::picture::{self, Legend, Look, Values};
use super::tone::{Encoder, index_color};
use super::view::{self, Area, View};
use super::{project, theme};
use crate::engine::Picture;

/// Points of the screen for each pixel from which on its values stand on it.
const ROOM_FOR_TEXT: f32 = 44.0;

/// What a drag does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drag {
    Orbit,
    Pan,
    Dolly,
    Shift,
    Crop([u32; 2]),
    Wipe,
}

/// How near to the line of a wipe a hand takes hold of it, in points.
const GRIP: f32 = 5.0;

/// What an image was made of; another one is made when it is not this any more.
#[derive(Clone, PartialEq)]
struct Made {
    picture: (usize, u64),
    reference: Option<usize>,
    look: Look,
    layer: Option<String>,
    overlay: Option<(String, f32)>,
    mode: Mode,
    factor: usize,
}

/// The picture in the window.
#[derive(Default)]
pub struct Canvas {
    view: View,
    drag: Option<Drag>,
    crop: Option<[[u32; 2]; 2]>,
    /// The pixel under the hand.
    pub hover: Option<[u32; 2]>,
    encoder: Option<Encoder>,
    made: Option<Made>,
    main: Option<TextureHandle>,
    other: Option<TextureHandle>,
    legend: Option<Legend>,
    /// The difference to the snapshot, if that is shown.
    pub difference: Option<Difference>,
    /// Why there is no image though there is a picture.
    lacks: Option<String>,
    area: Option<Area>,
    /// Images that were made so far, for tests.
    pub images: u64,
}

impl Canvas {
    /// Does what concerns the picture's place.
    pub fn command(&mut self, command: Command) {
        let Some(area) = self.area else {
            return;
        };
        match command {
            Command::Fit => self.view.fit(),
            Command::ActualPixels => self.view.zoom_to(1.0, area.rect.center(), &area),
            Command::Larger => self.view.step(true, &area),
            Command::Smaller => self.view.step(false, &area),
            _ => {}
        }
    }

    /// Pixels of the screen for each of the picture.
    pub fn zoom(&self) -> Option<f32> {
        self.area.map(|area| self.view.zoom(&area))
    }

    /// Where the picture lies, in points.
    pub fn placed(&self) -> Option<Rect> {
        self.area.map(|area| self.view.placed(&area))
    }

    /// Draws the picture into what room there is, and follows the hands on it.
    pub fn show(&mut self, ui: &mut Ui, desk: &mut Desk) {
        let rect = ui.available_rect_before_wrap();
        let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Picture"));
        ui.advance_cursor_after_rect(rect);
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, theme::SURROUND);
        if rect.width() < 1.0 || rect.height() < 1.0 {
            return;
        }
        let Some(picture) = desk.picture().map(Arc::clone) else {
            self.hover = None;
            self.drag = None;
            nothing_yet(&painter, rect, desk);
            return;
        };
        let area = Area {
            rect,
            size: [picture.width, picture.height],
            scale: ui.ctx().pixels_per_point(),
        };
        self.area = Some(area);
        self.handle(ui, &response, desk);
        let placed = self.view.placed(&area);
        self.refresh(ui.ctx(), desk, &picture, &area);
        self.draw(ui, &painter, desk, &picture, placed);
    }

    fn handle(&mut self, ui: &Ui, response: &Response, desk: &mut Desk) {
        let Some(area) = self.area else {
            return;
        };
        let size = area.size;
        let placed = self.view.placed(&area);
        let (modifiers, origin, wheel, magnified) = ui.input(|i| {
            (
                i.modifiers,
                i.pointer.press_origin(),
                i.smooth_scroll_delta().y,
                i.zoom_delta(),
            )
        });
        let pointer = response.hover_pos();
        self.hover = pointer.and_then(|at| view::pixel_at(placed, size, at));
        if let Some(at) = pointer {
            if magnified != 1.0 {
                self.view
                    .zoom_to(self.view.zoom(&area) * magnified, at, &area);
            } else if wheel != 0.0 && !modifiers.command {
                desk.dolly(wheel / 40.0);
            }
        }
        if response.drag_started() {
            // Where the hand pressed, and not where it is by now: frames may be slower than hands.
            let line = wipe_at(desk, placed).filter(|_| self.other.is_some());
            let is_line = origin
                .zip(line)
                .is_some_and(|(at, x)| (at.x - x).abs() <= GRIP);
            let start = origin.map(|at| view::pixel_near(placed, size, at));
            self.drag = if is_line && response.dragged_by(PointerButton::Primary) {
                Some(Drag::Wipe)
            } else {
                begun(response, modifiers, desk.tool, start)
            };
        }
        if let Some(drag) = self.drag {
            self.follow(response, desk, drag, &area);
        }
        if response.drag_stopped() || !response.dragged() && self.drag.is_some() {
            if let (Some(Drag::Crop(_)), Some(crop)) = (self.drag, self.crop.take()) {
                desk.crop_to(Some(crop));
                desk.tool = Tool::Orbit;
            }
            self.drag = None;
        }
        let clicked = response.interact_pointer_pos();
        let clicked = clicked.and_then(|at| view::pixel_at(placed, size, at));
        if let Some(pixel) = clicked {
            if response.double_clicked() && desk.tool == Tool::Orbit {
                desk.aim(pixel);
            } else if response.clicked() {
                let tool = match (modifiers.command, modifiers.shift) {
                    (true, _) => Tool::Focus,
                    (_, true) => Tool::Trace,
                    _ => desk.tool,
                };
                desk.click(pixel, tool);
            }
        }
        if response.hovered() {
            let icon = match (self.drag, desk.tool) {
                (Some(Drag::Orbit | Drag::Pan | Drag::Dolly | Drag::Shift), _) => {
                    CursorIcon::Grabbing
                }
                (_, Tool::Orbit) => CursorIcon::Default,
                _ => CursorIcon::Crosshair,
            };
            ui.ctx().set_cursor_icon(icon);
        }
    }

    fn follow(&mut self, response: &Response, desk: &mut Desk, drag: Drag, area: &Area) {
        let delta = response.drag_delta();
        let placed = self.view.placed(area);
        let share = delta / placed.height().max(1.0);
        let moved = delta.x != 0.0 || delta.y != 0.0;
        match drag {
            Drag::Crop(start) => {
                if let Some(at) = response.interact_pointer_pos() {
                    let end = view::pixel_near(placed, area.size, at);
                    let low = [start[0].min(end[0]), start[1].min(end[1])];
                    let high = [start[0].max(end[0]) + 1, start[1].max(end[1]) + 1];
                    self.crop = Some([low, high]);
                }
            }
            Drag::Wipe => {
                if let Some(at) = response.interact_pointer_pos() {
                    let share = (at.x - placed.left()) / placed.width().max(1.0);
                    desk.wipe = share.clamp(0.0, 1.0);
                }
            }
            _ if !moved => {}
            Drag::Orbit => desk.drag_orbit(share.x, share.y),
            Drag::Pan => desk.drag_pan(share.x, share.y),
            Drag::Dolly => desk.dolly((share.x - share.y) * 12.0),
            Drag::Shift => self.view.shift(delta, area),
        }
    }

    /// Makes the textures again if what they are made of has changed.
    fn refresh(&mut self, ctx: &Context, desk: &Desk, picture: &Arc<Picture>, area: &Area) {
        let reference = desk.reference().map(|s| Arc::clone(&s.picture));
        let most = ctx.input(|i| i.max_texture_side).max(64);
        let longest = picture.width.max(picture.height) as usize;
        // Fewer texels where the screen has fewer pixels, so that what is left is a mean and no choice.
        let wanted = (1.0 / self.view.zoom(area)).floor().max(1.0) as usize;
        let factor = wanted.max(longest.div_ceil(most));
        let made = Made {
            picture: (Arc::as_ptr(picture) as usize, picture.number),
            reference: reference.as_ref().map(|r| Arc::as_ptr(r) as usize),
            look: desk.look,
            layer: desk.layer.clone(),
            overlay: desk.overlay.clone().map(|name| (name, desk.overlay_share)),
            mode: if reference.is_some() {
                desk.compare
            } else {
                Mode::Off
            },
            factor,
        };
        if self.made.as_ref() == Some(&made) {
            return;
        }
        self.images += 1;
        let look = &desk.look;
        let encoder = self.encoder.take();
        let encoder = encoder.filter(|e| e.is(look.curve, look.exposure));
        let encoder = encoder.unwrap_or_else(|| Encoder::new(look.curve, look.exposure));
        self.difference = None;
        self.lacks = None;
        let whole = match (&reference, made.mode) {
            (Some(reference), mode) if mode.is_difference() => {
                self.difference = compare::difference(picture, reference, mode);
                if self.difference.is_none() {
                    self.lacks = Some(format!(
                        "The snapshot has {} x {} pixels, the picture {} x {}",
                        reference.width, reference.height, picture.width, picture.height
                    ));
                }
                self.difference.as_ref().map(|d| {
                    let values = Values::Light((&d.pixels[..]).into());
                    picture::image(&values, sizes(picture), look, &encoder, &[])
                })
            }
            (Some(reference), Mode::Flip) => image_of(reference, desk, &encoder),
            _ => image_of(picture, desk, &encoder),
        };
        if whole.is_none() && self.lacks.is_none() {
            let name = desk.layer.as_deref().unwrap_or("the picture");
            self.lacks = Some(format!("{name} is not recorded yet"));
        }
        self.legend = whole.as_ref().and_then(|w| w.legend.clone());
        let whole = whole.or_else(|| {
            // Something is better than nothing while it comes.
            let values = picture::values(picture, None)?;
            Some(picture::image(&values, sizes(picture), look, &encoder, &[]))
        });
        if let Some(whole) = whole {
            upload(ctx, &mut self.main, "picture", whole.image, factor);
        }
        match (&reference, made.mode) {
            (Some(reference), Mode::Wipe) => {
                let other = image_of(reference, desk, &encoder).or_else(|| {
                    let values = picture::values(reference, None)?;
                    Some(picture::image(
                        &values,
                        sizes(reference),
                        look,
                        &encoder,
                        &[],
                    ))
                });
                if let Some(other) = other {
                    upload(ctx, &mut self.other, "snapshot", other.image, factor);
                }
            }
            _ => self.other = None,
        }
        self.encoder = Some(encoder);
        self.made = Some(made);
    }

    fn draw(
        &mut self,
        ui: &mut Ui,
        painter: &Painter,
        desk: &Desk,
        picture: &Picture,
        placed: Rect,
    ) {
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        if let Some(main) = &self.main {
            painter.image(main.id(), placed, uv, Color32::WHITE);
        }
        if let Some(other) = self.other.as_ref().map(TextureHandle::id) {
            let line = wipe_at(desk, placed).unwrap_or(placed.right());
            let right = Rect::from_min_max(pos2(line, placed.top()), placed.max);
            let clipped = painter.with_clip_rect(right.intersect(painter.clip_rect()));
            clipped.image(other, placed, uv, Color32::WHITE);
            wipe_line(ui, painter, desk, placed, line);
        }
        let size = [picture.width, picture.height];
        self.pixel_texts(painter, desk, picture, placed);
        self.draw_crop(painter, desk, size, placed);
        draw_path(painter, desk, picture, placed);
        if let Some(pixel) = desk.picked_pixel() {
            let low = view::corner(placed, size, pixel);
            let high = view::corner(placed, size, [pixel[0] + 1, pixel[1] + 1]);
            cross(painter, low + (high - low) * 0.5);
        }
        if let Some(legend) = &self.legend {
            draw_legend(painter, legend, desk);
        }
        if let Some(lacks) = &self.lacks {
            let top = painter.clip_rect().center_top() + vec2(0.0, 8.0);
            label(painter, top, Align2::CENTER_TOP, lacks, theme::WARNING);
        }
    }

    /// The values of pixels on the pixels, where they are large enough.
    fn pixel_texts(&self, painter: &Painter, desk: &Desk, picture: &Picture, placed: Rect) {
        let room = placed.width() / picture.width.max(1) as f32;
        if room < ROOM_FOR_TEXT || self.difference.is_some() {
            return;
        }
        let size = [picture.width, picture.height];
        let seen = painter.clip_rect().intersect(placed);
        let (from, to) = (
            view::pixel_near(placed, size, seen.min),
            view::pixel_near(placed, size, seen.max),
        );
        let font = FontId::monospace((room / 5.0).clamp(9.0, 13.0));
        let step = font.size + 1.0;
        for row in from[1]..=to[1] {
            for column in from[0]..=to[0] {
                let share = (column as f32 + 0.5) / size[0] as f32;
                let Some(shown) = desk.seen_at(share) else {
                    continue;
                };
                let index = row as usize * shown.width as usize + column as usize;
                let texts = picture::texts(shown, desk.layer.as_deref(), index);
                let corner = view::corner(placed, size, [column, row]);
                let cell = Rect::from_min_size(corner, vec2(room, room));
                painter.rect_stroke(
                    cell,
                    0.0,
                    Stroke::new(1.0, Color32::from_black_alpha(50)),
                    StrokeKind::Inside,
                );
                let top = cell.center().y - 0.5 * step * texts.len() as f32;
                for (line, text) in texts.iter().enumerate() {
                    let at = pos2(cell.center().x, top + step * line as f32);
                    for (shift, color) in [
                        (vec2(1.0, 1.0), Color32::from_black_alpha(200)),
                        (vec2(0.0, 0.0), Color32::from_gray(235)),
                    ] {
                        painter.text(at + shift, Align2::CENTER_TOP, text, font.clone(), color);
                    }
                }
            }
        }
    }

    fn draw_crop(&self, painter: &Painter, desk: &Desk, size: [u32; 2], placed: Rect) {
        let Some([from, to]) = self.crop.or(desk.crop) else {
            return;
        };
        let inner = Rect::from_min_max(
            view::corner(placed, size, from),
            view::corner(placed, size, to),
        );
        let shade = Color32::from_black_alpha(if self.crop.is_some() { 110 } else { 70 });
        let seen = placed;
        for part in [
            Rect::from_min_max(seen.min, pos2(seen.max.x, inner.min.y)),
            Rect::from_min_max(pos2(seen.min.x, inner.max.y), seen.max),
            Rect::from_min_max(
                pos2(seen.min.x, inner.min.y),
                pos2(inner.min.x, inner.max.y),
            ),
            Rect::from_min_max(
                pos2(inner.max.x, inner.min.y),
                pos2(seen.max.x, inner.max.y),
            ),
        ] {
            painter.rect_filled(part, 0.0, shade);
        }
        let stroke = Stroke::new(1.0, theme::ACCENT);
        painter.rect_stroke(inner, 0.0, stroke, StrokeKind::Outside);
    }
}

fn begun(
    response: &Response,
    modifiers: Modifiers,
    tool: Tool,
    start: Option<[u32; 2]>,
) -> Option<Drag> {
    if response.dragged_by(PointerButton::Middle) {
        return Some(Drag::Pan);
    }
    if response.dragged_by(PointerButton::Secondary) {
        return Some(Drag::Dolly);
    }
    Some(match (modifiers.command, modifiers.shift, tool) {
        (true, _, _) => Drag::Shift,
        (_, true, _) => Drag::Pan,
        (_, _, Tool::Crop) => Drag::Crop(start?),
        _ => Drag::Orbit,
    })
}

fn sizes(picture: &Picture) -> [usize; 2] {
    [picture.width as usize, picture.height as usize]
}

/// What a layer has. Kernels have the colors that the list of kernels has.
fn values_of<'a>(picture: &'a Picture, name: Option<&str>, desk: &Desk) -> Option<Values<'a>> {
    let mut values = picture::values(picture, name)?;
    if let (Some("kernel"), Values::Indices(_, names, colors)) = (name, &mut values) {
        let kernels = &desk.news.kernels.kernels;
        for (name, color) in names.iter().zip(colors) {
            if let Some(index) = kernels.iter().position(|kernel| kernel.name == *name) {
                *color = index_color(index);
            }
        }
    }
    Some(values)
}

/// The image of a picture as the desk has it shown; nothing if it lacks the layer.
fn image_of(picture: &Picture, desk: &Desk, encoder: &Encoder) -> Option<picture::Shown> {
    let values = values_of(picture, desk.layer.as_deref(), desk)?;
    let lost: &[u32] = match desk.layer {
        None => &picture.nonfinite_pixels,
        Some(_) => &[],
    };
    let mut shown = picture::image(&values, sizes(picture), &desk.look, encoder, lost);
    if desk.layer.is_none()
        && let Some(name) = &desk.overlay
        && let Some(values) = values_of(picture, Some(name), desk)
    {
        let over = picture::image(&values, sizes(picture), &desk.look, encoder, &[]);
        picture::blended(&mut shown.image, &over.image, desk.overlay_share);
        shown.legend = over.legend;
    }
    Some(shown)
}

fn upload(
    ctx: &Context,
    texture: &mut Option<TextureHandle>,
    name: &str,
    image: ColorImage,
    factor: usize,
) {
    let options = TextureOptions {
        magnification: TextureFilter::Nearest,
        minification: TextureFilter::Linear,
        ..TextureOptions::NEAREST
    };
    let image = match factor {
        0 | 1 => image,
        factor => picture::reduced(&image, factor),
    };
    match texture {
        Some(texture) => texture.set(image, options),
        None => *texture = Some(ctx.load_texture(name, image, options)),
    }
}

fn nothing_yet(painter: &Painter, rect: Rect, desk: &Desk) {
    use crate::engine::State;
    let text = match &desk.news.state {
        State::Reading => "Reading files",
        State::Compiling => "Compiling materials",
        State::Building => "Building kernels",
        State::Broken => "The files have errors",
        State::Failed(why) => why,
        _ => "Waiting for the first samples",
    };
    let galley = painter.layout(
        text.to_owned(),
        FontId::proportional(15.0),
        theme::QUIET,
        (rect.width() - 40.0).max(40.0),
    );
    let corner = rect.center() - 0.5 * galley.size();
    painter.galley(corner, galley, theme::QUIET);
}

/// A text on a plate of its own.
fn label(painter: &Painter, at: Pos2, align: Align2, text: &str, color: Color32) -> Rect {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), color);
    let rect = align.anchor_size(at, galley.size() + vec2(12.0, 6.0));
    painter.rect_filled(rect, CornerRadius::same(3), Color32::from_black_alpha(190));
    painter.galley(rect.min + vec2(6.0, 3.0), galley, color);
    rect
}

/// Where the line of the wipe is, if there is one.
fn wipe_at(desk: &Desk, placed: Rect) -> Option<f32> {
    let line = placed.left() + desk.wipe.clamp(0.0, 1.0) * placed.width();
    (desk.compare == Mode::Wipe && desk.reference().is_some()).then_some(line)
}

fn wipe_line(ui: &mut Ui, painter: &Painter, desk: &Desk, placed: Rect, line: f32) {
    let shown = placed.intersect(painter.clip_rect());
    if !shown.is_positive() {
        return;
    }
    let grip = Rect::from_min_max(
        pos2(line - GRIP, shown.top()),
        pos2(line + GRIP, shown.bottom()),
    );
    // The picture itself follows a drag of the line; this only shows that there is one.
    let response = ui.interact(grip, ui.scope_id().with("wipe"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Splitter, true, "Wipe line"));
    if response.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    for (width, color) in [(3.0, Color32::from_black_alpha(140)), (1.0, Color32::WHITE)] {
        painter.line_segment(
            [pos2(line, shown.top()), pos2(line, shown.bottom())],
            Stroke::new(width, color),
        );
    }
    let name = desk.reference().map_or(String::new(), |s| s.name.clone());
    let top = shown.top() + 6.0;
    label(
        painter,
        pos2(line - 6.0, top),
        Align2::RIGHT_TOP,
        "now",
        theme::TEXT,
    );
    label(
        painter,
        pos2(line + 6.0, top),
        Align2::LEFT_TOP,
        &name,
        theme::TEXT,
    );
}

fn cross(painter: &Painter, at: Pos2) {
    for (width, color) in [(3.0, Color32::from_black_alpha(160)), (1.0, theme::ACCENT)] {
        let stroke = Stroke::new(width, color);
        for [from, to] in [
            [vec2(-11.0, 0.0), vec2(-4.0, 0.0)],
            [vec2(4.0, 0.0), vec2(11.0, 0.0)],
            [vec2(0.0, -11.0), vec2(0.0, -4.0)],
            [vec2(0.0, 4.0), vec2(0.0, 11.0)],
        ] {
            painter.line_segment([at + from, at + to], stroke);
        }
    }
}

/// The path that was traced, as the picture's camera sees it.
fn draw_path(painter: &Painter, desk: &Desk, picture: &Picture, placed: Rect) {
    let camera = picture.camera.or(desk.camera());
    let (Some(traced), Some(camera)) = (&desk.traced, camera) else {
        return;
    };
    let painter = painter.with_clip_rect(placed.intersect(painter.clip_rect()));
    let aspect = picture.width.max(1) as f32 / picture.height.max(1) as f32;
    // Far outside, lines are no longer drawn well: cut to some times the picture.
    let place = |at: [f32; 2]| {
        let at = at.map(|x| x.clamp(-20.0, 21.0));
        placed.min + vec2(at[0], at[1]) * placed.size()
    };
    let vertices: Vec<Vec3> = traced.vertices.iter().map(|v| Vec3::from(*v)).collect();
    let count = vertices.len().max(2) - 1;
    let color = |i: usize| {
        let share = i as f32 / count as f32;
        let [r, g, b] = super::tone::Map::Inferno.color(0.9 - 0.5 * share);
        Color32::from_rgb(r, g, b)
    };
    for (i, ends) in vertices.windows(2).enumerate() {
        let Some(ends) = project::line(&camera, aspect, [ends[0], ends[1]]) else {
            continue;
        };
        let ends = ends.map(place);
        painter.line_segment(ends, Stroke::new(4.0, Color32::from_black_alpha(150)));
        painter.line_segment(ends, Stroke::new(2.0, color(i)));
    }
    for (i, vertex) in vertices.iter().enumerate().skip(1) {
        let Some(at) = project::point(&camera, aspect, *vertex) else {
            continue;
        };
        let at = place(at);
        painter.circle(
            at,
            4.0,
            color(i - 1),
            Stroke::new(1.5, Color32::from_black_alpha(200)),
        );
        let text = i.to_string();
        let beside = at + vec2(7.0, -7.0);
        for (shift, color) in [
            (vec2(1.0, 1.0), Color32::from_black_alpha(220)),
            (vec2(0.0, 0.0), Color32::WHITE),
        ] {
            let font = FontId::proportional(12.0);
            painter.text(beside + shift, Align2::LEFT_BOTTOM, &text, font, color);
        }
    }
}

fn draw_legend(painter: &Painter, legend: &Legend, desk: &Desk) {
    let clip = painter.clip_rect();
    if clip.width() < 220.0 || clip.height() < 80.0 {
        return;
    }
    let font = FontId::proportional(11.0);
    let corner = clip.left_bottom() + vec2(10.0, -10.0);
    let name = match &desk.layer {
        _ if desk.reference().is_some() && desk.compare.is_difference() => "difference",
        Some(name) => name,
        None => desk.overlay.as_deref().unwrap_or("luminance"),
    };
    match legend {
        Legend::Scale(map, span) => {
            let plate = Rect::from_min_size(corner - vec2(0.0, 46.0), vec2(240.0, 46.0));
            painter.rect_filled(plate, 3.0, Color32::from_black_alpha(190));
            let bar = Rect::from_min_size(plate.min + vec2(10.0, 19.0), vec2(220.0, 8.0));
            for i in 0..110 {
                let [r, g, b] = map.color(i as f32 / 109.0);
                let part = Rect::from_min_size(bar.min + vec2(2.0 * i as f32, 0.0), vec2(2.0, 8.0));
                painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
            }
            let scale = if span.is_log { "logarithmic" } else { "linear" };
            let title = format!("{name} ({scale})");
            let top = plate.min + vec2(10.0, 3.0);
            painter.text(top, Align2::LEFT_TOP, title, font.clone(), theme::TEXT);
            for (place, align) in [
                (0.0, Align2::LEFT_TOP),
                (0.5, Align2::CENTER_TOP),
                (1.0, Align2::RIGHT_TOP),
            ] {
                let at = pos2(bar.left() + place * bar.width(), bar.bottom() + 3.0);
                let text = picture::number(span.at(place));
                painter.text(at, align, text, font.clone(), theme::TEXT);
            }
        }
        Legend::Names(names) => {
            let most = (((clip.height() - 40.0) / 15.0) as usize).clamp(1, 24);
            let rows = names.len().min(most);
            let height = 15.0 * rows as f32 + 22.0;
            let plate = Rect::from_min_size(corner - vec2(0.0, height), vec2(190.0, height));
            painter.rect_filled(plate, 3.0, Color32::from_black_alpha(190));
            let clipped = painter.with_clip_rect(plate);
            let title = match names.len() - rows {
                0 => name.to_owned(),
                more => format!("{name}, and {more} more"),
            };
            let top = plate.min + vec2(10.0, 3.0);
            clipped.text(top, Align2::LEFT_TOP, title, font.clone(), theme::QUIET);
            for (i, ([r, g, b], name)) in names.iter().take(rows).enumerate() {
                let at = plate.min + vec2(10.0, 19.0 + 15.0 * i as f32);
                let swatch = Rect::from_min_size(at + vec2(0.0, 2.0), vec2(10.0, 10.0));
                clipped.rect_filled(swatch, 2.0, Color32::from_rgb(*r, *g, *b));
                let beside = at + vec2(16.0, 0.0);
                clipped.text(beside, Align2::LEFT_TOP, name, font.clone(), theme::TEXT);
            }
        }
    }
}
