// The ray-triangle test: as in Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection"
// (2013), corners are moved to the ray's frame, where edges are tested in two dimensions. The frame
// is orthonormal in place of a shear after a permutation of axes: that costs the same once the
// permutation is counted, and no axis is special.

// The frame of a ray: two unit vectors across it, its direction as z.
struct RayFrame {
    origin: vec3<f32>,
    across: Across,
    z: vec3<f32>
}

// t and the barycentric coordinates of b and c; t = -1 on a miss. The order of operations matters:
// see edge_side.
fn intersect_triangle(triangle: Triangle, frame: RayFrame) -> vec3<f32> {
    let from_a = triangle.a - frame.origin;
    let from_b = triangle.b - frame.origin;
    let from_c = triangle.c - frame.origin;
    let a = to_plane(from_a, frame);
    let b = to_plane(from_b, frame);
    let c = to_plane(from_c, frame);
    let weights = vec3<f32>(edge_side(b, c), edge_side(c, a), edge_side(a, b));
    let inside = all(weights >= vec3<f32>(0.0)) || all(weights <= vec3<f32>(0.0));
    let sum = weights.x + weights.y + weights.z;
    if !(inside && abs(sum) > 1e-37) {
        return vec3<f32>(-1.0, 0.0, 0.0);
    }
    let barycentric = weights / sum;
    // Distances along the ray are computed for hits only.
    let depths = vec3<f32>(dot(frame.z, from_a), dot(frame.z, from_b), dot(frame.z, from_c));
    return vec3<f32>(dot(barycentric, depths), barycentric.yz);
}

// Where a point, given from the ray's origin, lies across the ray.
fn to_plane(point: vec3<f32>, frame: RayFrame) -> vec2<f32> {
    return vec2<f32>(dot(frame.across.x, point), dot(frame.across.y, point));
}

// On which side of the edge from p to q is the ray, times twice the area they span? It is
// p.x q.y - p.y q.x in a form that the triangle on the other side, which has the edge from q to
// p, evaluates to the exact negative, whether or not the driver fuses multiplications with
// additions. So no ray passes between them.
fn edge_side(p: vec2<f32>, q: vec2<f32>) -> f32 {
    let middle = p + q;
    let edge = q - p;
    return middle.x * edge.y - middle.y * edge.x;
}
