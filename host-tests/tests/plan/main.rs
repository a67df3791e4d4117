//! `cargo plan`: its output, and random scenarios compared with independent references.

mod joint;

mod random;
