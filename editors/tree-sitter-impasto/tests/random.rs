//! Random numbers that are the same in every run, and random expressions made of them.

/// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators" (2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }

    pub(crate) fn pick<'a>(&mut self, from: &[&'a str]) -> &'a str {
        from[self.below(from.len())]
    }
}

const OPERATORS: [&str; 18] = [
    "||", "&&", "==", "!=", "<", "<=", ">", ">=", "|", "^", "&", "<<", ">>", "+", "-", "*", "/",
    "%",
];

const LEAVES: [&str; 22] = [
    "a",
    "b_1",
    "_",
    "true",
    "false",
    "0",
    "12",
    "12u",
    "0xff",
    "0xFFu",
    "1.5",
    "2.",
    ".5",
    "1e-3",
    "2.5E+7",
    "1 m",
    "12um",
    "0.6 mm",
    "30 deg",
    "\"wood.png\"",
    "\"\"",
    "m",
];

const SPACES: [&str; 6] = ["", " ", " ", "\n    ", " /* aside */ ", " // aside\n"];

/// An expression as somebody may write it, with every operator, literal and kind of space.
pub(crate) fn expression(random: &mut Random, depth: usize) -> String {
    if depth == 0 {
        return random.pick(&LEAVES).to_owned();
    }
    let inner = |random: &mut Random| expression(random, depth - 1);
    match random.below(16) {
        0..=6 => {
            let (left, right) = (inner(random), inner(random));
            let (before, after) = (random.pick(&SPACES), random.pick(&SPACES));
            let operator = random.pick(&OPERATORS);
            format!("{left} {before}{operator} {after}{right}")
        }
        7 => format!("{}{}", random.pick(&["-", "!", "--", "-!"]), inner(random)),
        8 => format!("({})", inner(random)),
        9 => format!(
            "{}.{}",
            inner(random),
            random.pick(&["x", "xyz", "surface"])
        ),
        10 => format!("{}[{}]", inner(random), inner(random)),
        11 => format!("f({}, name: {})", inner(random), inner(random)),
        12 => format!("f({},)", inner(random)),
        13 => format!("[{}, {}]", inner(random), inner(random)),
        14 => format!(
            "if {} {{ {} }} else {{ {} }}",
            inner(random),
            inner(random),
            inner(random)
        ),
        _ => format!("{{ let a = {}; {} }}", inner(random), inner(random)),
    }
}
