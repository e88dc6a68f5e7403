//! Where is kept what can be made anew: verdicts of tests, and kernels that were built. It only saves time.

use std::path::PathBuf;

/// The variable that names the folder, or says [`OFF`].
pub const VARIABLE: &str = "IMPASTO_CACHE";

/// What the variable says if nothing is to be kept.
pub const OFF: &str = "off";

/// The folder of what is kept under a name: `impasto/NAME` in the user's cache, or `NAME` in the folder that the variable
/// `IMPASTO_CACHE` names. None if that is `off`, or the user has no cache.
pub fn folder(name: &str) -> Option<PathBuf> {
    let var = |name| {
        let value = std::env::var_os(name).filter(|v| !v.is_empty());
        value.map(PathBuf::from)
    };
    if let Some(chosen) = var(VARIABLE) {
        return (chosen.as_os_str() != OFF).then(|| chosen.join(name));
    }
    let user = if cfg!(windows) {
        var("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        var("HOME").map(|home| home.join("Library/Caches"))
    } else {
        var("XDG_CACHE_HOME").or_else(|| var("HOME").map(|home| home.join(".cache")))
    };
    Some(user?.join("impasto").join(name))
}
