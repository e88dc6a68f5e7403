//! The results of a study: what its pages are made of. One JSON file, small enough to be committed, and a table for
//! spreadsheets; every row says by which command, version and device it was measured, and when.

use std::collections::BTreeSet;
use std::path::Path;

use impasto_compiler::partition::profile::Fit;
use impasto_runtime::input;
use impasto_runtime::lab::rays::RayRate;
use impasto_runtime::render::report::Report;
use serde::{Deserialize, Serialize};

use super::partition::{self, Measured};
use super::records::{FORMAT, Record, Stamp};
use super::study::{Part, Study};
use crate::calibrate::Errors;
use crate::files::reason;

/// Everything that was measured.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// [`FORMAT`].
    pub format: u32,
    /// The study's name.
    pub study: String,
    /// What is known of the time models.
    #[serde(default)]
    pub models: Vec<ModelNote>,
    /// In the order of measuring.
    pub rows: Vec<Row>,
}

/// The profile that predicted in a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelNote {
    /// The part.
    pub part: String,
    /// The profile's name.
    pub profile: String,
    /// What it says of its own fit.
    pub fit: Option<Fit>,
    /// How constants fitted to half of the materials do for the other half.
    #[serde(default)]
    pub held_out: Option<Errors>,
}

/// A measurement.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The part's name.
    pub part: String,
    /// The scene's name; empty if the part is measured as a whole.
    pub scene: String,
    /// What else tells it apart.
    pub variant: String,
    /// By what it was made, and when.
    pub stamp: Stamp,
    /// Why there is nothing, if the measurement failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
    /// What a reader must know of these numbers.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// Kernels and plans.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kernels: Option<partition::Scene>,
    /// Paths a second of every repetition of a render.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rates: Vec<f64>,
    /// The report of the render in the middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<Report>,
    /// Triangles of a scene whose ray casts were timed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub triangles: Option<usize>,
    /// Its ray casts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rays: Vec<RayRate>,
}

impl Row {
    /// What of a record is kept.
    ///
    /// # Errors
    /// If its kernels contradict each other.
    pub fn new(record: &Record, study: &Study) -> Result<Self, String> {
        let scene = study.scene(&record.id.scene);
        let kernels = match (&record.answer, scene) {
            (Some(answer), Some(scene)) => {
                let mut kernels = partition::Scene::new(scene, answer)?;
                kernels.renders.clone_from(&record.renders);
                // A plan that names what is not there is found now.
                Measured::new(&kernels)?;
                Some(kernels)
            }
            _ => None,
        };
        Ok(Self {
            part: record.id.part.clone(),
            scene: record.id.scene.clone(),
            variant: record.id.variant.clone(),
            stamp: record.stamp.clone(),
            failed: record.failed.clone(),
            note: String::new(),
            kernels,
            rates: record.rates.clone(),
            report: record.report.clone(),
            triangles: record.rays.as_ref().map(|rays| rays.triangles),
            rays: record
                .rays
                .as_ref()
                .map(|rays| rays.rates.clone())
                .unwrap_or_default(),
        })
    }
}

impl Results {
    /// Those of a study, without any yet.
    pub fn new(study: &str) -> Self {
        Self {
            format: FORMAT,
            study: study.into(),
            ..Self::default()
        }
    }

    /// Those in a file, for a study that says more of its scenes.
    ///
    /// # Errors
    /// If it cannot be read, or is of another format.
    pub fn load(path: &Path, study: &Study) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Versioned {
            format: u32,
        }
        let hint =
            "hint: remove the file, and run the study again: records of measurements write it anew";
        let damaged =
            |e: serde_json::Error| format!("`{}` holds no results: {e}\n  {hint}", path.display());
        let text = input::read_to_string(path);
        let text = text.map_err(|e| format!("cannot read `{}`: {}", path.display(), reason(&e)))?;
        let Versioned { format } = serde_json::from_str(&text).map_err(damaged)?;
        if format != FORMAT {
            let name = path.display();
            return Err(format!(
                "`{name}` has format {format}, and this program reads {FORMAT}\n  {hint}"
            ));
        }
        let mut results: Self = serde_json::from_str(&text).map_err(damaged)?;
        for row in &mut results.rows {
            if let (Some(kernels), Some(scene)) = (row.kernels.take(), study.scene(&row.scene)) {
                row.kernels = Some(kernels.of(scene));
            }
        }
        Ok(results)
    }

    /// With newer ones in the place of those of the same measurements. Errors of a fit stay as long as all that it was made
    /// of does.
    pub fn with(mut self, newer: Self) -> Self {
        let mut changed: BTreeSet<String> = BTreeSet::new();
        for row in newer.rows {
            let same = |known: &&mut Row| {
                known.part == row.part && known.scene == row.scene && known.variant == row.variant
            };
            let known = self.rows.iter_mut().find(same);
            if known.as_ref().is_none_or(|known| known.stamp != row.stamp) {
                changed.insert(row.part.clone());
            }
            match known {
                Some(known) => *known = row,
                None => self.rows.push(row),
            }
        }
        for mut note in newer.models {
            let known = self.models.iter().position(|known| known.part == note.part);
            let Some(at) = known else {
                self.models.push(note);
                continue;
            };
            let before = self.models[at].held_out.take();
            let before = before.filter(|_| !changed.contains(&note.part));
            note.held_out = note.held_out.or(before);
            self.models[at] = note;
        }
        self
    }

    /// Without the rows of measurements that a study does not have.
    pub fn asked_for_by(mut self, study: &Study) -> Self {
        let has = |part: &Part, row: &Row| {
            let mut scenes = part.scenes.iter().map(|scene| &study.scenes[*scene]);
            // Those of all scenes together name none.
            let has_scene = row.scene.is_empty() || scenes.any(|scene| scene.name == row.scene);
            has_scene && part.variants().contains(&row.variant)
        };
        self.rows.retain(|row| {
            let part = study.part(Some(&row.part), |_| true);
            part.is_some_and(|part| has(part, row))
        });
        self
    }

    /// The rows of a part.
    pub fn of<'a>(&'a self, part: &'a Part) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(move |row| row.part == part.name)
    }

    /// A row of a part.
    pub fn find(&self, part: &Part, scene: &str, variant: &str) -> Option<&Row> {
        let mut rows = self.rows.iter().filter(|row| row.part == part.name);
        rows.find(|row| row.scene == scene && row.variant == variant)
    }

    /// As a table for spreadsheets: a row a number.
    pub fn csv(&self) -> String {
        super::csv::csv(self)
    }

    /// As JSON, a line a row; of kernels a line for each.
    ///
    /// # Errors
    /// If numbers have no JSON.
    pub fn text(&self) -> Result<String, String> {
        let failed = |e: serde_json::Error| format!("cannot write results as JSON: {e}");
        let models = self.models.iter().map(serde_json::to_string);
        let models = models.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let rows = self.rows.iter().map(Row::text);
        let rows = rows.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        Ok(format!(
            "{{\n\"format\": {},\n\"study\": {},\n\"models\": [\n{}\n],\n\"rows\": [\n{}\n]\n}}\n",
            self.format,
            serde_json::to_string(&self.study).map_err(failed)?,
            models.join(",\n"),
            rows.join(",\n")
        ))
    }
}

impl Row {
    fn text(&self) -> Result<String, serde_json::Error> {
        let Some(kernels) = &self.kernels else {
            return serde_json::to_string(self);
        };
        let head = Self {
            kernels: None,
            ..self.clone()
        };
        let head = serde_json::to_string(&head)?;
        let head = head.strip_suffix('}').unwrap_or(&head);
        let serde_json::Value::Object(mut fields) = serde_json::to_value(kernels)? else {
            return serde_json::to_string(self);
        };
        let rounded = fields.iter_mut().filter(|(name, _)| *name != "renders");
        rounded.for_each(|(_, value)| partition::round(value));
        let field = |(name, value): (&String, &serde_json::Value)| match value {
            serde_json::Value::Array(items) if !items.is_empty() => {
                let items: Vec<String> = items.iter().map(|item| format!("  {item}")).collect();
                format!(" \"{name}\": [\n{}\n ]", items.join(",\n"))
            }
            value => format!(" \"{name}\": {value}"),
        };
        let fields: Vec<String> = fields.iter().map(field).collect();
        Ok(format!(
            "{head},\"kernels\":{{\n{}\n}}}}",
            fields.join(",\n")
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newer_rows_take_the_place_of_older_ones_and_others_stay() {
        let row = |scene: &str, version: &str| Row {
            part: "p".into(),
            scene: scene.into(),
            stamp: Stamp {
                version: version.into(),
                ..Stamp::default()
            },
            ..Row::default()
        };
        let of = |rows: Vec<Row>, held: Option<usize>| Results {
            rows,
            models: vec![ModelNote {
                part: "p".into(),
                held_out: held.map(|kernels| Errors {
                    kernels,
                    ..Errors::default()
                }),
                ..ModelNote::default()
            }],
            ..Results::new("s")
        };
        let old = of(vec![row("a", "1"), row("b", "1")], Some(7));
        let all = old.with(of(vec![row("b", "2"), row("c", "2")], None));
        let told: Vec<String> = all
            .rows
            .iter()
            .map(|r| format!("{}{}", r.scene, r.stamp.version))
            .collect();
        assert_eq!(told, ["a1", "b2", "c2"]);
        // The fit was made of other kernels.
        assert_eq!(all.models[0].held_out, None);
        let held = |all: &Results| all.models[0].held_out.as_ref().map(|held| held.kernels);
        // A run without a GPU has nothing to say of the fit, and changes no row.
        let old = of(vec![row("a", "1"), row("b", "1")], Some(7));
        let same = old.with(of(vec![row("b", "1")], None));
        assert_eq!(held(&same), Some(7));
        let fitted = same.with(of(vec![row("b", "2")], Some(8)));
        assert_eq!(held(&fitted), Some(8));
        // What is written is read again.
        let again: Results = serde_json::from_str(&all.text().expect("text")).expect("JSON");
        assert_eq!(again.text(), all.text());
    }

    #[test]
    fn rows_go_with_the_scenes_and_variants_of_the_study() {
        let text = r#"
            title = "Mine"
            scenes = [{ name = "a", file = "a.toml" }, { name = "b", file = "b.toml" }]
            [[studies]]
            kind = "rates"
            name = "speed"
            scenes = ["a"]
            strategies = ["own", "mega"]
        "#;
        let study = Study::parse(Path::new("mine.toml"), text).expect("it is sound");
        let row = |part: &str, scene: &str, variant: &str| Row {
            part: part.into(),
            scene: scene.into(),
            variant: variant.into(),
            ..Row::default()
        };
        let kept = [("speed", "a", "own"), ("speed", "a", "mega")];
        let gone = [
            ("speed", "a", "mixed"),
            ("speed", "b", "own"),
            ("slow", "a", "own"),
        ];
        let all = Results {
            rows: kept
                .iter()
                .chain(&gone)
                .map(|(p, s, v)| row(p, s, v))
                .collect(),
            ..Results::new("mine")
        };
        let rows = all.asked_for_by(&study).rows;
        let told: Vec<_> = rows
            .iter()
            .map(|r| (&*r.part, &*r.scene, &*r.variant))
            .collect();
        assert_eq!(told, kept);
    }
}
