//! Ways to do the same work: what a researcher wants to compare and a user can leave alone.
//!
//! Every value of every choice gives the same picture, but for noise where the sampler changes.
//! A choice is declared here once; the command line, the report and the experiments read its
//! names from `ALL`.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A choice between techniques, each with a name on the command line.
pub trait Choice: Copy + PartialEq + 'static {
    /// Every value with its name and what it means; the default is first.
    const ALL: &'static [(Self, &'static str, &'static str)];

    /// The value's name.
    fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(value, ..)| *value == self);
        found.map_or("", |(_, name, _)| name)
    }

    /// The value called `name`.
    fn from_name(name: &str) -> Option<Self> {
        let found = Self::ALL.iter().find(|(_, n, _)| *n == name);
        found.map(|(value, ..)| *value)
    }
}

/// Declares enums that are choices: the first value is the default, doc comments are the help.
macro_rules! choices {
    ($($(#[doc = $about:literal])+ $choice:ident {
        $(#[doc = $what:literal] $value:ident = $name:literal,)+
    })+) => { $(
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $choice {
            $(#[doc = $what] $value,)+
        }

        impl Choice for $choice {
            const ALL: &'static [(Self, &'static str, &'static str)] =
                &[$(($choice::$value, $name, $what)),+];
        }

        impl Default for $choice {
            fn default() -> Self {
                Self::ALL[0].0
            }
        }

        impl Serialize for $choice {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_str(self.name())
            }
        }

        impl<'de> Deserialize<'de> for $choice {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let name = String::deserialize(from)?;
                let expected = || Self::ALL.iter().map(|(_, name, _)| *name).collect::<Vec<_>>().join(", ");
                Self::from_name(&name).ok_or_else(|| {
                    D::Error::custom(format!("`{name}` is none of {}", expected()))
                })
            }
        }
    )+ };
}

choices! {
    /// Where random numbers come from.
    Sampler {
        /// Sobol points with a random mask per pixel for 32 dimensions, then hashes (Laine et al. 2013)
        Sobol = "sobol",
        /// Sobol points, Owen-scrambled and shuffled anew for every pixel and draw (Burley 2020)
        Owen = "owen",
        /// Hashes of pixel, sample and dimension: independent numbers
        Independent = "independent",
    }

    /// How kernels append to queues (Laine et al. 2013, section 4.4).
    Append {
        /// One atomic operation per workgroup and queue
        Workgroup = "workgroup",
        /// One atomic operation per subgroup and queue
        Subgroup = "subgroup",
        /// One atomic operation per thread
        Thread = "thread",
    }

    /// How path state lies in memory (Laine et al. 2013, section 4.3).
    StateLayout {
        /// A structure of arrays: neighbours read neighbouring words
        Arrays = "soa",
        /// A structure of arrays of two fields each, as many as a sector of the cache holds
        Pairs = "pairs",
        /// An array of structures: a path's words lie together
        Structures = "aos",
    }

    /// Whether paths move to other slots of the pool.
    SlotOrder {
        /// As in `work` where a plan has several materials, else as in `fixed`
        Auto = "auto",
        /// The logic kernel puts the paths of a workgroup in the order of the queues that they go to
        Work = "work",
        /// A path keeps its slot
        Fixed = "fixed",
    }

    /// When threads of a megakernel whose path has ended begin another (Laine et al. 2013,
    /// section 4.1).
    Regeneration {
        /// Never: a thread traces one path
        Never = "never",
        /// When over half of a subgroup idles
        Half = "half",
        /// As soon as a thread idles
        Always = "always",
    }

    /// The acceleration structure that rays are cast through.
    Traversal {
        /// An eight-wide BVH with compressed nodes (Ylitie et al. 2017)
        Cwbvh = "cwbvh",
        /// A binary BVH with the boxes of children in their parent (Aila and Laine 2009)
        Bvh2 = "bvh2",
    }

    /// In how many leaves of an acceleration structure a triangle lies.
    Tree {
        /// Large ones in several where that makes the tree cheaper to cast rays through, else each in one
        Auto = "auto",
        /// Each in one
        Whole = "whole",
        /// Large ones in several: boxes of their pieces are smaller than one around all of it
        Split = "split",
    }

    /// Where a ray cast keeps the nodes it has yet to visit.
    Stack {
        /// An array of the thread's own
        Private = "private",
        /// The first entries in workgroup memory (Ylitie et al. 2017)
        Workgroup = "workgroup",
        /// Some bits per level in registers, and pointers to parents (Laine 2010)
        Trail = "trail",
    }

    /// When threads that fetch rays test triangles.
    Leaves {
        /// When enough threads of a subgroup have one to test (Ylitie et al. 2017)
        Together = "together",
        /// Right after the node that they are in
        AtOnce = "at-once",
    }

    /// How threads get the rays of a queue.
    RayFetch {
        /// Threads stay and take new rays when many of a subgroup have none (Aila and Laine 2009)
        Persistent = "persistent",
        /// One ray per thread
        Thread = "thread",
    }

    /// Which kernels cast rays, where threads take one after another.
    RayKernels {
        /// As in `one` where few paths are in flight, else as in `each`
        Auto = "auto",
        /// One for all: while the last of one kind are under way, other threads have rays of the next
        One = "one",
        /// One for each kind of ray
        Each = "each",
    }

    /// Where rays of the camera are cast.
    CameraRays {
        /// As in `straight`, on the processor as in `at-once`
        Auto = "auto",
        /// By the kernel that begins a path, and a path that hits nothing ends there
        AtOnce = "at-once",
        /// The same, and what they hit goes straight to its material, in the same iteration
        Straight = "straight",
        /// With those of later segments
        Queue = "queue",
    }

    /// Which rays are cast of those that end a path.
    LastRays {
        /// Those that may meet a light, where all lights are small; else all
        Lights = "lights",
        /// Every one of them
        All = "all",
    }

    /// How geometry is stored that is repeated often enough to share it.
    Copies {
        /// Once, and placed by a second level of the acceleration structure
        Shared = "shared",
        /// As often as it is placed
        Flat = "flat",
    }

    /// Where ray casts find rays, and leave what they hit.
    RayData {
        /// In the path's state
        Slots = "slots",
        /// In buffers of their own, in the order of requests (Laine et al. 2013, section 4.2)
        Requests = "requests",
    }

    /// What kernels can do that the scene may not ask for.
    Features {
        /// What the scene needs, and nothing else
        Scene = "scene",
        /// Every feature that can be on: the same picture, to measure what leaving features out saves
        All = "all",
    }

    /// In which order rays are cast.
    RayOrder {
        /// As they were asked for
        Queue = "queue",
        /// Sorted by origin (512 cells of the scene) and by the octant of the direction
        Coarse = "coarse",
        /// The same with 32,768 cells
        Fine = "fine",
    }
}

/// A value of every choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Technique {
    /// Whether kernels count the lanes at work, which makes them much slower.
    pub profile: bool,
    /// Threads of a workgroup; chosen by the kind of plan and GPU if `None`.
    pub workgroup: Option<u32>,
    /// Threads of kernels that fetch one item after another; as many as fill the GPU if `None`.
    /// There are more if else each had to fetch very many.
    pub threads: Option<u32>,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// How kernels append to queues.
    pub append: Append,
    /// How path state lies in memory.
    pub state: StateLayout,
    /// Whether paths move to other slots.
    pub slot_order: SlotOrder,
    /// When threads of a megakernel begin another path.
    pub regeneration: Regeneration,
    /// What rays are cast through.
    pub traversal: Traversal,
    /// In how many leaves a triangle lies.
    pub tree: Tree,
    /// Where casts keep the nodes they have yet to visit.
    pub stack: Stack,
    /// When threads that fetch rays test triangles; others do it at once.
    pub leaves: Leaves,
    /// How threads get the rays of a queue; in a megakernel each has its own.
    pub ray_fetch: RayFetch,
    /// Which kernels cast rays whose threads take one after another.
    pub ray_kernels: RayKernels,
    /// Where rays of the camera are cast; in a megakernel each thread casts its own.
    pub camera_rays: CameraRays,
    /// Which rays are cast of those that end a path.
    pub last_rays: LastRays,
    /// How repeated geometry is stored.
    pub copies: Copies,
    /// Where ray casts find rays.
    pub ray_data: RayData,
    /// In which order rays are cast.
    pub ray_order: RayOrder,
    /// What kernels can do beside what the scene asks for.
    pub features: Features,
}

impl Technique {
    /// The technique that a GPU can run: what needs subgroups is replaced by the next best where it has
    /// none. Reports say what ran.
    pub(crate) fn within(self, has_subgroups: bool) -> Self {
        if has_subgroups {
            return self;
        }
        Self {
            append: match self.append {
                Append::Subgroup => Append::Workgroup,
                other => other,
            },
            regeneration: Regeneration::Never,
            ray_fetch: RayFetch::Thread,
            profile: false,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_names<C: Choice + Default + std::fmt::Debug>() {
        assert_eq!(C::default(), C::ALL[0].0);
        for (value, name, what) in C::ALL {
            assert_eq!(C::from_name(name), Some(*value));
            assert_eq!(value.name(), *name);
            assert!(what.starts_with(' ') && what.len() > 10, "{name}: {what}");
        }
        assert_eq!(C::from_name("no such technique"), None);
    }

    #[test]
    fn every_value_is_found_by_its_name() {
        check_names::<Sampler>();
        check_names::<Append>();
        check_names::<StateLayout>();
        check_names::<SlotOrder>();
        check_names::<Regeneration>();
        check_names::<Traversal>();
        check_names::<Tree>();
        check_names::<Stack>();
        check_names::<Leaves>();
        check_names::<RayFetch>();
        check_names::<RayKernels>();
        check_names::<CameraRays>();
        check_names::<LastRays>();
        check_names::<Copies>();
        check_names::<RayData>();
        check_names::<RayOrder>();
        check_names::<Features>();
    }
}
