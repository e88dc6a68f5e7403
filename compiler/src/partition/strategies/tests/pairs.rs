//! `pairs`: every two materials share a binned kernel.

use crate::partition::strategies::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups};

pub(super) const ROW: StrategyRow = StrategyRow::new(
    "pairs",
    "a binned kernel for every two materials",
    Rule::Names(groups),
);

fn groups(request: &Request<'_>) -> Groups {
    let pairs = request.materials.chunks(2);
    let kernel = |pair: &[usize]| (Form::Binned.with_members(pair.len()), pair.to_vec());
    pairs.map(kernel).collect()
}
