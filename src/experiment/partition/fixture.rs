//! Answers of `impasto plan --strategy exhaustive` by hand, for tests: three materials whose best plan and
//! whose regret are known, and one that is on no surface.

use impasto_compiler::cost::{Classes, Cost, LANES, Operations};
use impasto_compiler::partition::{Form, Hits, Prediction, Workload};

use super::results::{Render, Scene};
use crate::experiment::records::{Id, Record, Stamp};
use crate::experiment::study::{self, Partition, Renders, Source};
use crate::measure::{Adapter, Answer, Kernel, Material, Measurement, PlanTime};
use impasto_scenes::mixes::{Hits as Coherence, Mix, Shares};

/// Microseconds of a kernel: form, members, predicted, measured.
///
/// The least sum is that of `mixed:a,b|inline:c`: 30 + 15. What was predicted makes
/// `own:a|own:b|own:c` look best: 12 + 14 + 20, where 20 + 18 + 22 = 60 was measured.
const KERNELS: [(Form, &str, f64, f64); 18] = [
    (Form::Own, "a", 12.0, 20.0),
    (Form::Own, "b", 14.0, 18.0),
    (Form::Own, "c", 20.0, 22.0),
    (Form::Mixed, "a b", 35.0, 30.0),
    (Form::Mixed, "a c", 40.0, 44.0),
    (Form::Mixed, "b c", 41.0, 45.0),
    (Form::Mixed, "a b c", 60.0, 90.0),
    (Form::Binned, "a b", 33.0, 36.0),
    (Form::Binned, "a c", 37.0, 43.0),
    (Form::Binned, "b c", 38.0, 42.0),
    (Form::Binned, "a b c", 50.0, 55.0),
    (Form::Inline, "a", 25.0, 27.0),
    (Form::Inline, "b", 26.0, 28.0),
    (Form::Inline, "c", 28.0, 15.0),
    (Form::Inline, "a b", 45.0, 50.0),
    (Form::Inline, "a c", 48.0, 52.0),
    (Form::Inline, "b c", 49.0, 53.0),
    (Form::Inline, "a b c", 70.0, 95.0),
];

/// Strategy, partition, microseconds of a whole iteration if one was timed. Logic takes 40, all else 60.
const PLANS: [(&str, &str, Option<f64>); 8] = [
    ("auto", "own:a|own:b|own:c", Some(161.0)),
    ("own", "own:a|own:b|own:c", Some(161.0)),
    ("mixed", "mixed:a,b,c", None),
    ("binned", "binned:a,b,c", None),
    ("inline", "inline:a,b,c", None),
    ("paper", "own:c|mixed:a,b", Some(150.0)),
    ("threshold=1000", "own:a|mixed:b,c", None),
    ("sample", "own:b|binned:a,c", Some(168.0)),
];

/// The answer.
pub fn answer() -> Answer {
    let plan = |(strategy, partition, measured): &(&str, &str, Option<f64>)| PlanTime {
        strategy: (*strategy).into(),
        partition: (*partition).into(),
        predicted: 0.0,
        added: None,
        measured: measured.map(|us| us * 1e-6),
        expected: None,
        kernels: Vec::new(),
    };
    Answer {
        measurement: measurement(),
        profile: String::new(),
        plans: PLANS.iter().map(plan).collect(),
        auto: "own:a|own:b|own:c".into(),
        best: "mixed:a,b|inline:c".into(),
        regret: Some(60.0 / 45.0),
        regret_of_iterations: None,
        planning_seconds: 1e-4,
        left_out: 0,
        failed: Vec::new(),
    }
}

fn measurement() -> Measurement {
    let hits = |(material, share, present): (&str, f64, f64)| Hits {
        material: material.into(),
        on_surface: share > 0.0,
        share,
        present,
        loads: 64.0,
        stores: 48.0,
    };
    let workload = [
        ("a", 0.5, 0.9),
        ("b", 0.25, 0.8),
        ("c", 0.125, 0.125),
        ("ghost", 0.0, 0.0),
    ];
    let kernel = |(form, members, predicted, measured): &(Form, &str, f64, f64)| Kernel {
        form: *form,
        members: members.split(' ').map(String::from).collect(),
        measured: measured * 1e-6,
        spread: 0.01,
        items: 0,
        logic_seconds: 0.0,
        predicted: Some(Prediction {
            total: predicted * 1e-6,
            ..Prediction::default()
        }),
        registers: None,
        binary_bytes: None,
    };
    Measurement {
        scene: "tiny".into(),
        adapter: Adapter {
            name: "GPU".into(),
            backend: "vulkan".into(),
            driver: "1.0".into(),
            ..Adapter::default()
        },
        pool: 1 << 20,
        repetitions: 9,
        workload: Workload {
            pool: 1 << 20,
            materials: workload.map(hits).into(),
            begun: 0.0,
            logic_seconds: 4e-5,
            other_seconds: 6e-5,
            in_order: false,
        },
        materials: workload
            .map(|(name, ..)| Material {
                name: name.into(),
                cost: (name == "a").then(|| cost(1200.0)),
            })
            .into(),
        kernels: KERNELS.iter().map(kernel).collect(),
        logic_seconds: 4e-5,
        other_seconds: 6e-5,
    }
}

/// A material of so many operations.
fn cost(mean: f64) -> Cost {
    Cost {
        operations: Operations {
            evaluations: 1,
            mean,
            min: mean as u64,
            max: mean as u64,
            classes: Classes::default(),
        },
        issued: [Classes::default(); LANES.len()],
        live: 0,
        code: 0,
        loops: 0,
        bytes: 0.0,
    }
}

/// What is measured.
pub fn case() -> study::Scene {
    study::Scene {
        name: "tiny".into(),
        title: "tiny".into(),
        about: "three of a kind".into(),
        source: Source::Mix(Mix {
            name: "tiny".into(),
            about: "three of a kind".into(),
            hits: Coherence::Random,
            shares: Shares::Even,
            materials: ["a", "b", "c"].map(String::from).into(),
        }),
        samples: Some(1),
        family: None,
        given: Default::default(),
        needs: None,
    }
}

/// How it is measured; of the first scene by all strategies.
pub fn part() -> Partition {
    Partition {
        pools: vec![1 << 20],
        repetitions: None,
        kernels: None,
        model: None,
        renders: Renders::Some,
        rounds: 2,
        all_strategies: vec![0],
        options: Vec::new(),
    }
}

/// A scene of the fixture.
pub fn scene() -> Scene {
    let mut scene = Scene::new(&case(), &answer()).expect("a scene");
    scene.renders = renders();
    scene
}

fn renders() -> Vec<Render> {
    let render = |label: &str, rates: [f64; 2]| Render {
        label: label.into(),
        options: vec![format!("--strategy={label}")],
        rates: rates.into(),
    };
    vec![
        render("auto's plan", [1.0e8, 1.1e8]),
        render("mega", [0.5e8, 0.55e8]),
    ]
}

/// Its record.
pub fn record() -> Record {
    let stamp = Stamp {
        command: "impasto plan".into(),
        version: "abc".into(),
        ..Stamp::default()
    };
    let id = Id::new("partition", "tiny", "1048576");
    let mut record = Record::new(id, "0".into(), stamp);
    record.answer = Some(answer());
    record.renders = renders();
    record
}
