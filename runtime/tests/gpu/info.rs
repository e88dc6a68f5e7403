//! What is said of the GPU, and of one that is not there.

use impasto_runtime::gpu::{Gpu, GpuOptions};

use crate::gpu::stub::gpu;

#[test]
fn the_gpu_is_described_as_text_and_as_json() {
    let info = gpu().info();
    let text = info.to_string();
    let json = serde_json::to_value(&info).expect("JSON");
    assert!(text.contains(&info.name) && json["name"] == info.name.as_str());
    assert!(
        text.contains("max_storage_buffer_binding_size = "),
        "{text}"
    );
    assert!(Gpu::found().contains(&info));
}

#[test]
fn a_gpu_that_is_not_there_is_named_with_those_that_are() {
    let options = GpuOptions {
        adapter: Some("Voodoo 2".parse().expect("a name")),
        ..GpuOptions::default()
    };
    let message = match Gpu::new(&options) {
        Err(error) => error.to_string(),
        Ok(gpu) => panic!("opened {}", gpu.info()),
    };
    assert!(message.contains("no GPU is called `Voodoo 2`"), "{message}");
    assert!(message.contains(&gpu().info().name), "{message}");
}

#[test]
fn a_gpu_is_found_by_part_of_its_name_in_any_case() {
    let name = gpu().info().name;
    let part: String = name.to_uppercase().chars().take(4).collect();
    let options = GpuOptions {
        adapter: Some(part.parse().expect("a name")),
        ..GpuOptions::default()
    };
    let found = Gpu::new(&options).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(found.info().name, name);
}
