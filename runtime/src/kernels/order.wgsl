// The order of rays: a counting sort of a queue by where rays begin and roughly where they go, so that
// the threads of a subgroup visit the same nodes (after Garanzha and Loop, "Fast Ray Sorting and
// Breadth-First Packet Traversal for GPU Ray Tracing", 2010, who sort by the same). Three
// kernels: this one counts the rays of each bin, and notes each ray's bin and rank in it;
// order_scan.wgsl turns counts into the places where bins begin, and order_scatter.wgsl writes the
// queue again. bins[b] is the count of bin b, bins[BINS + b] its begin, bins[2 BINS] the number of
// places taken.

fn bin_ray(item: u32, origin: vec3<f32>, direction: vec3<f32>) {
    let bin = ray_bin(origin, direction);
    queues[REGION_BINS * POOL_SIZE + item] = bin;
    queues[REGION_RANKS * POOL_SIZE + item] = atomicAdd(&bins[bin], 1u);
}

// Cells of the scene along a curve (Morton order), and in each the octants of directions: eight
// neighbouring bins.
fn ray_bin(origin: vec3<f32>, direction: vec3<f32>) -> u32 {
    let cells = f32(1u << CELL_BITS);
    let place = clamp((origin - SCENE_LOW) * (cells * SCENE_SCALE), vec3<f32>(0.0), vec3<f32>(cells - 1.0));
    let cell = vec3<u32>(place);
    var bin = 0u;
    for (var bit = 0u; bit < CELL_BITS; bit++) {
        let bits = (cell >> vec3<u32>(bit)) & vec3<u32>(1u);
        bin |= (bits.x | (bits.y << 1u) | (bits.z << 2u)) << (3u * bit);
    }
    let octant = select(vec3<u32>(1u, 2u, 4u), vec3<u32>(0u), direction < vec3<f32>(0.0));
    return 8u * bin + (octant.x | octant.y | octant.z);
}
