//! Checkpoints: a film file that a render keeps up to date, and goes on from when it is started
//! again with the same arguments.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use impasto::files::{self, Lock, LockError};
use impasto::runtime::film::file::FilmFile;
use impasto::runtime::film::output::remove_unfinished;
use impasto::runtime::options::Progress;
use impasto::runtime::render::passes::Keeping;
use impasto::{MultiRenderer, Rendering, RuntimeError};

use super::{Failure, Global};

#[derive(Args)]
pub(super) struct CheckpointArgs {
    /// Keep a checkpoint in this film file; resume from it if it exists
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Seconds between two checkpoints; an interruption loses at most that
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = parse_seconds)]
    checkpoint_every: f64,
}

pub(super) fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.01..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err("expected a number of seconds from 0.01 to 86400".into()),
    }
}

/// Called with how far a render is; breaks to end it.
type OnProgress<'a> = &'a mut dyn FnMut(&Progress) -> std::ops::ControlFlow<()>;

impl CheckpointArgs {
    /// Is one to be kept?
    pub(super) fn is_given(&self) -> bool {
        self.checkpoint.is_some()
    }

    /// Keeps the checkpoint to this process. Two renders that go on from one would each undo what the other kept.
    pub(super) fn lock(&self) -> Result<Option<Lock>, Failure> {
        let Some(path) = &self.checkpoint else {
            return Ok(None);
        };
        files::check_writable(path)?;
        let lock = Lock::take(path).map_err(|why| {
            let hint = "wait until that render ends, or name another with `--checkpoint`";
            let is_transient = matches!(why, LockError::InUse(_));
            let message = format!("cannot use the checkpoint: {why}\n  hint: {hint}");
            Failure::new(message, is_transient)
        })?;
        remove_unfinished(path);
        Ok(Some(lock))
    }

    /// The film that an earlier run left. Whether it can be used is asked before any work.
    pub(super) fn read(&self) -> Result<Option<FilmFile>, Failure> {
        let Some(path) = &self.checkpoint else {
            return Ok(None);
        };
        if !path.exists() {
            return Ok(None);
        }
        let film = FilmFile::read(path);
        film.map(Some)
            .map_err(|error| self.failure(&error.to_string()))
    }

    /// Renders, from `start` on if there is one. A checkpoint that cannot be written is noted, since
    /// the render itself is still worth finishing.
    pub(super) fn render(
        &self,
        renderer: &mut MultiRenderer<'_>,
        start: Option<FilmFile>,
        global: &Global,
        progress: OnProgress<'_>,
    ) -> Result<Rendering, Failure> {
        let Some(path) = &self.checkpoint else {
            return renderer.render(progress).map_err(super::runtime);
        };
        if let Some(film) = &start {
            let (done, name) = (film.samples(), path.display());
            global.note(&format!("going on from the {done} samples of `{name}`"));
            let devices = renderer.makers();
            let others = film.about.makers.iter();
            for other in others.filter(|maker| !devices.contains(maker)) {
                let names: Vec<String> = devices.iter().map(ToString::to_string).collect();
                let device = names.join(" and ");
                global.note(&format!(
                    "warning: they are of {other}, and {device} goes on: the bits may not be those of one device"
                ));
            }
        }
        let mut keep = |film: &FilmFile| {
            if let Err(error) = film.write(path) {
                global.note(&format!("warning: no checkpoint: {error}"));
            }
            Ok(())
        };
        let keeping = Keeping {
            start,
            every: Duration::from_secs_f64(self.checkpoint_every),
            keep: &mut keep,
        };
        let rendering = renderer.render_keeping(keeping, progress);
        rendering.map_err(|error| match error {
            RuntimeError::OtherRender(reason) => {
                let name = path.display();
                self.failure(&format!("cannot use the checkpoint `{name}`: {reason}"))
            }
            error => super::runtime(error),
        })
    }

    fn failure(&self, message: &str) -> Failure {
        let hint = "remove it to start anew, or name another with `--checkpoint`";
        Failure::Error(format!("{message}\n  hint: {hint}"))
    }
}
