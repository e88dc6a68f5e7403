//! Which device profile the time model takes its constants from.

use std::path::Path;

use impasto::compiler::partition::DeviceProfile;
use impasto::runtime::gpu::DeviceInfo;

use super::{Failure, read_text};

/// A profile, and whether it is the GPU's own.
#[derive(Clone)]
pub(super) struct Profile {
    /// The name of the shipped profile that it is or is scaled from, or its file.
    pub(super) name: String,
    pub(super) profile: DeviceProfile,
    pub(super) exact: bool,
}

impl Profile {
    /// The profile that was `given`: one that is part of the program, or a file.
    pub(super) fn given(given: &str) -> Result<Self, Failure> {
        let profile = match DeviceProfile::named(given) {
            Some(profile) => profile,
            None => {
                let text = read_text(Path::new(given)).map_err(|error| unread(given, error))?;
                DeviceProfile::parse(&text).map_err(|e| format!("`{given}`: {e}"))?
            }
        };
        Ok(Self {
            name: given.to_owned(),
            profile,
            exact: true,
        })
    }

    /// The shipped profile that fits a GPU best.
    pub(super) fn of(info: &DeviceInfo) -> Result<Self, Failure> {
        let choice = DeviceProfile::shipped(&info.name, info.kind).map_err(|e| e.to_string())?;
        Ok(Self {
            name: choice.name.to_string(),
            profile: choice.profile,
            exact: choice.exact,
        })
    }
}

/// What is neither a shipped profile's name nor a file that can be read.
fn unread(given: &str, error: Failure) -> Failure {
    match error {
        Failure::Error(message) if !Path::new(given).exists() => {
            let names: Vec<&str> = DeviceProfile::shipped_names().collect();
            let hint = format!("give a file, or one of {}", names.join(", "));
            Failure::Error(format!("{message}\nhint: {hint}"))
        }
        other => other,
    }
}
