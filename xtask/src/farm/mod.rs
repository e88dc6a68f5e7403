//! `cargo xtask farm`: a cluster of Slurm on this machine, jobs of `impasto farm` on it, and faults in their way. Each
//! ends with the bytes of the undivided render, or with a refusal that says what is wrong.
//!
//! Everything is rendered by the processor, so that the machine needs no GPU; those of the nodes are pretended.

mod cluster;
mod faults;
mod openjd;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use clap::Args;
use xtask::shell::{self, Result, cargo};

use cluster::Cluster;

#[derive(Args)]
pub(crate) struct FarmArgs {
    /// Start the cluster and leave it up, without running anything
    #[arg(long)]
    keep: bool,
    /// Only checks whose name contains this
    only: Option<String>,
}

/// A material that glows more with each frame.
const GLOW: &str = "use std::bsdf::diffuse;
use std::edf::uniform;
material glow {
    param wear: float = 0.1 in 0.0 .. 1.0;
    surface = diffuse(color(0.5 + 0.1 * wear));
    emission = uniform(color(0.1 * frame + time));
}
";

/// What checks have.
pub(crate) struct Bench {
    impasto: PathBuf,
    cluster: Cluster,
    /// Where jobs are.
    folder: PathBuf,
    /// Samples that one thread takes in a second of the small picture.
    samples_a_second: u32,
}

pub(crate) fn run(args: &FarmArgs) -> Result {
    if let Err(why) = cluster::prepare() {
        eprintln!("NOT CHECKED: {why}");
        return Ok(());
    }
    shell::section("Building the command");
    shell::run(cargo().args(["build", "--workspace", "--bin", "impasto"]))?;
    let impasto = shell::impasto("debug")?;
    let folder = std::env::temp_dir().join(format!("impasto-farm-{}", std::process::id()));
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let result = with_cluster(args, &impasto, &folder);
    if result.is_ok() && !args.keep {
        let _ = fs::remove_dir_all(&folder);
    } else if !args.keep {
        eprintln!("what was left is in {}", folder.display());
    }
    result
}

fn with_cluster(args: &FarmArgs, impasto: &Path, folder: &Path) -> Result {
    shell::section("Starting a cluster");
    let begin = Instant::now();
    let cluster = Cluster::start(&folder.join("cluster"))?;
    eprintln!(
        "three nodes are idle after {:.1} s",
        begin.elapsed().as_secs_f64()
    );
    if args.keep {
        let dir = cluster.dir.display().to_string();
        cluster.keep();
        eprintln!(
            "\nexport SLURM_CONF={dir}/slurm.conf    # then sinfo, sbatch, impasto farm submit"
        );
        eprintln!("bash {dir}/stop.sh {dir}    # ends it");
        return Ok(());
    }
    let bench = Bench::new(impasto, cluster, folder)?;
    let checks = faults::CHECKS.iter().chain(openjd::CHECKS);
    let mut failures = Vec::new();
    for (name, check) in checks {
        if args
            .only
            .as_ref()
            .is_some_and(|only| !name.contains(&**only))
        {
            continue;
        }
        let begin = Instant::now();
        let outcome = check(&bench);
        let seconds = begin.elapsed().as_secs_f64();
        match outcome {
            Ok(what) => eprintln!("ok    {seconds:>5.1} s  {name}: {what}"),
            Err(why) => {
                eprintln!("WRONG {seconds:>5.1} s  {name}: {why}");
                failures.push(*name);
            }
        }
        bench.calm()?;
    }
    if failures.is_empty() {
        Ok(())
    } else {
        Err(format!("wrong: {}", failures.join(", ")))
    }
}

impl Bench {
    fn new(impasto: &Path, cluster: Cluster, folder: &Path) -> Result<Self> {
        fs::write(folder.join("glow.impasto"), GLOW).map_err(|error| error.to_string())?;
        let mut bench = Self {
            impasto: impasto.to_owned(),
            cluster,
            folder: folder.to_owned(),
            samples_a_second: 1,
        };
        // How much this machine does, so that parts take seconds on any.
        let samples = 400;
        let begin = Instant::now();
        bench.render(1, samples, "speed")?;
        let seconds = begin.elapsed().as_secs_f64();
        bench.samples_a_second = (f64::from(samples) / seconds).clamp(20.0, 1e5) as u32;
        Ok(bench)
    }

    /// Options of every render.
    fn options() -> [&'static str; 4] {
        ["--turntable", "8", "--size", "32x32"]
    }

    /// What picks the device, after `--` of `farm new`.
    fn device() -> [&'static str; 4] {
        ["--device", "cpu", "--threads", "1"]
    }

    /// The program, with the cluster in its environment.
    pub(crate) fn impasto(&self, args: &[&str]) -> Result<Output> {
        let mut command = self.cluster.slurm(&self.impasto);
        let output = command.current_dir(&self.folder).args(args).output();
        output.map_err(|error| format!("impasto could not be started: {error}"))
    }

    /// The same; fails unless it exits with 0.
    pub(crate) fn well(&self, args: &[&str]) -> Result<String> {
        let output = self.impasto(args)?;
        if output.status.success() {
            return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
        }
        Err(format!(
            "`impasto {}`: {}",
            args.join(" "),
            String::from_utf8_lossy(&output.stderr).trim()
        ))
    }

    /// Fails unless it exits with a code and says something.
    pub(crate) fn refused(&self, args: &[&str], code: i32, says: &str) -> Result {
        let output = self.impasto(args)?;
        let said = String::from_utf8_lossy(&output.stderr);
        if output.status.code() == Some(code) && said.contains(says) {
            return Ok(());
        }
        let line = args.join(" ");
        Err(format!(
            "`impasto {line}` exits with {:?}, not {code} and `{says}`: {}",
            output.status.code(),
            said.trim()
        ))
    }

    /// Makes a job of frames in parts.
    pub(crate) fn job(
        &self,
        name: &str,
        frames: &str,
        samples: u32,
        parts: u32,
        more: &[&str],
    ) -> Result<PathBuf> {
        let (samples, parts) = (samples.to_string(), parts.to_string());
        let mut args = vec![
            "farm",
            "new",
            "glow.impasto",
            "--out",
            name,
            "--frames",
            frames,
        ];
        args.extend(Self::options());
        args.extend([
            "--spp",
            &samples,
            "--parts",
            &parts,
            "--checkpoint-every",
            "0.5",
        ]);
        args.extend(more);
        args.push("--");
        args.extend(Self::device());
        self.well(&args)?;
        Ok(self.folder.join(name))
    }

    /// Renders a frame undivided, and gives the bytes of its EXR.
    pub(crate) fn render(&self, frame: u32, samples: u32, name: &str) -> Result<Vec<u8>> {
        self.render_by(&Self::device(), frame, samples, name)
    }

    fn render_by(&self, device: &[&str], frame: u32, samples: u32, name: &str) -> Result<Vec<u8>> {
        let (frame, samples, out) = (
            frame.to_string(),
            samples.to_string(),
            format!("{name}.exr"),
        );
        let mut args = vec!["--quiet", "render", "glow.impasto", "--frame", &frame];
        args.extend(["--spp", &samples, "--out", &out]);
        args.extend(Self::options());
        args.extend(device);
        self.well(&args)?;
        fs::read(self.folder.join(&out)).map_err(|error| format!("{out}: {error}"))
    }

    /// Fails unless the pictures of a job are those of undivided renders.
    pub(crate) fn compare(
        &self,
        job: &Path,
        frames: std::ops::RangeInclusive<u32>,
        samples: u32,
    ) -> Result {
        for frame in frames {
            // By all threads, whose number changes no bit.
            let whole = self.render_by(&["--device", "cpu"], frame, samples, "whole")?;
            let path = job.join(format!("pictures/glow.{frame:04}.exr"));
            let merged = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            if merged != whole {
                return Err(format!(
                    "{} has other bytes than the undivided render",
                    path.display()
                ));
            }
        }
        Ok(())
    }

    /// Waits until nothing of the cluster runs or waits.
    pub(crate) fn finish(&self) -> Result<Duration> {
        cluster::wait("an empty queue", Duration::from_secs(100), || {
            Ok(self.queue()?.is_empty())
        })
    }

    /// What is in the queue.
    pub(crate) fn queue(&self) -> Result<String> {
        shell::capture(
            self.cluster
                .slurm("squeue")
                .args(["-h", "-r", "-o", "%i %T %N %k"]),
        )
    }

    /// Ends what a check left, and waits until all nodes can be used.
    fn calm(&self) -> Result {
        let _ = shell::capture(self.cluster.slurm("scancel").arg("--user=root"));
        for node in cluster::NODES {
            if !self.cluster.dir.join(format!("{node}.pid")).exists() {
                self.cluster.start_node(node)?;
            }
        }
        cluster::wait("idle nodes", Duration::from_secs(60), || {
            let states = shell::capture(self.cluster.slurm("sinfo").args(["-hN", "-o", "%T"]))?;
            Ok(states.lines().all(|state| state == "idle"))
        })
        .map(drop)
    }

    /// The log of a task.
    pub(crate) fn log(&self, job: &Path, task: &str) -> String {
        fs::read_to_string(job.join(format!("logs/{task}.log"))).unwrap_or_default()
    }

    /// Waits until a task runs and has kept a checkpoint, and gives the node it is on.
    pub(crate) fn node_of(&self, job: &Path, picture: u32, part: u32) -> Result<String> {
        let checkpoint = job.join(format!("parts/{picture}-{part}.checkpoint.film"));
        cluster::wait("a checkpoint", Duration::from_secs(60), || {
            Ok(checkpoint.exists())
        })?;
        let log = self.log(job, &format!("render-{picture}-{part}"));
        let node = log
            .lines()
            .rfind(|line| line.starts_with("==="))
            .and_then(|line| line.split(", ").nth(1));
        node.map(str::to_owned)
            .ok_or_else(|| format!("the log names no node: {log}"))
    }

    /// Samples of parts that take so many seconds.
    pub(crate) fn seconds(&self, seconds: u32) -> u32 {
        seconds * self.samples_a_second
    }
}

/// A check: what it showed, or what is wrong.
type Check = fn(&Bench) -> Result<String>;

/// A command that has the cluster in its environment.
fn with(bench: &Bench, program: &Path) -> Command {
    let mut command = bench.cluster.slurm(program);
    command.current_dir(&bench.folder);
    command
}
