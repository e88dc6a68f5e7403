//! WGSL from IR: the text of the functions that some materials need, and nothing else.
//!
//! The text obeys the WGSL specification (no extension of naga's is used) and is a function of
//! the program and the members alone: ids, not maps, decide every order.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::Program;
use crate::abi::{EMISSION, EVALUATE, Emission, TEXTURE_FETCH};
use crate::ir::{ExprKind, Function, StructId, Type};

mod function;
mod helpers;
mod names;

pub use function::{evaluated, type_name};
use helpers::Helpers;
pub use names::{Names, identifier, unique as unique_material_name};

/// The WGSL of `members` (indices of the program's materials).
pub fn module(program: &Program, members: &[usize]) -> String {
    let roots = roots(program, members);
    let functions = reachable(program, &roots);
    let mut helpers = Helpers::default();
    let mut body = String::new();
    for &id in &functions {
        let f = &program.module.functions[id];
        function::print(
            program,
            f,
            program.names.function(id),
            &mut helpers,
            &mut body,
        );
    }
    for (f, name) in &roots {
        function::print(program, f, name, &mut helpers, &mut body);
    }
    let mut out = String::new();
    structs(program, &functions, &roots, &mut out);
    helpers.print(program, &mut out);
    out.push_str(&body);
    dispatch(program, members, &mut out);
    out
}

/// The materials' own functions with their WGSL names.
fn roots<'p>(program: &'p Program, members: &[usize]) -> Vec<(&'p Function, String)> {
    let mut roots = Vec::new();
    for &member in members {
        let material = &program.materials[member];
        roots.push((&material.evaluate, evaluate_name(&material.info.name)));
        if let (Some(f), Emission::Varying) = (&material.emission, material.info.emission) {
            roots.push((f, emission_name(&material.info.name)));
        }
    }
    roots
}

/// The WGSL function of a material.
fn evaluate_name(material: &str) -> String {
    format!("evaluate_{material}")
}

/// The WGSL function of a material's emission.
fn emission_name(material: &str) -> String {
    format!("emission_{material}")
}

/// Functions that the roots call, directly or not, ascending (so callees come first).
fn reachable(program: &Program, roots: &[(&Function, String)]) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut pending: Vec<&Function> = roots.iter().map(|r| r.0).collect();
    while let Some(f) = pending.pop() {
        for callee in function::callees(f) {
            if found.insert(callee) {
                pending.push(&program.module.functions[callee]);
            }
        }
    }
    found
}

/// The structs of the ABI, and those that the functions use, in order of definition.
fn structs(
    program: &Program,
    functions: &BTreeSet<usize>,
    roots: &[(&Function, String)],
    out: &mut String,
) {
    let mut used = BTreeSet::from([program.core.surface_point, program.core.material_sample]);
    let all = functions
        .iter()
        .map(|&id| &program.module.functions[id])
        .chain(roots.iter().map(|r| r.0));
    for f in all {
        let types = f
            .exprs
            .iter()
            .map(|e| e.ty)
            .chain(f.locals.iter().map(|l| l.ty))
            .chain(f.params.iter().map(|p| p.ty));
        types.for_each(|ty| use_struct(program, ty, &mut used));
    }
    for id in used {
        let s = &program.module.structs[id.index()];
        let _ = writeln!(out, "struct {} {{", program.names.structure(id));
        for (name, ty) in &s.fields {
            let _ = writeln!(
                out,
                "    {}: {},",
                identifier(name),
                type_name(program, *ty)
            );
        }
        out.push_str("}\n\n");
    }
}

fn use_struct(program: &Program, ty: Type, used: &mut BTreeSet<StructId>) {
    if let Type::Struct(id) = ty
        && used.insert(id)
    {
        for (_, field) in &program.module.structs[id.index()].fields {
            use_struct(program, *field, used);
        }
    }
}

/// The functions that the kernels call.
fn dispatch(program: &Program, members: &[usize], out: &mut String) {
    let _ = writeln!(
        out,
        "fn {EVALUATE}(material: u32, point: SurfacePoint, wo: vec3f, wl: vec3f, u: vec4f) -> MaterialSample {{"
    );
    let cases = members
        .iter()
        .map(|&m| (m, evaluate_name(&program.materials[m].info.name)));
    switch(
        out,
        &cases.collect::<Vec<_>>(),
        "(point, wo, wl, u)",
        "MaterialSample()",
    );
    let emitters: Vec<(usize, String)> = members
        .iter()
        .filter(|&&m| program.materials[m].info.emission == Emission::Varying)
        .map(|&m| (m, emission_name(&program.materials[m].info.name)))
        .collect();
    if !emitters.is_empty() {
        let _ = writeln!(
            out,
            "\nfn {EMISSION}(material: u32, point: SurfacePoint, wo: vec3f) -> vec3f {{"
        );
        let everyone = emitters.len() == members.len();
        if everyone {
            switch(out, &emitters, "(point, wo)", "vec3f()");
        } else {
            cases_of(out, &emitters, "(point, wo)", "vec3f()");
        }
    }
}

/// A switch over materials, or a plain call where there is only one.
fn switch(out: &mut String, cases: &[(usize, String)], args: &str, otherwise: &str) {
    match cases {
        [(_, only)] => {
            let _ = writeln!(out, "    return {only}{args};\n}}");
        }
        _ => cases_of(out, cases, args, otherwise),
    }
}

fn cases_of(out: &mut String, cases: &[(usize, String)], args: &str, otherwise: &str) {
    out.push_str("    switch material {\n");
    for (material, name) in cases {
        let _ = writeln!(out, "        case {material}u: {{ return {name}{args}; }}");
    }
    let _ = writeln!(
        out,
        "        default: {{ return {otherwise}; }}\n    }}\n}}"
    );
}

/// Checks a module's text with naga, as every kernel that includes it will be checked.
///
/// # Errors
/// What naga says, with the place in the text.
pub fn validate(wgsl: &str) -> Result<(), String> {
    // The runtime provides the texture lookup; a stand-in completes the module here.
    let complete = if wgsl.contains(TEXTURE_FETCH) {
        format!(
            "{wgsl}\nfn {TEXTURE_FETCH}(slot: u32, uv: vec2f) -> vec4f {{ return vec4f(uv, f32(slot), 1.0); }}\n"
        )
    } else {
        wgsl.to_owned()
    };
    let module =
        naga::front::wgsl::parse_str(&complete).map_err(|e| e.emit_to_string(&complete))?;
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    validator
        .validate(&module)
        .map(|_| ())
        .map_err(|e| e.emit_to_string(&complete))
}

/// The fields of `SurfacePoint` that a material's functions read.
pub fn inputs(
    program_structs: &[crate::ir::Struct],
    functions: &[&Function],
) -> crate::abi::InputSet {
    let mut set = crate::abi::InputSet::default();
    for f in functions {
        for id in function::evaluated(f) {
            let ExprKind::Field(base, i) = f.expr(id).kind else {
                continue;
            };
            let (ExprKind::Param(0), Type::Struct(s)) = (&f.expr(base).kind, f.ty(base)) else {
                continue;
            };
            match program_structs[s.index()].fields[i as usize].0.as_str() {
                "position" => set.position = true,
                "normal" => set.normal = true,
                "geometric_normal" => set.geometric_normal = true,
                "tangent" => set.tangent = true,
                "uv" => set.uv = true,
                // Always provided, until kernels follow media.
                _ => {}
            }
        }
    }
    set
}
