//! Many materials: those whose code is equal but for constants become instances of one.
//!
//! Every material takes its share of passes, of WGSL and of a driver's time for compiling kernels. Few
//! get code of their own, in which constants are worth that. If there are many, a constant in which
//! materials differ becomes a parameter of the first of them, and what is one code is compiled once.

use std::collections::BTreeMap;

use super::{Setting, constants};
use crate::diag::{Code, Diagnostic};
use crate::ir::{Closure, Const, ExprKind, Lobe, Material};

/// A material that requests ask for, with the settings they ask for it in.
pub(crate) struct Requested {
    pub(crate) material: Material,
    /// Does it stay a material of its own?
    pub(crate) apart: bool,
    /// Settings with their places in the list of requests.
    pub(crate) settings: Vec<(usize, Setting)>,
}

/// So many materials have code of their own, whatever they have in common.
pub(crate) const MOST_APART: usize = 64;

/// Most materials of a program whose code differs by more than constants.
const MOST_CODES: usize = 1024;

/// The same materials if they are few; else one for each code, in the order of the first of each.
///
/// # Errors
/// There is more code than can be compiled.
pub(crate) fn merged(requested: Vec<Requested>) -> Result<Vec<Requested>, Diagnostic> {
    if requested.len() <= MOST_APART {
        return Ok(requested);
    }
    let mut groups: Vec<Vec<Requested>> = Vec::new();
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    for one in requested {
        let next = groups.len();
        let group = if one.apart {
            next
        } else {
            *known.entry(code(&one.material)).or_insert(next)
        };
        if group == next {
            groups.push(Vec::new());
        }
        groups[group].push(one);
    }
    if groups.len() > MOST_CODES {
        let message = format!(
            "the materials come to {} shaders that differ by more than constants",
            groups.len()
        );
        return Err(Diagnostic::without_span(Code::TooLarge, message)
            .expected(format!("at most {MOST_CODES}"))
            .hint(
                "let instances of one material differ in parameters; instances share its code, \
                 however many they are",
            ));
    }
    Ok(groups.into_iter().filter_map(instances).collect())
}

/// What tells the code of a material apart from that of others: all but names, places and floats.
fn code(material: &Material) -> String {
    let params = material.params.iter().map(|p| (p.surface_type, p.ty));
    let params: Vec<_> = params.collect();
    let body = &material.body;
    let locals: Vec<_> = body.locals.iter().map(|local| local.ty).collect();
    let exprs = body.exprs.iter().map(|e| match &e.kind {
        ExprKind::Const(Const::Float(_)) => (e.ty, None),
        kind => (e.ty, Some(kind)),
    });
    let exprs: Vec<_> = exprs.collect();
    let closures = material.closures.iter().map(|closure| match closure {
        Closure::Lobe(Lobe {
            def,
            args,
            normal,
            tangent,
            ..
        }) => (Some((def, args, normal, tangent)), None),
        other => (None, Some(other)),
    });
    let closures: Vec<_> = closures.collect();
    let interior = material.interior.map(|i| (i.when, i.parts));
    let outputs = (
        material.surface,
        material.emission,
        interior,
        material.opacity,
    );
    format!(
        "{params:?} {locals:?} {exprs:?} {:?} {} {closures:?} {outputs:?}",
        body.body, body.turns
    )
}

/// One material for those of one code; none for none.
fn instances(group: Vec<Requested>) -> Option<Requested> {
    let apart = group.first()?.apart;
    let first = group.first()?.material.clone();
    let floats = |material: &Material, at: usize| match &material.body.exprs.get(at)?.kind {
        ExprKind::Const(value @ Const::Float(_)) => Some(value.clone()),
        _ => None,
    };
    let differ = |at: &usize| {
        let value = floats(&first, *at);
        value.is_some() && group.iter().any(|m| floats(&m.material, *at) != value)
    };
    let differing: Vec<usize> = (0..first.body.exprs.len()).filter(differ).collect();
    let mut material = first.clone();
    for &at in &differing {
        constants::to_parameter(&mut material, at);
    }
    let settings = group.into_iter().flat_map(|one| {
        let own: Vec<Const> = differing
            .iter()
            .filter_map(|at| floats(&one.material, *at))
            .collect();
        let with_own = |(place, mut setting): (usize, Setting)| {
            setting.values.extend(own.iter().cloned());
            (place, setting)
        };
        one.settings.into_iter().map(with_own).collect::<Vec<_>>()
    });
    Some(Requested {
        apart,
        settings: settings.collect(),
        material,
    })
}
