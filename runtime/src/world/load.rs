//! Loading a scene with all that there is to put into one.

use std::collections::BTreeMap;
use std::path::Path;

use super::lights::{LIGHT_KINDS, readers};
use crate::error::SceneError;
use crate::input;
use crate::scene::formats::{FORMATS, Format, Geometry};
use crate::scene::{Scene, SceneFile, load_with};

/// [`load_with`] every format of geometry and every kind of light.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    load_with(&input::scene(path), FORMATS, &readers(LIGHT_KINDS)).map_err(explain_generated)
}

/// Reads a scene file with every format of geometry and every kind of light, for scenes at any frame and with other
/// values of parameters.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn open(path: &Path) -> Result<SceneFile<'static>, SceneError> {
    SceneFile::read_with(&input::scene(path), FORMATS, &readers(LIGHT_KINDS))
        .map_err(explain_generated)
}

/// The same of the text of a scene, whose geometry is of the `formats`.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn open_text<'f>(
    path: &Path,
    text: String,
    formats: &'f [Format],
) -> Result<SceneFile<'f>, SceneError> {
    SceneFile::of_text(path, text, formats, &readers(LIGHT_KINDS), &BTreeMap::new())
}

/// The same of a text that names files of every format of geometry, and geometry that is not in files: `held` has it by
/// names, which end in `.arrays`.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn open_holding(
    path: &Path,
    text: String,
    held: &BTreeMap<String, Geometry>,
) -> Result<SceneFile<'static>, SceneError> {
    SceneFile::of_text(path, text, &WITH_HELD, &readers(LIGHT_KINDS), held)
}

/// Every format, and that of geometry which programs hold in memory.
static WITH_HELD: [Format; FORMATS.len() + 1] = {
    let held = Format {
        name: "arrays",
        extensions: &["arrays"],
        read: |_, name, _| {
            Err(SceneError::new(format!(
                "nobody holds geometry called `{name}`"
            )))
        },
        without_material: "triangles without a material",
        values: &[],
        values_of: "arrays",
    };
    let mut all = [held; FORMATS.len() + 1];
    let mut row = 0;
    while row < FORMATS.len() {
        all[row] = FORMATS[row];
        row += 1;
    }
    all
};

/// The text of a scene that may be read with every format of geometry, in place of what is at `path`.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn open_edited(path: &Path, text: String) -> Result<SceneFile<'static>, SceneError> {
    open_text(path, text, FORMATS).map_err(explain_generated)
}

/// Reads the text of a scene, and none of the files that it names.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn check_text(path: &Path, text: &str) -> Result<(), SceneError> {
    crate::scene::check_text(path, text, FORMATS, &readers(LIGHT_KINDS))
}

/// The folder of an example whose files are too large to be kept with it.
const GENERATED: &str = "generated";

/// Whoever renders an example for the first time misses the files that are to be generated.
fn explain_generated(error: SceneError) -> SceneError {
    let file = error.path.as_deref();
    let folder = file.and_then(Path::parent).and_then(Path::file_name);
    let is_missing = file.is_some_and(|file| !file.exists());
    if is_missing && folder.is_some_and(|name| name == GENERATED) {
        error.or_hint("`cargo scenes` makes the generated files of the example scenes")
    } else {
        error
    }
}
