//! WGSL from IR: the text of the functions that some materials need, and nothing else.
//!
//! The text obeys the WGSL specification (no extension of naga's is used) and is a function of
//! the program and the members alone: ids, not maps, decide every order.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::abi::{Input, InputSet, sample_declares};
use crate::ir::{ExprKind, Function, StructId, Type};
use crate::parameters::TableLayout;
use crate::program::{Program, identifier};

mod dispatch;
mod function;
mod helpers;
mod inliner;
mod lookups;
mod target;
mod validate;
mod walk;

pub use dispatch::lookup;
use helpers::Helpers;
pub(crate) use inliner::decide as inlined;
pub use lookups::lookups;
pub use target::{Target, complete, enables};
pub use validate::validate;
pub(crate) use validate::{nested_too_deep, validate_with_progress};
pub(crate) use walk::table_values;

impl Program {
    /// The WGSL of some materials: structs, the functions they reach, one function a material,
    /// `evaluate_material`, and `material_emission` if some emission varies.
    pub fn wgsl(&self, members: &[usize]) -> String {
        module(self, members)
    }

    /// The WGSL of `material_of`, which kernels need to sort instances by material.
    pub fn lookup_wgsl(&self) -> String {
        lookup(self)
    }

    /// The WGSL of all materials as a module of its own, with declarations of all that a kernel
    /// would provide.
    pub fn complete_wgsl(&self, target: Target) -> String {
        let all: Vec<usize> = (0..self.materials.len()).collect();
        complete(self, &all, target)
    }
}

/// The WGSL of `members` (indices of the program's materials).
pub fn module(program: &Program, members: &[usize]) -> String {
    let roots = roots(program, members);
    let functions = reachable(program, &roots);
    let mut helpers = Helpers::default();
    helpers.walks = members.iter().any(|&m| program.materials[m].info.walks);
    let mut body = String::new();
    for &id in &functions {
        let f = &program.module.functions[id];
        function::print(
            program,
            f,
            program.names.function(id),
            None,
            &mut helpers,
            &mut body,
        );
    }
    for root in &roots {
        let layout = Some(root.layout).filter(|l| l.rows > 0);
        function::print(
            program,
            root.function,
            &root.name,
            layout,
            &mut helpers,
            &mut body,
        );
    }
    let mut out = String::new();
    structs(program, &functions, &roots, helpers.walks, &mut out);
    helpers.print(program, &mut out);
    out.push_str(&body);
    dispatch::dispatch(program, members, &mut out);
    out
}

/// The WGSL of functions that no material calls, under their own names: operations by themselves,
/// for comparing what a GPU makes of them with what the interpreter does. They use neither structs
/// nor calls nor the parameter table.
pub fn functions(program: &Program, functions: &[Function]) -> String {
    let mut helpers = Helpers::default();
    let mut body = String::new();
    for f in functions {
        function::print(program, f, &f.name, None, &mut helpers, &mut body);
    }
    let mut out = String::new();
    helpers.print(program, &mut out);
    out + &body
}

/// A material's own function.
struct Root<'p> {
    function: &'p Function,
    name: String,
    /// Where the values that it reads of the parameter table lie.
    layout: &'p TableLayout,
}

/// The materials' own functions with their WGSL names.
fn roots<'p>(program: &'p Program, members: &[usize]) -> Vec<Root<'p>> {
    let mut roots = Vec::new();
    for &member in members {
        let material = &program.materials[member];
        let mut add = |function, name| {
            roots.push(Root {
                function,
                name,
                layout: &material.layout,
            });
        };
        add(&material.evaluate, evaluate_name(&material.info.name));
        if let (Some(f), true) = (&material.emission, material.info.varying_emission) {
            add(f, emission_name(&material.info.name));
        }
        if let Some(looks) = &material.looks {
            add(&looks.albedo, albedo_name(&material.info.name));
            add(&looks.normal, normal_name(&material.info.name));
        }
    }
    roots
}

/// The WGSL name of a type.
fn type_name(program: &Program, ty: Type) -> &str {
    match ty {
        Type::Bool => "bool",
        Type::Int => "i32",
        Type::Float => "f32",
        Type::Vec2 => "vec2f",
        Type::Vec3 => "vec3f",
        Type::Vec4 => "vec4f",
        Type::Mat3 => "mat3x3f",
        Type::Struct(id) => program.names.structure(id),
    }
}

/// The WGSL function of a material.
fn evaluate_name(material: &str) -> String {
    format!("evaluate_{material}")
}

/// The WGSL function of a material's emission.
fn emission_name(material: &str) -> String {
    format!("emission_{material}")
}

/// The WGSL function of a material's albedo.
fn albedo_name(material: &str) -> String {
    format!("albedo_{material}")
}

/// The WGSL function of a material's normal.
fn normal_name(material: &str) -> String {
    format!("normal_{material}")
}

/// Functions that the roots call, directly or not, ascending (so callees come first).
fn reachable(program: &Program, roots: &[Root<'_>]) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut pending: Vec<&Function> = roots.iter().map(|r| r.function).collect();
    while let Some(f) = pending.pop() {
        for callee in f.calls() {
            if found.insert(callee.index()) {
                pending.push(&program.module.functions[callee.index()]);
            }
        }
    }
    found
}

/// The structs of the ABI, and those that the functions use, in order of definition.
fn structs(
    program: &Program,
    functions: &BTreeSet<usize>,
    roots: &[Root<'_>],
    walks: bool,
    out: &mut String,
) {
    let mut used = BTreeSet::from([program.core.surface_point, program.core.material_sample]);
    let all = functions
        .iter()
        .map(|&id| &program.module.functions[id])
        .chain(roots.iter().map(|r| r.function));
    for f in all {
        let types = f
            .exprs
            .iter()
            .map(|e| e.ty)
            .chain(f.locals.iter().map(|l| l.ty))
            .chain(f.params.iter().map(|p| p.ty));
        types.for_each(|ty| use_struct(program, ty, &mut used));
    }
    let functions: Vec<&Function> = roots.iter().map(|r| r.function).collect();
    let read = inputs(&program.module.structs, &functions);
    for id in used {
        let s = &program.module.structs[id.index()];
        let _ = writeln!(out, "struct {} {{", program.names.structure(id));
        let declared = |name: &str| {
            if id == program.core.material_sample {
                return sample_declares(name, walks);
            }
            id != program.core.surface_point || read.declares(name)
        };
        for (name, ty) in s.fields.iter().filter(|(name, _)| declared(name)) {
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

/// The fields of `SurfacePoint` that a material's functions read.
pub fn inputs(program_structs: &[crate::ir::Struct], functions: &[&Function]) -> InputSet {
    let mut set = InputSet::default();
    for f in functions {
        for id in f.evaluated() {
            let ExprKind::Field(base, i) = f.expr(id).kind else {
                continue;
            };
            let (ExprKind::Param(0), Type::Struct(s)) = (&f.expr(base).kind, f.ty(base)) else {
                continue;
            };
            let field = &program_structs[s.index()].fields[i as usize].0;
            Input::of_field(field)
                .into_iter()
                .for_each(|input| set.insert(input));
        }
    }
    set
}
