// The megakernel: the stages of the wavefront in a loop, with state in registers (Laine et al. 2013,
// section 4.1). A thread takes a path from its camera to its end, which MAX_DEPTH bounds.
#if regenerates
//
// Threads whose path has ended begin another: they take what is left of the portion of work that the
// prepare kernel handed out, until that or their own share is used up: a thread takes no more than
// FETCH_LIMIT paths on average, and there are threads enough for all. Which of them traces a path
// changes nothing.
#endif

var<private> wanted_instance: u32 = NOTHING;
#each sure
$variable
#end

// A turn ends without a material instead: what the path gathered is in the film.
fn request_new_path() {}

fn request_material(instance: u32) {
    wanted_instance = instance;
}

#each sure
$request

#end
#each possible
$variable

$request

#end
// Takes a path over one segment; whether it goes on.
fn advance(item: u32) -> bool {
#each before
    if $wanted {
        $wanted = false;
        $call;
    }
#end
    wanted_instance = NOTHING;
#each each_turn
    $call;
#end
    if wanted_instance == NOTHING {
        return false;
    }
#each beside
    if $wanted {
        $wanted = false;
        $call;
    }
#end
    material(item, wanted_instance);
    return true;
}
#if regenerates

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(
    @builtin(subgroup_invocation_id) lane_of_subgroup: u32, @builtin(local_invocation_index) lane: u32
) {
    subgroup_lane = lane_of_subgroup;
#if walk_lane
    walk_lane = lane;
#endif
    let lanes = lane_count(subgroupBallot(true));
    var live = false;
    var work_left = true;
    var fetched = 0u;
    var item = 0u;
    loop {
        // Paths diverge; here the threads come together again.
        subgroupBarrier();
        let idle = subgroupBallot(!live);
        let idle_lanes = lane_count(idle);
        if work_left && idle_lanes * REGENERATION_SHARE > lanes {
            let leader = first_lane(idle);
            var first = 0u;
            if subgroup_lane == leader {
                first = atomicAdd(&counters[COUNTER_FETCHED], idle_lanes);
            }
            first = subgroupShuffle(first, leader);
            fetched += idle_lanes;
            work_left = first + idle_lanes < POOL_SIZE && fetched < FETCH_LIMIT * lanes;
            if !live {
                item = first + lanes_before(idle, subgroup_lane);
                live = item < POOL_SIZE;
                if live {
                    new_path(item, item);
                }
            }
        }
        if !subgroupAny(live) {
            break;
        }
        if live {
            live = advance(item);
        }
    }
}
#else

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
#if walk_lane
    walk_lane = lane;
#endif
    let item = (group.y * ROW_GROUPS + group.x) * WORKGROUP_SIZE + lane;
    if item >= POOL_SIZE {
        return;
    }
    new_path(item, item);
    // Each segment takes a turn, and one more ends a path whose scattering failed.
    for (var turn = 0u; turn <= MAX_DEPTH + 1u; turn++) {
        if !advance(item) {
            return;
        }
    }
}
#endif
