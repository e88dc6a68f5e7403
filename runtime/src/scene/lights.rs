//! The lights that a scene lists, whatever kinds of them there are.
//!
//! A scene does not know the kinds. Whoever loads it hands over a [`LightReader`] for each, and a light says
//! of itself where it is and which triangles it adds. `world::lights` has the kinds.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::document::Table;
use crate::error::SceneError;

/// Reads the `[[lights]]` entries of a kind.
#[derive(Clone, Copy, Debug)]
pub struct LightReader {
    /// What entries of the kind give as their `kind`.
    pub kind: &'static str,
    pub(crate) read: ReadLight,
}

/// Takes the keys of an entry from its table. Gives the light, and its place in the world if it has one.
pub(crate) type ReadLight = fn(&mut Table) -> Result<(Light, Option<DVec3>), SceneError>;

/// What a kind says of a light of its own.
pub trait SceneLight: Any + Clone + PartialEq + fmt::Debug + Send + Sync {
    /// Puts a light that has a place there, in the coordinates of the scene.
    fn put_at(&mut self, _place: Vec3) {}

    /// The corners of its surface if its place in the world is `_place`; none without a surface.
    fn corners(&self, _place: DVec3) -> Vec<DVec3> {
        Vec::new()
    }

    /// The triangles that it adds to the scene, in the scene's coordinates. They have no material, and paths
    /// end on them.
    fn triangles(&self) -> Vec<[Vec3; 3]> {
        Vec::new()
    }
}

/// A light that is neither a surface with an emissive material nor the environment.
#[derive(Clone)]
pub struct Light(Arc<dyn AnyLight>);

impl Light {
    /// A light of any kind.
    pub fn new(light: impl SceneLight) -> Light {
        Light(Arc::new(light))
    }

    /// The light if it is of the kind `L`.
    pub fn get<L: SceneLight>(&self) -> Option<&L> {
        let light: &dyn Any = &*self.0;
        light.downcast_ref()
    }

    /// The same light at a place of the scene.
    pub(super) fn put_at(&self, place: Vec3) -> Light {
        self.0.copy_at(place)
    }

    /// The corners of its surface if its place in the world is `place`.
    pub(super) fn corners(&self, place: DVec3) -> Vec<DVec3> {
        self.0.corners(place)
    }

    /// The triangles that it adds to the scene.
    pub(super) fn triangles(&self) -> Vec<[Vec3; 3]> {
        self.0.triangles()
    }
}

impl PartialEq for Light {
    fn eq(&self, other: &Light) -> bool {
        self.0.is_like(other)
    }
}

impl fmt::Debug for Light {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.0, f)
    }
}

/// [`SceneLight`] of a kind that is not known here.
trait AnyLight: Any + fmt::Debug + Send + Sync {
    fn copy_at(&self, place: Vec3) -> Light;
    fn corners(&self, place: DVec3) -> Vec<DVec3>;
    fn triangles(&self) -> Vec<[Vec3; 3]>;
    fn is_like(&self, other: &Light) -> bool;
}

impl<L: SceneLight> AnyLight for L {
    fn copy_at(&self, place: Vec3) -> Light {
        let mut copy = self.clone();
        copy.put_at(place);
        Light::new(copy)
    }

    fn corners(&self, place: DVec3) -> Vec<DVec3> {
        SceneLight::corners(self, place)
    }

    fn triangles(&self) -> Vec<[Vec3; 3]> {
        SceneLight::triangles(self)
    }

    fn is_like(&self, other: &Light) -> bool {
        other.get() == Some(self)
    }
}
