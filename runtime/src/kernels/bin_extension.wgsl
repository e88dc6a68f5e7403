// Counts extension rays by what they will meet; see order.wgsl.

fn bin_extension(slot: u32, item: u32) {
    bin_ray(item, load_ray_origin(slot).origin, load_ray_direction(slot).direction);
}
