//! The sets of kernels that a session has, and which of them renders.

use super::super::built::Built;
use super::super::course::Speed;

/// Which kernels render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// Open ones of the processor, until a GPU's driver has made those for it.
    StandIn,
    Open,
    Final,
}

/// Sets of kernels.
pub(super) struct Sets<'d> {
    pub turn: Turn,
    pub stand_in: Option<Built<'d>>,
    pub open: Option<Built<'d>>,
    pub last: Option<Built<'d>>,
    /// How fast the device renders, and the one that stands in.
    speeds: [Speed; 2],
}

impl<'d> Sets<'d> {
    /// None yet, for a device that is a GPU of its own or not.
    pub(super) fn new(is_fast: bool) -> Self {
        Self {
            turn: Turn::Open,
            stand_in: None,
            open: None,
            last: None,
            speeds: [Speed::assumed(is_fast), Speed::assumed(false)],
        }
    }

    /// The kernels that render.
    pub(super) fn active(&self) -> Option<&Built<'d>> {
        match self.turn {
            Turn::StandIn => self.stand_in.as_ref(),
            Turn::Open => self.open.as_ref(),
            Turn::Final => self.last.as_ref(),
        }
    }

    /// The same, to be changed.
    pub(super) fn active_mut(&mut self) -> Option<&mut Built<'d>> {
        match self.turn {
            Turn::StandIn => self.stand_in.as_mut(),
            Turn::Open => self.open.as_mut(),
            Turn::Final => self.last.as_mut(),
        }
    }

    /// How fast those are that render.
    pub(super) fn speed(&self) -> &Speed {
        &self.speeds[usize::from(self.turn == Turn::StandIn)]
    }

    pub(super) fn speed_mut(&mut self) -> &mut Speed {
        &mut self.speeds[usize::from(self.turn == Turn::StandIn)]
    }
}
