//! Cost of converting positions between mission and earth coordinates in f64, which this core lacks.

use core::hint::black_box;

use cortex_m_semihosting::hprintln;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement, Sites};

use super::counter::instructions;

/// Measures the instructions for the line from Tx to Rx on earth.
///
/// Measured are the creation of the line, and the conversion of a position to latitude and longitude and back.
#[inline(never)]
pub(crate) fn flight() {
    let site = Geodetic::from_degrees;
    let (Some(tx), Some(rx)) = (site(47.40, 8.54, 420.0), site(47.41, 8.55, 431.0)) else {
        return;
    };
    let mut axis = None;
    let sites = black_box(Sites { tx, rx });
    let line = instructions(|| axis = Axis::between(sites).ok());
    let Some(axis) = axis else { return };
    let place = black_box(Placement {
        x_m: 700.0,
        y_m: 30.0,
        altitude_m: 60.0,
    });
    let mut point = None;
    let to_earth = instructions(|| point = axis.point(place));
    let Some(point) = black_box(point) else {
        return;
    };
    let from_earth = instructions(|| axis.place(point));
    hprintln!("line {}", line);
    hprintln!("to_earth {}", to_earth);
    hprintln!("from_earth {}", from_earth);
}
