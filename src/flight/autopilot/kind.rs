//! Kind of autopilot: PX4 or ArduCopter.

/// Values of `MAV_TYPE` for vehicles that hover under ArduCopter. With other vehicles the same mode numbers have other meanings.
const COPTERS: [u8; 9] = [2, 3, 4, 13, 14, 15, 29, 35, 43];

/// Kind of autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// PX4: OFFBOARD grants control, for as long as targets are streamed.
    Px4,
    /// ArduCopter: GUIDED grants control, and a target holds for good.
    ArduCopter,
}

impl Kind {
    /// Returns the kind for these values of `MAV_AUTOPILOT` and `MAV_TYPE`.
    pub(super) fn of(autopilot: u8, vehicle: u8) -> Option<Self> {
        match autopilot {
            12 => Some(Self::Px4),
            3 if COPTERS.contains(&vehicle) => Some(Self::ArduCopter),
            _ => None,
        }
    }
}
