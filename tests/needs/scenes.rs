//! Small scenes that differ in what they need.

use std::path::{Path, PathBuf};

use impasto::runtime::technique::{CameraRays, LastRays, Technique};
use impasto::runtime::world::World;
use impasto::{Program, Scene};

/// What corners of the geometry have beside positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corners {
    Plain,
    Normals,
    Uvs,
    /// The second set is that of another file.
    Uvs1,
    Colors,
}

/// A scene as text: a floor and a wall, and two tilted tiles above them.
#[derive(Clone, Debug)]
pub struct Text {
    pub camera: &'static str,
    pub integrator: &'static str,
    pub lights: Vec<&'static str>,
    pub environment: &'static str,
    /// The body of the material of the first tile; that of the room otherwise.
    pub thing: Option<&'static str>,
    /// The same of the second.
    pub other: Option<&'static str>,
    pub corners: Corners,
    /// Whether the geometry stands there twice, and is stored once.
    pub shared: Option<bool>,
    pub technique: Technique,
    /// What `--aov` asks for.
    pub outputs: &'static [&'static str],
}

pub const QUAD: &str = "kind = \"quad\"\ncorner = [-0.5, 1.9, -0.5]\nu = [1, 0, 0]\nv = [0, 0, 1]\n\
                        radiance = [9, 8, 7]";
pub const SECOND_QUAD: &str = "kind = \"quad\"\ncorner = [-1, 1.5, 0]\nu = [0.3, 0, 0]\nv = [0, 0, 0.3]\n\
                               radiance = [3, 8, 9]";
pub const TWO_SIDED: &str = "kind = \"quad\"\ncorner = [-0.5, 1.9, -0.5]\nu = [1, 0, 0]\nv = [0, 0, 1]\n\
                             radiance = [9, 8, 7]\ntwo_sided = true";
pub const SPHERE: &str =
    "kind = \"sphere\"\ncenter = [-0.8, 1.5, 0.2]\nradius = 0.1\nradiance = [3, 8, 9]";
pub const SPOT: &str = "kind = \"sphere\"\ncenter = [-0.8, 1.5, 0.2]\nradius = 0.1\nradiance = [3, 8, 9]\n\
                        axis = [0.4, -1, 0]\ncone = 50\ninner = 20";
pub const QUAD_BY_CHANCE: &str = "kind = \"quad\"\ncorner = [-0.5, 1.9, -0.5]\nu = [1, 0, 0]\nv = [0, 0, 1]\n\
                                  radiance = [9, 8, 7]\nsample = false";
pub const DIRECTION: &str = "kind = \"distant\"\nto_light = [-0.2, 1, 0.3]\nirradiance = [2, 2, 1]";
pub const DISC: &str =
    "kind = \"distant\"\nto_light = [-0.2, 1, 0.3]\nirradiance = [2, 2, 1]\nangle = 20";
pub const DISC_BY_CHANCE: &str = "kind = \"distant\"\nto_light = [-0.2, 1, 0.3]\nirradiance = [2, 2, 1]\nangle = 20\nsample = false";
pub const SKY: &str = "[environment]\ncolor = [0.3, 0.4, 0.5]\nsample = true\n";
pub const MAP: &str = "[environment]\nfile = \"sky.hdr\"\n";

/// Every ray is cast, and those of the camera with the others: where they may be cast at once and which need not be
/// cast, other rows decide.
pub fn queued() -> Technique {
    Technique {
        camera_rays: CameraRays::Queue,
        last_rays: LastRays::All,
        ..Technique::default()
    }
}

impl Default for Text {
    fn default() -> Self {
        Self {
            camera: "",
            integrator: "max_depth = 4\nroulette_start = 8",
            lights: vec![QUAD],
            environment: "",
            thing: None,
            other: None,
            corners: Corners::Plain,
            shared: None,
            technique: queued(),
            outputs: &[],
        }
    }
}

/// A scene that was read and compiled.
pub struct Loaded {
    pub scene: Scene,
    pub program: Program,
    pub world: World,
    pub technique: Technique,
}

impl Text {
    /// Writes the scene's files into `folder`, and reads them.
    pub fn load(&self, folder: &Path) -> Loaded {
        self.write(folder);
        let scene = impasto::load(&folder.join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
        let outputs = self.outputs();
        let program = impasto::compile_for(&scene, &outputs).unwrap_or_else(|e| panic!("{e}"));
        let technique = self.technique;
        let world = World::of_render(&scene, &program, &technique, &outputs);
        Loaded {
            world: world.unwrap_or_else(|e| panic!("{e}")),
            scene,
            program,
            technique,
        }
    }

    pub fn outputs(&self) -> Vec<String> {
        self.outputs.iter().map(|name| (*name).to_owned()).collect()
    }

    fn write(&self, folder: &Path) {
        let file = |name: &str, text: &str| {
            std::fs::write(folder.join(name), text).expect("the file is written");
        };
        let mut scene = format!(
            "[camera]\nposition = [0, 1, 3]\nlook_at = [0, 0.7, 0]\nfov = 45\n{}\n\
             [film]\nwidth = 16\nheight = 16\n[integrator]\n{}\n",
            self.camera, self.integrator
        );
        scene += "[[geometry]]\nobj = \"room.obj\"\n";
        if self.corners == Corners::Uvs1 {
            scene += "uv1 = \"second.obj\"\n";
            file("second.obj", &self.obj());
        }
        if let Some(shared) = self.shared {
            scene += &format!(
                "share = {shared}\nplacements = [{{}}, {{ translate = [0.3, 0.4, -0.2] }}]\n"
            );
        }
        let bodies = [
            ("room", Some("surface = diffuse(color(0.6, 0.5, 0.4));")),
            ("thing", self.thing),
            ("other", self.other),
        ];
        for (name, body) in bodies {
            if let Some(body) = body {
                scene += &format!("[materials.{name}]\nfile = \"{name}.impasto\"\n");
                file(&format!("{name}.impasto"), &material(name, body));
            }
        }
        for light in &self.lights {
            scene += &format!("[[lights]]\n{light}\n");
        }
        scene += self.environment;
        file("scene.toml", &scene);
        file("room.obj", &self.obj());
        let sky: Vec<_> = (0..8u8)
            .map(|i| image::Rgb([0.2, 0.1 * f32::from(i), 0.5]))
            .collect();
        let hdr = std::fs::File::create(folder.join("sky.hdr")).expect("a file");
        let encoder = image::codecs::hdr::HdrEncoder::new(hdr);
        encoder.encode(&sky, 4, 2).expect("a picture");
        let stone = root().join("materials/textures/stone.png");
        std::fs::copy(stone, folder.join("stone.png")).expect("a texture");
    }

    fn obj(&self) -> String {
        let name = |own: Option<&str>, name| if own.is_some() { name } else { "room" };
        let tiles: [(&str, [[f32; 3]; 4]); 4] = [
            (
                "room",
                [[-2., 0., 2.], [2., 0., 2.], [2., 0., -2.], [-2., 0., -2.]],
            ),
            (
                "room",
                [[-2., 0., -1.], [2., 0., -1.], [2., 3., -1.], [-2., 3., -1.]],
            ),
            (
                name(self.thing, "thing"),
                [
                    [-0.8, 0.3, 0.3],
                    [0., 0.3, 0.5],
                    [0., 0.9, 0.],
                    [-0.8, 0.9, -0.2],
                ],
            ),
            (
                name(self.other, "other"),
                [
                    [0.1, 0.2, 0.3],
                    [0.9, 0.3, 0.2],
                    [0.9, 0.9, 0.],
                    [0.1, 0.9, -0.2],
                ],
            ),
        ];
        let mut text = String::from("vn 0 1 0\nvn 0.1 0.9 0.3\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n");
        for (at, (material, corners)) in tiles.iter().enumerate() {
            text += &format!("usemtl {material}\n");
            for (k, [x, y, z]) in corners.iter().enumerate() {
                let color = match self.corners {
                    Corners::Colors => format!(" 0.9 0.{k} 0.5"),
                    _ => String::new(),
                };
                text += &format!("v {x} {y} {z}{color}\n");
            }
            let corner = |k: usize| {
                let v = 4 * at + k + 1;
                match self.corners {
                    Corners::Plain | Corners::Colors => format!(" {v}"),
                    Corners::Normals => format!(" {v}//{}", 1 + k % 2),
                    Corners::Uvs | Corners::Uvs1 => format!(" {v}/{}", k + 1),
                }
            };
            text += &format!("f{}\n", (0..4).map(corner).collect::<String>());
        }
        text
    }
}

fn material(name: &str, body: &str) -> String {
    let names = [
        "blinn_phong",
        "dielectric",
        "diffuse",
        "random_walk",
        "smooth_dielectric",
        "specular",
        "translucent",
    ];
    let used: Vec<&str> = names
        .into_iter()
        .filter(|n| {
            body.contains(&format!("= {n}("))
                || body.contains(&format!(" {n}("))
                || body.contains(&format!("({n}("))
        })
        .collect();
    let mut text = format!("use std::bsdf::{{{}}};\n", used.join(", "));
    if body.contains("uniform(") {
        text += "use std::edf::uniform;\n";
    }
    let (params, body) = if body.contains("picture") {
        ("param picture: texture = \"stone.png\"; ", body)
    } else {
        ("", body)
    };
    format!("{text}material {name} {{ {params}{body} }}\n")
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}
