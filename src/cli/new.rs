//! `impasto new`: a material to start from, and a scene that shows it.

use std::path::Path;

use clap::{Args, ValueEnum};
use impasto::starter::{self, Template};
use serde_json::json;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct NewArgs {
    /// The material's name, which the file or folder has, too
    name: String,
    /// What to start from
    #[arg(long, default_value = "matte")]
    template: Wanted,
    /// Make a folder with the material and a scene that renders it at once
    #[arg(long)]
    scene: bool,
}

/// The templates as arguments.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Wanted {
    /// One matte color
    Matte,
    /// A dirty varnish over a matte base
    Layered,
    /// Metal flakes under a clear coat
    Paint,
    /// A BSDF of your own
    Bsdf,
    /// A material that glows; always with its scene
    Scene,
}

impl From<Wanted> for Template {
    fn from(wanted: Wanted) -> Self {
        match wanted {
            Wanted::Matte => Template::Matte,
            Wanted::Layered => Template::Layered,
            Wanted::Paint => Template::Paint,
            Wanted::Bsdf => Template::Bsdf,
            Wanted::Scene => Template::Scene,
        }
    }
}

pub(super) fn run(args: &NewArgs, global: &Global) -> Outcome {
    let template = Template::from(args.template);
    let name = args.name.as_str();
    let here = Path::new("");
    let with_scene = args.scene || template == Template::Scene;
    let (written, commands) = if with_scene {
        let files = starter::scene(name, template).map_err(failed)?;
        let path = starter::write_folder(here, name, &files).map_err(failed)?;
        let written = files.iter().map(|f| path.join(&f.name)).collect();
        (
            written,
            vec![
                format!("impasto check {name}/{name}.impasto"),
                format!("impasto render {name}/scene.toml --spp 64 --out {name}.png"),
            ],
        )
    } else {
        let file = starter::material(name, template).map_err(failed)?;
        let path = starter::write_file(here, &file).map_err(failed)?;
        (
            vec![path],
            vec![
                format!("impasto check {name}.impasto"),
                format!("impasto eval {name}.impasto"),
                format!("impasto emit {name}.impasto"),
            ],
        )
    };
    let written: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    if global.json() {
        let result = json!({ "written": written, "next": commands });
        return print(&format!("{result:#}\n"));
    }
    global.note(&format!(
        "wrote {}\nnext:\n    {}",
        written.join(", "),
        commands.join("\n    ")
    ));
    Ok(())
}

fn failed(error: starter::StarterError) -> Failure {
    Failure::Error(error.to_string())
}
