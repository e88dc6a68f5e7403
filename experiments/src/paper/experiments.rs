//! What is measured: the table of scenes with the paper's figures, and every render.

use impasto_scenes::crossover;

/// The sections of the page, in its order.
pub(super) const SECTIONS: [&str; 6] = [
    "speed",
    "stages",
    "ablations",
    "rays",
    "utilisation",
    "crossover",
];

/// A scene of the paper and what it reports of it (tables 1 and 2, on a Tesla K20).
pub(super) struct Scene {
    /// Its name there.
    pub title: &'static str,
    /// Its folder in `examples/`.
    pub folder: &'static str,
    /// Mpaths/s of the megakernel and of the wavefront.
    pub speed: [f64; 2],
    /// Milliseconds of an iteration over 1 M paths: logic, new path, materials, ray casts.
    pub stages: [f64; 4],
    /// Samples a pixel that keep an H200 busy for about a second.
    samples: u32,
}

pub(super) const SCENES: [Scene; 3] = [
    Scene {
        title: "CARPAINT",
        folder: "carpaint",
        speed: [42.99, 58.38],
        stages: [2.40, 0.86, 2.31, 4.31],
        samples: 1024,
    },
    Scene {
        title: "CITY",
        folder: "city",
        speed: [5.41, 9.70],
        stages: [3.42, 0.86, 5.47, 12.53],
        samples: 256,
    },
    Scene {
        title: "CONFERENCE",
        folder: "conference",
        speed: [2.71, 8.71],
        stages: [3.01, 0.79, 6.37, 9.62],
        samples: 256,
    },
];

/// What has to be generated: the paper's scenes, and the families of scenes.
pub(super) const GENERATED: [&str; 4] = ["carpaint", "city", "conference", "crossover"];

/// The pool of the paper: 2^20 paths.
const PAPER_POOL: &str = "--pool=1048576";

/// A change of one technique against the defaults: what is varied, and the option.
pub(super) const ABLATIONS: [(&str, &str); 35] = [
    ("pool", "--pool=262144"),
    ("pool", "--pool=524288"),
    ("pool", PAPER_POOL),
    ("pool", "--pool=2097152"),
    ("pool", "--pool=4194304"),
    ("pool", "--pool=8388608"),
    ("workgroup", "--workgroup=64"),
    ("workgroup", "--workgroup=128"),
    ("workgroup", "--workgroup=256"),
    ("workgroup", "--workgroup=512"),
    ("random numbers", "--sampler=sobol"),
    ("random numbers", "--sampler=owen"),
    ("random numbers", "--sampler=independent"),
    ("appending to queues", "--append=workgroup"),
    ("appending to queues", "--append=subgroup"),
    ("appending to queues", "--append=thread"),
    ("path state", "--state=soa"),
    ("path state", "--state=pairs"),
    ("path state", "--state=aos"),
    ("acceleration structure", "--traversal=cwbvh"),
    ("acceleration structure", "--traversal=bvh2"),
    ("stack", "--stack=private"),
    ("stack", "--stack=workgroup"),
    ("stack", "--stack=trail"),
    ("triangles", "--leaves=together"),
    ("triangles", "--leaves=at-once"),
    ("threads and rays", "--ray-fetch=persistent"),
    ("threads and rays", "--ray-fetch=thread"),
    ("rays and results", "--ray-data=slots"),
    ("rays and results", "--ray-data=requests"),
    ("order of rays", "--ray-order=queue"),
    ("order of rays", "--ray-order=coarse"),
    ("order of rays", "--ray-order=fine"),
    ("runtime checks", "--checked"),
    ("validation of indirect arguments", "--validate-indirect"),
];

/// One render, repeated.
pub(super) struct Experiment {
    pub section: &'static str,
    /// What tells it from others of its section and scene.
    pub label: String,
    /// The scene's folder or file, relative to the repository.
    pub scene: String,
    pub options: Vec<String>,
    pub repeats: usize,
}

impl Experiment {
    /// The command as one would type it.
    pub(super) fn line(&self) -> String {
        let options = self.options.join(" ");
        format!("impasto render {} {options}", self.scene)
    }
}

/// Every experiment; `quick` divides samples.
pub(super) fn all(quick: u32) -> Vec<Experiment> {
    let mut out = Vec::new();
    for scene in &SCENES {
        let samples = (scene.samples / quick).max(1);
        let make = |section, label: &str, samples: u32, options: &[&str], repeats| Experiment {
            section,
            label: label.to_string(),
            scene: format!("examples/{}/scene.toml", scene.folder),
            options: std::iter::once(format!("--spp={samples}"))
                .chain(options.iter().map(|o| o.to_string()))
                .collect(),
            repeats: if quick == 1 { repeats } else { 1 },
        };
        for regeneration in ["never", "half", "always"] {
            let option = format!("--regeneration={regeneration}");
            let label = format!("mega, {regeneration}");
            let options = ["--strategy=mega", &option];
            out.push(make("speed", &label, samples, &options, 3));
        }
        for strategy in ["shared", "own"] {
            let option = format!("--strategy={strategy}");
            out.push(make("speed", strategy, samples, &[&option], 3));
        }
        let options = ["--strategy=own", PAPER_POOL];
        out.push(make("stages", "own", samples, &options, 3));
        let half = (samples / 2).max(1);
        out.push(make("ablations", "", half, &["--strategy=own"], 3));
        for (_, option) in ABLATIONS {
            let options = ["--strategy=own", option];
            out.push(make("ablations", option, half, &options, 1));
        }
        // Counting takes time: few paths are enough, since there are a million at once.
        let few = (8 / quick).max(1);
        for strategy in ["mega", "own"] {
            let option = format!("--strategy={strategy}");
            let options = [option.as_str(), "--profile", PAPER_POOL];
            out.push(make("utilisation", strategy, few, &options, 1));
        }
    }
    out.extend(families(quick));
    out
}

/// The families of scenes that differ in one number.
fn families(quick: u32) -> Vec<Experiment> {
    let samples = (512 / quick).max(1);
    let mut out = Vec::new();
    for member in crossover::all() {
        for strategy in ["mega", "shared", "own"] {
            out.push(Experiment {
                section: "crossover",
                label: format!("{} {} {strategy}", member.family, member.number),
                scene: member.scene.clone(),
                options: vec![format!("--spp={samples}"), format!("--strategy={strategy}")],
                repeats: 1,
            });
        }
    }
    out
}
