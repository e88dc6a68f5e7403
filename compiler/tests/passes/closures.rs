//! Pruning does not change what a material reflects.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Closure, Const, Function, Material, Module, verify};
use impasto_compiler::passes::pass;
use impasto_compiler::{Checked, MemoryLoader};

use super::lowered::{checked, evaluate};
use super::meaning::{Numbers, near};

/// Surfaces, with the number of lobes that are left of each. `t` and `c` are parameters.
const SURFACES: [(&str, usize); 10] = [
    ("layer(0.0 * shiny, mix(diffuse(c), diffuse(0.2), 0.0))", 1),
    ("mix(diffuse(color(0.0)), shiny, t)", 1),
    ("mix(shiny, diffuse(color(0.0)), t)", 1),
    (
        "layer(shiny, if t < 0.5 { diffuse(c) } else { diffuse(color(0.0)) })",
        2,
    ),
    ("layer(mix(shiny, 0.0 * diffuse(c), t), diffuse(c))", 2),
    (
        "layer(shiny, if t < 0.5 { 0.0 * shiny } else { diffuse(c) })",
        2,
    ),
    ("layer(t * diffuse(color(1.0)), diffuse(c))", 2),
    ("layer(1.0 * (c * diffuse(0.5)), shiny)", 2),
    ("0.5 * matte + 0.25 * matte", 2),
    ("layer(t * shiny, mix(matte, shiny, 1.0))", 2),
];

fn lobes(m: &Material) -> usize {
    let lobes = m.closures.iter();
    lobes.filter(|c| matches!(c, Closure::Lobe(_))).count()
}

/// The light that comes from a direction, by the numbers.
fn reflected(module: &Module, f: &Function, params: &[Const], args: &[Value<f64>]) -> Value<f64> {
    let mut run = Interpreter::<f64>::new(module, 1 << 22).with_params(params);
    let sample = run.run(f, args.to_vec()).expect("fuel");
    let structs = module.structs.iter();
    let fields = &structs
        .clone()
        .find(|s| s.name == "MaterialSample")
        .expect("a struct of the core")
        .fields;
    let index = fields
        .iter()
        .position(|f| f.0 == "light_throughput")
        .expect("a field");
    sample.field(index).expect("a field").clone()
}

/// A material with a surface.
fn with_surface(surface: &str) -> Checked {
    let mut files = MemoryLoader::default();
    let text = format!(
        "use std::bsdf::{{diffuse, blinn_phong}};
         material m {{
             param t: float = 0.3 in 0.0 .. 1.0;
             param c: color = color(0.2, 0.5, 0.9);
             let shiny = blinn_phong(exponent: 20.0);
             let matte = diffuse(c);
             let _unused = layer(shiny, matte);
             surface = {surface};
         }}"
    );
    files.add("m.impasto", text);
    checked("m.impasto", &mut files)
}

#[test]
fn pruning_keeps_what_a_material_reflects() {
    for (surface, left) in SURFACES {
        let checked = with_surface(surface);
        let mut pruned = checked.checked[0].clone();
        let prune = pass("prune").expect("a row");
        let done = prune.run_on_material(&checked.ir, &mut pruned, &[]);
        assert!(done.is_ok());
        verify::material(&checked.ir, &pruned).expect("well-formed");
        assert_eq!(lobes(&pruned), left, "{surface}");
        // A closure that is used twice is as if it were written twice.
        let written_out = surface
            .replace("shiny", "blinn_phong(exponent: 20.0)")
            .replace("matte", "diffuse(c)");
        let reference = with_surface(&written_out);
        let (before, after) = (
            (&reference.ir, &reference.checked[0]),
            (&checked.ir, &pruned),
        );
        compare(surface, before, after);
    }
}

/// Compares two materials, each over its module.
fn compare(surface: &str, before: (&Module, &Material), after: (&Module, &Material)) {
    let (f, g) = (evaluate(before.0, before.1), evaluate(after.0, after.1));
    let (mut numbers, mut lit) = (Numbers(3), 0);
    for _ in 0..50 {
        let params = [
            Const::Float(vec![numbers.unit()]),
            Const::Float([(); 3].map(|()| numbers.unit()).to_vec()),
        ];
        let args = view(before.0, &f, &mut numbers);
        let old = reflected(before.0, &f, &params, &args);
        let new = reflected(after.0, &g, &params, &args);
        assert!(
            near(&old, &new),
            "{surface}: {params:?} was {old:?} and is {new:?}"
        );
        lit += usize::from(old.to_f64().iter().any(|&x| x > 0.0));
    }
    assert!(lit > 40, "{surface}: only {lit} of 50 are lit");
}

/// A flat point, and directions on its front.
fn view(module: &Module, f: &Function, numbers: &mut Numbers) -> Vec<Value<f64>> {
    let direction = |numbers: &mut Numbers| {
        let (z, a) = (
            0.05 + 0.95 * numbers.unit(),
            std::f64::consts::TAU * numbers.unit(),
        );
        let s = (1.0 - z * z).sqrt();
        Value::vector(&[s * a.cos(), s * a.sin(), z])
    };
    let structs = module.structs.iter();
    let point = structs
        .clone()
        .find(|s| s.name == "SurfacePoint")
        .expect("a struct of the core");
    let fields = point.fields.iter().map(|(name, ty)| match name.as_str() {
        "normal" | "geometric_normal" => Value::vector(&[0.0, 0.0, 1.0]),
        "tangent" => Value::vector(&[1.0, 0.0, 0.0]),
        "exterior_ior" => Value::float(1.0),
        _ => numbers.value(module, *ty),
    });
    let point = Value::Struct(fields.collect());
    let u = [(); 4].map(|()| numbers.unit());
    assert_eq!(f.params.len(), 4);
    vec![
        point,
        direction(numbers),
        direction(numbers),
        Value::vector(&u),
    ]
}
