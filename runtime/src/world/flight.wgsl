// Light on its way through matter that scatters it: a random walk, which belongs to the ray cast that
// it begins with. It costs no turn of the wavefront, no depth and no number of the path's own draws.
//
// Lights are not sampled from within matter: light that was turned is found by chance only, and a
// density of 0 says so. volume.wgsl has media, subsurface.wgsl what lies below opaque surfaces.

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

// Where light that would go on for some distance gets to.
struct Stop {
    hit: Hit,
    // Is that a surface?
    meets: bool,
    // How far it is.
    way: f32,
    // How far light can go that is turned there, and be before all surfaces.
    clear: f32
}

fn next_stop(flight: Flight, distance: f32, skip: u32) -> Stop {
    // Where light is turned next to a surface, rounding must not put it behind.
    let margin = 4e-6 * (max_component(abs(flight.start)) + distance);
    let hit = trace_closest(flight.start, flight.direction, min(distance + margin, 3.0e38), skip);
    let any = hit.primitive != NOTHING;
    let meets = any && hit.t <= distance;
    return Stop(hit, meets, select(distance, hit.t, meets), select(distance, max(hit.t - 2.0 * margin, 0.0), any));
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

// How far light goes that meets something `rate` times a metre; far beyond everything at a rate of 0.
fn free_flight(rate: f32, u: f32) -> f32 {
    if rate > 0.0 {
        return min(-log(1.0 - u) / rate, 3.0e38);
    }
    return 3.0e38;
}

// The mean cosine `g` as a draw of the cosine. Source: Henyey and Greenstein, "Diffuse Radiation in the
// Galaxy" (1941); the inverse is written such that no g divides.
fn scattered_cosine(g: f32, u: f32) -> f32 {
    let m = 1.0 - 2.0 * u;
    let y = (m + g) / (1.0 + g * m);
    return clamp(y + 0.5 * g * (1.0 - y) * (1.0 + y), -1.0, 1.0);
}

// A direction at this cosine from `axis`, around it by a turn in [0, 1).
fn turned_from(axis: vec3<f32>, cosine: f32, turn: f32) -> vec3<f32> {
    let sine = sqrt((1.0 - cosine) * (1.0 + cosine));
    let angle = 6.2831853 * turn;
    // Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    let side = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (side + axis.z);
    let b = axis.x * axis.y * a;
    let x_axis = vec3<f32>(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x);
    let y_axis = vec3<f32>(b, side + axis.y * axis.y * a, -axis.y);
    return normalize(sine * cos(angle) * x_axis + sine * sin(angle) * y_axis + cosine * axis);
}
