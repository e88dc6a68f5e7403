//! Writing film files, piece by piece.

use std::io::Write;
use std::path::Path;

use super::{FilmFile, MAGIC, PIECE, SAMPLER_BYTES, VERSION};
use crate::error::RuntimeError;
use crate::film::file::Range;
use crate::film::output;
use crate::fingerprint::Running;
use crate::technique::Choice;

impl FilmFile {
    /// Writes the file whole, or leaves what was there before.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RuntimeError> {
        let written = output::replace(path, |file| Ok(self.write_to(file)?));
        written.map_err(|why| why.at(path))
    }

    pub(super) fn write_to(&self, to: &mut impl Write) -> std::io::Result<()> {
        let mut fingerprint = Running::new();
        let mut put = |bytes: &[u8], with_fingerprint: bool| {
            fingerprint.add(bytes);
            to.write_all(bytes)?;
            if with_fingerprint {
                let sum = fingerprint.finish().to_le_bytes();
                fingerprint.add(&sum);
                to.write_all(&sum)?;
            }
            std::io::Result::Ok(())
        };
        let all = 0..self.sums.layers().planes();
        let has_words = |plane: &usize| self.sums.plane(*plane).iter().any(|word| *word != 0);
        let planes: Vec<usize> = all.filter(has_words).collect();
        put(&self.header(&planes), true)?;
        let mut piece = Vec::with_capacity(4 * PIECE);
        for plane in planes {
            for words in self.sums.plane(plane).chunks(PIECE) {
                piece.clear();
                piece.extend(words.iter().flat_map(|word| word.to_le_bytes()));
                put(&piece, false)?;
            }
        }
        put(&[], true)
    }

    /// Everything before the planes, of which some are there.
    fn header(&self, planes: &[usize]) -> Vec<u8> {
        let about = &self.about;
        let identity = &about.identity;
        let mut out = MAGIC.to_vec();
        let mut sampler = [0; SAMPLER_BYTES];
        for (to, from) in sampler.iter_mut().zip(identity.sampler.name().bytes()) {
            *to = from;
        }
        for word in [VERSION, identity.width, identity.height, identity.seed] {
            out.extend(word.to_le_bytes());
        }
        out.extend(sampler);
        for long in [identity.scene, about.nonfinite, about.clamped] {
            out.extend(long.to_le_bytes());
        }
        write_ranges(&mut out, &about.ranges);
        write_ranges(&mut out, &about.asked);
        write_text(&mut out, &about.scene);
        let layers = self.sums.layers();
        write_count(&mut out, layers.iter().count());
        for layer in layers.iter() {
            write_text(&mut out, &layer.name);
            write_count(&mut out, layer.names.len());
            let names = layer.names.iter();
            names.for_each(|name| write_text(&mut out, name));
        }
        write_count(&mut out, about.makers.len());
        for maker in &about.makers {
            for text in [&maker.device, &maker.backend, &maker.driver] {
                write_text(&mut out, text);
            }
        }
        let mut present = vec![0u32; layers.planes().div_ceil(32)];
        planes
            .iter()
            .for_each(|plane| present[plane / 32] |= 1 << (plane % 32));
        out.extend(present.iter().flat_map(|word| word.to_le_bytes()));
        out
    }
}

fn write_ranges(out: &mut Vec<u8>, ranges: &[Range]) {
    write_count(out, ranges.len());
    for range in ranges {
        out.extend(range.first.to_le_bytes());
        out.extend(range.count.to_le_bytes());
    }
}

fn write_count(out: &mut Vec<u8>, count: usize) {
    out.extend((count as u32).to_le_bytes());
}

/// A length in bytes, and the bytes.
fn write_text(out: &mut Vec<u8>, text: &str) {
    write_count(out, text.len());
    out.extend(text.as_bytes());
}
