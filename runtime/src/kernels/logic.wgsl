// Takes in what the last ray casts found, and decides how a path goes on.
//
// MAX_DEPTH counts path segments. Light that arrives over at most that many is gathered, by
// both strategies alike: a light sample of vertex n makes a path of n + 1 segments, and so
// does the scattered ray that hits the light. Were they cut at different lengths, one half of
// the weights that sum to 1 would be missing.

fn logic(slot: u32) {
    var path = load_radiance(slot);
    if (path.flags & PATH_RETIRED) != 0u {
        return;
    }
    if (path.flags & PATH_LIVE) == 0u {
        request_new_path();
        return;
    }
    let ray = load_ray_direction(slot);
    let pixel = load_ray_origin(slot).pixel;
    let vertex = path.flags & DEPTH_MASK;
#if subsurface
    let below = (path.flags & PATH_BELOW) != 0u;
#endif
    var carried = load_throughput(slot);
    var instance = NOTHING;
    var hit = PathHit(0.0, 0.0, 0.0, NOTHING);

#if shadow_rays
    if (path.flags & PATH_LIT) != 0u {
        path.radiance += light_contribution(slot);
#if light_groups
        record_light(pixel, load_light_group(slot).group, light_contribution(slot));
#endif
    }
#endif
#if subsurface
    let walks = below && (load_below_pulled(slot).status & BELOW_ENDED) == 0u;
    if walks && any(carried.throughput > vec3<f32>(0.0)) {
#if shadow_rays
        path.flags &= ~PATH_LIT;
        store_radiance(slot, path);
#endif
        request_below();
        return;
    }
#endif
    // A throughput of zero says that scattering failed and no ray was cast.
    if any(carried.throughput > vec3<f32>(0.0)) {
#if requests
        hit = requested_hit(load_requests(slot).extension);
        store_hit(slot, hit);
#else
        hit = load_hit(slot);
#endif
#if absorption
#if subsurface
        // Below a surface light is in its matter alone.
        if !below {
#endif
#if scattering
        carried.throughput *= ray_transmittance(load_media(slot).stack, hit.t);
#else
        carried.throughput *= transmittance(load_media(slot).stack, hit.t);
#endif
#if subsurface
        }
#endif
        store_throughput(slot, carried);
#endif
        if hit.primitive != NOTHING {
#if subsurface
            // What emits does so to its outside.
            if !below {
#endif
#if hit_lights
            path.radiance += carried.throughput
                * light_hit(hit.primitive, hit.t, ray.direction, carried.bsdf_pdf);
#if light_groups
            let met = light_hit(hit.primitive, hit.t, ray.direction, carried.bsdf_pdf);
            record_light(pixel, hit_group(hit.primitive), carried.throughput * met);
#endif
#endif
#if subsurface
            }
            // Where light leaves, it does by the material that it entered through.
            if below {
                instance = load_below_rates(slot).instance;
            } else {
                instance = primitive_instance(hit.primitive);
            }
#else
            instance = primitive_instance(hit.primitive);
#endif
        }
#if escape_lights
        if hit.primitive == NOTHING {
            path.radiance += carried.throughput * light_escape(ray.direction, carried.bsdf_pdf);
#if light_groups
            record_escape(pixel, carried.throughput, ray.direction, carried.bsdf_pdf);
#endif
        }
#endif
    }
#if first_hit_outputs
    if vertex == 1u && hit.primitive != NOTHING {
        record_first_hit(pixel, hit, ray.direction, instance);
    }
#endif
#if material_outputs
    let seen = instance;
#endif
#if varying_emission
    if instance != NOTHING && vertex >= MAX_DEPTH && !needs_last_evaluation(instance) {
#else
    if vertex >= MAX_DEPTH {
#endif
        instance = NOTHING;
    }
#if roulette
    if instance != NOTHING && vertex >= ROULETTE_START {
        let survival = roulette(carried.throughput, pixel, ray.sample, vertex);
        if survival > 0.0 {
            carried.throughput /= survival;
            store_throughput(slot, carried);
        } else {
            instance = NOTHING;
        }
    }
#endif
#if material_outputs
    // How the first hit looks is asked of its material even if the path ends there.
    if instance == NOTHING && vertex == 1u && seen != NOTHING {
        path.flags = ((path.flags & ~PATH_LIT) | PATH_LOOKS) + 1u;
        store_radiance(slot, path);
        request_material(seen);
        return;
    }
#endif
    if instance == NOTHING {
        film_add(vec3<u32>(pixel, ray.sample, vertex), path.radiance);
        request_new_path();
        return;
    }

    path.flags = (path.flags & ~PATH_LIT) + 1u;
#if shadow_rays
#if varying_emission
    let goes_on = vertex < MAX_DEPTH;
#else
    let goes_on = true;
#endif
#if unlit_materials
    if goes_on && scatters_sampled_light(instance) {
#else
    if goes_on {
#endif
        // For the material stage, which samples a light.
        path.flags |= PATH_LIT;
    }
#endif
    store_radiance(slot, path);
    request_material(instance);
}

#if shadow_rays

// What the light sample of the last vertex brings; nothing if the shadow ray was blocked.
fn light_contribution(slot: u32) -> vec3<f32> {
#if requests
    if shadow_results[load_requests(slot).shadow] != 0u {
        return vec3<f32>(0.0);
    }
#endif
    return load_contribution(slot).radiance;
}
#endif
#if requests

// What the ray cast of a request found.
fn requested_hit(request: u32) -> PathHit {
    let words = extension_hits[request];
    return PathHit(bitcast<f32>(words.x), bitcast<f32>(words.y), bitcast<f32>(words.z), words.w);
}
#endif
