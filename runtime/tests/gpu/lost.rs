//! A GPU that is lost in the middle of a render: an error that says so, and what was kept is whole.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::gpu::stub::{Kind, Room, materials, plan, samples};
use impasto_compiler::partition::Strategy;
use impasto_runtime::error::RuntimeError;
use impasto_runtime::gpu::{Gpu, GpuOptions};
use impasto_runtime::render::Renderer;
use impasto_runtime::render::passes::Keeping;

#[test]
fn a_lost_gpu_is_an_error_and_what_was_kept_can_be_gone_on_from() {
    let room = Room {
        width: 8,
        height: 8,
        max_depth: 3,
        ..Room::default()
    };
    let surfaces = materials(&[Kind::Diffuse(0.5)]);
    let plan = plan(Strategy::OWN, &surfaces);
    let open = || Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}"));

    let gpu = open();
    let mut last = None;
    let mut keep = |film: &_| {
        last = Some(std::clone::Clone::clone(film));
        Ok(())
    };
    let keeping = Keeping {
        start: None,
        every: Duration::from_nanos(1),
        keep: &mut keep,
    };
    let options = samples(1000);
    let mut renderer = Renderer::from_world(&gpu, &room.world(), &surfaces, &plan, &options)
        .unwrap_or_else(|e| panic!("{e}"));
    let result = renderer.render_keeping(keeping, &mut |progress| {
        if progress.paths > 8 * 8 * 3 {
            gpu.lose();
        }
        ControlFlow::Continue(())
    });
    let error = result.expect_err("the GPU is gone");
    assert!(matches!(error, RuntimeError::DeviceLost(_)), "{error:?}");
    assert!(
        error
            .to_string()
            .contains("the GPU was lost while rendering")
    );
    drop(renderer);

    let kept: impasto_runtime::film::file::FilmFile = last.expect("something was kept");
    let done = kept.samples();
    assert!((1..1000).contains(&done));
    let options = samples(done as u32 + 2);
    let another = open();
    let render = |start| {
        let mut renderer =
            Renderer::from_world(&another, &room.world(), &surfaces, &plan, &options)
                .unwrap_or_else(|e| panic!("{e}"));
        let keeping = Keeping {
            start,
            every: Duration::from_secs(1),
            keep: &mut |_| Ok(()),
        };
        let rendering = renderer.render_keeping(keeping, &mut |_| ControlFlow::Continue(()));
        rendering.unwrap_or_else(|e| panic!("{e}")).sums
    };
    assert_eq!(render(Some(kept)), render(None));
}
