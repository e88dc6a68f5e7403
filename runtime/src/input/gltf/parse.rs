//! From a file to a [`Model`]: its JSON is read and checked, and where its binary part is is found.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use gltf::Semantic;
use gltf::json::validation::{Checked, Error as Invalid, Validate};
use serde_json::Value;

use super::motion::Motion;
use super::packed::{DRACO, MESHOPT, Packed};
use super::{Choice, Model, material, unreadable};
use crate::error::SceneError;
use crate::input::stamp::Stamp;

/// Extensions that a file may require: what they ask for is done.
const KNOWN: &[&str] = &[
    MESHOPT,
    "EXT_texture_webp",
    DRACO,
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    VARIANTS,
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

const VARIANTS: &str = "KHR_materials_variants";

impl Model {
    /// Parses the file at `path`, of which this is the content, with what is chosen of it.
    ///
    /// # Errors
    /// What is wrong with it, or there is nothing of the name that is chosen.
    pub(super) fn parse(
        path: &Path,
        mut file: File,
        stamp: Stamp,
        choice: &Choice,
    ) -> Result<Self, SceneError> {
        let wrong = |message: String| SceneError::in_file(path, message);
        let parts = parts(&mut file, stamp.length).map_err(|e| unreadable(path, &e))?;
        let Parts {
            text,
            binary,
            is_whole,
        } = parts.map_err(wrong)?;
        let damaged = |e: serde_json::Error| {
            let place = SceneError::in_file(path, format!("the glTF file is damaged: {e}"));
            if is_whole && e.line() > 0 {
                place.line(e.line())
            } else {
                place
            }
        };
        if text.iter().all(u8::is_ascii_whitespace) {
            return Err(wrong("the glTF file is empty".into()));
        }
        let mut json: Value = serde_json::from_slice(&text).map_err(damaged)?;
        let version = json["asset"]["version"].as_str().unwrap_or_default();
        if !version.starts_with("2.") {
            let found = if version.is_empty() {
                "no version"
            } else {
                version
            };
            return Err(wrong(format!("it is glTF of {found}"))
                .hint("glTF 2.0 is read; converters and Blender write it"));
        }
        let is_chosen =
            choose(&mut json, choice).map_err(|(message, hint)| wrong(message).hint(hint))?;
        let root: gltf::json::Root = if spell_out(&mut json) || is_chosen {
            serde_json::from_value(json.clone()).map_err(damaged)?
        } else {
            serde_json::from_slice(&text).map_err(damaged)?
        };
        check(path, &root)?;
        let motion = Motion::of(&root).map_err(wrong)?;
        let packed = Packed::of(&json).map_err(wrong)?;
        let materials = match json["materials"].take() {
            Value::Array(materials) => materials,
            _ => Vec::new(),
        };
        let document = gltf::Document::from_json_without_validation(root);
        let (material_names, source_names) = material::names(&document);
        let primitives = document.meshes().flat_map(|mesh| mesh.primitives());
        let colored = primitives.filter(|p| p.get(&gltf::Semantic::Colors(0)).is_some());
        let colored = colored.filter_map(|p| p.material().index()).collect();
        Ok(Self {
            path: path.to_owned(),
            stamp,
            choice: choice.clone(),
            document,
            materials,
            binary,
            material_names,
            source_names,
            colored,
            motion,
            packed,
        })
    }
}

/// Puts the animation that is chosen before all others, and gives primitives the materials of the variant that is.
/// Whether there was a choice; else an error and a hint.
fn choose(json: &mut Value, choice: &Choice) -> Result<bool, (String, String)> {
    if let Some(name) = &choice.animation {
        let number = chosen(&json["animations"], name, "animation")?;
        if let Some(Value::Array(animations)) = json.get_mut("animations") {
            animations[..=number].rotate_right(1);
        }
    }
    if let Some(name) = &choice.variant {
        let variants = &json["extensions"][VARIANTS]["variants"];
        let number = chosen(variants, name, "variant")?;
        let meshes = json.get_mut("meshes").and_then(Value::as_array_mut);
        let meshes = meshes.into_iter().flatten();
        let primitives = meshes.filter_map(|mesh| mesh.get_mut("primitives")?.as_array_mut());
        for primitive in primitives.flatten() {
            let mappings = primitive["extensions"][VARIANTS]["mappings"].as_array();
            let holds = |mapping: &&Value| {
                let variants = mapping["variants"].as_array();
                variants.is_some_and(|v| v.iter().any(|v| v.as_u64() == Some(number as u64)))
            };
            let own = mappings.into_iter().flatten().find(holds);
            if let Some(material) = own.map(|mapping| mapping["material"].clone()) {
                primitive["material"] = material;
            }
        }
    }
    Ok(*choice != Choice::default())
}

/// The number of what has that name or number in a list; else an error and a hint.
fn chosen(list: &Value, name: &str, what: &str) -> Result<usize, (String, String)> {
    let named = |item: &Value| item["name"].as_str().map(str::to_owned);
    let names: Vec<Option<String>> = list.as_array().into_iter().flatten().map(named).collect();
    let by_name = names.iter().position(|own| own.as_deref() == Some(name));
    let by_number = || name.parse().ok().filter(|number| *number < names.len());
    by_name.or_else(by_number).ok_or_else(|| {
        let shown = names.iter().enumerate();
        let shown = shown.map(|(number, name)| match name {
            Some(name) => format!("`{name}`"),
            None => number.to_string(),
        });
        let shown: Vec<String> = shown.collect();
        let hint = if shown.is_empty() {
            format!("it has no {what}s")
        } else {
            format!("there are {}", shown.join(", "))
        };
        (format!("the file has no {what} `{name}`"), hint)
    })
}

/// Makes what glTF allows and the crate does not know what it knows: scenes without nodes have none, channels that
/// move no node, as extensions have them, are left out, and textures that are WebP alone have that as their picture.
/// Whether there was any.
fn spell_out(json: &mut Value) -> bool {
    let list = |json: &mut Value, key: &str| match json.get_mut(key) {
        Some(Value::Array(items)) => std::mem::take(items),
        _ => Vec::new(),
    };
    let mut changed = false;
    let mut scenes = list(json, "scenes");
    for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
        changed |= !scene.contains_key("nodes");
        scene
            .entry("nodes")
            .or_insert_with(|| Value::Array(Vec::new()));
    }
    let mut animations = list(json, "animations");
    for animation in &mut animations {
        if let Some(Value::Array(channels)) = animation.get_mut("channels") {
            let count = channels.len();
            let moves_nothing = |target: &Value| target.is_object() && target["node"].is_null();
            channels.retain(|channel| !moves_nothing(&channel["target"]));
            changed |= channels.len() < count;
        }
    }
    let mut textures = list(json, "textures");
    for texture in &mut textures {
        let webp = texture
            .pointer("/extensions/EXT_texture_webp/source")
            .cloned();
        if let (Some(texture), Some(webp)) = (texture.as_object_mut(), webp)
            && !texture.contains_key("source")
        {
            texture.insert("source".into(), webp);
            changed = true;
        }
    }
    let all = [
        ("scenes", scenes),
        ("animations", animations),
        ("textures", textures),
    ];
    for (key, items) in all {
        if !items.is_empty() {
            json[key] = items.into();
        }
    }
    changed
}

/// The JSON of a file, and where its binary part is.
struct Parts {
    text: Vec<u8>,
    binary: Option<Range<u64>>,
    /// Is the JSON the whole file?
    is_whole: bool,
}

/// Reads the JSON of a file of so many bytes; what is wrong with a `.glb`, in words.
fn parts(file: &mut File, has: u64) -> io::Result<Result<Parts, String>> {
    let mut head = Vec::new();
    file.by_ref().take(HEAD).read_to_end(&mut head)?;
    if !head.starts_with(b"glTF") {
        file.read_to_end(&mut head)?;
        return Ok(Ok(Parts {
            text: head,
            binary: None,
            is_whole: true,
        }));
    }
    let cut = || Ok(Err("the .glb file is cut off".to_owned()));
    let (Some(version), Some(length)) = (word(&head, 4), word(&head, 8)) else {
        return cut();
    };
    if version != 2 {
        return Ok(Err(format!("it is glTF {version}, and 2 is read")));
    }
    if length > has {
        return Ok(Err(format!(
            "the .glb file is cut off: it has {has} of {length} bytes"
        )));
    }
    let (mut text, mut binary) = (None, None);
    let mut at = HEAD;
    while at + CHUNK <= length {
        let mut head = [0; CHUNK as usize];
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut head)?;
        let size = word(&head, 0).unwrap_or(0);
        let content = at + CHUNK..at + CHUNK + size;
        if content.end > has {
            return cut();
        }
        match &head[4..] {
            b"JSON" if text.is_none() => {
                let mut bytes = Vec::new();
                file.by_ref().take(size).read_to_end(&mut bytes)?;
                text = Some(bytes);
            }
            b"BIN\0" if binary.is_none() => binary = Some(content.clone()),
            _ => {}
        }
        at = content.end;
    }
    let missing = || "the .glb file has no JSON part".to_owned();
    Ok(text.ok_or_else(missing).map(|text| Parts {
        text,
        binary,
        is_whole: false,
    }))
}

/// Bytes of the head of a `.glb`, and of that of one of its parts.
const HEAD: u64 = 12;
const CHUNK: u64 = 8;

fn word(bytes: &[u8], at: usize) -> Option<u64> {
    let four = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes(four.try_into().ok()?).into())
}

/// Fails where an index leads nowhere, something is missing, or an extension is required that nobody here knows.
fn check(path: &Path, root: &gltf::json::Root) -> Result<(), SceneError> {
    let unknown = |name: &&String| !KNOWN.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().find(unknown) {
        return Err(SceneError::in_file(
            path,
            format!("the file requires the extension `{name}`, which is not read"),
        )
        .hint(format!("export it without; there are {}", KNOWN.join(", "))));
    }
    let mut first = None;
    let mut report = |place: &dyn Fn() -> gltf::json::Path, what: Invalid| {
        if first.is_some() || what == Invalid::Unsupported {
            return;
        }
        let place = place().to_string();
        // An accessor without a view is zeros, or compressed, which the crate does not know.
        let is_zeros = place.starts_with("accessors[") && place.ends_with("].bufferView");
        if !(is_zeros && what == Invalid::Missing) {
            first = Some((place, what));
        }
    };
    // The crate looks at the accessors of positions before it checks that they are there.
    let lost = |p: &gltf::json::mesh::Primitive| {
        let places = p.attributes.get(&Checked::Valid(Semantic::Positions));
        places.is_some_and(|accessor| accessor.value() >= root.accessors.len())
    };
    for (mesh, number) in root.meshes.iter().zip(0..) {
        if let Some(place) = mesh.primitives.iter().position(lost) {
            return Err(SceneError::in_file(
                path,
                format!(
                    "the glTF file is damaged: `meshes[{number}].primitives[{place}].attributes[\"POSITION\"]` \
                     leads to something that is not there"
                ),
            ));
        }
    }
    root.validate(root, gltf::json::Path::new, &mut report);
    let Some((place, what)) = first else {
        return Ok(());
    };
    let what = match what {
        Invalid::IndexOutOfBounds => "leads to something that is not there",
        Invalid::Missing => "is missing",
        Invalid::Oversize => "is too large",
        Invalid::Invalid | Invalid::Unsupported => "has no legal value",
    };
    Err(SceneError::in_file(
        path,
        format!("the glTF file is damaged: `{place}` {what}"),
    ))
}
