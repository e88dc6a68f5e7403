// Finds what a path's next segment hits.

fn extension(slot: u32) {
    let start = load_ray_origin(slot);
    let ray = load_ray_direction(slot);
    let hit = trace_closest(start.origin, ray.direction, 3.0e38, load_hit(slot).primitive);
    store_hit(slot, PathHit(hit.t, hit.u, hit.v, hit.primitive));
}
