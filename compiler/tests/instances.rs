//! One topology, one shader: what instances of a material share, and what differs between them.

use impasto_compiler::abi::{self, Emission};
use impasto_compiler::{MaterialRequest, MemoryLoader, Parameters, Program, compile, diag};

use crate::common::answered;

const PAINT: &str = "
use std::bsdf::{blinn_phong, diffuse, mirror};
material paint {
    param tint: color = srgb(0x8c1010);
    param gloss: float = 40.0 in 1.0 .. 1000.0;
    param amount: float = 0.5 in 0.0 .. 1.0;
    param coated: bool = true;
    param seed: int = 3;
    let spots = unit_float(hash(int(position.x * 8.0), seed));
    let coat = if coated { mirror(1.5) } else { mirror(1.2) };
    surface = layer(coat, amount * spots * blinn_phong(gloss), diffuse(tint));
}";

const LAMP: &str = "
use std::edf::uniform;
material lamp {
    param power: float = 1.0;
    param waves: float = 0.0;
    emission = power * (1.0 + waves * sin(position.x)) * uniform(2.0);
}";

/// A request with parameters written as `name = value; name = value`.
fn request(name: &str, file: &str, params: &str) -> MaterialRequest {
    let pairs = params.split(';').filter_map(|p| p.split_once('='));
    let pairs = pairs.map(|(n, v)| (n.trim().to_owned(), v.trim().into()));
    MaterialRequest {
        params: pairs.collect(),
        ..MaterialRequest::new(name, file)
    }
}

fn program(files: &[(&str, &str)], requests: &[MaterialRequest]) -> Program {
    let mut loader = MemoryLoader::default();
    for (name, text) in files {
        loader.add(*name, *text);
    }
    let compiled = compile(requests, &mut loader);
    let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled.program.unwrap_or_else(|| panic!("{text}"))
}

fn paints(params: &[&str]) -> Program {
    let requests: Vec<MaterialRequest> = params
        .iter()
        .enumerate()
        .map(|(i, p)| request(&format!("paint_{i}"), "paint.impasto", p))
        .collect();
    program(&[("paint.impasto", PAINT)], &requests)
}

/// What an instance answers at a few points: every number of its samples.
fn answers(program: &Program, instance: usize) -> Vec<f64> {
    answered::samples(program, instance).concat()
}

#[test]
fn instances_share_code_and_keep_their_values() {
    let params = [
        "tint = color(0.1, 0.2, 0.3); gloss = 10.0",
        "amount = 1.0; coated = false; seed = 8",
        "",
        "gloss = 900.0; seed = -5; tint = color(1.0, 0.0, 0.5)",
    ];
    let shared = paints(&params);
    assert_eq!(shared.materials().len(), 1);
    assert_eq!(shared.instances().len(), 4);
    for (i, p) in params.iter().enumerate() {
        let alone = paints(&[p]);
        assert_eq!(answers(&shared, i), answers(&alone, 0), "instance {i}: {p}");
    }
    assert_ne!(answers(&shared, 0), answers(&shared, 2));
}

#[test]
fn the_table_holds_what_instances_differ_in() {
    // Every instance has this gloss: it is a constant of the code.
    let gloss = "gloss = 123.0";
    let shared = paints(&[gloss, "gloss = 123.0; amount = 0.25"]);
    let wgsl = shared.wgsl(&[0]);
    assert!(wgsl.contains("material_parameters[row"), "{wgsl}");
    let tables = shared.tables();
    let names: Vec<&str> = tables.iter().map(|t| t.name).collect();
    assert_eq!(names, [abi::INSTANCES, abi::PARAMETERS]);
    assert_eq!(tables[0].words, [0, 0, 0, 1]);
    let amounts: Vec<f32> = [0, 4].map(|i| f32::from_bits(tables[1].words[i])).to_vec();
    assert_eq!(amounts, [0.5, 0.25]);
    assert_eq!(tables[1].words.len(), 8, "one row of four words each");
}

#[test]
fn instances_that_agree_need_no_table() {
    let one = paints(&["gloss = 10.0"]);
    assert!(one.tables().is_empty());
    let equal = paints(&["gloss = 10.0", "gloss = 10.0"]);
    assert_eq!(equal.materials().len(), 1);
    assert_eq!(one.wgsl(&[0]), equal.wgsl(&[0]));
}

#[test]
fn baking_gives_each_setting_code_of_its_own() {
    let mut requests = vec![
        request("a", "paint.impasto", "gloss = 10.0"),
        request("b", "paint.impasto", "gloss = 20.0"),
        request("c", "paint.impasto", "gloss = 10.0"),
    ];
    requests
        .iter_mut()
        .for_each(|r| r.parameters = Parameters::Baked);
    let baked = program(&[("paint.impasto", PAINT)], &requests);
    assert_eq!(
        baked.materials().len(),
        2,
        "equal settings share code still"
    );
    let materials: Vec<usize> = baked.instances().iter().map(|i| i.info.material).collect();
    assert_eq!(materials, [0, 1, 0]);
    assert!(!baked.wgsl(&[0, 1]).contains(abi::PARAMETERS));
    let alone = paints(&["gloss = 20.0"]);
    assert_eq!(answers(&baked, 1), answers(&alone, 0));
}

#[test]
fn code_can_be_asked_for_that_holds_for_any_values() {
    let mut requests = vec![request("a", "paint.impasto", "gloss = 10.0")];
    requests[0].parameters = Parameters::Table;
    let open = program(&[("paint.impasto", PAINT)], &requests);
    assert_eq!(open.tables().len(), 2);
    // Of `coated` and `gloss` the kernel reads what the host makes of them.
    for name in ["tint", "amount", "seed"] {
        assert!(
            open.wgsl(&[0]).contains(&format!("let {name} = ")),
            "{name}"
        );
    }
    assert_eq!(answers(&open, 0), answers(&paints(&["gloss = 10.0"]), 0));
}

#[test]
fn a_thousand_instances_of_ten_materials_are_ten_shaders() {
    let files: Vec<(String, String)> = (0..10)
        .map(|i| {
            (
                format!("m{i}.impasto"),
                PAINT.replace("paint", &format!("paint_{i}")),
            )
        })
        .collect();
    let files: Vec<(&str, &str)> = files
        .iter()
        .map(|(n, t)| (n.as_str(), t.as_str()))
        .collect();
    let requests: Vec<MaterialRequest> = (0..1000)
        .map(|i| {
            let params = format!("gloss = {}.5; amount = {}", 1 + i / 10, i as f32 / 1000.0);
            request(&format!("object_{i}"), files[i % 10].0, &params)
        })
        .collect();
    let program = program(&files, &requests);
    assert_eq!(program.materials().len(), 10);
    assert_eq!(program.instances().len(), 1000);
    let all: Vec<usize> = (0..10).collect();
    let functions = program.wgsl(&all).matches("fn evaluate_paint_").count();
    assert_eq!(functions, 10);
    let instance = &program.instances()[734];
    assert_eq!(
        (instance.info.name.as_str(), instance.info.material),
        ("object_734", 4)
    );
}

#[test]
fn names_of_parameters_and_instances_stay_their_own() {
    let files = |paint: &str| {
        program(
            &[("paint.impasto", paint), ("lamp.impasto", LAMP)],
            &[
                request("first", "paint.impasto", ""),
                request("second", "paint.impasto", ""),
                request("lamp", "lamp.impasto", "power = 2.0"),
                request("lamp_2", "lamp.impasto", "waves = 0.5"),
            ],
        )
    };
    let renamed = PAINT.replace("gloss", "lamp").replace("tint", "row");
    let (before, after) = (files(PAINT), files(&renamed));
    assert_eq!(before.wgsl(&[1]), after.wgsl(&[1]));
    let mut requests = vec![
        request("x", "paint.impasto", "gloss = 20.0"),
        request("y", "paint.impasto", ""),
    ];
    let before = program(&[("paint.impasto", PAINT)], &requests);
    requests[0].name = "row".into();
    requests[1].name = "material".into();
    let after = program(&[("paint.impasto", PAINT)], &requests);
    assert_eq!(before.wgsl(&[0]), after.wgsl(&[0]));
}

#[test]
fn lamps_are_sampled_unless_one_of_their_kind_varies() {
    let lamps = |params: &[&str]| -> Vec<Emission> {
        let requests: Vec<MaterialRequest> = params
            .iter()
            .map(|p| request("lamp", "lamp.impasto", p))
            .collect();
        let program = program(&[("lamp.impasto", LAMP)], &requests);
        let varies = program.materials().next().expect("one").varying_emission;
        assert_eq!(varies, program.wgsl(&[0]).contains("fn material_emission("));
        program
            .instances()
            .iter()
            .map(|i| i.info.emission)
            .collect()
    };
    let steady = lamps(&["", "power = 3.0", "power = 0.0"]);
    let uniform = |x: f32| Emission::Uniform([x; 3]);
    assert_eq!(steady, [uniform(2.0), uniform(6.0), Emission::None]);
    // Code that depends on the position serves all of them.
    let mixed = lamps(&["", "waves = 0.5", "power = 0.0"]);
    assert!(
        mixed.contains(&Emission::Varying) && !mixed.contains(&uniform(2.0)),
        "{mixed:?}"
    );
}
