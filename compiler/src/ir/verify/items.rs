//! Checks what functions are parts of: modules with structs and closure definitions, and
//! materials with closure trees.

use super::{Problem, check};
use crate::ir::{
    Closure, ClosureDef, ClosureId, ExprId, ExprKind, Function, FunctionId, Lobe, Material,
    Methods, Module, Struct, Type,
};
use crate::source::Span;

/// Most fields that a struct may have, those of structs within it included.
pub const MAX_FIELDS: usize = 1023;

/// What is wrong with a module, if anything: with a struct, a function, or a closure definition.
///
/// # Errors
/// The first problem.
pub fn module(module: &Module) -> Result<(), Problem> {
    structs(&module.structs)?;
    for (i, f) in module.functions.iter().enumerate() {
        super::function(module, f)?;
        calls_before(f, i)?;
    }
    module.closures.iter().try_for_each(|c| closure(module, c))
}

fn problem<T>(span: Span, message: String) -> Result<T, Problem> {
    Err(Problem { span, message })
}

/// Structs contain only structs before them, so that none contains itself, and are not huge.
fn structs(structs: &[Struct]) -> Result<(), Problem> {
    let mut sizes: Vec<usize> = Vec::new();
    for s in structs {
        let mut size = 0_usize;
        for (field, ty) in &s.fields {
            size = size.saturating_add(match ty {
                Type::Struct(id) => match sizes.get(id.index()) {
                    Some(size) => *size,
                    None => {
                        let text = format!("{}: field `{field}` contains a later struct", s.name);
                        return problem(s.span, text);
                    }
                },
                _ => 1,
            });
        }
        if size == 0 || size > MAX_FIELDS {
            let message = format!("{}: {size} fields, not 1 to {MAX_FIELDS}", s.name);
            return problem(s.span, message);
        }
        sizes.push(size);
    }
    Ok(())
}

/// Function number `index` calls only functions before it.
fn calls_before(f: &Function, index: usize) -> Result<(), Problem> {
    let later = f.exprs.iter().find(
        |e| matches!(e.kind, ExprKind::Call(FunctionId(callee), _) if callee as usize >= index),
    );
    match later {
        Some(e) => problem(
            e.span,
            format!("{}: calls itself or a later function", f.name),
        ),
        None => Ok(()),
    }
}

/// A definition's methods take its parameters and then directions.
fn closure(module: &Module, def: &ClosureDef) -> Result<(), Problem> {
    use Type::{Float, Vec3};
    let methods: Vec<(FunctionId, usize, Type)> = match def.methods {
        Methods::Bsdf {
            sample,
            eval,
            pdf,
            albedo,
            passes,
            walk: _,
        } => [
            (sample, 2, Vec3),
            (eval, 2, Vec3),
            (pdf, 2, Float),
            (albedo, 1, Vec3),
        ]
        .into_iter()
        .chain(passes.map(|id| (id, 1, Vec3)))
        .collect(),
        Methods::Edf { emit } => vec![(emit, 1, Vec3)],
    };
    for (id, directions, result) in methods {
        let own = def.params.iter().map(|p| p.ty);
        let params = own.chain(std::iter::repeat_n(Vec3, directions));
        let fits = module
            .functions
            .get(id.index())
            .is_some_and(|f| f.result == result && f.params.iter().map(|p| p.ty).eq(params));
        if !fits {
            let message = format!(
                "{}: a method has other parameters or another value",
                def.name
            );
            return problem(def.span, message);
        }
    }
    match def.methods {
        Methods::Bsdf { walk: Some(id), .. } => walk(module, def, id),
        _ => Ok(()),
    }
}

/// The method `walk` takes the parameters alone; it gives albedo, extinction and anisotropy.
fn walk(module: &Module, def: &ClosureDef, id: FunctionId) -> Result<(), Problem> {
    use Type::{Float, Vec3};
    let own = || def.params.iter().map(|p| p.ty);
    let fits = module.functions.get(id.index()).is_some_and(|f| {
        let Type::Struct(s) = f.result else {
            return false;
        };
        let fields = module.structs.get(s.index()).map(|s| &s.fields);
        let types = fields.map(|fields| fields.iter().map(|(_, ty)| *ty).collect::<Vec<_>>());
        f.params.iter().map(|p| p.ty).eq(own()) && types == Some(vec![Vec3, Vec3, Float])
    });
    if fits && !def.delta {
        return Ok(());
    }
    let message = format!("{}: `walk` has other parameters or another value", def.name);
    problem(def.span, message)
}

/// What is wrong with a material over `module`, if anything.
///
/// # Errors
/// The first problem.
pub fn material(module: &Module, m: &Material) -> Result<(), Problem> {
    let tree = Tree {
        module,
        m,
        ready: check(module, &m.body)?,
    };
    tree.params()?;
    for (i, node) in m.closures.iter().enumerate() {
        tree.closure(i, node)?;
    }
    for root in [m.surface, m.emission].into_iter().flatten() {
        tree.child(root, m.closures.len())?;
    }
    if let Some(medium) = &m.interior {
        for (_, ty, id) in medium.named() {
            tree.operand(id, &[ty])?;
        }
        if let Some(when) = medium.when {
            tree.operand(when, &[Type::Bool])?;
        }
    }
    m.opacity
        .map_or(Ok(()), |id| tree.operand(id, &[Type::Float]))
}

/// A material whose body was checked.
struct Tree<'a> {
    module: &'a Module,
    m: &'a Material,
    /// Which expressions are there at the end of the body.
    ready: Vec<bool>,
}

impl Tree<'_> {
    fn wrong(&self, span: Span, message: &str) -> Result<(), Problem> {
        problem(span, format!("{}: {message}", self.m.name))
    }

    fn params(&self) -> Result<(), Problem> {
        for p in &self.m.params {
            if !super::is_constant_of(&p.default, p.ty) {
                return self.wrong(p.span, &format!("the default of `{}` does not fit", p.name));
            }
        }
        let fits = |i: u32, ty| self.m.params.get(i as usize).map(|p| p.ty) == Some(ty);
        for e in &self.m.body.exprs {
            match e.kind {
                ExprKind::MaterialParam(i) if !fits(i, e.ty) => {
                    return self.wrong(e.span, &format!("there is no uniform ${i} of its type"));
                }
                ExprKind::TableValue(i) => {
                    let early = format!("#{i} of the table is read before hoisting has made it");
                    return self.wrong(e.span, &early);
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Node `index`: children come before it, so that no node is below itself.
    fn closure(&self, index: usize, node: &Closure) -> Result<(), Problem> {
        let children = |ids: &[ClosureId]| ids.iter().try_for_each(|&id| self.child(id, index));
        match node {
            Closure::Lobe(lobe) => self.lobe(lobe),
            Closure::Layer(a, b) | Closure::Add(a, b) => children(&[*a, *b]),
            Closure::Mix(a, b, t) => {
                children(&[*a, *b])?;
                self.operand(*t, &[Type::Float])
            }
            Closure::Weight(w, a) => {
                children(&[*a])?;
                self.operand(*w, &[Type::Float, Type::Vec3])
            }
            Closure::Select(c, a, b) => {
                children(&[*a, *b])?;
                self.operand(*c, &[Type::Bool])
            }
        }
    }

    fn child(&self, id: ClosureId, before: usize) -> Result<(), Problem> {
        if id.index() < before {
            return Ok(());
        }
        self.wrong(self.m.span, "a closure refers to itself or a later one")
    }

    fn lobe(&self, lobe: &Lobe) -> Result<(), Problem> {
        let Some(def) = self.module.closures.get(lobe.def.index()) else {
            return self.wrong(lobe.span, "there is no such bsdf or edf");
        };
        if def.params.len() != lobe.args.len() {
            return self.wrong(
                lobe.span,
                "a lobe has more or fewer arguments than parameters",
            );
        }
        for (param, &arg) in def.params.iter().zip(&lobe.args) {
            self.operand(arg, &[param.ty])?;
        }
        let mut frame = lobe.normal.iter().chain(&lobe.tangent);
        frame.try_for_each(|&id| self.operand(id, &[Type::Vec3]))
    }

    fn operand(&self, id: ExprId, types: &[Type]) -> Result<(), Problem> {
        let f = &self.m.body;
        if self.ready.get(id.index()) != Some(&true) {
            return self.wrong(f.span, "an output uses what is not evaluated");
        }
        if !types.contains(&f.ty(id)) {
            return self.wrong(f.expr(id).span, "an operand of an output has another type");
        }
        Ok(())
    }
}
