// Light on its way through media that scatter it; see flight.wgsl.

// Does the medium that counts scatter?
fn scatters(media: vec4<u32>) -> bool {
    return any(volume_table[active_medium(media) & 0xffffu].xyz > vec3<f32>(0.0));
}

// What a ray of length `distance` has kept, where the flight has not seen to that.
fn ray_transmittance(media: vec4<u32>, distance: f32) -> vec3<f32> {
    if scatters(media) {
        return vec3<f32>(1.0);
    }
    return transmittance(media, distance);
}

// Goes on to the nearest surface, but `skip`; `path` is pixel, sample and vertex.
fn fly(path: vec3<u32>, media: vec4<u32>, begun: Flight, skip: u32) -> Flight {
    if !scatters(media) {
        var flight = begun;
        flight.hit = trace_closest(flight.start, flight.direction, 3.0e38, skip);
        return flight;
    }
    let row = active_medium(media) & 0xffffu;
    let volume = volume_table[row];
    return fly_through(path, Matter(medium_table[row].xyz, volume.xyz, volume.w, false), begun, skip);
}
