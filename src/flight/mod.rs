//! Flight: positions on earth, and the link to the autopilot.
//!
//! | module | subject |
//! | --- | --- |
//! | [`axis`] | the line from transmitter to receiver on earth, and positions relative to it |
//! | [`course`] | that line for a mission, and the speed limit |
//! | `mavlink` | MAVLink 2 messages |
//! | [`autopilot`] | targets for the autopilot, control given by the pilot, and the drone's position |
//!
//! ```
//! use uav_relay::Placement;
//! use uav_relay::flight::axis::Axis;
//! use uav_relay::Geodetic;
//!
//! let tx = Geodetic::from_degrees(47.40, 8.54, 420.0).ok_or("not on earth")?;
//! let rx = Geodetic::from_degrees(47.41, 8.55, 431.0).ok_or("not on earth")?;
//! let axis = Axis::try_new(tx, rx)?;
//! assert!(axis.is_of(1343.795));
//!
//! // 20 m above the straight line between the two sites' grounds, 300 m from the transmitter.
//! let point = axis.point(Placement::on_line(300.0, 20.0)).ok_or("far off")?;
//! assert_eq!(point.amsl_mm, 442_456);
//! let back = axis.place(point).ok_or("far off")?;
//! assert!((back.x_m - 300.0).abs() < 0.02 && back.y_m.abs() < 0.02);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

pub mod autopilot;
pub mod axis;
pub mod course;
#[cfg(not(feature = "internals"))]
pub(crate) mod mavlink;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod mavlink;
