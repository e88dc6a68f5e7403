//! The derivative of every operation of the table: a width whose operands grow at known rates along
//! one direction, against the difference of the operation's values over a short way.

use std::f64::consts::FRAC_PI_2;

use impasto_compiler::ir::build::Builder;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::ops::{Op, STEEPEST, Shape};
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::ir::{
    Const, ExprId, Function, Local, Material, Module, Struct, StructId, Type,
};
use impasto_compiler::passes::pass;
use impasto_compiler::source::{FileId, Span};

const HERE: Span = Span {
    file: FileId(0),
    start: 0,
    end: 0,
};

/// A module with the part of `SurfacePoint` that differentiation knows.
fn module() -> Module {
    let fields = [
        ("position", Type::Vec3),
        ("footprint_x", Type::Vec3),
        ("footprint_y", Type::Vec3),
    ];
    Module {
        structs: vec![Struct {
            name: "SurfacePoint".into(),
            fields: fields.map(|(n, ty)| (n.to_owned(), ty)).to_vec(),
            span: HERE,
        }],
        ..Module::default()
    }
}

/// Numbers that are the same every time.
struct Numbers(u64);

impl Numbers {
    /// The next in [-2, 2).
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 51) as f64 - 2.0
    }
}

/// A function of the surface point under construction.
struct Case {
    module: Module,
    b: Builder,
    position: ExprId,
}

impl Case {
    fn new() -> Self {
        let (module, point) = (module(), Type::Struct(StructId(0)));
        let point = Local {
            name: "point".into(),
            ty: point,
        };
        let mut b = Builder::new("f", vec![point], HERE);
        let param = b.param(0, HERE);
        let position = b.field(&module, param, 0, HERE);
        Self {
            module,
            b,
            position,
        }
    }

    /// `at + rate * position.x` by component; a matrix by column.
    fn linear(&mut self, ty: Type, at: &[f64], rate: &[f64]) -> ExprId {
        if ty == Type::Mat3 {
            let columns =
                [0, 3, 6].map(|c| self.linear(Type::Vec3, &at[c..c + 3], &rate[c..c + 3]));
            return self.b.compose(ty, &columns, HERE);
        }
        let x = self.b.swizzle(self.position, &[0], HERE);
        let rate = self.b.constant(Const::Float(rate.to_vec()), HERE);
        let at = self.b.constant(Const::Float(at.to_vec()), HERE);
        let moved = self.b.op(Op::Mul, &[x, rate], HERE);
        self.b.op(Op::Add, &[at, moved], HERE)
    }
}

/// Far more than any derivative here, so that a width with it added has a sign.
const BIAS: f64 = 1e5;

/// The derivative along x, at x = 0, that `widths` finds of an op of operands `at` that grow by
/// `rates`: what is added to the op grows so fast that no width is below 0.
fn derivative<F: Real>(op: Op, types: &[Type], at: &[Vec<f64>], rates: &[Vec<f64>]) -> Vec<f64> {
    let mut case = Case::new();
    let value = operation(&mut case, op, types, at, rates);
    let width = case.b.ty(value).width().expect("floats");
    let steep = case.linear(case.b.ty(value), &vec![0.0; width], &vec![BIAS; width]);
    let sum = case.b.op(Op::Add, &[value, steep], HERE);
    let asked = case.b.op(Op::FilterWidth, &[sum], HERE);
    let f = with_widths(&case.module, case.b.finish(asked));
    let found = run::<F>(&case.module, &f, 0.0);
    found.iter().map(|w| w - BIAS).collect()
}

/// A body as the pass `widths` leaves it.
fn with_widths(module: &Module, body: Function) -> Function {
    let mut material = Material {
        name: "m".into(),
        docs: Vec::new(),
        params: Vec::new(),
        body,
        closures: Vec::new(),
        surface: None,
        emission: None,
        interior: None,
        opacity: None,
        span: HERE,
    };
    let widths = pass("widths").expect("a row");
    assert_eq!(widths.run_on_material(module, &mut material, &[]), Ok(true));
    material.body
}

fn operation(
    case: &mut Case,
    op: Op,
    types: &[Type],
    at: &[Vec<f64>],
    rates: &[Vec<f64>],
) -> ExprId {
    let operands = types.iter().zip(at.iter().zip(rates));
    let args: Vec<ExprId> = operands
        .map(|(&ty, (at, rate))| match ty {
            Type::Bool => case.b.constant(Const::Bool(at[0] > 0.0), HERE),
            _ => case.linear(ty, at, rate),
        })
        .collect();
    case.b.op(op, &args, HERE)
}

/// The op's value at x.
fn value(op: Op, types: &[Type], at: &[Vec<f64>], rates: &[Vec<f64>], x: f64) -> Vec<f64> {
    let mut case = Case::new();
    let value = operation(&mut case, op, types, at, rates);
    let f = case.b.finish(value);
    run::<f64>(&case.module, &f, x)
}

/// The op's value in single precision.
fn single(op: Op, types: &[Type], at: &[Vec<f64>], rates: &[Vec<f64>]) -> Vec<f64> {
    let mut case = Case::new();
    let value = operation(&mut case, op, types, at, rates);
    let f = case.b.finish(value);
    run::<f32>(&case.module, &f, 0.0)
}

fn run<F: Real>(module: &Module, f: &Function, x: f64) -> Vec<f64> {
    let point = Value::Struct(vec![
        Value::vector(&[x, 0.0, 0.0]),
        Value::vector(&[1.0, 0.0, 0.0]),
        Value::vector(&[0.0; 3]),
    ]);
    let mut interpreter = Interpreter::<F>::new(module, 10_000);
    interpreter
        .run(f, vec![point])
        .expect("enough fuel")
        .to_f64()
}

/// Types of operands that an op whose value is of floats takes; none for others.
fn operands(op: Op) -> Vec<Vec<Type>> {
    use Type::{Bool, Float, Mat3, Vec2, Vec3, Vec4};
    match op.info().shape {
        Shape::Float(1) | Shape::Number(1) => vec![vec![Float], vec![Vec3]],
        // Scalars combine with vectors.
        Shape::Float(2) | Shape::Number(2) => {
            vec![
                vec![Float; 2],
                vec![Vec3; 2],
                vec![Float, Vec2],
                vec![Vec4, Float],
            ]
        }
        Shape::Float(3) | Shape::Number(3) => {
            vec![
                vec![Float; 3],
                vec![Vec3; 3],
                vec![Vec2, Float, Float],
                vec![Float, Float, Vec3],
            ]
        }
        Shape::Reduce(n) if op == Op::Luminance => vec![vec![Vec3; n]],
        Shape::Reduce(n) | Shape::Vector(n) => vec![vec![Vec2; n], vec![Vec3; n], vec![Vec4; n]],
        Shape::Cross => vec![vec![Vec3; 2]],
        Shape::MatVec => vec![vec![Mat3, Vec3]],
        Shape::Select => vec![vec![Bool, Float, Float], vec![Bool, Vec3, Vec3]],
        _ => vec![],
    }
}

fn numbers(ty: Type, next: &mut impl FnMut() -> f64) -> Vec<f64> {
    let count = if ty == Type::Mat3 {
        9
    } else {
        ty.width().unwrap_or(1)
    };
    (0..count).map(|_| next()).collect()
}

/// Which operands grow: every one alone, and all together.
fn growing(count: usize) -> impl Iterator<Item = usize> + Clone {
    (0..count)
        .map(|k| 1 << k)
        .chain((count > 1).then_some((1 << count) - 1))
}

#[test]
fn every_derivative_is_the_limit_of_differences() {
    const STEP: f64 = 1e-6;
    let mut random = Numbers(7);
    for &op in Op::ALL.iter().filter(|op| **op != Op::FilterWidth) {
        for types in operands(op) {
            let (mut asked, mut smooth) = (0, 0);
            for grows in growing(types.len()).cycle().take(60) {
                let at: Vec<_> = types
                    .iter()
                    .map(|&ty| numbers(ty, &mut || random.next()))
                    .collect();
                let mut rate = |k: usize| {
                    if grows >> k & 1 == 1 {
                        random.next()
                    } else {
                        0.0
                    }
                };
                let rates: Vec<_> = types
                    .iter()
                    .enumerate()
                    .map(|(k, &ty)| numbers(ty, &mut || rate(k)))
                    .collect();
                let value = |x| value(op, &types, &at, &rates, x);
                let (before, here, after) = (value(-STEP), value(0.0), value(STEP));
                let found = derivative::<f64>(op, &types, &at, &rates);
                for c in 0..here.len() {
                    let (left, right) = ((here[c] - before[c]) / STEP, (after[c] - here[c]) / STEP);
                    asked += 1;
                    // A kink or a step lies between.
                    if (left - right).abs() > 1e-3 * (1.0 + left.abs()) || left.abs() > BIAS / 2.0 {
                        continue;
                    }
                    smooth += 1;
                    let expected = (after[c] - before[c]) / (2.0 * STEP);
                    let off = (found[c] - expected).abs();
                    assert!(
                        off < 1e-5 * (1.0 + expected.abs()),
                        "{op:?} of {at:?} growing by {rates:?}: {found:?}, expected {expected}"
                    );
                }
            }
            assert!(
                10 * smooth > 9 * asked,
                "{op:?} of {types:?}: {smooth} of {asked}"
            );
        }
    }
}

/// Steps have derivative 0 and no operation.
#[test]
fn ops_without_a_rule_are_steps() {
    let steps: Vec<Op> = Op::ALL.iter().copied().filter(|op| op.is_step()).collect();
    for op in &steps {
        let result = op.info().shape;
        let of_floats = matches!(result, Shape::Float(_) | Shape::Number(_));
        let named = matches!(
            op,
            Op::Step | Op::Sign | Op::Floor | Op::Ceil | Op::Round | Op::FilterWidth
        );
        assert_eq!(of_floats, named, "{op:?}");
    }
    let floats =
        |op: &&Op| operands(**op).len() + usize::from(matches!(op.info().shape, Shape::Lookup(_)));
    let with_floats: Vec<&Op> = Op::ALL.iter().filter(|op| floats(op) > 0).collect();
    assert!(
        with_floats
            .iter()
            .all(|op| !op.is_step() || steps.contains(op))
    );
    assert!(with_floats.len() > 40, "{}", with_floats.len());
}

/// Where an op has a pole, a kink, or nothing at all: a width is a number in single precision, too.
#[test]
fn no_derivative_is_infinite_or_no_number() {
    const PLACES: [f64; 12] = [
        0.0, -0.0, 1e-40, 1e-30, -1e-20, 1e-7, 1.0, -1.0, FRAC_PI_2, 100.0, -1e6, 1e9,
    ];
    for &op in Op::ALL.iter().filter(|op| !operands(**op).is_empty()) {
        for types in operands(op) {
            for i in 0..PLACES.len() * PLACES.len() {
                let place = |k: usize, c: usize| {
                    let spread = [i, i / PLACES.len(), i + 5][k] + c * (i % 5);
                    PLACES[spread % PLACES.len()]
                };
                let all = |value: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
                    let of = |(k, &ty): (usize, &Type)| {
                        let mut c = 0;
                        numbers(ty, &mut || {
                            c += 1;
                            value(k, c)
                        })
                    };
                    types.iter().enumerate().map(of).collect()
                };
                let at = all(&place);
                let rates = all(&|k, c| [0.5, 0.0, -1e-3, 1.0][(i + k + c) % 4]);
                // Where the op itself leaves the range of its numbers, nothing is promised.
                if single(op, &types, &at, &rates)
                    .iter()
                    .any(|x| x.is_nan() || x.abs() >= 1e30)
                {
                    continue;
                }
                for found in derivative::<f32>(op, &types, &at, &rates) {
                    let width = found + BIAS;
                    assert!(
                        (0.0..=1.001 * STEEPEST).contains(&width),
                        "{op:?} of {at:?} growing by {rates:?}: {width}"
                    );
                }
            }
        }
    }
}
