//! Builds a material's `evaluate` function: patterns, lobe weights, sampling, value and density.

use super::view::{View, ViewedLobe};
use super::{Core, Path, delta_only, walks};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, Function, FunctionId, LocalId, Material, Module, Stmt, Type};

/// Parameters of the function after `point` and `wo`.
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
    let params = [("wl", Type::Vec3), ("u", Type::Vec4)];
    let mut view = View::new(module, core, m, &params);
    let value = view.answer(paths);
    let mut f = view.finish(value);
    name.clone_into(&mut f.name);
    f
}

/// The results, as variables.
struct Results {
    wi: LocalId,
    pdf: LocalId,
    throughput: LocalId,
    light_pdf: LocalId,
    light_throughput: LocalId,
    /// 0 if the path went where there is no surface, or below it, else 1; absent where nothing asks.
    met: Option<LocalId>,
    /// What the path meets below the surface; absent where none goes there.
    below: Option<Below>,
}

/// The same as the fields of `RandomWalk`, and whether the path goes there.
#[derive(Clone, Copy)]
struct Below {
    taken: LocalId,
    albedo: LocalId,
    extinction: LocalId,
    anisotropy: LocalId,
}

impl View<'_> {
    fn answer(&mut self, paths: &[Path<'_>]) -> ExprId {
        let results = Results {
            wi: self.b.local("wi", Type::Vec3),
            pdf: self.b.local("pdf", Type::Float),
            throughput: self.b.local("throughput", Type::Vec3),
            light_pdf: self.b.local("light_pdf", Type::Float),
            light_throughput: self.b.local("light_throughput", Type::Vec3),
            met: self
                .asks_for_gaps(paths)
                .then(|| self.b.local("met", Type::Float)),
            below: walks(self.module, paths).then(|| self.below()),
        };
        if let Some(met) = results.met {
            let one = self.float(1.0);
            self.b.store(met, one);
        }
        if let Some(root) = self.m.surface {
            let (lobes, _) = self.lobes(root, paths);
            if let Some(total) = self.total(&lobes) {
                self.sample(&lobes, total, &results);
                if !delta_only(self.module, paths) {
                    self.directions(&lobes, total, &results);
                }
            }
        }
        self.result(&results)
    }

    fn below(&mut self) -> Below {
        Below {
            taken: self.b.local("below", Type::Float),
            albedo: self.b.local("below_albedo", Type::Vec3),
            extinction: self.b.local("below_extinction", Type::Vec3),
            anisotropy: self.b.local("below_anisotropy", Type::Float),
        }
    }

    /// Must going elsewhere be told from going through the surface into its interior?
    fn asks_for_gaps(&self, paths: &[Path<'_>]) -> bool {
        self.m.interior.is_some() && paths.iter().any(|p| self.is_gap(p))
    }

    /// Does the lobe lead through a gap of the surface, or below it on a walk?
    fn is_gap(&self, path: &Path<'_>) -> bool {
        let walks = walks(self.module, std::slice::from_ref(path));
        walks || self.core.transparent == Some(path.lobe.def)
    }

    /// The sum of all shares; nothing without lobes.
    fn total(&mut self, lobes: &[ViewedLobe<'_>]) -> Option<ExprId> {
        let shares = lobes.iter().map(|lobe| lobe.share);
        let total = shares.reduce(|sum, share| self.op(Op::Add, &[sum, share]))?;
        self.b.name(total, "total");
        Some(total)
    }

    // ---- Sampling ----------------------------------------------------------------------

    /// Chooses a lobe by its share and samples it. A discrete lobe gives its throughput at once.
    fn sample(&mut self, lobes: &[ViewedLobe<'_>], total: ExprId, results: &Results) {
        let u = self.param(U);
        let choice = self.b.swizzle(u, &[0], self.span);
        let choice = self.op(Op::Mul, &[choice, total]);
        let rest = self.b.swizzle(u, &[1, 2, 3], self.span);
        self.b.name(choice, "choice");
        self.sample_from(lobes, choice, None, total, rest, results);
    }

    /// `if choice < sum of shares so far { lobe } else { the lobes after it }`
    fn sample_from(
        &mut self,
        lobes: &[ViewedLobe<'_>],
        choice: ExprId,
        before: Option<ExprId>,
        total: ExprId,
        u: ExprId,
        results: &Results,
    ) {
        let Some((lobe, after)) = lobes.split_first() else {
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

    fn sample_lobe(&mut self, lobe: &ViewedLobe<'_>, total: ExprId, u: ExprId, results: &Results) {
        let [sample, eval, pdf, _] = lobe.methods;
        self.at_lobe(lobe.path.lobe);
        let mut args = lobe.path.lobe.args.clone();
        args.extend([lobe.wo, u]);
        let local = self.call(sample, &args);
        let wi = self.call(self.core.to_world, &[lobe.frame, local]);
        self.b.store(results.wi, wi);
        if let Some(met) = results.met.filter(|_| self.is_gap(lobe.path)) {
            let zero = self.float(0.0);
            self.b.store(met, zero);
        }
        if let (Some(walk), Some(below)) = (lobe.walk, results.below) {
            self.go_below(lobe.path, walk, below);
        }
        if lobe.delta {
            args.pop();
            args.push(local);
            let (weighted, chance) = if lobe.walk.is_some() {
                // What comes back of it, the walk finds out.
                (lobe.weight, lobe.share)
            } else {
                let (value, mass) = (self.call(eval, &args), self.call(pdf, &args));
                let weighted = self.op(Op::Mul, &[lobe.weight, value]);
                // The probability of the choice and of the direction: share / total * mass.
                (weighted, self.op(Op::Mul, &[lobe.share, mass]))
            };
            let throughput = self.op(Op::Mul, &[weighted, total]);
            let throughput = self.op(Op::Div, &[throughput, chance]);
            let valid = self.valid(lobe, local, wi);
            let black = self.color(0.0);
            let throughput = self.op(Op::Select, &[valid, throughput, black]);
            self.b.store(results.throughput, throughput);
        } else {
            // Its density, and that of the other lobes, is found below; this marks it as due.
            let due = self.float(1.0);
            self.b.store(results.pdf, due);
        }
        self.at_material();
    }

    /// Keeps what the path meets below the surface.
    fn go_below(&mut self, path: &Path<'_>, walk: FunctionId, below: Below) {
        let met = self.call(walk, &path.lobe.args);
        let fields = [below.albedo, below.extinction, below.anisotropy];
        for (index, local) in fields.into_iter().enumerate() {
            let value = self.b.field(self.module, met, index, self.span);
            self.b.store(local, value);
        }
        let one = self.float(1.0);
        self.b.store(below.taken, one);
    }

    /// Do the lobe's frame and the geometry agree on reflection or transmission?
    fn valid(&mut self, lobe: &ViewedLobe<'_>, local: ExprId, wi: ExprId) -> ExprId {
        let (wo, geometric) = (self.wo(), self.point("geometric_normal"));
        self.call(
            self.core.transport_valid,
            &[lobe.wo, local, wo, wi, geometric],
        )
    }

    // ---- Evaluation --------------------------------------------------------------------

    /// Value and density of the lobes that have one, for the sampled direction and the light's.
    /// One loop over both keeps the code of the lobes once.
    fn directions(&mut self, lobes: &[ViewedLobe<'_>], total: ExprId, results: &Results) {
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
        let (value, density) = self.direction(lobes, direction, total);
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
    fn direction(
        &mut self,
        lobes: &[ViewedLobe<'_>],
        wi: ExprId,
        total: ExprId,
    ) -> (ExprId, ExprId) {
        let value = self.b.local("value", Type::Vec3);
        let density = self.b.local("density", Type::Float);
        let (black, zero) = (
            self.b.constant(Const::Float(vec![0.0; 3]), self.span),
            self.float(0.0),
        );
        self.b.store(value, black);
        self.b.store(density, zero);
        for lobe in lobes.iter().filter(|l| !l.delta) {
            self.at_lobe(lobe.path.lobe);
            let [_, eval, pdf, _] = lobe.methods;
            let local = self.call(self.core.to_local, &[lobe.frame, wi]);
            let valid = self.valid(lobe, local, wi);
            // What has no weight here costs no evaluation.
            let counts = self.op(Op::Greater, &[lobe.share, zero]);
            let valid = self.op(Op::And, &[valid, counts]);
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
        self.at_material();
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

    /// 1 if the path changes its medium: there is one to change to, and `wi` is on the other side.
    fn transmitted(&mut self, wi: ExprId, results: &Results) -> ExprId {
        let zero = self.float(0.0);
        let Some(interior) = self.m.interior else {
            return zero;
        };
        let (wo, geometric) = (self.wo(), self.point("geometric_normal"));
        let (a, b) = (
            self.op(Op::Dot, &[wo, geometric]),
            self.op(Op::Dot, &[wi, geometric]),
        );
        let product = self.op(Op::Mul, &[a, b]);
        let mut crossed = self.op(Op::Less, &[product, zero]);
        if let Some(when) = interior.when {
            crossed = self.op(Op::And, &[crossed, when]);
        }
        let met = match results.met {
            Some(met) => self.b.load(met, self.span),
            None => self.float(1.0),
        };
        self.op(Op::Select, &[crossed, met, zero])
    }

    fn result(&mut self, results: &Results) -> ExprId {
        let wi = self.b.load(results.wi, self.span);
        let transmitted = self.transmitted(wi, results);
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
        let below = match results.below {
            Some(b) => [b.taken, b.albedo, b.extinction, b.anisotropy]
                .map(|local| self.b.load(local, self.span)),
            None => {
                let zero = self.float(0.0);
                let black = self.b.constant(Const::Float(vec![0.0; 3]), self.span);
                [zero, black, black, zero]
            }
        };
        let fields: Vec<ExprId> = fields.into_iter().chain(below).collect();
        self.b.make(self.core.material_sample, &fields, self.span)
    }
}
