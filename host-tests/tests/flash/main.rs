//! What a drone keeps in its flash: the epoch of its frames, the missions that were uploaded, and what it has said in votes.

mod epoch;
mod journal;
mod uploads;
mod views;
