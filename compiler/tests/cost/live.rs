//! How many numbers are alive at once, on functions for which that can be counted by hand.

use impasto_compiler::cost;
use impasto_compiler::ir::parse::parse;
use impasto_compiler::source::FileId;

/// The numbers alive at once in the last function of a text.
fn live(text: &str) -> u32 {
    let parsed = parse(FileId(0), text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let (f, _) = parsed.module.functions.split_last().expect("a function");
    cost::live(&parsed.module, f)
}

/// Asserts what is alive in a function over `x`, `n` and `v` with the given body.
#[track_caller]
fn assert_live(expected: u32, body: &str) {
    let text = format!(
        "fn f(x: float, n: int, v: vec3) -> float {{ var @0.a: float var @1.i: int {body} }}"
    );
    assert_eq!(live(&text), expected, "{body}");
}

#[test]
fn what_is_needed_at_the_end_is_alive_together() {
    // Eight values (with names, so that they are computed before they are summed), less the last.
    let sines = |count: usize| {
        let values = (0..count).map(|i| format!("%{i} s{i}: float = mul x, {}.5\n", i + 2));
        let mut text: String = values.collect();
        for i in 0..count - 1 {
            let (sum, a) = (count + i, if i == 0 { 0 } else { count + i - 1 });
            text += &format!("%{sum}: float = add %{a}, %{}\n", i + 1);
        }
        format!("{text} return %{}", 2 * count - 2)
    };
    assert_live(8, &sines(8));
    assert_live(20, &sines(20));
}

#[test]
fn a_chain_keeps_one_number() {
    assert_live(
        1,
        "%0: float = sin x %1: float = exp %0 %2: float = mul %1, 2.0 return %2",
    );
    // With a second operand it is two.
    assert_live(2, "%0: float = sin x %1: float = add x, %0 return %1");
}

#[test]
fn vectors_count_by_component_and_their_parts_are_not_new() {
    assert_live(3, "%0: vec3 = sqrt v %1: float = %0.x return %1");
    // One component is used, so only that is alive; putting vectors together makes nothing.
    assert_live(
        1,
        "%0: float = v.y %1: vec3 = (0.5).xxx %2: float = mul %0, 2.0 return %2",
    );
    assert_live(
        3,
        "%0: float = v.x %1: vec3 = vec3(%0) %2: vec3 = mul %1, v %3: float = dot %2, %2 return %3",
    );
    assert_live(
        6,
        "%0 u: vec3 = sqrt v %1 w: vec3 = mul v, 2.0 %2: float = dot %0, %1 return %2",
    );
}

#[test]
fn arguments_and_constants() {
    // Arguments are alive up to their last use, ones never used are not, and constants never.
    assert_live(0, "return 1.0");
    assert_live(1, "return x");
    assert_live(
        4,
        "%0: float = dot v, v %1 y: float = sqrt %0 %2: float = mul x, %1 return %2",
    );
}

#[test]
fn branches_keep_what_their_own_side_needs() {
    // Before the branch x and three numbers of v; within, either x or v.
    assert_live(
        5,
        "%0: int = hash n %1 c: bool = lt %0, 3
         if %1 { %2: float = sin x @0.a = %2 } else { %3: float = dot v, v @0.a = %3 }
         %4: float = load @0.a return %4",
    );
    // What is used behind the branch stays alive on both sides.
    assert_live(
        5,
        "if true { %0: float = dot v, v @0.a = %0 }
         %1: float = load @0.a %2: float = add %1, x %3: float = to_float n %4: float = mul %2, %3
         return %4",
    );
}

#[test]
fn loops_keep_what_a_later_turn_needs() {
    // The counter, its bound, a, and x, which every turn reads although this is its last mention.
    assert_live(
        4,
        "@0.a = 0.0 for @1.i in 0 .. n {
             %0: float = load @0.a %1: float = add %0, x @0.a = %1
         } %2: float = load @0.a return %2",
    );
    // With v behind the loop, seven.
    assert_live(
        7,
        "@0.a = 0.0 for @1.i in 0 .. n {
             %0: float = load @0.a %1: float = add %0, x @0.a = %1
         } %2: float = load @0.a %3: float = dot v, v %4: float = add %2, %3 return %4",
    );
    // A variable that is stored before it is read in each turn is not carried from turn to turn:
    // the counter, its bound and x are, and the last a is needed behind.
    assert_live(
        4,
        "for @1.i in 0 .. n {
             %0: float = sin x %1: float = add %0, x @0.a = %1 %2: float = load @0.a
             %3: bool = lt %2, 1.0 if %3 { break }
         } return x",
    );
    // So is x where the turn has no more use for it: beside three sines, the counter and its bound.
    assert_live(
        6,
        "@0.a = 0.0 for @1.i in 0 .. n {
             %0: float = load @0.a %1: float = add %0, x %2: vec3 = vec3(%1) %3 s: vec3 = sin %2
             %4: float = dot %3, %3 @0.a = %4
         } %5: float = load @0.a return %5",
    );
    // What is needed behind a loop is needed where its test ends it, though the body stores it anew:
    // a beside v and three sines of it, x, n and the counter.
    assert_live(
        10,
        "@0.a = x loop limit 9 {
             %0 s: vec3 = sin v %1: float = dot %0, %0 %2: bool = lt %1, x
         } while %2 { %3: float = to_float n @0.a = %3 }
         %4: float = load @0.a return %4",
    );
    // A while loop has a counter of its own; its test may use what the body changes.
    assert_live(
        3,
        "@0.a = x loop limit 9 { %0: float = load @0.a %1: bool = lt %0, 9.0 } while %1 {
             %2: float = load @0.a %3: float = mul %2, %2 @0.a = %3
         } %4: float = load @0.a return %4",
    );
}

#[test]
fn reading_a_variable_takes_no_number_unless_it_changes() {
    assert_live(
        2,
        "@0.a = x %0 old: float = load @0.a %1: float = sin %0 %2: float = add %1, %0 return %2",
    );
    // The old value and the new one are used.
    assert_live(
        2,
        "@0.a = x %0 old: float = load @0.a %1: float = sin %0 @0.a = %1
         %2: float = load @0.a %3: float = add %0, %2 return %3",
    );
    // In a loop it changes behind the last use of the text: both, the counter and its bound.
    assert_live(
        4,
        "@0.a = x %0 old: float = load @0.a
         for @1.i in 0 .. n {
             %1: float = load @0.a %2: float = add %1, %0 %3: float = sin %2 @0.a = %3
         } %4: float = load @0.a return %4",
    );
}

const CALLEE: &str = "fn g(v: vec3, w: vec3) -> float {
    %0 a: vec3 = sqrt v %1 b: vec3 = exp w %2 c: vec3 = mul v, w %3: vec3 = add %0, %1
    %4: vec3 = add %3, %2 %5: float = dot %4, %4 return %5 } ";

#[test]
fn calls_are_in_line() {
    // Within: v and w, with a then b made of them.
    assert_eq!(live(CALLEE), 12);
    let f = |body: &str| {
        live(&format!(
            "{CALLEE} fn f(x: float, v: vec3) -> float {{ {body} }}"
        ))
    };
    // One argument for both parameters: its numbers are not doubled.
    assert_eq!(f("%0: float = call g(v, v) return %0"), 9);
    // What is alive at the call comes on top.
    assert_eq!(
        f("%0: float = call g(v, v) %1: float = add %0, x return %1"),
        10
    );
    // Two calls: v is kept during the first, the result of that during the second.
    assert_eq!(
        f("%0 a: float = call g(v, v) %1 b: float = call g(v, v) %2: float = add %0, %1 return %2"),
        12
    );
}
