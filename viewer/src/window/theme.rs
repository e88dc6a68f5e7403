//! How the window looks. Everything is a neutral grey, since colors are judged beside it; one warm color marks what a hand
//! changed or chose.

use eframe::egui::{
    Color32, Context, CornerRadius, FontFamily, FontId, Stroke, TextStyle, Theme, Visuals, vec2,
};

/// What surrounds the picture.
pub const SURROUND: Color32 = Color32::from_gray(0x2b);
/// Panels.
pub const PANEL: Color32 = Color32::from_gray(0x22);
/// What is changed or chosen.
pub const ACCENT: Color32 = Color32::from_rgb(0xe0, 0xa4, 0x58);
/// Errors.
pub const BAD: Color32 = Color32::from_rgb(0xe8, 0x6a, 0x5c);
/// Warnings.
pub const WARNING: Color32 = Color32::from_rgb(0xd8, 0xb4, 0x50);
/// What is fine.
pub const GOOD: Color32 = Color32::from_rgb(0x84, 0xb8, 0x78);
/// Text that says less.
pub const QUIET: Color32 = Color32::from_gray(0x92);
/// Text.
pub const TEXT: Color32 = Color32::from_gray(0xcc);

/// Makes a window look so.
pub fn apply(ctx: &Context) {
    ctx.set_theme(Theme::Dark);
    ctx.options_mut(|options| {
        // Ctrl and 0 fit the picture, and are no magnifier of buttons.
        options.zoom_with_keyboard = false;
    });
    ctx.all_styles_mut(|style| {
        let font = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles = [
            (TextStyle::Small, font(11.0)),
            (TextStyle::Body, font(13.0)),
            (TextStyle::Button, font(13.0)),
            (TextStyle::Heading, font(15.0)),
            (
                TextStyle::Monospace,
                FontId::new(12.0, FontFamily::Monospace),
            ),
        ]
        .into();
        style.spacing.item_spacing = vec2(6.0, 4.0);
        style.spacing.button_padding = vec2(7.0, 2.0);
        style.spacing.interact_size = vec2(30.0, 20.0);
        style.spacing.slider_width = 100.0;
        style.spacing.indent = 10.0;
        style.spacing.icon_width = 13.0;
        style.animation_time = 0.0;
        style.visuals = visuals();
    });
}

fn visuals() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = PANEL;
    visuals.window_fill = Color32::from_gray(0x26);
    visuals.extreme_bg_color = Color32::from_gray(0x17);
    visuals.faint_bg_color = Color32::from_gray(0x28);
    visuals.window_stroke = Stroke::new(1.0, Color32::from_gray(0x45));
    visuals.selection.bg_fill = Color32::from_rgb(0x6a, 0x52, 0x34);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_gray(0xf0));
    visuals.hyperlink_color = ACCENT;
    visuals.error_fg_color = BAD;
    visuals.warn_fg_color = WARNING;
    visuals.slider_trailing_fill = true;
    visuals.striped = false;
    let corner = CornerRadius::same(3);
    let widgets = &mut visuals.widgets;
    for (widget, fill, text) in [
        (&mut widgets.noninteractive, 0x22, 0xcc),
        (&mut widgets.inactive, 0x38, 0xd0),
        (&mut widgets.hovered, 0x46, 0xf0),
        (&mut widgets.active, 0x52, 0xff),
        (&mut widgets.open, 0x30, 0xd8),
    ] {
        widget.bg_fill = Color32::from_gray(fill);
        widget.weak_bg_fill = Color32::from_gray(fill);
        widget.bg_stroke = Stroke::NONE;
        widget.fg_stroke = Stroke::new(1.0, Color32::from_gray(text));
        widget.corner_radius = corner;
        widget.expansion = 0.0;
    }
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(0x33));
    visuals
}
