//! Materials, scenes and GPUs that might exist, drawn at random: what searches and explanations are
//! tested with.

use super::profile::Weights;
use super::{Calibrated, DeviceProfile, Hits, Requires, STRATEGIES, Strategy, Workload};
use crate::cost::{Classes, Cost, LANES, Operations};
use crate::random::SplitMix64;

/// The strategies that must know nothing but names.
pub(super) fn by_names() -> impl Iterator<Item = Strategy> {
    let all = STRATEGIES.iter().copied().map(Strategy::new);
    all.filter(|strategy| strategy.requires() == Requires::Nothing)
}

pub(super) struct Random(SplitMix64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(SplitMix64(seed))
    }

    pub(super) fn unit(&mut self) -> f64 {
        (self.0.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    /// Between `a` and `b`, each order of magnitude as likely.
    fn magnitude(&mut self, a: f64, b: f64) -> f64 {
        self.between(a.ln(), b.ln()).exp()
    }
}

/// Materials, a scene and a GPU that might exist.
pub(super) struct Case {
    pub(super) costs: Vec<Option<Cost>>,
    pub(super) workload: Workload,
    pub(super) profile: DeviceProfile,
}

/// About those of an H200, and the same whatever is fitted to one.
const WEIGHTS: Weights = Weights {
    launch: 1.725_491e-5,
    latency: 2.761_873e-9,
    alu: 1.029_557e-12,
    special: 5.409_07e-12,
    integer: 9.613_232e-13,
    texture: 1.111_469e-14,
    turns: 1.542_542e-12,
    memory: 1.432_44e-13,
    scatter: 1.191_417e-12,
    code: 1419.15,
    miss: 0.499_694,
    overlap: 1.162_173,
    inline_loads: 0.032_915,
    free_registers: 28.403_64,
    pressure: 2.656_393,
    occupancy: 0.935_313,
    inline_logic: 0.0,
    company: 0.0,
};

impl Case {
    pub(super) fn new(count: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut profile = DeviceProfile::named("h200").expect("it is shipped");
        profile.weights = WEIGHTS;
        let w = &mut profile.weights;
        for constant in [
            &mut w.launch,
            &mut w.latency,
            &mut w.alu,
            &mut w.memory,
            &mut w.scatter,
        ] {
            *constant *= random.magnitude(0.25, 4.0);
        }
        w.code = random.magnitude(1e3, 1e5);
        w.pressure = random.between(0.0, 1.0);
        let costs = (0..count).map(|_| Some(cost(&mut random))).collect();
        let weights: Vec<f64> = (0..count).map(|_| random.magnitude(0.01, 1.0)).collect();
        let all = weights.iter().sum::<f64>() / random.between(0.3, 1.0);
        let hits = |(i, weight): (usize, &f64)| {
            let share = if random.unit() < 0.1 {
                0.0
            } else {
                weight / all
            };
            let draws = random.magnitude(1.0, 32.0);
            Hits {
                material: format!("m{i}"),
                on_surface: true,
                share,
                present: 1.0 - (1.0 - share).powf(draws),
                loads: 64.0,
                stores: 96.0,
            }
        };
        let materials = weights.iter().enumerate().map(hits).collect();
        let workload = Workload {
            pool: 1 << 20,
            materials,
            begun: 0.0,
            logic_seconds: 8e-5,
            other_seconds: 0.0,
            in_order: false,
        };
        Self {
            costs,
            workload,
            profile,
        }
    }

    pub(super) fn model(&self) -> Calibrated<'_> {
        Calibrated {
            costs: &self.costs,
            workload: &self.workload,
            profile: &self.profile,
        }
    }
}

fn cost(random: &mut Random) -> Cost {
    let mean = random.magnitude(50.0, 8000.0);
    let classes = Classes {
        alu: 0.7 * mean,
        special: 0.05 * mean,
        integer: 0.25 * mean,
        ..Classes::default()
    };
    let growth = random.between(1.0, 1.3);
    let issued = |lanes: u32| {
        let times = growth.powf(f64::from(lanes).log2());
        Classes {
            alu: classes.alu * times,
            special: classes.special * times,
            integer: classes.integer * times,
            ..classes
        }
    };
    Cost {
        operations: Operations {
            evaluations: 1,
            mean,
            min: 0,
            max: 2 * mean as u64,
            classes,
        },
        issued: LANES.map(issued),
        live: random.between(20.0, 200.0) as u32,
        code: (mean * random.between(0.5, 2.0)) as u32,
        loops: 0,
        bytes: random.between(0.0, 64.0),
    }
}
