// The threads of a subgroup as bits of a ballot, lane 0 lowest. A subgroup has at most 128.

var<private> subgroup_lane: u32;

fn lane_count(ballot: vec4<u32>) -> u32 {
    let counts = countOneBits(ballot);
    return counts.x + counts.y + counts.z + counts.w;
}

// The lowest lane of a ballot that is not empty.
fn first_lane(ballot: vec4<u32>) -> u32 {
    if ballot.x != 0u {
        return firstTrailingBit(ballot.x);
    }
    if ballot.y != 0u {
        return 32u + firstTrailingBit(ballot.y);
    }
    if ballot.z != 0u {
        return 64u + firstTrailingBit(ballot.z);
    }
    return 96u + firstTrailingBit(ballot.w);
}

// How many lanes of a ballot come before `lane`.
fn lanes_before(ballot: vec4<u32>, lane: u32) -> u32 {
    let word = vec4<u32>(0u, 32u, 64u, 96u);
    let within = (vec4<u32>(1u) << (vec4<u32>(lane) & vec4<u32>(31u))) - 1u;
    let mask = select(select(vec4<u32>(0u), within, vec4<u32>(lane) >= word),
        vec4<u32>(0xffffffffu), vec4<u32>(lane) >= word + 32u);
    return lane_count(ballot & mask);
}
