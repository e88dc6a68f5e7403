// Finds what a path's next segment hits.

#if fetched
fn begin_ray(slot: u32) -> Walk {
    let start = load_ray_origin(slot).origin;
    let direction = load_ray_direction(slot).direction;
    return begin_walk(BVH_ROOT, 0u, start, direction, 3.0e38, load_hit(slot).primitive);
}

fn is_decided(hit: Hit) -> bool {
    return false;
}

fn end_ray(slot: u32, hit: Hit) {
    store_hit(slot, PathHit(hit.t, hit.u, hit.v, hit.primitive));
}
#else
fn extension(slot: u32) {
    let start = load_ray_origin(slot);
    let ray = load_ray_direction(slot);
#if overlap
    let hit = trace_to_boundary(slot, start.origin, ray.direction, load_hit(slot).primitive);
#else
    let hit = trace_closest(start.origin, ray.direction, 3.0e38, load_hit(slot).primitive);
#endif
    store_hit(slot, PathHit(hit.t, hit.u, hit.v, hit.primitive));
}
#endif
#if overlap

// The nearest hit that is none of a medium hidden by another of higher priority. Such boundaries
// are crossed: nothing happens there but that the path is in other media beyond. What lies beyond
// is found by scattering only, since it is in their shadow: a density of 0 says so.
fn trace_to_boundary(slot: u32, origin: vec3<f32>, direction: vec3<f32>, skip: u32) -> Hit {
    var carried = load_throughput(slot);
    var media = load_media(slot).stack;
    var start = origin;
    var crossed = skip;
    for (var count = 0u; count <= MAX_FALSE_BOUNDARIES; count++) {
        let hit = trace_closest(start, direction, 3.0e38, crossed);
        if hit.primitive == NOTHING {
            return hit;
        }
        let medium = primitive_medium(hit.primitive);
        let side = hit_geometric_normal(hit.primitive);
        let inside = dot(side, direction) > 0.0;
        if !is_false_boundary(media, medium, inside) {
            return hit;
        }
#if absorption
        carried.throughput *= transmittance(media, hit.t);
#endif
        carried.bsdf_pdf = 0.0;
        store_throughput(slot, carried);
        media = cross_boundary(media, medium, inside);
        store_media(slot, PathMedia(media));
        let position = hit_position(hit.primitive, vec2<f32>(hit.u, hit.v));
        start = offset_origin(position, select(-side, side, inside));
        crossed = hit.primitive;
    }
    atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
    store_throughput(slot, PathThroughput(vec3<f32>(0.0), 0.0));
    return Hit(0.0, 0.0, 0.0, NOTHING);
}
#endif
