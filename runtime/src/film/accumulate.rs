//! Adding films plane by plane and piece by piece, as they are read: a part of a picture of any size takes a piece of
//! memory to be added, and not as much as the picture.

use crate::film::file::Piece;
use crate::film::layers::Layers;
use crate::film::outputs::{ID_SLOTS, Kind, SUM_WORDS};
use crate::film::{COUNT_PLANE, Sums};

/// Pixels to which it pays to add the words of all films before the next: their sums stay in the nearest cache.
pub(super) const BLOCK: usize = 1024;

/// Sums to which planes of other films are added. Pieces of a film come in the order of its planes.
pub(super) struct Accumulator<'s> {
    sums: &'s mut Sums,
    roles: Vec<Role>,
    /// Of each film that is being added, where the ids of its last slot went.
    homes: Vec<Homes>,
}

/// Where the ids of a slot went, until the samples come that they count.
#[derive(Default)]
struct Homes {
    /// The plane of the ids.
    of: Option<usize>,
    /// Of each pixel a slot among those there are, or [`LOST`].
    slots: Vec<u8>,
}

/// The place after all slots, which counts samples whose id found no room.
const LOST: u8 = ID_SLOTS as u8;

/// How the words of a plane are added to those there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The word `0` of a sum, the lowest of which is in the plane so many before this one; carries go to the others.
    Word(usize),
    /// A number of samples.
    Count,
    /// The complement of a distance, of which the largest is kept.
    Nearest,
    /// The id of a slot of a list that begins with a plane. Its number of samples is in the next plane.
    Id(usize),
    /// The number of samples of the id before.
    IdCount(usize),
}

impl<'s> Accumulator<'s> {
    pub(super) fn new(sums: &'s mut Sums) -> Self {
        Self {
            roles: roles(sums.layers()),
            sums,
            homes: Vec::new(),
        }
    }

    /// Adds `words` of a plane of a film, which are those of the pixels from `pixel` on. Words beyond the last pixel are
    /// none. Films are numbers, by which those are told apart that are added side by side.
    pub(super) fn add(&mut self, film: usize, plane: usize, pixel: usize, words: &[u32]) {
        let count = self.sums.pixel_count();
        let words = &words[..words.len().min(count.saturating_sub(pixel))];
        let Some(role) = self.roles.get(plane).copied() else {
            return;
        };
        let blocks = words.chunks(BLOCK).zip((pixel..).step_by(BLOCK));
        for (words, pixel) in blocks {
            match role {
                Role::Word(word) => self.add_word(plane, SUM_WORDS - 1 - word, pixel, words),
                Role::Count => self.combine(plane, pixel, words, u32::saturating_add),
                Role::Nearest => self.combine(plane, pixel, words, u32::max),
                Role::Id(first) => self.place_ids(film, plane, first, pixel, words),
                Role::IdCount(first) => self.count_ids(film, plane, first, pixel, words),
            }
        }
    }

    /// Adds a piece of several films.
    pub(super) fn add_piece(&mut self, piece: &Piece) {
        for first in (0..piece.length()).step_by(BLOCK) {
            let block = first..piece.length().min(first + BLOCK);
            for (film, words) in piece.words() {
                self.add(
                    film,
                    piece.plane,
                    piece.pixel + first,
                    &words[block.clone()],
                );
            }
        }
    }

    fn combine(
        &mut self,
        plane: usize,
        pixel: usize,
        words: &[u32],
        with: impl Fn(u32, u32) -> u32,
    ) {
        let own = &mut self.sums.plane_mut(plane)[pixel..];
        for (own, word) in own.iter_mut().zip(words) {
            *own = with(*own, *word);
        }
    }

    /// Adds one word of sums, which `above` more words follow in the next planes.
    fn add_word(&mut self, plane: usize, above: usize, pixel: usize, words: &[u32]) {
        let own = &mut self.sums.plane_mut(plane)[pixel..];
        let mut carries = 0;
        for (own, word) in own.iter_mut().zip(words) {
            *own = own.wrapping_add(*word);
            carries |= u32::from(*own < *word);
        }
        if carries != 0 && above > 0 {
            self.carry(plane, above, pixel, words);
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

    /// Puts the ids of a slot into the lists there are. What finds no room is counted as it is where samples are taken.
    fn place_ids(&mut self, film: usize, plane: usize, first: usize, pixel: usize, ids: &[u32]) {
        let count = self.sums.pixel_count();
        if self.homes.len() <= film {
            self.homes.resize_with(film + 1, Homes::default);
        }
        let homes = &mut self.homes[film];
        homes.of = Some(plane);
        homes.slots.resize(count, 0);
        let homes = &mut homes.slots[pixel..][..ids.len()];
        // Most pixels have the ids that they had in the film before, in the same slots.
        let same = (plane - first) / 2;
        homes.fill(same as u8);
        let own = &self.sums.plane(plane)[pixel..];
        let differ = |(own, id): (&u32, &u32)| u32::from(*own != *id && *id != 0);
        if own
            .iter()
            .zip(ids)
            .map(differ)
            .fold(0, std::ops::BitOr::bitor)
            == 0
        {
            return;
        }
        let slots = &mut self.sums.words[first * count..];
        for (at, (id, home)) in ids.iter().zip(homes).enumerate() {
            let place = |slot: usize| 2 * slot * count + pixel + at;
            if *id == 0 || slots[place(same)] == *id {
                continue;
            }
            let has_room = |slot: &usize| [0, *id].contains(&slots[place(*slot)]);
            *home = match (0..ID_SLOTS).find(has_room) {
                Some(slot) => {
                    slots[place(slot)] = *id;
                    slot as u8
                }
                None => LOST,
            };
        }
    }

    /// Counts the samples of ids that were put into the lists.
    fn count_ids(&mut self, film: usize, plane: usize, first: usize, pixel: usize, words: &[u32]) {
        let count = self.sums.pixel_count();
        let homes = self.homes.get(film);
        let homes = homes.filter(|homes| homes.of == plane.checked_sub(1));
        // Samples of no id are none.
        let Some(homes) = homes.map(|homes| &homes.slots[pixel..][..words.len()]) else {
            return;
        };
        let plane_of = |home: u8| match home {
            LOST => first + 2 * ID_SLOTS,
            slot => first + 2 * usize::from(slot) + 1,
        };
        let home = homes[0];
        if homes
            .iter()
            .fold(0, |differ, other| differ | (home ^ other))
            == 0
        {
            return self.combine(plane_of(home), pixel, words, u32::saturating_add);
        }
        for (at, (home, samples)) in homes.iter().zip(words).enumerate() {
            let own = &mut self.sums.words[plane_of(*home) * count + pixel + at];
            *own = own.saturating_add(*samples);
        }
    }

    /// Ends the last film.
    pub(super) fn finish(self) {
        self.sums.sort_all_ids();
    }
}

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
                roles.extend((0..ID_SLOTS).flat_map(|_| [Role::Id(first), Role::IdCount(first)]));
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
                accumulator.add(0, plane, pixel, &[*word]);
            }
        }
        accumulator.add(0, usize::MAX, 0, &[1]);
        accumulator.add(0, 0, 2, &[1]);
        accumulator.finish();
        assert_eq!(pieces, whole);
        assert_ne!(whole, a.sums);
    }
}
