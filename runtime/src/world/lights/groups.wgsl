// Groups of lights: which of the film's outputs light is recorded in, where it is gathered.

// Of light from a surface, by its row of the table.
fn light_group(light: u32) -> u32 {
    return light_groups[light];
}

// Of light that a path ran into.
fn hit_group(primitive: u32) -> u32 {
    let light = primitive_light(primitive);
    if light < GROUPED_LIGHTS {
        return light_group(light);
    }
    return NOTHING;
}

// Of light that materials emit where they are hit.
fn instance_group(instance: u32) -> u32 {
    return instance_groups[instance];
}
