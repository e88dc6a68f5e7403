//! Adding films plane by plane and piece by piece, as they are read: a part of a picture of any size takes a piece of
//! memory to be added, and not as much as the picture.

use crate::film::layers::Layers;
use crate::film::outputs::{ID_SLOTS, Kind, SUM_WORDS};
use crate::film::{COUNT_PLANE, Sums};

/// Sums to which planes of other films are added. Pieces of a film come in the order of its planes.
pub(super) struct Accumulator<'s> {
    sums: &'s mut Sums,
    roles: Vec<Role>,
    /// The ids of a slot, until the samples come that they count; empty until there are any.
    ids: Vec<u32>,
    /// The plane that those are of.
    ids_of: Option<usize>,
}

/// How the words of a plane are added to those there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The word `0` of a sum, the lowest of which is in the plane so many before this one; carries go to the others.
    Word(usize),
    /// A number of samples.
    Count,
    /// The complement of a distance, of which the largest is kept.
    Nearest,
    /// The id of a slot, whose number of samples is in the next plane.
    Id,
    /// The number of samples of the id before, in a list of slots that begins with a plane.
    IdCount(usize),
}

impl<'s> Accumulator<'s> {
    pub(super) fn new(sums: &'s mut Sums) -> Self {
        Self {
            roles: roles(sums.layers()),
            sums,
            ids: Vec::new(),
            ids_of: None,
        }
    }

    /// Adds `words` of a plane, which are those of the pixels from `pixel` on. Words beyond the last pixel are none.
    pub(super) fn add(&mut self, plane: usize, pixel: usize, words: &[u32]) {
        let count = self.sums.pixel_count();
        let words = &words[..words.len().min(count.saturating_sub(pixel))];
        let Some(role) = self.roles.get(plane) else {
            return;
        };
        match *role {
            Role::Word(word) => self.add_word(plane, SUM_WORDS - 1 - word, pixel, words),
            Role::Count => self.combine(plane, pixel, words, u32::saturating_add),
            Role::Nearest => self.combine(plane, pixel, words, u32::max),
            Role::Id => {
                self.ids.resize(count, 0);
                self.ids[pixel..][..words.len()].copy_from_slice(words);
                self.ids_of = Some(plane);
            }
            Role::IdCount(first) if self.ids_of == plane.checked_sub(1) => {
                self.add_ids(first, pixel, words)
            }
            // Ids of no plane are none.
            Role::IdCount(_) => {}
        }
    }

    fn combine(&mut self, plane: usize, pixel: usize, words: &[u32], with: fn(u32, u32) -> u32) {
        let own = &mut self.sums.plane_mut(plane)[pixel..];
        for (own, word) in own.iter_mut().zip(words) {
            *own = with(*own, *word);
        }
    }

    /// Adds one word of sums, which `above` more words follow in the next planes.
    fn add_word(&mut self, plane: usize, above: usize, pixel: usize, words: &[u32]) {
        let count = self.sums.pixel_count();
        let mut at = pixel;
        for block in words.chunks(BLOCK) {
            let own = &mut self.sums.words[plane * count + at..][..block.len()];
            let mut carries = 0;
            for (own, word) in own.iter_mut().zip(block) {
                *own = own.wrapping_add(*word);
                carries |= u32::from(*own < *word);
            }
            if carries != 0 && above > 0 {
                self.carry(plane, above, at, block);
            }
            at += block.len();
        }
    }

    /// Carries from a plane to which `words` were added to those above it.
    fn carry(&mut self, plane: usize, above: usize, pixel: usize, words: &[u32]) {
        let count = self.sums.pixel_count();
        let (low, rest) = self.sums.words.split_at_mut((plane + 1) * count);
        let low = &low[plane * count + pixel..][..words.len()];
        if above == 1 {
            let high = &mut rest[pixel..][..words.len()];
            for ((low, word), high) in low.iter().zip(words).zip(high) {
                *high = high.wrapping_add(u32::from(low < word));
            }
            return;
        }
        let (middle, high) = rest.split_at_mut(count);
        let (middle, high) = (&mut middle[pixel..], &mut high[pixel..]);
        for (((low, word), middle), high) in low.iter().zip(words).zip(middle).zip(high) {
            let carried;
            (*middle, carried) = middle.overflowing_add(u32::from(low < word));
            *high = high.wrapping_add(u32::from(carried));
        }
    }

    /// Puts the ids of a slot into the lists there are; what finds no room is counted as it is where samples are taken.
    fn add_ids(&mut self, first: usize, pixel: usize, words: &[u32]) {
        let count = self.sums.pixel_count();
        let slots = &mut self.sums.words[first * count..];
        let ids = &self.ids[pixel..];
        for (at, (id, samples)) in ids.iter().zip(words).enumerate() {
            if *id == 0 {
                continue;
            }
            let place = |plane: usize| plane * count + pixel + at;
            let has_room = |slot: &usize| [0, *id].contains(&slots[place(2 * slot)]);
            let to = match (0..ID_SLOTS).find(has_room) {
                Some(slot) => {
                    slots[place(2 * slot)] = *id;
                    2 * slot + 1
                }
                None => 2 * ID_SLOTS,
            };
            slots[place(to)] = slots[place(to)].saturating_add(*samples);
        }
    }

    /// Ends the last film.
    pub(super) fn finish(self) {
        self.sums.sort_all_ids();
    }
}

/// Pixels whose carries are looked for together: a block stays in the nearest cache.
const BLOCK: usize = 1024;

/// The roles of all planes.
fn roles(layers: &Layers) -> Vec<Role> {
    let sum = || (0..SUM_WORDS).map(Role::Word);
    let mut roles: Vec<Role> = (0..COUNT_PLANE / SUM_WORDS).flat_map(|_| sum()).collect();
    roles.push(Role::Count);
    for (first, layer) in layers.placed() {
        match layer.output.kind {
            Kind::Mean(..) | Kind::Variance => {
                roles.extend(layer.output.channels.iter().flat_map(|_| sum()));
            }
            Kind::Share => roles.push(Role::Count),
            Kind::Nearest => roles.push(Role::Nearest),
            Kind::Ids => {
                roles.extend((0..ID_SLOTS).flat_map(|_| [Role::Id, Role::IdCount(first)]));
                roles.push(Role::Count);
            }
            Kind::Samples => {}
        }
    }
    roles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::file::tests::with_outputs;

    #[test]
    fn every_plane_has_a_role() {
        let names = [
            "albedo",
            "depth",
            "material",
            "variance",
            "samples",
            "object",
            "light_key",
        ];
        let film = with_outputs(0, 1, 1, &names);
        assert_eq!(roles(film.sums.layers()).len(), film.sums.layers().planes());
    }

    /// However a film is cut into pieces.
    #[test]
    fn pieces_add_to_what_the_whole_does() {
        let names = ["albedo", "depth", "material"];
        let (a, b) = (
            with_outputs(0, 2, u32::MAX, &names),
            with_outputs(2, 2, 9, &names),
        );
        let mut whole = a.sums.clone();
        whole.add(&b.sums);
        let mut pieces = a.sums.clone();
        let mut accumulator = Accumulator::new(&mut pieces);
        for plane in 0..b.sums.layers().planes() {
            for (pixel, word) in b.sums.plane(plane).iter().enumerate() {
                accumulator.add(plane, pixel, &[*word]);
            }
        }
        accumulator.add(usize::MAX, 0, &[1]);
        accumulator.add(0, 2, &[1]);
        accumulator.finish();
        assert_eq!(pieces, whole);
        assert_ne!(whole, a.sums);
    }
}
