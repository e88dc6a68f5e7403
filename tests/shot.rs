//! Pictures of one thing again and again share what they can: code, and the trees over geometry.

use impasto::compiler::{MemoryLoader, Moment, Program, compile};
use impasto::runtime::scene::{Asked, FilmSettings};
use impasto::set::{Sample, Set};
use impasto::shot::param;
use impasto::shot::sweep::{Sweep, firsts, shares_code};
use impasto::shot::{Studio, Subject, open_requests};
use impasto::{Choice, Device, DeviceOptions, MaterialRequest, RenderOptions, Scene};

const FILE: &str = "paint.impasto";

const PAINT: &str = "use std::bsdf::{clear_coat, diffuse};
material paint {
    param roughness: float = 0.25 in 0.0 .. 1.0;
    param wear: float = 0.0 in 0.0 .. 1.0;
    let faded = wear * (0.5 + 0.5 * sin(time));
    surface = layer(clear_coat(roughness: roughness), diffuse(color(0.6 * (1.0 - faded))));
}
";

fn subject() -> Subject {
    let sample = Sample {
        file: FILE.into(),
        material: None,
        turntable: Some(8),
    };
    Subject::on(Set::Ball, &sample).expect("a set")
}

fn scene(subject: &Subject, asked: &Asked) -> Scene {
    let mut scene = subject.scene(asked).expect("a scene");
    scene.film = FilmSettings {
        width: 16,
        height: 16,
    };
    scene
}

fn compiled(requests: &[MaterialRequest], text: &str) -> Program {
    let mut files = MemoryLoader::default();
    files.add(FILE, text);
    for name in ["ground", "core"] {
        let path = format!("{}/src/set/{name}.impasto", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("a material of the sets");
        files.add(format!("set/{name}.impasto"), text);
    }
    compile(requests, &mut files).program.expect("it compiles")
}

fn device() -> Device {
    let options = DeviceOptions {
        choice: Choice::Cpu,
        ..DeviceOptions::default()
    };
    Device::open(&options).expect("the processor")
}

/// The texts of the kernels that render a scene, and its picture.
fn rendered(
    studio: &Studio<'_>,
    scene: &Scene,
    program: &Program,
    first: usize,
) -> (Vec<String>, Vec<[f32; 3]>) {
    let options = RenderOptions {
        samples: 2,
        ..RenderOptions::default()
    };
    let renderer = studio.renderer(scene, program, first, &options);
    let mut renderer = renderer.expect("it is built");
    let kernels = renderer
        .kernels()
        .map(|(_, wgsl)| wgsl.to_owned())
        .collect();
    let rendering = renderer.render(&mut |_| std::ops::ControlFlow::Continue(()));
    (kernels, rendering.expect("it renders").film.pixels)
}

#[test]
fn pictures_of_a_sheet_run_one_code() {
    let subject = subject();
    let options = [param::parse("roughness=0:1:3").expect("a sweep")];
    let (given, axes) = param::given(&options, &subject, &[]).expect("it fits");
    let asked = Asked { given, frame: 0.0 };
    let sweep = Sweep::new(axes).expect("a sheet");
    let (requests, counts) = sweep.requests(&subject, &asked).expect("scenes");
    let program = compiled(&requests, PAINT);
    assert!(shares_code(&program, &counts));
    let device = device();
    let studio = Studio::new(std::slice::from_ref(&device));
    let mut seen: Vec<(Vec<String>, Vec<[f32; 3]>)> = Vec::new();
    for (index, first) in firsts(&counts).into_iter().enumerate() {
        let scene = scene(&subject, &sweep.asked(&asked, index));
        seen.push(rendered(&studio, &scene, &program, first));
    }
    assert!(seen.windows(2).all(|pair| pair[0].0 == pair[1].0));
    assert!(seen.windows(2).all(|pair| pair[0].1 != pair[1].1));
}

#[test]
fn other_values_and_other_times_need_no_other_code() {
    let (subject, device) = (subject(), device());
    let studio = Studio::new(std::slice::from_ref(&device));
    let scene = scene(&subject, &Asked::default());
    let of = |text: &str, moment: Option<Moment>| {
        let mut requests = open_requests(&scene);
        requests
            .iter_mut()
            .for_each(|request| request.moment = moment);
        rendered(&studio, &scene, &compiled(&requests, text), 0)
    };
    let now = Some(Moment::of_frame(0.0, 24.0));
    let first = of(PAINT, now);
    let rough = of(&PAINT.replace("0.25", "0.75"), now);
    assert!(first.0 == rough.0 && first.1 != rough.1);
    let worn = PAINT.replace("wear: float = 0.0", "wear: float = 0.5");
    let (worn, later) = (
        of(&worn, now),
        of(&worn, Some(Moment::of_frame(30.0, 24.0))),
    );
    assert!(worn.0 == first.0 && later.0 == first.0 && worn.1 != later.1);
    // Other code is other code.
    let placed = PAINT.replace("sin(time)", "sin(time + position.x)");
    assert!(of(&placed, now).0 != first.0);
}

#[test]
fn times_that_are_no_numbers_are_refused() {
    let mut request = MaterialRequest::new("paint", FILE);
    let mut files = MemoryLoader::default();
    files.add(FILE, PAINT);
    for time in [f64::NAN, f64::INFINITY, 1e39] {
        request.moment = Some(Moment { frame: 0.0, time });
        let compiled = compile(std::slice::from_ref(&request), &mut files);
        assert!(compiled.program.is_none(), "{time} is taken");
        let said = &compiled.diagnostics[0].message;
        assert!(said.starts_with("the time is"), "{said}");
    }
}
