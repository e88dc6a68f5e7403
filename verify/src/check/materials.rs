//! What any material is held to: finite answers, single precision that is near to double, and what `light` asks for.

use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::interface::MaterialInterface;
use impasto_compiler::source::Span;
use impasto_compiler::{Loader, MaterialRequest, Parameters, Program, compile};

use super::{Bound, File, Options, Subject, Verdict, light, promised, seed_of};
use crate::drawn::{self, From, Setting};
use crate::lanes::{self, Stuck};
use crate::material::{
    self, FOOTPRINT, LIGHT_THROUGHPUT, PDF, WI, answers, digits, error_toward_light, point,
};
use crate::statistics::{Numbers, direction};

/// The share of directions that may be further from double precision than `NEAR`: next to edges of
/// regions that BSDFs state, and where parameters at the ends of their ranges make patterns very fine.
const FEW: f64 = 0.05;

/// The relative error of all other directions, beside what the last digits of the inputs change.
const NEAR: f64 = 1e-3;

/// Directions toward the light that are asked for together.
const TOWARD: usize = 64;

/// A material with values for its parameters.
pub(super) struct Variant {
    pub settings: Vec<Setting>,
    pub program: Program,
    /// Are the values the ends of their ranges?
    at_ends: bool,
}

/// A material under examination.
pub(super) struct Asked<'a> {
    pub file: &'a File,
    pub subject: &'a Subject,
    pub seed: u64,
    pub options: Options,
}

impl Asked<'_> {
    /// A finding at the line that begins with `topic`, or else at the name.
    pub fn found(&self, code: Code, topic: &str, message: String) -> Diagnostic {
        let message = format!("`{}` {message}", self.subject.name);
        Diagnostic::new(code, self.subject.place(topic), message)
    }

    /// Where something was found.
    pub fn with(&self, settings: &[Setting]) -> String {
        let seed = self.options.seed;
        format!("with {} (seed {seed})", drawn::shown(settings))
    }

    /// Where it was found from one angle.
    pub fn seen(&self, settings: &[Setting], degrees: f64) -> String {
        let with = self.with(settings);
        format!("{with}, seen from {degrees} degrees to the normal")
    }

    /// An evaluation that does not end.
    pub fn stuck(&self, stuck: Stuck, settings: &[Setting]) -> Diagnostic {
        let message = format!("cannot be evaluated {}: {stuck}", self.with(settings));
        self.found(Code::NotEvaluated, "", message)
            .expected("fewer than some 100,000 operations an evaluation")
            .hint("`impasto cost` shows the lines that cost most")
    }

    /// The material with these values, each a constant of its code.
    pub fn compiled(
        &self,
        settings: &[Setting],
        loader: &mut dyn Loader,
    ) -> Result<Program, Box<Diagnostic>> {
        let request = MaterialRequest {
            material: Some(self.subject.name.clone()),
            params: drawn::values(settings),
            parameters: Parameters::Baked,
            ..MaterialRequest::new(self.subject.name.clone(), self.file.path.clone())
        };
        let compiled = compile(&[request], loader);
        compiled.program.ok_or_else(|| {
            let errors = compiled.diagnostics.iter().filter(|d| d.is_error());
            let first = errors.map(|d| (d.code, d.message.clone())).next();
            let (code, why) = first.unwrap_or((Code::NotEvaluated, String::new()));
            let message = format!("does not compile {}: {why}", self.with(settings));
            Box::new(self.found(code, "", message))
        })
    }
}

/// Holds a material to all that it must keep.
pub(super) fn examine(
    (file, subject): (&File, &Subject),
    told: &MaterialInterface,
    loader: &mut dyn Loader,
    options: Options,
) -> Verdict {
    let seed = seed_of(subject, options);
    let asked = Asked {
        file,
        subject,
        seed,
        options,
    };
    let mut verdict = Verdict::default();
    let variants = variants(&asked, told, loader, &mut verdict);
    let mut kinds: Vec<(Code, Diagnostic)> = Vec::new();
    for (i, variant) in variants.iter().enumerate() {
        let found = one(&asked, variant, i, &mut verdict);
        for d in found.unwrap_or_else(|stuck| vec![asked.stuck(stuck, &variant.settings)]) {
            // Of each kind the first: others are as a rule the same fault seen from elsewhere.
            if !kinds.iter().any(|(code, _)| *code == d.code) {
                kinds.push((d.code, d));
            }
        }
    }
    verdict
        .diagnostics
        .extend(kinds.into_iter().map(|(_, d)| d));
    promised::held(&asked, variants.first(), loader, &mut verdict);
    verdict
}

/// The material with its defaults, with what its documentation asks to try, with values from its ranges, and with their
/// ends.
fn variants(
    asked: &Asked<'_>,
    told: &MaterialInterface,
    loader: &mut dyn Loader,
    verdict: &mut Verdict,
) -> Vec<Variant> {
    let effort = asked.options.effort;
    let mut variants: Vec<Variant> = Vec::new();
    let mut add = |from: From, settings: Vec<Setting>, place: Option<Span>| {
        if variants.iter().any(|v| v.settings == settings) {
            return;
        }
        match asked.compiled(&settings, loader) {
            Ok(program) => variants.push(Variant {
                settings,
                program,
                at_ends: from == From::Ends,
            }),
            // The end of a range that single precision rounds beyond it.
            Err(d) if d.code == Code::OutOfRange && place.is_none() => {}
            Err(mut d) => {
                d.span = place.or(d.span);
                verdict.diagnostics.push(*d);
            }
        }
    };
    add(From::Ranges, Vec::new(), None);
    for (settings, place) in promised::tried(asked.subject) {
        add(From::Ranges, settings, Some(place));
    }
    for (from, count) in [
        (From::Ranges, effort.of(1, 6)),
        (From::Ends, effort.of(2, 8)),
    ] {
        for seed in (1..=count as u64).map(|k| asked.seed.wrapping_add(k)) {
            add(from, drawn::drawn(&told.params, from, seed), None);
        }
    }
    variants
}

/// Points at which materials are asked.
pub(super) fn points() -> [Vec<f64>; 2] {
    [
        point([0.013, 0.024, 0.5], [0.3137, 0.7193]),
        point([1.37, -2.61, 0.4], [2.6141, 0.1091]),
    ]
}

fn one(
    asked: &Asked<'_>,
    variant: &Variant,
    i: usize,
    verdict: &mut Verdict,
) -> Result<Vec<Diagnostic>, Stuck> {
    let mut found = Vec::new();
    verdict.checks += 3;
    found.extend(unsound(asked, variant)?);
    let what = ("finite", "answers that are not finite or negative");
    verdict.measure(what, found.len() as f64, Bound::AtMost(0.0), || {
        asked.with(&variant.settings)
    });
    if !found.is_empty() {
        // Numbers that are none say nothing more.
        return Ok(found);
    }
    found.extend(light::bright(asked, variant, i, verdict)?);
    if variant.at_ends {
        return Ok(found);
    }
    found.extend(imprecise(asked, variant, verdict)?);
    verdict.checks += 2;
    found.extend(light::distributed(asked, variant, i, verdict)?);
    Ok(found)
}

/// Directions and numbers at the ends of their ranges, and such that lie between.
fn hostile(n: &mut Numbers) -> (Vec<[f64; 3]>, Vec<[f64; 4]>) {
    const COSINES: [f64; 6] = [1.0, 1e-4, 1e-7, -1e-7, -1e-4, -1.0];
    const UNITS: [f64; 3] = [0.0, 0.5, 1.0 - 1.0 / 16_777_216.0];
    let toward = (0..TOWARD).map(|l| match COSINES.get(l) {
        Some(z) => direction(*z, 0.3),
        None => n.direction(),
    });
    let toward = toward.map(|w| w.map(|x| f64::from(x as f32))).collect();
    let units = (0..TOWARD).map(|l| {
        let four = n.four();
        // The first third has ends in every place.
        std::array::from_fn(|k| {
            let end = UNITS[(l / 3usize.pow(k as u32 % 3)) % 3];
            if l < TOWARD / 3 { end } else { four[k] }
        })
    });
    (toward, units.collect())
}

fn is_light(v: &[f64; 3]) -> bool {
    v.iter().all(|x| x.is_finite() && *x >= 0.0)
}

/// Answers that are no numbers, negative, or no directions.
fn unsound(asked: &Asked<'_>, variant: &Variant) -> Result<Option<Diagnostic>, Stuck> {
    let mut n = Numbers::new(asked.seed);
    let program = &variant.program;
    let views = [1.0, 0.5, 1e-4, 1e-7, -1e-7, -0.5];
    for mut at in points() {
        // A footprint, so that what filters does.
        at[FOOTPRINT..]
            .iter_mut()
            .for_each(|x| *x = n.between(-2e-3, 2e-3));
        for k in 0..asked.options.effort.of(12, 128) {
            let z = views.get(k).copied();
            let wo = z.map_or_else(|| n.direction(), |z| direction(z, 0.7));
            let wo = wo.map(|x| f64::from(x as f32));
            if let Some(light) = material::emitted(program, &at, wo)?.filter(|l| !is_light(l)) {
                let place = &at[..3];
                let with = asked.with(&variant.settings);
                let message = format!("emits {light:?} toward {wo:?} at {place:?}, {with}");
                let found = asked.found(Code::NotSound, "", message);
                return Ok(Some(found.expected("finite radiance that is not negative")));
            }
            let (wl, u) = hostile(&mut n);
            let double = answers::<f64>(program, &at, wo, &wl, &u)?;
            let single = answers::<f32>(program, &at, wo, &wl, &u)?;
            for l in 0..TOWARD {
                let all = |c: usize| {
                    [
                        lanes::float_at(&double, c, l),
                        lanes::float_at(&single, c, l),
                    ]
                };
                let numbers = (PDF..LIGHT_THROUGHPUT + 3).map(all);
                let bad = numbers.flatten().find(|x| !(x.is_finite() && *x >= 0.0));
                let (x, y, z) = (all(WI), all(WI + 1), all(WI + 2));
                let length = |p: usize| (x[p] * x[p] + y[p] * y[p] + z[p] * z[p]).sqrt();
                let sampled =
                    (0..2).find(|p| all(PDF)[*p] > 0.0 && (length(*p) - 1.0).abs() > 1e-4);
                let what = match (bad, sampled) {
                    (Some(x), _) => format!("answers {x}"),
                    (None, Some(p)) => format!("samples a direction of length {}", length(p)),
                    (None, None) => continue,
                };
                let (wl, u, place) = (wl[l], u[l], &at[..3]);
                let message = format!(
                    "{what} seen from {wo:?} with light from {wl:?} and the random numbers {u:?} at {place:?}, {}",
                    asked.with(&variant.settings)
                );
                let found = asked.found(Code::NotSound, "", message);
                return Ok(Some(found.expected(
                    "finite numbers that are not negative, and unit directions",
                )));
            }
        }
    }
    Ok(None)
}

/// Single precision that is far from double.
fn imprecise(
    asked: &Asked<'_>,
    variant: &Variant,
    verdict: &mut Verdict,
) -> Result<Option<Diagnostic>, Stuck> {
    let mut n = Numbers::new(asked.seed);
    let (mut far, mut count) = (0usize, 0usize);
    let program = &variant.program;
    let mut worst = (0.0, [0.0; 3], [0.0; 3]);
    for at in points() {
        for _ in 0..asked.options.effort.of(8, 128) {
            let wo = n.direction().map(|x| f64::from(x as f32));
            let wl: Vec<[f64; 3]> = (0..TOWARD)
                .map(|_| n.direction().map(|x| f64::from(x as f32)))
                .collect();
            let u: Vec<[f64; 4]> = wl.iter().map(|_| n.four()).collect();
            let exact = answers::<f64>(program, &at, wo, &wl, &u)?;
            let found = answers::<f32>(program, &at, wo, &wl, &u)?;
            let errors: Vec<f64> = (0..TOWARD)
                .map(|l| error_toward_light(&exact, &found, l))
                .collect();
            count += TOWARD;
            if !errors.iter().any(|error| *error > NEAR) {
                continue;
            }
            let digits = digits((&at, wo), &mut n, (&exact, TOWARD), |at, wo| {
                answers::<f64>(program, at, wo, &wl, &u)
            })?;
            for (l, (error, digits)) in errors.iter().zip(&digits).enumerate() {
                let beyond = error - digits;
                far += usize::from(beyond > NEAR);
                if beyond > worst.0 {
                    worst = (beyond, wo, wl[l]);
                }
            }
        }
    }
    let share = far as f64 / count as f64;
    let few = promised::share(asked.subject).unwrap_or(FEW);
    let what = (
        "precision",
        "share of directions further than 1e-3 from double",
    );
    let with = asked.with(&variant.settings);
    if verdict.measure(what, share, Bound::AtMost(few), || with.clone()) {
        return Ok(None);
    }
    let (error, wo, wl) = worst;
    let message = format!(
        "is far from double precision at {share:.3} of all directions, most (by {error:.1e}) seen from {wo:?} with \
         light from {wl:?}, {with}"
    );
    let found = asked.found(Code::Imprecise, "Precision:", message);
    Ok(Some(
        found
            .expected(format!("at most {few} of them further than {NEAR:e}"))
            .hint(format!(
                "differences of nearly equal numbers lose digits; a fractal may state `Precision: within {:.2}`",
                (share * 1.2).min(1.0)
            )),
    ))
}
