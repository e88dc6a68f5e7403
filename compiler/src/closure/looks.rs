//! Builds the functions that say how a material looks where it is hit, whatever the light: what denoisers and
//! compositing ask for. They are written only if a program is compiled with them.

use super::view::View;
use super::{Core, lobes};
use crate::ir::ops::Op;
use crate::ir::{Function, Material, Module};

/// The functions of a material.
#[derive(Clone, Debug)]
pub struct Looks {
    /// `(point, wo) -> color`: what it scatters in all of light from `wo`.
    pub albedo: Function,
    /// `(point, wo) -> normal`: the mean of the normals of its lobes, each by its share of that.
    pub normal: Function,
}

impl Looks {
    /// How many functions they are.
    pub const FUNCTIONS: usize = 2;

    /// Those of a material.
    pub fn of(module: &Module, core: &Core, m: &Material) -> Self {
        let named = |mut f: Function| {
            m.name.clone_into(&mut f.name);
            f
        };
        Self {
            albedo: named(albedo(module, core, m)),
            normal: named(normal(module, core, m)),
        }
    }

    /// The functions, in the order in which passes have them.
    pub fn functions(&self) -> [&Function; Self::FUNCTIONS] {
        [&self.albedo, &self.normal]
    }

    /// The other way round; nothing if they are not there.
    pub fn from_functions(mut functions: impl Iterator<Item = Function>) -> Option<Self> {
        let (albedo, normal) = (functions.next()?, functions.next()?);
        Some(Self { albedo, normal })
    }
}

fn albedo(module: &Module, core: &Core, m: &Material) -> Function {
    let mut view = View::new(module, core, m, &[]);
    let value = match m.surface {
        Some(root) => view.lobes(root, &lobes(m, root)).1.albedo,
        None => view.color(0.0),
    };
    let (zero, one) = (view.float(0.0), view.float(1.0));
    let value = view.op(Op::Clamp, &[value, zero, one]);
    view.finish(value)
}

fn normal(module: &Module, core: &Core, m: &Material) -> Function {
    let mut view = View::new(module, core, m, &[]);
    let own = view.point("normal");
    let paths = m.surface.map_or(Vec::new(), |root| lobes(m, root));
    let has_own = paths.iter().any(|p| p.lobe.normal.is_some());
    let Some(root) = m.surface.filter(|_| has_own) else {
        return view.finish(own);
    };
    let (ready, _) = view.lobes(root, &paths);
    let mut sum = view.color(0.0);
    for lobe in &ready {
        let normal = lobe.path.lobe.normal.unwrap_or(own);
        let part = view.op(Op::Mul, &[normal, lobe.share]);
        sum = view.op(Op::Add, &[sum, part]);
    }
    // Of what scatters nothing, or to opposite sides, it is that of the surface.
    let (length, least) = (view.op(Op::Length, &[sum]), view.float(1e-6));
    let is_some = view.op(Op::Greater, &[length, least]);
    let length = view.op(Op::Max, &[length, least]);
    let unit = view.op(Op::Div, &[sum, length]);
    let value = view.op(Op::Select, &[is_some, unit, own]);
    view.finish(value)
}
