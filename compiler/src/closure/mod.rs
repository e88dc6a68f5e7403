//! From a closure tree to lobes, and from lobes to one function that samples and evaluates them.
//!
//! Layering is albedo scaling on the view side (design, "The language in one example"): the
//! weight of what lies under a layer is one minus the layer's directional albedo. So every
//! lobe's weight is known once `wo` is, the lobe to sample is chosen by its share of the total
//! albedo, and value and density are sums over the lobes. All of it is ordinary IR: the GPU
//! and the interpreter run the same function, without a runtime stack of BSDFs.

use crate::ir::{
    Closure, ClosureId, Const, ExprId, ExprKind, Function, FunctionId, Lobe, Material, Methods,
    Module,
};

mod emission;
mod evaluate;

pub use emission::{emission, emission_kind};
pub use evaluate::evaluate;

/// Most lobes of a material.
pub const MAX_LOBES: usize = 64;

/// Functions and structs of `std::core` that lowered code uses.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Core {
    pub valid_normal: FunctionId,
    pub frame: FunctionId,
    pub to_local: FunctionId,
    pub to_world: FunctionId,
    pub transport_valid: FunctionId,
    pub surface_point: crate::ir::StructId,
    pub material_sample: crate::ir::StructId,
}

/// A lobe with the way to it from the root.
#[derive(Clone, Debug)]
pub struct Path<'a> {
    /// The bsdf or edf.
    pub lobe: &'a Lobe,
    /// Its node in the tree.
    pub id: ClosureId,
}

/// The lobes of a tree that can contribute, in the order they are written. Those under a weight
/// or mix that is the constant zero are left out.
pub fn lobes(material: &Material, root: ClosureId) -> Vec<Path<'_>> {
    let mut found = Vec::new();
    collect(material, root, &mut found);
    found
}

fn collect<'a>(m: &'a Material, id: ClosureId, found: &mut Vec<Path<'a>>) {
    match &m.closures[id.index()] {
        Closure::Lobe(lobe) => found.push(Path { lobe, id }),
        _ => {
            for child in children(m, id) {
                collect(m, child, found);
            }
        }
    }
}

/// The children of a node that can contribute.
pub fn children(m: &Material, id: ClosureId) -> Vec<ClosureId> {
    let f = &m.body;
    match &m.closures[id.index()] {
        Closure::Lobe(_) => vec![],
        Closure::Weight(w, _) if is_constant(f, *w, 0.0) => vec![],
        Closure::Weight(_, a) => vec![*a],
        Closure::Mix(a, _, t) if is_constant(f, *t, 0.0) => vec![*a],
        Closure::Mix(_, b, t) if is_constant(f, *t, 1.0) => vec![*b],
        Closure::Select(c, a, b) => match f.constant(*c) {
            Some(Const::Bool(true)) => vec![*a],
            Some(Const::Bool(false)) => vec![*b],
            _ => vec![*a, *b],
        },
        Closure::Layer(a, b) | Closure::Mix(a, b, _) | Closure::Add(a, b) => vec![*a, *b],
    }
}

fn is_constant(f: &Function, id: ExprId, value: f64) -> bool {
    matches!(f.constant(id), Some(Const::Float(v)) if v.iter().all(|&x| x == value))
}

/// Are all lobes discrete?
pub fn delta_only(module: &Module, lobes: &[Path<'_>]) -> bool {
    lobes
        .iter()
        .all(|p| module.closures[p.lobe.def.index()].delta)
}

/// Could a lobe scatter to the other side? True if its sample or evaluation does not stay on
/// one side, found by sampling it: directions are tried on a fixed grid with its own arguments
/// where these are constant, and with its functions alone where they are not.
pub fn transmissive(module: &Module, material: &Material, lobes: &[Path<'_>]) -> bool {
    lobes.iter().any(|p| {
        let def = &module.closures[p.lobe.def.index()];
        let Methods::Bsdf { sample, .. } = def.methods else {
            return false;
        };
        let args: Option<Vec<Const>> = p
            .lobe
            .args
            .iter()
            .map(|&a| material.body.constant(a).cloned())
            .collect();
        match args {
            Some(args) => samples_transmit(module, sample, &args),
            // What varies over the surface is not known here: ask the function's text.
            None => may_transmit(module, sample),
        }
    })
}

/// Draws directions from a sample method with constant arguments, both sides of the surface.
fn samples_transmit(module: &Module, sample: FunctionId, args: &[Const]) -> bool {
    use crate::ir::{interp::Interpreter, value::Value};
    let grid = [0.02, 0.35, 0.65, 0.98];
    let mut run = Interpreter::<f64>::new(module, 1 << 22);
    for wo in [
        [0.6, 0.0, 0.8],
        [0.6, 0.0, -0.8],
        [0.0, 0.995, 0.0998],
        [0.0, 0.995, -0.0998],
    ] {
        for i in 0..64 {
            let u = [grid[i & 3], grid[(i >> 2) & 3], grid[i >> 4]];
            let mut values: Vec<Value<f64>> = args.iter().map(Value::constant).collect();
            values.extend([Value::vector(&wo), Value::vector(&u)]);
            let Ok(wi) = run.call(sample, values) else {
                return true;
            };
            if wi.to_f64().get(2).is_some_and(|z| z * wo[2] < 0.0) {
                return true;
            }
        }
    }
    false
}

/// Does a sample method, or what it calls, refract? Conservative: any call but of functions
/// known to stay on the side of `wo` counts.
fn may_transmit(module: &Module, sample: FunctionId) -> bool {
    let f = &module.functions[sample.index()];
    f.exprs.iter().any(|e| match e.kind {
        ExprKind::Call(callee, _) => {
            let name = module.functions[callee.index()].name.as_str();
            name.starts_with("refract") || may_transmit(module, callee)
        }
        _ => false,
    })
}
