//! Where prims are: `xformOpOrder` and the operations that it names.

use glam::{DMat4, DQuat, DVec3};
use openusd::sdf::{Path, Value};

use super::values::{self, Reader};

const RESET: &str = "!resetXformStack!";
const INVERSE: &str = "!invert!";
const PREFIX: &str = "xformOp:";

/// Where a prim is in its parent.
pub(super) struct Local {
    pub(super) matrix: DMat4,
    /// Does it leave its parents where they are?
    pub(super) resets: bool,
    pub(super) varies: bool,
}

impl Reader<'_> {
    /// Where a prim is in its parent, or in the world if it says so.
    pub(super) fn local(&self, prim: &Path) -> Result<Local, String> {
        let mut local = Local {
            matrix: DMat4::IDENTITY,
            resets: false,
            varies: false,
        };
        for operation in self.order(prim)? {
            if operation == RESET {
                local = Local {
                    matrix: DMat4::IDENTITY,
                    resets: true,
                    varies: false,
                };
                continue;
            }
            let (name, is_inverse) = match operation.strip_prefix(INVERSE) {
                Some(name) => (name, true),
                None => (operation.as_str(), false),
            };
            let Some(value) = self.value(prim, name)? else {
                continue;
            };
            let matrix = operated(name, &value).ok_or_else(|| {
                format!(
                    "`{prim}.{name}` is no operation that moves a prim: it is {}",
                    values::kind(&value)
                )
            })?;
            let matrix = if is_inverse {
                let is_flat = matrix.determinant() == 0.0;
                if is_flat {
                    return Err(format!(
                        "`{prim}` asks for the inverse of `{name}`, which is flat"
                    ));
                }
                matrix.inverse()
            } else {
                matrix
            };
            local.matrix *= matrix;
            local.varies |= self.varies(prim, name);
        }
        if !local.matrix.is_finite() {
            return Err(format!("the place of `{prim}` is no number"));
        }
        Ok(local)
    }

    /// The times at which a prim is said to be somewhere.
    pub(super) fn local_times(&self, prim: &Path) -> Vec<f64> {
        let order = self.order(prim).unwrap_or_default();
        let names = order
            .iter()
            .map(|name| name.strip_prefix(INVERSE).unwrap_or(name));
        names.flat_map(|name| self.times(prim, name)).collect()
    }

    fn order(&self, prim: &Path) -> Result<Vec<String>, String> {
        Ok(match self.value(prim, "xformOpOrder")? {
            Some(Value::TokenVec(order)) => order.iter().map(|t| t.as_str().to_owned()).collect(),
            Some(Value::StringVec(order)) => order,
            _ => Vec::new(),
        })
    }
}

/// The matrix of an operation.
fn operated(name: &str, value: &Value) -> Option<DMat4> {
    let kind = name.strip_prefix(PREFIX)?.split(':').next()?;
    let vector = || values::vector(value);
    let one = || values::number(value);
    let turn = |axis, degrees: f64| DMat4::from_axis_angle(axis, degrees.to_radians());
    Some(match kind {
        "translate" => DMat4::from_translation(vector()?),
        "translateX" => DMat4::from_translation(DVec3::X * one()?),
        "translateY" => DMat4::from_translation(DVec3::Y * one()?),
        "translateZ" => DMat4::from_translation(DVec3::Z * one()?),
        "scale" => DMat4::from_scale(vector()?),
        "scaleX" => DMat4::from_scale(DVec3::new(one()?, 1.0, 1.0)),
        "scaleY" => DMat4::from_scale(DVec3::new(1.0, one()?, 1.0)),
        "scaleZ" => DMat4::from_scale(DVec3::new(1.0, 1.0, one()?)),
        "rotateX" => turn(DVec3::X, one()?),
        "rotateY" => turn(DVec3::Y, one()?),
        "rotateZ" => turn(DVec3::Z, one()?),
        "orient" => {
            let turn: DQuat = values::rotations(value.clone())?.first().copied()?;
            DMat4::from_quat(turn)
        }
        "transform" => values::matrix(value)?,
        // The first axis turns first.
        _ => {
            let axes = kind.strip_prefix("rotate").filter(|axes| axes.len() == 3)?;
            let degrees = vector()?;
            axes.chars().try_fold(DMat4::IDENTITY, |all, axis| {
                let one = match axis {
                    'X' => turn(DVec3::X, degrees.x),
                    'Y' => turn(DVec3::Y, degrees.y),
                    'Z' => turn(DVec3::Z, degrees.z),
                    _ => return None,
                };
                Some(one * all)
            })?
        }
    })
}
