//! Whether a world has the parts that stages ask for. One that is made of a scene has; one made by hand may not.

use crate::error::RuntimeError;
use crate::kernels::stages::{Part, STAGES};
use crate::world::KernelParts;
use crate::world::needs::{Need, Needs};

/// Fails if a part is missing that a stage asks for.
pub(crate) fn check(parts: &KernelParts, needs: Needs) -> Result<(), RuntimeError> {
    for stage in STAGES.iter().filter(|stage| needs.met(stage.need)) {
        let mut asked = stage.parts_in(needs);
        if let Some(part) = asked.find(|part| is_missing(*part, parts, needs)) {
            return Err(RuntimeError::MissingPart {
                part: part.name(),
                stage: stage.name,
            });
        }
    }
    Ok(())
}

fn is_missing(part: Part, parts: &KernelParts, needs: Needs) -> bool {
    match part {
        Part::Geometry => parts.geometry.wgsl.is_empty(),
        Part::Surface => parts.surface.wgsl.is_empty(),
        Part::Lights => parts.lights.wgsl.is_empty(),
        Part::Traversal => parts.bvh.wgsl.is_empty(),
        Part::Media => parts.media.is_none(),
        Part::Materials => needs.has(Need::Textures) && parts.texture.is_none(),
        // The runtime's own.
        Part::Random
        | Part::Camera
        | Part::Film
        | Part::Numbers
        | Part::Mis
        | Part::Flights
        | Part::Order
        | Part::Roulette
        | Part::Fates => false,
        // A world has outputs only with what they look up.
        Part::Outputs => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::ShaderPart;

    fn part() -> ShaderPart {
        ShaderPart {
            wgsl: "const A = 1;\n".into(),
            buffers: Vec::new(),
        }
    }

    fn whole() -> KernelParts {
        KernelParts {
            geometry: part(),
            bvh: part(),
            surface: part(),
            lights: part(),
            media: Some(part()),
            texture: Some(part()),
            outputs: None,
        }
    }

    #[track_caller]
    fn refused(parts: KernelParts, needs: &[Need], expected: &str) {
        let error = check(&parts, Needs::of_rows(needs)).expect_err("a part is missing");
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn a_part_that_is_missing_is_named_with_the_stage() {
        let all = Needs::of_rows(&[Need::Media, Need::Absorption, Need::Textures]);
        assert!(check(&whole(), all).is_ok());
        let mut parts = whole();
        (parts.media, parts.texture) = (None, None);
        assert!(check(&parts, Needs::default()).is_ok());
        refused(
            parts.clone(),
            &[Need::Media, Need::Absorption],
            "the world has no media, which the stage `logic` asks for",
        );
        refused(
            parts,
            &[Need::Textures],
            "the world has no texture lookups, which the stage `material` asks for",
        );
        let mut parts = whole();
        parts.bvh = ShaderPart::default();
        refused(
            parts,
            &[],
            "the world has no ray casts, which the stage `extension` asks for",
        );
    }
}
