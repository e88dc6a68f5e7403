//! Device profiles: kernels of known cost are timed, and the constants of the time model fitted to what
//! they took.

mod constants;
mod errors;
mod fit;
mod measure;
mod minimise;
mod registers;
mod report;
mod room;
mod score;
mod sources;

pub use errors::Errors;
#[cfg(test)]
pub(crate) use fit::tests::{all_measured_by, measured_by};
pub use fit::{Fitted, Residual, fit};
pub use measure::{Effort, Step, measure};
pub use registers::{Registers, registers};
pub use report::text;
pub use score::{Scored, Scores, score, scores_text};

use impasto_compiler::partition::DeviceProfile;

use crate::measure::{Adapter, Measurement};

/// The profile to start from for measurements of one GPU: the shipped one that is nearest, under the
/// name of that GPU.
///
/// # Errors
/// If there are no measurements, or they are of several GPUs.
pub fn start(sets: &[Measurement]) -> Result<DeviceProfile, String> {
    let Some(first) = sets.first() else {
        return Err("there are no measurements".into());
    };
    let Adapter {
        name,
        driver,
        kind,
        subgroup,
        ..
    } = &first.adapter;
    if let Some(other) = sets.iter().find(|set| set.adapter.name != *name) {
        return Err(format!(
            "the measurements are of several GPUs, `{name}` and `{}`\n  hint: a profile is of one; \
             leave out the files of the other",
            other.adapter.name
        ));
    }
    let choice = DeviceProfile::shipped(name, kind).map_err(|e| e.to_string())?;
    Ok(DeviceProfile {
        device: name.clone(),
        driver: driver.clone(),
        subgroup: match subgroup {
            0 => choice.profile.subgroup,
            lanes => *lanes,
        },
        ..choice.profile
    })
}
