//! Files that other programs write: MaterialX documents, and glTF files as text and as `.glb`.

use std::io;
use std::path::Path;

use super::kinds::{NUMBERS, Seeds, words};
use crate::Random;
use crate::mutate::{mutate, revalue, soup};

/// Words of MaterialX.
const MTLX: &[&str] = &[
    "<materialx version=\"1.39\">",
    "</materialx>",
    "<nodegraph name=\"g\">",
    "</nodegraph>",
    "<surfacematerial name=\"m\" type=\"material\">",
    "<input name=\"in\" type=\"float\" nodename=\"a\"/>",
    "<output name=\"out\" type=\"color3\" nodename=\"a\"/>",
    "<add name=\"a\" type=\"float\">",
    "<image name=\"a\" type=\"color3\"><input name=\"file\" type=\"filename\" value=\"../x.png\"/></image>",
    "<nodedef name=\"ND_a\" node=\"a\">",
    "<include href=\"m.mtlx\"/>",
    "<xi:include href=\"/dev/zero\"/>",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
    "&b;",
    "value=\"nan, inf\"",
    "value=\"\"",
    "type=\"matrix44\"",
    "type=\"BSDF\"",
    "interfacename=\"a\"",
    "nodegraph=\"g\"",
    "colorspace=\"acescg\"",
    "channels=\"xyzw\"",
    "\"",
    "<",
    ">",
    "/>",
];

/// Words of glTF.
const GLTF: &[&str] = &[
    "\"byteLength\": 4294967295",
    "\"byteOffset\": 3",
    "\"byteStride\": 1",
    "\"count\": 99999999",
    "\"componentType\": 5121",
    "\"type\": \"MAT4\"",
    "\"children\": [0]",
    "\"mesh\": 7",
    "\"mode\": 6",
    "\"indices\": 0",
    "\"sparse\": {}",
    "\"matrix\": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]",
    "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]",
    "\"uri\": \"../../m.bin\"",
    "\"uri\": \"m.gltf\"",
    "\"skin\": 0",
    "null",
    "{",
    "}",
    "[",
    "]",
    ",",
    "\"",
];

/// A triangle with a material, a camera and a light.
const TRIANGLE: &str = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0, 1, 2] }],
"nodes": [{ "mesh": 0, "scale": [1, 1, 1] }, { "camera": 0, "translation": [0, 0, 3] },
          { "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
"cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }],
"extensionsUsed": ["KHR_lights_punctual", "KHR_materials_ior"],
"extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 100 }] } },
"materials": [{ "name": "a", "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.2, 1], "metallicFactor": 0 },
                "alphaMode": "MASK", "alphaCutoff": 0.5, "extensions": { "KHR_materials_ior": { "ior": 1.4 } } }],
"meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0, "mode": 4 }] }],
"accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0],
                "max": [1, 1, 0] }, { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" }],
"bufferViews": [{ "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 6 }],
"buffers": [{ "byteLength": 42BUFFER }] }"#;

/// What the buffer of the triangle holds: three corners, and their indices.
fn buffer() -> Vec<u8> {
    let corners = [-1.0f32, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0];
    let corners = corners.iter().flat_map(|x| x.to_le_bytes());
    corners.chain([0, 0, 1, 0, 2, 0]).collect()
}

/// A document of the importer's tests with changes.
pub(super) fn document(
    seeds: &Seeds,
    random: &mut Random,
    folder: &Path,
) -> io::Result<Vec<String>> {
    let documents = &seeds.documents;
    let good = &documents[random.below(documents.len())];
    let text = match random.below(8) {
        0 => soup(random, MTLX, 40),
        1..5 => mutate(random, good, documents, MTLX),
        _ => revalue(random, good, NUMBERS),
    };
    std::fs::write(folder.join("m.mtlx"), text)?;
    let command = ["import m.mtlx --out made", "check m.mtlx", "cost m.mtlx"];
    Ok(words(command[random.below(command.len())]))
}

/// A glTF file with changes, its buffer beside it or within.
pub(super) fn gltf(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let is_binary = random.below(2) == 0;
    let beside = if is_binary {
        ""
    } else {
        ", \"uri\": \"m.bin\""
    };
    let good = TRIANGLE.replace("BUFFER", beside).into_bytes();
    let text = match random.below(8) {
        0 => [
            b"{ \"asset\": { \"version\": \"2.0\" }, ".as_slice(),
            &soup(random, GLTF, 40),
        ]
        .concat(),
        1..5 => mutate(random, &good, std::slice::from_ref(&good), GLTF),
        _ => revalue(random, &good, NUMBERS),
    };
    let name = if is_binary { "m.glb" } else { "m.gltf" };
    if is_binary {
        let file = binary(text);
        let file = match random.below(3) {
            0 => mutate(
                random,
                &file,
                std::slice::from_ref(&file),
                &["BIN\0", "JSON", "glTF"],
            ),
            _ => file,
        };
        std::fs::write(folder.join(name), file)?;
    } else {
        std::fs::write(folder.join(name), text)?;
        std::fs::write(folder.join("m.bin"), buffer())?;
    }
    let command = ["check", "plan --needs", "import --out made"][random.below(3)];
    Ok(words(&format!("{command} {name}")))
}

/// A `.glb` of a text and the triangle's buffer.
fn binary(mut text: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut buffer = buffer();
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = word(28 + text.len() + buffer.len());
    let head = [b"glTF".as_slice(), &word(2), &length].concat();
    let parts = [(b"JSON", text), (b"BIN\0", buffer)];
    let part = |(kind, bytes): (&[u8; 4], Vec<u8>)| [&word(bytes.len())[..], kind, &bytes].concat();
    head.into_iter()
        .chain(parts.into_iter().flat_map(part))
        .collect()
}
