//! What the table of needs judges by: all that is known before a kernel is written.

use impasto_compiler::abi::{InputSet, MaterialInfo};

use super::Need;
use crate::technique::Technique;
use crate::world::World;

/// A scene, its materials, and how it is to be rendered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts<'a> {
    pub world: &'a World,
    pub materials: &'a [MaterialInfo],
    pub technique: &'a Technique,
    /// Whether stages are kernels of their own.
    pub wavefront: bool,
}

/// What a scene's own parts say of it, for `Facts`.
#[derive(Clone, Debug, Default)]
pub struct SceneFacts {
    /// Rows of the table that kinds of lights are, each with what it is in the scene.
    pub(crate) lights: Vec<(Need, String)>,
    /// Can scattered rays find a light that is sampled as well?
    pub(crate) weighted: bool,
    /// Is a light sampled that is at infinity?
    pub(crate) far: bool,
    /// Is there more than one light to choose from, or more to choose in one?
    pub(crate) choice: bool,
    /// Can paths run into lights?
    pub(crate) hit: bool,
    /// Can paths leave the scene into light?
    pub(crate) escape: bool,
    /// Have any corners normals?
    pub(crate) normals: bool,
    /// Have any corners texture coordinates?
    pub(crate) uvs: bool,
    /// Are objects placed by a second level of the acceleration structure?
    pub(crate) placed: bool,
}

impl SceneFacts {
    /// Of a world whose parts are written by hand, of which the worst is assumed; whether lights that are
    /// sampled can be met by chance as well decides how samples are weighted.
    pub fn by_hand(weighted: bool) -> Self {
        Self {
            lights: Vec::new(),
            weighted,
            far: true,
            choice: true,
            hit: true,
            escape: true,
            normals: true,
            uvs: true,
            placed: false,
        }
    }
}

impl Facts<'_> {
    /// The kind of light of a row, as it is in the scene.
    pub(super) fn light(&self, need: Need) -> Option<String> {
        let lights = &self.world.parts.facts.lights;
        let found = lights.iter().find(|(row, _)| *row == need);
        found.map(|(_, what)| what.clone())
    }

    /// Says of the first material for which a condition holds what is so.
    pub(super) fn material(
        &self,
        what: &str,
        holds: impl Fn(&MaterialInfo) -> bool,
    ) -> Option<String> {
        let found = self.materials.iter().find(|m| holds(m))?;
        Some(format!("`{}` {what}", found.name))
    }

    /// The same of the first material that reads some input.
    pub(super) fn reads(&self, what: &str, reads: impl Fn(&InputSet) -> bool) -> Option<String> {
        self.material(&format!("reads {what}"), |m| reads(&m.inputs))
    }
}
