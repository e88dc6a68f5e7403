//! From an instance to the code of its material: the functions that kernels call.

use std::fmt::Write;

use super::{albedo_name, emission_name, evaluate_name, normal_name};
use crate::abi::{ALBEDO, EMISSION, EVALUATE, INSTANCES, MATERIAL_OF, NORMAL};
use crate::program::Program;

/// The functions that the kernels call.
pub fn dispatch(program: &Program, members: &[usize], out: &mut String) {
    let _ = writeln!(
        out,
        "fn {EVALUATE}(instance: u32, point: SurfacePoint, wo: vec3f, wl: vec3f, u: vec4f) -> MaterialSample {{"
    );
    let evaluate = Dispatch {
        program,
        name: evaluate_name,
        args: "point, wo, wl, u",
        otherwise: "MaterialSample()",
    };
    evaluate.print(members, members.len() == 1, out);
    let emits = |m: &&usize| program.materials[**m].info.varying_emission;
    let emitters: Vec<usize> = members.iter().filter(emits).copied().collect();
    if !emitters.is_empty() {
        let _ = writeln!(
            out,
            "\nfn {EMISSION}(instance: u32, point: SurfacePoint, wo: vec3f) -> vec3f {{"
        );
        let emission = Dispatch {
            program,
            name: emission_name,
            args: "point, wo",
            otherwise: "vec3f()",
        };
        emission.print(&emitters, members.len() == 1, out);
    }
    if program.has_looks() {
        looks(program, members, (ALBEDO, albedo_name, "vec3f()"), out);
        looks(program, members, (NORMAL, normal_name, "point.normal"), out);
    }
}

/// A function that says how a material looks.
fn looks(
    program: &Program,
    members: &[usize],
    (function, name, otherwise): (&str, fn(&str) -> String, &'static str),
    out: &mut String,
) {
    let _ = writeln!(
        out,
        "\nfn {function}(instance: u32, point: SurfacePoint, wo: vec3f) -> vec3f {{"
    );
    let dispatch = Dispatch {
        program,
        name,
        args: "point, wo",
        otherwise,
    };
    dispatch.print(members, members.len() == 1, out);
}

/// A call of one function of the material of an instance.
struct Dispatch<'p> {
    program: &'p Program,
    /// The function's name for a material's.
    name: fn(&str) -> String,
    args: &'p str,
    /// What an instance of no such material gives.
    otherwise: &'p str,
}

impl Dispatch<'_> {
    /// A switch over materials, or a plain call where the instance can only be of one.
    fn print(&self, materials: &[usize], only: bool, out: &mut String) {
        let rows = |m: &usize| self.program.materials[*m].layout.rows > 0;
        let rows = materials.iter().any(rows);
        let material = if rows || (self.program.has_instance_table() && !only) {
            let _ = writeln!(out, "    let entry = {INSTANCES}[instance];");
            "entry.x"
        } else {
            "instance"
        };
        if only {
            let _ = writeln!(out, "    return {};\n}}", self.call(materials[0]));
            return;
        }
        let _ = writeln!(out, "    switch {material} {{");
        for &m in materials {
            let _ = writeln!(out, "        case {m}u: {{ return {}; }}", self.call(m));
        }
        let otherwise = self.otherwise;
        let _ = writeln!(
            out,
            "        default: {{ return {otherwise}; }}\n    }}\n}}"
        );
    }

    fn call(&self, material: usize) -> String {
        let material = &self.program.materials[material];
        let row = if material.layout.rows > 0 {
            "entry.y, "
        } else {
            ""
        };
        format!("{}({row}{})", (self.name)(&material.info.name), self.args)
    }
}

/// `material_of`, by table where there is one.
pub fn lookup(program: &Program) -> String {
    let value = if program.has_instance_table() {
        format!("{INSTANCES}[instance].x")
    } else {
        "instance".to_owned()
    };
    format!("fn {MATERIAL_OF}(instance: u32) -> u32 {{\n    return {value};\n}}\n")
}
