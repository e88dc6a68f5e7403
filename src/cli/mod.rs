//! The command line: options, exit codes, and what goes to which stream.
//!
//! Results and what programs read go to standard output; diagnostics for people, progress and
//! notes go to standard error. A command fails in one of four ways, see `Failure`.

use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{Sender, channel};

use clap::{ArgAction, ColorChoice, Parser, Subcommand, ValueEnum};
use impasto::compiler::diag::{self, Diagnostic};
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, MaterialRequest, Program};
use impasto::farm::{FarmError, INTERRUPTED, TRANSIENT};
use impasto::files::Unwritten;
use impasto::{FileLoader, Scene};

mod calibrate;
mod check;
mod checkpoint;
mod completions;
mod converge;
mod cost;
mod dropped;
mod emit;
mod eval;
mod exhaustive;
mod experiment;
mod explain;
mod export;
mod farm;
mod fmt;
mod import;
mod info;
mod interrupt;
mod lsp;
mod made;
mod merge;
mod needs;
mod new;
mod outputs;
mod plan;
mod planned;
mod profile;
mod progress;
mod rays;
mod render;
mod shot;
mod sources;
mod strategy;
mod technique;
mod test;
mod trace;
mod until;
mod view;

/// A material language and a wavefront path tracer for it.
#[derive(Parser)]
#[command(
    name = "impasto",
    version,
    after_help = "Exit codes: 0 fine; 1 diagnostics; 2 usage, input or output; 75 may work on another try or machine; \
                  130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    global: Global,
}

/// Options of every command.
#[derive(clap::Args)]
struct Global {
    /// Color diagnostics
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    color: ColorChoice,
    /// Format of diagnostics and results: text, or JSON on standard output
    #[arg(long, global = true, default_value = "text")]
    format: Format,
    /// Print more
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
    /// Print only errors and results
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// How progress is shown: a bar or lines on standard error, or lines that OpenJD takes on standard output
    #[arg(
        long = "progress",
        global = true,
        value_name = "FORM",
        default_value = "auto"
    )]
    progress: ProgressForm,
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ProgressForm {
    /// A bar on a terminal, and elsewhere a line every five seconds, on standard error
    Auto,
    /// `openjd_progress` and `openjd_status`, on standard output
    Openjd,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

#[derive(Subcommand)]
enum Command {
    /// Check material files and scenes, and report every problem
    Check(check::CheckArgs),
    /// Make a material to start from
    New(new::NewArgs),
    /// Make sources of MaterialX documents, and folders of glTF and USD files with scene, sources and pictures
    Import(import::ImportArgs),
    /// Write a material that is an instance of a surface model as MaterialX or glTF, with its pictures
    Export(export::ExportArgs),
    /// Hold materials and bsdfs to what any must keep and to what their documentation promises
    Test(test::TestArgs),
    /// Format sources, keeping every comment
    Fmt(fmt::FmtArgs),
    /// Print a stage of the compilation of a material file
    Emit(emit::EmitArgs),
    /// Count the operations of one evaluation of each material
    Cost(cost::CostArgs),
    /// Fit the time model to this GPU by timing kernels
    Calibrate(Box<calibrate::CalibrateArgs>),
    /// Explain which materials share a kernel in a scene, and why
    Plan(Box<plan::PlanCommandArgs>),
    /// Evaluate a material, closure or function at one point
    Eval(Box<eval::EvalArgs>),
    /// Render a scene, or a material file on a built-in set
    Render(Box<render::RenderArgs>),
    /// Open a window that renders while you look, turn and edit; or send pictures to tev
    View(Box<view::ViewArgs>),
    /// Measure how fast renders converge: error against run time
    Converge(Box<converge::ConvergeArgs>),
    /// Run a study: scenes, materials, models and GPUs, measured and told on a page
    Experiment(Box<experiment::ExperimentArgs>),
    /// Replay the path of one sample, and print every vertex
    Trace(trace::TraceArgs),
    /// Time ray casts alone, by every technique
    Rays(rays::RaysArgs),
    /// Merge parts of a render into one picture
    Merge(merge::MergeArgs),
    /// Render on a farm of machines: jobs for Slurm and OpenJD, and here
    #[command(subcommand)]
    Farm(Box<farm::FarmCommand>),
    /// Serve an editor: the language server, on standard input and output
    Lsp(lsp::LspArgs),
    /// Show the device that would render, with its limits, and the others
    Info(info::DeviceArgs),
    /// Explain a diagnostic code, such as E0201; without one, list all
    Explain(explain::ExplainArgs),
    /// Print a completion script for a shell
    Completions(completions::CompletionsArgs),
}

/// Why a command did not do what it was asked for.
enum Failure {
    /// The sources have errors, which were reported: exit code 1.
    Diagnostics,
    /// A usage, input or output error, still to be reported: exit code 2.
    Error(String),
    /// What may work on another try or on another machine, still to be reported: exit code 75, as BSD's sysexits
    /// name it (EX_TEMPFAIL). A GPU was lost, or none was found that was asked for; its memory or a disk was full;
    /// another process holds the checkpoint.
    Transient(String),
    /// Ctrl-C; what could be kept was kept and said: exit code 130.
    Interrupted,
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Failure::Error(message)
    }
}

impl From<Unwritten> for Failure {
    fn from(unwritten: Unwritten) -> Self {
        Self::new(unwritten.reason, unwritten.transient)
    }
}

impl From<FarmError> for Failure {
    fn from(error: FarmError) -> Self {
        match error {
            FarmError::Permanent(message) => Failure::Error(message),
            FarmError::Transient(message) => Failure::Transient(message),
            FarmError::Interrupted => Failure::Interrupted,
        }
    }
}

impl Failure {
    /// One that may pass, or one that will not.
    fn new(message: String, is_transient: bool) -> Self {
        if is_transient {
            Failure::Transient(message)
        } else {
            Failure::Error(message)
        }
    }

    /// What is still to be said of it.
    fn message(&self) -> Option<&str> {
        match self {
            Failure::Error(message) | Failure::Transient(message) => Some(message),
            Failure::Diagnostics | Failure::Interrupted => None,
        }
    }

    fn code(&self) -> u8 {
        match self {
            Failure::Diagnostics => 1,
            Failure::Error(_) => 2,
            Failure::Transient(_) => TRANSIENT,
            Failure::Interrupted => INTERRUPTED,
        }
    }
}

type Outcome = Result<(), Failure>;

/// Something that only the main thread may do.
pub type Job = Box<dyn FnOnce() + Send>;

/// Has something done by the main thread, which takes `jobs`; by this one if it is that.
#[cfg(feature = "window")]
fn on_main_thread<T: Send + 'static>(
    jobs: Option<&Sender<Job>>,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Failure> {
    let Some(jobs) = jobs else { return Ok(work()) };
    let (sender, done) = channel();
    let job = Box::new(move || {
        // Whoever asked waits for it.
        let _ = sender.send(work());
    });
    let gone = |_| Failure::Error("the main thread is gone".into());
    jobs.send(job).map_err(|_| gone(()))?;
    done.recv().map_err(|_| gone(()))
}

/// Stack of the thread that does the work. That of the main thread is what the system grants it (`ulimit -s`), which
/// may be little.
const STACK_BYTES: usize = 32 << 20;

/// Runs the command by its arguments, of which the first is its name, and reports its failure; the exit code. It is the main
/// thread that calls this: it does what only that may do. Wrong arguments end the process.
pub fn main(args: Vec<OsString>) -> u8 {
    let builder = std::thread::Builder::new().name("main".into());
    let (sender, jobs) = channel::<Job>();
    let given = args.clone();
    let work = move || run(given, Some(&sender));
    match builder.stack_size(STACK_BYTES).spawn(work) {
        Ok(thread) => {
            // Windows are the main thread's on some systems. There are no more jobs when the work is done.
            jobs.into_iter().for_each(|job| job());
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        }
        Err(_) => run(args, None),
    }
}

/// Reads the arguments, runs the command, reports its failure. The main thread takes `jobs`, unless it is this one.
fn run(args: Vec<OsString>, jobs: Option<&Sender<Job>>) -> u8 {
    interrupt::outlive_file_limit();
    let cli = Cli::parse_from(args);
    let global = cli.global;
    let outcome = match cli.command {
        Command::Check(args) => check::run(&args, &global),
        Command::Emit(args) => emit::run(&args, &global),
        Command::New(args) => new::run(&args, &global),
        Command::Test(args) => test::run(&args, &global),
        Command::Fmt(args) => fmt::run(&args, &global),
        Command::Import(args) => import::run(&args, &global),
        Command::Export(args) => export::run(&args, &global),
        Command::Calibrate(args) => calibrate::run(&args, &global),
        Command::Converge(args) => converge::run(&args, &global),
        Command::Experiment(args) => experiment::run(&args, &global),
        Command::Cost(args) => cost::run(&args, &global),
        Command::Plan(args) => plan::run(&args, &global),
        Command::Eval(args) => eval::run(&args, &global),
        Command::Render(args) => render::run(&args, &global),
        Command::Trace(args) => trace::run(&args, &global),
        Command::Rays(args) => rays::run(&args, &global),
        Command::Merge(args) => merge::run(&args, &global),
        Command::Farm(command) => farm::run(&command, &global),
        Command::Lsp(args) => lsp::run(&args),
        Command::View(args) => view::run(&args, &global, jobs),
        Command::Info(args) => info::run(&args, &global),
        Command::Explain(args) => explain::run(&args, &global),
        Command::Completions(args) => completions::run(&args),
    };
    match outcome {
        Ok(()) => {
            progress::complete(&global);
            0
        }
        Err(failure) => {
            if let Some(message) = failure.message() {
                say(&format!("{}: {message}", global.error_word()));
                progress::failed(&global, message);
            }
            failure.code()
        }
    }
}

impl Global {
    /// Whether standard error takes colors.
    fn colored(&self) -> bool {
        match self.color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => {
                let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
                let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
                io::stderr().is_terminal() && !set("NO_COLOR") && !dumb
            }
        }
    }

    fn json(&self) -> bool {
        self.format == Format::Json
    }

    fn error_word(&self) -> &'static str {
        if self.colored() {
            "\x1b[1;31merror\x1b[0m"
        } else {
            "error"
        }
    }

    /// What says a note on standard error, unless `--quiet`, for who outlives this.
    fn warner(&self) -> fn(&str) {
        if self.quiet { |_| () } else { say }
    }

    /// A note on standard error, unless `--quiet`.
    fn note(&self, message: &str) {
        if !self.quiet {
            say(message);
        }
    }

    /// A note on standard error with `--verbose` only.
    fn detail(&self, message: &str) {
        if self.verbose > 0 {
            say(message);
        }
    }

    /// Diagnostics as text on standard error; with `--quiet`, errors only.
    fn report(&self, sources: &SourceMap, diagnostics: &[Diagnostic]) {
        let wanted = |d: &&Diagnostic| d.is_error() || !self.quiet;
        let shown: Vec<Diagnostic> = diagnostics.iter().filter(wanted).cloned().collect();
        if !shown.is_empty() {
            let text = diag::render::text(sources, &shown, self.colored());
            say(text.trim_end());
        }
    }
}

/// Diagnostics as JSON values, to be part of a larger result.
fn json(sources: &SourceMap, diagnostics: &[Diagnostic]) -> Vec<serde_json::Value> {
    let text = diag::render::json(sources, diagnostics);
    serde_json::from_str(&text).unwrap_or_default()
}

/// Writes a line to standard error; there is nobody left to tell when that fails.
fn say(message: &str) {
    let _ = progress::aside(|| writeln!(io::stderr().lock(), "{message}"));
}

/// Writes to standard output. A reader that has gone away (`impasto ... | head`) is no error.
fn print(text: &str) -> Outcome {
    let written = progress::aside(|| {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    });
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            let why = impasto::files::reason(&error);
            let message = format!("cannot write to standard output: {why}");
            Err(Failure::new(message, Unwritten::from(error).transient))
        }
        _ => Ok(()),
    }
}

/// Compiles what is asked for, and reports what is wrong with it.
fn compile(
    requests: &[MaterialRequest],
    loader: &mut FileLoader,
    global: &Global,
) -> Result<Program, Failure> {
    let compiled = compiler::compile(requests, loader);
    global.report(&compiled.sources, &compiled.diagnostics);
    compiled.program.ok_or(Failure::Diagnostics)
}

/// A scene and what its materials compile to.
fn compiled_scene(path: &std::path::Path, global: &Global) -> Result<(Scene, Program), Failure> {
    let scene = impasto::load(path).map_err(|e| Failure::Error(e.to_string()))?;
    let mut loader = FileLoader::new(&scene.base);
    let program = compile(&impasto::requests(&scene), &mut loader, global)?;
    Ok((scene, program))
}

/// The text of a file that an option names.
fn read_text(path: &std::path::Path) -> Result<String, Failure> {
    let text = impasto::runtime::input::read_to_string(path);
    text.map_err(|error| {
        let why = impasto::files::reason(&error);
        Failure::Error(format!("cannot read `{}`: {why}", path.display()))
    })
}

/// An error of the renderer.
fn runtime(error: impasto::RuntimeError) -> Failure {
    Failure::new(error.to_string(), error.is_transient())
}

/// `1 error`, `2 errors`.
fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}
