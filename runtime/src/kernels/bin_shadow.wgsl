// Counts shadow rays by what they will meet; see order.wgsl.

fn bin_shadow(slot: u32, item: u32) {
    bin_ray(item, load_shadow_origin(slot).origin, load_shadow_direction(slot).direction);
}
