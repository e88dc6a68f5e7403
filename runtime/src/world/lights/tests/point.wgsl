// A light at a point, which light samples alone find.

fn sample_point_light(pick: LightPick, position: vec3<f32>) -> LightSample {
    let to_light = point_lights[pick.light - FIRST_POINT_LIGHT].xyz - position;
    let distance = length(to_light);
    if !(distance > 1e-15) {
        return no_light_sample();
    }
    let irradiance = light_radiance(pick.light) / (distance * distance);
    return LightSample(to_light / distance, distance, irradiance / pick.probability, 0.0);
}
