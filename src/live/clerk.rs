//! Errands: what an order asks for beside the picture, done one after another on a thread of their own.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use impasto_runtime::film::{Film, exr, output};
use impasto_runtime::input;
use impasto_viewer::engine::{Answer, Order, Picked, Picture, Traced};

use super::shared::{Shared, Shown};
use super::written;
use crate::files;
use crate::trace::{self, Request};

/// Does errands until the end.
pub(super) fn work(shared: &Shared) {
    while let Some(errand) = shared.next_errand() {
        if let Some(answer) = done(shared, errand) {
            shared.answer(answer);
        }
    }
}

fn done(shared: &Shared, errand: Order) -> Option<Answer> {
    let shown = shared.shown();
    Some(match errand {
        Order::Pick(pixel) => Answer::Picked(shown.and_then(|shown| picked(shared, &shown, pixel))),
        Order::Trace { pixel, sample } => Answer::Traced(match shown {
            Some(shown) => traced(&shown, pixel, sample),
            None => untraced(pixel, sample, "there is no picture yet".into()),
        }),
        Order::Save { path, exposure } => Answer::Saved(match shown {
            Some(shown) => save(&shown, &path, exposure).map(|()| path),
            None => Err(NOTHING.into()),
        }),
        Order::WriteBack => Answer::Saved(write_back(shared)),
        Order::Read(path) => Answer::Read(read(&path)),
        _ => return None,
    })
}

const NOTHING: &str = "there is no picture yet\n  hint: save again once there is one";

/// What is at a pixel.
fn picked(shared: &Shared, shown: &Shown, pixel: [u32; 2]) -> Option<Picked> {
    let seen = shared.first_hits(shown).at(&shown.camera, pixel)?;
    let binding = seen.material.map(|material| material as usize);
    let instances = shown.program.instances();
    let material = binding.and_then(|binding| Some(instances.get(binding)?.info.material));
    Some(Picked {
        pixel,
        binding,
        object: Some(seen.object).filter(|name| !name.is_empty()),
        position: seen.position.to_array(),
        depth: seen.depth,
        source: material.and_then(|material| shown.program.place(material)),
        bounds: Some(seen.bounds.map(|corner| corner.to_array())),
    })
}

/// The path of a sample, from the camera on.
fn traced(shown: &Shown, pixel: [u32; 2], sample: u32) -> Traced {
    let mut scene = (*shown.scene).clone();
    scene.camera = shown.camera;
    let request = Request {
        pixel,
        sample,
        seed: shown.seed,
        ..Request::default()
    };
    match trace::replay(&scene, &shown.program, &request) {
        Ok(replay) => {
            let text = trace::text(&replay);
            let origin = scene.origin.to_array();
            let path = replay.double.map(|path| {
                // People are told places in the world, the window those of the scene.
                let place = |at: [f64; 3]| std::array::from_fn(|i| (at[i] - origin[i]) as f32);
                let first = scene.camera.position.to_array();
                let hits = path
                    .vertices
                    .iter()
                    .filter_map(|v| Some(place(v.hit.as_ref()?.position)));
                std::iter::once(first).chain(hits).collect()
            });
            Traced {
                pixel,
                sample,
                vertices: path.unwrap_or_default(),
                text,
            }
        }
        Err(error) => untraced(pixel, sample, error.to_string()),
    }
}

fn untraced(pixel: [u32; 2], sample: u32, why: String) -> Traced {
    Traced {
        pixel,
        sample,
        vertices: Vec::new(),
        text: format!("{why}\n"),
    }
}

/// Writes what is shown, as the extension of the name says.
fn save(shown: &Shown, path: &Path, exposure: f32) -> Result<(), String> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let picture = || Film {
        width: shown.picture.width,
        height: shown.picture.height,
        pixels: shown.picture.pixels.to_vec(),
        samples: shown.picture.counts.to_vec(),
    };
    let written = match (extension.to_str(), &shown.film) {
        (Some("exr"), Some((film, _))) => exr::write(film, path),
        (Some("png" | "exr"), _) => output::write(&picture(), path, exposure),
        (Some("film"), Some((film, true))) => film.write(path),
        (Some("film"), Some((_, false))) => {
            return Err(
                "a .film file is a part of a render by one seed, but an error is estimated by samples of two\n  \
                 hint: write a picture, or end the estimate"
                    .into(),
            );
        }
        (Some("film"), None) => {
            return Err("not every pixel has a sample yet\n  hint: save again in a moment".into());
        }
        _ => {
            return Err(format!(
                "cannot write `{}`: pictures are .exr or .png files, and parts of one .film files",
                path.display()
            ));
        }
    };
    written.map_err(|error| error.to_string())
}

/// Writes what was set into the scene file.
fn write_back(shared: &Shared) -> Result<PathBuf, String> {
    let project = shared.news().project;
    if !project.is_scene {
        return Err(
            "a material that is looked at on a set has no scene to write values into\n  hint: `impasto new NAME \
             --scene` makes one, or change the defaults in the source"
                .into(),
        );
    }
    let path = input::scene(&project.path);
    let file = input::on_disk(&path);
    if file != path {
        return Err(format!(
            "values are written into scene files, and `{0}` is no such file\n  hint: `impasto import {0} --out FOLDER` \
             makes a scene of it",
            file.display()
        ));
    }
    let text = std::fs::read_to_string(&path).map_err(|error| {
        format!(
            "cannot read `{}`: {}",
            path.display(),
            files::reason(&error)
        )
    })?;
    let mut values = shared.wanted().0.values;
    let params = project.bindings.iter().flat_map(|binding| {
        let params = binding.params.iter().filter(|p| p.is_set);
        params.map(|p| (binding.name.as_str(), p.interface.name.as_str()))
    });
    let set: Vec<(&str, &str)> = params.collect();
    values.retain(|id, _| set.contains(&(id.binding.as_str(), id.param.as_str())));
    let written = written::with_values(&text, &values)?;
    if written != text {
        files::write_whole(&path, written.as_bytes())?;
    }
    Ok(path)
}

/// A picture to compare with.
fn read(path: &Path) -> Result<Arc<Picture>, String> {
    let film = output::read(path, "picture").map_err(|error| error.to_string())?;
    Ok(Arc::new(Picture {
        width: film.width,
        height: film.height,
        pixels: Arc::new(film.pixels),
        counts: Arc::new(film.samples),
        ..Picture::default()
    }))
}
