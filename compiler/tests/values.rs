//! Other values and the same code: a program that is given values is the one that is compiled with them.

use impasto_compiler::{
    MaterialRequest, MemoryLoader, Moment, ParameterValue, Parameters, Program, Unfit, compile,
    diag, with_values,
};

const PAINT: &str = "
use std::bsdf::{blinn_phong, diffuse, mirror};
const RED: color = srgb(0x8c1010);
material paint {
    param tint: color = srgb(0x8c1010);
    param gloss: float = 40.0 in 1.0 .. 1000.0;
    param size: length = 3 mm in 0.1 mm .. 1 m;
    param coated: bool = true;
    param seed: int = 3;
    param map: texture = \"a.png\";
    let spots = unit_float(hash(int((position / size).x), seed));
    let coat = if coated { mirror(1.5) } else { mirror(1.2) };
    let t = image(map, uv) * (1.0 + 0.1 * sin(time));
    surface = layer(coat, 0.5 * spots * blinn_phong(gloss), diffuse(mix(RED, tint, 0.9) * t * 0.5));
}";

const LAMP: &str = "
use std::edf::uniform;
use std::bsdf::mirror;
material lamp {
    param power: float = 1.0;
    param waves: float = 0.0;
    param filled: bool = true;
    emission = power * (1.0 + waves * sin(position.x)) * uniform(2.0);
    surface = mirror(1.5);
}";

fn loader() -> MemoryLoader {
    let mut loader = MemoryLoader::default();
    loader.add("paint.impasto", PAINT);
    loader.add("lamp.impasto", LAMP);
    loader
}

fn request(name: &str, params: &[(&str, ParameterValue)]) -> MaterialRequest {
    MaterialRequest {
        params: params
            .iter()
            .map(|(name, value)| ((*name).to_owned(), value.clone()))
            .collect(),
        parameters: Parameters::Table,
        moment: Some(Moment::default()),
        ..MaterialRequest::new(name, format!("{name}.impasto"))
    }
}

fn compiled(requests: &[MaterialRequest]) -> Program {
    let compiled = compile(requests, &mut loader());
    let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled.program.unwrap_or_else(|| panic!("{text}"))
}

/// Everything that a renderer sees of a program.
fn seen(program: &Program) -> String {
    let all: Vec<usize> = (0..program.materials().len()).collect();
    let infos: Vec<_> = program.instances().iter().map(|i| &i.info).collect();
    format!(
        "{} {:?} {:?} {infos:?}",
        program.wgsl(&all),
        program.infos(),
        program.tables()
    )
}

use ParameterValue::{Bool, Float, Floats, Int, Texture};

#[test]
fn given_values_are_compiled_values() {
    let first = [request("paint", &[]), request("lamp", &[])];
    let program = compiled(&first);
    type Given<'a> = &'a [(&'a str, ParameterValue)];
    let cases: [(Given, Given); 5] = [
        (&[("gloss", Float(80.0)), ("coated", Bool(false))], &[]),
        (
            &[("tint", Floats(vec![0.1, 0.5, 0.9])), ("seed", Int(9))],
            &[("power", Float(3.0))],
        ),
        (
            &[("size", "7 mm".into()), ("map", Texture("a.png".into()))],
            &[("power", Int(0))],
        ),
        (&[("tint", "srgb(0x20ff40)".into())], &[]),
        (&[], &[]),
    ];
    let mut before = program.clone();
    for (paint, lamp) in cases {
        let mut requests = [request("paint", paint), request("lamp", lamp)];
        requests[0].moment = Some(Moment {
            frame: 5.0,
            time: 0.2,
        });
        let expected = seen(&compiled(&requests));
        // From the first values and from those before.
        for from in [&program, &before] {
            let next = with_values(from, &requests).ok().expect("the same code");
            assert_eq!(seen(&next), expected);
        }
        before = with_values(&program, &requests)
            .ok()
            .expect("the same code");
    }
}

#[test]
fn wrong_values_are_told_as_the_compiler_does() {
    let program = compiled(&[request("paint", &[])]);
    let cases: [(&str, ParameterValue); 4] = [
        ("gloss", Float(0.5)),
        ("gloss", Bool(true)),
        ("shine", Float(0.5)),
        ("size", "2 m".into()),
    ];
    for (name, value) in cases {
        let requests = [request("paint", &[(name, value)])];
        let expected = compile(&requests, &mut loader());
        let expected = diag::render::text(&expected.sources, &expected.diagnostics, false);
        match with_values(&program, &requests) {
            Err(Unfit::Wrong(sources, found)) => {
                assert_eq!(diag::render::text(&sources, &found, false), expected);
            }
            _ => panic!("{name}: {expected}"),
        }
    }
}

#[test]
fn what_takes_other_code_is_said() {
    let why =
        |from: &[MaterialRequest], to: &[MaterialRequest]| match with_values(&compiled(from), to) {
            Err(Unfit::Code(why)) => why,
            Err(Unfit::Wrong(..)) => "wrong".into(),
            Ok(_) => "fits".into(),
        };
    let paint = [request("paint", &[])];
    let with = |name, value| [request("paint", &[(name, value)])];
    assert_eq!(
        why(&paint, &with("map", Texture("b.png".into()))),
        "`map` is another texture"
    );
    let named = why(&paint, &with("tint", "0.5 * RED".into()));
    assert_eq!(named, "an expression needs its material's file");
    let mut baked = paint.clone();
    baked[0].parameters = Parameters::Baked;
    assert_eq!(
        why(&baked, &with("gloss", Float(3.0))),
        "`gloss` is a constant of the code"
    );
    assert_eq!(why(&baked, &paint), "fits");
    let lamp = [request("lamp", &[])];
    let waves = [request("lamp", &[("waves", Float(1.0))])];
    assert_ne!(why(&lamp, &waves), "wrong");
    assert!(why(&paint, &[]).starts_with("there are more or fewer"));
}
