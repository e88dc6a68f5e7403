//! GPU time by timestamps, as finely as the device can give them.

/// Where timestamps are written, finest last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Timing {
    /// Nowhere: only the time waited is known.
    None,
    /// Around passes, so that each dispatch takes a pass of its own.
    AroundPass,
    /// Between the dispatches of one pass.
    #[default]
    InPass,
}

impl Timing {
    /// The finest that a device with `features` can do.
    pub(crate) fn finest(features: wgpu::Features) -> Self {
        if features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES) {
            Timing::InPass
        } else if features.contains(wgpu::Features::TIMESTAMP_QUERY) {
            Timing::AroundPass
        } else {
            Timing::None
        }
    }

    /// Timestamps that `dispatches` dispatches write.
    pub(crate) fn queries(self, dispatches: u32) -> u32 {
        match self {
            Timing::InPass => dispatches + 1,
            Timing::AroundPass => 2 * dispatches,
            Timing::None => 0,
        }
    }

    /// The most dispatches whose timestamps fit one query set.
    pub(crate) fn max_dispatches(self) -> u32 {
        match self {
            Timing::InPass => wgpu::QUERY_SET_MAX_QUERIES - 1,
            Timing::AroundPass => wgpu::QUERY_SET_MAX_QUERIES / 2,
            Timing::None => u32::MAX,
        }
    }

    /// Seconds of each dispatch, and of all from the first beginning to the last end. Drivers
    /// may give timestamps that run backwards; those count as no time.
    pub(crate) fn seconds(self, ticks: &[u64], nanoseconds_a_tick: f32) -> (Vec<f64>, f64) {
        let seconds = |from: u64, to: u64| {
            to.saturating_sub(from) as f64 * f64::from(nanoseconds_a_tick) / 1e9
        };
        let each = match self {
            Timing::InPass => ticks.windows(2).map(|t| seconds(t[0], t[1])).collect(),
            Timing::AroundPass => ticks.chunks_exact(2).map(|t| seconds(t[0], t[1])).collect(),
            Timing::None => Vec::new(),
        };
        let all = match ticks {
            [first, .., last] => seconds(*first, *last),
            _ => 0.0,
        };
        (each, all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dispatches_are_timed_between_timestamps() {
        let (each, all) = Timing::InPass.seconds(&[10, 30, 25, 40], 1e9);
        assert_eq!((each, all), (vec![20.0, 0.0, 15.0], 30.0));
        let (each, all) = Timing::AroundPass.seconds(&[10, 30, 35, 40], 1e9);
        assert_eq!((each, all), (vec![20.0, 5.0], 30.0));
        assert_eq!(Timing::None.seconds(&[], 1.0), (vec![], 0.0));
    }
}
