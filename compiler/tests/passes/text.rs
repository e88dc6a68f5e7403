//! Text that is printed can be read, and printed again it is the same text; what is no IR is told
//! apart, with its place.

use impasto_compiler::ir::parse::{MAX_NESTING, parse};
use impasto_compiler::ir::print;
use impasto_compiler::source::FileId;

use super::lowered::{Files, checked, material_files};

#[test]
fn text_of_every_material_survives_reading() {
    for path in material_files() {
        let checked = checked(&path, &mut Files);
        let text = print::module(&checked.ir, &checked.checked);
        let parsed = parse(FileId(0), &text).unwrap_or_else(|e| panic!("{path}: {e}"));
        assert_eq!(parsed.materials.len(), checked.checked.len(), "{path}");
        let again = print::module(&parsed.module, &parsed.materials);
        assert!(
            again == text,
            "{path}: the text changes when it is read and printed again"
        );
        // What a user sees leaves out what the file does not reach, and can be read as well.
        let materials: Vec<_> = checked.checked.iter().collect();
        let shown = print::reachable(&checked.ir, None, &materials);
        let parsed = parse(FileId(0), &shown).unwrap_or_else(|e| panic!("{path}: {e}"));
        assert_eq!(
            print::module(&parsed.module, &parsed.materials),
            shown,
            "{path}"
        );
    }
}

/// Reads and prints.
fn reprinted(text: &str) -> String {
    let parsed = parse(FileId(0), text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    print::module(&parsed.module, &parsed.materials)
}

#[test]
fn everything_that_can_be_written_survives_reading() {
    let text = include_str!("everything.ir");
    assert_eq!(reprinted(text), text);
}

#[test]
fn numbers_follow_the_order_of_evaluation() {
    let text = "fn f(x: float) -> float { %7: float = neg x %3: float = abs %7 return %3 }";
    let expected = "fn f(x: float) -> float {\n    %0: float = neg x\n    %1: float = abs %0\n    return %1\n}\n";
    assert_eq!(reprinted(text), expected);
}

#[test]
fn names_that_occur_twice_are_numbered() {
    let mut parsed = parse(
        FileId(0),
        "fn f() -> int { return 1 } fn g() -> int { return 2 }",
    )
    .expect("IR");
    parsed.module.functions[1].name = "f".into();
    let text = print::module(&parsed.module, &[]);
    assert!(text.contains("fn f#2()"), "{text}");
    assert_eq!(reprinted(&text), text);
}

/// Each text is refused at a line and column, with words that contain these.
#[test]
fn what_is_no_ir_is_refused_with_its_place() {
    let cases = [
        ("fn f() -> float { return 1 }", 1, 1, "1 is Int, not Float"),
        (
            "fn f() -> float {\n    return %0\n}",
            2,
            12,
            "used before it is evaluated",
        ),
        (
            "fn f() -> real { return 1.0 }",
            1,
            11,
            "unknown type `real`",
        ),
        ("fn f() -> int { return 4294967296 }", 1, 24, "32 bits"),
        ("fn f() -> float { return 1e999 }", 1, 26, "finite float"),
        (
            "fn f() -> float { %0: float = bend 1.0 return %0 }",
            1,
            31,
            "unknown operation",
        ),
        (
            "fn f() -> int { %0: int = hash 1, 2, 3, 4 return %0 }",
            1,
            27,
            "4 operands",
        ),
        (
            "fn f() -> int { %0: int = add 1, 2.0 return %0 }",
            1,
            17,
            "do not give Int",
        ),
        (
            "fn f() -> int { %0: int = call f() return %0 }",
            1,
            32,
            "unknown function",
        ),
        (
            "fn f() -> int { return 1 } fn f() -> int { return 1 }",
            1,
            31,
            "defined twice",
        ),
        ("struct S { a: S }", 1, 15, "unknown type `S`"),
        ("struct S { }", 1, 1, "0 fields"),
        (
            "fn f(a: int, a: int) -> int { return a }",
            1,
            14,
            "there twice",
        ),
        (
            "fn f() -> int { break return 1 }",
            1,
            1,
            "a jump outside of loops",
        ),
        (
            "fn f() -> int { loop limit 0 { } while true { } return 1 }",
            1,
            1,
            "no turns",
        ),
        (
            "fn f() -> int { loop limit 2 { break } while true { } return 1 }",
            1,
            1,
            "in the head of one",
        ),
        (
            "fn f() -> int { var @0.x: float for @0.x in 0 .. 1 { } return 1 }",
            1,
            1,
            "not an int",
        ),
        (
            "fn f() -> int { var @0.i: int for @0.i in 0 .. 1 { @0.i = 5 } return 1 }",
            1,
            1,
            "counter @0 is assigned",
        ),
        (
            "fn f() -> int { var @0.i: int for @0.i in 0 .. 1 { } %0: int = load @0.i return %0 }",
            1,
            54,
            "read outside its loop",
        ),
        (
            "fn f() -> int { var @0.v: vec2 @0.v.z = 1.0 return 1 }",
            1,
            1,
            "no component 2",
        ),
        (
            "fn f() -> int { var @0.v: vec2 @0.v = 1.0 return 1 }",
            1,
            1,
            "not Vec2",
        ),
        (
            "fn f() -> int { if true { %0: int = hash 1 } return %0 }",
            1,
            1,
            "before it is evaluated",
        ),
        (
            "fn f(x: float) -> float { %0: float = x.y return %0 }",
            1,
            27,
            "do not give Float",
        ),
        ("edf e() { emit = glow }", 1, 18, "unknown function `glow`"),
        (
            "fn g(w: float) -> vec3 { return (0.0, 0.0, 0.0) } edf e() { emit = g }",
            1,
            51,
            "a method",
        ),
        (
            "material m() { surface = lobe clay() }",
            1,
            31,
            "unknown bsdf or edf",
        ),
        (
            "material m() { uniform $0 a: float = 1 }",
            1,
            24,
            "the default of `a`",
        ),
        (
            "fn f() -> float { uniform $0: float table #0: float %0: float = add $0, #0 return %0 }",
            1,
            1,
            "what hoisting made of them",
        ),
        ("fn f() -> float { return #0 }", 1, 26, "unknown table `#0`"),
        (
            "material m() { table #0: float opacity = #0 }",
            1,
            16,
            "unexpected `table`",
        ),
        (
            "material m() { opacity = 1.0 opacity = 1.0 }",
            1,
            30,
            "`opacity` is there twice",
        ),
        (
            "material m() { opacity = true }",
            1,
            26,
            "operand of an output",
        ),
        ("fn f() -> int { return é }", 1, 24, "unknown character"),
        ("texture \"a", 1, 9, "does not end"),
    ];
    for (text, line, column, words) in cases {
        match parse(FileId(0), text) {
            Ok(_) => panic!("accepted: {text}"),
            Err(e) => {
                let all = e.to_string();
                assert!(all.contains(words), "{text}\n{all}");
                assert_eq!((e.line, e.column), (line, column), "{text}\n{all}");
            }
        }
    }
}

#[test]
fn deep_nesting_is_refused() {
    let deep = |n: usize| {
        let (open, close) = ("if true { ".repeat(n), "} ".repeat(n));
        format!("fn f() -> int {{ {open}{close} return 1 }}")
    };
    assert!(parse(FileId(0), &deep(MAX_NESTING)).is_ok());
    let refused = parse(FileId(0), &deep(MAX_NESTING + 1)).expect_err("too deep");
    assert!(refused.to_string().contains("nest too deeply"), "{refused}");
    let layers = format!("material m() {{ surface = {} }}", "layer ".repeat(100_000));
    let refused = parse(FileId(0), &layers).expect_err("too deep");
    assert!(refused.to_string().contains("nest too deeply"), "{refused}");
}
