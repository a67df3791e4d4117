//! Battery of the drone: departure when it is low, way out, and command to return.
//!
//! | departure | action |
//! | --- | --- |
//! | requested | a text to the pilot |
//! | free | fly to the place beside the line (`--exit`), if any; the library sends the text "battery: leave now" |
//! | free, there or without such a place, under setpoint control | with `--return rtl`: one command to return; the pilot's choice of a mode ends it |
//!
//! The companion never arms, takes off or lands.

use serde_json::{Value, json};
use uav_relay::{Departure, Instant, Placement, Relay};

use crate::autopilot::Companion;
use crate::status::at;
use uav_relay_linux::log::Log;

/// Maximum distance from the place beside the line at which the drone has arrived, m.
const NEAR_M: f32 = 2.0;

/// Permitted behaviour of a drone that may leave.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BatteryPlan {
    /// Distance of the place beside the line from the drone's place, m; `None` to hold.
    ///
    /// It is positive to the right of the line.
    pub(crate) exit_m: Option<f32>,
    /// True if the companion may command the autopilot to return.
    pub(crate) returns: bool,
}

/// State of the departure, as logged.
#[derive(Debug)]
pub(crate) struct Battery {
    plan: BatteryPlan,
    departure: Departure,
    exit: Option<Placement>,
    has_returned: bool,
}

impl Battery {
    pub(crate) const fn new(plan: BatteryPlan) -> Self {
        Self {
            plan,
            departure: Departure::Member,
            exit: None,
            has_returned: false,
        }
    }

    /// Follows the relay's departure: logs it, and flies `drone` to its place beside the line and home.
    pub(crate) fn tend(
        &mut self,
        now: Instant,
        log: &Log,
        relay: &Relay,
        autopilot: Option<&mut Companion>,
        drone: Option<Placement>,
    ) {
        let departure = relay.departure(now);
        let before = std::mem::replace(&mut self.departure, departure);
        let mut autopilot = autopilot;
        if departure != before {
            log.event(
                now,
                "departure",
                self.status(relay, now),
                describe(departure),
            );
            let is_asked = matches!(before, Departure::Member | Departure::Spare)
                && !matches!(departure, Departure::Member | Departure::Spare);
            if let Some(autopilot) = autopilot.as_deref_mut().filter(|_| is_asked) {
                autopilot.send_text("battery: low, asks to leave the chain");
            }
        }
        let Some(autopilot) = autopilot else {
            return;
        };
        if departure != Departure::Free {
            if self.exit.take().is_some() {
                autopilot.set_exit(None);
            }
            self.has_returned = false;
            return;
        }
        if let (None, Some(exit_m), Some(place)) = (self.exit, self.plan.exit_m, relay.setpoint()) {
            let exit = Placement {
                y_m: place.y_m + exit_m,
                ..place
            };
            self.exit = Some(exit);
            autopilot.set_exit(self.exit);
            let text = format_args!(
                "flies to its place beside the line: x {:.1} m, y {:.1} m, altitude {:.1} m",
                exit.x_m, exit.y_m, exit.altitude_m
            );
            log.event(now, "exit", at(exit), text);
        }
        let is_clear = match (self.plan.exit_m, self.exit, drone) {
            (None, ..) => true,
            (Some(_), Some(exit), Some(drone)) => {
                let off = [
                    drone.x_m - exit.x_m,
                    drone.y_m - exit.y_m,
                    drone.altitude_m - exit.altitude_m,
                ];
                off.into_iter().all(|off_m| off_m.abs() <= NEAR_M)
            }
            _ => false,
        };
        let may_return = self.plan.returns && !self.has_returned;
        if may_return && is_clear && autopilot.return_home(now) {
            self.has_returned = true;
            let text = "commands the autopilot to return (RTL), as --return rtl allows";
            log.line(now, "return", text);
        }
    }

    /// Returns the endurance and the departure as JSON.
    pub(crate) fn status(&self, relay: &Relay, now: Instant) -> Value {
        json!({
            "departure": word(self.departure),
            "endurance_s": relay.endurance_s(now),
            "leaves_below_s": relay.endurance_limit_s(),
            "exit": self.exit.map(at),
            "returns": self.has_returned,
        })
    }
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
            "this relay asks to leave and is refused: without --positions or --autopilot its neighbours would fly close to it"
        }
        Departure::NeedsChannel => {
            "this relay asks to leave and is refused: over --upstream and --downstream its neighbours do not receive each other, use --shared"
        }
        Departure::NeedsQuorum => {
            "this relay asks to leave and is refused for now: the remaining relays would have no quorum"
        }
        Departure::WideGap => {
            "this relay asks to leave and is refused for now: the numbers of its neighbours differ by more than four"
        }
        Departure::Blocked => {
            "this relay asks to leave and is refused for a minute: its neighbours do not receive each other"
        }
        Departure::Spare => {
            "this relay waits outside of the chain as a spare, until the leader calls it"
        }
        Departure::Outside => {
            "this relay is outside of the chain and holds its position until the others have closed up"
        }
        Departure::Free => "this drone may fly away; its relay has no place in the chain",
        _ => "the departure has another state",
    }
}
