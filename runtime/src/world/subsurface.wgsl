// Light below a surface: a walk through the matter of the material that it entered, until it is outside of
// all that it has entered; see flight.wgsl. The boundary neither reflects nor refracts.
//
// A walk is drawn in one of six ways: for each of three channels as light goes, and with a pull back to the
// surface. Its weight is the light that goes this walk over the density with which all six draw it together
// (the balance heuristic; over channels: Wilkie et al., "Hero Wavelength Spectral Sampling", 2014). No walk
// weighs more than 1 / (1 - PULLED) times the most that it would if drawn as light goes.
//
// The pull is that of light whose importance grows exponentially towards the surface (Dwivedi 1982;
// Krivanek and d'Eon, "A Zero-Variance-Based Sampling Scheme for Monte Carlo Subsurface Scattering", 2014):
// along a cosine mu to the normal where it entered, extinction is by 1 - s mu of what it is, and turned
// directions have densities in proportion to 1 / (1 - s mu), where s is the share that the decay of diffused
// light with depth has of extinction.

// The least mean free path, over the distance that rays are moved off surfaces at most: what is shorter
// would be lost in rounding.
const LEAST_FREE_PATH: f32 = 32.0;
// The share of walks that are pulled, where scattering has no direction and the matter is thick.
const PULLED: f32 = 0.75;
// How thick that is: times the depth at which 1 / e of diffused light is left.
const THICK: f32 = 4.0;
// The turns whose numbers are spread evenly over the samples of a pixel, apart from all other draws of the path.
const SPREAD_TURNS: u32 = 8;
const SPREAD_DRAWS: u32 = 0x40000000u;

// What light goes through below a surface: how much of it is met and scattered a metre, and the mean cosine
// by which it turns.
struct Matter {
    extinction: vec3<f32>,
    scattering: vec3<f32>,
    anisotropy: f32
}

// What light meets that was turned as often. From COARSE_TURNS on, steps double in length every
// COARSER_TURNS turns, and so many times more of the light is absorbed in each that the depth which light
// reaches by diffusion stays: 1 / sqrt(3 sigma_a sigma_t'). Of light that nothing absorbs, the share
// 1 / sqrt(pi n) is still below a half space after n turns (Sparre Andersen 1954), so that without it many
// walks would have no end.
fn matter_after(matter: Matter, turns: u32) -> Matter {
    if turns < COARSE_TURNS {
        return matter;
    }
    let scale = exp2(f32(min((turns - COARSE_TURNS) / COARSER_TURNS + 1u, 40u)));
    let absorbed = min((matter.extinction - matter.scattering) * scale, matter.extinction / scale);
    let extinction = matter.extinction / scale;
    return Matter(extinction, extinction - absorbed, matter.anisotropy);
}

// How fast light gets less with depth, a metre. Source: the fit of d'Eon to the roots of Case, for light
// that is scattered to all sides; where it is not, of the matter that diffuses light as this does.
fn decay(matter: Matter) -> vec3<f32> {
    let g = matter.anisotropy;
    let albedo = matter.scattering / matter.extinction;
    let similar = max(albedo * (1.0 - g) / (1.0 - g * albedo), vec3<f32>(1e-3));
    let power = 2.44294 - 0.0215813 * similar + 0.578637 / similar;
    return matter.extinction * (1.0 - g * albedo) * sqrt(1.0 - pow(similar, power));
}

// The six ways to draw a walk: with which probabilities this one was drawn in each channel, as light goes and
// pulled.
struct Ways {
    plain: vec3<f32>,
    pulled: vec3<f32>
}

// A walk, beside the flight itself.
struct Below {
    matter: Matter,
    // Out of the surface where light entered, and how it gets less with depth there.
    outwards: vec3<f32>,
    decay: vec3<f32>,
    ways: Ways,
    // The way that this walk goes: 1 in its channel, and whether it is pulled.
    channel: vec3<f32>,
    is_pulled: bool,
    // Did light enter against the normal of the geometry?
    against: bool,
    // Of how many surfaces it is on the side that it has entered.
    depth: i32,
    // Is it turned next, or does it go on as before?
    turned: bool,
    ended: bool
}

// How often light that enters at `place` meets something, held to what is resolved there.
fn resolved_rates(rates: vec3<f32>, place: vec3<f32>) -> vec3<f32> {
    return min(rates, vec3<f32>(1.0 / max(LEAST_FREE_PATH * 4e-6 * max_component(abs(place)), 1e-18)));
}

// Chooses the way of a walk by a number in [0, 1), which is spread evenly over the samples of a pixel.
fn begin_below(choice: f32, matter: Matter, side: vec3<f32>, begun: Flight, entered: u32) -> Below {
    let throughput = begun.carried.throughput;
    let shares = throughput / (throughput.x + throughput.y + throughput.z);
    let against = dot(side, begun.direction) < 0.0;
    let outwards = select(-side, side, against);
    let rates = decay(matter);
    let reach = THICK / min(rates.x, min(rates.y, rates.z));
    let behind = trace_closest(begun.start, -outwards, min(reach, 3.0e38), entered);
    let within = clamp((rates * behind.t - 1.0) / (THICK - 1.0), vec3<f32>(0.0), vec3<f32>(1.0));
    let pulls = select(within, vec3<f32>(1.0), behind.primitive == NOTHING);
    let pulled = PULLED * max(1.0 - 2.0 * abs(matter.anisotropy), 0.0) * pulls;
    let ways = Ways(shares * (1.0 - pulled), shares * pulled);
    let last = choice >= shares.x + shares.y;
    let channel = select(vec3<f32>(0.0, f32(!last), f32(last)), vec3<f32>(1.0, 0.0, 0.0), choice < shares.x);
    // What is left of the number, within its channel.
    let u = choice - dot(channel, vec3<f32>(0.0, shares.x, shares.x + shares.y));
    let is_pulled = u < dot(channel, ways.pulled);
    return Below(matter, outwards, rates, ways, channel, is_pulled, against, 1, false, false);
}

// Takes a walk on to where light is turned, meets a surface or ends; which primitive it leaves.
fn step_below(path: vec3<u32>, flight: ptr<function, Flight>, walk: ptr<function, Below>, skip: u32) -> u32 {
    let stop = fly_below(path, flight, walk, skip);
    let turns = (*flight).turns;
    (*flight).turns++;
    (*walk).turned = !stop.meets;
    if stop.meets {
        let hit = stop.hit;
        let side = hit_geometric_normal(hit.primitive);
        let along = dot(side, (*flight).direction) > 0.0;
        // Lights without a material are passed.
        if primitive_instance(hit.primitive) != NOTHING {
            (*walk).depth += select(1, -1, along == (*walk).against);
        }
        (*flight).hit = hit;
        (*walk).ended = (*walk).depth == 0;
        if !(*walk).ended {
            let position = hit_position(hit.primitive, vec2<f32>(hit.u, hit.v));
            (*flight).start = offset_origin(position, select(-side, side, along));
        }
        return hit.primitive;
    }
    // Where nothing is met however far, the surface has a hole, or is none of a body.
    let survival = min(max_component((*flight).carried.throughput) / FAINT, 1.0);
    if stop.way > 1e37 || unit_numbers(turn_bits(path, turns, 1u)).x >= survival {
        *flight = ended(*flight);
        (*walk).ended = true;
        return NOTHING;
    }
    (*flight).carried.throughput /= survival;
    (*flight).start += (*flight).direction * stop.clear;
    return NOTHING;
}

// Goes on to where light would be turned next, or to the surface before that.
fn fly_below(path: vec3<u32>, flight: ptr<function, Flight>, walk: ptr<function, Below>, skip: u32) -> Stop {
    let matter = matter_after((*walk).matter, (*flight).turns);
    let slope = clamp((*walk).decay / matter.extinction, vec3<f32>(0.1), vec3<f32>(0.999));
    var u: vec4<f32>;
    if (*flight).turns < SPREAD_TURNS {
        u = random_numbers(path.x, path.y, SPREAD_DRAWS + path.z * SPREAD_TURNS + (*flight).turns);
    } else {
        u = unit_numbers(turn_bits(path, (*flight).turns, 0u));
    }
    // The density with which pulled light is turned as it was, over that of the phase function.
    var turned = vec3<f32>(1.0);
    if (*walk).turned {
        let before = (*flight).direction;
        let range = log((1.0 + slope) / (1.0 - slope));
        if (*walk).is_pulled {
            let s = dot(slope, (*walk).channel);
            let cosine = (1.0 - (1.0 + s) * exp(-u.y * dot(range, (*walk).channel))) / s;
            (*flight).direction = turned_from((*walk).outwards, clamp(cosine, -1.0, 1.0), u.z);
        } else {
            (*flight).direction = turned_from(before, scattered_cosine(matter.anisotropy, u.y), u.z);
        }
        turned = 2.0 * slope / ((1.0 - slope * dot((*flight).direction, (*walk).outwards)) * range);
        turned /= phase(matter.anisotropy, dot(before, (*flight).direction));
    }
    let pulled = matter.extinction * (1.0 - slope * dot((*flight).direction, (*walk).outwards));
    let rate = dot(select(matter.extinction, pulled, (*walk).is_pulled), (*walk).channel);
    let stop = next_stop(*flight, free_flight(rate, u.x), skip);
    let way = min(stop.way, 1e18);
    // What is left of light that goes so far, in each channel; and the density with which each way gets here.
    var kept = exp(-matter.extinction * way);
    var by_plain = (*walk).ways.plain * kept;
    var by_pulled = (*walk).ways.pulled * turned * exp(-pulled * way);
    if !stop.meets {
        by_plain *= matter.extinction;
        by_pulled *= pulled;
        kept *= matter.scattering;
    }
    let density = dot(by_plain + by_pulled, vec3<f32>(1.0));
    (*flight).carried.throughput *= kept / density;
    (*walk).ways = Ways(by_plain / density, by_pulled / density);
    return stop;
}

// The density of a turn by this cosine, over that of light that is turned to all sides alike. Source: Henyey
// and Greenstein 1941.
fn phase(g: f32, cosine: f32) -> f32 {
    let d = max(1.0 + g * g - 2.0 * g * cosine, 1e-6);
    return (1.0 - g * g) / (d * sqrt(d));
}

// What is left of a walk, beside its shares, in a word that is not 0: turns (13 bits), depth (8 bits), channel
// (2 bits) and flags.
const BELOW_PULLED: u32 = 1u << 23u;
const BELOW_AGAINST: u32 = 1u << 24u;
const BELOW_TURNED: u32 = 1u << 25u;
const BELOW_BEGUN: u32 = 1u << 26u;

fn pack_below(walk: Below, turns: u32) -> u32 {
    let channel = u32(walk.channel.y + 2.0 * walk.channel.z);
    let counts = turns | (u32(clamp(walk.depth, 0, 255)) << 13u) | (channel << 21u) | BELOW_BEGUN;
    return counts | select(0u, BELOW_PULLED, walk.is_pulled) | select(0u, BELOW_AGAINST, walk.against)
        | select(0u, BELOW_TURNED, walk.turned) | select(0u, BELOW_ENDED, walk.ended);
}

fn turns_so_far(status: u32) -> u32 {
    return status & 0x1fffu;
}

fn unpack_below(matter: Matter, side: vec3<f32>, ways: Ways, status: u32) -> Below {
    let channel = vec3<f32>(vec3<u32>((status >> 21u) & 3u) == vec3<u32>(0u, 1u, 2u));
    let against = (status & BELOW_AGAINST) != 0u;
    let depth = i32((status >> 13u) & 0xffu);
    return Below(matter, select(-side, side, against), decay(matter), ways, channel, (status & BELOW_PULLED) != 0u,
        against, depth, (status & BELOW_TURNED) != 0u, (status & BELOW_ENDED) != 0u);
}
