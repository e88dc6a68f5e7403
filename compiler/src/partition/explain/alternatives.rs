//! Other ways for one kernel of a plan: another form, merged with another kernel, inline, divided, or
//! less one of its materials. Each changes as little of the plan as it can.

use serde::Serialize;

use super::Subject;
use crate::partition::search::ordered;
use crate::partition::text::{STRATEGY, print};
use crate::partition::{Form, Groups, Plan, Prediction};

/// A plan that differs in what becomes of one kernel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Alternative {
    /// What is otherwise, such as ``merged with `material_wood` as binned``.
    pub what: String,
    /// The plan that this makes, as a partition string.
    pub partition: String,
    /// By how much the whole takes longer, in seconds; below zero if this would be faster.
    pub more: f64,
    /// The part of the prediction that decides: the one that grows most, or that shrinks most where this
    /// would be faster.
    pub part: &'static str,
    /// By how much that part grows, in seconds.
    pub part_more: f64,
    /// Why it does.
    pub why: String,
}

/// Kernels in place of others.
struct Change {
    what: String,
    /// Indices of the kernels that go.
    old: Vec<usize>,
    new: Groups,
}

/// Kernels whose materials may move to any other kernel; of more, every pair would be too many.
const FEW: usize = 8;

/// The best way for kernel `k` of `groups` other than the one it has.
pub(super) fn best(subject: &Subject, groups: &Groups, k: usize) -> Option<Alternative> {
    let judged = changes(subject, groups, k).into_iter().map(|change| {
        let sum = |groups: &mut dyn Iterator<Item = &(Form, Vec<usize>)>| {
            groups
                .map(|(form, m)| subject.model.predict(*form, m))
                .fold(Prediction::default(), add)
        };
        let before = sum(&mut change.old.iter().map(|g| &groups[*g]));
        let after = sum(&mut change.new.iter());
        (after.total - before.total, before, after, change)
    });
    let least = judged.min_by(|a, b| a.0.total_cmp(&b.0));
    least.map(|(more, before, after, change)| {
        let (part, part_more) = deciding(&before, &after, more);
        Alternative {
            more,
            part,
            part_more,
            why: why(subject, part, part_more, groups, &change),
            partition: partition(subject, groups, &change),
            what: change.what,
        }
    })
}

/// The whole plan after a change.
fn partition(subject: &Subject, groups: &Groups, change: &Change) -> String {
    let kept = groups
        .iter()
        .enumerate()
        .filter(|(g, _)| !change.old.contains(g));
    let kept = kept.map(|(_, group)| group.clone());
    let all = ordered(kept.chain(change.new.iter().cloned()).collect());
    let plan = Plan::wavefront(STRATEGY, all, subject.plan.unused.clone(), subject.names);
    print(&plan, subject.names)
}

/// Everything that can be done with kernel `k`.
fn changes(subject: &Subject, groups: &Groups, k: usize) -> Vec<Change> {
    let (form, members) = &groups[k];
    let inline = groups.iter().position(|(form, _)| *form == Form::Inline);
    let mut changes = Vec::new();
    let mut offer = |what: String, old: &[usize], new: Groups| {
        let old = old.to_vec();
        changes.push(Change { what, old, new });
    };
    for other in Form::queued_of_members(members.len()).filter(|other| other != form) {
        offer(
            format!("as {}", other.name()),
            &[k],
            vec![(other, members.clone())],
        );
    }
    if members.len() > 1 {
        let each = members.iter().map(|m| (Form::Own, vec![*m])).collect();
        offer("a kernel for each member".into(), &[k], each);
    }
    if inline.is_none() {
        offer("inline".into(), &[k], vec![(Form::Inline, members.clone())]);
    }
    for (j, (with, theirs)) in groups.iter().enumerate().filter(|(j, _)| *j != k) {
        let name = &subject.plan.kernels[j].name;
        let all = union(members, theirs);
        if [form, with].contains(&&Form::Inline) {
            let what = match form {
                Form::Inline => format!("`{name}` inline as well"),
                _ => "inline".to_owned(),
            };
            offer(what, &[k, j], vec![(Form::Inline, all)]);
            continue;
        }
        for form in Form::queued_of_members(all.len()) {
            let what = format!("merged with `{name}` as {}", form.name());
            offer(what, &[k, j], vec![(form, all.clone())]);
        }
    }
    if members.len() > 1 {
        for m in members {
            without(subject, groups, k, *m, &mut offer);
        }
    }
    changes
}

/// What can be done with member `m` of kernel `k`, which has others.
fn without(
    subject: &Subject,
    groups: &Groups,
    k: usize,
    m: usize,
    offer: &mut impl FnMut(String, &[usize], Groups),
) {
    let (form, members) = &groups[k];
    let name = &subject.names[m];
    let rest: Vec<usize> = members
        .iter()
        .copied()
        .filter(|other| *other != m)
        .collect();
    let rest = (form.with_members(rest.len()), rest);
    let alone = format!("`{name}` in a kernel of its own");
    offer(alone, &[k], vec![rest.clone(), (Form::Own, vec![m])]);
    if groups.iter().all(|(form, _)| *form != Form::Inline) {
        let inline = (Form::Inline, vec![m]);
        offer(format!("`{name}` inline"), &[k], vec![rest.clone(), inline]);
    }
    if groups.len() > FEW {
        return;
    }
    for (j, (with, theirs)) in groups.iter().enumerate().filter(|(j, _)| *j != k) {
        let all = union(&[m], theirs);
        let what = match with {
            Form::Inline => format!("`{name}` inline"),
            _ => format!("`{name}` in `{}`", subject.plan.kernels[j].name),
        };
        let forms: Vec<Form> = if with.takes_several() {
            vec![*with]
        } else {
            Form::queued_of_members(all.len()).collect()
        };
        for form in forms {
            offer(
                what.clone(),
                &[k, j],
                vec![rest.clone(), (form, all.clone())],
            );
        }
    }
}

fn union(a: &[usize], b: &[usize]) -> Vec<usize> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all
}

fn add(a: Prediction, b: Prediction) -> Prediction {
    Prediction {
        launch: a.launch + b.launch,
        latency: a.latency + b.latency,
        issue: a.issue + b.issue,
        memory: a.memory + b.memory,
        logic: a.logic + b.logic,
        total: a.total + b.total,
    }
}

/// The part that changes most in the direction of the whole, and by how much.
fn deciding(before: &Prediction, after: &Prediction, more: f64) -> (&'static str, f64) {
    let parts = |p: &Prediction| {
        [
            ("launch", p.launch),
            ("latency", p.latency),
            ("issue", p.issue),
            ("memory", p.memory),
            ("logic", p.logic),
        ]
    };
    let grown = parts(after).into_iter().zip(parts(before));
    let grown = grown.map(|((name, a), (_, b))| (name, a - b));
    let most = grown.max_by(|a, b| (a.1 * more.signum()).total_cmp(&(b.1 * more.signum())));
    most.unwrap_or(("issue", 0.0))
}

/// Why a part grows or shrinks, in words.
fn why(subject: &Subject, part: &str, more: f64, groups: &Groups, change: &Change) -> String {
    let before = subject.lanes(change.old.iter().map(|g| &groups[*g]));
    let after = subject.lanes(change.new.iter());
    let width = subject.model.profile.subgroup;
    let kernels = |count: usize, inline: bool| count - usize::from(inline);
    let new = kernels(
        change.new.len(),
        change.new.iter().any(|g| g.0 == Form::Inline),
    );
    let old = change
        .old
        .iter()
        .filter(|g| groups[**g].0 != Form::Inline)
        .count();
    match (part, more >= 0.0) {
        ("issue", true) if after < 0.97 * before => format!(
            "subgroups evaluate with {after:.1} of {width} lanes, not {before:.1}: neighbours take turns"
        ),
        ("issue", true) => "together their code crowds the caches of instructions".into(),
        ("issue", false) if after > 1.03 * before => {
            format!("subgroups evaluate with {after:.1} of {width} lanes, not {before:.1}")
        }
        ("issue", false) => "less code crowds the caches of instructions".into(),
        ("launch", true) if new > old => match new - old {
            1 => "one more kernel waits for its last subgroup".into(),
            more => format!("{more} more kernels wait for their last subgroups"),
        },
        ("launch", false) if new < old => match old - new {
            1 => "one kernel less waits for its last subgroup".into(),
            less => format!("{less} kernels less wait for their last subgroups"),
        },
        ("launch", _) => "a dispatch more or less".into(),
        ("latency", true) => "the longest subgroup takes longer by itself".into(),
        ("latency", false) => "the longest subgroup is shorter".into(),
        ("logic", true) => {
            "the logic kernel takes their registers, and so runs fewer threads".into()
        }
        ("logic", false) => "the logic kernel has registers to spare".into(),
        ("memory", true) if new > old => "path state is read once more".into(),
        ("memory", true) => "path state that lies apart shares no reads".into(),
        ("memory", false) => "path state is at hand or lies closer".into(),
        _ => "of all parts a little".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::cases::Case;
    use super::*;

    #[test]
    fn reasons_follow_what_changes() {
        let mut case = Case::new(3, 1);
        for hits in &mut case.workload.materials {
            (hits.share, hits.present) = (0.5, 1.0 - 0.5f64.powi(32));
        }
        (
            case.workload.materials[2].share,
            case.workload.materials[2].present,
        ) = (0.0, 0.0);
        let names: Vec<String> = (0..3).map(|m| format!("m{m}")).collect();
        let groups: Groups = vec![(Form::Binned, vec![0, 1]), (Form::Own, vec![2])];
        let plan = Plan::wavefront("test", groups.clone(), Vec::new(), &names);
        let subject = Subject {
            plan: &plan,
            names: &names,
            model: case.model(),
            exact: true,
        };
        let said = |part: &str, more: f64, old: &[usize], new: Groups| {
            let (what, old) = (String::new(), old.to_vec());
            why(&subject, part, more, &groups, &Change { what, old, new })
        };
        let mixed = || vec![(Form::Mixed, vec![0, 1])];
        let each = || vec![(Form::Own, vec![0]), (Form::Own, vec![1])];
        assert!(said("issue", 1.0, &[0], mixed()).contains("with 16.0 of 32 lanes, not 32.0"));
        assert!(said("issue", 1.0, &[0], each()).contains("crowds"));
        assert!(said("launch", 1.0, &[0], each()).contains("one more kernel"));
        let all = || vec![(Form::Binned, vec![0, 1, 2])];
        assert!(said("launch", -1.0, &[0, 1], all()).contains("one kernel less"));
        let inline = || vec![(Form::Inline, vec![0, 1])];
        assert!(said("memory", -1.0, &[0], inline()).contains("at hand"));
        assert!(said("logic", 1.0, &[0], inline()).contains("registers"));
    }
}
