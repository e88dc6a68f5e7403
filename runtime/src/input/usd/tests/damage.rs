//! That no byte of a file is trusted: damage is an error, in bounded time and memory.

use std::fmt::Write;

use openusd::sdf::{FileFormat, LayerRegistry};

use super::{Room, SQUARE, layer};
use crate::input::usd::{archive, binary, text};

/// A layer as a binary crate, which the reader's own writer makes.
fn crate_of(text: &str) -> Vec<u8> {
    let room = Room::of(text);
    let files = super::super::resolver::Files::beside(&room.path());
    let format = |id| -> &dyn FileFormat { LayerRegistry::find_by_id(id).expect("a format") };
    let resolved = openusd::ar::ResolvedPath::new(room.path().canonicalize().expect("it is there"));
    let data = format("usda").read(&files, &resolved).expect("a layer");
    let mut bytes = std::io::Cursor::new(Vec::new());
    format("usdc").write(&*data, &mut bytes).expect("written");
    bytes.into_inner()
}

fn sample() -> Vec<u8> {
    crate_of(&format!(
        "def Mesh \"m\" {{ {SQUARE}
            double3 xformOp:translate.timeSamples = {{ 0: (0, 0, 0), 24: (4, 0, 0) }}
            uniform token[] xformOpOrder = [\"xformOp:translate\"]
        }}
        def \"a\" ( references = </m>\n customData = {{ int a = 1\n dictionary b = {{ string c = \"d\" }} }} ) {{}}"
    ))
}

#[test]
fn a_binary_crate_shows_what_its_text_shows() {
    let bytes = sample();
    assert_eq!(binary::check(&bytes), Ok(()));
    for name in ["m.usdc", "m.usd"] {
        assert_eq!(Room::with(name, &bytes).all().triangles.len(), 4);
    }
}

#[test]
fn a_crate_that_is_cut_off_is_an_error() {
    let bytes = sample();
    for length in 0..bytes.len() {
        let found = binary::check(&bytes[..length]);
        assert!(
            found.is_err() || length + 64 > bytes.len(),
            "{length} of {}",
            bytes.len()
        );
    }
    let cut = &bytes[..bytes.len() / 2];
    assert!(Room::with("m.usdc", cut).wrong().contains("damaged"));
}

#[test]
fn no_byte_of_a_crate_ends_the_process() {
    let bytes = sample();
    for at in (0..bytes.len()).step_by(3) {
        for value in [0, 0x7f, 0xff] {
            let mut changed = bytes.clone();
            changed[at] = value;
            if binary::check(&changed).is_ok() && at % 9 == 0 {
                let _ = Room::with("m.usdc", &changed).read("", 0.0);
            }
        }
    }
}

#[test]
fn a_crate_that_says_it_has_more_than_there_is_takes_no_memory() {
    let bytes = sample();
    // Any eight bytes may be a count.
    for at in (8..bytes.len() - 8).step_by(5) {
        for count in [u64::MAX, 1 << 40, 1 << 31] {
            let mut changed = bytes.clone();
            changed[at..at + 8].copy_from_slice(&count.to_le_bytes());
            if binary::check(&changed).is_ok() && at % 25 == 8 {
                let _ = Room::with("m.usdc", &changed).read("", 0.0);
            }
        }
    }
}

#[test]
fn brackets_nest_no_deeper_than_is_read() {
    let nested = |depth: usize| {
        layer(&format!(
            "{}{}",
            "def \"a\" {".repeat(depth),
            "}".repeat(depth)
        ))
    };
    assert_eq!(text::check(nested(100).as_bytes()), Ok(()));
    let error = text::check(nested(200).as_bytes()).expect_err("too deep");
    assert!(
        error.contains("line 7") && error.contains("brackets"),
        "{error}"
    );
    // Those of strings, paths and comments are none.
    let harmless = format!(
        "\"{0}\" '{0}' @{0}@ \"\"\"{0}\"\"\" \"\\\"{0}\" # {0}\n",
        "(".repeat(500)
    );
    assert_eq!(text::check(harmless.as_bytes()), Ok(()));
    assert!(
        Room::with("m.usda", nested(20_000).as_bytes())
            .wrong()
            .contains("brackets")
    );
}

#[test]
fn references_that_double_are_refused_before_they_are_composed() {
    let mut text = String::new();
    for i in 0..30 {
        for name in ["a", "b"] {
            let next = i + 1;
            let _ = writeln!(
                text,
                "def \"{name}{i}\" ( references = [</a{next}>, </b{next}>] ) {{}}"
            );
        }
    }
    text.push_str("def Cube \"a30\" {}\ndef Cube \"b30\" {}\n");
    let error = Room::of(&text).wrong();
    assert!(
        error.contains("/a0") && error.contains("composed of more than"),
        "{error}"
    );
}

#[test]
fn prims_that_multiply_are_bounded() {
    let mut text = String::new();
    for i in 0..8 {
        let _ = writeln!(text, "def \"a{i}\" {{");
        for j in 0..10 {
            let _ = writeln!(
                text,
                "    def \"c{j}\" ( instanceable = true\n references = </a{}> ) {{}}",
                i + 1
            );
        }
        text.push_str("}\n");
    }
    text.push_str("def \"a8\" { def Cube \"c\" {} }\n");
    let error = Room::of(&text).wrong();
    assert!(error.contains("more than 200000 prims"), "{error}");
}

#[test]
fn circles_of_layers_and_prims_end() {
    let room = Room::of(
        "def \"a\" ( references = </b> ) {}\ndef \"b\" ( references = </a> ) {}
        def \"c\" ( references = @m.usda@</c> ) {}
        def \"d\" ( inherits = </d/e> ) { def \"e\" {} }
        def \"f\" { def \"g\" ( references = </f> ) {} }
        def Cube \"shown\" {}",
    );
    assert_eq!(room.all().triangles.len(), 12);
    let own = "#usda 1.0\n(\n    subLayers = [@m.usda@]\n)\ndef Cube \"c\" {}\n";
    assert_eq!(
        Room::with("m.usda", own.as_bytes()).all().triangles.len(),
        12
    );
}

#[test]
fn an_archive_is_as_large_as_its_files() {
    let not_one = archive::files(b"no archive").expect_err("none");
    assert!(not_one.contains("no zip archive"), "{not_one}");
    let mut bytes = b"PK\x03\x04".to_vec();
    bytes.resize(30, 0);
    bytes.extend(b"x");
    let start = bytes.len();
    let mut entry = b"PK\x01\x02".to_vec();
    entry.resize(46, 0);
    // Compressed by method 8 from one byte to many.
    (entry[10], entry[20], entry[26], entry[28]) = (8, 1, 0x7f, 1);
    entry.push(b'x');
    bytes.extend(&entry);
    bytes.extend(b"PK\x05\x06\0\0\0\0\x01\0\x01\0");
    bytes.extend((entry.len() as u32).to_le_bytes());
    bytes.extend((start as u32).to_le_bytes());
    bytes.extend([0, 0]);
    let error = archive::files(&bytes).expect_err("compressed");
    assert!(error.contains("compressed"), "{error}");
    assert!(Room::with("m.usdz", &bytes).wrong().contains("compressed"));
}

#[test]
fn a_text_that_is_no_layer_is_an_error_with_the_file() {
    for text in [
        "",
        "hello",
        "#usda 1.0\ndef {",
        "#usda 1.0\ndef Mesh \"a\" { int[] b = [1, }",
    ] {
        let error = Room::with("m.usda", text.as_bytes()).wrong();
        assert!(error.contains("m.usda"), "{error}");
    }
    assert!(
        Room::with("m.usd", &[0xff, 0xfe, 0x00])
            .wrong()
            .contains("m.usd")
    );
}

/// Text that is no name of a property is none that a prim has. The composition looks for it without end.
#[test]
fn operations_that_no_prim_has_are_left_out() {
    let order = format!("xformOp:translat{}e", "}".repeat(600));
    let text = format!(
        "def Mesh \"m\" {{ {SQUARE} }}
        def Camera \"c\" {{
            double3 xformOp:translate = (0, 0, 5)
            uniform token[] xformOpOrder = [\"{order}\"]
        }}"
    );
    assert_eq!(Room::of(&text).all().triangles.len(), 2);
}
