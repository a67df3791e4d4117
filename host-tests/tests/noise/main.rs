//! Receiver noise: SINR in place of SIR, compared with references. `COUNT` and `SEED` select chains or scenes.

mod chains;
mod field;
mod reach;
mod space;
