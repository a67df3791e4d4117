//! Log lines.

use core::convert::Infallible;

use defmt::{Debug2Format, error, info, warn};
use uav_relay::asynch::{AsyncAutopilot, AsyncRelay};
use uav_relay::flight::autopilot::AutopilotEvent;
use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::autopilot::trust::Mistrust;
use uav_relay::{Event, Relay};
use uav_relay_block::Config;
use uav_relay_chip::reset::Reset;

use crate::drone::Refused;

pub(crate) fn started(reset: Reset) {
    match reset {
        Reset::Watchdog => {
            error!("restarted by the watchdog: the main loop hung, or the clock stopped");
        }
        reset => info!("started: {}", reset.text()),
    }
}

pub(crate) fn begins(config: &Config) {
    info!(
        "relay {} of {}, network {}",
        config.identity.index,
        config.mission.relays(),
        config.identity.network
    );
}

pub(crate) fn unsigned() {
    warn!("no key: frames are not signed, so anybody in range can forge them");
}

/// Logs the signing epoch of this start, and whether it was stored.
pub(crate) fn signs(epoch: u32, is_stored: bool) {
    if is_stored {
        info!(
            "frames are signed; epoch {} (start counter, larger at every start)",
            epoch
        );
    } else {
        error!(
            "frames are signed; epoch {} (start counter): this relay cannot store it, so increase the epoch in the configuration block before every start",
            epoch
        );
    }
}

pub(crate) fn unguarded() {
    warn!(
        "no sites (positions of Tx and Rx on earth): no autopilot is controlled, and drones are not kept apart while they move"
    );
}

/// Logs the length of the line from Tx to Rx, m, and the drone's speed limit, m/s.
pub(crate) fn flies(along_m: f64, speed_m_s: f32) {
    info!(
        "autopilot: {} m from transmitter to receiver, maximum speed {} m/s",
        along_m, speed_m_s
    );
}

pub(crate) fn signs_to_autopilot() {
    info!(
        "frames to the autopilot are signed; frames from the autopilot that are not signed with the same key are ignored"
    );
}

/// Logs that votes on the chain's members were found in flash, and if the relay accepts them.
pub(crate) fn votes_restored(accepted: bool) {
    if accepted {
        info!("votes on the chain's members from before this start were read from flash");
    } else {
        error!(
            "votes on the chain's members in flash were written by another firmware, and are ignored: harmless before a flight; in flight land this drone, because it might vote twice"
        );
    }
}

/// Logs that storing votes on the chain's members works again (true) or fails (false).
pub(crate) fn votes(is_stored: bool) {
    if is_stored {
        info!("votes on the chain's members can be stored in flash again");
    } else {
        error!(
            "votes on the chain's members cannot be stored in flash, and a restart in flight would lose them: land this drone, and check its flash"
        );
    }
}

pub(crate) fn refused(why: Refused) {
    match why {
        Refused::Block(why) => error!(
            "configuration refused: invalid configuration block ({}): provision the drone again",
            Debug2Format(&why)
        ),
        Refused::NoFlash => {
            error!(
                "configuration refused: it has a key, but this board cannot store the epoch (start counter) that signing needs"
            );
        }
        Refused::NoEpoch => {
            error!(
                "frames cannot be signed: the epoch (start counter) has reached its maximum: provision all drones with a new key"
            );
        }
        Refused::NoAutopilot => {
            error!(
                "configuration refused: it has sites (positions of Tx and Rx), but this image has no port to an autopilot"
            );
        }
        Refused::Course(why) => error!("configuration refused: sites: {}", why),
        Refused::Setup(why) => {
            error!(
                "configuration refused: not supported by this image: {}",
                why
            );
        }
    }
}

/// Logs the relay's events and setpoints, and shows the events to the autopilot's operator.
pub(crate) async fn events(
    relay: &AsyncRelay<'_>,
    autopilot: Option<&AsyncAutopilot>,
) -> Infallible {
    loop {
        let event = relay.next_event().await;
        if let Some(autopilot) = autopilot {
            autopilot.handle_event(event);
        }
        info!("{}", event);
        if event == Event::SetpointChanged
            && let Some(place) = relay.look(Relay::setpoint).flatten()
        {
            let bits = [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits);
            info!(
                "setpoint x {} m ({:#010x}) y {} m ({:#010x}) altitude {} m ({:#010x})",
                place.x_m, bits[0], place.y_m, bits[1], place.altitude_m, bits[2]
            );
        }
    }
}

/// Logs the events of the link to the autopilot.
pub(crate) async fn autopilot(link: &AsyncAutopilot) -> Infallible {
    loop {
        let event = link.next_event().await;
        match event {
            AutopilotEvent::Mistrusted(Mistrust::SignsOnly) => info!("autopilot: {}", event),
            AutopilotEvent::Mistrusted(_) => error!("autopilot: {}", event),
            AutopilotEvent::Restarted
            | AutopilotEvent::Refused
            | AutopilotEvent::Released(_)
            | AutopilotEvent::Waits(_)
            | AutopilotEvent::LostCleared { .. }
            | AutopilotEvent::ClearRefused { .. }
            | AutopilotEvent::FenceBreached
            | AutopilotEvent::OffLine(_)
            | AutopilotEvent::State(State::Silent | State::Blind) => {
                warn!("autopilot: {}", event);
            }
            _ => info!("autopilot: {}", event),
        }
    }
}
