//! Builds a function that tells what a material is made of as seen at a point from a direction:
//! its patterns, and each lobe with its arguments, albedo, weight and share. It asks the same
//! [`View`] as evaluation does, so what is shown is what is rendered.

use super::view::View;
use super::{Core, Path, lobes};
use crate::ir::ops::Op;
use crate::ir::{
    Expr, ExprId, ExprKind, Function, Local, Material, Module, Stmt, Struct, StructId,
};

/// The function, and what the fields of its result are.
#[derive(Clone, Debug)]
pub struct Probe {
    /// The module that it runs in.
    pub module: Module,
    /// `(point, wo) -> struct`: patterns, then lobes one after another, then the rest.
    pub function: Function,
    /// Names of the `let` values of the material's body.
    pub patterns: Vec<String>,
    /// The lobes. Fields of a lobe: its arguments, albedo, weight, share of being chosen.
    pub lobes: Vec<ProbedLobe>,
    /// Names of the fields behind the lobes.
    pub rest: Vec<String>,
}

/// A lobe of a probed material.
#[derive(Clone, Debug)]
pub struct ProbedLobe {
    /// Name of its bsdf.
    pub bsdf: String,
    /// Names of its parameters.
    pub params: Vec<String>,
    /// Are its directions discrete?
    pub delta: bool,
}

/// The probe of a material whose parameters are constants.
pub fn probe(module: &Module, core: &Core, m: &Material) -> Probe {
    let paths: Vec<Path<'_>> = m.surface.map_or(Vec::new(), |root| lobes(m, root));
    let mut view = View::new(module, core, m, &[]);
    let mut patterns = patterns(&m.body);
    // A parameter is a constant of its name by now.
    patterns.retain(|(name, id)| {
        m.body.constant(*id).is_none() || !m.params.iter().any(|p| p.name == *name)
    });
    let mut fields: Vec<ExprId> = patterns.iter().map(|(_, id)| *id).collect();
    let mut found = Vec::new();
    let mut rest = Vec::new();
    if let Some(root) = m.surface {
        let (ready, seen) = view.lobes(root, &paths);
        let total = ready.iter().map(|l| l.share);
        let total = total.reduce(|sum, share| view.op(Op::Add, &[sum, share]));
        for lobe in &ready {
            let def = &module.closures[lobe.path.lobe.def.index()];
            let share = total.map_or(lobe.share, |t| view.op(Op::Div, &[lobe.share, t]));
            fields.extend(&lobe.path.lobe.args);
            fields.extend([lobe.albedo, lobe.weight, share]);
            found.push(ProbedLobe {
                bsdf: def.name.clone(),
                params: def.params.iter().map(|p| p.name.clone()).collect(),
                delta: def.delta,
            });
        }
        rest.push(("albedo".to_owned(), seen.albedo));
    }
    rest.extend(m.opacity.map(|id| ("opacity".to_owned(), id)));
    if let Some(medium) = &m.interior {
        rest.extend(medium.when.map(|id| ("interior.when".to_owned(), id)));
        let parts = medium.named();
        rest.extend(parts.map(|(name, _, id)| (format!("interior.{name}"), id)));
    }
    fields.extend(rest.iter().map(|(_, id)| *id));
    let mut module = module.clone();
    let function = finish(view, &mut module, &fields);
    Probe {
        module,
        function,
        patterns: patterns.into_iter().map(|(name, _)| name).collect(),
        lobes: found,
        rest: rest.into_iter().map(|(name, _)| name).collect(),
    }
}

/// Ends the function with a struct of `fields`, which is added to the module.
fn finish(mut view: View<'_>, module: &mut Module, fields: &[ExprId]) -> Function {
    let id = StructId(module.structs.len() as u32);
    let field = |&id: &ExprId| Local {
        name: String::new(),
        ty: view.b.ty(id),
    };
    let fields_of = fields.iter().map(field).map(|l| (l.name, l.ty)).collect();
    module.structs.push(Struct {
        name: "Probe".into(),
        fields: fields_of,
        span: view.span,
    });
    let value = view.b.make(id, fields, view.span);
    view.finish(value)
}

/// The named values that hold at the end of a body: constants, and those outside of branches.
fn patterns(body: &Function) -> Vec<(String, ExprId)> {
    let mut holds = vec![false; body.exprs.len()];
    for stmt in &body.body {
        if let Stmt::Eval(id) = stmt {
            holds[id.index()] = true;
        }
    }
    let visible = |(i, e): (usize, &Expr)| {
        let constant = matches!(e.kind, ExprKind::Const(_) | ExprKind::Param(_));
        let name = e.name.clone().filter(|_| constant || holds[i])?;
        Some((name, ExprId(i as u32)))
    };
    body.exprs.iter().enumerate().filter_map(visible).collect()
}
