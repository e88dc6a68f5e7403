// Takes light on below the surface that it entered. Walks differ in length: a thread takes some turns of one, and
// what is left of it waits for the next iteration, among walks alone.

fn below(slot: u32) {
    let origin = load_ray_origin(slot);
    let way = load_ray_direction(slot);
    let path = vec3<u32>(origin.pixel, way.sample, load_radiance(slot).flags & DEPTH_MASK);
    let met = load_below(slot);
    let plain = load_below_plain(slot);
    let pulled = load_below_pulled(slot);
    let nowhere = Hit(0.0, 0.0, 0.0, NOTHING);
    var flight = Flight(nowhere, origin.origin, way.direction, load_throughput(slot), 0u);
    var skip = load_hit(slot).primitive;
    let begins = pulled.status == 0u;
    let entered = select(plain.entered, skip, begins);
    var rates = load_below_rates(slot);
    if begins {
        rates.extinction = resolved_rates(rates.extinction, origin.origin);
    }
    let kept = min(met.albedo, vec3<f32>(1.0));
    let matter = Matter(rates.extinction, rates.extinction * kept, clamp(met.anisotropy, -0.99, 0.99));
    let side = hit_geometric_normal(entered);
    var walk: Below;
    if begins {
        let choice = random_numbers(path.x, path.y, vertex_draw(path.z - 1u, DRAW_SCATTERING)).w;
        walk = begin_below(choice, matter, side, flight, entered);
    } else {
        walk = unpack_below(matter, side, Ways(plain.shares, pulled.shares), pulled.status);
        flight.turns = turns_so_far(pulled.status);
    }
#if wavefront
    let last = min(flight.turns + TURNS_AT_ONCE, MAX_TURNS);
#else
    let last = MAX_TURNS;
#endif
    while !walk.ended && flight.turns < last {
        skip = step_below(path, &flight, &walk, skip);
    }
    if !walk.ended && flight.turns >= MAX_TURNS {
        atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
        flight = ended(flight);
        walk.ended = true;
    }
    if walk.ended {
        flight.carried.bsdf_pdf = 0.0;
        store_hit(slot, PathHit(flight.hit.t, flight.hit.u, flight.hit.v, flight.hit.primitive));
#if ray_cones
        // Light that was turned may come from anywhere: its last segment begins as narrow as it can.
        store_cone(slot, PathCone(load_cone(slot).width, WIDEST_CONE, 0u, 0u));
#endif
    } else {
        store_ray_origin(slot, PathRayOrigin(flight.start, path.x));
        store_hit(slot, PathHit(0.0, 0.0, 0.0, skip));
        store_below_plain(slot, PathBelowPlain(walk.ways.plain, entered));
        store_below_rates(slot, rates);
    }
    store_throughput(slot, flight.carried);
    store_ray_direction(slot, PathRayDirection(flight.direction, path.y));
    store_below_pulled(slot, PathBelowPulled(walk.ways.pulled, pack_below(walk, flight.turns)));
}
