//! Arrays on the processor, against a closed form.

use std::f32::consts::PI;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use impasto_compiler::{MaterialRequest, MemoryLoader, Program, compile_with_looks};

use super::{Evaluator, Given, Inputs, What};
use crate::cpu::{Cpu, CpuOptions};
use crate::device::DeviceRef;
use crate::error::RuntimeError;

const SOURCE: &str = "use std::bsdf::diffuse;
    material m { param share: color = color(0.5, 0.25, 0.0); surface = diffuse(share); }";

fn program(source: &str) -> Program {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", source);
    let compiled = compile_with_looks(&[MaterialRequest::new("m", "m.impasto")], &mut files);
    compiled
        .program
        .unwrap_or_else(|| panic!("{:?}", compiled.diagnostics))
}

fn evaluated(what: What, given: &[(&str, &[f32])], items: usize) -> Result<Vec<f32>, RuntimeError> {
    let cpu = Cpu::new(&CpuOptions::default())?;
    let built = Evaluator::new(DeviceRef::Cpu(&cpu), &program(SOURCE), Path::new(""), what)?;
    let given = given.iter().map(|(name, numbers)| Given {
        name,
        numbers: numbers.to_vec().into(),
    });
    let inputs = Inputs::new(items, given.collect()).unwrap_or_else(|e| panic!("{e}"));
    built.run(&inputs, &Arc::new(AtomicBool::new(false)))
}

#[test]
fn a_diffuse_surface_is_its_closed_form_at_every_item() {
    // More than a portion of work for a thread, and no multiple of a workgroup.
    let items = 5000;
    let cosine = |item: usize| (item + 1) as f32 / items as f32;
    let wi: Vec<f32> = (0..items)
        .flat_map(|item| {
            let z = cosine(item);
            [(1.0 - z * z).max(0.0).sqrt(), 0.0, z]
        })
        .collect();
    let given: [(&str, &[f32]); 2] = [("wo", &[0.0, 0.0, 1.0]), ("wi", &wi)];
    let found = evaluated(What::Scattering, &given, items).unwrap_or_else(|e| panic!("{e}"));
    for (item, found) in found.chunks_exact(4).enumerate() {
        let z = cosine(item);
        let expected = [0.5 * z / PI, 0.25 * z / PI, 0.0, z / PI];
        let near = found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near, "{item}: {found:?}, not {expected:?}");
    }
}

#[test]
fn samples_and_albedo_are_those_of_the_material() {
    let u: [f32; 8] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
    let found = evaluated(What::Sample, &[("u", &u)], 2).unwrap_or_else(|e| panic!("{e}"));
    for sample in found.chunks_exact(8) {
        assert!((sample[3] - sample[2] / PI).abs() < 1e-6, "{sample:?}");
        assert!(
            (sample[4] - 0.5).abs() < 1e-6 && sample[7] == 0.0,
            "{sample:?}"
        );
    }
    assert_ne!(found[..3], found[8..11]);
    let albedo = evaluated(What::Albedo, &[], 1).unwrap_or_else(|e| panic!("{e}"));
    let near = albedo
        .iter()
        .zip([0.5, 0.25, 0.0])
        .all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(near && albedo.len() == 3, "{albedo:?}");
    let emission = evaluated(What::Emission, &[], 1).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(emission, [0.0; 3]);
}

#[test]
fn what_is_stopped_has_no_values() {
    let cpu = Cpu::new(&CpuOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let built = Evaluator::new(
        DeviceRef::Cpu(&cpu),
        &program(SOURCE),
        Path::new(""),
        What::Scattering,
    );
    let built = built.unwrap_or_else(|e| panic!("{e}"));
    let inputs = Inputs::new(100_000, Vec::new()).unwrap_or_else(|e| panic!("{e}"));
    let stopped = built.run(&inputs, &Arc::new(AtomicBool::new(true)));
    assert!(
        matches!(stopped, Err(RuntimeError::Interrupted)),
        "{stopped:?}"
    );
}
