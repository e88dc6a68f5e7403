//! Builds a material's `evaluate` function: patterns, lobe weights, sampling, value and density.

use std::collections::BTreeMap;

use super::{Core, Path, children, delta_only};
use crate::ir::build::Builder;
use crate::ir::{
    Closure, ClosureId, Const, ExprId, Function, LocalId, Material, Methods, Module, Stmt, Type,
};
use crate::ops::Op;
use crate::source::Span;

/// Least albedo by which a lobe is chosen, so that none that contributes is never sampled.
const LEAST_ALBEDO: f64 = 1e-3;

/// Parameters of the function, in order.
const POINT: usize = 0;
const WO: usize = 1;
const WL: usize = 2;
const U: usize = 3;

/// The function `(point, wo, wl, u) -> MaterialSample` of a material whose lobes are `paths`.
pub fn evaluate(
    module: &Module,
    core: &Core,
    m: &Material,
    name: &str,
    paths: &[Path<'_>],
) -> Function {
    let mut body = m.body.clone();
    body.name = name.to_owned();
    body.params.extend(
        [("wo", Type::Vec3), ("wl", Type::Vec3), ("u", Type::Vec4)].map(|(name, ty)| {
            crate::ir::Local {
                name: name.into(),
                ty,
            }
        }),
    );
    let mut lower = Lower {
        module,
        core,
        m,
        b: Builder::resume(body),
        span: m.span,
    };
    let value = lower.function(paths);
    lower.b.finish(value)
}

/// What decides a frame: the normal and tangent that a lobe asks for, if it does.
type FrameKey = (Option<ExprId>, Option<ExprId>);

/// What evaluation needs of a lobe.
struct Ready<'a> {
    path: &'a Path<'a>,
    delta: bool,
    methods: [crate::ir::FunctionId; 4],
    frame: ExprId,
    wo: ExprId,
    albedo: ExprId,
    /// Color by which its value counts.
    weight: ExprId,
    /// Probability of being chosen, before division by the total.
    share: ExprId,
}

/// The results, as variables.
struct Results {
    wi: LocalId,
    pdf: LocalId,
    throughput: LocalId,
    light_pdf: LocalId,
    light_throughput: LocalId,
}

struct Lower<'a> {
    module: &'a Module,
    core: &'a Core,
    m: &'a Material,
    b: Builder,
    span: Span,
}

impl Lower<'_> {
    fn function(&mut self, paths: &[Path<'_>]) -> ExprId {
        let results = Results {
            wi: self.b.local("wi", Type::Vec3),
            pdf: self.b.local("pdf", Type::Float),
            throughput: self.b.local("throughput", Type::Vec3),
            light_pdf: self.b.local("light_pdf", Type::Float),
            light_throughput: self.b.local("light_throughput", Type::Vec3),
        };
        let ready = self.prepare(paths);
        if !ready.is_empty() {
            let total = self.sum(ready.iter().map(|l| l.share).collect());
            self.sample(&ready, total, &results);
            if !delta_only(self.module, paths) {
                self.directions(&ready, total, &results);
            }
        }
        self.result(&results)
    }

    // ---- Lobes -------------------------------------------------------------------------

    /// Frames, albedos and weights of all lobes.
    fn prepare<'a>(&mut self, paths: &'a [Path<'a>]) -> Vec<Ready<'a>> {
        let mut frames = BTreeMap::new();
        let mut ready: Vec<Ready<'a>> = Vec::new();
        for path in paths {
            let def = &self.module.closures[path.lobe.def.index()];
            let Methods::Bsdf {
                sample,
                eval,
                pdf,
                albedo,
            } = def.methods
            else {
                continue;
            };
            self.span = path.lobe.span;
            let (frame, wo) = self.frame(path, &mut frames);
            let mut args = path.lobe.args.clone();
            args.push(wo);
            let albedo_value = self.call(albedo, &args);
            let (one, zero) = (self.float(1.0), self.float(0.0));
            let albedo_value = self.op(Op::Clamp, &[albedo_value, zero, one]);
            self.b.name(albedo_value, &format!("{}_albedo", def.name));
            ready.push(Ready {
                path,
                delta: def.delta,
                methods: [sample, eval, pdf, albedo],
                frame,
                wo,
                albedo: albedo_value,
                weight: albedo_value,
                share: albedo_value,
            });
        }
        self.span = self.m.span;
        if let Some(root) = self.m.surface {
            let white = self.b.constant(Const::Float(vec![1.0; 3]), self.span);
            self.weights(root, white, &mut ready);
        }
        for lobe in &mut ready {
            let least = self.float(LEAST_ALBEDO);
            let floor = self.op(Op::Max, &[lobe.albedo, least]);
            let product = self.op(Op::Mul, &[lobe.weight, floor]);
            lobe.share = self.op(Op::MaxComponent, &[product]);
        }
        ready
    }

    /// The frame of a lobe and `wo` in it; lobes with the same normal and tangent share them.
    fn frame(
        &mut self,
        path: &Path<'_>,
        known: &mut BTreeMap<FrameKey, (ExprId, ExprId)>,
    ) -> (ExprId, ExprId) {
        let key = (path.lobe.normal, path.lobe.tangent);
        if let Some(found) = known.get(&key) {
            return *found;
        }
        let normal = path.lobe.normal.unwrap_or_else(|| self.point("normal"));
        let tangent = path.lobe.tangent.unwrap_or_else(|| self.point("tangent"));
        let (geometric, wo) = (self.point("geometric_normal"), self.param(WO));
        let normal = self.call(self.core.valid_normal, &[normal, geometric, wo]);
        let frame = self.call(self.core.frame, &[normal, tangent]);
        let wo_local = self.call(self.core.to_local, &[frame, wo]);
        known.insert(key, (frame, wo_local));
        (frame, wo_local)
    }

    /// Hands weights down the tree; gives the albedo of the node.
    fn weights(&mut self, id: ClosureId, weight: ExprId, ready: &mut [Ready<'_>]) -> ExprId {
        let kept = children(self.m, id);
        let black = self.b.constant(Const::Float(vec![0.0; 3]), self.span);
        match self.m.closures[id.index()].clone() {
            Closure::Lobe(_) => match ready.iter_mut().find(|l| l.path.id == id) {
                Some(lobe) => {
                    lobe.weight = weight;
                    lobe.albedo
                }
                None => black,
            },
            _ if kept.is_empty() => black,
            Closure::Weight(w, a) => {
                let inner = self.op(Op::Mul, &[weight, w]);
                let albedo = self.weights(a, inner, ready);
                self.op(Op::Mul, &[albedo, w])
            }
            Closure::Layer(a, b) => {
                let top = self.weights(a, weight, ready);
                let one = self.float(1.0);
                let passed = self.op(Op::Sub, &[one, top]);
                let zero = self.float(0.0);
                let passed = self.op(Op::Max, &[passed, zero]);
                let under = self.op(Op::Mul, &[weight, passed]);
                let base = self.weights(b, under, ready);
                let base = self.op(Op::Mul, &[passed, base]);
                self.op(Op::Add, &[top, base])
            }
            Closure::Add(a, b) => {
                let (a, b) = (
                    self.weights(a, weight, ready),
                    self.weights(b, weight, ready),
                );
                let sum = self.op(Op::Add, &[a, b]);
                let one = self.float(1.0);
                self.op(Op::Min, &[sum, one])
            }
            Closure::Mix(_, _, _) | Closure::Select(..) if kept.len() == 1 => {
                self.weights(kept[0], weight, ready)
            }
            Closure::Mix(a, b, t) => self.blend(a, b, t, weight, ready),
            Closure::Select(c, a, b) => {
                let (one, zero) = (self.float(1.0), self.float(0.0));
                let t = self.op(Op::Select, &[c, zero, one]);
                self.blend(a, b, t, weight, ready)
            }
        }
    }

    fn blend(
        &mut self,
        a: ClosureId,
        b: ClosureId,
        t: ExprId,
        weight: ExprId,
        ready: &mut [Ready<'_>],
    ) -> ExprId {
        let one = self.float(1.0);
        let rest = self.op(Op::Sub, &[one, t]);
        let (wa, wb) = (
            self.op(Op::Mul, &[weight, rest]),
            self.op(Op::Mul, &[weight, t]),
        );
        let (ea, eb) = (self.weights(a, wa, ready), self.weights(b, wb, ready));
        self.op(Op::Mix, &[ea, eb, t])
    }

    // ---- Sampling ----------------------------------------------------------------------

    /// Chooses a lobe by its share and samples it. A discrete lobe gives its throughput at once.
    fn sample(&mut self, ready: &[Ready<'_>], total: ExprId, results: &Results) {
        let u = self.param(U);
        let choice = self.b.swizzle(u, &[0], self.span);
        let choice = self.op(Op::Mul, &[choice, total]);
        let rest = self.b.swizzle(u, &[1, 2, 3], self.span);
        self.b.name(choice, "choice");
        self.sample_from(ready, choice, None, total, rest, results);
    }

    /// `if choice < sum of shares so far { lobe } else { the lobes after it }`
    fn sample_from(
        &mut self,
        ready: &[Ready<'_>],
        choice: ExprId,
        before: Option<ExprId>,
        total: ExprId,
        u: ExprId,
        results: &Results,
    ) {
        let Some((lobe, after)) = ready.split_first() else {
            return;
        };
        let bound = match before {
            Some(before) => self.op(Op::Add, &[before, lobe.share]),
            None => lobe.share,
        };
        // The last lobe takes what rounding leaves, unless it has no share at all.
        let zero = self.float(0.0);
        let taken = if after.is_empty() {
            self.op(Op::Greater, &[lobe.share, zero])
        } else {
            self.op(Op::Less, &[choice, bound])
        };
        self.b.open();
        self.sample_lobe(lobe, total, u, results);
        let then = self.b.close();
        self.b.open();
        self.sample_from(after, choice, Some(bound), total, u, results);
        let otherwise = self.b.close();
        self.b.stmt(Stmt::If(taken, then, otherwise));
    }

    fn sample_lobe(&mut self, lobe: &Ready<'_>, total: ExprId, u: ExprId, results: &Results) {
        let [sample, eval, pdf, _] = lobe.methods;
        self.span = lobe.path.lobe.span;
        let mut args = lobe.path.lobe.args.clone();
        args.extend([lobe.wo, u]);
        let local = self.call(sample, &args);
        let wi = self.call(self.core.to_world, &[lobe.frame, local]);
        self.b.store(results.wi, wi);
        if lobe.delta {
            args.pop();
            args.push(local);
            let (value, mass) = (self.call(eval, &args), self.call(pdf, &args));
            let weighted = self.op(Op::Mul, &[lobe.weight, value]);
            // The probability of the choice and of the direction: share / total * mass.
            let chance = self.op(Op::Mul, &[lobe.share, mass]);
            let throughput = self.op(Op::Mul, &[weighted, total]);
            let throughput = self.op(Op::Div, &[throughput, chance]);
            let valid = self.valid(lobe, local, wi);
            let black = self.b.constant(Const::Float(vec![0.0; 3]), self.span);
            let throughput = self.op(Op::Select, &[valid, throughput, black]);
            self.b.store(results.throughput, throughput);
        } else {
            // Its density, and that of the other lobes, is found below; this marks it as due.
            let due = self.float(1.0);
            self.b.store(results.pdf, due);
        }
        self.span = self.m.span;
    }

    /// Do the lobe's frame and the geometry agree on reflection or transmission?
    fn valid(&mut self, lobe: &Ready<'_>, local: ExprId, wi: ExprId) -> ExprId {
        let (wo, geometric) = (self.param(WO), self.point("geometric_normal"));
        self.call(
            self.core.transport_valid,
            &[lobe.wo, local, wo, wi, geometric],
        )
    }

    // ---- Evaluation --------------------------------------------------------------------

    /// Value and density of the lobes that have one, for the sampled direction and the light's.
    /// One loop over both keeps the code of the lobes once.
    fn directions(&mut self, ready: &[Ready<'_>], total: ExprId, results: &Results) {
        let turn = self.b.local("turn", Type::Int);
        let (low, high) = (
            self.b.constant(Const::Int(0), self.span),
            self.b.constant(Const::Int(2), self.span),
        );
        self.b.open();
        let turn_value = self.b.load(turn, self.span);
        let first = self.op(Op::Equal, &[turn_value, low]);
        let (sampled, light) = (self.b.load(results.wi, self.span), self.param(WL));
        let direction = self.op(Op::Select, &[first, sampled, light]);
        self.b.name(direction, "direction");
        let (value, density) = self.direction(ready, direction, total);
        self.b.open();
        self.store_sampled(value, density, results);
        let then = self.b.close();
        self.b.open();
        self.b.store(results.light_throughput, value);
        self.b.store(results.light_pdf, density);
        let otherwise = self.b.close();
        self.b.stmt(Stmt::If(first, then, otherwise));
        let body = self.b.close();
        self.b.stmt(Stmt::For {
            local: turn,
            low,
            high,
            body,
        });
    }

    fn store_sampled(&mut self, value: ExprId, density: ExprId, results: &Results) {
        let (due, zero) = (self.b.load(results.pdf, self.span), self.float(0.0));
        let continuous = self.op(Op::Greater, &[due, zero]);
        self.b.open();
        self.b.store(results.pdf, density);
        let throughput = self.op(Op::Div, &[value, density]);
        self.b.store(results.throughput, throughput);
        let then = self.b.close();
        self.b.stmt(Stmt::If(continuous, then, Vec::new()));
    }

    /// Sums of weighted values and of densities over the lobes, for one world direction.
    fn direction(&mut self, ready: &[Ready<'_>], wi: ExprId, total: ExprId) -> (ExprId, ExprId) {
        let value = self.b.local("value", Type::Vec3);
        let density = self.b.local("density", Type::Float);
        let (black, zero) = (
            self.b.constant(Const::Float(vec![0.0; 3]), self.span),
            self.float(0.0),
        );
        self.b.store(value, black);
        self.b.store(density, zero);
        for lobe in ready.iter().filter(|l| !l.delta) {
            self.span = lobe.path.lobe.span;
            let [_, eval, pdf, _] = lobe.methods;
            let local = self.call(self.core.to_local, &[lobe.frame, wi]);
            let valid = self.valid(lobe, local, wi);
            self.b.open();
            let mut args = lobe.path.lobe.args.clone();
            args.extend([lobe.wo, local]);
            let f = self.call(eval, &args);
            let f = self.op(Op::Mul, &[lobe.weight, f]);
            self.add_to(value, f);
            let p = self.call(pdf, &args);
            let p = self.op(Op::Mul, &[lobe.share, p]);
            self.add_to(density, p);
            let then = self.b.close();
            self.b.stmt(Stmt::If(valid, then, Vec::new()));
        }
        self.span = self.m.span;
        let (value, density) = (
            self.b.load(value, self.span),
            self.b.load(density, self.span),
        );
        let density = self.op(Op::Div, &[density, total]);
        (value, density)
    }

    fn add_to(&mut self, local: LocalId, value: ExprId) {
        let old = self.b.load(local, self.span);
        let new = self.op(Op::Add, &[old, value]);
        self.b.store(local, new);
    }

    fn result(&mut self, results: &Results) -> ExprId {
        let wi = self.b.load(results.wi, self.span);
        let (wo, geometric) = (self.param(WO), self.point("geometric_normal"));
        let (a, b) = (
            self.op(Op::Dot, &[wo, geometric]),
            self.op(Op::Dot, &[wi, geometric]),
        );
        let product = self.op(Op::Mul, &[a, b]);
        let (zero, one) = (self.float(0.0), self.float(1.0));
        let crossed = self.op(Op::Less, &[product, zero]);
        let transmitted = self.op(Op::Select, &[crossed, one, zero]);
        let rest = [
            results.pdf,
            results.throughput,
            results.light_pdf,
            results.light_throughput,
        ];
        let [pdf, throughput, light_pdf, light_throughput] =
            rest.map(|l| self.b.load(l, self.span));
        let fields = [
            wi,
            pdf,
            throughput,
            light_pdf,
            light_throughput,
            transmitted,
        ];
        self.b.make(self.core.material_sample, &fields, self.span)
    }

    // ---- Shorthands --------------------------------------------------------------------

    fn sum(&mut self, values: Vec<ExprId>) -> ExprId {
        let mut values = values.into_iter();
        let first = values.next().unwrap_or(ExprId(0));
        let total = values.fold(first, |sum, v| self.op(Op::Add, &[sum, v]));
        self.b.name(total, "total");
        total
    }

    fn op(&mut self, op: Op, args: &[ExprId]) -> ExprId {
        self.b.op(op, args, self.span)
    }

    fn call(&mut self, f: crate::ir::FunctionId, args: &[ExprId]) -> ExprId {
        self.b.call(self.module, f, args, self.span)
    }

    fn float(&mut self, x: f64) -> ExprId {
        self.b.float(x, self.span)
    }

    fn param(&mut self, index: usize) -> ExprId {
        self.b.param(index, self.span)
    }

    /// A field of the surface point.
    fn point(&mut self, name: &str) -> ExprId {
        let point = self.param(POINT);
        let fields = &self.module.structs[self.core.surface_point.index()].fields;
        let index = fields.iter().position(|(n, _)| n == name).unwrap_or(0);
        self.b.field(self.module, point, index, self.span)
    }
}
