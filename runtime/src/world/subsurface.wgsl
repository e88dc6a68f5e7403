// Light below a surface: a walk through the matter of the material that it entered, until it is outside of
// all that it has entered; see flight.wgsl. The boundary neither reflects nor refracts.

// The least mean free path, over the distance that rays are moved off surfaces at most: what is shorter
// would be lost in rounding.
const LEAST_FREE_PATH: f32 = 32.0;

// Walks from `begun`, just below the primitive `entered`, to where light leaves. Objects that overlap are
// one: surfaces that light meets from outside on its way are entered as well. Lights without a material
// are passed.
fn walk_below(path: vec3<u32>, albedo: vec3<f32>, rates: vec3<f32>, g: f32, begun: Flight, entered: u32) -> Flight {
    var flight = begun;
    let floor_path = LEAST_FREE_PATH * 4e-6 * max_component(abs(begun.start));
    let extinction = min(rates, vec3<f32>(1.0 / max(floor_path, 1e-18)));
    let kept = min(albedo, vec3<f32>(1.0));
    let matter = Matter(extinction, extinction * kept, clamp(g, -0.99, 0.99), true);
    let inward = dot(hit_geometric_normal(entered), flight.direction);
    var skip = entered;
    // Of how many surfaces light is on the side that it has entered.
    var depth = 1;
    while flight.turns < MAX_TURNS {
        flight = fly_through(path, matter, flight, skip);
        let hit = flight.hit;
        if hit.primitive == NOTHING {
            // Through a hole of the surface, or between objects that are no bodies.
            return ended(flight);
        }
        let side = hit_geometric_normal(hit.primitive);
        let way = dot(side, flight.direction);
        if primitive_instance(hit.primitive) != NOTHING {
            depth += select(-1, 1, way * inward > 0.0);
        }
        if depth == 0 {
            flight.carried.bsdf_pdf = 0.0;
            return flight;
        }
        let position = hit_position(hit.primitive, vec2<f32>(hit.u, hit.v));
        flight.start = offset_origin(position, select(-side, side, way > 0.0));
        skip = hit.primitive;
        flight.turns++;
    }
    atomicAdd(&counters[COUNTER_LOST_PATHS], 1u);
    return ended(flight);
}
