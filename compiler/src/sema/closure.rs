//! Checking the definitions of closures: their parameters and methods.

use crate::ast::{self, ClosureKind, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::{self, ClosureDefId, FunctionId, Methods};

use super::body::Body;
use super::modules::ModuleId;
use super::types::Ty;
use super::{Checked, Checker, Param};

/// Methods of closures: name, types of the arguments, type of the value.
const BSDF_METHODS: [(&str, &[Ty], Ty); 5] = [
    ("sample", &[Ty::Vector, Ty::Vec3], Ty::Vector),
    ("eval", &[Ty::Vector, Ty::Vector], Ty::Color),
    ("pdf", &[Ty::Vector, Ty::Vector], Ty::Float),
    ("albedo", &[Ty::Vector], Ty::Color),
    (PASSES, &[Ty::Vector], Ty::Color),
];
/// The method that a bsdf may leave out: all that it does not reflect passes then.
const PASSES: &str = "passes";
/// The method of a bsdf whose light walks below the surface: what it meets there.
const WALK: &str = "walk";
/// The struct of `std::core` that `walk` gives.
const RANDOM_WALK: &str = "RandomWalk";
const EDF_METHODS: [(&str, &[Ty], Ty); 1] = [("emit", &[Ty::Vector], Ty::Color)];

impl Checker<'_> {
    /// Checks a bsdf or edf.
    pub(super) fn closure_def(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        def: &ast::ClosureDef,
    ) -> Option<Checked> {
        let params = self.params(module, &def.params)?;
        let mut methods = match def.kind {
            ClosureKind::Bsdf | ClosureKind::DeltaBsdf => BSDF_METHODS.to_vec(),
            ClosureKind::Edf => EDF_METHODS.to_vec(),
        };
        if def.kind == ClosureKind::Bsdf {
            let walk = self.core_struct(RANDOM_WALK)?;
            methods.push((WALK, &[], Ty::Struct(walk)));
        }
        let known = self.known_methods(item, def, &methods);
        let mut ids = Vec::new();
        let (mut passes, mut walk) = (None, None);
        let mut complete = true;
        for (name, types, result) in &methods {
            let Some(method) = def.methods.iter().find(|m| m.name.node == *name) else {
                if *name != PASSES && *name != WALK {
                    self.missing_method(item, name, types.len());
                    complete = false;
                }
                continue;
            };
            let id = self.method(module, item, def, &params, method, types, *result);
            complete &= id.is_some();
            match *name {
                PASSES => passes = id,
                WALK => walk = id,
                _ => ids.extend(id),
            }
        }
        if !known || !complete {
            return None;
        }
        let (ty, methods) = match ids.as_slice() {
            [sample, eval, pdf, albedo] => (
                Ty::Bsdf,
                Methods::Bsdf {
                    sample: *sample,
                    eval: *eval,
                    pdf: *pdf,
                    albedo: *albedo,
                    passes,
                    walk,
                },
            ),
            [emit] => (Ty::Edf, Methods::Edf { emit: *emit }),
            _ => return None,
        };
        let id = ClosureDefId(self.ir.closures.len() as u32);
        let locals = params.iter().filter_map(|p| {
            Some(ir::Local {
                name: p.name.clone(),
                ty: p.ty.ir()?,
            })
        });
        self.ir.closures.push(ir::ClosureDef {
            name: item.name.node.clone(),
            delta: def.kind == ClosureKind::DeltaBsdf,
            params: locals.collect(),
            methods,
            span: item.span,
        });
        self.closure_params.push(params.into());
        Some(Checked::Closure(id, ty))
    }

    fn known_methods(
        &mut self,
        item: &ast::Item,
        def: &ast::ClosureDef,
        known: &[(&str, &[Ty], Ty)],
    ) -> bool {
        let mut ok = true;
        let mut seen: Vec<&str> = Vec::new();
        for method in &def.methods {
            let name = method.name.node.as_str();
            let problem = if !known.iter().any(|(n, ..)| *n == name) {
                let names = known.iter().map(|(n, ..)| *n);
                let message = format!("`{}` cannot define `{name}`", item.name.node);
                Diagnostic::new(Code::UnknownName, method.name.span, message)
                    .expected(format!("one of {}", super::modules::list(names.clone())))
                    .did_you_mean(name, names)
            } else if seen.contains(&name) {
                let message = format!("`{}` defines `{name}` twice", item.name.node);
                Diagnostic::new(Code::Duplicate, method.name.span, message)
                    .expected("one definition a method")
            } else {
                seen.push(name);
                continue;
            };
            self.report(problem);
            ok = false;
        }
        ok
    }

    fn missing_method(&mut self, item: &ast::Item, name: &str, args: usize) {
        let signature = match (name, args) {
            ("sample", _) => "sample(wo, u) = ...;".to_owned(),
            (name, 2) => format!("{name}(wo, wi) = ...;"),
            (name, _) => format!("{name}(wo) = ...;"),
        };
        let message = format!("`{}` does not define `{name}`", item.name.node);
        let missing = Diagnostic::new(Code::MissingMethod, item.name.span, message)
            .expected(format!("`{signature}`"));
        self.report(missing);
    }

    #[allow(clippy::too_many_arguments)]
    fn method(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        def: &ast::ClosureDef,
        params: &[Param],
        method: &ast::Method,
        types: &[Ty],
        result: Ty,
    ) -> Option<FunctionId> {
        if method.args.len() != types.len() {
            let message = format!(
                "`{}` takes {} arguments, not {}",
                method.name.node,
                types.len(),
                method.args.len()
            );
            let code = if method.args.len() < types.len() {
                Code::MissingArgument
            } else {
                Code::TooManyArguments
            };
            self.report(
                Diagnostic::new(code, method.name.span, message)
                    .expected(format!("{} arguments", types.len())),
            );
            return None;
        }
        let own = def
            .params
            .iter()
            .zip(params)
            .map(|(p, typed)| (p.name.clone(), typed.ty));
        let directions = method.args.iter().cloned().zip(types.iter().copied());
        let args: Vec<(Name, Ty)> = own.chain(directions).collect();
        let name = format!("{}_{}", item.name.node, method.name.node);
        let lets = |cx: &mut Body| {
            let ok = cx.statements(&def.lets);
            // A `let` that one method needs another may leave alone.
            cx.scopes.watch_none();
            ok.then_some(())
        };
        self.lower_function(
            module,
            &name,
            method.span,
            &args,
            result,
            lets,
            &method.body,
        )
    }
}
