//! Who answers what the kernel asks of materials: the compiler's own interpreter, which is the
//! oracle that generated WGSL is held against, or that generated WGSL itself.

use impasto_compiler::ir::interp::{Interpreter, TextureLookup};
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Function, Type};
use impasto_compiler::program::{CompiledMaterial, Program};

use impasto_cpu::KernelError;
use impasto_cpu::interpret::Float;

use crate::error::LIMIT;
use crate::signature::Signature;

/// Which code of materials is run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaterialCode {
    /// The compiler's IR, by its own interpreter.
    #[default]
    Ir,
    /// The WGSL that GPUs get, by the interpreter of kernels.
    Wgsl,
}

/// Materials that answer.
pub(super) enum Materials<'p, F> {
    /// The kernel's own code does.
    Wgsl,
    /// The oracle does.
    Ir(Oracle<'p, F>),
}

/// The compiler's interpreter, one an instance that was hit.
pub(super) struct Oracle<'p, F> {
    program: &'p Program,
    texture: Option<&'p TextureLookup<'p>>,
    instances: Vec<Option<Interpreter<'p, F>>>,
}

impl<'p, F: Float> Oracle<'p, F> {
    pub(super) fn new(program: &'p Program, texture: Option<&'p TextureLookup<'p>>) -> Self {
        let instances = program.instances().iter().map(|_| None).collect();
        Self {
            program,
            texture,
            instances,
        }
    }

    fn run(
        &mut self,
        instance: usize,
        function: &'p Function,
        arguments: Vec<Value<F>>,
    ) -> Result<Value<F>, KernelError> {
        let program = self.program;
        let Some(place) = self.instances.get_mut(instance) else {
            return Err(unknown(instance));
        };
        let interpreter = place.get_or_insert_with(|| {
            let values = &program.instances()[instance].values;
            let run = Interpreter::new(program.ir(), 0).with_table(values);
            match self.texture {
                Some(texture) => run.with_texture(texture),
                None => run,
            }
        });
        interpreter.refill(LIMIT);
        let value = interpreter.run(function, arguments);
        value.map_err(|_| KernelError::Endless(LIMIT))
    }

    /// The arguments of a material's function that the kernel gives by name.
    fn arguments(
        &self,
        function: &Function,
        names: &[&str],
        of: &Signature,
        cells: &[u64],
    ) -> Vec<Value<F>> {
        let vector = |name: &str| {
            let numbers: Vec<F> = of
                .arguments
                .numbers::<F>(name, cells)
                .into_iter()
                .map(F::of)
                .collect();
            Value::floats(&numbers)
        };
        let point = match function.params.first().map(|p| p.ty) {
            Some(Type::Struct(id)) => {
                let structs = &self.program.ir().structs;
                let fields = structs[id.index()].fields.iter().map(|(name, ty)| {
                    let name = format!("point.{name}");
                    let numbers = of.arguments.numbers::<F>(&name, cells);
                    match (ty, &numbers[..]) {
                        (_, []) => Value::zero(*ty, structs),
                        (Type::Int, _) => Value::Int(of.arguments.word(&name, cells) as i32),
                        (Type::Mat3, &[a, b, c, d, e, f, g, h, i]) => {
                            let columns = [[a, b, c], [d, e, f], [g, h, i]];
                            Value::Mat3(columns.map(|column| column.map(F::of)))
                        }
                        _ => vector(&name),
                    }
                });
                Value::Struct(fields.collect())
            }
            _ => Value::float(0.0),
        };
        let others = names.iter().map(|name| vector(name));
        std::iter::once(point).chain(others).collect()
    }
}

/// The instance that a kernel asks for, and the code of its material.
fn asked<'p>(
    program: &'p Program,
    of: &Signature,
    cells: &[u64],
) -> Result<(usize, &'p CompiledMaterial), KernelError> {
    let instance = of.arguments.word("instance", cells) as usize;
    let info = program.instances().get(instance);
    let material = info.map(|info| &program.compiled()[info.info.material]);
    Ok((instance, material.ok_or_else(|| unknown(instance))?))
}

fn unknown(instance: usize) -> KernelError {
    KernelError::Unsupported {
        what: format!("instance {instance} of materials"),
        function: "evaluate_material".into(),
    }
}

impl<F: Float> Materials<'_, F> {
    /// What a material samples, and reflects of a light.
    pub(super) fn evaluate(
        &mut self,
        of: &Signature,
        cells: &[u64],
        result: &mut Vec<u64>,
    ) -> Result<(), KernelError> {
        let Materials::Ir(oracle) = self else {
            return Ok(());
        };
        let (instance, material) = asked(oracle.program, of, cells)?;
        let function = &material.evaluate;
        let arguments = oracle.arguments(function, &["wo", "wl", "u"], of, cells);
        let sample = oracle.run(instance, function, arguments)?;
        result.resize(of.result.cells().max(1), 0);
        if let Type::Struct(id) = function.result {
            let fields = &oracle.program.ir().structs[id.index()].fields;
            for (i, (name, _)) in fields.iter().enumerate() {
                if let Some(value) = sample.field(i) {
                    of.result.put(name, value.components(), result);
                }
            }
        }
        Ok(())
    }

    /// What a material emits.
    pub(super) fn emission(
        &mut self,
        of: &Signature,
        cells: &[u64],
        result: &mut Vec<u64>,
    ) -> Result<(), KernelError> {
        let Materials::Ir(oracle) = self else {
            return Ok(());
        };
        let (instance, material) = asked(oracle.program, of, cells)?;
        result.resize(of.result.cells().max(1), 0);
        // Kernels leave emission that is the same everywhere to lights.
        let varies = material.info.varying_emission;
        if let Some(function) = material.emission.as_ref().filter(|_| varies) {
            let arguments = oracle.arguments(function, &["wo"], of, cells);
            let value = oracle.run(instance, function, arguments)?;
            of.result.put("", value.components(), result);
        }
        Ok(())
    }
}
