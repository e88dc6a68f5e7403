//! Files of all forms give the same mesh, and files that are not what they say are explained.

use super::*;

/// An element: its name, its properties and its entries. A list is its count and its items.
type Rows = (&'static str, &'static [&'static str], Vec<Vec<f64>>);

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// A file of these elements.
fn written(encoding: &str, elements: &[Rows]) -> Vec<u8> {
    let mut file = format!("ply\nformat {encoding} 1.0\ncomment made\n").into_bytes();
    for (name, properties, rows) in elements {
        file.extend(format!("element {name} {}\n", rows.len()).bytes());
        let lines = properties.iter().map(|p| format!("property {p}\n"));
        file.extend(lines.collect::<String>().bytes());
    }
    file.extend(b"end_header\n");
    for (_, properties, rows) in elements {
        for row in rows {
            entry(&mut file, encoding, properties, row);
        }
    }
    file
}

fn entry(file: &mut Vec<u8>, encoding: &str, properties: &[&str], row: &[f64]) {
    let mut values = row.iter();
    let mut put = |scalar: &str| {
        let value = *values.next().expect("the row has a value");
        number(file, encoding, scalar, value);
        value
    };
    for property in properties {
        match property.split(' ').collect::<Vec<_>>()[..] {
            ["list", count, items, _] => {
                let count = put(count);
                (0..count as usize).for_each(|_| {
                    put(items);
                });
            }
            [scalar, _] => {
                put(scalar);
            }
            _ => panic!("{property}"),
        }
    }
    if encoding == "ascii" {
        file.push(b'\n');
    }
}

fn number(file: &mut Vec<u8>, encoding: &str, scalar: &str, value: f64) {
    if encoding == "ascii" {
        let text = match scalar {
            "float" | "float32" => (value as f32).to_string(),
            _ => value.to_string(),
        };
        file.extend(format!("{text} ").bytes());
        return;
    }
    let mut bytes = match scalar {
        "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
        "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
        "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
        "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
        "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
        "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
        "int64" => (value as i64).to_le_bytes().to_vec(),
        "uint64" => (value as u64).to_le_bytes().to_vec(),
        "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
        "double" | "float64" => value.to_le_bytes().to_vec(),
        _ => panic!("{scalar}"),
    };
    if encoding == "binary_big_endian" {
        bytes.reverse();
    }
    file.extend(bytes);
}

/// What the file of these bytes is read as.
fn read_bytes(bytes: &[u8]) -> Result<Geometry, SceneError> {
    decode(Path::new("a.ply"), "a.ply", bytes)
}

fn geometry(bytes: &[u8]) -> Geometry {
    read_bytes(bytes).unwrap_or_else(|e| panic!("{e}"))
}

/// Everything that a geometry says.
fn said(geometry: &Geometry) -> String {
    format!("{geometry:?}")
}

/// A quad and a triangle with everything that vertices and faces may have, and more.
fn everything() -> Vec<Rows> {
    let place = [[0.1, 0.0], [1.0, 0.0], [1.0, 1.3], [0.0, 1.0], [2.0, 0.5]];
    let vertex = |(index, [x, y]): (usize, [f64; 2])| {
        let tags: &[f64] = [&[0.0][..], &[2.0, -7.0, 300.0]][index % 2];
        let normal_and_uv = [0.0, 0.0, 1.0, x, y];
        let color = [60.0 * index as f64, 255.0, 0.0];
        [&[y, x, 2.0], tags, &normal_and_uv, &color].concat()
    };
    let vertices = place.into_iter().enumerate().map(vertex);
    vec![
        (
            "camera",
            &["double view", "list int16 double poses"],
            vec![vec![0.5, 0.0], vec![-0.5, 2.0, 1.0, 1e300]],
        ),
        (
            "vertex",
            &[
                "double y",
                "float x",
                "float32 z",
                "list char short tags",
                "float nx",
                "float64 ny",
                "float nz",
                "float s",
                "float t",
                "uchar red",
                "uint8 green",
                "uchar blue",
            ],
            vertices.collect(),
        ),
        (
            "face",
            &[
                "uint64 id",
                "list uchar int vertex_indices",
                "list uint8 float texcoord",
            ],
            vec![
                vec![1.0, 4.0, 0.0, 1.0, 2.0, 3.0, 0.0],
                vec![2.0, 3.0, 1.0, 4.0, 2.0, 6.0, 0.0, 0.1, 0.5, 0.25, 1.0, 0.75],
                vec![3.0, 2.0, 1.0, 4.0, 0.0],
            ],
        ),
        (
            "edge",
            &["int vertex1", "int vertex2"],
            vec![vec![-1.0, 1.0]],
        ),
    ]
}

/// A triangle of plain places whose indices have these types.
fn plain(corners: &'static [&'static str]) -> Vec<Rows> {
    let places = vec![vec![0.0; 3], vec![1.0, 0.0, 0.0], vec![0.0, 1.0, 0.0]];
    vec![
        ("vertex", &["float x", "float y", "float z"], places),
        ("face", corners, vec![vec![3.0, 0.0, 1.0, 2.0]]),
    ]
}

#[test]
fn all_encodings_give_the_same() {
    let [text, little, big] = ENCODINGS.map(|e| geometry(&written(e, &everything())));
    assert_eq!(said(&text), said(&little));
    assert_eq!(said(&text), said(&big));
    assert_eq!(text.triangles.len(), 3);
    let first = text.triangles[0];
    // The precision is that of the types.
    assert_eq!(first.positions[0], DVec3::new(f64::from(0.1f32), 0.0, 2.0));
    assert_eq!(first.positions[2].y, 1.3);
    assert_eq!(first.normals, Some([Vec3::Z; 3]));
    // Coordinates of faces count before those of vertices, and where there are none, those of vertices do.
    assert_eq!(first.uvs.map(|uvs| uvs[1]), Some(Vec2::X));
    let last = text.triangles[2].uvs.map(|uvs| uvs[1]);
    assert_eq!(last, Some(Vec2::new(0.5, 0.25)));
    let [color, ..] = text.triangles[2].colors.expect("there are colors");
    assert_eq!(
        color,
        Vec3::new(srgb_to_linear(60.0 / 255.0) as f32, 1.0, 0.0)
    );
    let warnings: Vec<&str> = text.warnings.iter().map(|w| &*w.message).collect();
    assert_eq!(warnings, ["faces of fewer than three corners, left out: 1"]);
}

#[test]
fn indices_have_any_type_and_name() {
    let expected = said(&geometry(&written(
        "ascii",
        &plain(&["list uchar int vertex_indices"]),
    )));
    let kinds: [&'static [&'static str]; 7] = [
        &["list char char vertex_indices"],
        &["list int8 uint8 vertex_index"],
        &["list ushort short vertex_index"],
        &["list int uint16 vertex_indices"],
        &["list uint uint vertex_indices"],
        &["list int64 uint64 vertex_indices"],
        &["list uint32 double vertex_indices"],
    ];
    for kind in kinds {
        for encoding in ENCODINGS {
            let found = said(&geometry(&written(encoding, &plain(kind))));
            assert_eq!(found, expected, "{kind:?} {encoding}");
        }
    }
}

#[test]
fn colors_are_linear_if_they_have_a_fraction() {
    let color = |properties: &'static [&'static str], rgb: [f64; 3]| {
        let mut elements = plain(&["list uchar int vertex_indices"]);
        elements[0].1 = properties;
        let rows = elements[0].2.iter_mut();
        rows.for_each(|row| row.extend(rgb));
        let geometry = geometry(&written("binary_big_endian", &elements));
        geometry.triangles[0].colors.expect("there are colors")[0]
    };
    let half = srgb_to_linear(0.5) as f32;
    let near = |found: Vec3, expected: [f32; 3]| {
        assert!(
            found.distance(expected.into()) < 0.01,
            "{found} {expected:?}"
        );
    };
    let bytes = &[
        "float x",
        "float y",
        "float z",
        "uchar red",
        "uchar green",
        "uchar blue",
    ];
    near(color(bytes, [127.5, 255.0, 0.0]), [half, 1.0, 0.0]);
    let words = &[
        "float x", "float y", "float z", "ushort r", "ushort g", "ushort b",
    ];
    near(color(words, [32768.0, 65535.0, 0.0]), [half, 1.0, 0.0]);
    let ints = &[
        "float x",
        "float y",
        "float z",
        "int red",
        "int green",
        "int blue",
    ];
    near(color(ints, [128.0, 300.0, -1.0]), [half, 1.0, 0.0]);
    let floats = &[
        "float x",
        "float y",
        "float z",
        "float red",
        "float green",
        "double blue",
    ];
    near(color(floats, [0.5, 3.0, 0.0]), [0.5, 3.0, 0.0]);
}

#[test]
fn faces_have_colors_where_vertices_have_none() {
    let mut elements = plain(&["list uchar int vertex_indices"]);
    let properties: &[&str] = &[
        "list uchar int vertex_indices",
        "uchar red",
        "uchar green",
        "uchar blue",
    ];
    elements[1].1 = properties;
    elements[1].2 = vec![vec![3.0, 0.0, 1.0, 2.0, 255.0, 0.0, 0.0]];
    let triangle = geometry(&written("ascii", &elements)).triangles[0];
    assert_eq!(triangle.colors, Some([Vec3::X; 3]));
}

#[test]
fn strips_turn_every_other_triangle() {
    let mut elements = plain(&[]);
    elements[0].2.push(vec![1.0, 1.0, 0.0]);
    let strip = [0.0, 1.0, 2.0, 3.0, -1.0, 1.0, 3.0, 3.0, 2.0, 0.0];
    let strip = [&[strip.len() as f64], &strip[..]].concat();
    elements[1] = ("tristrips", &["list int int vertex_indices"], vec![strip]);
    // Strips may come before their vertices.
    elements.swap(0, 1);
    for encoding in ENCODINGS {
        let geometry = geometry(&written(encoding, &elements));
        let at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let at = at.map(|[x, y]| DVec3::new(x, y, 0.0));
        let found: Vec<_> = geometry.triangles.iter().map(|t| t.positions).collect();
        let expected = [[0, 1, 2], [2, 1, 3], [3, 2, 0]];
        assert_eq!(found, expected.map(|corners| corners.map(|c| at[c])));
    }
}

#[test]
fn any_line_ends_and_remarks_are_read() {
    let text = "ply\nformat ascii 1.0   \nobj_info x\ncomment TextureFile old\\wood 1.png\n\n\
                element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\n\
                0 0 0\n1 0 0\n\n 0\t1.0e0 0 \n3 0 1 2";
    let expected = geometry(text.as_bytes());
    assert_eq!(expected.triangles.len(), 1);
    let picture = ParameterValue::Texture("old/wood 1.png".into());
    assert_eq!(expected.materials[0].values, [("TextureFile", picture)]);
    for newline in ["\r\n", "\r"] {
        let found = geometry(text.replace('\n', newline).as_bytes());
        assert_eq!(said(&found), said(&expected), "{newline:?}");
    }
    // After the header, a byte that looks like the other half of a line end is data.
    let binary = written(
        "binary_little_endian",
        &plain(&["list uchar int vertex_indices"]),
    );
    let header = binary
        .windows(11)
        .position(|w| w == b"end_header\n")
        .expect("it ends")
        + 11;
    let (text, data) = binary.split_at(header);
    for newline in ["\r\n", "\r"] {
        let text = String::from_utf8_lossy(text).replace('\n', newline);
        let mut data = data.to_vec();
        data[0] = b'\n';
        let found = geometry(&[text.as_bytes(), &data].concat());
        let x = f32::from_le_bytes([b'\n', 0, 0, 0]);
        assert_eq!(
            found.triangles[0].positions[0].x,
            f64::from(x),
            "{newline:?}"
        );
    }
}

/// An ASCII file with these changes.
fn changed(changes: &[(&str, &str)]) -> Vec<u8> {
    let file = written("ascii", &plain(&["list uchar int vertex_indices"]));
    let mut text = String::from_utf8(file).expect("it is text");
    for (from, to) in changes {
        assert!(text.contains(from), "{from} in {text}");
        text = text.replacen(from, to, 1);
    }
    text.into_bytes()
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let cases: &[(&str, &str, &str)] = &[
        ("ply\n", "plx\n", "a.ply:1: it is no PLY file"),
        (
            "format ascii 1.0\n",
            "",
            "a.ply:9: the header says no `format`",
        ),
        (
            "ascii",
            "text",
            "a.ply:2: the format `text` is none of ascii, ",
        ),
        (
            "vertex 3",
            "vertex -3",
            "a.ply:4: the element `vertex` cannot have `-3` entries",
        ),
        (
            "vertex 3",
            "vertex",
            "a.ply:4: an `element` has a name and a count",
        ),
        (
            "vertex 3",
            "vertex 3\nelement vertex 3",
            "the header has two elements `vertex`",
        ),
        (
            "vertex 3",
            "vertex 4000000000",
            "the header promises 4000000000 of the element `vertex`",
        ),
        ("vertex 3", "vertex 99999999999", "more than 2^32 vertices"),
        ("vertex 3", "corner 3", "the header has no element `vertex`"),
        ("float x", "half x", "a.ply:5: `half` is no type of numbers"),
        ("float x", "float", "a.ply:5: the property has no name"),
        (
            "float x",
            "float q",
            "lack one of the properties `x`, `y` and `z`",
        ),
        (
            "list uchar",
            "list float",
            "a.ply:9: a list cannot be counted by a float",
        ),
        (
            "vertex_indices",
            "indices",
            "the element `face` has no list `vertex_indices`",
        ),
        ("face 1", "face 0", "the PLY file has no faces"),
        (
            "element face 1",
            "element edge 1",
            "points alone are not rendered",
        ),
        ("3 0 1 2", "2 0 1", "the PLY file has no faces"),
        (
            "1 0 0",
            "1 0",
            "a.ply:12: vertex 1 lacks numbers: its line ends in `z`",
        ),
        (
            "1 0 0",
            "1 x 0",
            "a.ply:12: vertex 1 has `x` in `y`, which is a float",
        ),
        (
            "1 0 0",
            "1 nan 0",
            "a.ply:12: the place of vertex 1 is not finite",
        ),
        (
            "1 0 0",
            "1 0 1e39",
            "a.ply:12: the place of vertex 1 is not finite",
        ),
        (
            "3 0 1 2",
            "3 0 1 3",
            "a.ply:14: face 0 uses vertex 3, but the file has 3, counted from 0",
        ),
        ("3 0 1 2", "3 0 -1 2", "a.ply:14: face 0 uses vertex -1"),
        (
            "3 0 1 2",
            "3 0 1.5 2",
            "face 0 has `1.5` in `vertex_indices`, which is a list",
        ),
        (
            "3 0 1 2",
            "300 0 1 2",
            "face 0 has `300` in `vertex_indices`",
        ),
        ("3 0 1 2", "-3 0 1 2", "face 0 has `-3` in `vertex_indices`"),
        (
            "3 0 1 2",
            "4 0 1 2",
            "face 0 lacks numbers: its line ends in `vertex_indices`",
        ),
        (
            "3 0 1 2 \n",
            "4 0 1 2",
            "a.ply:14: the file ends in face 0 of 1",
        ),
        ("end_header\n", "", "a.ply:14: the file ends in its header"),
    ];
    for (from, to, expected) in cases {
        let error = read_bytes(&changed(&[(from, to)]))
            .expect_err(to)
            .to_string();
        assert!(error.contains(expected), "{error}\nlacks {expected}");
    }
    let long = "x".repeat(1 << 20);
    let error = read_bytes(&changed(&[("float x", &long)])).expect_err("it is no type");
    assert!(error.to_string().len() < 200);
    let list = (
        "uchar int vertex_indices",
        "uchar int vertex_indices\nproperty list uchar float texcoord",
    );
    let error =
        read_bytes(&changed(&[list, ("3 0 1 2", "3 0 1 2 2 0.5 0.5")])).expect_err("too few");
    let expected = "face 0 has 2 numbers in `texcoord`, but two for each of 3 corners are needed";
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn binary_files_say_the_byte() {
    let mut elements = plain(&["list char int vertex_indices"]);
    elements[1].2[0][1] = 7.0;
    let file = written("binary_little_endian", &elements);
    let expected = format!(
        "face 0 uses vertex 7, but the file has 3, counted from 0, at byte {}",
        file.len() - 13
    );
    let error = read_bytes(&file).expect_err("out of range").to_string();
    assert!(error.contains(&expected), "{error}");
    let mut negative = file.clone();
    negative[file.len() - 13] = 0xff;
    let error = read_bytes(&negative)
        .expect_err("a negative count")
        .to_string();
    assert!(
        error.contains("face 0 has `-1` in `vertex_indices`"),
        "{error}"
    );
}

#[test]
fn what_is_left_over_is_told() {
    let unknown = changed(&[("comment made", "made by hand")]);
    let warnings = geometry(&unknown).warnings;
    assert_eq!(
        warnings[0].text("a.ply"),
        "a.ply:3: `made by hand` is no line of a header, left out"
    );
    let longer = changed(&[("1 0 0", "1 0 0 9"), ("0 1 0", "0 1 0 x")]);
    let warnings = geometry(&longer).warnings;
    let expected = "lines of more numbers than the header says, of which the last are left out: 2";
    assert_eq!(warnings[0].message, expected);
    let mut file = written(
        "binary_little_endian",
        &plain(&["list char int vertex_indices"]),
    );
    file.extend([7; 5]);
    let expected = "bytes after the last element of the header, left out: 5";
    assert_eq!(geometry(&file).warnings[0].message, expected);
}

#[test]
fn every_start_of_a_file_is_an_error_or_a_mesh() {
    for encoding in ENCODINGS {
        let file = written(encoding, &everything());
        let whole = geometry(&file).triangles.len();
        for end in 0..file.len() {
            let found = read_bytes(&file[..end]).map_or(0, |g| g.triangles.len());
            assert!(found <= whole, "{encoding} {end}");
        }
    }
}

#[test]
fn no_change_of_bytes_makes_a_reader_panic_or_take_much() {
    let mut random = impasto_fuzz::Random(23);
    for encoding in ENCODINGS {
        let file = written(encoding, &everything());
        for _ in 0..2000 {
            let mut bytes = file.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] = random.bits() as u8;
            }
            if let Ok(geometry) = read_bytes(&bytes) {
                assert!(geometry.triangles.capacity() <= 2 * bytes.len());
            }
        }
    }
}
