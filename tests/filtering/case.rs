//! Scenes of squares with materials of a line or two.

use std::ops::ControlFlow;
use std::path::Path;

use impasto::runtime::technique::Technique;
use impasto::runtime::world::World;
use impasto::trace::MaterialCode;
use impasto::trace::path::{Float, Replayer, with_room};
use impasto::{Gpu, GpuOptions, Program, RenderOptions, Renderer, Scene, Strategy};

/// Pixels of a side; odd, so that one is in the middle.
pub const SIZE: u32 = 9;
/// Vertical field of view, in degrees.
const FOV: f64 = 6.0;

/// A square of one material in the plane y = 0 (or above it, seen from below), with u and v along x and z.
pub struct Square {
    pub material: &'static str,
    pub half: f64,
    pub y: f64,
    /// Does it face up all the same?
    pub turned: bool,
    /// What is said of the geometry beside its file.
    pub placed: &'static str,
}

impl Square {
    pub fn new(material: &'static str) -> Self {
        Self {
            material,
            half: 50.0,
            y: 0.0,
            turned: false,
            placed: "",
        }
    }

    /// Facing up at the bottom, down above.
    fn obj(&self, scale: f64, shift: f64) -> String {
        let (h, y) = (self.half, self.y);
        let mut corners = [[-h, h], [h, h], [h, -h], [-h, -h]];
        if y > 0.0 && !self.turned {
            corners.reverse();
        }
        let mut text = format!("usemtl {}\n", self.material);
        for [x, z] in corners {
            text += &format!("v {} {} {}\n", scale * x + shift, scale * y, scale * z);
        }
        for [x, z] in corners {
            text += &format!("vt {x} {z}\n");
        }
        text + "f 1/1 2/2 3/3 4/4\n"
    }
}

/// A scene as numbers.
pub struct Case {
    pub squares: Vec<Square>,
    /// Statements of the materials, by name.
    pub materials: Vec<(&'static str, String)>,
    pub from: [f64; 3],
    pub to: [f64; 3],
    /// Everything is this many times as large, and moved along x.
    pub scale: f64,
    pub shift: f64,
    pub camera: String,
    pub depth: u32,
    pub samples: u32,
    pub seed: u32,
    pub size: [u32; 2],
    pub fov: f64,
    pub strategy: Strategy,
}

impl Case {
    /// A floor of a material, seen from a place.
    pub fn floor(statements: impl Into<String>, from: [f64; 3]) -> Self {
        Self {
            squares: vec![Square::new("floor")],
            materials: vec![("floor", statements.into())],
            from,
            to: [0.0; 3],
            scale: 1.0,
            shift: 0.0,
            camera: String::new(),
            depth: 1,
            samples: 16,
            seed: 0,
            size: [SIZE; 2],
            fov: FOV,
            strategy: Strategy::OWN,
        }
    }

    fn write(&self, folder: &Path) {
        let file = |name: &str, text: &str| {
            std::fs::write(folder.join(name), text).expect("the file is written");
        };
        let place = |p: [f64; 3]| {
            [
                self.scale * p[0] + self.shift,
                self.scale * p[1],
                self.scale * p[2],
            ]
        };
        let mut scene = format!(
            "[camera]\nposition = {:?}\nlook_at = {:?}\nup = [0, 0, -1]\nfov = {}\n{}\n\
             [film]\nwidth = {}\nheight = {}\n\
             [integrator]\nmax_depth = {}\nroulette_start = 100\n",
            place(self.from),
            place(self.to),
            self.fov,
            self.camera,
            self.size[0],
            self.size[1],
            self.depth
        );
        for (i, square) in self.squares.iter().enumerate() {
            scene += &format!("[[geometry]]\nobj = \"{i}.obj\"\n{}\n", square.placed);
            file(&format!("{i}.obj"), &square.obj(self.scale, self.shift));
        }
        for (name, statements) in &self.materials {
            scene += &format!("[materials.{name}]\nfile = \"{name}.impasto\"\n");
            let uses: String = [
                ("bsdf", "smooth_dielectric"),
                ("bsdf", "diffuse"),
                ("bsdf", "specular"),
                ("edf", "uniform"),
            ]
            .iter()
            .filter(|(_, item)| statements.contains(&format!("{item}(")))
            .map(|(folder, item)| format!("use std::{folder}::{item};\n"))
            .collect();
            let (items, body) = statements.split_once("%%").unwrap_or(("", statements));
            file(
                &format!("{name}.impasto"),
                &format!("{uses}{items}\nmaterial {name} {{ {body} }}\n"),
            );
        }
        file("scene.toml", &scene);
    }

    fn load(&self) -> (Scene, Program) {
        let folder = tempfile::tempdir().expect("a folder");
        self.write(folder.path());
        let scene =
            impasto::load(&folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
        let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{e}"));
        (scene, program)
    }

    /// The same picture of one sample a pixel, by the interpreter of kernels.
    pub fn replay<F: Float>(&self, materials: MaterialCode) -> Vec<[f64; 3]> {
        let (scene, program) = self.load();
        let technique = Technique::default();
        let world = World::of_program(&scene, &program, &technique);
        let world = world.unwrap_or_else(|e| panic!("{e}"));
        let all = with_room(|| {
            let replayer = Replayer::new(&world, &program, technique.sampler).expect("a kernel");
            let code = replayer.code(materials).expect("known code");
            let mut session = replayer.session::<F>(&code).expect("known buffers");
            let pixels = (0..self.size[0] * self.size[1]).map(|p| {
                let place = [p % self.size[0], p / self.size[0]];
                let path = session.path(place, 0, self.seed);
                path.unwrap_or_else(|e| panic!("{e}")).radiance
            });
            pixels.collect()
        });
        all.unwrap_or_else(|e| panic!("{e}"))
    }

    /// The picture, row by row.
    pub fn render(&self) -> Vec<[f64; 3]> {
        let (scene, program) = self.load();
        let plan = impasto::plan(&program, self.strategy).expect("a plan");
        let gpu = Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let options = RenderOptions {
            samples: self.samples,
            seed: self.seed,
            ..RenderOptions::default()
        };
        let renderer = Renderer::new(&gpu, &scene, &program, &plan, &options);
        let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
        let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(rendering.report.nonfinite_samples, 0);
        let pixels = rendering.film.pixels.iter();
        pixels.map(|p| p.map(f64::from)).collect()
    }

    /// The pixel in the middle.
    pub fn middle(&self) -> [f64; 3] {
        let [width, height] = self.size;
        self.render()[(height / 2 * width + width / 2) as usize]
    }

    /// The angle from a pixel to the next in the middle of the picture.
    pub fn pixel(&self) -> f64 {
        2.0 * (0.5 * self.fov.to_radians()).tan() / f64::from(self.size[1])
    }
}
