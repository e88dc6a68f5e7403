//! BSDFs as distributions: each with arguments that its documentation asks to try, seen from a direction.
//!
//! Lines of a BSDF's doc comment that are read:
//! `Try: name = value | value` (any Impasto constants; the default is tried anyway),
//! `Albedo: within 0.02.` or `Albedo: exact.` (and `..., from inside within 0.3`: on the side of
//! the greater index), `Not reciprocal`, `Radiance:`, which
//! says that what passes is scaled by the squared ratio of the indices, given by the parameter
//! `ior`, and `Straight:`, which says that what passes is not refracted. Lines of their own are
//! `Range: name = low .. high, ...`, between which a search draws parameters (colors and floats
//! that are not told: 0 to 1), `Furnace: within 0.01 with name: value, ...`: with these arguments
//! all light is kept, whatever the others are, `Gain: within 0.04 with name: value, ...`: by how
//! much more than all light is reflected with these, and `Region: within 0.01 where condition`: a part
//! of the parameters and directions where single precision may be off by more (see [`region`]), and
//! `Weights: at most 10`, of value over density.

use std::cell::Cell;

use impasto_compiler::ir::value::Real;
use impasto_compiler::ir::{
    ClosureDefId, Const, Expr, ExprId, ExprKind, Function, FunctionId, Local, Module, Stmt, Type,
};
use impasto_compiler::passes;

use crate::distribution::{Distribution, Outcome};
use crate::evaluate;
use crate::lanes::{self, Fuel, Lanes, Stuck};
use crate::promise;

pub mod cases;
pub mod ends;
pub mod energy;
pub mod reciprocity;
pub mod region;
pub mod search;
pub mod space;

/// Expressions that one batch of directions may take: a hundred thousand a direction.
const FUEL: u64 = 1 << 31;

/// A BSDF and the arguments that it is tried with.
pub struct Bsdf {
    /// Its name.
    pub name: String,
    /// Does it scatter into discrete directions?
    pub delta: bool,
    /// How far `albedo` may be from the integral of `eval`; infinite, if the documentation does not say so.
    pub albedo_within: f64,
    /// The same for directions on the side of the greater index.
    pub albedo_within_inside: f64,
    /// Is it the same with the directions exchanged?
    pub reciprocal: bool,
    /// Is transmitted radiance scaled by the indices?
    pub scales_radiance: bool,
    /// Its documentation, line by line.
    pub lines: Vec<String>,
    /// Types of its parameters, as written.
    pub types: Vec<String>,
    /// What its methods are in.
    pub module: Module,
    /// Its definition in the module.
    pub def: ClosureDefId,
    /// Draws a direction.
    pub sample: FunctionId,
    /// Its value.
    pub eval: FunctionId,
    /// Its density.
    pub pdf: FunctionId,
    /// What it reflects in all.
    pub albedo: FunctionId,
    /// What it lets through, where that is not all that it leaves.
    pub passes: Option<FunctionId>,
    /// Its parameters as they are tried.
    pub cases: Vec<Case>,
}

/// A BSDF's parameters.
pub struct Case {
    /// As written in a call.
    pub label: String,
    /// The arguments.
    pub args: Vec<Const>,
    /// Index inside over the index outside, where it matters.
    pub ior: f64,
}

impl Bsdf {
    /// What methods answer for a case, one after another in a vector: a function of `wo` and what they take besides.
    pub fn answers(&self, case: &Case, methods: &[FunctionId]) -> Function {
        let method = |id: FunctionId| &self.module.functions[id.index()];
        let span = method(methods[0]).span;
        let mut exprs = Vec::new();
        let mut add = |kind: ExprKind, ty: Type| {
            exprs.push(Expr {
                kind,
                ty,
                span,
                via: None,
                name: None,
            });
            ExprId(exprs.len() as u32 - 1)
        };
        let (given, taken) = method(methods[0]).params.split_at(case.args.len());
        let args = case.args.iter().zip(given);
        let mut args: Vec<ExprId> = args
            .map(|(c, param)| add(ExprKind::Const(c.clone()), param.ty))
            .collect();
        args.extend((0..).zip(taken).map(|(i, p)| add(ExprKind::Param(i), p.ty)));
        let call = |&id: &FunctionId| add(ExprKind::Call(id, args.clone()), method(id).result);
        let mut made: Vec<ExprId> = methods.iter().map(call).collect();
        let widths = methods.iter().filter_map(|&id| method(id).result.width());
        let result = Type::of_width(widths.sum());
        if made.len() > 1 {
            made.push(add(ExprKind::Compose(made.clone()), result));
        }
        Function {
            name: "answers".into(),
            params: taken.to_vec(),
            result,
            locals: Vec::new(),
            value: made[made.len() - 1],
            body: made.into_iter().map(Stmt::Eval).collect(),
            exprs,
            turns: methods.iter().map(|&id| method(id).turns).sum(),
            sites: Vec::new(),
            span,
        }
    }
}

/// The ratio of the indices on both sides, 1 where it changes nothing.
fn ior_of(params: &[Local], docs: &str, args: &[Const]) -> f64 {
    let ior = params.iter().zip(args).find(|(p, _)| p.name == "ior");
    match ior {
        Some((_, Const::Float(v))) if v.len() == 1 && !docs.contains("Straight:") => v[0],
        _ => 1.0,
    }
}

impl Bsdf {
    /// What its documentation says on lines that begin with `topic`.
    pub fn said<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a str> {
        promise::said(&self.lines, topic)
    }

    /// Its parameters.
    pub fn params(&self) -> &[Local] {
        &self.module.closures[self.def.index()].params
    }

    /// The case of other arguments.
    pub fn case(&self, label: String, args: Vec<Const>) -> Case {
        let ior = ior_of(self.params(), &self.lines.join(" "), &args);
        Case { label, args, ior }
    }

    /// What the power that goes from `wi` to `wo` is over the radiance: undoes the scaling of
    /// what passes.
    pub fn power_over_radiance(&self, case: &Case, wo_z: f64, wi_z: f64) -> f64 {
        let scaled = self.scales_radiance && wo_z * wi_z < 0.0;
        if !scaled {
            1.0
        } else if wo_z > 0.0 {
            case.ior * case.ior
        } else {
            1.0 / (case.ior * case.ior)
        }
    }
}

impl Bsdf {
    /// What a method answers for a case, a lane for each of what it takes besides.
    ///
    /// # Errors
    /// [`Stuck`], if it takes too long.
    pub fn call<F: Real>(
        &self,
        case: &Case,
        method: FunctionId,
        rest: Vec<Lanes<F>>,
    ) -> Result<Lanes<F>, Stuck> {
        let mut args: Vec<Lanes<F>> = case.args.iter().map(lanes::constant).collect();
        args.extend(rest);
        let f = &self.module.functions[method.index()];
        evaluate::answers(&self.module, f, args, &granted())
    }
}

/// The work that one batch of directions may take.
pub fn granted() -> Fuel {
    Cell::new(FUEL)
}

/// A BSDF seen from `wo`.
pub fn distribution<'a>(bsdf: &'a Bsdf, case: &'a Case, wo: [f64; 3]) -> Distribution<'a> {
    let [sample, measure] = functions(bsdf, case);
    distribution_of(bsdf, case, wo, sample, measure)
}

/// The same for very many directions. Its functions are optimised as in a kernel, with the case's arguments for
/// constants: what density and value share is computed once, and what the case does not need is not.
pub fn optimised<'a>(bsdf: &'a Bsdf, case: &'a Case, wo: [f64; 3]) -> Distribution<'a> {
    let [sample, measure] = functions(bsdf, case).map(|mut function| {
        passes::run(&bsdf.module, &mut function);
        function
    });
    distribution_of(bsdf, case, wo, sample, measure)
}

/// What samples directions, and what gives their density and value.
fn functions(bsdf: &Bsdf, case: &Case) -> [Function; 2] {
    [&[bsdf.sample][..], &[bsdf.pdf, bsdf.eval]].map(|methods| bsdf.answers(case, methods))
}

fn distribution_of<'a>(
    bsdf: &'a Bsdf,
    case: &'a Case,
    wo: [f64; 3],
    sampled: Function,
    measured: Function,
) -> Distribution<'a> {
    let ask = move |function: &Function, second: Lanes| {
        let args = vec![lanes::uniform(&wo), second];
        evaluate::answers(&bsdf.module, function, args, &granted())
    };
    let sample = move |u: &[[f64; 4]]| {
        let numbers = (0..3).map(|c| lanes::floats(u.iter().map(|u| u[c]).collect()));
        let wi = ask(&sampled, numbers.collect())?;
        let one = |l| std::array::from_fn(|c| lanes::float_at(&wi, c, l));
        Ok((0..u.len()).map(one).collect())
    };
    let measure = move |wi: &[[f64; 3]]| {
        let found = ask(&measured, lanes::vectors(wi))?;
        let answer = |(l, wi): (usize, &[f64; 3])| {
            let power = bsdf.power_over_radiance(case, wo[2], wi[2]);
            let v = |c: usize| power * lanes::float_at(&found, 1 + c, l);
            [lanes::float_at(&found, 0, l), v(0), v(1), v(2)]
        };
        Ok(wi.iter().enumerate().map(answer).collect())
    };
    Distribution {
        label: format!(
            "{} from {:.0} degrees",
            case.label,
            wo[2].acos().to_degrees()
        ),
        sample: Box::new(sample),
        measure: Box::new(measure),
    }
}

/// What the BSDF's `albedo` says.
///
/// # Errors
/// [`Stuck`], if it takes too long.
pub fn albedo(bsdf: &Bsdf, case: &Case, wo: [f64; 3]) -> Result<[f64; 3], Stuck> {
    let albedo = bsdf.call::<f64>(case, bsdf.albedo, vec![lanes::uniform(&wo)])?;
    Ok(std::array::from_fn(|c| lanes::float_at(&albedo, c, 0)))
}

/// How near the documentation says that `albedo` is.
pub fn albedo_within(bsdf: &Bsdf, case: &Case, wo: [f64; 3]) -> f64 {
    if (wo[2] > 0.0) == (case.ior >= 1.0) {
        bsdf.albedo_within
    } else {
        bsdf.albedo_within_inside
    }
}

/// What is wrong with `albedo`: it is the integral, within what its documentation promises.
///
/// # Errors
/// [`Stuck`], if it takes too long.
pub fn albedo_fault(
    bsdf: &Bsdf,
    case: &Case,
    wo: [f64; 3],
    outcome: &Outcome,
) -> Result<Option<String>, Stuck> {
    let said = albedo(bsdf, case, wo)?;
    let within = albedo_within(bsdf, case, wo);
    let right = (0..3).all(|c| {
        let close = (said[c] - outcome.energy[c]).abs() < within + 1e-3;
        close && (0.0..=1.0).contains(&said[c])
    });
    let energy = outcome.energy;
    let fault = || format!("albedo says {said:?}, the integral is {energy:?}");
    Ok((!right).then(fault))
}
