//! USD files: layers as text and as binary crates, and archives of them.

use std::io;
use std::path::Path;

use super::kinds::{NUMBERS, Seeds, words};
use crate::Random;
use crate::mutate::{mutate, revalue, soup};

/// Words of USD.
const WORDS: &[&str] = &[
    "references = @m.usda@",
    "references = </a>",
    "references = [</a>, </b>]",
    "payload = @../../m.usda@",
    "subLayers = [@m.usda@]",
    "inherits = </a/b>",
    "instanceable = true",
    "variantSet \"v\" = { \"a\" { } }",
    "point3f[] points = [(nan, inf, -1)]",
    "int[] faceVertexCounts = [3, 99999999]",
    "int[] faceVertexIndices = [0, 1, 4294967295]",
    "uniform token[] xformOpOrder = [\"!resetXformStack!\", \"!invert!xformOp:scale\"]",
    "xformOp:scale.timeSamples = { 0: (0, 0, 0), 24: (1, 1, 1) }",
    "rel prototypes = [</a>]",
    "rel material:binding = </m>",
    "token outputs:surface.connect = </m/s.outputs:surface>",
    "asset inputs:file = @/dev/zero@",
    "def Sphere \"s\" { double radius = 1e300 }",
    "def PointInstancer \"p\" { int[] protoIndices = [0, 0] }",
    "upAxis = \"Z\"",
    "metersPerUnit = 0",
    "None",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    "@",
    "\"",
];

/// A mesh with a material, a camera that moves, instances and lights.
const LAYER: &str = r#"#usda 1.0
(
    defaultPrim = "a"
    metersPerUnit = 1
    upAxis = "Y"
    timeCodesPerSecond = 24
)
def Xform "a" {
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 24: (1, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "t" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {
        int[] faceVertexCounts = [3, 4]
        int[] faceVertexIndices = [0, 1, 2, 0, 1, 2, 3]
        point3f[] points = [(-1, -1, 0), (1, -1, 0), (0, 1, 0), (-1, 1, 0)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0)] ( interpolation = "vertex" )
        int[] primvars:st:indices = [0, 1, 0, 1]
        color3f[] primvars:displayColor = [(1, 0, 0)]
        uniform token subdivisionScheme = "none"
        rel material:binding = </m>
    }
}
def Xform "b" ( 
    instanceable = true
    references = </a>
) {}
def PointInstancer "p" {
    rel prototypes = [</p/s>]
    int[] protoIndices = [0, 0]
    point3f[] positions = [(2, 0, 0), (3, 0, 0)]
    def Sphere "s" {
        double radius = 0.5
    }
}
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.2, 0.1)
        float inputs:roughness = 0.4
        token outputs:surface
    }
}
def Camera "c" {
    float focalLength = 50
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def SphereLight "l" {
    float inputs:intensity = 10
    float inputs:radius = 0.1
}
def DistantLight "d" {
    float inputs:intensity = 5000
}
"#;

/// A layer of the same kind in a binary crate.
const CRATE: &[u8] = include_bytes!("triangle.usdc");

/// A USD file with changes.
pub(super) fn usd(_: &Seeds, random: &mut Random, folder: &Path) -> io::Result<Vec<String>> {
    let text = || LAYER.as_bytes().to_vec();
    let kinds = ["m.usda", "m.usdc", "m.usdz"];
    let name = kinds[random.below(kinds.len())];
    let good = if name == "m.usdc" || random.below(2) == 0 && name == "m.usdz" {
        CRATE.to_vec()
    } else {
        text()
    };
    let layer = match random.below(8) {
        0 => [good.as_slice(), &soup(random, WORDS, 40)].concat(),
        1..5 => mutate(random, &good, std::slice::from_ref(&good), WORDS),
        5 => bytes_changed(random, good.clone()),
        _ => revalue(random, &good, NUMBERS),
    };
    let file = if name == "m.usdz" {
        let archive = archive(if good == CRATE { "m.usdc" } else { "m.usda" }, &layer);
        match random.below(3) {
            0 => bytes_changed(random, archive),
            _ => archive,
        }
    } else {
        layer
    };
    std::fs::write(folder.join(name), file)?;
    let command = ["check", "plan --needs", "import --out made"][random.below(3)];
    Ok(words(&format!("{command} {name}")))
}

/// Some bytes in place of others: numbers of tables, of which a text would have digits.
fn bytes_changed(random: &mut Random, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len().max(1));
        let values = [0, 1, 2, 0x7f, 0x80, 0xff];
        if let Some(byte) = bytes.get_mut(at) {
            *byte = values[random.below(values.len())];
        }
    }
    bytes
}

/// An archive of one file, as it is.
fn archive(name: &str, bytes: &[u8]) -> Vec<u8> {
    let short = |n: usize| (n as u16).to_le_bytes();
    let long = |n: usize| (n as u32).to_le_bytes();
    let common = [
        &[0; 8][..],
        &long(0),
        &long(bytes.len()),
        &long(bytes.len()),
        &short(name.len()),
        &short(0),
    ]
    .concat();
    let local = [
        b"PK\x03\x04".as_slice(),
        &short(10),
        &common,
        name.as_bytes(),
    ]
    .concat();
    let entry = [
        b"PK\x01\x02".as_slice(),
        &short(10),
        &short(10),
        &common,
        &[0; 10],
        &long(0),
        name.as_bytes(),
    ]
    .concat();
    let start = local.len() + bytes.len();
    let end = [
        b"PK\x05\x06".as_slice(),
        &[0; 4],
        &short(1),
        &short(1),
        &long(entry.len()),
        &long(start),
        &short(0),
    ]
    .concat();
    [local, bytes.to_vec(), entry, end].concat()
}
