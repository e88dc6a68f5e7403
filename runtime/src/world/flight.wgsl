// Light on its way through matter that scatters it: a random walk, which belongs to the ray cast that
// it begins with. It costs no turn of the wavefront, no depth and no number of the path's own draws.
//
// Distances are sampled in one channel and weighed by what all three would have given (Chiang, Kutz
// and Burley, "Practical and Controllable Subsurface Scattering for Production Path Tracing", 2016).
// Lights are not sampled from within matter: light that was turned is found by chance only, and a
// density of 0 says so.

// Where light has come to.
struct Flight {
    // What lies at the end of the last segment.
    hit: Hit,
    // That segment.
    start: vec3<f32>,
    direction: vec3<f32>,
    carried: PathThroughput,
    // How often it was turned since the ray was cast.
    turns: u32
}

// What light goes through: how much of it is met and scattered a metre, and the mean cosine by which it
// turns.
struct Matter {
    extinction: vec3<f32>,
    scattering: vec3<f32>,
    anisotropy: f32,
    // Does what light meets late become coarser?
    coarsens: bool
}

// What light meets that was turned as often. From COARSE_TURNS on, steps double in length every
// COARSER_TURNS turns, and so many times more of the light is absorbed in each that the depth which light
// reaches by diffusion stays: 1 / sqrt(3 sigma_a sigma_t'). Of light that nothing absorbs, the share
// 1 / sqrt(pi n) is still below a half space after n turns (Sparre Andersen 1954), so that without it many
// walks would have no end.
fn matter_after(matter: Matter, turns: u32) -> Matter {
    if !matter.coarsens || turns < COARSE_TURNS {
        return matter;
    }
    let scale = exp2(f32(min((turns - COARSE_TURNS) / COARSER_TURNS + 1u, 40u)));
    let absorbed = min((matter.extinction - matter.scattering) * scale, matter.extinction / scale);
    let extinction = matter.extinction / scale;
    return Matter(extinction, extinction - absorbed, matter.anisotropy, true);
}

// Goes on to the nearest surface, but `skip`; `path` is pixel, sample and vertex.
fn fly_through(path: vec3<u32>, matter: Matter, begun: Flight, skip: u32) -> Flight {
    var flight = begun;
    var skipped = skip;
    while flight.turns < MAX_TURNS {
        let throughput = flight.carried.throughput;
        let shares = throughput / (throughput.x + throughput.y + throughput.z);
        let u = unit_numbers(turn_bits(path, flight.turns, 0u));
        let met = matter_after(matter, flight.turns);
        let extinction = met.extinction;
        let distance = free_flight(chosen(shares, extinction, u.w), u.x);
        // Where light is turned next to a surface, rounding must not put it behind.
        let margin = 4e-6 * (max_component(abs(flight.start)) + distance);
        let hit = trace_closest(flight.start, flight.direction, min(distance + margin, 3.0e38), skipped);
        let meets = hit.primitive != NOTHING && hit.t <= distance;
        let kept = exp(-extinction * min(select(distance, hit.t, meets), 1e18));
        if meets || distance > 1e37 {
            flight.hit = hit;
            flight.carried.throughput *= kept / dot(shares, kept);
            return flight;
        }
        flight.carried.throughput *= met.scattering * kept / dot(shares, extinction * kept);
        flight.carried.bsdf_pdf = 0.0;
        let least = select(1.0, 0.25, matter.coarsens);
        let survival = min(max_component(flight.carried.throughput) / least, 1.0);
        if unit_numbers(turn_bits(path, flight.turns, 1u)).x >= survival {
            return ended(flight);
        }
        flight.carried.throughput /= survival;
        let way = select(distance, max(hit.t - 2.0 * margin, 0.0), hit.primitive != NOTHING);
        flight.start += flight.direction * way;
        flight.direction = scattered(flight.direction, matter.anisotropy, u.yz);
        flight.turns++;
        skipped = NOTHING;
    }
    atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
    return ended(flight);
}

// A flight that leads nowhere.
fn ended(flight: Flight) -> Flight {
    var end = flight;
    end.hit = Hit(0.0, 0.0, 0.0, NOTHING);
    end.carried = PathThroughput(vec3<f32>(0.0), 0.0);
    return end;
}

// Random words of a turn, apart from those of the path's draws, which are few.
fn turn_bits(path: vec3<u32>, turn: u32, purpose: u32) -> vec4<u32> {
    let draw = 0x80000000u + (path.z * MAX_TURNS + turn) * 2u + purpose;
    return pcg4d(vec4<u32>(path.xy, draw, run.seed));
}

// The value of a channel, chosen with these probabilities.
fn chosen(shares: vec3<f32>, values: vec3<f32>, u: f32) -> f32 {
    if u < shares.x {
        return values.x;
    }
    return select(values.z, values.y, u < shares.x + shares.y);
}

// How far light goes that meets something `rate` times a metre; far beyond everything at a rate of 0.
fn free_flight(rate: f32, u: f32) -> f32 {
    if rate > 0.0 {
        return min(-log(1.0 - u) / rate, 3.0e38);
    }
    return 3.0e38;
}

// A new direction for light that goes along `direction`. Source: Henyey and Greenstein, "Diffuse
// Radiation in the Galaxy" (1941); the inverse is written such that no g divides.
fn scattered(direction: vec3<f32>, g: f32, u: vec2<f32>) -> vec3<f32> {
    let m = 1.0 - 2.0 * u.x;
    let y = (m + g) / (1.0 + g * m);
    let cosine = clamp(y + 0.5 * g * (1.0 - y) * (1.0 + y), -1.0, 1.0);
    let sine = sqrt((1.0 - cosine) * (1.0 + cosine));
    let angle = 6.2831853 * u.y;
    // Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    let side = select(-1.0, 1.0, direction.z >= 0.0);
    let a = -1.0 / (side + direction.z);
    let b = direction.x * direction.y * a;
    let x_axis = vec3<f32>(1.0 + side * direction.x * direction.x * a, side * b, -side * direction.x);
    let y_axis = vec3<f32>(b, side + direction.y * direction.y * a, -direction.y);
    let turned = sine * cos(angle) * x_axis + sine * sin(angle) * y_axis + cosine * direction;
    return normalize(turned);
}
