//! A closure tree seen from `wo`: the frame of each lobe, its directional albedo, and the weight by
//! which it counts. Evaluation, emission under a coat and analyses ask for it alike.

use std::collections::BTreeMap;

use super::{Core, Path, children};
use crate::ir::build::Builder;
use crate::ir::ops::Op;
use crate::ir::{
    Closure, ClosureId, Const, ExprId, ExprKind, Function, FunctionId, Lobe, Local, Material,
    Methods, Module, Type,
};
use crate::source::Span;

/// Least albedo by which a lobe is chosen, so that none that contributes is never sampled.
const LEAST_ALBEDO: f64 = 1e-3;

/// Parameters that every function of a material begins with, in order.
const POINT: usize = 0;
const WO: usize = 1;

/// What decides a frame: the normal and tangent that a lobe asks for, if it does.
type FrameKey = (Option<ExprId>, Option<ExprId>);

/// A lobe as `wo` sees it.
pub(super) struct ViewedLobe<'a> {
    pub path: &'a Path<'a>,
    pub delta: bool,
    /// Sample, eval, pdf and albedo.
    pub methods: [FunctionId; 4],
    /// What light meets that it sends below the surface.
    pub walk: Option<FunctionId>,
    pub frame: ExprId,
    /// `wo` in the frame.
    pub wo: ExprId,
    /// Directional albedo, from 0 to 1.
    pub albedo: ExprId,
    /// What it lets through, where that is not all that it leaves.
    passed: Option<ExprId>,
    /// Color by which its value counts.
    pub weight: ExprId,
    /// Probability of being chosen, before division by the total.
    pub share: ExprId,
}

/// What a node does to the light that `wo` sees.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// Directional albedo.
    pub albedo: ExprId,
    /// What it lets through to the node under it, where that is not all that it leaves.
    passed: Option<ExprId>,
}

impl Seen {
    /// A node that lets through what it does not reflect.
    fn all_else(albedo: ExprId) -> Self {
        Self {
            albedo,
            passed: None,
        }
    }
}

/// A function of a material under construction: `(point, wo, ...)` after its patterns.
pub(super) struct View<'m> {
    pub module: &'m Module,
    pub core: &'m Core,
    pub m: &'m Material,
    pub b: Builder,
    /// The origin of what is added.
    pub span: Span,
    frames: BTreeMap<FrameKey, (ExprId, ExprId)>,
}

impl<'m> View<'m> {
    /// The material's body with parameters after its point and `wo`.
    pub fn new(
        module: &'m Module,
        core: &'m Core,
        m: &'m Material,
        params: &[(&str, Type)],
    ) -> Self {
        let mut body = m.body.clone();
        let params = std::iter::once(&("wo", Type::Vec3)).chain(params);
        body.params.extend(params.map(|&(name, ty)| Local {
            name: name.into(),
            ty,
        }));
        Self {
            module,
            core,
            m,
            b: Builder::resume(body),
            span: m.span,
            frames: BTreeMap::new(),
        }
    }

    /// Ends the function.
    pub fn finish(self, value: ExprId) -> Function {
        self.b.finish(value)
    }

    /// The lobes under a node, of which `paths` are those that contribute, and what the node does.
    pub fn lobes<'a>(
        &mut self,
        root: ClosureId,
        paths: &'a [Path<'a>],
    ) -> (Vec<ViewedLobe<'a>>, Seen) {
        let mut lobes: Vec<ViewedLobe<'a>> = paths.iter().filter_map(|p| self.lobe(p)).collect();
        self.at_material();
        let white = self.color(1.0);
        let seen = self.weights(root, white, &mut lobes);
        for lobe in &mut lobes {
            let least = self.float(LEAST_ALBEDO);
            let floor = self.op(Op::Max, &[lobe.albedo, least]);
            let product = self.op(Op::Mul, &[lobe.weight, floor]);
            lobe.share = self.op(Op::MaxComponent, &[product]);
            let name = &self.module.closures[lobe.path.lobe.def.index()].name;
            self.b.name(lobe.weight, &format!("{name}_weight"));
            self.b.name(lobe.share, &format!("{name}_share"));
        }
        (lobes, seen)
    }

    /// A lobe with its frame and albedo; its weight is not known yet.
    fn lobe<'a>(&mut self, path: &'a Path<'a>) -> Option<ViewedLobe<'a>> {
        let module = self.module;
        let def = &module.closures[path.lobe.def.index()];
        let Methods::Bsdf {
            sample,
            eval,
            pdf,
            albedo,
            passes,
            walk,
        } = def.methods
        else {
            return None;
        };
        self.at_lobe(path.lobe);
        let (frame, wo) = self.frame(path);
        let mut args = path.lobe.args.clone();
        args.push(wo);
        let value = self.share_of_light(albedo, &args);
        self.b.name(value, &format!("{}_albedo", def.name));
        let passed = passes.map(|passes| self.share_of_light(passes, &args));
        Some(ViewedLobe {
            path,
            delta: def.delta || walk.is_some(),
            methods: [sample, eval, pdf, albedo],
            walk,
            frame,
            wo,
            albedo: value,
            passed,
            weight: value,
            share: value,
        })
    }

    /// A color from 0 to 1, by a method of a lobe.
    fn share_of_light(&mut self, method: FunctionId, args: &[ExprId]) -> ExprId {
        let value = self.call(method, args);
        let (one, zero) = (self.float(1.0), self.float(0.0));
        self.op(Op::Clamp, &[value, zero, one])
    }

    /// The frame of a lobe and `wo` in it; lobes with the same normal and tangent share them.
    fn frame(&mut self, path: &Path<'_>) -> (ExprId, ExprId) {
        let own = |v: &Self, id: Option<ExprId>, field| id.filter(|&id| !v.is_point(id, field));
        let key = (
            own(self, path.lobe.normal, "normal"),
            own(self, path.lobe.tangent, "tangent"),
        );
        if let Some(found) = self.frames.get(&key) {
            return *found;
        }
        let normal = key.0.unwrap_or_else(|| self.point("normal"));
        let tangent = key.1.unwrap_or_else(|| self.point("tangent"));
        let (geometric, wo) = (self.point("geometric_normal"), self.wo());
        let normal = self.call(self.core.valid_normal, &[normal, geometric, wo]);
        let frame = self.call(self.core.frame, &[normal, tangent]);
        self.b.name(frame, "frame");
        let wo_local = self.call(self.core.to_local, &[frame, wo]);
        self.b.name(wo_local, "wo_local");
        self.frames.insert(key, (frame, wo_local));
        (frame, wo_local)
    }

    /// What a node lets through to the one under it.
    pub fn passed(&mut self, seen: Seen) -> ExprId {
        seen.passed.unwrap_or_else(|| {
            let (one, zero) = (self.float(1.0), self.float(0.0));
            let rest = self.op(Op::Sub, &[one, seen.albedo]);
            self.op(Op::Max, &[rest, zero])
        })
    }

    /// The same of two nodes, if it needs telling for either.
    fn both_passed(&mut self, a: Seen, b: Seen) -> Option<(ExprId, ExprId)> {
        (a.passed.is_some() || b.passed.is_some()).then(|| (self.passed(a), self.passed(b)))
    }

    /// Hands weights down the tree; tells what the node does.
    fn weights(&mut self, id: ClosureId, weight: ExprId, lobes: &mut [ViewedLobe<'_>]) -> Seen {
        let kept = children(self.m, id);
        let black = Seen::all_else(self.color(0.0));
        match self.m.closures[id.index()].clone() {
            Closure::Lobe(_) => match lobes.iter_mut().find(|l| l.path.id == id) {
                Some(lobe) => {
                    lobe.weight = weight;
                    Seen {
                        albedo: lobe.albedo,
                        passed: lobe.passed,
                    }
                }
                None => black,
            },
            _ if kept.is_empty() => black,
            Closure::Weight(w, a) => {
                let inner = self.op(Op::Mul, &[weight, w]);
                let a = self.weights(a, inner, lobes);
                Seen {
                    albedo: self.op(Op::Mul, &[a.albedo, w]),
                    passed: a.passed.map(|passed| self.weighted_passage(passed, w)),
                }
            }
            Closure::Layer(a, b) => {
                let top = self.weights(a, weight, lobes);
                let passed = self.passed(top);
                let under = self.op(Op::Mul, &[weight, passed]);
                let base = self.weights(b, under, lobes);
                let lit = self.op(Op::Mul, &[passed, base.albedo]);
                let through = self.both_passed(top, base);
                Seen {
                    albedo: self.op(Op::Add, &[top.albedo, lit]),
                    passed: through.map(|(a, b)| self.op(Op::Mul, &[a, b])),
                }
            }
            Closure::Add(a, b) => {
                let (a, b) = (
                    self.weights(a, weight, lobes),
                    self.weights(b, weight, lobes),
                );
                let sum = self.op(Op::Add, &[a.albedo, b.albedo]);
                let one = self.float(1.0);
                let through = self.both_passed(a, b);
                Seen {
                    albedo: self.op(Op::Min, &[sum, one]),
                    passed: through.map(|(a, b)| self.less_than_either(a, b)),
                }
            }
            Closure::Mix(_, _, _) | Closure::Select(..) if kept.len() == 1 => {
                self.weights(kept[0], weight, lobes)
            }
            Closure::Mix(a, b, t) => self.blend(a, b, t, weight, lobes),
            Closure::Select(c, a, b) => {
                let (one, zero) = (self.float(1.0), self.float(0.0));
                let t = self.op(Op::Select, &[c, zero, one]);
                self.blend(a, b, t, weight, lobes)
            }
        }
    }

    fn blend(
        &mut self,
        a: ClosureId,
        b: ClosureId,
        t: ExprId,
        weight: ExprId,
        lobes: &mut [ViewedLobe<'_>],
    ) -> Seen {
        let one = self.float(1.0);
        let rest = self.op(Op::Sub, &[one, t]);
        let (wa, wb) = (
            self.op(Op::Mul, &[weight, rest]),
            self.op(Op::Mul, &[weight, t]),
        );
        let (a, b) = (self.weights(a, wa, lobes), self.weights(b, wb, lobes));
        let through = self.both_passed(a, b);
        Seen {
            albedo: self.op(Op::Mix, &[a.albedo, b.albedo, t]),
            passed: through.map(|(a, b)| self.op(Op::Mix, &[a, b, t])),
        }
    }

    /// What passes where only the share `w` of the surface is covered: 1 - w (1 - passed).
    fn weighted_passage(&mut self, passed: ExprId, w: ExprId) -> ExprId {
        let (one, zero) = (self.float(1.0), self.float(0.0));
        let kept = self.op(Op::Sub, &[one, passed]);
        let kept = self.op(Op::Mul, &[kept, w]);
        let rest = self.op(Op::Sub, &[one, kept]);
        self.op(Op::Max, &[rest, zero])
    }

    /// What passes two closures side by side: each takes away what it does not let through.
    fn less_than_either(&mut self, a: ExprId, b: ExprId) -> ExprId {
        let (one, zero) = (self.float(1.0), self.float(0.0));
        let sum = self.op(Op::Add, &[a, b]);
        let rest = self.op(Op::Sub, &[sum, one]);
        self.op(Op::Max, &[rest, zero])
    }

    /// What is added from now on comes from a lobe.
    pub fn at_lobe(&mut self, lobe: &Lobe) {
        self.span = lobe.span;
        self.b.set_via(lobe.via);
    }

    /// What is added from now on comes from the material as a whole.
    pub fn at_material(&mut self) {
        self.span = self.m.span;
        self.b.set_via(None);
    }

    // ---- Shorthands --------------------------------------------------------------------

    pub fn op(&mut self, op: Op, args: &[ExprId]) -> ExprId {
        self.b.op(op, args, self.span)
    }

    pub fn call(&mut self, f: FunctionId, args: &[ExprId]) -> ExprId {
        self.b.call(self.module, f, args, self.span)
    }

    pub fn float(&mut self, x: f64) -> ExprId {
        self.b.float(x, self.span)
    }

    /// A grey.
    pub fn color(&mut self, x: f64) -> ExprId {
        self.b.constant(Const::Float(vec![x; 3]), self.span)
    }

    pub fn param(&mut self, index: usize) -> ExprId {
        self.b.param(index, self.span)
    }

    pub fn wo(&mut self) -> ExprId {
        self.param(WO)
    }

    /// Is an expression that field of the surface point?
    fn is_point(&self, id: ExprId, name: &str) -> bool {
        let f = self.b.function();
        let ExprKind::Field(base, index) = f.expr(id).kind else {
            return false;
        };
        let fields = &self.module.structs[self.core.surface_point.index()].fields;
        let of_point = matches!(f.expr(base).kind, ExprKind::Param(p) if p as usize == POINT);
        of_point && fields.get(index as usize).is_some_and(|(n, _)| n == name)
    }

    /// A field of the surface point.
    pub fn point(&mut self, name: &str) -> ExprId {
        let point = self.param(POINT);
        let fields = &self.module.structs[self.core.surface_point.index()].fields;
        let index = fields.iter().position(|(n, _)| n == name).unwrap_or(0);
        self.b.field(self.module, point, index, self.span)
    }
}
