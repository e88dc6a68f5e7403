//! `impasto import`: what other programs wrote, as a folder of sources and a scene that one can go on with.

use std::path::{Path, PathBuf};

use clap::Args;
use impasto::files::{reason, write_whole};
use impasto::runtime::input::gltf;
use serde_json::json;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct ImportArgs {
    /// A glTF file (.gltf, .glb)
    file: PathBuf,
    /// The folder to write, which must be new or empty; the file's name without extension by default
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn run(args: &ImportArgs, global: &Global) -> Outcome {
    let extension = args.file.extension().unwrap_or_default();
    if !["gltf", "glb"]
        .iter()
        .any(|e| extension.eq_ignore_ascii_case(e))
    {
        return Err(Failure::Error(format!(
            "`{}` is in no format that is imported\n  hint: glTF (.gltf, .glb) is; `render` takes OBJ files in scenes as \
             they are",
            args.file.display()
        )));
    }
    let out = args.out.clone();
    let out = out.unwrap_or_else(|| args.file.file_stem().unwrap_or_default().into());
    check_free(&out)?;
    let files = gltf::unpacked(&args.file).map_err(|e| Failure::Error(e.to_string()))?;
    for (name, bytes) in &files {
        let path = out.join(name);
        let folder = path.parent().unwrap_or(Path::new(""));
        let made = std::fs::create_dir_all(folder);
        made.map_err(|e| Failure::Error(format!("cannot make `{}`: {e}", folder.display())))?;
        write_whole(&path, bytes)?;
    }
    let scene = out.join("scene.toml").display().to_string();
    let next = format!(
        "impasto render {scene} --spp 64 --out {}.png",
        out.display()
    );
    if global.json() {
        let written: Vec<String> = files
            .iter()
            .map(|(name, _)| out.join(name).display().to_string())
            .collect();
        return print(&format!(
            "{:#}\n",
            json!({ "written": written, "next": [next] })
        ));
    }
    global.note(&format!(
        "wrote {scene} and {} files\nnext:\n    {next}",
        files.len() - 1
    ));
    Ok(())
}

/// Nothing of somebody else's is written over.
fn check_free(out: &Path) -> Result<(), Failure> {
    let entries = match std::fs::read_dir(out) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => {
            let why = reason(&e);
            return Err(Failure::Error(format!(
                "cannot use `{}`: {why}",
                out.display()
            )));
        }
    };
    if entries.count() == 0 {
        return Ok(());
    }
    Err(Failure::Error(format!(
        "`{}` is not empty\n  hint: name another folder by `--out`",
        out.display()
    )))
}
