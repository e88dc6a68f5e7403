// Light on its way through media that scatter it; see flight.wgsl.

// Does the medium that counts scatter?
fn scatters(media: vec4<u32>) -> bool {
    return any(volume_table[active_medium(media) & 0xffffu].xyz > vec3<f32>(0.0));
}

// What a ray of length `distance` has kept, where the flight has not seen to that.
fn ray_transmittance(media: vec4<u32>, distance: f32) -> vec3<f32> {
    if scatters(media) {
        return vec3<f32>(1.0);
    }
    return transmittance(media, distance);
}

// Goes on to the nearest surface, but `skip`; `path` is pixel, sample and vertex. Distances are sampled in
// one channel and weighed by what all three would have given (Chiang, Kutz and Burley, "Practical and
// Controllable Subsurface Scattering for Production Path Tracing", 2016).
fn fly(path: vec3<u32>, media: vec4<u32>, begun: Flight, skip: u32) -> Flight {
    var flight = begun;
    if !scatters(media) {
        flight.hit = trace_closest(flight.start, flight.direction, 3.0e38, skip);
        return flight;
    }
    let row = active_medium(media) & 0xffffu;
    let extinction = medium_table[row].xyz;
    let volume = volume_table[row];
    var skipped = skip;
    while flight.turns < MAX_TURNS {
        let throughput = flight.carried.throughput;
        let shares = throughput / (throughput.x + throughput.y + throughput.z);
        let u = unit_numbers(turn_bits(path, flight.turns, 0u));
        let distance = free_flight(chosen(shares, extinction, u.w), u.x);
        let stop = next_stop(flight, distance, skipped);
        let kept = exp(-extinction * min(stop.way, 1e18));
        if stop.meets || distance > 1e37 {
            flight.hit = stop.hit;
            flight.carried.throughput *= kept / dot(shares, kept);
            return flight;
        }
        flight.carried.throughput *= volume.xyz * kept / dot(shares, extinction * kept);
        let survival = min(max_component(flight.carried.throughput), 1.0);
        if unit_numbers(turn_bits(path, flight.turns, 1u)).x >= survival {
            return ended(flight);
        }
        flight.carried.throughput /= survival;
        flight.carried.bsdf_pdf = 0.0;
        flight.start += flight.direction * stop.clear;
        flight.direction = turned_from(flight.direction, scattered_cosine(volume.w, u.y), u.z);
        flight.turns++;
        skipped = NOTHING;
    }
    atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
    return ended(flight);
}

// The value of a channel, chosen with these probabilities.
fn chosen(shares: vec3<f32>, values: vec3<f32>, u: f32) -> f32 {
    if u < shares.x {
        return values.x;
    }
    return select(values.z, values.y, u < shares.x + shares.y);
}
