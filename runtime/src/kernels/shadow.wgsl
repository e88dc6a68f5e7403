// Asks whether a light sample is seen from its vertex; one that is not reaches the path by
// no throughput.

// A ray: where it begins and the primitive that it begins on; its direction and how far it goes.
#if requests
fn shadow_ray(request: u32) -> array<vec4<u32>, 2> {
    return array<vec4<u32>, 2>(shadow_rays[2u * request], shadow_rays[2u * request + 1u]);
}

fn keep_shadow(request: u32, blocked: bool) {
    shadow_results[request] = select(0u, 1u, blocked);
}
#else
fn shadow_ray(slot: u32) -> array<vec4<u32>, 2> {
    let origin = load_shadow_origin(slot).origin;
    let ray = load_shadow_direction(slot);
    let distance = load_contribution(slot).distance;
    return array<vec4<u32>, 2>(
        vec4<u32>(bitcast<vec3<u32>>(origin), ray.primitive),
        vec4<u32>(bitcast<vec3<u32>>(ray.direction), bitcast<u32>(distance))
    );
}

fn keep_shadow(slot: u32, blocked: bool) {
    if blocked {
        store_contribution(slot, PathContribution(vec3<f32>(0.0), 0.0));
    }
}
#endif

#if fetched
fn is_shadow_decided(hit: Hit) -> bool {
    return hit.primitive != NO_PRIMITIVE;
}

fn end_shadow(request: u32, hit: Hit) {
    keep_shadow(request, is_shadow_decided(hit));
}
#else
fn shadow(request: u32) {
    let ray = shadow_ray(request);
    let way = bitcast<vec4<f32>>(ray[1]);
    keep_shadow(request, trace_any(bitcast<vec3<f32>>(ray[0].xyz), way.xyz, way.w, ray[0].w));
}
#endif
