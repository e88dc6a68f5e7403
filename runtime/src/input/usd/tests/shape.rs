//! Meshes and solids.

use glam::Vec3;

use super::{Room, SQUARE, bounds, near};

#[test]
fn faces_of_any_number_of_corners_are_cut_into_triangles() {
    let room = Room::of(
        "def Mesh \"m\" {
            int[] faceVertexCounts = [3, 5]
            int[] faceVertexIndices = [0, 1, 2, 0, 1, 2, 3, 4]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]
        }",
    );
    assert_eq!(room.all().triangles.len(), 4);
}

#[test]
fn a_left_handed_mesh_and_a_mirrored_one_face_outward() {
    let normal = |text: &str| {
        let room = Room::of(&format!("def Mesh \"m\" {{ {SQUARE}\n{text}\n}}"));
        let [a, b, c] = room.all().triangles[0].positions;
        (b - a).cross(c - a).normalize().z
    };
    assert_eq!(normal(""), 1.0);
    assert_eq!(normal("uniform token orientation = \"leftHanded\""), -1.0);
    let mirrored =
        "float3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]";
    assert_eq!(normal(mirrored), 1.0);
}

#[test]
fn holes_are_left_out() {
    let room = Room::of(
        "def Mesh \"m\" {
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
            int[] holeIndices = [1]
            point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
        }",
    );
    assert_eq!(room.all().triangles.len(), 1);
}

#[test]
fn values_are_by_mesh_face_point_or_corner() {
    let colors = |by: &str, values: &str| {
        let room = Room::of(&format!(
            "def Mesh \"m\" {{
                int[] faceVertexCounts = [3, 3]
                int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
                point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
                color3f[] primvars:displayColor = {values} ( interpolation = \"{by}\" )
            }}"
        ));
        let geometry = room.all();
        let red = |t: usize| {
            geometry.triangles[t]
                .colors
                .expect("colors")
                .map(|c: Vec3| c.x)
        };
        [red(0), red(1)]
    };
    let list = |n: u32| {
        let each: Vec<String> = (0..n).map(|i| format!("({i}, 0, 0)")).collect();
        format!("[{}]", each.join(", "))
    };
    assert_eq!(colors("constant", "[(7, 0, 0)]"), [[7.0; 3]; 2]);
    assert_eq!(colors("uniform", &list(2)), [[0.0; 3], [1.0; 3]]);
    assert_eq!(colors("vertex", &list(4)), [[0., 1., 2.], [0., 2., 3.]]);
    assert_eq!(
        colors("faceVarying", &list(6)),
        [[0., 1., 2.], [3., 4., 5.]]
    );
}

#[test]
fn indices_of_a_primvar_are_followed() {
    let room = Room::of(&format!(
        "def Mesh \"m\" {{ {SQUARE}
            texCoord2f[] primvars:st = [(0.25, 0), (0.5, 1)] ( interpolation = \"vertex\" )
            int[] primvars:st:indices = [0, 1, 0, 1]
        }}"
    ));
    let uvs = room.all().triangles[0].uvs.expect("coordinates");
    assert_eq!(uvs.map(|v| v.x), [0.25, 0.5, 0.25]);
}

#[test]
fn a_mesh_that_is_to_be_subdivided_has_smooth_normals_and_a_warning() {
    let text = SQUARE.replace("\"none\"", "\"catmullClark\"");
    let geometry = Room::of(&format!("def Mesh \"m\" {{ {text} }}")).all();
    assert_eq!(
        geometry.triangles[0].normals.expect("normals")[0].normalize(),
        Vec3::Z
    );
    assert!(
        geometry
            .warnings
            .iter()
            .any(|w| w.message.contains("subdivided"))
    );
    let flat = Room::of(&format!("def Mesh \"m\" {{ {SQUARE} }}")).all();
    assert_eq!((flat.triangles[0].normals, flat.warnings.len()), (None, 0));
}

#[test]
fn solids_are_as_large_as_they_say() {
    let cases = [
        ("Sphere", "double radius = 2", [-2., -2., -2.], [2., 2., 2.]),
        (
            "Cube",
            "double size = 3",
            [-1.5, -1.5, -1.5],
            [1.5, 1.5, 1.5],
        ),
        (
            "Cylinder",
            "double height = 4\nuniform token axis = \"Y\"",
            [-1., -2., -1.],
            [1., 2., 1.],
        ),
        (
            "Cone",
            "double height = 4\nuniform token axis = \"X\"",
            [-2., -1., -1.],
            [2., 1., 1.],
        ),
        (
            "Capsule",
            "double height = 2\ndouble radius = 1",
            [-1., -1., -2.],
            [1., 1., 2.],
        ),
        (
            "Plane",
            "double width = 4\ndouble length = 6",
            [-2., -3., 0.],
            [2., 3., 0.],
        ),
    ];
    for (kind, text, low, high) in cases {
        let geometry = Room::of(&format!("def {kind} \"s\" {{\n{text}\n}}")).all();
        let [a, b] = bounds(&geometry);
        assert!(near(a, low) && near(b, high), "{kind}: {a} {b}");
        for triangle in &geometry.triangles {
            let [p, q, r] = triangle.positions;
            let normal = (q - p).cross(r - p);
            let said: Vec3 = triangle.normals.expect("normals").iter().sum();
            let is_outward = kind == "Plane" || normal.dot(p + q + r) > 0.0;
            assert!(normal.dot(said.as_dvec3()) > 0.0 && is_outward, "{kind}");
        }
    }
}

#[test]
fn what_is_wrong_with_a_mesh_names_its_prim() {
    let mesh = |counts: &str, indices: &str, points: &str| {
        let room = Room::of(&format!(
            "def Xform \"a\" {{ def Mesh \"b\" {{
                int[] faceVertexCounts = {counts}
                int[] faceVertexIndices = {indices}
                point3f[] points = {points}
            }} }}"
        ));
        room.wrong()
    };
    let points = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]";
    let cases = [
        (
            mesh("[4]", "[0, 1, 2]", points),
            "its faces have 4 corners, but there are 3",
        ),
        (
            mesh("[3]", "[0, 1, 3]", points),
            "a corner is at point 3 of 3",
        ),
        (mesh("[3]", "[0, 1, -1]", points), "a number below 0"),
        (
            mesh("[3]", "[0, 1, 2]", "[(0, 0, 0), (inf, 0, 0), (0, 1, 0)]"),
            "a point is no number",
        ),
    ];
    for (found, expected) in cases {
        assert!(
            found.contains("/a/b") && found.contains(expected),
            "{found}"
        );
    }
}

#[test]
fn a_mesh_is_bent_by_its_skeleton_and_its_shapes() {
    let room = Room::of(
        "def SkelRoot \"r\" {
            def Skeleton \"s\" {
                rel skel:animationSource = </r/a>
                uniform token[] joints = [\"low\", \"low/high\"]
                uniform matrix4d[] bindTransforms = [( (1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1) ), ( (1,0,0,0), (0,1,0,0), (0,0,1,0), (0,1,0,1) )]
                uniform matrix4d[] restTransforms = [( (1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1) ), ( (1,0,0,0), (0,1,0,0), (0,0,1,0), (0,1,0,1) )]
            }
            def SkelAnimation \"a\" {
                uniform token[] joints = [\"low/high\"]
                float3[] translations = [(0, 1, 0)]
                quatf[] rotations.timeSamples = { 0: [(1, 0, 0, 0)], 24: [(0.70710678, 0, 0, 0.70710678)] }
                half3[] scales = [(1, 1, 1)]
                uniform token[] blendShapes = [\"wide\"]
                float[] blendShapeWeights.timeSamples = { 0: [0], 24: [1] }
            }
            def Mesh \"m\" ( prepend apiSchemas = [\"SkelBindingAPI\"] ) {
                rel skel:skeleton = </r/s>
                int[] faceVertexCounts = [3]
                int[] faceVertexIndices = [0, 1, 2]
                point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 2, 0)]
                uniform token subdivisionScheme = \"none\"
                int[] primvars:skel:jointIndices = [0, 0, 1] ( interpolation = \"vertex\" elementSize = 1 )
                float[] primvars:skel:jointWeights = [1, 1, 1] ( interpolation = \"vertex\" elementSize = 1 )
                uniform token[] skel:blendShapes = [\"wide\"]
                rel skel:blendShapeTargets = </r/m/wide>
                def BlendShape \"wide\" {
                    uniform vector3f[] offsets = [(1, 0, 0)]
                    uniform int[] pointIndices = [1]
                }
            }
        }"
        .replace("\" elementSize", "\"\n elementSize")
        .as_str(),
    );
    let at = |seconds| {
        let geometry = room
            .read("prims/0.usd", seconds)
            .unwrap_or_else(|e| panic!("{e}"));
        assert!(geometry.moves);
        geometry.triangles[0].positions
    };
    let [_, b, c] = at(0.0);
    assert!(near(b, [1., 0., 0.]) && near(c, [0., 2., 0.]), "{b} {c}");
    // The upper joint lies down to the left, and the shape pulls the right corner out.
    let [_, b, c] = at(1.0);
    assert!(near(b, [2., 0., 0.]) && near(c, [-1., 1., 0.]), "{b} {c}");
}
