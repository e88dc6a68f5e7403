//! A stage more is a file and a row: the kernels of tables with one added, composed and validated. The table
//! in use is held against its files, and tables with a mistake must be refused by name.

use std::collections::BTreeMap;
use std::path::Path;

use impasto_compiler::partition::{Form, Plan};
use impasto_compiler::{Loader, MaterialRequest, Parameters, Program, compile, library_text};

use super::check::check;
use super::layout::PlanLayout;
use super::modules::{Composer, DispatchSource, Extent, Kernel, Sizes};
use super::random::{self, Demand};
use super::stages::{Entry, Part, Phase, Request, STAGES, Stage, Work};
use crate::technique::{Append, RayData, RayKernels, Regeneration, Technique};
use crate::wgsl::BufferData;
use crate::wgsl::template::Template;
use crate::world::needs::ALWAYS;
use crate::world::{MaterialSource, World};

/// The file of a stage that is not in the table: it counts what paths hit from far.
const PROBE: &str = "// Counts the vertices that are far from the last.\n
fn probe(slot: u32) {
    if load_hit(slot).t > 1.0 {
        atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
    }
}
";

/// Its row.
fn probe(phase: Phase, work: Work) -> Stage {
    Stage {
        name: "probe",
        body: file(PROBE),
        arguments: "slot",
        need: ALWAYS,
        phase,
        work,
        workgroup: Some(96),
        before: &[],
        casts: None,
        parts: &[(Part::Geometry, ALWAYS)],
        loads: &[(ALWAYS, &["hit"])],
        stores: &[],
    }
}

/// A file of WGSL.
fn file(text: &'static str) -> Template {
    Template {
        file: "a stage",
        source: file!(),
        text,
    }
}

/// A queue of slots that a stage fills.
fn queue(from: &'static [&'static str]) -> Work {
    Work::Queue(Request {
        from,
        parameters: "",
        entry: Entry::Slot,
    })
}

/// The table with a stage more, which another asks for after it has called `call`.
fn with(stage: Stage, asking: &str, call: &str) -> &'static [Stage] {
    let mut stages = STAGES.to_vec();
    let asks = format!("{call}\n    request_probe();");
    if let Some(by) = stages.iter_mut().find(|s| s.name == asking) {
        assert!(by.body.text.contains(call), "{call}");
        by.body.text = by.body.text.replace(call, &asks).leak();
    }
    let at = match stage.phase {
        Phase::Rays => stages.iter().position(|s| s.name == "extension"),
        phase => stages
            .iter()
            .rposition(|s| s.phase == phase)
            .map(|at| at + 1),
    };
    stages.insert(at.expect("a stage of its phase"), stage);
    stages.leak()
}

/// Sources in a folder.
struct Files<'a>(&'a Path);

impl Loader for Files<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        if let Some(text) = library_text(path) {
            return Ok(text?.as_bytes().to_vec());
        }
        std::fs::read(self.0.join(path)).map_err(|error| error.to_string())
    }
}

/// A scene with its materials.
struct Room {
    world: World,
    program: Program,
}

impl Room {
    fn new(technique: &Technique) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/cornell/scene.toml");
        let scene = crate::world::load(&path).unwrap_or_else(|e| panic!("{e}"));
        let requests = scene.materials.iter().cloned().map(|b| MaterialRequest {
            apart: false,
            moment: None,
            written: None,
            name: b.name,
            file: b.file,
            material: b.material,
            params: b.params,
            parameters: Parameters::Agreed,
        });
        let requests: Vec<MaterialRequest> = requests.collect();
        let compilation = compile(&requests, &mut Files(&scene.base));
        let program = compilation.program.expect("materials that compile");
        let world = World::of_program(&scene, &program, technique);
        Self {
            world: world.unwrap_or_else(|e| panic!("{e}")),
            program,
        }
    }

    /// The kernels of a table of stages, which are valid: of a wavefront whose materials are evaluated in some form,
    /// or of a megakernel.
    fn kernels(
        &self,
        stages: &'static [Stage],
        form: Option<Form>,
        technique: Technique,
    ) -> Vec<Kernel> {
        let (world, materials) = (&self.world, self.program.infos());
        let names: Vec<String> = materials.iter().map(|m| m.name.clone()).collect();
        let unbound = &world.parts.unbound;
        let all = (0..names.len()).collect();
        let plan = match form {
            None => Plan::mega(&names, unbound),
            Some(Form::Own) => Plan::own(&names, unbound),
            Some(form) => Plan::wavefront("test", [(form, all)], Vec::new(), &names),
        };
        let plan = plan.leaving_out(unbound);
        let decision = world.decide(&materials, &technique);
        let layout = PlanLayout::of_stages(stages, &decision, &materials, unbound, &plan);
        let layout = layout.unwrap_or_else(|e| panic!("{e}"));
        let tables = self.program.tables();
        let tables: Vec<BufferData> = tables.iter().map(BufferData::from).collect();
        let composer = Composer {
            world,
            decision: &decision,
            parts: &world.parts.written(decision.needs),
            source: &self.program,
            materials: &materials,
            instances: &MaterialSource::instances(&self.program),
            tables: &tables,
            plan: &plan,
            layout,
            sizes: Sizes {
                pool: 1 << 10,
                pools: 1,
                workgroup: 64,
                suited: true,
                threads: 1 << 8,
                fetch_limit: 16,
                row_groups: 1 << 8,
            },
            technique,
            queue_table: false,
            subgroup_size: 32,
            random: &random::part(technique.sampler, Demand::of(world, decision.natural)),
        };
        let kernels = composer.kernels();
        check_workgroups(&composer, &kernels);
        for kernel in &kernels {
            let valid = crate::kernels::validate::validate(&kernel.desc.name, &kernel.wgsl);
            valid.unwrap_or_else(|e| panic!("{e}"));
            check_sizes(&composer, kernel);
        }
        kernels
    }
}

/// A queue has one size of dispatches, whichever kernels work on it.
fn check_workgroups(composer: &Composer<'_>, kernels: &[Kernel]) {
    let indirect = kernels.iter().filter_map(|kernel| {
        let threads = composer.sizes.workgroup_of(&kernel.desc);
        match kernel.desc.source.extent(composer.sizes) {
            Extent::Queue(queue) => Some((queue, threads)),
            _ => None,
        }
    });
    let mut of_queues = BTreeMap::new();
    for (queue, threads) in indirect {
        assert_eq!(*of_queues.entry(queue).or_insert(threads), threads);
    }
}

/// What a kernel binds has a size.
fn check_sizes(composer: &Composer<'_>, kernel: &Kernel) {
    for binding in &kernel.bindings {
        let row = super::buffers::BUFFERS
            .iter()
            .find(|b| b.name == binding.name);
        let bytes = row.map(|buffer| buffer.bytes(composer));
        assert_ne!(bytes, Some(0), "`{}` in {}", binding.name, kernel.desc.name);
    }
}

fn techniques() -> Vec<Technique> {
    let appends = [Append::Workgroup, Append::Subgroup, Append::Thread];
    let of = |ray_data| {
        move |append| Technique {
            append,
            ray_data,
            ..Technique::default()
        }
    };
    let slots = appends.map(of(RayData::Slots));
    slots
        .into_iter()
        .chain(appends.map(of(RayData::Requests)))
        .collect()
}

fn names(kernels: &[Kernel]) -> Vec<&str> {
    kernels.iter().map(|k| k.desc.role).collect()
}

fn text<'k>(kernels: &'k [Kernel], role: &str) -> &'k str {
    let found = kernels.iter().find(|k| k.desc.role == role);
    &found.unwrap_or_else(|| panic!("no {role}")).wgsl
}

#[test]
fn a_stage_that_another_asks_for_is_a_file_and_a_row() {
    let stage = probe(Phase::Materials, queue(&["logic"]));
    let stages = with(stage, "logic", "request_material(instance);");
    for technique in techniques() {
        let room = Room::new(&technique);
        for form in [Form::Own, Form::Binned, Form::Inline] {
            let kernels = room.kernels(stages, Some(form), technique);
            let probe = kernels.iter().find(|k| k.desc.role == "probe");
            let probe = probe.expect("the stage's kernel");
            let DispatchSource::Queue(queue) = probe.desc.source else {
                panic!("{:?}", probe.desc.source);
            };
            let declared = format!("const QUEUE_PROBE: u32 = {queue}u;");
            assert!(text(&kernels, "logic").contains(&declared));
            let consumed = format!("const END_CONSUMED: u32 = {}u;", queue + 1);
            let mut prepare = kernels.iter().filter(|k| k.desc.role == "prepare");
            assert!(prepare.any(|kernel| kernel.wgsl.contains(&consumed)));
        }
        let mega = room.kernels(stages, None, technique);
        let asked = "if wants_probe {\n        wants_probe = false;\n        probe(item);\n    }\n    material(";
        assert!(text(&mega, "mega").contains(asked));
    }
}

#[test]
fn a_stage_may_run_among_ray_casts() {
    let stage = probe(Phase::Rays, queue(&["material"]));
    let call = "request_extension(start, scattered.wi, hit.primitive);";
    let stages = with(stage, "material", call);
    for technique in techniques() {
        let room = Room::new(&technique);
        let kernels = room.kernels(stages, Some(Form::Own), technique);
        assert!(names(&kernels).ends_with(&["probe", "extension"]));
        let kernels = room.kernels(stages, None, technique);
        assert!(text(&kernels, "mega").contains("probe(item);\n    }\n    if wants_extension {"));
    }
}

#[test]
fn a_stage_over_all_slots_needs_no_queue() {
    let stages = with(probe(Phase::Logic, Work::Pool), "", "");
    let technique = Technique {
        regeneration: Regeneration::Always,
        ..Technique::default()
    };
    let room = Room::new(&technique);
    let kernels = room.kernels(stages, Some(Form::Own), technique);
    assert!(names(&kernels).starts_with(&["logic", "probe", "prepare", "new_path"]));
    let mega = room.kernels(stages, None, technique);
    assert!(text(&mega, "mega").contains("    logic(item);\n    probe(item);\n"));
}

#[test]
fn workgroups_suit_where_hits_go() {
    let technique = Technique {
        ray_kernels: RayKernels::Each,
        ..Technique::default()
    };
    let room = Room::new(&technique);
    for (form, logic) in [
        (Form::Own, Some(384)),
        // One queue for all hits.
        (Form::Mixed, Some(512)),
        (Form::Inline, None),
    ] {
        let kernels = room.kernels(&STAGES, Some(form), technique);
        let of = |role| {
            let mut kernels = kernels.iter().filter(|k| k.desc.role == role);
            kernels.next().expect("the stage's kernel").desc.workgroup
        };
        let roles = ["logic", "new_path", "shadow", "extension"];
        assert_eq!(
            roles.map(of),
            [logic, Some(128), Some(512), Some(512)],
            "{form:?}"
        );
    }
}

#[test]
fn the_table_is_what_its_files_do() {
    check(&STAGES).unwrap_or_else(|e| panic!("{e}"));
}

/// What is said of a table in which a stage was changed.
fn refusal(name: &str, change: impl FnOnce(&mut Stage)) -> String {
    let mut stages = STAGES.to_vec();
    let stage = stages.iter_mut().find(|s| s.name == name);
    change(stage.expect("a stage"));
    let error = check(&stages).expect_err("a mistake");
    error.to_string()
}

#[test]
fn a_mistake_in_the_table_is_told_with_the_stage_it_is_in() {
    let cases = [
        (
            refusal("shadow", |s| s.body = file("// Nothing.\n")),
            "`shadow` lacks its function `shadow` in its file",
        ),
        (
            refusal("extension", |s| {
                s.body = file("\nfn extension(slot: u32) {}\n")
            }),
            "`extension` lacks its function `extension_ray` in its file",
        ),
        (
            refusal("bin_shadow", |s| s.name = "logic"),
            "`logic` is in the table twice",
        ),
        (
            refusal("new_path", |s| s.work = Work::Begin { from: &[] }),
            "`new_path` has a queue that no stage fills",
        ),
        (
            refusal("new_path", |s| s.work = Work::Begin { from: &["logics"] }),
            "`new_path` is asked for by `logics`, which is no stage",
        ),
        (
            refusal("new_path", |s| {
                s.work = Work::Begin {
                    from: &["material"],
                }
            }),
            "`new_path` is asked for by `material`, which runs in the same phase",
        ),
        (
            refusal("new_path", |s| {
                s.work = Work::Begin {
                    from: &["extension"],
                }
            }),
            "`new_path` is asked for by `extension`, which never calls `request_new_path()`",
        ),
        (
            refusal("new_path", |s| s.work = Work::Pool),
            "`logic` calls `request_new_path()`, and no queue of that name lists it",
        ),
        (
            refusal("bin_shadow", |s| s.work = Work::Sort { of: "logic" }),
            "`bin_shadow` sorts the rays of `logic`, which has no queue of rays",
        ),
        (
            refusal("bin_shadow", |s| s.before = &[]),
            "`bin_shadow` sorts the rays of `shadow`, and is not to run before that",
        ),
        (
            refusal("shadow", |s| s.before = &["logic"]),
            "`shadow` is to run before `logic`, and does not come before it in the table",
        ),
        (
            refusal("shadow", |s| s.phase = Phase::Logic),
            "`new_path` comes before a stage of an earlier phase",
        ),
        (
            refusal("shadow", |s| s.stores = &[(ALWAYS, &["contributions"])]),
            "`shadow` lists `contributions`, which no field of the state is used as",
        ),
        (
            refusal("shadow", |s| s.stores = &[]),
            "`shadow` calls `store_contribution()`, and its row does not list `contribution`",
        ),
        (
            refusal("shadow", |s| {
                s.stores = &[(ALWAYS, &["contribution", "hit"])]
            }),
            "`shadow` lists `hit`, and never calls `store_hit()`",
        ),
    ];
    for (said, expected) in cases {
        assert!(said.contains(expected), "{said}: {expected}");
    }
}
