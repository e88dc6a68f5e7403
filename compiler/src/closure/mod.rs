//! From a closure tree to lobes, and from lobes to one function that samples and evaluates them.
//!
//! Layering is albedo scaling on the view side (design, "The language in one example"): the
//! weight of what lies under a layer is one minus the layer's directional albedo. So every
//! lobe's weight is known once `wo` is, the lobe to sample is chosen by its share of the total
//! albedo, and value and density are sums over the lobes. All of it is ordinary IR: the GPU
//! and the interpreter run the same function, without a runtime stack of BSDFs.

use crate::ir::interp::Interpreter;
use crate::ir::value::Value;
use crate::ir::{
    Closure, ClosureDefId, ClosureId, Const, ExprId, Function, FunctionId, Lobe, Local, Material,
    Methods, Module, Type,
};

mod emission;
mod evaluate;
mod gain;
mod looks;
mod opacity;
mod probe;
mod view;

pub use emission::{emission, emission_kind};
pub use evaluate::evaluate;
pub use gain::{Excess, Gain, excesses, gain};
pub use looks::Looks;
pub use opacity::cut_out;
pub use probe::{Probe, ProbedLobe, probe};

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
    /// The bsdf of what is not there; known once a material has an opacity.
    pub transparent: Option<ClosureDefId>,
}

impl Core {
    /// The functions.
    pub fn functions(&self) -> [FunctionId; 5] {
        [
            self.valid_normal,
            self.frame,
            self.to_local,
            self.to_world,
            self.transport_valid,
        ]
    }
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

/// The lobes that a material scatters by.
pub fn surface_lobes(material: &Material) -> Vec<Path<'_>> {
    let root = material.surface;
    root.map_or(Vec::new(), |root| lobes(material, root))
}

/// How many lobes [`lobes`] would find without leaving any out. A closure that is used twice
/// counts twice, so there may be too many to list.
pub fn lobe_count(material: &Material, root: ClosureId) -> usize {
    let mut counts: Vec<usize> = Vec::new();
    // Children come before their parents.
    for closure in &material.closures[..=root.index()] {
        let count = |id: &ClosureId| counts[id.index()];
        counts.push(match closure {
            Closure::Lobe(_) => 1,
            Closure::Weight(_, a) => count(a),
            Closure::Layer(a, b)
            | Closure::Mix(a, b, _)
            | Closure::Add(a, b)
            | Closure::Select(_, a, b) => count(a).saturating_add(count(b)),
        });
    }
    counts[root.index()]
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

/// Are all lobes discrete? Those that walk are as good as discrete: no direction of a light is one of theirs.
pub fn delta_only(module: &Module, lobes: &[Path<'_>]) -> bool {
    lobes.iter().all(|p| {
        let def = &module.closures[p.lobe.def.index()];
        def.delta || walks(module, std::slice::from_ref(p))
    })
}

/// Does light walk below the surface by some lobe?
pub fn walks(module: &Module, lobes: &[Path<'_>]) -> bool {
    let methods = |p: &Path<'_>| &module.closures[p.lobe.def.index()].methods;
    lobes
        .iter()
        .any(|p| matches!(methods(p), Methods::Bsdf { walk: Some(_), .. }))
}

/// Could a lobe scatter to the other side? Found by drawing directions from it, over a fixed grid
/// of numbers, with its own arguments where these are constant and with one half where not.
pub fn transmissive(module: &Module, material: &Material, lobes: &[Path<'_>]) -> bool {
    let mut asked: Vec<(ClosureDefId, Vec<Const>)> = Vec::new();
    lobes.iter().any(|p| {
        let def = &module.closures[p.lobe.def.index()];
        let Methods::Bsdf { sample, .. } = def.methods else {
            return false;
        };
        let stand_in = |(arg, param): (&ExprId, &Local)| {
            let constant = material.body.constant(*arg).cloned();
            constant.unwrap_or_else(|| half(param.ty))
        };
        let args: Vec<Const> = p.lobe.args.iter().zip(&def.params).map(stand_in).collect();
        let key = (p.lobe.def, args);
        if asked.contains(&key) {
            return false;
        }
        let crosses = samples_cross(module, sample, &key.1);
        asked.push(key);
        crosses
    })
}

/// One half in every component of a type.
fn half(ty: Type) -> Const {
    match ty {
        Type::Bool => Const::Bool(true),
        Type::Int => Const::Int(0),
        _ => Const::Float(vec![0.5; ty.width().unwrap_or(1)]),
    }
}

/// Does a sample method with these arguments ever leave the side of `wo`?
fn samples_cross(module: &Module, sample: FunctionId, args: &[Const]) -> bool {
    const DIRECTION: [[f64; 2]; 4] = [[0.02, 0.5], [0.35, 0.1], [0.65, 0.9], [0.98, 0.35]];
    const CHOICE: [f64; 4] = [0.001, 0.35, 0.65, 0.999];
    let mut run = Interpreter::<f64>::new(module, 1 << 22);
    [[0.6, 0.0, 0.8], [0.6, 0.0, -0.8]]
        .iter()
        .any(|wo: &[f64; 3]| {
            CHOICE
                .iter()
                .zip(DIRECTION.iter().cycle().skip(1))
                .chain(CHOICE.iter().zip(&DIRECTION))
                .any(|(z, [x, y])| {
                    let mut values: Vec<Value<f64>> = args.iter().map(Value::constant).collect();
                    values.extend([Value::vector(wo), Value::vector(&[*x, *y, *z])]);
                    // What takes too long to find out is taken to cross.
                    let wi = run.call(sample, values).map(|wi| wi.to_f64());
                    wi.map_or(true, |wi| wi.get(2).is_some_and(|z| z * wo[2] < 0.0))
                })
        })
}
