//! What is looked at in a `.usda` layer before the reader has it. That one calls itself for each bracket within another,
//! and composing takes longer than in proportion to how deep prims lie, so how deep brackets nest is bounded here.

/// Brackets within brackets.
const DEEPEST: usize = 128;

/// Fails if brackets nest too deeply.
pub(super) fn check(text: &[u8]) -> Result<(), String> {
    let mut depth = 0_usize;
    let mut line = 1_usize;
    let mut at = 0;
    while let Some(byte) = text.get(at) {
        let rest = &text[at..];
        at += match byte {
            b'\n' => {
                line += 1;
                1
            }
            b'#' => rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len()),
            b'"' | b'\'' => {
                let mark = [*byte; 3];
                let (mark, is_long) = if rest.starts_with(&mark) {
                    (&mark[..], true)
                } else {
                    (&mark[..1], false)
                };
                let length = string(&rest[mark.len()..], mark, is_long);
                line += rest[..mark.len() + length]
                    .iter()
                    .filter(|b| **b == b'\n')
                    .count();
                mark.len() + length
            }
            b'@' => {
                let mark: &[u8] = if rest.starts_with(b"@@@") {
                    b"@@@"
                } else {
                    b"@"
                };
                let end = rest[mark.len()..]
                    .windows(mark.len())
                    .position(|w| w == mark);
                let length = end.map_or(rest.len(), |end| end + 2 * mark.len());
                line += rest[..length].iter().filter(|b| **b == b'\n').count();
                length
            }
            b'(' | b'[' | b'{' => {
                depth += 1;
                if depth > DEEPEST {
                    return Err(format!(
                        "line {line}: more than {DEEPEST} brackets lie within each other"
                    ));
                }
                1
            }
            b')' | b']' | b'}' => {
                depth = depth.saturating_sub(1);
                1
            }
            _ => 1,
        };
    }
    Ok(())
}

/// How long a string is from after its first mark to after its last.
fn string(rest: &[u8], mark: &[u8], is_long: bool) -> usize {
    let mut at = 0;
    while let Some(byte) = rest.get(at) {
        if *byte == b'\\' {
            at += 2;
        } else if rest[at..].starts_with(mark) {
            return at + mark.len();
        } else if *byte == b'\n' && !is_long {
            return at;
        } else {
            at += 1;
        }
    }
    rest.len()
}
