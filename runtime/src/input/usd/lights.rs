//! Lights and the camera of a stage.
//!
//! A light has a radiance, color times intensity times 2 to its exposure; if it is normalized it has that as power over its
//! area instead. The area is one of the stage's units, as the intensity was chosen by.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use openusd::sdf::{Path, Value};

use super::model::{Dome, Lens, Light, Seeing};
use super::solids;
use super::values;
use super::walk::{Above, Walk};

/// Frames of keys, at most.
const MOST_FRAMES: u32 = 10_000;

/// The radius of lamps that are points, in metres.
const POINT: f64 = 0.005;

/// Blender writes the radius of its sun for the diameter, and a quarter of its irradiance, as its own renderer and Karma
/// take it back; seen in what Blender 5.0.1 writes.
const BLENDER_ANGLE: f64 = 2.0;
const BLENDER_SUN: f64 = 4.0;

type Checked<T = ()> = Result<T, String>;

impl Walk<'_> {
    pub(super) fn light(&mut self, path: &Path, kind: &str, here: &Above) -> Checked {
        let reader = self.reader;
        let input =
            |name: &str, default: f64| reader.number(path, &format!("inputs:{name}"), default);
        let usual = if kind == "DistantLight" {
            50_000.0
        } else {
            1.0
        };
        let strength = input("intensity", usual)? * input("exposure", 0.0)?.exp2();
        let color = reader
            .value(path, "inputs:color")?
            .as_ref()
            .and_then(values::vector);
        let mut color = color.unwrap_or(DVec3::ONE).max(DVec3::ZERO);
        if reader.flag(path, "inputs:enableColorTemperature", false)? {
            color *= blackbody(input("colorTemperature", 6500.0)?);
        }
        let radiance = color * strength;
        if !(radiance.is_finite() && radiance.max_element() > 0.0) {
            return Ok(());
        }
        let is_ball = kind == "SphereLight" && is_even(&DMat3::from_mat4(here.world));
        for name in ["cone:angle", "ies:file", "focus"] {
            let name = format!("inputs:shaping:{name}");
            let changes = match reader.value(path, &name)? {
                None => false,
                Some(value) if name.ends_with("angle") => {
                    !is_ball && values::number(&value).is_some_and(|angle| angle < 90.0)
                }
                Some(value) => values::number(&value) != Some(0.0),
            };
            if changes {
                self.warn(format!(
                    "`{path}.{name}` is left out: the light shines evenly"
                ));
            }
        }
        let is_normalized = reader.flag(path, "inputs:normalize", false)?;
        let world = here.world;
        let axes = DMat3::from_mat4(world);
        let unit = self.upright.x_axis.length();
        // Vectors of the light in the world, and areas in units of the stage.
        let area_of = |u: DVec3, v: DVec3| (axes * u).cross(axes * v).length() / (unit * unit);
        let name = path.as_str().to_owned();
        match kind {
            "DistantLight" => {
                let mut angle = input("angle", 0.53)?;
                let mut radiance = radiance;
                if self.is_of_blender {
                    (angle, radiance) = (BLENDER_ANGLE * angle, BLENDER_SUN * radiance);
                }
                let angle = angle.clamp(0.0, 179.0);
                let solid = PI * (0.5 * angle).to_radians().sin().powi(2);
                let is_whole = is_normalized || solid == 0.0;
                let irradiance = if is_whole { radiance } else { radiance * solid };
                let to_light = (axes * DVec3::Z).normalize_or(DVec3::Y);
                self.model.lights.push(Light::Distant {
                    to_light,
                    irradiance,
                    angle,
                });
            }
            "RectLight" => {
                let (u, v) = (
                    DVec3::X * input("width", 1.0)?,
                    DVec3::Y * input("height", 1.0)?,
                );
                let area = area_of(u, v);
                if area <= 0.0 || !area.is_finite() {
                    return Ok(());
                }
                if reader.value(path, "inputs:texture:file")?.is_some() {
                    self.warn(format!("the picture of the light `{path}` is left out"));
                }
                let radiance = if is_normalized {
                    radiance / area
                } else {
                    radiance
                };
                // It shines along -z: the way that v x u points to.
                let (u, v) = (axes * v, axes * u);
                let corner = world.w_axis.truncate() - 0.5 * (u + v);
                let (u, v) = if axes.determinant() < 0.0 {
                    (v, u)
                } else {
                    (u, v)
                };
                self.model.lights.push(Light::Quad {
                    corner,
                    u,
                    v,
                    radiance,
                });
            }
            "DomeLight" | "DomeLight_1" => self.dome(path, kind, here, radiance)?,
            _ => {
                let mut radius = input("radius", 0.5)?;
                let length = input("length", 1.0)?;
                let is_point = reader.flag(path, "treatAsPoint", false)? || radius == 0.0;
                let least = POINT / unit;
                let said = radius;
                radius = if is_point { least } else { radius };
                if is_ball {
                    let world_radius = radius * axes.x_axis.length();
                    let area = 4.0 * PI * (world_radius / unit).powi(2);
                    let said = 4.0 * PI * (said * axes.x_axis.length() / unit).powi(2);
                    // A point has the power of the sphere that it stands for.
                    let radiance = if is_normalized {
                        radiance / area
                    } else if is_point && said > 0.0 {
                        radiance * said / area
                    } else {
                        radiance
                    };
                    if world_radius.is_finite() && world_radius > 0.0 && radiance.is_finite() {
                        let cone = self.cone(path, &axes)?;
                        self.model.lights.push(Light::Ball {
                            center: world.w_axis.truncate(),
                            radius: world_radius,
                            radiance,
                            cone,
                        });
                    }
                    return Ok(());
                }
                let shape = match kind {
                    "SphereLight" => "sphere",
                    "DiskLight" => "disk",
                    _ => "tube",
                };
                let turned = |v: glam::Vec3| {
                    let v = v.as_dvec3();
                    // Tubes lie along x.
                    if shape == "tube" {
                        DVec3::new(v.z, v.x, v.y)
                    } else {
                        v
                    }
                };
                let triangles = solids::coarse(shape, radius as f32, length as f32);
                let flips = axes.determinant() < 0.0;
                let placed = triangles.into_iter().map(|[a, b, c]| {
                    let at = |v| world.transform_point3(turned(v));
                    if flips {
                        [at(a), at(c), at(b)]
                    } else {
                        [at(a), at(b), at(c)]
                    }
                });
                let triangles: Vec<[DVec3; 3]> = placed.collect();
                let size = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
                let area: f64 = triangles.iter().map(size).sum::<f64>() / (unit * unit);
                // What the whole surface would have: corners lie on it, and faces a little below.
                let scale = axes.determinant().abs().cbrt() / unit;
                let (r, l) = (radius * scale, length * scale);
                let whole = match shape {
                    "sphere" => 4.0 * PI * r * r,
                    "disk" => PI * r * r,
                    _ => 2.0 * PI * r * l,
                };
                if area <= 0.0 || whole <= 0.0 || !area.is_finite() || !whole.is_finite() {
                    return Ok(());
                }
                let power = if is_normalized {
                    radiance
                } else if is_point && said > 0.0 {
                    radiance * whole * (said / radius).powi(2)
                } else {
                    radiance * whole
                };
                self.model.lights.push(Light::Mesh {
                    name,
                    triangles,
                    radiance: power / area,
                });
            }
        }
        Ok(())
    }

    /// The cone of a spot; none if it shines all around.
    fn cone(&self, path: &Path, axes: &DMat3) -> Checked<Option<(DVec3, [f64; 2])>> {
        let number = |name: &str, default| self.reader.number(path, name, default);
        let outer = number("inputs:shaping:cone:angle", 180.0)?;
        if !(0.0..90.0).contains(&outer)
            || self
                .reader
                .value(path, "inputs:shaping:cone:angle")?
                .is_none()
        {
            return Ok(None);
        }
        let soft = number("inputs:shaping:cone:softness", 0.0)?.clamp(0.0, 1.0);
        let outer = outer.max(0.01);
        let axis = (axes * DVec3::NEG_Z).normalize_or(DVec3::NEG_Y);
        Ok(Some((axis, [outer * (1.0 - soft), outer])))
    }

    fn dome(&mut self, path: &Path, kind: &str, here: &Above, radiance: DVec3) -> Checked {
        if self.model.dome.is_some() {
            self.warn(format!("a scene has one environment: `{path}` is left out"));
            return Ok(());
        }
        let reader = self.reader;
        let picture = match reader.value(path, "inputs:texture:file")? {
            Some(Value::AssetPath(asset)) => self.picture(&asset),
            _ => None,
        };
        let format = reader.token(path, "inputs:texture:format")?;
        if picture.is_some() && format.is_some_and(|f| f != "automatic" && f != "latlong") {
            self.warn(format!(
                "the picture of `{path}` is taken for a lat-long one"
            ));
        }
        // The pole of a dome is y, but of the newer kind that of the stage if it does not say another.
        let pole = reader.token(path, "poleAxis")?;
        let is_z = match pole.as_deref() {
            Some("Z") => true,
            Some("Y") => false,
            _ => kind == "DomeLight_1" && self.upright.z_axis.y.abs() > self.upright.y_axis.y.abs(),
        };
        let (up, front) = if is_z {
            (DVec3::Z, -DVec3::Y)
        } else {
            (DVec3::Y, DVec3::Z)
        };
        let axes = DMat3::from_mat4(here.world);
        let up = (axes * up).normalize_or(DVec3::Y);
        if picture.is_some() && up.y < 0.999 {
            self.warn(format!(
                "the environment `{path}` is turned about the vertical axis alone"
            ));
        }
        // Its centre is +z, which is -z in an environment here.
        let front = axes * front;
        let turn = front.x.atan2(front.z).to_degrees() + 180.0;
        self.model.dome = Some(Dome {
            picture,
            radiance,
            turn,
        });
        Ok(())
    }

    pub(super) fn camera(&mut self, path: &Path, here: &Above) -> Checked {
        if self.reader.token(path, "projection")?.as_deref() == Some("orthographic") {
            self.warn(format!(
                "cameras are perspective ones: `{path}` is left out"
            ));
            return Ok(());
        }
        let (lens, shape) = self.lens(path)?;
        let mut times: Vec<f64> = Vec::new();
        let mut at = Some(path.clone());
        while let Some(prim) = at.filter(|prim| !prim.is_abs_root()) {
            times.extend(self.reader.local_times(&prim));
            at = prim.parent();
        }
        for name in ["focalLength", "verticalAperture", "focusDistance", "fStop"] {
            times.extend(self.reader.times(path, name));
        }
        times.retain(|t| t.is_finite() && *t >= 0.0);
        let mut keys = Vec::new();
        // Whoever reads it at another time wants no keys.
        if times.len() > 1 && self.model.seconds == 0.0 {
            let first = times.iter().copied().fold(f64::MAX, f64::min).floor() as u32;
            let last = times.iter().copied().fold(0.0, f64::max).ceil().min(1e6) as u32;
            let now = self.reader.time;
            for frame in first..=last.min(first.saturating_add(MOST_FRAMES - 1)) {
                self.reader.time = f64::from(frame);
                keys.push((frame, self.world(path)?, self.lens(path)?.0));
            }
            self.reader.time = now;
        }
        self.model.camera = Some(Seeing {
            transform: here.world,
            lens,
            shape,
            keys,
        });
        Ok(())
    }

    /// The lens of a camera, and the width of its picture in heights.
    fn lens(&self, path: &Path) -> Checked<(Lens, f64)> {
        let number = |name: &str, default: f64| self.reader.number(path, name, default);
        let length = number("focalLength", 50.0)?.max(1e-6);
        let (width, height) = (
            number("horizontalAperture", 20.955)?,
            number("verticalAperture", 15.2908)?,
        );
        let unit = self.upright.x_axis.length();
        let focus = number("focusDistance", 0.0)? * unit;
        let stop = number("fStop", 0.0)?;
        let lens = Lens {
            fov: 2.0 * (0.5 * height / length).atan().to_degrees(),
            focus: (focus > 0.0).then_some(focus),
            // Lengths of a lens are tenths of the stage's unit.
            aperture: if stop > 0.0 {
                0.1 * length / stop * unit
            } else {
                0.0
            },
        };
        Ok((lens, width / height))
    }
}

/// Is it a matrix that leaves spheres what they are?
fn is_even(axes: &DMat3) -> bool {
    let length = axes.x_axis.length();
    let other = |axis: DVec3| (axis.length() - length).abs() <= 1e-3 * length;
    let is_square = |a: DVec3, b: DVec3| a.dot(b).abs() <= 1e-3 * length * length;
    length > 0.0
        && other(axes.y_axis)
        && other(axes.z_axis)
        && is_square(axes.x_axis, axes.y_axis)
        && is_square(axes.x_axis, axes.z_axis)
        && is_square(axes.y_axis, axes.z_axis)
}

/// The color of a glowing body at a temperature in kelvin, of luminance 1: Planck's spectrum by the formula of Krystek
/// for its chromaticity, in linear sRGB.
///
/// Source: M. Krystek, "An algorithm to calculate correlated colour temperature" (1985).
fn blackbody(kelvin: f64) -> DVec3 {
    let t = kelvin.clamp(1000.0, 15000.0);
    let u = (0.860_117_757 + 1.541_182_54e-4 * t + 1.286_412_12e-7 * t * t)
        / (1.0 + 8.424_202_35e-4 * t + 7.081_451_63e-7 * t * t);
    let v = (0.317_398_726 + 4.228_062_45e-5 * t + 4.204_816_91e-8 * t * t)
        / (1.0 - 2.897_418_16e-5 * t + 1.614_560_53e-7 * t * t);
    let x = 3.0 * u / (2.0 * u - 8.0 * v + 4.0);
    let y = 2.0 * v / (2.0 * u - 8.0 * v + 4.0);
    let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let rgb = DVec3::new(
        DVec3::new(3.240_454_2, -1.537_138_5, -0.498_531_4).dot(xyz),
        DVec3::new(-0.969_266, 1.876_010_8, 0.041_556).dot(xyz),
        DVec3::new(0.055_643_4, -0.204_025_9, 1.057_225_2).dot(xyz),
    );
    let rgb = rgb.max(DVec3::ZERO);
    let luminance = rgb.dot(DVec3::new(0.212_6, 0.715_2, 0.072_2));
    rgb / luminance
}
