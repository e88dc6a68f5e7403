//! What compiled materials answer, by the interpreter in double precision.

use impasto_compiler::Program;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;

/// The samples of an instance at a few points, a list of numbers each.
pub fn samples(program: &Program, instance: usize) -> Vec<Vec<f64>> {
    let instance = &program.instances()[instance];
    let evaluate = &program.compiled()[instance.info.material].evaluate;
    let mut run = Interpreter::<f64>::new(program.ir(), 1 << 30).with_table(&instance.values);
    let asked = (0..20).map(|i| {
        let t = f64::from(i);
        let up = || Value::vector(&[0.0, 0.0, 1.0]);
        let point = Value::Struct(vec![
            Value::vector(&[0.37 * t, 0.2, -0.1 * t]),
            up(),
            up(),
            Value::vector(&[1.0, 0.0, 0.0]),
            Value::vector(&[0.1 * t, 0.3]),
            Value::float(1.0),
        ]);
        let wo = [0.6, 0.0, 0.8];
        let wl = [-0.48, 0.36, 0.8];
        let u = [0.05 * t, 0.3, 0.7, 0.1];
        let args = vec![
            point,
            Value::vector(&wo),
            Value::vector(&wl),
            Value::vector(&u),
        ];
        let sample = run.run(evaluate, args).expect("ends");
        let fields = (0..).map_while(|field| sample.field(field).map(Value::to_f64));
        fields.flatten().collect()
    });
    asked.collect()
}
