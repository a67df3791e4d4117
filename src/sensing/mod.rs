//! Estimation of an unknown interferer from the interference power that each relay measures.
//!
//! One source of `P` watts at (X, Y, 0) is received at (x, y, h) with I = P / (eta s), s = (X - x)^2 + (Y - y)^2 + h^2, by the
//! paper's path loss. So 1 / I is *linear* in the unknowns. In units of half the distance, u = 2 x / D - 1, t = 2 y / D, z = 2 h
//! / D, and of 1e-12 W, v = 1e-12 W / I:
//!
//! ```text
//! v = k (q + X'^2 + Y'^2 + 1/3) - 2 k X' u - 2 k Y' t,    q = u^2 - 1/3 + t^2 + z^2,    k = 1e-12 W eta D^2 / (4 P)
//! ```
//!
//! with X' = 2 X / D - 1 and Y' = 2 Y / D. The four terms 1, u, q and t are Legendre polynomials along the line, which keeps
//! their sums well conditioned in an f32.
//!
//! | file | content |
//! | --- | --- |
//! | `sums` | the terms of a position; the levels of the transmitter and the receiver; the sums that a pass collects |
//! | `fit` | the source that fits the sums, or the closest one, its uncertainty, and the reasons for no source |
//! | [`belief`] | the chain's interference estimate, and the rules for its replacement; the velocity of a moving interferer |
//! | `doubt` | the relay whose measurements do not fit those of the others; the same for the transmitter and the receiver |
//!
//! Errors of measured powers are assumed to be *relative*: the mean of K independent samples has an error of 1 / sqrt(K), and
//! each position has an error of its own (shadowing). So each position counts once, with the weight 1 / v^2, however long a relay
//! hovers there. Accuracy: `host-tests/tests/sensing/`.

pub mod belief;
pub(crate) mod doubt;
#[cfg(not(feature = "internals"))]
pub(crate) mod fit;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod fit;
#[cfg(not(feature = "internals"))]
pub(crate) mod sums;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod sums;

pub use fit::Unfit;
