//! Which functions of a kernel are compiled on their own, and which where they are called.
//!
//! Values in a function are registers, and what is passed by memory costs loads and stores; but a function
//! called from many places would be compiled as often. Functions that take pointers are always part of their
//! callers, whose variables then are registers as well.

use crate::code::{Block, Code, First, Function, Ins, Node, Pointer};

/// Instructions of a function that is always part of its callers.
const SMALL: usize = 60;
/// The same of one that is called from one place.
const LONE: usize = 1200;

/// What is known of the functions of a kernel, by their index.
#[derive(Debug)]
pub(crate) struct Plan {
    /// Whether a function is compiled where it is called.
    pub inline: Vec<bool>,
    /// Whether it indexes what its arguments point to.
    pub indexes_arguments: Vec<bool>,
    /// About how many operations it is.
    pub sizes: Vec<usize>,
}

impl Plan {
    pub(crate) fn new(code: &Code) -> Self {
        let count = code.functions.len();
        let mut sites = vec![0usize; count];
        let all = code.functions.iter().flatten().chain([&code.main]);
        for function in all {
            walk(&function.body, &mut |node| {
                if let Node::Call { function, .. } = node {
                    sites[*function as usize] += 1;
                }
            });
        }
        let mut plan = Self {
            inline: vec![false; count],
            indexes_arguments: vec![false; count],
            sizes: vec![0; count],
        };
        // Callees come before their callers.
        for (index, function) in code.functions.iter().enumerate() {
            let Some(function) = function else { continue };
            let (mut size, mut pointers) = (0, false);
            let mut indexes = false;
            walk(&function.body, &mut |node| match node {
                Node::Ins(ins) => {
                    size += weight(ins);
                    indexes |= matches!(
                        ins,
                        Ins::Index {
                            first: First::Slot(_),
                            ..
                        }
                    );
                    pointers |= takes_pointers(ins, function.arguments);
                }
                Node::Call { function, .. } => {
                    let callee = *function as usize;
                    size += 4;
                    if plan.inline[callee] {
                        size += plan.sizes[callee];
                        indexes |= plan.indexes_arguments[callee];
                    }
                }
                _ => size += 1,
            });
            plan.sizes[index] = size;
            plan.indexes_arguments[index] = indexes;
            plan.inline[index] = !function.answered
                && (pointers || size <= SMALL || sites[index] == 1 && size <= LONE);
        }
        plan
    }
}

/// About how many operations an instruction is.
pub(crate) fn weight(ins: &Ins) -> usize {
    match ins {
        Ins::Copy { .. } | Ins::Address { .. } => 0,
        Ins::Map1 { count, .. } | Ins::Map2 { count, .. } | Ins::Map3 { count, .. } => {
            *count as usize
        }
        Ins::Vectors { width, .. } => 2 * (*width as usize & 15),
        Ins::Element { count, .. } | Ins::Load { count, .. } | Ins::Store { count, .. } => {
            1 + *count as usize
        }
        Ins::Index { .. } | Ins::Atomic { .. } | Ins::Length { .. } => 2,
    }
}

/// Whether an instruction uses one of the first cells as a pointer.
fn takes_pointers(ins: &Ins, arguments: u32) -> bool {
    let of = |pointer: &Pointer| matches!(pointer, Pointer::Cell { slot, .. } if *slot < arguments);
    match ins {
        Ins::Load { pointer, .. }
        | Ins::Store { pointer, .. }
        | Ins::Address { pointer, .. }
        | Ins::Atomic { pointer, .. } => of(pointer),
        _ => false,
    }
}

/// Visits every node of a block and of the blocks within.
pub(crate) fn walk<'a>(block: &'a Block, visit: &mut impl FnMut(&'a Node)) {
    for node in block {
        visit(node);
        match node {
            Node::If { accept, reject, .. } => {
                walk(accept, visit);
                walk(reject, visit);
            }
            Node::Switch { cases, .. } => cases.iter().for_each(|case| walk(&case.body, visit)),
            Node::Loop {
                body, continuing, ..
            } => {
                walk(body, visit);
                walk(continuing, visit);
            }
            Node::Block(inner) => walk(inner, visit),
            _ => {}
        }
    }
}

/// By variable of a function: whether it must lie in memory, because it is indexed by what is known only
/// when running.
pub(crate) fn in_memory(function: &Function, plan: &Plan) -> Vec<bool> {
    let mut found = vec![false; function.variables.len()];
    let mut mark = |cell: u32| {
        let within = |(first, cells): &(u32, u32)| (*first..first + cells).contains(&cell);
        if let Some(at) = function.variables.iter().position(within) {
            found[at] = true;
        }
    };
    let mut addresses: Vec<(u32, u32)> = Vec::new();
    walk(&function.body, &mut |node| match node {
        Node::Ins(Ins::Index {
            first: First::Frame(cell),
            ..
        }) => mark(*cell),
        Node::Ins(Ins::Address {
            pointer: Pointer::Frame(cell),
            to,
        }) => addresses.push((*to, *cell)),
        Node::Call {
            function: callee,
            arguments,
            ..
        } if plan.indexes_arguments[*callee as usize] || !plan.inline[*callee as usize] => {
            for (slot, _) in arguments {
                let passed = addresses.iter().filter(|(to, _)| to == slot);
                passed.for_each(|(_, cell)| mark(*cell));
            }
        }
        _ => {}
    });
    found
}
