//! `cargo xtask python`: installs the Python package into an environment of its own below the build folder, by
//! `pip install .` as its users do, and runs its tests and the notebooks of docs/notebooks there.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use xtask::shell::{self, Result};

#[derive(Args)]
pub(crate) struct PythonArgs {
    /// Build the extension module as a release: slower to build, and as fast as users have it
    #[arg(long)]
    release: bool,
    /// Build the extension module with the features of the whole workspace, which the tests of Rust have built already, and
    /// put it beside the sources of the package in place of `pip install .`
    #[arg(long, conflicts_with = "release")]
    quick: bool,
    /// Arguments of pytest, such as `-k arrays`
    #[arg(last = true)]
    pytest: Vec<String>,
}

/// The environment, below the root.
const ENVIRONMENT: &str = "target/python";

/// The names that Python has.
const NAMES: [&str; 2] = ["python3", "python"];

/// The least version that the package takes.
const LEAST: (u32, u32) = (3, 10);

/// Prints that nothing was checked, and why. That is no error: the project needs no Python.
fn not_checked(why: &str) -> Result {
    eprintln!("NOT CHECKED: {why}");
    Ok(())
}

pub(crate) fn run(args: &PythonArgs) -> Result {
    let Some(python) = python() else {
        let (major, minor) = LEAST;
        return not_checked(&format!("there is no Python from {major}.{minor} on here"));
    };
    let environment = shell::root().join(ENVIRONMENT);
    let inside = inside(&environment);
    if !inside.exists() {
        shell::section("An environment for the package");
        let made = Command::new(&python)
            .arg("-m")
            .arg("venv")
            .arg(&environment)
            .status();
        if !made.is_ok_and(|status| status.success()) {
            return not_checked("Python has no module venv, or it failed");
        }
    }
    shell::section("What builds and tests the package");
    let mut tools = pip(&inside);
    tools.args(["maturin>=1.9,<2", "ipykernel", "matplotlib", "mypy"]);
    tools.args(["nbclient", "nbformat", "numpy", "pytest"]);
    if shell::run(&mut tools).is_err() {
        return not_checked("packages of Python could not be had");
    }
    if args.quick {
        assemble(&inside)?;
    } else {
        shell::section("pip install .");
        let mut install = pip(&inside);
        // With the tools that are there already, so that cargo finds what it built before.
        install.args(["--no-build-isolation", "--no-deps", "--force-reinstall"]);
        if !args.release {
            install.args(["--config-settings", "build-args=--profile dev"]);
        }
        shell::run(install.arg("."))?;
    }
    shell::section("Tests and notebooks");
    let mut pytest = Command::new(&inside);
    pytest.current_dir(shell::root());
    pytest.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]);
    shell::run(pytest.args(&args.pytest))
}

/// Puts the sources of the package and the extension module of a build of the workspace into an environment.
fn assemble(inside: &Path) -> Result {
    shell::section("The extension module, as the workspace builds it");
    // With everything, or else dependencies have other features than in tests.
    shell::run(shell::cargo().args(["build", "--workspace", "--all-targets"]))?;
    let mut ask = Command::new(inside);
    let code = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let packages = PathBuf::from(shell::capture(ask.args(["-c", code]))?.trim());
    let package = packages.join("impasto");
    let failed = |what: &Path, why: &std::io::Error| format!("{}: {why}", what.display());
    if package.exists() {
        std::fs::remove_dir_all(&package).map_err(|why| failed(&package, &why))?;
    }
    std::fs::create_dir_all(&package).map_err(|why| failed(&package, &why))?;
    let sources = shell::root().join("python/impasto");
    let entries = std::fs::read_dir(&sources).map_err(|why| failed(&sources, &why))?;
    for source in entries.flatten().map(|entry| entry.path()) {
        if let Some(name) = source.file_name().filter(|_| source.is_file()) {
            std::fs::copy(&source, package.join(name)).map_err(|why| failed(&source, &why))?;
        }
    }
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let built = shell::root().join(format!("target/debug/{prefix}_impasto{suffix}"));
    let ending = if cfg!(windows) { "pyd" } else { "abi3.so" };
    let module = package.join(format!("_impasto.{ending}"));
    std::fs::copy(&built, module).map_err(|why| failed(&built, &why))?;
    Ok(())
}

/// The Python to make the environment with.
fn python() -> Option<PathBuf> {
    let (major, minor) = LEAST;
    let check = format!("import sys; sys.exit(sys.version_info < ({major}, {minor}))");
    let fits = |name: &&str| {
        let mut command = Command::new(name);
        shell::capture(command.args(["-c", &check])).is_ok()
    };
    NAMES.into_iter().find(fits).map(PathBuf::from)
}

/// The Python of an environment.
fn inside(environment: &Path) -> PathBuf {
    if cfg!(windows) {
        environment.join("Scripts/python.exe")
    } else {
        environment.join("bin/python")
    }
}

/// `pip install` in the repository, by the Python of the environment and with its programs on the search path.
fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.current_dir(shell::root());
    let own = python.parent().map(Path::to_path_buf);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = own.into_iter().chain(std::env::split_paths(&path));
    if let Ok(path) = std::env::join_paths(path) {
        command.env("PATH", path);
    }
    command.args([
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]);
    command
}
