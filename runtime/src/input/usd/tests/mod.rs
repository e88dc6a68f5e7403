//! USD files as folders, from layers that are written here.

use std::path::PathBuf;

use glam::DVec3;
use tempfile::TempDir;

use crate::error::SceneError;
use crate::input;
use crate::scene::formats::{FORMATS, Geometry};

mod composed;
mod damage;
mod shading;
mod shape;
mod shown;

/// A folder with a file.
struct Room {
    folder: TempDir,
    name: String,
}

impl Room {
    /// A folder with a layer `m.usda` of this text after its first lines, in metres and with y up.
    fn of(text: &str) -> Self {
        Self::with("m.usda", layer(text).as_bytes())
    }

    fn with(name: &str, bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let room = Self {
            folder,
            name: name.into(),
        };
        room.and(name, bytes)
    }

    /// Writes another file into the folder.
    fn and(self, name: &str, bytes: &[u8]) -> Self {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("written");
        self
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join(&self.name)
    }

    fn member(&self, name: &str) -> String {
        let bytes = input::read(&self.path().join(name)).unwrap_or_else(|e| panic!("{e}"));
        String::from_utf8(bytes).expect("UTF-8")
    }

    fn read(&self, member: &str, seconds: f64) -> Result<Geometry, SceneError> {
        let format = FORMATS.iter().find(|f| f.name == "USD").expect("a row");
        let name = if member.is_empty() {
            self.name.clone()
        } else {
            format!("{}/{member}", self.name)
        };
        (format.read)(self.folder.path(), &name, seconds)
    }

    /// All that it shows, at time 0.
    fn all(&self) -> Geometry {
        self.read("", 0.0).unwrap_or_else(|e| panic!("{e}"))
    }

    /// What is wrong with a member.
    fn wrong_member(&self, name: &str) -> String {
        let error = input::read(&self.path().join(name));
        error.expect_err("an error").to_string()
    }

    /// What is wrong with it.
    fn wrong(&self) -> String {
        match self.read("", 0.0) {
            Ok(_) => panic!("nothing is wrong"),
            Err(error) => error.to_string(),
        }
    }
}

fn layer(text: &str) -> String {
    let head = "metersPerUnit = 1\n    upAxis = \"Y\"\n    timeCodesPerSecond = 24";
    format!("#usda 1.0\n(\n    {head}\n)\n{text}")
}

/// Attributes of a square of two metres in x and y that has a corner at the origin.
const SQUARE: &str = "
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    uniform token subdivisionScheme = \"none\"
";

/// The lowest and the highest corner.
fn bounds(geometry: &Geometry) -> [DVec3; 2] {
    let corners = || geometry.triangles.iter().flat_map(|t| t.positions);
    [
        corners().fold(DVec3::MAX, DVec3::min),
        corners().fold(DVec3::MIN, DVec3::max),
    ]
}

fn near(a: DVec3, b: [f64; 3]) -> bool {
    (a - DVec3::from(b)).abs().max_element() < 1e-5
}
