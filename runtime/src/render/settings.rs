//! Settings that no render can have, whatever the GPU, found before anything is built.

use crate::error::RuntimeError;
use crate::kernels::state;
use crate::options::RenderOptions;
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
    if let Some(some) = &options.pixels {
        check_pixels(some, world.width, world.height)?;
    }
    if options.pool == Some(0) {
        return refuse("pool", "0".into(), "at least 1 path");
    }
    Ok(())
}

/// The same for which pixels are rendered.
pub(crate) fn check_pixels(some: &[u32], width: u32, height: u32) -> Result<(), RuntimeError> {
    let all = u64::from(width) * u64::from(height);
    let ascending = some.windows(2).all(|pair| pair[0] < pair[1]);
    let last = some.last().map(|last| u64::from(*last));
    if ascending && last.is_some_and(|last| last < all) {
        return Ok(());
    }
    let value = match last {
        None => "empty".to_string(),
        Some(_) if !ascending => "not ascending".to_string(),
        Some(last) => format!("up to {last}"),
    };
    let expected = format!("at least one of the indices below {all}, ascending");
    refuse("the choice of pixels", value, &expected)
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
