//! Battery of the drone: logs the departure, sends texts to the pilot, and delays a start in flight.
//!
//! | departure | text to the pilot |
//! | --- | --- |
//! | requested, outside of the chain, free, or a member again | once |
//! | refused | every minute in flight |
//! | free, or at the reserve | "battery: leave now" every 5 s until he takes over, by the library |
//!
//! The drone keeps its setpoint; its pilot flies it home. The companion never changes the mode.

use serde_json::{Value, json};
use uav_relay::flight::autopilot::state::State;
use uav_relay::{Departure, Duration, Instant, Relay};

use crate::autopilot::Companion;
use crate::lost::log_command;
use uav_relay_linux::log::Log;

/// Beginning of the texts to the pilot if the relay leaves because of its battery.
const LOW: &str = "battery: low, ";

/// Time between two texts to the pilot about the same refused departure from the chain.
const AGAIN: Duration = Duration::from_millis(60_000);

/// Minimum time between two log lines about a departure from the chain that is not granted yet.
const LOGGED: Duration = Duration::from_millis(10_000);

/// Maximum wait of a starting relay for its drone's endurance (remaining flight time).
const FIRST: Duration = Duration::from_millis(10_000);
/// Maximum time from a starting relay's first low endurance to the confirmation of its departure.
const CONFIRMED: Duration = Duration::from_millis(20_000);

/// State of the relay's departure from the chain because of its battery, as last logged.
#[derive(Debug)]
pub(crate) struct Battery {
    departure: Departure,
    logged_at: Instant,
    told_at: Instant,
    /// True while the starting relay waits for its drone's endurance (remaining flight time).
    waits: bool,
    /// Time of the first endurance below the limit for leaving the chain, during the wait at the start.
    low_at: Option<Instant>,
    has_reserve: bool,
    /// Last time at which the drone's endurance (remaining flight time) was known, or not needed.
    ///
    /// The endurance is not needed on the ground, nor after the relay was informed that the endurance is unknown.
    known_at: Instant,
}

impl Battery {
    /// Creates the state at the start. With `has_reserve` (option `--reserve`) the relay waits for its endurance.
    pub(crate) const fn new(has_reserve: bool) -> Self {
        Self {
            departure: Departure::Member,
            logged_at: Instant::ZERO,
            told_at: Instant::ZERO,
            waits: has_reserve,
            low_at: None,
            has_reserve,
            known_at: Instant::ZERO,
        }
    }

    /// Returns true while a starting relay waits for its drone's endurance (remaining flight time).
    ///
    /// A relay that restarts with a low battery thereby leaves the chain before it takes part in an agreement.
    pub(crate) fn waits(&mut self, now: Instant, relay: &Relay, link: Option<&Companion>) -> bool {
        let left_s = relay.endurance_s(now);
        if left_s.is_some() && left_s < relay.endurance_limit_s() {
            self.low_at = self.low_at.or(Some(now));
        }
        let is_inside = matches!(relay.departure(now), Departure::Member | Departure::Spare);
        let is_open = match self.low_at {
            Some(at) => is_inside && now.since(at) < CONFIRMED,
            None => left_s.is_none() && now.since(Instant::ZERO) < FIRST,
        };
        self.waits &= is_open && !link.is_some_and(|link| link.is_landed(now));
        self.waits
    }

    /// Informs the relay that its drone's endurance is unknown, if no endurance was received for 10 s.
    ///
    /// The relay then raises an event. This function does nothing while the autopilot is silent or the drone is on the
    /// ground.
    pub(crate) fn tell_unknown(
        &mut self,
        now: Instant,
        relay: &mut Relay,
        link: Option<&Companion>,
    ) {
        let is_grounded =
            link.is_some_and(|link| matches!(link.control(), State::Silent | State::Grounded));
        if is_grounded || relay.endurance_s(now).is_some() {
            self.known_at = now;
        } else if self.has_reserve && now.since(self.known_at) >= FIRST {
            self.known_at = now;
            relay.handle_endurance(now, f32::NAN, f32::NAN);
        }
    }

    pub(crate) const fn is_waiting(&self) -> bool {
        self.waits
    }

    /// Logs changes of the relay's departure, and sends them to the pilot as text.
    pub(crate) fn tend(
        &mut self,
        now: Instant,
        log: &Log,
        relay: &Relay,
        autopilot: Option<&mut Companion>,
    ) {
        let departure = relay.departure(now);
        let is_flapping = is_pending(departure) && is_pending(self.departure);
        let is_news =
            departure != self.departure && !(is_flapping && now.since(self.logged_at) < LOGGED);
        if is_news {
            self.departure = departure;
            self.logged_at = now;
            let fields = self.status(relay, now);
            log.event(now, "departure", fields, describe(departure));
        }
        let refusal = refusal(departure);
        let is_again = refusal.is_some() && now.since(self.told_at) >= AGAIN;
        if let Some(autopilot) = autopilot
            && !matches!(autopilot.control(), State::Silent | State::Grounded)
            && (is_news || is_again)
        {
            self.told_at = now;
            let text = match departure {
                Departure::Requested => Some("asks others to fill its place"),
                Departure::Outside => Some("waits until its place is filled"),
                Departure::Free => Some("has permission to leave"),
                Departure::Member => Some("is in the chain, or joins it"),
                _ => refusal,
            };
            let why = if relay.leaves_by_endurance() {
                LOW
            } else {
                "relay: "
            };
            if let Some(text) = text {
                autopilot.send_text(&format!("{why}{text}"));
            }
        }
    }

    /// Executes the operator's commands `leave` and `stay`; returns the answer. `None` for other commands.
    pub(crate) fn command(
        now: Instant,
        log: &Log,
        relay: &mut Relay,
        command: &str,
        user: &str,
    ) -> Option<Value> {
        let text = match command.trim() {
            "leave" => {
                relay.leave(now, relay.endurance_s(now));
                "this relay asks to leave the chain, as the operator commands"
            }
            "stay" => {
                relay.stay(now);
                if relay.is_at_reserve() {
                    "this relay stays in the chain, as the operator commands; the battery lasts only for the way home and the reserve: fly the drone home"
                } else if relay.endurance_limit_s().is_some() {
                    "this relay stays in the chain, as the operator commands; it asks again to leave when its remaining time of flight, less the time of the way home, is below half of the present value, and also below the limit at which it usually asks"
                } else {
                    "this relay stays in the chain, as the operator commands"
                }
            }
            _ => return None,
        };
        Some(log_command(
            now,
            log,
            Ok(("commanded", text.to_owned())),
            command,
            user,
        ))
    }

    /// Returns the drone's endurance and the relay's departure as JSON. An unknown value is `null`.
    pub(crate) fn status(&self, relay: &Relay, now: Instant) -> Value {
        json!({
            "departure": word(self.departure),
            "endurance_s": relay.endurance_s(now),
            "leaves_below_s": relay.endurance_limit_s(),
            "endurance_losses": relay.endurance_losses(),
            "at_reserve": relay.is_at_reserve(),
            "must_leave": relay.must_leave(),
        })
    }
}

/// Returns true if the departure has been requested, but not granted yet.
const fn is_pending(departure: Departure) -> bool {
    !matches!(
        departure,
        Departure::Member | Departure::Spare | Departure::Outside | Departure::Free
    )
}

/// Returns the pilot's text for the reason of a refused departure, at most 36 bytes; otherwise `None`.
const fn refusal(departure: Departure) -> Option<&'static str> {
    Some(match departure {
        Departure::NeedsGuard => "may not leave: drones not kept apart",
        Departure::NeedsChannel => "may not leave: needs a shared radio",
        Departure::NeedsQuorum => "may not leave: others lack a quorum",
        Departure::WideGap => "may not leave: too many relays lost",
        Departure::Blocked => "may not leave: neighbours not linked",
        _ => return None,
    })
}

const fn word(departure: Departure) -> &'static str {
    match departure {
        Departure::Member => "member",
        Departure::Requested => "requested",
        Departure::NeedsGuard => "needs guard",
        Departure::NeedsChannel => "needs channel",
        Departure::NeedsQuorum => "needs quorum",
        Departure::WideGap => "wide gap",
        Departure::Blocked => "blocked",
        Departure::Spare => "spare",
        Departure::Outside => "outside",
        Departure::Free => "free",
        _ => "other",
    }
}

const fn describe(departure: Departure) -> &'static str {
    match departure {
        Departure::Member => "this relay is a member of the chain, or joins it",
        Departure::Requested => {
            "this relay asks to leave the chain, and holds its position until the leader's order"
        }
        Departure::NeedsGuard => {
            "this relay asks to leave and is refused: without --positions or --autopilot nothing keeps the drones of its neighbours away from this drone"
        }
        Departure::NeedsChannel => {
            "this relay asks to leave and is refused: over --upstream and --downstream its neighbours do not receive each other, use --shared"
        }
        Departure::NeedsQuorum => {
            "this relay asks to leave and is refused for now: the remaining relays would have no quorum"
        }
        Departure::WideGap => {
            "this relay asks to leave and is refused for now: too many relays beside it are absent: the numbers of its two neighbours differ by more than four, so these could not become neighbours of each other"
        }
        Departure::Blocked => {
            "this relay asks to leave and is refused for a minute: its neighbours do not receive each other"
        }
        Departure::Spare => {
            "this relay waits outside of the chain as a spare, until the leader calls it"
        }
        Departure::Outside => {
            "this relay is outside of the chain and holds its position until the other relays have filled its place"
        }
        Departure::Free => {
            "this drone has permission to leave; its relay has no place in the chain"
        }
        _ => "the relay's departure is in a state that this program does not know",
    }
}

#[cfg(test)]
mod tests {
    use uav_relay::Departure;

    /// Every refusal fits into a STATUSTEXT of 50 characters, so that the autopilot link does not cut it.
    #[test]
    fn refusals_fit_into_the_text_for_the_pilot() {
        for departure in [
            Departure::NeedsGuard,
            Departure::NeedsChannel,
            Departure::NeedsQuorum,
            Departure::WideGap,
            Departure::Blocked,
        ] {
            let text = super::refusal(departure).unwrap();
            let longest = format!("{}{text}", super::LOW);
            assert!(
                longest.len() <= 50,
                "{longest:?} has {} bytes",
                longest.len()
            );
        }
    }
}
