//! Which prims are shown, where, from where and in which light.

use glam::DVec3;

use super::{Room, SQUARE, bounds, near};

#[test]
fn a_stage_is_brought_to_metres_with_y_up() {
    let head = "#usda 1.0\n(\n    metersPerUnit = 0.01\n    upAxis = \"Z\"\n)\n";
    let mesh = format!("def Mesh \"m\" {{ {SQUARE} }}").replace("(2, 2, 0)", "(2, 2, 100)");
    let geometry = Room::with("m.usda", format!("{head}{mesh}").as_bytes()).all();
    let [low, high] = bounds(&geometry);
    assert!(
        near(low, [0., 0., -0.02]) && near(high, [0.02, 1., 0.]),
        "{low} {high}"
    );
}

#[test]
fn operations_are_applied_in_their_order() {
    let at = |text: &str| {
        let room = Room::of(&format!(
            "def Xform \"above\" {{
                double3 xformOp:translate = (0, 0, 100)
                uniform token[] xformOpOrder = [\"xformOp:translate\"]
                def Mesh \"m\" {{ {SQUARE}\n{text}\n}}
            }}"
        ));
        bounds(&room.all())
    };
    let [low, high] = at(
        "double3 xformOp:translate = (10, 0, 0)\nfloat xformOp:rotateZ = 90\nfloat3 xformOp:scale = (1, 2, 1)
         uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateZ\", \"xformOp:scale\"]",
    );
    assert!(
        near(low, [6., 0., 100.]) && near(high, [10., 2., 100.]),
        "{low} {high}"
    );
    let [low, _] = at(
        "double3 xformOp:translate:pivot = (1, 1, 0)\nfloat3 xformOp:rotateXYZ = (0, 0, 180)
         uniform token[] xformOpOrder = [\"!resetXformStack!\", \"xformOp:translate:pivot\", \"xformOp:rotateXYZ\", \
         \"!invert!xformOp:translate:pivot\"]",
    );
    assert!(near(low, [0., 0., 0.]), "{low}");
    let [low, high] = at(
        "matrix4d xformOp:transform = ( (2, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1) )
         uniform token[] xformOpOrder = [\"xformOp:transform\"]",
    );
    assert!(
        near(low, [5., 6., 107.]) && near(high, [9., 8., 107.]),
        "{low} {high}"
    );
}

#[test]
fn what_is_invisible_inactive_or_of_another_purpose_is_not_shown() {
    let count = |text: &str| {
        let room = Room::of(&format!(
            "def Mesh \"shown\" {{ {SQUARE} }}
            def Xform \"a\" {text} def Mesh \"m\" {{ {SQUARE} }} }}"
        ));
        room.all().triangles.len()
    };
    assert_eq!(count("{"), 4);
    assert_eq!(count("{ token visibility = \"invisible\"\n"), 2);
    assert_eq!(count("{ uniform token purpose = \"guide\"\n"), 2);
    assert_eq!(count("{ uniform token purpose = \"render\"\n"), 4);
    assert_eq!(count("( active = false ) {"), 2);
    let over = Room::of(&format!(
        "over Xform \"o\" {{ def Mesh \"m\" {{ {SQUARE} }} }}\nclass Mesh \"c\" {{ {SQUARE} }}"
    ));
    assert!(over.wrong().contains("no triangles"));
}

#[test]
fn instances_of_points_share_a_mesh() {
    let room = Room::of(
        "def PointInstancer \"p\" {
            rel prototypes = [</p/cube>, </p/plane>]
            int[] protoIndices = [0, 1, 0]
            point3f[] positions = [(0, 0, 0), (5, 0, 0), (9, 0, 0)]
            float3[] scales = [(1, 1, 1), (1, 1, 1), (2, 2, 2)]
            int64[] ids = [10, 11, 12]
            def Cube \"cube\" {}
            def Plane \"plane\" {}
        }",
    );
    let scene = room.member("scene.toml");
    assert_eq!(scene.matches("[[geometry]]").count(), 2, "{scene}");
    let [_, high] = bounds(&room.all());
    assert!(near(high, [11., 2., 2.]), "{high}");
    assert_eq!(room.all().triangles.len(), 12 + 2 + 12);
}

#[test]
fn what_moves_is_read_at_the_time_of_the_frame() {
    let room = Room::of(&format!(
        "def Mesh \"still\" {{ {SQUARE} }}
        def Mesh \"m\" {{ {SQUARE}
            double3 xformOp:translate.timeSamples = {{ 0: (0, 0, 0), 24: (4, 0, 0) }}
            uniform token[] xformOpOrder = [\"xformOp:translate\"]
        }}
        def Mesh \"gone\" {{ {SQUARE}
            token visibility.timeSamples = {{ 0: \"inherited\", 12: \"invisible\" }}
        }}"
    ));
    let scene = room.member("scene.toml");
    assert!(
        scene.contains("meshes/0.usd")
            && scene.contains("prims/1.usd")
            && scene.contains("prims/2.usd"),
        "{scene}"
    );
    let moved = room
        .read("prims/1.usd", 0.5)
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(moved.moves && near(bounds(&moved)[0], [2., 0., 0.]));
    let there = |seconds| {
        room.read("prims/2.usd", seconds)
            .map_or(9, |g| g.triangles.len())
    };
    assert_eq!([there(0.0), there(0.5)], [2, 0]);
}

#[test]
fn a_camera_with_its_lens_is_the_camera_of_the_scene() {
    let room = Room::of(&format!(
        "def Mesh \"m\" {{ {SQUARE} }}
        def Camera \"c\" {{
            float focalLength = 50
            float horizontalAperture = 36
            float verticalAperture = 24
            float focusDistance = 3
            float fStop = 2
            double3 xformOp:translate.timeSamples = {{ 0: (0, 0, 5), 2: (2, 0, 5) }}
            uniform token[] xformOpOrder = [\"xformOp:translate\"]
        }}"
    ));
    let scene = room.member("scene.toml");
    for expected in [
        "position = [0.0, 0.0, 5.0]",
        "look_at = [0.0, 0.0, 2.0]",
        "fov = 26.99",
        "aperture = 2.5",
        "keys.position = [[0, [0.0, 0.0, 5.0]], [1, [1.0, 0.0, 5.0]], [2, [2.0, 0.0, 5.0]]]",
        "height = 683",
    ] {
        assert!(scene.contains(expected), "{expected} in {scene}");
    }
}

#[test]
fn a_file_without_camera_and_lights_is_framed_and_lit() {
    let scene = Room::of(&format!("def Mesh \"m\" {{ {SQUARE} }}")).member("scene.toml");
    assert!(
        scene.contains("look_at = [1.0, 1.0, 0.0]") && scene.contains("kind = \"distant\""),
        "{scene}"
    );
}

/// The numbers after a key, all that there are.
fn numbers(scene: &str, key: &str) -> Vec<f64> {
    let lines = scene
        .lines()
        .filter_map(|line| line.split_once(&format!("{key} = [")));
    let lists = lines.filter_map(|(_, rest)| rest.split(']').next());
    lists
        .flat_map(|list| list.split(", ").map(|n| n.parse().expect("a number")))
        .collect()
}

#[test]
fn lights_have_the_radiance_that_they_say() {
    let light = |text: &str| {
        let room = Room::of(&format!("def Mesh \"m\" {{ {SQUARE} }}\ndef {text}"));
        room.member("scene.toml")
    };
    let scene = light(
        "RectLight \"l\" {\nfloat inputs:width = 2\nfloat inputs:height = 3\nfloat inputs:intensity = 12\nfloat inputs:exposure = 1\n}",
    );
    assert_eq!(numbers(&scene, "radiance"), [24.0; 3]);
    // It shines along -z.
    let (u, v) = (numbers(&scene, "u"), numbers(&scene, "v"));
    let normal = DVec3::from_slice(&u).cross(DVec3::from_slice(&v));
    assert!(near(normal, [0., 0., -6.]), "{normal}");
    let scene = light(
        "RectLight \"l\" {\nfloat inputs:width = 2\nfloat inputs:height = 3\nfloat inputs:intensity = 12\nbool inputs:normalize = 1\n}",
    );
    assert_eq!(numbers(&scene, "radiance"), [2.0; 3]);
    let scene = light(
        "DistantLight \"l\" {\nfloat inputs:intensity = 3\nfloat inputs:angle = 0\ncolor3f inputs:color = (1, 0.5, 0)\n}",
    );
    assert_eq!(numbers(&scene, "irradiance"), [3.0, 1.5, 0.0]);
    let scene = light("DistantLight \"l\" {}");
    assert!(
        (numbers(&scene, "irradiance")[0] - 3.36).abs() < 0.01,
        "{scene}"
    );
    let scene = light("DomeLight \"l\" {\nfloat inputs:intensity = 0.5\n}");
    assert!(
        scene.contains("[environment]\ncolor = [0.5, 0.5, 0.5]"),
        "{scene}"
    );
}

#[test]
fn a_lamp_that_is_a_mesh_has_the_power_of_the_whole_shape() {
    let power = |text: &str| {
        let room = Room::of(&format!("def Mesh \"m\" {{ {SQUARE} }}\ndef {text}"));
        let radiance = numbers(&room.member("scene.toml"), "radiance")[0];
        let lamp = room
            .read("lights/0.usd", 0.0)
            .unwrap_or_else(|e| panic!("{e}"));
        let size = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        radiance
            * lamp
                .triangles
                .iter()
                .map(|t| size(t.positions))
                .sum::<f64>()
    };
    let pi = std::f64::consts::PI;
    let cases = [
        (
            "DiskLight \"l\" {\nfloat inputs:radius = 3\nbool inputs:normalize = 1\n}",
            1.0,
        ),
        ("DiskLight \"l\" {\nfloat inputs:radius = 3\n}", 9.0 * pi),
        (
            "CylinderLight \"l\" {\nfloat inputs:radius = 0.5\nfloat inputs:length = 4\n}",
            4.0 * pi,
        ),
    ];
    for (text, expected) in cases {
        let found = power(text);
        assert!(
            (found / expected - 1.0).abs() < 1e-5,
            "{text}: {found} {expected}"
        );
    }
}

#[test]
fn a_sphere_light_is_a_sphere_or_a_spot() {
    let light = |text: &str| {
        let room = Room::of(&format!(
            "def Mesh \"m\" {{ {SQUARE} }}\ndef SphereLight \"l\" {{\nfloat inputs:radius = 2\n{text}\n}}"
        ));
        room.member("scene.toml")
    };
    let whole = light("float inputs:intensity = 3");
    assert!(
        whole.contains("kind = \"sphere\"\ncenter = [0.0, 0.0, 0.0]\nradius = 2.0"),
        "{whole}"
    );
    assert!(!whole.contains("cone"), "{whole}");
    assert_eq!(numbers(&whole, "radiance"), [3.0; 3]);
    let area = 16.0 * std::f64::consts::PI;
    let normalized = light("bool inputs:normalize = 1");
    assert!((numbers(&normalized, "radiance")[0] * area - 1.0).abs() < 1e-6);
    let spot =
        light("float inputs:shaping:cone:angle = 40\nfloat inputs:shaping:cone:softness = 0.25");
    assert!(
        spot.contains("axis = [0.0, 0.0, -1.0]\ninner = 30.0\ncone = 40.0"),
        "{spot}"
    );
    // One that is no sphere in the world is a mesh.
    let flat = light(
        "float3 xformOp:scale = (1, 1, 0.5)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]",
    );
    assert!(
        flat.contains("lights/0.usd") && !flat.contains("kind = \"sphere\""),
        "{flat}"
    );
}
