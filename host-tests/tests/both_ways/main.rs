//! Both directions of a chain: relays placed for the way there and the way back.

mod flown;
mod judge;
mod placed;
mod refused;
mod scenes;
mod space;
mod space_judge;
mod unchanged;
