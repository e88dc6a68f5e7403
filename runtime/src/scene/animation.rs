//! What a scene says of time: keys and turntables, and where they put things at a frame.
//!
//! A picture is of one moment: nothing moves while it is taken, and there is no motion blur.

use glam::{DMat3, DVec3};
use impasto_compiler::ParameterValue;
use toml::de::DeValue;

use super::Transform;
use super::description::optional;
use super::document::{Table, Value, number};
use crate::error::SceneError;

/// The largest number that a frame may have.
pub const MAX_FRAME: u32 = 1_000_000;
/// Most frames a second.
const MAX_RATE: f32 = 1000.0;
/// Most keys of one value.
const MAX_KEYS: usize = 10_000;

/// The `[animation]` table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Animation {
    /// How many frames a second has, above 0; 24 by default.
    pub frames_per_second: f64,
    /// Does what has keys come to rest at each of them? Else it goes from one to the next at an even pace.
    pub smooth: bool,
}

impl Default for Animation {
    fn default() -> Self {
        Self {
            frames_per_second: 24.0,
            smooth: false,
        }
    }
}

impl Animation {
    /// Takes the table from that of the scene.
    pub(super) fn read(root: &mut Table) -> Result<Self, SceneError> {
        let mut animation = Self::default();
        let Some(value) = root.get("animation") else {
            return Ok(animation);
        };
        let mut table = value.table("[animation]")?;
        let rate = |v: &Value| {
            let expected = format!("a number above 0, at most {MAX_RATE}");
            v.float_where(&expected, |rate| rate > 0.0 && rate <= MAX_RATE)
        };
        animation.frames_per_second = optional(&mut table, "frames_per_second", rate, 24.0)?.into();
        let smooth = |v: &Value| match v.item().as_str() {
            Some("linear") => Ok(false),
            Some("smooth") => Ok(true),
            _ => Err(v.mismatch("\"linear\" or \"smooth\"")),
        };
        animation.smooth = optional(&mut table, "interpolation", smooth, false)?;
        table.finish()?;
        Ok(animation)
    }
}

/// The moment that a description is read for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) frame: f64,
    pub(super) smooth: bool,
}

impl Moment {
    /// The `keys` of a table, which errors call `title`.
    pub(super) fn keys<'d>(
        table: &mut Table<'d>,
        title: &str,
    ) -> Result<Option<Table<'d>>, SceneError> {
        let value = table.get("keys");
        value
            .map(|value| value.table(format!("`keys` of {title}")))
            .transpose()
    }

    /// Has the `keys` of a table, which errors call `title`, say what its numbers are at this moment.
    pub(super) fn hold(self, table: &mut Table<'_>, title: &str) -> Result<(), SceneError> {
        let Some(keys) = Self::keys(table, title)? else {
            return Ok(());
        };
        let read = |value: &Value| {
            let expected = "a finite number, or a list of such";
            value.numbers().ok_or_else(|| value.mismatch(expected))
        };
        for (name, value) in keys.named() {
            let mix = |a: &Vec<f64>, b: &Vec<f64>, t: f64| {
                if a.len() != b.len() {
                    return Err(value.error("its values have not as many numbers as each other"));
                }
                let each = a.iter().zip(b).map(|(a, b)| a + t * (b - a));
                Ok(each.collect())
            };
            let numbers = self.of_keys(&value, read, mix)?;
            table.hold(name, value.holding(numbers));
        }
        Ok(())
    }

    /// What the keys `name`, if there are any, say at this moment; else `otherwise`.
    pub(super) fn keyed<'d, T>(
        self,
        keys: &mut Option<Table<'d>>,
        name: &'static str,
        read: impl Fn(&Value<'d>) -> Result<T, SceneError>,
        mix: impl Fn(&T, &T, f64) -> T,
        otherwise: T,
    ) -> Result<T, SceneError> {
        let value = keys.as_mut().and_then(|keys| keys.get(name));
        match value {
            Some(value) => self.of_keys(&value, read, |a, b, t| Ok(mix(a, b, t))),
            None => Ok(otherwise),
        }
    }

    /// What `[[frame, VALUE], ..]` says at this moment: before the first key its value, after the last one that.
    pub(super) fn of_keys<'d, T>(
        self,
        value: &Value<'d>,
        read: impl Fn(&Value<'d>) -> Result<T, SceneError>,
        mix: impl Fn(&T, &T, f64) -> Result<T, SceneError>,
    ) -> Result<T, SceneError> {
        let mut keys: Vec<(f64, T)> = Vec::new();
        for (frame, item) in pairs(value)? {
            if keys.last().is_some_and(|(last, _)| *last >= frame) {
                let message = format!("{frame} does not come after the frame before it");
                return Err(item
                    .error(message)
                    .hint("keys are in the order of their frames"));
            }
            keys.push((frame, read(&item)?));
        }
        let after = keys.iter().position(|(frame, _)| *frame > self.frame);
        let last = after.unwrap_or(keys.len()).saturating_sub(1);
        match (after, keys.get(last), keys.get(last + 1)) {
            (Some(1..), Some((from, a)), Some((to, b))) => {
                let t = (self.frame - from) / (to - from);
                let eased = t * t * (3.0 - 2.0 * t);
                mix(a, b, if self.smooth { eased } else { t })
            }
            (_, Some(_), _) => Ok(keys.swap_remove(last).1),
            _ => Err(value.mismatch(PAIRS)),
        }
    }
}

const PAIRS: &str = "keys, as [[1, VALUE], [24, VALUE]]: frames and what it is there";

/// The pairs of a list, at least one.
fn pairs<'d>(value: &Value<'d>) -> Result<Vec<(f64, Value<'d>)>, SceneError> {
    let items = value.items().filter(|items| !items.is_empty());
    let items = items.ok_or_else(|| value.mismatch(PAIRS))?;
    if items.len() > MAX_KEYS {
        return Err(value.error(format!("there are more than {MAX_KEYS} keys")));
    }
    let pair = |item: Value<'d>| {
        let refused = || item.mismatch("a frame and a value, as [24, VALUE]");
        let both: [Value<'d>; 2] = item
            .items()
            .and_then(|both| both.try_into().ok())
            .ok_or_else(refused)?;
        let [frame, value] = both;
        let number = number(frame.item()).filter(|f| f.abs() <= f64::from(MAX_FRAME));
        let expected = format!("a frame's number, at most {MAX_FRAME}");
        Ok((number.ok_or_else(|| frame.mismatch(&expected))?, value))
    };
    items.into_iter().map(pair).collect()
}

/// Between two places.
pub(super) fn mix_places(a: &DVec3, b: &DVec3, t: f64) -> DVec3 {
    a.lerp(*b, t)
}

/// Between two values of a parameter, the components of numbers apart. What needs the language is left to it.
pub(super) fn mix_values(a: &ParameterValue, b: &ParameterValue, t: f64) -> Option<ParameterValue> {
    let float = |value: &ParameterValue| match value {
        ParameterValue::Int(i) => Some(*i as f64),
        ParameterValue::Float(x) => Some(*x),
        _ => None,
    };
    let between = |a: f64, b: f64| a + t * (b - a);
    if let (Some(a), Some(b)) = (float(a), float(b)) {
        return Some(ParameterValue::Float(between(a, b)));
    }
    match (a, b) {
        (ParameterValue::Floats(a), ParameterValue::Floats(b)) if a.len() == b.len() => {
            let each = a.iter().zip(b).map(|(a, b)| between(*a, *b));
            Some(ParameterValue::Floats(each.collect()))
        }
        (ParameterValue::Text(a), ParameterValue::Text(b)) => Some(ParameterValue::Text(format!(
            "({a}) * {:?} + ({b}) * {t:?}",
            1.0 - t
        ))),
        _ => None,
    }
}

/// The `turntable` of a table as a turn about a vertical axis: `{ frames = 24, about = [x, y, z] }`, or the number of
/// frames alone. Without `about` it turns about `home`.
pub(super) fn turntable(
    table: &mut Table,
    moment: Moment,
    home: DVec3,
) -> Result<Transform, SceneError> {
    let Some(value) = table.get("turntable") else {
        return Ok(Transform::default());
    };
    let frames = |v: &Value| v.integer(1..=MAX_FRAME);
    let (frames, about) = match value.item() {
        DeValue::Table(_) => {
            let mut table = value.table("`turntable`")?;
            let count = frames(&table.require("frames")?)?;
            let about = optional(&mut table, "about", Value::place, home)?;
            table.finish()?;
            (count, about)
        }
        _ => (frames(&value)?, home),
    };
    let turns = (moment.frame / f64::from(frames)).rem_euclid(1.0);
    let turn = DMat3::from_rotation_y(turns * std::f64::consts::TAU);
    if turns == 0.0 {
        return Ok(Transform::default());
    }
    Ok(Transform {
        matrix: turn,
        translation: about - turn * about,
    })
}
