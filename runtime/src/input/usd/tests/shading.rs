//! Materials: networks of UsdShade as sources, and what is bound to what.

use super::{Room, SQUARE};

fn with_material(network: &str) -> Room {
    Room::of(&format!(
        "def Mesh \"m\" ( prepend apiSchemas = [\"MaterialBindingAPI\"] ) {{ {SQUARE}
            rel material:binding = </Looks/Old_Paint>
            texCoord2f[] primvars:map = [(0, 0), (1, 0), (1, 1), (0, 1)] ( interpolation = \"vertex\" )
            texCoord2f[] primvars:st = [(9, 9), (9, 9), (9, 9), (9, 9)] ( interpolation = \"vertex\" )
        }}
        def Scope \"Looks\" {{ def Material \"Old_Paint\" {{ {network} }} }}"
    ))
}

const PREVIEW: &str = "
    token outputs:surface.connect = </Looks/Old_Paint/s.outputs:surface>
    color3f inputs:tint = (0.5, 0.25, 0.125)
    def Shader \"s\" {
        uniform token info:id = \"UsdPreviewSurface\"
        color3f inputs:diffuseColor.connect = </Looks/Old_Paint.inputs:tint>
        float inputs:roughness.connect = </Looks/Old_Paint/t.outputs:g>
        token outputs:surface
    }
    def Shader \"t\" {
        uniform token info:id = \"UsdUVTexture\"
        asset inputs:file = @rough.png@
        token inputs:sourceColorSpace = \"raw\"
        token inputs:wrapS = \"mirror\"
        float2 inputs:st.connect = </Looks/Old_Paint/r.outputs:result>
        float outputs:g
    }
    def Shader \"r\" {
        uniform token info:id = \"UsdPrimvarReader_float2\"
        string inputs:varname = \"map\"
        float2 outputs:result
    }
";

#[test]
fn a_preview_surface_becomes_a_source() {
    let room = with_material(PREVIEW).and("rough.png", b"png");
    let source = room.member("old_paint.impasto");
    for expected in [
        "material old_paint",
        "0.5, 0.25, 0.125",
        "\"images/0\"",
        "MIRROR",
    ] {
        assert!(source.contains(expected), "{expected} in {source}");
    }
    let scene = room.member("scene.toml");
    assert!(
        scene.contains("[materials.Old_Paint]") || scene.contains("[materials.\"Old_Paint\"]"),
        "{scene}"
    );
    assert!(
        scene.contains("file = \"old_paint.impasto\"\nmaterial = \"old_paint\""),
        "{scene}"
    );
    // The material says which coordinates it reads.
    let uvs = room.all().triangles[0].uvs.expect("coordinates");
    assert_eq!(uvs[1].x, 1.0);
}

#[test]
fn a_network_of_materialx_becomes_a_source() {
    let room = with_material(
        "token outputs:mtlx:surface.connect = </Looks/Old_Paint/s.outputs:out>
        def Shader \"s\" {
            uniform token info:id = \"ND_standard_surface_surfaceshader\"
            color3f inputs:base_color.connect = </Looks/Old_Paint/g.outputs:out>
            float inputs:metalness = 1
            token outputs:out
        }
        def NodeGraph \"g\" {
            color3f outputs:out.connect = </Looks/Old_Paint/g/mix.outputs:out>
            def Shader \"mix\" {
                uniform token info:id = \"ND_mix_color3\"
                color3f inputs:fg = (1, 0, 0)
                color3f inputs:bg = (0, 0, 1)
                float inputs:mix = 0.25
                color3f outputs:out
            }
        }",
    );
    let source = room.member("old_paint.impasto");
    assert!(
        source.contains("std::surface::standard_surface") && source.contains("mix("),
        "{source}"
    );
}

#[test]
fn a_node_without_counterpart_is_an_error_that_names_it() {
    let room = with_material(
        "token outputs:surface.connect = </Looks/Old_Paint/s.outputs:out>
        def Shader \"s\" { uniform token info:id = \"PxrSurface\"\n token outputs:out }",
    );
    let error = room.wrong_member("old_paint.impasto");
    assert!(
        error.contains("`/Looks/Old_Paint/s` is a `PxrSurface`") && error.contains("expected: "),
        "{error}"
    );
    let room = with_material(
        "token outputs:surface.connect = </Looks/Old_Paint/s.outputs:out>
        def Shader \"s\" {
            uniform token info:id = \"ND_standard_surface_surfaceshader\"
            color3f inputs:base_color.connect = </Looks/Old_Paint/blur.outputs:out>
            token outputs:out
        }
        def Shader \"blur\" { uniform token info:id = \"ND_blur_color3\"\n color3f outputs:out }",
    );
    let error = room.wrong_member("old_paint.impasto");
    assert!(
        error.contains("Old_Paint") && error.contains("blur"),
        "{error}"
    );
    let circle = with_material(
        "token outputs:surface.connect = </Looks/Old_Paint/s.outputs:out>
        def Shader \"s\" {
            uniform token info:id = \"ND_standard_surface_surfaceshader\"
            float inputs:base.connect = </Looks/Old_Paint/s.outputs:out>
            token outputs:out
        }",
    );
    assert!(
        circle
            .wrong_member("old_paint.impasto")
            .contains("in a circle")
    );
}

#[test]
fn a_material_for_another_renderer_is_replaced_with_a_warning() {
    let room = with_material("token outputs:ri:surface.connect = </Looks/Old_Paint/s.outputs:out>");
    let warnings = room.all().warnings;
    assert!(
        warnings
            .iter()
            .any(|w| w.message.contains("it is for ri alone")),
        "{warnings:?}"
    );
    assert!(
        room.member("scene.toml")
            .contains("file = \"display_color.impasto\"")
    );
    assert!(
        room.member("display_color.impasto")
            .contains("vertex_color")
    );
}

#[test]
fn bindings_are_inherited_and_the_stronger_ones_win() {
    let names = |outer: &str| {
        let material = |name: &str| {
            format!(
                "def Material \"{name}\" {{ token outputs:ri:surface.connect = </x.outputs:y> }}"
            )
        };
        let room = Room::of(&format!(
            "def Xform \"a\" ( prepend apiSchemas = [\"MaterialBindingAPI\"] ) {{
                rel material:binding = </outer> {outer}
                def Mesh \"m\" {{ {SQUARE} }}
                def Mesh \"n\" ( prepend apiSchemas = [\"MaterialBindingAPI\"] ) {{ {SQUARE}\n rel material:binding = </inner> }}
            }}\n{}\n{}",
            material("outer"),
            material("inner"),
        ));
        let all = room.all();
        let name = |t: usize| all.materials[all.triangles[t].material].name.clone();
        [name(0), name(2)]
    };
    assert_eq!(names(""), ["outer", "inner"]);
    assert_eq!(
        names("( bindMaterialAs = \"strongerThanDescendants\" )"),
        ["outer", "outer"]
    );
}

#[test]
fn subsets_of_faces_have_materials_of_their_own() {
    let room = Room::of(
        "def Mesh \"m\" {
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
            point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
            def GeomSubset \"part\" ( prepend apiSchemas = [\"MaterialBindingAPI\"] ) {
                uniform token elementType = \"face\"
                int[] indices = [1]
                rel material:binding = </two>
            }
        }
        def Material \"two\" { token outputs:ri:surface.connect = </x.outputs:y> }",
    );
    let all = room.all();
    let names = all
        .triangles
        .iter()
        .map(|t| all.materials[t.material].name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["", "two"]);
}

#[test]
fn a_mesh_without_a_material_has_the_color_that_it_says_or_grey() {
    let red = |text: &str| {
        let room = Room::of(&format!("def Mesh \"m\" {{ {SQUARE}\n{text}\n}}"));
        room.all().triangles[0].colors.expect("colors")[0].x
    };
    assert_eq!(red(""), 0.18);
    assert_eq!(
        red("color3f[] primvars:displayColor = [(0.75, 0, 0)]"),
        0.75
    );
}
