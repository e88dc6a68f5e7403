//! What the doc comments of noises, patterns and colors promise, held for every function of their
//! folders: the range in `Value: low .. high`, averages over boxes where there is a `width`, and
//! sound numbers for any arguments.

use impasto_compiler::ast::{Field, Function, Item, ItemKind, Module, Param};
use impasto_compiler::parser;
use impasto_compiler::source::FileId;
use impasto_stdlib::StdFile;

use super::lanes::{self, Lanes};
use super::text::Text;
use impasto_verify::statistics::Numbers;

/// Folders whose functions are held to what they say.
const FOLDERS: [&str; 3] = ["noise", "pattern", "color"];

/// How far beyond its range a value may be by rounding.
const SLACK: f64 = 2e-6;

/// Coordinates about which functions are looked at.
const PLACES: [f64; 6] = [0.0, -3.0, 1e3, 1e6, 1e12, -1e17];

/// A function of the library.
struct Promised {
    name: String,
    docs: String,
    params: Vec<Param>,
    /// What each number of the result is promised to lie between: as a function of its place.
    ranges: Vec<Range>,
    /// Does it say anything of its value, if only that it may be any?
    states: bool,
    text: Text,
}

#[derive(Clone, Copy, Debug)]
struct Range {
    low: f64,
    high: f64,
    /// Only as long as other parameters have their defaults.
    by_default: bool,
}

/// `Value: low .. high`, with `by default` behind it where parameters can change it.
fn stated(docs: &[String]) -> Option<Range> {
    let line = docs.iter().find_map(|l| l.trim().strip_prefix("Value: "))?;
    if line == "any" {
        return None;
    }
    let (low, rest) = line.split_once(" .. ").expect("low .. high");
    let (high, by_default) = match rest.split_once(' ') {
        Some((high, "by default")) => (high, true),
        Some(_) => panic!("`{line}`: after the range only `by default`"),
        None => (rest, false),
    };
    let number = |s: &str| s.parse::<f64>().unwrap_or_else(|_| panic!("`{line}`"));
    Some(Range {
        low: number(low),
        high: number(high),
        by_default,
    })
}

/// How many numbers a value of a type is.
fn width(ty: &str) -> Option<usize> {
    Some(match ty {
        "float" | "int" | "bool" | "angle" | "length" => 1,
        "vec2" => 2,
        "vec3" | "point" | "vector" | "normal" | "color" => 3,
        "vec4" | "mat2" => 4,
        _ => return None,
    })
}

const ANY: Range = Range {
    low: f64::MIN,
    high: f64::MAX,
    by_default: false,
};

/// The range of each number of a result; of a struct's, as its fields state it.
fn ranges(folder: &str, docs: &[String], result: &str) -> Vec<Range> {
    if let Some(n) = width(result) {
        return vec![stated(docs).unwrap_or(ANY); n];
    }
    let fields = fields(folder, result).into_iter();
    fields
        .flat_map(|f| ranges(folder, &f.docs, &f.ty.node))
        .collect()
}

/// The fields of a struct of a folder.
fn fields(folder: &str, name: &str) -> Vec<Field> {
    let mut items = impasto_stdlib::folder(folder).flat_map(|f| parsed(f).items);
    let found = items.find_map(|i| match i.kind {
        ItemKind::Struct(fields) if i.name.node == name => Some(fields),
        _ => None,
    });
    found.unwrap_or_else(|| panic!("no struct `{name}` in {folder}"))
}

/// Does a definition say anything of its value, if only that it may be any?
fn states(folder: &str, docs: &[String], result: &str) -> bool {
    docs.iter().any(|l| l.trim().starts_with("Value: "))
        || width(result).is_none()
            && fields(folder, result)
                .iter()
                .any(|f| states(folder, &f.docs, &f.ty.node))
}

fn parsed(file: &StdFile) -> Module {
    parser::parse(FileId(0), file.text).0
}

/// The functions of a file that take nothing but numbers.
fn of_file(file: &StdFile) -> Vec<Promised> {
    let ast = parsed(file);
    let functions = ast.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Function(f) if !item.private => Some((item, f)),
        _ => None,
    });
    let plain = functions.filter(|(_, f)| f.params.iter().all(|p| width(&p.ty.node).is_some()));
    plain
        .map(|(item, f)| Promised {
            name: format!("{}::{}", file.folder, item.name.node),
            docs: item.docs.join(" "),
            params: f.params.clone(),
            states: states(file.folder, &item.docs, &f.result.node),
            ranges: ranges(file.folder, &item.docs, &f.result.node),
            text: Text::new(&calls(file, item, f)),
        })
        .collect()
}

/// `bare`: what has no default; `wide`: that and the width; `all`: every parameter.
fn calls(file: &StdFile, item: &Item, f: &Function) -> String {
    let (name, result) = (&item.name.node, &f.result.node);
    let mut text = match width(result) {
        Some(_) => format!("use std::{}::{name};\n", file.folder),
        None => format!("use std::{}::{{{name}, {result}}};\n", file.folder),
    };
    let needed = |p: &Param| p.default.is_none();
    type Keep<'a> = &'a dyn Fn(&Param) -> bool;
    let forms: [(&str, Keep<'_>); 3] = [
        ("bare", &needed),
        ("wide", &|p| needed(p) || p.name.node == "width"),
        ("all", &|_| true),
    ];
    for (form, keep) in forms {
        let kept = || f.params.iter().filter(|p| keep(p));
        let params: Vec<_> = kept()
            .map(|p| format!("{}: {}", p.name.node, p.ty.node))
            .collect();
        let args: Vec<_> = kept().map(|p| format!("{0}: {0}", p.name.node)).collect();
        text += &format!(
            "fn {form}_({}) -> {result} = {name}({});\n",
            params.join(", "),
            args.join(", ")
        );
    }
    text
}

fn promised() -> Vec<Promised> {
    let files = FOLDERS.iter().flat_map(|f| impasto_stdlib::folder(f));
    let mut all: Vec<_> = files.flat_map(of_file).collect();
    // A function that promises nothing is a helper's own.
    all.retain(|f| f.states);
    assert!(all.len() > 40, "only {} functions", all.len());
    all
}

/// A width that is asked for by default is a helper's own.
fn is_optional_width(p: Option<&Param>) -> bool {
    p.is_some_and(|p| p.name.node == "width" && p.default.is_some())
}

impl Promised {
    fn filters(&self) -> bool {
        is_optional_width(self.params.last())
    }

    /// Arguments for what has no default: coordinates about a place, numbers from 0 to 1.
    fn needed(&self, n: &mut Numbers, about: f64, spread: f64) -> Vec<Vec<f64>> {
        let needed = self.params.iter().filter(|p| p.default.is_none());
        needed.map(|p| argument(n, p, about, spread)).collect()
    }

    fn call(&self, form: &str, args: &[Vec<f64>]) -> Vec<f64> {
        let args: Vec<&[f64]> = args.iter().map(Vec::as_slice).collect();
        self.text.call::<f32>(form, &args)
    }

    /// What is wrong with a result.
    fn fault(&self, value: &[f64], defaults: bool) -> Option<String> {
        assert_eq!(value.len(), self.ranges.len(), "{}", self.name);
        value.iter().zip(&self.ranges).find_map(|(&v, range)| {
            let held = defaults || !range.by_default;
            let within = v >= range.low - SLACK && v <= range.high + SLACK;
            let sound = v.is_finite() && (!held || within);
            (!sound).then(|| format!("{v} is not in {} .. {}", range.low, range.high))
        })
    }
}

fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// A tame value for a parameter.
fn argument(n: &mut Numbers, p: &Param, about: f64, spread: f64) -> Vec<f64> {
    let count = width(&p.ty.node).expect("a plain type");
    let one = |n: &mut Numbers| match p.ty.node.as_str() {
        "bool" => n.unit().round(),
        "int" => n.between(0.0, 9.0).floor(),
        "color" => single(n.unit()),
        "angle" => single(n.between(-4.0, 4.0)),
        "normal" => single(n.between(-1.0, 1.0)),
        _ => single(about + n.between(-spread, spread)),
    };
    (0..count).map(|_| one(n)).collect()
}

/// Numbers that break formulas.
fn wild(n: &mut Numbers, p: &Param) -> Vec<f64> {
    const FLOATS: [f64; 12] = [
        0.0, 1.0, -1.0, 0.5, 1e-30, -1e-7, 1e6, -1e9, 1e17, -1e17, 2.0, 0.3,
    ];
    const INTS: [f64; 6] = [0.0, 1.0, -1.0, 5.0, 2_147_483_647.0, -2_147_483_648.0];
    let pick = |n: &mut Numbers, of: &[f64]| of[(n.unit() * of.len() as f64) as usize];
    let count = width(&p.ty.node).expect("a plain type");
    (0..count)
        .map(|_| match p.ty.node.as_str() {
            "bool" => n.unit().round(),
            "int" => pick(n, &INTS),
            "color" => n.unit(),
            _ => single(pick(n, &FLOATS)),
        })
        .collect()
}

#[test]
fn values_keep_to_the_ranges_that_are_stated() {
    super::each_in_parallel(&promised(), |_, f| {
        let mut n = Numbers::new(1);
        let mut faults = Vec::new();
        for about in PLACES {
            for _ in 0..25 {
                let mut args = f.needed(&mut n, about, 4f64.max(about.abs() * 1e-5));
                let bare = f.call("bare_", &args);
                if f.filters() {
                    let width = f.params.last().expect("a width");
                    let scale = 10f64.powf(n.between(-8.0, 8.0));
                    let sides = argument(&mut n, width, 0.0, 1.0);
                    args.push(sides.iter().map(|x| single(x.abs() * scale)).collect());
                }
                let wide = f.call("wide_", &args);
                for value in [&bare, &wide] {
                    let fault = f.fault(value, true);
                    faults.extend(fault.map(|m| format!("{m} at {args:?}")));
                }
            }
        }
        faults.truncate(3);
        (f.name.clone(), faults)
    });
}

#[test]
fn values_are_sound_whatever_the_arguments() {
    super::each_in_parallel(&promised(), |_, f| {
        let mut n = Numbers::new(2);
        let mut faults = Vec::new();
        for turn in 0..100 {
            let draw = |p: &Param| match turn % 2 {
                0 => wild(&mut n, p),
                _ => argument(&mut n, p, 0.0, 3.0),
            };
            let args: Vec<Vec<f64>> = f.params.iter().map(draw).collect();
            let fault = f.fault(&f.call("all_", &args), false);
            faults.extend(fault.map(|m| format!("{m} with {args:?}")));
        }
        faults.truncate(3);
        (f.name.clone(), faults)
    });
}

#[test]
fn values_are_the_same_in_both_precisions() {
    super::each_in_parallel(&promised(), |_, f| {
        let mut n = Numbers::new(3);
        let mut far = 0;
        for _ in 0..200 {
            let args = f.needed(&mut n, 0.0, 20.0);
            let slices: Vec<&[f64]> = args.iter().map(Vec::as_slice).collect();
            let [a, b] = [
                f.text.call::<f32>("bare_", &slices),
                f.text.call::<f64>("bare_", &slices),
            ];
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 2e-4 * b.abs().max(1.0);
            far += usize::from(!a.iter().zip(&b).all(near));
        }
        // At borders, rounding decides on which side a place is.
        let fault = (far > 4).then(|| format!("{far} of 200 values differ"));
        (f.name.clone(), fault.into_iter().collect())
    });
}

/// The mean of a function over a box around its first argument, by points at random in its cells.
fn mean(f: &Promised, n: &mut Numbers, args: &[Vec<f64>], sides: &[f64]) -> f64 {
    let cells: usize = match sides.len() {
        1 => 512,
        2 => 64,
        _ => 16,
    };
    let count = cells.pow(sides.len() as u32);
    let mut place = |cell: usize, axis: usize| {
        let step = (cell / cells.pow(axis as u32)) % cells;
        args[0][axis] + ((step as f64 + n.unit()) / cells as f64 - 0.5) * sides[axis]
    };
    let columns = (0..sides.len())
        .map(|axis| lanes::floats((0..count).map(|cell| place(cell, axis)).collect()))
        .collect();
    let rest = args[1..].iter().map(|a| lanes::uniform(a));
    let all: Vec<Lanes<f64>> = std::iter::once(columns).chain(rest).collect();
    let out = lanes::call(f.text.module, f.text.id("bare_"), all);
    let last = value_of(f, out.len());
    let one = |l: usize| lanes::float_at(&out, last, l);
    (0..count).map(one).sum::<f64>() / count as f64
}

/// Which number of a result is looked at: of a color the first, of a struct the last.
fn value_of(f: &Promised, count: usize) -> usize {
    if f.ranges.len() == 3 { 0 } else { count - 1 }
}

/// Patterns that are averaged over a box, with the greatest and the mean error that is allowed:
/// those that say `exactly` are, up to what the mean by points is off itself.
fn averaged() -> Vec<(Promised, f64, f64)> {
    let all = promised().into_iter();
    let filtering = all.filter(|f| f.name.starts_with("pattern") && f.filters());
    let bounded = filtering.map(|f| {
        let exact = f.docs.contains("exactly");
        let (most, typical) = if exact { (0.03, 0.006) } else { (0.25, 0.04) };
        (f, most, typical)
    });
    let found: Vec<_> = bounded.collect();
    assert!(found.len() > 20, "only {} patterns filter", found.len());
    found
}

#[test]
fn filtered_patterns_are_means_over_boxes() {
    super::each_in_parallel(&averaged(), |_, (f, most, typical)| {
        let mut n = Numbers::new(4);
        let (mut worst, mut sum, mut place) = (0.0f64, 0.0, String::new());
        const TRIES: usize = 24;
        for turn in 0..TRIES {
            let args = f.needed(&mut n, 0.5, if turn % 2 == 0 { 0.5 } else { 3.0 });
            // From points to several periods of a pattern.
            let scale = 10f64.powf(-2.5 + 3.5 * turn as f64 / TRIES as f64);
            let sides: Vec<f64> = args[0]
                .iter()
                .map(|_| single(scale * n.between(0.5, 1.0)))
                .collect();
            let expected = mean(f, &mut n, &args, &sides);
            let wide = [args.clone(), vec![sides.clone()]].concat();
            let found = f.call("wide_", &wide);
            let error = (found[value_of(f, found.len())] - expected).abs();
            sum += error / TRIES as f64;
            if error > worst {
                (worst, place) = (error, format!("{args:?} over {sides:?}"));
            }
        }
        let bad = worst > *most || sum > *typical;
        let fault = bad.then(|| format!("off by {worst:.4}, {sum:.4} on average, at {place}"));
        (f.name.clone(), fault.into_iter().collect())
    });
}

#[test]
fn every_file_of_these_folders_states_a_range() {
    let promised = promised();
    for file in FOLDERS.iter().flat_map(|f| impasto_stdlib::folder(f)) {
        let (ast, name) = (parsed(file), format!("{}::{}", file.folder, file.name));
        let main = ast.items.iter().find(|i| i.name.node == file.name);
        let Some(ItemKind::Function(f)) = main.map(|i| &i.kind) else {
            panic!("{name} does not define what it is named after");
        };
        // Normals, directions and places have no range, nor what is not a number.
        let plain = f.params.iter().all(|p| width(&p.ty.node).is_some());
        let open = !["float", "color", "vec3", "vec4"].contains(&f.result.node.as_str());
        assert!(
            !plain || open || promised.iter().any(|p| p.name == name),
            "{name} does not state its range"
        );
    }
}
