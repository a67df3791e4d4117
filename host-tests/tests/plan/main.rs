//! `cargo plan`: what it prints, and random scenarios against judges that share nothing with the crate.

mod joint;

mod random;
