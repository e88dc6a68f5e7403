// Boxes around all that shines, two rows each after the lights of the table: their corners.

// Whether a ray may meet a light. Where it can not, its last chance to gather any is gone.
fn may_meet_light(origin: vec3<f32>, direction: vec3<f32>) -> bool {
    let flat = abs(direction) < vec3<f32>(1e-30);
    let inverse = 1.0 / select(direction, vec3<f32>(1e-30), flat);
    for (var at = 0u; at < LIGHT_BOXES; at += 1u) {
        let corner = 2u * (LIGHT_COUNT + at);
        let a = (bitcast<vec3<f32>>(light_table[corner].xyz) - origin) * inverse;
        let b = (bitcast<vec3<f32>>(light_table[corner + 1u].xyz) - origin) * inverse;
        let near = min(a, b);
        let far = max(a, b);
        if max(max(near.x, near.y), max(near.z, 0.0)) <= min(min(far.x, far.y), far.z) {
            return true;
        }
    }
    return false;
}
