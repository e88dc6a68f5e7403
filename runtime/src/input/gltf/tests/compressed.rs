//! Files that meshopt and Draco compressed are those that they were before, and no byte of them is trusted either.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer,
};
use serde_json::{Value, json};

use super::super::packed::{DRACO, MESHOPT};
use super::{file_of, geometry_of, packed, read, square};

/// The square with its views compressed by meshopt.
fn by_meshopt() -> (Value, Vec<u8>) {
    let (mut json, binary) = square();
    let mut workspace = Workspace::default();
    let version = VertexEncoding::new(0, 0).expect("the version of the extension");
    let mut attribute = |bytes: &[u8], stride| {
        encode_vertex_buffer(bytes, 4, stride, version, &mut workspace).expect("it is packed")
    };
    let positions = attribute(&binary[..48], 12);
    let uvs = attribute(&binary[48..80], 8);
    let indices = encode_index_buffer(&[0, 1, 2, 0, 2, 3], IndexEncoding::DEFAULT, &mut workspace);
    let views = [
        (positions, 12, 4, "ATTRIBUTES"),
        (uvs, 8, 4, "ATTRIBUTES"),
        (indices.expect("it is packed"), 2, 6, "TRIANGLES"),
    ];
    let mut bytes = Vec::new();
    for (number, (own, stride, count, mode)) in views.into_iter().enumerate() {
        json["bufferViews"][number] = json!({
            "buffer": 1, "byteOffset": 0, "byteLength": stride * count,
            "extensions": { MESHOPT: { "buffer": 0, "byteOffset": bytes.len(), "byteLength": own.len(),
                "byteStride": stride, "count": count, "mode": mode } },
        });
        bytes.extend(own);
    }
    json["buffers"] = json!([
        { "byteLength": bytes.len() },
        { "byteLength": 92, "extensions": { MESHOPT: { "fallback": true } } },
    ]);
    json["extensionsRequired"] = json!([MESHOPT]);
    (json, bytes)
}

/// The square's mesh as Draco has it, written by the encoder of `draco-core`: face by face with numbers as they are, and by
/// EdgeBreaker with numbers of 11 bits. Attribute 0 has places, and 1 texture coordinates.
const BY_DRACO: [&str; 2] = [
    "RFJBQ08CAgEAAAACBAEAAQIAAgMBAgAJAwAAAwkCAAEAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/\
     AACAPwAAgD8AAIA/AAAAAAAAAAAAAAAA",
    "RFJBQ08CAgEBAAAABAIBAgAAAR//ARH/AREC/wAAAAAAAQAJAwAAAgEDCQIAAQIBAQEAAwMBMAEQAwAogpgAAAAAAP8HAAAAAAAAAAAAAAAAAAAAAIA/CwEB\
     AQADAwEgASADAPCDpgAAAAAA/wcAAAAAAAAAAAAAAACAPws=",
];

/// The square with such a mesh for its triangles.
fn by_draco(mesh: &str) -> (Value, Vec<u8>) {
    let (mut json, _) = square();
    let bytes = STANDARD.decode(mesh).expect("base 64");
    for accessor in json["accessors"].as_array_mut().expect("a list") {
        accessor
            .as_object_mut()
            .expect("an object")
            .remove("bufferView");
    }
    json["meshes"][0]["primitives"][0]["extensions"] = json!({ DRACO: {
        "bufferView": 0, "attributes": { "POSITION": 0, "TEXCOORD_0": 1 },
    } });
    json["bufferViews"] = json!([{ "buffer": 0, "byteLength": bytes.len() }]);
    json["buffers"][0]["byteLength"] = bytes.len().into();
    json["extensionsRequired"] = json!([DRACO]);
    (json, bytes)
}

/// Compressed files of the square.
fn all() -> [(&'static str, (Value, Vec<u8>)); 3] {
    [
        ("meshopt", by_meshopt()),
        ("Draco", by_draco(BY_DRACO[0])),
        ("Draco's EdgeBreaker", by_draco(BY_DRACO[1])),
    ]
}

/// Triangles of a file by their corners, in an order of their own.
fn triangles(json: &Value, binary: &[u8]) -> Vec<String> {
    let geometry = geometry_of(packed(json, binary)).unwrap_or_else(|e| panic!("{e}"));
    let mut all: Vec<String> = geometry
        .triangles
        .iter()
        .map(|triangle| {
            // Either may begin with another corner.
            let mut corners: Vec<String> = (0..3)
                .map(|i| {
                    format!(
                        "{:?} {:?}",
                        triangle.positions[i],
                        triangle.uvs.map(|uvs| uvs[i])
                    )
                })
                .collect();
            let first = (0..3).min_by_key(|i| corners[*i].clone()).unwrap_or(0);
            corners.rotate_left(first);
            corners.join("; ")
        })
        .collect();
    all.sort();
    all
}

#[test]
fn compressed_files_are_those_that_they_were() {
    let (json, binary) = square();
    let expected = triangles(&json, &binary);
    for (name, (json, binary)) in all() {
        assert_eq!(triangles(&json, &binary), expected, "{name}");
    }
}

#[test]
fn what_is_damaged_in_them_is_told() {
    for (name, (json, binary)) in all() {
        // Any byte of another value gives an error or other numbers, and never a panic.
        let mut refused = 0;
        for at in 0..binary.len() {
            for value in [0, 0x80, 0xff] {
                let mut damaged = binary.clone();
                damaged[at] = value;
                let (_folder, path) = file_of(&packed(&json, &damaged));
                refused += u32::from(read(&path).is_err());
            }
        }
        assert!(refused > 0, "{name}");
        for length in 0..binary.len() {
            let mut shorter = json.clone();
            shorter["buffers"][0]["byteLength"] = length.into();
            let cut = geometry_of(packed(&shorter, &binary[..length]));
            assert!(cut.is_err(), "{name}: {length} of {}", binary.len());
        }
    }
    type Change<'a> = &'a dyn Fn(&mut Value);
    let meshopt: [(&str, Change); 4] = [
        (
            "`bufferViews[0].extensions.EXT_meshopt_compression`: `count`",
            &|own| {
                own["bufferViews"][0]["extensions"][MESHOPT]["count"] = 1_000_000_000.into();
            },
        ),
        ("`mode` is missing or has no legal value", &|own| {
            own["bufferViews"][0]["extensions"][MESHOPT]["mode"] = "NONE".into();
        }),
        (
            "view 1, which meshopt compressed, is damaged: there is no such buffer",
            &|own| {
                own["bufferViews"][1]["extensions"][MESHOPT]["buffer"] = 9.into();
            },
        ),
        ("view 2, which meshopt compressed, is damaged", &|own| {
            own["bufferViews"][2]["extensions"][MESHOPT]["byteLength"] = 3.into();
        }),
    ];
    let draco: [(&str, Change); 4] = [
        (
            "accessor 0 is attribute 7 of Draco's mesh, which has none",
            &|own| {
                own["meshes"][0]["primitives"][0]["extensions"][DRACO]["attributes"]["POSITION"] =
                    7.into();
            },
        ),
        ("`bufferView` is missing or has no legal value", &|own| {
            own["meshes"][0]["primitives"][0]["extensions"][DRACO]["bufferView"] = 7.into();
        }),
        ("accessor 0 has 4000 elements, and Draco's mesh 4", &|own| {
            own["accessors"][0]["count"] = 4000.into();
        }),
        ("accessor 1 has not as many components", &|own| {
            own["meshes"][0]["primitives"][0]["extensions"][DRACO]["attributes"]["TEXCOORD_0"] =
                0.into();
        }),
    ];
    for ((json, binary), cases) in [(by_meshopt(), meshopt), (by_draco(BY_DRACO[0]), draco)] {
        for (expected, change) in cases {
            let mut json = json.clone();
            change(&mut json);
            let error = geometry_of(packed(&json, &binary))
                .expect_err(expected)
                .to_string();
            assert!(error.contains(expected), "{expected}: {error}");
        }
    }
}
