// Asks whether a light sample is seen from its vertex; one that is not reaches the path by
// no throughput.

#if fetched
fn begin_ray(slot: u32) -> Walk {
    let start = load_shadow_origin(slot);
    let ray = load_shadow_ray(slot);
    return begin_walk(BVH_ROOT, 0u, start.origin, ray.direction, ray.distance, start.skip);
}

fn is_decided(hit: Hit) -> bool {
    return hit.primitive != NO_PRIMITIVE;
}

fn end_ray(slot: u32, hit: Hit) {
    if is_decided(hit) {
        store_light_throughput(slot, PathLightThroughput(vec3<f32>(0.0), 0.0));
    }
}
#else
fn shadow(slot: u32) {
    let start = load_shadow_origin(slot);
    let ray = load_shadow_ray(slot);
    if trace_any(start.origin, ray.direction, ray.distance, start.skip) {
        store_light_throughput(slot, PathLightThroughput(vec3<f32>(0.0), 0.0));
    }
}
#endif
