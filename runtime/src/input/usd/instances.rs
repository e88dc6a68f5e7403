//! Instances at points: prototypes of which each is at many places.

use std::collections::BTreeSet;

use glam::{DMat4, DQuat, DVec3};
use openusd::sdf::{Path, Value};

use super::values::{self, Reader};
use super::walk::{Above, MOST_PLACES, Walk};

type Checked<T = ()> = Result<T, String>;

impl Walk<'_> {
    /// Each prototype at its places.
    pub(super) fn instancer(&mut self, path: &Path, here: &Above) -> Checked {
        let reader = self.reader;
        let wrong = |what: &str| format!("the instances of `{path}` cannot be read: {what}");
        let prototypes = reader.targets(path, "prototypes")?;
        let numbers = reader.counts(path, "protoIndices")?.unwrap_or_default();
        let positions = reader.vectors(path, "positions")?.unwrap_or_default();
        let scales = reader.vectors(path, "scales")?.unwrap_or_default();
        let turns = ["orientationsf", "orientations"].iter().find_map(|name| {
            reader
                .value(path, name)
                .ok()
                .flatten()
                .and_then(values::rotations)
        });
        let turns = turns.unwrap_or_default();
        if positions.len() != numbers.len() {
            return Err(wrong(&format!(
                "it has {} positions and {} prototypes of them",
                positions.len(),
                numbers.len()
            )));
        }
        if numbers.len() > MOST_PLACES {
            return Err(wrong(&format!("there are more than {MOST_PLACES}")));
        }
        let hidden = hidden(&reader, path, numbers.len())?;
        let names = [
            "protoIndices",
            "positions",
            "scales",
            "orientations",
            "orientationsf",
            "invisibleIds",
        ];
        let varies = names.iter().any(|name| reader.varies(path, name));
        let mut places: Vec<Vec<DMat4>> = vec![Vec::new(); prototypes.len()];
        for (index, number) in numbers.iter().enumerate() {
            if hidden.contains(&index) {
                continue;
            }
            let list = places.get_mut(*number as usize);
            let list =
                list.ok_or_else(|| wrong(&format!("prototype {number} of {}", prototypes.len())))?;
            let scale = scales.get(index).map_or(DVec3::ONE, |s| s.as_dvec3());
            let turn = turns.get(index).copied().unwrap_or(DQuat::IDENTITY);
            let matrix =
                DMat4::from_scale_rotation_translation(scale, turn, positions[index].as_dvec3());
            if !matrix.is_finite() {
                return Err(wrong(&format!(
                    "the place of instance {index} is no number"
                )));
            }
            list.push(here.world * matrix);
        }
        let outside = std::mem::take(&mut self.model.placed);
        let mut all = Vec::new();
        for (prototype, places) in prototypes.iter().zip(places) {
            let lower = Above {
                world: DMat4::IDENTITY,
                moves: here.moves || varies,
                ..here.clone()
            };
            // Lights and cameras of prototypes are of no place.
            let (lights, watch) = (
                self.model.lights.len(),
                std::mem::replace(&mut self.takes_camera, false),
            );
            self.prim(prototype, &lower)?;
            self.model.lights.truncate(lights);
            self.takes_camera = watch;
            for mut placed in std::mem::take(&mut self.model.placed) {
                let count = placed.places.len().saturating_mul(places.len());
                if count > MOST_PLACES {
                    return Err(wrong(&format!("there are more than {MOST_PLACES}")));
                }
                let own = std::mem::take(&mut placed.places);
                placed.places = places
                    .iter()
                    .flat_map(|m| own.iter().map(move |own| *m * *own))
                    .collect();
                all.push(placed);
            }
        }
        self.model.placed = outside;
        let count: usize = all
            .iter()
            .chain(&self.model.placed)
            .map(|p| p.places.len())
            .sum();
        if count > MOST_PLACES {
            return Err(wrong(&format!("there are more than {MOST_PLACES}")));
        }
        self.model.placed.extend(all);
        Ok(())
    }
}

/// The instances that are not shown.
fn hidden(reader: &Reader<'_>, path: &Path, count: usize) -> Checked<BTreeSet<usize>> {
    let list = |name: &str| -> Checked<Vec<i64>> {
        Ok(match reader.value(path, name)? {
            Some(Value::Int64Vec(all)) => all,
            Some(Value::IntVec(all)) => all.into_iter().map(i64::from).collect(),
            _ => Vec::new(),
        })
    };
    let gone: BTreeSet<i64> = list("invisibleIds")?.into_iter().collect();
    let ids = list("ids")?;
    let id = |index: usize| ids.get(index).copied().unwrap_or(index as i64);
    Ok((0..count)
        .filter(|index| gone.contains(&id(*index)))
        .collect())
}
