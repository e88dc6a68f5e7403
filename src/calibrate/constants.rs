//! The constants of the time model as coordinates in which they can be fitted.
//!
//! Their names come from the profile's own fields, so that a constant that the model gains is fitted
//! without more ado. Each is searched by its logarithm within bounds.

use impasto_compiler::partition::profile::Weights;

/// What is to be known of a constant of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Its name in profiles.
    pub name: &'static str,
    /// The least and the most that it can be.
    pub bounds: [f64; 2],
    /// What it means, with its unit.
    pub meaning: &'static str,
}

const TIMES: [f64; 2] = [1e-15, 1e-2];

const fn time(name: &'static str, meaning: &'static str) -> Constant {
    Constant {
        name,
        bounds: TIMES,
        meaning,
    }
}

/// Every constant of the model.
pub const CONSTANTS: [Constant; 18] = [
    time("launch", "s, a dispatch that finds nothing to do"),
    time("latency", "s, an operation that waits for the one before"),
    time("alu", "s, float arithmetic of a subgroup"),
    time(
        "special",
        "s, a division, root or transcendental of a subgroup",
    ),
    time("integer", "s, an integer operation of a subgroup"),
    time("texture", "s, a texture lookup of a subgroup"),
    time("turns", "s, a turn of a loop of a subgroup"),
    time("memory", "s, a byte that a lane reads or writes"),
    time(
        "scatter",
        "s, the same in addition where neighbours are elsewhere",
    ),
    Constant {
        name: "code",
        bounds: [300.0, 1e6],
        meaning: "operations of code that caches hold",
    },
    Constant {
        name: "miss",
        bounds: [1e-3, 10.0],
        meaning: "slowdown by as much more code side by side, as a share",
    },
    Constant {
        name: "overlap",
        bounds: [1.0, 16.0],
        meaning: "exponent by which operations, memory and waiting overlap",
    },
    Constant {
        name: "inline_loads",
        bounds: [1e-3, 2.0],
        meaning: "share of their loads that inline materials make",
    },
    Constant {
        name: "free_registers",
        bounds: [8.0, 256.0],
        meaning: "live numbers that leave the logic kernel as it is",
    },
    Constant {
        name: "pressure",
        bounds: [1e-3, 20.0],
        meaning: "its slowdown by a hundred more, as a share",
    },
    Constant {
        name: "occupancy",
        // With 128 registers a thread, a quarter of the threads are in flight that are with 32.
        bounds: [1e-3, 3.0],
        meaning: "slowdown of a kernel's memory by a hundred live numbers, as a share",
    },
    Constant {
        name: "inline_logic",
        bounds: [1e-3, 20.0],
        meaning: "slowdown of the logic kernel by any inline material, as a share",
    },
    Constant {
        name: "company",
        bounds: [1e-3, 3.0],
        meaning: "slowdown of materials that share a kernel with queues, as a share",
    },
];

/// What is known of the constant called `name`; little of one that is not in the table.
pub fn constant(name: &str) -> Constant {
    let found = CONSTANTS.iter().find(|constant| constant.name == name);
    found.copied().unwrap_or(Constant {
        name: "",
        bounds: [1e-15, 1e9],
        meaning: "",
    })
}

/// Every constant by its name, in alphabetical order.
pub fn named(weights: &Weights) -> Vec<(String, f64)> {
    let mut all = weights
        .named()
        .map(|(name, value)| (name.to_owned(), value));
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all.into()
}

/// The coordinates of constants: logarithms, in the order of [`named`].
pub fn coordinates(weights: &Weights) -> Vec<f64> {
    let all = named(weights).into_iter();
    all.map(|(name, value)| {
        let [least, most] = constant(&name).bounds;
        value.clamp(least, most).ln()
    })
    .collect()
}

/// The constants at coordinates, each within its bounds; `like` gives their names.
pub fn at(coordinates: &[f64], like: &Weights) -> Weights {
    let names = named(like).into_iter().zip(coordinates);
    let fields = names.map(|((name, _), coordinate)| {
        let [least, most] = constant(&name).bounds;
        (name, serde_json::json!(coordinate.exp().clamp(least, most)))
    });
    let fields = fields.collect::<serde_json::Map<_, _>>();
    serde_json::from_value(fields.into()).unwrap_or(*like)
}

#[cfg(test)]
mod tests {
    use super::*;
    use impasto_compiler::partition::DeviceProfile;

    #[test]
    fn every_constant_is_known_and_survives_the_way_there_and_back() {
        for name in DeviceProfile::shipped_names() {
            let profile = DeviceProfile::named(name).expect("it is shipped");
            let weights = profile.weights;
            let back = at(&coordinates(&weights), &weights);
            for ((name, before), (_, after)) in named(&weights).into_iter().zip(named(&back)) {
                let Constant {
                    bounds, meaning, ..
                } = constant(&name);
                assert!(!meaning.is_empty(), "`{name}` needs a row in the table");
                let expected = before.clamp(bounds[0], bounds[1]);
                assert!((after / expected - 1.0).abs() < 1e-12, "{name}");
            }
            assert_eq!(named(&weights).len(), CONSTANTS.len(), "a row too many");
        }
    }

    #[test]
    fn constants_stay_within_their_bounds() {
        let weights = DeviceProfile::named("h200").expect("it is shipped").weights;
        let far = vec![1e3; coordinates(&weights).len()];
        for (name, value) in named(&at(&far, &weights)) {
            assert_eq!(value, constant(&name).bounds[1], "{name}");
        }
    }
}
