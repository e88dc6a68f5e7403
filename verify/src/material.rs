//! Whole materials, asked as kernels ask them: the function that samples a direction and answers toward a light.

use std::cell::Cell;

use impasto_compiler::Program;
use impasto_compiler::ir::value::Real;
use impasto_compiler::ir::{Const, Type};

use crate::cells::Measures;
use crate::distribution::Distribution;
use crate::evaluate;
use crate::lanes::{self, Lanes, Stuck};
use crate::precision::errors;
use crate::statistics::Numbers;

/// Expressions that one batch of directions may take: a hundred thousand a direction.
const FUEL: u64 = 1 << 31;

/// Where in `MaterialSample`, flattened, each answer begins.
pub const WI: usize = 0;
/// The density of the sampled direction.
pub const PDF: usize = 3;
/// What it carries.
pub const THROUGHPUT: usize = 4;
/// The density of the light's direction.
pub const LIGHT_PDF: usize = 7;
/// The value toward it.
pub const LIGHT_THROUGHPUT: usize = 8;
/// Whether the sampled direction goes into another medium.
const TRANSMITTED: usize = 11;

/// Where in `SurfacePoint`, flattened, the texture coordinates begin and end, and how long it is.
const UV: usize = 12;
const UV_END: usize = 14;
const AFTER: usize = 25;

/// Where its footprint begins, which goes on to the end.
pub const FOOTPRINT: usize = 15;

/// A surface point with the normal up, flattened, of numbers that single precision has.
pub fn point(position: [f64; 3], uv: [f64; 2]) -> Vec<f64> {
    let rest = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
    let exterior_ior = 1.0;
    // What is asked for here is asked without filtering.
    let footprint = [0.0; 10];
    let around = position.into_iter().chain(rest).chain(uv);
    let all = around.chain([exterior_ior]).chain(footprint);
    all.map(|x| f64::from(x as f32)).collect()
}

/// The `SurfacePoint` of a program at a point as of [`point`], which is where it is in its object as
/// well, seen from `wo`.
pub fn seen<F: Real>(program: &Program, at: &[f64], wo: [f64; 3]) -> Lanes<F> {
    let evaluate = &program.compiled()[0].evaluate;
    let fields = match evaluate.params.first().map(|p| p.ty) {
        Some(Type::Struct(id)) => program.ir().structs[id.index()].fields.as_slice(),
        _ => &[],
    };
    let numbers = |name: &str, ty: Type| -> Vec<f64> {
        match name {
            "position" | "object_position" => at[0..3].to_vec(),
            "normal" => at[3..6].to_vec(),
            "geometric_normal" => at[6..9].to_vec(),
            "tangent" => at[9..UV].to_vec(),
            "uv" | "uv1" => at[UV..UV_END].to_vec(),
            "exterior_ior" => at[UV_END..15].to_vec(),
            "footprint_x" => at[15..18].to_vec(),
            "footprint_y" => at[18..21].to_vec(),
            "footprint_uv_x" | "footprint_uv1_x" => at[21..23].to_vec(),
            "footprint_uv_y" | "footprint_uv1_y" => at[23..AFTER].to_vec(),
            "view" => wo.to_vec(),
            "object_scale" => vec![1.0],
            "object_from_world" | "world_from_object" => {
                vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
            }
            "vertex_color" => vec![1.0; 3],
            // Footprints of what has none here.
            _ => vec![0.0; ty.width().unwrap_or(1)],
        }
    };
    let columns = fields.iter().flat_map(|(name, ty)| match ty {
        Type::Int => lanes::constant(&Const::Int(0)),
        _ => lanes::uniform(&numbers(name, *ty)),
    });
    columns.collect()
}

/// What the only material of a program answers, a lane each.
fn evaluated<F: Real>(program: &Program, args: Vec<Lanes<F>>) -> Result<Lanes<F>, Stuck> {
    let evaluate = &program.compiled()[0].evaluate;
    evaluate::answers(program.ir(), evaluate, args, &Cell::new(FUEL))
}

/// The light that the front gives off toward `wo`, in single precision; nothing where none is.
///
/// # Errors
/// [`Stuck`], if that takes too long.
pub fn emitted(program: &Program, at: &[f64], wo: [f64; 3]) -> Result<Option<[f64; 3]>, Stuck> {
    let Some(emission) = &program.compiled()[0].emission else {
        return Ok(None);
    };
    let args = vec![seen::<f32>(program, at, wo), lanes::uniform(&wo)];
    let found = evaluate::answers(program.ir(), emission, args, &Cell::new(FUEL))?;
    Ok(Some(std::array::from_fn(|c| lanes::float_at(&found, c, 0))))
}

/// The continuous part of a material at a point.
pub fn distribution<'a>(
    label: String,
    program: &'a Program,
    at: &'a [f64],
    wo: [f64; 3],
) -> Distribution<'a> {
    let ask = move |wl: Lanes, u: Lanes| -> Result<Lanes, Stuck> {
        let args = vec![seen(program, at, wo), lanes::uniform(&wo), wl, u];
        evaluated(program, args)
    };
    let sample = move |u: &[[f64; 4]]| {
        let out = ask(lanes::uniform(&[0.0; 3]), lanes::vectors(u))?;
        let one = |l: usize| -> [f64; 3] {
            let drawn = lanes::float_at(&out, PDF, l) > 0.0;
            std::array::from_fn(|c| {
                if drawn {
                    lanes::float_at(&out, WI + c, l)
                } else {
                    0.0
                }
            })
        };
        Ok((0..u.len()).map(one).collect())
    };
    let measure = move |wi: &[[f64; 3]]| {
        let out = ask(lanes::vectors(wi), lanes::uniform(&[0.5; 4]))?;
        let one = |l: usize| -> Measures {
            let value = |c: usize| lanes::float_at(&out, LIGHT_THROUGHPUT + c, l);
            [
                lanes::float_at(&out, LIGHT_PDF, l),
                value(0),
                value(1),
                value(2),
            ]
        };
        Ok((0..wi.len()).map(one).collect())
    };
    Distribution {
        label,
        sample: Box::new(sample),
        measure: Box::new(measure),
    }
}

/// What throughputs add up to, discrete and continuous, from `samples` samples: of power, so what
/// goes into another medium counts with the square of the index by which it refracts.
///
/// # Errors
/// [`Stuck`], if that takes too long.
pub fn reflected(
    program: &Program,
    at: &[f64],
    wo: [f64; 3],
    samples: usize,
) -> Result<[f64; 3], Stuck> {
    let entered = match program.instances()[0].info.medium {
        Some(medium) => {
            let stated = f64::from(medium.ior * medium.ior);
            let found = refracted(program, at)?.unwrap_or(stated);
            let far = (found / stated - 1.0).abs() > ANOTHER_INDEX;
            if far { found } else { stated }
        }
        None => 1.0,
    };
    let out = drawn(program, at, wo, samples)?;
    let all = |c: usize| {
        let one = |l: usize| {
            let enters = lanes::float_at(&out, TRANSMITTED, l) > 0.0;
            lanes::float_at(&out, THROUGHPUT + c, l) * if enters { entered } else { 1.0 }
        };
        (0..samples).map(one).sum::<f64>() / samples as f64
    };
    Ok(std::array::from_fn(all))
}

/// How far what light refracts by is from the square of the medium's index, where it is taken to be another: total reflection
/// blurs what rough glass of the same index tells by a few hundredths.
const ANOTHER_INDEX: f64 = 0.25;

/// Samples that tell by which index light refracts.
const REFRACTED: usize = 1024;

/// The square of the index by which light refracts on its way in; none if no light goes in and out.
///
/// It need not be that of the medium: a surface model may scale its index, as `specular_weight` of OpenPBR does. Light that
/// comes from inside has the square of the index times the light that passes, light that comes from outside the same over
/// that square, so the root of what one has over the other is the square.
fn refracted(program: &Program, at: &[f64]) -> Result<Option<f64>, Stuck> {
    let mut passed = [0.0; 2];
    for (passed, wo) in passed.iter_mut().zip([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]) {
        let out = drawn(program, at, wo, REFRACTED)?;
        for l in 0..REFRACTED {
            if lanes::float_at(&out, TRANSMITTED, l) > 0.0 {
                *passed += (0..3)
                    .map(|c| lanes::float_at(&out, THROUGHPUT + c, l))
                    .sum::<f64>();
            }
        }
    }
    let [outside, inside] = passed;
    let found = (inside / outside).sqrt();
    Ok((found.is_finite() && found > 0.0).then_some(found))
}

/// What a material draws, seen from `wo`, by numbers that never change.
fn drawn(program: &Program, at: &[f64], wo: [f64; 3], samples: usize) -> Result<Lanes, Stuck> {
    let mut n = Numbers::new(11);
    // In strata of the choice of a lobe, which is most of the noise.
    let stratified = |i: usize| {
        let [lobe, a, b, c] = n.four();
        [(i as f64 + lobe) / samples as f64, a, b, c]
    };
    let u: Vec<[f64; 4]> = (0..samples).map(stratified).collect();
    let args = vec![
        seen(program, at, wo),
        lanes::uniform(&wo),
        lanes::uniform(&[0.0; 3]),
        lanes::vectors(&u),
    ];
    evaluated(program, args)
}

/// Answers of a material in one precision toward many light directions, sampled by many numbers.
///
/// # Errors
/// [`Stuck`], if that takes too long.
pub fn answers<F: Real>(
    program: &Program,
    at: &[f64],
    wo: [f64; 3],
    wl: &[[f64; 3]],
    u: &[[f64; 4]],
) -> Result<Lanes<F>, Stuck> {
    let args = vec![
        seen(program, at, wo),
        lanes::uniform(&wo),
        lanes::vectors(wl),
        lanes::vectors(u),
    ];
    evaluated(program, args)
}

/// How far a number is moved, in parts of itself: two units in its last place.
const LAST_DIGITS: f64 = 2.0 * f32::EPSILON as f64;

/// How far answers in double precision are from `exact` where the point's coordinates and `wo`
/// differ in their last digits, by direction. A noise of a tenth of a millimetre a metre from its
/// origin, or the boundary of a fractal, makes much of those digits. No arithmetic in single
/// precision can be nearer than that.
///
/// # Errors
/// What `answers` fails with.
pub fn digits(
    (at, wo): (&[f64], [f64; 3]),
    n: &mut Numbers,
    (exact, count): (&Lanes<f64>, usize),
    answers: impl Fn(&[f64], [f64; 3]) -> Result<Lanes<f64>, Stuck>,
) -> Result<Vec<f64>, Stuck> {
    let mut most = vec![0.0f64; count];
    for _ in 0..3 {
        let signs: Vec<f64> = (0..at.len() + 3)
            .map(|i| match i {
                3..UV | UV_END..AFTER => 0.0,
                _ => n.between(-1.0, 1.0).signum(),
            })
            .collect();
        // There and back, so that one of the two is beyond an edge next to the point.
        for step in [LAST_DIGITS, -LAST_DIGITS] {
            let moved = |x: f64, i: usize| x * (1.0 + step * signs[i]);
            let at: Vec<f64> = at.iter().enumerate().map(|(i, x)| moved(*x, i)).collect();
            let wo = std::array::from_fn(|c| moved(wo[c], AFTER + c));
            let found = answers(&at, wo)?;
            for (l, most) in most.iter_mut().enumerate() {
                *most = most.max(error_toward_light(exact, &found, l));
            }
        }
    }
    Ok(most)
}

/// The relative error of what is said of the light sample's direction in a lane.
pub fn error_toward_light<F: Real>(exact: &Lanes<f64>, found: &Lanes<F>, lane: usize) -> f64 {
    let a = [0, 1, 2, 3].map(|c| lanes::float_at(exact, LIGHT_PDF + c, lane));
    let b = [0, 1, 2, 3].map(|c| lanes::float_at(found, LIGHT_PDF + c, lane));
    let [pdf, value, _] = errors(&a, &b, true);
    pdf.max(value)
}
