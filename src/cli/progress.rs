//! How far a command is: a bar on a terminal, and elsewhere a plain line every few seconds, so that logs of farms and
//! editors tell the same. With `--progress openjd` it is lines on standard output that workers of OpenJD take.
//!
//! A command has one [`Meter`] for all of its work. What it shows never falls, and is complete only when the work is.

use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use impasto::runtime::options::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::{Global, ProgressForm};

/// The time between two lines, and before the first one.
const EVERY: Duration = Duration::from_secs(5);
/// The time between two looks at a bar whose work says nothing: its clock goes on.
const TICK: Duration = Duration::from_millis(500);
/// The time between two lines for a program.
const OFTEN: Duration = Duration::from_secs(1);
/// Steps of a bar.
const STEPS: u64 = 10_000;

/// The bar on the terminal, if there is one. Whatever else is written goes above it.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// What is locked here is whole after a panic too.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes something else than progress, without a bar in its way.
pub(super) fn aside<T>(write: impl FnOnce() -> T) -> T {
    let bar = lock(&BAR).clone();
    match bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Shows how far a command is, until it is dropped.
pub(super) struct Meter(Shown);

enum Shown {
    Nowhere,
    Bar(ProgressBar, Mutex<State>),
    Lines(Arc<Ticking>, Option<JoinHandle<()>>),
}

/// Lines, and what the thread that writes them waits for.
struct Ticking {
    begin: Instant,
    /// None once the command is done.
    lines: Mutex<Option<Lines>>,
    ended: Condvar,
}

impl Meter {
    /// For a command that begins now.
    pub(super) fn new(global: &Global) -> Self {
        let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Self(if global.progress == ProgressForm::Openjd {
            let mut last = String::new();
            lines(OFTEN, State::openjd, move |line| {
                if last != line {
                    openjd(line);
                    line.clone_into(&mut last);
                }
            })
        } else if global.quiet {
            Shown::Nowhere
        } else if io::stderr().is_terminal() && !is_dumb {
            Shown::Bar(bar(), Mutex::default())
        } else {
            lines(EVERY, State::line, |line| {
                // There is nobody left to tell when that fails.
                let _ = writeln!(io::stderr().lock(), "{line}");
            })
        })
    }

    /// So much of the whole work is done, from 0 to 1, and this is what is done now. A share below that of before
    /// leaves it as it was.
    pub(super) fn show(&self, share: f64, what: impl Into<String>) {
        match &self.0 {
            Shown::Nowhere => {}
            Shown::Bar(bar, state) => {
                let mut state = lock(state);
                state.advance(bar.elapsed(), share, what.into());
                if bar.message() != state.what {
                    bar.set_message(state.what.clone());
                }
                bar.set_position((state.share * STEPS as f64) as u64);
                let mut shown = lock(&BAR);
                if shown.is_none() {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(TICK);
                    *shown = Some(bar.clone());
                }
            }
            Shown::Lines(ticking, _) => {
                let now = ticking.begin.elapsed();
                if let Some(lines) = lock(&ticking.lines).as_mut() {
                    lines.state.advance(now, share, what.into());
                }
            }
        }
    }

    /// The part from `share` on, which is `width` of the whole.
    pub(super) fn part(&self, share: f64, width: f64) -> Part<'_> {
        Part {
            meter: self,
            share,
            width,
        }
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        match &mut self.0 {
            Shown::Nowhere => {}
            Shown::Bar(bar, _) => {
                *lock(&BAR) = None;
                bar.finish_and_clear();
            }
            Shown::Lines(ticking, thread) => {
                *lock(&ticking.lines) = None;
                ticking.ended.notify_all();
                if let Some(thread) = thread.take() {
                    // It does nothing that can panic.
                    let _ = thread.join();
                }
            }
        }
    }
}

/// A part of the work of a command.
#[derive(Clone, Copy)]
pub(super) struct Part<'m> {
    meter: &'m Meter,
    share: f64,
    width: f64,
}

impl Part<'_> {
    /// So much of this part is done.
    pub(super) fn show(&self, share: f64, what: impl Into<String>) {
        let share = self.share + self.width * share.clamp(0.0, 1.0);
        self.meter.show(share, what);
    }

    /// Of so many things in this part so many are done.
    pub(super) fn count(&self, done: usize, all: usize, what: &str) {
        let share = done as f64 / all.max(1) as f64;
        self.show(share, format!("{what} ({done} of {all})"));
    }
}

/// Writes lines for a worker of OpenJD. Whoever reads them may be gone.
fn openjd(lines: &str) {
    let mut out = io::stdout().lock();
    let _ = writeln!(out, "{lines}").and_then(|()| out.flush());
}

/// Tells a worker of OpenJD that all is done, if one listens.
pub(super) fn complete(global: &Global) {
    if global.progress == ProgressForm::Openjd {
        openjd("openjd_progress: 100.0");
    }
}

/// Tells a worker of OpenJD why the command failed, if one listens.
pub(super) fn failed(global: &Global, message: &str) {
    if global.progress == ProgressForm::Openjd {
        openjd(&format!("openjd_fail: {}", one_line(message)));
    }
}

/// A text that does not break a line, nor moves a cursor.
fn one_line(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let joined = lines.join("; ");
    joined.chars().filter(|c| !c.is_control()).collect()
}

/// How much of a render is done.
pub(super) fn share(progress: &Progress) -> f64 {
    progress.paths as f64 / progress.total.max(1) as f64
}

/// How many of its samples are taken, in words.
pub(super) fn samples_taken(progress: &Progress, samples: u32) -> String {
    let taken = (share(progress) * f64::from(samples)).min(f64::from(samples));
    format!("{taken:.0} of {samples} samples a pixel")
}

/// A bar that is not drawn before it has something to show.
fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::hidden());
    let template = "{msg} {wide_bar} {percent:>3} %, {elapsed} gone{rest}";
    // Nothing is known of the rest before anything is done.
    let rest = |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        let left = state.eta().as_secs();
        // It goes into memory, which takes it.
        let _ = match left {
            0 => Ok(()),
            left => write!(out, ", {left}s left"),
        };
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("rest", rest));
    }
    bar
}

/// Lines from a thread of their own: a step of the work that says nothing for long is no reason for silence.
fn lines(
    every: Duration,
    form: fn(&State, Duration) -> String,
    mut write: impl FnMut(&str) + Send + 'static,
) -> Shown {
    let ticking = Arc::new(Ticking {
        begin: Instant::now(),
        lines: Mutex::new(Some(Lines::new(every, form))),
        ended: Condvar::new(),
    });
    let shared = ticking.clone();
    let thread = std::thread::Builder::new().spawn(move || {
        let mut guard = lock(&shared.lines);
        while let Some(lines) = guard.as_mut() {
            let now = shared.begin.elapsed();
            if let Some(line) = lines.due(now) {
                write(&line);
            }
            let wait = lines.next.saturating_sub(now);
            let waited = shared.ended.wait_timeout(guard, wait);
            guard = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    });
    // Without a thread there are no lines, and the work itself goes on.
    Shown::Lines(ticking, thread.ok())
}

/// When to write a line, by a clock that counts from the begin of the command.
struct Lines {
    every: Duration,
    next: Duration,
    form: fn(&State, Duration) -> String,
    state: State,
}

impl Lines {
    fn new(every: Duration, form: fn(&State, Duration) -> String) -> Self {
        Self {
            every,
            next: every,
            form,
            state: State::default(),
        }
    }

    /// The line that is due, if one is and there is anything to say.
    fn due(&mut self, now: Duration) -> Option<String> {
        if now < self.next {
            return None;
        }
        self.next = now + self.every;
        (!self.state.what.is_empty()).then(|| (self.form)(&self.state, now))
    }
}

/// How far the work is.
#[derive(Default)]
struct State {
    share: f64,
    what: String,
    /// When the share first rose: what comes before, like building kernels, says nothing about the rest.
    rose: Option<Duration>,
}

/// What is not done yet is not shown as done.
const MOST: f64 = 0.99;

impl State {
    fn advance(&mut self, now: Duration, share: f64, what: String) {
        // `max` takes no NaN.
        self.share = self.share.max(share.min(MOST));
        self.what = what;
        if self.share > 0.0 {
            self.rose.get_or_insert(now);
        }
    }

    /// ` 37 %, 12 s gone, 20 s left: 24 of 64 samples a pixel`
    fn line(&self, now: Duration) -> String {
        let percent = (100.0 * self.share) as u32;
        let left = self.left(now);
        let left = left.map_or(String::new(), |left| format!(", {} left", time(left)));
        // Nothing that is named may break the line, or move the cursor.
        let what: String = self.what.chars().filter(|c| !c.is_control()).collect();
        format!("{percent:>3} %, {} gone{left}: {what}", time(now))
    }

    /// The same for a worker of OpenJD.
    fn openjd(&self, _: Duration) -> String {
        format!(
            "openjd_progress: {:.1}\nopenjd_status: {}",
            100.0 * self.share,
            one_line(&self.what)
        )
    }

    /// The time that the rest takes at the rate so far, once there is one.
    fn left(&self, now: Duration) -> Option<Duration> {
        let gone = now.saturating_sub(self.rose?);
        let left = gone.as_secs_f64() * (1.0 - self.share) / self.share;
        let is_known = !gone.is_zero() && left < LONGEST && self.share < MOST;
        is_known.then(|| Duration::from_secs_f64(left))
    }
}

/// Seconds from which on an estimate says nothing: 30 days.
const LONGEST: f64 = 30.0 * 86_400.0;

/// `12 s`, `3 min 20 s`, `2 h 5 min`.
fn time(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn seconds(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    fn lines_at(lines: &mut Lines, now: std::ops::Range<u64>) -> Vec<String> {
        now.filter_map(|second| lines.due(seconds(second)))
            .collect()
    }

    #[test]
    fn a_line_every_five_seconds_and_none_before() {
        let mut lines = Lines::new(EVERY, State::line);
        assert_eq!(lines_at(&mut lines, 0..7), [""; 0], "nothing to say");
        lines.state.advance(seconds(7), 0.0, "building".into());
        assert_eq!(lines_at(&mut lines, 7..10), [""; 0]);
        assert_eq!(
            lines_at(&mut lines, 10..21),
            [
                "  0 %, 10 s gone: building",
                "  0 %, 15 s gone: building",
                "  0 %, 20 s gone: building"
            ]
        );
    }

    #[test]
    fn shares_never_fall_and_the_end_is_only_at_the_end() {
        let mut state = State::default();
        let mut last = 0.0;
        let mut shown = Vec::new();
        for (second, share) in [1.0, 0.71, 1.0, f64::NAN, 0.19, -1.0, 7.0, 1.0]
            .into_iter()
            .enumerate()
        {
            state.advance(seconds(second as u64), share, "x".into());
            assert!(state.share >= last);
            last = state.share;
            shown.push(state.line(seconds(second as u64)));
        }
        assert!(shown.iter().all(|l| l.starts_with(" 99 %")), "{shown:?}");
        let mut state = State::default();
        for share in [0.0, 0.5, 0.25, 0.6] {
            state.advance(seconds(1), share, String::new());
        }
        assert!((state.share - 0.6).abs() < 1e-12);
    }

    #[test]
    fn lines_are_plain_and_say_what_is_left() {
        let mut state = State::default();
        state.advance(seconds(10), 0.0, "building kernels (3 of 4)".into());
        // Only what sampling took tells what it will take.
        state.advance(seconds(20), 0.1, "1 of 10 samples a pixel".into());
        state.advance(seconds(30), 0.5, "5 of 10 samples a pixel".into());
        assert_eq!(
            state.line(seconds(30)),
            " 50 %, 30 s gone, 10 s left: 5 of 10 samples a pixel"
        );
        state.advance(seconds(40), 0.5, "a\rb\x1b[2Kc\nd".into());
        let line = state.line(seconds(40));
        assert!(line.ends_with(": ab[2Kcd"), "{line:?}");
        assert!(!line.chars().any(char::is_control));
    }

    #[test]
    fn times_in_words() {
        for (s, text) in [
            (59, "59 s"),
            (200, "3 min 20 s"),
            (7500, "2 h 5 min"),
            (360_000, "100 h 0 min"),
        ] {
            assert_eq!(time(seconds(s)), text);
        }
    }

    #[test]
    fn parts_are_of_the_whole() {
        let ticking = lines(seconds(3600), State::line, |_| ());
        let meter = Meter(ticking);
        let share = |meter: &Meter| match &meter.0 {
            Shown::Lines(ticking, _) => {
                let guard = lock(&ticking.lines);
                let state = &guard.as_ref().expect("not ended").state;
                (state.share, state.what.clone())
            }
            _ => panic!("lines"),
        };
        meter.part(0.5, 0.25).count(1, 2, "materials");
        assert_eq!(share(&meter), (0.625, "materials (1 of 2)".into()));
        meter.part(0.25, 0.25).show(9.0, "late");
        assert_eq!(share(&meter), (0.625, "late".into()));
    }

    #[test]
    fn quiet_is_silent() {
        let global = |quiet| Global {
            color: clap::ColorChoice::Auto,
            format: super::super::Format::Text,
            verbose: 0,
            quiet,
            progress: ProgressForm::Auto,
        };
        assert!(matches!(Meter::new(&global(true)).0, Shown::Nowhere));
        assert!(!matches!(Meter::new(&global(false)).0, Shown::Nowhere));
    }

    #[test]
    fn workers_of_openjd_are_told_percent_and_what_is_done() {
        let mut state = State::default();
        state.advance(seconds(1), 0.375, "24 of 64\nsamples\x1b[2K".into());
        assert_eq!(
            state.openjd(seconds(2)),
            "openjd_progress: 37.5\nopenjd_status: 24 of 64; samples[2K"
        );
        assert_eq!(one_line("no film\n  hint: none"), "no film; hint: none");
    }

    /// A step that says nothing has lines too, and none comes after the end.
    #[test]
    fn a_thread_writes_while_the_work_is_silent() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let meter = Meter(lines(Duration::from_millis(10), State::line, move |line| {
            let _ = sender.send(line.to_owned());
        }));
        meter.show(0.25, "one long step");
        let wait = Duration::from_secs(60);
        for _ in 0..3 {
            let line = receiver.recv_timeout(wait).expect("a line");
            assert!(line.starts_with(" 25 %"), "{line}");
        }
        drop(meter);
        while receiver.try_recv().is_ok() {}
        assert!(receiver.recv_timeout(wait).is_err(), "the thread is gone");
    }
}
