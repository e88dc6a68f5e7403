//! Makes test cases of BSDFs: each with the parameter values that its documentation asks to try.

use impasto_compiler::ast::{ClosureKind, Item, ItemKind, Param};
use impasto_compiler::ir::{Closure, ClosureDefId, ClosureId, Const, Material, Methods, Module};
use impasto_compiler::source::FileId;
use impasto_compiler::{Loader, check, diag, parser, passes};

use super::{Bsdf, Case, ior_of};
use crate::promise::{promise, whole_lines};

/// Cases of one BSDF beyond which parameters vary one at a time.
const MOST_CASES: usize = 30;

/// A parameter and the values to try, as source text; none is the default.
struct Tried {
    name: String,
    values: Vec<Option<String>>,
}

/// What a file says of the closure that it defines under its own name.
pub struct Documented {
    /// Bsdf, delta bsdf or edf.
    pub kind: ClosureKind,
    /// Its name.
    pub name: String,
    /// Its doc comment in one line.
    pub docs: String,
    /// The same, line by line.
    pub lines: Vec<String>,
    /// Types of its parameters, as written.
    pub types: Vec<String>,
    /// Argument lists to try.
    pub calls: Vec<String>,
}

/// Reads the definition `name` of a text; its float parameters also try `extremes`.
///
/// # Errors
/// What is wrong with the definition or with its lines.
pub fn documented(name: &str, text: &str, extremes: &[&str]) -> Result<Documented, String> {
    let (ast, _) = parser::parse(FileId(0), text);
    let item = ast.items.iter().find(|i| i.name.node == name);
    let item = item.ok_or_else(|| format!("there is no `{name}`"))?;
    described(item, extremes)
}

/// The same of a definition.
///
/// # Errors
/// What is wrong with its lines.
pub fn described(item: &Item, extremes: &[&str]) -> Result<Documented, String> {
    let ItemKind::Closure(def) = &item.kind else {
        return Err(format!("`{}` is no closure", item.name.node));
    };
    let mut tried: Vec<Tried> = def.params.iter().map(untold).collect::<Result<_, _>>()?;
    let lines = item.docs.iter();
    for line in lines.filter_map(|l| l.trim().strip_prefix("Try:")) {
        let (param, values) = line
            .split_once('=')
            .ok_or("the line is `Try: name = value | ...`")?;
        let known = tried.iter_mut().find(|t| t.name == param.trim());
        let known = known.ok_or_else(|| format!("there is no parameter `{}`", param.trim()))?;
        let values = values.split('|').map(|v| Some(v.trim().to_owned()));
        known.values.truncate(1);
        known.values.extend(values);
    }
    for (t, _) in tried
        .iter_mut()
        .zip(&def.params)
        .filter(|(_, p)| p.ty.node == "float")
    {
        t.values
            .extend(extremes.iter().map(|v| Some((*v).to_owned())));
    }
    Ok(Documented {
        kind: def.kind,
        name: item.name.node.clone(),
        docs: item.docs.join(" "),
        types: def.params.iter().map(|p| p.ty.node.to_string()).collect(),
        lines: whole_lines(&item.docs),
        calls: combinations(&tried),
    })
}

/// What to try of a parameter that the documentation does not mention: first its default, or what takes the place of
/// one.
fn untold(param: &Param) -> Result<Tried, String> {
    let ty = param.ty.node.to_string();
    let values: &[&str] = match ty.as_str() {
        "color" => &["1.0"],
        "float" => &["0.0", "1.0"],
        _ => &[],
    };
    let first = match (&param.default, ty.as_str()) {
        (Some(_), _) => None,
        (None, "color" | "float") => Some("0.5"),
        (None, "bool") => Some("true"),
        (None, "int") => Some("1"),
        (None, "length") => Some("1 cm"),
        (None, "angle") => Some("30 deg"),
        (None, "vec2") => Some("vec2(0.5)"),
        (None, "vec3") => Some("vec3(0.5)"),
        (None, "point") => Some("point(0.1, 0.2, 0.3)"),
        (None, "vector" | "normal") => Some("normal(0.0, 0.0, 1.0)"),
        (None, _) => {
            let name = &param.name.node;
            return Err(format!("the parameter `{name}: {ty}` has no default"));
        }
    };
    let all = std::iter::once(first).chain(values.iter().copied().map(Some));
    Ok(Tried {
        name: param.name.node.clone(),
        values: all.map(|v| v.map(str::to_owned)).collect(),
    })
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

/// A text that defines or imports BSDFs.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// The path that it is loaded by.
    pub path: &'a str,
    /// The text itself.
    pub text: &'a str,
}

/// Gives one text, and others as another loader does.
struct Overlay<'a> {
    path: &'a str,
    text: String,
    below: &'a mut dyn Loader,
}

impl Loader for Overlay<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        if path == self.path {
            return Ok(self.text.clone().into_bytes());
        }
        self.below.load(path)
    }

    fn beside(&mut self, path: &str) -> Vec<String> {
        self.below.beside(path)
    }
}

/// Has the compiler evaluate argument lists of a BSDF that a text knows, each in a material of its own.
///
/// # Errors
/// The diagnostics, or what else is wrong with the definition.
pub fn build(
    source: Source<'_>,
    documented: &Documented,
    calls: &[String],
    loader: &mut dyn Loader,
) -> Result<Bsdf, String> {
    let name = documented.name.as_str();
    let docs = documented.docs.as_str();
    let case = |(i, call): (usize, &String)| {
        format!("material impasto_case_{i} {{ surface = {name}({call}); }}\n")
    };
    let cases: String = calls.iter().enumerate().map(case).collect();
    let mut files = Overlay {
        path: source.path,
        text: format!("{}\n{cases}", source.text),
        below: loader,
    };
    let checked = check(source.path, &mut files);
    if diag::has_errors(&checked.diagnostics) {
        return Err(diag::render::text(
            &checked.sources,
            &checked.diagnostics,
            false,
        ));
    }
    let module = checked.ir;
    let mut materials = checked.checked;
    let first = materials.len().saturating_sub(calls.len());
    let mut lobes = Vec::new();
    for material in &mut materials[first..] {
        lobes.push(lobe_of(&module, material).ok_or("its arguments are no constants")?);
    }
    let def = lobes.first().ok_or("there is no case")?.0;
    let Methods::Bsdf {
        sample,
        eval,
        pdf,
        albedo,
        passes,
        walk: _,
    } = module.closures[def.index()].methods
    else {
        return Err(format!("`{name}` is no bsdf"));
    };
    let params = &module.closures[def.index()].params;
    let cases = lobes.into_iter().zip(calls).map(|((_, args), call)| Case {
        label: format!("{name}({call})"),
        ior: ior_of(params, docs, &args),
        args,
    });
    let cases = cases.collect();
    let albedo_within = promise(docs, "Albedo:").unwrap_or(f64::INFINITY);
    Ok(Bsdf {
        name: name.to_owned(),
        delta: documented.kind == ClosureKind::DeltaBsdf,
        lines: documented.lines.clone(),
        types: documented.types.clone(),
        albedo_within,
        albedo_within_inside: promise(docs, "from inside").unwrap_or(albedo_within),
        reciprocal: !docs.contains("Not reciprocal"),
        scales_radiance: docs.contains("Radiance:"),
        def,
        sample,
        eval,
        pdf,
        albedo,
        passes,
        cases,
        module,
    })
}

/// The definition and the arguments of the only lobe of a material's surface.
fn lobe_of(module: &Module, material: &mut Material) -> Option<(ClosureDefId, Vec<Const>)> {
    let surface = material.surface?;
    let args = arguments_of(module, material, surface)?;
    match material.closures.get(surface.index())? {
        Closure::Lobe(lobe) => Some((lobe.def, args)),
        _ => None,
    }
}

/// The arguments of `closure`, a lobe of `material`, if they are constants.
pub fn arguments_of(
    module: &Module,
    material: &mut Material,
    closure: ClosureId,
) -> Option<Vec<Const>> {
    passes::run_material_until(module, material, &[], "fold_body").ok()?;
    let Closure::Lobe(lobe) = material.closures.get(closure.index())? else {
        return None;
    };
    let constant = |&a: &_| material.body.constant(a).cloned().map(rounded);
    lobe.args.iter().map(constant).collect()
}

/// A constant as a kernel has it, in single precision.
fn rounded(c: Const) -> Const {
    match c {
        Const::Float(v) => Const::Float(v.into_iter().map(|x| f64::from(x as f32)).collect()),
        other => other,
    }
}
