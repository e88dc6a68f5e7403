//! Making one measurement: its process, and the record of what it said.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use impasto_runtime::lab::rays::RayReport;
use impasto_runtime::render::report::{AdapterReport, Report};

use super::{Bench, Show, Unit};
use crate::experiment::convergence;
use crate::experiment::partition;
use crate::experiment::process::{Failed, alone, capture};
use crate::experiment::records::Record;
use crate::experiment::study::{Kind, Partition, Rates};

impl Bench<'_> {
    pub(super) fn partition<'b>(
        &'b self,
        part: &'b Partition,
        [share, limit]: [Duration; 2],
        stop: &'b dyn Fn() -> bool,
    ) -> partition::Bench<'b> {
        partition::Bench {
            program: &self.order.program,
            records: &self.records,
            part,
            device: &self.order.device,
            quick: self.order.quick,
            share,
            limit,
            stop,
        }
    }

    pub(super) fn case<'b>(
        &'b self,
        part: &Partition,
        scene: usize,
        unit: &Unit,
        file: &'b Path,
    ) -> partition::Case<'b> {
        let least = part.pools.iter().min();
        partition::Case {
            scene: &self.study.scenes[scene],
            index: scene,
            file,
            pool: part.pools[unit.variant],
            is_first_pool: least == Some(&part.pools[unit.variant]),
        }
    }

    /// Makes a measurement and keeps it: a line that says how it went. What can be cut short is, after `share`.
    pub(super) fn measure(
        &self,
        unit: &Unit,
        digest: &str,
        share: Option<Duration>,
        show: &Show<'_>,
    ) -> Result<String, Failed> {
        let begun = Instant::now();
        // Times are only those of a GPU that nobody else uses.
        let _alone = alone(&self.order.device, show.stop)?;
        let part = &self.study.parts[unit.part];
        let limit = Duration::from_secs(part.limit);
        // Until it is whole, a record stands for nothing.
        let mut record = Record::new(self.id(unit), String::new(), self.stamp(unit));
        let line = match (&part.kind, unit.scene) {
            (Kind::Partition(of), Some(scene)) => {
                let file = self.study.scenes[scene].file(&self.mixes());
                let case = self.case(of, scene, unit, &file);
                let line = self
                    .partition(of, [share.unwrap_or(limit), limit], show.stop)
                    .measure(&case, &mut record)?;
                let adapter = record
                    .answer
                    .as_ref()
                    .map(|a| a.measurement.adapter.clone());
                if let Some(adapter) = adapter {
                    record.stamp = record.stamp.on(&AdapterReport {
                        name: adapter.name,
                        backend: adapter.backend,
                        driver: adapter.driver,
                    });
                }
                line
            }
            (Kind::Rates(of), Some(scene)) => {
                self.rates(of, unit, scene, limit, show, &mut record)?
            }
            (Kind::Rays(_), Some(_)) => {
                let mut command = Command::new(&self.order.program);
                command
                    .args(self.words(unit))
                    .args(["--quiet", "--format", "json"]);
                let text = capture(&mut command, limit, show.stop)?;
                let answer: RayReport = serde_json::from_str(&text)
                    .map_err(|e| format!("the answer of `impasto rays` is not as expected: {e}"))?;
                record.stamp = record.stamp.on(&answer.adapter);
                let line = format!("{} rates", answer.rates.len());
                record.rays = Some(answer);
                line
            }
            _ => {
                let folder = self.order.out.join(&part.name);
                let mut command = Command::new(&self.order.program);
                command
                    .args(self.words(unit))
                    .arg("--quiet")
                    .arg("--out")
                    .arg(&folder);
                capture(&mut command, limit, show.stop)?;
                let found = convergence::load(&folder)?;
                record.stamp = record.stamp.on(&found.adapter);
                format!("{} scenes", found.scenes.len())
            }
        };
        record.digest = digest.into();
        self.records.save(&record)?;
        Ok(format!("{line} ({:.1} s)", begun.elapsed().as_secs_f64()))
    }

    /// Renders, so often as is asked for.
    pub(super) fn rates(
        &self,
        of: &Rates,
        unit: &Unit,
        scene: usize,
        limit: Duration,
        show: &Show<'_>,
        record: &mut Record,
    ) -> Result<String, Failed> {
        let repeats = if self.order.quick { 1 } else { of.repeats };
        let file = self.study.scenes[scene].file(&self.mixes());
        let mut words = self.rate_words(of, &of.variants[unit.variant], scene);
        words.extend(self.order.device.iter().cloned());
        let render = |_| partition::render(&self.order.program, &file, &words, limit, show.stop);
        let mut reports = (0..repeats)
            .map(render)
            .collect::<Result<Vec<Report>, Failed>>()?;
        reports.sort_by(|a, b| a.rate().total_cmp(&b.rate()));
        record.rates = reports.iter().map(Report::rate).collect();
        let median = reports.swap_remove(reports.len() / 2);
        record.stamp = record.stamp.clone().on(&median.adapter);
        let line = format!("{:.2} Mpaths/s", median.rate() * 1e-6);
        record.report = Some(median);
        Ok(line)
    }
}
