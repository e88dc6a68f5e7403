// Russian roulette: dim paths end at random, and the others carry more for them.

// The chance with which a path goes on from the end of its `vertex`-th segment; 0 if this one ends there.
fn roulette(throughput: vec3<f32>, pixel: u32, sample: u32, vertex: u32) -> f32 {
    let survival = survival_probability(throughput);
    let drawn = random_numbers(pixel, sample, vertex_draw(vertex, DRAW_LIGHT)).w;
    return select(0.0, survival, drawn < survival);
}

// The square root of what the path carries: ended in proportion to that itself, the few that go on carry so much more that
// their noise costs what was saved (docs/measurements.md, when roulette may begin). At least the chance of the smallest
// random number, and a multiple of it: then the number falls below it exactly that often, and dividing by it leaves the
// mean alone.
fn survival_probability(throughput: vec3<f32>) -> f32 {
    return ceil(min(sqrt(max_component(throughput)), 0.95) * 0x1p24) * 0x1p-24;
}
