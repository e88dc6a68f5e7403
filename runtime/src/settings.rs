//! Settings that no render can have, whatever the GPU, found before anything is built.

use crate::error::RuntimeError;
use crate::render::RenderOptions;
use crate::state;
use crate::world::World;

/// Fails, with what is possible, if a setting cannot be rendered.
pub(crate) fn check(world: &World, options: &RenderOptions) -> Result<(), RuntimeError> {
    let pixels = u64::from(world.width) * u64::from(world.height);
    if pixels == 0 || pixels > 1 << 29 {
        let size = format!("{} x {}", world.width, world.height);
        return refuse("the picture's size", size, "1 to 2^29 pixels");
    }
    if world.max_depth == 0 || world.max_depth > state::MAX_DEPTH {
        let expected = format!("1 to {} segments", state::MAX_DEPTH);
        return refuse("max_depth", world.max_depth.to_string(), &expected);
    }
    check_samples(options)?;
    if options.pool == Some(0) {
        return refuse("pool", "0".into(), "at least 1 path");
    }
    Ok(())
}

/// The same for which samples are taken.
pub(crate) fn check_samples(options: &RenderOptions) -> Result<(), RuntimeError> {
    if options.samples == 0 {
        return refuse("samples", "0".into(), "at least 1 sample a pixel");
    }
    if options.first_sample.checked_add(options.samples).is_none() {
        // The largest word stands for all samples of a pixel (kernels/random).
        let last = u64::from(options.first_sample) + u64::from(options.samples) - 1;
        return refuse(
            "the last sample's index",
            last.to_string(),
            "at most 2^32 - 2",
        );
    }
    Ok(())
}

fn refuse(setting: &'static str, value: String, expected: &str) -> Result<(), RuntimeError> {
    Err(RuntimeError::Setting {
        setting,
        value,
        expected: expected.to_string(),
    })
}
