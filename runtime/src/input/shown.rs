//! What scenes of files of other programs share: a view of everything where such a file has no camera, light where it has
//! none, and numbers as scene files have them.

use glam::{DMat4, DVec3};

/// Vertical field of view of a camera that the file does not have, in degrees.
pub(super) const FOV: f64 = 35.0;

/// How much wider than everything the picture is.
const MARGIN: f64 = 1.1;

/// More places of a mesh than this are in a file of their own, which is faster to read than a list.
pub(super) const LISTED: usize = 10_000;

/// Columns and rows of the picture, the rows for a camera that does not say its shape.
pub(super) const COLUMNS: u32 = 1024;
const ROWS: u32 = 768;

/// Like a photographer's: a soft light from above and behind the camera, and a bright room.
pub(super) const LIGHT: &str = "[environment]\ncolor = 0.4\n\n\
    [[lights]]\nkind = \"distant\"\nto_light = [0.4, 0.9, 0.6]\nirradiance = 1.5\nangle = 20\n";

/// The first line of a file of places.
pub(super) const PLACES: &str = "m00 m01 m02 m03 m10 m11 m12 m13 m20 m21 m22 m23\n";

/// A box around everything.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent(Option<[DVec3; 2]>);

impl Extent {
    pub(super) fn take_in(&mut self, place: DVec3) {
        if place.is_finite() {
            let [a, b] = self.0.unwrap_or([place; 2]);
            self.0 = Some([a.min(place), b.max(place)]);
        }
    }

    /// The corners of the box; none if nothing is in it.
    pub(super) fn corners(&self) -> Vec<DVec3> {
        let Some([low, high]) = self.0 else {
            return Vec::new();
        };
        let corner = |i: usize| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            DVec3::new(
                pick(0, low.x, high.x),
                pick(1, low.y, high.y),
                pick(2, low.z, high.z),
            )
        };
        (0..8).map(corner).collect()
    }

    /// The centre of everything, and how far it reaches from there.
    pub(super) fn reach(&self) -> (DVec3, f64) {
        let [low, high] = self.0.unwrap_or([-DVec3::ONE, DVec3::ONE]);
        let radius = 0.5 * low.distance(high);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        (0.5 * (low + high), radius)
    }

    /// Where one sees everything from above and from the right, where to, and what is up.
    pub(super) fn view(&self) -> [DVec3; 3] {
        let (centre, radius) = self.reach();
        let direction = DVec3::new(0.55, 0.4, 1.0).normalize();
        let distance = self.distance(direction, radius);
        [centre + distance * direction, centre, DVec3::Y]
    }

    /// How far from the centre, in this direction, one sees everything in a square picture with a margin.
    fn distance(&self, direction: DVec3, radius: f64) -> f64 {
        let right = DVec3::Y.cross(direction).normalize();
        let up = direction.cross(right);
        let slope = (0.5 * FOV).to_radians().tan();
        let half = self
            .0
            .map_or(DVec3::splat(radius), |[low, high]| 0.5 * (high - low));
        let corners = (0..8).map(|i| {
            let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            let across = corner.dot(right).abs().max(corner.dot(up).abs());
            corner.dot(direction) + MARGIN * across / slope
        });
        corners.fold(radius, f64::max)
    }
}

/// The rows of a picture that is so many heights wide.
pub(super) fn rows(shape: Option<f64>) -> u32 {
    let shape = shape.filter(|s| (0.01..100.0).contains(s));
    shape.map_or(ROWS, |s| (f64::from(COLUMNS) / s).round().max(1.0) as u32)
}

/// Where a camera is, where it looks at so far away, and what is up.
pub(super) fn view(transform: &DMat4, distance: f64) -> [DVec3; 3] {
    let position = transform.w_axis.truncate();
    let forward = -transform.z_axis.truncate().normalize_or(DVec3::Z);
    let up = transform.y_axis.truncate().normalize_or(DVec3::Y);
    [position, position + distance * forward, up]
}

/// An entry of `[[geometry]]`: a file where it is.
pub(super) fn geometry(file: &str, places: &[DMat4], listed: &str) -> String {
    let head = format!("[[geometry]]\nfile = {}\n", quoted(file));
    let places: Vec<String> = places.iter().map(matrix).collect();
    match &places[..] {
        [] => format!("{head}\n"),
        [one] => format!("{head}matrix = [{one}]\n\n"),
        all if all.len() > LISTED => format!("{head}placements = {}\n\n", quoted(listed)),
        all => {
            let all: String = all
                .iter()
                .map(|m| format!("  {{ matrix = [{m}] }},\n"))
                .collect();
            format!("{head}placements = [\n{all}]\n\n")
        }
    }
}

pub(super) fn array(v: DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

/// The upper three rows of a matrix.
pub(super) fn matrix(m: &DMat4) -> String {
    let rows = [m.row(0), m.row(1), m.row(2)];
    let numbers = rows.iter().flat_map(|row| row.to_array());
    let numbers: Vec<String> = numbers.map(|x| format!("{x:?}")).collect();
    numbers.join(", ")
}

pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
