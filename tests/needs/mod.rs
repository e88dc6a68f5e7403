//! What a scene does not need is absent from it: for every row of the table of needs a pair of scenes that
//! differ in it alone.
//!
//! What differs in the kernels of a pair is compared with what the pair says of the row, to the name of a
//! function; and both are rendered with everything on as well, which must be the same picture. The
//! rows are walked: one without a pair fails.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::Path;

use impasto::runtime::audit::{self, KernelText, NeedsReport};
use impasto::runtime::technique::{Features, LastRays, Technique};
use impasto::runtime::world::World;
use impasto::{Gpu, GpuOptions, RenderOptions, Renderer, Rendering, Strategy};

mod pairs;
mod scenes;

use pairs::{HELD_ELSEWHERE, PAIRS};
use scenes::{Loaded, Text};

/// Names that the compiler gives to functions of materials, which differ where materials do.
const GENERATED: [&str; 11] = [
    "core_",
    "bsdf_",
    "edf_",
    "noise_",
    "pattern_",
    "user_",
    "op_",
    "evaluate_",
    "emission_",
    "albedo_",
    "normal_",
];

#[test]
fn every_row_has_one_pair() {
    let rows: Vec<&str> = audit::rows().map(|(name, _)| name).collect();
    for row in &rows {
        let count = PAIRS.iter().filter(|pair| pair.row == *row).count();
        let elsewhere = HELD_ELSEWHERE.iter().filter(|(name, _)| name == row);
        assert_eq!(count + elsewhere.count(), 1, "pairs of `{row}`");
    }
    assert_eq!(rows.len(), PAIRS.len() + HELD_ELSEWHERE.len());
}

#[test]
fn a_pair_differs_by_the_items_of_its_row_alone() {
    let mut wrong = String::new();
    // Half of the scenes stand in several pairs.
    let mut known = BTreeMap::new();
    for pair in &PAIRS {
        let texts = [(pair.without)(), (pair.with)()];
        for text in &texts {
            let kernels = || Kernels::of(&load(text));
            known.entry(format!("{text:?}")).or_insert_with(kernels);
        }
        let [without, with] = texts.map(|text| &known[&format!("{text:?}")]);
        let rows: BTreeSet<&str> = with.needed.difference(&without.needed).copied().collect();
        let expected = pair.also.iter().copied().chain([pair.row]);
        assert_eq!(
            rows,
            expected.collect(),
            "the rows that `{}` brings",
            pair.row
        );
        let lost: Vec<_> = without.needed.difference(&with.needed).collect();
        assert!(lost.is_empty(), "`{}` takes away {lost:?}", pair.row);
        let items = with.beyond(without);
        if items != pair.items {
            wrong += &format!(
                "`{}` brings\n    {items:?}\nin the place of\n    {:?}\n",
                pair.row, pair.items
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn with_everything_on_the_picture_is_the_same() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("a GPU is needed: {e}"));
    let mut seen = BTreeSet::new();
    for pair in &PAIRS {
        for text in [(pair.without)(), (pair.with)()] {
            if !seen.insert(format!("{text:?}")) {
                continue;
            }
            let special = picture(&gpu, &text, Features::Scene);
            let whole = picture(&gpu, &text, Features::All);
            assert!(
                special.iter().any(|v| *v > 0.0),
                "{}: a black picture",
                pair.row
            );
            let apart = special
                .iter()
                .zip(&whole)
                .filter(|(a, b)| !is_near(**a, **b));
            let apart: Vec<_> = apart.collect();
            // Other drivers round what they compile in another way, and a path may go astray.
            let allowed = match gpu.info().kind {
                "software" => 0,
                _ => special.len() / 50,
            };
            assert!(apart.len() <= allowed, "{}: {apart:?}", pair.row);
        }
    }
}

/// Of every pair, with paths that end by their length and with some that end by roulette.
#[test]
fn without_last_rays_that_meet_no_light_the_picture_is_the_same() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("a GPU is needed: {e}"));
    let mut seen = BTreeSet::new();
    let [mut cast, mut of_all] = [0, 0];
    for pair in &PAIRS {
        for (text, integrator) in [
            ((pair.without)(), "max_depth = 2\nroulette_start = 8"),
            ((pair.with)(), "max_depth = 5\nroulette_start = 1"),
        ] {
            let by = |last_rays| {
                let technique = Technique {
                    last_rays,
                    ..text.technique
                };
                Text {
                    integrator,
                    technique,
                    ..text.clone()
                }
            };
            if !seen.insert(format!("{:?}", by(LastRays::All))) {
                continue;
            }
            let [some, all] =
                [LastRays::Lights, LastRays::All].map(|last| rendered(&gpu, &by(last)));
            assert_eq!(some.film.pixels, all.film.pixels, "{}", pair.row);
            if some.report.technique.last_rays == LastRays::Lights {
                let rays = |of: &Rendering| of.report.items_of("extension").expect("rays");
                cast += rays(&some);
                of_all += rays(&all);
            }
        }
    }
    assert!(
        cast > 0 && 10 * cast < 9 * of_all,
        "{cast} of {of_all} rays"
    );
}

/// The issue's own measure: a box of one Lambertian material, lit by one quad.
#[test]
fn a_lambertian_box_under_a_quad_has_96_bytes_a_path_and_no_line_for_more() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = Text {
        technique: Technique::default(),
        ..Text::default()
    };
    let kernels = Kernels::of(&text.load(folder.path()));
    assert!(kernels.path_bytes <= 96, "{}", kernels.path_bytes);
    let words = [
        "environment",
        "escape",
        "media",
        "medium",
        "absorption",
        "transmit",
        "exterior_index",
        "distant",
        "mesh_light",
        "two_sided",
        "far_away",
        "roulette",
        "survival",
        "multiply_high",
        "texture",
        "vertex_uvs",
        "vertex_normals",
        "hit_uv",
        "hit_tangent",
        "hit_normal",
        "lens",
        "material_of",
        "material_parameters",
        "needs_last",
        "scatters_sampled",
        "material_emission",
        "placement",
        "request_",
        "ray_bin",
        "false_boundary",
        "renew",
        "cone",
        "footprint",
        "uv_change",
    ];
    // Every kernel of the wavefront asks for work.
    let asked = [
        "request_new_path",
        "request_material",
        "request_extension",
        "request_shadow",
        "requests",
    ];
    for KernelText { name, wgsl, .. } in &kernels.texts {
        let mut code: String = wgsl
            .lines()
            .map(|l| l.split("//").next().unwrap_or(""))
            .collect::<Vec<_>>()
            .join("\n");
        for call in asked {
            code = code.replace(call, "");
        }
        let code = code.to_lowercase();
        for word in words {
            // Members of the struct that materials are given, and of the uniform of the camera, have the names of what
            // nobody computes.
            let members = ["exterior_ior: f32", "transmitted: f32", "lens_radius: f32"];
            let found = code
                .lines()
                .find(|l| l.contains(word) && !members.iter().any(|m| l.contains(m)));
            assert_eq!(found, None, "`{word}` in {name}");
        }
    }
}

fn load(text: &Text) -> Loaded {
    let folder = tempfile::tempdir().expect("a folder");
    text.load(folder.path())
}

/// Equal, but for some units in the last place: a normal that is made a unit once more turns a path by one,
/// and what the path brings is a product of several.
fn is_near(a: f32, b: f32) -> bool {
    a.to_bits().abs_diff(b.to_bits()) <= 64
}

fn picture(gpu: &Gpu, text: &Text, features: Features) -> Vec<f32> {
    let technique = Technique {
        features,
        ..text.technique
    };
    let text = Text {
        technique,
        ..text.clone()
    };
    let film = rendered(gpu, &text).film;
    film.pixels.into_iter().flatten().collect()
}

fn rendered(gpu: &Gpu, text: &Text) -> Rendering {
    let folder = tempfile::tempdir().expect("a folder");
    let Loaded { scene, program, .. } = text.load(folder.path());
    let options = RenderOptions {
        samples: 4,
        technique: text.technique,
        outputs: text.outputs(),
        ..RenderOptions::default()
    };
    let plan = impasto::plan(&program, Strategy::OWN)
        .expect("a plan")
        .leaving_out(&impasto::plan::unused(&scene, &program));
    let renderer = Renderer::new(gpu, &scene, &program, &plan, &options);
    let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    rendering.unwrap_or_else(|e| panic!("{e}"))
}

/// The kernels of a scene.
struct Kernels {
    needed: BTreeSet<&'static str>,
    path_bytes: i64,
    texts: Vec<KernelText>,
}

impl Kernels {
    fn of(scene: &Loaded) -> Self {
        let Loaded {
            program,
            world,
            technique,
            ..
        } = scene;
        let report: NeedsReport =
            audit::report(world, program, *technique).unwrap_or_else(|e| panic!("{e}"));
        let needed = report.rows.iter().filter(|row| row.because.is_some());
        Self {
            needed: needed.map(|row| row.name).collect(),
            path_bytes: report.extent.path_bytes,
            texts: audit::kernels(world, program, *technique).unwrap_or_else(|e| panic!("{e}")),
        }
    }

    /// What these have that others have not, and the other way round.
    fn beyond(&self, other: &Kernels) -> String {
        let mut items = Vec::new();
        let bytes = self.path_bytes - other.path_bytes;
        if bytes != 0 {
            items.push(format!("{bytes:+} bytes"));
        }
        let sets = [
            ("kernels", [self.names(), other.names()]),
            ("bindings", [self.bindings(), other.bindings()]),
            ("functions", [self.functions(), other.functions()]),
        ];
        for (what, [these, those]) in sets {
            let more = these.difference(&those).map(|n| format!(" +{n}"));
            let less = those.difference(&these).map(|n| format!(" -{n}"));
            let differences: String = more.chain(less).collect();
            if !differences.is_empty() {
                items.push(format!("{what}{differences}"));
            }
        }
        items.join("; ")
    }

    fn names(&self) -> BTreeSet<String> {
        let of_materials = ["room", "thing", "other"];
        let names = self.texts.iter().map(|k| k.name.clone());
        names
            .filter(|n| !of_materials.contains(&n.as_str()))
            .collect()
    }

    fn bindings(&self) -> BTreeSet<String> {
        self.texts.iter().flat_map(|k| k.bindings.clone()).collect()
    }

    /// The functions written by hand, or generated by the runtime.
    fn functions(&self) -> BTreeSet<String> {
        let lines = self.texts.iter().flat_map(|k| k.wgsl.lines());
        let names = lines.filter_map(|line| line.strip_prefix("fn ")?.split('(').next());
        let names = names.filter(|name| !GENERATED.iter().any(|g| name.starts_with(g)));
        names.map(str::to_owned).collect()
    }
}

#[test]
fn the_documentation_lists_every_row() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/needs.md");
    let text = std::fs::read_to_string(path).expect("docs/needs.md");
    let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("| ")).collect();
    let listed: BTreeMap<&str, &str> = lines
        .iter()
        .filter_map(|line| {
            let mut cells = line.trim_matches('|').split(" | ");
            Some((cells.next()?.trim(), cells.next()?.trim()))
        })
        .collect();
    for (name, when) in audit::rows() {
        assert_eq!(listed.get(name), Some(&when), "the line of `{name}`");
    }
    assert_eq!(
        listed.len(),
        audit::rows().count() + 1,
        "rows and a heading"
    );
}

/// A pair's scenes are worlds whose needs do not depend on how they are rendered.
#[test]
fn forcing_everything_forces_what_can_be() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = Text::default().load(folder.path());
    let technique = Technique {
        features: Features::All,
        ..Technique::default()
    };
    let world = World::of_program(&scene.scene, &scene.program, &technique);
    let world = world.unwrap_or_else(|e| panic!("{e}"));
    let texts = audit::kernels(&world, &scene.program, technique).unwrap_or_else(|e| panic!("{e}"));
    let all: String = texts.iter().map(|k| k.wgsl.as_str()).collect();
    for function in [
        "sample_mesh_light",
        "sample_distant_light",
        "sample_environment",
        "transmittance",
        "power_heuristic",
        "survival_probability",
        "is_false_boundary",
        "material_emission",
        "hit_uv",
        "hit_normal",
        "scattered_spread",
    ] {
        assert!(all.contains(&format!("fn {function}(")), "{function}");
    }
}
