//! What a session tells of itself: pictures and what stands beside them, the project with its values, and its state.

use std::sync::Arc;
use std::time::Instant;

use impasto_runtime::device::Device;
use impasto_runtime::error::RuntimeError;
use impasto_runtime::film::Sums;
use impasto_viewer::engine::{Picture, PictureLayer, Problem, State};

use super::super::built::{Built, Code};
use super::super::course::{Asked, Course, Step, is_done};
use super::super::shared::Shown;
use super::super::survey::{self, Planned, Survey};
use super::super::{kernels, picture, problems, project};
use super::sets::Turn;
use super::{KERNELS_EVERY, Session};

impl Session<'_, '_> {
    /// Looks at the film, and hands it out as a picture.
    pub(super) fn look(
        &mut self,
        step: &Step,
        asked: &Asked,
        has_picture: bool,
    ) -> Result<(), RuntimeError> {
        let (Some(built), Some(course)) = (self.sets.active(), &mut self.course) else {
            return Ok(());
        };
        let sums = built.renderer.sums_of(&course.sitting)?;
        course.look(step, asked, &sums);
        if !has_picture {
            return Ok(());
        }
        self.number += 1;
        let before = self.shown.as_deref();
        let mut picture = picture(self.number, built, course, asked, &sums, before);
        let survey = self.survey.as_deref().filter(|_| self.following.surveys);
        picture.layers.extend(own_layers(built, course, survey));
        let picture = Arc::new(picture);
        let is_coarse = course.stride() > 1;
        let film = (!is_coarse).then(|| {
            let film = built.renderer.film_of(&course.sitting, sums);
            (Arc::new(film), asked.goals.is_none())
        });
        if let Some((film, true)) = &film {
            course.keep(film);
        }
        course.pictures += 1;
        self.handed = course.samples();
        self.shared.show(Shown {
            scene: built.scene.clone(),
            program: built.program.clone(),
            camera: built.camera,
            picture: picture.clone(),
            film,
            seed: asked.seed,
            origin: built.origin,
            planned: planned(self.device, built, course),
        });
        let is_late = |told: Instant| told.elapsed() >= KERNELS_EVERY;
        let due = course.pictures == 1 || self.told_kernels.is_none_or(is_late);
        let survey = self.survey.as_deref();
        let kernels = || Arc::new(kernels::of(built, &course.sitting, survey));
        let kernels = due.then(kernels);
        if due {
            self.told_kernels = Some(Instant::now());
        }
        let errors = course.error_points();
        self.shown = Some(picture.clone());
        self.shared.tell(|news| {
            news.picture = Some(picture);
            if let Some(kernels) = kernels
                && *news.kernels != *kernels
            {
                news.kernels = kernels;
            }
            if *news.errors != errors {
                news.errors = Arc::new(errors);
            }
        });
        Ok(())
    }

    /// Hands the last picture out again, with what was found beside it since.
    pub(super) fn show_again(&mut self) {
        let built = self.sets.active();
        let (Some(built), Some(course), Some(shown)) = (built, &self.course, &self.shown) else {
            return;
        };
        let survey = self.survey.as_deref();
        let kernels = kernels::of(built, &course.sitting, survey);
        self.shared.tell(|news| {
            if *news.kernels != kernels {
                news.kernels = Arc::new(kernels);
            }
        });
        // One of before the last order is not of what was looked at.
        if self.following.surveys && shown.camera == Some(built.camera) {
            let own = own_layers(built, course, survey);
            let is_recorded = |l: &PictureLayer| own.iter().all(|own| own.name != l.name);
            let recorded = shown.layers.iter().filter(|l| is_recorded(l)).cloned();
            self.number += 1;
            let picture = Arc::new(Picture {
                number: self.number,
                layers: recorded.chain(own.iter().cloned()).collect(),
                ..(**shown).clone()
            });
            self.shown = Some(picture.clone());
            self.shared.tell(|news| news.picture = Some(picture));
        }
    }

    /// Says what is shown, with its values, and what is wrong.
    pub(super) fn tell_project(&mut self) {
        let project = self.sets.active().map(|built| {
            let values = &built.values;
            Arc::new(project::with_values(
                &built.described.project,
                &built.program,
                values,
            ))
        });
        let complaints = self.following.complaints.values();
        let all = self
            .of_files
            .iter()
            .chain(&self.of_values)
            .chain(complaints);
        let all: Vec<Problem> = all.cloned().collect();
        self.shared.tell(|news| {
            if let Some(project) = project {
                news.project = project;
            }
            if *news.problems != all {
                news.problems = Arc::new(all);
            }
        });
    }

    /// Says what the engine is at.
    pub(super) fn tell_state(&mut self) {
        if self.mailbox.at_work() == Some(Code::Open) {
            // The maker says what it is at.
            return;
        }
        let is_done = match (self.sets.active(), &self.course) {
            (Some(built), Some(course)) => is_done(course, &self.asked(built)),
            _ => false,
        };
        // What open kernels have done is done again by final ones.
        let is_done = is_done && (self.sets.turn == Turn::Final || self.open_is_final);
        let state = if let Some(why) = &self.failed {
            State::Failed(why.clone())
        } else if problems::has_errors(&self.of_files) {
            State::Broken
        } else if self.following.paused {
            State::Paused
        } else if is_done {
            State::Done
        } else {
            State::Rendering
        };
        if self.shared.news().state != state {
            self.shared.tell(|news| news.state = state);
        }
    }
}

/// The picture that a film holds.
fn picture(
    number: u64,
    built: &Built<'_>,
    course: &Course,
    asked: &Asked,
    sums: &Sums,
    before: Option<&Picture>,
) -> Picture {
    let [width, height] = built.size();
    let (pixels, counts) = picture::pixels(sums, &asked.pixels, course.stride(), before);
    let (nonfinite, dropped) = built.renderer.dropped_of(&course.sitting);
    let examples = dropped.iter().filter_map(|d| d.example.as_ref());
    let mut places: Vec<u32> = examples.map(|e| e.pixel[1] * width + e.pixel[0]).collect();
    places.sort_unstable();
    places.dedup();
    Picture {
        number,
        width,
        height,
        camera: Some(built.camera),
        samples: course.samples().max(1),
        samples_asked: asked.samples,
        elapsed: course.begun.elapsed(),
        pixels: Arc::new(pixels),
        counts: Arc::new(counts),
        layers: picture::layers(sums),
        nonfinite,
        nonfinite_pixels: Arc::new(places),
        stands_in: built.stands_in,
    }
}

/// Layers that no output records: what is known of a picture's error, and what was found of what its pixels see.
fn own_layers(built: &Built<'_>, course: &Course, survey: Option<&Survey>) -> Vec<PictureLayer> {
    let error = course.errors.as_ref().map(survey::error_layer);
    let survey = survey.filter(|survey| survey.origin == Some(built.origin));
    let seen = survey.map(|s| s.layers(&built.camera, &built.program, built.renderer.plan()));
    error
        .into_iter()
        .chain(seen.into_iter().flatten())
        .collect()
}

/// What is to be explained of a plan, where a model knows its times.
fn planned(device: &Device, built: &Built<'_>, course: &Course) -> Option<Planned> {
    let workload = built.renderer.workload_of(&course.sitting)?;
    Some(Planned {
        plan: built.renderer.plan().clone(),
        workload,
        device: device.info(),
    })
}
