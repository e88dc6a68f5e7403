//! Animations, skins and morph targets, beside answers that one can work out.

use glam::DVec3;
use serde_json::{Value, json};

use super::super::tests::speed::Parts;
use super::super::tests::{file_of, read_at};
use crate::error::SceneError;
use crate::scene::formats::{FORMATS, Geometry};
use crate::scene::{Asked, Scene};
use crate::world;

/// A file with one triangle as mesh 0, to which tests add.
struct File {
    parts: Parts,
    json: Value,
}

impl File {
    fn new() -> Self {
        let mut parts = Parts::default();
        let positions = parts.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.], 3);
        let json = json!({
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": positions } }] }],
            "nodes": [{ "mesh": 0 }],
            "scenes": [{ "nodes": [0] }],
        });
        Self { parts, json }
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
    }

    /// Adds a channel that moves something of a node.
    fn moved(
        &mut self,
        node: usize,
        path: &str,
        how: &str,
        times: &[f32],
        values: [usize; 2],
        numbers: &[f32],
    ) {
        let input = self.parts.floats(times, 1);
        let [width, _] = values;
        let output = self.parts.floats(numbers, width);
        if self.json["animations"].is_null() {
            self.json["animations"] = json!([{ "name": "walk", "samplers": [], "channels": [] }]);
        }
        let animation = &mut self.json["animations"][0];
        let samplers = animation["samplers"].as_array_mut().expect("samplers");
        samplers.push(json!({ "input": input, "output": output, "interpolation": how }));
        let sampler = samplers.len() - 1;
        let channels = animation["channels"].as_array_mut().expect("channels");
        channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }

    fn at(self, seconds: f64) -> Result<Geometry, SceneError> {
        let (_folder, path) = file_of(&self.parts.file(self.json));
        read_at(&path, seconds)
    }

    #[track_caller]
    fn corners_at(self, seconds: f64) -> Vec<DVec3> {
        let geometry = self.at(seconds).unwrap_or_else(|e| panic!("{e}"));
        geometry
            .triangles
            .iter()
            .flat_map(|t| t.positions)
            .collect()
    }

    #[track_caller]
    fn error(self) -> String {
        self.at(0.5).expect_err("it is damaged").to_string()
    }
}

#[track_caller]
fn assert_near(found: DVec3, expected: [f64; 3]) {
    let expected = DVec3::from(expected);
    assert!(found.distance(expected) < 1e-6, "{found}, not {expected}");
}

const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;

#[test]
fn another_animation_is_shown_from_its_folder() {
    let mut file = File::new();
    let mut animations = Vec::new();
    for (name, end) in [("walk", [1., 0., 0.]), ("run", [0., 3., 0.])] {
        file.json["animations"] = Value::Null;
        let [x, y, z] = end;
        let keys = [0., 0., 0., x, y, z];
        file.moved(0, "translation", "LINEAR", &[0.0, 1.0], [3, 0], &keys);
        let mut own = file.json["animations"][0].take();
        own["name"] = name.into();
        animations.push(own);
    }
    file.json["animations"] = animations.into();
    let (folder, _path) = file_of(&file.parts.file(file.json));
    let format = FORMATS.iter().find(|f| f.name == "glTF").expect("a row");
    for (member, expected) in [
        ("meshes.gltf", [1.0, 0.0, 0.0]),
        ("animations/walk/meshes.gltf", [1.0, 0.0, 0.0]),
        ("animations/run/nodes/0.gltf", [0.0, 3.0, 0.0]),
        ("animations/1/meshes.gltf", [0.0, 3.0, 0.0]),
    ] {
        let read = (format.read)(folder.path(), &format!("m.glb/{member}"), 1.0);
        let read = read.unwrap_or_else(|e| panic!("{member}: {e}"));
        assert_near(read.triangles[0].positions[0], expected);
    }
}

#[test]
fn nodes_move_as_their_keys_say() {
    let moved = |how: &str, numbers: &[f32], seconds: f64| {
        let mut file = File::new();
        file.moved(0, "translation", how, &[1.0, 3.0], [3, 0], numbers);
        file.corners_at(seconds)[0]
    };
    let plain = [0., 0., 0., 4., 0., 8.];
    for (seconds, expected) in [
        (0.0, [0., 0., 0.]),
        (1.5, [1., 0., 2.]),
        (3.0, [4., 0., 8.]),
        (9.0, [4., 0., 8.]),
    ] {
        assert_near(moved("LINEAR", &plain, seconds), expected);
    }
    assert_near(moved("STEP", &plain, 2.9), [0., 0., 0.]);
    assert_near(moved("STEP", &plain, 3.0), [4., 0., 8.]);
    // Each key has the slope before it, its value, and the slope after it. Between them is 2 s.
    let cubic = [
        0., 0., 0., 1., 0., 0., 0.5, 0., 0., -1., 0., 0., 3., 0., 0., 0., 0., 0.,
    ];
    // By hand at a half: 0.5 (1 + 3) + 2 (0.125 * 0.5 - 0.125 * -1).
    assert_near(moved("CUBICSPLINE", &cubic, 2.0), [2.375, 0., 0.]);
    assert_near(moved("CUBICSPLINE", &cubic, 0.5), [1., 0., 0.]);
}

#[test]
fn animations_of_other_nodes_are_shown_together() {
    let mut file = File::new();
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    for (node, to) in [(0, 1.0), (1, 2.0), (1, 9.0)] {
        let key = [0., 0., to];
        file.moved(node, "translation", "STEP", &[0.0], [3, 0], &key);
    }
    // Each channel is an animation of its own: the first, one of another object, and another take of that.
    let animation = file.json["animations"][0].clone();
    let alone =
        |channel: &Value| json!({ "samplers": animation["samplers"], "channels": [channel] });
    let channels = animation["channels"].as_array().expect("channels");
    file.json["animations"] = channels.iter().map(alone).collect();
    let corners = file.corners_at(0.0);
    assert_near(corners[0], [0., 0., 1.]);
    assert_near(corners[3], [0., 0., 2.]);
}

#[test]
fn turns_take_the_short_way_and_scales_stay_within() {
    // A quarter about z, the second key with the other sign, which is the same turn.
    let mut file = File::new();
    let keys = [0., 0., 0., 1., 0., 0., -HALF, -HALF];
    file.moved(0, "rotation", "LINEAR", &[0.0, 1.0], [4, 0], &keys);
    file.json["nodes"][0]["scale"] = json!([2.0, 1.0, 1.0]);
    let third = std::f64::consts::FRAC_PI_6;
    let corners = file.corners_at(1.0 / 3.0);
    assert_near(corners[1], [2.0 * third.cos(), 2.0 * third.sin(), 0.0]);
    assert_near(corners[2], [-third.sin(), third.cos(), 0.0]);
    // A child is where its parent is, and turns of four zeros are none.
    let mut file = File::new();
    file.json["nodes"] = json!([{ "children": [1], "translation": [0, 5, 0] }, { "mesh": 0 }]);
    file.moved(
        0,
        "scale",
        "LINEAR",
        &[0.0, 2.0],
        [3, 0],
        &[1., 1., 1., 3., 1., 1.],
    );
    file.moved(1, "rotation", "STEP", &[0.0], [4, 0], &[0.; 4]);
    assert_near(file.corners_at(1.0)[1], [2.0, 5.0, 0.0]);
}

/// Two joints, of which the second is a quarter turned about z at (0, 2, 0), with inverse matrices or without.
fn skinned(weights: [[f32; 2]; 3], inverses: Option<usize>) -> File {
    let mut file = File::new();
    let joints: Vec<u8> = [[0u8, 1, 0, 0]; 3].concat();
    let joints = file.parts.accessor(&joints, 5121, 3, "VEC4");
    file.attribute("JOINTS_0", joints);
    let four: Vec<f32> = weights.iter().flat_map(|[a, b]| [*a, *b, 0., 0.]).collect();
    let weights = file.parts.floats(&four, 4);
    file.attribute("WEIGHTS_0", weights);
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
        { "children": [2] },
        { "translation": [0, 2, 0], "rotation": [0, 0, HALF, HALF] },
    ]);
    file.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    file.json["skins"] = json!([{ "joints": [1, 2] }]);
    if let Some(count) = inverses {
        // The second undoes a move by (0, 2, 0).
        let mut numbers = Vec::new();
        for joint in 0..count {
            let up = if joint == 1 { -2.0 } else { 0.0 };
            numbers.extend([
                1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., up, 0., 1.,
            ]);
        }
        file.json["skins"][0]["inverseBindMatrices"] = file.parts.floats(&numbers, 16).into();
    }
    file
}

#[test]
fn skins_follow_their_joints_and_not_their_node() {
    let corners = skinned([[1., 0.], [0., 1.], [0.5, 0.5]], None).corners_at(0.0);
    assert_near(corners[0], [0., 0., 0.]);
    assert_near(corners[1], [0., 3., 0.]);
    // Half of (0, 1, 0), and half of where the turned joint puts it, (-1, 2, 0).
    assert_near(corners[2], [-0.5, 1.5, 0.]);
    let corners = skinned([[0., 1.]; 3], Some(2)).corners_at(0.0);
    assert_near(corners[0], [2., 2., 0.]);
    // Weights that are no shares of one are made so, and what has none follows the first joint.
    let corners = skinned([[0.25, 0.25], [0., 3.], [0., 0.]], None).corners_at(0.0);
    assert_near(corners[0], [0., 1., 0.]);
    assert_near(corners[1], [0., 3., 0.]);
    assert_near(corners[2], [0., 1., 0.]);
}

#[test]
fn joints_may_flatten_and_mirror() {
    let mut file = skinned([[1., 0.]; 3], None);
    let normals = file.parts.floats(&[0., 0., 1., 0., 0., 1., 0., 0., 1.], 3);
    file.attribute("NORMAL", normals);
    file.json["nodes"][1]["scale"] = json!([1, 1, 0]);
    let geometry = file.at(0.0).unwrap_or_else(|e| panic!("{e}"));
    let [triangle] = &geometry.triangles[..] else {
        panic!("one triangle")
    };
    assert_eq!(
        triangle.normals.map(|n| n[0].to_array()),
        Some([0., 0., 1.])
    );
    let mut file = skinned([[1., 0.]; 3], None);
    file.json["nodes"][1]["scale"] = json!([-1, 1, 1]);
    let corners = file.corners_at(0.0);
    // The corners go around the other way, so that the outside stays outside.
    assert_eq!(corners, [DVec3::ZERO, DVec3::Y, DVec3::NEG_X]);
    let mut file = skinned([[1., 0.]; 3], None);
    file.json["nodes"][1]["scale"] = json!([0, 0, 0]);
    assert_eq!(file.corners_at(0.0), [DVec3::ZERO; 3]);
}

fn morphed() -> File {
    let mut file = File::new();
    let up = file.parts.floats(&[0., 0., 1., 0., 0., 2., 0., 0., 3.], 3);
    let out = file.parts.floats(&[1., 0., 0., 1., 0., 0., 1., 0., 0.], 3);
    file.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{ "POSITION": up }, { "POSITION": out }]);
    file
}

#[test]
fn morph_targets_add_up() {
    assert_near(morphed().corners_at(0.0)[1], [1., 0., 0.]);
    let mut file = morphed();
    file.json["meshes"][0]["weights"] = json!([0.5, 2.0]);
    assert_near(file.corners_at(0.0)[1], [3., 0., 1.]);
    // A node's weights are in place of the mesh's, and an animation's of both.
    let mut file = morphed();
    file.json["meshes"][0]["weights"] = json!([0.5, 2.0]);
    file.json["nodes"][0]["weights"] = json!([1.0, 0.0]);
    assert_near(file.corners_at(0.0)[2], [0., 1., 3.]);
    let animated = |seconds| {
        let mut file = morphed();
        file.json["nodes"][0]["weights"] = json!([1.0, 0.0]);
        file.moved(
            0,
            "weights",
            "LINEAR",
            &[0.0, 2.0],
            [1, 0],
            &[0., 0., 1., 4.],
        );
        file.corners_at(seconds)[0]
    };
    assert_near(animated(0.0), [0., 0., 0.]);
    assert_near(animated(1.0), [2., 0., 0.5]);
    assert_near(animated(2.0), [4., 0., 1.]);
}

#[test]
fn damaged_motion_is_told() {
    let channel = |times: &[f32], numbers: &[f32], how: &str| {
        let mut file = File::new();
        file.moved(0, "translation", how, times, [3, 0], numbers);
        file.error()
    };
    let six = [0.; 6];
    for (error, expected) in [
        (
            channel(&[0., 1., 2.], &six, "LINEAR"),
            "sampler 0 of animation `walk` has 6 numbers for 3 keys of 3",
        ),
        (
            channel(&[0., 1.], &six, "CUBICSPLINE"),
            "has 6 numbers for 2 keys of 9",
        ),
        (
            channel(&[1., 0.], &six, "LINEAR"),
            "has key 1 before the one before it",
        ),
        (
            channel(&[0., f32::NAN], &six, "LINEAR"),
            "has a value that is no number",
        ),
        (
            channel(&[0., 1.], &[0., 0., 0., 0., 0., f32::INFINITY], "STEP"),
            "has a value that is no number",
        ),
    ] {
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let mut file = File::new();
    file.moved(99, "scale", "LINEAR", &[0.], [3, 0], &[1.; 3]);
    let error = file.error();
    assert!(
        error.contains("channel 0 of animation `walk` leads to something that is not there"),
        "{error}"
    );
    let error = skinned([[0., 1.]; 3], Some(1)).error();
    assert!(
        error.contains("skin 0 has 1 inverse matrices for 2 joints"),
        "{error}"
    );
    let mut file = skinned([[0., 1.]; 3], None);
    file.json["skins"][0]["joints"] = json!([1]);
    let error = file.error();
    assert!(error.contains("corner 0 has joint 1 of 1"), "{error}");
    let error = skinned([[0., -1.]; 3], None).error();
    assert!(
        error.contains("corner 0 has a weight that is no share"),
        "{error}"
    );
    let mut file = morphed();
    let short = file.parts.floats(&[0., 0., 1.], 3);
    file.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = short.into();
    file.json["meshes"][0]["weights"] = json!([1.0, 0.0]);
    let error = file.error();
    assert!(
        error.contains("morph target 0 has 1 corners, and the primitive 3"),
        "{error}"
    );
    // What extensions move is not moved.
    let mut file = File::new();
    file.moved(0, "translation", "LINEAR", &[0.], [3, 0], &[1.; 3]);
    file.json["animations"][0]["channels"][0]["target"] = json!({ "path": "pointer",
        "extensions": { "KHR_animation_pointer": { "pointer": "/nodes/0/scale" } } });
    assert_near(file.corners_at(0.0)[0], [0., 0., 0.]);
}

/// The scene of a file at a frame.
fn scene_at(file: File, frame: f64) -> Scene {
    let (_folder, path) = file_of(&file.parts.file(file.json));
    let scene = world::open(&path).unwrap_or_else(|e| panic!("{e}"));
    let asked = Asked {
        frame,
        ..Asked::default()
    };
    scene.scene(&asked).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn frames_of_a_scene_show_its_motion() {
    let still_and_moving = || {
        let mut file = File::new();
        file.json["nodes"] = json!([
            { "mesh": 0 },
            { "mesh": 0 },
            { "camera": 0, "translation": [0, 0, 9] },
        ]);
        file.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
        file.json["cameras"] =
            json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
        file.moved(
            1,
            "translation",
            "LINEAR",
            &[0.0, 2.0],
            [3, 0],
            &[0., 0., 1., 0., 48., 1.],
        );
        file.moved(
            2,
            "translation",
            "LINEAR",
            &[0.0, 2.0],
            [3, 0],
            &[0., 0., 9., 48., 0., 9.],
        );
        file
    };
    for frame in [0.0, 12.0, 12.5, 48.0, 60.0] {
        let scene = scene_at(still_and_moving(), frame);
        let shown = f64::min(frame, 48.0) as f32;
        let corner = scene.mesh.positions[1][0];
        assert!((corner.y - shown).abs() < 1e-4, "{frame}: {corner}");
        assert_eq!(scene.mesh.positions[0][0], glam::Vec3::ZERO);
        let camera = scene.camera;
        assert!(
            (camera.position.x - shown).abs() < 1e-4,
            "{frame}: {camera:?}"
        );
        assert!(
            (camera.look_at.x - shown).abs() < 1e-4,
            "{frame}: {camera:?}"
        );
    }
}
