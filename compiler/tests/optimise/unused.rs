//! A material whose unused layers have weight zero is the same code as one written without them.

use impasto_compiler::MemoryLoader;
use impasto_compiler::ir::print;
use impasto_compiler::passes;

use super::corpus::{checked, evaluation};

/// The optimised evaluation of the material `m` whose surface is `surface`.
fn code(surface: &str) -> String {
    let text = format!(
        "use std::bsdf::{{blinn_phong, diffuse, mirror}};
         use std::noise::flakes;
         material m {{
             param amount: float = 0.0;
             let spots = flakes(position, normal, size: 1 mm);
             surface = {surface};
         }}"
    );
    let mut loader = MemoryLoader::default();
    loader.add("m.impasto", text);
    let checked = checked("m.impasto", &mut loader);
    let subject = evaluation(&checked.ir, &checked.checked[0], true);
    let mut module = subject.module;
    passes::library(&mut module, 0);
    let mut f = subject.function;
    passes::run(&module, &mut f);
    print::function(&module, &f)
}

#[test]
fn layers_of_weight_zero_leave_no_trace() {
    let plain = code("layer(mirror(1.5), diffuse(0.5))");
    let flakes = "amount * spots.weight * blinn_phong(900, normal: spots.normal)";
    for unused in [
        format!("layer(mirror(1.5), {flakes}, diffuse(0.5))"),
        format!("layer(mirror(1.5), layer({flakes}, diffuse(0.5)))"),
        format!("layer(mirror(1.5), {flakes} + diffuse(0.5))"),
        format!("mix(layer(mirror(1.5), diffuse(0.5)), {flakes}, amount)"),
        "layer(mirror(1.5), if amount > 0.0 { mirror(1.2) } else { diffuse(0.5) })".into(),
    ] {
        assert_eq!(code(&unused), plain, "{unused}");
    }
    assert_ne!(code(&flakes.replace("amount", "0.5")), plain);
}
