//! `impasto new`: files to start from. A material by one of the templates, and a scene that renders
//! it at once.
//!
//! Nothing is ever overwritten, and what is written is written as a whole: a file takes its name,
//! and a scene its folder's, when it is complete.

mod ball;

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::compiler::MemoryLoader;
use crate::compiler::lexer::Token;
use crate::files::reason;

/// Longest name, in characters.
const MAX_NAME: usize = 64;

/// Names that files of a scene have, or that devices have on some systems.
const TAKEN: [&str; 7] = ["table", "std", "con", "prn", "aux", "nul", "private"];

/// What a material starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Template {
    /// One matte color.
    #[default]
    Matte,
    /// A dirty varnish over a matte base.
    Layered,
    /// Metal flakes under a clear coat.
    Paint,
    /// A BSDF of one's own.
    Bsdf,
    /// A material that glows, in a scene.
    Scene,
}

impl Template {
    /// Every template, in the order of the help.
    pub const ALL: [Template; 5] = [
        Template::Matte,
        Template::Layered,
        Template::Paint,
        Template::Bsdf,
        Template::Scene,
    ];

    fn text(self) -> &'static str {
        match self {
            Template::Matte => include_str!("templates/matte.impasto"),
            Template::Layered => include_str!("templates/layered.impasto"),
            Template::Paint => include_str!("templates/paint.impasto"),
            Template::Bsdf => include_str!("templates/bsdf.impasto"),
            Template::Scene => include_str!("templates/scene.impasto"),
        }
    }
}

/// Why nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum StarterError {
    /// No material can be called that.
    #[error(
        "`{name}` cannot be the name of a material: {why}\nhint: use letters, digits and `_`, as in `red_paint`"
    )]
    Name {
        /// As it was given.
        name: String,
        /// What is wrong with it.
        why: String,
    },
    /// Something of that name is there.
    #[error("`{0}` exists already; nothing was written")]
    Exists(PathBuf),
    /// The file system refused.
    #[error("cannot write `{path}`: {why}")]
    Write {
        /// What was to be written.
        path: PathBuf,
        /// The reason.
        why: String,
    },
}

/// A file of a starter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StarterFile {
    /// Its name in the folder.
    pub name: String,
    /// What is in it.
    pub text: String,
}

/// The material `name` by `template`, alone.
///
/// # Errors
/// Names that no material can have.
pub fn material(name: &str, template: Template) -> Result<StarterFile, StarterError> {
    check_name(name)?;
    let file = StarterFile {
        name: format!("{name}.impasto"),
        text: template.text().replace("NAME", name),
    };
    // Names that the template imports are not known here.
    let mut files = MemoryLoader::default();
    files.add(&file.name, &*file.text);
    let checked = crate::compiler::check(&file.name, &mut files);
    match checked.diagnostics.first() {
        None => Ok(file),
        Some(diagnostic) => Err(StarterError::Name {
            name: name.into(),
            why: format!("it means something else already ({})", diagnostic.message),
        }),
    }
}

/// The material `name` by `template` and what is needed to see it: the files of a folder.
///
/// # Errors
/// Names that no material can have.
pub fn scene(name: &str, template: Template) -> Result<Vec<StarterFile>, StarterError> {
    let file = |name: &str, text: String| StarterFile {
        name: name.into(),
        text,
    };
    let description = include_str!("templates/scene.toml").replace("NAME", name);
    Ok(vec![
        material(name, template)?,
        file("scene.toml", description),
        file(
            "table.impasto",
            include_str!("templates/table.impasto").into(),
        ),
        file("ball.obj", ball::ball()),
        file("table.obj", ball::table()),
    ])
}

/// Writes `file` into `folder` and gives its path.
///
/// # Errors
/// If a file of that name is there, or the file system refuses.
pub fn write_file(folder: &Path, file: &StarterFile) -> Result<PathBuf, StarterError> {
    let path = folder.join(&file.name);
    let failed = |error: &std::io::Error| StarterError::Write {
        path: path.clone(),
        why: reason(error),
    };
    let mut temporary = builder(0o666)
        .tempfile_in(here(folder))
        .map_err(|e| failed(&e))?;
    let written = temporary.write_all(file.text.as_bytes());
    written.map_err(|e| failed(&e))?;
    match temporary.persist_noclobber(&path) {
        Ok(_) => Ok(path),
        Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => {
            Err(StarterError::Exists(path))
        }
        Err(error) => Err(failed(&error.error)),
    }
}

/// Writes `files` into a new folder `name` in `folder`, and gives its path.
///
/// # Errors
/// If something of that name is there, or the file system refuses.
pub fn write_folder(
    folder: &Path,
    name: &str,
    files: &[StarterFile],
) -> Result<PathBuf, StarterError> {
    let path = folder.join(name);
    if path.symlink_metadata().is_ok() {
        return Err(StarterError::Exists(path));
    }
    let failed = |error: &std::io::Error| StarterError::Write {
        path: path.clone(),
        why: reason(error),
    };
    let temporary = builder(0o777)
        .tempdir_in(here(folder))
        .map_err(|e| failed(&e))?;
    for file in files {
        write_file(temporary.path(), file)?;
    }
    match std::fs::rename(temporary.path(), &path) {
        Ok(()) => {
            // The folder has another name now, and stays.
            let _ = temporary.keep();
            Ok(path)
        }
        Err(error) => Err(failed(&error)),
    }
}

/// Makes temporary files and folders that others may read, as far as the user's mask says.
fn builder(mode: u32) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".impasto-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

fn here(folder: &Path) -> &Path {
    if folder == Path::new("") {
        Path::new(".")
    } else {
        folder
    }
}

/// Checks that `name` can name a material, and so a file and a folder.
fn check_name(name: &str) -> Result<(), StarterError> {
    let why = if name.is_empty() {
        "it is empty".to_owned()
    } else if name.contains(['/', '\\']) || name.starts_with('.') {
        "it is a path; go to the folder that the files are to be in".to_owned()
    } else if name.chars().count() > MAX_NAME {
        format!("it has more than {MAX_NAME} characters")
    } else if let Some(character) = name.chars().find(|c| !is_part(*c)) {
        format!("`{}` is in it", character.escape_debug())
    } else if name.starts_with(|c: char| c.is_ascii_digit()) {
        "it starts with a digit".to_owned()
    } else if Token::KEYWORDS.contains(&name) {
        "it is a word of the language".to_owned()
    } else if TAKEN.contains(&name.to_ascii_lowercase().as_str()) {
        "it is reserved".to_owned()
    } else {
        return Ok(());
    };
    Err(StarterError::Name {
        name: name.escape_debug().collect(),
        why,
    })
}

fn is_part(character: char) -> bool {
    character == '_' || character.is_ascii_alphanumeric()
}

impl fmt::Display for Template {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Template::Matte => "matte",
            Template::Layered => "layered",
            Template::Paint => "paint",
            Template::Bsdf => "bsdf",
            Template::Scene => "scene",
        })
    }
}
