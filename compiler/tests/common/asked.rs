//! A compiled material, asked as a kernel asks it, by the f64 interpreter.
// Each test program uses some of it.
#![allow(dead_code)]

use impasto_compiler::Program;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;

/// A compiled material, asked as a kernel asks it.
pub struct Asked {
    pub program: &'static Program,
}

/// What it answered.
#[derive(Debug)]
pub struct Answer {
    pub wi: [f64; 3],
    pub pdf: f64,
    pub throughput: [f64; 3],
    pub light_pdf: f64,
    pub light_throughput: [f64; 3],
    pub transmitted: f64,
}

impl Asked {
    /// Compiles `uses` and a material whose surface is `surface`.
    pub fn new(uses: &str, surface: &str) -> Self {
        Self::material(&format!("{uses}\nmaterial m {{ surface = {surface}; }}"))
    }

    /// Compiles the only material of a text.
    pub fn material(text: &str) -> Self {
        Self {
            program: Box::leak(Box::new(super::program(text))),
        }
    }

    pub fn ask(&self, wo: [f64; 3], wl: [f64; 3], u: [f64; 4]) -> Answer {
        let z = || Value::vector(&[0.0, 0.0, 1.0]);
        let point = vec![
            Value::vector(&[0.3, -1.2, 0.7]),
            z(),
            z(),
            Value::vector(&[1.0, 0.0, 0.0]),
            Value::vector(&[0.4, 0.6]),
            Value::float(1.0),
        ];
        let args = vec![
            Value::Struct(point),
            Value::vector(&wo),
            Value::vector(&wl),
            Value::vector(&u),
        ];
        let evaluate = &self.program.compiled()[0].evaluate;
        let run = |run: &mut Interpreter<'static, f64>| run.run(evaluate, args);
        let result = super::kept::interpreter(self.program.ir(), run).expect("fuel");
        let vector = |i: usize| -> [f64; 3] {
            result
                .field(i)
                .expect("field")
                .to_f64()
                .try_into()
                .expect("vec3")
        };
        let float = |i: usize| result.field(i).expect("field").as_float();
        Answer {
            wi: vector(0),
            pdf: float(1),
            throughput: vector(2),
            light_pdf: float(3),
            light_throughput: vector(4),
            transmitted: float(5),
        }
    }

    /// The mean of the sampled throughput: the material's albedo as a renderer sees it.
    pub fn sampled_albedo(&self, wo: [f64; 3], n: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for i in 0..n {
            let answer = self.ask(wo, [0.0; 3], point4(i));
            (0..3).for_each(|c| sum[c] += answer.throughput[c]);
        }
        sum.map(|s| s / n as f64)
    }
}

/// The R4 sequence: four well-spread numbers (Roberts 2018).
pub fn point4(i: usize) -> [f64; 4] {
    let g = 1.167_303_978_261_418_7_f64;
    std::array::from_fn(|d| (0.5 + (i as f64 + 1.0) / g.powi(d as i32 + 1)).fract())
}

pub fn direction(theta_degrees: f64, phi: f64) -> [f64; 3] {
    let t = theta_degrees.to_radians();
    [t.sin() * phi.cos(), t.sin() * phi.sin(), t.cos()]
}

pub fn near(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!(
        (a - b).abs() <= tolerance,
        "{what}: {a} is not {b} (within {tolerance})"
    );
}
