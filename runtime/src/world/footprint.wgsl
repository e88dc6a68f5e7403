// What a cone sees of the surface that it meets: Akenine-Moller et al., "Texture Level of Detail Strategies for
// Real-Time Ray Tracing" (Ray Tracing Gems, 2019, chapter 20), with both axes of the ellipse.

struct Footprint {
    // The diameter along the projection of the cone's axis, and that across it.
    x: vec3<f32>,
    y: vec3<f32>
}

// Of a cone of a width, which comes from the direction wo. At grazing angles it is no longer than LONGEST_FOOTPRINT
// times its width: what patterns average over is a box, and one that long would blur across the view as well.
fn footprint(normal: vec3<f32>, wo: vec3<f32>, width: f32) -> Footprint {
    let cosine = dot(normal, wo);
    let along = wo - cosine * normal;
    let sine = length(along);
    var x = across(normal).x;
    if sine > 1e-3 {
        x = along / sine;
    }
    let stretched = width / max(abs(cosine), 1.0 / LONGEST_FOOTPRINT);
    return Footprint(stretched * x, width * cross(normal, x));
}
