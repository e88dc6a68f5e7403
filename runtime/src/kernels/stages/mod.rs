//! The stages of the path tracer, after Laine et al. 2013, section 4.2: what a row of their table says.
//!
//! A stage is one WGSL function that works on one slot of the pool. It reaches path state
//! through accessors and asks for further work through `request_*` functions, so that the
//! same body runs as a kernel of the wavefront or as a step of the megakernel. What follows
//! from the table (which text a kernel is composed of, which queues there are and who fills them, when
//! a kernel runs, and where the megakernel calls it) is derived in `modules`, `wavefront`, `requests` and
//! `queues`. A new stage is one file in `kernels/` and one row in `table`.

mod table;

pub(crate) use table::STAGES;

use crate::wgsl::template::Template;
use crate::world::needs::{Needs, When};

/// A text that stages need beside their own, in the order of a kernel's text.
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
    /// Light that is turned on its way.
    Flights,
    /// Ray casts.
    Traversal,
    /// What rays are ordered by.
    Order,
    /// Generated material code with what it reads.
    Materials,
    /// Whether paths are ended at random.
    Roulette,
    /// What is known of materials without evaluating them.
    Fates,
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
            Part::Flights => "flights through matter",
            Part::Traversal => "ray casts",
            Part::Order => "order of rays",
            Part::Materials => "texture lookups",
            Part::Roulette => "Russian roulette",
            Part::Fates => "knowledge of materials",
            Part::Outputs => "outputs",
        }
    }
}

/// A part of an iteration. Between two of them a prepare kernel turns the lengths of queues into the sizes of
/// dispatches; within one, kernels may run in any order unless a row says `before`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Deciding how each path goes on.
    Logic,
    /// New paths, and materials.
    Materials,
    /// Ray casts.
    Rays,
}

impl Phase {
    /// All, in the order of an iteration, each with the name of the prepare kernel before it.
    pub(crate) const ALL: [(Phase, &'static str); 3] = [
        (Phase::Logic, ""),
        (Phase::Materials, "prepare_materials"),
        (Phase::Rays, "prepare_rays"),
    ];
}

/// What a stage works on, and who asks for it. A request is a call of `request_` and the stage's name.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Work {
    /// Every slot of the pool; in the megakernel once a turn.
    Pool,
    /// Slots that have no path, in a queue; in the megakernel before the first turn. The prepare kernel hands
    /// out work to them.
    Begin {
        /// The stages that ask for it.
        from: &'static [&'static str],
    },
    /// Slots that hit a material: as many queues as the plan's kernels have, or where they were
    /// found if it is evaluated inline; in the megakernel at the end of a turn.
    Material {
        /// The stages that ask for it.
        from: &'static [&'static str],
    },
    /// Entries of a queue; in the megakernel it is called if it was asked for.
    Queue(Request),
    /// The rays in the queue of another stage, which are put in order before that.
    Sort {
        /// That stage.
        of: &'static str,
    },
}

/// The request that fills a queue.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    /// The stages that make it.
    pub from: &'static [&'static str],
    /// The parameters of its function.
    pub parameters: &'static str,
    /// What it leaves in the queue.
    pub entry: Entry,
}

/// What an entry of a queue is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Entry {
    /// The slot that asked.
    Slot,
    /// The slot; or the ray, if rays are in buffers of their own: WGSL of its words, in terms of the parameters.
    Ray([&'static str; 2]),
}

/// Names of uses of state fields, and the condition on which a stage accesses them.
type Uses = &'static [(When, &'static [&'static str])];

/// One stage.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    /// Its name in reports and GPU captures, and of its WGSL function.
    pub name: &'static str,
    /// The file of the WGSL function.
    pub body: Template,
    /// The function's arguments, of `slot`, the `item` of its queue, and an `instance` that was hit.
    pub arguments: &'static str,
    /// When it exists.
    pub need: When,
    /// When in an iteration it runs.
    pub phase: Phase,
    /// What it works on.
    pub work: Work,
    /// Threads of a workgroup that suit its kernel on GPUs; `None` for those that suit most kernels.
    pub workgroup: Option<u32>,
    /// The stages of its phase that it must run before.
    pub before: &'static [&'static str],
    /// If it casts rays, when its threads may stay and take up one ray after another. The body then gives
    /// `NAME_ray`, `is_NAME_decided` and `end_NAME` as well, NAME being the stage's.
    pub casts: Option<When>,
    /// The texts it needs, each with what must exist for it.
    pub parts: &'static [(Part, When)],
    /// The state that it loads.
    pub loads: Uses,
    /// The state that it stores.
    pub stores: Uses,
}

impl Work {
    /// The stages that ask for it.
    pub(crate) fn from(&self) -> &'static [&'static str] {
        match self {
            Work::Begin { from } | Work::Material { from } => from,
            Work::Queue(request) => request.from,
            Work::Pool | Work::Sort { .. } => &[],
        }
    }

    /// Whether it is in queues that requests fill.
    pub(crate) fn is_asked_for(&self) -> bool {
        !matches!(self, Work::Pool | Work::Sort { .. })
    }
}

impl Stage {
    /// Whether it loads a use of the state, if that exists.
    pub(crate) fn loads(&self, name: &str, needs: Needs) -> bool {
        accesses(self.loads, name, needs)
    }

    /// Whether it stores a use of the state, if that exists.
    pub(crate) fn stores(&self, name: &str, needs: Needs) -> bool {
        accesses(self.stores, name, needs)
    }

    /// Whether kernels that run it evaluate materials.
    pub(crate) fn evaluates_materials(&self) -> bool {
        self.has(Part::Materials)
    }

    /// Whether it decides how each path goes on.
    pub(crate) fn decides(&self) -> bool {
        matches!(self.work, Work::Pool)
    }

    /// The texts that it needs in a scene.
    pub(crate) fn parts_in(&self, needs: Needs) -> impl Iterator<Item = Part> {
        let asked = self.parts.iter().filter(move |(_, need)| needs.met(*need));
        asked.map(|(part, _)| *part)
    }

    fn has(&self, part: Part) -> bool {
        self.parts.iter().any(|(p, _)| *p == part)
    }

    /// Its request, if it has a queue of its own.
    pub(crate) fn request(&self) -> Option<&Request> {
        match &self.work {
            Work::Queue(request) => Some(request),
            _ => None,
        }
    }

    /// Whether entries of its queue may be rays.
    pub(crate) fn takes_rays(&self) -> bool {
        let request = self.request();
        request.is_some_and(|request| matches!(request.entry, Entry::Ray(_)))
    }

    /// What a stage that asks for it calls.
    pub(crate) fn call_of_request(&self) -> String {
        format!("request_{}(", self.name)
    }

    /// The call of its function for a slot, the item of its queue and an instance.
    pub(crate) fn call(&self, slot: &str, item: &str, instance: &str) -> String {
        let argument = |name: &str| match name {
            "item" => item.to_string(),
            "instance" => instance.to_string(),
            _ => slot.to_string(),
        };
        let arguments: Vec<String> = self.arguments.split(", ").map(argument).collect();
        format!("{}({})", self.name, arguments.join(", "))
    }
}

fn accesses(uses: Uses, name: &str, needs: Needs) -> bool {
    let mut listed = uses.iter().filter(|(when, _)| needs.met(*when));
    listed.any(|(_, names)| names.contains(&name))
}
