//! The media that fill the insides of a scene's objects: a table of the distinct ones, which of
//! them each triangle bounds, and what of all that paths have to follow.
//!
//! A path carries a stack of the media it is in. Where objects overlap, the medium with the
//! highest priority counts: Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced
//! Images". `media.wgsl` and, where light is scattered,
//! `volume.wgsl` are the other half of this file.

use std::collections::BTreeMap;

use impasto_compiler::abi::walk::{COARSE_TURNS, COARSER_TURNS, FAINT};
use impasto_compiler::abi::{Input, InstanceInfo, MaterialInfo, Medium};

use crate::error::SceneError;
use crate::scene::MAX_NESTED;
use crate::wgsl::{BufferData, ShaderPart};
use crate::wgsl::{constant_f32, constant_u32, constants_u32};
use crate::world::needs::{MediaTraits, Need, Needs};

/// How many distinct media, and how many priorities, a scene can have: a word's halves hold them.
const MAX_MEDIA: usize = 0xffff;
/// How many boundaries in a row that are none (of media overlapped by another of higher priority)
/// a path crosses before it is given up.
pub(crate) const MAX_FALSE_BOUNDARIES: u32 = 64;
/// The strongest absorption and scattering that kernels get, in 1/m; times the greatest distance
/// both together are finite.
const MAX_RATE: f32 = 1e18;
/// The mean cosine that scattered light turns by is at most this, either way.
const MAX_ANISOTROPY: f32 = 0.99;
/// How often light is turned on its way from one surface to the next before it is given up.
pub(crate) const MAX_TURNS: u32 = 4096;
/// How often a kernel of the wavefront turns light below a surface before it takes up the next walk.
pub(crate) const TURNS_AT_ONCE: u32 = 16;

/// What paths have to know of media. Empty if nothing depends on the medium that a path is in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Media {
    /// `active_medium` and the other functions of a stack; needs the geometry part. Absent if
    /// paths need not follow media.
    pub part: Option<ShaderPart>,
    /// For each instance the word of its medium (see `media.wgsl`), 0 without one.
    pub of_instance: Vec<u32>,
    /// The stack of a path that starts at the camera, innermost first.
    pub camera: [u32; MAX_NESTED],
    /// Is light lost on its way in any of them, absorbed or scattered?
    pub absorb: bool,
    /// Does any of them scatter light?
    pub scatter: bool,
    /// Do their priorities differ, so that one may hide the boundaries of another?
    pub overlap: bool,
}

impl Media {
    /// The media of `instances` of `materials`. The camera is in the media of those in `around`,
    /// outermost first.
    ///
    /// # Errors
    /// The camera is said to be in something that has no interior, or there are too many media.
    pub fn build(
        materials: &[MaterialInfo],
        instances: &[InstanceInfo],
        around: &[u32],
    ) -> Result<Media, SceneError> {
        let table = Table::new(instances.iter().filter_map(|i| i.medium));
        if table.media.len() >= MAX_MEDIA {
            let count = table.media.len();
            let message = format!("the scene's materials have {count} different interiors");
            return Err(SceneError::new(message).hint("at most 65534 are possible"));
        }
        let camera = camera(instances, around, &table)?;
        let scatter = table.scatters();
        let absorb = table
            .media
            .iter()
            .any(|m| any(m.absorption) || any(m.scattering));
        let overlap = table.ranks.len() > 1;
        let reads_ior = materials.iter().any(|m| m.inputs.has(Input::ExteriorIor));
        if table.media.is_empty() || !(absorb || overlap || reads_ior) {
            return Ok(Media::default());
        }
        let words = instances.iter().map(|i| table.word(i.medium));
        Ok(Media {
            part: Some(table.part()),
            of_instance: words.collect(),
            camera,
            absorb,
            scatter,
            overlap,
        })
    }
}

impl Media {
    /// What the table of needs has to know.
    pub(super) fn traits(&self) -> MediaTraits {
        MediaTraits {
            followed: self.part.is_some(),
            absorb: self.absorb,
            scatter: self.scatter,
            overlap: self.overlap,
        }
    }
}

/// The functions of a stack for a scene that has empty space only.
pub(crate) fn of_empty_space() -> ShaderPart {
    Table::new(std::iter::empty()).part()
}

/// What ray casts know of light that is turned on its way, in media or below surfaces.
pub(crate) fn flights(needs: Needs) -> String {
    let constants = constants_u32(&[
        ("MAX_TURNS", MAX_TURNS),
        ("COARSE_TURNS", COARSE_TURNS),
        ("COARSER_TURNS", COARSER_TURNS),
        ("TURNS_AT_ONCE", TURNS_AT_ONCE),
    ]) + &constant_f32("FAINT", FAINT);
    let below = if needs.has(Need::Subsurface) {
        include_str!("subsurface.wgsl")
    } else {
        ""
    };
    constants + include_str!("flight.wgsl") + below
}

/// Every medium once.
struct Table {
    /// In order of first use.
    media: Vec<Medium>,
    /// The places of the same in `media`.
    rows: BTreeMap<Key, u32>,
    /// The places of priorities in their order.
    ranks: BTreeMap<u32, u32>,
}

/// The bits of a medium.
type Key = ([u32; 3], u32, u32, [u32; 3], u32);

impl Table {
    fn new(all: impl Iterator<Item = Medium>) -> Table {
        let mut media = Vec::new();
        let mut rows = BTreeMap::new();
        for medium in all.map(finite) {
            rows.entry(key(&medium)).or_insert_with(|| {
                media.push(medium);
                media.len() as u32 - 1
            });
        }
        let ranks = ranks(&media);
        Table { media, rows, ranks }
    }

    /// The word of a medium; 0 of none.
    fn word(&self, medium: Option<Medium>) -> u32 {
        let word = |m: Medium| {
            let row = self.rows.get(&key(&finite(m)))?;
            Some(self.ranks.get(&m.priority)? << 16 | (row + 1))
        };
        medium.and_then(word).unwrap_or(0)
    }

    /// The functions of a stack, and a row a medium; row 0 is empty space.
    fn part(&self) -> ShaderPart {
        let extinction = |m: &Medium, c: usize| m.absorption[c] + m.scattering[c];
        let row = |m: &Medium| {
            let [r, g, b] = [0, 1, 2].map(|c| extinction(m, c));
            [r, g, b, m.ior]
        };
        let mut part = ShaderPart {
            wgsl: constant_u32("MAX_FALSE_BOUNDARIES", MAX_FALSE_BOUNDARIES)
                + include_str!("media.wgsl"),
            buffers: vec![self.buffer("medium_table", row)],
        };
        if self.scatters() {
            part.wgsl += include_str!("volume.wgsl");
            let row = |m: &Medium| {
                let [r, g, b] = m.scattering;
                [r, g, b, m.anisotropy]
            };
            part.buffers.push(self.buffer("volume_table", row));
        }
        part
    }

    /// A row for empty space and one a medium.
    fn buffer(&self, name: &'static str, row: impl Fn(&Medium) -> [f32; 4]) -> BufferData {
        let rows: Vec<[f32; 4]> = std::iter::once(&Medium::AIR)
            .chain(&self.media)
            .map(row)
            .collect();
        BufferData::new(name, "array<vec4<f32>>", &rows)
    }

    fn scatters(&self) -> bool {
        self.media.iter().any(|m| any(m.scattering))
    }
}

fn key(medium: &Medium) -> Key {
    let bits = |rates: [f32; 3]| rates.map(f32::to_bits);
    (
        bits(medium.absorption),
        medium.ior.to_bits(),
        medium.priority,
        bits(medium.scattering),
        medium.anisotropy.to_bits(),
    )
}

/// A medium with numbers that kernels can compute with: rates below zero, or that are no numbers, are
/// zero, as is an anisotropy that is none, and what has no positive index is as empty space.
fn finite(medium: Medium) -> Medium {
    let rate = |a: f32| if a > 0.0 { a.min(MAX_RATE) } else { 0.0 };
    let has_index = medium.ior > 0.0 && medium.ior.is_finite();
    let turns = medium.anisotropy.abs() <= MAX_ANISOTROPY;
    Medium {
        absorption: medium.absorption.map(rate),
        ior: if has_index { medium.ior } else { 1.0 },
        priority: medium.priority,
        scattering: medium.scattering.map(rate),
        anisotropy: if turns { medium.anisotropy } else { 0.0 },
    }
}

fn any(rates: [f32; 3]) -> bool {
    rates.iter().any(|r| *r > 0.0)
}

/// The places of priorities in their order.
fn ranks(media: &[Medium]) -> BTreeMap<u32, u32> {
    let mut priorities: Vec<u32> = media.iter().map(|m| m.priority).collect();
    priorities.sort_unstable();
    priorities.dedup();
    priorities.into_iter().zip(0..).collect()
}

/// The stack of the camera, innermost first.
fn camera(
    instances: &[InstanceInfo],
    around: &[u32],
    table: &Table,
) -> Result<[u32; MAX_NESTED], SceneError> {
    let mut stack = [0; MAX_NESTED];
    for (entry, &index) in stack.iter_mut().zip(around.iter().rev()) {
        let instance = instances.get(index as usize);
        let medium = instance.and_then(|i| i.medium);
        if medium.is_none() {
            let name = instance.map_or("", |i| i.name.as_str());
            let message = format!("the camera cannot be in `{name}`, which has no interior");
            let hint = "`medium` of [camera] names materials that assign `interior`";
            return Err(SceneError::new(message).hint(hint));
        }
        *entry = table.word(medium);
    }
    Ok(stack)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(absorption: f32, ior: f32, priority: u32) -> Medium {
        Medium {
            absorption: [absorption; 3],
            ior,
            priority,
            ..Medium::AIR
        }
    }

    #[test]
    fn equal_media_are_one_and_priorities_keep_their_order() {
        let media = [
            medium(1.0, 1.5, 7),
            medium(f32::NAN, 1.3, 90),
            medium(-3.0, 1.3, 90),
            medium(1.0, 1.5, 7),
            medium(f32::INFINITY, 1.0, 0),
        ];
        let table = Table::new(media.into_iter());
        let expected = [
            medium(1.0, 1.5, 7),
            medium(0.0, 1.3, 90),
            medium(MAX_RATE, 1.0, 0),
        ];
        assert_eq!(table.media, expected);
        let words = media.map(|m| table.word(Some(m)));
        assert_eq!(words, [0x1_0001, 0x2_0002, 0x2_0002, 0x1_0001, 3]);
        assert_eq!(table.word(None), 0);
    }
}
