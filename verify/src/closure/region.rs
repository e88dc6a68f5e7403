//! Where single precision may be off by more than elsewhere: lines
//! `Region: within 0.01 where condition` of a BSDF's documentation. The condition is Impasto, over
//! the BSDF's parameters, `wo` and `wi`, so what people read is what the tests run. `a jump where`
//! says that the formula itself jumps there, from one value to 0: rounding takes either side.

use impasto_compiler::ir::{FunctionId, Module};
use impasto_compiler::{MemoryLoader, check, diag};

use super::{Bsdf, granted};
use crate::evaluate;
use crate::lanes::{Column, Lanes, Stuck};

/// The greatest relative error of values, densities and weights outside all stated regions.
pub const FINE: f64 = 1e-4;

/// Conditions that documentation names.
const NAMED: &str = "
    // Does light meet the facet that mirrors or refracts it next to the edge of total reflection,
    // where the slope of Fresnel's formula is infinite, or along the facet?
    fn edge_of_reflection(wo: vector, wi: vector, ior: float) -> bool {
        let o = upper(wo);
        let i = beside(wo, wi);
        let n = index_met(wo, ior);
        if wo.z * wi.z > 0.0 {
            let a = dot(o, normalize(o + i));
            let b = dot(o, normalize(o + mirrored(i)));
            let d = (n - 1.0) * (n + 1.0);
            abs(d + a * a) < 1e-3 || abs(d + b * b) < 1e-3
        } else {
            facet_grazed(o, i, n) || facet_grazed(o, mirrored(i), n)
        }
    }
    fn facet_grazed(o: vector, i: vector, n: float) -> bool {
        let m = normalize(o + i * n);
        abs(dot(o, m)) < 0.01 || abs(dot(i, m)) < 0.01
    }
    // Does the facet that refracts the light stand upright? Beyond that there is none.
    fn facet_at_horizon(wo: vector, wi: vector, ior: float) -> bool {
        let o = upper(wo);
        let i = beside(wo, wi);
        let n = index_met(wo, ior);
        let upright = min(abs(normalize(o + i * n).z), abs(normalize(o + mirrored(i) * n).z));
        wo.z * wi.z < 0.0 && upright < 1e-3
    }
    // The edge of total reflection for metals, seen from outside: where nothing is absorbed, they are dielectrics.
    fn edge_of_metal(wo: vector, wi: vector, ior: color, k: color) -> bool {
        let c = abs(dot(wo, half_vector(wo, wi)));
        far_from_edge(c, ior, k) < 1e-3
    }
    // The same at one of the three angles over which `average_conductor` takes its mean.
    fn edge_of_metal_on_average(ior: color, k: color) -> bool {
        let a = far_from_edge(0.335711, ior, k);
        let b = far_from_edge(0.707107, ior, k);
        let c = far_from_edge(0.941965, ior, k);
        min(a, min(b, c)) < 2e-4
    }
    fn far_from_edge(c: float, ior: color, k: color) -> float {
        let far = abs(conductor_q2(c, ior, k)) + 2.0 * ior * k;
        min(far.r, min(far.g, far.b))
    }
    // The edge of total reflection for a smooth boundary, met at the cosine c with the index n.
    fn edge_of_total(c: float, n: float) -> bool =
        abs((n - 1.0) * (n + 1.0) + c * c) < 1e-3;
    fn least_alpha(ior: float, roughness: float, anisotropy: float) -> float {
        let a = boundary_alpha(contrasting(ior), roughness, anisotropy);
        min(a.x, a.y)
    }
";

/// The stated regions of a BSDF.
#[derive(Default)]
pub struct Regions {
    module: Module,
    stated: Vec<(FunctionId, f64)>,
}

impl Regions {
    /// Those that the documentation of `bsdf` states.
    ///
    /// # Errors
    /// What is wrong with a line, or the diagnostics of its condition.
    pub fn of(bsdf: &Bsdf) -> Result<Self, String> {
        let parsed = bsdf.said("Region:").map(|line| {
            let (what, condition) = line.split_once(" where ")?;
            let within = match what {
                "a jump" => f64::INFINITY,
                what => what.strip_prefix("within ")?.parse().ok()?,
            };
            Some((condition.trim_end_matches('.'), within))
        });
        let parsed: Option<Vec<(&str, f64)>> = parsed.collect();
        let parsed = parsed.ok_or("the line is `Region: within X where condition`")?;
        if parsed.is_empty() {
            return Ok(Self::default());
        }
        let functions = parsed.iter().enumerate();
        let functions: String = functions
            .map(|(i, (condition, _))| {
                format!(
                    "fn region_{i}({}) -> bool = {condition};\n",
                    parameters(bsdf)
                )
            })
            .collect();
        let mut files = MemoryLoader::default();
        files.add("regions.impasto", functions + NAMED);
        let checked = check("regions.impasto", &mut files);
        if diag::has_errors(&checked.diagnostics) {
            return Err(diag::render::text(
                &checked.sources,
                &checked.diagnostics,
                false,
            ));
        }
        let known = &checked.ir.functions;
        let stated = parsed.iter().enumerate().filter_map(|(i, (_, within))| {
            let name = format!("region_{i}");
            let at = known.iter().position(|f| f.name == name)?;
            Some((FunctionId(at as u32), *within))
        });
        Ok(Self {
            stated: stated.collect(),
            module: checked.ir,
        })
    }

    /// What error is stated in each lane, `FINE` outside all regions.
    ///
    /// # Errors
    /// [`Stuck`], if a condition takes too long.
    pub fn within(&self, args: &[Lanes], lanes: usize) -> Result<Vec<f64>, Stuck> {
        let mut within = vec![FINE; lanes];
        for (id, stated) in &self.stated {
            let f = &self.module.functions[id.index()];
            let holds = evaluate::answers::<f64>(&self.module, f, args.to_vec(), &granted())?;
            let Some(Column::Bool(holds)) = holds.first() else {
                continue;
            };
            for (l, within) in within.iter_mut().enumerate() {
                if holds[if holds.len() == 1 { 0 } else { l }] {
                    *within = within.max(*stated);
                }
            }
        }
        Ok(within)
    }
}

/// Parameters of a condition. Dimensions are left out: a length is a float of metres.
fn parameters(bsdf: &Bsdf) -> String {
    let names = bsdf.params().iter().zip(&bsdf.types);
    let each = names.map(|(p, ty)| {
        let ty = if ty == "length" || ty == "angle" {
            "float"
        } else {
            ty
        };
        format!("{}: {ty}, ", p.name)
    });
    each.collect::<String>() + "wo: vector, wi: vector"
}
