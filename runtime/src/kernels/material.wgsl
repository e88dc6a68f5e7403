// The shell around generated material code: the surface point in, the next rays out.

fn material(slot: u32, instance: u32) {
    var path = load_radiance(slot);
    let hit = load_hit(slot);
    let arrived = load_ray_direction(slot);
    let pixel = load_ray_origin(slot).pixel;
    let carried = load_throughput(slot);
    let side = hit_geometric_normal(hit.primitive);
    let position = hit_position(hit.primitive, vec2<f32>(hit.u, hit.v));
    let vertex = (path.flags & DEPTH_MASK) - 1u;
    // To the sample of a light; of length 0 without one.
    var wl = vec3<f32>(0.0);
#if shadow_rays
    let asks = (path.flags & PATH_LIT) != 0u;
    var light: LightSample;
    if asks {
        let bits = random_bits(pixel, arrived.sample, vertex_draw(vertex, DRAW_LIGHT));
        light = sample_light(position, bits);
#if light_groups
        store_light_group(slot, PathLightGroup(light_group(pick_light(bits).light), 0u, 0u, 0u));
#endif
    }
    let lit = any(light.radiance > vec3<f32>(0.0));
    if lit {
        wl = light.wi;
    }
#endif
#if subsurface
    // From below the surface light goes out as if it came from outside.
    let leaves = (path.flags & PATH_BELOW) != 0u;
    let wo = select(-arrived.direction, arrived.direction, leaves);
#else
    let wo = -arrived.direction;
#endif
#if media
    let media = load_media(slot).stack;
    let medium = primitive_medium(hit.primitive);
    let inside = dot(side, wo) < 0.0;
#endif
#if exterior_ior
    let exterior = exterior_index(media, medium, inside);
#else
    let exterior = 1.0;
#endif
#if ray_cones
    let cone = load_cone(slot);
    let width = cone.width + cone.spread * hit.t;
    let point = surface_point(hit, exterior, wo, width);
#else
#if view
    let point = surface_point(hit, exterior, wo);
#else
    let point = surface_point(hit, exterior);
#endif
#endif
    let place = vec3<u32>(pixel, arrived.sample, vertex);

#if material_outputs
    if vertex == 1u {
        record_material(pixel, instance, point, wo);
        if (path.flags & PATH_LOOKS) != 0u {
            store_throughput(slot, PathThroughput(vec3<f32>(0.0), 0.0));
            return;
        }
    }
#endif
#if varying_emission
#if subsurface
    if !leaves {
#endif
#if light_groups
    let emitted = carried.throughput
        * checked_emission(material_emission(instance, point, wo), instance, place);
    path.radiance += emitted;
    record_light(pixel, instance_group(instance), emitted);
#else
    path.radiance += carried.throughput
        * checked_emission(material_emission(instance, point, wo), instance, place);
#endif
#if subsurface
    }
#endif
    store_radiance(slot, path);
    if vertex >= MAX_DEPTH {
        store_throughput(slot, PathThroughput(vec3<f32>(0.0), 0.0));
        return;
    }
#endif
    let u = random_numbers(pixel, arrived.sample, vertex_draw(vertex, DRAW_SCATTERING));
#if subsurface
    var scattered: MaterialSample;
    if leaves {
        scattered = leave_surface_diffusely(point, wo, wl, u);
    } else {
        scattered = checked_sample(evaluate_material(instance, point, wo, wl, u), instance, place);
    }
    let enters = scattered.below > 0.5;
    if enters {
        store_below(slot, PathBelow(scattered.below_albedo, scattered.below_anisotropy));
        store_below_rates(slot, PathBelowRates(scattered.below_extinction, instance));
        store_below_pulled(slot, PathBelowPulled(vec3<f32>(0.0), 0u));
    }
    if enters != leaves {
        path.flags ^= PATH_BELOW;
        store_radiance(slot, path);
    }
#else
    let scattered = checked_sample(evaluate_material(instance, point, wo, wl, u), instance, place);
#endif

#if last_rays
    var weight = carried.throughput * scattered.throughput;
    // The last ray gathers the light that it meets and nothing else.
    if is_last(weight, pixel, arrived.sample, vertex + 1u)
        && !may_meet_light(leave_surface(position, side, scattered.wi), scattered.wi) {
        weight = vec3<f32>(0.0);
    }
#else
    let weight = carried.throughput * scattered.throughput;
#endif
    store_throughput(slot, PathThroughput(weight, scattered.pdf));
    let goes_on = any(weight > vec3<f32>(0.0));
    if goes_on {
        let start = leave_surface(position, side, scattered.wi);
        store_ray_origin(slot, PathRayOrigin(start, pixel));
        store_ray_direction(slot, PathRayDirection(scattered.wi, arrived.sample));
#if ray_cones
        store_cone(slot, PathCone(width, scattered_spread(cone.spread, scattered.pdf), 0u, 0u));
#endif
#if subsurface
        if enters {
            request_below();
        } else {
            request_extension(start, scattered.wi, hit.primitive);
        }
#else
        request_extension(start, scattered.wi, hit.primitive);
#endif
    }
#if changes_medium
    if scattered.transmitted > 0.5 {
        store_media(slot, PathMedia(cross_boundary(media, medium, inside)));
    }
#endif
#if shadow_rays
    var contribution = PathContribution(vec3<f32>(0.0), 0.0);
    if lit {
        var reach = carried.throughput * scattered.light_throughput;
#if absorption
        // The way to the light is in one medium: boundaries, like everything, cast shadows.
        let stays = (dot(side, wl) < 0.0) == inside;
        let beyond = select(media_beyond(media, medium, inside), media, stays);
        reach *= transmittance(beyond, light.distance);
#endif
        let start = leave_surface(position, side, wl);
        let way = aim(wl, light.distance, start - position);
#if mis
        let share = light_share(light.pdf, scattered.light_pdf);
        contribution = PathContribution(reach * light.radiance * share, way.distance);
#else
        contribution = PathContribution(reach * light.radiance, way.distance);
#endif
        if any(reach > vec3<f32>(0.0)) {
#if slot_shadows
            store_shadow_direction(slot, PathShadowDirection(way.direction, hit.primitive));
#if own_shadow_origins
            store_shadow_origin(slot, PathShadowOrigin(start, pixel));
#else
            // Both rays leave to the side that the path came from.
            if !goes_on {
                store_shadow_origin(slot, PathShadowOrigin(start, pixel));
            }
#endif
#endif
            request_shadow(start, hit.primitive, way.direction, way.distance);
        }
    }
    if asks {
        store_contribution(slot, contribution);
    }
#endif
}

#if last_rays
// Whether the logic stage will end the path after its `vertex`-th segment, whatever that meets. What a medium
// absorbs on the way leaves less to go on for.
fn is_last(throughput: vec3<f32>, pixel: u32, sample: u32, vertex: u32) -> bool {
#if roulette
    if vertex >= ROULETTE_START && roulette(throughput, pixel, sample, vertex) == 0.0 {
        return true;
    }
#endif
    return vertex >= MAX_DEPTH;
}

#endif
#if ray_cones
// How fast the cone of a scattered ray widens. A ray that was chosen with a density stands for the solid angle
// around it that it would be alone in among CONE_RAYS others (Suykens and Willems, "Path Differentials
// and Applications", 2001); discrete directions keep the cone. What adds up are squares, since the
// places of rays in either are independent.
fn scattered_spread(spread: f32, pdf: f32) -> f32 {
    if !(pdf > 0.0) {
        return spread;
    }
    return min(sqrt(spread * spread + 1.0 / (CONE_RAYS * pdf)), WIDEST_CONE);
}

#endif
// A ray's origin, off the surface on the side the ray leaves to.
fn leave_surface(position: vec3<f32>, side: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    return offset_origin(position, select(-side, side, dot(side, direction) > 0.0));
}

#if subsurface
// Light from below goes out as from a Lambertian surface, whatever it has met.
fn leave_surface_diffusely(point: SurfacePoint, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    let outward = select(-1.0, 1.0, dot(point.geometric_normal, wo) > 0.0);
    let side = outward * point.geometric_normal;
    let normal = outward * point.normal;
    let axes = across(normal);
    let radius = sqrt(u.y);
    let angle = 6.2831853 * u.z;
    let wi = radius * cos(angle) * axes.x + radius * sin(angle) * axes.y + sqrt(1.0 - u.y) * normal;
    let pdf = lambertian(normal, side, wi);
    let light = lambertian(normal, side, wl);
    let whole = select(vec3<f32>(0.0), vec3<f32>(1.0), pdf > 0.0);
    var sample = MaterialSample();
    sample.wi = wi;
    sample.pdf = pdf;
    sample.throughput = whole;
    sample.light_pdf = light;
    sample.light_throughput = vec3<f32>(light);
    return sample;
}

// |cos| / pi toward `wi`, if that is outside by the shading normal and by that of the geometry.
fn lambertian(normal: vec3<f32>, side: vec3<f32>, wi: vec3<f32>) -> f32 {
    return select(0.0, max(dot(normal, wi), 0.0) * 0.31830987, dot(side, wi) > 0.0);
}

#endif
// A sample with a value that is no number or below zero is dropped whole, and counted for its material.
fn checked_sample(sample: MaterialSample, instance: u32, place: vec3<u32>) -> MaterialSample {
    // What is light is finite, so that most samples are through with one test a value.
    let densities = vec3<f32>(sample.pdf, sample.light_pdf, 0.0);
    if is_light(sample.throughput) && is_light(densities) && is_light(sample.light_throughput)
#if subsurface
        && is_light(sample.below_albedo) && is_light(sample.below_extinction)
        && is_finite(vec3<f32>(sample.below_anisotropy))
#endif
        && is_finite(sample.wi) {
        return sample;
    }
    count_wrong_sample(sample, densities, instance, place);
#if subsurface
    return MaterialSample();
#else
    let none = vec3<f32>(0.0);
    return MaterialSample(none, 0.0, none, 0.0, none, 0.0);
#endif
}

// Values that are no numbers come before those below zero, as what a row counts.
fn count_wrong_sample(sample: MaterialSample, densities: vec3<f32>, instance: u32, place: vec3<u32>) {
    let finite = vec3<bool>(
        is_finite(sample.throughput), is_finite(densities), is_finite(sample.light_throughput)
    );
    let light = vec3<bool>(
        is_light(sample.throughput), is_light(densities), is_light(sample.light_throughput)
    );
    let negative = all(finite) && is_finite(sample.wi);
    let right = select(finite, light, negative);
    var value = DROPPED_BY_DIRECTION;
    if !right.x {
        value = DROPPED_BY_THROUGHPUT;
    } else if !right.y {
        value = DROPPED_BY_PDF;
    } else if !right.z {
        value = DROPPED_BY_LIGHT_THROUGHPUT;
    }
    count_dropped(dropped_row(instance), negative, value, place);
}

#if varying_emission
fn checked_emission(emission: vec3<f32>, instance: u32, place: vec3<u32>) -> vec3<f32> {
    if is_light(emission) {
        return emission;
    }
    count_dropped(dropped_row(instance), is_finite(emission), DROPPED_BY_EMISSION, place);
    return vec3<f32>(0.0);
}

#endif
#if mis
// The weight of a light sample. Scattering cannot hit a discrete light (density 0), so its sample
// counts fully.
fn light_share(light_pdf: f32, bsdf_pdf: f32) -> f32 {
    if light_pdf > 0.0 {
        return power_heuristic(light_pdf, bsdf_pdf);
    }
    return 1.0;
}
#endif
#if shadow_rays

// A shadow ray's direction and length.
struct Way { direction: vec3<f32>, distance: f32 }

// The ray from the moved origin to the point that was sampled. Its end is off the light already, which must
// not occlude itself; a few units in the last place make up for rounding here.
#if far_lights
// Lights far away stay in their direction.
#endif
fn aim(direction: vec3<f32>, distance: f32, moved: vec3<f32>) -> Way {
#if far_lights
    if distance > 1e18 {
        return Way(direction, distance);
    }
#endif
    let to_light = direction * distance - moved;
    let left = length(to_light);
    return Way(to_light / max(left, 1e-30), left * 0.999999);
}
#endif
#if requests

// Keeps where the results of the path's ray casts will be.
fn keep_requests(slot: u32, extension: u32, shadow: u32) {
    store_requests(slot, PathRequests(extension, shadow, 0u, 0u));
}
#endif
