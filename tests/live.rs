//! The engine behind the window, driven without one: what it shows after each order, and what it leaves as it is.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

use impasto::compiler::ParameterValue;
use impasto::compiler::interface::Value;
use impasto::live::engine::{
    Answer, Engine, LayerKind, News, Order, ParamId, Picture, PictureLayer, State,
};
use impasto::live::{Live, LiveOptions};
use impasto::runtime::film::file::FilmFile;
use impasto::runtime::scene::{Asked, Camera, FilmSettings, GivenParam};
use impasto::set::{Sample, Set};
use impasto::shot::Subject;
use impasto::{Choice, Device, DeviceOptions, RenderOptions, Renderer, Strategy};
use tempfile::TempDir;

const PAINT: &str = "use std::bsdf::{clear_coat, diffuse};
/// Paint.
material paint {
    /// How rough its coat is.
    param roughness: float = 0.25 in 0.0 .. 1.0;
    param tint: color = color(0.5, 0.2, 0.1);
    surface = layer(clear_coat(roughness: roughness), diffuse(tint));
}
";

const LAMP: &str = "use std::edf::uniform;
use std::bsdf::diffuse;
material lamp {
    param power: float = 1.0 in 0.0 .. 100.0;
    emission = power * uniform(color(1.0, 0.9, 0.8));
    surface = diffuse(color(0.2));
}
";

const SCENE: &str = "# A wall and a lamp.
[camera]
position = [0.0, 0.0, 3.0]   # in front
look_at = [0.0, 0.0, 0.0]
fov = 40

[film]
width = 16
height = 12

[[geometry]]
file = \"wall.obj\"

# As it was measured.
[materials.wall]
file = \"paint.impasto\"
params = { roughness = 0.5 } # of the day

[materials.bulb]
file = \"lamp.impasto\"
params = { power = 4.0 }
";

const WALL: &str = "o wall
v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0
usemtl wall
f 1 2 3 4
o bulb
v -0.3 0.6 0.5\nv 0.3 0.6 0.5\nv 0 1 0.5
usemtl bulb
f 5 7 6\n";

const TRIANGLE: &str = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
"meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
"accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [-1, -1, 0], "max": [1, 1, 0] }],
"bufferViews": [{ "buffer": 0, "byteLength": 36 }],
"buffers": [{ "byteLength": 36, "uri":
    "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA" }] }"#;

/// How long anything may take where other work goes on.
const LONG: Duration = Duration::from_secs(90);

fn device(choice: Choice) -> DeviceOptions {
    DeviceOptions {
        choice,
        ..DeviceOptions::default()
    }
}

fn options(choice: Choice) -> LiveOptions {
    LiveOptions {
        device: device(choice),
        size: Some([16, 12]),
        samples: 8,
        ..LiveOptions::default()
    }
}

/// Files, and an engine that shows one of them.
struct Room {
    folder: TempDir,
    live: Arc<Live>,
    /// The states that were told.
    states: Arc<Mutex<Vec<State>>>,
}

impl Room {
    fn new(file: &str, options: LiveOptions) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in [
            ("paint.impasto", PAINT),
            ("lamp.impasto", LAMP),
            ("scene.toml", SCENE),
            ("wall.obj", WALL),
        ] {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        let live = Live::new(&folder.path().join(file), options).expect("threads");
        let live = Arc::new(live);
        let states: Arc<Mutex<Vec<State>>> = Arc::default();
        let (seen, own): (_, Weak<Live>) = (states.clone(), Arc::downgrade(&live));
        live.on_news(Box::new(move || {
            if let Some(live) = own.upgrade() {
                seen.lock().expect("states").push(live.news().state);
            }
        }));
        Self {
            folder,
            live,
            states,
        }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.at(name), text).expect("written");
    }

    /// News of which something holds.
    #[track_caller]
    fn wait(&self, what: &str, holds: impl Fn(&News) -> bool) -> News {
        let begin = Instant::now();
        loop {
            let news = self.live.news();
            if holds(&news) {
                return news;
            }
            let texts: Vec<&str> = news.problems.iter().map(|p| p.text.as_str()).collect();
            assert!(
                begin.elapsed() < LONG,
                "no {what}: {:?} {texts:?}",
                news.state
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// A picture after the one of this number.
    #[track_caller]
    fn picture_after(&self, number: u64) -> Arc<Picture> {
        let has_one = |news: &News| news.picture.as_ref().is_some_and(|p| p.number > number);
        self.wait("picture", has_one).picture.expect("a picture")
    }

    #[track_caller]
    fn answer(&self, order: Order) -> Answer {
        self.live.order(order);
        let begin = Instant::now();
        loop {
            if let Some(answer) = self.live.answers().pop() {
                return answer;
            }
            assert!(begin.elapsed() < LONG, "no answer");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// What is shown, as it is saved.
    #[track_caller]
    fn film(&self) -> FilmFile {
        let path = self.at("shown.film");
        let answer = self.answer(Order::Save {
            path: path.clone(),
            exposure: 0.0,
        });
        assert!(matches!(answer, Answer::Saved(Ok(_))), "{answer:?}");
        FilmFile::read(&path).expect("a film")
    }

    /// The picture once all is done.
    #[track_caller]
    fn rested(&self) -> News {
        // An order may not have been followed yet.
        std::thread::sleep(Duration::from_millis(300));
        self.wait("end", |news| news.state == State::Done)
    }
}

/// One film is of the same as the other, and has the same bits.
#[track_caller]
fn check(film: &FilmFile, expected: &FilmFile) {
    assert_eq!(film.sums, expected.sums);
    assert_eq!(film.about.identity, expected.about.identity);
    assert_eq!(film.about.ranges, expected.about.ranges);
}

fn set(binding: &str, param: &str, value: ParameterValue, dragged: bool) -> Order {
    let (binding, param) = (binding.into(), param.into());
    Order::Set {
        param: ParamId { binding, param },
        value,
        dragged,
    }
}

fn value(news: &News, param: &str) -> Value {
    let mut params = news.project.bindings.iter().flat_map(|b| &b.params);
    let found = params.find(|p| p.interface.name == param);
    found.expect("a parameter").value.clone()
}

/// The film of `impasto render` of what is at `path`, from a camera and with values.
fn rendered(
    path: &Path,
    choice: Choice,
    camera: Option<Camera>,
    values: &[(&str, &str, f64)],
) -> FilmFile {
    let subject = if path.extension().is_some_and(|e| e == "toml") {
        Subject::of_scene(path)
    } else {
        let sample = Sample {
            file: path.to_string_lossy().into_owned(),
            material: None,
            turntable: None,
        };
        Subject::on(Set::Ball, &sample)
    };
    let given = values.iter().map(|(binding, param, value)| GivenParam {
        binding: (*binding).into(),
        param: (*param).into(),
        value: ParameterValue::Float(*value),
        origin: "given".into(),
    });
    let asked = Asked {
        given: given.collect(),
        ..Asked::default()
    };
    let mut scene = subject.and_then(|s| s.scene(&asked)).expect("a scene");
    scene.film = FilmSettings {
        width: 16,
        height: 12,
    };
    scene.camera = camera.unwrap_or(scene.camera);
    let program = impasto::compile(&scene).expect("it compiles");
    let plan = impasto::plan(&program, Strategy::OWN).expect("a plan");
    let device = Device::open(&device(choice)).expect("a device");
    let options = RenderOptions {
        samples: 8,
        ..RenderOptions::default()
    };
    let renderer = Renderer::new(&device, &scene, &program, &plan, &options);
    let rendering = renderer
        .expect("it is built")
        .render(&mut |_| std::ops::ControlFlow::Continue(()));
    rendering.expect("it renders").sums
}

#[test]
fn what_is_left_alone_has_the_bits_of_a_render() {
    for choice in [Choice::Cpu, Choice::Gpu] {
        let room = Room::new("paint.impasto", options(choice));
        let first = room.picture_after(0);
        assert_eq!((first.width, first.height), (16, 12));
        let news = room.rested();
        let picture = news.picture.expect("a picture");
        assert_eq!((picture.samples, picture.samples_asked), (8, 8));
        assert!(news.problems.is_empty(), "{:?}", news.problems);
        assert!(picture.counts.iter().all(|count| *count == 8));
        let saved = room.film();
        let expected = rendered(&room.at("paint.impasto"), choice, None, &[]);
        check(&saved, &expected);
        assert_eq!(*picture.pixels, expected.sums.picture().pixels);
    }
}

#[test]
fn the_processor_stands_in_while_a_driver_compiles() {
    // Drivers keep kernels on disk: none may have seen this code.
    let source = include_str!("../materials/car_paint.impasto");
    let since = std::time::UNIX_EPOCH.elapsed().expect("a clock");
    let unseen = format!("seed: {}", since.as_micros() % 1_000_000_000);
    let edited = source.replace("seed: 1", &unseen);
    assert_ne!(edited, source);

    let room = Room::new("paint.impasto", options(Choice::Gpu));
    room.rested();
    let pictures: Arc<Mutex<Vec<Arc<Picture>>>> = Arc::default();
    let (seen, own): (_, Weak<Live>) = (pictures.clone(), Arc::downgrade(&room.live));
    room.live.on_news(Box::new(move || {
        if let Some(picture) = own.upgrade().and_then(|live| live.news().picture) {
            seen.lock().expect("pictures").push(picture);
        }
    }));
    room.write("paint.impasto", &edited);
    let stands_in = |news: &News| news.picture.as_ref().is_some_and(|p| p.stands_in);
    let news = room.wait("picture of the processor", stands_in);
    assert!(news.problems.is_empty(), "{:?}", news.problems);
    room.wait("picture of the device", |news| !stands_in(news));
    room.rested();

    // Both show the same, but for what rounding does to a few paths.
    let pictures = pictures.lock().expect("pictures").clone();
    let first = |stands_in: bool| {
        let of = |p: &&Arc<Picture>| p.stands_in == stands_in && p.counts.iter().all(|c| *c == 1);
        pictures.iter().find(of).expect("a picture of one sample")
    };
    let (processor, device) = (first(true), first(false));
    assert!(processor.number < device.number);
    let is_close = |(a, b): (&[f32; 3], &[f32; 3])| {
        let channels = a.iter().zip(b);
        let mut off = channels.map(|(a, b)| (a - b).abs() / (a + b).max(1e-3));
        off.all(|off| off < 1e-3)
    };
    let pairs = processor.pixels.iter().zip(device.pixels.iter());
    let close = pairs.filter(|pair| is_close(*pair)).count();
    assert!(close * 100 >= 95 * processor.pixels.len(), "{close}");
    let turns = pictures.iter().skip_while(|p| !p.stands_in);
    let after: Vec<bool> = turns.map(|p| p.stands_in).collect();
    assert!(after.is_sorted_by(|a, b| a >= b), "{after:?}");
    let expected = rendered(&room.at("paint.impasto"), Choice::Gpu, None, &[]);
    check(&room.film(), &expected);
}

#[test]
fn a_camera_and_a_value_compile_nothing() {
    let room = Room::new("scene.toml", options(Choice::Cpu));
    let first = room.rested();
    let camera = first.project.camera.expect("a camera");
    room.states.lock().expect("states").clear();
    let mut moved = camera;
    moved.position.x += 0.4;
    room.live.order(Order::Look(moved));
    let is_moved = |news: &News| {
        news.picture
            .as_ref()
            .is_some_and(|p| p.camera == Some(moved))
    };
    let seen = room
        .wait("other view", is_moved)
        .picture
        .expect("a picture");
    let first_picture = first.picture.expect("a picture");
    assert_ne!(seen.pixels, first_picture.pixels);
    let sum = |picture: &Picture| picture.pixels.iter().map(|p| p[0]).sum::<f32>();
    let mut last = seen.clone();
    for (step, roughness) in [0.1, 0.9, 0.3].into_iter().enumerate() {
        let value = ParameterValue::Float(roughness);
        room.live.order(set("wall", "roughness", value, step < 2));
        let other = room.wait("other picture", |news| {
            news.picture
                .as_ref()
                .is_some_and(|p| p.pixels != last.pixels)
                && self::value(news, "roughness") == Value::Number(roughness as f32)
        });
        last = other.picture.expect("a picture");
    }
    // Light follows from a value as well.
    let power = ParameterValue::Float(40.0);
    room.live.order(set("bulb", "power", power, true));
    let is_bright = |news: &News| {
        news.picture
            .as_ref()
            .is_some_and(|p| sum(p) > 4.0 * sum(&last))
    };
    let news = room.wait("bright picture", is_bright);
    assert_eq!(value(&news, "power"), Value::Number(40.0));
    let states = room.states.lock().expect("states").clone();
    let builds = [State::Compiling, State::Building];
    assert!(!states.iter().any(|s| builds.contains(s)), "{states:?}");
    // Left alone, it is the render of that camera and these values.
    room.live
        .order(set("bulb", "power", ParameterValue::Float(40.0), false));
    room.rested();
    let values = [("wall", "roughness", 0.3), ("bulb", "power", 40.0)];
    let expected = rendered(&room.at("scene.toml"), Choice::Cpu, Some(moved), &values);
    check(&room.film(), &expected);
    // A reset gives back what is written, and the camera of the scene is there again.
    room.live.order(Order::ResetAll);
    room.live.order(Order::LookAsWritten);
    let news = room.wait("values as written", |news| {
        value(news, "roughness") == Value::Number(0.5) && value(news, "power") == Value::Number(4.0)
    });
    assert!(
        news.project
            .bindings
            .iter()
            .flat_map(|b| &b.params)
            .all(|p| !p.is_set)
    );
    let news = room.rested();
    let picture = news.picture.expect("a picture");
    assert_eq!(picture.pixels, first_picture.pixels);
}

#[test]
fn wrong_values_and_broken_files_leave_the_last_picture() {
    let room = Room::new("paint.impasto", options(Choice::Cpu));
    let first = room.picture_after(0);
    room.live
        .order(set("sample", "roughness", ParameterValue::Float(7.0), true));
    let news = room.wait("problem", |news| !news.problems.is_empty());
    assert!(
        news.problems[0].text.contains("sample.roughness"),
        "{:?}",
        news.problems
    );
    assert!(news.picture.is_some());
    room.live.order(Order::ResetAll);
    room.wait("peace", |news| news.problems.is_empty());

    room.write(
        "paint.impasto",
        &PAINT.replace("diffuse(tint)", "diffuse(taint)"),
    );
    let news = room.wait("problem", |news| news.state == State::Broken);
    let problem = &news.problems[0];
    assert!(
        !problem.is_warning && problem.message.contains("taint"),
        "{problem:?}"
    );
    assert_eq!(problem.code.as_deref(), Some("E0201"));
    let place = problem.place.clone().expect("a place");
    assert!(
        place.0.ends_with("paint.impasto") && place.1 == 7,
        "{place:?}"
    );
    let kept = news.picture.expect("the last picture");
    assert!(kept.number >= first.number && kept.pixels.len() == 16 * 12);

    // Mended, with a new default and a new parameter.
    let mended = PAINT
        .replace("= 0.25 in", "= 0.75 in")
        .replace("    surface", "    param other: float = 2.0;\n    surface");
    room.write("paint.impasto", &mended);
    let news = room.wait("new parameter", |news| {
        let mut bindings = news.project.bindings.iter();
        news.state != State::Broken && bindings.any(|b| b.params.len() == 3)
    });
    assert_eq!(value(&news, "roughness"), Value::Number(0.75));
    room.picture_after(kept.number);

    // A file that is gone, and comes back.
    std::fs::remove_file(room.at("paint.impasto")).expect("removed");
    room.wait("problem", |news| news.state == State::Broken);
    room.write("paint.impasto", PAINT);
    room.wait("file", |news| {
        value(news, "roughness") == Value::Number(0.25)
    });
}

#[test]
fn a_save_without_effect_keeps_the_samples_and_a_reload_keeps_the_camera() {
    let room = Room::new("scene.toml", options(Choice::Cpu));
    let mut camera = room.picture_after(0).camera.expect("a camera");
    camera.position.y += 0.3;
    room.live.order(Order::Look(camera));
    let done = room.rested().picture.expect("a picture");
    assert_eq!(done.camera, Some(camera));
    let project = room.live.news().project;
    room.write("paint.impasto", &format!("{PAINT}// A comment.\n"));
    room.wait("new project", |news| !Arc::ptr_eq(&news.project, &project));
    std::thread::sleep(Duration::from_millis(700));
    let still = room.rested().picture.expect("a picture");
    assert_eq!((still.number, still.samples), (done.number, done.samples));
    room.write("paint.impasto", &PAINT.replace("0.2, 0.1", "0.9, 0.1"));
    let other = room.picture_after(done.number);
    assert_eq!(other.camera, Some(camera));
    assert!(other.samples <= 8);
}

#[test]
fn values_are_written_back_between_comments() {
    let room = Room::new("scene.toml", options(Choice::Cpu));
    room.picture_after(0);
    room.live.order(set(
        "wall",
        "roughness",
        ParameterValue::Float(0.125),
        false,
    ));
    room.live.order(set(
        "wall",
        "tint",
        ParameterValue::Floats(vec![0.25, 0.5, 0.75]),
        false,
    ));
    room.wait("value", |news| {
        value(news, "tint") == Value::Components(vec![0.25, 0.5, 0.75])
    });
    let Answer::Saved(Ok(path)) = room.answer(Order::WriteBack) else {
        panic!("it is written");
    };
    let written = std::fs::read_to_string(path).expect("the scene");
    let expected = SCENE.replace(
        "{ roughness = 0.5 } # of the day",
        "{ roughness = 0.125, tint = [0.25, 0.5, 0.75] } # of the day",
    );
    assert_eq!(written, expected);
    let news = room.wait("scene as it is now", |news| {
        let params = &news.project.bindings[0].params;
        params.iter().all(|p| !p.is_set) && params[0].written == Some(ParameterValue::Float(0.125))
    });
    assert_eq!(value(&news, "roughness"), Value::Number(0.125));
    // A set has no file to write to.
    let room = Room::new("paint.impasto", options(Choice::Cpu));
    room.picture_after(0);
    let refused = room.answer(Order::WriteBack);
    assert!(matches!(refused, Answer::Saved(Err(why)) if why.contains("hint")));
    // Nor is a glTF file written into.
    std::fs::write(room.at("model.gltf"), TRIANGLE).expect("written");
    let live = Live::new(&room.at("model.gltf"), options(Choice::Cpu)).expect("threads");
    let room = Room {
        live: Arc::new(live),
        ..room
    };
    room.picture_after(0);
    let refused = room.answer(Order::WriteBack);
    assert!(matches!(refused, Answer::Saved(Err(why)) if why.contains("`impasto import ")));
    let kept = std::fs::read_to_string(room.at("model.gltf")).expect("the file");
    assert_eq!(kept, TRIANGLE);
}

#[test]
fn pixels_are_picked_traced_saved_and_read() {
    let room = Room::new("scene.toml", options(Choice::Cpu));
    let done = room.rested();
    let Answer::Picked(Some(picked)) = room.answer(Order::Pick([8, 6])) else {
        panic!("the wall is there");
    };
    let binding = picked.binding.expect("a binding");
    assert_eq!(done.project.bindings[binding].name, "wall");
    assert_eq!(picked.object.as_deref(), Some("wall/wall"));
    assert!(
        (picked.depth - 3.0).abs() < 1e-4 && picked.position[2].abs() < 1e-4,
        "{picked:?}"
    );
    let (file, line) = picked.source.expect("a source");
    assert!(
        file.ends_with("paint.impasto") && line == 3,
        "{file} {line}"
    );
    assert!(matches!(
        room.answer(Order::Pick([99, 0])),
        Answer::Picked(None)
    ));

    let Answer::Traced(traced) = room.answer(Order::Trace {
        pixel: [8, 6],
        sample: 1,
    }) else {
        panic!("a path");
    };
    assert!(traced.vertices.len() >= 2, "{}", traced.text);
    assert!((traced.vertices[0][2] - 3.0).abs() < 1e-6);
    assert!(traced.text.contains("pixel 8,6, sample 1") && traced.text.contains("vertex 1"));

    for name in ["a.exr", "a.png", "a.film"] {
        let path = room.at(name);
        let order = Order::Save {
            path: path.clone(),
            exposure: 0.0,
        };
        let Answer::Saved(saved) = room.answer(order) else {
            panic!("{name}");
        };
        assert_eq!(saved.as_ref(), Ok(&path));
    }
    let Answer::Read(Ok(read)) = room.answer(Order::Read(room.at("a.exr"))) else {
        panic!("it is read");
    };
    assert_eq!(read.pixels, done.picture.expect("a picture").pixels);
    let refused = room.answer(Order::Save {
        path: room.at("none/a.png"),
        exposure: 0.0,
    });
    assert!(matches!(refused, Answer::Saved(Err(_))));
    assert!(matches!(
        room.answer(Order::Read(room.at("b.exr"))),
        Answer::Read(Err(_))
    ));
}

#[test]
fn sizes_crops_outputs_strategies_and_ends_are_followed() {
    let room = Room::new("scene.toml", options(Choice::Cpu));
    room.picture_after(0);
    room.live
        .order(Order::Outputs(vec!["depth".into(), "material".into()]));
    let with_layers = |news: &News| news.picture.as_ref().is_some_and(|p| p.layers.len() >= 2);
    let picture = room.wait("layers", with_layers).picture.expect("a picture");
    let depth = picture
        .layers
        .iter()
        .find(|l| l.name == "depth")
        .expect("depth");
    assert_eq!((depth.channels, depth.values.len()), (1, 16 * 12));
    assert!((depth.values[6 * 16 + 8] - 3.0).abs() < 0.1);
    room.live.order(Order::Size([24, 10]));
    room.wait("size", |news| {
        news.picture
            .as_ref()
            .is_some_and(|p| (p.width, p.height) == (24, 10))
    });
    room.live.order(Order::Samples(16));
    room.live.order(Order::Crop(Some([[4, 2], [9, 7]])));
    let news = room.wait("end", |news| {
        news.state == State::Done && news.picture.as_ref().is_some_and(|p| p.samples == 16)
    });
    let picture = news.picture.expect("a picture");
    let full = picture.counts.iter().filter(|count| **count == 16).count();
    assert!(full >= 25, "{full}");
    room.live.order(Order::Crop(None));
    room.live.order(Order::Strategy("none".into()));
    let news = room.wait("complaint", |news| !news.problems.is_empty());
    assert!(news.problems[0].is_warning);
    room.live.order(Order::Strategy("mega".into()));
    let news = room.wait("megakernel", |news| news.kernels.strategy == "mega");
    assert!(!news.kernels.reasons.is_empty());
    room.live.order(Order::Until(Some("relmse=1e6".into())));
    let news = room.wait("error", |news| {
        !news.errors.is_empty() && news.state == State::Done
    });
    assert!(
        news.errors
            .last()
            .is_some_and(|e| e.relmse.is_finite() && e.samples >= 16)
    );
    room.live.order(Order::Pause(true));
    room.wait("pause", |news| news.state == State::Paused);
}

/// A layer of a picture, by its name.
fn layer<'p>(picture: &'p Picture, name: &str) -> Option<&'p PictureLayer> {
    picture.layers.iter().find(|layer| layer.name == name)
}

#[test]
fn what_pixels_see_and_how_wrong_they_are_is_found_beside_the_picture() {
    let slow = LiveOptions {
        samples: 4096,
        ..options(Choice::Cpu)
    };
    let room = Room::new("scene.toml", slow);
    let news = room.rested();
    let names: Vec<&str> = news
        .project
        .own_layers
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(names, ["error", "cost", "kernel"]);

    // The curve of the error falls, though no error was asked for.
    let errors = &news.errors;
    assert!(errors.len() >= 3, "{errors:?}");
    let (first, last) = (&errors[0], &errors[errors.len() - 1]);
    assert_eq!(last.samples, 4096);
    assert!(
        last.relmse > 0.0 && last.relmse < 0.5 * first.relmse,
        "{errors:?}"
    );
    let picture = news.picture.clone().expect("a picture");
    let error = layer(&picture, "error").expect("errors of pixels");
    assert_eq!(error.values.len(), 16 * 12);
    let mean_square = error.values.iter().map(|e| e * e).sum::<f32>() / error.values.len() as f32;
    let ratio = f64::from(mean_square) / last.relmse;
    assert!(
        (0.05..20.0).contains(&ratio),
        "{ratio}: both tell of the same error"
    );

    // What materials cost is known without being asked for, and where they are seen once it is.
    let news = room.wait("costs", |news| {
        let operations = &news.kernels.operations;
        operations.len() == 2 && operations.iter().all(Option::is_some)
    });
    let operations: Vec<f32> = news
        .kernels
        .operations
        .iter()
        .map(|o| o.unwrap_or(0.0) as f32)
        .collect();
    assert!(
        operations[0] > operations[1],
        "a coat costs more than none: {operations:?}"
    );
    assert!(news.picture.is_some_and(|p| layer(&p, "cost").is_none()));
    room.live.order(Order::Survey(true));
    let (wall, bulb, beside) = (6 * 16 + 8, 16 + 8, 0);
    // Open kernels cost something else than final ones, by which they are followed.
    let costs = |news: &News| -> Vec<f32> {
        let operations = news.kernels.operations.iter();
        operations.map(|o| o.unwrap_or(0.0) as f32).collect()
    };
    let has_both = |news: &News| {
        let picture = news.picture.as_deref();
        let cost = picture.and_then(|p| layer(p, "cost"));
        let is_of_these = cost.is_some_and(|cost| cost.values[wall] == costs(news)[0]);
        is_of_these && picture.is_some_and(|p| layer(p, "kernel").is_some())
    };
    let news = room.wait("layers", has_both);
    let operations = costs(&news);
    let seen = news.picture.expect("a picture");
    assert_eq!(seen.pixels, picture.pixels, "the picture stays");
    let cost = layer(&seen, "cost").expect("costs");
    let kernel = layer(&seen, "kernel").expect("kernels");
    let LayerKind::Index(kernels) = &kernel.kind else {
        panic!("kernels have names");
    };
    for (pixel, expected) in [(wall, "paint"), (bulb, "lamp")] {
        let binding = usize::from(pixel == bulb);
        assert_eq!(cost.values[pixel], operations[binding], "{expected}");
        let name = &kernels[kernel.values[pixel] as usize];
        assert!(
            name.contains(expected),
            "{name} is the kernel of {expected}"
        );
    }
    // From afar the wall has an end, and there is nothing beside it.
    let mut far = picture.camera.expect("a camera");
    far.position.z = 30.0;
    room.live.order(Order::Look(far));
    let is_far = |news: &News| {
        let far = news.picture.as_ref().is_some_and(|p| p.camera == Some(far));
        far && has_both(news)
    };
    let seen = room
        .wait("layers from afar", is_far)
        .picture
        .expect("a picture");
    let cost = layer(&seen, "cost").expect("costs");
    assert_eq!(cost.values[beside], 0.0);
    // Another size is the same program.
    room.live.order(Order::Size([24, 10]));
    let is_sized = |news: &News| {
        let picture = news.picture.as_deref().filter(|p| p.width == 24);
        let cost = picture.and_then(|p| layer(p, "cost"));
        cost.is_some_and(|cost| cost.values.len() == 240) && costs(news)[0] > 0.0
    };
    let seen = room
        .wait("layers of another size", is_sized)
        .picture
        .expect("a picture");
    room.live.order(Order::Survey(false));
    room.live.order(Order::Restart);
    let is_without = |news: &News| {
        let again = |p: &&Arc<Picture>| p.number > seen.number;
        news.picture
            .as_ref()
            .filter(again)
            .is_some_and(|p| layer(p, "cost").is_none())
    };
    room.wait("picture without them", is_without);
}

#[test]
fn a_device_that_is_lost_is_opened_again() {
    let room = Room::new("scene.toml", options(Choice::Gpu));
    let done = room.rested().picture.expect("a picture");
    let mut camera = done.camera.expect("a camera");
    room.live.lose();
    camera.position.y += 0.3;
    room.live.order(Order::Look(camera));
    let moved = |news: &News| {
        let picture = news.picture.as_ref();
        news.state == State::Done && picture.is_some_and(|p| p.camera == Some(camera))
    };
    let news = room.wait("end on the new device", moved);
    assert!(news.problems.is_empty(), "{:?}", news.problems);
    let expected = rendered(&room.at("scene.toml"), Choice::Gpu, Some(camera), &[]);
    check(&room.film(), &expected);
    // One that is lost again at once is not worth another attempt, and that is said.
    room.live.lose();
    room.live.order(Order::Restart);
    let news = room.wait("failure", |news| matches!(news.state, State::Failed(_)));
    let State::Failed(why) = &news.state else {
        unreachable!("it was waited for");
    };
    assert!(why.contains("the GPU was lost while rendering"), "{why}");
    assert!(news.picture.is_some(), "the last picture stays");
}

/// Editors that save all the time, in place and by renaming, whole and half.
#[test]
fn a_thousand_saves_end_with_the_last_one() {
    let room = Room::new("paint.impasto", options(Choice::Cpu));
    room.picture_after(0);
    let begun = Instant::now();
    for save in 0..1000 {
        let text = PAINT.replace("= 0.25 in", &format!("= 0.{:03} in", 1 + save % 900));
        match save % 4 {
            0 => room.write("paint.impasto", &text),
            1 => room.write("paint.impasto", &text[..text.len() / 2]),
            2 => {
                room.write("saved.impasto", &text);
                std::fs::rename(room.at("saved.impasto"), room.at("paint.impasto"))
                    .expect("renamed");
            }
            _ => std::fs::remove_file(room.at("paint.impasto")).expect("removed"),
        }
        std::thread::sleep(Duration::from_micros(500));
    }
    assert!(begun.elapsed() < Duration::from_secs(60));
    room.write("paint.impasto", &PAINT.replace("= 0.25 in", "= 0.875 in"));
    let last = room.wait("last save", |news| {
        news.state == State::Done && value(news, "roughness") == Value::Number(0.875)
    });
    assert!(last.problems.is_empty(), "{:?}", last.problems);
    let expected = rendered(&room.at("paint.impasto"), Choice::Cpu, None, &[]);
    check(&room.film(), &expected);
}
