//! The text of the kernel: generated code of a material, and around it an entry point that makes a surface point of what
//! is given and writes what is asked for.

use std::fmt::Write;

use impasto_compiler::Program;
use impasto_compiler::abi::InputSet;
use impasto_compiler::ir::{Function, Struct, Type};

use super::inputs::{COUNT, FIELDS};
use crate::wgsl::{BufferData, ShaderPart};

/// What a material is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum What {
    /// f |cos| from `wi` to `wo` without discrete lobes (three numbers, 1/sr), and the density with which `wi` is sampled
    /// (1/sr).
    Scattering,
    /// The direction that `u` chooses (three numbers), its density (1/sr; 0 if it is discrete), f |cos| / pdf (three
    /// numbers), and 1 if it goes into another medium.
    Sample,
    /// The share of light that is scattered, seen from `wo` (three numbers).
    Albedo,
    /// The radiance toward `wo` (three numbers, W/(m^2 sr)).
    Emission,
}

impl What {
    /// Numbers of an item.
    pub fn width(self) -> usize {
        match self {
            What::Scattering => 4,
            What::Sample => 8,
            What::Albedo | What::Emission => 3,
        }
    }

    /// The numbers in WGSL.
    fn values(self, emits: bool) -> (&'static str, &'static [&'static str]) {
        match self {
            What::Scattering => (
                "let answer = evaluate_material(0u, point, wo, wi, u);",
                &[
                    "answer.light_throughput.x",
                    "answer.light_throughput.y",
                    "answer.light_throughput.z",
                    "answer.light_pdf",
                ],
            ),
            What::Sample => (
                "let answer = evaluate_material(0u, point, wo, vec3<f32>(0.0), u);",
                &[
                    "answer.wi.x",
                    "answer.wi.y",
                    "answer.wi.z",
                    "answer.pdf",
                    "answer.throughput.x",
                    "answer.throughput.y",
                    "answer.throughput.z",
                    "answer.transmitted",
                ],
            ),
            What::Albedo => ("let answer = material_albedo(0u, point, wo);", COLOR),
            What::Emission if emits => ("let answer = material_emission(0u, point, wo);", COLOR),
            What::Emission => ("let answer = vec3<f32>(0.0);", COLOR),
        }
    }
}

const COLOR: &[&str] = &["answer.x", "answer.y", "answer.z"];

/// Threads of a workgroup.
pub(super) const WORKGROUP: u32 = 64;
/// Workgroups in a row of a dispatch.
pub(super) const ROW: u32 = 1 << 15;
/// The buffer of what is given, and that of what is found.
pub(super) const GIVEN: &str = "given_words";
pub(super) const FOUND: &str = "found_numbers";

/// A kernel's text, and the contents of the buffers that it reads beside what is given.
pub(super) struct Text {
    pub wgsl: String,
    pub buffers: Vec<BufferData>,
    pub width: usize,
}

impl Text {
    pub(super) fn new(program: &Program, textures: Option<ShaderPart>, what: What) -> Self {
        let (code, textures) = textures.map(|part| (part.wgsl, part.buffers)).unzip();
        let tables = program.tables();
        let tables = tables.iter().map(BufferData::from);
        let buffers: Vec<BufferData> = tables.chain(textures.into_iter().flatten()).collect();
        let mut wgsl = declarations(&buffers);
        wgsl += &code.unwrap_or_default();
        let material = &program.compiled()[0];
        wgsl += &program.wgsl(&[0]);
        wgsl += HELPERS;
        wgsl += &surface_point(program, &material.evaluate, material.info.inputs);
        wgsl += &entry(what, material.info.varying_emission);
        Self {
            wgsl,
            buffers,
            width: what.width(),
        }
    }
}

fn declarations(buffers: &[BufferData]) -> String {
    let own = [
        (GIVEN, "array<u32>", "read"),
        (FOUND, "array<f32>", "read_write"),
    ];
    let others = buffers.iter().map(|b| (b.name, b.wgsl_type, "read"));
    let all = (0..).zip(own.into_iter().chain(others));
    all.map(|(index, (name, ty, access))| {
        format!("@group(0) @binding({index}) var<storage, {access}> {name}: {ty};\n")
    })
    .collect()
}

/// A number of an item, and two unit vectors in the surface, of which the first is along the tangent if there is one.
const HELPERS: &str = "
fn given(field: u32, item: u32, component: u32) -> f32 {
    return bitcast<f32>(given_words[given_words[2u * field] + given_words[2u * field + 1u] * item + component]);
}

fn across(n: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let side = cross(n, v);
    if dot(side, side) > 1e-12 {
        return normalize(side);
    }
    let axis = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(n.x) > 0.7);
    return normalize(cross(n, axis));
}
";

/// `given_point`: the surface point of an item, of which code reads some fields.
fn surface_point(program: &Program, evaluate: &Function, read: InputSet) -> String {
    let mut text = "\nfn given_point(item: u32) -> SurfacePoint {\n".to_owned();
    let mut line = |line: &str| {
        let _ = writeln!(text, "    {line}");
    };
    line("var point: SurfacePoint;");
    for name in ["geometric_normal", "tangent", "footprint", "wo"] {
        line(&format!("let {name} = {};", given(name)));
    }
    line("let y = across(geometric_normal, tangent);");
    line("let x = cross(y, geometric_normal);");
    let point = evaluate.params.first().map(|p| p.ty);
    let structs: &[Struct] = &program.ir().structs;
    let fields = match point {
        Some(Type::Struct(id)) => &structs[id.index()].fields[..],
        _ => &[],
    };
    for (name, ty) in fields.iter().filter(|(name, _)| read.declares(name)) {
        let value = match name.as_str() {
            "footprint_x" => "footprint * x".into(),
            "footprint_y" => "footprint * y".into(),
            "footprint_uv_x" | "footprint_uv1_x" => "vec2<f32>(footprint, 0.0)".into(),
            "footprint_uv_y" | "footprint_uv1_y" => "vec2<f32>(0.0, footprint)".into(),
            "view" => "wo".into(),
            "object_scale" => "1.0".into(),
            "object_from_world" | "world_from_object" => {
                "mat3x3<f32>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)".into()
            }
            name if FIELDS.iter().any(|field| field.name == name) && *ty == Type::Int => {
                format!("i32({})", given(name))
            }
            name if FIELDS.iter().any(|field| field.name == name) => given(name),
            // How colors change over the footprint is not given: they do not.
            _ => continue,
        };
        line(&format!(
            "point.{} = {value};",
            impasto_compiler::program::identifier(name)
        ));
    }
    line("return point;");
    text + "}\n"
}

/// A field of the item in WGSL.
fn given(name: &str) -> String {
    let index = FIELDS.iter().position(|field| field.name == name);
    let index = index.unwrap_or_default();
    let component = |c: usize| format!("given({index}u, item, {c}u)");
    match FIELDS[index].width {
        1 => component(0),
        width => {
            let components: Vec<String> = (0..width).map(component).collect();
            format!("vec{width}<f32>({})", components.join(", "))
        }
    }
}

fn entry(what: What, emits: bool) -> String {
    let (call, values) = what.values(emits);
    let width = values.len();
    let mut text = format!(
        "\n@compute @workgroup_size({WORKGROUP})\n\
         fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {{\n    \
         let item = (group.y * {ROW}u + group.x) * {WORKGROUP}u + lane;\n    \
         if item >= given_words[{COUNT}u] {{\n        return;\n    }}\n    \
         let point = given_point(item);\n"
    );
    for name in ["wo", "wi", "u"] {
        let _ = writeln!(text, "    let {name} = {};", given(name));
    }
    let _ = writeln!(text, "    {call}");
    for (at, value) in values.iter().enumerate() {
        let _ = writeln!(
            text,
            "    found_numbers[item * {width}u + {at}u] = {value};"
        );
    }
    text + "}\n"
}
