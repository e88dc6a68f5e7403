//! Finding a GPU to run kernels on, and installing a software one where there is none. Tests of kernels
//! want one; pictures do not, since the processor renders them.
//!
//! The verdict is always `impasto info`'s, run once it is built. Before that there is one cheap
//! look: a Linux machine on which no Vulkan driver is registered at all cannot have an adapter,
//! and it is better to learn so before a build of minutes than after it.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shell::{self, Result};

/// Debian's names of Mesa's software Vulkan and of the Vulkan loader.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Where the Vulkan loader reads driver manifests, below each data folder.
const MANIFESTS: &str = "vulkan/icd.d";

/// Installs a driver if none is registered. To be called before building.
pub fn prepare() -> Result {
    if !cfg!(target_os = "linux") || !registered_drivers().is_empty() {
        return Ok(());
    }
    shell::section("Preparing an adapter");
    install("no Vulkan driver is registered on this machine")
}

/// Checks by running `impasto info` that there is a usable adapter; where there is none,
/// installs a driver and checks again. Prints which adapter it is.
pub fn require(impasto: &Path) -> Result {
    shell::section("Looking for an adapter");
    let info = || shell::capture(Command::new(impasto).args(["info", "--device", "gpu"]));
    let adapter = match info() {
        Ok(adapter) => adapter,
        Err(reason) => {
            eprintln!("{reason}");
            install("this machine has no usable adapter")?;
            info().map_err(|reason| format!("there is still no usable adapter\n{reason}"))?
        }
    };
    show(&adapter);
    Ok(())
}

/// Says what would render, which is the processor where there is no GPU.
pub fn look(impasto: &Path) -> Result {
    shell::section("Looking for a device");
    show(&shell::capture(Command::new(impasto).arg("info"))?);
    Ok(())
}

fn show(info: &str) {
    info.lines().take(4).for_each(|line| eprintln!("{line}"));
}

/// Installs Mesa's software Vulkan through apt, or says what to install elsewhere.
fn install(reason: &str) -> Result {
    if let Some(name) = driver_override() {
        return Err(format!(
            "the environment variable {name} hides every driver that is installed\n\
             hint: unset it, or let it name the manifest of a driver"
        ));
    }
    if !cfg!(target_os = "linux") || !shell::exists("apt-get") {
        return Err(format!("{reason}\nhint: {}", advice()));
    }
    let packages = PACKAGES.join(" and ");
    eprintln!("{reason}: installing Mesa's software Vulkan with apt ({packages})");
    install_packages(&PACKAGES)
}

/// Installs packages of Debian and Ubuntu.
pub fn install_packages(packages: &[&str]) -> Result {
    shell::run(apt().arg("update"))?;
    shell::run(
        apt()
            .args(["install", "--yes", "--no-install-recommends"])
            .args(packages),
    )
}

/// What to do where this cannot install a driver.
fn advice() -> &'static str {
    if cfg!(target_os = "macos") {
        "macOS renders through Metal, which needs a Mac with a GPU it supports; nothing can be installed"
    } else if cfg!(windows) {
        "install the graphics driver of this machine's vendor (DirectX 12 or Vulkan)"
    } else if shell::exists("dnf") {
        "install the packages mesa-vulkan-drivers and vulkan-loader (`sudo dnf install ...`)"
    } else if shell::exists("pacman") {
        "install the packages vulkan-swrast and vulkan-icd-loader (`sudo pacman -S ...`)"
    } else if shell::exists("apk") {
        "install the packages mesa-vulkan-swrast and vulkan-loader (`sudo apk add ...`)"
    } else if shell::exists("zypper") {
        "install the packages libvulkan_lvp and libvulkan1 (`sudo zypper install ...`)"
    } else {
        "install a Vulkan driver; Mesa's llvmpipe (lavapipe) works on any processor"
    }
}

/// `apt-get` without questions, through sudo unless this is root.
fn apt() -> Command {
    let mut command = if is_root() {
        Command::new("apt-get")
    } else {
        // sudo drops the environment, so that `env` has to set the variable behind it.
        let mut sudo = Command::new("sudo");
        sudo.args(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
        sudo
    };
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command
}

/// Does this run as root?
pub fn is_root() -> bool {
    shell::capture(Command::new("id").arg("-u")).is_ok_and(|id| id == "0")
}

/// The environment variable that tells the loader to look at certain drivers only, if none of
/// those exist: installing more would not help then.
fn driver_override() -> Option<&'static str> {
    let (name, manifests) = listed_drivers()?;
    manifests.is_empty().then_some(name)
}

/// Manifests of the Vulkan drivers that the loader would find.
fn registered_drivers() -> Vec<PathBuf> {
    if let Some((_, manifests)) = listed_drivers() {
        return manifests;
    }
    data_folders()
        .iter()
        .flat_map(|folder| manifests_in(&folder.join(MANIFESTS)))
        .collect()
}

/// The environment variable that lists drivers, if one does, and those of them that exist.
fn listed_drivers() -> Option<(&'static str, Vec<PathBuf>)> {
    ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"]
        .into_iter()
        .find_map(|name| {
            let value = std::env::var_os(name).filter(|value| !value.is_empty())?;
            Some((name, manifests_of_variable(&value)))
        })
}

fn manifests_of_variable(value: &std::ffi::OsStr) -> Vec<PathBuf> {
    let listed = std::env::split_paths(value);
    listed
        .flat_map(|path| {
            if path.is_dir() {
                manifests_in(&path)
            } else if path.is_file() {
                vec![path]
            } else {
                Vec::new()
            }
        })
        .collect()
}

fn manifests_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    paths
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .collect()
}

/// The folders below which the loader looks on Linux, the XDG ones included.
fn data_folders() -> Vec<PathBuf> {
    let fixed = ["/etc", "/usr/local/etc", "/usr/share", "/usr/local/share"];
    let mut folders: Vec<PathBuf> = fixed.into_iter().map(PathBuf::from).collect();
    for name in [
        "XDG_DATA_DIRS",
        "XDG_CONFIG_DIRS",
        "XDG_DATA_HOME",
        "XDG_CONFIG_HOME",
    ] {
        let value = std::env::var_os(name).unwrap_or_default();
        folders.extend(std::env::split_paths(&value));
    }
    if let Some(home) = std::env::home_dir() {
        folders.extend([home.join(".local/share"), home.join(".config")]);
    }
    folders.push("/run/opengl-driver/share".into());
    folders
}
