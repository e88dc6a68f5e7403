//! A cluster of Slurm on this machine: three nodes with two pretended GPUs each, as root, without systemd or cgroups.
//!
//! Debian's slurmd is built to run several times on one machine. GPUs are pretended by device files that do no harm:
//! Slurm takes character devices alone, and leaves SLURM_JOB_GPUS out without a word for others.

use std::fs;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use xtask::adapter;
use xtask::shell::{self, Result};

/// The nodes.
pub(super) const NODES: [&str; 3] = ["n1", "n2", "n3"];
/// Debian's packages.
const PACKAGES: [&str; 2] = ["slurm-wlm", "munge"];
/// What ends everything.
const STOP: &str = include_str!("stop.sh");

/// A cluster that runs, until it is dropped.
pub(super) struct Cluster {
    pub(super) dir: PathBuf,
    /// Stops the cluster when the pipe to it closes, which it does however this process ends.
    guard: Option<Child>,
}

/// Installs Slurm if it is not there.
pub(super) fn prepare() -> Result {
    if !cfg!(target_os = "linux") {
        return Err("a local cluster needs Linux".into());
    }
    if !adapter::is_root() {
        return Err(
            "a local cluster is started by root: its nodes run tasks as whoever submits them"
                .into(),
        );
    }
    let programs = ["slurmctld", "slurmd", "sbatch", "munged"];
    let is_there =
        |program: &&str| shell::exists(program) || Path::new("/usr/sbin").join(program).is_file();
    if programs.iter().all(is_there) {
        return Ok(());
    }
    shell::section("Installing Slurm");
    if !shell::exists("apt-get") {
        return Err(format!(
            "Slurm is not here: install {} of Debian or their like",
            PACKAGES.join(" and ")
        ));
    }
    adapter::install_packages(&PACKAGES)
}

/// A port that nobody listens at now.
fn port() -> Result<u16> {
    let listener =
        std::net::TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    listener
        .map(|address| address.port())
        .map_err(|error| format!("no port is free: {error}"))
}

impl Cluster {
    /// Starts one in a folder that need not be there, and waits until its nodes are idle.
    pub(super) fn start(dir: &Path) -> Result<Self> {
        let cannot =
            |error: std::io::Error| format!("cannot write into {}: {error}", dir.display());
        for name in ["state", "munge"] {
            fs::create_dir_all(dir.join(name)).map_err(cannot)?;
        }
        shell::run(
            Command::new("chmod")
                .arg("711")
                .arg(dir)
                .arg(dir.join("munge")),
        )?;
        let host = shell::capture(Command::new("hostname").arg("-s"))?;
        let at = dir.display();
        let mut nodes = String::new();
        let mut gpus = String::new();
        for node in NODES {
            nodes += &format!(
                "NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={}\n",
                port()?
            );
            gpus += &format!("NodeName={node} Name=gpu File={at}/dev-{node}/nvidia[0-1]\n");
            for (device, file) in [("/dev/null", "nvidia0"), ("/dev/zero", "nvidia1")] {
                fs::create_dir_all(dir.join(format!("dev-{node}"))).map_err(cannot)?;
                fs::create_dir_all(dir.join(format!("spool-{node}"))).map_err(cannot)?;
                let link = dir.join(format!("dev-{node}/{file}"));
                std::os::unix::fs::symlink(device, link).map_err(cannot)?;
            }
        }
        let config = format!(
            "ClusterName=farm\n\
             SlurmctldHost={host}(127.0.0.1)\n\
             SlurmctldPort={}\n\
             SlurmUser=root\n\
             # A requeued task waits until its credential is out of date, which takes two minutes unless told otherwise.\n\
             AuthInfo=socket={at}/munge/socket,cred_expire=5\n\
             StateSaveLocation={at}/state\n\
             SlurmdSpoolDir={at}/spool-%n\n\
             SlurmctldPidFile={at}/slurmctld.pid\n\
             SlurmdPidFile={at}/%n.pid\n\
             SlurmctldLogFile={at}/slurmctld.log\n\
             SlurmdLogFile={at}/%n.log\n\
             # Without systemd and cgroups.\n\
             ProctrackType=proctrack/linuxproc\n\
             TaskPlugin=task/none\n\
             SelectType=select/cons_tres\n\
             SelectTypeParameters=CR_Core\n\
             # Nodes have what is said below, whatever the machine has.\n\
             SlurmdParameters=config_overrides\n\
             # A small cluster need not wait for more jobs before it looks at one.\n\
             SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1,sched_min_interval=0\n\
             # A node that says nothing is soon given up.\n\
             SlurmdTimeout=4\n\
             MessageTimeout=2\n\
             TCPTimeout=1\n\
             KillWait=15\n\
             ReturnToService=2\n\
             GresTypes=gpu\n\
             NodeName=DEFAULT CPUs=2 RealMemory=1000 Gres=gpu:2 State=UNKNOWN\n\
             {nodes}\
             PartitionName=all Nodes=n[1-3] Default=YES MaxTime=INFINITE\n",
            port()?
        );
        let write = |name: &str, text: &str| fs::write(dir.join(name), text).map_err(cannot);
        write("slurm.conf", &config)?;
        write("gres.conf", &gpus)?;
        write("cgroup.conf", "CgroupAutomount=no\n")?;
        write("stop.sh", STOP)?;
        let mut cluster = Self {
            dir: dir.to_owned(),
            guard: None,
        };
        cluster.guard = Some(cluster.guardian()?);
        let munge = |name: &str| dir.join("munge").join(name);
        shell::capture(
            Command::new("mungekey")
                .arg("--create")
                .arg("--keyfile")
                .arg(munge("key")),
        )?;
        let mut munged = Command::new("munged");
        munged.arg("--force").arg("--key-file").arg(munge("key"));
        munged
            .arg("--socket")
            .arg(munge("socket"))
            .arg("--pid-file")
            .arg(dir.join("munge.pid"));
        munged
            .arg("--log-file")
            .arg(munge("log"))
            .arg("--seed-file")
            .arg(munge("seed"));
        shell::capture(&mut munged)?;
        cluster.start_controller()?;
        for node in NODES {
            cluster.start_node(node)?;
        }
        wait("idle nodes", Duration::from_secs(60), || {
            let states = cluster.slurm("sinfo").args(["-hN", "-o", "%T"]).output();
            let states = states.map(|out| String::from_utf8_lossy(&out.stdout).into_owned());
            Ok(states.is_ok_and(|states| {
                states.lines().filter(|state| *state == "idle").count() == NODES.len()
            }))
        })?;
        Ok(cluster)
    }

    /// Whoever stops the cluster when this process is gone.
    fn guardian(&self) -> Result<Child> {
        let mut sh = Command::new("bash");
        sh.arg("-c").arg("cat >/dev/null; exec bash \"$0\" \"$1\"");
        sh.arg(self.dir.join("stop.sh")).arg(&self.dir);
        // A Ctrl-C at the terminal is not for it.
        sh.stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0);
        sh.spawn()
            .map_err(|error| format!("cannot start bash: {error}"))
    }

    /// A program that talks to this cluster.
    pub(super) fn slurm(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.dir.join("slurm.conf"));
        command
    }

    fn start_controller(&self) -> Result {
        shell::capture(
            self.slurm("slurmctld")
                .arg("-f")
                .arg(self.dir.join("slurm.conf")),
        )
        .map(drop)
    }

    /// Ends the controller well, and starts it again. (One that is killed forgets what it was told in the last seconds.)
    pub(super) fn restart_controller(&self) -> Result {
        let pid = self.pid("slurmctld")?;
        shell::capture(Command::new("kill").arg(&pid))?;
        wait("the controller's end", Duration::from_secs(30), || {
            Ok(!Path::new("/proc").join(&pid).exists())
        })?;
        self.start_controller()
    }

    pub(super) fn start_node(&self, node: &str) -> Result {
        shell::capture(
            self.slurm("slurmd")
                .args(["-N", node, "-f"])
                .arg(self.dir.join("slurm.conf")),
        )
        .map(drop)
    }

    /// The number of a daemon's process.
    fn pid(&self, daemon: &str) -> Result<String> {
        let path = self.dir.join(format!("{daemon}.pid"));
        let text =
            fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(text.trim().to_owned())
    }

    /// Ends a daemon at once, and nothing that it started.
    pub(super) fn kill(&self, daemon: &str) -> Result {
        shell::capture(Command::new("kill").args(["-9", &self.pid(daemon)?]))?;
        // Nobody else who gets that number is to be ended later.
        let _ = fs::remove_file(self.dir.join(format!("{daemon}.pid")));
        Ok(())
    }

    /// As if the plug of a node were pulled: its daemon, the keepers of its tasks and the tasks end at once, so that
    /// nobody reports an end.
    pub(super) fn crash(&self, node: &str) -> Result {
        let script = r#"
            victims=$(cat "$1/$2.pid"); rm "$1/$2.pid"
            while [ -n "$victims" ]; do
                kill -9 $victims 2>/dev/null
                keepers= tasks=
                for environ in $(grep -lzxF "SLURM_CONF=$1/slurm.conf" /proc/[0-9]*/environ 2>/dev/null); do
                    grep -qzxF "SLURMD_NODENAME=$2" "$environ" 2>/dev/null || continue
                    pid=${environ#/proc/} pid=${pid%/environ}
                    tasks+=" $pid"
                    parent=$(ps -o ppid= -p "$pid" | tr -d ' ')
                    case $(cat "/proc/$parent/comm" 2>/dev/null) in slurmstepd*) keepers+=" $parent" ;; esac
                done
                victims="$keepers$tasks"
            done"#;
        shell::capture(
            Command::new("bash")
                .args(["-c", script, "crash"])
                .arg(&self.dir)
                .arg(node),
        )
        .map(drop)
    }

    /// Leaves the cluster to whoever wants to play.
    pub(super) fn keep(mut self) {
        if let Some(mut guard) = self.guard.take() {
            // Ended before its pipe closes, it stops nothing.
            let _ = guard.kill();
            let _ = guard.wait();
        }
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        if let Some(mut guard) = self.guard.take() {
            if let Some(mut pipe) = guard.stdin.take() {
                let _ = pipe.flush();
            }
            let _ = guard.wait();
        }
    }
}

/// Looks until something is so.
pub(super) fn wait(
    what: &str,
    longest: Duration,
    mut is_so: impl FnMut() -> Result<bool>,
) -> Result<Duration> {
    let begin = Instant::now();
    while !is_so()? {
        if begin.elapsed() > longest {
            return Err(format!(
                "there was no sign of {what} within {} s",
                longest.as_secs()
            ));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(begin.elapsed())
}
