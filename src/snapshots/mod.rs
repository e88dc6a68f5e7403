//! Snapshots of materials, kept beside their sources: the WGSL, what it costs, its parameters, and a small picture.
//!
//! [`taken`] makes the snapshot of a material as it is, [`Stored`] is the one that was accepted, and [`differences`] says
//! in diagnostics what of the one is not so in the other, at the lines of the source that cause it. Nothing here writes
//! but [`accept`].

use std::path::{Path, PathBuf};

use impasto_compiler::codegen::Target;
use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::source::{SourceMap, Span};
use impasto_compiler::{Loader, MaterialRequest, compile, cost, interface};

use impasto_runtime::input;

use crate::files;

mod difference;
mod facts;
pub mod picture;
mod stored;
mod wgsl;

pub use difference::{Aspect, Difference, differences};
pub use picture::Picture;
pub use stored::{FOLDER, Stored, digest, has_place, keeps, orphans, read};
pub use wgsl::Changed;

/// A material whose snapshot is taken.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// Its file.
    pub file: &'a str,
    /// Its name.
    pub name: &'a str,
    /// Where that is written.
    pub span: Span,
}

/// The snapshot of a material as it is.
#[derive(Clone, Debug)]
pub struct Taken {
    /// Its WGSL, without the comments that say where lines come from.
    pub wgsl: String,
    /// For each line of the WGSL the source and line that it comes from, if it says so.
    pub from: Vec<Option<(String, usize)>>,
    /// Costs and parameters as JSON.
    pub facts: String,
    /// What it looks like.
    pub picture: Picture,
    /// The files of pictures that it reads.
    pub textures: Vec<PathBuf>,
}

/// Points at which costs are counted, as `impasto cost` does.
const COUNTED: usize = 1024;

/// Takes the snapshot of a material with its defaults.
///
/// # Errors
/// Why it does not compile or cannot be rendered, with the texts that this points into if they are not the caller's.
pub fn taken(
    subject: Subject<'_>,
    loader: &mut dyn Loader,
    studio: &picture::Studio,
) -> Result<Taken, (Option<SourceMap>, Vec<Diagnostic>)> {
    let request = MaterialRequest {
        material: Some(subject.name.to_owned()),
        apart: true,
        ..MaterialRequest::new(subject.name, subject.file)
    };
    let compiled = compile(std::slice::from_ref(&request), loader);
    let Some(program) = compiled.program else {
        return Err((Some(compiled.sources), compiled.diagnostics));
    };
    let (wgsl, from) = wgsl::without_places(&program.complete_wgsl(Target::Native));
    let measured = cost::anywhere(&program, COUNTED).into_iter().next();
    let told = interface::interface(subject.file, loader);
    let told = told.materials.into_iter().find(|m| m.name == subject.name);
    let facts = facts::text(measured.as_ref(), &wgsl, told.as_ref());
    let picture = studio.picture(subject.file, subject.name).map_err(|why| {
        let message = format!("no picture of `{}` can be made: {why}", subject.name);
        let cannot = Diagnostic::new(Code::NotEvaluated, subject.span, message);
        (None, vec![cannot])
    })?;
    let base = Path::new(subject.file).parent().unwrap_or(Path::new(""));
    let textures = program.textures().into_iter();
    let textures = textures.map(|t| base.join(input::on_disk(Path::new(&t.path))));
    Ok(Taken {
        textures: textures.collect(),
        wgsl,
        from,
        facts,
        picture,
    })
}

/// Makes what was taken the snapshot of a material.
///
/// # Errors
/// What could not be written.
pub fn accept(subject: Subject<'_>, taken: &Taken) -> Result<(), String> {
    let paths = stored::paths(subject.file, subject.name);
    let folder = stored::folder(subject.file);
    files::make_folder(&folder)?;
    let head = stored::head(subject.file, subject.name);
    let parts: [(&Path, Vec<u8>); 3] = [
        (&paths.wgsl, (head + &taken.wgsl).into_bytes()),
        (&paths.facts, taken.facts.clone().into_bytes()),
        (&paths.picture, taken.picture.png.clone()),
    ];
    for (path, bytes) in parts {
        files::write_whole(path, &bytes)?;
    }
    Ok(())
}

/// A material in a folder that keeps snapshots has none.
pub fn missing(subject: Subject<'_>) -> Diagnostic {
    let message = format!("`{}` has no snapshot", subject.name);
    let folder = stored::folder(subject.file);
    Diagnostic::new(Code::NoSnapshot, subject.span, message)
        .expected(format!(
            "one in `{}`, as other materials have",
            folder.display()
        ))
        .hint("`impasto test --accept` takes it")
}
