//! The one table of the fields of a path's state. Which stages read and write them is in the table of stages.

use super::Type::{F32, U32, Vec3, Words};
use super::{Field, Use};
use crate::world::needs::{ALWAYS, Need, When, when};

/// Shadow rays, where they are part of the path's state.
pub(crate) const SLOT_SHADOWS: When = When {
    all: &[Need::ShadowRays],
    none: &[Need::Requests],
};
/// Those that may begin on another side of a surface than extension rays.
pub(crate) const OWN_SHADOW_ORIGINS: When = When {
    all: &[Need::ShadowRays, Need::CrossingShadows],
    none: &[Need::Requests],
};
/// Those that do not.
const SHARED_ORIGINS: When = When {
    all: &[Need::ShadowRays],
    none: &[Need::Requests, Need::CrossingShadows],
};
/// Those that are cast before extension rays, whose hits overwrite their directions.
const EARLY_SHADOWS: When = When {
    all: &[Need::ShadowRays],
    none: &[Need::Requests, Need::JointCasts],
};
/// Those that are cast together with extension rays.
const JOINT_SHADOWS: When = When {
    all: &[Need::ShadowRays, Need::JointCasts],
    none: &[Need::Requests],
};
/// Shadow rays, wherever they are.
const SHADOW_RAYS: When = when(&[Need::ShadowRays]);

/// Every field there is, in the order of memory. Those that follow each other in pairs are those that
/// stages access together.
pub(crate) const FIELDS: [Field; 16] = [
    Field {
        uses: &[
            // The extension ray: from the camera or the last vertex.
            Use {
                name: "ray_origin",
                components: &[("origin", Vec3), ("pixel", U32)],
                need: ALWAYS,
            },
            // Where no material is crossed, both rays begin at the same place.
            Use {
                name: "shadow_origin",
                components: &[("origin", Vec3), ("pixel", U32)],
                need: SHARED_ORIGINS,
            },
        ],
        flag: None,
    },
    Field {
        // Until the ray is cast, the direction in which it begins; then that in which it arrives, which is
        // another where light is turned on its way.
        uses: &[Use {
            name: "ray_direction",
            components: &[("direction", Vec3), ("sample", U32)],
            need: ALWAYS,
        }],
        flag: None,
    },
    Field {
        uses: &[
            // What the extension ray hit: distance, barycentrics, primitive. Until the next is cast,
            // the primitive is the one that both kinds of ray start on.
            Use {
                name: "hit",
                components: &[("t", F32), ("u", F32), ("v", F32), ("primitive", U32)],
                need: ALWAYS,
            },
            // The shadow ray's direction, once the material has been evaluated at the hit, if it is cast before.
            Use {
                name: "shadow_direction",
                components: &[("direction", Vec3), ("primitive", U32)],
                need: EARLY_SHADOWS,
            },
        ],
        flag: None,
    },
    Field {
        // The product of f |cos| / pdf so far (0: the path ends), and the density by solid angle with which the
        // extension ray was sampled (0: a discrete direction).
        uses: &[Use {
            name: "throughput",
            components: &[("throughput", Vec3), ("bsdf_pdf", F32)],
            need: ALWAYS,
        }],
        flag: None,
    },
    Field {
        // Radiance gathered so far; the flags are declared in `constants`.
        uses: &[Use {
            name: "radiance",
            components: &[("radiance", Vec3), ("flags", U32)],
            need: ALWAYS,
        }],
        flag: None,
    },
    Field {
        // What of the light that was sampled reaches the camera unless the shadow ray is blocked (then 0), and
        // how far that goes.
        uses: &[Use {
            name: "contribution",
            components: &[("radiance", Vec3), ("distance", F32)],
            need: SHADOW_RAYS,
        }],
        flag: Some("PATH_LIT"),
    },
    Field {
        // The shadow ray's direction if it is cast while extension rays hit something, and the primitive that it
        // starts on.
        uses: &[Use {
            name: "shadow_direction",
            components: &[("direction", Vec3), ("primitive", U32)],
            need: JOINT_SHADOWS,
        }],
        flag: Some("PATH_LIT"),
    },
    Field {
        // Where the shadow ray begins if that may be on another side than where the extension ray does.
        uses: &[Use {
            name: "shadow_origin",
            components: &[("origin", Vec3), ("pixel", U32)],
            need: OWN_SHADOW_ORIGINS,
        }],
        flag: Some("PATH_LIT"),
    },
    Field {
        // The places of its rays in buffers of their own, where their results will be.
        uses: &[Use {
            name: "requests",
            components: &[
                ("extension", U32),
                ("shadow", U32),
                ("unused0", U32),
                ("unused1", U32),
            ],
            need: when(&[Need::Requests]),
        }],
        flag: None,
    },
    Field {
        // The cone that its ray stands for: how wide it is where the ray begins, in metres, and by how
        // much a metre it widens; see docs/filtering.md.
        uses: &[Use {
            name: "cone",
            components: &[
                ("width", F32),
                ("spread", F32),
                ("unused0", U32),
                ("unused1", U32),
            ],
            need: when(&[Need::RayCones]),
        }],
        flag: None,
    },
    Field {
        // The group of the light that was sampled, until what it brings is gathered.
        uses: &[Use {
            name: "light_group",
            components: &[
                ("group", U32),
                ("unused0", U32),
                ("unused1", U32),
                ("unused2", U32),
            ],
            need: when(&[Need::LightGroups, Need::ShadowRays]),
        }],
        flag: Some("PATH_LIT"),
    },
    Field {
        // The media it is in; see `world/media.wgsl`.
        uses: &[Use {
            name: "media",
            components: &[("stack", Words)],
            need: when(&[Need::Media]),
        }],
        flag: None,
    },
    Field {
        // What it meets below the surface that it entered last: the share of light that scattering leaves, and the
        // mean cosine by which it turns.
        uses: &[Use {
            name: "below",
            components: &[("albedo", Vec3), ("anisotropy", F32)],
            need: when(&[Need::Subsurface]),
        }],
        flag: Some("PATH_BELOW"),
    },
    Field {
        // How often it meets something there, and the instance of a material that it entered through.
        uses: &[Use {
            name: "below_rates",
            components: &[("extinction", Vec3), ("instance", U32)],
            need: when(&[Need::Subsurface]),
        }],
        flag: Some("PATH_BELOW"),
    },
    Field {
        // With which probabilities its walk was drawn in each channel as light goes, and the primitive that it
        // entered through.
        uses: &[Use {
            name: "below_plain",
            components: &[("shares", Vec3), ("entered", U32)],
            need: when(&[Need::Subsurface]),
        }],
        flag: Some("PATH_BELOW"),
    },
    Field {
        // The same of walks that are pulled back, and how far the walk has come: 0 before it, see
        // `world/subsurface.wgsl`.
        uses: &[Use {
            name: "below_pulled",
            components: &[("shares", Vec3), ("status", U32)],
            need: when(&[Need::Subsurface]),
        }],
        flag: Some("PATH_BELOW"),
    },
];
