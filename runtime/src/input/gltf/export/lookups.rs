//! How a picture is named and looked up in glTF.

use impasto_compiler::abi::{FILTERS, WRAPS};
use impasto_compiler::instance::{Lookup, Place};
use serde_json::{Map, Value as Json, json};

use super::{numbers, short};

/// What kind of picture a file is by its name, if it is one that glTF has.
pub(super) fn picture_type(file: &str) -> Option<&'static str> {
    let (_, extension) = file.rsplit_once('.')?;
    match extension.to_ascii_lowercase().as_str() {
        "png" => Some("png"),
        "jpg" | "jpeg" => Some("jpeg"),
        _ => None,
    }
}

/// How a picture goes on and is filtered, where that is not the default; none if glTF has nothing like it.
#[allow(clippy::option_option)]
pub(super) fn sampler(lookup: &Lookup) -> Option<Option<Json>> {
    let mut sampler = Map::new();
    for (key, wrap) in ["wrapS", "wrapT"].into_iter().zip(lookup.wrap) {
        let mode = match *WRAPS.get(wrap)? {
            "REPEAT" => continue,
            "MIRROR" => 33648,
            "CLAMP" => 33071,
            _ => return None,
        };
        sampler.insert(key.into(), json!(mode));
    }
    match *FILTERS.get(lookup.filter)? {
        "BILINEAR" => {}
        "NEAREST" => {
            sampler.insert("magFilter".into(), json!(9728));
            sampler.insert("minFilter".into(), json!(9728));
        }
        _ => return None,
    }
    Some((!sampler.is_empty()).then_some(Json::Object(sampler)))
}

/// `KHR_texture_transform` of a place, where it is not the texture coordinates themselves; none if it is no offset,
/// rotation and scale. In glTF v goes down.
#[allow(clippy::option_option)]
pub(super) fn transform(place: &Place) -> Option<Option<Json>> {
    if place.matrix == Place::PLAIN && place.offset == [0.0; 2] {
        return Some(None);
    }
    let [[a, b], [d, e]] = place.matrix;
    let turn = if a == 0.0 && d == 0.0 {
        f64::atan2(-b, e)
    } else {
        f64::atan2(d, a)
    };
    // A picture that is mirrored along u is not turned by half.
    let turn = if d == 0.0 && a < 0.0 { 0.0 } else { turn };
    let (sin, cos) = turn.sin_cos();
    let scale = [a * cos + d * sin, e * cos - b * sin];
    let sheared = -b * cos - e * sin;
    if sheared.abs() > 1e-6 * (b.abs() + e.abs()).max(1e-6) {
        return None;
    }
    let offset = [b + place.offset[0], 1.0 - e - place.offset[1]];
    let mut transform = Map::new();
    if offset.iter().any(|x| (*x as f32) != 0.0) {
        transform.insert("offset".into(), numbers(&offset));
    }
    if turn as f32 != 0.0 {
        transform.insert("rotation".into(), short(turn));
    }
    if scale.iter().any(|x| (*x as f32) != 1.0) {
        transform.insert("scale".into(), numbers(&scale));
    }
    Some((!transform.is_empty()).then_some(Json::Object(transform)))
}

/// A relative path as a URI.
pub(super) fn uri(path: &str) -> String {
    use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
    const ESCAPED: &AsciiSet = &NON_ALPHANUMERIC
        .remove(b'/')
        .remove(b'.')
        .remove(b'-')
        .remove(b'_')
        .remove(b'~');
    utf8_percent_encode(path, ESCAPED).to_string()
}
