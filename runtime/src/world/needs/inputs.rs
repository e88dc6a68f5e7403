//! What the table of needs judges by: all that is known before a kernel is written, as plain data.

use impasto_compiler::abi::{Input, MaterialInfo};

use super::Need;
use crate::film::layers::Layers;
use crate::film::outputs::{Ask, At, OUTPUTS, Output};
use crate::technique::{CameraRays, LastRays, RayData, RayFetch, RayKernels, RayOrder};

/// What a world's parts, its materials and the technique say.
#[derive(Clone, Debug)]
pub(crate) struct NeedInputs<'a> {
    pub lights: LightTraits,
    pub media: MediaTraits,
    pub surface: SurfaceTraits,
    /// Has the camera an aperture?
    pub lens: bool,
    /// Longest path in segments.
    pub max_depth: u32,
    /// The segment from whose end on a path may be ended at random.
    pub roulette_start: u32,
    pub materials: &'a [MaterialInfo],
    pub ray_order: RayOrder,
    pub ray_data: RayData,
    pub ray_fetch: RayFetch,
    pub ray_kernels: RayKernels,
    pub camera_rays: CameraRays,
    pub last_rays: LastRays,
    pub outputs: OutputTraits,
}

/// What the film records beside the picture: of the table of outputs a bit a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OutputTraits(u64);

impl OutputTraits {
    /// Of the layers of a film.
    pub(crate) fn of(layers: &Layers) -> Self {
        let rows = OUTPUTS.iter().enumerate();
        let recorded = rows.filter(|(_, row)| layers.iter().any(|l| std::ptr::eq(l.output, *row)));
        Self(recorded.fold(0, |bits, (at, _)| bits | 1 << at))
    }

    /// The first output for which a condition holds, in words.
    fn find(self, holds: impl Fn(&Output) -> bool) -> Option<String> {
        let rows = OUTPUTS.iter().enumerate();
        let mut recorded = rows.filter(|(at, _)| self.0 >> at & 1 == 1);
        let found = recorded.find(|(_, row)| holds(row));
        found.map(|(_, row)| format!("`--aov` asks for `{}`", row.name))
    }
}

/// What lights there are.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTraits {
    /// Rows of the table that kinds of lights are, each with what it is in the scene.
    pub rows: Vec<(Need, String)>,
    /// Can any light be sampled?
    pub sampled: bool,
    /// Can scattered rays find a light that is sampled as well?
    pub weighted: bool,
    /// Is a light sampled that is at infinity?
    pub far: bool,
    /// Is there more than one light to choose from, or more to choose in one?
    pub choice: bool,
    /// Can paths run into lights?
    pub hit: bool,
    /// Can paths leave the scene into light?
    pub escape: bool,
    /// Do rays rarely meet the boxes around all that have a surface?
    pub small: bool,
}

/// What fills objects.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MediaTraits {
    /// Does some result depend on the medium that a path is in?
    pub followed: bool,
    /// Is light lost on its way in any of them, absorbed or scattered?
    pub absorb: bool,
    /// Does any of them scatter light?
    pub scatter: bool,
    /// Do their priorities differ?
    pub overlap: bool,
}

/// What geometry says beside positions.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceTraits {
    /// Have any corners normals?
    pub normals: bool,
    /// Have any corners texture coordinates?
    pub uvs: bool,
    /// Have any a second set of them?
    pub uvs1: bool,
    /// Have any colors?
    pub colors: bool,
    /// Are coordinates counted from elsewhere than the world's origin?
    pub moved: bool,
    /// Are objects placed by a second level of the acceleration structure?
    pub placed: bool,
}

impl NeedInputs<'_> {
    /// The same with some materials only.
    pub(super) fn with_materials<'b>(&self, materials: &'b [MaterialInfo]) -> NeedInputs<'b> {
        NeedInputs {
            materials,
            lights: self.lights.clone(),
            // What the logic stage records is nothing that materials must be given.
            outputs: OutputTraits::default(),
            ..*self
        }
    }

    /// The kind of light of a row, as it is in the scene.
    pub(super) fn light(&self, need: Need) -> Option<String> {
        let found = self.lights.rows.iter().find(|(row, _)| *row == need);
        found.map(|(_, what)| what.clone())
    }

    /// Says which output is recorded at a point of a path.
    pub(super) fn records(&self, at: At) -> Option<String> {
        self.outputs.find(|output| output.is_recorded_at(at))
    }

    /// Says which output asks for something.
    pub(super) fn asks(&self, ask: Ask) -> Option<String> {
        self.outputs.find(|output| output.asks.contains(&ask))
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
    pub(super) fn reads(&self, what: &str, inputs: &[Input]) -> Option<String> {
        self.material(&format!("reads {what}"), |m| m.inputs.any(inputs))
    }
}
