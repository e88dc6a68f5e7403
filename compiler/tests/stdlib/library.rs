//! Walks the BSDFs of the library and makes test cases of them: each BSDF with each of the
//! parameter values that its documentation asks to try.
//!
//! Lines of a BSDF's doc comment that tests read:
//! `Try: name = value | value` (any Impasto constants; the default is tried anyway),
//! `Albedo: within 0.02.` or `Albedo: exact.` (and `..., from inside within 0.3`: on the side of
//! the greater index), `Not reciprocal`, `Radiance:`, which
//! says that what passes is scaled by the squared ratio of the indices, given by the parameter
//! `ior`, and `Straight:`, which says that what passes is not refracted. Lines of their own are
//! `Range: name = low .. high, ...`, between which a search draws parameters (colors and floats
//! that are not told: 0 to 1), `Furnace: within 0.01 with name: value, ...`: with these arguments
//! all light is kept, whatever the others are, `Gain: within 0.04 with name: value, ...`: by how
//! much more than all light is reflected with these, and `Region: within 0.01 where condition`: a part
//! of the parameters and directions where single precision may be off by more (see `region`), and
//! `Weights: at most 10`, of value over density.

use std::sync::LazyLock;

use impasto_compiler::ast::{ClosureKind, ItemKind};
use impasto_compiler::ir::{
    Closure, ClosureId, Const, Expr, ExprId, ExprKind, Function, FunctionId, Local, Material,
    Methods, Module, Stmt, Type,
};
use impasto_compiler::source::FileId;
use impasto_compiler::{MemoryLoader, check, diag, parser, passes};

/// Cases of one BSDF beyond which parameters vary one at a time.
const MOST_CASES: usize = 30;

/// A BSDF of the library.
pub struct Bsdf {
    pub name: String,
    pub delta: bool,
    /// How far `albedo` may be from the integral of `eval`.
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
    pub module: Module,
    pub sample: FunctionId,
    pub eval: FunctionId,
    pub pdf: FunctionId,
    pub albedo: FunctionId,
    /// What it lets through, where that is not all that it leaves.
    pub passes: Option<FunctionId>,
    pub cases: Vec<Case>,
}

/// A BSDF's parameters.
pub struct Case {
    /// As written in a call.
    pub label: String,
    pub args: Vec<Const>,
    /// Index inside over the index outside, where it matters.
    pub ior: f64,
}

/// A parameter and the values to try, as source text; none is the default.
struct Tried {
    name: String,
    values: Vec<Option<String>>,
}

/// Every BSDF of `std::bsdf`, with its cases. They are compiled once.
pub fn bsdfs() -> &'static [Bsdf] {
    static ALL: LazyLock<Vec<Bsdf>> = LazyLock::new(|| bsdfs_with(&[]));
    &ALL
}

/// Every BSDF of `std::bsdf`; its float parameters also try `values`.
pub fn bsdfs_with(values: &[&str]) -> Vec<Bsdf> {
    let files: Vec<_> = impasto_stdlib::folder("bsdf").collect();
    assert!(files.len() >= 8, "only {} files in bsdf/", files.len());
    files
        .into_iter()
        .map(|file| bsdf(file.name, file.text, values))
        .collect()
}

/// The BSDF that a file of the library defines under its own name.
fn bsdf(name: &str, text: &str, extremes: &[&str]) -> Bsdf {
    let documented = documented(name, text, extremes);
    build(name, &documented, &documented.calls)
}

/// The BSDF `name` with one set of arguments.
pub fn bsdf_with(name: &str, call: &str) -> Bsdf {
    let file = impasto_stdlib::file("bsdf", name);
    let file = file.unwrap_or_else(|| panic!("no std::bsdf::{name}"));
    let documented = documented(name, file.text, &[]);
    build(name, &documented, &[call.to_owned()])
}

/// What a file says of the closure that it defines under its own name.
pub struct Documented {
    kind: ClosureKind,
    /// Its doc comment in one line.
    pub docs: String,
    /// The same, line by line.
    pub lines: Vec<String>,
    /// Types of its parameters, as written.
    pub types: Vec<String>,
    /// Argument lists to try.
    pub calls: Vec<String>,
}

/// Reads a file of the library; its float parameters also try `extremes`.
pub fn documented(name: &str, text: &str, extremes: &[&str]) -> Documented {
    let (ast, _) = parser::parse(FileId(0), text);
    let item = ast.items.iter().find(|i| i.name.node == name);
    let item = item.unwrap_or_else(|| panic!("{name} does not define `{name}`"));
    let ItemKind::Closure(def) = &item.kind else {
        panic!("`{name}` is no closure")
    };
    let mut tried: Vec<Tried> = def
        .params
        .iter()
        .map(|p| untold(&p.name.node, &p.ty.node))
        .collect();
    for line in item
        .docs
        .iter()
        .filter_map(|l| l.trim().strip_prefix("Try:"))
    {
        let (param, values) = line.split_once('=').expect("`Try: name = value | ...`");
        let known = tried.iter_mut().find(|t| t.name == param.trim());
        let known = known.unwrap_or_else(|| panic!("{name} has no parameter `{}`", param.trim()));
        let values = values.split('|').map(|v| Some(v.trim().to_owned()));
        known.values = std::iter::once(None).chain(values).collect();
    }
    for (t, _) in tried
        .iter_mut()
        .zip(&def.params)
        .filter(|(_, p)| p.ty.node == "float")
    {
        t.values
            .extend(extremes.iter().map(|v| Some((*v).to_owned())));
    }
    Documented {
        kind: def.kind,
        docs: item.docs.join(" "),
        types: def.params.iter().map(|p| p.ty.node.to_string()).collect(),
        lines: whole_lines(&item.docs),
        calls: combinations(&tried),
    }
}

/// What to try of a parameter that the documentation does not mention.
fn untold(name: &str, ty: &str) -> Tried {
    let values: &[&str] = match ty {
        "color" => &["1.0"],
        "float" => &["0.0", "1.0"],
        _ => &[],
    };
    let values = values.iter().map(|v| Some((*v).to_owned()));
    Tried {
        name: name.to_owned(),
        values: std::iter::once(None).chain(values).collect(),
    }
}

/// Argument lists: all combinations, or when they are many, one parameter at a time and a
/// diagonal through all.
fn combinations(tried: &[Tried]) -> Vec<String> {
    let sizes: Vec<usize> = tried.iter().map(|t| t.values.len()).collect();
    let all: usize = sizes.iter().product();
    let digits = |mut k: usize| -> Vec<usize> {
        let digit = |&n: &usize| {
            let d = k % n;
            k /= n;
            d
        };
        sizes.iter().map(digit).collect()
    };
    let mut chosen: Vec<Vec<usize>> = if all <= MOST_CASES {
        (0..all).map(digits).collect()
    } else {
        let single = (0..sizes.len()).flat_map(|p| {
            (0..sizes[p]).map(move |v| (0..).take(p).map(|_| 0).chain([v]).collect::<Vec<_>>())
        });
        // A step that has no factor in common with the sizes goes through all digits.
        let diagonal = (0..MOST_CASES / 2).map(|i| digits((i * 7919 + 1) % all));
        single
            .map(|mut c| {
                c.resize(sizes.len(), 0);
                c
            })
            .chain(diagonal)
            .collect()
    };
    chosen.sort();
    chosen.dedup();
    chosen.iter().map(|c| arguments(tried, c)).collect()
}

fn arguments(tried: &[Tried], chosen: &[usize]) -> String {
    let given = tried.iter().zip(chosen).filter_map(|(t, &v)| {
        t.values[v]
            .as_ref()
            .map(|value| format!("{}: {value}", t.name))
    });
    given.collect::<Vec<_>>().join(", ")
}

/// Has the compiler evaluate the argument lists, each in a material of its own.
fn build(name: &str, documented: &Documented, calls: &[String]) -> Bsdf {
    let docs = documented.docs.as_str();
    let materials = calls
        .iter()
        .enumerate()
        .map(|(i, call)| format!("material case_{i} {{ surface = {name}({call}); }}\n"));
    let text = format!("use std::bsdf::{name};\n{}", materials.collect::<String>());
    let mut files = MemoryLoader::default();
    files.add("cases.impasto", text);
    let checked = check("cases.impasto", &mut files);
    let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(
        !diag::has_errors(&checked.diagnostics),
        "{name}:\n{problems}"
    );

    let module = checked.ir;
    let def = module
        .closures
        .iter()
        .find(|c| c.name == name)
        .expect("the bsdf itself");
    let Methods::Bsdf {
        sample,
        eval,
        pdf,
        albedo,
        passes,
        walk: _,
    } = def.methods
    else {
        panic!("`{name}` is no bsdf")
    };
    let params = def.params.clone();
    let cases = checked
        .checked
        .into_iter()
        .zip(calls)
        .map(|(mut material, call)| {
            let surface = material.surface.expect("a surface");
            let args = arguments_of(&module, &mut material, surface);
            let ior = ior_of(&params, docs, &args);
            Case {
                label: format!("{name}({call})"),
                args,
                ior,
            }
        });
    let cases = cases.collect();
    let albedo_within = promise(docs, "Albedo:").unwrap_or_else(|| {
        panic!("{name}: its documentation must say `Albedo: exact.` or `Albedo: within X.`")
    });
    Bsdf {
        name: name.to_owned(),
        delta: documented.kind == ClosureKind::DeltaBsdf,
        lines: documented.lines.clone(),
        types: documented.types.clone(),
        albedo_within,
        albedo_within_inside: promise(docs, "from inside").unwrap_or(albedo_within),
        reciprocal: !docs.contains("Not reciprocal"),
        scales_radiance: docs.contains("Radiance:"),
        sample,
        eval,
        pdf,
        albedo,
        passes,
        cases,
        module,
    }
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
        let result = match widths.sum() {
            3 => Type::Vec3,
            4 => Type::Vec4,
            width => panic!("{}: {width} answers", self.name),
        };
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

/// The arguments of `closure`, a lobe of `material` with constant arguments.
pub fn arguments_of(module: &Module, material: &mut Material, closure: ClosureId) -> Vec<Const> {
    passes::run_material_until(module, material, &[], "fold_body").expect("no problem");
    let Closure::Lobe(lobe) = &material.closures[closure.index()] else {
        panic!("one lobe")
    };
    let body = &material.body;
    let constant = |&a: &_| body.constant(a).cloned().expect("a constant argument");
    lobe.args.iter().map(constant).map(rounded).collect()
}

/// A constant as a kernel has it, in single precision.
fn rounded(c: Const) -> Const {
    match c {
        Const::Float(v) => Const::Float(v.into_iter().map(|x| f64::from(x as f32)).collect()),
        other => other,
    }
}

/// How exact the documentation says that something is: `exact` or `within X`.
pub fn promise(docs: &str, topic: &str) -> Option<f64> {
    let rest = docs.split_once(topic)?.1.trim_start();
    if rest.starts_with("exact") {
        return Some(0.0);
    }
    let number = rest.strip_prefix("within ")?.split(' ').next()?;
    number.trim_end_matches([',', '.', ';']).parse().ok()
}

/// The lines of a doc comment, where one that ends with a comma or `&&` goes on in the next.
pub fn whole_lines(docs: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for line in docs.iter().map(|l| l.trim()) {
        match lines.last_mut().filter(|l| l.ends_with([',', '&'])) {
            Some(begun) => *begun = format!("{begun} {line}"),
            None => lines.push(line.to_owned()),
        }
    }
    lines
}

impl Bsdf {
    /// What its documentation says on lines that begin with `topic`.
    pub fn said<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a str> {
        let lines = self.lines.iter();
        lines.filter_map(move |l| Some(l.strip_prefix(topic)?.trim()))
    }

    /// The case of other arguments.
    pub fn case(&self, label: String, args: Vec<Const>) -> Case {
        let def = self.module.closures.iter().find(|c| c.name == self.name);
        let params = &def.expect("the bsdf itself").params;
        let ior = ior_of(params, &self.lines.join(" "), &args);
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
