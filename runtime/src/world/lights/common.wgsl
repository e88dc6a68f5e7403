// What every kind of light shares.

// One direction in which light may arrive at a point.
struct LightSample {
    wi: vec3<f32>,       // unit, towards the light
    distance: f32,       // how far a shadow ray goes, short of the light itself
    radiance: vec3<f32>, // divided by the density of the sample, choice of the light included; 0: no sample
    pdf: f32             // that density, by solid angle; 0 for a light seen in a single direction
}

fn no_light_sample() -> LightSample {
    return LightSample(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 0.0);
}

// Distance to lights at infinity.
const FAR_AWAY: f32 = 3e38;
#if mis

// The weight of a direction that scattering chose with density `bsdf_pdf` (0: a camera ray or a
// discrete lobe, which light samples cannot replace) and that light samples have density `light_pdf` of.
fn scattering_weight(bsdf_pdf: f32, light_pdf: f32) -> f32 {
    return select(1.0, power_heuristic(bsdf_pdf, light_pdf), bsdf_pdf > 0.0);
}
#endif
