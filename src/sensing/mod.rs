//! The interferer that nobody told of, found from how much interference each relay hears where it is.
//!
//! One source of `P` watts at (X, Y, 0) is heard at (x, y, h) with I = P / (eta s), s = (X - x)^2 + (Y - y)^2 + h^2, by the paper's
//! own path loss. So 1 / I is *linear* in what is not known. In units of half the distance, u = 2 x / D - 1, t = 2 y / D, z = 2 h / D, and of
//! 1e-12 W, v = 1e-12 W / I:
//!
//! ```text
//! v = k (q + X'^2 + Y'^2 + 1/3) - 2 k X' u - 2 k Y' t,    q = u^2 - 1/3 + t^2 + z^2,    k = 1e-12 W eta D^2 / (4 P)
//! ```
//!
//! with X' = 2 X / D - 1 and Y' = 2 Y / D. The four terms 1, u, q and t are Legendre's along the line, which keeps their sums well
//! conditioned in an f32.
//!
//! | file | one idea |
//! | --- | --- |
//! | `terms` | the four terms of a place, and the coefficients of a source |
//! | `sums` | what a pass adds up along the chain |
//! | `listener` | what one relay has heard, place by place, and how it fades |
//! | `level` | what the transmitter and the receiver hear, on the ground |
//! | `factor` | a 4 x 4 system, solved |
//! | `fit` | the source that the sums speak of, or the one nearest to them, how sure that is, and when none does |
//! | [`belief`] | what the chain flies by, and when another fit takes its place |
//! | `track` | the velocity of an interferer that moves |
//! | `doubt` | the relay whose measurements do not fit those of the others |
//! | `ends` | the same of the transmitter's and the receiver's |
//!
//! Errors of measured powers are taken to be *relative*: the mean of K independent samples is off by 1 / sqrt(K), and a place has a share of its
//! own (shadowing). So each place counts once, with the weight 1 / v^2, however long a relay hovers there. How good all this is:
//! `host-tests/tests/sensing/`.

pub mod belief;
pub(crate) mod doubt;
mod ends;
mod factor;
#[cfg(not(feature = "internals"))]
pub(crate) mod fit;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod fit;
#[cfg(not(feature = "internals"))]
pub(crate) mod level;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod level;
pub(crate) mod listener;
#[cfg(not(feature = "internals"))]
pub(crate) mod sums;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod sums;
pub(crate) mod terms;
pub(crate) mod track;

pub use fit::Unfit;
