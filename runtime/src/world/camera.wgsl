// Rays of a pinhole or thin-lens camera, uniform over the pixel: the film's filter is a box.
// The best pair of the numbers, y and z, is the place in the pixel; x and w are for the lens.

struct CameraRay { origin: vec3<f32>, direction: vec3<f32> }

fn camera_ray(pixel: u32, u: vec4<f32>) -> CameraRay {
    let column = f32(pixel % WIDTH) + u.y;
    let row = f32(pixel / WIDTH) + u.z;
    let x = 2.0 * column / f32(WIDTH) - 1.0;
    let y = 1.0 - 2.0 * row / f32(HEIGHT);
    let towards = camera.forward + x * camera.right + y * camera.up;
#if lens
    // Everything on the plane of focus stays where the pinhole sees it.
    let radius = camera.lens_radius * sqrt(u.x);
    let angle = 6.2831853 * u.w;
    let right = normalize(camera.right);
    let up = normalize(camera.up);
    let offset = radius * (cos(angle) * right + sin(angle) * up);
    return CameraRay(camera.position + offset, normalize(camera.focus_distance * towards - offset));
#else
    return CameraRay(camera.position, normalize(towards));
#endif
}
