//! Textures in whole renders: far away, and replayed on the CPU.

use std::ops::ControlFlow;
use std::path::Path as File;
use std::sync::LazyLock;

use impasto::runtime::technique::{Regeneration, Sampler, Technique};
use impasto::runtime::world::World;
use impasto::trace::MaterialCode;
use impasto::trace::path::{Replayer, with_room};
use impasto::{Gpu, GpuOptions, Program, RenderOptions, Renderer, Scene, Strategy};

const SIDE: u32 = 24;

/// One for all tests: some drivers cannot make and drop several at a time.
static GPU: LazyLock<Gpu> =
    LazyLock::new(|| Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}")));

/// A board of 2 m, seen from the front or lying on the ground, that shines with the color `expr`.
struct Board<'a> {
    expr: &'a str,
    camera: &'a str,
}

const FACING: &str = "position = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 25";
/// 100 m away, and small: a pixel sees a ninth of the board along each side.
const FAR: &str = "position = [0, 0, 100]\nlook_at = [0, 0, 0]\nfov = 1.1";
const GRAZING: &str = "position = [0, -2.2, 0.35]\nlook_at = [0, 0, 0]\nfov = 20";

impl Board<'_> {
    fn load(&self, folder: &File) -> (Scene, Program) {
        let file = |name: &str, text: &str| {
            std::fs::write(folder.join(name), text).expect("it is written");
        };
        file(
            "board.obj",
            "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
             usemtl board\nf 1/1 2/2 3/3 4/4\n",
        );
        file(
            "board.impasto",
            &format!(
                "use std::edf::uniform;
                material board {{
                    param picture: texture = \"picture.png\";
                    emission = uniform({});
                }}",
                self.expr
            ),
        );
        file(
            "scene.toml",
            &format!(
                "[camera]\n{}\n[film]\nwidth = {SIDE}\nheight = {SIDE}\n[integrator]\nmax_depth = 2\n\
                 [[geometry]]\nobj = \"board.obj\"\n[materials.board]\nfile = \"board.impasto\"\n",
                self.camera
            ),
        );
        // Odd sides, one of them short; texels that have nothing to do with their neighbours.
        let level = |x: u32, y: u32| (((x + 3) * (y + 7) * 7919) >> 3) as u8;
        let picture = image::RgbaImage::from_fn(19, 6, |x, y| {
            image::Rgba([level(x, y), level(y, x + 1), 128, 255])
        });
        picture
            .save(folder.join("picture.png"))
            .expect("it is saved");
        let scene = impasto::load(&folder.join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
        let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{e}"));
        (scene, program)
    }
}

fn technique() -> Technique {
    Technique {
        sampler: Sampler::Independent,
        regeneration: Regeneration::Never,
        ..Technique::default()
    }
}

fn render(scene: &Scene, program: &Program, samples: u32) -> Vec<[f32; 3]> {
    let options = RenderOptions {
        samples,
        seed: 5,
        technique: technique(),
        ..RenderOptions::default()
    };
    let plan = impasto::plan(program, Strategy::OWN).expect("a plan");
    let renderer = Renderer::new(&*GPU, scene, program, &plan, &options);
    let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rendering.report.nonfinite_samples, 0);
    rendering.film.pixels
}

/// Mean and variance of red over the pixels.
fn statistics(pixels: &[[f32; 3]]) -> (f64, f64) {
    let n = pixels.len() as f64;
    let mean = pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / n;
    let squares = pixels.iter().map(|p| (f64::from(p[0]) - mean).powi(2));
    (mean, squares.sum::<f64>() / n)
}

fn seen(expr: &str, camera: &str) -> (f64, f64) {
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, program) = Board { expr, camera }.load(folder.path());
    statistics(&render(&scene, &program, 1))
}

#[test]
fn far_boards_have_the_same_mean_and_less_noise_with_a_width() {
    let point = seen("image(picture, 9.0 * uv)", FAR);
    for width in ["vec2(1.0 / 3.0)", "filter_width(9.0 * uv)"] {
        let wide = seen(&format!("image(picture, 9.0 * uv, width: {width})"), FAR);
        // The error of a mean of that many pixels; then the noise.
        let error = (point.1 / f64::from(SIDE * SIDE)).sqrt();
        assert!(
            (wide.0 - point.0).abs() < 4.0 * error,
            "{width}: {wide:?}, {point:?}"
        );
        assert!(wide.1 < 0.2 * point.1, "{width}: {wide:?}, {point:?}");
    }
}

/// Every lookup in kernels against the same in double precision, by the replay's own code and by the
/// kernel's.
#[test]
fn replays_look_textures_up_as_kernels_do() {
    for (expr, camera) in [
        ("image(picture, 3.0 * uv - 1.2, wrap: MIRROR)", FACING),
        (
            "image(picture, 2.0 * uv - 0.4, wrap_u: CLAMP, wrap_v: BORDER)",
            FACING,
        ),
        (
            "image(picture, 2.0 * uv, filter: NEAREST, width: vec2(0.02, 0.4))",
            FACING,
        ),
        (
            "image(picture, 3.0 * uv - 1.0, filter: BICUBIC, wrap_u: BORDER, wrap_v: MIRROR)",
            FACING,
        ),
        (
            "image(picture, uv, width: vec2(0.7, 0.1), wrap: CLAMP)",
            FACING,
        ),
        (
            "color(image_data(picture, 5.0 * uv, width: 0.3 * uv).xyz) * image_alpha(picture, uv)",
            FACING,
        ),
        (
            "image(picture, 4.0 * uv, width: filter_width(4.0 * uv))",
            GRAZING,
        ),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let (scene, program) = Board { expr, camera }.load(folder.path());
        let gpu = render(&scene, &program, 1);
        let (mean, variance) = statistics(&gpu);
        assert!(
            mean > 0.02 && variance > 1e-5,
            "{expr}: nothing to see: {mean} {variance}"
        );
        for code in [MaterialCode::Ir, MaterialCode::Wgsl] {
            let replayed = replay(&scene, &program, code);
            let off = gpu.iter().zip(&replayed);
            // Nearest texels may change hands at their edges.
            let far = |(a, b): &(&[f32; 3], &[f64; 3])| {
                (0..3).any(|c| (f64::from(a[c]) - b[c]).abs() > 2e-3 * b[c].abs() + 1e-4)
            };
            let different = off.filter(far).count();
            assert!(
                different <= 3,
                "{expr}: {different} pixels differ by {code:?}"
            );
        }
    }
}

fn replay(scene: &Scene, program: &Program, code: MaterialCode) -> Vec<[f64; 3]> {
    let technique = technique();
    let world = World::of_program(scene, program, &technique);
    let world = world.unwrap_or_else(|e| panic!("{e}"));
    let pixels = with_room(|| {
        let replayer = Replayer::new(&world, program, technique.sampler).expect("a kernel");
        let code = replayer.code(code).expect("known code");
        let mut session = replayer.session::<f64>(&code).expect("known buffers");
        let mut pixel = |p: u32| {
            let path = session.path([p % SIDE, p / SIDE], 0, 5);
            path.unwrap_or_else(|e| panic!("{e}")).radiance
        };
        (0..SIDE * SIDE).map(&mut pixel).collect()
    });
    pixels.unwrap_or_else(|e| panic!("{e}"))
}
