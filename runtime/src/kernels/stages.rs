//! The table of stages of the path tracer, after Laine et al. 2013, section 4.2.
//!
//! A stage is one WGSL function that works on one slot of the pool. It reaches path state
//! through accessors and asks for further work through `request_*` functions, so that the
//! same body runs as a kernel of the wavefront or as a step of the megakernel. What follows
//! from the table (which text a kernel is composed of, which queues there are) is derived in
//! `modules`, `wavefront` and `queues`. A new stage is one file in `kernels/` and one row here.

use crate::wgsl::template::{Template, template};
use crate::world::needs::{ALWAYS, Need, When, when};

const ABSORPTION: When = when(&[Need::Absorption]);
const MEDIA: When = when(&[Need::Media]);
const MIS: When = when(&[Need::Mis]);
const OVERLAP: When = when(&[Need::Overlap]);
const SCATTERING: When = when(&[Need::Scattering]);
const FIRST_HIT_OUTPUTS: When = when(&[Need::FirstHitOutputs]);
const MATERIAL_OUTPUTS: When = when(&[Need::MaterialOutputs]);
const SAMPLE_OUTPUTS: When = when(&[Need::SampleOutputs]);
const LIGHT_GROUPS: When = when(&[Need::LightGroups]);

/// The stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum StageId {
    /// Ends or goes on with every path, and samples a light.
    Logic,
    /// Starts a path.
    NewPath,
    /// Evaluates the material that was hit.
    Material,
    /// Counts shadow rays by what they will meet.
    BinShadow,
    /// Asks whether a light sample is seen.
    Shadow,
    /// Counts extension rays by what they will meet.
    BinExtension,
    /// Finds what the path's next segment hits.
    Extension,
}

/// A text that stages need beside their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    /// Random numbers.
    Random,
    /// Camera rays.
    Camera,
    /// The sums of the picture.
    Film,
    /// Tests for numbers that are none.
    Numbers,
    /// The triangles.
    Geometry,
    /// What a hit says of the surface.
    Surface,
    /// Weights of light samples against scattered rays.
    Mis,
    /// Sampling and evaluation of lights.
    Lights,
    /// The media that paths are in.
    Media,
    /// Ray casts.
    Traversal,
    /// What rays are ordered by.
    Order,
    /// Generated material code with what it reads.
    Materials,
    /// What records outputs of the film beside the picture.
    Outputs,
}

impl Part {
    /// What messages call it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Part::Random => "random numbers",
            Part::Camera => "camera",
            Part::Film => "film",
            Part::Numbers => "tests of numbers",
            Part::Geometry => "geometry",
            Part::Surface => "surface",
            Part::Mis => "weights of light samples",
            Part::Lights => "lights",
            Part::Media => "media",
            Part::Traversal => "ray casts",
            Part::Order => "order of rays",
            Part::Materials => "texture lookups",
            Part::Outputs => "outputs",
        }
    }
}

/// One stage.
#[derive(Debug)]
pub(crate) struct Stage {
    /// Which.
    pub id: StageId,
    /// Its name in reports and GPU captures, and of its WGSL function.
    pub name: &'static str,
    /// The file of the WGSL function.
    pub body: Template,
    /// The texts it needs, each with what must exist for it.
    pub parts: &'static [(Part, When)],
    /// When it exists.
    pub need: When,
}

/// Every stage, in the order of an iteration. Shadow rays come before extension rays because
/// those overwrite the hit.
pub(crate) const STAGES: [Stage; 7] = [
    Stage {
        id: StageId::Logic,
        name: "logic",
        body: template!("logic.wgsl"),
        parts: &[
            (Part::Random, ALWAYS),
            (Part::Numbers, ALWAYS),
            (Part::Film, ALWAYS),
            (Part::Geometry, ALWAYS),
            (Part::Surface, ALWAYS),
            (Part::Mis, MIS),
            (Part::Lights, ALWAYS),
            (Part::Media, ABSORPTION),
            (Part::Camera, FIRST_HIT_OUTPUTS),
            (Part::Outputs, FIRST_HIT_OUTPUTS),
            (Part::Outputs, SAMPLE_OUTPUTS),
            (Part::Outputs, LIGHT_GROUPS),
        ],
        need: ALWAYS,
    },
    Stage {
        id: StageId::NewPath,
        name: "new_path",
        body: template!("new_path.wgsl"),
        parts: &[(Part::Random, ALWAYS), (Part::Camera, ALWAYS)],
        need: ALWAYS,
    },
    Stage {
        id: StageId::Material,
        name: "material",
        body: template!("material.wgsl"),
        parts: &[
            (Part::Random, ALWAYS),
            (Part::Numbers, ALWAYS),
            (Part::Geometry, ALWAYS),
            (Part::Surface, ALWAYS),
            (Part::Mis, MIS),
            (Part::Media, MEDIA),
            (Part::Materials, ALWAYS),
            (Part::Outputs, MATERIAL_OUTPUTS),
            (Part::Outputs, LIGHT_GROUPS),
        ],
        need: ALWAYS,
    },
    Stage {
        id: StageId::BinShadow,
        name: "bin_shadow",
        body: template!("bin_shadow.wgsl"),
        parts: &[(Part::Order, ALWAYS)],
        need: when(&[Need::Order, Need::ShadowRays]),
    },
    Stage {
        id: StageId::Shadow,
        name: "shadow",
        body: template!("shadow.wgsl"),
        parts: &[(Part::Geometry, ALWAYS), (Part::Traversal, ALWAYS)],
        need: when(&[Need::ShadowRays]),
    },
    Stage {
        id: StageId::BinExtension,
        name: "bin_extension",
        body: template!("bin_extension.wgsl"),
        parts: &[(Part::Order, ALWAYS)],
        need: when(&[Need::Order]),
    },
    Stage {
        id: StageId::Extension,
        name: "extension",
        body: template!("extension.wgsl"),
        parts: &[
            (Part::Geometry, ALWAYS),
            (Part::Traversal, ALWAYS),
            (Part::Surface, OVERLAP),
            (Part::Media, OVERLAP),
            (Part::Media, SCATTERING),
            (Part::Random, SCATTERING),
            (Part::Numbers, SCATTERING),
        ],
        need: ALWAYS,
    },
];

impl StageId {
    /// Its row in the table.
    pub(crate) fn stage(self) -> &'static Stage {
        // The table holds every stage, which a test asserts.
        STAGES.iter().find(|s| s.id == self).unwrap_or(&STAGES[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stage_is_in_the_table_once() {
        for stage in &STAGES {
            assert_eq!(stage.id.stage().name, stage.name);
            assert_eq!(STAGES.iter().filter(|s| s.id == stage.id).count(), 1);
            assert!(stage.body.text.contains(&format!("\nfn {}(", stage.name)));
        }
        assert_eq!(StageId::Extension as usize, STAGES.len() - 1);
    }
}
