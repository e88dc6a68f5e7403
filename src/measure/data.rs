//! Measurements of kernels as data: what they cost, what was asked of them, how long they took. The
//! files of `impasto calibrate --data` and of `impasto plan --strategy exhaustive --format json`.

use impasto_compiler::cost::Cost;
use impasto_compiler::partition::{Form, Prediction, Workload};
use serde::{Deserialize, Serialize};

/// The version of the format.
pub const VERSION: u32 = 1;

/// Kernels of one scene, measured with one pool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The scene's name.
    pub scene: String,
    /// What they ran on.
    pub adapter: Adapter,
    /// Paths in flight.
    pub pool: u32,
    /// How often each was timed; medians count.
    pub repetitions: u32,
    /// What the measured iteration asks of them.
    pub workload: Workload,
    /// The materials, in the order of the workload.
    pub materials: Vec<Material>,
    /// The kernels.
    pub kernels: Vec<Kernel>,
    /// Seconds of the logic kernel if no material is inline.
    pub logic_seconds: f64,
    /// Seconds of everything but logic and material kernels.
    pub other_seconds: f64,
}

/// A GPU.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// The interface it was reached through.
    #[serde(default)]
    pub backend: String,
    /// The driver's name and version.
    #[serde(default)]
    pub driver: String,
    /// Discrete, integrated, virtual, software or other.
    #[serde(default)]
    pub kind: String,
    /// Lanes of its subgroups; 0 if unknown.
    #[serde(default)]
    pub subgroup: u32,
}

/// A material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// What evaluating it costs; none if it is on no surface.
    pub cost: Option<Cost>,
}

/// A kernel that was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kernel {
    /// How it treats its members.
    pub form: Form,
    /// The names of the materials it evaluates.
    pub members: Vec<String>,
    /// Median GPU seconds; of inline materials those by which they make logic slower, which may be
    /// below zero.
    pub measured: f64,
    /// Half of the distance between the quartiles over the median.
    #[serde(default)]
    pub spread: f64,
    /// Items that it worked on; slots if inline.
    #[serde(default)]
    pub items: u64,
    /// Seconds of the logic kernel that filled its queues, or that it is part of.
    #[serde(default)]
    pub logic_seconds: f64,
    /// What the time model said of it, by the profile at hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted: Option<Prediction>,
    /// Registers that the driver gives a thread of it, where it tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub registers: Option<u32>,
    /// Bytes of its machine code, where the driver tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub binary_bytes: Option<u64>,
}

/// Several measurements in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Data {
    /// The version of the format.
    pub version: u32,
    /// The measurements.
    pub sets: Vec<Measurement>,
}

/// What a file says it is: several measurements, one that `impasto plan` answered, or the record of
/// an experiment around such an answer.
#[derive(Deserialize)]
struct Kind {
    version: Option<serde_json::Value>,
    sets: Option<serde::de::IgnoredAny>,
    kernels: Option<serde::de::IgnoredAny>,
    answer: Option<serde_json::Value>,
}

impl Data {
    /// Those measurements, as a file of this version.
    pub fn new(sets: Vec<Measurement>) -> Self {
        Self {
            version: VERSION,
            sets,
        }
    }

    /// The measurements in the text of a file, without what was predicted of them: that was another
    /// version's, or another profile's.
    ///
    /// # Errors
    /// What is wrong with it, and what to do.
    pub fn parse(text: &str) -> Result<Self, String> {
        let again = "\n  hint: measure again, with `impasto calibrate --data FILE` or \
                     `impasto plan SCENE --strategy exhaustive --format json`";
        let broken = |e: serde_json::Error| format!("it cannot be read: {e}{again}");
        let kind: Kind = serde_json::from_str(text).map_err(broken)?;
        let mut data = match (kind.answer, kind.sets, kind.kernels) {
            (Some(answer), ..) => Self::new(vec![serde_json::from_value(answer).map_err(broken)?]),
            (_, Some(_), _) => {
                let version = kind.version.unwrap_or_default();
                if version != VERSION {
                    return Err(format!(
                        "it has version {version}, and this program reads {VERSION}{again}"
                    ));
                }
                serde_json::from_str(text).map_err(broken)?
            }
            (_, _, Some(_)) => Self::new(vec![serde_json::from_str(text).map_err(broken)?]),
            _ => return Err(format!("it holds no measurements{again}")),
        };
        for set in &mut data.sets {
            set.check().map_err(|why| format!("{why}{again}"))?;
            set.kernels.iter_mut().for_each(|k| k.predicted = None);
        }
        Ok(data)
    }

    /// The text of a file.
    pub fn text(&self) -> String {
        // Structs of numbers, strings and lists always have a JSON text.
        let text = serde_json::to_string(self).unwrap_or_default();
        format!("{text}\n")
    }
}

impl Measurement {
    /// The indices of a kernel's members.
    pub fn members(&self, kernel: &Kernel) -> Vec<usize> {
        let index = |name: &String| self.materials.iter().position(|m| m.name == *name);
        let mut members: Vec<usize> = kernel.members.iter().filter_map(index).collect();
        members.sort_unstable();
        members
    }

    /// Names of kernels, workload and materials agree, and times are numbers.
    fn check(&self) -> Result<(), String> {
        let scene = &self.scene;
        let hits = self.workload.materials.iter().map(|h| &h.material);
        if !hits.eq(self.materials.iter().map(|m| &m.name)) {
            return Err(format!(
                "the workload of `{scene}` is of other materials than it lists"
            ));
        }
        for kernel in &self.kernels {
            let name = || kernel.members.join(", ");
            if kernel.members.is_empty() || self.members(kernel).len() != kernel.members.len() {
                return Err(format!(
                    "a kernel of `{scene}` is over materials that it does not list: {}",
                    name()
                ));
            }
            if !kernel.measured.is_finite() || kernel.form.has_queue() && kernel.measured < 0.0 {
                return Err(format!(
                    "the kernel over {} of `{scene}` took no time",
                    name()
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use impasto_compiler::partition::Hits;

    fn measurement() -> Measurement {
        Measurement {
            scene: "room".into(),
            adapter: Adapter::default(),
            pool: 64,
            repetitions: 3,
            workload: Workload {
                pool: 64,
                materials: vec![Hits {
                    material: "paint".into(),
                    on_surface: true,
                    share: 0.5,
                    present: 0.9,
                    loads: 1.0,
                    stores: 2.0,
                }],
                begun: 0.0,
                logic_seconds: 0.1,
                other_seconds: 0.2,
                in_order: false,
            },
            materials: vec![Material {
                name: "paint".into(),
                cost: None,
            }],
            kernels: vec![Kernel {
                form: Form::Own,
                members: vec!["paint".into()],
                measured: 1e-5,
                spread: 0.01,
                items: 32,
                logic_seconds: 1e-5,
                predicted: None,
                registers: None,
                binary_bytes: None,
            }],
            logic_seconds: 0.1,
            other_seconds: 0.2,
        }
    }

    #[test]
    fn files_of_all_kinds_are_read() {
        let data = Data::new(vec![measurement(), measurement()]);
        assert_eq!(Data::parse(&data.text()), Ok(data));
        // What `impasto plan` answers has more in it.
        let mut answer = serde_json::to_value(measurement()).expect("JSON");
        answer["plans"] = serde_json::json!([{ "strategy": "own" }]);
        answer["kernels"][0]["predicted"] = serde_json::json!({ "total": 1.0 });
        let one = Data::new(vec![measurement()]);
        assert_eq!(Data::parse(&answer.to_string()), Ok(one.clone()));
        let record = serde_json::json!({ "version": "x", "command": "y", "answer": answer });
        assert_eq!(Data::parse(&record.to_string()), Ok(one));
    }

    #[test]
    fn what_cannot_be_used_is_said_with_what_to_do() {
        let refused = |text: &str, part: &str| {
            let why = Data::parse(text).expect_err(text);
            assert!(
                why.contains(part) && why.contains("hint: measure again"),
                "{why}"
            );
        };
        refused("", "cannot be read");
        refused("{\"sets\": [", "cannot be read");
        refused("{}", "no measurements");
        refused("{\"version\": 7, \"sets\": []}", "version 7");
        refused("{\"sets\": []}", "version null");
        refused("{\"version\": 1, \"sets\": [{}]}", "missing field");
        let with = |change: &dyn Fn(&mut Measurement)| {
            let mut set = measurement();
            change(&mut set);
            Data::new(vec![set]).text()
        };
        refused(&with(&|s| s.kernels[0].members.clear()), "does not list");
        refused(&with(&|s| s.kernels[0].members[0] = "wax".into()), "wax");
        refused(&with(&|s| s.kernels[0].measured = -1.0), "no time");
        refused(&with(&|s| s.materials.clear()), "other materials");
    }
}
