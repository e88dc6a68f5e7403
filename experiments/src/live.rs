//! `cargo experiments live`: how long one waits for a new picture while one looks around in a scene, drags a value, or
//! saves a source. It measures the engine behind `impasto view`, without its window.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use impasto::compiler::ParameterValue;
use impasto::live::engine::{Engine, News, Order, ParamId, Picture, State};
use impasto::live::{Live, LiveOptions};
use impasto::set::SAMPLE;
use impasto::{Choice, DeviceOptions};
use xtask::shell::{self, Result};

#[derive(Args)]
pub(crate) struct LiveArgs {
    /// The material, which is looked at on the ball
    #[arg(
        long,
        value_name = "FILE",
        default_value = "materials/car_paint.impasto"
    )]
    material: PathBuf,
    /// A parameter of it, a number from 0 to 1
    #[arg(long, value_name = "NAME", default_value = "flake_amount")]
    param: String,
    /// A text of the source that edits change, with another number each time
    #[arg(long, value_name = "TEXT", default_value = "exponent: 900")]
    edited: String,
    /// A text of the source with an int at its end, so that edits of it take other code
    #[arg(long, value_name = "TEXT", default_value = "seed: 1")]
    recoded: String,
    /// Which device renders
    #[arg(long, value_enum, default_value = "best")]
    device: DeviceArg,
    /// Columns and rows of the picture
    #[arg(long, value_name = "WxH", default_value = "480x360")]
    size: String,
    /// Paths in flight; by default as the window has them
    #[arg(long, value_name = "PATHS")]
    pool: Option<u32>,
    /// Orders of each kind; half as many edits
    #[arg(long, default_value_t = 20)]
    rounds: u32,
}

#[derive(Clone, Copy, ValueEnum)]
enum DeviceArg {
    Best,
    Gpu,
    Cpu,
}

/// How long anything may take.
const LONG: Duration = Duration::from_secs(60);
/// How long a hand stays between two orders, so that the second finds a render under way.
const BETWEEN: Duration = Duration::from_millis(150);

/// How long an author looks at an edit before the next one.
const LOOK: Duration = Duration::from_secs(5);

pub(crate) fn run(args: &LiveArgs) -> Result {
    let sides = args.size.split_once('x');
    let size = sides.and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size: [u32; 2] = size.ok_or("expected columns and rows, as in 480x360")?;
    let folder = shell::root().join("target/live");
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let file = folder.join("edited.impasto");
    let source = std::fs::read_to_string(&args.material).map_err(|e| e.to_string())?;
    write(&file, &source)?;
    let begun = Instant::now();
    let options = LiveOptions {
        device: DeviceOptions {
            choice: match args.device {
                DeviceArg::Best => Choice::Best,
                DeviceArg::Gpu => Choice::Gpu,
                DeviceArg::Cpu => Choice::Cpu,
            },
            ..DeviceOptions::default()
        },
        size: Some(size),
        samples: 1 << 16,
        pool: args.pool,
        ..LiveOptions::default()
    };
    let live = Live::new(&file, options).map_err(|e| e.to_string())?;
    let engine = Watched {
        live,
        spent: RefCell::default(),
    };
    let first = engine.until(|news| news.picture.is_some())?;
    let opened = begun.elapsed();
    let own = |p: &Picture| !p.stands_in;
    let device = engine.until(|news| has(news, own) && !news.kernels.device.is_empty())?;
    let of_device = begun.elapsed();
    let device = &device.kernels.device;
    eprintln!(
        "{device}, {}x{}, {}",
        size[0],
        size[1],
        args.material.display()
    );
    eprintln!(
        "first picture after opening: {}, of the device {}",
        milliseconds(opened),
        milliseconds(of_device)
    );
    let camera = first.project.camera.ok_or("the set has no camera")?;
    // Final kernels are there by then, as they are when somebody has looked for a while.
    engine.until(|news| news.state == State::Rendering)?;
    std::thread::sleep(Duration::from_secs(3));

    let mut looks = Vec::new();
    for round in 1..=args.rounds {
        let mut moved = camera;
        moved.position.x += 0.002 * round as f32;
        let shows = |picture: &Picture| picture.camera == Some(moved);
        looks.push(engine.order(Order::Look(moved), |news| has(news, shows))?);
        std::thread::sleep(BETWEEN);
    }
    print("orbit", looks);

    let mut drags = Vec::new();
    for round in 0..args.rounds {
        let before = engine.live.news();
        let number = before.picture.as_ref().map_or(0, |picture| picture.number);
        let param = ParamId {
            binding: SAMPLE.into(),
            param: args.param.clone(),
        };
        let value = 0.2 + 0.6 * f64::from(round) / f64::from(args.rounds);
        let order = Order::Set {
            param,
            value: ParameterValue::Float(value),
            dragged: round + 1 < args.rounds,
        };
        let project = before.project;
        drags.push(engine.order(order, |news| {
            !Arc::ptr_eq(&news.project, &project)
                && has(news, |p| p.number > number && p.samples == 1)
        })?);
        std::thread::sleep(BETWEEN);
    }
    print("drag", drags);

    // No driver may have seen the source before: they keep kernels on disk.
    let unseen = 7919 * u64::from(std::process::id()) + opened.as_nanos() as u64;
    let number = |round| edited_number(unseen, round);
    engine.edits(
        "edit of a number",
        &file,
        (&source, &args.edited),
        args.rounds,
        number,
    )?;
    let code = |round| (unseen % 1_000_000_000 + u64::from(round)).to_string();
    engine.edits(
        "edit of code",
        &file,
        (&source, &args.recoded),
        args.rounds,
        code,
    )?;

    // How fast it is meanwhile, once it is left alone.
    std::thread::sleep(LOOK);
    let rate = |picture: &Picture| f64::from(picture.samples) / picture.elapsed.as_secs_f64();
    if let Some(picture) = engine.live.news().picture {
        let paths = rate(&picture) * f64::from(size[0]) * f64::from(size[1]);
        eprintln!("left alone: {:.2} million paths a second", paths * 1e-6);
    }
    let kernels = engine.live.news().kernels;
    for kernel in &kernels.kernels {
        let share = kernel
            .share
            .map_or(String::new(), |share| format!("{:.1} %", 100.0 * share));
        eprintln!("  {:<32} {share}", kernel.name);
    }
    kernels
        .reasons
        .iter()
        .for_each(|reason| eprintln!("  {reason}"));
    Ok(())
}

/// A number like few others, to seven digits.
fn edited_number(unseen: u64, round: u32) -> String {
    format!(
        "{}.{:04}",
        300 + 50 * (round % 12),
        (unseen + u64::from(round) * 7) % 10_000
    )
}

fn write(path: &Path, text: &str) -> Result {
    impasto::files::write_whole(path, text.as_bytes()).map_err(String::from)?;
    Ok(())
}

fn has(news: &News, holds: impl Fn(&Picture) -> bool) -> bool {
    news.picture.as_deref().is_some_and(holds)
}

/// An engine whose news are looked at all the time.
struct Watched {
    live: Live,
    /// How long it was in each state.
    spent: RefCell<BTreeMap<String, Duration>>,
}

impl Watched {
    fn until(&self, holds: impl Fn(&News) -> bool) -> Result<News> {
        let begun = Instant::now();
        let mut last = begun;
        loop {
            let news = self.live.news();
            let state = format!("{:?}", news.state);
            *self.spent.borrow_mut().entry(state).or_default() += last.elapsed();
            last = Instant::now();
            if holds(&news) {
                return Ok(news);
            }
            if begun.elapsed() > LONG {
                let texts: Vec<&str> = news.problems.iter().map(|p| p.text.as_str()).collect();
                return Err(format!(
                    "no picture came: {:?} {}",
                    news.state,
                    texts.join("\n")
                ));
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    }

    /// Saves a source with one text of it changed again and again, as an author who looks in between.
    fn edits(
        &self,
        what: &str,
        file: &Path,
        (source, edited): (&str, &str),
        rounds: u32,
        number: impl Fn(u32) -> String,
    ) -> Result {
        if !source.contains(edited) {
            return Err(format!("the source has no `{edited}`"));
        }
        let before = edited.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        let (mut times, mut of_device) = (Vec::new(), Vec::new());
        self.spent.take();
        for round in 0..rounds.div_ceil(2) {
            // The kernels of a long look are there by then.
            std::thread::sleep(LOOK);
            let news = self.live.news();
            let shown = news.picture.as_ref().map_or(0, |picture| picture.number);
            let text = source.replace(edited, &format!("{before}{}", number(round)));
            let begun = Instant::now();
            write(file, &text)?;
            self.until(|now| {
                !Arc::ptr_eq(&now.project, &news.project)
                    && has(now, |p| p.number > shown && p.samples == 1)
            })?;
            times.push(begun.elapsed());
            self.until(|now| has(now, |p| p.number > shown && !p.stands_in))?;
            of_device.push(begun.elapsed());
        }
        let all = times.len().max(1) as u32;
        print(what, times);
        print("  of the device", of_device);
        for (state, time) in self.spent.take() {
            eprintln!("  {state}: {} on average", milliseconds(time / all));
        }
        Ok(())
    }

    /// The time from an order to the news that follow from it.
    fn order(&self, order: Order, holds: impl Fn(&News) -> bool) -> Result<Duration> {
        let begun = Instant::now();
        self.live.order(order);
        self.until(holds)?;
        Ok(begun.elapsed())
    }
}

fn milliseconds(time: Duration) -> String {
    format!("{:.0} ms", 1e3 * time.as_secs_f64())
}

fn print(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let at = |part: usize| {
        times
            .get(times.len() * part / 10)
            .copied()
            .unwrap_or_default()
    };
    eprintln!(
        "{what}: {} in the median of {}, {} at most",
        milliseconds(at(5)),
        times.len(),
        milliseconds(times.last().copied().unwrap_or_default())
    );
}
