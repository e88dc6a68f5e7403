//! `threshold=N`: what is expensive has a kernel of its own, and what is cheap shares one.

use super::{Number, Request, Rule, StrategyRow};
use crate::cost::Cost;
use crate::partition::{Form, Groups, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow {
    number: Some(Number {
        of: "operations",
        example: 1000.0,
    }),
    ..StrategyRow::new(
        "threshold",
        "materials of N operations and more each have a kernel, the others share one",
        Rule::Costs(groups),
    )
};

impl Strategy {
    /// Materials of at least `operations` on average have their own kernel, the others share a mixed one.
    pub const fn threshold(operations: f64) -> Strategy {
        Strategy::with_number(&ROW, operations)
    }
}

/// Each material of at least so many operations on its own, the others in one mixed kernel. A material of
/// unknown cost counts as cheap.
pub(super) fn groups(request: &Request<'_>, costs: &[Option<Cost>]) -> Groups {
    let mean = |m: &usize| {
        let cost = costs.get(*m).and_then(Option::as_ref);
        cost.map_or(0.0, |cost| cost.operations.mean)
    };
    let all = request.materials.iter().copied();
    let (own, rest): (Vec<usize>, Vec<usize>) = all.partition(|m| mean(m) >= request.number);
    let mut groups: Groups = own.into_iter().map(|m| (Form::Own, vec![m])).collect();
    groups.push((Form::Mixed.with_members(rest.len()), rest));
    groups
}
