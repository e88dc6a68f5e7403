//! Cryptomatte: ids of names and their coverage, as compositing programs read them (Friedman and Jones, "Fully
//! Automatic ID Mattes with Support for Motion Blur and Transparency", 2015; specification 1.2).
//!
//! An id is the MurmurHash3 of a name, made a float that is neither infinite, nor no number, nor a denormal.
//! Ranks are the ids of a pixel by falling coverage, two to a layer of four channels.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::film::Sums;
use crate::film::layers::Layer;
use crate::film::outputs::ID_SLOTS;

/// The hash that names become ids by, as metadata calls it.
pub const HASH: &str = "MurmurHash3_32";
/// How a hash becomes a float, as metadata calls it.
pub const CONVERSION: &str = "uint32_to_float32";

/// MurmurHash3 in 32 bits (Appleby) of the bytes of a name, with the seed 0.
pub fn hash(name: &str) -> u32 {
    let scramble = |k: u32| {
        let k = k.wrapping_mul(0xcc9e_2d51).rotate_left(15);
        k.wrapping_mul(0x1b87_3593)
    };
    let (blocks, tail) = name.as_bytes().as_chunks::<4>();
    let mut h = 0u32;
    for block in blocks {
        h ^= scramble(u32::from_le_bytes(*block));
        h = h.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    if !tail.is_empty() {
        let bytes = tail.iter().rev();
        h ^= scramble(bytes.fold(0, |k, byte| k << 8 | u32::from(*byte)));
    }
    h ^= name.len() as u32;
    h = (h ^ h >> 16).wrapping_mul(0x85eb_ca6b);
    h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
    h ^ h >> 16
}

/// The id of a name: its hash with an exponent from 1 to 254.
pub fn id(name: &str) -> f32 {
    let hash = hash(name);
    let exponent = (hash >> 23 & 255).clamp(1, 254);
    f32::from_bits(hash & 0x807f_ffff | exponent << 23)
}

/// The names and ids of a layer as JSON, by name.
pub fn manifest(names: &[String]) -> String {
    let hex = |name: &String| format!("{:08x}", id(name).to_bits());
    let entries: BTreeMap<&String, String> = names.iter().map(|n| (n, hex(n))).collect();
    serde_json::to_string(&entries).unwrap_or_default()
}

/// The key of a layer's metadata: seven digits of the hash of its name.
pub fn key(layer: &str) -> String {
    format!("{:08x}", hash(layer))[..7].to_owned()
}

/// The channels of a layer with their values in some pixels: `NAME00.R` to `NAME03.A`.
pub fn channels(sums: &Sums, layer: &Layer, pixels: Range<usize>) -> Vec<(String, Vec<f32>)> {
    let ids: Vec<f32> = layer.names.iter().map(|name| id(name)).collect();
    let ranks: Vec<_> = pixels
        .map(|pixel| ranks(sums, layer, &ids, pixel))
        .collect();
    let name = layer.output.channels[0];
    let mut channels = Vec::new();
    for rank in 0..ID_SLOTS {
        let letters = [["R", "G"], ["B", "A"]][rank % 2];
        for (part, letter) in letters.into_iter().enumerate() {
            let values = ranks.iter().map(|pixel| pixel[rank][part]).collect();
            channels.push((format!("{name}{:02}.{letter}", rank / 2), values));
        }
    }
    channels
}

/// The ids of a pixel with their coverage, by falling coverage.
fn ranks(sums: &Sums, layer: &Layer, ids: &[f32], pixel: usize) -> [[f32; 2]; ID_SLOTS] {
    let samples = f64::from(sums.count(pixel).max(1));
    let mut ranks = [[0.0; 2]; ID_SLOTS];
    // Names that are equal are one id.
    let mut found: Vec<(f32, u32)> = Vec::new();
    for counted in sums.ids(&layer.name, pixel) {
        let id = ids.get(counted.id as usize).copied().unwrap_or(0.0);
        match found.iter_mut().find(|(known, _)| *known == id) {
            Some((_, count)) => *count += counted.count,
            None => found.push((id, counted.count)),
        }
    }
    found.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    for (rank, (id, count)) in ranks.iter_mut().zip(found) {
        *rank = [id, (f64::from(count) / samples) as f32];
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PLANES;
    use crate::film::layers::Layers;
    use crate::film::outputs::Output;

    /// Values that are published for the hash.
    #[test]
    fn names_are_hashed_as_others_hash_them() {
        for (name, expected) in [
            ("", 0),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
            ("test", 0xba6b_d213),
            ("a", 0x3c25_69b2),
        ] {
            assert_eq!(hash(name), expected, "{name}");
        }
    }

    #[test]
    fn ids_are_numbers_that_every_program_keeps() {
        assert_eq!(id("hello").to_bits(), 0x248b_fa47);
        assert_eq!(id("").to_bits(), 1 << 23);
        for number in 0..20_000 {
            assert!(id(&number.to_string()).is_normal(), "{number}");
        }
    }

    #[test]
    fn manifests_are_json() {
        let names = ["b \"2\"", "hello"].map(str::to_owned);
        let text = manifest(&names);
        let read: BTreeMap<String, String> = serde_json::from_str(&text).expect("JSON");
        assert_eq!(read["hello"], "248bfa47");
        assert_eq!(read.len(), 2);
        assert_eq!(key("CryptoMaterial").len(), 7);
    }

    /// Readers take the first ranks for the largest, and two objects of a name for one.
    #[test]
    fn ids_are_ranked_by_coverage_and_equal_names_are_one() {
        let names = ["floor", "leaf", "stem", "leaf"].map(str::to_owned);
        let layer = Layer {
            output: Output::named("object").expect("an output"),
            name: "object".into(),
            names: names.to_vec(),
        };
        // Of ten samples four met the floor, and three and two the leaves: together the most.
        let mut words = vec![0; PLANES];
        words[PLANES - 1] = 10;
        let mut slots = [[0u32; 2]; ID_SLOTS];
        slots[..4].copy_from_slice(&[[1, 4], [2, 3], [3, 1], [4, 2]]);
        words.extend(slots.concat());
        words.push(0);
        let layers = Layers::new(vec![layer.clone()]);
        let sums = Sums::new(1, 1, layers, words).expect("a pixel's words");
        let found = channels(&sums, &layer, 0..1);
        let values: Vec<f32> = found.iter().map(|(_, values)| values[0]).collect();
        let expected = [id("leaf"), 0.5, id("floor"), 0.4, id("stem"), 0.1];
        assert_eq!(values[..6], expected);
        assert!(values[6..].iter().all(|value| *value == 0.0));
        let letters: Vec<&str> = found
            .iter()
            .map(|(name, _)| &name[name.len() - 4..])
            .collect();
        assert_eq!(letters[..5], ["00.R", "00.G", "00.B", "00.A", "01.R"]);
    }
}
