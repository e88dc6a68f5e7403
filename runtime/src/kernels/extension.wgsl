// Finds what a path's next segment hits.

// A ray: where it begins and the primitive that it begins on; its direction and how far it goes.
#if requests
fn extension_ray(request: u32) -> array<vec4<u32>, 2> {
    return array<vec4<u32>, 2>(extension_rays[2u * request], extension_rays[2u * request + 1u]);
}

fn keep_hit(request: u32, hit: Hit) {
    extension_hits[request] = vec4<u32>(bitcast<vec3<u32>>(vec3<f32>(hit.t, hit.u, hit.v)), hit.primitive);
}
#else
fn extension_ray(slot: u32) -> array<vec4<u32>, 2> {
    let origin = bitcast<vec3<u32>>(load_ray_origin(slot).origin);
    let direction = bitcast<vec3<u32>>(load_ray_direction(slot).direction);
    return array<vec4<u32>, 2>(vec4<u32>(origin, load_hit(slot).primitive), vec4<u32>(direction, bitcast<u32>(3.0e38f)));
}

fn keep_hit(slot: u32, hit: Hit) {
    store_hit(slot, PathHit(hit.t, hit.u, hit.v, hit.primitive));
}
#endif

#if fetched
fn is_extension_decided(hit: Hit) -> bool {
    return false;
}

fn end_extension(request: u32, hit: Hit) {
    keep_hit(request, hit);
}
#else
fn extension(request: u32) {
    let ray = extension_ray(request);
    let start = bitcast<vec3<f32>>(ray[0].xyz);
    let direction = bitcast<vec3<f32>>(ray[1].xyz);
#if overlap
    keep_hit(request, trace_to_boundary(request, start, direction, ray[0].w));
#endif
#if scattering && !overlap
    keep_hit(request, trace_to_surface(request, start, direction, ray[0].w));
#endif
#if !scattering && !overlap
    keep_hit(request, trace_closest(start, direction, 3.0e38, ray[0].w));
#endif
}
#endif
#if scattering

// The pixel, sample and vertex of a path.
fn path_of(slot: u32) -> vec3<u32> {
    let vertex = load_radiance(slot).flags & DEPTH_MASK;
    return vec3<u32>(load_ray_origin(slot).pixel, load_ray_direction(slot).sample, vertex);
}

fn keep_flight(slot: u32, sample: u32, flight: Flight) {
    store_throughput(slot, flight.carried);
    if flight.turns > 0u {
        store_ray_direction(slot, PathRayDirection(flight.direction, sample));
#if ray_cones
        // Light that was turned may come from anywhere: its last segment begins as narrow as it can.
        let cone = load_cone(slot);
        store_cone(slot, PathCone(cone.width, WIDEST_CONE, 0u, 0u));
#endif
    }
}

// The nearest hit for light that may be turned on its way.
fn trace_to_surface(slot: u32, origin: vec3<f32>, direction: vec3<f32>, skip: u32) -> Hit {
    let path = path_of(slot);
    let nowhere = Hit(0.0, 0.0, 0.0, NOTHING);
    let begun = Flight(nowhere, origin, direction, load_throughput(slot), 0u);
    let flight = fly(path, load_media(slot).stack, begun, skip);
    keep_flight(slot, path.y, flight);
    return flight.hit;
}
#endif
#if overlap

// The nearest hit that is none of a medium hidden by another of higher priority. Such boundaries
// are crossed: nothing happens there but that the path is in other media beyond. What lies beyond
// is found by scattering only, since it is in their shadow: a density of 0 says so.
fn trace_to_boundary(slot: u32, origin: vec3<f32>, direction: vec3<f32>, skip: u32) -> Hit {
    var media = load_media(slot).stack;
    var crossed = skip;
#if scattering
    let path = path_of(slot);
    let nowhere = Hit(0.0, 0.0, 0.0, NOTHING);
    var flight = Flight(nowhere, origin, direction, load_throughput(slot), 0u);
#else
    var carried = load_throughput(slot);
    var start = origin;
#endif
    for (var count = 0u; count <= MAX_FALSE_BOUNDARIES; count++) {
#if scattering
        flight = fly(path, media, flight, crossed);
        keep_flight(slot, path.y, flight);
        let hit = flight.hit;
        let way = flight.direction;
#else
        let hit = trace_closest(start, direction, 3.0e38, crossed);
        let way = direction;
#endif
        if hit.primitive == NOTHING {
            return hit;
        }
        let medium = primitive_medium(hit.primitive);
        let side = hit_geometric_normal(hit.primitive);
        let inside = dot(side, way) > 0.0;
        if !is_false_boundary(media, medium, inside) {
            return hit;
        }
#if scattering
        flight.carried.throughput *= ray_transmittance(media, hit.t);
        flight.carried.bsdf_pdf = 0.0;
        store_throughput(slot, flight.carried);
#else
#if absorption
        carried.throughput *= transmittance(media, hit.t);
#endif
        carried.bsdf_pdf = 0.0;
        store_throughput(slot, carried);
#endif
#if ray_cones
        let cone = load_cone(slot);
        let width = cone.width + cone.spread * hit.t;
        store_cone(slot, PathCone(width, cone.spread, 0u, 0u));
#endif
        media = cross_boundary(media, medium, inside);
        store_media(slot, PathMedia(media));
        let position = hit_position(hit.primitive, vec2<f32>(hit.u, hit.v));
#if scattering
        flight.start = offset_origin(position, select(-side, side, inside));
#else
        start = offset_origin(position, select(-side, side, inside));
#endif
        crossed = hit.primitive;
    }
    atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
    store_throughput(slot, PathThroughput(vec3<f32>(0.0), 0.0));
    return Hit(0.0, 0.0, 0.0, NOTHING);
}
#endif
