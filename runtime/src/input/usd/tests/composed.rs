//! Layers that make a stage together, and where they may lie.

use openusd::usdz::ArchiveWriter;

use super::{Room, SQUARE, bounds, layer, near};

#[test]
fn layers_references_payloads_variants_and_inherits_are_composed() {
    let part = layer(&format!("def Mesh \"m\" {{ {SQUARE} }}"))
        .replace("metersPerUnit", "defaultPrim = \"m\"\n    metersPerUnit");
    let room = Room::of(
        "def \"whole\" ( references = @parts/a.usda@ ) {
            double3 xformOp:translate = (10, 0, 0)
            uniform token[] xformOpOrder = [\"xformOp:translate\"]
        }
        def \"later\" ( payload = @parts/a.usda@</m> ) {}
        class \"_high\" {
            double3 xformOp:translate = (0, 20, 0)
            uniform token[] xformOpOrder = [\"xformOp:translate\"]
        }
        def \"up\" ( inherits = </_high>\n references = @parts/a.usda@ ) {}
        def Xform \"choice\" (
            variants = { string size = \"large\" }
            prepend variantSets = \"size\"
        ) {
            variantSet \"size\" = {
                \"small\" { def Sphere \"s\" {} }
                \"large\" { def Plane \"p\" { double width = 100 } }
            }
        }",
    );
    let geometry = room.and("parts/a.usda", part.as_bytes()).all();
    assert_eq!(geometry.triangles.len(), 8);
    let [low, high] = bounds(&geometry);
    assert!(
        near(low, [-50., -1., 0.]) && near(high, [50., 22., 0.]),
        "{low} {high}"
    );
}

#[test]
fn native_instances_share_a_mesh() {
    let room = Room::of(&format!(
        "def Xform \"part\" {{ def Mesh \"m\" {{ {SQUARE} }} }}
        def \"a\" ( instanceable = true\n references = </part> ) {{}}
        def \"b\" ( instanceable = true\n references = </part> ) {{
            double3 xformOp:translate = (7, 0, 0)
            uniform token[] xformOpOrder = [\"xformOp:translate\"]
        }}"
    ));
    let scene = room.member("scene.toml");
    // The part itself, and what both instances share.
    assert_eq!(scene.matches("[[geometry]]").count(), 2, "{scene}");
    assert_eq!(room.all().triangles.len(), 6);
    assert!(near(bounds(&room.all())[1], [9., 2., 0.]));
}

#[test]
fn files_outside_of_the_folder_are_refused() {
    for path in ["../../x.usda", "/etc/passwd.usda"] {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("x.usda"), layer("")).expect("written");
        std::fs::create_dir_all(folder.path().join("a/b")).expect("a folder");
        let own = folder.path().join("x.usda");
        let path = if path.starts_with('/') {
            own.to_string_lossy().into_owned()
        } else {
            path.into()
        };
        let text = layer(&format!(
            "def Cube \"c\" {{}}\ndef \"a\" ( references = @{path}@</b> ) {{}}"
        ));
        std::fs::write(folder.path().join("a/b/m.usda"), text).expect("written");
        let error =
            crate::input::read(&folder.path().join("a/b/m.usda/scene.toml")).expect_err("refused");
        let error = error.to_string();
        assert!(
            error.contains("lies outside of its folder") && error.contains("hint: "),
            "{error}"
        );
    }
}

#[test]
fn a_layer_that_is_missing_is_a_warning() {
    let geometry =
        Room::of("def Cube \"c\" {}\ndef \"a\" ( references = @gone.usda@</b> ) {}").all();
    assert!(
        geometry
            .warnings
            .iter()
            .any(|w| w.message.contains("gone.usda")),
        "{:?}",
        geometry.warnings
    );
}

#[test]
fn layers_and_pictures_come_out_of_an_archive() {
    let text = layer(&format!(
        "def Mesh \"m\" ( prepend apiSchemas = [\"MaterialBindingAPI\"] ) {{ {SQUARE}\n rel material:binding = </mat> }}
        def \"more\" ( references = @parts/b.usda@</c> ) {{}}
        def Material \"mat\" {{
            token outputs:surface.connect = </mat/s.outputs:surface>
            def Shader \"s\" {{
                uniform token info:id = \"UsdPreviewSurface\"
                color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>
                token outputs:surface
            }}
            def Shader \"t\" {{
                uniform token info:id = \"UsdUVTexture\"
                asset inputs:file = @textures/a.png@
                float3 outputs:rgb
            }}
        }}"
    ));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.usdz");
    let mut writer = ArchiveWriter::create(&path).expect("an archive");
    let parts = layer("def Cube \"c\" {}");
    for (name, bytes) in [
        ("m.usda", text.as_bytes()),
        ("parts/b.usda", parts.as_bytes()),
        ("textures/a.png", b"a picture"),
    ] {
        writer.add_layer(name, bytes).expect("added");
    }
    writer.finish().expect("written");
    let bytes = std::fs::read(&path).expect("the archive");
    let room = Room::with("m.usdz", &bytes);
    assert_eq!(room.all().triangles.len(), 2 + 12);
    assert!(
        room.member("mat.impasto").contains("\"images/0\""),
        "{}",
        room.member("mat.impasto")
    );
    assert_eq!(room.member("images/0"), "a picture");
}
