//! Ranges of numbers in messages.

pub(super) fn is_count(relays: u16) -> bool {
    (1..=1000).contains(&relays)
}

/// Returns true if a node may propose `view`: node number in the low ten bits, view number above.
pub(super) fn is_proposed(view: u32) -> bool {
    (1..=1000).contains(&(view % 1024)) && view >= 1024
}

pub(super) fn is_altitude(altitude_m: f32) -> bool {
    (0.1..=1e5).contains(&altitude_m)
}

pub(super) fn is_power(power_w: f32) -> bool {
    (1e-6..=1e6).contains(&power_w)
}

pub(super) fn is_place(x_m: f32) -> bool {
    (0.0..=1e6).contains(&x_m)
}

pub(super) fn is_beside(y_m: f32) -> bool {
    (-1e5..=1e5).contains(&y_m)
}

pub(super) fn is_sir(sir: f32) -> bool {
    (0.0..f32::INFINITY).contains(&sir)
}
