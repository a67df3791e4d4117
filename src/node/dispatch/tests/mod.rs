//! What one relay does on its own: what it is handed, and what it says of it.

mod fixture;
mod offers;
mod telling;
