//! What a scene must have for a state field, a stage or a block of WGSL to exist: a scene pays for
//! what it uses, and this is where it is decided what that is.

use impasto_compiler::abi::MaterialInfo;

use crate::world::World;

/// What a scene must have for a field, a stage or a block of WGSL to exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Need {
    /// Nothing.
    Always,
    /// A light that can be sampled, and a material that light can be sampled for.
    ShadowRays,
    /// The same, where rays are part of the path's state.
    SlotShadows,
    /// Of these, where shadow rays may begin on another side of a surface than extension rays.
    OwnShadowOrigins,
    /// Where they do not.
    SharedOrigins,
    /// Rays in buffers of their own.
    Requests,
    /// A medium that some result depends on.
    Media,
    /// A medium that absorbs light.
    Absorption,
    /// Media of different priority, of which one may hide the boundaries of another.
    Overlap,
    /// Extension rays that are cast in another order than they were asked for.
    Order,
    /// The same for shadow rays.
    ShadowOrder,
}

/// What a scene has, from which it follows what must exist.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    /// Light is sampled somewhere.
    pub shadow_rays: bool,
    /// A material that light is sampled for may be crossed.
    pub crossing_shadows: bool,
    /// Rays are in buffers of their own.
    pub requests: bool,
    /// Paths carry the media they are in.
    pub media: bool,
    /// A medium absorbs light.
    pub absorption: bool,
    /// Media differ in priority.
    pub overlap: bool,
    /// A material emits light that depends on the point or direction.
    pub varying_emission: bool,
    /// Rays are cast in an order of their own.
    pub order: bool,
    /// Only some pixels are rendered.
    pub some_pixels: bool,
}

impl Needs {
    /// What a scene and its materials need. Of `requests` and `order` the technique decides, of
    /// `some_pixels` what is asked for.
    pub(crate) fn of(world: &World, materials: &[MaterialInfo]) -> Self {
        let media = &world.parts.media;
        let shadow_rays = world.parts.has_sampled_lights
            && world.max_depth > 1
            && materials.iter().any(|m| !m.delta_only);
        Self {
            shadow_rays,
            crossing_shadows: shadow_rays && materials.iter().any(|m| !m.delta_only && m.crosses),
            media: media.part.is_some(),
            absorption: media.absorb,
            overlap: media.overlap,
            varying_emission: materials.iter().any(|m| m.varying_emission),
            order: false,
            requests: false,
            some_pixels: false,
        }
    }

    /// Whether what has this need exists.
    pub(crate) fn met(self, need: Need) -> bool {
        match need {
            Need::Always => true,
            Need::ShadowRays => self.shadow_rays,
            Need::SlotShadows => self.shadow_rays && !self.requests,
            Need::OwnShadowOrigins => self.met(Need::SlotShadows) && self.crossing_shadows,
            Need::SharedOrigins => self.met(Need::SlotShadows) && !self.crossing_shadows,
            Need::Requests => self.requests,
            Need::Media => self.media,
            Need::Absorption => self.absorption,
            Need::Overlap => self.overlap,
            Need::Order => self.order,
            Need::ShadowOrder => self.order && self.shadow_rays,
        }
    }
}
