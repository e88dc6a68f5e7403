//! `cargo xtask layers`: draws the folders of each crate and their arrows into ARCHITECTURE.md.
//!
//! [`CRATES`] says which folder may name which: those of the layers before its own. The unit tests hold
//! the sources to that, and the page to the sources.

use std::path::Path;

use clap::Args;

mod arrows;
mod draw;

use arrows::{Arrow, Source, arrows, folders};
use xtask::shell::{self, Result};

/// The page that has the drawing, between two lines that mark it.
const PAGE: &str = "ARCHITECTURE.md";

#[derive(Args)]
pub(crate) struct LayersArgs {
    /// Write the drawing into ARCHITECTURE.md
    #[arg(long)]
    write: bool,
}

/// A crate and its layers.
struct Crate {
    name: &'static str,
    /// Its sources, below the root of the repository.
    folder: &'static str,
    /// Its folders from the bottom up. Each names only folders of the layers before its own.
    layers: &'static [&'static [&'static str]],
}

/// Every crate whose folders are layers.
const CRATES: &[Crate] = &[
    Crate {
        name: "impasto-compiler",
        folder: "compiler/src",
        layers: &[
            &[
                "abi",
                "moment",
                "parameter_value",
                "random",
                "source",
                "stages",
            ],
            &["ast", "diag", "ir"],
            &["closure", "lexer", "loader", "parameters", "written"],
            &["parser", "passes"],
            &["program"],
            &["codegen", "format", "oracle", "sema"],
            &["analysis", "build", "interface"],
            &["driver"],
            &["inspect", "instance", "values"],
            &["cost"],
            &["partition"],
        ],
    },
    Crate {
        name: "impasto-cpu",
        folder: "cpu/src",
        layers: &[
            &["cell", "error", "shape"],
            &["code"],
            &["arithmetic", "interpret", "lower", "plan"],
            &["native"],
            &["wide"],
            &["kernel"],
        ],
    },
    Crate {
        name: "impasto-runtime",
        folder: "runtime/src",
        layers: &[
            &["error", "technique", "parallel", "fingerprint", "wgsl"],
            &["input"],
            &["image_file", "options"],
            &["film", "scene"],
            &["world"],
            &["kernels"],
            &["gpu"],
            &["cpu"],
            &["device"],
            &["render"],
            &["multi"],
            &["lab", "audit", "evaluate"],
        ],
    },
    Crate {
        name: "impasto-trace",
        folder: "trace/src",
        layers: &[
            &["error", "path", "textures"],
            &["compare", "signature"],
            &["materials"],
            &["record"],
            &["replay"],
        ],
    },
    Crate {
        name: "impasto-lsp",
        folder: "lsp/src",
        layers: &[
            &["host", "library", "text"],
            &["margin"],
            &["documents"],
            &["material"],
            &["scene", "worker"],
            &["server"],
        ],
    },
    Crate {
        name: "impasto-verify",
        folder: "verify/src",
        layers: &[
            &["effort", "lanes", "precision", "promise", "statistics"],
            &["cells", "drawn", "evaluate"],
            &["distribution"],
            &["closure", "material"],
            &["check"],
        ],
    },
    Crate {
        name: "impasto-import",
        folder: "import/src",
        layers: &[&["error", "files"], &["imported"], &["mtlx"]],
    },
    Crate {
        name: "impasto",
        folder: "src",
        layers: &[
            &["set"],
            &[
                "cache", "error", "files", "goal", "ir_text", "cost", "plot", "docs", "trace",
            ],
            &["driver", "plan", "starter"],
            &["converge", "measure", "shot"],
            &["calibrate", "editor", "farm", "live", "snapshots", "tev"],
            &["experiment"],
            &["cli"],
        ],
    },
    Crate {
        name: "impasto-python",
        folder: "python/src",
        layers: &[
            &["error"],
            &["device", "process", "source"],
            &["scene"],
            &["bsdf", "material", "plan"],
            &["model", "render", "study"],
            &["command"],
        ],
    },
];

/// Prints the drawing, or writes it; fails if a folder names one that it may not.
pub(crate) fn run(args: &LayersArgs) -> Result {
    let root = shell::root();
    let drawing = drawing(root)?;
    if args.write {
        let page = root.join(PAGE);
        let text = std::fs::read_to_string(&page).map_err(|e| format!("{PAGE}: {e}"))?;
        std::fs::write(&page, draw::replace(&text, &drawing)?).map_err(|e| e.to_string())?;
    } else {
        eprint!("{drawing}");
    }
    let wrong: Vec<String> = violations(root)?;
    if wrong.is_empty() {
        return Ok(());
    }
    Err(wrong.join("\n"))
}

/// The drawing of every crate.
fn drawing(root: &Path) -> Result<String> {
    let mut out = draw::crates(&dependencies(root)?);
    for part in CRATES {
        let sources = sources(&root.join(part.folder))?;
        let folders = folders(&sources).into_iter().map(str::to_owned);
        out += &draw::table(
            part.name,
            part.folder,
            &folders.collect(),
            &arrows(&sources),
        );
    }
    Ok(out)
}

/// The workspace's crates, each with those that its manifest depends on.
fn dependencies(root: &Path) -> Result<Vec<(String, Vec<String>)>> {
    let read =
        |path: &Path| std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()));
    let workspace = read(&root.join("Cargo.toml"))?;
    let members = workspace.lines().find_map(|l| l.strip_prefix("members = "));
    let members = members.unwrap_or_default().split('"').skip(1).step_by(2);
    let folders = members.map(|member| root.join(member));
    let mut crates = Vec::new();
    for folder in folders.chain([root.to_path_buf()]) {
        let manifest = read(&folder.join("Cargo.toml"))?;
        let name = manifest.lines().find_map(|l| l.strip_prefix("name = "));
        let needed = manifest
            .lines()
            .skip_while(|l| *l != "[dependencies]")
            .skip(1);
        let needed = needed.take_while(|line| !line.starts_with('['));
        let needed = needed.filter_map(|line| line.split(['.', ' ']).next());
        let needed = needed.filter(|name| name.starts_with("impasto") || *name == "xtask");
        crates.push((
            name.unwrap_or_default().trim_matches('"').to_owned(),
            needed.map(str::to_owned).collect(),
        ));
    }
    Ok(crates)
}

/// What names what it may not, in all crates.
fn violations(root: &Path) -> Result<Vec<String>> {
    let mut all = Vec::new();
    for part in CRATES {
        let sources = sources(&root.join(part.folder))?;
        all.extend(violations_of(part.folder, &sources, part.layers));
    }
    Ok(all)
}

/// What names what it may not: with file and line, and what may be named.
fn violations_of(folder: &str, sources: &[Source], layers: &[&[&str]]) -> Vec<String> {
    let layer = |name: &str| layers.iter().position(|layer| layer.contains(&name));
    let all = folders(sources);
    let unknown = all.iter().filter(|name| layer(name).is_none());
    let unknown = unknown.map(|name| {
        format!("{folder}/{name} is in no layer: give it one in `CRATES` (xtask/src/layers/mod.rs)")
    });
    let gone = layers.iter().copied().flatten();
    let gone = gone.filter(|name| !all.contains(*name));
    let gone = gone.map(|name| format!("`CRATES` has {folder}/{name}, which does not exist"));
    let arrows = arrows(sources);
    let upward = arrows.iter().filter(|arrow| {
        let (from, to) = (layer(&arrow.from), layer(&arrow.to));
        from.is_some() && (to.is_none() || to >= from)
    });
    let upward = upward.map(|Arrow { from, to, place }| {
        let below = layers[..layer(from).unwrap_or(0)].concat().join(", ");
        let (file, line) = place;
        format!("{folder}/{file}:{line}: `{from}` names `{to}`; it may name {below}")
    });
    unknown.chain(gone).chain(upward).collect()
}

/// Every Rust file below a folder, in the order of their paths.
fn sources(folder: &Path) -> Result<Vec<Source>> {
    let mut sources = Vec::new();
    let mut left = vec![folder.to_path_buf()];
    let text = |e: std::io::Error| format!("{}: {e}", folder.display());
    while let Some(path) = left.pop() {
        for entry in std::fs::read_dir(&path).map_err(text)? {
            let path = entry.map_err(text)?.path();
            if path.is_dir() {
                // Tests of a crate, which may name all of it.
                if path.file_name().is_none_or(|name| name != "tests") {
                    left.push(path);
                }
            } else if is_source(&path) {
                let below = path.strip_prefix(folder).unwrap_or(&path);
                let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
                sources.push(Source {
                    path: parts.join("/"),
                    text: std::fs::read_to_string(&path).map_err(text)?,
                });
            }
        }
    }
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(sources)
}

/// Whether a file is Rust that is more than tests.
fn is_source(path: &Path) -> bool {
    let is_tests = path.file_stem().is_some_and(|stem| stem == "tests");
    path.extension().is_some_and(|e| e == "rs") && !is_tests
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_folder_names_one_that_it_may_not() {
        let wrong = violations(shell::root()).expect("readable sources");
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn the_page_shows_the_arrows_that_there_are() {
        let root = shell::root();
        let page = std::fs::read_to_string(root.join(PAGE)).expect("the page");
        let drawn = draw::replace(&page, &drawing(root).expect("readable sources"));
        assert!(
            drawn.expect("marks") == page,
            "{PAGE} is behind the sources: run `cargo xtask layers --write`"
        );
    }

    /// The runtime's own sources with one import more, from a low layer to a high one.
    #[test]
    fn a_planted_import_is_found_with_its_place() {
        let part = CRATES.iter().find(|part| part.folder == "runtime/src");
        let part = part.expect("the runtime");
        let mut sources = sources(&shell::root().join(part.folder)).expect("readable sources");
        let scene = sources.iter_mut().find(|s| s.path == "scene/mod.rs");
        let scene = scene.expect("the folder of scenes");
        let planted = scene.text.find("\nuse ").expect("an import") + 1;
        scene
            .text
            .insert_str(planted, "use crate::render::Renderer;\n");
        let line = scene.text[..planted].matches('\n').count() + 1;
        let wrong = violations_of(part.folder, &sources, part.layers);
        let place = format!("runtime/src/scene/mod.rs:{line}: `scene` names `render`; it may name");
        assert_eq!(wrong.len(), 1, "{wrong:?}");
        assert!(wrong[0].starts_with(&place), "{}", wrong[0]);
    }

    #[test]
    fn folders_without_a_layer_and_layers_without_a_folder_are_found() {
        let source = |path: &str| Source {
            path: path.to_owned(),
            text: String::new(),
        };
        let wrong = violations_of("x/src", &[source("new/mod.rs")], &[&["old"]]);
        assert_eq!(wrong.len(), 2);
        assert!(wrong[0].contains("x/src/new is in no layer"));
        assert!(wrong[1].contains("x/src/old, which does not exist"));
    }
}
