//! The one table of stages.

use super::{Entry, Part, Phase, Request, Stage, Work};
use crate::wgsl::template::template;
use crate::world::needs::{ALWAYS, Need, When, when};

const ABSORPTION: When = when(&[Need::Absorption]);
const CAMERA_CASTS: When = when(&[Need::CameraCasts]);
const LAST_RAYS: When = when(&[Need::LastRays]);
const LAST_BY_ROULETTE: When = when(&[Need::LastRays, Need::Roulette]);
const MEDIA: When = when(&[Need::Media]);
const MIS: When = when(&[Need::Mis]);
const OVERLAP: When = when(&[Need::Overlap]);
const ROULETTE: When = when(&[Need::Roulette]);
const SHADOW_RAYS: When = when(&[Need::ShadowRays]);
const SUBSURFACE: When = when(&[Need::Subsurface]);
const SCATTERING: When = when(&[Need::Scattering]);
const FIRST_HIT_OUTPUTS: When = when(&[Need::FirstHitOutputs]);
const MATERIAL_OUTPUTS: When = when(&[Need::MaterialOutputs]);
const SAMPLE_OUTPUTS: When = when(&[Need::SampleOutputs]);
const LIGHT_GROUPS: When = when(&[Need::LightGroups]);

/// Every stage, in the order of an iteration.
pub(crate) static STAGES: [Stage; 8] = [
    // Ends or goes on with every path.
    Stage {
        name: "logic",
        body: template!("../logic.wgsl"),
        arguments: "slot",
        need: ALWAYS,
        phase: Phase::Logic,
        work: Work::Pool,
        workgroup: Some(384),
        before: &[],
        casts: None,
        parts: &[
            (Part::Random, ALWAYS),
            (Part::Numbers, ALWAYS),
            (Part::Film, ALWAYS),
            (Part::Geometry, ALWAYS),
            (Part::Surface, ALWAYS),
            (Part::Mis, MIS),
            (Part::Lights, ALWAYS),
            (Part::Media, ABSORPTION),
            (Part::Roulette, ROULETTE),
            (Part::Fates, ALWAYS),
            (Part::Camera, FIRST_HIT_OUTPUTS),
            (Part::Outputs, FIRST_HIT_OUTPUTS),
            (Part::Outputs, SAMPLE_OUTPUTS),
            (Part::Outputs, LIGHT_GROUPS),
        ],
        loads: &[(
            ALWAYS,
            &[
                "ray_origin",
                "ray_direction",
                "hit",
                "throughput",
                "radiance",
                "contribution",
                "requests",
                "light_group",
                "media",
                "below_rates",
                "below_pulled",
            ],
        )],
        stores: &[(ALWAYS, &["hit", "throughput", "radiance"])],
    },
    // Starts a path.
    Stage {
        name: "new_path",
        body: template!("../new_path.wgsl"),
        arguments: "slot, item",
        need: ALWAYS,
        phase: Phase::Materials,
        work: Work::Begin { from: &["logic"] },
        workgroup: Some(128),
        before: &[],
        casts: None,
        parts: &[
            (Part::Random, ALWAYS),
            (Part::Camera, ALWAYS),
            (Part::Geometry, CAMERA_CASTS),
            (Part::Traversal, CAMERA_CASTS),
            (Part::Numbers, CAMERA_CASTS),
            (Part::Film, CAMERA_CASTS),
            (Part::Mis, when(&[Need::CameraCasts, Need::Mis])),
            (Part::Lights, CAMERA_CASTS),
            (
                Part::Outputs,
                when(&[Need::CameraCasts, Need::SampleOutputs]),
            ),
            (Part::Outputs, when(&[Need::CameraCasts, Need::LightGroups])),
        ],
        loads: &[],
        stores: &[(
            ALWAYS,
            &[
                "ray_origin",
                "ray_direction",
                "hit",
                "throughput",
                "radiance",
                "requests",
                "cone",
                "media",
            ],
        )],
    },
    // Samples a light, and evaluates the material that was hit.
    Stage {
        name: "material",
        body: template!("../material.wgsl"),
        arguments: "slot, instance",
        need: ALWAYS,
        phase: Phase::Materials,
        work: Work::Material { from: &["logic"] },
        workgroup: None,
        before: &[],
        casts: None,
        parts: &[
            (Part::Random, ALWAYS),
            (Part::Numbers, ALWAYS),
            (Part::Geometry, ALWAYS),
            (Part::Surface, ALWAYS),
            (Part::Mis, MIS),
            (Part::Lights, SHADOW_RAYS),
            (Part::Lights, LAST_RAYS),
            (Part::Roulette, LAST_BY_ROULETTE),
            (Part::Media, MEDIA),
            (Part::Materials, ALWAYS),
            (Part::Outputs, MATERIAL_OUTPUTS),
            (Part::Outputs, LIGHT_GROUPS),
        ],
        loads: &[(
            ALWAYS,
            &[
                "ray_origin",
                "ray_direction",
                "hit",
                "throughput",
                "radiance",
                "cone",
                "media",
            ],
        )],
        stores: &[(
            ALWAYS,
            &[
                "ray_origin",
                "shadow_origin",
                "ray_direction",
                "shadow_direction",
                "throughput",
                "radiance",
                "contribution",
                "requests",
                "cone",
                "light_group",
                "media",
                "below",
                "below_rates",
                "below_pulled",
            ],
        )],
    },
    // Counts shadow rays by what they will meet.
    Stage {
        name: "bin_shadow",
        body: template!("../bin_shadow.wgsl"),
        arguments: "slot, item",
        need: when(&[Need::Order, Need::ShadowRays]),
        phase: Phase::Rays,
        work: Work::Sort { of: "shadow" },
        workgroup: None,
        before: &["shadow"],
        casts: None,
        parts: &[(Part::Order, ALWAYS)],
        loads: &[(ALWAYS, &["shadow_origin", "shadow_direction"])],
        stores: &[],
    },
    // Asks whether a light sample is seen. The primitive that both kinds of ray start on is overwritten by
    // extension rays.
    Stage {
        name: "shadow",
        body: template!("../shadow.wgsl"),
        arguments: "slot",
        need: SHADOW_RAYS,
        phase: Phase::Rays,
        work: Work::Queue(Request {
            from: &["material"],
            parameters: "origin: vec3<f32>, skip: u32, direction: vec3<f32>, distance: f32",
            entry: Entry::Ray([
                "vec4<u32>(bitcast<vec3<u32>>(origin), skip)",
                "vec4<u32>(bitcast<vec3<u32>>(direction), bitcast<u32>(distance))",
            ]),
        }),
        workgroup: None,
        before: &["extension", "below"],
        casts: Some(ALWAYS),
        parts: &[(Part::Geometry, ALWAYS), (Part::Traversal, ALWAYS)],
        loads: &[(
            ALWAYS,
            &["shadow_origin", "shadow_direction", "contribution"],
        )],
        stores: &[(ALWAYS, &["contribution"])],
    },
    // Counts extension rays by what they will meet.
    Stage {
        name: "bin_extension",
        body: template!("../bin_extension.wgsl"),
        arguments: "slot, item",
        need: when(&[Need::Order]),
        phase: Phase::Rays,
        work: Work::Sort { of: "extension" },
        workgroup: None,
        before: &["extension"],
        casts: None,
        parts: &[(Part::Order, ALWAYS)],
        loads: &[(ALWAYS, &["ray_origin", "ray_direction"])],
        stores: &[],
    },
    // Finds what the path's next segment hits.
    Stage {
        name: "extension",
        body: template!("../extension.wgsl"),
        arguments: "slot",
        need: ALWAYS,
        phase: Phase::Rays,
        work: Work::Queue(Request {
            from: &["new_path", "material"],
            parameters: "origin: vec3<f32>, direction: vec3<f32>, skip: u32",
            entry: Entry::Ray([
                "vec4<u32>(bitcast<vec3<u32>>(origin), skip)",
                "vec4<u32>(bitcast<vec3<u32>>(direction), bitcast<u32>(3.0e38f))",
            ]),
        }),
        workgroup: None,
        before: &[],
        // Boundaries that are crossed, and light that is turned, would have to be seen to in the midst
        // of a cast.
        casts: Some(When {
            all: &[],
            none: &[Need::Overlap, Need::Scattering],
        }),
        parts: &[
            (Part::Geometry, ALWAYS),
            (Part::Traversal, ALWAYS),
            (Part::Surface, OVERLAP),
            (Part::Media, OVERLAP),
            (Part::Media, SCATTERING),
            (Part::Random, SCATTERING),
            (Part::Numbers, SCATTERING),
            (Part::Flights, SCATTERING),
        ],
        loads: &[
            (
                ALWAYS,
                &["ray_origin", "ray_direction", "hit", "throughput", "media"],
            ),
            (OVERLAP, &["cone"]),
            // Turns have random numbers by the vertex at which the ray was cast.
            (SCATTERING, &["cone", "radiance"]),
        ],
        stores: &[
            (ALWAYS, &["hit", "throughput", "media"]),
            (OVERLAP, &["cone"]),
            (SCATTERING, &["cone", "ray_direction"]),
        ],
    },
    // Takes light on below the surface that it entered.
    Stage {
        name: "below",
        body: template!("../below.wgsl"),
        arguments: "slot",
        need: SUBSURFACE,
        phase: Phase::Rays,
        work: Work::Queue(Request {
            from: &["logic", "material"],
            parameters: "",
            entry: Entry::Slot,
        }),
        workgroup: None,
        before: &[],
        casts: None,
        parts: &[
            (Part::Geometry, ALWAYS),
            (Part::Traversal, ALWAYS),
            (Part::Surface, ALWAYS),
            (Part::Random, ALWAYS),
            (Part::Numbers, ALWAYS),
            (Part::Flights, ALWAYS),
        ],
        loads: &[(
            ALWAYS,
            &[
                "ray_origin",
                "ray_direction",
                "hit",
                "throughput",
                "radiance",
                "cone",
                "below",
                "below_rates",
                "below_plain",
                "below_pulled",
            ],
        )],
        stores: &[(
            ALWAYS,
            &[
                "ray_origin",
                "ray_direction",
                "hit",
                "throughput",
                "cone",
                "below_rates",
                "below_plain",
                "below_pulled",
            ],
        )],
    },
];
