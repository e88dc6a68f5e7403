//! What is in a `.usdz` file. USD has its pictures and layers in a zip archive as they are, not compressed, so a file of
//! it is a part of the archive: nothing grows when it is read.

use std::ops::Range;

/// An archive ends with a record of this mark, and at most so many bytes of a comment after it.
const END: [u8; 4] = *b"PK\x05\x06";
const LONGEST_COMMENT: usize = 0xffff;
const END_LENGTH: usize = 22;

/// Each file has a record in the directory, and one before its bytes.
const ENTRY: [u8; 4] = *b"PK\x01\x02";
const ENTRY_LENGTH: usize = 46;
const LOCAL: [u8; 4] = *b"PK\x03\x04";
const LOCAL_LENGTH: usize = 30;

/// The files of an archive: their names and where their bytes are, in its order.
pub(super) fn files(bytes: &[u8]) -> Result<Vec<(String, Range<usize>)>, String> {
    let damaged = || "the archive is damaged".to_owned();
    let none = "it is no zip archive, or is cut off";
    let last = bytes.len().checked_sub(END_LENGTH).ok_or(none)?;
    let first = last.saturating_sub(LONGEST_COMMENT);
    let end = (first..=last)
        .rev()
        .find(|at| bytes[*at..].starts_with(&END));
    let end = end.ok_or(none)?;
    let count = number(bytes, end + 10, 2).ok_or_else(damaged)?;
    let mut at = number(bytes, end + 16, 4).ok_or_else(damaged)?;
    let mut files = Vec::new();
    for _ in 0..count {
        let entry = bytes.get(at..).filter(|rest| rest.starts_with(&ENTRY));
        let entry = entry.ok_or_else(damaged)?;
        let field = |from: usize, length: usize| number(entry, from, length).ok_or_else(damaged);
        let (flags, method) = (field(8, 2)?, field(10, 2)?);
        let (packed, length, local) = (field(20, 4)?, field(24, 4)?, field(42, 4)?);
        let (name, extra, comment) = (field(28, 2)?, field(30, 2)?, field(32, 2)?);
        let written = entry
            .get(ENTRY_LENGTH..ENTRY_LENGTH + name)
            .ok_or_else(damaged)?;
        let written = String::from_utf8_lossy(written).into_owned();
        at += ENTRY_LENGTH + name + extra + comment;
        if written.ends_with('/') {
            continue;
        }
        if method != 0 || packed != length || flags & 1 != 0 {
            return Err(format!(
                "`{written}` in it is compressed or encrypted, which USD does not allow"
            ));
        }
        let head = bytes.get(local..).filter(|rest| rest.starts_with(&LOCAL));
        let head = head.ok_or_else(damaged)?;
        let before = |from: usize| number(head, from, 2).ok_or_else(damaged);
        let start = local + LOCAL_LENGTH + before(26)? + before(28)?;
        let end = start.checked_add(length).filter(|end| *end <= bytes.len());
        files.push((written, start..end.ok_or_else(damaged)?));
    }
    Ok(files)
}

/// The layer that an archive shows: the first of its files, if that is one.
pub(super) fn shown(files: &[(String, Range<usize>)]) -> Option<&str> {
    let (name, _) = files.first()?;
    let (_, extension) = name.rsplit_once('.')?;
    let is_layer = ["usd", "usda", "usdc"]
        .iter()
        .any(|e| extension.eq_ignore_ascii_case(e));
    is_layer.then_some(name)
}

/// A number of so many bytes, the lowest first.
fn number(bytes: &[u8], from: usize, length: usize) -> Option<usize> {
    let digits = bytes.get(from..from.checked_add(length)?)?;
    Some(
        digits
            .iter()
            .rev()
            .fold(0, |sum, digit| sum << 8 | usize::from(*digit)),
    )
}
