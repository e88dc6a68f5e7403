// Asks whether a light sample is seen from its vertex; one that is not reaches the path by
// no throughput.

fn shadow(slot: u32) {
    let start = load_shadow_origin(slot);
    let ray = load_shadow_ray(slot);
    if trace_any(start.origin, ray.direction, ray.distance, start.skip) {
        store_light_throughput(slot, PathLightThroughput(vec3<f32>(0.0), 0.0));
    }
}
