//! What an estimate does not know: sentences about the case at hand, the largest doubt first.

use super::super::error::list;
use super::Subject;
use crate::cost::Cost;

/// The sentences.
pub(super) fn sentences(subject: &Subject) -> Vec<String> {
    let all = [
        profile(subject),
        fit(subject),
        hits(subject),
        loops(subject),
        textures(subject),
        costs(subject),
        Some("registers are counted as numbers that are alive at once, not as the driver allocates them".into()),
    ];
    all.into_iter().flatten().collect()
}

fn profile(subject: &Subject) -> Option<String> {
    (!subject.exact).then(|| {
        let device = &subject.model.profile.device;
        format!("what {device} takes: the constants are scaled from another's; `impasto calibrate` measures them")
    })
}

fn fit(subject: &Subject) -> Option<String> {
    let fit = &subject.model.profile.fit;
    Some(match fit.points {
        0 => "how well the profile's constants fit: they are estimates, not measurements".into(),
        points => format!(
            "what misses the model: kernels it was fitted to are off by {:.0} % in the median, others by {:.0} % \
             ({points} measured)",
            100.0 * fit.median_error,
            100.0 * fit.held_out_error
        ),
    })
}

fn hits(subject: &Subject) -> Option<String> {
    let pool = subject.model.workload.pool;
    Some(format!(
        "hits of other views and other pools: shares are means over iterations of this view with {} paths in \
         flight",
        super::text::grouped(pool.into())
    ))
}

fn loops(subject: &Subject) -> Option<String> {
    let turning =
        |cost: &Cost| cost.loops > 0 && cost.operations.max as f64 > 1.5 * cost.operations.mean;
    let found = named(subject, turning);
    let points = subject
        .model
        .costs
        .iter()
        .flatten()
        .map(|c| c.operations.evaluations);
    let points = points.max().unwrap_or(0);
    (!found.is_empty()).then(|| {
        let names = list(found.iter().copied());
        format!("how often loops and branches of {names} run here: counted at {points} points of their surfaces")
    })
}

fn textures(subject: &Subject) -> Option<String> {
    let found = named(subject, |cost| cost.operations.classes.texture > 0.0);
    (!found.is_empty()).then(|| {
        let names = list(found.iter().copied());
        format!("how caches serve the textures of {names}: each lookup counts the same")
    })
}

fn costs(subject: &Subject) -> Option<String> {
    let unused = &subject.plan.unused;
    let lacking = (0..subject.names.len()).filter(|m| !unused.contains(m));
    let lacking = lacking.filter(|m| subject.model.costs.get(*m).is_none_or(Option::is_none));
    let lacking: Vec<&str> = lacking.map(|m| subject.names[m].as_str()).collect();
    (!lacking.is_empty()).then(|| format!("what {} cost: they count as nothing", list(lacking)))
}

/// Materials with kernels whose cost is such.
fn named<'a>(subject: &Subject<'a>, such: impl Fn(&Cost) -> bool) -> Vec<&'a str> {
    let placed = (0..subject.names.len()).filter(|m| !subject.plan.unused.contains(m));
    let of = |m: &usize| {
        subject
            .model
            .costs
            .get(*m)
            .and_then(Option::as_ref)
            .is_some_and(&such)
    };
    placed
        .filter(of)
        .map(|m| subject.names[m].as_str())
        .collect()
}
