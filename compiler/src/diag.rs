//! Diagnostics: what went wrong, where, what was expected, and what to try.
//!
//! The table [`Code::ALL`] is the one place where codes are declared; `impasto explain`,
//! the documentation and the tests read it. Rendering as text and JSON is in [`render`].

use serde::Serialize;

use crate::source::Span;

pub mod examples;
pub mod foreign;
pub mod render;

mod origin;

macro_rules! codes {
    ($($name:ident = $code:literal, $severity:ident, $title:literal, $explanation:literal;)*) => {
        /// A diagnostic's stable identity, such as `E0201`.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[allow(missing_docs)]
        pub enum Code { $($name),* }

        impl Code {
            /// Every code in order.
            pub const ALL: &'static [Code] = &[$(Code::$name),*];

            /// The code as written, such as `E0201`.
            pub fn id(self) -> &'static str {
                match self { $(Code::$name => $code),* }
            }

            /// Whether it stops the compilation.
            pub fn severity(self) -> Severity {
                match self { $(Code::$name => Severity::$severity),* }
            }

            /// The kind of problem in a few words.
            pub fn title(self) -> &'static str {
                match self { $(Code::$name => $title),* }
            }

            /// A paragraph for `impasto explain`.
            pub fn explanation(self) -> &'static str {
                match self { $(Code::$name => $explanation),* }
            }
        }
    };
}

/// How bad a diagnostic is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing; compilation goes on.
    Warning,
    /// Nothing is generated.
    Error,
}

codes! {
    // E01xx: reading and syntax
    SourceTooLarge = "E0101", Error, "source too large",
        "A source file may have at most 1 MiB. Split it into modules and import them with `use`.";
    InvalidUtf8 = "E0102", Error, "source is not text",
        "Source files are UTF-8 text. The file given is binary or in another encoding.";
    UnknownCharacter = "E0103", Error, "unknown character",
        "The character is not part of the language. Outside comments and strings, sources are ASCII.";
    Unterminated = "E0104", Error, "unterminated text",
        "A string must end on the line it starts on, and a block comment `/* ... */` must be closed.";
    InvalidNumber = "E0105", Error, "invalid number",
        "An integer must fit into 32 bits (hexadecimal ones may use all of them), and a float must be finite in 32-bit precision.";
    NestedTooDeep = "E0106", Error, "nested too deeply",
        "Brackets, operators and else-if chains may nest at most 256 levels in all, and the blocks of a function 126. Name parts of the expression with `let`, or move inner blocks to a function.";
    Syntax = "E0107", Error, "syntax error",
        "The source does not follow the grammar at this place. See docs/language.md for the grammar.";
    Unclosed = "E0108", Error, "unbalanced brackets",
        "Every `(`, `[` and `{` needs its partner of the same kind.";
    NoMaterial = "E0109", Error, "no material",
        "The file does not define a material (or not the requested one), so there is nothing to render.";
    // E02xx: names and modules
    UnknownName = "E0201", Error, "unknown name",
        "No variable, parameter, function or closure of that name is in scope. Names from other modules need a `use`.";
    UnknownType = "E0202", Error, "unknown type",
        "Types are bool, int, uint, float, length, angle, vec2, vec3, vec4, color, point, vector, normal, mat2, mat3, texture, bsdf, edf, medium and structs in scope.";
    UnknownModule = "E0203", Error, "unknown module",
        "A `use` names a folder of the standard library (`std::bsdf`, `std::noise`, ...) or a file beside the importing one.";
    UnknownImport = "E0204", Error, "nothing of that name in the module",
        "The module exists but defines no item of that name.";
    ImportCycle = "E0205", Error, "import cycle",
        "Modules may not import each other in a circle. Move shared definitions to a third module.";
    Duplicate = "E0206", Error, "defined twice",
        "A name may be defined once in its scope. Inner blocks may shadow outer names. Functions cannot be overloaded: two functions with the same name are an error, even with different parameters.";
    Recursion = "E0207", Error, "recursion",
        "GPUs run without a call stack: functions and materials may not call themselves, directly or through others. Use a bounded loop.";
    UnknownField = "E0208", Error, "unknown field",
        "The value has no field or component of that name. Vectors have x, y, z, w; colors r, g, b; structs their fields.";
    UnknownOutput = "E0209", Error, "unknown output",
        "A material assigns `surface` and, when it needs them, `emission`, `interior` and `opacity`; or all of them at once, with `material = ...;`.";
    UnknownArgument = "E0210", Error, "unknown argument",
        "The function has no parameter of that name.";
    MissingArgument = "E0211", Error, "missing argument",
        "Every parameter without a default needs an argument.";
    TooManyArguments = "E0212", Error, "too many arguments",
        "More arguments were given than there are parameters, or one was given twice.";
    UnknownUnit = "E0213", Error, "unknown unit",
        "Lengths are written in nm, um, mm, cm, m or km, angles in deg or rad.";
    UnknownParameter = "E0214", Error, "unknown material parameter",
        "A scene sets a parameter that the material does not declare.";
    PrivateItem = "E0215", Error, "private to its module",
        "Only its own file can use a definition marked `private`. Remove `private` there to import it.";
    // E03xx: types and values
    TypeMismatch = "E0301", Error, "wrong type",
        "The value does not have the type that this place needs. An int converts to a float implicitly, and a float to a grey color; everything else is converted by calling the type: `color(v)`, `float(l)`.";
    NoOperator = "E0302", Error, "operator does not apply",
        "The operator is not defined for these types. Colors and directions do not mix; lengths add to lengths only.";
    NeedsUnit = "E0303", Error, "a unit is needed",
        "Lengths and angles are written with their unit, as in `0.5 mm` or `30 deg`.";
    NotConstant = "E0304", Error, "not a constant",
        "This place needs a value known before rendering: literals, constants and functions of those.";
    OutOfRange = "E0305", Error, "value out of range",
        "The parameter declares a range and the value is outside it.";
    NotAssignable = "E0306", Error, "cannot be assigned",
        "Only `var` variables, their components and a material's outputs can be assigned.";
    MissingValue = "E0307", Error, "a value is missing",
        "A function body ends in an expression without a semicolon, and an `if` used as a value needs an `else`.";
    LoopBound = "E0308", Error, "loop without a usable bound",
        "A `while` states its bound with `limit N`; a `for` has constant or bounded limits. At most 65,536 turns are allowed in nested loops together.";
    MissingMethod = "E0309", Error, "missing method",
        "A bsdf defines sample, eval, pdf and albedo; an edf defines emit.";
    MissingOutput = "E0310", Error, "no surface",
        "A material must assign `surface` or `emission` exactly once.";
    ClosureUse = "E0311", Error, "a closure cannot be used here",
        "Closures (bsdf, edf, medium) are combined with layer, mix, `*` and `+`, named with `let` and assigned to outputs. They cannot be stored in `var`, structs or loops.";
    TooManyLobes = "E0312", Error, "too many lobes",
        "A material may have at most 64 lobes after layering, not counting those whose weight is the constant zero; 1024 counting them.";
    Unsupported = "E0313", Error, "not supported here",
        "The construct is planned but not yet supported here.";
    NotFinite = "E0314", Error, "not a finite number",
        "Parameters and constants must be finite numbers.";
    TooLarge = "E0315", Error, "material too large",
        "Functions are inlined for the GPU, and a material may grow to at most 400,000 operations. No function of its code may have more than 50,000 operations, constants and assignments, because shader compilers take time with the square of that. A function or closure has at most 250 parameters, a struct 1023 fields, a file 1024 materials. Calls of materials and of functions that return closures nest at most 32 deep and expand to at most 50,000 expressions per material; closures nest at most 256 levels deep.";
    VaryingMedium = "E0316", Error, "varying medium",
        "The medium inside an object is uniform: `interior` may depend on parameters and constants only, not on the point of the surface or on textures.";
    Metadata = "E0317", Error, "contradictory metadata",
        "The block after a parameter gives user interfaces its `label` and `group` (texts), its `soft` range (of a slider, within the range of the parameter, around the default) and its `unit` (of a length or an angle). Bools and textures have no ranges.";
    // E04xx: export
    NotExported = "E0401", Error, "cannot be exported",
        "`impasto export` writes materials that are one call of a surface model, as in `material = open_pbr(..);`. Each argument is a constant, a picture, a constant times a picture, or a normal map; the format that is written to may have further limits.";
    // E05xx: what `impasto test` finds
    NotSound = "E0501", Error, "unsound answers",
        "Whatever its parameters, directions and random numbers are, a material answers with finite numbers that are not negative, and samples unit directions. `impasto test` asks it at the ends of their ranges, in single and in double precision.";
    MakesLight = "E0502", Error, "makes light",
        "A surface reflects and transmits at most the light that falls on it: paths gain energy at one that does not, and pictures of it do not converge. `layer` and `mix` keep energy where `+` and weights above 1 do not. A bsdf that is known to gain some states it: `Gain: within 0.02`.";
    WrongDensity = "E0503", Error, "sampled otherwise than stated",
        "`pdf` is the density of what `sample` draws, by solid angle, and integrates to at most 1; directions toward which `eval` is not zero can be drawn. Otherwise pictures are wrong, not only noisy. Samples are compared with the density by a chi-squared test, and what they add up to with the integral of `eval`.";
    Imprecise = "E0504", Error, "far from double precision",
        "Kernels compute in single precision. An answer is far if it differs from that in double precision by more than 1e-3 beyond what the last digits of its inputs change. A material states which share of directions may be, `Precision: within 0.1`, and a bsdf where it is further off: `Region: within 0.01 where condition`.";
    NotReciprocal = "E0505", Error, "not reciprocal",
        "f(wo, wi) and f(wi, wo) differ. A bsdf is reciprocal unless its documentation says `Not reciprocal`; a material, if it promises `Reciprocal: within X`. `layer` is not.";
    BrokenPromise = "E0506", Error, "promise not kept",
        "A line of the documentation states what is not so: of a material `Furnace: within 0.02 with a = 1`, `Albedo: 0.2 .. 0.8`, `Cost: at most 3000 operations`, `Registers: at most 60`, `Lines: at most 200`; of a bsdf `Furnace:`, `Albedo:`, `Gain:` and `Weights:`. See docs/testing.md.";
    UnreadPromise = "E0507", Error, "promise that cannot be read",
        "A line of the documentation begins with a word that states a promise, and goes on otherwise than promises do. docs/testing.md has the form of each. A line that is meant as prose begins with another word.";
    NotEvaluated = "E0508", Error, "cannot be tested",
        "Materials are evaluated at some hundred thousand directions. Evaluations of this one take more work together than is granted (as a rule, some loop goes round very often), or there is no way to give its parameters values.";
    FailedAssertion = "E0509", Error, "assertion fails",
        "`impasto test` ran a test of the file, and what it asserts does not hold. Values of the operands, or of the arguments, are those of the first time that it failed. Tests are evaluated in single and in double precision; `near(a, b, within)` allows for rounding.";
    SnapshotDiffers = "E0510", Error, "not as the snapshot",
        "The folder `snapshots` beside the source keeps the WGSL, the costs, the parameters and a small picture of a material, and what is differs from that. `impasto test --review` shows both and asks; `--accept` makes what is the snapshot.";
    NoSnapshot = "E0511", Error, "no snapshot",
        "The folder `snapshots` beside the source has snapshots of other materials, and none of this one. `impasto test --accept` takes it.";
    BadSnapshot = "E0512", Error, "snapshot that cannot be read",
        "A file of the snapshot is damaged, has a merge conflict, or was written by another version of Impasto. `impasto test --accept` writes it anew; version control has what it was.";
    // E09xx: generated code
    InvalidWgsl = "E0901", Error, "generated code was rejected",
        "The WGSL validator refused generated code. This is a defect of the compiler; please report it with the source.";
    // W: warnings
    EnergyGain = "W0001", Warning, "may gain energy",
        "`a + b` of closures adds their albedos, which can exceed one. Use `layer`, `mix` or weights that sum to at most one.";
    WeightAboveOne = "W0002", Warning, "weight above one",
        "A closure weighted by more than one can reflect more light than it receives.";
    Unused = "W0003", Warning, "never used",
        "The name is defined and never used. If that is intended, start it with an underscore.";
    LobesNeverSampled = "W0004", Warning, "weight is always zero",
        "The closure's weight is the constant zero, so it never contributes.";
    AboveOne = "W0005", Warning, "color above one",
        "Reflectances and the components of `srgb` go from 0 to 1. Above, a surface sends out more light than falls on it.";
    PlainSize = "W0006", Warning, "size without a unit",
        "`position` is in metres. Divided by a plain number, its features are so many metres large; a length says which size is meant, as in `position / 3 cm`.";
}

impl Code {
    /// The code written `id`, in either case.
    pub fn from_id(id: &str) -> Option<Code> {
        Self::ALL
            .iter()
            .copied()
            .find(|c| c.id().eq_ignore_ascii_case(id))
    }
}

/// A second place that belongs to a diagnostic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Where.
    pub span: Span,
    /// What is there.
    pub message: String,
}

/// A change that may repair a source: what a hint says, for editors to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// What it does, in the imperative: `write `perlin``.
    pub title: String,
    /// What is replaced; empty to insert.
    pub span: Span,
    /// What must stand there, or the change is not the one that was meant.
    pub was: Option<String>,
    /// What takes its place.
    pub text: String,
    /// What to import for that, as paths: `std::noise::perlin`.
    pub imports: Vec<String>,
}

/// One problem of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Its identity, which also tells its severity.
    pub code: Code,
    /// Where; absent for problems of a whole file or input that is no text.
    pub span: Option<Span>,
    /// What is wrong, in one line, with the names involved.
    pub message: String,
    /// What would have been accepted here.
    pub expected: Option<String>,
    /// What to try.
    pub hint: Option<String>,
    /// Other places that matter.
    pub labels: Vec<Label>,
    /// Changes that may repair it, the likeliest first.
    pub fixes: Vec<Fix>,
    /// What else to know of the place: where it comes from.
    pub notes: Vec<String>,
}

impl Diagnostic {
    /// A diagnostic at `span`.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self {
            span: Some(span),
            ..Self::without_span(code, message)
        }
    }

    /// A diagnostic without a place in a source.
    pub fn without_span(code: Code, message: impl Into<String>) -> Self {
        let message = message.into();
        Self {
            code,
            span: None,
            message,
            expected: None,
            hint: None,
            labels: Vec::new(),
            fixes: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Says what would have been accepted.
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// Says what to try.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Hints at the nearest of `candidates` to `name`, when one is near.
    pub fn did_you_mean<'a>(
        self,
        name: &str,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        match nearest(name, candidates) {
            Some(best) => self.meant(name, best),
            None => self,
        }
    }

    /// Asks whether `best` was meant by `name`, which stands where the diagnostic is.
    pub fn meant(self, name: &str, best: &str) -> Self {
        let fixed = match self.span {
            Some(span) => self.replaced(span, Some(name), best),
            None => self,
        };
        fixed.hint(format!("did you mean `{best}`?"))
    }

    /// Offers to write `text` at `span`, where `was` stands if that is said.
    pub fn replaced(mut self, span: Span, was: Option<&str>, text: &str) -> Self {
        self.fixes.push(Fix {
            title: format!("write `{text}`"),
            span,
            was: was.map(str::to_owned),
            text: text.to_owned(),
            imports: Vec::new(),
        });
        self
    }

    /// Offers a change.
    pub fn fix(mut self, fix: Fix) -> Self {
        self.fixes.push(fix);
        self
    }

    /// Hints that what is at `path`, such as `std::noise::perlin`, must be imported.
    pub fn imported(self, path: &str) -> Self {
        let hinted = self.hint(format!("import it: `use {path};`"));
        match hinted.span {
            Some(span) => hinted.fix(Fix {
                title: format!("import `{path}`"),
                span: Span {
                    end: span.start,
                    ..span
                },
                was: None,
                text: String::new(),
                imports: vec![path.to_owned()],
            }),
            None => hinted,
        }
    }

    /// The same where `name` at `span` may have been meant for the name at its end.
    pub fn import_of(self, path: &str, span: Span, name: &str, best: &str) -> Self {
        let hinted = self.hint(format!("import it: `use {path};`"));
        hinted.fix(Fix {
            title: format!("write `{best}`, and import `{path}`"),
            span,
            was: Some(name.to_owned()),
            text: best.to_owned(),
            imports: vec![path.to_owned()],
        })
    }

    /// Points at a second place.
    pub fn label(mut self, span: Span, message: impl Into<String>) -> Self {
        self.labels.push(Label {
            span,
            message: message.into(),
        });
        self
    }

    /// Does it stop the compilation?
    pub fn is_error(&self) -> bool {
        self.code.severity() == Severity::Error
    }
}

/// Does any of `diagnostics` stop the compilation?
pub fn has_errors(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(Diagnostic::is_error)
}

/// Drops the warnings that an error may be the cause of: what did not check uses nothing.
pub fn drop_unsure(diagnostics: &mut Vec<Diagnostic>) {
    if has_errors(diagnostics) {
        diagnostics.retain(|d| d.code != Code::Unused);
    }
}

/// The candidate with the smallest edit distance to `name`, if at most a third of it differs.
/// Equal distances are decided by the alphabet, so that output never depends on iteration order.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Comparing takes time by the product of the lengths; no one misspells a name this long.
    if name.len() > 80 {
        return None;
    }
    let limit = name.chars().count().div_ceil(3);
    let scored = candidates.into_iter().map(|c| (edit_distance(name, c), c));
    scored.filter(|(d, _)| *d <= limit).min().map(|(_, c)| c)
}

/// Levenshtein distance in characters, a swap of neighbours counting as one edit.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![(0..=b.len()).collect::<Vec<_>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let substituted = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = substituted.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}
