//! Log lines for the reasons that keep a drone from its setpoint.

use serde_json::json;
use uav_relay::HoldReason;
use uav_relay::{Duration, Instant, Relay, Side};

use uav_relay_linux::log::Log;

/// Minimum duration of a wait for a neighbour before it is logged.
///
/// Shorter waits are normal while the relays agree on new positions.
const SETTLES: Duration = Duration::from_millis(3_000);

const SIDES: [Side; 2] = [Side::Upstream, Side::Downstream];

/// Returns the reasons why the drone waits for its upstream and for its downstream neighbour.
pub(crate) fn reasons(relay: &Relay) -> [Option<HoldReason>; 2] {
    SIDES.map(|side| relay.hold_reason(side))
}

/// Reasons why the drone waits for its neighbours: those logged, and the newest ones (maybe brief).
#[derive(Debug, Default)]
pub(crate) struct HoldReasonLog {
    logged: [Option<HoldReason>; 2],
    newest: [Option<HoldReason>; 2],
    since: Instant,
}

impl HoldReasonLog {
    /// Logs the reasons for waiting if they have changed, once they have lasted for [`SETTLES`].
    ///
    /// Returns the time at which changed reasons will have lasted that long, if any.
    pub(crate) fn tend(
        &mut self,
        now: Instant,
        log: &Log,
        relay: &Relay,
        name: impl Fn(u16) -> String,
    ) -> Option<Instant> {
        let reasons = reasons(relay);
        if reasons != self.newest {
            (self.newest, self.since) = (reasons, now);
        }
        if reasons == self.logged {
            return None;
        }
        let due = self.since + SETTLES;
        if now < due {
            return Some(due);
        }
        let neighbours = relay.neighbours();
        for (at, (reason, logged)) in reasons.into_iter().zip(self.logged).enumerate() {
            if reason == logged {
                continue;
            }
            let node = neighbours.get(at).copied().flatten();
            let whom = node.map_or_else(|| "its neighbour".to_owned(), &name);
            let fields = json!({ "node": node, "reason": reason.map(word) });
            let text = match reason {
                Some(reason) => {
                    format!("this drone holds its position: {}", describe(reason, &whom))
                }
                None => format!("this drone no longer waits for {whom}"),
            };
            log.event(now, "waits", fields, text);
        }
        self.logged = reasons;
        None
    }
}

pub(crate) const fn word(reason: HoldReason) -> &'static str {
    match reason {
        HoldReason::Unheard => "unheard",
        HoldReason::Order => "order",
        HoldReason::Close => "close",
        HoldReason::Lost => "lost",
        HoldReason::NotFlown => "not_flown",
        HoldReason::Pending => "pending",
        HoldReason::Halted => "halted",
    }
}

fn describe(reason: HoldReason, whom: &str) -> String {
    match reason {
        HoldReason::Unheard => {
            format!(
                "{whom} is not under setpoint control, or its position has not been received yet"
            )
        }
        HoldReason::Order => format!(
            "this drone is on the wrong side of {whom} along the line from Tx to Rx, or too close to it to tell the side: fly one of the two drones by hand until they are in the order of their numbers"
        ),
        HoldReason::Close => {
            format!("this drone's agreed position is too close to the present position of {whom}")
        }
        HoldReason::Lost => {
            format!(
                "the drone of a lost relay may still hover between this drone and {whom}: when it has landed, send the command `clear-lost` with the number of the lost relay"
            )
        }
        HoldReason::NotFlown => {
            format!(
                "{whom} is in the way, and not under setpoint control: its pilot has to move it or to choose OFFBOARD or GUIDED"
            )
        }
        HoldReason::Pending => {
            format!("{whom} has not yet left the space into which this drone has to move")
        }
        HoldReason::Halted => {
            format!(
                "a relay beyond {whom} is, or may be, on the wrong side of its own neighbour: see the log of that relay"
            )
        }
    }
}
