//! A pass over the lines of an OBJ file: it checks them, and writes a copy of what tobj is to parse.
//!
//! A large file is scanned in pieces, side by side. What a line means depends on those before it in three ways: by how
//! many vertices there are, which negative indices count back from; by the material that `usemtl` named last; and by the
//! object and the group that are open. The first is counted beforehand, the others are settled when pieces are joined.

use std::fmt::Write;
use std::path::Path;

use crate::error::SceneError;
use crate::parallel;
use crate::scene::formats::Part;

/// The three lists that faces index, in the order of indices in `1/2/3`.
const LISTS: [&str; 3] = ["vertex", "texture coordinate", "normal"];
/// The statements that add to them.
const KEYS: [&str; 3] = ["v", "vt", "vn"];
/// The numbers that each must have at least.
const NEEDED: [usize; 3] = [3, 1, 3];

/// The color of vertices that have none in a file in which others have.
const WHITE: &str = " 1 1 1";

/// What a pass over a file finds.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Scan {
    /// `v`, `vt` and `vn` lines, in pieces; faces may come before what they use.
    pub vertices: Vec<String>,
    /// `f` lines with absolute indices, in pieces.
    pub faces: Vec<String>,
    /// What is known of each triangle beside its corners.
    pub triangles: Vec<Attributes>,
    /// In order of first use.
    pub materials: Vec<String>,
    /// What `o` and `g` lines name.
    pub parts: Vec<Part>,
    pub mtl_files: Vec<String>,
    /// Faces with fewer than three corners, which are left out.
    pub degenerate_faces: usize,
}

/// Of a triangle: whether all corners of its face have texture coordinates, and normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Attributes {
    pub uvs: bool,
    pub normals: bool,
    /// Index into [`Scan::materials`].
    pub material: usize,
}

impl Scan {
    /// Scans a text in pieces of about so many `bytes`.
    ///
    /// # Errors
    /// The first line that is wrong.
    pub(super) fn new(path: &Path, text: &str, bytes: usize) -> Result<Self, SceneError> {
        let pieces = pieces(text, bytes);
        let mut before = Before::default();
        let mut begun = Vec::new();
        for (own, piece) in parallel::map(&pieces, |piece| Before::counted(piece))
            .into_iter()
            .zip(pieces)
        {
            begun.push((before, piece));
            before = before.and(own);
        }
        let scanned = parallel::map(&begun, |(before, text)| Piece::new(path, *before, text));
        let mut pieces = scanned.into_iter().collect::<Result<Vec<Piece<'_>>, _>>()?;
        check_ranges(path, before.counts, &pieces)?;
        if pieces.iter().any(|piece| piece.colored) {
            let plain = pieces.iter_mut().filter(|piece| !piece.colored);
            plain.for_each(Piece::color_before);
        }
        Ok(Self::joined(pieces))
    }

    fn joined(pieces: Vec<Piece<'_>>) -> Self {
        let mut scan = Self::default();
        let mut current = String::new();
        // The object and the group that faces belong to, as indices of parts.
        let mut open: [Option<usize>; 2] = [None; 2];
        for piece in pieces {
            let first = scan.triangles.len();
            let begins_in_it = piece.triangles.first().is_some_and(|of| of.1.is_none());
            let inherited = if begins_in_it {
                scan.material(&current)
            } else {
                0
            };
            let names = piece.materials.iter();
            let indices: Vec<usize> = names.map(|name| scan.material(name)).collect();
            let settled = piece
                .triangles
                .iter()
                .map(|&([uvs, normals], material)| Attributes {
                    uvs,
                    normals,
                    material: material.map_or(inherited, |index| indices[index]),
                });
            scan.triangles.extend(settled);
            for Begun {
                is_object,
                name,
                at,
            } in piece.parts
            {
                let at = first + at;
                let ended = usize::from(!is_object);
                scan.end(&mut open[ended..], at);
                open[ended] = Some(scan.parts.len());
                scan.parts.push(Part {
                    name,
                    triangles: at..at,
                });
            }
            current = piece.current.unwrap_or(current);
            scan.vertices.push(piece.vertices);
            scan.faces.push(piece.faces);
            scan.mtl_files.extend(piece.mtl_files);
            scan.degenerate_faces += piece.degenerate_faces;
        }
        scan.end(&mut open, scan.triangles.len());
        scan.parts.retain(|part| !part.triangles.is_empty());
        scan
    }

    /// Ends parts before the triangle `at`.
    fn end(&mut self, open: &mut [Option<usize>], at: usize) {
        for part in open.iter_mut().filter_map(Option::take) {
            self.parts[part].triangles.end = at;
        }
    }

    /// The index of a material.
    fn material(&mut self, name: &str) -> usize {
        index_of(&mut self.materials, name)
    }
}

/// The index of a name among others, which it joins if it is not there.
fn index_of(names: &mut Vec<String>, name: &str) -> usize {
    let known = names.iter().position(|known| known == name);
    known.unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    })
}

/// A text in pieces of whole lines.
fn pieces(mut text: &str, bytes: usize) -> Vec<&str> {
    let mut pieces = Vec::new();
    while text.len() > bytes {
        let line_end = text.as_bytes()[bytes..].iter().position(|b| *b == b'\n');
        let (piece, rest) = text.split_at(line_end.map_or(text.len(), |end| bytes + end + 1));
        pieces.push(piece);
        text = rest;
    }
    pieces.push(text);
    pieces
}

/// A line without its comment.
fn statement(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim()
}

/// The keyword of a statement, and what follows.
fn key(statement: &str) -> (&str, &str) {
    let both = statement.split_once(char::is_whitespace);
    both.unwrap_or((statement, ""))
}

/// What lies before a line: lines, and entries of the three lists.
#[derive(Clone, Copy, Default)]
struct Before {
    lines: usize,
    counts: [usize; 3],
}

impl Before {
    /// What is in a piece.
    fn counted(piece: &str) -> Self {
        let mut counted = Self::default();
        for line in piece.lines() {
            counted.lines += 1;
            if !line.trim_start().starts_with('v') {
                continue;
            }
            let (key, _) = key(statement(line));
            if let Some(list) = KEYS.iter().position(|k| *k == key) {
                counted.counts[list] += 1;
            }
        }
        counted
    }

    fn and(self, other: Self) -> Self {
        Self {
            lines: self.lines + other.lines,
            counts: std::array::from_fn(|list| self.counts[list] + other.counts[list]),
        }
    }
}

/// An object or a group that begins with the triangle `at` of a piece.
struct Begun {
    is_object: bool,
    name: String,
    at: usize,
}

/// What a pass over a piece finds.
struct Piece<'p> {
    path: &'p Path,
    vertices: String,
    faces: String,
    /// Entries of the lists so far, those before the piece included.
    counts: [usize; 3],
    /// Do the `v` lines of `vertices` have colors?
    colored: bool,
    /// The largest index into each list, and the first line that has it.
    largest: [(usize, usize); 3],
    /// For each triangle whether all corners have texture coordinates and normals, and its material as an index of
    /// `materials`; none if that is the one that `usemtl` named before the piece.
    triangles: Vec<([bool; 2], Option<usize>)>,
    /// In order of first use.
    materials: Vec<String>,
    /// What `usemtl` said last, and its index once it is used.
    current: Option<String>,
    material: Option<usize>,
    parts: Vec<Begun>,
    mtl_files: Vec<String>,
    degenerate_faces: usize,
}

impl<'p> Piece<'p> {
    fn new(path: &'p Path, before: Before, text: &str) -> Result<Self, SceneError> {
        let mut piece = Piece {
            path,
            // Either may be nearly all of the text. What they do not use is never touched.
            vertices: String::with_capacity(text.len()),
            faces: String::with_capacity(text.len()),
            counts: before.counts,
            colored: false,
            largest: [(0, 0); 3],
            triangles: Vec::new(),
            materials: Vec::new(),
            current: None,
            material: None,
            parts: Vec::new(),
            mtl_files: Vec::new(),
            degenerate_faces: 0,
        };
        for (index, line) in text.lines().enumerate() {
            piece.line(before.lines + index + 1, line)?;
        }
        Ok(piece)
    }

    fn line(&mut self, number: usize, line: &str) -> Result<(), SceneError> {
        let statement = statement(line);
        if statement.ends_with('\\') {
            let message = "the line goes on in the next, which is not supported";
            let error = error(self.path, number, message);
            return Err(error.hint("join lines that end in `\\`"));
        }
        let (key, rest) = key(statement);
        if let Some(list) = KEYS.iter().position(|k| *k == key) {
            return self.vertex(number, list, rest);
        }
        match key {
            "f" => return self.face(number, rest),
            "usemtl" => {
                self.current = Some(rest.trim().to_owned());
                self.material = None;
            }
            "o" | "g" => self.parts.push(Begun {
                is_object: key == "o",
                name: rest.trim().to_owned(),
                at: self.triangles.len(),
            }),
            "mtllib" => self.mtl_files.push(rest.trim().replace('\\', "/")),
            _ => {}
        }
        Ok(())
    }

    /// A line of numbers. A fourth number of `v` divides the others, and three more are a color; third texture
    /// coordinates are left out.
    fn vertex(&mut self, line: usize, list: usize, rest: &str) -> Result<(), SceneError> {
        self.counts[list] += 1;
        let (key, needed) = (KEYS[list], NEEDED[list]);
        let what = || format!("{} {}", LISTS[list], self.counts[list]);
        let wrong = |message: String| error(self.path, line, message);
        let mut words = [""; 6];
        for (place, word) in words.iter_mut().zip(rest.split_whitespace()) {
            *place = word;
        }
        let has_weight = key == "v" && !words[3].is_empty() && words[4].is_empty();
        let has_color = key == "v" && !words[5].is_empty();
        let kept = match key {
            "vt" => 2,
            _ if has_color => 6,
            _ => 3,
        };
        let read = kept + usize::from(has_weight);
        let mut values = [0.0f64; 6];
        for (found, word) in words[..read].iter().enumerate() {
            if word.is_empty() && found < needed {
                let message = format!("{} has {found} of {needed} numbers", what());
                return Err(wrong(message).hint("is the file complete?"));
            }
            let word = if word.is_empty() { "0" } else { word };
            values[found] = word
                .parse()
                .map_err(|_| wrong(format!("{} has `{word}` where a number should be", what())))?;
        }
        let weight = if has_weight { values[3] } else { 1.0 };
        let is_finite = |v: &f64| ((v / weight) as f32).is_finite();
        if !values[..kept].iter().all(is_finite) {
            return Err(wrong(format!("{} is not finite: {}", what(), rest.trim())));
        }
        if has_color && !self.colored {
            self.color_before();
        }
        self.vertices += key;
        for (word, value) in words[..kept].iter().zip(values) {
            self.vertices.push(' ');
            match word {
                _ if has_weight => self.vertices += &(value / weight).to_string(),
                &"" => self.vertices.push('0'),
                word => self.vertices += word,
            }
        }
        if key == "v" && self.colored && !has_color {
            self.vertices += WHITE;
        }
        self.vertices.push('\n');
        Ok(())
    }

    /// Gives the vertices so far, which have no color, white, since tobj wants all or none.
    fn color_before(&mut self) {
        self.colored = true;
        let mut vertices = String::with_capacity(2 * self.vertices.len());
        for line in self.vertices.lines() {
            vertices += line;
            if line.starts_with("v ") {
                vertices += WHITE;
            }
            vertices.push('\n');
        }
        self.vertices = vertices;
    }

    fn face(&mut self, line: usize, rest: &str) -> Result<(), SceneError> {
        let start = self.faces.len();
        self.faces.push('f');
        let (mut corners, mut has) = (0, [true; 2]);
        for word in rest.split_whitespace() {
            let corner = self.corner(line, word)?;
            corners += 1;
            has[0] &= corner[1].is_some();
            has[1] &= corner[2].is_some();
            self.faces.push(' ');
            if corner.iter().all(Option::is_some) && !word.contains('-') {
                self.faces += word;
                continue;
            }
            for (index, separator) in corner.iter().zip(["/", "/", ""]) {
                if let Some(index) = index {
                    let _ = write!(self.faces, "{index}");
                }
                self.faces += separator;
            }
        }
        self.faces.push('\n');
        if corners < 3 {
            self.faces.truncate(start);
            self.degenerate_faces += 1;
            return Ok(());
        }
        if let (Some(name), None) = (&self.current, self.material) {
            self.material = Some(index_of(&mut self.materials, name));
        }
        let triangles = std::iter::repeat_n((has, self.material), corners - 2);
        self.triangles.extend(triangles);
        Ok(())
    }

    /// The absolute indices, from 1, of `1/2/3`, `1//3`, `1/2` or `1`.
    fn corner(&mut self, line: usize, word: &str) -> Result<[Option<usize>; 3], SceneError> {
        let mut indices = [None; 3];
        for (list, text) in word.split('/').enumerate() {
            let malformed = || {
                let error = error(self.path, line, format!("`{word}` is no corner of a face"));
                error.hint("corners are written 1, 1/2, 1//3 or 1/2/3")
            };
            if list > 2 || (list == 0 && text.is_empty()) {
                return Err(malformed());
            }
            if text.is_empty() {
                continue;
            }
            let index: i64 = text.parse().map_err(|_| malformed())?;
            let count = self.counts[list];
            let absolute = match index {
                1.. => usize::try_from(index).ok(),
                _ => usize::try_from(count as i64 + 1 + index)
                    .ok()
                    .filter(|&i| i > 0 && index < 0),
            };
            let Some(absolute) = absolute else {
                return Err(out_of_range(self.path, line, list, index, count));
            };
            if absolute > self.largest[list].0 {
                self.largest[list] = (absolute, line);
            }
            indices[list] = Some(absolute);
        }
        Ok(indices)
    }
}

/// No index may be beyond its list in the whole file.
fn check_ranges(path: &Path, counts: [usize; 3], pieces: &[Piece<'_>]) -> Result<(), SceneError> {
    for (list, count) in counts.into_iter().enumerate() {
        let mut largest = (0, 0);
        for piece in pieces.iter().filter(|piece| piece.largest[list].0 > 0) {
            if piece.largest[list].0 > largest.0 {
                largest = piece.largest[list];
            }
        }
        let (index, line) = largest;
        if index > count {
            return Err(out_of_range(path, line, list, index as i64, count));
        }
    }
    Ok(())
}

fn error(path: &Path, line: usize, message: impl Into<String>) -> SceneError {
    SceneError::in_file(path, message).line(line)
}

fn out_of_range(path: &Path, line: usize, list: usize, index: i64, count: usize) -> SceneError {
    let what = LISTS[list];
    let message = format!("the face uses {what} {index}, but the file has {count}");
    error(path, line, message).hint("indices start at 1; negative ones count back from the latest")
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "\
mtllib a.mtl
v 0 0 0
v 1 0 0
v 0 1 0 # a comment
f 1 2 3
vt 0 0
vn 0 0 1
o box
usemtl red
f -3//1 -2//1 -1//1
f 1 2
g side
v 1 1 0 1 0 0
usemtl blue
usemtl red
f 1/1/1 2/1/1 4/1/1 3/1/1
g
f 1 2 3
o last
v 2 2 0 2
usemtl blue
f -1 1 2
f 1 2 3
";

    fn scan(text: &str, bytes: usize) -> Result<Scan, SceneError> {
        Scan::new(Path::new("a.obj"), text, bytes)
    }

    #[test]
    fn pieces_of_any_size_say_the_same_of_a_file() {
        let whole = scan(FILE, FILE.len()).expect("it is legal");
        assert_eq!(whole.materials, ["", "red", "blue"]);
        let of = |t: &Attributes| (t.uvs, t.normals, t.material);
        assert_eq!(
            whole.triangles.iter().map(of).collect::<Vec<_>>(),
            [
                (false, false, 0),
                (false, true, 1),
                (true, true, 1),
                (true, true, 1),
                (false, false, 1),
                (false, false, 2),
                (false, false, 2),
            ]
        );
        let parts: Vec<_> = whole
            .parts
            .iter()
            .map(|p| (&p.name[..], p.triangles.clone()))
            .collect();
        assert_eq!(
            parts,
            [("box", 1..5), ("side", 2..4), ("", 4..5), ("last", 5..7)]
        );
        assert_eq!(
            (whole.degenerate_faces, &whole.mtl_files[..]),
            (1, &["a.mtl".to_owned()][..])
        );
        assert_eq!(
            whole.vertices.concat(),
            "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nvt 0 0\nvn 0 0 1\nv 1 1 0 1 0 0\nv 1 1 0 1 1 1\n"
        );
        for bytes in 0..FILE.len() {
            let pieces = scan(FILE, bytes).expect("it is legal");
            assert!(bytes > 200 || pieces.faces.len() > 1);
            let joined = Scan {
                vertices: vec![pieces.vertices.concat()],
                faces: vec![pieces.faces.concat()],
                ..pieces
            };
            assert_eq!(joined, whole, "{bytes}");
        }
    }

    #[test]
    fn the_first_line_that_is_wrong_is_told_whatever_the_pieces() {
        for (line, message) in [
            ("f 1 2 9", "the face uses vertex 9, but the file has 5"),
            ("f -9 1 2", "the face uses vertex -9, but the file has 5"),
            ("v 1 x 2", "vertex 6 has `x` where a number should be"),
            ("f 1/2/3/4 1 1", "`1/2/3/4` is no corner of a face"),
        ] {
            let text = format!("{FILE}{line}\nf 1 2 3\n{line}\n");
            for bytes in [0, 20, 100, text.len()] {
                let error = scan(&text, bytes).expect_err(line).to_string();
                assert!(error.contains(message), "{error}");
                assert!(error.contains(":24"), "{error}");
            }
        }
    }
}
