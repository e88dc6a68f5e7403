// Starts a path: takes the next item of work and casts the camera's ray.
#if camera_casts
// Rays of neighbouring pixels meet the same nodes, so that each thread casts its own, and a path that hits
// nothing ends here: it never has a state in memory.
#endif
//
// The prepare kernel hands out work in portions, one for all slots of this iteration, so that
// no counter is contended and more than 2^32 paths need no 64-bit arithmetic here.

fn new_path(slot: u32, item: u32) {
    let place = atomicLoad(&counters[COUNTER_WORK_PIXEL]) + item;
#if some_pixels
    let pixels = run.pixels;
#else
    let pixels = PIXELS;
#endif
    let sample = atomicLoad(&counters[COUNTER_WORK_SAMPLE]) + place / pixels;
    if sample >= run.samples {
        store_radiance(slot, PathRadiance(vec3<f32>(0.0), PATH_RETIRED));
        return;
    }
#if some_pixels
    let pixel = pixel_list[place % pixels];
#else
    let pixel = pixel_at(place % pixels);
#endif
    let index = run.first_sample + sample;
    let ray = camera_ray(pixel, random_numbers(pixel, index, DRAW_CAMERA));
#if camera_casts
    let hit = trace_closest(ray.origin, ray.direction, 3.0e38, NOTHING);
    if hit.primitive == NOTHING {
        var seen = vec3<f32>(0.0);
#if escape_lights
        seen = light_escape(ray.direction, 0.0);
#if light_groups
        record_escape(pixel, vec3<f32>(1.0), ray.direction, 0.0);
#endif
#endif
        film_add(vec3<u32>(pixel, index, 1u), seen);
        store_radiance(slot, PathRadiance(vec3<f32>(0.0), 0u));
        return;
    }
    store_hit(slot, PathHit(hit.t, hit.u, hit.v, hit.primitive));
#else
    store_hit(slot, PathHit(0.0, 0.0, 0.0, NOTHING));
#endif
    store_ray_origin(slot, PathRayOrigin(ray.origin, pixel));
    store_ray_direction(slot, PathRayDirection(ray.direction, index));
    store_throughput(slot, PathThroughput(vec3<f32>(1.0), 0.0));
    store_radiance(slot, PathRadiance(vec3<f32>(0.0), PATH_LIVE + 1u));
#if media
    store_media(slot, PathMedia(CAMERA_MEDIA));
#endif
#if ray_cones
    // The pixel's solid angle, seen from a point of the lens, falls with the third power of the cosine.
    let cosine = dot(ray.direction, camera.forward);
    store_cone(slot, PathCone(0.0, camera.pixel_angle * cosine * sqrt(cosine), 0u, 0u));
#endif
#if !camera_casts
    request_extension(ray.origin, ray.direction, NOTHING);
#endif
}
#if !some_pixels

// The pixel at a place in the order in which those of a sample are begun: tile by tile (tiles.rs).
// Where the picture is a whole number of tiles, all divisors are constants: compilers divide by those by multiplying.
fn pixel_at(place: u32) -> u32 {
    let top = place / (TILE_HEIGHT * WIDTH) * TILE_HEIGHT;
    let height = select(min(TILE_HEIGHT, HEIGHT - top), TILE_HEIGHT, HEIGHT % TILE_HEIGHT == 0u);
    let of_row = place - top * WIDTH;
    let left = of_row / (TILE_WIDTH * height) * TILE_WIDTH;
    let width = select(min(TILE_WIDTH, WIDTH - left), TILE_WIDTH, WIDTH % TILE_WIDTH == 0u);
    let of_tile = of_row - left * height;
    return (top + of_tile / width) * WIDTH + left + of_tile % width;
}
#endif
#if requests

// Keeps where the results of the path's ray casts will be.
fn keep_requests(slot: u32, extension: u32, shadow: u32) {
    store_requests(slot, PathRequests(extension, shadow, 0u, 0u));
}
#endif
