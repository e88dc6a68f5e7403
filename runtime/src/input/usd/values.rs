//! Values of attributes as numbers: USD has each in halves, floats and doubles.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use glam::{DMat4, DQuat, DVec3, Vec2, Vec3};
use openusd::sdf::{Path, Value};
use openusd::usd::{Stage, TimeCode};

/// What the reader says of an attribute, at a time.
#[derive(Clone, Copy)]
pub(super) struct Reader<'s> {
    pub(super) stage: &'s Stage,
    /// In time codes.
    pub(super) time: f64,
    pub(super) known: &'s Known,
}

/// What prims say anything of, so that nobody asks the composition for what none of its layers has.
#[derive(Default)]
pub(super) struct Known(RefCell<HashMap<Path, Rc<HashSet<String>>>>);

/// How many prims are known.
const KNOWN: usize = 256;

impl Reader<'_> {
    /// Does a prim say anything of a property?
    fn has(&self, prim: &Path, name: &str) -> bool {
        if let Some(names) = self.known.0.borrow().get(prim) {
            return names.contains(name);
        }
        let names = self.stage.prim(prim.clone()).property_names();
        let names = names.unwrap_or_default();
        let names: HashSet<String> = names.iter().map(|n| n.as_str().to_owned()).collect();
        let is_there = names.contains(name);
        let mut known = self.known.0.borrow_mut();
        if known.len() >= KNOWN {
            known.clear();
        }
        known.insert(prim.clone(), Rc::new(names));
        is_there
    }

    /// The path of a property that a prim says anything of. Others are not asked for: it takes the composition long, and with
    /// text that is no name, without end.
    fn property(&self, prim: &Path, name: &str) -> Option<Path> {
        if !self.has(prim, name) {
            return None;
        }
        prim.append_property(name).ok()
    }

    /// The value of an attribute of a prim; none if it has none.
    pub(super) fn value(&self, prim: &Path, name: &str) -> Result<Option<Value>, String> {
        let Some(path) = self.property(prim, name) else {
            return Ok(None);
        };
        let attribute = self.stage.attribute(path);
        let value = attribute.get_at::<Value>(Some(TimeCode::new(self.time)));
        let value = value.map_err(|e| format!("`{prim}.{name}` cannot be read: {e:#}"))?;
        Ok(value.filter(|v| !matches!(v, Value::None | Value::ValueBlock)))
    }

    /// Is the value another at other times?
    pub(super) fn varies(&self, prim: &Path, name: &str) -> bool {
        self.property(prim, name).is_some_and(|path| {
            self.stage
                .value_might_be_time_varying(path)
                .unwrap_or(false)
        })
    }

    /// Where an attribute has samples, in time codes.
    pub(super) fn times(&self, prim: &Path, name: &str) -> Vec<f64> {
        let path = self.property(prim, name);
        let times = path.and_then(|path| self.stage.time_sample_times(path).ok().flatten());
        times.unwrap_or_default()
    }

    pub(super) fn number(&self, prim: &Path, name: &str, default: f64) -> Result<f64, String> {
        let value = self.value(prim, name)?.as_ref().and_then(number);
        Ok(value.filter(|v| v.is_finite()).unwrap_or(default))
    }

    pub(super) fn token(&self, prim: &Path, name: &str) -> Result<Option<String>, String> {
        Ok(self.value(prim, name)?.as_ref().and_then(text))
    }

    pub(super) fn flag(&self, prim: &Path, name: &str, default: bool) -> Result<bool, String> {
        Ok(match self.value(prim, name)? {
            Some(Value::Bool(flag)) => flag,
            _ => default,
        })
    }

    /// A list of whole numbers, of which none is below 0.
    pub(super) fn counts(&self, prim: &Path, name: &str) -> Result<Option<Vec<u32>>, String> {
        let Some(value) = self.value(prim, name)? else {
            return Ok(None);
        };
        let wrong = || format!("`{prim}.{name}` has a number below 0, or one that is too large");
        let all: Option<Vec<u32>> = match value {
            Value::IntVec(all) => all.into_iter().map(|i| i.try_into().ok()).collect(),
            Value::UintVec(all) => Some(all),
            Value::Int64Vec(all) => all.into_iter().map(|i| i.try_into().ok()).collect(),
            other => {
                return Err(format!(
                    "`{prim}.{name}` is no list of whole numbers, but {}",
                    kind(&other)
                ));
            }
        };
        all.map(Some).ok_or_else(wrong)
    }

    pub(super) fn vectors(&self, prim: &Path, name: &str) -> Result<Option<Vec<Vec3>>, String> {
        self.value(prim, name)?
            .map(|value| {
                let what = kind(&value);
                vectors(value).ok_or_else(|| {
                    format!("`{prim}.{name}` is no list of three numbers each, but {what}")
                })
            })
            .transpose()
    }

    /// The targets of a relationship.
    pub(super) fn targets(&self, prim: &Path, name: &str) -> Result<Vec<Path>, String> {
        let Some(path) = self.property(prim, name) else {
            return Ok(Vec::new());
        };
        let targets = self.stage.relationship(path).forwarded_targets();
        targets.map_err(|e| format!("`{prim}.{name}` cannot be read: {e:#}"))
    }

    /// A field of an attribute that is a word.
    pub(super) fn field(&self, prim: &Path, name: &str, field: &str) -> Option<String> {
        let path = self.property(prim, name)?;
        let value = self.stage.attribute(path).get_metadata::<Value>(field);
        value.ok().flatten().as_ref().and_then(text)
    }
}

/// What a value is, for messages.
pub(super) fn kind(value: &Value) -> String {
    let all = format!("{value:?}");
    let end = all
        .find(|c: char| !c.is_ascii_alphanumeric())
        .unwrap_or(all.len());
    format!("`{}`", &all[..end])
}

pub(super) fn number(value: &Value) -> Option<f64> {
    Some(match value {
        Value::Half(x) => f64::from(x.to_f32()),
        Value::Float(x) => f64::from(*x),
        Value::Double(x) => *x,
        Value::Int(x) => f64::from(*x),
        Value::Uint(x) => f64::from(*x),
        Value::Int64(x) => *x as f64,
        Value::Uint64(x) => *x as f64,
        Value::Bool(x) => f64::from(u8::from(*x)),
        Value::TimeCode(x) => x.0,
        _ => return None,
    })
}

pub(super) fn text(value: &Value) -> Option<String> {
    match value {
        Value::Token(text) => Some(text.as_str().to_owned()),
        Value::String(text) => Some(text.clone()),
        _ => None,
    }
}

/// The components of a number, vector or color.
pub(super) fn components(value: &Value) -> Option<Vec<f64>> {
    if let Some(one) = number(value) {
        return Some(vec![one]);
    }
    Some(match value {
        Value::Vec2h(v) => vec![v.x.to_f64(), v.y.to_f64()],
        Value::Vec2f(v) => vec![v.x.into(), v.y.into()],
        Value::Vec2d(v) => vec![v.x, v.y],
        Value::Vec2i(v) => vec![v.x.into(), v.y.into()],
        Value::Vec3h(v) => vec![v.x.to_f64(), v.y.to_f64(), v.z.to_f64()],
        Value::Vec3f(v) => vec![v.x.into(), v.y.into(), v.z.into()],
        Value::Vec3d(v) => vec![v.x, v.y, v.z],
        Value::Vec3i(v) => vec![v.x.into(), v.y.into(), v.z.into()],
        Value::Vec4h(v) => vec![v.x.to_f64(), v.y.to_f64(), v.z.to_f64(), v.w.to_f64()],
        Value::Vec4f(v) => vec![v.x.into(), v.y.into(), v.z.into(), v.w.into()],
        Value::Vec4d(v) => vec![v.x, v.y, v.z, v.w],
        Value::Vec4i(v) => vec![v.x.into(), v.y.into(), v.z.into(), v.w.into()],
        Value::Matrix3d(m) => m.0.to_vec(),
        Value::Matrix4d(m) => m.0.to_vec(),
        _ => return None,
    })
}

pub(super) fn vector(value: &Value) -> Option<DVec3> {
    match components(value)?[..] {
        [x, y, z] => Some(DVec3::new(x, y, z)),
        _ => None,
    }
}

pub(super) fn vectors(value: Value) -> Option<Vec<Vec3>> {
    Some(match value {
        Value::Vec3fVec(all) => all.iter().map(|v| Vec3::new(v.x, v.y, v.z)).collect(),
        Value::Vec3dVec(all) => all
            .iter()
            .map(|v| DVec3::new(v.x, v.y, v.z).as_vec3())
            .collect(),
        Value::Vec3hVec(all) => {
            let each = all
                .iter()
                .map(|v| Vec3::new(v.x.to_f32(), v.y.to_f32(), v.z.to_f32()));
            each.collect()
        }
        other => vec![vector(&other)?.as_vec3()],
    })
}

pub(super) fn pairs(value: Value) -> Option<Vec<Vec2>> {
    Some(match value {
        Value::Vec2fVec(all) => all.iter().map(|v| Vec2::new(v.x, v.y)).collect(),
        Value::Vec2dVec(all) => all
            .iter()
            .map(|v| Vec2::new(v.x as f32, v.y as f32))
            .collect(),
        Value::Vec2hVec(all) => all
            .iter()
            .map(|v| Vec2::new(v.x.to_f32(), v.y.to_f32()))
            .collect(),
        other => match components(&other)?[..] {
            [x, y] => vec![Vec2::new(x as f32, y as f32)],
            _ => return None,
        },
    })
}

pub(super) fn floats(value: Value) -> Option<Vec<f32>> {
    Some(match value {
        Value::FloatVec(all) => all,
        Value::DoubleVec(all) => all.into_iter().map(|x| x as f32).collect(),
        Value::HalfVec(all) => all.into_iter().map(|x| x.to_f32()).collect(),
        other => vec![number(&other)? as f32],
    })
}

pub(super) fn rotations(value: Value) -> Option<Vec<DQuat>> {
    let made = |x: f64, y: f64, z: f64, w: f64| {
        let turn = DQuat::from_xyzw(x, y, z, w);
        if turn.length_squared() > 0.0 {
            turn.normalize()
        } else {
            DQuat::IDENTITY
        }
    };
    Some(match value {
        Value::QuathVec(all) => {
            let each = all
                .iter()
                .map(|q| made(q.x.to_f64(), q.y.to_f64(), q.z.to_f64(), q.w.to_f64()));
            each.collect()
        }
        Value::QuatfVec(all) => {
            let each = all
                .iter()
                .map(|q| made(q.x.into(), q.y.into(), q.z.into(), q.w.into()));
            each.collect()
        }
        Value::QuatdVec(all) => all.iter().map(|q| made(q.x, q.y, q.z, q.w)).collect(),
        Value::Quath(q) => vec![made(q.x.to_f64(), q.y.to_f64(), q.z.to_f64(), q.w.to_f64())],
        Value::Quatf(q) => vec![made(q.x.into(), q.y.into(), q.z.into(), q.w.into())],
        Value::Quatd(q) => vec![made(q.x, q.y, q.z, q.w)],
        _ => return None,
    })
}

/// A matrix: USD multiplies rows from the left, so its rows are columns here.
pub(super) fn matrix(value: &Value) -> Option<DMat4> {
    match value {
        Value::Matrix4d(m) => Some(DMat4::from_cols_array(&m.0)),
        _ => None,
    }
}

pub(super) fn matrices(value: Value) -> Option<Vec<DMat4>> {
    match value {
        Value::Matrix4dVec(all) => Some(all.iter().map(|m| DMat4::from_cols_array(&m.0)).collect()),
        _ => None,
    }
}
