//! What a drone keeps in its flash: the epoch of its frames, and the missions that were uploaded.

mod epoch;
mod uploads;
