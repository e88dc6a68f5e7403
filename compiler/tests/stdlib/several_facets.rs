//! What GGX surfaces lose to second facets: the fits of `core/ggx_energy` against integrals of the
//! formulas themselves, and the lobe that brings the loss back.

use super::text::Text;

const LOSS: &str = "
    fn alpha(roughness: float, anisotropy: float) -> vec2 = ggx_alpha(roughness, anisotropy);
    fn loss(w: vector, alpha: vec2, anisotropy: float) -> float =
        ggx_loss(ggx_loss_of(alpha, anisotropy), ggx_terms(ggx_view(w, alpha)));
    fn mean(alpha: vec2, anisotropy: float) -> float = ggx_loss_of(alpha, anisotropy).mean;
    // How bright the lobe of several facets is, over how often `wi` is sampled for it.
    fn weight(wi: vector, alpha: vec2, anisotropy: float) -> float {
        let loss = ggx_loss_of(alpha, anisotropy);
        ggx_diffuse(loss, 1.0, ggx_loss(loss, ggx_terms(ggx_view(wi, alpha))), wi)
            / ggx_or_diffuse_pdf(vector(0.0, 0.0, 1.0), wi, alpha, loss, 1.0)
    }
";

/// Greatest loss that is not brought back, and greatest gain, without anisotropy and with it.
const BOUNDS: [(f64, f64); 2] = [(-0.0018, 0.0009), (-0.0092, 0.0009)];

const ROUGHNESS: [f64; 12] = [
    0.01, 0.05, 0.11, 0.21, 0.3, 0.39, 0.48, 0.57, 0.67, 0.79, 0.9, 1.0,
];
const ANISOTROPY: [f64; 7] = [0.0, 0.35, 0.6, 0.85, 1.0, -0.5, -1.0];
const COSINES: [f64; 10] = [1e-3, 0.01, 0.03, 0.08, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0];

/// 1 - E(w): one less the mean of G2 / G1 over facets seen from `w`, by `count` evenly spread ones.
/// Written down again from Heitz 2014 (shadowing) and Dupuy and Benyoub 2023 (facets).
fn integrated(w: [f64; 3], alpha: [f64; 2], count: usize) -> f64 {
    let stretched = |v: [f64; 3]| [v[0] * alpha[0], v[1] * alpha[1], v[2]];
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let lambda = |v: [f64; 3]| 0.5 * (length(stretched(v)) / v[2] - 1.0);
    let view = stretched(w).map(|x| x / length(stretched(w)));
    let mut kept = 0.0;
    for i in 0..count {
        let u = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2]
            .map(|g| (0.5 + g * i as f64).fract());
        let z = (1.0 - u[0]) * (1.0 + view[2]) - view[2];
        let (s, phi) = ((1.0 - z * z).max(0.0).sqrt(), std::f64::consts::TAU * u[1]);
        let m = stretched([
            s * phi.cos() + view[0],
            s * phi.sin() + view[1],
            z + view[2],
        ]);
        let m = m.map(|x| x / length(m));
        let cosine: f64 = (0..3).map(|k| m[k] * w[k]).sum();
        let wi: [f64; 3] = std::array::from_fn(|k| 2.0 * cosine * m[k] - w[k]);
        if wi[2] > 0.0 {
            kept += (1.0 + lambda(w)) / (1.0 + lambda(w) + lambda(wi));
        }
    }
    1.0 - kept / count as f64
}

fn direction(z: f64, phi: f64) -> [f64; 3] {
    let s = (1.0 - z * z).max(0.0).sqrt();
    [s * phi.cos(), s * phi.sin(), z]
}

#[test]
fn the_loss_is_that_of_single_facets() {
    let text = Text::new(LOSS);
    for roughness in ROUGHNESS {
        for anisotropy in ANISOTROPY {
            let alpha = text.call::<f64>("alpha", &[&[roughness], &[anisotropy]]);
            let (least, most) = BOUNDS[usize::from(anisotropy != 0.0)];
            let azimuths: &[f64] = if anisotropy == 0.0 {
                &[0.3]
            } else {
                &[0.0, 0.5, 1.0, 1.35, std::f64::consts::FRAC_PI_2]
            };
            for (z, &phi) in COSINES
                .iter()
                .flat_map(|z| azimuths.iter().map(move |p| (z, p)))
            {
                let w = direction(*z, phi);
                let exact = integrated(w, [alpha[0], alpha[1]], 1 << 13);
                let args: [&[f64]; 3] = [&w, &alpha, &[anisotropy]];
                let fit = text.call::<f64>("loss", &args)[0];
                assert!(
                    (least..=most).contains(&(fit - exact)),
                    "roughness {roughness}, anisotropy {anisotropy}, from {w:?}: {fit} of {exact}"
                );
                let single = text.call::<f32>("loss", &args)[0];
                assert!(
                    (single - fit).abs() < 2e-5,
                    "single precision: {single}, {fit}"
                );
            }
        }
    }
}

#[test]
fn the_loss_of_the_roughest_surface_has_its_closed_form() {
    let text = Text::new(LOSS);
    for z in COSINES {
        // At alpha 1, mirrored directions are spread evenly over a cap: E = 1 - z log(1 + 1/z).
        let exact = z * (1.0 + 1.0 / z).ln();
        assert!((integrated(direction(z, 0.0), [1.0; 2], 1 << 14) - exact).abs() < 5e-4);
        let fit = text.call::<f64>("loss", &[&direction(z, 0.0), &[1.0, 1.0], &[0.0]])[0];
        assert!((-0.0018..0.0009).contains(&(fit - exact)), "{z}: {fit}");
    }
}

/// The mean of `of` over directions above, weighted by the cosine; evenly in the logarithm of
/// z^2 + `near`.
fn mean_by_cosine(near: f64, of: impl Fn([f64; 3]) -> f64) -> f64 {
    let reach = (1.0 + 1.0 / near).ln();
    let (rows, columns) = (400, 9);
    let mut sum = 0.0;
    for i in 0..rows {
        let u = (f64::from(i) + 0.5) / f64::from(rows);
        let z2 = near * ((reach * u).exp() - 1.0);
        for j in 0..columns {
            let phi = (f64::from(j) + 0.5) / f64::from(columns) * std::f64::consts::FRAC_PI_2;
            sum += of(direction(z2.sqrt(), phi)) * (z2 + near) * reach;
        }
    }
    sum / f64::from(rows * columns)
}

#[test]
fn what_several_facets_return_is_all_that_single_facets_lose() {
    let text = Text::new(LOSS);
    for roughness in ROUGHNESS {
        for anisotropy in ANISOTROPY {
            let alpha = text.call::<f64>("alpha", &[&[roughness], &[anisotropy]]);
            let near = (alpha[0] * alpha[1]).max(1e-8);
            let loss = |w: [f64; 3]| text.call::<f64>("loss", &[&w, &alpha, &[anisotropy]])[0];
            let summed = mean_by_cosine(near, loss);
            let said = text.call::<f64>("mean", &[&alpha, &[anisotropy]])[0];
            // As light: no direction of an anisotropic or a rough surface loses more than 0.7,
            // none of a nearly smooth one more than 0.15.
            let share = if alpha[0].max(alpha[1]) < 0.1 {
                0.15
            } else {
                0.7
            };
            let off = (said / summed - 1.0).abs() * share;
            let within = if anisotropy == 0.0 { 3e-4 } else { 1.2e-3 };
            assert!(
                off < within,
                "roughness {roughness}, anisotropy {anisotropy}: {said}, not {summed}"
            );
        }
    }
}

#[test]
fn the_lobe_of_several_facets_is_sampled_as_it_shines() {
    let text = Text::new(LOSS);
    for roughness in ROUGHNESS {
        for (anisotropy, most) in [(0.0, 1.4), (0.8, 2.0), (-1.0, 2.0)] {
            let alpha = text.call::<f64>("alpha", &[&[roughness], &[anisotropy]]);
            for (z, phi) in COSINES
                .iter()
                .flat_map(|z| [0.0, 0.8, 1.5].map(|p| (*z, p)))
            {
                let args: [&[f64]; 3] = [&direction(z, phi), &alpha, &[anisotropy]];
                for weight in [
                    text.call::<f64>("weight", &args),
                    text.call::<f32>("weight", &args),
                ] {
                    assert!(
                        (0.0..=most).contains(&weight[0]),
                        "roughness {roughness}, anisotropy {anisotropy}: {} at {z}, {phi}",
                        weight[0]
                    );
                }
            }
        }
    }
}
