//! Renders on an open device, follows orders, and hands out pictures, until the end or until the device is lost.
//!
//! There are two sets of kernels. Open ones read the values of parameters from tables: they are there soon after a file
//! was saved, and whoever drags a slider sees them. Once a hand has rested for a while, final ones are built beside
//! the render, which are those of `impasto render`. They begin the picture again, without anybody noticing: the
//! picture by open kernels stays until theirs has as many samples. So what is left alone has in the end the bits of
//! `impasto render`, and no picture gets worse on the way.
//!
//! Drivers of GPUs take longer for new code than the processor does. While one makes open kernels, those of the
//! processor stand in for them: they show the first picture, which the GPU then goes on from in the same way.

mod sets;
mod tell;

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use impasto_runtime::device::{Choice, Device, DeviceOptions};
use impasto_runtime::error::RuntimeError;
use impasto_viewer::engine::{Picture, Problem};

use super::LiveOptions;
use super::built::{Applied, Built, Code, settable};
use super::course::{Asked, Course, Step, is_done};
use super::mailbox::{Job, Mailbox, Outcome};
use super::maker::Maker;
use super::pixels::Pixels;
use super::problems;
use super::shared::Shared;
use super::survey::Survey;
use super::wanted::Wanted;
use sets::{Sets, Turn};

/// A hand has rested when it has done nothing for so long; where the processor renders, making kernels takes its time,
/// and the hand may soon move again.
const RESTED: Duration = Duration::from_millis(500);
const RESTED_LONG: Duration = Duration::from_millis(1500);
/// A picture rests for so long at most while others kernels are made.
const HELD: Duration = Duration::from_secs(2);
/// How long to wait for something to do.
const IDLE: Duration = Duration::from_millis(50);
/// How often it is told which kernels take how long.
const KERNELS_EVERY: Duration = Duration::from_millis(300);

/// Why a session ended.
pub(super) enum End {
    /// It was asked to.
    Quit,
    /// The device is lost.
    Lost(RuntimeError),
}

/// Renders until the end.
pub(super) fn run(device: &Device, shared: &Shared, path: &PathBuf, options: &LiveOptions) -> End {
    // Where the processor cannot render, one waits for the driver.
    let processor = match device {
        Device::Gpu(_) => Device::open(&DeviceOptions {
            choice: Choice::Cpu,
            ..options.device.clone()
        })
        .ok(),
        Device::Cpu(_) => None,
    };
    let (mailbox, kept) = (Mailbox::default(), Mutex::default());
    std::thread::scope(|scope| {
        for (code, name) in [(Code::Open, "make"), (Code::Final, "make final")] {
            let builder = std::thread::Builder::new()
                .name(name.into())
                .stack_size(super::STACK_BYTES);
            let maker = Maker {
                device,
                stand_in: processor.as_ref().filter(|_| code == Code::Open),
                shared,
                mailbox: &mailbox,
                path,
                options,
                kept: &kept,
                code,
            };
            if let Err(error) = builder.spawn_scoped(scope, move || maker.work()) {
                mailbox.end();
                return End::Lost(RuntimeError::Threads {
                    threads: 1,
                    reason: error.to_string(),
                });
            }
        }
        let mut session = Session::new(device, shared, &mailbox, options);
        let end = session.render();
        mailbox.end();
        end
    })
}

struct Session<'d, 's> {
    device: &'d Device,
    shared: &'s Shared,
    mailbox: &'s Mailbox<'d>,
    options: &'s LiveOptions,
    /// What is followed, and the number of the order that it came to be by.
    following: Wanted,
    pictures: u64,
    sets: Sets<'d>,
    /// Whether the open kernels are as good as final ones.
    open_is_final: bool,
    /// Counts jobs.
    jobs: u64,
    /// When the last one was given.
    asked_at: Instant,
    /// The job that made the open kernels, and when they came.
    open_job: u64,
    opened: Instant,
    course: Option<Course>,
    /// Samples of the last picture that was handed out of what is shown now.
    handed: u32,
    /// Whether a GPU of its own renders.
    is_fast: bool,
    /// What is wrong with the files, and with values.
    of_files: Vec<Problem>,
    of_values: Vec<Problem>,
    /// What keeps the device from rendering these kernels.
    failed: Option<String>,
    number: u64,
    shown: Option<Arc<Picture>>,
    told_kernels: Option<Instant>,
    /// What was found beside the picture.
    survey: Option<Arc<Survey>>,
}

impl<'d, 's> Session<'d, 's> {
    fn new(
        device: &'d Device,
        shared: &'s Shared,
        mailbox: &'s Mailbox<'d>,
        options: &'s LiveOptions,
    ) -> Self {
        let (following, pictures) = shared.wanted();
        let is_fast = crate::plan::is_fast(device);
        let news = shared.news();
        Self {
            device,
            shared,
            mailbox,
            options,
            following,
            pictures,
            sets: Sets::new(is_fast),
            open_is_final: false,
            jobs: 0,
            asked_at: Instant::now(),
            open_job: 0,
            opened: Instant::now(),
            course: None,
            handed: 0,
            is_fast,
            of_files: Vec::new(),
            of_values: Vec::new(),
            failed: None,
            number: news.picture.as_ref().map_or(0, |picture| picture.number),
            shown: news.picture,
            told_kernels: None,
            survey: None,
        }
    }

    fn render(&mut self) -> End {
        self.make(Code::Open);
        loop {
            match self.turn() {
                Ok(true) => {}
                Ok(false) => return End::Quit,
                Err(error) if is_loss(&error) => return End::Lost(error),
                Err(error) => {
                    self.change();
                    self.failed = Some(error.to_string());
                    self.tell_state();
                }
            }
        }
    }

    /// Follows orders, takes what was made, and renders a portion or waits. `false` at the end.
    fn turn(&mut self) -> Result<bool, RuntimeError> {
        if self.shared.quits() {
            return Ok(false);
        }
        if let (true, Device::Gpu(gpu)) = (self.shared.takes_loss(), self.device) {
            gpu.lose();
        }
        if let Some(made) = self.mailbox.take() {
            self.adopt(made.job, made.outcome)?;
        }
        let (wanted, pictures) = self.shared.wanted();
        if wanted != self.following {
            self.follow(wanted)?;
        }
        self.pictures = pictures;
        if let Some(survey) = self.shared.take_survey() {
            self.survey = Some(survey);
            self.show_again();
        }
        self.finish();
        if !self.portion()? {
            self.shared.wait(IDLE);
        }
        Ok(true)
    }

    /// Has kernels made for what is followed now.
    fn make(&mut self, code: Code) {
        self.jobs += 1;
        self.asked_at = Instant::now();
        self.mailbox.ask(Job {
            wanted: self.following.clone(),
            code,
            of: self.open_job,
            number: self.jobs,
        });
        self.tell_state();
    }

    /// Follows what is wanted from now on.
    fn follow(&mut self, wanted: Wanted) -> Result<(), RuntimeError> {
        let old = std::mem::replace(&mut self.following, wanted);
        if !self.is_fast && old.moved != self.following.moved {
            // The hand needs the processor.
            self.mailbox.drop_final();
        }
        let new = &self.following;
        let is_other = (&old.size, &old.outputs, &old.strategy, old.frame, old.reads)
            != (&new.size, &new.outputs, &new.strategy, new.frame, new.reads);
        let begins = (old.restarts, old.crop, old.goals.is_some())
            != (new.restarts, new.crop, new.goals.is_some());
        let complains = old.complaints != new.complaints;
        if begins {
            self.change();
        }
        if complains {
            self.tell_project();
        }
        if is_other {
            self.make(Code::Open);
        }
        self.apply()?;
        self.tell_state();
        Ok(())
    }

    /// Gives the kernels that render the camera and the values that are wanted.
    fn apply(&mut self) -> Result<(), RuntimeError> {
        let values = self.following.values.clone();
        let camera = self.following.camera;
        if let (Turn::Final, Some(last)) = (self.sets.turn, &self.sets.last)
            && settable(&values, &last.described) != last.values
        {
            self.sets.turn = Turn::Open;
            self.change();
        }
        let Some(built) = self.sets.active_mut() else {
            return Ok(());
        };
        let applied = [built.set(&values)?, built.look(camera)];
        let is_changed = applied.iter().any(|a| matches!(a, Applied::Changed));
        let other = applied.iter().any(|a| matches!(a, Applied::OtherKernels));
        let [of_values, _] = applied;
        let was_wrong = !self.of_values.is_empty();
        self.of_values = match of_values {
            Applied::Wrong(problems) => problems,
            _ => Vec::new(),
        };
        if is_changed {
            self.change();
            self.open_is_final &= self.sets.turn == Turn::Final;
        }
        if is_changed || was_wrong || !self.of_values.is_empty() {
            self.tell_project();
        }
        // One that is under way is waited for: whoever drags goes on dragging.
        if other && self.mailbox.at_work() != Some(Code::Open) {
            self.make(Code::Open);
        }
        Ok(())
    }

    /// Takes over what was made.
    fn adopt(&mut self, job: Job, outcome: Outcome<'d>) -> Result<(), RuntimeError> {
        match (job.code, outcome) {
            (code, Outcome::Failed(error)) if is_loss(&error) && !is_full(code, &error) => {
                return Err(error);
            }
            (Code::Open, Outcome::Failed(error)) => {
                self.of_files = vec![problems::of_render(&error)];
            }
            (Code::Open, Outcome::Wrong(problems)) => self.of_files = problems,
            (_, Outcome::StandsIn(built, problems)) => {
                self.of_files = problems;
                self.failed = None;
                self.take_stand_in(*built)?;
            }
            (Code::Open, Outcome::Built(built, problems)) => {
                self.of_files = problems;
                self.failed = None;
                self.open_job = job.number;
                self.opened = Instant::now();
                self.forget_written(&built);
                self.take_open(*built)?;
            }
            (Code::Open, Outcome::Same) => {}
            // It was made for what is no longer there.
            (Code::Final, _) if job.of != self.open_job => {}
            (Code::Final, Outcome::Built(built, problems)) => self.take_last(*built, problems)?,
            (Code::Final, Outcome::Same) => self.open_is_final = true,
            // What open kernels can do, final ones may not; the picture stays.
            (Code::Final, Outcome::Wrong(problems)) => {
                self.of_files = problems;
                self.open_is_final = true;
            }
            (Code::Final, Outcome::Failed(error)) => {
                self.of_files.push(Problem {
                    is_warning: true,
                    ..problems::of_render(&error)
                });
                self.open_is_final = true;
            }
        }
        self.tell_project();
        self.tell_state();
        Ok(())
    }

    /// Values that were written into the scene need not be set any more.
    fn forget_written(&mut self, built: &Built<'d>) {
        let written = |id: &impasto_viewer::engine::ParamId| {
            let binding = built.described.project.bindings.iter();
            let binding = binding.into_iter().find(|b| b.name == id.binding)?;
            let param = binding
                .params
                .iter()
                .find(|p| p.interface.name == id.param)?;
            param.written.clone()
        };
        let is_same = |id: &_, value: &_| written(id).as_ref() == Some(value);
        let values = &mut self.following.values;
        values.retain(|id, value| !is_same(id, value));
        self.shared
            .amend(|wanted| wanted.values.retain(|id, value| !is_same(id, value)));
    }

    /// Goes on by kernels of the processor until those of the device are there.
    fn take_stand_in(&mut self, mut built: Built<'d>) -> Result<(), RuntimeError> {
        let wanted = (self.following.values.clone(), self.following.camera);
        let applied = [built.set(&wanted.0)?, built.look(wanted.1)];
        if applied.iter().all(|a| !matches!(a, Applied::OtherKernels)) {
            self.sets.stand_in = Some(built);
            self.sets.turn = Turn::StandIn;
            self.change();
        }
        Ok(())
    }

    /// Takes open kernels over, unless they show what is shown anyway.
    fn take_open(&mut self, mut built: Built<'d>) -> Result<(), RuntimeError> {
        let wanted = (self.following.values.clone(), self.following.camera);
        let applied = [built.set(&wanted.0)?, built.look(wanted.1)];
        let other = applied.iter().any(|a| matches!(a, Applied::OtherKernels));
        let stood_in = self.sets.stand_in.take();
        let sets = &mut self.sets;
        let is_same = sets.open.as_ref().is_some_and(|old| {
            let same_camera = old.camera == built.camera || sets.turn == Turn::Final;
            same_camera
                && sets.turn != Turn::StandIn
                && old.size() == built.size()
                && old.renderer.fingerprint_but_camera() == built.renderer.fingerprint_but_camera()
        });
        if is_same && let Some(old) = &mut sets.open {
            // The samples stay; what is said of them may be new.
            old.described = built.described;
            old.scene = built.scene;
            if let Some(last) = &mut sets.last {
                last.described = old.described.clone();
            }
        } else {
            let is_as_shown = stood_in.is_some_and(|shown| shown.shows_what(&built));
            sets.open = Some(built);
            sets.last = None;
            sets.turn = Turn::Open;
            if is_as_shown {
                self.begin();
            } else {
                self.change();
            }
        }
        self.open_is_final = false;
        if other {
            self.make(Code::Open);
            return Ok(());
        }
        // The file may have another camera than before.
        self.apply()
    }

    /// Goes on by final kernels, if they are for what is wanted.
    fn take_last(
        &mut self,
        mut built: Built<'d>,
        problems: Vec<Problem>,
    ) -> Result<(), RuntimeError> {
        let values = settable(&self.following.values, &built.described);
        let is_here = matches!(
            built.look(self.following.camera),
            Applied::Same | Applied::Changed
        );
        if values != built.values || !is_here {
            return Ok(());
        }
        self.of_files = problems;
        self.sets.last = Some(built);
        self.sets.turn = Turn::Final;
        self.begin();
        Ok(())
    }

    /// Has final kernels made once the hand rests.
    fn finish(&mut self) {
        let has_open = self.sets.open.is_some() && self.failed.is_none();
        let is_turn = self.sets.turn == Turn::Open && !self.open_is_final;
        let is_due = has_open && is_turn && !self.following.paused;
        let rested = if self.is_fast { RESTED } else { RESTED_LONG };
        let rests =
            !self.following.dragged && self.following.moved.max(self.opened).elapsed() >= rested;
        let has_picture = self
            .course
            .as_ref()
            .is_some_and(|course| course.pictures > 0);
        if is_due && rests && has_picture && self.mailbox.at_work().is_none() {
            // Perhaps those of before are.
            let values = self.following.values.clone();
            if let Some(last) = &mut self.sets.last
                && settable(&values, &last.described) == last.values
                && matches!(
                    last.look(self.following.camera),
                    Applied::Same | Applied::Changed
                )
            {
                self.sets.turn = Turn::Final;
                self.begin();
                return;
            }
            self.make(Code::Final);
        }
    }

    /// What is shown becomes another picture.
    fn change(&mut self) {
        self.course = None;
        self.handed = 0;
    }

    /// Begins the picture anew. Nothing is handed out until it is as good as the one that is there, if that is the same
    /// but for its last bits.
    fn begin(&mut self) {
        let silent_below = self.handed.min(self.following.most_samples());
        if let Some(built) = self.sets.active_mut() {
            let sitting = built.renderer.sit();
            let before = self.course.take();
            self.course = Some(Course::new(sitting, silent_below, before.as_ref()));
        }
    }

    fn asked(&self, built: &Built<'_>) -> Asked {
        Asked {
            seed: self.options.seed,
            samples: self.following.most_samples(),
            goals: self.following.goals,
            pixels: Pixels::new(built.size(), self.following.crop),
        }
    }

    /// Whether a picture rests that is about to be replaced: it would take the time of what is to replace it.
    fn holds(&self) -> bool {
        let is_soon = self.asked_at.elapsed() < self.held();
        is_soon && self.handed > 0 && self.mailbox.at_work() == Some(Code::Open)
    }

    /// How long it rests at most. A driver of a GPU in software needs the processor that stands in.
    fn held(&self) -> Duration {
        if self.sets.turn == Turn::StandIn && !self.is_fast {
            Duration::MAX
        } else {
            HELD
        }
    }

    /// Takes a portion of samples, and hands out a picture of them. `false` if there is nothing to do.
    fn portion(&mut self) -> Result<bool, RuntimeError> {
        let waits = self.following.paused || self.failed.is_some() || self.holds();
        if self.sets.active().is_none() || waits {
            return Ok(false);
        }
        if self.course.is_none() {
            self.begin();
        }
        let (Some(built), Some(course)) = (self.sets.active(), &self.course) else {
            return Ok(false);
        };
        let asked = self.asked(built);
        let Some(step) = course.next(&asked, self.sets.speed()) else {
            return Ok(false);
        };
        if !self.take(&step, &asked)? {
            // What is known of the error stays, should it be the same picture by other kernels.
            self.begin();
            return Ok(true);
        }
        let Some(course) = &mut self.course else {
            return Ok(true);
        };
        let has_picture = course.took(&step, &asked);
        if has_picture || course.needs_look(&asked) {
            let begun = Instant::now();
            self.look(&step, &asked, has_picture)?;
            self.sets.speed_mut().handed_out(begun.elapsed());
        }
        let is_done = self
            .course
            .as_ref()
            .is_some_and(|course| is_done(course, &asked));
        if is_done || has_picture {
            self.tell_state();
        }
        Ok(true)
    }

    /// Takes the samples of a step; `false` if it was given up for another picture. The first picture after an order is
    /// not given up for the next order: a hand that moves all the time would see none.
    fn take(&mut self, step: &Step, asked: &Asked) -> Result<bool, RuntimeError> {
        let (shared, mailbox, pictures) = (self.shared, self.mailbox, self.pictures);
        let held_for = self.held();
        let (Some(built), Some(course)) = (self.sets.active_mut(), &mut self.course) else {
            return Ok(false);
        };
        let is_first = course.pictures == 0 && course.silent_below == 0;
        let pixels = built.select(asked.pixels, step.some)?;
        built.renderer.select(&impasto_runtime::render::Samples {
            seed: asked.seed,
            first: 0,
            count: asked.samples,
        })?;
        let ends = || {
            let is_other = shared.pictures() != pictures && !is_first;
            is_other || mailbox.has_other() || shared.quits()
        };
        // Files are read again at once, and the samples stay until it is known that they are of something else.
        let reads = Cell::new(self.following.reads);
        let asked_at = Cell::new(self.asked_at);
        let (of, number) = (self.open_job, self.jobs + 1);
        let read_again = || {
            if shared.reads() == reads.get() {
                return;
            }
            let (wanted, _) = shared.wanted();
            reads.set(wanted.reads);
            asked_at.set(Instant::now());
            mailbox.ask(Job {
                wanted,
                code: Code::Open,
                of,
                number,
            });
        };
        let has_shown = self.handed > 0;
        let holds = || {
            let is_soon = asked_at.get().elapsed() < held_for;
            is_soon && has_shown && mailbox.at_work() == Some(Code::Open)
        };
        let mut held = Duration::ZERO;
        let mut look = |_: &_| {
            let begun = Instant::now();
            read_again();
            while holds() && !ends() {
                shared.wait(IDLE);
                held = held.max(begun.elapsed());
                read_again();
            }
            if ends() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let begun = Instant::now();
        let taken = built
            .renderer
            .take_portion(&mut course.sitting, &step.portion, &mut look)?;
        if taken {
            let paths = pixels * u64::from(step.portion.count);
            let time = begun.elapsed().saturating_sub(held);
            self.sets.speed_mut().took(step, paths, time);
        }
        if reads.get() != self.following.reads {
            self.following.reads = reads.get();
            (self.asked_at, self.jobs) = (asked_at.get(), number);
        }
        Ok(taken)
    }
}

/// Is there no room for final kernels beside the open ones? These render on.
fn is_full(code: Code, error: &RuntimeError) -> bool {
    code == Code::Final && matches!(error, RuntimeError::OutOfMemory(_))
}

/// Is the device to be opened anew? Calls on one that is lost are refused, and not always for that reason.
fn is_loss(error: &RuntimeError) -> bool {
    matches!(
        error,
        RuntimeError::DeviceLost(_) | RuntimeError::Validation(_) | RuntimeError::OutOfMemory(_)
    )
}
