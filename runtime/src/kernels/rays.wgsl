// The benchmark of ray casts: rays from a buffer, hits to a buffer. rays[2i] is origin and largest
// distance, rays[2i + 1] direction and the primitive that is not hit.

fn store_result(slot: u32, hit: Hit) {
    hits[slot] = vec4<u32>(bitcast<vec3<u32>>(vec3<f32>(hit.t, hit.u, hit.v)), hit.primitive);
}
#if fetched

fn cast_ray(slot: u32) -> array<vec4<u32>, 2> {
    let start = rays[2u * slot];
    let way = rays[2u * slot + 1u];
    return array<vec4<u32>, 2>(vec4<u32>(start.xyz, way.w), vec4<u32>(way.xyz, start.w));
}

fn is_cast_decided(hit: Hit) -> bool {
#if any_hit
    return hit.primitive != NO_PRIMITIVE;
#else
    return false;
#endif
}

fn end_cast(slot: u32, hit: Hit) {
    store_result(slot, hit);
}
#else

fn run_stage(slot: u32, item: u32) {
    let start = bitcast<vec4<f32>>(rays[2u * slot]);
    let way = rays[2u * slot + 1u];
    let direction = bitcast<vec3<f32>>(way.xyz);
#if any_hit
    let blocked = trace_any(start.xyz, direction, start.w, way.w);
    store_result(slot, Hit(start.w, 0.0, 0.0, select(NO_PRIMITIVE, 0u, blocked)));
#else
    store_result(slot, trace_closest(start.xyz, direction, start.w, way.w));
#endif
}
#endif
