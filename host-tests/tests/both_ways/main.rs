//! Both directions of a chain: relays placed for the way there and the way back.

mod field;
mod flown;
mod judge;
mod placed;
mod profiles;
mod refused;
mod scenes;
mod sensing;
mod several;
mod shares;
mod space;
mod space_judge;
mod turns;
mod unchanged;
