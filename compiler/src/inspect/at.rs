//! The point and directions at which something is evaluated, and how they are written:
//! `position=(0.1, 0, 2), wo=(0, 0, 1), u=(0.5, 0.5, 0.5, 0.5)`.

use std::str::FromStr;

use serde::Serialize;

use crate::diag::nearest;

/// Where and from where something is evaluated. Directions are unit vectors in world space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct At {
    /// Metres.
    pub position: [f64; 3],
    /// Shading normal.
    pub normal: [f64; 3],
    /// Normal of the geometry.
    pub geometric_normal: [f64; 3],
    /// Direction in which u grows; zero if there is none.
    pub tangent: [f64; 3],
    /// Texture coordinates.
    pub uv: [f64; 2],
    /// Index of refraction of the medium outside.
    pub exterior_ior: f64,
    /// Seconds since frame 0.
    pub time: f64,
    /// The number of the frame.
    pub frame: f64,
    /// The diameter of what a ray sees, in metres, for `filter_width`. Along the tangent and across
    /// it, u and v grow by as much.
    pub footprint: f64,
    /// Where it is in its object; where it is in the world if it is not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object_position: Option<[f64; 3]>,
    /// Which placement it is on; the first if it is not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instance_id: Option<[f64; 1]>,
    /// The second texture coordinates; the first if they are not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uv1: Option<[f64; 2]>,
    /// The color of the geometry; white if it is not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertex_color: Option<[f64; 3]>,
    /// Toward the viewer.
    pub wo: [f64; 3],
    /// Toward the light.
    pub wi: [f64; 3],
    /// The numbers that choose a lobe and a direction, each in [0, 1).
    pub u: [f64; 4],
}

impl Default for At {
    fn default() -> Self {
        Self {
            position: [0.1, 0.2, 0.3],
            normal: [0.0, 0.0, 1.0],
            geometric_normal: [0.0, 0.0, 1.0],
            tangent: [1.0, 0.0, 0.0],
            uv: [0.25, 0.75],
            exterior_ior: 1.0,
            time: 0.0,
            frame: 0.0,
            footprint: 0.0,
            object_position: None,
            instance_id: None,
            uv1: None,
            vertex_color: None,
            wo: [0.6, 0.0, 0.8],
            wi: [-0.48, 0.36, 0.8],
            u: [0.5; 4],
        }
    }
}

/// The keys in the order they are shown, each with how many numbers it takes.
const KEYS: [(&str, usize); 16] = [
    ("position", 3),
    ("normal", 3),
    ("geometric_normal", 3),
    ("tangent", 3),
    ("uv", 2),
    ("exterior_ior", 1),
    ("time", 1),
    ("frame", 1),
    ("footprint", 1),
    ("object_position", 3),
    ("instance_id", 1),
    ("uv1", 2),
    ("vertex_color", 3),
    ("wo", 3),
    ("wi", 3),
    ("u", 4),
];

impl At {
    /// Every key that was given or has a default, with its numbers.
    pub fn entries(&self) -> Vec<(&'static str, Vec<f64>)> {
        let mut copy = *self;
        let mut entry = |(key, _): (&'static str, usize)| {
            let is_there = match key {
                "object_position" => self.object_position.is_some(),
                "instance_id" => self.instance_id.is_some(),
                "uv1" => self.uv1.is_some(),
                "vertex_color" => self.vertex_color.is_some(),
                // Few materials ask when they are seen.
                "time" => self.time != 0.0,
                "frame" => self.frame != 0.0,
                _ => true,
            };
            let numbers = copy.numbers(key).filter(|_| is_there)?;
            Some((key, numbers.to_vec()))
        };
        KEYS.into_iter().filter_map(&mut entry).collect()
    }

    /// The numbers of a key, or of a field of `SurfacePoint`; the columns of a matrix one after another.
    pub(crate) fn field(&self, name: &str) -> Option<Vec<f64>> {
        let d = self.footprint;
        let [x, y] = perpendicular(self.geometric_normal, self.tangent);
        Some(match name {
            "footprint_x" => x.map(|c| d * c).to_vec(),
            "footprint_y" => y.map(|c| d * c).to_vec(),
            "footprint_uv_x" | "footprint_uv1_x" => vec![d, 0.0],
            "footprint_uv_y" | "footprint_uv1_y" => vec![0.0, d],
            "footprint_color_x" | "footprint_color_y" => vec![0.0; 3],
            "view" => self.wo.to_vec(),
            "object_scale" => vec![1.0],
            "object_from_world" | "world_from_object" => {
                vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
            }
            _ => {
                let mut copy = *self;
                copy.numbers(name)?.to_vec()
            }
        })
    }

    /// The numbers of a key; those that are not said are taken from what stands for them.
    fn numbers(&mut self, key: &str) -> Option<&mut [f64]> {
        Some(match key {
            "object_position" => self.object_position.get_or_insert(self.position),
            "instance_id" => self.instance_id.get_or_insert([0.0]),
            "uv1" => self.uv1.get_or_insert(self.uv),
            "vertex_color" => self.vertex_color.get_or_insert([1.0; 3]),
            "position" => &mut self.position,
            "normal" => &mut self.normal,
            "geometric_normal" => &mut self.geometric_normal,
            "tangent" => &mut self.tangent,
            "uv" => &mut self.uv,
            "exterior_ior" => std::slice::from_mut(&mut self.exterior_ior),
            "time" => std::slice::from_mut(&mut self.time),
            "frame" => std::slice::from_mut(&mut self.frame),
            "footprint" => std::slice::from_mut(&mut self.footprint),
            "wo" => &mut self.wo,
            "wi" => &mut self.wi,
            "u" => &mut self.u,
            _ => return None,
        })
    }

    fn set(&mut self, key: &str, mut values: Vec<f64>) -> Result<(), String> {
        let Some(numbers) = self.numbers(key) else {
            return Err(unknown(key));
        };
        if numbers.len() != values.len() {
            let (wanted, given) = (numbers.len(), values.len());
            return Err(format!(
                "`{key}` takes {}, not {given}",
                if wanted == 1 {
                    "1 number".into()
                } else {
                    format!("{wanted} numbers")
                }
            ));
        }
        check(key, &mut values)?;
        numbers.copy_from_slice(&values);
        Ok(())
    }
}

/// Two unit vectors perpendicular to the unit vector `n` and each other, the first as near to `v` as
/// can be.
fn perpendicular(n: [f64; 3], v: [f64; 3]) -> [[f64; 3]; 2] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i]);
    // Where v is no help, an axis far from n.
    let axis = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][usize::from(n[0].abs() > 0.7)];
    let sides = [v, axis].map(|v| cross(n, v));
    let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let y = sides.into_iter().find(|y| length(y) > 1e-6);
    let y = y.map_or([0.0; 3], |y| y.map(|x| x / length(&y)));
    [cross(y, n), y]
}

fn unknown(key: &str) -> String {
    let names = KEYS.map(|(name, _)| name);
    match nearest(key, names) {
        Some(near) => format!("unknown key `{key}`; did you mean `{near}`?"),
        None => format!("unknown key `{key}`; the keys are {}", names.join(", ")),
    }
}

/// Checks the values of `key`, and makes directions unit vectors.
fn check(key: &str, values: &mut [f64]) -> Result<(), String> {
    // Single precision must be able to hold them.
    if !values.iter().all(|x| (*x as f32).is_finite()) {
        return Err(format!("`{key}` must be finite"));
    }
    match key {
        "u" if !values.iter().all(|x| (0.0..1.0).contains(x)) => {
            Err("the numbers of `u` lie in [0, 1)".into())
        }
        "exterior_ior" if values.iter().all(|x| *x > 0.0) => Ok(()),
        "exterior_ior" => Err("`exterior_ior` must be above 0; air has 1".into()),
        "footprint" if values.iter().all(|x| *x >= 0.0) => Ok(()),
        "footprint" => Err("`footprint` is a diameter and cannot be below 0".into()),
        "instance_id"
            if !values
                .iter()
                .all(|x| x.fract() == 0.0 && *x >= 0.0 && *x < 2e9) =>
        {
            Err("`instance_id` is a whole number from 0".into())
        }
        "position" | "uv" | "u" | "time" | "frame" | "object_position" | "instance_id" | "uv1"
        | "vertex_color" => Ok(()),
        _ => {
            let longest = values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            if longest > 0.0 {
                // Scaled first, so that squares neither overflow nor vanish.
                values.iter_mut().for_each(|x| *x /= longest);
                let length = values.iter().map(|x| x * x).sum::<f64>().sqrt();
                values.iter_mut().for_each(|x| *x /= length);
                Ok(())
            } else if key == "tangent" {
                Ok(())
            } else {
                Err(format!("`{key}` is a direction and cannot be zero"))
            }
        }
    }
}

impl FromStr for At {
    type Err = String;

    /// Reads `key=(x, y, ..), key=x`; what is not given keeps its default, and the normal of the
    /// geometry is the normal if only that is given.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut at = Self::default();
        let mut seen: Vec<&str> = Vec::new();
        let mut rest = text.trim();
        while !rest.is_empty() {
            let (key, values, after) = entry(rest)?;
            if seen.contains(&key) {
                return Err(format!("`{key}` is given twice"));
            }
            at.set(key, values)?;
            seen.push(key);
            rest = after;
        }
        if seen.contains(&"normal") && !seen.contains(&"geometric_normal") {
            at.geometric_normal = at.normal;
        }
        Ok(at)
    }
}

/// The first entry: key, numbers, and what follows its comma.
fn entry(text: &str) -> Result<(&str, Vec<f64>, &str), String> {
    let form = "write `key=(x, y, z)`, separated by commas";
    let (key, after) = text
        .split_once('=')
        .ok_or_else(|| format!("`{text}` has no `=`; {form}"))?;
    let (key, after) = (key.trim(), after.trim_start());
    let (numbers, rest) = match after.strip_prefix('(') {
        Some(inner) => inner
            .split_once(')')
            .ok_or_else(|| format!("the `(` of `{key}` is not closed; {form}"))?,
        None => after.split_at(after.find(',').unwrap_or(after.len())),
    };
    let rest = rest.trim_start();
    let rest = match rest.strip_prefix(',') {
        Some(more) => more.trim_start(),
        None if rest.is_empty() => rest,
        None => return Err(format!("a comma is missing before `{rest}`; {form}")),
    };
    let number = |part: &str| {
        let part = part.trim();
        part.parse::<f64>()
            .map_err(|_| format!("`{part}` in `{key}` is not a number; {form}"))
    };
    let values: Result<Vec<f64>, String> = numbers.split(',').map(number).collect();
    Ok((key, values?, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_read_and_directions_made_unit() {
        let at: At = "position=(1, -2,3e-1), wo = (0,3,4),exterior_ior=1.33, normal=(0,2,0)"
            .parse()
            .expect("fine");
        assert_eq!(at.position, [1.0, -2.0, 0.3]);
        assert_eq!(at.wo, [0.0, 0.6, 0.8]);
        assert_eq!(at.exterior_ior, 1.33);
        assert_eq!(
            (at.normal, at.geometric_normal),
            ([0.0, 1.0, 0.0], [0.0, 1.0, 0.0])
        );
        assert_eq!(at.uv, At::default().uv);
        assert_eq!("".parse(), Ok(At::default()));
        let tiny: At = "wi=(0,1e-30,0), tangent=(0,0,0)".parse().expect("fine");
        assert_eq!((tiny.wi, tiny.tangent), ([0.0, 1.0, 0.0], [0.0; 3]));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, said) in [
            ("positon=(0,0,0)", "did you mean `position`"),
            ("light=(0,0,1)", "the keys are position, normal"),
            ("wo=(0,0)", "`wo` takes 3 numbers, not 2"),
            ("exterior_ior=(1,2)", "takes 1 number, not 2"),
            ("wo=(0,0,0)", "cannot be zero"),
            ("uv=(nan,0)", "must be finite"),
            ("position=(1e39,0,0)", "must be finite"),
            ("u=(0,0,0,1)", "[0, 1)"),
            ("exterior_ior=0", "above 0"),
            ("footprint=-1", "below 0"),
            ("instance_id=0.5", "whole number"),
            ("instance_id=-1", "whole number"),
            ("wo=(0,0,x)", "`x` in `wo` is not a number"),
            ("wo=(0,0,1", "not closed"),
            ("wo", "has no `=`"),
            ("wo=(0,0,1) wi=(0,0,1)", "a comma is missing"),
            ("uv=(0,0), uv=(1,1)", "`uv` is given twice"),
        ] {
            let error = text.parse::<At>().expect_err(text);
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn a_footprint_lies_in_the_surface() {
        let at: At = "normal=(0,1,0), tangent=(0,0,2), footprint=3"
            .parse()
            .expect("fine");
        let field = |name| at.field(name).expect("a field");
        assert_eq!(field("footprint_x"), [0.0, 0.0, 3.0]);
        assert_eq!(field("footprint_y"), [3.0, 0.0, 0.0]);
        assert_eq!(field("footprint_uv_y"), [0.0, 3.0]);
        let steep: At = "normal=(1,0,0), tangent=(0,0,0), footprint=2"
            .parse()
            .expect("fine");
        let across = steep.field("footprint_x").expect("a field");
        assert_eq!(
            (across[0], across.iter().map(|x| x * x).sum::<f64>()),
            (0.0, 4.0)
        );
    }

    #[test]
    fn every_key_is_shown_and_set() {
        let mut at = At::default();
        for (key, width) in KEYS {
            assert_eq!(at.field(key).map(|n| n.len()), Some(width), "{key}");
            assert_eq!(at.numbers(key).map(|n| n.len()), Some(width), "{key}");
        }
    }
}
