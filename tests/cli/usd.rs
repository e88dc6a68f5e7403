//! USD files: rendered and checked as they are, and imported as folders to go on with.

use std::path::Path;

use crate::cli::common::{folder, impasto, names};

/// A square of four colors that faces +z, in centimetres, seen from in front of it; it emits, so that a picture has its
/// colors. Its picture and half of its prims are in other files.
const SCENE: &str = r#"#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Y"
)
def "square" (
    references = @parts/square.usda@</square>
) {
    rel material:binding = </looks/Four_Colors>
}
def Camera "camera" {
    float focalLength = 50
    float horizontalAperture = 24
    float verticalAperture = 24
    double3 xformOp:translate = (50, 50, 208.3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Scope "looks" {
    def Material "Four_Colors" {
        token outputs:surface.connect = </looks/Four_Colors/surface.outputs:surface>
        def Shader "surface" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0, 0, 0)
            float inputs:roughness = 1
            int inputs:useSpecularWorkflow = 1
            color3f inputs:emissiveColor.connect = </looks/Four_Colors/picture.outputs:rgb>
            token outputs:surface
        }
        def Shader "picture" {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @four.png@
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            float3 outputs:rgb
        }
    }
}
def DomeLight "none" {
    float inputs:intensity = 0
}
"#;

const SQUARE: &str = r#"#usda 1.0
def Mesh "square" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (100, 0, 0), (100, 100, 0), (0, 100, 0)]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "vertex"
    )
    uniform token subdivisionScheme = "none"
}
"#;

fn write(folder: &Path) -> String {
    let file = folder.join("square.usda");
    std::fs::create_dir_all(folder.join("parts")).expect("a folder");
    std::fs::write(&file, SCENE).expect("a layer");
    std::fs::write(folder.join("parts/square.usda"), SQUARE).expect("a layer");
    // Above red and green, below blue and white.
    let mut texels = image::RgbImage::new(64, 64);
    for (x, y, texel) in texels.enumerate_pixels_mut() {
        *texel = image::Rgb(match (x < 32, y < 32) {
            (true, true) => [255, 0, 0],
            (false, true) => [0, 255, 0],
            (true, false) => [0, 0, 255],
            (false, false) => [255; 3],
        });
    }
    texels.save(folder.join("four.png")).expect("a picture");
    file.display().to_string()
}

/// Which channels are bright in the quarters of a picture: above left, above right, below left, below right.
fn quarters(scene: &str, out: &Path) -> [[bool; 3]; 4] {
    let picture = out.display().to_string();
    let args = ["--size", "32x32", "--spp", "16", "--device", "cpu"];
    impasto(&[&["render", scene, "--out", &picture], &args[..]].concat()).exits(0);
    let pixels = image::open(out).expect("a picture").to_rgb8();
    let at = |(x, y)| pixels.get_pixel(x, y).0.map(|channel| channel > 128);
    [(4, 4), (28, 4), (4, 28), (28, 28)].map(at)
}

const EXPECTED: [[bool; 3]; 4] = [
    [true, false, false],
    [false, true, false],
    [false, false, true],
    [true, true, true],
];

#[test]
fn a_file_is_rendered_checked_and_imported() {
    let temporary = folder();
    let path = write(temporary.path());
    impasto(&["check", &path])
        .exits(0)
        .says("checked 1 file: 0 errors");
    assert_eq!(quarters(&path, &temporary.path().join("a.png")), EXPECTED);
    for source in [
        "four_colors.impasto",
        "display_color.impasto",
        "lamp.impasto",
    ] {
        let source = format!("{path}/{source}");
        impasto(&["check", &source])
            .exits(0)
            .says("0 errors, 0 warnings");
        impasto(&["fmt", "--check", &source]).exits(0);
    }
    let out = temporary.path().join("made");
    let out_text = out.display().to_string();
    impasto(&["import", &path, "--out", &out_text])
        .exits(0)
        .says("impasto render");
    let made = names(&out);
    for name in [
        "four_colors.impasto",
        "images",
        "parts",
        "scene.toml",
        "square.usda",
    ] {
        assert!(made.iter().any(|own| own == name), "{made:?}");
    }
    let scene = out.join("scene.toml").display().to_string();
    assert_eq!(quarters(&scene, &temporary.path().join("b.png")), EXPECTED);
}

#[test]
fn what_is_wrong_is_said_of_the_file() {
    let temporary = folder();
    let path = write(temporary.path());
    let wrong = |from: &str, to: &str| {
        std::fs::write(&path, SCENE.replace(from, to)).expect("a layer");
        impasto(&["check", &path]).exits(1)
    };
    wrong("\"UsdPreviewSurface\"", "\"PxrSurface\"")
        .says("the node `/looks/Four_Colors/surface` is a `PxrSurface`");
    wrong("def Scope", "def {").says("square.usda");
}
