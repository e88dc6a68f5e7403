//! Loading a scene with all that there is to put into one.

use std::path::Path;

use super::lights::{LIGHT_KINDS, readers};
use crate::error::SceneError;
use crate::scene::formats::FORMATS;
use crate::scene::{Scene, load_with};

/// [`load_with`] every format of geometry and every kind of light.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    load_with(path, FORMATS, &readers(LIGHT_KINDS))
}
