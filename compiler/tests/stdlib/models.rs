//! The models that other programs define, against the same layers written by hand with the numbers that
//! their specifications make of parameters: which part lies over which, what is squared, which way
//! directions are turned.

use super::known::assert_near;
use super::lanes;
use super::open_pbr::{here, same, written};
use super::sampling::view;
use impasto_compiler::Program;

/// A model of the library, called with these arguments.
fn model(name: &str, list: &[(&str, &str)]) -> Program {
    let arguments: String = list.iter().map(|(n, v)| format!("{n}: {v}, ")).collect();
    written(&format!(
        "use std::surface::{name};\nmaterial m {{ material = {name}({arguments}); }}"
    ))
}

/// A material of these statements, with every BSDF of the library that they name.
fn by_hand(statements: &str) -> Program {
    let emits = statements.contains(" uniform(");
    let uses: String = impasto_stdlib::folder("bsdf")
        .filter(|file| statements.contains(&format!(" {}(", file.name)))
        .map(|file| format!("use std::bsdf::{};\n", file.name))
        .chain(emits.then(|| "use std::edf::uniform;\n".into()))
        .collect();
    written(&format!("{uses}material m {{ {statements} }}"))
}

/// Emission head-on and from the side.
fn emitted(p: &Program) -> Vec<f64> {
    let emission = p.compiled()[0].emission.as_ref().expect("it emits");
    let mut all = Vec::new();
    for degrees in [0.0, 50.0] {
        let args = vec![lanes::uniform(&here()), lanes::uniform(&view(degrees))];
        let found = lanes::run::<f64>(p.ir(), emission, args);
        all.extend((0..3).map(|c| lanes::float_at(&found, c, 0)));
    }
    all
}

#[test]
fn gltf_is_the_layers_that_its_extensions_describe() {
    let found = model(
        "gltf_pbr",
        &[
            ("base_color", "color(0.8, 0.5, 0.3)"),
            ("metallic", "0.3"),
            ("roughness", "0.5"),
            ("specular", "0.7"),
            ("specular_color", "color(0.9, 0.8, 0.6)"),
            ("ior", "1.8"),
            ("clearcoat", "0.6"),
            ("clearcoat_roughness", "0.2"),
            (
                "clearcoat_normal",
                "normalize(normal + vector(0.1, 0.05, 0.0))",
            ),
            ("sheen_color", "color(0.3, 0.2, 0.1)"),
            ("sheen_roughness", "0.6"),
            ("emissive", "color(3.0, 2.0, 1.0)"),
            ("emissive_strength", "2"),
        ],
    );
    // Head-on, an index of 1.8 reflects (0.8 / 2.8)^2. Roughness of the fuzz is squared.
    let expected = by_hand(
        "let f0 = 0.081632653 * color(0.9, 0.8, 0.6);
        let gloss = generalized_schlick(color0: 0.7 * f0, color90: color(0.7), roughness: 0.5);
        let opaque = layer(gloss, diffuse(color(0.8, 0.5, 0.3)));
        let metal = generalized_schlick(color0: color(0.8, 0.5, 0.3), roughness: 0.5);
        let fuzz = sheen_conty_kulla(color(0.3, 0.2, 0.1), 0.36);
        let bent = normalize(normal + vector(0.1, 0.05, 0.0));
        let coat = coating(ior: 1.5, roughness: 0.2, normal: bent);
        surface = layer(0.6 * coat, fuzz, mix(opaque, metal, 0.3));
        emission = layer(0.6 * coat, uniform(color(6.0, 4.0, 2.0)));",
    );
    same(&found, &expected, 1e-5);
    for (found, exact) in emitted(&found).into_iter().zip(emitted(&expected)) {
        assert_near(found, exact, 1e-6, "the emission");
    }
}

#[test]
fn gltf_glass_is_solid_where_it_is_thick_and_a_pane_where_not() {
    let clear = [
        ("metallic", "0"),
        ("transmission", "0.6"),
        ("roughness", "0.4"),
        ("ior", "1.4"),
        ("base_color", "color(0.5, 0.9, 0.7)"),
    ];
    let gloss = "let e = color(0.027777778);
        let gloss = generalized_schlick(color0: e, color90: color(1.0), roughness: 0.4);
        let opaque = layer(gloss, diffuse(color(0.5, 0.9, 0.7)));
        let fuzz = sheen_conty_kulla(color(0.0), 0.0);";
    let arguments = "ior: 1.4, roughness: 0.4, tint: color(0.5, 0.9, 0.7)";
    let pane = by_hand(&format!(
        "{gloss} surface = layer(fuzz, mix(opaque, thin_dielectric({arguments}), 0.6));"
    ));
    same(&model("gltf_pbr", &clear), &pane, 1e-5);
    let solid = by_hand(&format!(
        "{gloss} surface = layer(fuzz, mix(opaque, dielectric({arguments}), 0.6));
        interior = medium(ior: 1.4);"
    ));
    let thick = [&clear[..], &[("thickness", "1 cm")]].concat();
    same(&model("gltf_pbr", &thick), &solid, 1e-5);
    // A tenth of red is left after 2 cm.
    let dyed = [
        &thick[..],
        &[
            ("attenuation_color", "color(0.1, 1.0, 1.0)"),
            ("attenuation_distance", "2 cm"),
        ],
    ]
    .concat();
    let dyed = model("gltf_pbr", &dyed);
    let medium = dyed.instances()[0].info.medium.expect("an interior");
    assert_near(
        f64::from(medium.absorption[0]),
        10f64.ln() / 0.02,
        1e-5,
        "red",
    );
    assert_eq!((medium.absorption[1], medium.absorption[2]), (0.0, 0.0));
}

/// Alpha counts in the mode BLEND; in MASK, from the cutoff on, all is there, and below nothing.
#[test]
fn gltf_alpha_is_ignored_masks_or_blends() {
    let found = |mode, alpha| {
        let list = [
            ("alpha_mode", mode),
            ("alpha", alpha),
            ("alpha_cutoff", "0.6"),
        ];
        model("gltf_pbr", &list)
    };
    let expected = |opacity| {
        by_hand(&format!(
            "let metal = generalized_schlick(color0: color(1.0), roughness: 1.0);
            surface = layer( sheen_conty_kulla(color(0.0), 0.0), metal);
            opacity = {opacity};"
        ))
    };
    for (mode, alpha, opacity) in [
        ("0", "0.3", "1.0"),
        ("1", "0.6", "1.0"),
        ("1", "0.59", "0.0"),
        ("2", "0.3", "0.3"),
    ] {
        same(&found(mode, alpha), &expected(opacity), 1e-5);
    }
}

/// What is left after the depth is the color, whatever share of the loss is scattering.
#[test]
fn standard_surface_counts_scattering_a_depth() {
    let inked = model(
        "standard_surface",
        &[
            ("transmission", "1"),
            ("transmission_color", "color(0.1, 0.5, 0.5)"),
            ("transmission_depth", "2 cm"),
            ("transmission_scatter", "color(0.5, 0.25, 0.0)"),
            ("transmission_scatter_anisotropy", "0.3"),
        ],
    );
    let medium = inked.instances()[0].info.medium.expect("an interior");
    let lost = [10f64.ln(), 2f64.ln(), 2f64.ln()];
    for (c, (lost, scattered)) in lost.into_iter().zip([0.5, 0.25, 0.0]).enumerate() {
        let found = [medium.absorption[c], medium.scattering[c]].map(f64::from);
        assert_near(found[0], (lost - scattered) / 0.02, 1e-5, "the absorption");
        assert_near(found[1], scattered / 0.02, 1e-5, "the scattering");
    }
    assert_near(f64::from(medium.anisotropy), 0.3, 1e-6, "the anisotropy");
}

#[test]
fn the_principled_model_is_the_layers_that_it_describes() {
    let found = model(
        "disney_principled",
        &[
            ("baseColor", "color(0.8, 0.4, 0.2)"),
            ("metallic", "0.25"),
            ("subsurface", "0.3"),
            ("specular", "0.6"),
            ("roughness", "0.4"),
            ("specularTint", "0.5"),
            ("anisotropic", "0.3"),
            ("sheen", "0.7"),
            ("sheenTint", "0.4"),
            ("clearcoat", "0.8"),
            ("clearcoatGloss", "0.7"),
            ("specTrans", "0.2"),
            ("ior", "1.4"),
        ],
    );
    // The hue is the color over its luminance in the primaries of Rec. 709.
    let expected = by_hand(
        "let base = color(0.8, 0.4, 0.2);
        let hue = base / (0.2126 * 0.8 + 0.7152 * 0.4 + 0.0722 * 0.2);
        let body = mix( burley_diffuse(base, 0.4), subsurface(color: base), 0.3);
        let cloth = 0.7 * sheen_conty_kulla(0.5 * mix(color(1.0), hue, 0.4));
        let highlight = generalized_schlick(
            color0: mix(0.048 * mix(color(1.0), hue, 0.5), base, 0.25),
            roughness: 0.4,
            anisotropy: 0.3,
        );
        let solid = layer(highlight, 0.75 * layer(cloth, body));
        let glass = dielectric(ior: 1.4, roughness: 0.4, tint: sqrt(base), anisotropy: 0.3);
        surface = layer(0.2 * clear_coat(roughness: 0.3), mix(solid, glass, 0.15));
        interior = medium(ior: 1.4);",
    );
    same(&found, &expected, 1e-4);
}
