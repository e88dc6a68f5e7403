//! What `render` says of samples that were left out, and how their paths can be replayed.

use impasto::runtime::kernels::dropped::{Dropped, Example};
use impasto::runtime::render::report::Report;
use impasto::runtime::technique::{Choice, Sampler};

use super::render::RenderArgs;

/// A warning for each material and kernel, with the command that replays an example.
pub(super) fn warnings(report: &Report, args: &RenderArgs) -> Vec<String> {
    let found: u64 = report.dropped.iter().map(Dropped::samples).sum();
    let warnings = report.dropped.iter().map(|entry| {
        // What traces paths takes scenes as they are.
        let replay = entry.example.as_ref().filter(|_| args.shot.is_plain());
        let replay = replay.filter(|_| !impasto::shot::is_material(&args.scene));
        let replay = replay.map(|example| replay_hint(example, report, args));
        format!("warning: {}{}", sentence(entry), replay.unwrap_or_default())
    });
    let earlier = report.nonfinite_samples.saturating_sub(found);
    let resumed = (earlier > 0).then(|| {
        format!("warning: {earlier} samples taken over from the checkpoint had been left out as no light")
    });
    warnings.chain(resumed).collect()
}

/// `3 samples of glass were left out (kernel material_glass): 2 not finite, 1 below zero`
fn sentence(entry: &Dropped) -> String {
    let of = match &entry.material {
        Some(material) => format!("of the material `{material}`"),
        None => "whose radiance is no light".to_owned(),
    };
    let (all, kernel) = (entry.samples(), &entry.kernel);
    let (nonfinite, negative) = (entry.nonfinite, entry.negative);
    format!(
        "{} {of} were left out by the kernel {kernel}: {nonfinite} not finite, {negative} below zero",
        super::count(all as usize, "sample")
    )
}

fn replay_hint(example: &Example, report: &Report, args: &RenderArgs) -> String {
    let (value, vertex) = (&example.value, example.vertex);
    let command = replay_command(example, report.technique.sampler, args);
    format!("; one by its {value} at vertex {vertex}, which this replays:\n  {command}")
}

/// The command line that replays a path of this render.
fn replay_command(example: &Example, sampler: Sampler, args: &RenderArgs) -> String {
    let scene = quoted(&args.scene.display().to_string());
    let [x, y] = example.pixel;
    let (sample, seed) = (example.sample, example.seed);
    let mut out = format!("impasto trace {scene} --pixel {x},{y} --sample {sample} --seed {seed}");
    // What overflows on a GPU may not do so in double precision.
    out += " --precision 32";
    if sampler != Sampler::default() {
        out += &format!(" --sampler {}", sampler.name());
    }
    if let Some((width, height)) = args.size {
        out += &format!(" --size {width}x{height}");
    }
    out
}

/// As a shell takes it.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,@=".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_quoted_where_a_shell_would_part_them() {
        assert_eq!(quoted("a/b-1.toml"), "a/b-1.toml");
        assert_eq!(quoted("my scene.toml"), "'my scene.toml'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
