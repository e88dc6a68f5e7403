//! An engine without a renderer, for tests of the window and for its example: a ball on a floor, in closed form. It follows
//! every order in a way that can be seen, and writes all of them down.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use glam::Vec3;
use impasto_compiler::ParameterValue;
use impasto_compiler::interface::{ParamInterface, UnitInterface, Value};
use impasto_runtime::scene::Camera;

use crate::engine::{
    Answer, Binding, Engine, ErrorPoint, Kernel, Kernels, LayerKind, News, Order, Param, ParamId,
    Picked, Picture, PictureLayer, Problem, Project, State, Traced,
};

/// The engine. Clones are the same one, so that a test can look at what a window gave away.
#[derive(Clone)]
pub struct BallEngine(Arc<Shared>);

struct Shared {
    inner: Mutex<Inner>,
    wake: Mutex<Option<Box<dyn Fn() + Send + Sync>>>,
    has_quit: AtomicBool,
}

struct Inner {
    news: News,
    answers: Vec<Answer>,
    orders: Vec<Order>,
    camera: Camera,
    size: [u32; 2],
    crop: Option<[[u32; 2]; 2]>,
    outputs: Vec<String>,
    surveys: bool,
    samples: u32,
    taken: u32,
    number: u64,
    frame: u32,
    is_paused: bool,
    /// Are all samples there at once, without a thread that takes them?
    is_still: bool,
    began: Instant,
    /// A file that stands for the scene: with the word `error` in it, it is broken.
    file: Option<PathBuf>,
    text: String,
}

/// Columns and rows of the picture of [`BallEngine::progressive`].
pub const SIZE: [u32; 2] = [640, 400];
/// Its samples.
pub const SAMPLES: u32 = 64;

/// The camera that the scene has.
pub fn camera() -> Camera {
    Camera {
        position: Vec3::new(0.0, 0.16, 0.62),
        look_at: Vec3::new(0.0, 0.05, 0.0),
        up: Vec3::Y,
        fov: 32.0,
        aperture: 0.01,
        focus: 0.6,
    }
}

fn param(name: &str, ty: &str, default: Value, docs: &str) -> Param {
    let words = name.replace('_', " ");
    let (first, rest) = words.split_at(1);
    Param {
        interface: ParamInterface {
            name: name.to_owned(),
            ty: ty.to_owned(),
            label: first.to_uppercase() + rest,
            group: None,
            docs: docs.to_owned(),
            settable: true,
            default_text: match &default {
                Value::Number(x) => x.to_string(),
                Value::Bool(b) => b.to_string(),
                Value::Int(i) => i.to_string(),
                Value::Components(c) => format!("{c:?}"),
                Value::Text(t) => format!("\"{t}\""),
            },
            default: default.clone(),
            hard: None,
            soft: None,
            unit: None,
        },
        written: None,
        value: default,
        is_set: false,
        is_animated: false,
    }
}

impl Param {
    fn with(mut self, change: impl FnOnce(&mut ParamInterface)) -> Self {
        change(&mut self.interface);
        self
    }
}

/// What the engine shows: two materials with parameters of every kind.
pub fn project() -> Project {
    let group = |name: &str| Some(name.to_owned());
    let color = |r, g, b| Value::Components(vec![r, g, b]);
    let glaze = vec![
        param(
            "base_color",
            "color",
            color(0.42, 0.11, 0.06),
            "Color of the clay.",
        )
        .with(|i| {
            i.hard = Some([0.0, 1.0]);
            i.group = group("Base");
        }),
        param(
            "roughness",
            "float",
            Value::Number(0.3),
            "How rough the glaze is: 0 is a mirror.",
        )
        .with(|i| {
            i.hard = Some([0.0, 1.0]);
            i.group = group("Base");
        }),
        param(
            "speckle",
            "length",
            Value::Number(0.008),
            "Size of the speckles.",
        )
        .with(|i| {
            i.hard = Some([1e-4, 1.0]);
            i.soft = Some([1e-3, 0.03]);
            i.group = group("Pattern");
            i.unit = Some(UnitInterface {
                name: "mm",
                size: 1e-3,
            });
            i.default_text = "8 mm".to_owned();
        }),
        param("turn", "angle", Value::Number(0.5), "Turns the pattern.").with(|i| {
            i.soft = Some([0.0, std::f32::consts::TAU]);
            i.group = group("Pattern");
            i.unit = Some(UnitInterface {
                name: "deg",
                size: std::f64::consts::PI / 180.0,
            });
            i.default_text = "28.6 deg".to_owned();
        }),
        param(
            "octaves",
            "int",
            Value::Int(3),
            "How fine the speckles get.",
        )
        .with(|i| {
            i.hard = Some([1.0, 8.0]);
            i.group = group("Pattern");
        }),
        param(
            "coated",
            "bool",
            Value::Bool(true),
            "Is there a clear coat?",
        )
        .with(|i| {
            i.group = group("Coat");
        }),
        param(
            "bent",
            "normal",
            Value::Text("normal".to_owned()),
            "Bends the coat.",
        )
        .with(|i| {
            i.settable = false;
            i.group = group("Coat");
        }),
    ];
    let floor = vec![
        param(
            "tint",
            "color",
            color(0.5, 0.5, 0.5),
            "Color of the brighter squares.",
        )
        .with(|i| {
            i.hard = Some([0.0, 1.0]);
        }),
        param("square", "length", Value::Number(0.05), "Side of a square.").with(|i| {
            i.hard = Some([1e-3, 10.0]);
            i.soft = Some([0.01, 0.2]);
            i.unit = Some(UnitInterface {
                name: "cm",
                size: 1e-2,
            });
        }),
        param(
            "offset",
            "vec3",
            color(0.0, 0.0, 0.0),
            "Moves the squares, in metres.",
        ),
        param(
            "wood",
            "texture",
            Value::Text("wood.png".to_owned()),
            "A picture over the squares.",
        ),
        param("glow", "float", Value::Number(0.0), "Light of the squares.").with(|i| {
            i.hard = Some([0.0, f32::INFINITY]);
        }),
    ];
    let mut project = Project {
        name: "ball.toml".to_owned(),
        path: PathBuf::from("ball.toml"),
        is_scene: true,
        camera: Some(camera()),
        bounds: Some([[-0.1, 0.0, -0.1], [0.1, 0.2, 0.1]]),
        size: SIZE,
        bindings: vec![
            Binding {
                name: "pot".to_owned(),
                file: "glaze.impasto".to_owned(),
                material: "glaze".to_owned(),
                docs: "A clear glaze over speckled clay.".to_owned(),
                params: glaze,
            },
            Binding {
                name: "floor".to_owned(),
                file: "squares.impasto".to_owned(),
                material: "squares".to_owned(),
                docs: "Squares.".to_owned(),
                params: floor,
            },
        ],
        own_layers: [
            ("error", "the estimated error of the pixel"),
            ("cost", "operations of the materials"),
            ("kernel", "the kernel of the first hit"),
        ]
        .map(|(name, about)| (name.to_owned(), about.to_owned()))
        .to_vec(),
        outputs: [
            ("albedo", "What the material scatters in all."),
            ("normal", "The shading normal in the world."),
            ("depth", "The distance along the view."),
        ]
        .map(|(name, about)| (name.to_owned(), about.to_owned()))
        .to_vec(),
        strategies: [
            ("auto", "What the time model finds best."),
            ("own", "Each material has a kernel."),
            ("mega", "One kernel for everything."),
            (
                "threshold=",
                "A kernel for each material of so many operations.",
            ),
        ]
        .map(|(name, about)| (name.to_owned(), about.to_owned()))
        .to_vec(),
        frames: Some([1, 48]),
    };
    if let Some(glow) = project.bindings[1].params.last_mut() {
        glow.is_animated = true;
    }
    project
}

impl BallEngine {
    /// An engine that has all samples at once, and does nothing that is not asked for.
    pub fn still() -> Self {
        let mut inner = Inner {
            news: News {
                project: Arc::new(project()),
                kernels: Arc::new(kernels("auto")),
                ..News::default()
            },
            answers: Vec::new(),
            orders: Vec::new(),
            camera: camera(),
            size: [64, 40],
            crop: None,
            outputs: Vec::new(),
            surveys: false,
            samples: 64,
            taken: 64,
            number: 0,
            frame: 1,
            is_paused: false,
            is_still: true,
            began: Instant::now(),
            file: None,
            text: String::new(),
        };
        inner.paint();
        Self(Arc::new(Shared {
            inner: Mutex::new(inner),
            wake: Mutex::new(None),
            has_quit: AtomicBool::new(false),
        }))
    }

    /// An engine that takes samples on a thread of its own, and reads `file` again when it changes.
    pub fn progressive(file: Option<&Path>) -> Self {
        let engine = Self::still();
        {
            let mut inner = engine.inner();
            inner.size = SIZE;
            inner.samples = SAMPLES;
            inner.is_still = false;
            inner.file = file.map(Path::to_owned);
            inner.restart();
        }
        let shared = Arc::clone(&engine.0);
        std::thread::spawn(move || {
            while !shared.has_quit.load(Ordering::Relaxed) {
                let news = {
                    let mut inner = lock(&shared.inner);
                    inner.read() | inner.step()
                };
                if news {
                    wake(&shared);
                }
                std::thread::sleep(Duration::from_millis(40));
            }
        });
        engine
    }

    /// Orders that came since the last call.
    pub fn orders(&self) -> Vec<Order> {
        std::mem::take(&mut self.inner().orders)
    }

    /// Has the engine been asked to quit?
    pub fn has_quit(&self) -> bool {
        self.0.has_quit.load(Ordering::Relaxed)
    }

    /// Changes the news, as something else than an order does.
    pub fn change(&self, change: impl FnOnce(&mut News)) {
        change(&mut self.inner().news);
        wake(&self.0);
    }

    /// Breaks the files, or repairs them.
    pub fn break_files(&self, is_broken: bool) {
        self.inner().break_files(is_broken);
        wake(&self.0);
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        lock(&self.0.inner)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn wake(shared: &Shared) {
    if let Some(wake) = &*lock(&shared.wake) {
        wake();
    }
}

impl Engine for BallEngine {
    fn order(&self, order: Order) {
        if order == Order::Quit {
            self.0.has_quit.store(true, Ordering::Relaxed);
        }
        {
            let mut inner = self.inner();
            inner.follow(&order);
            inner.orders.push(order);
        }
        wake(&self.0);
    }

    fn news(&self) -> News {
        self.inner().news.clone()
    }

    fn answers(&self) -> Vec<Answer> {
        std::mem::take(&mut self.inner().answers)
    }

    fn on_news(&self, wake: Box<dyn Fn() + Send + Sync>) {
        *lock(&self.0.wake) = Some(wake);
    }
}

fn kernels(strategy: &str) -> Kernels {
    let kernel = |name: &str, materials: &[&str], share| Kernel {
        name: name.to_owned(),
        materials: materials.iter().map(|&m| m.to_owned()).collect(),
        share: Some(share),
    };
    Kernels {
        device: "closed form".to_owned(),
        strategy: strategy.to_owned(),
        kernels: match strategy {
            "mega" => vec![kernel("megakernel", &["glaze", "squares"], 1.0)],
            _ => vec![
                kernel("new paths", &[], 0.08),
                kernel("ray cast", &[], 0.46),
                kernel("glaze", &["glaze"], 0.27),
                kernel("squares", &["squares"], 0.11),
                kernel("shadow rays", &[], 0.08),
            ],
        },
        reasons: vec![
            "glaze has a kernel of its own: sharing one would cost 1.31 times the time".to_owned(),
            "squares has few operations and no lobe in common with others".to_owned(),
        ],
        operations: vec![Some(412.0), Some(58.0)],
    }
}

/// What a ray meets.
#[derive(Clone, Copy)]
struct Hit {
    distance: f32,
    position: Vec3,
    normal: Vec3,
    binding: usize,
}

const CENTRE: Vec3 = Vec3::new(0.0, 0.1, 0.0);
const RADIUS: f32 = 0.1;

fn meet(from: Vec3, toward: Vec3) -> Option<Hit> {
    let away = from - CENTRE;
    let half = away.dot(toward);
    let inside = half * half - away.length_squared() + RADIUS * RADIUS;
    let ball = (inside > 0.0)
        .then(|| -half - inside.sqrt())
        .filter(|t| *t > 1e-5);
    let floor = (toward.y < -1e-6).then(|| -from.y / toward.y);
    let floor = floor.filter(|t| *t > 1e-5 && (from + *t * toward).length() < 3.0);
    match (ball, floor) {
        (Some(t), floor) if floor.is_none_or(|f| t < f) => {
            let position = from + t * toward;
            Some(Hit {
                distance: t,
                position,
                normal: (position - CENTRE) / RADIUS,
                binding: 0,
            })
        }
        (_, Some(t)) => Some(Hit {
            distance: t,
            position: from + t * toward,
            normal: Vec3::Y,
            binding: 1,
        }),
        _ => None,
    }
}

/// A number from 0 to 1 for each place.
fn hash(x: u32, y: u32, z: u32) -> f32 {
    let mut h =
        x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA6B) ^ z.wrapping_mul(0xC2B2_AE35);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^= h >> 15;
    h as f32 / u32::MAX as f32
}

impl Inner {
    fn value(&self, binding: usize, name: &str) -> &Value {
        const NONE: &Value = &Value::Number(0.0);
        let params = &self.news.project.bindings[binding].params;
        let found = params.iter().find(|p| p.interface.name == name);
        found.map_or(NONE, |p| &p.value)
    }

    fn number(&self, binding: usize, name: &str) -> f32 {
        match self.value(binding, name) {
            Value::Number(x) => *x,
            Value::Int(i) => *i as f32,
            Value::Bool(b) => f32::from(*b),
            _ => 0.0,
        }
    }

    fn color(&self, binding: usize, name: &str) -> Vec3 {
        match self.value(binding, name) {
            Value::Components(c) if c.len() == 3 => Vec3::new(c[0], c[1], c[2]),
            _ => Vec3::ZERO,
        }
    }

    fn ray(&self, column: u32, row: u32) -> Vec3 {
        let [right, up, forward] = self.camera.basis();
        let height = (0.5 * self.camera.fov.to_radians()).tan();
        let aspect = self.size[0] as f32 / self.size[1] as f32;
        let x = 2.0 * (column as f32 + 0.5) / self.size[0] as f32 - 1.0;
        let y = 1.0 - 2.0 * (row as f32 + 0.5) / self.size[1] as f32;
        (forward + right * x * height * aspect + up * y * height).normalize()
    }

    fn albedo(&self, hit: &Hit) -> Vec3 {
        match hit.binding {
            0 => {
                let size = self.number(0, "speckle").max(1e-5);
                let (sin, cos) = self.number(0, "turn").sin_cos();
                let p = hit.position;
                let p = Vec3::new(cos * p.x + sin * p.z, p.y, cos * p.z - sin * p.x) / size;
                let cell = p.floor();
                let spot = hash(
                    cell.x as i32 as u32,
                    cell.y as i32 as u32,
                    cell.z as i32 as u32,
                );
                let round = 1.0 - (p - cell - 0.5).length() * 2.0;
                let speckle = if spot > 0.7 && round > 0.2 { 0.4 } else { 1.0 };
                self.color(0, "base_color") * speckle
            }
            _ => {
                let p =
                    (hit.position - self.color(1, "offset")) / self.number(1, "square").max(1e-5);
                let is_odd = (p.x.floor() + p.z.floor()).rem_euclid(2.0) > 0.5;
                let tint = self.color(1, "tint");
                if is_odd { 0.35 * tint } else { tint }
            }
        }
    }

    fn radiance(&self, from: Vec3, toward: Vec3, depth: u32) -> Vec3 {
        let Some(hit) = meet(from, toward) else {
            let up = 0.5 + 0.5 * toward.y;
            return Vec3::new(0.16, 0.18, 0.21) * up + Vec3::splat(0.03);
        };
        let angle = self.frame as f32 * 0.02;
        let light = Vec3::new(-0.5 + angle, 0.9, 0.5).normalize();
        let shadow = if meet(hit.position + 1e-4 * hit.normal, light).is_some() {
            0.12
        } else {
            1.0
        };
        let cosine = hit.normal.dot(light).max(0.0);
        let ambient = 0.25 + 0.15 * hit.normal.y;
        let diffuse = self.albedo(&hit) * (1.6 * cosine * shadow + ambient);
        if hit.binding == 1 || self.number(0, "coated") == 0.0 {
            return diffuse;
        }
        let mirrored = toward - 2.0 * toward.dot(hit.normal) * hit.normal;
        let fresnel = 0.04 + 0.96 * (1.0 + toward.dot(hit.normal)).clamp(0.0, 1.0).powi(5);
        let roughness = self.number(0, "roughness");
        let sharp = 2.0 / (roughness * roughness + 1e-3);
        let highlight = 0.06 * sharp * mirrored.dot(light).max(0.0).powf(sharp) * shadow;
        let seen = match depth {
            0 => self.radiance(hit.position + 1e-4 * hit.normal, mirrored, 1),
            _ => Vec3::splat(0.15),
        };
        diffuse * (1.0 - fresnel) + seen * fresnel * (1.0 - roughness) + Vec3::splat(highlight)
    }

    /// Paints the picture with the samples that there are, which are noise of a size that falls with them.
    fn paint(&mut self) {
        let [width, height] = self.size;
        let count = (width * height) as usize;
        let mut pixels = Vec::with_capacity(count);
        let (mut error, mut cost, mut kernel) =
            (vec![0.0; count], vec![0.0; count], vec![-1.0; count]);
        let (mut albedo, mut normal, mut depth) = (Vec::new(), Vec::new(), Vec::new());
        let old = self
            .news
            .picture
            .clone()
            .filter(|p| [p.width, p.height] == self.size);
        let mut counts = vec![self.taken; count];
        let forward = self.camera.basis()[2];
        for row in 0..height {
            for column in 0..width {
                let index = (row * width + column) as usize;
                let is_out = self.crop.is_some_and(|[from, to]| {
                    !(from[0]..to[0]).contains(&column) || !(from[1]..to[1]).contains(&row)
                });
                let toward = self.ray(column, row);
                let hit = meet(self.camera.position, toward);
                if let Some(hit) = &hit {
                    kernel[index] = hit.binding as f32;
                    cost[index] = [412.0, 58.0][hit.binding];
                }
                albedo.extend(hit.map_or([0.0; 3], |h| self.albedo(&h).to_array()));
                normal.extend(hit.map_or([0.0; 3], |h| h.normal.to_array()));
                depth.push(hit.map_or(0.0, |h| h.distance * toward.dot(forward)));
                if is_out {
                    counts[index] = 0;
                    let kept = old.as_ref().map_or([0.0; 3], |p| p.pixels[index]);
                    pixels.push(kept);
                    continue;
                }
                let mean = self.radiance(self.camera.position, toward, 0);
                let noise =
                    (hash(column, row, self.taken) - 0.5) * 1.4 / (self.taken.max(1) as f32).sqrt();
                error[index] = mean.length() * 0.4 / (self.taken.max(1) as f32).sqrt();
                pixels.push((mean * (1.0 + noise)).to_array());
            }
        }
        let layer = |name: &str, about: &str, kind, channels, values| PictureLayer {
            name: name.to_owned(),
            about: about.to_owned(),
            kind,
            channels,
            values: Arc::new(values),
        };
        let names = vec!["glaze".to_owned(), "squares".to_owned()];
        let mut layers = vec![layer(
            "error",
            "the estimated error",
            LayerKind::Number,
            1,
            error,
        )];
        if self.surveys {
            let kind = LayerKind::Index(names);
            layers.push(layer("cost", "operations", LayerKind::Number, 1, cost));
            layers.push(layer("kernel", "the kernel", kind, 1, kernel));
        }
        for name in &self.outputs {
            layers.push(match name.as_str() {
                "albedo" => layer(
                    "albedo",
                    "What is scattered.",
                    LayerKind::Color,
                    3,
                    albedo.clone(),
                ),
                "normal" => layer(
                    "normal",
                    "The normal.",
                    LayerKind::Direction,
                    3,
                    normal.clone(),
                ),
                _ => layer(
                    "depth",
                    "The distance.",
                    LayerKind::Number,
                    1,
                    depth.clone(),
                ),
            });
        }
        self.number += 1;
        self.news.picture = Some(Arc::new(Picture {
            number: self.number,
            width,
            height,
            camera: Some(self.camera),
            samples: self.taken,
            samples_asked: self.samples,
            elapsed: self.began.elapsed(),
            pixels: Arc::new(pixels),
            counts: Arc::new(counts),
            layers,
            nonfinite: 0,
            nonfinite_pixels: Arc::new(Vec::new()),
            stands_in: false,
        }));
        if self.news.problems.is_empty() {
            self.news.state = match (self.is_paused, self.taken >= self.samples) {
                (true, _) => State::Paused,
                (_, true) => State::Done,
                _ => State::Rendering,
            };
        }
    }

    fn restart(&mut self) {
        self.taken = if self.is_still { self.samples } else { 1 };
        self.began = Instant::now();
        self.news.errors = Arc::new(Vec::new());
        self.paint();
    }

    fn step(&mut self) -> bool {
        if self.taken >= self.samples || self.is_paused || !self.news.problems.is_empty() {
            return false;
        }
        self.taken = (self.taken + self.taken.div_ceil(2)).min(self.samples);
        let mut errors = (*self.news.errors).clone();
        errors.push(ErrorPoint {
            seconds: self.began.elapsed().as_secs_f64(),
            samples: self.taken,
            relmse: 0.16 / f64::from(self.taken),
        });
        self.news.errors = Arc::new(errors);
        self.paint();
        true
    }

    fn read(&mut self) -> bool {
        let Some(path) = &self.file else {
            return false;
        };
        let text = std::fs::read_to_string(path).unwrap_or_default();
        if text == self.text {
            return false;
        }
        self.break_files(text.contains("error"));
        self.text = text;
        true
    }

    fn break_files(&mut self, is_broken: bool) {
        let problem = Problem {
            is_warning: false,
            code: Some("E0201".to_owned()),
            message: "unknown name `roughnes`".to_owned(),
            place: Some(("glaze.impasto".to_owned(), 12, 24)),
            text: "error[E0201]: unknown name `roughnes`\n   --> glaze.impasto:12:24\n   |\n12 |     mirror(fresnel: 1.5, \
                   roughness: roughnes),\n   |                        ^^^^^^^^ not found here\n   |\n   = expected: a \
                   name in scope\n   = help: did you mean `roughness`?\n"
                .to_owned(),
        };
        self.news.problems = Arc::new(if is_broken { vec![problem] } else { Vec::new() });
        if is_broken {
            self.news.state = State::Broken
        } else {
            self.restart()
        }
    }

    fn change(&mut self, change: impl FnOnce(&mut Project)) {
        let mut project = (*self.news.project).clone();
        change(&mut project);
        self.news.project = Arc::new(project);
    }

    fn set(&mut self, id: &ParamId, value: Option<Value>) {
        self.change(|project| {
            let bindings = project.bindings.iter_mut().filter(|b| b.name == id.binding);
            let params = bindings.flat_map(|b| &mut b.params);
            for param in params.filter(|p| p.interface.name == id.param) {
                param.is_set = value.is_some();
                let default = param.interface.default.clone();
                param.value = value.clone().unwrap_or(default);
            }
        });
        self.restart();
    }

    fn follow(&mut self, order: &Order) {
        match order {
            Order::Look(camera) => {
                self.camera = *camera;
                self.restart();
            }
            Order::LookAsWritten => {
                self.camera = camera();
                self.restart();
            }
            Order::Size(size) => {
                self.size = *size;
                self.restart();
            }
            Order::Crop(crop) => {
                self.crop = *crop;
                self.restart();
            }
            Order::Set { param, value, .. } => {
                if let Some(value) = plain(value) {
                    self.set(param, Some(value));
                }
            }
            Order::Reset(id) => self.set(id, None),
            Order::ResetAll => {
                let project = Arc::clone(&self.news.project);
                for binding in &project.bindings {
                    for param in binding.params.iter().filter(|p| p.is_set) {
                        let id = ParamId {
                            binding: binding.name.clone(),
                            param: param.interface.name.clone(),
                        };
                        self.set(&id, None);
                    }
                }
            }
            Order::Frame(frame) => {
                self.frame = *frame;
                self.restart();
            }
            Order::Outputs(outputs) => {
                self.outputs.clone_from(outputs);
                self.paint();
            }
            Order::Survey(surveys) => {
                self.surveys = *surveys;
                self.paint();
            }
            Order::Samples(samples) => {
                self.samples = *samples;
                self.paint();
            }
            Order::Strategy(strategy) => {
                self.news.kernels = Arc::new(kernels(strategy));
                self.restart();
            }
            Order::Pause(is_paused) => {
                self.is_paused = *is_paused;
                self.paint();
            }
            Order::Restart | Order::Reload => self.restart(),
            Order::Pick(pixel) => {
                let picked = self.pick(*pixel);
                self.answers.push(Answer::Picked(picked));
            }
            Order::Trace { pixel, sample } => {
                let traced = self.trace(*pixel, *sample);
                self.answers.push(Answer::Traced(traced));
            }
            Order::WriteBack => {
                self.change(|project| {
                    for param in project.bindings.iter_mut().flat_map(|b| &mut b.params) {
                        if std::mem::take(&mut param.is_set) {
                            param.interface.default = param.value.clone();
                        }
                    }
                });
                self.answers
                    .push(Answer::Saved(Ok(PathBuf::from("ball.toml"))));
            }
            Order::Save { path, .. } => self.answers.push(Answer::Saved(Ok(path.clone()))),
            Order::Read(path) => {
                let picture = self
                    .news
                    .picture
                    .clone()
                    .filter(|_| path.ends_with("good.exr"));
                let read = picture.ok_or_else(|| format!("{} is not there", path.display()));
                self.answers.push(Answer::Read(read));
            }
            Order::Until(_) | Order::Quit => {}
        }
    }

    fn pick(&self, pixel: [u32; 2]) -> Option<Picked> {
        let toward = self.ray(pixel[0], pixel[1]);
        let hit = meet(self.camera.position, toward)?;
        let low = CENTRE - RADIUS;
        let high = CENTRE + RADIUS;
        Some(Picked {
            pixel,
            binding: Some(hit.binding),
            object: Some(["set/ball", "set/floor"][hit.binding].to_owned()),
            position: hit.position.to_array(),
            bounds: (hit.binding == 0).then(|| [low.to_array(), high.to_array()]),
            depth: hit.distance * toward.dot(self.camera.basis()[2]),
            source: Some((
                ["glaze.impasto", "squares.impasto"][hit.binding].to_owned(),
                12,
            )),
        })
    }

    fn trace(&self, pixel: [u32; 2], sample: u32) -> Traced {
        let mut from = self.camera.position;
        let mut toward = self.ray(pixel[0], pixel[1]);
        let mut vertices = vec![from.to_array()];
        let mut text = format!(
            "pixel {},{}, sample {sample}, seed 0, in f64\n\ncamera\n  from               {from}\n",
            pixel[0], pixel[1]
        );
        for bounce in 1..6u32 {
            let Some(hit) = meet(from, toward) else {
                vertices.push((from + 0.4 * toward).to_array());
                text += &format!("\nvertex {bounce}\n  hit                nothing\n");
                break;
            };
            vertices.push(hit.position.to_array());
            text += &format!(
                "\nvertex {bounce}\n  hit                {}, front\n  position           {}\n  distance           {}\n",
                ["glaze", "squares"][hit.binding],
                hit.position,
                hit.distance
            );
            let random = |k| hash(pixel[0] + 7 * bounce, pixel[1] + k, sample) - 0.5;
            let mirrored = toward - 2.0 * toward.dot(hit.normal) * hit.normal;
            let turned = mirrored + 0.8 * Vec3::new(random(1), random(2), random(3));
            toward = turned.normalize_or(hit.normal);
            if toward.dot(hit.normal) < 0.05 {
                toward = hit.normal;
            }
            from = hit.position + 1e-4 * hit.normal;
        }
        text += "\nend\n  because            it left the scene\n";
        Traced {
            pixel,
            sample,
            vertices,
            text,
        }
    }
}

/// A value of an order as news have it. Lengths and angles come with their unit.
fn plain(value: &ParameterValue) -> Option<Value> {
    Some(match value {
        ParameterValue::Bool(b) => Value::Bool(*b),
        ParameterValue::Int(i) => Value::Int(i32::try_from(*i).ok()?),
        ParameterValue::Float(x) => Value::Number(*x as f32),
        ParameterValue::Floats(v) => Value::Components(v.iter().map(|x| *x as f32).collect()),
        ParameterValue::Texture(path) => Value::Text(path.clone()),
        ParameterValue::Text(text) => {
            let (number, unit) = text.split_once(' ')?;
            let size = match unit {
                "mm" => 1e-3,
                "cm" => 1e-2,
                "deg" => std::f64::consts::PI / 180.0,
                _ => return None,
            };
            Value::Number((number.parse::<f64>().ok()? * size) as f32)
        }
        ParameterValue::From(_, value) => plain(value)?,
    })
}
