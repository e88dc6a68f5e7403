//! Long sources of every shape whose work may grow faster than they do. Each generator fills as many
//! bytes as it is asked for, so that what takes four times as long at twice the size is found.
//!
//! `cargo run --release -p impasto-fuzz --bin long` says what each takes;
//! `compiler/tests/limits.rs` holds them to bounds.

/// Sources of one shape, of any size.
pub struct Shape {
    /// What they are made of.
    pub name: &'static str,
    make: fn(Room) -> String,
}

impl Shape {
    /// A source of at most `bytes` bytes, and not many fewer; longer only where the frame alone is.
    #[must_use]
    pub fn source(&self, bytes: usize) -> String {
        (self.make)(Room(bytes))
    }
}

/// The shape of that name.
#[must_use]
pub fn shape(name: &str) -> Option<&'static Shape> {
    SHAPES.iter().find(|s| s.name == name)
}

/// How many bytes a source may have.
#[derive(Clone, Copy)]
struct Room(usize);

impl Room {
    /// `part(0)`, `part(1)`, ... as long as they fit, and how many they are.
    fn count(self, part: impl Fn(usize) -> String) -> (String, usize) {
        let (mut out, mut n) = (String::new(), 0);
        loop {
            let next = part(n);
            if out.len() + next.len() > self.0 && n > 0 {
                return (out, n);
            }
            out += &next;
            n += 1;
        }
    }

    fn fill(self, part: impl Fn(usize) -> String) -> String {
        self.count(part).0
    }

    /// The same within `frame`, at its `@`.
    fn within(self, frame: &str, part: impl Fn(usize) -> String) -> String {
        frame.replace('@', &self.without(frame.len()).fill(part))
    }

    /// The same, with the number of the last part in place of each `#` of the frame.
    fn counted(self, frame: &str, part: impl Fn(usize) -> String) -> String {
        let (text, n) = self.without(frame.len() + 16).count(part);
        let last = (n - 1).to_string();
        frame.replace('#', &last).replace('@', &text)
    }

    fn without(self, bytes: usize) -> Self {
        Self(self.0.saturating_sub(bytes))
    }

    /// The same with a share of the bytes: for what is written `parts` times.
    fn divided(self, parts: usize) -> Self {
        Self(self.0 / parts)
    }
}

/// A material of what stands at `@`, with a `surface` that reads `x`.
const READS_X: &str = "use std::bsdf::diffuse;\n\
    material m {\nvar x = position.x;\n@surface = diffuse(color(x));\n}\n";

/// A material of what stands at `@`, of which nothing shows.
const UNREAD: &str = "use std::bsdf::diffuse;\nmaterial m {\n@surface = diffuse(0.5);\n}\n";

/// A material that is one statement, among definitions.
const BEHIND: &str = "use std::bsdf::diffuse;\n@material m { surface = diffuse(0.5); }\n";

/// A link of a chain: the first is another.
fn link(i: usize, first: impl Fn() -> String, next: impl Fn(usize) -> String) -> String {
    if i == 0 { first() } else { next(i - 1) }
}

macro_rules! shapes {
    ($($name:literal => $make:expr;)*) => {
        /// Every shape.
        pub const SHAPES: &[Shape] = &[$(Shape { name: $name, make: $make }),*];
    };
}

shapes! {
    // Statements in a row.
    "constant lets" => |r| r.within(UNREAD, |i| format!("let a{i} = 1.0;\n"));
    "unread lets" => |r| r.within(UNREAD, |i| format!("let a{i} = position.x * {i}.5;\n"));
    "lets on one line" => |r| r.within(UNREAD, |i| format!("let a{i} = position.x;")).replace('\n', " ");
    "lets in a chain" => |r| r.counted(
        "use std::bsdf::diffuse;\nmaterial m {\n@surface = diffuse(color(a#));\n}\n",
        |i| link(i, || "let a0 = position.x;\n".into(), |j| format!("let a{i} = sin(a{j});\n")),
    );
    "lets in a function" => |r| r.counted(
        "use std::bsdf::diffuse;\nfn f(x: float) -> float {\n@a#\n}\nmaterial m { surface = diffuse(color(f(position.x))); }\n",
        |i| link(i, || "let a0 = x;\n".into(), |j| format!("let a{i} = sin(a{j});\n")),
    );
    "lets read at the end" => |r| {
        let (lets, n) = r.without(200).divided(2).count(|i| format!("let a{i} = sin({i}.5 * position.x);\n"));
        let sums: String = (0..n).map(|i| format!("x += a{i};\n")).collect();
        READS_X.replace('@', &(lets + &sums))
    };
    "sums" => |r| r.within(READS_X, |i| format!("x += position.y * {i}.5;\n"));
    "equal sums" => |r| r.within(READS_X, |_| "x += position.y;\n".into());
    "constant sums" => |r| r.within(
        "use std::bsdf::diffuse;\nmaterial m {\nvar x = 0.0;\n@surface = diffuse(color(x));\n}\n",
        |_| "x += 1e-9;\n".into(),
    );
    "components" => |r| r.within(
        "use std::bsdf::diffuse;\nmaterial m {\nvar v = vec3(position);\n@surface = diffuse(color(v));\n}\n",
        |i| format!("v.{} += position.{} * {i}.5;\n", ["x", "y", "z"][i % 3], ["x", "y", "z"][i / 3 % 3]),
    );
    "vectors" => |r| r.within(READS_X, |i| format!("x += vec4(x, uv, {i}.5).wzyx.y;\n"));
    "variables" => |r| r.within(UNREAD, |i| format!("var a{i} = position.x;\n"));
    "variables in turn" => |r| r.within(READS_X, |i| format!("var a{i} = x * {i}.5; x += a{i};\n"));
    "unknown types" => |r| r.within(UNREAD, |i| format!("let a{i}: flot = 1.0;\n"));

    // Branches.
    "branches" => |r| r.within(READS_X, |i| format!("if x > {i}.5 {{ x += 1.0; }}\n"));
    "branches on one condition" => |r| r.within(READS_X, |i| format!("if uv.x > 0.5 {{ x *= uv.y + {i}.5; }}\n"));
    "branches with both sides" => |r| r.within(READS_X, |i| format!("if x > {i}.5 {{ x += 1.0; }} else {{ x = x * x; }}\n"));
    "branches that never hold" => |r| r.within(READS_X, |i| format!("if false {{ x += {i}.5; }}\n"));
    "branches without effect" => |r| r.within(READS_X, |i| format!("if x > {i}.5 {{ let _a = x; }}\n"));
    "chains of else" => |r| r.within(READS_X, |i| {
        let more: String = (0..100).map(|j| format!(" else if x > {j}.0 {{ x = {j}.0; }}")).collect();
        format!("if x > {i}.5 {{ x += 1.0; }}{more}\n")
    });
    "chosen values" => |r| r.within(READS_X, |i| format!("x += if uv.y > {i}.5 {{ sin(x) }} else {{ cos(x) }};\n"));
    "variables in branches" => |r| {
        let (vars, n) = r.without(200).divided(4).count(|i| format!("var a{i} = x * {i}.5;\n"));
        let branches: String = (0..n).map(|i| format!("if uv.x > {i}.5 {{ a{i} = x; x += 1.0; }} x += a{i};\n")).collect();
        READS_X.replace('@', &(vars + &branches))
    };
    "blocks in blocks" => |r| r.within(READS_X, |i| {
        let open: String = (0..60).map(|j| format!("if x > {i}.5 {{ x += {j}.0; ")).collect();
        let close: String = (0..60).map(|j| format!("x *= {j}.5; }}\n")).collect();
        open + &close
    });
    "variables of blocks in blocks" => |r| r.within(READS_X, |i| {
        let open: String = (0..60).map(|j| format!("if x > {i}.5 {{ var a{j} = x; ")).collect();
        let close: String = (0..60).rev().map(|j| format!("x += a{j}; a0 += x; }}\n")).collect();
        open + &close
    });

    // Loops.
    "loops" => |r| r.within(READS_X, |i| format!("for i in 0..8 {{ x += sin(x + {i}.5); }}\n"));
    "loops without effect" => |r| r.within(READS_X, |_| "for i in 0..8 { let _a = x; }\n".into());
    "long loops" => |r| r.within(READS_X, |_| "for i in 0..65536 { x += 1.0; }\n".into());
    "loops of invariants" => |r| r.within(READS_X, |i| format!("for i in 0..8 {{ x += sin(uv.x + {i}.5); }}\n"));
    "loops of variables" => |r| {
        let (vars, n) = r.without(200).divided(4).count(|i| format!("var a{i} = x * {i}.5;\n"));
        let loops: String = (0..n).map(|i| format!("for i in 0..8 {{ a{i} = x; x += a{}; }} x += a{i};\n", n - 1 - i)).collect();
        READS_X.replace('@', &(vars + &loops))
    };
    "loops in loops" => |r| r.within(READS_X, |i| {
        let open: String = (0..16).map(|j| format!("for i{j} in 0..2 {{ ")).collect();
        let close: String = (0..16).rev().map(|j| format!("x += {i}.5 * float(i{j}); }}\n")).collect();
        open + &close
    });
    "loops with jumps" => |r| r.within(READS_X, |i| format!("for i in 0..8 {{ if x > {i}.5 {{ break; }} x += uv.x; }}\n"));
    "loops with a test" => |r| r.within(READS_X, |i| format!("while x < {i}.5 limit 8 {{ x += uv.x; }}\n"));
    "chains of stores" => |r| {
        // What one turn stores, the next loads: each variable matters only once the one before does.
        let (vars, n) = r.without(300).divided(3).count(|i| format!("var a{i} = {i}.5;\n"));
        let moves: String = (1..n).map(|i| format!("a{} = a{i};\n", i - 1)).collect();
        READS_X.replace('@', &format!("{vars}for i in 0..8 {{\n{moves}x += a0;\n}}\n"))
    };
    "chains of stores backwards" => |r| {
        let (vars, n) = r.without(300).divided(3).count(|i| format!("var a{i} = uv.x * {i}.5;\n"));
        let moves: String = (1..n).rev().map(|i| format!("a{} = a{i};\n", i - 1)).collect();
        READS_X.replace('@', &format!("{vars}for i in 0..8 {{\n{moves}x += a0;\n}}\n"))
    };

    // Expressions.
    "long sums" => |r| r.within(READS_X, |i| {
        let terms: String = (0..60).map(|t| format!(" + uv.x * {t}.5")).collect();
        format!("x = {i}.5{terms};\n")
    });
    "brackets" => |r| r.within(READS_X, |_| format!("x += {}x{};\n", "(".repeat(200), ")".repeat(200)));
    "a long vector" => |r| r.within("const A: vec3 = vec3(@1);\n", |i| format!("{i}.0, "));
    "a call with many arguments" => |r| r.within("const A: float = max(@1);\n", |i| format!("{i}, "));
    "arguments by name" => |r| {
        let (params, n) = r.without(100).divided(2).count(|i| format!("p{i}: float, "));
        let args: String = (0..n).rev().map(|i| format!("p{i}: 1, ")).collect();
        format!("fn f({params}) -> float = p0;\nconst A: float = f({args});\n")
    };
    "arguments in order" => |r| {
        let (params, n) = r.without(200).divided(2).count(|i| format!("p{i}: float, "));
        let args: String = (0..n).map(|i| format!("{i}.5, ")).collect();
        BEHIND.replace('@', &format!("fn f({params}) -> float = p0;\n")).replace("(0.5)", &format!("(color(f({args})))"))
    };
    "arguments of one line each" => |r| r.within("const A: float = max(\n@1);\n", |_| "sin(1.0),\n".into());
    "comparisons" => |r| r.within(READS_X, |i| format!("x = select(x > {i}.5 && uv.x < 0.5 || x == uv.y, x, uv.x);\n"));
    "ints" => |r| r.within(
        "use std::bsdf::diffuse;\nmaterial m {\nvar n = int(position.x);\n@surface = diffuse(color(unit_float(n)));\n}\n",
        |i| format!("n = hash(n, {i}) ^ (n << 3);\n"),
    );
    "filter widths" => |r| r.within(READS_X, |i| format!("x += filter_width(x * {i}.5);\n"));
    "filter widths of a chain" => |r| r.within(
        "use std::bsdf::diffuse;\nmaterial m {\nvar x = position.x;\n@let w = filter_width(x);\nsurface = diffuse(color(w));\n}\n",
        |i| format!("x = sin(x * {i}.5);\n"),
    );

    // Calls.
    "functions" => |r| r.within(BEHIND, |i| format!("fn f{i}(x: float) -> float = sin(x);\n"));
    "private functions" => |r| r.within(BEHIND, |i| format!("private fn f{i}(x: float) -> float = sin(x);\n"));
    "a chain of functions" => |r| r.counted(
        "use std::bsdf::diffuse;\n@material m { surface = diffuse(color(f#(position.x))); }\n",
        |i| link(i, || "fn f0(x: float) -> float = sin(x);\n".into(), |j| format!("fn f{i}(x: float) -> float = f{j}(x);\n")),
    );
    "a chain of functions that grow" => |r| r.counted(
        "use std::bsdf::diffuse;\n@material m { surface = diffuse(color(f#(position.x))); }\n",
        |i| link(i, || "fn f0(x: float) -> float = sin(x);\n".into(), |j| format!("fn f{i}(x: float) -> float = f{j}(sin(x));\n")),
    );
    "a chain of functions backwards" => |r| r.within(
        "use std::bsdf::diffuse;\n@fn f#(x: float) -> float = x;\nmaterial m { surface = diffuse(color(f0(position.x))); }\n",
        |i| format!("fn f{i}(x: float) -> float = f{}(sin(x));\n", i + 1),
    ).replace("f#", "f");
    "functions that call all before" => |r| r.counted(
        "use std::bsdf::diffuse;\n@material m { surface = diffuse(color(f#(position.x))); }\n",
        |i| link(i, || "fn f0(x: float) -> float = sin(x);\n".into(), |j| {
            let calls: String = (j.saturating_sub(40)..=j).map(|k| format!(" + f{k}(x)")).collect();
            format!("fn f{i}(x: float) -> float = x{calls};\n")
        }),
    );
    "functions that are all called" => |r| {
        let (fns, n) = r.without(200).divided(3).count(|i| format!("fn f{i}(x: float) -> float = sin(x * {i}.5);\n"));
        let calls: String = (0..n).map(|i| format!("x += f{i}(x);\n")).collect();
        READS_X.replace("material", &(fns + "material")).replace('@', &calls)
    };
    "large functions that are all called" => |r| {
        let body: String = (0..60).map(|i| format!("y += sin(y * {i}.5); ")).collect();
        let (fns, n) = r.without(200 + r.0 / 16).count(|i| format!("fn f{i}(x: float) -> float {{ var y = x * {i}.5; {body} y }}\n"));
        let calls: String = (0..n).map(|i| format!("x += f{i}(x) + f{i}(-x);\n")).collect();
        READS_X.replace("material", &(fns + "material")).replace('@', &calls)
    };
    "calls of one function" => |r| r.within(
        &format!("{READS_X}fn f(x: float, y: float) -> float = sin(x + y);\n"),
        |i| format!("x = f(x, {i}.5);\n"),
    );
    "calls of noise" => |r| r.within(
        &format!("use std::noise::perlin;\n{READS_X}"),
        |i| format!("x += perlin(vec3(position) * {i}.5);\n"),
    );
    "gradients" => |r| r.within(
        &format!("{READS_X}fn f(p: point) -> float = sin(float(p.x));\n"),
        |_| "x += gradient(f(position), step: 1 mm).x;\n".into(),
    );
    "constants by a function" => |r| r.within(
        &format!("{BEHIND}fn f() -> float {{ var x = 0.0; for i in 0..256 {{ x += 1.0; }} x }}\n"),
        |i| format!("const C{i}: float = f();\n"),
    );
    "calls of constants" => |r| r.within(
        &format!("{READS_X}fn f(y: float) -> float {{ var x = y; for i in 0..400 {{ x += 1.0; }} x }}\n"),
        |i| format!("x += f({i}.5);\n"),
    );
    "closures by a function" => |r| r.within(
        &format!("{UNREAD}fn g(x: float) -> bsdf = diffuse(x);\n"),
        |i| format!("let a{i} = g({i}.5);\n"),
    );
    "calls of a material" => |r| r.within(
        &format!("{UNREAD}material n {{ surface = diffuse(0.5); }}\n"),
        |i| format!("let a{i} = n();\n"),
    );

    // Definitions.
    "constants" => |r| r.within(BEHIND, |i| format!("const C{i}: float = {i}.5;\n"));
    "a chain of constants" => |r| r.within(
        BEHIND,
        |i| link(i, || "const C0: float = 1.0;\n".into(), |j| format!("const C{i}: float = C{j} + 1.0;\n")),
    );
    "a chain of constants backwards" => |r| r.within(
        "use std::bsdf::diffuse;\n@const C: float = 1.0;\nmaterial m { surface = diffuse(C0); }\n",
        |i| format!("const C{i}: float = C{};\n", i + 1),
    );
    "structs" => |r| r.within(BEHIND, |i| format!("struct S{i} {{ a: float }}\n"));
    "a chain of structs" => |r| r.within(
        BEHIND,
        |i| link(i, || "struct S0 { a: float }\n".into(), |j| format!("struct S{i} {{ a: S{j} }}\n")),
    );
    "structs that are used" => |r| {
        let (structs, n) = r.without(200).divided(3).count(|i| format!("struct S{i} {{ a: float, b: float }}\n"));
        let uses: String = (0..n).map(|i| format!("let s{i} = S{i}(x, b: uv.x); x += s{i}.b * s{i}.a;\n")).collect();
        READS_X.replace("material", &(structs + "material")).replace('@', &uses)
    };
    "fields" => |r| r.within("struct S {\n@}\n", |i| format!("a{i}: float,\n"));
    "structs of many fields" => |r| {
        let fields: String = (0..1000).map(|i| format!("a{i}: float, ")).collect();
        let args: String = (0..1000).map(|i| format!("a{i}: x, ")).collect();
        r.within(&format!("{READS_X}struct S {{ {fields} }}\n"), |i| format!("let s{i} = S({args}); x += s{i}.a7;\n"))
    };
    "private definitions" => |r| r.within(BEHIND, |i| format!("private const C{i}: float = 1.0;\n"));
    "definitions of one name" => |r| r.within(BEHIND, |_| "const C: float = 1.0;\n".into());
    "imports of one name" => |r| r.within(BEHIND, |_| "use std::noise::perlin;\n".into());
    "imports by other names" => |r| r.within(BEHIND, |i| format!("use std::noise::perlin as p{i};\n"));
    "imports in one list" => |r| r.within(&format!("use std::noise::{{\n@}};\n{}", BEHIND.replace('@', "")), |i| format!("perlin as p{i},\n"));
    "closures" => |r| r.within(BEHIND, |i| format!("edf e{i}(radiance: color) {{ emit(wo) = radiance; }}\n"));
    "materials" => |r| r.within(
        "use std::bsdf::diffuse;\n@",
        |i| format!("material m{i} {{ surface = diffuse(0.5); }}\n"),
    );
    "different materials" => |r| r.within(
        "use std::bsdf::diffuse;\nuse std::bsdf::mirror;\n@",
        |i| format!("material m{i} {{ surface = layer(mirror(), diffuse(color(sin(position.x * {i}.5)))); }}\n"),
    );
    "parameters" => |r| r.within(UNREAD, |i| format!("param p{i}: float = 1.0;\n"));
    "parameters that are read" => |r| {
        let (params, n) = r.without(200).divided(2).count(|i| format!("param p{i}: float = {i}.5 in 0 .. 1e6;\n"));
        let sums: String = (0..n).map(|i| format!("x += p{i} * uv.x;\n")).collect();
        format!("use std::bsdf::diffuse;\nmaterial m {{\n{params}var x = position.x;\n{sums}surface = diffuse(color(x));\n}}\n")
    };
    "parameters with metadata" => |r| r.within(
        UNREAD,
        |i| format!("param p{i}: float = 1.0 in 0 .. 2 {{ label: \"P {i}\", group: \"G {i}\", soft: 0 .. 1 }};\n"),
    );
    "parameters that are textures" => |r| r.within(UNREAD, |i| format!("param p{i}: texture = \"t{i}.png\";\n"));

    // Closures and outputs.
    "unread closures" => |r| r.within(UNREAD, |i| format!("let a{i} = diffuse(0.5);\n"));
    "layers" => |r| r.within(
        "use std::bsdf::diffuse;\nmaterial m {\nvar x = position.x;\n@surface = a60;\n}\n",
        |i| match i {
            0 => "let a0 = diffuse(0.5);\n".into(),
            1..=60 => format!("let a{i} = mix(a{}, diffuse(color(uv.x * {i}.5)), x);\n", i - 1),
            _ => format!("x += sin(x * {i}.5);\n"),
        },
    );
    "media" => |r| r.within(UNREAD, |i| format!("let a{i} = medium(ior: 1.5);\n"));
    "lookups" => |r| r.within(
        "use std::bsdf::diffuse;\nmaterial m {\nparam t: texture = \"t.png\";\nvar x = position.x;\n@surface = diffuse(color(x));\n}\n",
        |i| format!("x += image(t, uv * {i}.5).g;\n"),
    );
    "lookups of many textures" => |r| r.within(READS_X, |i| format!("x += image(\"t{i}.png\", uv).g;\n"));

    // Text.
    "comments" => |r| r.within(BEHIND, |_| "// a comment\n".into());
    "comments behind statements" => |r| r.within(READS_X, |i| format!("x += {i}.5; // and why\n"));
    "comments in a call" => |r| r.within("const A: float = max(\n@1);\n", |i| format!("{i}, // and why\n"));
    "comments in comments" => |r| r.within(BEHIND, |_| "/* /* */ */".into());
    "documentation" => |r| r.within(BEHIND, |_| "/// What it is.\n".into());
    "one comment" => |r| r.without(8).within(BEHIND, |_| "a".into()).replace(";\na", ";\n//a").replace("amaterial", "a\nmaterial");
    "blank lines" => |r| r.within(BEHIND, |_| "\n".into());
    "blanks" => |r| r.within(BEHIND, |_| " ".into());
    "a long string" => |r| r.within("material m { param t: texture = \"@\"; }\n", |_| "a".into());
    "a long name" => |r| r.within("const @: int = 1;\n", |_| "a".into());
    "a long number" => |r| r.within("const A: float = @;\n", |_| "9".into());

    // Mistakes.
    "unknown names" => |r| r.within(UNREAD, |i| format!("let a{i} = b{i};\n"));
    "unknown functions" => |r| r.within(UNREAD, |i| format!("let a{i} = sinn(1.0);\n"));
    "unknown imports" => |r| r.within(BEHIND, |_| "use std::bsdf::difuse;\n".into());
    "unknown calls among functions" => |r| r.within(
        "use std::bsdf::diffuse;\n@material m { surface = diffuse(g(1)); }\n",
        |i| format!("fn f{i}(x: float) -> float = g{i}(x);\n"),
    );
    "lets of one name" => |r| r.within(UNREAD, |_| "let a = 1.0;\n".into());
    "stray tokens" => |r| r.within(UNREAD, |_| "+ ) ;\n".into());
    "open brackets" => |r| r.within("const A: float = @", |_| "(".into());
    "closing brackets" => |r| r.within("const A: float = @", |_| ")".into());
    "open blocks" => |r| r.within("material m { @", |_| "{".into());
    "open strings" => |r| r.within(UNREAD, |_| "\" \n".into());
    "letters of no alphabet" => |r| r.within(UNREAD, |_| "\u{e9}".into());
    "statements without an end" => |r| r.within(UNREAD, |_| "let a = 1.0\n".into());
    "definitions without an end" => |r| r.within("@", |_| "fn f(".into());
}
