//! `impasto view`: a window on a scene or material that is rendered while one works on it, and pictures for tev.

use std::path::PathBuf;
use std::sync::mpsc::Sender;

use clap::Args;
use clap::builder::StringValueParser;
use impasto::live::{Live, LiveOptions, engine::ParamId};
use impasto::set::SAMPLE;
use impasto::shot::param::{self, ParamOption};
use impasto::tev::{self, Address, Told};
use impasto::{files, goal, shot};

use super::completions::Known;
use super::info::DeviceArgs;
use super::outputs::{aov_help, aov_names, parse_exposure};
use super::render::parse_size;
use super::shot::On;
use super::technique::TechniqueArgs;
use super::{Failure, Global, Job, Outcome, interrupt};

#[derive(Args)]
pub(super) struct ViewArgs {
    /// The scene, a TOML file; or a material file or module of the library, to be seen on a built-in set
    scene: PathBuf,
    /// What a material file is put on; a ball by default
    #[arg(long, value_enum, value_name = "SET")]
    on: Option<On>,
    /// Which material of the file, if it defines several
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Give a parameter a value, as in `roughness=0.2`, or of a scene's binding `wall.roughness=0.2`
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = param::parse)]
    params: Vec<ParamOption>,
    /// Samples of a pixel after which the picture rests
    #[arg(long, value_name = "COUNT", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Rest when the error is small enough or the time is up, as `impasto render` has it. May be given several times: what
    /// is reached first counts
    #[arg(long, value_name = "GOAL", value_parser = Known::new(goal_text, goal::kinds), hide_possible_values = true)]
    until: Vec<String>,
    /// Width and height of the picture in pixels, as in 640x480; the scene's own by default
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u32,
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = Known::new(StringValueParser::new(), aov_names), hide_possible_values = true, help = aov_help())]
    aov: Vec<String>,
    /// The frame of what moves
    #[arg(long, value_name = "FRAME")]
    frame: Option<u32>,
    /// Turn what a material file is put on once in so many frames
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    turntable: Option<u32>,
    /// Which materials share a kernel, as `impasto render` has it
    #[arg(long, value_name = "STRATEGY")]
    strategy: Option<String>,
    /// Paths in flight; by default chosen by the size of the picture
    #[arg(long, value_name = "PATHS", value_parser = clap::value_parser!(u32).range(1..))]
    pool: Option<u32>,
    /// Brighten the picture by this many stops
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
    /// A picture to compare with, EXR or PNG
    #[arg(long, value_name = "FILE")]
    compare: Option<PathBuf>,
    /// Where the picture is saved unless a hand says otherwise
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Pixels of the screen for each point of the window; what the system says by default
    #[arg(long, value_name = "FACTOR")]
    scale: Option<f32>,
    /// Open no window, and send pictures to a tev that listens there, on this machine or another one
    #[arg(long, value_name = "HOST[:PORT]", value_parser = Address::parse, conflicts_with_all = ["compare", "scale", "out", "exposure"])]
    tev: Option<Address>,
    #[command(flatten)]
    device: DeviceArgs,
    // Last, since its heading is that of all options after it.
    #[command(flatten)]
    technique: TechniqueArgs,
}

pub(super) fn run(args: &ViewArgs, global: &Global, jobs: Option<&Sender<Job>>) -> Outcome {
    args.device.check()?;
    if !args.scene.to_string_lossy().starts_with("std::") {
        // That is a slip, and nothing to wait for.
        files::check_readable(&args.scene)?;
    }
    let live = Live::new(&args.scene, args.options(global)?);
    let live = live.map_err(|error| format!("cannot begin to render: {error}"))?;
    match &args.tev {
        Some(address) => send(&live, address, global),
        None => args.window(live, jobs),
    }
}

/// A goal as it is written, if it is one.
fn goal_text(text: &str) -> Result<String, String> {
    goal::parse(text).map(|_| text.to_owned())
}

impl ViewArgs {
    fn options(&self, global: &Global) -> Result<LiveOptions, Failure> {
        let is_material = shot::is_material(&self.scene);
        let of_materials = [
            ("--on", self.on.is_some()),
            ("--material", self.material.is_some()),
            ("--turntable", self.turntable.is_some()),
        ];
        if let Some((option, _)) = of_materials
            .iter()
            .find(|(_, given)| *given && !is_material)
        {
            return Err(Failure::Error(format!(
                "`{option}` is for material files (`impasto view brick.impasto`), and this is a scene"
            )));
        }
        let mut values = Vec::new();
        for option in &self.params {
            let [value] = option.values.as_slice() else {
                return Err(Failure::Error(format!(
                    "`--param {}` is a sweep, and a window shows one picture\n  hint: drag its slider",
                    option.name
                )));
            };
            let binding = match (&option.binding, is_material) {
                (Some(binding), false) => binding.clone(),
                (None, true) => SAMPLE.to_owned(),
                (Some(_), true) => {
                    return Err(Failure::Error(format!(
                        "a material file binds nothing\n  hint: write `--param {}=...`",
                        option.name
                    )));
                }
                (None, false) => {
                    return Err(Failure::Error(format!(
                        "`--param {0}`: a parameter of which material?\n  hint: write `--param NAME.{0}=...`",
                        option.name
                    )));
                }
            };
            let param = option.name.clone();
            values.push((ParamId { binding, param }, value.clone()));
        }
        Ok(LiveOptions {
            device: self.device.options(global.warner()),
            set: self.on.map_or_else(Default::default, Into::into),
            material: self.material.clone(),
            turntable: self.turntable,
            samples: self.spp,
            size: self.size.map(|(width, height)| [width, height]),
            seed: self.seed,
            values,
            frame: self.frame,
            outputs: self.aov.clone(),
            strategy: self.strategy.clone(),
            until: self.until(),
            pool: self.pool,
            technique: self.technique.technique(),
        })
    }

    /// All goals, if there are any.
    fn until(&self) -> Option<String> {
        (!self.until.is_empty()).then(|| self.until.join(","))
    }

    #[cfg(feature = "window")]
    fn window(&self, live: Live, jobs: Option<&Sender<Job>>) -> Outcome {
        let name = self.scene.file_name().unwrap_or(self.scene.as_os_str());
        let options = impasto_viewer::window::WindowOptions {
            title: format!("{} - Impasto", name.to_string_lossy()),
            size: None,
            scale: self.scale,
            exposure: self.exposure,
            save_as: self.out.clone(),
            compare_with: self.compare.clone(),
            until: self.until(),
        };
        let work = move || impasto_viewer::window::run(Box::new(live), options);
        super::on_main_thread(jobs, work)?.map_err(Failure::Error)
    }

    #[cfg(not(feature = "window"))]
    fn window(&self, _: Live, _: Option<&Sender<Job>>) -> Outcome {
        Err(Failure::Error(
            "this program was built without windows\n  hint: build it with `--features window`, or use `--tev HOST`, or `impasto render --watch`".into(),
        ))
    }
}

/// Sends pictures until Ctrl-C.
fn send(live: &Live, address: &Address, global: &Global) -> Outcome {
    global.note(&format!(
        "sending pictures to tev at {address}; Ctrl-C ends it"
    ));
    let mut is_away = false;
    let mut tell = |told: Told<'_>| match told {
        Told::Sent(picture) => {
            if std::mem::take(&mut is_away) {
                global.note(&format!("tev at {address} is there again"));
            }
            if picture.samples >= picture.samples_asked {
                global.note(&format!("sent {} samples", picture.samples));
            }
        }
        Told::Problems(problems) => {
            for problem in problems {
                super::say(problem.text.trim_end());
            }
        }
        Told::Away(error) => {
            if !std::mem::replace(&mut is_away, true) {
                global.note(&format!(
                    "warning: no tev at {address}: {error}; trying again"
                ));
            }
        }
    };
    let stop = || interrupt::requested();
    tev::send(live, address, &stop, &mut tell)?;
    Err(Failure::Interrupted)
}
