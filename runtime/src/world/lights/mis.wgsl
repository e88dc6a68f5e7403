// Multiple importance sampling: light that both samples of lights and scattered rays find is weighted,
// so that both together count once.

// The weight of a technique with density a where another has density b (Veach 1997, beta = 2).
// In this form neither squares overflow nor zeros divide; both weights sum to 1. WGSL has GPUs divide
// well by numbers up to 2^126 only, so that the largest densities are brought below.
fn power_heuristic(a: f32, b: f32) -> f32 {
    if a <= 0.0 {
        return 0.0;
    }
    let larger = max(a, b);
    let scale = select(1.0, 0x1p-4, larger > 0x1p120);
    let ratio = (min(a, b) * scale) / (larger * scale);
    let smaller = ratio * ratio / (1.0 + ratio * ratio);
    return select(smaller, 1.0 - smaller, a >= b);
}
