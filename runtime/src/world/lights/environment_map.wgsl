// A lat-long picture: the top row is +y, its centre column -z, and +x is right of that.
// environment_texels holds radiance, and in .w the density by solid angle of sampling the texel.

// Texture coordinates of a direction: u to the right, v down.
fn environment_uv(direction: vec3<f32>) -> vec2<f32> {
    let d = turn_about_y(direction, ENVIRONMENT_SINE, ENVIRONMENT_COSINE);
    let across2 = d.x * d.x + d.z * d.z;
    // At a pole every u is the same; this one keeps atan2 defined.
    let forward = select(1.0, -d.z, across2 > 0.0);
    return vec2<f32>(
        0.5 + atan2(d.x, forward) * 0.15915494,
        atan2(sqrt(across2), d.y) * 0.31830987
    );
}

fn turn_about_y(v: vec3<f32>, sine: f32, cosine: f32) -> vec3<f32> {
    return vec3<f32>(cosine * v.x - sine * v.z, v.y, sine * v.x + cosine * v.z);
}

// Bilinear between texel centres, around the seam, and constant beyond the centres of the first
// and last row.
fn environment_radiance(uv: vec2<f32>) -> vec3<f32> {
    let p = uv * vec2<f32>(f32(ENVIRONMENT_WIDTH), f32(ENVIRONMENT_HEIGHT)) - 0.5;
    let cell = floor(p);
    let weight = p - cell;
    let left = i32(cell.x) + select(0, i32(ENVIRONMENT_WIDTH), cell.x < 0.0);
    let columns = vec2<u32>(u32(left), u32(left) + 1u) % ENVIRONMENT_WIDTH;
    let last = i32(ENVIRONMENT_HEIGHT) - 1;
    let top = u32(clamp(i32(cell.y), 0, last)) * ENVIRONMENT_WIDTH;
    let bottom = u32(clamp(i32(cell.y) + 1, 0, last)) * ENVIRONMENT_WIDTH;
    return mix(
        mix(environment_texels[top + columns.x].xyz, environment_texels[top + columns.y].xyz, weight.x),
        mix(environment_texels[bottom + columns.x].xyz, environment_texels[bottom + columns.y].xyz, weight.x),
        weight.y
    );
}
