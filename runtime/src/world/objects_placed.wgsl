// The object of a primitive: the first part of its placement, and which of them its triangle is of.

fn primitive_object(primitive: u32) -> u32 {
    let place = place_of(primitive);
    return placement_objects[place.placement] + triangle_objects[place.triangle];
}
