//! The worst of what many cases measured, kept as one row for each BSDF and kind of measurement.

use std::collections::BTreeMap;
use std::sync::Mutex;

use crate::common::record::{Bound, Row};

/// Which table, of what, and what was measured.
type Key = (&'static str, String, &'static str);

/// Collects measurements of tests that run in parallel.
#[derive(Default)]
pub struct Tally {
    worst: Mutex<BTreeMap<Key, (f64, Bound, String)>>,
}

impl Tally {
    /// Takes a measurement, if it is worse than those before.
    pub fn add(&self, key: (&'static str, &str, &'static str), x: f64, bound: Bound, place: &str) {
        let (table, subject, what) = key;
        let mut worst = self.worst.lock().expect("no panic while it is held");
        let entry = worst.entry((table, subject.to_owned(), what));
        let kept = entry.or_insert_with(|| (x, bound, place.to_owned()));
        let worse = match bound {
            Bound::AtMost(_) => x > kept.0 || x.is_nan(),
            Bound::AtLeast(_) => x < kept.0 || x.is_nan(),
        };
        if worse {
            *kept = (x, bound, place.to_owned());
        }
    }

    /// Keeps the rows.
    fn note(&self) {
        let worst = self.worst.lock().expect("no panic while it was held");
        for ((table, subject, what), (worst, bound, place)) in &*worst {
            let (worst, bound, what) = (*worst, *bound, *what);
            Row {
                table,
                subject,
                what,
                worst,
                bound,
                place,
            }
            .note();
        }
    }
}

/// Rows are kept when the tally goes, so that a test which fails leaves its own.
impl Drop for Tally {
    fn drop(&mut self) {
        self.note();
    }
}
