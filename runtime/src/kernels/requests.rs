//! Requests: the functions by which stages ask for further work, and what becomes of it. In the wavefront the
//! kernel around a stage appends the slot to queues; in the megakernel a thread remembers what to do next.
//!
//! The files of WGSL say it once for all requests, by sets of them (`#each`).

use std::ops::Range;

use crate::kernels::modules::Composer;
use crate::kernels::shells::SUBGROUP;
use crate::kernels::stages::{Entry, Phase, Request, Stage, Work};
use crate::technique::Append;
use crate::wgsl;
use crate::wgsl::template::{Set, Template, Words, template};
use crate::world::needs::Need;

/// What a kernel of the wavefront appends to queues.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pushes {
    /// Whether it chooses what a slot does next: a new path or a material.
    pub sorts: bool,
    /// The stages with queues of their own that it asks for.
    pub asked: Vec<&'static Stage>,
    /// The queues among which those are.
    pub queues: Range<usize>,
}

impl Pushes {
    pub(crate) fn is_empty(&self) -> bool {
        !self.sorts && self.asked.is_empty()
    }

    /// Whether rays are among it.
    pub(crate) fn has_rays(&self) -> bool {
        self.asked.iter().any(|stage| stage.takes_rays())
    }
}

impl Composer<'_> {
    /// What a kernel pushes that runs some stages, for `members` where those evaluate materials.
    pub(crate) fn pushes(&self, stages: &[&'static Stage], members: &[usize]) -> Pushes {
        // The table lists who may ask for work; whether it does in this scene, the conditions of its text say.
        let bodies: Vec<_> = stages.iter().map(|s| (s, self.body(s, members))).collect();
        let asks = |by: &Stage, body: &str, target: &Stage| {
            let from = target.work.from();
            from.contains(&by.name)
                && self.needs_in(by, members).met(target.need)
                && body.contains(&target.call_of_request())
        };
        let rows = self.layout.stages().iter();
        let targets = rows.filter(|target| bodies.iter().any(|(by, body)| asks(by, body, target)));
        let targets: Vec<&'static Stage> = targets.collect();
        let queues = self.layout.queues;
        let ranges = targets.iter().map(|target| queues.of_phase(target.phase));
        let queues = ranges.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        let own = |stage: &&'static Stage| stage.request().is_some();
        let mut asked: Vec<_> = targets.iter().copied().filter(own).collect();
        asked.sort_by_key(|stage| self.layout.queues.of(stage.name).start);
        Pushes {
            sorts: targets.iter().any(|target| !own(target)),
            asked,
            queues: queues.unwrap_or_default(),
        }
    }

    /// The functions by which the stages of a kernel ask for work, and how they append to queues.
    pub(crate) fn push_text(&self, pushes: &Pushes) -> String {
        let requests = self.layout.needs.has(Need::Requests);
        let subgroups = self.technique.append == Append::Subgroup;
        let flags = [
            ("sorts", pushes.sorts),
            ("requests", requests),
            ("keeps", requests && pushes.has_rays()),
            ("subgroups", subgroups),
        ];
        let sets = self.pushed(pushes, requests);
        let text = |template: Template| template.with_sets(&flags, &sets);
        let one_by_one = || text(template!("append/one_by_one.wgsl"));
        let append = match self.technique.append {
            Append::Workgroup => text(template!("append/workgroup.wgsl")),
            Append::Subgroup => one_by_one() + include_str!("append/subgroup.wgsl") + SUBGROUP,
            Append::Thread => one_by_one() + include_str!("append/thread.wgsl"),
        };
        let Range { start, end } = pushes.queues;
        wgsl::constants_u32(&[
            ("FIRST_PUSHED", start as u32),
            ("PUSHED_QUEUES", (end - start) as u32),
        ]) + &text(template!("queue.wgsl"))
            + &append
    }

    /// The sets of what a kernel pushes: stages that it asks for, with the choice of a slot's next work; those
    /// whose rays it keeps in buffers of their own, in one set whether any is wanted; and all that have rays.
    fn pushed(&self, pushes: &Pushes, in_buffers: bool) -> [Set; 5] {
        let of = |stage: &&'static Stage| words(stage, in_buffers);
        let kept = pushes.asked.iter().filter(|s| in_buffers && s.takes_rays());
        let wanted: Vec<String> = kept.clone().map(|stage| wanted(stage)).collect();
        let asked: Vec<Words> = pushes.asked.iter().map(of).collect();
        let work = pushes.sorts.then(work).into_iter();
        [
            ("wishes", work.chain(asked.clone()).collect()),
            ("asked", asked),
            ("kept", kept.map(of).collect()),
            ("any_kept", vec![vec![("wanted", wanted.join(" || "))]]),
            ("rays", self.rays().map(|s| words(s, in_buffers)).collect()),
        ]
    }

    /// WGSL of the places of a thread's rays in their queues, as arguments.
    pub(crate) fn ray_places(&self) -> String {
        let places = self.rays().map(|stage| format!("{}_place", stage.name));
        places.collect::<Vec<_>>().join(", ")
    }

    /// The stages with queues of rays, in the order of queues.
    fn rays(&self) -> impl Iterator<Item = &'static Stage> {
        self.layout.queues.order().filter(|s| s.takes_rays())
    }

    /// The sets of the megakernel's text: its requests, and the calls of stages in a turn of its loop. Those
    /// come first that were asked for in the last, then what runs each turn, then what that asked for.
    pub(crate) fn turn_sets(&self) -> [Set; 5] {
        let some = |some: &dyn Fn(&Stage) -> bool| -> Vec<Words> {
            let stages = self.stages().filter(|s| some(s));
            stages.map(|s| words(s, false)).collect()
        };
        let asked = |s: &Stage| s.request().is_some();
        let beside = |s: &Stage| asked(s) && s.phase == Phase::Materials;
        [
            ("sure", some(&|s| asked(s) && s.need.is_always())),
            ("possible", some(&|s| asked(s) && !s.need.is_always())),
            ("before", some(&|s| asked(s) && !beside(s))),
            ("each_turn", some(&|s| matches!(s.work, Work::Pool))),
            ("beside", some(&beside)),
        ]
    }
}

/// What texts say of the request for a stage.
fn words(stage: &Stage, in_buffers: bool) -> Words {
    let upper = stage.name.to_uppercase();
    vec![
        ("name", stage.name.to_string()),
        ("wanted", wanted(stage)),
        ("queue", format!("QUEUE_{upper}")),
        ("call", stage.call("item", "item", "wanted_instance")),
        (
            "variable",
            format!("var<private> {}: bool = false;", wanted(stage)),
        ),
        ("request", request_text(stage, in_buffers)),
    ]
}

/// The same of the choice between a new path and a material.
fn work() -> Words {
    vec![
        ("name", "work".into()),
        ("wanted", "wanted_work != NOTHING".into()),
        ("queue", "wanted_work".into()),
    ]
}

/// The variable that says whether a stage was asked for.
fn wanted(stage: &Stage) -> String {
    format!("wants_{}", stage.name)
}

/// The function by which a stage is asked for, with the words of the ray that it keeps if rays are in buffers
/// of their own.
fn request_text(stage: &Stage, in_buffers: bool) -> String {
    let Some(Request {
        parameters, entry, ..
    }) = stage.request()
    else {
        return String::new();
    };
    let name = stage.name;
    let mut ray = String::new();
    let mut body = format!("    wants_{name} = true;\n");
    if let (Entry::Ray(words), true) = (entry, in_buffers) {
        ray = format!(
            "var<private> {name}_ray: array<vec4<u32>, {}>;\n",
            words.len()
        );
        for (at, word) in words.iter().enumerate() {
            body += &format!("    {name}_ray[{at}] = {word};\n");
        }
    }
    format!("{ray}fn request_{name}({parameters}) {{\n{body}}}")
}
