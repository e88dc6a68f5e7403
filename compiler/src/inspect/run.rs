//! Runs the functions of what is evaluated and puts names to their numbers.

use super::{At, FUEL, Lobe, Named, Precision, Results, Sampled, Shown, Surface, Toward, items};
use crate::build::ProgramBuilder;
use crate::closure::{self, Probe};
use crate::driver::MaterialRequest;
use crate::ir::interp::Interpreter;
use crate::ir::ops::Counts;
use crate::ir::value::{Real, Value};
use crate::ir::{Const, Function, Material, Module, Struct, Type};
use crate::loader::Loader;
use crate::passes;
use crate::program::Program;
use crate::sema::Checker;
use crate::source::Span;

/// A material that can be looked into.
pub(super) struct Probed {
    pub parameters: Vec<Named>,
    probe: Probe,
}

/// Checks the material of a request that compiled, and builds its probe.
pub(super) fn probed(request: &MaterialRequest, loader: &mut dyn Loader) -> Option<Probed> {
    let mut checker = Checker::new(loader);
    let core = ProgramBuilder::new(&mut checker)?.core();
    let module = checker.load(&request.file)?;
    let index = checker.find_material(module, request.material.as_deref())?;
    let mut material = checker.material(module, index)?;
    let values =
        checker.parameter_values(module, &material, &request.params, &request.name, None)?;
    let values = checker.values_at(&material, values, request.moment.unwrap_or_default())?;
    let opacity = material.opacity;
    if opacity.is_some() {
        closure::cut_out(
            &mut material,
            checker.library_closure("bsdf", "transparent")?,
        );
        // It is an output to be shown all the same.
        material.opacity = opacity;
    }
    let given: Vec<Option<Const>> = values.iter().cloned().map(Some).collect();
    passes::run_material_until(&checker.ir, &mut material, &given, "fold_body").ok()?;
    Some(Probed {
        parameters: parameters(&checker.ir, &material, &values),
        probe: closure::probe(&checker.ir, &core, &material),
    })
}

fn parameters(module: &Module, material: &Material, values: &[Const]) -> Vec<Named> {
    let shown = |surface_type: &str, value: &Const| match value {
        Const::Int(t) if surface_type == "texture" => {
            let path = usize::try_from(*t)
                .ok()
                .and_then(|t| module.textures.get(t));
            Shown::Text(path.cloned().unwrap_or_default())
        }
        value => Shown::constant(value),
    };
    let named = material.params.iter().zip(values).map(|(p, value)| Named {
        name: p.name.clone(),
        value: shown(p.surface_type, value),
    });
    named.collect()
}

/// The surface point.
pub(crate) fn point<F: Real>(at: &At, point: &Struct) -> Value<F> {
    let field = |(name, ty): &(String, Type)| match at.field(name) {
        Some(numbers) => of_type(*ty, &numbers),
        None => Value::zero(*ty, &[]),
    };
    Value::Struct(point.fields.iter().map(field).collect())
}

/// The value of a machine type that some numbers are.
fn of_type<F: Real>(ty: Type, numbers: &[f64]) -> Value<F> {
    match (ty, numbers) {
        (Type::Int, [number, ..]) => Value::Int(*number as i32),
        (Type::Mat3, &[a, b, c, d, e, f, g, h, i]) => {
            Value::Mat3([[a, b, c], [d, e, f], [g, h, i]].map(|column| column.map(F::of)))
        }
        _ => Value::vector(numbers),
    }
}

fn vector<F: Real>(numbers: &[f64]) -> Value<F> {
    Value::vector(numbers)
}

/// The arguments of a function over the context of [`items::CONTEXT`].
pub(crate) fn context<F: Real>(at: &At) -> Vec<Value<F>> {
    let context = items::CONTEXT.iter();
    let args = context.map(|(name, ty)| {
        let numbers = at.field(name).unwrap_or_default();
        let ty = if *ty == "int" { Type::Int } else { Type::Float };
        of_type(ty, &numbers)
    });
    args.collect()
}

/// The budget of an evaluation is spent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spent {
    /// The loop that took most turns, if any did.
    pub busiest_loop: Option<Span>,
}

/// Evaluates a function.
pub(super) fn value<'a, F: Real>(
    run: &mut Interpreter<'a, F>,
    f: &'a Function,
    args: Vec<Value<F>>,
) -> Result<Value<F>, Spent> {
    run.run(f, args).map_err(|_| Spent {
        busiest_loop: run.busiest_loop(),
    })
}

/// The value of a function over the context of [`items::CONTEXT`].
pub(super) fn function<F: Real>(
    module: &Module,
    f: &Function,
    at: &At,
    precision: Precision,
) -> Result<Results, Spent> {
    let mut run = Interpreter::<F>::new(module, FUEL).with_parts();
    let value = value(&mut run, f, context(at))?;
    Ok(Results {
        value: Some(Shown::new(&value, f.result, module)),
        ..nothing(precision, run.counts())
    })
}

fn nothing(precision: Precision, operations: Counts) -> Results {
    Results {
        precision,
        value: None,
        patterns: Vec::new(),
        surface: None,
        emission: None,
        outputs: Vec::new(),
        operations,
    }
}

/// What the only material of a program does at a point.
pub(super) fn material<F: Real>(
    program: &Program,
    probed: &Probed,
    at: &At,
    precision: Precision,
) -> Result<Results, Spent> {
    let structs = &program.ir().structs;
    let compiled = &program.compiled()[0];
    let run = Interpreter::<F>::new(program.ir(), FUEL).with_parts();
    let mut run = run.with_table(&program.instances()[0].values);
    let here = |f: &Function, module: &Module| match f.params.first().map(|p| p.ty) {
        Some(Type::Struct(id)) => point::<F>(at, &module.structs[id.index()]),
        _ => Value::float(0.0),
    };
    let args = vec![
        here(&compiled.evaluate, program.ir()),
        vector(&at.wo),
        vector(&at.wi),
        vector(&at.u),
    ];
    let sample = value(&mut run, &compiled.evaluate, args)?;
    let emission = match &compiled.emission {
        Some(f) => {
            let args = vec![here(f, program.ir()), vector(&at.wo)];
            Some(value(&mut run, f, args)?)
        }
        None => None,
    };
    let operations = run.counts();
    let field = |name: &str| sample_field(&sample, compiled.evaluate.result, structs, name);
    let (toward, sampled) = (
        Toward {
            value: field("light_throughput"),
            pdf: field("light_pdf"),
        },
        Sampled {
            wi: field("wi"),
            pdf: field("pdf"),
            throughput: field("throughput"),
            transmitted: field("transmitted") == Shown::Float(1.0),
        },
    );
    let probe = &probed.probe;
    let mut run = Interpreter::<F>::new(&probe.module, FUEL).with_parts();
    let args = vec![here(&probe.function, &probe.module), vector(&at.wo)];
    let mut fields = Fields::new(probe, &value(&mut run, &probe.function, args)?);
    let patterns = fields.named(&probe.patterns);
    let lobes: Vec<Lobe> = probe.lobes.iter().map(|l| fields.lobe(l)).collect();
    let mut outputs = fields.named(&probe.rest);
    let albedo = outputs.iter().position(|o| o.name == "albedo");
    let surface = albedo.map(|i| Surface {
        lobes,
        albedo: outputs.remove(i).value,
        toward,
        sampled,
    });
    Ok(Results {
        patterns,
        surface,
        emission: emission.map(|e| Shown::floats(&e.to_f64())),
        outputs,
        ..nothing(precision, operations)
    })
}

/// The field `name` of a material's answer.
fn sample_field<F: Real>(value: &Value<F>, ty: Type, structs: &[Struct], name: &str) -> Shown {
    let Type::Struct(id) = ty else {
        return Shown::Float(0.0);
    };
    let fields = &structs[id.index()].fields;
    let found = fields.iter().position(|(n, _)| n == name);
    let found = found.and_then(|i| value.field(i));
    found.map_or(Shown::Float(0.0), |v| Shown::floats(&v.to_f64()))
}

/// Takes the fields of a probe's result one after another.
struct Fields {
    left: std::vec::IntoIter<Shown>,
}

impl Fields {
    fn new<F: Real>(probe: &Probe, value: &Value<F>) -> Self {
        let all = match Shown::new(value, probe.function.result, &probe.module) {
            Shown::Fields(fields) => fields.into_iter().map(|(_, v)| v).collect(),
            _ => Vec::new(),
        };
        Self {
            left: all.into_iter(),
        }
    }

    fn next(&mut self) -> Shown {
        self.left.next().unwrap_or(Shown::Float(0.0))
    }

    fn named(&mut self, names: &[impl AsRef<str>]) -> Vec<Named> {
        let named = |name: &_| Named {
            name: AsRef::<str>::as_ref(name).to_owned(),
            value: self.next(),
        };
        names.iter().map(named).collect()
    }

    fn lobe(&mut self, lobe: &closure::ProbedLobe) -> Lobe {
        Lobe {
            bsdf: lobe.bsdf.clone(),
            delta: lobe.delta,
            arguments: self.named(&lobe.params),
            albedo: self.next(),
            weight: self.next(),
            share: self.next(),
        }
    }
}
