//! A closure tree seen from `wo`: the frame of each lobe, its directional albedo, and the weight by
//! which it counts. Evaluation, emission under a coat and analyses ask for it alike.

use std::collections::BTreeMap;

use super::{Core, Path, children};
use crate::ir::build::Builder;
use crate::ir::{
    Closure, ClosureId, Const, ExprId, Function, FunctionId, Lobe, Local, Material, Methods,
    Module, Type,
};
use crate::ops::Op;
use crate::source::Span;

/// Least albedo by which a lobe is chosen, so that none that contributes is never sampled.
const LEAST_ALBEDO: f64 = 1e-3;

/// Parameters that every function of a material begins with, in order.
const POINT: usize = 0;
const WO: usize = 1;

/// What decides a frame: the normal and tangent that a lobe asks for, if it does.
type FrameKey = (Option<ExprId>, Option<ExprId>);

/// A lobe as `wo` sees it.
pub(super) struct Ready<'a> {
    pub path: &'a Path<'a>,
    pub delta: bool,
    /// Sample, eval, pdf and albedo.
    pub methods: [FunctionId; 4],
    pub frame: ExprId,
    /// `wo` in the frame.
    pub wo: ExprId,
    /// Directional albedo, from 0 to 1.
    pub albedo: ExprId,
    /// Color by which its value counts.
    pub weight: ExprId,
    /// Probability of being chosen, before division by the total.
    pub share: ExprId,
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

    /// The lobes under a node, of which `paths` are those that contribute, and the node's albedo.
    pub fn lobes<'a>(
        &mut self,
        root: ClosureId,
        paths: &'a [Path<'a>],
    ) -> (Vec<Ready<'a>>, ExprId) {
        let mut ready: Vec<Ready<'a>> = paths.iter().filter_map(|p| self.lobe(p)).collect();
        self.at_material();
        let white = self.color(1.0);
        let albedo = self.weights(root, white, &mut ready);
        for lobe in &mut ready {
            let least = self.float(LEAST_ALBEDO);
            let floor = self.op(Op::Max, &[lobe.albedo, least]);
            let product = self.op(Op::Mul, &[lobe.weight, floor]);
            lobe.share = self.op(Op::MaxComponent, &[product]);
            let name = &self.module.closures[lobe.path.lobe.def.index()].name;
            self.b.name(lobe.weight, &format!("{name}_weight"));
            self.b.name(lobe.share, &format!("{name}_share"));
        }
        (ready, albedo)
    }

    /// A lobe with its frame and albedo; its weight is not known yet.
    fn lobe<'a>(&mut self, path: &'a Path<'a>) -> Option<Ready<'a>> {
        let module = self.module;
        let def = &module.closures[path.lobe.def.index()];
        let Methods::Bsdf {
            sample,
            eval,
            pdf,
            albedo,
        } = def.methods
        else {
            return None;
        };
        self.at_lobe(path.lobe);
        let (frame, wo) = self.frame(path);
        let mut args = path.lobe.args.clone();
        args.push(wo);
        let value = self.call(albedo, &args);
        let (one, zero) = (self.float(1.0), self.float(0.0));
        let value = self.op(Op::Clamp, &[value, zero, one]);
        self.b.name(value, &format!("{}_albedo", def.name));
        Some(Ready {
            path,
            delta: def.delta,
            methods: [sample, eval, pdf, albedo],
            frame,
            wo,
            albedo: value,
            weight: value,
            share: value,
        })
    }

    /// The frame of a lobe and `wo` in it; lobes with the same normal and tangent share them.
    fn frame(&mut self, path: &Path<'_>) -> (ExprId, ExprId) {
        let key = (path.lobe.normal, path.lobe.tangent);
        if let Some(found) = self.frames.get(&key) {
            return *found;
        }
        let normal = path.lobe.normal.unwrap_or_else(|| self.point("normal"));
        let tangent = path.lobe.tangent.unwrap_or_else(|| self.point("tangent"));
        let (geometric, wo) = (self.point("geometric_normal"), self.wo());
        let normal = self.call(self.core.valid_normal, &[normal, geometric, wo]);
        let frame = self.call(self.core.frame, &[normal, tangent]);
        self.b.name(frame, "frame");
        let wo_local = self.call(self.core.to_local, &[frame, wo]);
        self.b.name(wo_local, "wo_local");
        self.frames.insert(key, (frame, wo_local));
        (frame, wo_local)
    }

    /// Hands weights down the tree; gives the albedo of the node.
    fn weights(&mut self, id: ClosureId, weight: ExprId, ready: &mut [Ready<'_>]) -> ExprId {
        let kept = children(self.m, id);
        let black = self.color(0.0);
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

    /// A field of the surface point.
    pub fn point(&mut self, name: &str) -> ExprId {
        let point = self.param(POINT);
        let fields = &self.module.structs[self.core.surface_point.index()].fields;
        let index = fields.iter().position(|(n, _)| n == name).unwrap_or(0);
        self.b.field(self.module, point, index, self.span)
    }
}
