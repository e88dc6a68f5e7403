//! Device profiles: what one operation of each kind costs on a GPU. `impasto calibrate` fits them.
//! Some are part of the program; a GPU without one of its own gets the nearest of them, scaled.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The version of the format, and of the model whose constants it holds.
pub const VERSION: u32 = 1;

/// The constants of the time model for one GPU.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceProfile {
    /// [`VERSION`] of the program that wrote it.
    pub version: u32,
    /// The adapter's name, such as `NVIDIA H200`.
    pub device: String,
    /// Its driver and the driver's version.
    pub driver: String,
    /// Lanes of a subgroup.
    pub subgroup: u32,
    /// The constants.
    pub weights: Weights,
    /// How well the model fits what was measured.
    pub fit: Fit,
}

/// The constants; the formulas they stand in are those of [`super::model`]. Times are in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// What a kernel more costs: its dispatch, and the machine that drains before the next.
    pub launch: f64,
    /// An operation of a subgroup that waits for the one before.
    pub latency: f64,
    /// A subgroup's operation of float arithmetic, all of the machine being busy; so the next.
    pub alu: f64,
    /// Divisions, roots, transcendentals.
    pub special: f64,
    /// Integers and bits.
    pub integer: f64,
    /// A texture lookup.
    pub texture: f64,
    /// A turn of a loop.
    pub turns: f64,
    /// A byte of memory that one lane reads or writes.
    pub memory: f64,
    /// The same in addition where no neighbouring slot is in the same kernel.
    pub scatter: f64,
    /// Operations of code that the caches of instructions hold.
    pub code: f64,
    /// By which share operations get slower for each time more code that is evaluated side by side.
    pub miss: f64,
    /// The exponent by which operations, memory and waiting overlap: 1 adds them, infinity takes the
    /// longest.
    pub overlap: f64,
    /// The share of its loads that an inline material has to make by itself.
    pub inline_loads: f64,
    /// Live numbers that an inline material may have without making the logic kernel slower.
    pub free_registers: f64,
    /// By how much each further hundred of them slows that kernel down, as a share.
    pub pressure: f64,
    /// By how much a hundred live numbers of a kernel slow its memory down, as a share.
    #[serde(default)]
    pub occupancy: f64,
    /// By how much any inline material slows the logic kernel down, as a share.
    #[serde(default)]
    pub inline_logic: f64,
    /// By how much longer a kernel with queues of several materials takes for each of them, as a share.
    #[serde(default)]
    pub company: f64,
}

/// How well a model fits what was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// Kernels that were measured.
    pub points: u32,
    /// The median of |predicted / measured - 1|.
    pub median_error: f64,
    /// The same of kernels that the constants were not fitted to.
    pub held_out_error: f64,
    /// Spearman's rank correlation of predicted and measured times.
    pub rank_correlation: f64,
}

/// Why a text is no profile that can be used, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProfileError(String);

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hint = "make a new one on this GPU with `impasto calibrate`";
        write!(f, "{}\nhint: {hint}", self.0)
    }
}

impl std::error::Error for ProfileError {}

/// What a profile of any version has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

impl DeviceProfile {
    /// The profile that the JSON `text` describes.
    ///
    /// # Errors
    /// If it is broken, of another version, or has constants that no GPU has.
    pub fn parse(text: &str) -> Result<Self, ProfileError> {
        let broken = |e| ProfileError(format!("the device profile cannot be read: {e}"));
        let Versioned { version } = serde_json::from_str(text).map_err(broken)?;
        if version != VERSION {
            return Err(ProfileError(format!(
                "the device profile has version {version}, and this program reads {VERSION}"
            )));
        }
        let profile: Self = serde_json::from_str(text).map_err(broken)?;
        profile.check()?;
        Ok(profile)
    }

    /// Holds the constants to what is possible: finite, none below zero, a subgroup of lanes.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ProfileError> {
        let refuse = |name: &str, value: f64, expected: &str| {
            let what = format!("`{name}` of the device profile is {value}: expected {expected}");
            Err(ProfileError(what))
        };
        if !(1..=MAX_SUBGROUP).contains(&self.subgroup) {
            let expected = format!("1 to {MAX_SUBGROUP}");
            return refuse("subgroup", self.subgroup.into(), &expected);
        }
        for (name, value) in self.weights.named() {
            if !value.is_finite() || value < 0.0 {
                return refuse(name, value, "a finite number, at least 0");
            }
        }
        Ok(())
    }
}

/// Lanes of the largest subgroup that WebGPU allows.
const MAX_SUBGROUP: u32 = 128;

impl Weights {
    /// Every constant with its name in files.
    pub fn named(&self) -> [(&'static str, f64); 18] {
        [
            ("launch", self.launch),
            ("latency", self.latency),
            ("alu", self.alu),
            ("special", self.special),
            ("integer", self.integer),
            ("texture", self.texture),
            ("turns", self.turns),
            ("memory", self.memory),
            ("scatter", self.scatter),
            ("code", self.code),
            ("miss", self.miss),
            ("overlap", self.overlap),
            ("inline_loads", self.inline_loads),
            ("free_registers", self.free_registers),
            ("pressure", self.pressure),
            ("occupancy", self.occupancy),
            ("inline_logic", self.inline_logic),
            ("company", self.company),
        ]
    }

    /// The constants of a machine that does `1 / times` as much at once, and each thing as fast.
    fn scaled(self, times: f64) -> Self {
        Self {
            alu: self.alu * times,
            special: self.special * times,
            integer: self.integer * times,
            texture: self.texture * times,
            turns: self.turns * times,
            memory: self.memory * times,
            scatter: self.scatter * times,
            ..self
        }
    }
}

/// The profiles that are part of the program: the name that `--profile` takes, the part of an
/// adapter's name by which it is known, in lower case, and the text.
const SHIPPED: [(&str, &str, &str); 3] = [
    ("h200", "h200", include_str!("profiles/h200.json")),
    ("h100", "h100", include_str!("profiles/h100.json")),
    (
        "llvmpipe",
        "llvmpipe",
        include_str!("profiles/llvmpipe.json"),
    ),
];

/// How much longer throughput takes than on an H200, for GPUs without a profile. An H200 does 33 T
/// operations a second and reads 4.3 TB; a graphics card for desktops about half, one that shares
/// a chip and its memory with the processor about a thirtieth.
const SCALE: [(&str, f64); 2] = [("integrated", 30.0), ("virtual", 4.0)];

/// As [`SCALE`], for every other kind.
const SCALE_OTHERWISE: f64 = 2.0;

/// The profile that is used for an adapter.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The constants.
    pub profile: DeviceProfile,
    /// The name of the shipped profile that it is, or is scaled from.
    pub name: &'static str,
    /// Is it this adapter's? Otherwise it is another's, scaled: a reason to calibrate.
    pub exact: bool,
}

impl DeviceProfile {
    /// The names of the shipped profiles.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, ..)| *name)
    }

    /// The shipped profile called `name`, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        let found = SHIPPED.iter().find(|(n, ..)| *n == name);
        found.and_then(|(.., text)| Self::parse(text).ok())
    }

    /// The shipped profile for the adapter called `adapter` of a `kind` (`discrete`, `integrated`,
    /// `virtual`, `software` or other): its own, or else the nearest one, scaled.
    ///
    /// # Errors
    /// If a shipped profile is broken, which tests exclude.
    pub fn shipped(adapter: &str, kind: &str) -> Result<Choice, ProfileError> {
        let lower = adapter.to_lowercase();
        if let Some((name, _, text)) = SHIPPED.iter().find(|(_, part, _)| lower.contains(part)) {
            return Ok(Choice {
                profile: Self::parse(text)?,
                name,
                exact: true,
            });
        }
        let [h200, _, llvmpipe] = SHIPPED;
        let scale = SCALE.iter().find(|(k, _)| *k == kind);
        let scale = scale.map_or(SCALE_OTHERWISE, |(_, scale)| *scale);
        let ((name, _, text), scale) = match kind {
            "software" => (llvmpipe, 1.0),
            _ => (h200, scale),
        };
        let nearest = Self::parse(text)?;
        let profile = Self {
            device: adapter.to_owned(),
            driver: String::new(),
            weights: nearest.weights.scaled(scale),
            fit: Fit::default(),
            ..nearest
        };
        Ok(Choice {
            profile,
            name,
            exact: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn h200() -> String {
        SHIPPED[0].2.to_owned()
    }

    #[test]
    fn shipped_profiles_can_be_used() {
        for (name, part, text) in SHIPPED {
            let profile = DeviceProfile::parse(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(profile.device.to_lowercase().contains(part), "{name}");
            assert_eq!(DeviceProfile::named(name), Some(profile));
        }
        assert_eq!(DeviceProfile::named("voodoo"), None);
    }

    #[test]
    fn adapters_get_their_profile_or_a_scaled_one() {
        let get = |adapter, kind| DeviceProfile::shipped(adapter, kind).expect("they are sound");
        let own = get("NVIDIA H200", "discrete");
        assert_eq!((own.name, own.exact), ("h200", true));
        let sibling = get("NVIDIA H100 80GB HBM3", "discrete");
        assert_eq!((sibling.name, sibling.exact), ("h100", true));
        let software = get("llvmpipe (LLVM 15.0.6, 256 bits)", "software");
        assert_eq!((software.name, software.exact), ("llvmpipe", true));
        let other = get("SwiftShader", "software");
        assert_eq!((other.name, other.exact), ("llvmpipe", false));
        let [card, chip] =
            [("GeForce RTX 4090", "discrete"), ("Apple M1", "integrated")].map(|(a, k)| get(a, k));
        assert!(!card.exact && !chip.exact);
        assert_eq!(chip.profile.device, "Apple M1");
        let (a, b, c) = (
            own.profile.weights,
            card.profile.weights,
            chip.profile.weights,
        );
        assert!(a.alu < b.alu && b.alu < c.alu);
        // Everything that the machine does side by side takes longer, and nothing else.
        let longer = [
            "alu", "special", "integer", "texture", "turns", "memory", "scatter",
        ];
        let times = b.alu / a.alu;
        for ((name, own), (_, scaled)) in a.named().into_iter().zip(b.named()) {
            let expected = if longer.contains(&name) {
                own * times
            } else {
                own
            };
            assert!((scaled - expected).abs() <= 1e-12 * expected, "{name}");
        }
        assert_eq!((a.launch, a.latency, a.code), (c.launch, c.latency, c.code));
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        let refused = |text: &str, part: &str| {
            let error = DeviceProfile::parse(text).expect_err(part).to_string();
            assert!(
                error.contains(part) && error.contains("`impasto calibrate`"),
                "{error}"
            );
        };
        refused(
            &h200().replacen("\"version\": 1", "\"version\": 7", 1),
            "version 7",
        );
        refused(&h200()[..100], "line ");
        refused("[]", "cannot be read");
        refused(
            &h200().replacen("\"alu\"", "\"ula\"", 1),
            "unknown field `ula`",
        );
        refused(
            &h200().replacen("\"launch\"", "\"latency\"", 1),
            "duplicate field",
        );
        refused(
            &h200().replacen("\"subgroup\": 32", "\"subgroup\": 0", 1),
            "`subgroup`",
        );
        refused(
            &h200().replacen("\"alu\": ", "\"alu\": -", 1),
            "`alu` of the device profile is -",
        );
        refused(
            &h200().replacen("\"alu\": ", "\"alu\": 1e999, \"x\": ", 1),
            "out of range",
        );
        refused(
            &h200().replacen("\"alu\": ", "\"alu\": null, \"x\": ", 1),
            "invalid type: null",
        );
        let mut profile = DeviceProfile::parse(&h200()).expect("it is sound");
        profile.weights.miss = f64::NAN;
        assert!(profile.check().is_err());
    }

    #[test]
    fn every_constant_is_named() {
        let profile = DeviceProfile::parse(&h200()).expect("it is sound");
        let json = serde_json::to_value(profile.weights).expect("numbers");
        let named: serde_json::Map<_, _> = profile
            .weights
            .named()
            .into_iter()
            .map(|(name, value)| (name.to_owned(), value.into()))
            .collect();
        assert_eq!(json, serde_json::Value::Object(named));
    }
}
