//! How long files take to read: one of many meshes and pictures, one mesh beside the same as OBJ, and many nodes.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::{packed, save};
use crate::input;
use crate::scene::formats::{FORMATS, Geometry};
use crate::world;

#[test]
#[ignore = "a measurement, of a minute"]
fn speed() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    many_members(folder);
    beside_obj(folder);
    many_nodes(folder, 100_000);
    many_nodes(folder, 1_000_000);
}

fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begin = Instant::now();
    let made = work();
    (begin.elapsed().as_secs_f64(), made)
}

/// 1,000 meshes of 200 triangles, and 200 pictures of 100 KB, which nobody decodes.
fn many_members(folder: &Path) {
    let (meshes, pictures) = (1000, 200);
    let mut parts = Parts::default();
    let primitive = parts.grid(10);
    let mut all = vec![json!({ "primitives": [primitive] })];
    for _ in 1..meshes {
        let primitive = parts.grid(10);
        all.push(json!({ "primitives": [primitive] }));
    }
    let picture = vec![7; 100_000];
    let images: Vec<Value> = (0..pictures)
        .map(|_| json!({ "bufferView": parts.view(&picture), "mimeType": "image/png" }))
        .collect();
    let node = |m: usize| json!({ "mesh": m, "translation": [m, 0, 0] });
    let nodes: Vec<Value> = (0..meshes).map(node).collect();
    let path = folder.join("many.glb");
    let file = parts.file(json!({ "meshes": all, "images": images, "nodes": nodes }));
    save(&path, &file, 60);
    let (scene, loaded) = seconds(|| world::load(&path));
    assert_eq!(loaded.expect("it loads").mesh.len(), 200 * meshes);
    let (looked_at, ()) = seconds(|| {
        for number in 0..pictures {
            let bytes = input::read(&path.join(format!("images/{number}")));
            assert_eq!(bytes.expect("a picture").len(), picture.len());
        }
    });
    let megabytes = file.len() as f64 / 1e6;
    eprintln!(
        "{megabytes:.0} MB of {meshes} meshes and {pictures} pictures: {scene:.3} s and {looked_at:.3} s"
    );
}

/// A million triangles with normals and texture coordinates.
fn beside_obj(folder: &Path) {
    let cells = 707;
    let mut parts = Parts::default();
    let primitive = parts.grid(cells);
    let file =
        parts.file(json!({ "meshes": [{ "primitives": [primitive] }], "nodes": [{ "mesh": 0 }] }));
    save(&folder.join("grid.glb"), &file, 60);
    let mut text = String::new();
    let (corners, triangles) = grid(cells);
    for [x, y] in &corners {
        let _ = writeln!(text, "v {x} {y} 0.5\nvt {x} {y}\nvn 0 0 1");
    }
    for corners in &triangles {
        let [a, b, c] = corners.map(|i| i + 1);
        let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
    }
    save(&folder.join("grid.obj"), text.as_bytes(), 60);
    let read = |name: &str| -> (f64, Geometry) {
        let extension = name.rsplit('.').next().unwrap_or_default();
        let format = FORMATS.iter().find(|f| f.extensions.contains(&extension));
        let format = format.expect("a row");
        let mut runs: Vec<_> = (0..5)
            .map(|_| seconds(|| (format.read)(folder, name, 0.0).expect("it is read")))
            .collect();
        runs.sort_by(|a, b| a.0.total_cmp(&b.0));
        runs.swap_remove(2)
    };
    let (obj, of_obj) = read("grid.obj");
    let (glb, of_glb) = read("grid.glb");
    assert_eq!(of_obj.triangles.len(), of_glb.triangles.len());
    let (count, share) = (of_glb.triangles.len(), glb / obj);
    eprintln!("{count} triangles: OBJ {obj:.3} s, glTF {glb:.3} s, {share:.3} of it");
}

/// Nodes that show one mesh, each hundred of them the children of one, in a file without scenes.
fn many_nodes(folder: &Path, count: usize) {
    let mut parts = Parts::default();
    let primitive = parts.grid(1);
    let node = |i: usize| {
        let mut node = json!({ "mesh": 0, "translation": [i % 1000, i / 1000, 0] });
        if i.is_multiple_of(100) {
            node["children"] = (i + 1..i + 100).collect();
        }
        node
    };
    let nodes: Vec<Value> = (0..count).map(node).collect();
    let path = folder.join("nodes.glb");
    let file = parts.file(json!({ "meshes": [{ "primitives": [primitive] }], "nodes": nodes }));
    save(&path, &file, 60);
    let (scene, text) = seconds(|| input::read(&path.join("scene.toml")));
    let length = text.expect("a scene").len();
    let (whole, loaded) = seconds(|| world::load(&path));
    let loaded = loaded.expect("it loads");
    assert!(loaded.mesh.len() == 2 * count || loaded.placements.len() == count);
    eprintln!("{count} nodes: text of {length} bytes {scene:.3} s, scene {whole:.3} s");
}

/// Corners and triangles of a square of so many cells a side.
fn grid(cells: usize) -> (Vec<[f32; 2]>, Vec<[u32; 3]>) {
    let side = cells + 1;
    let at = |i: usize| i as f32 / cells as f32;
    let corners = (0..side * side).map(|i| [at(i % side), at(i / side)]);
    let triangles = (0..cells * cells).flat_map(|i| {
        let first = (i / cells * side + i % cells) as u32;
        let above = first + side as u32;
        [[first, first + 1, above + 1], [first, above + 1, above]]
    });
    (corners.collect(), triangles.collect())
}

/// A file under way.
#[derive(Default)]
pub(in crate::input::gltf) struct Parts {
    views: Vec<Value>,
    accessors: Vec<Value>,
    binary: Vec<u8>,
}

impl Parts {
    fn view(&mut self, bytes: &[u8]) -> usize {
        let view =
            json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// An accessor of floats, so many an element.
    pub(in crate::input::gltf) fn floats(&mut self, numbers: &[f32], width: usize) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let kind = match width {
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            16 => "MAT4",
            _ => "SCALAR",
        };
        self.accessor(&bytes, 5126, numbers.len() / width, kind)
    }

    pub(in crate::input::gltf) fn accessor(
        &mut self,
        bytes: &[u8],
        component: usize,
        count: usize,
        kind: &str,
    ) -> usize {
        let view = self.view(bytes);
        let mut accessor = json!({ "bufferView": view, "componentType": component, "count": count,
                                   "type": kind });
        if kind == "VEC3" {
            accessor["min"] = json!([0, 0, 0]);
            accessor["max"] = json!([1, 1, 1]);
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// A primitive of a square of so many cells a side.
    fn grid(&mut self, cells: usize) -> Value {
        let (corners, triangles) = grid(cells);

        let places: Vec<f32> = corners.iter().flat_map(|[x, y]| [*x, *y, 0.5]).collect();
        let normals = [0.0, 0.0, 1.0].repeat(corners.len());
        let indices: Vec<u8> = triangles
            .iter()
            .flatten()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        json!({ "attributes": {
                "POSITION": self.floats(&places, 3),
                "NORMAL": self.floats(&normals, 3),
                "TEXCOORD_0": self.floats(corners.as_flattened(), 2) },
            "indices": self.accessor(&indices, 5125, 3 * triangles.len(), "SCALAR") })
    }

    /// The whole file, with what `json` has beside.
    pub(in crate::input::gltf) fn file(self, mut json: Value) -> Vec<u8> {
        json["asset"] = json!({ "version": "2.0" });
        json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        json["bufferViews"] = self.views.into();
        json["accessors"] = self.accessors.into();
        packed(&json, &self.binary)
    }
}
