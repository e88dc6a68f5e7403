//! The kinds of cases: the table, and what each is made from. A kind writes its files into an empty folder and
//! says which arguments the command is run with there.

use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{films, foreign, pictures, scenes, usd};
use crate::Random;
use crate::corpus::{Corpus, files, root, sources};
use crate::geometry::SCENES;
use crate::mutate::{mutate, revalue, soup};
use crate::sources::SHAPES;

/// A kind of cases.
#[derive(Clone, Copy)]
pub struct Kind {
    /// What it is called.
    pub name: &'static str,
    pub(super) make: Make,
}

type Make = fn(&Seeds, &mut Random, &Path) -> io::Result<Vec<String>>;

/// All of them. Only the last ones open a GPU.
pub const KINDS: &[Kind] = &[
    kind("source", source),
    kind("shape", shape),
    kind("scene", scene),
    kind("geometry", geometry),
    kind("ply", ply),
    kind("gltf", foreign::gltf),
    kind("usd", usd::usd),
    kind("document", foreign::document),
    kind("material", material),
    kind("placements", placements),
    kind("picture", picture),
    kind("film", film),
    kind("plan", plan),
    kind("workload", workload),
    kind("profile", profile),
    kind("checkpoint", checkpoint),
    kind("render", render),
];

const fn kind(name: &'static str, make: Make) -> Kind {
    Kind { name, make }
}

/// An example whose files are changed.
struct Example {
    name: String,
    scene: Vec<u8>,
    workload: Vec<u8>,
}

/// Good files to begin with.
pub(super) struct Seeds {
    root: PathBuf,
    sources: Corpus,
    pub(super) documents: Vec<Vec<u8>>,
    examples: Vec<Example>,
    scenes: Vec<Vec<u8>>,
    pictures: Vec<(&'static str, Vec<u8>)>,
    films: Vec<Vec<u8>>,
    plans: Vec<Vec<u8>>,
    workloads: Vec<Vec<u8>>,
    profiles: Vec<Vec<u8>>,
}

/// Longest scene that is changed: longer ones are all alike.
const LONGEST: usize = 8 << 10;
/// The scene that films and plans are of.
const RENDERED: &str = "cornell";
/// How films are rendered, but for where to.
const RENDER: &str = "--size 4x3 --spp 2 --strategy own";

impl Seeds {
    /// Those that only the command can make are made in `folder`.
    pub(super) fn new(impasto: &Path, folder: &Path) -> Result<Self, String> {
        let root = std::path::absolute(root()).map_err(|e| e.to_string())?;
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let examples = examples(&root);
        let scene = format!("{}/examples/{RENDERED}/scene.toml", root.display());
        let made = |arguments: &str, out: &str| made(impasto, &scene, arguments, &folder.join(out));
        let films = vec![
            made(&format!("render {RENDER} --out"), "plain.film")?,
            made(
                &format!("render {RENDER} --aov albedo,material,variance --out"),
                "outputs.film",
            )?,
        ];
        for film in &films {
            let mut sealed = film.clone();
            films::seal(&mut sealed);
            if sealed != *film {
                return Err("films do not end in the fingerprint that is known here".into());
            }
        }
        let workload = root.join(format!("tests/plans/{RENDERED}.workload.json"));
        let given = format!(
            "--workload {} --profile h200 --samples 16 --save",
            workload.display()
        );
        let plans = vec![
            made(&format!("plan {given}"), "auto.json")?,
            made(&format!("plan --strategy own {given}"), "own.json")?,
        ];
        Ok(Self {
            sources: sources(),
            documents: files("import/tests/documents", ".mtlx"),
            scenes: examples.iter().map(|e| e.scene.clone()).collect(),
            examples,
            pictures: pictures::good()?,
            films,
            plans,
            workloads: vec![
                std::fs::read(&workload).map_err(|e| format!("{}: {e}", workload.display()))?,
            ],
            profiles: files("compiler/src/partition/profiles", ".json"),
            root,
        })
    }

    fn example(&self, random: &mut Random) -> &Example {
        &self.examples[random.below(self.examples.len())]
    }

    /// Brings an example's files into a folder, but for the scene itself; gives the folder of the latter.
    fn beside(&self, name: &str, folder: &Path) -> io::Result<PathBuf> {
        let here = folder.join("examples").join(name);
        std::fs::create_dir_all(&here)?;
        symlink(self.root.join("materials"), folder.join("materials"))?;
        for entry in std::fs::read_dir(self.root.join("examples"))? {
            let entry = entry?;
            if entry.file_name() != name {
                symlink(
                    entry.path(),
                    folder.join("examples").join(entry.file_name()),
                )?;
            }
        }
        for entry in std::fs::read_dir(self.root.join("examples").join(name))? {
            let entry = entry?;
            if entry.file_name() != "scene.toml" {
                symlink(entry.path(), here.join(entry.file_name()))?;
            }
        }
        Ok(here)
    }

    fn rendered(&self) -> String {
        format!("{}/examples/{RENDERED}/scene.toml", self.root.display())
    }
}

fn examples(root: &Path) -> Vec<Example> {
    let entries = std::fs::read_dir(root.join("examples"));
    let names = entries
        .into_iter()
        .flatten()
        .flatten()
        .map(|e| e.file_name());
    let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    names.sort();
    let example = |name: String| {
        let scene = std::fs::read(root.join("examples").join(&name).join("scene.toml")).ok()?;
        let workload = root
            .join("tests/plans")
            .join(format!("{name}.workload.json"));
        let workload = std::fs::read(workload).ok()?;
        // What `cargo scenes` makes is large, and not there until it is asked for.
        let is_small =
            scene.len() <= LONGEST && !String::from_utf8_lossy(&scene).contains("generated/");
        is_small.then_some(Example {
            name,
            scene,
            workload,
        })
    };
    names.into_iter().filter_map(example).collect()
}

/// What the command writes to the file that its last argument names.
fn made(impasto: &Path, scene: &str, arguments: &str, out: &Path) -> Result<Vec<u8>, String> {
    let run = Command::new(impasto)
        .args(arguments.split_whitespace())
        .arg(out)
        .arg(scene)
        .stdin(Stdio::null())
        .output();
    let run = run.map_err(|e| format!("{}: {e}", impasto.display()))?;
    if !run.status.success() {
        let why = String::from_utf8_lossy(&run.stderr).into_owned();
        return Err(format!("no {} to begin with: {why}", out.display()));
    }
    std::fs::read(out).map_err(|e| format!("{}: {e}", out.display()))
}

pub(super) fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

fn source(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let text = crate::search::input(random, &seeds.sources);
    std::fs::write(folder.join("m.impasto"), text)?;
    on_source(random)
}

fn shape(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let shape = &SHAPES[random.below(SHAPES.len())];
    let bytes = [200, 2_000, 20_000][random.below(3)];
    std::fs::write(folder.join("m.impasto"), shape.source(bytes))?;
    on_source(random)
}

/// One of the commands that read sources.
fn on_source(random: &mut Random) -> io::Result<Vec<String>> {
    let command = [
        "check m.impasto",
        "check --format json m.impasto",
        "emit m.impasto",
        "emit --what ir m.impasto",
        "emit --target webgpu m.impasto",
        "emit --what params m.impasto",
        "emit --what docs m.impasto",
        "fmt --check m.impasto",
        "cost m.impasto",
        "eval m.impasto",
    ];
    Ok(words(command[random.below(command.len())]))
}

/// Writes an example with a changed scene; gives the name of the scene, and the example.
fn changed<'s>(
    seeds: &'s Seeds,
    random: &mut Random,
    folder: &Path,
) -> io::Result<(String, &'s Example)> {
    let example = seeds.example(random);
    let here = seeds.beside(&example.name, folder)?;
    let text = scenes::mutated(random, &example.scene, &seeds.scenes);
    std::fs::write(here.join("scene.toml"), text)?;
    Ok((format!("examples/{}/scene.toml", example.name), example))
}

fn scene(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let (at, example) = changed(seeds, random, folder)?;
    std::fs::write(folder.join("workload.json"), &example.workload)?;
    Ok(words(&match random.below(8) {
        0 => format!("plan {at} --workload workload.json --profile h200 --samples 16"),
        1 => format!("trace {at} --pixel 0,0 --size 2x2"),
        _ => format!("plan --needs {at}"),
    }))
}

/// Words of OBJ files.
const OBJ: &[&str] = &[
    "v",
    "vt",
    "vn",
    "f",
    "l",
    "p",
    "o",
    "g",
    "s",
    "usemtl",
    "mtllib",
    "1/1/1",
    "1//1",
    "-1",
    "0",
    "1e39",
    "nan",
    "inf",
    "4294967296",
    "99999999999999999999",
    "\n",
    "\\\n",
    "#",
    "f 1 2 3\n",
    "f 1 1 1\n",
    "v 1e300 1e300 1e300\n",
    "vn 0 0 0\n",
    "vt nan nan\n",
    "v 1 2\n",
    "f 1 2\n",
    "f 0 0 0\n",
    "f -1 -2 -3\n",
    "usemtl x\n",
    "mtllib g.obj\n",
    "mtllib m.mtl\n",
    "mtllib .\n",
    "v 1 2 3 4 5 6 7\n",
];
/// Words of PLY files.
const PLY: &[&str] = &[
    "ply\n",
    "format ascii 1.0\n",
    "format binary_little_endian 1.0\n",
    "format binary_big_endian 1.0\n",
    "element vertex 3\n",
    "element vertex 4294967295\n",
    "element face 99999999999999999999\n",
    "element tristrips 1\n",
    "property float x\n",
    "property double nx\n",
    "property uchar red\n",
    "property list uchar int vertex_indices\n",
    "property list int int64 vertex_index\n",
    "property list char float texcoord\n",
    "comment TextureFile x.png\n",
    "end_header\n",
    "-1",
    "255",
    "nan",
    "1e39",
    "4294967295",
    "\r",
    "\n",
    "\0",
    "\u{7f}\u{7f}",
];
/// Words of MTL files.
const MTL: &[&str] = &[
    "newmtl",
    "Kd",
    "Ks",
    "Ka",
    "Ke",
    "Ns",
    "Ni",
    "d",
    "Tr",
    "illum",
    "map_Kd",
    "map_Bump",
    "1e39",
    "nan",
    "-1",
    "\n",
    "newmtl x\n",
    "Kd 1\n",
    "Kd 1 2 3 4\n",
    "Ni 0\n",
    "map_Kd m.mtl\n",
    "map_Kd -s 1 1 1 x.png\n",
    "Kd nan nan nan\n",
    "Pr 2\n",
    "Pm 1\n",
    "Pcr 2\n",
    "aniso -1\n",
    "disp m.mtl\n",
    "map_Bump -bm nan -s 2 x.png\n",
    "norm -clamp on x.png\n",
];

/// Numbers that a text of geometry may have, and some that it may not.
pub(super) const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "1e30",
    "-1e30",
    "1e38",
    "1e-38",
    "1e-45",
    "3.4e38",
    "1e300",
    "1e-300",
    "1e999",
    "0.99999999",
    "1.00000001",
    "65536",
    "4294967295",
    "4294967296",
    "-2147483648",
    "9223372036854775808",
    "1e12",
    "16777217",
    "nan",
    "inf",
    "0x10",
    "1_000",
    "+1",
    ".",
    "1e",
    "1 2",
];

/// A scene of hard geometry with its OBJ text.
fn hard(random: &mut Random, folder: &Path) -> io::Result<Vec<u8>> {
    let row = &SCENES[random.below(SCENES.len())];
    let most = [4, 60][random.below(2)];
    row.write(8 + random.below(most), folder)?;
    std::fs::read(folder.join("g.obj"))
}

fn geometry(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let obj = hard(random, folder)?;
    let other = b"vt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1\nf 1//1 2//1 3//1\n".to_vec();
    let obj = match random.below(3) {
        0 => mutate(random, &obj, &[obj.clone(), other], OBJ),
        _ => revalue(random, &obj, NUMBERS),
    };
    std::fs::write(folder.join("g.obj"), obj)?;
    Ok(words("plan --needs scene.toml"))
}

/// A scene with a PLY file, whose text or bytes are those of two triangles but for some.
fn ply(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    hard(random, folder)?;
    let header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n\
        property list uchar float texcoord\nend_header\n";
    let text = "0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n1 1 0 7 8 9\n3 0 1 2 0\n4 0 1 3 2 8 0 0 1 0 1 1 0 1\n";
    let text = format!("ply\nformat ascii 1.0\n{header}{text}").into_bytes();
    let is_big = random.below(2) == 0;
    let bytes = ply_bytes(header, is_big);
    let (good, other) = match random.below(2) {
        0 => (text, bytes),
        _ => (bytes, text),
    };
    let file = match random.below(8) {
        0 => [b"ply\n".as_slice(), &soup(random, PLY, 40)].concat(),
        1..5 => mutate(random, &good, &[good.clone(), other], PLY),
        _ => revalue(random, &good, NUMBERS),
    };
    std::fs::write(folder.join("g.ply"), file)?;
    let scene = std::fs::read_to_string(folder.join("scene.toml"))?;
    let scene = scene.replace("obj = 'g.obj'", "file = 'g.ply'");
    std::fs::write(folder.join("scene.toml"), scene)?;
    Ok(words("plan --needs scene.toml"))
}

/// The same two triangles as bytes.
fn ply_bytes(header: &str, is_big: bool) -> Vec<u8> {
    let order = if is_big { "big" } else { "little" };
    let mut out = format!("ply\nformat binary_{order}_endian 1.0\n{header}").into_bytes();
    let word = |bits: u32| {
        if is_big {
            bits.to_be_bytes()
        } else {
            bits.to_le_bytes()
        }
    };
    for corner in 0..4 {
        for at in [corner % 2, corner / 2, 0] {
            out.extend(word((at as f32).to_bits()));
        }
        out.extend([1, 2, 3]);
    }
    for face in [[0, 1, 2], [2, 1, 3]] {
        out.push(3);
        out.extend(face.into_iter().flat_map(word));
        out.push(0);
    }
    out
}

fn material(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let obj = hard(random, folder)?;
    let obj = [b"mtllib m.mtl\nusemtl a\n".as_slice(), &obj].concat();
    std::fs::write(folder.join("g.obj"), obj)?;
    let good = b"newmtl a\nKd 0.5 0.4 0.3\nKs 0 0 0\nNs 10\nNi 1.5\nd 1\nillum 2\n".to_vec();
    let mtl = match random.below(8) {
        0 => soup(random, MTL, 40),
        1..4 => mutate(random, &good, std::slice::from_ref(&good), MTL),
        _ => revalue(random, &good, NUMBERS),
    };
    std::fs::write(folder.join("m.mtl"), mtl)?;
    let text = "use std::bsdf::diffuse;\nmaterial matte { param c: color = color(0.5); surface = diffuse(c); }\n\
        material bright { surface = diffuse(0.5); }\n";
    std::fs::write(folder.join("m.impasto"), text)?;
    let scene = std::fs::read_to_string(folder.join("scene.toml"))?;
    let scene = scene.replace("material = 'bright'", "material = 'matte'");
    let name = ["$Kd", "$Ks", "$Ns", "$Ni", "$d", "$Pr"][random.below(6)];
    std::fs::write(
        folder.join("scene.toml"),
        format!("{scene}params = {{ c = \"{name}\" }}\n"),
    )?;
    Ok(words("plan --needs scene.toml"))
}

fn placements(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    hard(random, folder)?;
    let good = b"x y z ry scale\n0 0 0 0 1\n1 0 0 90 0.5\n".to_vec();
    let file = folder.join("placements.txt");
    let good = std::fs::read(&file).unwrap_or(good);
    let text = match random.below(3) {
        0 => mutate(random, &good, std::slice::from_ref(&good), OBJ),
        _ => revalue(random, &good, NUMBERS),
    };
    std::fs::write(file, text)?;
    let scene = std::fs::read_to_string(folder.join("scene.toml"))?;
    if !scene.contains("placements") {
        let entry = "obj = 'g.obj'\nplacements = 'placements.txt'";
        std::fs::write(
            folder.join("scene.toml"),
            scene.replace("obj = 'g.obj'", entry),
        )?;
    }
    Ok(words("plan --needs scene.toml"))
}

/// As a texture and as an environment, of which the scene says which is read.
fn picture(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let (extension, good) = &seeds.pictures[random.below(seeds.pictures.len())];
    let bytes = pictures::mutated(random, good);
    // Now and then with the extension of another format.
    let extension = match random.below(8) {
        0 => seeds.pictures[random.below(seeds.pictures.len())].0,
        _ => extension,
    };
    let name = format!("p.{extension}");
    std::fs::write(folder.join(&name), bytes)?;
    hard(random, folder)?;
    let scene = std::fs::read_to_string(folder.join("scene.toml"))?;
    if random.below(2) == 0 {
        let scene = scene.replace(
            "environment.color = 0.5",
            &format!("environment.file = '{name}'"),
        );
        std::fs::write(folder.join("scene.toml"), scene)?;
    } else {
        let surface = "surface = diffuse(image(p, uv));";
        let text = format!(
            "use std::bsdf::diffuse;\nmaterial matte {{ param p: texture = \"{name}\"; {surface} }}\n\
             material bright {{ param p: texture = \"{name}\"; {surface} }}\n"
        );
        std::fs::write(folder.join("m.impasto"), text)?;
    }
    Ok(words("plan --needs scene.toml"))
}

fn film(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let good = &seeds.films[random.below(seeds.films.len())];
    std::fs::write(folder.join("a.film"), films::mutated(random, good))?;
    std::fs::write(
        folder.join("b.film"),
        &seeds.films[random.below(seeds.films.len())],
    )?;
    let out = ["o.exr", "o.png", "o.film"][random.below(3)];
    Ok(words(&match random.below(3) {
        0 => format!("merge b.film a.film --out {out}"),
        _ => format!("merge a.film --out {out}"),
    }))
}

/// Words of the JSON files.
const JSON: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    ":",
    ",",
    "\"",
    "null",
    "true",
    "false",
    "0",
    "-1",
    "1e999",
    "-1e999",
    "1e308",
    "1e-320",
    "NaN",
    "18446744073709551616",
    "9223372036854775807",
    "4294967296",
    "[]",
    "{}",
    "\"\"",
    "\"\\u0000\"",
    "\"\\ud800\"",
    "[[[[[[[[",
    "\"own\"",
    "\"kernels\"",
    "\"materials\"",
    "\"hits\"",
    "\"inline\"",
];

/// Values to put in the place of others.
const JSON_VALUES: &[&str] = &[
    "0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "1.5",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "18446744073709551615",
    "18446744073709551616",
    "9223372036854775807",
    "4294967295",
    "4294967296",
    "65536",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"x\"",
    "\"own\"",
    "\"inline\"",
    "\"matte\"",
    "\"\\u0000\"",
    "[0]",
    "1e38",
    "1e-45",
];

fn json(random: &mut Random, all: &[Vec<u8>]) -> Vec<u8> {
    let good = &all[random.below(all.len())];
    match random.below(6) {
        0 => good[..random.below(good.len() + 1)].to_vec(),
        1 => mutate(random, good, all, JSON),
        _ => revalue(random, good, JSON_VALUES),
    }
}

fn plan(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    std::fs::write(folder.join("p.json"), json(random, &seeds.plans))?;
    on_plan(seeds, "--plan p.json --profile h200", None)
}

fn workload(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    std::fs::write(folder.join("w.json"), json(random, &seeds.workloads))?;
    on_plan(seeds, "--profile h200", Some("w.json"))
}

fn profile(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    std::fs::write(folder.join("d.json"), json(random, &seeds.profiles))?;
    on_plan(seeds, "--profile d.json", None)
}

fn on_plan(seeds: &Seeds, more: &str, workload: Option<&str>) -> io::Result<Vec<String>> {
    let mut arguments = words(&format!("plan --samples 16 {more} --workload"));
    let good = seeds
        .root
        .join(format!("tests/plans/{RENDERED}.workload.json"));
    arguments.push(workload.map_or_else(|| good.display().to_string(), str::to_owned));
    arguments.push(seeds.rendered());
    Ok(arguments)
}

fn checkpoint(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    std::fs::write(
        folder.join("c.film"),
        films::mutated(random, &seeds.films[0]),
    )?;
    let mut arguments = words(&format!("render {RENDER} --checkpoint c.film --out o.png"));
    arguments.push(seeds.rendered());
    Ok(arguments)
}

/// A changed scene all the way to a picture.
fn render(seeds: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let at = changed(seeds, random, folder)?.0;
    Ok(words(&format!(
        "render {at} --size 4x3 --spp 1 --strategy own --out o.exr"
    )))
}
