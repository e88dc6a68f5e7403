//! Where the picture lies in the window: whole, or magnified about a point. Pixels of the picture fall on whole pixels of
//! the screen where they can, since blurred pixels cannot be judged.

use eframe::egui::{Pos2, Rect, Vec2, pos2, vec2};

/// The least and greatest magnification, in pixels of the screen for each of the picture.
const ZOOMS: [f32; 2] = [1.0 / 64.0, 256.0];

/// What is seen of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Pixels of the screen for each of the picture; as many as fit if none.
    zoom: Option<f32>,
    /// What is in the middle, from (0, 0) to (1, 1).
    centre: Vec2,
}

impl Default for View {
    fn default() -> Self {
        Self {
            zoom: None,
            centre: vec2(0.5, 0.5),
        }
    }
}

/// Where a picture is to lie.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// The room that there is, in points.
    pub rect: Rect,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// Pixels of the screen for each point.
    pub scale: f32,
}

impl Area {
    fn size(&self) -> Vec2 {
        vec2(self.size[0].max(1) as f32, self.size[1].max(1) as f32)
    }

    /// The magnification at which all of the picture is seen: whole if it is above 1.
    fn fitting(&self) -> f32 {
        let room = self.rect.size() * self.scale / self.size();
        let zoom = room.x.min(room.y);
        let zoom = if zoom >= 1.0 { zoom.floor() } else { zoom };
        zoom.clamp(ZOOMS[0], ZOOMS[1])
    }
}

impl View {
    /// Pixels of the screen for each of the picture.
    pub fn zoom(&self, area: &Area) -> f32 {
        self.zoom.unwrap_or_else(|| area.fitting())
    }

    /// Is the whole picture seen, whatever the room?
    pub fn is_fit(&self) -> bool {
        self.zoom.is_none()
    }

    /// Where the picture lies, in points.
    pub fn placed(&self, area: &Area) -> Rect {
        let scale = area.scale.max(1e-3);
        let extent = area.size() * self.zoom(area) / scale;
        let centre = if self.is_fit() {
            vec2(0.5, 0.5)
        } else {
            self.centre
        };
        let corner = area.rect.center() - extent * centre;
        // On whole pixels of the screen.
        let corner = (corner.to_vec2() * scale).round() / scale;
        Rect::from_min_size(corner.to_pos2(), extent)
    }

    /// All of the picture.
    pub fn fit(&mut self) {
        *self = Self::default();
    }

    /// A magnification, with what is at a place of the window staying there.
    pub fn zoom_to(&mut self, zoom: f32, at: Pos2, area: &Area) {
        if !zoom.is_finite() {
            return;
        }
        let zoom = zoom.clamp(ZOOMS[0], ZOOMS[1]);
        let placed = self.placed(area);
        let share = (at - placed.min) / placed.size();
        let extent = area.size() * zoom / area.scale.max(1e-3);
        let corner = at - share * extent;
        self.zoom = Some(zoom);
        self.centre = (area.rect.center() - corner) / extent;
        self.hold();
    }

    /// Twice as large, or half, in powers of two.
    pub fn step(&mut self, is_larger: bool, area: &Area) {
        let power = self.zoom(area).log2();
        let power = if is_larger {
            (power + 0.01).floor() + 1.0
        } else {
            (power - 0.01).ceil() - 1.0
        };
        self.zoom_to(power.exp2(), area.rect.center(), area);
    }

    /// Moves the picture by so many points.
    pub fn shift(&mut self, by: Vec2, area: &Area) {
        let placed = self.placed(area);
        self.zoom = Some(self.zoom(area));
        let share = by / placed.size();
        if share.x.is_finite() && share.y.is_finite() {
            self.centre -= share;
        }
        self.hold();
    }

    /// Some of the picture stays in the middle, so that it is never lost.
    fn hold(&mut self) {
        let hold = |x: f32| {
            if x.is_finite() {
                x.clamp(0.0, 1.0)
            } else {
                0.5
            }
        };
        self.centre = vec2(hold(self.centre.x), hold(self.centre.y));
    }
}

/// The pixel at a place of the window, if the picture, which lies in `placed`, is there.
pub fn pixel_at(placed: Rect, size: [u32; 2], at: Pos2) -> Option<[u32; 2]> {
    let share = (at - placed.min) / placed.size();
    let is_inside = |x: f32| (0.0..1.0).contains(&x);
    if !(is_inside(share.x) && is_inside(share.y)) || size.contains(&0) {
        return None;
    }
    let column = ((share.x * size[0] as f32) as u32).min(size[0] - 1);
    let row = ((share.y * size[1] as f32) as u32).min(size[1] - 1);
    Some([column, row])
}

/// The nearest pixel to a place of the window.
pub fn pixel_near(placed: Rect, size: [u32; 2], at: Pos2) -> [u32; 2] {
    let share = (at - placed.min) / placed.size();
    let near = |x: f32, n: u32| ((x.clamp(0.0, 1.0) * n as f32) as u32).min(n.saturating_sub(1));
    [near(share.x, size[0]), near(share.y, size[1])]
}

/// Where a corner between pixels lies in the window.
pub fn corner(placed: Rect, size: [u32; 2], pixel: [u32; 2]) -> Pos2 {
    let share = vec2(
        pixel[0] as f32 / size[0].max(1) as f32,
        pixel[1] as f32 / size[1].max(1) as f32,
    );
    pos2(0.0, 0.0) + (placed.min.to_vec2() + share * placed.size())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(width: f32, height: f32, size: [u32; 2], scale: f32) -> Area {
        Area {
            rect: Rect::from_min_size(pos2(300.0, 40.0), vec2(width, height)),
            size,
            scale,
        }
    }

    #[test]
    fn a_picture_fits_on_whole_pixels_in_the_middle() {
        let small = area(701.0, 700.0, [320, 240], 1.0);
        let placed = View::default().placed(&small);
        assert_eq!(placed.size(), vec2(640.0, 480.0));
        assert_eq!(placed.min.x.fract(), 0.0);
        assert!((placed.center() - small.rect.center()).length() <= 1.0);
        let large = area(700.0, 700.0, [1400, 700], 1.0);
        assert_eq!(View::default().placed(&large).size(), vec2(700.0, 350.0));
        // Twice as many pixels of the screen for each point.
        let dense = area(700.0, 700.0, [1400, 700], 2.0);
        assert_eq!(View::default().placed(&dense).size(), vec2(700.0, 350.0));
        assert_eq!(View::default().zoom(&dense), 1.0);
    }

    #[test]
    fn magnifying_keeps_what_is_under_the_hand() {
        let area = area(700.0, 700.0, [640, 480], 1.0);
        let mut view = View::default();
        let at = pos2(400.0, 300.0);
        let before = pixel_at(view.placed(&area), area.size, at);
        for zoom in [2.0, 7.0, 40.0] {
            view.zoom_to(zoom, at, &area);
            assert_eq!(pixel_at(view.placed(&area), area.size, at), before);
            assert_eq!(view.zoom(&area), zoom);
        }
        view.fit();
        assert!(view.is_fit());
        view.step(true, &area);
        assert_eq!(view.zoom(&area), 2.0);
        view.step(false, &area);
        view.step(false, &area);
        assert_eq!(view.zoom(&area), 0.5);
        for _ in 0..40 {
            view.step(true, &area);
        }
        assert_eq!(view.zoom(&area), 256.0);
    }

    #[test]
    fn the_picture_follows_and_is_never_lost() {
        let area = area(700.0, 700.0, [640, 480], 1.0);
        let mut view = View::default();
        let before = view.placed(&area);
        view.shift(vec2(10.0, -20.0), &area);
        let after = view.placed(&area);
        assert!(((after.min - before.min) - vec2(10.0, -20.0)).length() < 1.0);
        view.shift(vec2(1e9, f32::NAN), &area);
        let placed = view.placed(&area);
        assert!(placed.contains(area.rect.center()) || placed.min.x <= area.rect.center().x);
        assert!(placed.is_finite());
    }

    #[test]
    fn no_room_and_no_pixels_are_no_reason_to_fail() {
        for (width, height, size, scale) in [
            (0.0, 0.0, [640, 480], 1.0),
            (-5.0, 3.0, [640, 480], 2.0),
            (700.0, 700.0, [0, 0], 1.0),
            (700.0, 700.0, [1, 1], 0.0),
        ] {
            let area = area(width, height, size, scale);
            let mut view = View::default();
            view.step(true, &area);
            view.shift(vec2(3.0, 3.0), &area);
            view.zoom_to(f32::NAN, pos2(0.0, 0.0), &area);
            let placed = view.placed(&area);
            let _ = pixel_at(placed, size, pos2(1.0, 1.0));
            let _ = pixel_near(placed, size, pos2(1.0, 1.0));
            assert!(
                placed.min.x.is_finite() && placed.max.y.is_finite(),
                "{area:?} {placed:?}"
            );
        }
    }

    #[test]
    fn pixels_and_corners() {
        let placed = Rect::from_min_size(pos2(10.0, 20.0), vec2(40.0, 20.0));
        assert_eq!(pixel_at(placed, [4, 2], pos2(10.0, 20.0)), Some([0, 0]));
        assert_eq!(pixel_at(placed, [4, 2], pos2(49.9, 39.9)), Some([3, 1]));
        assert_eq!(pixel_at(placed, [4, 2], pos2(50.0, 30.0)), None);
        assert_eq!(pixel_near(placed, [4, 2], pos2(500.0, -30.0)), [3, 0]);
        assert_eq!(corner(placed, [4, 2], [2, 1]), pos2(30.0, 30.0));
    }
}
