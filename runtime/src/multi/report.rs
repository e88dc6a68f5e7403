//! The report of a render by several devices.

use super::common::Given;
use crate::kernels::dropped::Dropped;
use crate::render::report::{DeviceReport, Report};

/// What all devices did together: the report of the first one that is left, with the sums of all. Each has a row of its
/// own.
pub(super) fn of_all(reports: &[(Report, &Given)]) -> Report {
    let devices = reports.iter().map(|(report, given)| DeviceReport {
        adapter: report.adapter.clone(),
        adapter_id: report.adapter_id.clone(),
        samples: given.samples,
        gpu_seconds: report.gpu_seconds,
        paths_per_second: report.paths_per_second,
        plan: report.plan.clone(),
        replanned: report.replanned.clone(),
        pool_size: report.pool_size,
        wanted_pool_size: report.wanted_pool_size,
        iterations: report.iterations,
        kernels: report.kernels.clone(),
        lost: given.lost.clone(),
    });
    let devices: Vec<DeviceReport> = devices.collect();
    let is_left = |at: &usize| reports[*at].1.lost.is_none();
    let first = (0..reports.len()).find(is_left).unwrap_or_default();
    let sum = |of: fn(&Report) -> u64| reports.iter().map(|(report, _)| of(report)).sum::<u64>();
    let seconds =
        |of: fn(&Report) -> f64| reports.iter().map(|(report, _)| of(report)).sum::<f64>();
    let steady = reports.iter().map(|(r, _)| r.steady_paths_per_second);
    let dropped = reports
        .iter()
        .flat_map(|(report, _)| report.dropped.clone());
    let counted = |of: fn(&Given) -> u64| reports.iter().map(|(_, given)| of(given)).sum::<u64>();
    Report {
        gpu_seconds: seconds(|r| r.gpu_seconds),
        paths_per_second: seconds(|r| r.paths_per_second),
        steady_paths_per_second: steady.sum(),
        iterations: sum(|r| r.iterations),
        nonfinite_samples: counted(|g| g.counted.nonfinite),
        negative_samples: sum(|r| r.negative_samples),
        clamped_samples: counted(|g| g.counted.clamped),
        dropped: Dropped::merged(dropped),
        queue_overflow: sum(|r| r.queue_overflow),
        media_overflow: sum(|r| r.media_overflow),
        lost_paths: sum(|r| r.lost_paths),
        devices,
        ..reports[first].0.clone()
    }
}
