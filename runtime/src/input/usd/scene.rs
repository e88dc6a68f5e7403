//! The scene that a USD file shows, as the text of a scene file.

use std::collections::BTreeMap;
use std::fmt::Write;

use glam::{DMat4, DVec3, Vec3};

use super::model::{Lens, Light, Model, Placed};
use super::shade::BARE;
use crate::input::shown::{self, Extent, array, quoted};

impl Model {
    /// The text of a scene file, in which names of files within begin with `prefix`.
    pub(super) fn scene(&self, prefix: &str) -> String {
        let name = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let mut text = format!(
            "name = {}\n\n[animation]\nframes_per_second = {:?}\n",
            quoted(&name),
            self.rate
        );
        let extent = self.extent();
        self.write_view(&extent, &mut text);
        if self.placed.is_empty() && self.lights.is_empty() {
            // What is wrong is told where the geometry is read.
            text.push_str(&shown::geometry(&format!("{prefix}meshes.usd"), &[], ""));
        }
        for (mesh, places) in self.still() {
            let file = format!("{prefix}meshes/{mesh}.usd");
            text.push_str(&shown::geometry(
                &file,
                &places,
                &format!("{prefix}placements/{mesh}.txt"),
            ));
        }
        for (number, placed) in self.placed.iter().enumerate() {
            if placed.moves {
                text.push_str(&shown::geometry(
                    &format!("{prefix}prims/{number}.usd"),
                    &[],
                    "",
                ));
            }
        }
        for material in &self.materials {
            let source = &material.source;
            let _ = writeln!(text, "[materials.{}]", quoted(&material.name));
            let (file, within) = match &material.made {
                Ok(None) => (BARE, None),
                Ok(Some(made)) => (source.as_str(), Some(&made.within)),
                Err(_) => (source.as_str(), Some(source)),
            };
            let _ = writeln!(text, "file = \"{file}.impasto\"");
            if let Some(within) = within {
                let _ = writeln!(text, "material = {}", quoted(within));
            }
            text.push('\n');
        }
        let _ = write!(text, "[materials.\"*\"]\nfile = \"{BARE}.impasto\"\n\n");
        self.write_lights(prefix, &mut text);
        text
    }

    /// Meshes that stay where they are, and their places.
    fn still(&self) -> BTreeMap<usize, Vec<DMat4>> {
        let mut still: BTreeMap<usize, Vec<DMat4>> = BTreeMap::new();
        for placed in self
            .placed
            .iter()
            .filter(|p| !p.moves && p.is_visible && !p.places.is_empty())
        {
            still.entry(placed.mesh).or_default().extend(&placed.places);
        }
        still
    }

    /// Where a mesh is, as a file of places.
    pub(super) fn placements(&self, mesh: usize) -> String {
        let mut text = String::from(shown::PLACES);
        for place in self.still().get(&mesh).into_iter().flatten() {
            text.push_str(&shown::matrix(place));
            text.push('\n');
        }
        text
    }

    fn extent(&self) -> Extent {
        let boxes: Vec<Extent> = self
            .meshes
            .iter()
            .map(|mesh| {
                let mut extent = Extent::default();
                mesh.points
                    .iter()
                    .for_each(|p: &Vec3| extent.take_in(p.as_dvec3()));
                extent
            })
            .collect();
        let mut all = Extent::default();
        for Placed {
            mesh,
            places,
            is_visible,
            ..
        } in &self.placed
        {
            let corners = boxes[*mesh].corners();
            for place in places.iter().filter(|_| *is_visible) {
                corners
                    .iter()
                    .for_each(|corner| all.take_in(place.transform_point3(*corner)));
            }
        }
        all
    }

    fn write_view(&self, extent: &Extent, text: &mut String) {
        let (centre, _) = extent.reach();
        let Some(camera) = &self.camera else {
            let [position, look_at, up] = extent.view().map(array);
            let rows = shown::rows(None);
            let _ = write!(
                text,
                "\n[camera]\nposition = {position}\nlook_at = {look_at}\nup = {up}\nfov = {:?}\n\n[film]\nwidth = {}\nheight = {rows}\n\n",
                shown::FOV,
                shown::COLUMNS,
            );
            return;
        };
        let distance = |transform: &DMat4, lens: &Lens| {
            let forward = -transform.z_axis.truncate().normalize_or(DVec3::Z);
            let along = (centre - transform.w_axis.truncate()).dot(forward);
            let along = if along > 0.0 { along } else { 1.0 };
            lens.focus.unwrap_or(along)
        };
        let lens = &camera.lens;
        let [position, look_at, up] =
            shown::view(&camera.transform, distance(&camera.transform, lens)).map(array);
        let _ = write!(
            text,
            "\n[camera]\nposition = {position}\nlook_at = {look_at}\nup = {up}\nfov = {:?}\n",
            fov(lens)
        );
        if lens.aperture > 0.0 {
            let _ = writeln!(text, "aperture = {:?}", lens.aperture);
        }
        let names = ["position", "look_at", "up"];
        for (index, name) in names.iter().enumerate().filter(|_| camera.keys.len() > 1) {
            let keys = camera.keys.iter().map(|(frame, transform, lens)| {
                let at = shown::view(transform, distance(transform, lens))[index];
                format!("[{frame}, {}]", array(at))
            });
            let _ = writeln!(
                text,
                "keys.{name} = [{}]",
                keys.collect::<Vec<_>>().join(", ")
            );
        }
        let changes = |of: fn(&Lens) -> f64| {
            camera
                .keys
                .iter()
                .any(|(_, _, other)| of(other) != of(lens))
        };
        for (name, of) in [
            ("fov", fov as fn(&Lens) -> f64),
            ("aperture", |lens: &Lens| lens.aperture),
        ] {
            if changes(of) {
                let keys = camera
                    .keys
                    .iter()
                    .map(|(frame, _, lens)| format!("[{frame}, {:?}]", of(lens)));
                let _ = writeln!(
                    text,
                    "keys.{name} = [{}]",
                    keys.collect::<Vec<_>>().join(", ")
                );
            }
        }
        let rows = shown::rows(Some(camera.shape));
        let _ = write!(
            text,
            "\n[film]\nwidth = {}\nheight = {rows}\n\n",
            shown::COLUMNS
        );
    }

    fn write_lights(&self, prefix: &str, text: &mut String) {
        if self.lights.is_empty() && self.dome.is_none() {
            text.push_str(shown::LIGHT);
            return;
        }
        if let Some(dome) = &self.dome {
            match dome.picture {
                // Of a picture's color no more than the strength can be told.
                Some(number) => {
                    let strength = dome.radiance.dot(DVec3::new(0.2126, 0.7152, 0.0722));
                    let _ = write!(
                        text,
                        "[environment]\nfile = \"images/{number}\"\nscale = {strength:?}\nrotate = {:?}\n\n",
                        dome.turn.rem_euclid(360.0)
                    );
                }
                None => {
                    let _ = write!(text, "[environment]\ncolor = {}\n\n", array(dome.radiance));
                }
            }
        }
        for (number, light) in self.lights.iter().enumerate() {
            let _ = match light {
                Light::Distant {
                    to_light,
                    irradiance,
                    angle,
                } => write!(
                    text,
                    "[[lights]]\nkind = \"distant\"\nto_light = {}\nirradiance = {}\nangle = {angle:?}\n\n",
                    array(*to_light),
                    array(*irradiance),
                ),
                Light::Quad {
                    corner,
                    u,
                    v,
                    radiance,
                } => write!(
                    text,
                    "[[lights]]\nkind = \"quad\"\ncorner = {}\nu = {}\nv = {}\nradiance = {}\n\n",
                    array(*corner),
                    array(*u),
                    array(*v),
                    array(*radiance),
                ),
                Light::Ball {
                    center,
                    radius,
                    radiance,
                    cone,
                } => {
                    let spot = cone.map(|(axis, [inner, outer])| {
                        format!(
                            "axis = {}\ninner = {inner:?}\ncone = {outer:?}\n",
                            array(axis)
                        )
                    });
                    write!(
                        text,
                        "[[lights]]\nkind = \"sphere\"\ncenter = {}\nradius = {radius:?}\nradiance = {}\n{}\n",
                        array(*center),
                        array(*radiance),
                        spot.unwrap_or_default(),
                    )
                }
                Light::Mesh { name, radiance, .. } => {
                    let name = quoted(name);
                    let file = quoted(&format!("{prefix}lights/{number}.usd"));
                    write!(
                        text,
                        "[[geometry]]\nfile = {file}\nmaterial = {name}\n\n\
                         [materials.{name}]\nfile = \"lamp.impasto\"\nparams = {{ radiance = {} }}\n\n",
                        array(*radiance),
                    )
                }
            };
        }
    }
}

fn fov(lens: &Lens) -> f64 {
    lens.fov.clamp(0.1, 179.0)
}
