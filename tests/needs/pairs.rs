//! The pairs: what a row brings, and two scenes of which one needs it.

use super::scenes::{
    Corners, DIRECTION, DISC, DISC_BY_CHANCE, MAP, QUAD, QUAD_BY_CHANCE, SECOND_QUAD, SKY, SPHERE,
    SPOT, TWO_SIDED, Text, queued,
};
use impasto::runtime::technique::{CameraRays, LastRays, RayData, RayKernels, RayOrder, Technique};

/// Two scenes that differ in a row.
pub struct Pair {
    /// The row's name.
    pub row: &'static str,
    /// Rows that it cannot be without, or that cannot be without it.
    pub also: &'static [&'static str],
    /// What the kernels have more, and less.
    pub items: &'static str,
    pub without: fn() -> Text,
    pub with: fn() -> Text,
}

/// Rows without a pair here, and where they are tested.
pub const HELD_ELSEWHERE: [(&str, &str); 2] = [
    (
        "an origin of the scene's own",
        "runtime/tests/gpu/extremes: scenes that are moved",
    ),
    (
        "some pixels only",
        "runtime/tests/gpu/pixels.rs: it is no property of a scene",
    ),
];

const SHADE: &str = "surface = diffuse(color(0.3));";
const MIRROR: &str = "surface = specular(color(0.9));";
const PANE: &str = "surface = smooth_dielectric(ior: 1.5);";

fn lit(lights: &[&'static str]) -> Text {
    Text {
        lights: lights.to_vec(),
        ..Text::default()
    }
}

fn thing(thing: &'static str) -> Text {
    Text {
        thing: Some(thing),
        ..Text::default()
    }
}

fn beside(thing: &'static str, other: &'static str) -> Text {
    Text {
        thing: Some(thing),
        other: Some(other),
        ..Text::default()
    }
}

fn under(environment: &'static str, text: Text) -> Text {
    Text {
        environment,
        ..text
    }
}

fn recording(outputs: &'static [&'static str]) -> Text {
    Text {
        outputs,
        ..Text::default()
    }
}

fn with(corners: Corners, text: Text) -> Text {
    Text { corners, ..text }
}

fn with_uvs(text: Text) -> Text {
    Text {
        corners: Corners::Uvs,
        ..text
    }
}

macro_rules! pairs {
    ($($row:literal, also $also:expr, $items:literal, $without:expr => $with:expr;)+) => {
        pub const PAIRS: [Pair; [$($row),+].len()] = [$(Pair {
            row: $row,
            also: $also,
            items: $items,
            without: || $without,
            with: || $with,
        }),+];
    };
}

pairs! {
    "mesh lights", also &[], "functions +mesh_light_hit +sample_mesh_light",
        Text { thing: Some(SHADE), ..lit(&[QUAD, SECOND_QUAD]) }
        => Text {
            thing: Some("surface = diffuse(color(0.3)); emission = uniform(color(4.0));"),
            ..lit(&[QUAD, SECOND_QUAD])
        };
    "quad lights", also &[], "functions +quad_light_hit +sample_quad_light",
        Text { thing: Some("surface = diffuse(color(0.3)); emission = uniform(color(4.0));"), ..lit(&[]) }
        => Text { thing: Some("surface = diffuse(color(0.3)); emission = uniform(color(4.0));"), ..lit(&[QUAD]) };
    "two-sided quads", also &[], "functions +is_two_sided", lit(&[QUAD]) => lit(&[TWO_SIDED]);
    "sphere lights", also &[], "bindings +sphere_lights; functions +sample_sphere_light +sphere_light_hit",
        lit(&[QUAD, SECOND_QUAD]) => lit(&[QUAD, SPHERE]);
    "spots", also &[], "functions +spot_share", lit(&[SPHERE]) => lit(&[SPOT]);
    "distant lights in one direction", also &["sampled light from infinity"], "functions +distant_light +sample_distant_light",
        lit(&[QUAD, SECOND_QUAD]) => lit(&[QUAD, DIRECTION]);
    "distant lights with an angle", also &[], "functions +distant_light +distant_light_escape +sample_distant_light",
        under(SKY, lit(&[QUAD])) => under(SKY, lit(&[QUAD, DISC]));
    "uniform environment", also &[], "functions +environment_escape +sample_environment", lit(&[QUAD, DISC]) => under(SKY, lit(&[QUAD, DISC]));
    "environment map", also &[], "bindings +environment_alias +environment_texels; functions +environment_escape \
         +environment_radiance +environment_uv +pick_slot +pole_height +renew \
         +sample_environment +turn_about_y", lit(&[QUAD, DISC]) => under(MAP, lit(&[QUAD, DISC]));
    "lights that paths run into", also &["quad lights"], "functions +area_density +area_hit +light_hit +light_radiance +no_light_sample \
         +primitive_light +quad_light_hit +sample_area +sample_quad_light +triangle_area",
        under(SKY, lit(&[DISC])) => under(SKY, lit(&[DISC, QUAD]));
    "light from infinity", also &["distant lights with an angle"], "functions +distant_light_escape +light_escape",
        lit(&[QUAD, DIRECTION]) => lit(&[QUAD, DIRECTION, DISC]);
    "shadow rays", also &["multiple importance sampling"], "+16 bytes; kernels +shadow; functions +aim +area_density +end_shadow +is_shadow_decided \
         +keep_shadow +light_contribution +light_probability +light_share +load_contribution \
         +load_shadow_direction +load_shadow_origin \
         +no_light_sample +pick_light +power_heuristic +request_shadow +sample_area \
         +sample_light +sample_quad_light +scattering_weight +shadow_ray \
         +store_contribution +store_shadow_direction +store_shadow_origin",
        lit(&[QUAD_BY_CHANCE]) => lit(&[QUAD]);
    "choice of a light", also &[], "functions +light_place +multiply_high +renew_word", lit(&[QUAD]) => lit(&[QUAD, SECOND_QUAD]);
    "multiple importance sampling", also &[], "functions +light_share +power_heuristic +scattering_weight",
        lit(&[QUAD_BY_CHANCE, DIRECTION]) => lit(&[QUAD, DIRECTION]);
    "sampled light from infinity", also &[], "",
        lit(&[QUAD, DISC_BY_CHANCE]) => lit(&[QUAD, DISC]);
    "hits without a light sample", also &[], "functions +scatters_sampled_light", thing(SHADE) => thing(MIRROR);
    "shadow origins", also &[], "+16 bytes", thing(SHADE) => thing("surface = translucent(color(0.3));");
    "media", also &["absorption", "paths that change their medium"], "+16 bytes; bindings +medium_table; functions +active_medium +cross_boundary \
         +load_media +media_beyond +primitive_medium +store_media +transmittance \
         +without_medium",
        thing("surface = smooth_dielectric(ior: 1.5); interior = medium(ior: 1.5);")
        => thing("surface = smooth_dielectric(ior: 1.5); interior = medium(ior: 1.5, absorption: color(3.0));");
    "absorption", also &[], "functions +transmittance",
        thing("surface = smooth_dielectric(ior: 1.5 / exterior_ior); interior = medium(ior: 1.5);")
        => thing("surface = smooth_dielectric(ior: 1.5 / exterior_ior); interior = medium(ior: 1.5, absorption: color(3.0));");
    "media that scatter", also &[], "bindings +volume_table; functions +chosen +ended +extension +fly +free_flight +keep_flight +max_component \
         +next_stop +path_of +ray_transmittance +scattered_cosine +scatters +trace +trace_closest +trace_to_surface +turn_bits +turned_from \
         -end_extension -is_extension_decided",
        thing("surface = smooth_dielectric(ior: 1.5); interior = medium(ior: 1.5, absorption: color(3.0));")
        => thing("surface = smooth_dielectric(ior: 1.5); interior = medium(ior: 1.5, absorption: color(3.0), scattering: color(2.0));");
    "overlapping media", also &[], "functions +extension +is_false_boundary +trace +trace_closest +trace_to_boundary \
         -end_extension -is_extension_decided",
        beside(
            "surface = smooth_dielectric(ior: 1.5 / exterior_ior); interior = medium(ior: 1.5, priority: 2);",
            "surface = smooth_dielectric(ior: 1.3 / exterior_ior); interior = medium(ior: 1.3, priority: 2);",
        )
        => beside(
            "surface = smooth_dielectric(ior: 1.5 / exterior_ior); interior = medium(ior: 1.5, priority: 2);",
            "surface = smooth_dielectric(ior: 1.3 / exterior_ior); interior = medium(ior: 1.3, priority: 1);",
        );
    "paths that change their medium", also &[], "functions +cross_boundary",
        beside("surface = diffuse(color(0.3)); interior = medium(ior: 1.5, absorption: color(3.0));", PANE)
        => beside("surface = smooth_dielectric(ior: 1.5); interior = medium(ior: 1.5, absorption: color(3.0));", PANE);
    "index outside of surfaces", also &[], "functions +exterior_index +media_outside",
        thing("surface = smooth_dielectric(ior: 1.5); interior = medium(ior: 1.5, absorption: color(3.0));")
        => thing("surface = smooth_dielectric(ior: 1.5 / exterior_ior); interior = medium(ior: 1.5, absorption: color(3.0));");
    "walks below surfaces", also &[], "+64 bytes; kernels +below; functions +begin_below +below +decay +ended \
         +fly_below +free_flight +lambertian +leave_surface_diffusely +load_below +load_below_plain +load_below_pulled \
         +load_below_rates +matter_after +max_component +next_stop +pack_below +phase +request_below +resolved_rates \
         +scattered_cosine +step_below +store_below +store_below_plain +store_below_pulled +store_below_rates +trace \
         +trace_closest +turn_bits +turned_from +turns_so_far +unpack_below",
        thing("surface = translucent(color(0.3));") => thing("surface = random_walk(color(0.3));");
    "emission that varies", also &[], "functions +checked_emission +material_emission +needs_last_evaluation",
        thing(SHADE) => thing("surface = diffuse(color(0.3)); emission = uniform(color(0.5 + 0.5 * normal.y));");
    "positions", also &[], "", thing(SHADE) => thing("surface = diffuse(color(0.4 + 0.2 * sin(position.x)));");
    "vertex normals", also &[], "bindings +vertex_normals; functions +hit_normal +unpack_normal",
        Text::default() => Text { corners: Corners::Normals, ..Text::default() };
    "texture coordinates", also &[], "functions +hit_uv",
        with_uvs(thing(SHADE)) => with_uvs(thing("surface = diffuse(color(0.3 + 0.4 * uv.x));"));
    "tangents", also &[], "bindings +vertex_uvs; functions +hit_tangent", Text::default() => with_uvs(Text::default());
    "ray cones", also &[], "+16 bytes; functions +footprint +load_cone +scattered_spread +store_cone",
        thing("surface = diffuse(color(0.4 + 0.2 * sin(position.x)));")
        => thing("surface = diffuse(color(0.4 + 0.2 * sin(position.x) * exp(-1.0 * filter_width(position).x)));");
    "widths of texture coordinates", also &["ray cones"], "+16 bytes; functions +attribute_corners +barycentric_change \
         +footprint +hit_uv_change +load_cone +scattered_spread +store_cone",
        with_uvs(thing("surface = diffuse(color(0.3 + 0.4 * uv.x));"))
        => with_uvs(thing("surface = diffuse(color(0.3 + 0.4 * uv.x * exp(-1.0 * filter_width(uv).x)));"));
    "a second set of texture coordinates", also &[], "bindings +vertex_uvs1; functions +attribute_corners +hit_uv1",
        with(Corners::Uvs1, thing(SHADE))
        => with(Corners::Uvs1, thing("surface = diffuse(color(0.3 + 0.4 * uv1.x));"));
    "widths of the second set", also &["ray cones"], "+16 bytes; functions +barycentric_change +footprint +hit_uv1_change +load_cone +scattered_spread +store_cone",
        with(Corners::Uvs1, thing("surface = diffuse(color(0.3 + 0.4 * uv1.x));"))
        => with(Corners::Uvs1, thing("surface = diffuse(color(0.3 + 0.4 * uv1.x * exp(-1.0 * filter_width(uv1).x)));"));
    "vertex colors", also &[], "bindings +vertex_colors; functions +attribute_corners +hit_color +vertex_color_of",
        with(Corners::Colors, thing(SHADE)) => with(Corners::Colors, thing("surface = diffuse(vertex_color);"));
    "widths of vertex colors", also &["ray cones"], "+16 bytes; functions +barycentric_change +footprint +hit_color_change +load_cone +scattered_spread +store_cone",
        with(Corners::Colors, thing("surface = diffuse(vertex_color);"))
        => with(Corners::Colors, thing("surface = diffuse(vertex_color * exp(-1.0 * filter_width(vertex_color).r));"));
    "view directions", also &[], "",
        thing(SHADE) => thing("surface = diffuse(color(0.3 + 0.4 * facing));");
    "places of objects", also &[], "bindings +triangle_places; functions +hit_place",
        thing(SHADE) => thing("surface = diffuse(color(0.3 + 0.4 * instance_random(1)));");
    "spaces of objects", also &["places of objects"], "bindings +place_spaces +triangle_places; functions +hit_object_position +hit_place",
        thing(SHADE) => thing("surface = diffuse(color(0.4 + 0.2 * sin(object_position.x)));");
    "textures", also &[], "bindings +texture_data; functions +texel +texture_fetch +wrap_texel",
        with_uvs(thing("surface = diffuse(color(0.3 + 0.4 * uv.x));"))
        => with_uvs(thing("surface = diffuse(image(picture, uv));"));
    "choice of a lobe", also &[], "",
        thing(SHADE) => thing("surface = layer(0.2 * blinn_phong(20.0), diffuse(color(0.3)));");
    "Russian roulette", also &[], "functions +max_component +roulette +survival_probability",
        Text::default() => Text { integrator: "max_depth = 4\nroulette_start = 2", ..Text::default() };
    "lens", also &[], "",
        Text::default() => Text { camera: "aperture = 0.1\nfocus = 3", ..Text::default() };
    "placed objects", also &[], "bindings +placement_blocks +placement_materials +placements; functions \
         +enter_placement +is_mirrored +material_row +place_of +place_point +placed_triangle \
         +set_slabs +take_in_tree",
        Text { shared: Some(false), ..Text::default() } => Text { shared: Some(true), ..Text::default() };
    "outputs of the first hit", also &[], "functions +add_carrying +facing +film_add_signed +film_add_values +record_first_hit",
        Text::default() => recording(&["geometric_normal"]);
    "outputs of materials", also &[], "functions +add_carrying +film_add_signed +film_add_values +material_albedo +record_material",
        Text::default() => recording(&["albedo"]);
    "outputs of samples", also &[], "functions +add_carrying +film_add_signed +film_add_values +record_sample",
        Text::default() => recording(&["variance"]);
    "light groups", also &[], "+16 bytes; bindings +light_groups; functions +add_carrying +film_add_signed +film_add_values \
         +hit_group +light_group +load_light_group +record_light +store_light_group",
        Text::default() => recording(&["lights"]);
    "rays in an order of their own", also &[], "kernels +bin_extension +bin_shadow +scan_extension +scan_shadow +scatter_extension \
         +scatter_shadow; bindings +bins; functions +bin_extension +bin_ray +bin_shadow \
         +ray_bin",
        Text::default()
        => Text {
            technique: Technique { ray_order: RayOrder::Coarse, ..queued() },
            ..Text::default()
        };
    "rays in buffers of their own", also &[], "+16 bytes; bindings +extension_hits +extension_rays +shadow_rays +shadow_results; \
         functions +is_ray_wanted +keep_requests +load_requests +requested_hit \
         +store_requests -load_shadow_direction -load_shadow_origin -store_shadow_direction \
         -store_shadow_origin",
        Text::default()
        => Text {
            technique: Technique { ray_data: RayData::Requests, ..queued() },
            ..Text::default()
        };
    "all rays cast by one kernel", also &[], "+16 bytes; kernels +rays -extension -shadow",
        Text { technique: Technique { ray_kernels: RayKernels::Each, ..queued() }, ..Text::default() }
        => Text { technique: Technique { ray_kernels: RayKernels::One, ..queued() }, ..Text::default() };
    "rays of the camera cast at once", also &[], "functions +trace +trace_closest",
        Text::default()
        => Text {
            technique: Technique { camera_rays: CameraRays::AtOnce, ..queued() },
            ..Text::default()
        };
    "hits of the camera's rays decided at once", also &[], "kernels +prepare_paths; functions +put_down",
        Text {
            technique: Technique { camera_rays: CameraRays::AtOnce, ..queued() },
            ..Text::default()
        }
        => Text {
            technique: Technique { camera_rays: CameraRays::Straight, ..queued() },
            ..Text::default()
        };
    "last rays towards lights only", also &[], "functions +is_last +may_meet_light",
        Text::default()
        => Text {
            technique: Technique { last_rays: LastRays::Lights, ..queued() },
            ..Text::default()
        };
}
