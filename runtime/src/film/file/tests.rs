//! Film files come back as they were, those of older versions too, and no damage goes unseen.

use super::*;
use crate::film::PLANES;
use crate::film::layers::{Layer, Layers};
use crate::film::outputs::Output;
use crate::fingerprint;

/// A part of two pixels' samples, whose sums have words of `value`.
pub(in crate::film) fn part(first: u64, count: u64, value: u32) -> FilmFile {
    with_outputs(first, count, value, &[])
}

/// The same with outputs beside the picture.
pub(in crate::film) fn with_outputs(
    first: u64,
    count: u64,
    value: u32,
    names: &[&str],
) -> FilmFile {
    let samples = vec![count as u32; 2];
    let mut words = vec![value; 2 * (PLANES - 1)];
    words[4..6].fill(0);
    words.extend(samples);
    let layer = |name: &&str| Layer {
        output: Output::named(name).expect("an output"),
        name: (*name).into(),
        names: vec!["metal".into(), "gras \u{df}".into()],
    };
    let layers = Layers::new(names.iter().map(layer).collect());
    // No id twice in a pixel, and none missing.
    words.extend((2 * PLANES..2 * layers.planes()).map(|i| 1 + i as u32 % 60));
    FilmFile {
        about: About {
            identity: Identity {
                width: 2,
                height: 1,
                seed: 7,
                sampler: Sampler::Owen,
                scene: 0x1234_5678_9abc_def0,
            },
            scene: "attic".into(),
            nonfinite: 1,
            clamped: 2,
            ranges: vec![Range { first, count }],
            asked: vec![Range { first, count }],
            makers: vec![maker("NVIDIA H200")],
        },
        sums: Sums::new(2, 1, layers, words).expect("two pixels' words"),
    }
}

/// A device by its name.
pub(in crate::film) fn maker(device: &str) -> Maker {
    Maker {
        device: device.into(),
        backend: "vulkan".into(),
        driver: "NVIDIA 570.195.03".into(),
    }
}

fn bytes_of(film: &FilmFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    film.write_to(&mut bytes).expect("memory takes it");
    bytes
}

fn read(bytes: &[u8]) -> Result<FilmFile, String> {
    let with_length = read_as(bytes, Some(bytes.len() as u64));
    // What comes from a pipe is read to the same.
    let without = read_as(bytes, None);
    assert_eq!(with_length.as_ref().ok(), without.as_ref().ok());
    with_length
}

fn read_as(bytes: &[u8], length: Option<u64>) -> Result<FilmFile, String> {
    let part = Part::new(bytes, length)?;
    let (film, _) = FilmFile::of(part, &mut |_| ControlFlow::Continue(()))?;
    Ok(film)
}

/// Where a film's file has the fingerprint of what stands before the planes.
fn header_length(bytes: &[u8]) -> usize {
    let is_end = |at: &usize| {
        let sum = bytes[*at..].first_chunk::<8>();
        sum == Some(&fingerprint::of(&bytes[..*at]).to_le_bytes())
    };
    (0..bytes.len()).find(is_end).expect("a fingerprint")
}

/// A file of some version with these bytes, and the fingerprints that belong to them.
fn sealed(header: &[u8], planes: &[u8], version: u32) -> Vec<u8> {
    let mut bytes = header.to_vec();
    let seal = |bytes: &mut Vec<u8>| {
        let sum = fingerprint::of(bytes);
        bytes.extend(sum.to_le_bytes());
    };
    if version == VERSION {
        seal(&mut bytes);
    }
    bytes.extend(planes);
    seal(&mut bytes);
    bytes
}

/// The file with `change` made to what stands before the planes.
fn changed(bytes: &[u8], version: u32, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let length = header_length(bytes);
    let mut header = bytes[..length].to_vec();
    change(&mut header);
    sealed(&header, &bytes[length + 8..bytes.len() - 8], version)
}

/// The first byte of the ranges.
const RANGES: usize = 24 + SAMPLER_BYTES + 24;
/// Bytes of a list of one range.
const ONE_RANGE: usize = 4 + 16;

/// The file of an older version: without the samples that were asked for and devices, and of the first without the
/// scene's name and outputs, of which there are none.
fn older(film: &FilmFile, version: u32) -> Vec<u8> {
    changed(&bytes_of(film), version, |header| {
        header[8] = version as u8;
        let makers = &film.about.makers;
        let texts = makers
            .iter()
            .flat_map(|m| [&m.device, &m.backend, &m.driver]);
        let makers: usize = 4 + texts.map(|text| 4 + text.len()).sum::<usize>();
        let present = 4 * film.sums.layers().planes().div_ceil(32);
        let end = header.len() - present;
        header.drain(end - makers..end);
        let name = RANGES + 2 * ONE_RANGE;
        if version == BEFORE_OUTPUTS {
            header.drain(name..name + 4 + film.about.scene.len() + 4);
        }
        header.drain(RANGES + ONE_RANGE..name);
    })
}

#[test]
fn a_file_comes_back_as_it_was() {
    let mut film = part(3, 5, u32::MAX);
    assert_eq!(read(&bytes_of(&film)), Ok(film.clone()));
    film.merge(&part(9, 1, 30)).expect("they merge");
    film.about.asked = vec![Range {
        first: 0,
        count: 99,
    }];
    film.about.makers.push(maker("\u{df}"));
    assert_eq!(film.about.ranges.len(), 2);
    assert_eq!(read(&bytes_of(&film)), Ok(film.clone()));
    film.about.makers.clear();
    assert_eq!(read(&bytes_of(&film)), Ok(film));
}

#[test]
fn outputs_come_back_as_they_were() {
    let film = with_outputs(0, 2, 3, &["material", "light_key", "position"]);
    assert_eq!(read(&bytes_of(&film)), Ok(film));
}

#[test]
fn files_of_older_versions_are_read() {
    let film = part(3, 5, 9);
    let first = read(&older(&film, BEFORE_OUTPUTS)).expect("it is read");
    assert_eq!((&first.sums, first.about.scene.as_str()), (&film.sums, ""));
    for names in [&[][..], &["material", "albedo"]] {
        let film = with_outputs(3, 5, 9, names);
        let second = read(&older(&film, BEFORE_DEVICES)).expect("it is read");
        let expected = About {
            makers: Vec::new(),
            ..film.about.clone()
        };
        assert_eq!((&second.sums, &second.about), (&film.sums, &expected));
        // Nobody knows what was asked for: what there is.
        assert_eq!(second.about.asked, second.about.ranges);
    }
}

/// A file that version 2 of this program wrote, byte by byte, so that this one cannot change both ends.
#[test]
fn a_file_of_version_2_has_the_bytes_that_it_had() {
    let mut bytes = b"IMPASTOF".to_vec();
    let words = |bytes: &mut Vec<u8>, words: &[u32]| {
        words
            .iter()
            .for_each(|word| bytes.extend(word.to_le_bytes()));
    };
    words(&mut bytes, &[2, 1, 1, 7]);
    bytes.extend(b"owen\0\0\0\0\0\0\0\0\0\0\0\0");
    words(&mut bytes, &[5, 0, 1, 0, 2, 0]);
    words(&mut bytes, &[1, 3, 0, 4, 0]);
    words(&mut bytes, &[1]);
    bytes.extend(b"s");
    words(&mut bytes, &[0]);
    words(&mut bytes, &[1 << 9 | 1, 77, 4]);
    let sum = fingerprint::of(&bytes);
    bytes.extend(sum.to_le_bytes());
    let film = read(&bytes).expect("it is read");
    assert_eq!(film.about.scene, "s");
    assert_eq!(film.about.ranges, [Range { first: 3, count: 4 }]);
    assert_eq!(
        (film.sums.plane(0), film.sums.plane(9)),
        (&[77][..], &[4][..])
    );
}

/// A resumed render would take a film for unfinished whose pixels lack samples.
#[test]
fn films_whose_pixels_lack_samples_are_refused() {
    for count in [6, 4] {
        let mut film = part(3, 5, 9);
        film.about.ranges[0].count = count;
        film.about.asked[0].count = 6;
        assert_eq!(read(&bytes_of(&film)), Err(damaged()));
    }
    // None has more than was asked for.
    let mut film = part(3, 5, 9);
    film.about.asked[0].count = 4;
    assert_eq!(read(&bytes_of(&film)), Err(damaged()));
}

#[test]
fn no_damage_goes_unseen() {
    no_damage_of(&bytes_of(&part(3, 5, 9)));
    no_damage_of(&bytes_of(&with_outputs(3, 5, 9, &["material"])));
    no_damage_of(&older(&part(3, 5, 9), BEFORE_OUTPUTS));
    no_damage_of(&older(
        &with_outputs(3, 5, 9, &["material"]),
        BEFORE_DEVICES,
    ));
}

fn no_damage_of(bytes: &[u8]) {
    read(bytes).expect("it is whole");
    for length in 0..bytes.len() {
        let error = read(&bytes[..length]).expect_err("it is cut");
        assert!(error == damaged() || length < 8, "{length} bytes: {error}");
    }
    for at in 0..bytes.len() {
        for bit in [0, 2, 7] {
            let mut other = bytes.to_vec();
            other[at] ^= 1 << bit;
            let error = read(&other).expect_err("a bit is wrong");
            // What says that it is a film, and of which version, is believed first.
            assert!(error == damaged() || at < 12, "byte {at}: {error}");
        }
    }
    let mut longer = bytes.to_vec();
    longer.push(0);
    assert_eq!(read(&longer), Err(damaged()));
}

/// A file whose fingerprints are right may still say what cannot be.
#[test]
fn numbers_that_cannot_be_are_refused() {
    let good = bytes_of(&part(3, 5, 9));
    let refused = |at: usize, bytes: &[u8]| {
        let put = |header: &mut Vec<u8>| header[at..at + bytes.len()].copy_from_slice(bytes);
        read(&changed(&good, VERSION, put)).expect_err("refused")
    };
    let future = VERSION as u8 + 1;
    assert!(refused(8, &[future]).contains(&format!("version {future}")));
    for width in [0, 1, 3, u32::MAX] {
        let error = refused(12, &width.to_le_bytes());
        assert!(error == damaged(), "{width}: {error}");
    }
    assert!(refused(24, b"halton").contains("halton"));
    for count in [0, 2, u32::MAX] {
        refused(RANGES, &count.to_le_bytes());
    }
    for ranges in [RANGES, RANGES + ONE_RANGE] {
        refused(ranges + 4, &u64::MAX.to_le_bytes());
        refused(ranges + 12, &0u64.to_le_bytes());
        refused(ranges + 12, &(1u64 << 32).to_le_bytes());
        refused(ranges + 20, &u32::MAX.to_le_bytes());
    }
    // Lengths of texts and lists for which there are no bytes.
    let scene = RANGES + 2 * ONE_RANGE;
    for length in [6, 1 << 19, u32::MAX] {
        assert_eq!(refused(scene, &length.to_le_bytes()), damaged());
        for place in [scene + 4 + 5, scene + 4 + 5 + 4] {
            refused(place, &length.to_le_bytes());
        }
    }
}

/// Headers that promise more than any machine holds cost nothing but the refusal.
#[test]
fn absurd_sizes_are_refused_before_they_are_taken() {
    let good = bytes_of(&part(3, 5, 9));
    let bytes = changed(&good, VERSION, |header| {
        header[12..20].fill(0xff);
    });
    assert_eq!(
        Part::new(&bytes[..], Some(bytes.len() as u64)).err(),
        Some(damaged())
    );
    // Of a pipe nobody knows the length.
    let error = read_as(&bytes, None).expect_err("it fits no memory");
    assert!(
        error.contains("fits no memory") || error == damaged(),
        "{error}"
    );
}
