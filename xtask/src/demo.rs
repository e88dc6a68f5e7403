//! `cargo xtask demo`: from a fresh checkout to a picture, on a GPU or else on the processor, without installing anything.

use std::process::Command;

use clap::Args;

use crate::adapter;
use crate::shell::{self, Result, cargo};

/// Several materials, small enough for any device.
const SCENE: &str = "examples/cornell/scene.toml";

#[derive(Args)]
pub(crate) struct DemoArgs {
    /// Samples per pixel
    #[arg(long, default_value_t = 48)]
    spp: u32,
    /// Width and height in pixels
    #[arg(long, default_value = "256x256")]
    size: String,
}

pub(crate) fn run(args: &DemoArgs) -> Result {
    shell::section("Building impasto");
    shell::run(cargo().args(["build", "--release", "--package", "impasto"]))?;
    let impasto = shell::impasto("release")?;
    adapter::look(&impasto)?;

    shell::section("Rendering");
    let folder = shell::root().join("out");
    std::fs::create_dir_all(&folder)
        .map_err(|e| format!("cannot create the folder {}: {e}", folder.display()))?;
    let picture = folder.join("demo.exr");
    let report = folder.join("demo.json");
    let mut render = Command::new(&impasto);
    render
        .current_dir(shell::root())
        .args(["render", SCENE, "--size", &args.size])
        .args(["--spp", &args.spp.to_string()])
        .arg("--out")
        .arg(&picture)
        .arg("--report")
        .arg(&report);
    shell::run(&mut render)?;

    shell::section("Done");
    eprintln!(
        "PNG, for looking:     {}",
        picture.with_extension("png").display()
    );
    eprintln!("EXR, linear radiance: {}", picture.display());
    eprintln!("Report:               {}", report.display());
    eprintln!("Next: change a material in {SCENE} or in materials/, and run this again.");
    Ok(())
}
