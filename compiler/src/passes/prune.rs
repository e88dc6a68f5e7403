//! Drops closures that contribute nothing, after parameters that all instances share are constants.
//!
//! A lobe that is dropped costs nothing: neither its patterns (dead code takes them), nor its share
//! of the kernel. What contributes nothing is: a closure with weight 0, the side of a `mix` or `if`
//! that a constant does not choose, a lobe that reflects nothing (or an edf that emits nothing)
//! whatever the direction, and what lies under a layer that lets nothing through. The value of the
//! material stays the same; which of the random numbers choose which lobe may change.
//!
//! A closure that a `let` names can be used several times. What is left is a tree without such
//! sharing, since each use has a weight of its own.

use std::collections::BTreeMap;

use crate::closure::lobe_count;
use crate::diag::Diagnostic;
use crate::ir::build::Builder;
use crate::ir::interp::Interpreter;
use crate::ir::ops::Op;
use crate::ir::value::Value;
use crate::ir::{
    Closure, ClosureId, Const, Expr, ExprId, Function, Lobe, Local, MAX_LOBES, Material, Methods,
    Module, Type,
};

/// Rewrites the closures of a material. An output of which nothing is left becomes `None`, and so
/// does an opacity of 1.
pub fn prune(
    module: &Module,
    material: &mut Material,
    _: &[Option<Const>],
) -> Result<bool, Diagnostic> {
    run(module, material, true);
    Ok(true)
}

/// As [`prune`], by weights alone: no method of a closure is looked at.
pub fn prune_weights(
    module: &Module,
    material: &mut Material,
    _: &[Option<Const>],
) -> Result<bool, Diagnostic> {
    run(module, material, false);
    Ok(true)
}

fn run(module: &Module, material: &mut Material, albedos: bool) {
    let mut pruner = Pruner {
        module,
        albedos,
        b: Builder::resume(material.body.clone()),
        closures: Vec::new(),
        nodes: Vec::new(),
        emits: Vec::new(),
        known: BTreeMap::new(),
    };
    for closure in &material.closures {
        let emits = pruner.is_edf(closure);
        pruner.emits.push(emits);
        let node = pruner.node(closure);
        pruner.nodes.push(node);
    }
    let left = |root: Option<ClosureId>| pruner.left(root?).map(|n| n.id);
    material.surface = left(material.surface);
    material.emission = left(material.emission);
    material.body = pruner.b.finish(material.body.value);
    material.closures = pruner.closures;
    unshare(material);
    if let Some(opacity) = material.opacity
        && is(material.body.constant(opacity), 1.0)
    {
        material.opacity = None;
    }
}

/// What is left of a node.
#[derive(Clone)]
struct Node {
    id: ClosureId,
    /// Its albedo, where that is the same for all directions and all else passes; none for edfs.
    albedo: Option<[f64; 3]>,
}

struct Pruner<'a> {
    module: &'a Module,
    /// Are albedos asked for?
    albedos: bool,
    /// The material's body, to which weights are added.
    b: Builder,
    closures: Vec<Closure>,
    /// What is left of each old node; children come before parents.
    nodes: Vec<Option<Node>>,
    /// Did each old node emit, rather than scatter?
    emits: Vec<bool>,
    /// Albedos found, by definition and arguments.
    known: BTreeMap<String, Option<[f64; 3]>>,
}

impl Pruner<'_> {
    fn left(&self, id: ClosureId) -> Option<Node> {
        self.nodes.get(id.index()).cloned().flatten()
    }

    fn constant(&self, id: ExprId) -> Option<&Const> {
        self.b.function().constant(id)
    }

    /// Does a node, whose children are known, emit? A bsdf over an edf does.
    fn is_edf(&self, closure: &Closure) -> bool {
        match closure {
            Closure::Lobe(lobe) => {
                let def = &self.module.closures[lobe.def.index()];
                matches!(def.methods, Methods::Edf { .. })
            }
            Closure::Layer(_, a) | Closure::Weight(_, a) | Closure::Add(a, _) => {
                self.emits[a.index()]
            }
            Closure::Mix(a, _, _) | Closure::Select(_, a, _) => self.emits[a.index()],
        }
    }

    fn add(&mut self, closure: Closure, albedo: Option<[f64; 3]>) -> Option<Node> {
        self.closures.push(closure);
        Some(Node {
            id: ClosureId(self.closures.len() as u32 - 1),
            albedo,
        })
    }

    fn node(&mut self, closure: &Closure) -> Option<Node> {
        match closure {
            Closure::Lobe(lobe) => self.lobe(lobe),
            Closure::Weight(w, a) => {
                let a = self.left(*a)?;
                self.weighted(*w, a)
            }
            Closure::Add(a, b) => match (self.left(*a), self.left(*b)) {
                (Some(a), Some(b)) => {
                    let albedo = both(&a, &b, |a, b| (a + b).min(1.0));
                    self.add(Closure::Add(a.id, b.id), albedo)
                }
                (a, b) => a.or(b),
            },
            Closure::Layer(a, b) => self.layer(*a, *b),
            Closure::Mix(a, b, t) => self.mix(*a, *b, *t),
            Closure::Select(c, a, b) => self.select(*c, *a, *b),
        }
    }

    /// A node under a weight.
    fn weighted(&mut self, w: ExprId, a: Node) -> Option<Node> {
        let weight = match self.constant(w) {
            c if is(c, 0.0) => return None,
            c if is(c, 1.0) => return Some(a),
            Some(Const::Float(v)) if v.len() == 3 => Some([v[0], v[1], v[2]]),
            Some(Const::Float(v)) => Some([v[0]; 3]),
            _ => None,
        };
        let albedo = weight.zip(a.albedo);
        let albedo = albedo.map(|(w, a)| [w[0] * a[0], w[1] * a[1], w[2] * a[2]]);
        self.add(Closure::Weight(w, a.id), albedo)
    }

    /// One closure over another; over an edf, a bsdf only takes light away.
    fn layer(&mut self, a: ClosureId, b: ClosureId) -> Option<Node> {
        let under = self.left(b);
        let Some(top) = self.left(a) else {
            return under;
        };
        let opaque = top.albedo.is_some_and(|a| a.iter().all(|&x| x >= 1.0));
        let Some(under) = under.filter(|_| !opaque) else {
            return (!self.emits[b.index()]).then_some(top);
        };
        let albedo = both(&top, &under, |a, b| a + (1.0 - a) * b);
        self.add(Closure::Layer(top.id, under.id), albedo)
    }

    fn mix(&mut self, a: ClosureId, b: ClosureId, t: ExprId) -> Option<Node> {
        let (only_a, only_b) = (is(self.constant(t), 0.0), is(self.constant(t), 1.0));
        match (self.left(a), self.left(b)) {
            (a, _) if only_a => a,
            (_, b) if only_b => b,
            (Some(a), Some(b)) if a.id == b.id => Some(a),
            (Some(a), Some(b)) => {
                let t_value = match self.constant(t) {
                    Some(Const::Float(v)) => v.first().copied(),
                    _ => None,
                };
                let mixed = t_value.and_then(|t| both(&a, &b, |a, b| a * (1.0 - t) + b * t));
                let albedo = mixed.or_else(|| a.albedo.filter(|_| a.albedo == b.albedo));
                self.add(Closure::Mix(a.id, b.id, t), albedo)
            }
            (Some(a), None) => {
                let rest = self.op(Op::Sub, &[Some(1.0), None], t);
                self.weighted(rest, a)
            }
            (None, Some(b)) => self.weighted(t, b),
            (None, None) => None,
        }
    }

    fn select(&mut self, c: ExprId, a: ClosureId, b: ClosureId) -> Option<Node> {
        match (self.constant(c), self.left(a), self.left(b)) {
            (Some(Const::Bool(true)), a, _) => a,
            (Some(Const::Bool(false)), _, b) => b,
            (_, Some(a), Some(b)) if a.id == b.id => Some(a),
            (_, Some(a), Some(b)) => {
                let albedo = a.albedo.filter(|_| a.albedo == b.albedo);
                self.add(Closure::Select(c, a.id, b.id), albedo)
            }
            (_, Some(a), None) => {
                let weight = self.op(Op::Select, &[None, Some(1.0), Some(0.0)], c);
                self.weighted(weight, a)
            }
            (_, None, Some(b)) => {
                let weight = self.op(Op::Select, &[None, Some(0.0), Some(1.0)], c);
                self.weighted(weight, b)
            }
            (_, None, None) => None,
        }
    }

    /// An operation on floats and on `operand`, which stands where they are `None`.
    fn op(&mut self, op: Op, args: &[Option<f64>], operand: ExprId) -> ExprId {
        let Expr { span, via, .. } = *self.b.function().expr(operand);
        self.b.set_via(via);
        let value = |b: &mut Builder, x: &Option<f64>| match x {
            Some(x) => b.float(*x, span),
            None => operand,
        };
        let args: Vec<ExprId> = args.iter().map(|x| value(&mut self.b, x)).collect();
        self.b.op(op, &args, span)
    }

    // ---- Lobes -------------------------------------------------------------------------

    /// A lobe, unless it never reflects or emits anything.
    fn lobe(&mut self, lobe: &Lobe) -> Option<Node> {
        let value = self.value(lobe);
        let def = &self.module.closures[lobe.def.index()];
        // What takes light away without reflecting it shows as well, in what lies under it.
        let absorbs = matches!(
            def.methods,
            Methods::Bsdf {
                passes: Some(_),
                ..
            }
        );
        if value == Some([0.0; 3]) && !absorbs {
            return None;
        }
        let scatters = matches!(def.methods, Methods::Bsdf { passes: None, .. });
        let clamped = |v: [f64; 3]| v.map(|x| x.clamp(0.0, 1.0));
        let albedo = value.filter(|_| scatters).map(clamped);
        self.add(Closure::Lobe(lobe.clone()), albedo)
    }

    /// A lobe's albedo or emission, where it is the same for all directions and for all values of
    /// the arguments that are not constant.
    fn value(&mut self, lobe: &Lobe) -> Option<[f64; 3]> {
        if !self.albedos {
            return None;
        }
        let args: Vec<Option<Const>> = lobe
            .args
            .iter()
            .map(|&a| self.constant(a).cloned())
            .collect();
        let key = format!("{:?} {args:?}", lobe.def);
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let found = constant_value(self.module, lobe, &args);
        self.known.insert(key, found);
        found
    }
}

/// The value of a lobe's albedo or emission if that is a constant, found by making a function of
/// it and running all passes.
fn constant_value(module: &Module, lobe: &Lobe, args: &[Option<Const>]) -> Option<[f64; 3]> {
    let def = &module.closures[lobe.def.index()];
    let method = match def.methods {
        Methods::Bsdf { albedo, .. } => albedo,
        Methods::Edf { emit } => emit,
    };
    let open = def.params.iter().zip(args).filter(|(_, c)| c.is_none());
    let mut params: Vec<Local> = open.map(|(p, _)| p.clone()).collect();
    params.push(Local {
        name: "wo".into(),
        ty: Type::Vec3,
    });
    let mut b = Builder::new(def.name.as_str(), params.clone(), lobe.span);
    let mut next = 0..;
    let mut value = |c: &Option<Const>| match c {
        Some(c) => b.constant(c.clone(), lobe.span),
        None => b.param(next.next().unwrap_or(0), lobe.span),
    };
    let mut values: Vec<ExprId> = args.iter().map(&mut value).collect();
    values.push(value(&None));
    let value = b.call(module, method, &values, lobe.span);
    let mut f = b.finish(value);
    if changes(module, &f, &params) {
        return None;
    }
    super::run(module, &mut f);
    match f.constant(f.value)? {
        Const::Float(v) => <[f64; 3]>::try_from(v.as_slice()).ok(),
        _ => None,
    }
}

/// Most expressions that are evaluated to see whether a value changes.
const CHANGE_FUEL: u64 = 1 << 14;

/// Does a function of `params` have different values for two sets of arguments? Then it is no
/// constant, which is found sooner than by running the passes.
fn changes(module: &Module, f: &Function, params: &[Local]) -> bool {
    let value = |cosine: f64, x: f64| {
        let sine = (1.0 - cosine * cosine).sqrt();
        let argument = |p: &Local| match p.ty {
            // `wo` comes last, but any vector of length 1 will do for the others as well.
            Type::Vec3 => Value::vector(&[sine * 0.6, sine * 0.8, cosine]),
            Type::Float => Value::constant(&Const::Float(vec![x])),
            Type::Bool => Value::constant(&Const::Bool(x > 0.5)),
            _ => Value::constant(&Const::Int(0)),
        };
        let supported = |ty| matches!(ty, Type::Vec3 | Type::Float | Type::Bool | Type::Int);
        if !params.iter().all(|p| supported(p.ty)) {
            return None;
        }
        let args = params.iter().map(argument).collect();
        let run = Interpreter::<f64>::new(module, CHANGE_FUEL).run(f, args);
        run.ok().map(|v| v.to_f64())
    };
    let (Some(a), Some(b)) = (value(0.9, 0.3), value(0.4, 0.6)) else {
        return false;
    };
    let far = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-6 * (1.0 + a.abs());
    a.iter().zip(&b).any(far)
}

/// Is a constant `value` in all components?
fn is(constant: Option<&Const>, value: f64) -> bool {
    matches!(constant, Some(Const::Float(v)) if v.iter().all(|&x| x == value))
}

/// The albedo that two nodes make together, where both are known.
fn both(a: &Node, b: &Node, f: impl Fn(f64, f64) -> f64) -> Option<[f64; 3]> {
    let (a, b) = (a.albedo?, b.albedo?);
    Some([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])])
}

/// Keeps the closures that outputs reach, each as often as it is used. A tree of too many lobes is
/// left as it is, for the error that follows.
fn unshare(m: &mut Material) {
    let roots = [m.surface, m.emission];
    let lobes = roots.into_iter().flatten().map(|r| lobe_count(m, r));
    if lobes.max() > Some(MAX_LOBES) {
        return;
    }
    let old = std::mem::take(&mut m.closures);
    let mut new = Vec::new();
    let [surface, emission] = roots.map(|root| root.map(|id| copy(&old, id, &mut new)));
    (m.surface, m.emission, m.closures) = (surface, emission, new);
}

/// Copies a node, after its children.
fn copy(old: &[Closure], id: ClosureId, new: &mut Vec<Closure>) -> ClosureId {
    let mut closure = old[id.index()].clone();
    match &mut closure {
        Closure::Lobe(_) => {}
        Closure::Weight(_, a) => *a = copy(old, *a, new),
        Closure::Layer(a, b)
        | Closure::Mix(a, b, _)
        | Closure::Add(a, b)
        | Closure::Select(_, a, b) => {
            *a = copy(old, *a, new);
            *b = copy(old, *b, new);
        }
    }
    new.push(closure);
    ClosureId(new.len() as u32 - 1)
}
